r"""
The best damper, without a sweep for each candidate
===================================================

A friction damper that is pressed too lightly takes no energy, one that is pressed too hard sticks and takes none either.
Between them lies an optimum. The usual way to find it is a frequency sweep for each candidate. This example follows the
resonance peak itself: one sweep finds the first peak, and a few Newton steps lead from each peak to the next.

The blade is that of Griffin (1980) as one mass on a spring, its damper a Jenkins element.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %%
# Unit mass, unit spring and a dashpot of 0.02; damper spring 0.5, sliding at a limit that is to be chosen.

blade = ss.model.lumped(np.eye(1), np.eye(1), 0.02 * np.eye(1), names=("mass",))
damper = ss.Contact(between=("blade.mass", "ground"), law=ss.Jenkins(k_t=0.5, limit=2.0), acts="tangential")
model = ss.Model(
    parts={"blade": ss.Part(structure=blade)},
    contacts={"damper": damper},
    loads={"shaker": ss.Load(on="blade.mass", newton=0.1)},
)
ends = (0.8 / (2 * np.pi), 1.4 / (2 * np.pi))

# %%
# Peaks for thirty limits, by both conditions: where the response has a horizontal tangent, and where the blade lags the
# force by 90°. The second is cheaper, and here gives nearly the same.

limits = np.geomspace(2.0, 0.02, 30)
peaks = {}
figure, axes = plt.subplots(layout="constrained")
for by, style in (("horizontal_tangent", "-"), ("phase_quadrature", "--")):
    found = model.resonance(parameter="limit", values=limits, frequency_hz=ends, by=by, harmonics=5, peaks=1)
    peaks[by] = found["resonance"].isel(case=0, peak=0)
    axes.loglog(peaks[by].value, peaks[by].amplitude, style, label=by.replace("_", " "))
tops = peaks["horizontal_tangent"]
best = tops.isel(point=int(np.argmin(tops.amplitude.values)))
lower = 1.0 - peaks["phase_quadrature"].amplitude.values / tops.amplitude.values
print(
    f"smallest peak: {float(best.amplitude):.5f} m at {float(best.frequency_hz):.5f} Hz with a limit of {float(best.value):.4f} N"
)
print(f"in quadrature the amplitude is up to {100 * lower.max():.2g} % lower")
axes.plot(best.value, best.amplitude, "o", label="smallest peak")
axes.set(xlabel="slip limit, N", ylabel="peak amplitude, m", title="Damper optimisation curve")
axes.legend()
assert abs(float(best.value) / 0.139 - 1.0) < 0.1

# %%
# The peaks lie on the tops of the responses that sweeps give.

figure, axes = plt.subplots(layout="constrained")
for limit in (0.03, 0.06, float(best.value), 0.3, 1.0):
    own = replace(damper, law=ss.Jenkins(k_t=0.5, limit=limit))
    swept = replace(model, contacts={"damper": own})
    keys = {"high": 5, "selection": "always_high", "stability": "off"}
    data = swept.forced_response(ends, **keys)["forced_response"].sortby("frequency_hz")
    axes.semilogy(data.frequency_hz, data.amplitude.isel(output=0), label=f"limit {limit:.3g} N")
axes.plot(tops.frequency_hz, tops.amplitude, "k:", label="tracked peaks")
axes.plot(best.frequency_hz, best.amplitude, "ko")
axes.set(xlabel="frequency, Hz", ylabel="amplitude, m", title="Responses and their peaks")
axes.legend()
plt.show()
