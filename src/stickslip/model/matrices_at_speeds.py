"""Matrices of a rotating part at several speeds, written by another program.

About the static state of a speed Ω the part obeys ``M ü + (C + Ω G) u̇ + K(Ω) u = f``. With linear elasticity and one temperature the
stiffness is ``K_0 + Ω² K_1 + Ω⁴ K_2``; with contacts inside the part, or temperatures that follow the speed, it is no polynomial.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix, as_array
from stickslip.errors import check_choice, input_error
from stickslip.model.axis import Axis
from stickslip.model.structure import Structure
from stickslip.units import RPM

Interpolation = Literal["polynomial", "pchip"]
MIN_SPEEDS = 3  # two speeds fix K_0 + Ω² K_1 and leave none to check it
DEGREE = 2  # of the stiffness in Ω²
PHYSICAL = ("x", "y", "z", "rx", "ry", "rz")
SAME_MASS_RTOL = 1e-6
SAME_CORIOLIS_RTOL = 1e-3
TRANSLATED_RTOL = (
    1e-6  # force of a translation over the sum of its parts, below which no support or removed dof is near
)
MIN_SOFTENING = 1e-3  # share of the spin softening below which there is none; a speed in rpm for one in rad/s has 0.011
WORK_RATIOS = (0.8, 1.25)  # of a static displacement, outside of which it is doubted
CONTENT_RTOL = 0.02  # deviation of the spin softening from the mass that is refused


@dataclass(frozen=True, eq=False)
class AtSpeed:
    """Matrices at one speed.

    Parameters
    ----------
    speed
        rad/s.
    structure
        Mass and stiffness with stress stiffening and spin softening. The skew part of its damping is the Coriolis matrix at this speed.
    displacement
        (n,) static displacement of this speed, m; None if unknown.
    """

    speed: float
    structure: Structure
    displacement: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class SpeedMatrices:
    """A part known at some speeds; `speed_matrices` makes one and checks it.

    Parameters
    ----------
    states
        At least three, ascending; the first at rest.
    between
        ``polynomial``: of degree two in Ω² (less with fewer speeds); ``pchip``: monotone cubic pieces in Ω² (Fritsch & Carlson 1980).
    """

    states: tuple[AtSpeed, ...]
    between: Interpolation = "polynomial"

    @property
    def rest(self) -> Structure:
        """The structure at rest."""
        return self.states[0].structure

    @property
    def speeds(self) -> FloatArray:
        """(k,) speeds, rad/s."""
        return np.array([s.speed for s in self.states])

    @property
    def has_displacements(self) -> bool:
        """Whether the static displacement of every speed is known."""
        return all(s.displacement is not None for s in self.states[1:])

    @cached_property
    def coriolis(self) -> Matrix | None:
        """(n, n) skew G of ``Ω G``, kg, from the highest speed that has one; None if none has."""
        for state in reversed(self.states):
            skew = _skew(state)
            if skew is not None:
                return skew
        return None

    def at_speed(self, speed: float, *, coriolis: bool = False) -> Structure:
        """Return the structure for small vibrations at a speed in rad/s.

        Raises
        ------
        InputError
            If the speed is above the highest known one, or the Coriolis matrix is asked for and unknown.
        """
        rest = self.rest
        if speed == 0.0:
            return rest
        self._require(speed)
        damping = rest.damping
        if coriolis:
            if self.coriolis is None:
                raise input_error(
                    "coriolis",
                    "is asked for, and the matrices at speed have no Coriolis matrix",
                    "Give at_speed a damping_matrix with it, or leave coriolis out.",
                )
            damping = damping + speed * self.coriolis
        return replace(rest, stiffness=self._stiffness(speed), damping=damping)

    def by_square(self, speed: float) -> Matrix:
        """Return the derivative of the stiffness with respect to Ω², N s²/m, at a speed in rad/s."""
        self._require(speed)
        return self._matrix(self._values.slope(speed**2))

    def static_load(self, speed: float) -> FloatArray:
        """Return the (n,) load that causes the static displacement of a speed in rad/s, N; zero without displacements."""
        if speed == 0.0 or not self.has_displacements:
            return np.zeros(self.rest.n)
        self._require(speed)
        return np.asarray(self._stiffness(speed) @ self._displacements(speed**2))

    @cached_property
    def error(self) -> float:
        """Largest error of the stiffness at a speed that is left out, over the largest change of the stiffness by the speed.

        Frobenius norms. With three speeds a straight line in Ω² stands for the polynomial.
        """
        known = self._values.known
        change = float(np.linalg.norm(known[-1] - known[0])) or 1.0
        x = self.speeds**2
        errors = []
        for left_out in range(1, len(x) - 1):
            others = np.arange(len(x)) != left_out
            there = _Interpolated(x[others], known[others], self.between)(x[left_out])
            errors.append(float(np.linalg.norm(there - known[left_out])) / change)
        return max(errors)

    def _require(self, speed: float) -> None:
        highest = self.states[-1].speed
        if not 0.0 <= speed <= highest * (1.0 + 1e-12):
            raise input_error(
                "at_speed",
                f"goes up to {highest / RPM:.6g} rpm, and {speed / RPM:.6g} rpm is asked for",
                "Write matrices at a higher speed, or narrow the range.",
            )

    def _stiffness(self, speed: float) -> Matrix:
        for state in self.states:
            if state.speed == speed:
                return state.structure.stiffness
        return self._matrix(self._values(speed**2))

    def _matrix(self, values: FloatArray) -> Matrix:
        n = self.rest.n
        if self._places is None:
            return values.reshape(n, n)
        rows, columns = np.divmod(self._places, n)
        return scipy.sparse.csr_array((values, (rows, columns)), shape=(n, n))

    @cached_property
    def _places(self) -> IntArray | None:
        """Positions ``row n + column`` of the entries that any stiffness has; None for dense matrices."""
        every = [s.structure.stiffness for s in self.states]
        if not all(scipy.sparse.issparse(k) for k in every):
            return None
        return np.unique(np.concatenate([_positions(k) for k in every]))

    @cached_property
    def _values(self) -> "_Interpolated":
        """Entries of the stiffness over Ω²."""
        every = [s.structure.stiffness for s in self.states]
        if self._places is None:
            known = np.array([as_array(k).ravel() for k in every])
        else:
            known = np.zeros((len(every), self._places.size))
            for row, k in zip(known, every, strict=True):
                row[np.searchsorted(self._places, _positions(k))] = scipy.sparse.coo_array(k).data
        return _Interpolated(self.speeds**2, known, self.between)

    @cached_property
    def _displacements(self) -> "_Interpolated":
        """Static displacements over Ω²."""
        none = np.zeros(self.rest.n)
        known = np.array([none if s.displacement is None else s.displacement for s in self.states])
        return _Interpolated(self.speeds**2, known, self.between)


@dataclass(frozen=True, eq=False)
class _Interpolated:
    """Numbers (k, m) known at the abscissae x (k,), between them."""

    x: FloatArray
    known: FloatArray
    between: Interpolation

    def __call__(self, x: float) -> FloatArray:
        """Return the (m,) numbers at x."""
        return self._at(x, 0)

    def slope(self, x: float) -> FloatArray:
        """Return the (m,) derivatives at x."""
        return self._at(x, 1)

    def _at(self, x: float, derivative: int) -> FloatArray:
        if self.between == "pchip" and len(self.x) > 1:
            curve = scipy.interpolate.PchipInterpolator(self.x, self.known, axis=0)
            return np.asarray(curve(x, derivative))
        top = float(self.x[-1]) or 1.0
        degree = min(len(self.x) - 1, DEGREE)
        powers = np.vander(self.x / top, degree + 1, increasing=True)
        at = np.array([(x / top) ** j for j in range(degree + 1)])
        if derivative:
            at = np.array([j * (x / top) ** max(j - 1, 0) / top for j in range(degree + 1)])
        return np.asarray((at @ np.linalg.pinv(powers)) @ self.known)


def speed_matrices(states: Sequence[AtSpeed], axis: Axis, *, between: Interpolation = "polynomial") -> SpeedMatrices:
    """Return a part known at some speeds, after checks of its matrices.

    Parameters
    ----------
    states
        At least three speeds in any order, one of them zero, all on the same physical dofs.
    axis
        Axis of rotation.
    between
        As in `SpeedMatrices`.

    Raises
    ------
    InputError
        If speeds are too few, dofs, masses or Coriolis matrices do not fit together, coordinates are not physical, or the stiffness
        does not hold the spin softening of the mass.
    """
    check_choice("between", between, get_args(Interpolation))
    ordered = tuple(sorted(states, key=lambda s: s.speed))
    speeds = np.array([s.speed for s in ordered])
    said = ", ".join(f"{s / RPM:.6g}" for s in speeds)
    if len(speeds) < MIN_SPEEDS or speeds[0] != 0.0 or np.any(np.diff(speeds) <= 0.0):
        raise input_error(
            "at_speed",
            f"needs matrices at rest and at two or more further speeds, got {said or 'none'} rpm",
            "Two speeds would leave none to check the stiffness between them.",
        )
    rest = ordered[0].structure
    for state in ordered:
        _check_dofs(rest, state)
    lacking = [s.speed for s in ordered[1:] if s.displacement is None]
    if 0 < len(lacking) < len(ordered) - 1:
        raise input_error(
            f"at_speed at {lacking[0] / RPM:.6g} rpm",
            "lacks the static displacement that other speeds have",
            "Give displacement at every speed, or at none.",
        )
    found = SpeedMatrices(ordered, between)
    for state in ordered[1:]:
        _check_coriolis(found, state)
        _refuse_other_content(rest, state, axis)
    return found


def warnings_of(own: SpeedMatrices, name: str, axis: Axis) -> tuple[str, ...]:
    """Return the warnings about a part known at some speeds."""
    found = []
    for state in own.states[1:]:
        place, ratio = f"{name}: at_speed at {state.speed / RPM:.6g} rpm", _work_ratio(own.rest, state, axis)
        if ratio is not None and not WORK_RATIOS[0] <= ratio <= WORK_RATIOS[1]:
            found.append(
                f"{place}: the displacement is {ratio:.3g} times what the centrifugal load of this speed causes. Is it of this speed, in "
                "the file's unit of length?"
            )
        even = state.structure.damping + state.structure.damping.T
        if _norm(even - own.rest.damping - own.rest.damping.T) > SAME_MASS_RTOL * _norm(state.structure.damping):
            found.append(
                f"{place}: the damping matrix dissipates otherwise than at rest, which is not used: the damping at rest stays."
            )
    if not own.has_displacements:
        found.append(
            f"{name}: static displacements of the speeds are not given, so that contacts get no centrifugal preload from it."
        )
    error = own.error
    if error > CONTENT_RTOL:
        what = "a straight line in the square of the speed" if len(own.states) == MIN_SPEEDS else "the other speeds"
        remedy = (
            "Give more speeds"
            if own.between == "pchip"
            else 'Give more speeds, or between = "pchip" if temperatures follow the speed'
        )
        found.append(
            f"{name}: at a speed left out the stiffness differs from {what} by {100 * error:.2g} % of its change by the speed. {remedy}."
        )
    return tuple(found)


def _refuse_other_content(rest: Structure, state: AtSpeed, axis: Axis) -> None:
    """Refuse matrices at a speed that do not hold the spin softening, or the Coriolis forces, of the mass.

    Stress stiffening does no work on translations t. Away from supports ``(K(Ω) - K(0)) t = -Ω² M P t`` holds exactly, and ``C t = 2 Ω M N
    t``; P projects on the plane of rotation, N is the product with the axis. Another factor is another unit or content. Nothing is refused
    where the digits of the files do not suffice.
    """
    moves = _translations(rest)
    if moves is None:
        return
    inside = _away_from_supports(rest, state, moves)
    held = np.asarray(rest.stiffness @ moves)
    place = f"at_speed at {state.speed / RPM:.6g} rpm"
    softened = state.speed**2 * np.asarray(rest.mass @ (moves @ axis.cross @ axis.cross))
    change = np.asarray(state.structure.stiffness @ moves) - held
    found = _apart(change[inside], softened[inside], float(np.linalg.norm(held[inside])))
    if found is not None and abs(found.share) <= MIN_SOFTENING:
        raise input_error(
            place,
            "the stiffness lacks the spin softening of the mass",
            "Write the tangent stiffness of the rotating frame, with stress stiffening and spin softening.",
        )
    if found is not None:
        raise input_error(
            place,
            f"the stiffness holds {found.share:.4g} of the spin softening that mass and speed have, and {100 * found.rest:.3g} % beside it",
            "Check the unit of the speed, the mass, the axis, and that all matrices are of one model.",
        )
    skew = _skew(state)
    if skew is None:
        return
    turned = 2.0 * np.asarray(rest.mass @ (moves @ axis.cross))
    found = _apart(np.asarray(skew @ moves)[inside], turned[inside], 0.0)
    if found is not None:
        raise input_error(
            place,
            f"the damping matrix holds {found.share:.4g} of the Coriolis forces that mass and speed have, and {100 * found.rest:.3g} % beside it",
            "Check its sign, the unit of the speed and the axis, or leave damping_matrix out.",
        )


def _away_from_supports(rest: Structure, state: AtSpeed, moves: FloatArray) -> BoolArray:
    """Return the rows (n,) that no support touches: no force of a translation, and no node near that lacks a direction.

    Beside a node that is held in one direction only, forces of a translation may cancel at rest and not at speed.
    """
    size = abs(rest.stiffness) @ np.ones(rest.n)
    free = np.all(np.abs(rest.stiffness @ moves) <= TRANSLATED_RTOL * size[:, None], axis=1)
    _, row = np.unique(rest.dofs.node, return_inverse=True)
    partly = (np.bincount(row, moves.sum(axis=1)) < 3.0)[row].astype(float)
    near = sum((abs(k) @ partly for k in (rest.stiffness, state.structure.stiffness)), partly)
    return np.asarray(free & (near == 0.0))


@dataclass(frozen=True)
class _Apart:
    """Share of an expected matrix in a given one, and what the given one holds beside it, over the expected one."""

    share: float
    rest: float


def _apart(given: FloatArray, expected: FloatArray, noise: float) -> _Apart | None:
    """Return the share of an expected matrix in a given one; None if they agree, or if the noise hides it."""
    size = float(np.linalg.norm(expected))
    if noise >= 0.5 * CONTENT_RTOL * size or np.linalg.norm(given - expected) <= CONTENT_RTOL * size:
        return None
    share = float(np.sum(given * expected)) / size**2
    return _Apart(share, float(np.linalg.norm(given - share * expected)) / size)


def _work_ratio(rest: Structure, state: AtSpeed, axis: Axis) -> float | None:
    """Return the work of a static displacement against the stiffness at rest over its work by the centrifugal load.

    It is one in linear statics. None without the displacement or the places of the nodes.
    """
    moves = _translations(rest)
    if state.displacement is None or moves is None or not np.isfinite(rest.dofs.position).all():
        return None
    outward = -(rest.dofs.position - np.asarray(axis.origin)) @ axis.cross @ axis.cross
    load = state.speed**2 * np.asarray(rest.mass @ np.sum(moves * outward, axis=1))
    u = state.displacement
    work = float(u @ load)
    return float(u @ (rest.stiffness @ u)) / work if work else np.inf


def _check_dofs(rest: Structure, state: AtSpeed) -> None:
    own, known = state.structure.dofs, rest.dofs
    place = f"at_speed at {state.speed / RPM:.6g} rpm"
    modal = [c for c in own.component if c not in PHYSICAL]
    if modal:
        raise input_error(
            place,
            f"has the coordinate {modal[0]!r}, which is no displacement of a node: modes of different speeds cannot be interpolated",
            "Write unreduced matrices, or matrices condensed to nodes alone.",
        )
    if own.component != known.component or not np.array_equal(own.node, known.node):
        raise input_error(
            place,
            f"has other dofs than the matrices at rest ({len(own)} for {len(known)}, or in another order)",
            "Write all speeds from one model with the same supports.",
        )
    off = _norm(state.structure.mass - rest.mass)
    if off > SAME_MASS_RTOL * _norm(rest.mass):
        raise input_error(
            place,
            f"has another mass than the matrices at rest: {100 * off / _norm(rest.mass):.2g} % apart",
            "Write all speeds from one model.",
        )


def _check_coriolis(own: SpeedMatrices, state: AtSpeed) -> None:
    skew = _skew(state)
    if skew is None or own.coriolis is None:
        return
    off = _norm(skew - own.coriolis) / _norm(own.coriolis)
    if off > SAME_CORIOLIS_RTOL:
        raise input_error(
            f"at_speed at {state.speed / RPM:.6g} rpm",
            f"has a Coriolis matrix that is not proportional to the speed: {100 * off:.2g} % apart from that of another speed",
            "Check the speed of each file.",
        )


def _skew(state: AtSpeed) -> Matrix | None:
    """Return the skew part of the damping over the speed; None if there is none."""
    if state.speed == 0.0:
        return None
    damping = state.structure.damping
    skew = 0.5 * (damping - damping.T) / state.speed
    return skew if _norm(skew) > 0.0 else None


def _translations(structure: Structure) -> FloatArray | None:
    """Return the (n, 3) translations of all nodes; None without a node that has x, y and z."""
    component = np.array(structure.dofs.component)
    found = np.stack([component == axis for axis in PHYSICAL[:3]], axis=1).astype(float)
    return found if np.all(found.any(axis=0)) else None


def _positions(matrix: Matrix) -> IntArray:
    found = scipy.sparse.coo_array(matrix)
    return np.asarray(found.row.astype(np.int64) * found.shape[1] + found.col)


def _norm(matrix: Matrix) -> float:
    return float(scipy.sparse.linalg.norm(matrix) if scipy.sparse.issparse(matrix) else np.linalg.norm(matrix))
