"""The two blades and their damper through the public API, without a study file."""

import numpy as np

import stickslip as ss

damper = ss.FlatCurvedDamper()
points, body = damper.contact_points(), damper.body()
blades = ss.model.assemble_solid(ss.model.mesh_blade_pair(ss.BladePair(), points), ss.Material())
keep = np.concatenate([blades.sets[name] for name in ("contact", "force", "output")])
blades = ss.model.rayleigh_damping(ss.craig_bampton(blades, keep, n_modes=25), 0.0075, (150.0, 300.0))
both = ss.model.join(blades=blades, damper=body.structure())

flat = ss.ElasticCoulomb(k_t=75e6, k_w=75e6, k_n=520e6 / 6, mu=0.6)
curved = ss.ElasticCoulomb(k_t=20e6 / 3, k_w=150e6, k_n=25e6 / 3, mu=0.6)
laws = tuple(flat if side == "flat" else curved for side in points.side)
nodes = both.sets["blades.contact"].reshape(-1, 3)
gaps = ss.model.gap_operator(points, nodes, both.sets["damper"], both.n, body)
contacts = ss.Interface(points.names, laws, gaps)
system = ss.System(both, contacts, outputs=both.sets["blades.output"], free=both.sets["damper"])

static, force = np.zeros(both.n), np.zeros(both.n, dtype=complex)
static[both.sets["damper"][2]] = 442.0  # N, centrifugal load on the damper
force[both.sets["blades.force"][0]] = 442.0 / 10  # N, harmonic force on blade 1
load = ss.HarmonicLoad(static, {1: force})
sweep = ss.Sweep(omega_range=(2 * np.pi * 150, 2 * np.pi * 187))
problem = ss.response.forced_problem(system, load, sweep)
for point in ss.response.accepted_points(list(ss.forced_response(system, load, sweep))):
    tip = abs(ss.response.fields(problem, point).outputs[1, 0])
    hertz, state = point.omega / (2 * np.pi), "" if point.converged else " (not converged)"
    print(f"{hertz:.2f} Hz, {point.order} harmonics: {tip * 1e6:.2f} µm{state}")
