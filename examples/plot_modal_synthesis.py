r"""
Every level of the load from one nonlinear mode
===============================================

How far a friction damper slips depends on how hard the blade is shaken, so that each level of excitation has a response of its own. A nonlinear
mode knows them all: its frequency and damping at every amplitude. This example follows the mode of the blade of Griffin (1980) once, and makes
of it the responses at ten levels, all peaks as one curve, and a run through the resonance that is too fast for it.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip.response import nonlinear_modes as modes
from stickslip.response.self_excited import stuck_modes

# %%
# Unit mass, unit spring, a dashpot of 0.02, and a damper whose spring of 0.5 slides at 0.1 N.

rows = np.array([[1.0], [0.0], [0.0]])  # the damper acts along t alone
contact = ss.Interface(("damper",), (ss.Jenkins(k_t=0.5, limit=0.1),), rows)
blade = ss.System(ss.model.lumped(np.eye(1), np.eye(1), 0.02 * np.eye(1)), contact, np.array([0]))
load = ss.HarmonicLoad(np.zeros(1), {1: np.array([0.1 + 0j])})

how = ss.response.Discretisation(order=7)
mode = stuck_modes(blade, 1)[0]
backbone = modes.nonlinear_mode(blade, ss.HarmonicLoad(np.zeros(1)), mode, 0, how)
backbone = modes.refined(backbone, load, how)
oscillator = modes.modal_oscillator(backbone, load)
print(f"{len(backbone.points)} points of the mode: {backbone.end}")

figure, axes = plt.subplots(layout="constrained")
for level in np.geomspace(0.3, 5.0, 10):
    response = modes.synthesise(oscillator, level)
    axes.semilogy(response.omega, response.amplitude, lw=1)
known = backbone.solutions
axes.semilogy([p.omega for p in known], [p.modal_amplitude for p in known], "k--", label="mode")
axes.set(xlabel="frequency, rad/s", ylabel="amplitude, m", xlim=(0.8, 1.4), ylim=(0.05, 30))
axes.legend()

# %%
# The level at which each amplitude has its peak: divided by it, the damper's optimum is the lowest point. A limit of 0.138956 N is the best
# under 0.1 N with one harmonic, so that 0.1 N is best under a level of 0.71965; with seven harmonics little changes.

curve = modes.peak_curve(oscillator, 0)
best = int(np.argmin(curve.per_load))
print(f"lowest peak per load at level {curve.level[best]:.4f}: {curve.per_load[best]:.5f} m")
assert abs(curve.level[best] / 0.71965 - 1.0) < 0.02
figure, axes = plt.subplots(layout="constrained")
axes.loglog(curve.level, curve.per_load)
axes.set(xlabel="level", ylabel="peak over level, m")

# %%
# Through the resonance in 300 s: the peak is late, and lower than the steady one.

figure, axes = plt.subplots(layout="constrained")
steady = modes.synthesise(oscillator, 2.0)
axes.plot(steady.omega, steady.amplitude, "k", label="steady")
swept = modes.Swept(ends=(0.8, 1.4), rate=0.6 / 300.0)
fast = modes.passage_through_resonance(oscillator, 2.0, swept)
axes.plot(fast.omega, fast.amplitude, label="in 300 s")
axes.set(xlabel="frequency, rad/s", ylabel="amplitude, m", xlim=swept.ends)
axes.legend()
plt.show()
