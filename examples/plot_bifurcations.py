r"""
A wheel that localises: bifurcations and the branch that leaves
===============================================================

Four equal masses in a ring, each between two elastic stops, neighbours driven against each other. Where the stops are met the motion
that all sectors share loses its stability, and a branch leaves in which two of them take nearly all of the vibration.

It uses the layers below ``ss.Model``, to show the waves of a wheel and the branch as objects of Python. With ``ss.Model`` the same is asked by ``model.forced_response(bifurcations="branches")``.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.bifurcations import bifurcations, side_branches

# %%
# The wheel as its waves: unit masses and springs, coupled by a spring of 0.03, driven by engine order 2.

SECTORS, COUPLING = 4, 0.03


def of_wave(k):
    stiffness = 1.0 + 2 * COUPLING * (1 - np.cos(2 * np.pi * k / SECTORS))
    return ss.model.lumped(np.ones(1), np.array([[stiffness]]), np.array([[0.02]]), names=("mass",))


wheel = TunedWheel({k: of_wave(k) for k in range(SECTORS)}, SECTORS, 2, harmonics=8)
stop = ss.UnilateralSpring(k_n=1.0, initial_gap=0.1)
gaps = np.array([[0.0], [0.0], [1.0], [0.0], [0.0], [-1.0]])  # t, w, n of both stops
system = ss.System(wheel, ss.Interface(("above", "below"), (stop, stop), gaps), np.array([0]))
load = ss.HarmonicLoad(np.zeros(1), {1: np.array([0.008 + 0j])})

# %%
# The response that all sectors share, its bifurcations, and what leaves at the first one: every sector for itself.

sweep = ss.Sweep(omega_range=(1.0, 1.3), low=[1, 3, 5], high=[1, 3, 5], selection="always_high")
problem = ss.response.forced_problem(system, load, sweep)
points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
found = bifurcations(problem, points)
print("\n".join(found.sentences))
first = next(b for b in found.found if b.kind == "branch point")
(branch,) = side_branches(problem, first)
print(branch.sentence)

# %%
# Amplitudes of the first harmonic: of the shared motion, and of the four sectors along the branch that leaves it.

points = [p for p in points if p.stage != "peak"]
each = np.array([np.abs(p.coefficients[1]) for p in branch.points])
plt.plot([p.omega for p in points], [problem.amplitude(p) for p in points], label="all alike")
plt.plot(branch.omegas, each[:, 0], "--", label="sectors 0 and 2")
plt.plot(branch.omegas, each[:, 1], "--", label="sectors 1 and 3")
plt.plot(first.omega, first.amplitude, "ks", label="branch point")
plt.gca().set(xlabel="frequency, rad/s", ylabel="amplitude, m", title="Localised motions of a wheel")
plt.legend()
plt.show()

ratio = float((each.max(axis=1) / each.min(axis=1)).max())
print(f"leaves at {first.omega:.5f} rad/s, up to {ratio:.1f} times as large in two of the sectors")
assert abs(first.omega - 1.02115) < 1e-4
assert ratio > 10.0
