"""Sets of harmonics of a periodic motion (supports), and conversion between real and complex Fourier coefficients.

``q(t) = Re sum_h Q_h exp(i h ω t)``, ``Q_h = C_h - i S_h``; the real vector is harmonic-major:
``[Q_0, C_1, S_1, ...]``, no factor 1/2.
"""

import math
from collections.abc import Iterable

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error

Harmonics = tuple[int, ...]  # ascending from 0: the static term is always kept
ByDof = tuple[Harmonics, ...]  # one support per coordinate


def harmonics_of(chosen: int | Iterable[int], place: str = "harmonics") -> Harmonics:
    """Return a set of harmonics (support) from its highest harmonic, or from a list such as 1, 3, 5.

    Parameters
    ----------
    chosen
        Highest harmonic of a full set, or a list of harmonics, to which the static term is added.
    place
        Place, for messages.

    Raises
    ------
    InputError
        If an entry is not an integer, or is negative.
    """
    try:
        given = range(chosen + 1) if isinstance(chosen, (int, np.integer)) else tuple(chosen)
        whole = [int(h) for h in given]
    except (TypeError, ValueError):
        given, whole = (), [-1]
    if any(h != w for h, w in zip(given, whole, strict=False)) or min(whole, default=-1) < 0:
        raise input_error(
            place,
            f"must be the highest harmonic or a list of harmonics from 0 on, got {chosen!r}",
            "5 keeps all up to the fifth; [1, 3, 5] keeps the odd ones and the static term.",
        )
    return tuple(sorted({0, *whole}))


def multiples(harmonics: Iterable[int], highest: int) -> Harmonics:
    """Return the multiples, from 0 to `highest`, of the common divisor of `harmonics`.

    A motion with these harmonics excites no others.
    """
    step = math.gcd(*harmonics) or 1
    return tuple(range(0, highest + 1, step))


def named(harmonics: Iterable[int]) -> str:
    """Return a support as text: ``5`` if it is full up to the fifth harmonic, else ``1, 3, 5``."""
    own = [int(h) for h in harmonics if h > 0]
    if own == list(range(1, len(own) + 1)):
        return str(len(own))
    return ", ".join(map(str, own))


def is_full(harmonics: Harmonics) -> bool:
    """Whether all harmonics up to the highest are kept."""
    return len(harmonics) == harmonics[-1] + 1


def rows_of(harmonics: Harmonics) -> IntArray:
    """Return the positions of the real coefficients of a support within the full set up to its highest harmonic."""
    h = np.array(harmonics[1:], dtype=np.int64)
    return np.concatenate([[0], np.stack([2 * h - 1, 2 * h], axis=1).reshape(-1)])


def rows_among(harmonics: Harmonics, some: Iterable[int]) -> IntArray:
    """Return the positions of the real coefficients of `some` harmonics within a support that contains them."""
    chosen = set(some)
    wanted = rows_of((0, *sorted(h for h in chosen if h > 0)))[0 if 0 in chosen else 1 :]
    return np.searchsorted(rows_of(harmonics), wanted)


def real_rows(coefficients: ComplexArray, harmonics: Harmonics) -> FloatArray:
    """Return the (2 len(harmonics) - 1, ...) real rows of a support from complex `coefficients` (H+1, ...).

    Missing harmonics are zero.
    """
    whole = coefficients if len(coefficients) == harmonics[-1] + 1 else padded(coefficients, harmonics[-1])
    return to_real(whole if is_full(harmonics) else whole[list(harmonics)])


def complex_rows(rows: FloatArray, harmonics: Harmonics) -> ComplexArray:
    """Return the (highest + 1, ...) complex coefficients of the real `rows`; zeros for missing harmonics."""
    kept = to_complex(rows)
    if is_full(harmonics):
        return kept
    out = np.zeros((harmonics[-1] + 1, *rows.shape[1:]), dtype=complex)
    out[list(harmonics)] = kept
    return out


def of_all(by_dof: ByDof) -> Harmonics:
    """Return the union of the harmonics of all coordinates."""
    return tuple(sorted({h for own in by_dof for h in own}))


def joined(one: ByDof, other: ByDof) -> ByDof:
    """Return for each coordinate the union of its harmonics in two sets."""
    return tuple(tuple(sorted({*a, *b})) for a, b in zip(one, other, strict=True))


def kept_by_dof(by_dof: ByDof, harmonics: Harmonics) -> BoolArray:
    """Return whether each pair of harmonic and coordinate is kept, (len(harmonics), n)."""
    return np.array([[h in own for own in by_dof] for h in harmonics], dtype=bool)


def supports_of(kept: BoolArray, harmonics: Harmonics) -> ByDof:
    """Return the support of each coordinate from the (len(harmonics), n) kept pairs of harmonic and coordinate."""
    return tuple(tuple(h for h, own in zip(harmonics, column, strict=True) if own) for column in kept.T)


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
