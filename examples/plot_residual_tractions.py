r"""
What a contact that sticks leaves open
======================================

A contact that never slips keeps a tangential force from before: from assembly, from a spin-up, from a larger vibration that has
died. Each force within the friction cone is a steady motion. As long as all contacts stick only the mean depends on it. Where another
contact slips, the mean decides how hard that is pressed, and with it the amplitude.

The system is the wedge damper between two planar blades after Ferhatoglu and Zucca.

It uses the layers below ``ss.Model``, to show the bounds and their tractions. With ``ss.Model`` the same is asked by ``model.residual_tractions()``.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip.response.residual_tractions import confirmed, traction_bounds

# dofs x1 y1 x2 y2 of the blades, xD yD of the damper; springs and dashpots of the benchmark
mass, damping = np.diag([1.0, 1, 1, 1, 0.1, 0.1]), np.diag([20.0, 20, 20, 20, 0, 0])
stiffness = np.diag([3e5] * 4 + [0.0, 0.0])
for a, b, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
    stiffness[[a, b], [a, b]] += k
    stiffness[[a, b], [b, a]] -= k
c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
gaps = np.zeros((6, 6))  # rows t, w, n of both contacts
gaps[0, [0, 1, 4, 5]], gaps[2, [0, 1, 4, 5]] = (-c, -s, c, s), (-s, c, s, -c)
gaps[3, [2, 3, 4, 5]], gaps[5, [2, 3, 4, 5]] = (-c, s, c, -s), (s, c, -s, -c)
law = ss.ElasticCoulomb(k_t=3e5, k_w=0.0, k_n=3e5, mu=0.5)
system = ss.System(
    ss.model.lumped(mass, stiffness, damping),
    ss.Interface(("left", "right"), (law, law), gaps),
    outputs=np.array([3]),
    free=np.array([4, 5]),
)
load = ss.HarmonicLoad(np.array([0, 0, 0, 0, 0, 120.0]), {1: -1j * np.array([0, -20, 5, 0, 0, 0.0])})

# %%
# The smallest and the largest amplitude at each frequency. The left contact slips from 214 Hz on, the right one sticks.

how = ss.response.Discretisation(order=5, samples=256, evaluator="intervals")
hertz = np.linspace(205.0, 240.0, 36)
bounds = list(traction_bounds(system, load, 2 * np.pi * hertz, discretisation=how))
least, own, most = (np.array([getattr(b, name).amplitude for b in bounds]) for name in ("least", "reference", "most"))

figure, axes = plt.subplots(layout="constrained")
axes.fill_between(hertz, 1e6 * least, 1e6 * most, alpha=0.3, label="over all residual tractions")
axes.plot(hertz, 1e6 * own, "k", label="springs unstretched at zero displacement")
axes.set(xlabel="frequency, Hz", ylabel="amplitude of $y_2$, µm", title="One answer of many")
axes.legend()
plt.show()

# %%
# Literature benchmark B8 has the extremes over 25 starts at 228 Hz. Here they are those over all starts, and each is a motion: solved
# again with forces that are marched over samples, it is the same.

(at,) = (b for b, f in zip(bounds, hertz, strict=True) if f == 228.0)
for name, end in (("smallest", at.least), ("largest", at.most)):
    again = confirmed(system, load, at.omega, end, discretisation=how)
    traction = end.multipliers[1, 0]
    print(f"{name}: {end.amplitude:.6e} m with {traction:+.3f} of the limit at t = 0, again {again.resolved:.6e} m")
assert abs(at.least.amplitude - 2.725740e-5) < 5e-12
assert abs(at.most.amplitude - 4.749974e-5) < 5e-12
