"""Trigonometric polynomials in real form: values, sign changes to round-off, and integrals of products.

A polynomial of order H is given by its (2H+1,) coefficients of 1, cos τ, sin τ, ..., cos Hτ, sin Hτ. Sign changes are
found by exclusion. A cell of the period is bisected until bounds on the second and third derivative prove that it
contains no sign change or, if the polynomial is monotone in it, exactly one. Thus none is missed (Petrov & Ewins 2003
bracket the times of transition by extrema in the same way).
"""

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.cache import njit

CELLS_PER_ORDER = 8  # of the initial grid of the search; with fewer cells, more must be bisected
_NARROWEST = 1e-8  # width below which a cell is not bisected: hidden sign changes are below round-off of the polynomial
_ROUND_OFF = 4e-16
# relative to the polynomial's bound, per term of its sum: smaller values have no reliable sign and count as zero
_NOISE = 4e-16
# bisections of a cell: if a polynomial stays near zero for long, smaller parts differ only by rounding
_MOST_CUTS = 2000
_MOST_STEPS = 60
DEEPEST = 40  # waiting parts of a cell: each bisection adds one, and 30 bisections reduce 2π to 1e-8


@njit(cache=True)
def most_sign_changes(order):  # type: ignore[no-untyped-def]
    """Return the size of the array of sign changes: 2H exact ones, and spurious ones of double roots by round-off."""
    return 8 * order + 16


def search_grid(order: int) -> FloatArray:
    """Tabulate the basis on the grid of `sign_changes`.

    Parameters
    ----------
    order
        Highest harmonic.

    Returns
    -------
    FloatArray
        (2 order + 1, cells + 1); the last column repeats the first to the last bit.
    """
    cells = max(CELLS_PER_ORDER * order, 1)
    angles = np.outer(np.arange(1, order + 1), 2.0 * np.pi * (np.arange(cells + 1) % cells) / cells)
    table = np.ones((2 * order + 1, cells + 1))
    table[1::2] = np.cos(angles)
    table[2::2] = np.sin(angles)
    return table


@njit(cache=True)
def value_and_slope(polynomial, tau):  # type: ignore[no-untyped-def]
    """Return the polynomial and its derivative at `tau`."""
    c1, s1 = np.cos(tau), np.sin(tau)
    c, s = 1.0, 0.0
    value, slope = polynomial[0], 0.0
    for h in range(1, (polynomial.size + 1) // 2):
        c, s = c * c1 - s * s1, s * c1 + c * s1
        a, b = polynomial[2 * h - 1], polynomial[2 * h]
        value += a * c + b * s
        slope += h * (b * c - a * s)
    return value, slope


@njit(cache=True)
def derivative(polynomial, out):  # type: ignore[no-untyped-def]
    """Fill `out` with the coefficients of the derivative by τ."""
    out[0] = 0.0
    for h in range(1, (polynomial.size + 1) // 2):
        out[2 * h - 1] = h * polynomial[2 * h]
        out[2 * h] = -h * polynomial[2 * h - 1]


@njit(cache=True)
def bounds(polynomial):  # type: ignore[no-untyped-def]
    """Return bounds of the polynomial and of its second and third derivative."""
    zeroth, second, third = abs(polynomial[0]), 0.0, 0.0
    for h in range(1, (polynomial.size + 1) // 2):
        size = np.sqrt(polynomial[2 * h - 1] ** 2 + polynomial[2 * h] ** 2)
        zeroth += size
        second += h * h * size
        third += h * h * h * size
    return zeroth, second, third


@njit(cache=True)
def root_between(polynomial, level, left, f_left, right, f_right, guess, size, second):  # type: ignore[no-untyped-def]
    """Return the zero of ``polynomial - level`` between `left` and `right`, where it has opposite signs.

    Newton's method from `guess`, kept in the bracket by bisection, ends when the next step or the value is round-off; `size` and
    `second` bound the polynomial and its second derivative.
    """
    if f_left == 0.0 or not left < right:
        return left
    if f_right == 0.0:
        return right
    tau = guess if left < guess < right else 0.5 * (left + right)
    for _ in range(_MOST_STEPS):
        f, slope = value_and_slope(polynomial, tau)
        f -= level
        if abs(f) <= _ROUND_OFF * size:
            return tau
        if (f < 0.0) == (f_left < 0.0):
            left = tau
        else:
            right = tau
        new = tau - f / slope if slope != 0.0 else left
        if not left < new < right:
            new = 0.5 * (left + right)
            if not left < new < right:
                return tau
            tau = new
            continue
        step = new - tau
        tau = new
        # the error after a step of Newton's method is the square of the step times second / (2 slope)
        if step * step * second <= _ROUND_OFF * abs(slope):
            return tau
    return tau


@njit(cache=True)
def _guess(left, f_left, d_left, right, f_right, d_right):  # type: ignore[no-untyped-def]
    """Return the root of the cubic τ(f) through both ends of a cell in which f is monotone."""
    width = right - left
    u = -f_left / (f_right - f_left)
    a = (f_right - f_left) / d_left
    b = (f_right - f_left) / d_right
    return left + u * (a + u * ((3.0 * width - 2.0 * a - b) + u * (a + b - 2.0 * width)))


@njit(cache=True)
def sign_changes(polynomial, slope, grid, values, slopes, cells, roots):  # type: ignore[no-untyped-def]
    """Find the sign changes of a polynomial in [0, 2π], in ascending order; zero counts as positive.

    Parameters
    ----------
    polynomial, slope
        (m,) coefficients of the polynomial and of its derivative.
    grid
        From `search_grid`.
    values, slopes
        (cells + 1,) out: both on the grid.
    cells
        (40, 3) work array: parts of a cell still to be searched.
    roots
        Out: sign changes; they alternate, the first one ends the sign of ``values[0]``.

    Returns
    -------
    int
        Number of sign changes, even.
    """
    n = grid.shape[1]
    on_grid(polynomial, grid, values)
    size, second, third = bounds(polynomial)
    if second == 0.0:
        return 0
    noise = _NOISE * size * polynomial.size
    for i in range(n):
        if abs(values[i]) <= noise:
            values[i] = 0.0
    on_grid(slope, grid, slopes)
    width = 2.0 * np.pi / (n - 1)
    flat, straight = 0.125 * width * width * second, 0.125 * width * width * third
    count = 0
    for i in range(n - 1):
        f_left, f_right, d_left, d_right = values[i], values[i + 1], slopes[i], slopes[i + 1]
        changes = (f_left < 0.0) != (f_right < 0.0)
        if not changes and min(abs(f_left), abs(f_right)) > flat:
            continue
        monotone = d_left * d_right > 0.0 and min(abs(d_left), abs(d_right)) > straight
        if monotone and not changes:
            continue
        left = i * width
        right = left + width
        if not monotone:
            count = _search(
                polynomial, left, f_left, d_left, right, f_right, d_right, size, second, third, cells, roots, count
            )
        elif count == roots.size:
            count -= 1
        else:
            guess = _guess(left, f_left, d_left, right, f_right, d_right)
            roots[count] = root_between(polynomial, 0.0, left, f_left, right, f_right, guess, size, second)
            count += 1
    return count - count % 2


@njit(cache=True)
def on_grid(polynomial, grid, values):  # type: ignore[no-untyped-def]
    """Fill `values` with the polynomial on the columns of `grid`."""
    for i in range(grid.shape[1]):
        values[i] = polynomial[0]
    for j in range(1, polynomial.size):
        p = polynomial[j]
        for i in range(grid.shape[1]):
            values[i] += p * grid[j, i]


@njit(cache=True)
def _search(  # type: ignore[no-untyped-def]
    polynomial, left, f_left, d_left, right, f_right, d_right, size, second, third, cells, roots, count
):
    """Append the sign changes of one cell, bisecting it until each part provably contains at most one."""
    waiting, cuts = 0, 0
    noise = _NOISE * size * polynomial.size
    while True:
        width = right - left
        eighth = 0.125 * width * width
        changes = (f_left < 0.0) != (f_right < 0.0)
        monotone = (d_left * d_right > 0.0 and min(abs(d_left), abs(d_right)) > eighth * third) or width < _NARROWEST
        excluded = not changes and (monotone or min(abs(f_left), abs(f_right)) > eighth * second)
        if not excluded and not monotone and waiting < cells.shape[0] and cuts < _MOST_CUTS:
            cuts += 1
            middle = 0.5 * (left + right)
            f, d = value_and_slope(polynomial, middle)
            if abs(f) <= noise:
                f = 0.0
            # within rounding of zero there is no sign change to find
            if not (f_left == 0.0 and f == 0.0 and f_right == 0.0):
                cells[waiting, 0], cells[waiting, 1], cells[waiting, 2] = right, f_right, d_right
                waiting += 1
                right, f_right, d_right = middle, f, d
                continue
        if changes and count == roots.size:
            # more than the polynomial can have: the last two are due to rounding where it is flat, and cancel
            count -= 1
        elif changes:
            roots[count] = root_between(
                polynomial, 0.0, left, f_left, right, f_right, 0.5 * (left + right), size, second
            )
            count += 1
        if waiting == 0:
            return count
        waiting -= 1
        left, f_left, d_left = right, f_right, d_right
        right, f_right, d_right = cells[waiting, 0], cells[waiting, 1], cells[waiting, 2]


@njit(cache=True)
def harmonics_at(tau, out):  # type: ignore[no-untyped-def]
    """Fill both rows of `out` with cos(mτ) and sin(mτ), m = 0, 1, ..."""
    cos, sin = out[0], out[1]
    c1, s1 = np.cos(tau), np.sin(tau)
    cos[0], sin[0] = 1.0, 0.0
    for m in range(1, cos.size):
        cos[m] = cos[m - 1] * c1 - sin[m - 1] * s1
        sin[m] = sin[m - 1] * c1 + cos[m - 1] * s1


@njit(cache=True)
def add_means(left, at_left, right, at_right, factor, means):  # type: ignore[no-untyped-def]
    """Add ``factor / 2π`` times the integrals of cos(mτ) and sin(mτ) from `left` to `right`, given `harmonics_at` both."""
    factor = factor / (2.0 * np.pi)
    means[0, 0] += factor * (right - left)
    for m in range(1, means.shape[1]):
        means[0, m] += factor / m * (at_right[1, m] - at_left[1, m])
        means[1, m] += factor / m * (at_left[0, m] - at_right[0, m])


@njit(cache=True)
def product_matrix(means, out):  # type: ignore[no-untyped-def]
    """Fill `out` with W times the integral of ``b b^T`` over the intervals of `means`; W weights rows 1, 2, 2, ..."""
    cos_sum, sin_sum = means[0], means[1]
    order = (out.shape[0] - 1) // 2
    out[0, 0] = cos_sum[0]
    for k in range(1, order + 1):
        out[0, 2 * k - 1] = cos_sum[k]
        out[0, 2 * k] = sin_sum[k]
        out[2 * k - 1, 0] = 2.0 * cos_sum[k]
        out[2 * k, 0] = 2.0 * sin_sum[k]
    for h in range(1, order + 1):
        for k in range(h, order + 1):
            c_d, s_d = cos_sum[k - h], sin_sum[k - h]
            c_s, s_s = cos_sum[h + k], sin_sum[h + k]
            out[2 * h - 1, 2 * k - 1] = out[2 * k - 1, 2 * h - 1] = c_d + c_s
            out[2 * h, 2 * k] = out[2 * k, 2 * h] = c_d - c_s
            out[2 * h - 1, 2 * k] = out[2 * k, 2 * h - 1] = s_s + s_d
            out[2 * h, 2 * k - 1] = out[2 * k - 1, 2 * h] = s_s - s_d
