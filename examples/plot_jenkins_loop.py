r"""
One Jenkins element: loop, describing function and sampling
===========================================================

A spring in series with a friction slider is the smallest element of every joint in this package. Under a sinusoidal
motion its hysteresis loop is a parallelogram and its first harmonic has a closed form. This example draws the first and
compares the second with what the alternating frequency/time scheme finds from samples of one period.

It uses the layers below ``ss.Model``, to show one law and its samples.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %%
# A contact with a constant normal force: no normal stiffness, a preload of 100 N, friction 0.5.

k_t, limit = 1e7, 50.0
law = ss.ElasticCoulomb(k_t=k_t, k_w=0.0, k_n=0.0, mu=0.5, preload=100.0)
slip_at = limit / k_t  # m


def period(amplitude, samples):
    """Evaluate the contact under ``g_t = amplitude cos(tau)``."""
    gap = np.zeros((3, 3))  # rows 1, cos, sin; columns t, w, n
    gap[1, 0] = amplitude
    return ss.harmonic.contact_forces(gap, ss.contact.compile_contacts([law]), samples)


# %%
# Loops at one and a half, two and five times the displacement at which the spring begins to slip.

figure, axes = plt.subplots(layout="constrained")
for ratio in (1.5, 2.0, 5.0):
    at = period(ratio * slip_at, 512)
    axes.plot(at.gap[0, 0] * 1e6, at.force[0, 0], label=f"A = {ratio:g} slip lengths")
axes.set(xlabel="tangential gap, µm", ylabel="friction force, N", title="Hysteresis loops")
axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))

# %%
# The describing function :math:`T_1/A = k_r + i k_i`. With :math:`Q_1 = C_1 - iS_1` the imaginary part is minus the
# sine coefficient; it is positive because friction takes energy.


def closed_form(ratio: float) -> complex:
    """Griffin's describing function over k, for an amplitude of `ratio` slip lengths."""
    theta = np.arccos(1.0 - 2.0 / ratio)
    real = (theta - np.sin(2.0 * theta) / 2.0) / np.pi
    return complex(real, 4.0 / (np.pi * ratio) * (1.0 - 1.0 / ratio))


ratio = 2.5
samples = np.array([16, 32, 64, 128, 256, 512, 1024, 2048])
errors = []
for n in samples:
    first = period(ratio * slip_at, int(n)).coefficients
    found = complex(first[1, 0], -first[2, 0]) / (k_t * ratio * slip_at)
    errors.append(abs(found - closed_form(ratio)))

figure, axes = plt.subplots()
axes.loglog(samples, errors, "o-", label="sampled")
axes.loglog(samples, errors[0] * (samples[0] / samples) ** 2, ":", label="second order")
axes.set(xlabel="samples per period", ylabel="error of the describing function / k", title="Effect of sampling")
axes.legend()

# %%
# The energy lost in a cycle is the area of the loop, :math:`4\mu N (A - x_c)`, and :math:`\pi k_i A^2` at the same time.

loop = period(ratio * slip_at, 2048)
lost = np.pi * -loop.coefficients[2, 0] * ratio * slip_at
print(f"dissipated: {lost:.6e} J; closed form: {4 * limit * (ratio - 1) * slip_at:.6e} J")
plt.show()
