r"""
A shrouded wheel: friction between neighbouring blades
======================================================

The shrouds of twelve blades are cut at an angle, so that the untwist of the turning blades presses them together. An engine order shakes the wheel: at small forces the
shrouds stick, at larger ones they slip at the resonance and take energy out of it.

One sector is meshed; its travelling waves are reduced one by one and put together to a wheel with contacts at every shroud. The centrifugal load is the static load of
the contacts.
"""

import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

SECTORS, ENGINE_ORDER, SPEED = 12, 4, 2 * math.pi * 60  # rad/s

geometry = ss.BladedSector(
    sectors=SECTORS,
    platform=None,
    shroud=ss.Shroud(span=0.95, face_angle=math.radians(-30)),
    disk_size=0.03,
    platform_size=0.013,
    airfoil_size=0.02,
)
solid = ss.rotating_solid(ss.mesh_sector(geometry), ss.Material())
at_rest = ss.cyclic_sector(solid.structure, SECTORS)
structure = solid.at_speed(SPEED, tie=at_rest.tie)

# %%
# Three nodes of each shroud face carry the contacts: two corners of one side and one of the other. The i-th nodes of both faces are partners.

low, high = (structure.sets[name].reshape(-1, 3) for name in ("shroud_low", "shroud_high"))
x, y, z = structure.dofs.position[low[:, 0]].T
radius = np.hypot(x, y)
size = (radius - radius.mean()) / np.ptp(radius), z / np.ptp(z)
corners = [int(np.argmax(a * size[0] + b * size[1])) for a, b in ((1, 1), (-1, 1), (0, -1))]
tip = structure.sets["tip"][:3]
sets = {
    **structure.sets,
    "left": low[corners].ravel(),
    "right": high[corners].ravel(),
    "point": tip,
}
sector = ss.cyclic_sector(replace(structure, sets=sets), SECTORS)
wheel = ss.reduced_wheel(
    sector, np.concatenate([sets[name] for name in ("left", "right", "point")]), n_modes=6
)
free = ss.rayleigh_damping(wheel.structure, 0.001, (100.0, 1000.0))
print(f"{SECTORS} sectors of {structure.n} dofs became a wheel of {free.n}")

# %%
# Contacts between neighbours, in relative coordinates: the gaps are the only unknowns of the harmonic balance.

law = ss.ElasticCoulomb(k_t=1e5, k_w=1e5, k_n=2e5, mu=0.3)
pairs = ss.neighbour_interface(free, SECTORS, law, low="left", high="right")
relative, gaps = ss.in_relative_coordinates(free, pairs.gap_operator, pairs.names)
contacts = ss.Interface(pairs.names, pairs.laws, gaps)
system = ss.System(relative, contacts, outputs=np.arange(relative.n))

static = wheel.load(solid.centrifugal_load(SPEED)).real
force = np.zeros(structure.n)
force[tip[1]] = 1.0  # N, around the wheel
travelling = wheel.load(force, ss.excited_wave(ENGINE_ORDER, SECTORS))

# %%
# The response to two engine-order forces. All blades do the same, one after the other.

tips = np.array([free.sets[f"sector{n}.point"] for n in range(SECTORS)])
angle = 2 * math.pi * np.arange(SECTORS) / SECTORS
around = np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])


def response(newton):
    """Return frequencies in Hz and the amplitudes of all tips around the wheel, in m/N."""
    load = ss.HarmonicLoad(relative.project(static), {1: relative.project(newton * travelling)})
    sweep = ss.Sweep(
        omega_range=(2 * math.pi * 340, 2 * math.pi * 440),
        low=1,
        high=1,
        selection="always_low",
        points=10,
        peak_points=0,
    )
    problem = ss.forced_problem(system, load, sweep)
    hertz, amplitude = [], []
    for point in ss.accepted_points(list(ss.forced_response(system, load, sweep))):
        if point.converged:
            moved = relative.expand(ss.fields(problem, point).outputs[1])[tips]
            hertz.append(point.omega / (2 * math.pi))
            amplitude.append(np.abs(np.sum(moved * around, axis=1)) / newton)
    order = np.argsort(hertz)
    return np.array(hertz)[order], np.array(amplitude)[order]


figure, axis = plt.subplots(figsize=(7, 4), constrained_layout=True)
for newton in (1.0, 5.0, 20.0):
    hertz, amplitude = response(newton)
    spread = np.ptp(amplitude, axis=1).max() / amplitude.max()
    print(
        f"{newton:g} N: peak {amplitude.max():.3g} m/N, blades differ by {spread:.1e} of the peak"
    )
    axis.semilogy(hertz, 1e6 * amplitude[:, 0], ".-", label=f"{newton:g} N on each blade")
axis.set(xlabel="excitation frequency (Hz)", ylabel="tip amplitude over force (µm/N)")
axis.set_title(f"Engine order {ENGINE_ORDER} on {SECTORS} shrouded blades")
axis.legend()
plt.show()
