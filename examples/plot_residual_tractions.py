r"""
What a contact that sticks leaves open
======================================

A contact that never slips keeps a tangential force from before: from assembly, from a spin-up, from a larger vibration that has
died. Each force within the friction cone is a steady motion. As long as all contacts stick only the mean depends on it. Where another
contact slips, the mean decides how hard that is pressed, and with it the amplitude.

The system is the wedge damper between two planar blades after Ferhatoglu and Zucca.
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
load = ss.HarmonicLoad(
    np.array([0, 0, 0, 0, 0, 120.0]), {1: -1j * np.array([0, -20, 5, 0, 0, 0.0])}
)

# %%
# The smallest and the largest amplitude at each frequency. The left contact slips from 214 Hz on, the right one sticks.

how = ss.response.Discretisation(order=5, samples=256, evaluator="intervals")
hertz = np.linspace(205.0, 240.0, 36)
bounds = list(traction_bounds(system, load, 2 * np.pi * hertz, discretisation=how))
least, own, most = (
    np.array([getattr(b, name).amplitude for b in bounds]) for name in ("least", "reference", "most")
)  # fmt: skip

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
    print(f"{name}: {end.amplitude:.6e} m with {traction:+.3f} of the limit at t = 0, again {again.resolved:.6e} m")  # fmt: skip
assert abs(at.least.amplitude - 2.725740e-5) < 5e-12
assert abs(at.most.amplitude - 4.749974e-5) < 5e-12

# %%
# The band is wide where the contact that sticks carries the load which presses the one that slips. A pin is pressed against a blade with
# 0.4 N through a guide whose friction holds up to 0.36 N either way: the blade is rubbed under 0.04 to 0.76 N, and the pin does not tell.

press, holds, mu, k_t, c, force = 0.4, 0.36, 0.5, 0.5, 0.02, 0.1
gaps = np.zeros((6, 2))
gaps[0, 0], gaps[2, 1], gaps[3, 1] = 1.0, -1.0, 1.0
face = ss.ElasticCoulomb(k_t=k_t, k_w=0.0, k_n=1.0, mu=mu)
guide = ss.Jenkins(k_t=1.0, limit=holds)
pin = ss.System(
    ss.model.lumped(np.diag([1.0, 0.1]), np.diag([1.0, 0.0]), np.diag([c, 0.0])),
    ss.Interface(("face", "guide"), (face, guide), gaps),
    outputs=np.array([0]),
    free=np.array([1]),
)
load = ss.HarmonicLoad(np.array([0, press]), {1: np.array([force, 0.0 + 0.0j])})
how = ss.response.Discretisation(order=1)
omegas = np.linspace(0.94, 1.28, 18)
bounds = list(traction_bounds(pin, load, omegas, discretisation=how))
least, own, most = (
    np.array([getattr(b, name).amplitude for b in bounds]) for name in ("least", "reference", "most")
)  # fmt: skip

figure, axes = plt.subplots(layout="constrained")
axes.fill_between(omegas, least, most, alpha=0.3, label="over all forces that the guide may hold")
axes.plot(omegas, own, "k", label="guide unstretched at zero displacement")
axes.set(xlabel="frequency, rad/s", ylabel="amplitude of the blade, m", yscale="log")
axes.legend()
plt.show()

# %%
# With one harmonic a blade that is rubbed under a constant force has a closed form. Over all such forces it has the same extremes: those with
# the guide at its limit to rounding, those in between to 0.02 %.


def needed(amplitude, omega, limit):
    """Force that keeps an amplitude: the first harmonic of stick and slip."""
    turn = np.arccos(1.0 - 2.0 * np.minimum(limit / (k_t * amplitude), 1.0))
    stiffness = 1.0 - omega**2 + k_t / np.pi * (turn - np.sin(turn) * np.cos(turn))
    return amplitude * np.hypot(stiffness, c * omega + k_t / np.pi * np.sin(turn) ** 2)


limits = mu * np.linspace(press - holds, press + holds, 2001)
for i, omega in enumerate(omegas):
    below, above = np.full(limits.shape, 1e-3), np.full(limits.shape, 10.0)
    for _ in range(50):
        middle = 0.5 * (below + above)
        short = needed(middle, omega, limits) < force
        below, above = np.where(short, middle, below), np.where(short, above, middle)
    for found, exact in ((least[i], below.argmin()), (most[i], below.argmax())):
        ends = exact in (0, limits.size - 1)
        assert abs(found / below[exact] - 1.0) < (1e-9 if ends else 3e-4)
print(f"resonance between {least.max():.4f} and {most.max():.4f} m, with the guide unstretched {own.max():.4f} m")  # fmt: skip
assert most.max() > 9.0 * least.max()
