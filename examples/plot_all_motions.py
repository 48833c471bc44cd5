r"""
A motion that no sweep meets
============================

A mass on a spring that softens, then hardens. With one harmonic its motions have the amplitudes :math:`\sqrt s` of

.. math:: \left((K(s) - \omega^2)^2 + c^2\omega^2\right) s = F^2, \qquad K(s) = 1 - \tfrac32 s + \tfrac58 s^2.

A sweep meets the resonance at 0.48 m. Above it lies a closed curve, an isola: its largest amplitude is the largest root of
:math:`c^2 s\,(K - c^2/4) = F^2`.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip.response.all_motions import MotionSearch, all_motions

c, force = 0.05, 0.02
spring = ss.PolynomialSpring(along_t=(0.0, 0.0, -2.0, 0.0, 1.0))
system = ss.System(
    ss.model.lumped(np.eye(1), np.eye(1), c * np.eye(1)),
    ss.Interface(("spring",), (spring,), np.array([[1.0], [0.0], [0.0]])),
    outputs=np.array([0]),
)
load = ss.HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})

# %%
# Deflation at one frequency finds the isola, and it is followed round. Twenty random states are integrated in time.

search = MotionSearch(
    omega_range=(0.1, 1.3), at=(0.34,), harmonics=1, tries=20, starts=20, steps=128
)
found = all_motions(system, load, search)

figure, axes = plt.subplots(layout="constrained")
for branch in found.branches:
    axes.plot(branch.omega, branch.amplitude, label="isola" if branch.isola else branch.origin)
axes.set(xlabel="frequency, rad/s", ylabel="amplitude, m", title="All motions of one harmonic")
axes.legend()
plt.show()

# %%
# Where the starts end is the judge: the true motion at this low frequency has a third harmonic near the mass's own frequency, and none of
# the starts stays on the isola. With three harmonics the same search does not find it.

(at,) = found.at
for i, motion in enumerate(at.motions):
    low, high = at.basins.interval(i)
    print(f"{motion.amplitude:.4f} m, {motion.stability}: {at.basins.count(i)} starts, basin of {low:.0%} to {high:.0%}")  # fmt: skip
more = all_motions(system, load, MotionSearch(omega_range=(0.1, 1.3), at=(0.34,), harmonics=3, tries=20, starts=0))  # fmt: skip

roots = np.roots([0.625, -1.5, 1.0 - c**2 / 4, -((force / c) ** 2)])
(isola,) = found.isolas
print(f"largest amplitude {isola.peak:.5f} m, in closed form {np.sqrt(roots.real.max()):.5f} m")
assert abs(isola.peak / np.sqrt(roots.real.max()) - 1.0) < 2e-3
assert not more.isolas
assert at.basins.count(0) == 20
