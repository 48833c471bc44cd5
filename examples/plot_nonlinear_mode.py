r"""
The backbone of a blade with a friction damper
==============================================

With its amplitude the frequency of a mode falls from that of stuck contacts to that without friction, and its damping rises and falls
again. One curve tells it for all loads: the peaks of the frequency responses lie on it.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss
from stickslip.response.nonlinear_modes import ModeSweep, nonlinear_mode
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited import stuck_modes

# %%
# One mass on a spring, a dashpot of 1 % and a friction damper of half the stiffness.

structure = ss.model.lumped(np.eye(1), np.eye(1), np.array([[0.02]]))
gap = np.array([[1.0], [0.0], [0.0]])  # t, w, n
damper = ss.Jenkins(k_t=0.5, limit=0.1)
system = ss.System(structure, ss.Interface(("damper",), (damper,), gap), np.array([0]))
still = ss.HarmonicLoad(np.zeros(1))

# %%
# The mode, from half the amplitude at which the damper slips to five times that, with as many harmonics as it needs.

mode = stuck_modes(system, 1)[0]
sweep = ModeSweep(span=(0.1, 1.0), points=30, most_harmonics=15)
backbone = nonlinear_mode(system, still, mode, 0, Discretisation(order=3), sweep)
print(backbone.end)
amplitude, omega, ratio = np.array([(p.amplitude, p.omega, p.ratio) for p in backbone.points]).T

# %%
# Frequency responses to three forces, and the backbone over them.

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
peaks = []
for force in (0.02, 0.05, 0.1):
    load = ss.HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})
    swept = ss.Sweep(omega_range=(0.9, 1.4), low=[1, 3, 5], high=[1, 3, 5], selection="always_high")
    problem = ss.response.forced_problem(system, load, swept)
    points = list(ss.response.accepted_points(list(ss.forced_response(system, load, swept))))
    points.sort(key=lambda p: p.omega)
    left.plot([p.omega for p in points], [problem.amplitude(p) for p in points], label=f"{force} N")
    peak = max(points, key=problem.amplitude)
    peaks.append((problem.amplitude(peak), peak.omega, force))
left.plot(omega, amplitude, "k--", label="backbone")
left.set(xlabel="frequency, rad/s", ylabel="amplitude, m", yscale="log")
left.legend()
right.plot(amplitude, 100 * ratio)
right.set(xlabel="amplitude, m", ylabel="damping ratio, %", xscale="log")
plt.show()

for top, at, force in peaks:
    on_curve = np.interp(top, amplitude, omega)
    balance = (
        2.0 * np.interp(top, amplitude, ratio) * at**2 * top
    )  # what damping takes at resonance
    print(
        f"{force} N: peak at {at:.4f} rad/s, backbone {on_curve:.4f}; {balance:.4f} N by its damping"
    )
    assert abs(at / on_curve - 1.0) < 0.01
    assert abs(balance / force - 1.0) < 0.03
assert abs(ratio.max() - 0.0738) < 2e-4
