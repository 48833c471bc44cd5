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

# %%
# Unit mass, unit spring, a dashpot of 0.02, and a damper whose spring of 0.5 slides at 0.1 N.

blade = ss.model.lumped(np.eye(1), np.eye(1), 0.02 * np.eye(1), names=("mass",))
damper = ss.Contact(between=("blade.mass", "ground"), law=ss.Jenkins(k_t=0.5, limit=0.1), acts="tangential")
model = ss.Model(
    parts={"blade": ss.Part(structure=blade)},
    contacts={"damper": damper},
    loads={"shaker": ss.Load(on="blade.mass", newton=0.1)},
)
levels = [*np.geomspace(0.3, 5.0, 10), 2.0]
ends = (0.8 / (2 * np.pi), 1.4 / (2 * np.pi))
rate = (ends[1] - ends[0]) / 300.0
result = model.modal_synthesis(levels=levels, frequency_hz=ends, passage_hz_per_s=[rate], harmonics=7, most_harmonics=7)
found = result["modal_synthesis"].isel(case=0)

figure, axes = plt.subplots(layout="constrained")
for k in range(len(levels) - 1):
    axes.semilogy(found.frequency_hz[k], found.amplitude[k], lw=1)
axes.semilogy(found.backbone_frequency_hz, found.backbone_amplitude, "k--", label="mode")
axes.set(xlabel="frequency, Hz", ylabel="amplitude, m", xlim=ends, ylim=(0.05, 30))
axes.legend()

# %%
# The level at which each amplitude has its peak: divided by it, the damper's optimum is the lowest point.

level, size = found.resonance_level.values, found.backbone_amplitude.values
best = int(np.nanargmin(size / level))
damping = found.backbone_damping_ratio.values[best]
print(f"lowest peak per load {size[best] / level[best]:.4f} m, at level {level[best]:.3f}, damping {damping:.3f}")
figure, axes = plt.subplots(layout="constrained")
axes.loglog(level, size / level)
axes.set(xlabel="level", ylabel="peak over level, m")

# %%
# The synthesis takes the motion at the peak for a nonlinear mode: the load then meets the velocity in phase. The peak of a forced response lies
# beside that point by the order of the damping squared, which is half a per cent here. So the response at this level, with as many harmonics, has to have
# the same peak within the damping squared. The level of the optimum itself is known less well, for the curve is flat there: the response with
# one harmonic has its optimum at 0.71965 (a limit of 0.138956 N is best under 0.1 N), and two per cent of the level change the peak per load by
# a few parts in ten thousand.

shaken = ss.Load(on="blade.mass", newton=0.1 * level[best])
loaded = ss.Model(parts=model.parts, contacts=model.contacts, loads={"shaker": shaken})
forced = loaded.forced_response(frequency_hz=ends, high=7)["forced_response"]
peak = float(forced.peak_amplitude[0])
print(f"peak of the forced response at that level: {peak:.4f} m, of the mode: {size[best]:.4f} m")
assert abs(size[best] / peak - 1.0) < damping**2

# %%
# Through the resonance in 300 s: the peak is late, and lower than the steady one.

figure, axes = plt.subplots(layout="constrained")
last = len(levels) - 1
axes.plot(found.frequency_hz[last], found.amplitude[last], "k", label="steady")
axes.plot(found.passage_frequency_hz[last, 0], found.passage_amplitude[last, 0], label="in 300 s")
axes.set(xlabel="frequency, Hz", ylabel="amplitude, m", xlim=ends)
axes.legend()
plt.show()
