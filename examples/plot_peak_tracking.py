r"""
The best damper, without a sweep for each candidate
===================================================

A friction damper that is pressed too lightly takes no energy, one that is pressed too hard sticks and takes none either.
Between them lies an optimum. The usual way to find it is a frequency sweep for each candidate. This example follows the
resonance peak itself: one sweep finds the first peak, and a few Newton steps lead from each peak to the next.

The blade is that of Griffin (1980) as one mass on a spring, its damper a Jenkins element.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss


def blade(limit: float) -> ss.System:
    """Unit mass, unit spring and a dashpot of 0.02; damper spring 0.5, sliding at `limit`."""
    rows = np.array([[1.0], [0.0], [0.0]])  # the damper acts along t alone
    contact = ss.Interface(("damper",), (ss.Jenkins(k_t=0.5, limit=limit),), rows)
    one = np.eye(1)
    return ss.System(ss.model.lumped(one, one, 0.02 * one), contact, outputs=np.array([0]))


load = ss.HarmonicLoad(np.zeros(1), {1: np.array([0.1 + 0j])})
omega_range = (0.8, 1.4)
how = ss.response.Discretisation(order=5)

# %%
# Peaks for thirty limits, by both conditions: where the response has a horizontal tangent, and where the blade lags the
# force by 90°. The second is cheaper, and here gives nearly the same.

limits = np.geomspace(2.0, 0.02, 30)
peaks = {
    condition: list(
        ss.response.track_peak(
            blade(2.0), load, "limit", limits, omega_range, condition, discretisation=how
        )
    )
    for condition in ("horizontal_tangent", "phase_quadrature")
}
best = ss.response.smallest_peak(
    blade(0.1), load, "limit", (0.1, 0.2), omega_range, discretisation=how
)
print(
    f"smallest peak: {best.amplitude:.5f} at {best.omega:.5f} rad/s with a limit of {best.value:.6f}"
)

tops = peaks["horizontal_tangent"]
print(f"{tops[0].evaluations} evaluations for the first peak, sweep included")
print(f"{np.mean([p.evaluations for p in tops[1:]]):.0f} for each of the others")

quarter = peaks["phase_quadrature"]
lower = max(1.0 - q.amplitude / p.amplitude for p, q in zip(tops, quarter, strict=True))
print(f"in quadrature the amplitude is up to {100 * lower:.2g} % lower")
print(f"{np.mean([p.evaluations for p in quarter[1:]]):.0f} evaluations for each of these")

figure, axes = plt.subplots(layout="constrained")
for (condition, points), style in zip(peaks.items(), ("-", "--"), strict=True):
    axes.loglog(limits, [p.amplitude for p in points], style, label=condition.replace("_", " "))
axes.plot(best.value, best.amplitude, "o", label="smallest peak")
axes.set(xlabel="slip limit, N", ylabel="peak amplitude, m", title="Damper optimisation curve")
axes.legend()

# %%
# The peaks lie on the tops of the responses that sweeps give. The optimum was found where the exact slope of the peak
# amplitude by the limit changes its sign.

figure, axes = plt.subplots(layout="constrained")
sweep = ss.Sweep(omega_range=omega_range, low=5, selection="always_low")
for limit in (0.03, 0.06, best.value, 0.3, 1.0):
    points = list(ss.forced_response(blade(limit), load, sweep))
    points = sorted(points, key=lambda p: p.omega)
    curve = [abs(p.coefficients[1, 0]) for p in points]
    axes.semilogy([p.omega for p in points], curve, label=f"limit {limit:.3g} N")
axes.plot([p.omega for p in tops], [p.amplitude for p in tops], "k:", label="tracked peaks")
axes.plot(best.omega, best.amplitude, "ko")
axes.set(xlabel="frequency, rad/s", ylabel="amplitude, m", title="Responses and their peaks")
axes.legend()
plt.show()
