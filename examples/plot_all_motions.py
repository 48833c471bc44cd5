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

c, force = 0.05, 0.02
law = ss.PolynomialSpring(along_t=(0.0, 0.0, -2.0, 0.0, 1.0))
mass = ss.model.lumped(np.eye(1), np.eye(1), c * np.eye(1), names=("mass",))
model = ss.Model(
    parts={"body": ss.Part(structure=mass)},
    contacts={"spring": ss.Contact(between=("body.mass", "ground"), law=law, acts="tangential")},
    loads={"shaker": ss.Load(on="body.mass", newton=force)},
)

# %%
# Deflation at one frequency finds the isola, and it is followed round. Twenty random states are integrated in time.

asked = {"frequency_hz": (0.016, 0.207), "at_hz": [0.34 / (2 * np.pi)], "tries": 20, "steps": 128}
found = model.all_motions(harmonics=1, starts=20, **asked)["all_motions"].isel(case=0)

figure, axes = plt.subplots(layout="constrained")
for branch in range(found.sizes["branch"]):
    own = found.isel(branch=branch)
    name = "isola" if own.isola else str(own.origin.values)
    axes.plot(own.frequency_hz, own.amplitude, label=name)
axes.set(xlabel="frequency, Hz", ylabel="amplitude, m", title="All motions of one harmonic")
axes.legend()
plt.show()

# %%
# Where the starts end is the judge: the true motion at this low frequency has a third harmonic near the mass's own frequency, and none of
# the starts stays on the isola. With three harmonics the same search does not find it.

at = found.isel(searched=0)
for k in np.flatnonzero(at.motion_branch.values >= 0):
    one = at.isel(motion=k)
    print(
        f"{float(one.motion_amplitude):.4f} m, {one.motion_stability.values}: {int(one.motion_count)} starts, basin of {float(one.motion_share_low):.0%} to {float(one.motion_share_high):.0%}"
    )
more = model.all_motions(harmonics=3, starts=0, **asked)["all_motions"].isel(case=0)

roots = np.roots([0.625, -1.5, 1.0 - c**2 / 4, -((force / c) ** 2)])
peak = float(found.peak_amplitude[found.isola.values == 1].item())
print(f"largest amplitude {peak:.5f} m, in closed form {np.sqrt(roots.real.max()):.5f} m")
assert abs(peak / np.sqrt(roots.real.max()) - 1.0) < 2e-3
assert not np.any(more.isola.values == 1)
assert int(at.motion_count[0]) == 20
