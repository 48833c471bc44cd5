"""Spectral decomposition of the interior (Krack et al. 2017, app. 5).

Each frequency costs products with constant matrices, and no factorisation. In interior modes of unit stiffness
``D_LL(p) = 1 + p C + p² M`` with ``p = iΩ`` and diagonal M. After the static condensation of the interior
``D_NL(p) = p (c + p m)``. This gives two exact sums, in which the frequency appears only in scalar weights:

- over modes, if C is diagonal too and the columns of c are multiples of those of m (Rayleigh damping, damping by mode);
- over poles, for any other C: ``D_LL⁻¹ = Σ φ ψᵀ / (1 - p ν)`` over the 2 l state-space eigenvectors,
  ``(ν² + ν C + M) φ = 0``. No ν is infinite: coordinates without mass have ν = 0. The numerator is divided by
  ``1 - p ν``, so that residues do not depend on p.

Coriolis terms make C unsymmetric. The sum over poles then has a different c on its right, ``D_LN(p) = p (c' + p m)ᵀ``.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.harmonic.matrices import are_shares, shares_of_two
from stickslip.model.blas_threads import threads_for

# condition number of an eigenvalue above which rounding could reach 1e-10 of a receptance
ILL_CONDITIONED = 1e4


@dataclass(frozen=True, eq=False)
class StateSpace:
    """State-space eigenvectors of the interior: ``D_LL⁻¹ = forward diag(1 / (1 - p ν)) backward``."""

    nu: ComplexArray  # (J,) s, inverse poles
    forward: ComplexArray  # (l, J)
    backward: ComplexArray  # (J, l)

    def solve(self, p: complex, right: ComplexArray) -> ComplexArray:
        """Return ``D_LL⁻¹ right`` for `right` (l,) or (l, k)."""
        weight = 1.0 / (1.0 - p * self.nu)
        amplitudes = self.backward @ right
        amplitudes *= weight if right.ndim == 1 else weight[:, None]
        return np.asarray(self.forward @ amplitudes)

    def solve_each(self, p: ComplexArray, right: ComplexArray) -> ComplexArray:
        """Return ``D_LL⁻¹ right`` (k, l), each row of `right` (k, l) at its own `p` (k,).

        The eigenvectors are read once for all rows: they are far larger than a row.
        """
        return np.asarray((right @ self.backward.T / (1.0 - p[:, None] * self.nu)) @ self.forward.T)

    def solve_transposed(self, p: complex, right: ComplexArray) -> ComplexArray:
        """Return ``D_LL⁻ᵀ right`` for `right` (l, k)."""
        amplitudes = (self.forward.T @ right) / (1.0 - p * self.nu)[:, None]
        return np.asarray(self.backward.T @ amplitudes)


def state_space(damping: FloatArray, mass: FloatArray) -> StateSpace | None:
    """Return the eigenvectors of ``ν² + ν C + M`` with diagonal M.

    Parameters
    ----------
    damping
        (l, l) C in coordinates of unit stiffness.
    mass
        (l,) M, not negative.

    Returns
    -------
    StateSpace or None
        None if eigenvectors are so nearly parallel that the sum over them would be less accurate than a factorisation.
    """
    n = mass.size
    root = np.diag(np.sqrt(np.maximum(mass, 0.0)))
    # displacement, and root times displacement over ν: a normal matrix if C = 0, for any spread of frequencies
    state = np.block([[-damping, -root], [root, np.zeros((n, n))]])
    with threads_for(2 * n):
        nu, vectors = np.linalg.eig(state)
    try:
        inverse = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        return None
    condition = np.linalg.norm(inverse, axis=1) * np.linalg.norm(vectors, axis=0)
    if not np.max(condition) <= ILL_CONDITIONED:
        return None
    return StateSpace(nu.astype(complex), vectors[:n].astype(complex), inverse[:, :n].astype(complex))


Blocks = tuple[FloatArray, FloatArray, FloatArray]  # K, C, M
LARGEST_STATE_SPACE = 2000  # interior coordinates; above, the eigenproblem takes many minutes
PARALLEL = 1e-10  # largest deviation of the columns of c from multiples of those of m, relative to c
LARGEST_TABLE = 8e6  # entries of all residues together, 64 MB; above, they are multiplied at each frequency
# rounding of a sum of products with the interior modes, relative to the largest damping in a row
IN_MODES = 1e-11
FAST = 10.0  # poles below this multiple of the lowest interior frequency are slow; see `_poles`


@dataclass(frozen=True, eq=False)
class ModeTerms:
    """Sum over modes, real: ``Z = Σ_k P_k p^k - left diag(w(p)) right``.

    Here ``w = v² / d`` with ``v = p (κ + p)`` and ``d = 1 + p c + p² m``. The derivatives are ``dw/dp = v q / d²`` with
    ``q = 2 κ + (4 + κ c) p + 3 c p² + 2 m p³``, and ``d(v/d)/dp = r / d²`` with ``r = κ + 2 p + (c - κ m) p²``.
    """

    left: FloatArray  # (n, J)
    right: FloatArray  # (J, n)
    polynomial: FloatArray  # (4, n, n) P
    ratio: FloatArray  # (l,) κ
    damping: FloatArray  # (l,) c
    mass: FloatArray  # (l,) m
    symmetric: bool = True
    direct: None = None  # the load needs only ``left diag(v / d) source``

    def weights(self, powers: ComplexArray, loaded: int) -> tuple[ComplexArray, ComplexArray]:
        """Return w and dw/dp, (2, H, J), at the `powers` (H, 4) of p, and load weights at the first `loaded` ones.

        The load weights are v / d and its derivative.
        """
        d, v, q, r = powers @ self._coefficients
        inverse = 1.0 / d
        over = v * inverse
        own, first = inverse[:loaded], over[:loaded]
        return np.array([v * over, q * inverse * over]), np.array([first, r[:loaded] * own * own])

    @cached_property
    def _coefficients(self) -> ComplexArray:
        """(4, 4, J) coefficients of the powers of p in d, v, q and r."""
        kappa, c, m = self.ratio, self.damping, self.mass
        none, one = np.zeros_like(c), np.ones_like(c)
        rows = (
            (one, c, m, none),
            (none, kappa, one, none),
            (2.0 * kappa, 4.0 + kappa * c, 3.0 * c, 2.0 * m),
            (kappa, 2.0 * one, c - kappa * m, none),
        )
        return np.array(rows, dtype=complex)  # complex like `powers`: a real array would be converted in each product

    def source(self, load: ComplexArray) -> ComplexArray:
        """Return the (H, J) amplitudes of the terms under interior modal loads (H, l)."""
        return load

    @cached_property
    def table(self) -> FloatArray:
        """(4 + J, n (n + 1) / 2) upper triangles of `polynomial` and of the residues, with minus sign."""
        rows, columns = np.triu_indices(self.left.shape[0])
        residues = (self.left[rows] * self.left[columns]).T
        return np.concatenate([self.polynomial[:, rows, columns], -residues])

    def on_table(self, powers: ComplexArray, loaded: int) -> tuple[ComplexArray, ComplexArray]:
        """Return the `weights` for the rows of `table` after the polynomial, and for the load."""
        return self.weights(powers, loaded)


@dataclass(frozen=True, eq=False)
class Poles:
    """Sum over poles: like `ModeTerms`, with complex matrices and ``w = p^2a / (1 - p ν)``."""

    left: ComplexArray
    right: ComplexArray
    polynomial: FloatArray
    direct: FloatArray
    power: FloatArray  # (J,) a: 2 for fast poles, 1 for slow ones
    states: StateSpace
    symmetric: bool

    def weights(self, powers: ComplexArray, loaded: int) -> tuple[ComplexArray, ComplexArray]:
        """Return w and dw/dp, (2, H, J), at the `powers` (H, 4) of p, and load weights at the first `loaded` ones."""
        p = powers[:, 1:2]
        e = 1.0 / (1.0 - p * self.states.nu)
        w = np.where(self.power == 2, p**4, p * p) * e
        slope = w * (2.0 * self.power / p + self.states.nu * e)
        return np.array([w, slope]), self._load_weights(powers[:loaded])

    def _load_weights(self, powers: ComplexArray) -> ComplexArray:
        """Return ``v = p^a / (1 - p ν)`` and dv/dp, (2, H, J), at the `powers` (H, 4) of p."""
        p = powers[:, 1:2]
        e = 1.0 / (1.0 - p * self.states.nu)
        v = np.where(self.power == 2, p * p, p) * e
        return np.array([v, v * (self.power / p + self.states.nu * e)])

    def source(self, load: ComplexArray) -> ComplexArray:
        """Return the (H, J) amplitudes of the terms under interior modal loads (H, l)."""
        return np.asarray(load @ self.states.backward.T)

    @cached_property
    def table(self) -> FloatArray:
        """(4 + J, n (n + 1) / 2) upper triangles of `polynomial` and of the residues R, with minus sign.

        Real poles have R, pairs of poles ``2 Re R`` and ``-2 Re(ν* R)``.
        """
        rows, columns = np.triu_indices(self.left.shape[0])
        single, pair = self._single_and_pairs
        kept = np.concatenate([single, pair])
        left, right = self.left[:, kept], self.right[kept].T
        # for repeated poles only the sum of residues is symmetric; their symmetric parts have the same sum
        each = 0.5 * (left[rows] * right[columns] + left[columns] * right[rows]).T
        own, paired = each[: single.size].real, each[single.size :]
        turned = self.states.nu[pair, None].conj() * paired
        polynomial = self.polynomial[:, rows, columns]
        return np.concatenate([polynomial, -own, -2.0 * paired.real, 2.0 * turned.real])

    def on_table(self, powers: ComplexArray, loaded: int) -> tuple[ComplexArray, ComplexArray]:
        """Return the `weights` for the rows of `table` after the polynomial, and for the load.

        A pair of poles adds up to ``g (2 Re R - 2 p Re(ν* R))`` with ``g = p^2a / (1 - 2 p Re ν + p² |ν|²)``.
        """
        p = powers[:, 1:2]
        fast, sums, size, twice = self._denominators
        x, own = p.imag * size, fast.size
        inverse = 1.0 / np.subtract((1.0 - x) * (1.0 + x), p * sums, dtype=complex)
        out = np.empty((2, p.shape[0], self.power.size), dtype=complex)
        (value, turned), (slope, turned_slope) = ((a[:, :own], a[:, own:]) for a in out)
        square = (p * p).real
        np.multiply(np.where(fast, square * square, square), inverse, out=value)
        inverse *= sums - p * twice
        inverse += np.where(fast, 4.0, 2.0) / p
        np.multiply(value, inverse, out=slope)
        pairs = slice(own - turned.shape[1], own)
        np.multiply(p, value[:, pairs], out=turned)
        np.multiply(p, slope[:, pairs], out=turned_slope)
        turned_slope += value[:, pairs]
        return out, self._load_weights(powers[:loaded])

    @cached_property
    def _denominators(self) -> tuple[BoolArray, FloatArray, FloatArray, FloatArray]:
        """Return where a is 2, and s, m and 2 m² of the denominators ``1 - p s + p² m²`` of real poles and pairs."""
        single, pair = self._single_and_pairs
        nu = self.states.nu
        size = np.concatenate([np.zeros(single.size), np.abs(nu[pair])])
        sums = np.concatenate([nu.real[single], 2.0 * nu.real[pair]])
        fast = self.power[np.concatenate([single, pair])] == 2
        return fast, sums, size, 2.0 * size**2

    @cached_property
    def _single_and_pairs(self) -> tuple[IntArray, IntArray]:
        """Return the positions of real poles, and of the first pole of each conjugate pair."""
        imaginary = self.states.nu.imag
        return np.flatnonzero(imaginary == 0.0), np.flatnonzero(imaginary > 0.0)


Terms = ModeTerms | Poles


@dataclass(frozen=True, eq=False)
class Interior:
    """The condensed coordinates in modes of unit stiffness; their decompositions are computed at first use and cached."""

    nn: Blocks
    nl: Blocks
    ll: Blocks
    diagonal: bool
    ln: Blocks | None = None  # transposed blocks from retained coordinates to interior, if damping is not symmetric
    loss: Blocks | None = None

    @property
    def far(self) -> Blocks:
        """Transposed blocks from the retained coordinates to the forces on the interior."""
        return self.nl if self.ln is None else self.ln

    @cached_property
    def rayleigh(self) -> tuple[float, float] | None:
        """Rayleigh coefficients (of stiffness and mass) on the retained coordinates; None without Rayleigh damping."""
        return None if self.ln is not None else shares_of_two(*self.nn)

    @cached_property
    def rayleigh_across(self) -> tuple[float, float] | None:
        """The same coefficients if they also fit the damping across to the interior; None otherwise."""
        own = self.rayleigh
        return own if own is not None and are_shares(*own, self.nl, IN_MODES) else None

    @cached_property
    def transposed(self) -> "Interior":
        """The structure with the transposed damping."""
        nn, ll = ((k, np.ascontiguousarray(c.T), m) for k, c, m in (self.nn, self.ll))
        return Interior(nn, self.far, ll, self.diagonal, self.nl, self.loss)

    @cached_property
    def states(self) -> StateSpace | None:
        """State-space eigenvectors of the interior.

        None if the damping is diagonal or structural, the interior too large, or its eigenvectors ill-conditioned.
        """
        _, damping, mass = self.ll
        if self.diagonal or self.loss is not None or not 0 < damping.shape[0] <= LARGEST_STATE_SPACE:
            return None
        return state_space(damping, np.diagonal(mass))

    @cached_property
    def terms(self) -> Terms | None:
        """Terms of the sum for the condensed stiffness; None if no such sum exists."""
        if self.loss is not None:
            return None
        if self.diagonal:
            return _modes(self.nn, self.nl, self.ll) if self.ln is None else None
        return None if self.states is None else _poles(self, self.states)


def _statically_condensed(
    nn: Blocks, nl: Blocks, ll: Blocks, ln: Blocks | None = None
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return (3, n, n) K, C, M condensed with the static shapes of the interior, and c, m and c' (n, l)."""
    far = nl[0]
    c, m = (cross - far @ own for cross, own in zip(nl[1:], ll[1:], strict=True))
    back = c if ln is None else ln[1] - far @ ll[1].T
    whole = [nn[0] - far @ far.T]
    for near, cross, moved in zip(nn[1:], nl[1:], (back, m), strict=True):
        whole.append(near - cross @ far.T - far @ moved.T)
    return np.array(whole), c, m, back


def _modes(nn: Blocks, nl: Blocks, ll: Blocks) -> ModeTerms | None:
    whole, c, m, _ = _statically_condensed(nn, nl, ll)
    squares = np.sum(m * m, axis=0)
    ratio = np.sum(c * m, axis=0) / np.where(squares > 0.0, squares, 1.0)
    largest = np.sum(np.abs(nl[1]) + np.abs(nl[0] @ ll[1]), axis=0)
    if np.any(np.sum(np.abs(c - ratio * m), axis=0) > PARALLEL * largest):
        return None
    polynomial = np.concatenate([whole, np.zeros((1, *whole.shape[1:]))])
    return ModeTerms(m, np.ascontiguousarray(m.T), polynomial, ratio, np.diagonal(ll[1]), np.diagonal(ll[2]))


def _poles(interior: Interior, states: StateSpace) -> Poles:
    """Divide ``p² (c + p m) φ ψᵀ (c' + p m)ᵀ`` by ``1 - p ν``.

    For small ν, ``(c + p m) φ = p r + (1 - p ν) c φ`` with ``r = (ν c + m) φ``. For large ν, it is
    ``v - (1 - p ν) m φ / ν`` with ``v = (c + m / ν) φ``. In both cases, neither term is much larger than their sum at
    the frequencies of interest.
    """
    ll = interior.ll
    whole, c, m, back = _statically_condensed(interior.nn, interior.nl, ll, interior.ln)
    nu, forward, backward = states.nu, states.forward, states.backward
    slow = FAST * np.abs(nu) > np.sqrt(np.max(np.diagonal(ll[2])))
    safe = np.where(slow, nu, 1.0)
    c_left, m_left, c_right, m_right = c @ forward, m @ forward, backward @ back.T, backward @ m.T
    left = np.where(slow, c_left + m_left / safe, nu * c_left + m_left)
    right = np.where(slow, c_right.T + m_right.T / safe, nu * c_right.T + m_right.T).T
    # the remainder of the division, over (1 - p ν): c, or -m / ν
    left_rest = np.where(slow, -m_left / safe, c_left)
    right_rest = np.where(slow, -m_right.T / safe, c_right.T).T
    crossed = left @ np.where(slow[:, None], right_rest, 0.0) + left_rest @ np.where(slow[:, None], right, 0.0)
    turned = left @ np.where(slow[:, None], 0.0, right_rest) + left_rest @ np.where(slow[:, None], 0.0, right)
    square = left_rest @ right_rest
    cube = turned - (left_rest * nu) @ right_rest
    whole[2] -= (crossed + square).real
    polynomial = np.concatenate([whole, -cube.real[None]])
    return Poles(
        left,
        np.ascontiguousarray(right),
        polynomial,
        (left_rest @ backward).real,
        np.where(slow, 1.0, 2.0),
        states,
        interior.ln is None,
    )


def summed(
    terms: Terms, omega: float, order: int, source: ComplexArray, direct: ComplexArray | None
) -> tuple[ComplexArray, ComplexArray]:
    """Evaluate the sums of harmonics 0..`order` at `omega` (rad/s), which is not zero.

    Parameters
    ----------
    terms
        The terms, from `Interior.terms`.
    omega
        Frequency, rad/s.
    order
        Highest harmonic.
    source, direct
        (L + 1, J) amplitudes of the terms under the load of the interior, and (L + 1, n) its product with `Terms.direct`, of the
        harmonics that the load has.

    Returns
    -------
    matrices
        (2, order + 1, n, n) condensed stiffness and its derivative by ω.
    loads
        (2, order + 1, n) contribution of the interior's load, and its derivative by ω.
    """
    n = terms.left.shape[0]
    matrices = np.empty((2, order + 1, n, n), dtype=complex)
    matrices[0, 0], matrices[1, 0] = terms.polynomial[0], 0.0
    powers, rate = _powers(omega, order)
    loaded = min(order + 1, len(source))
    by_table = terms.symmetric and terms.left.size * (n + 1) / 2 <= LARGEST_TABLE
    weigh = terms.on_table if by_table else terms.weights
    weights, of_load = weigh(powers[0], loaded - 1)
    weights[1] *= rate
    (_tabled if by_table else _multiplied)(terms, powers, weights, matrices[:, 1:])
    loads = np.zeros((2, order + 1, n), dtype=complex)
    if loaded > 1:
        own, rate = loads[:, 1:loaded], rate[: loaded - 1]
        of_load[1] *= rate
        np.matmul(of_load * -source[1:loaded], terms.left.T, out=own)
        if direct is not None:
            own[0] -= omega * rate * direct[1:loaded]
            own[1] -= rate * direct[1:loaded]
    return matrices, loads


def _multiplied(terms: Terms, powers: ComplexArray, weights: ComplexArray, out: ComplexArray) -> None:
    """Write ``Σ_k P_k p^k - Σ w R`` and its derivative to `out` (2, H, n, n)."""
    size = terms.left.shape[1]
    scaled = (terms.left * weights[:, :, None]).reshape(-1, size)
    products = (scaled @ terms.right).reshape(out.shape)
    polynomial = powers @ terms.polynomial.reshape(4, -1)
    np.subtract(polynomial.reshape(out.shape), products, out)


def _tabled(terms: Terms, powers: ComplexArray, weights: ComplexArray, out: ComplexArray) -> None:
    """Write the same sum to `out` by one real product with the table of residues."""
    n, table = terms.left.shape[0], terms.table
    whole = np.concatenate([powers, weights], axis=2)
    rows = np.array([whole.real, whole.imag]).reshape(-1, len(table))
    full = (rows @ table).take(_places(n), axis=1).reshape(2, *out.shape)
    out.real, out.imag = full


def _powers(omega: float, order: int) -> tuple[ComplexArray, ComplexArray]:
    """Return the powers 0 to 3 of ``p = i h ω`` and their derivatives by ω, (2, H, 4), and the rates ``i h`` (H, 1)."""
    rate, powers = _rates(order)
    square = omega * omega
    of_omega = (1.0, omega, square, omega * square), (0.0, 1.0, 2.0 * omega, 3.0 * square)
    return powers * np.array(of_omega)[:, None], rate


@lru_cache(maxsize=32)
def _rates(order: int) -> tuple[ComplexArray, ComplexArray]:
    """Return ``i h`` (H, 1) and its powers 0 to 3 (H, 4)."""
    rate = 1j * np.arange(1, order + 1)[:, None]
    return rate, np.concatenate([np.ones_like(rate), rate, rate * rate, rate * rate * rate], axis=1)


@lru_cache(maxsize=8)
def _places(n: int) -> IntArray:
    """Return the (n, n) positions of the entries of a symmetric matrix in its upper triangle."""
    places = np.zeros((n, n), dtype=np.int64)
    places[np.triu_indices(n)] = np.arange(n * (n + 1) // 2)
    return np.maximum(places, places.T)
