"""Spectral decomposition of the interior: a frequency costs products with constant matrices and no factorisation (Krack et al. 2017, app. 5).

In interior modes of unit stiffness ``D_LL(p) = 1 + p C + p² M`` with ``p = iΩ`` and diagonal M, and after the static condensation of
the interior ``D_NL(p) = p (c + p m)``. Two exact sums follow, in which frequency enters through scalar weights alone:

- modes, where C is diagonal too and the columns of c are multiples of those of m (Rayleigh damping, damping by mode);
- poles, with any other C: ``D_LL⁻¹ = Σ φ ψᵀ / (1 - p ν)`` over the 2 l state-space eigenvectors, ``(ν² + ν C + M) φ = 0``. There are no
  infinite ν: coordinates without mass have ν = 0. The numerator is divided by ``1 - p ν``, so that residues do not depend on p.

Coriolis terms make C unsymmetric: the sum over poles then has another c on its right, ``D_LN(p) = p (c' + p m)ᵀ``.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray

Blocks = tuple[FloatArray, FloatArray, FloatArray]  # K, C, M
LARGEST_STATE_SPACE = 2000  # interior coordinates; beyond, the eigenproblem takes many minutes
# condition number of an eigenvalue above which rounding could reach 1e-10 of a receptance
ILL_CONDITIONED = 1e4
PARALLEL = 1e-10  # share of c by which its columns may differ from multiples of those of m
LARGEST_TABLE = 8e6  # entries of all residues together, 64 MB; beyond, they are multiplied out at each frequency
FEWEST = 200  # terms below which such a table gains nothing
FAST = (
    10.0  # lowest interior frequencies: poles below are divided out of p = 1/ν, others out of p = 0
)


@dataclass(frozen=True, eq=False)
class Sums:
    """Condensed stiffness and load of the harmonics above zero, and their derivatives by ``p = iΩ``."""

    stiffness: ComplexArray  # (H, n, n)
    slope: ComplexArray  # (H, n, n)
    load: ComplexArray  # (H, n), of the interior
    load_slope: ComplexArray  # (H, n)


@dataclass(frozen=True, eq=False)
class ModeTerms:
    """Sum over modes: real, ``Z = Σ_k P_k p^k - left diag(w(p)) right``, ``w = p² (κ + p)² / d`` with ``d = 1 + p c + p² m``."""

    left: FloatArray  # (n, J)
    right: FloatArray  # (J, n)
    polynomial: FloatArray  # (4, n, n) P
    direct: FloatArray  # (n, l); the load takes ``left diag(v(p)) source + p direct f_L``
    ratio: FloatArray  # (l,) κ
    damping: FloatArray  # (l,)
    mass: FloatArray  # (l,)
    symmetric: bool = True

    def weights(self, p: ComplexArray) -> tuple[ComplexArray, ...]:
        """Return w, dw/dp, v and dv/dp, each (H, J), at `p` (H, 1)."""
        d = 1.0 + p * self.damping + p**2 * self.mass
        d_slope = self.damping + 2.0 * p * self.mass
        v = p * (self.ratio + p) / d
        v_slope = (self.ratio + 2.0 * p - v * d_slope) / d
        return v**2 * d, v * (2.0 * v_slope * d + v * d_slope), v, v_slope

    def source(self, load: ComplexArray) -> ComplexArray:
        """Return the (H, J) amplitudes of the terms under interior modal loads (H, l)."""
        return load

    @cached_property
    def residues(self) -> FloatArray:
        """(J, n (n + 1) / 2) upper triangles of the products of columns of `left` and rows of `right`."""
        rows, columns = np.triu_indices(self.left.shape[0])
        return np.ascontiguousarray((self.left[rows] * self.left[columns]).T)

    def on_residues(self, weights: ComplexArray) -> ComplexArray:
        """Return what the `weights` (k, J) are for the rows of `residues`."""
        return weights


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

    def solve_transposed(self, p: complex, right: ComplexArray) -> ComplexArray:
        """Return ``D_LL⁻ᵀ right`` for `right` (l, k)."""
        amplitudes = (self.forward.T @ right) / (1.0 - p * self.nu)[:, None]
        return np.asarray(self.backward.T @ amplitudes)


@dataclass(frozen=True, eq=False)
class Poles:
    """Sum over poles, the same with complex matrices and ``w = p^2a / (1 - p ν)``."""

    left: ComplexArray
    right: ComplexArray
    polynomial: FloatArray
    direct: FloatArray
    power: FloatArray  # (J,) a: 2 for fast poles, 1 for slow ones
    states: StateSpace
    symmetric: bool

    def weights(self, p: ComplexArray) -> tuple[ComplexArray, ...]:
        """Return w, dw/dp, v and dv/dp, each (H, J), at `p` (H, 1)."""
        e = 1.0 / (1.0 - p * self.states.nu)
        rate = self.states.nu * e
        v = np.where(self.power == 2, p * p, p) * e
        w = v * np.where(self.power == 2, p * p, p)
        per_p = self.power / p
        return w, w * (2.0 * per_p + rate), v, v * (per_p + rate)

    def source(self, load: ComplexArray) -> ComplexArray:
        """Return the (H, J) amplitudes of the terms under interior modal loads (H, l)."""
        return np.asarray(load @ self.states.backward.T)

    @cached_property
    def residues(self) -> FloatArray:
        """(J, n (n + 1) / 2) upper triangles: real parts for real poles and one of each pair, then imaginary parts for the pairs."""
        rows, columns = np.triu_indices(self.left.shape[0])
        single, pair = self._single_and_pairs
        kept = np.concatenate([single, pair])
        left, right = self.left[:, kept], self.right[kept].T
        # only the sum of residues is symmetric where poles repeat; their symmetric parts have the same sum
        each = 0.5 * (left[rows] * right[columns] + left[columns] * right[rows]).T
        return np.concatenate([each.real, each[single.size :].imag])

    def on_residues(self, weights: ComplexArray) -> ComplexArray:
        """Return what the `weights` (k, J) are for the rows of `residues`: ``w R + w' R* = (w + w') Re R + i (w - w') Im R``."""
        single, pair = self._single_and_pairs
        first, second = weights[:, pair], weights[:, pair + 1]
        return np.concatenate([weights[:, single], first + second, 1j * (first - second)], axis=1)

    @cached_property
    def _single_and_pairs(self) -> tuple[IntArray, IntArray]:
        """Return the places of real poles and of the first one of each conjugate pair, which LAPACK puts beside each other."""
        imaginary = self.states.nu.imag
        return np.flatnonzero(imaginary == 0.0), np.flatnonzero(imaginary > 0.0)


Terms = ModeTerms | Poles


@dataclass(frozen=True, eq=False)
class Interior:
    """The condensed coordinates in modes of unit stiffness; their decompositions are made when first asked for, and kept."""

    nn: Blocks
    nl: Blocks
    ll: Blocks
    diagonal: bool
    ln: Blocks | None = None  # transposes of the blocks back, where they differ
    loss: Blocks | None = None

    @property
    def far(self) -> Blocks:
        """Transposed blocks from the retained coordinates to the forces on the interior."""
        return self.nl if self.ln is None else self.ln

    @cached_property
    def transposed(self) -> "Interior":
        """The structure with the transposed damping."""
        nn, ll = ((k, np.ascontiguousarray(c.T), m) for k, c, m in (self.nn, self.ll))
        return Interior(nn, self.far, ll, self.diagonal, self.nl, self.loss)

    @cached_property
    def states(self) -> StateSpace | None:
        """State-space eigenvectors, or None where damping is diagonal or structural, the interior too large or its eigenvectors ill-conditioned."""
        _, damping, mass = self.ll
        if (
            self.diagonal
            or self.loss is not None
            or not 0 < damping.shape[0] <= LARGEST_STATE_SPACE
        ):
            return None
        return state_space(damping, np.diagonal(mass))

    @cached_property
    def terms(self) -> Terms | None:
        """Terms of the condensed stiffness, or None where there is no such sum."""
        if self.loss is not None:
            return None
        if self.diagonal:
            return _modes(self.nn, self.nl, self.ll) if self.ln is None else None
        return None if self.states is None else _poles(self, self.states)


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
        None if eigenvectors are so nearly parallel that the sum over them would lose the digits that a factorisation keeps.
    """
    n = mass.size
    root = np.diag(np.sqrt(np.maximum(mass, 0.0)))
    # displacement and root times displacement over ν: normal if C = 0, whatever the spread of frequencies
    state = np.block([[-damping, -root], [root, np.zeros((n, n))]])
    nu, vectors = np.linalg.eig(state)
    try:
        inverse = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        return None
    condition = np.linalg.norm(inverse, axis=1) * np.linalg.norm(vectors, axis=0)
    if not np.max(condition) <= ILL_CONDITIONED:
        return None
    return StateSpace(
        nu.astype(complex), vectors[:n].astype(complex), inverse[:, :n].astype(complex)
    )


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
    damping, mass = np.diagonal(ll[1]), np.diagonal(ll[2])
    return ModeTerms(
        m, np.ascontiguousarray(m.T), polynomial, np.zeros_like(m), ratio, damping, mass
    )


def _poles(interior: Interior, states: StateSpace) -> Poles:
    """Divide ``p² (c + p m) φ ψᵀ (c' + p m)ᵀ`` by ``1 - p ν``.

    With ``(c + p m) φ = p r + (1 - p ν) c φ`` and ``r = (ν c + m) φ`` where ν is small, with ``= v - (1 - p ν) m φ / ν`` and
    ``v = (c + m / ν) φ`` where it is large: neither part is much larger than their sum at the frequencies of interest.
    """
    ll = interior.ll
    whole, c, m, back = _statically_condensed(interior.nn, interior.nl, ll, interior.ln)
    nu, forward, backward = states.nu, states.forward, states.backward
    slow = FAST * np.abs(nu) > np.sqrt(np.max(np.diagonal(ll[2])))
    safe = np.where(slow, nu, 1.0)
    c_left, m_left, c_right, m_right = c @ forward, m @ forward, backward @ back.T, backward @ m.T
    left = np.where(slow, c_left + m_left / safe, nu * c_left + m_left)
    right = np.where(slow, c_right.T + m_right.T / safe, nu * c_right.T + m_right.T).T
    # what the division leaves, (1 - p ν) times: c, or -m / ν
    left_rest = np.where(slow, -m_left / safe, c_left)
    right_rest = np.where(slow, -m_right.T / safe, c_right.T).T
    crossed = left @ np.where(slow[:, None], right_rest, 0.0) + left_rest @ np.where(
        slow[:, None], right, 0.0
    )
    turned = left @ np.where(slow[:, None], 0.0, right_rest) + left_rest @ np.where(
        slow[:, None], 0.0, right
    )
    square = left_rest @ right_rest
    cube = turned - (left_rest * nu) @ right_rest
    whole[2] -= (crossed + square).real
    polynomial = np.concatenate([whole, -cube.real[None]])
    return Poles(
        left, np.ascontiguousarray(right), polynomial, (left_rest @ backward).real,
        np.where(slow, 1.0, 2.0), states, interior.ln is None,
    )  # fmt: skip


def summed(terms: Terms, p: ComplexArray, source: ComplexArray, direct: ComplexArray) -> Sums:
    """Evaluate the sums at the harmonics above zero.

    Parameters
    ----------
    terms
        From `Interior.terms`.
    p
        (H, 1) ``ihω``, none of them zero.
    source, direct
        (H, J) amplitudes of the terms under the load of the interior, and (H, n) its product with `Terms.direct`.
    """
    n = terms.left.shape[0]
    w, w_slope, v, v_slope = terms.weights(p)
    both = _products(terms, np.concatenate([w, w_slope])).reshape(2, -1, n, n)
    powers = np.concatenate([p**k for k in range(4)], axis=1)
    slopes = np.concatenate([np.zeros_like(p), np.ones_like(p), 2.0 * p, 3.0 * p**2], axis=1)
    static = terms.polynomial.reshape(4, -1)
    stiffness = (powers @ static).reshape(-1, n, n) - both[0]
    slope = (slopes @ static).reshape(-1, n, n) - both[1]
    return Sums(
        stiffness,
        slope,
        -(v * source) @ terms.left.T - p * direct,
        -(v_slope * source) @ terms.left.T - direct,
    )


def _products(terms: Terms, weights: ComplexArray) -> ComplexArray:
    """Return ``left diag(weights) right`` for each row of `weights` (k, J)."""
    k, (n, size) = weights.shape[0], terms.left.shape
    if not terms.symmetric or size < FEWEST or size * n * (n + 1) / 2 > LARGEST_TABLE:
        scaled = (terms.left * weights[:, None, :]).reshape(k * n, size)
        return np.asarray(scaled @ terms.right).reshape(k, n, n)
    on_rows = terms.on_residues(weights)
    triangles = np.concatenate([on_rows.real, on_rows.imag]) @ terms.residues
    return np.asarray((triangles[:k] + 1j * triangles[k:])[:, _places(n)])


@lru_cache(maxsize=8)
def _places(n: int) -> IntArray:
    """Return the (n, n) places of the entries of a symmetric matrix in its upper triangle."""
    places = np.zeros((n, n), dtype=np.int64)
    places[np.triu_indices(n)] = np.arange(n * (n + 1) // 2)
    return np.maximum(places, places.T)
