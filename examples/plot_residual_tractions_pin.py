r"""
A wide band: a pin whose guide sticks
=====================================

Residual tractions matter most where the contact that sticks carries the load which presses the one that slips. A pin is pressed
against a blade with 0.4 N through a guide whose friction holds up to 0.36 N either way. The blade is rubbed under 0.04 to
0.76 N, and the pin does not tell.

It uses the layers below ``ss.Model``, to show the bounds and their tractions. With ``ss.Model`` the same is asked by ``model.residual_tractions()``.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip.response.residual_tractions import traction_bounds

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
least, own, most = (np.array([getattr(b, name).amplitude for b in bounds]) for name in ("least", "reference", "most"))

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
print(f"resonance between {least.max():.4f} and {most.max():.4f} m, with the guide unstretched {own.max():.4f} m")
assert most.max() > 9.0 * least.max()
