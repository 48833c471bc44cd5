"""Complex and real Fourier coefficients.

``q(t) = Re sum_h Q_h exp(i h ω t)``, ``Q_h = C_h - i S_h``; the real vector is harmonic-major: ``[Q_0, C_1, S_1, ...]``, no factor 1/2.
"""

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray


def to_real(coefficients: ComplexArray) -> FloatArray:
    """Return the real rows (2H+1, ...) of complex `coefficients` (H+1, ...); the imaginary part of harmonic 0 is dropped."""
    order = coefficients.shape[0] - 1
    real = np.empty((2 * order + 1, *coefficients.shape[1:]))
    real[0] = coefficients[0].real
    real[1::2] = coefficients[1:].real
    np.negative(coefficients.imag[1:], out=real[2::2])
    return real


def to_complex(real: FloatArray) -> ComplexArray:
    """Return the complex coefficients (H+1, ...) of real rows (2H+1, ...)."""
    coefficients = np.empty(((real.shape[0] + 1) // 2, *real.shape[1:]), dtype=complex)
    coefficients[0] = real[0]
    coefficients.real[1:] = real[1::2]
    np.negative(real[2::2], out=coefficients.imag[1:])
    return coefficients


def padded(coefficients: ComplexArray, order: int) -> ComplexArray:
    """Return `coefficients` (H+1, ...) with harmonics up to `order`: zeros added, or higher ones dropped."""
    out = np.zeros((order + 1, *coefficients.shape[1:]), dtype=complex)
    keep = min(order + 1, coefficients.shape[0])
    out[:keep] = coefficients[:keep]
    return out
