r"""
The nonlinear mode behind a family of resonances
================================================

A blade with a friction damper has no single natural frequency: it falls from the frequency of the stuck damper to that of the sliding
one as the amplitude grows, and in between the damper takes the most energy. The nonlinear mode tells both without any load, and the peaks
of all frequency responses lie on it.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %%
# One mass on a spring, a dashpot of 1 % and a friction damper of half the stiffness.

blade = ss.model.lumped(np.eye(1), np.eye(1), 0.02 * np.eye(1), names=("mass",))
damper = ss.Contact(between=("blade.mass", "ground"), law=ss.Jenkins(k_t=0.5, limit=0.1), acts="tangential")
model = ss.Model(
    parts={"blade": ss.Part(structure=blade)},
    contacts={"damper": damper},
    loads={"shaker": ss.Load(on="blade.mass", newton=0.1)},
)

# %%
# The mode, from half the amplitude at which the damper slips to five times that, with as many harmonics as it needs.

mode = model.nonlinear_mode(modes=[1], amplitude_mm=(100, 1000), most_harmonics=15)
curve = mode["nonlinear_mode"].isel(case=0, branch=0)
print(str(curve.end.values))
known = curve.status.values == 0
amplitude, hertz, ratio = (curve[name].values[known] for name in ("amplitude", "frequency_hz", "damping_ratio"))

# %%
# Frequency responses to three forces, and the backbone over them.

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
peaks = []
for force in (0.02, 0.05, 0.1):
    driven = replace(model, loads={"shaker": ss.Load(on="blade.mass", newton=force)})
    found = driven.forced_response((0.145, 0.22), high=5, selection="always_high", stability="off")
    data = found["forced_response"].sortby("frequency_hz")
    left.plot(data.frequency_hz, data.amplitude.isel(output=0), label=f"{force} N")
    peaks.append((float(data.peak_amplitude[0]), float(data.peak_frequency_hz[0]), force))
left.plot(hertz, amplitude, "k--", label="backbone")
left.set(xlabel="frequency, Hz", ylabel="amplitude, m", yscale="log")
left.legend()
right.plot(amplitude, 100 * ratio)
right.set(xlabel="amplitude, m", ylabel="damping ratio, %", xscale="log")
plt.show()

for top, at, force in peaks:
    on_curve = np.interp(top, amplitude, hertz)
    # what damping takes at resonance
    balance = 2.0 * np.interp(top, amplitude, ratio) * (2 * np.pi * at) ** 2 * top
    print(f"{force} N: peak at {at:.5f} Hz, backbone {on_curve:.5f}; {balance:.4f} N by its damping")
    assert abs(at / on_curve - 1.0) < 0.01
    assert abs(balance / force - 1.0) < 0.03
assert abs(ratio.max() - 0.0738) < 2e-4
