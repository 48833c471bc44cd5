"""Harmonic balance of motions with two frequencies: ``q(t) = Re Σ Q_jk e^{i(jω1 + kω2)t}``, with the static term.

Each combined frequency has its own condensed dynamic stiffness. Contacts have memory, and time advances both phases at once, along the
characteristic ``θ1 = ω1 t, θ2 = ω2 t + φ`` of the torus. If ``ω2 / ω1`` is approximated by a ratio of integers q / p, a characteristic
closes after p turns of the first phase and q of the second. Its samples are those of one long period: the contact state and its
derivatives are marched along them without interpolation, so that the Jacobian is exact for the discrete equations. If it closes after
only a few turns, several parallel characteristics are used. The Jacobian has the structure of a harmonic-balance Jacobian, with combined
frequencies in place of harmonics, and is kept as products where that costs less.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, gcd
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.addresses import law_address
from stickslip.contact.compiled import CompiledContacts, MarchedLaws
from stickslip.contact.interface import Interface, SparseRows, add_contact_jacobian, sparse_rows
from stickslip.contact.march import period_march
from stickslip.errors import input_error
from stickslip.harmonic.balance import JacobianForm, check_retained
from stickslip.harmonic.costs import linear_costs, products_pay
from stickslip.harmonic.harmonic_set import Harmonics, to_complex, to_real
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.structured import StructuredJacobian

Indices = tuple[tuple[int, int], ...]  # (0, 0) first, then one of each pair (j, k), (-j, -k)

TURNS_A_HARMONIC, LEAST_TURNS = 4, 24
SAMPLES_A_HARMONIC, LEAST_SAMPLES = 8, 48  # per turn of the faster phase
SLIP = 2e-3  # largest error of the second phase, rad per turn: ten times as much changes forces by some thousandths
EXACT = 1e-6  # rad per turn: below this error, a ratio counts as a ratio of integers
LONG = 4  # times the usual number of turns, for a path through a whole slow beat


@dataclass(frozen=True)
class TorusPath:
    """Samples on a torus.

    Parameters
    ----------
    turns
        Turns of the first and second phase after which a characteristic closes; they have no common divisor.
    ways
        Number of parallel characteristics.
    samples
        Number of samples on each characteristic.
    """

    turns: tuple[int, int]
    ways: int
    samples: int

    @property
    def ratio(self) -> float:
        """Rational approximation of ω2 / ω1 for the contacts."""
        return self.turns[1] / self.turns[0]

    def phases(self, way: int) -> tuple[FloatArray, FloatArray]:
        """Return the (samples,) phases along a characteristic."""
        along = 2.0 * np.pi * np.arange(self.samples) / self.samples
        offset = 2.0 * np.pi * way / (self.ways * self.turns[0])
        return self.turns[0] * along, self.turns[1] * along + offset

    def slip(self, ratio: float) -> float:
        """Return the error of the second phase per turn of the first, rad."""
        return 2.0 * np.pi * abs(ratio - self.ratio)


def half_plane(order: int) -> Indices:
    """Return the indices (j, k) of combined frequencies ``j ω1 + k ω2`` with ``|j| + |k|`` up to `order`.

    Only one of (j, k) and (-j, -k) is returned.

    Raises
    ------
    InputError
        If the order is below 1.
    """
    if order < 1:
        raise input_error("harmonics", f"is {order}", "Keep at least the two frequencies: 1.")
    first = [(j, 0) for j in range(1, order + 1)]
    rest = [
        (j, k) for k in range(1, order + 1) for j in sorted(range(k - order, order - k + 1), key=lambda v: (abs(v), -v))
    ]
    return ((0, 0), *first, *rest)


def closed_path(ratio: float, order: int, refine: float = 1.0) -> TorusPath:
    """Return the shortest path with a rational approximation of `ratio`, ω2 / ω1.

    Parameters
    ----------
    ratio
        ω2 / ω1, above zero.
    order
        Largest sum of harmonics.
    refine
        Factor on the usual number of turns, and of samples per turn.
    """
    least = ceil(refine * max(TURNS_A_HARMONIC * order, LEAST_TURNS))
    choices = [(p, q) for p in range(1, 2 * least) for q in (max(1, round(ratio * p)),) if gcd(p, q) == 1]
    off = [2.0 * np.pi * abs(ratio - q / p) for p, q in choices]
    near = [i for i, slip in enumerate(off) if slip <= SLIP]
    p, q = choices[near[0] if near else int(np.argmin(off))]
    if p < least and 2.0 * np.pi * abs(ratio - q / p) > EXACT:
        p, q = _through_beat(ratio, least)
    a_turn = ceil(refine * max(SAMPLES_A_HARMONIC * order, LEAST_SAMPLES) * max(1.0, ratio))
    return TorusPath((p, q), ceil(least / p), p * a_turn)


def _through_beat(ratio: float, least: int) -> tuple[int, int]:
    """Return the turns of one long characteristic for a ratio close to a ratio of small integers.

    Parallel characteristics would have separate sliders, but a slider that sticks in one part of the beat keeps the
    state from another part. Thus one characteristic must pass through the whole beat.
    """
    turns = range(least, LONG * least)
    choices = [(p, q) for p in turns for q in {max(1, int(ratio * p)), int(ratio * p) + 1} if gcd(p, q) == 1]
    return min(choices, key=lambda c: abs(ratio - c[1] / c[0]))


@lru_cache(maxsize=64)
def torus_basis(path: TorusPath, indices: Indices, way: int) -> FloatArray:
    """Return (samples, m) values of ``1, cos(jθ1 + kθ2), sin(jθ1 + kθ2), ...`` along a characteristic."""
    first, second = path.phases(way)
    basis = np.ones((path.samples, 2 * len(indices) - 1))
    for place, (j, k) in enumerate(indices[1:]):
        angle = j * first + k * second
        basis[:, 1 + 2 * place], basis[:, 2 + 2 * place] = np.cos(angle), np.sin(angle)
    return basis


def torus_rates(basis: FloatArray, frequencies: FloatArray) -> FloatArray:
    """Return the time derivative of a basis whose functions have the `frequencies` (one per index, rad/s)."""
    rates = np.zeros_like(basis)
    rates[:, 1::2] = -frequencies[1:] * basis[:, 2::2]
    rates[:, 2::2] = frequencies[1:] * basis[:, 1::2]
    return rates


MAX_DENSE_UNKNOWNS = 4000  # largest size of a dense Jacobian: 128 MB


@dataclass(frozen=True, eq=False)
class TorusSide:
    """A condensed structure or wheel with two excitation frequencies.

    Parameters
    ----------
    first, second
        Dynamic stiffness with the loads of each frequency; the static load is part of `first`.
    waves
        Wave numbers of both frequencies and number of sectors of a tuned wheel; None: one structure for all
        frequencies.
    still
        Dynamic stiffness without a load, by wave number modulo the sectors; 0 for one structure.
    """

    first: DynamicStiffness
    second: DynamicStiffness
    still: Mapping[int, DynamicStiffness]
    waves: tuple[int, int, int] | None = None

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return self.first.n

    def wave(self, j: int, k: int) -> int:
        """Return the wave number of a combined frequency."""
        if self.waves is None:
            return 0
        first, second, sectors = self.waves
        return (j * first + k * second) % sectors

    def stiffness(
        self, indices: Indices, omegas: tuple[float, float], rate: float = 0.0
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the (len, n, n) dynamic stiffness at each combined frequency and its derivative by that frequency.

        Parameters
        ----------
        indices
            Indices of the combined frequencies.
        omegas
            ω1 and ω2, rad/s.
        rate
            Rate of a mass-proportional damping, 1/s, which is subtracted at all combined frequencies that contain the
            second one.
        """
        return _stiffness(self, indices, omegas, rate)

    def load(self, indices: Indices, omegas: tuple[float, float]) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return the (len, n) condensed load at each combined frequency and its derivatives by ω1 and ω2."""
        out = np.zeros((3, len(indices), self.n), dtype=complex)
        top = max(max(abs(j), abs(k)) for j, k in indices)
        one, two = self.first.condensed(omegas[0], top), self.second.condensed(omegas[1], top)
        for place, (j, k) in enumerate(indices):
            if k == 0:
                out[0, place], out[1, place] = one.load[j], one.load_derivative[j]
            elif j == 0:
                out[0, place], out[2, place] = two.load[k], two.load_derivative[k]
        return out[0], out[1], out[2]

    def recover(self, indices: Indices, omegas: tuple[float, float], q: ComplexArray) -> ComplexArray:
        """Return the (len, n_all) motion of all dofs from the motion of the retained coordinates (len, n)."""
        top = max(max(abs(j), abs(k)) for j, k in indices)
        own: list[ComplexArray | None] = [None] * len(indices)
        for linear, omega, places in (
            (self.first, omegas[0], {j: p for p, (j, k) in enumerate(indices) if k == 0}),
            (self.second, omegas[1], {k: p for p, (j, k) in enumerate(indices) if j == 0 and k}),
        ):
            rows = np.zeros((top + 1, self.n), dtype=complex)
            for h, place in places.items():
                rows[h] = q[place]
            full = linear.recover(omega, rows)
            for h, place in places.items():
                own[place] = full[h]
        for place, (j, k) in enumerate(indices):
            if own[place] is None:
                omega = j * omegas[0] + k * omegas[1]
                wave = self.wave(j, k) if omega >= 0.0 else self.wave(-j, -k)
                row = q[place] if omega >= 0.0 else q[place].conj()
                rows = np.stack([np.zeros_like(row), row])
                found = self.still[wave].recover_change(abs(omega), rows)[1]
                own[place] = found if omega >= 0.0 else found.conj()
        return np.array(own)


@dataclass(frozen=True, eq=False)
class CombinedProducts:
    """Products with one matrix per combined frequency; their harmonics are positions of combined frequencies.

    Parameters
    ----------
    stiffness
        (k, n, n) dynamic stiffness of each combined frequency, the static one first, N/m.
    """

    stiffness: ComplexArray

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.stiffness.shape[1])

    @property
    def harmonics(self) -> Harmonics:
        """Positions of the combined frequencies."""
        return tuple(range(len(self.stiffness)))

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness."""
        return isinstance(other, CombinedProducts) and self.stiffness is other.stiffness

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return to_real((self.stiffness @ to_complex(rows)[:, :, None])[..., 0])

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the product of the `rows` with the transpose of the real form of Z, which is the real form of Zᴴ."""
        return to_real((to_complex(rows).conj()[:, None, :] @ self.stiffness)[:, 0].conj())

    def block(self, harmonic: int) -> ComplexArray:
        """Return a copy of the matrix at a position, (n, n) in Fortran order."""
        return np.array(self.stiffness[harmonic], order="F")


@dataclass(frozen=True, eq=False)
class TorusForces:
    """Contact forces over the torus.

    Parameters
    ----------
    coefficients
        (m, 3 n_contacts) coefficients of the forces, N.
    blocks
        (n_contacts, P, m, m) derivatives by the coefficients of the gaps, N/m.
    beyond
        (m', 3 n_contacts) coefficients at additional combined frequencies, N.
    rates
        Whether a force depends on velocity.
    unsettled
        Number of contacts whose state did not become periodic on a characteristic.
    """

    coefficients: FloatArray
    blocks: FloatArray
    beyond: FloatArray
    rates: bool
    unsettled: int


@dataclass(frozen=True, eq=False)
class TorusLinearisation:
    """Residual and derivatives at one state, all scaled."""

    residual: FloatArray
    jac: FloatArray | StructuredJacobian
    by_first: FloatArray
    by_second: FloatArray
    seconds_contact: float
    unsettled: int

    def dense_jac(self) -> FloatArray:
        """Return the Jacobian as an array."""
        return self.jac if isinstance(self.jac, np.ndarray) else self.jac.dense()


@dataclass(frozen=True, eq=False)
class TorusBalance:
    """The periodic problem of two frequencies; build it with `torus_balance`.

    Unknowns are the real coefficients of each index, index-major: ``[Q_00, C_10, S_10, ...]`` with ``Q = C - iS``, over
    `displacement_scale`.
    """

    side: TorusSide
    interface: Interface
    compiled: CompiledContacts
    rows: SparseRows
    indices: Indices
    displacement_scale: float
    force_scale: float
    jacobian: JacobianForm = "auto"

    @property
    def structured(self) -> bool:
        """Whether the Jacobian is given by its products."""
        derivatives = self.compiled.n_contacts * self.compiled.pairs * self.n_rows**2
        pays = products_pay(linear_costs(self.side.n, len(self.indices), derivatives))
        return pays if self.jacobian == "auto" else self.jacobian == "structured"

    @property
    def order(self) -> int:
        """Largest sum of harmonics."""
        return max(abs(j) + abs(k) for j, k in self.indices)

    @property
    def n_rows(self) -> int:
        """Number of real coefficients per coordinate."""
        return 2 * len(self.indices) - 1

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.n_rows * self.side.n

    def coefficients(self, x: FloatArray) -> ComplexArray:
        """Return the (len(indices), n) coefficients of unknowns, m."""
        return to_complex(x.reshape(self.n_rows, self.side.n)) * self.displacement_scale

    def unknowns(self, coefficients: ComplexArray) -> FloatArray:
        """Return the unknowns of coefficients."""
        return to_real(coefficients).reshape(-1) / self.displacement_scale

    def with_indices(self, indices: Indices) -> "TorusBalance":
        """Return the same problem with other combined frequencies."""
        # a new `SparseRows` object: solvers share preconditioners between Jacobians with the same one
        return replace(self, indices=indices, rows=replace(self.rows))

    def from_other(self, other: "TorusBalance", x: FloatArray) -> FloatArray:
        """Return the unknowns of a motion that was computed with other indices."""
        known = dict(zip(other.indices, other.coefficients(x), strict=True))
        none = np.zeros(self.side.n, dtype=complex)
        return self.unknowns(np.array([known.get(index, none) for index in self.indices]))

    def forces(
        self, x: FloatArray, omegas: tuple[float, float], path: TorusPath, more: Indices = ((0, 0),)
    ) -> TorusForces:
        """Return the contact forces on the torus, also at the additional combined frequencies `more`."""
        gaps = self.rows.gaps(x.reshape(self.n_rows, self.side.n) * self.displacement_scale)
        frequencies = self.frequencies(omegas)
        n, m, pairs = self.compiled.n_contacts, self.n_rows, self.compiled.pairs
        coefficients, blocks = np.zeros((m, n, 3)), np.zeros((n, pairs, m, m))
        beyond = np.zeros((2 * len(more) - 1, n, 3))
        unsettled, rates = 0, False
        for way in range(path.ways):
            basis = torus_basis(path, self.indices, way)
            slope = torus_rates(basis, frequencies)
            for laws in self.compiled.marched:
                force, own, late, rated = _marched(laws, gaps.reshape(m, n, 3), (basis, slope), omegas[0], pairs)
                coefficients[:, laws.contacts] += _analysed(force, basis) / path.ways
                wider = torus_basis(path, more, way)
                beyond[:, laws.contacts] += _analysed(force, wider) / path.ways
                blocks[laws.contacts] += own / path.ways
                unsettled, rates = unsettled + late, rates or rated
        if self.compiled.weights is not None:
            coefficients *= self.compiled.weights[:, None]
            beyond *= self.compiled.weights[:, None]
            blocks *= self.compiled.weights[:, None, None, None]
        return TorusForces(coefficients.reshape(m, -1), blocks, beyond.reshape(len(beyond), -1), rates, unsettled)

    def frequencies(self, omegas: tuple[float, float]) -> FloatArray:
        """Return the combined frequencies, rad/s; some may be below zero."""
        return np.asarray(np.array(self.indices, dtype=float) @ np.array(omegas))

    def linearise(
        self, x: FloatArray, omegas: tuple[float, float], path: TorusPath, rate: float = 0.0
    ) -> TorusLinearisation:
        """Return residual and derivatives at unknowns `x`; `rate` as in `TorusSide.stiffness`."""
        start = perf_counter()
        forces = self.forces(x, omegas, path)
        seconds = perf_counter() - start
        factor = self.displacement_scale / self.force_scale
        stiffness, slopes = self.side.stiffness(self.indices, omegas, rate)
        load, load_first, load_second = self.side.load(self.indices, omegas)
        jac = StructuredJacobian(CombinedProducts(stiffness), forces.blocks, self.rows, factor)
        q = self.coefficients(x)[:, :, None]
        residual = to_real((stiffness @ q)[..., 0] - load)
        self.rows.add_forces(forces.coefficients, residual)
        j, k = np.array(self.indices, dtype=float).T[:, :, None]
        moved = (slopes @ q)[..., 0]
        by = [to_real(j * moved - load_first), to_real(k * moved - load_second)]
        if forces.rates:
            for place in range(2):
                self.rows.add_forces(self._by_rate(x, omegas, path, place), by[place])
        scale = self.force_scale
        return TorusLinearisation(
            residual.reshape(-1) / scale,
            jac if self.structured else jac.dense(),
            by[0].reshape(-1) / scale,
            by[1].reshape(-1) / scale,
            seconds,
            forces.unsettled,
        )

    def left_out(self, x: FloatArray, omegas: tuple[float, float], path: TorusPath, more: Indices) -> ComplexArray:
        """Return the (len(more), n) motion, m, due to contact forces at neglected combined frequencies; 0 at (0, 0).

        The contact stiffness is taken from the first frequency.
        """
        forces = self.forces(x, omegas, path, more)
        out = np.zeros((2 * len(more) - 1, self.side.n))
        self.rows.add_forces(forces.beyond, out)
        stiffness, _ = self.side.stiffness(more, omegas)
        against = np.zeros((self.side.n, self.side.n), order="F")
        cos = forces.blocks[:, :, 1:3, 1:3].diagonal(axis1=2, axis2=3).mean(axis=2)
        add_contact_jacobian(
            np.ascontiguousarray(cos[:, :, None, None]), self.rows.columns, self.rows.values, self.side.n, 1.0, against
        )
        moved = np.zeros((len(more), self.side.n), dtype=complex)
        right = to_complex(out)
        moved[1:] = np.linalg.solve(stiffness[1:] + against, -right[1:, :, None])[..., 0]
        return moved

    def by_damping(self, x: FloatArray, omegas: tuple[float, float], rate: float, step: float) -> FloatArray:
        """Return the derivative of the residual by `rate`, by a central difference of the linear side."""
        q = self.coefficients(x)[:, :, None]
        ends = [self.side.stiffness(self.indices, omegas, rate + s)[0] for s in (-step, step)]
        change = ((ends[1] - ends[0]) @ q)[..., 0] / (2.0 * step)
        return np.asarray(to_real(change).reshape(-1) / self.force_scale)

    def _by_rate(self, x: FloatArray, omegas: tuple[float, float], path: TorusPath, place: int) -> FloatArray:
        """Return the derivative of contact-force coefficients by a frequency, for forces that depend on velocity."""
        step = 1e-5 * omegas[place]
        ends = []
        for sign in (-1.0, 1.0):
            moved = list(omegas)
            moved[place] += sign * step
            ends.append(self.forces(x, (moved[0], moved[1]), path).coefficients)
        return np.asarray((ends[1] - ends[0]) / (2.0 * step))


def torus_balance(side: TorusSide, interface: Interface, order: int) -> TorusBalance:
    """Set up the balance of a motion with two frequencies.

    Parameters
    ----------
    side
        Condensed structure or wheel with its loads.
    interface
        Contacts on all dofs.
    order
        Largest sum of harmonics ``|j| + |k|``.

    Raises
    ------
    InputError
        If a contact is rigid, its dofs are not retained, a load is above the order, or there are too many unknowns.
    """
    if interface.rigid:
        raise input_error(
            "quasi_periodic",
            "a contact is rigid: its force is no function of the gap",
            "Give the contacts a stiffness, such as elastic_coulomb.",
        )
    check_retained("quasi_periodic", side.first, interface)
    loads = side.first.load, side.second.load
    highest = max((h for one in loads for h, f in one.harmonics.items() if np.any(f)), default=0)
    if highest > order:
        raise input_error(
            "quasi_periodic.harmonics",
            f"is {order}, and a load acts with {highest} times its frequency",
            f"Keep {highest} or more.",
        )
    local = interface.restricted(side.first.retained)
    stiffness = local.stuck_stiffness()
    known = stiffness[stiffness > 0.0]
    typical = float(np.exp(np.mean(np.log(known)))) if known.size else 1.0
    scale = max(*(one.scale for one in loads), float(np.max(np.abs(local.resting_force()), initial=0.0)))
    if scale <= 0.0:
        raise input_error("quasi_periodic", "nothing acts on the model", "Give a load.")
    indices = half_plane(order)
    unknowns = (2 * len(indices) - 1) * side.n
    if unknowns > MAX_DENSE_UNKNOWNS:
        raise input_error(
            "quasi_periodic.harmonics",
            f"{order} make {unknowns} unknowns of {side.n} coordinates, more than {MAX_DENSE_UNKNOWNS}",
            "Keep fewer, or reduce the contacts.",
        )
    compiled = local.compiled("march")
    rows = sparse_rows(local.gap_operator)
    return TorusBalance(side, local, compiled, rows, indices, scale / typical, scale)


def _marched(
    laws: MarchedLaws, gaps: FloatArray, tables: tuple[FloatArray, FloatArray], omega: float, pairs: int
) -> tuple[FloatArray, FloatArray, int, bool]:
    """March contacts of one law class along a characteristic.

    Return forces, blocks, the number of contacts that did not settle, and whether a force depends on velocity.
    """
    basis, rates = tables
    own = gaps[:, laws.contacts]
    n, samples = own.shape[1], len(basis)
    flat = own.reshape(len(own), -1).T
    gap, velocity = (np.ascontiguousarray((flat @ t.T).reshape(n, 3, samples)) for t in tables)
    force, by_omega = np.empty_like(gap), np.empty_like(gap)
    state = np.empty((n, 2, samples), dtype=np.int64)
    blocks = np.empty((n, pairs, len(own), len(own)))
    periods = np.empty(n, dtype=np.int64)
    period_march()(
        law_address(laws.kernel),
        laws.parameters,
        laws.start,
        gap,
        velocity,
        basis,
        rates,
        omega,
        force,
        state,
        blocks,
        by_omega,
        periods,
    )
    return force, blocks, int(np.count_nonzero(periods < 0)), bool(np.any(by_omega))


def _analysed(force: FloatArray, basis: FloatArray) -> FloatArray:
    """Return the (m, n, 3) coefficients of forces (n, 3, samples)."""
    n, _, samples = force.shape
    found = (2.0 / samples) * (basis.T @ force.reshape(3 * n, samples).T)
    found[0] *= 0.5
    return np.asarray(found.reshape(-1, n, 3))


@lru_cache(maxsize=2)
def _stiffness(
    side: TorusSide, indices: Indices, omegas: tuple[float, float], rate: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return `TorusSide.stiffness`, cached: a Newton iteration at fixed frequencies needs it at every step."""
    values = np.zeros((len(indices), side.n, side.n), dtype=complex)
    slopes = np.zeros_like(values)
    values[0] = side.first.condensed(omegas[0], 0).stiffness[0]
    damped: dict[int, DynamicStiffness] = {}
    for place, (j, k) in enumerate(indices):
        if place == 0:
            continue
        omega = j * omegas[0] + k * omegas[1]
        # a negative frequency is the conjugate of a positive one that travels in the opposite direction
        wave = side.wave(j, k) if omega >= 0.0 else side.wave(-j, -k)
        linear = side.still[wave]
        if k != 0 and rate != 0.0:
            linear = damped.setdefault(wave, linear.with_mass_damping(-rate))
        part = linear.condensed(abs(omega), 1)
        values[place] = part.stiffness[1] if omega >= 0.0 else part.stiffness[1].conj()
        slopes[place] = part.derivative[1] if omega >= 0.0 else -part.derivative[1].conj()
    return values, slopes
