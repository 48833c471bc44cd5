"""Two blades and a friction damper without a study file: parts, contacts, loads, one question, one result."""

import stickslip as ss

damper = ss.FlatCurvedDamper()
mesh = ss.model.mesh_blade_pair(ss.BladePair(), damper.contact_points())
blades = ss.model.solid_part(mesh, ss.Material(), reduction=ss.reduction.Reduction(25), damping=ss.model.Damping(ratio=0.0075, between_hz=(150, 300)))
flat = ss.ElasticCoulomb(k_t=450e6, k_w=450e6, k_n=520e6, mu=0.6)
curved = ss.ElasticCoulomb(k_t=20e6, k_w=450e6, k_n=25e6, mu=0.6)
model = ss.Model(
    parts={"blades": blades, "damper": ss.model.damper_part(damper)},
    contacts={side: ss.Contact(between=(f"damper.{side}", f"blades.underside_{n}"), law=law, share="interface")
              for n, side, law in ((1, "flat", flat), (2, "curved", curved))},
    loads={"pull": ss.Load(on="damper", newton=442.0, direction=(0, 0, 1), harmonic=0),
           "shaker": ss.Load(on="blades.force", newton=22.1, direction=(1, 0, 0))},
    outputs=(ss.Output(name="tip1", on="blades.tip1"),), retention=1e4)
result = model.forced_response(hz=(150, 187), high=5, peak_points=12)
print(result.peaks, result.report("two_blades.html"), sep="\n")
