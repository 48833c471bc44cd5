"""Wheels with different numbers of sectors on one shaft, coupled at their flanges by spatial harmonics of the circumference.

D. Laxalde, F. Thouverez and J.-P. Lombard, "Dynamics of multistage bladed disks systems", ASME Turbo Expo 2007, GT2007-27051.
Here a flange is tied weakly: the kept harmonics of both sides are equal, and only forces of these harmonics are transmitted.
Neglected harmonics therefore make the joint softer, never stiffer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.factorisation import DENSE, Say, Solve, factorise, silent
from stickslip.model.fe.lanczos import lanczos
from stickslip.model.modes import dense_modes, usual_shift
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.turning import node_table
from stickslip.reduction.waves import wave
from stickslip.units import HZ

DEPENDENT = 1e-10  # eigenvalue of the constraints' Gram matrix over the largest: smaller ones are redundant constraints
RIGID_SQUARE = 1e-6  # square of a frequency over the shift: less is a rigid motion with rounding

Wave = tuple[str, int]  # stage and wave number
CIRCLE_RTOL = 1e-4  # difference in radius or height over the flange's size: with less, nodes lie on one circle


@dataclass(frozen=True, eq=False)
class Circles:
    """Nodes of a sector on a flange, grouped by circles.

    Parameters
    ----------
    sector
        The sector.
    place
        (c, 2) radius and height of each circle, m.
    owner
        (p,) circle of each node.
    dofs
        (p, 3) dofs x, y, z of each node; -1 for supported components.
    angle
        (p,) angles about the axis, rad.
    weight
        (p,) quadrature weight of each node: its fraction of the sector's arc of the circle; the weights of a circle add up to one.
    frame
        (p, 3, 3) rows: radial, circumferential and axial unit vector.
    """

    sector: CyclicSector
    place: FloatArray
    owner: IntArray
    dofs: IntArray
    angle: FloatArray
    weight: FloatArray
    frame: FloatArray

    @property
    def count(self) -> int:
        """Number of circles."""
        return len(self.place)

    @property
    def fewest(self) -> int:
        """Smallest number of nodes of a sector on a circle."""
        return int(np.bincount(self.owner).min())

    def reordered(self, order: IntArray) -> "Circles":
        """Return the circles in another order: ``order[i]`` becomes the i-th."""
        new = np.argsort(order)
        return Circles(self.sector, self.place[order], new[self.owner], self.dofs, self.angle, self.weight, self.frame)


@dataclass(frozen=True, eq=False)
class Flange:
    """Two surfaces of two stages that are bolted together.

    Parameters
    ----------
    stages
        Names of the two stages.
    dofs
        Dofs of both sides: the nodes of one sector on the flange.
    harmonics
        Spatial harmonics of the circumference that are tied, from 0 on, in both senses of rotation.
    """

    stages: tuple[str, str]
    dofs: tuple[IntArray, IntArray]
    harmonics: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Multistage:
    """Stages and flanges; `multistage` makes it.

    Parameters
    ----------
    stages
        One sector of each stage; numbers of sectors may differ.
    flanges
        Flanges that tie the stages.
    places
        For each flange the circles on which the nodes of both sides lie.
    """

    stages: Mapping[str, CyclicSector]
    flanges: tuple[Flange, ...]
    places: tuple[tuple[Circles, Circles], ...]

    @property
    def harmonics(self) -> tuple[int, ...]:
        """All kept spatial harmonics, from 0 on."""
        return tuple(sorted({m for flange in self.flanges for m in flange.harmonics}))

    def waves(self, nodal_diameter: int) -> tuple[Wave, ...]:
        """Return the waves of all stages that vibrate together in a nodal diameter of the assembly.

        Harmonic m of the circumference belongs to wave ``m mod n_s`` of a stage, and a wave contains all harmonics ``k + j n_s``. Kept
        harmonics that are aliases on one stage therefore couple different waves of another.
        """
        self._require(nodal_diameter)
        found = {
            self._wave(name, nodal_diameter) for f in self.flanges if nodal_diameter in f.harmonics for name in f.stages
        }
        grown = True
        while grown:
            grown = False
            for flange in self.flanges:
                for m in _signed(flange.harmonics):
                    pair = {self._wave(name, m) for name in flange.stages}
                    if found & pair and not pair <= found:
                        found |= pair
                        grown = True
        order = list(self.stages)
        return tuple(sorted(found, key=lambda own: (order.index(own[0]), own[1])))

    @cached_property
    def nodal_diameters(self) -> tuple[int, ...]:
        """Nodal diameters of the assembly: the lowest kept harmonic of each group of coupled waves."""
        seen: set[Wave] = set()
        lowest = []
        for m in self.harmonics:
            own = set(self.waves(m))
            if not own & seen:
                lowest.append(m)
            seen |= own | {self._wave(name, -k) for name, k in own}
        return tuple(lowest)

    @property
    def unreached(self) -> tuple[Wave, ...]:
        """Waves without a kept harmonic, which occur in no nodal diameter of the assembly; wave numbers up to n_s/2."""
        found = {own for m in self.nodal_diameters for own in self.waves(m)}
        found |= {self._wave(name, -k) for name, k in found}
        each = [(name, k) for name, s in self.stages.items() for k in range(s.sectors // 2 + 1)]
        return tuple(own for own in each if own not in found)

    def _wave(self, name: str, harmonic: int) -> Wave:
        return name, harmonic % self.stages[name].sectors

    def _require(self, nodal_diameter: int) -> None:
        if nodal_diameter not in self.harmonics:
            kept = ", ".join(map(str, self.harmonics))
            raise input_error(
                "multistage: nodal_diameter",
                f"{nodal_diameter} is no kept harmonic of a flange, these are {kept}",
                "Keep it, or ask for one of these.",
            )


@dataclass(frozen=True, eq=False)
class MultistageModes:
    """Modes of an assembly in one of its nodal diameters, lowest first.

    Parameters
    ----------
    assembly
        The assembly.
    nodal_diameter
        Nodal diameter of the assembly.
    squares
        (n,) squares of circular frequencies, rad²/s².
    stiffest
        (n,) squares with all other harmonics of these waves fixed at the flanges: an upper bound for the effect of neglected
        harmonics; infinite if fewer modes remain.
    shapes
        Wave -> (N, n) displacements of sector 0 of the stage in this wave; the whole assembly has unit mass.
    shares
        (stages, n) fraction of the kinetic energy in each stage.
    """

    assembly: Multistage
    nodal_diameter: int
    squares: FloatArray
    stiffest: FloatArray
    shapes: Mapping[Wave, ComplexArray]
    shares: FloatArray

    @property
    def frequencies_hz(self) -> FloatArray:
        """(n,) natural frequencies in Hz."""
        return np.asarray(np.sign(self.squares) * np.sqrt(np.abs(self.squares)) / HZ)

    @property
    def stiffest_hz(self) -> FloatArray:
        """(n,) frequencies of `stiffest` in Hz."""
        return np.asarray(np.sign(self.stiffest) * np.sqrt(np.abs(self.stiffest)) / HZ)

    def on_sector(self, stage: str, number: int = 0) -> ComplexArray:
        """Return the (N, n) displacements of a sector of a stage, in its own axes."""
        sector = self.assembly.stages[stage]
        own = [(k, shape) for (name, k), shape in self.shapes.items() if name == stage]
        moved = np.zeros((sector.structure.n, self.squares.size), dtype=complex)
        for k, shape in own:
            moved += wave(k, sector.sectors).phase ** number * shape
        return moved


def multistage(stages: Mapping[str, CyclicSector], flanges: Sequence[Flange]) -> Multistage:
    """Join wheels at their flanges.

    Parameters
    ----------
    stages
        One sector of each wheel by name; all have the same axis.
    flanges
        Flanges. The nodes of both sides lie on the same circles about the axis; their number and their angles may differ.

    Raises
    ------
    InputError
        If both sides lie on different circles, a flange names an unknown stage, or a circle has too few nodes for a harmonic.
    """
    places = []
    for flange in flanges:
        both = []
        for name, dofs in zip(flange.stages, flange.dofs, strict=True):
            if name not in stages:
                raise input_error("multistage", f"there is no stage {name!r}", f"There are {', '.join(stages)}.")
            both.append(circles(stages[name], dofs, name))
        first, second = _same_circles(both[0], both[1], flange.stages)
        for side, name in zip((first, second), flange.stages, strict=True):
            _refuse_fine(side, name, stages[name].sectors, flange.harmonics)
        places.append((first, second))
    return Multistage(dict(stages), tuple(flanges), tuple(places))


def multistage_modes(assembly: Multistage, nodal_diameter: int, n: int, *, say: Say = silent) -> MultistageModes:
    """Return the `n` lowest undamped modes of an assembly in one of its nodal diameters, at rest.

    Parameters
    ----------
    assembly
        The assembly, from `multistage`.
    nodal_diameter
        One of the kept harmonics.
    n
        Number of modes.
    say
        Called with a sentence before long steps.

    Raises
    ------
    InputError
        If the assembly has fewer modes.
    """
    waves = assembly.waves(nodal_diameter)
    moving = [travelling_wave(assembly.stages[name], k) for name, k in waves]
    counts = np.array([assembly.stages[name].sectors for name, _ in waves])
    mass, stiffness = (_side_by_side(counts, [getattr(s, which) for s in moving]) for which in ("mass", "stiffness"))
    problem = _Problem(stiffness, mass, min(usual_shift(s) for s in moving))
    squares, vectors = problem.modes(constraints(assembly, waves), n, say)
    order = np.argsort(squares)
    squares, vectors = squares[order], vectors[:, order]
    held = constraints(assembly, waves, held=True)
    most = min(n, problem.free(held))
    stiffest = np.full(n, np.inf)
    stiffest[:most] = np.sort(problem.modes(held, most, say)[0]) if most else np.inf
    ends = np.cumsum([s.n for s in moving])[:-1]
    pieces = np.split(vectors, ends)
    energy = np.array(
        [c * np.sum((x.conj() * (s.mass @ x)).real, axis=0) for c, s, x in zip(counts, moving, pieces, strict=True)]
    )
    shares = np.array([energy[[name == own for own, _ in waves]].sum(axis=0) for name in assembly.stages])
    expanded = {
        own: np.asarray(assembly.stages[own[0]].wave_tie(own[1]) @ x) for own, x in zip(waves, pieces, strict=True)
    }
    return MultistageModes(
        assembly, nodal_diameter, squares, np.maximum(stiffest, squares), expanded, shares / shares.sum(axis=0)
    )


def _side_by_side(counts: IntArray, matrices: Sequence[Matrix]) -> Matrix:
    """Return the block-diagonal matrix of uncoupled wheels from the matrices of their sectors."""
    each = [c * scipy.sparse.csr_array(a) for c, a in zip(counts, matrices, strict=True)]
    return scipy.sparse.block_diag(each, format="csr")


def constraints(assembly: Multistage, waves: Sequence[Wave], *, held: bool = False) -> ComplexArray:
    """Return the (r, N) orthonormal rows of the flanges' constraints on the waves.

    With `held`, harmonics that are not kept are fixed as well.
    """
    sizes = [assembly.stages[name].wave_tie(k).shape[1] for name, k in waves]
    ends = np.concatenate([[0], np.cumsum(sizes)])
    place = {own: slice(ends[i], ends[i + 1]) for i, own in enumerate(waves)}
    rows = [np.zeros((0, ends[-1]), dtype=complex)]
    for flange, sides in zip(assembly.flanges, assembly.places, strict=True):
        pairs = list(zip((1, -1), flange.stages, sides, strict=True))
        kept = _signed(flange.harmonics)
        for m in kept:
            block = np.zeros((3 * sides[0].count, ends[-1]), dtype=complex)
            for sign, name, side in pairs:
                _add_harmonic(block, assembly.stages[name], (name, m), place, sign, side)
            rows.append(block)
        for _, name, side in pairs if held else ():
            most = assembly.stages[name].sectors * side.fewest // 2
            for m in sorted(set(range(-most, most + 1)) - set(kept)):
                block = np.zeros((3 * side.count, ends[-1]), dtype=complex)
                _add_harmonic(block, assembly.stages[name], (name, m), place, 1, side)
                rows.append(block)
    whole = np.vstack([block for block in rows if block.any() or not len(block)])
    squares, turn = np.linalg.eigh(whole @ whole.conj().T)
    independent = squares > DEPENDENT * np.max(squares, initial=0.0)
    turn = turn[:, independent] / np.sqrt(squares[independent])
    return np.asarray(turn.conj().T @ whole)


def _add_harmonic(
    block: ComplexArray,
    sector: CyclicSector,
    harmonic: tuple[str, int],
    place: Mapping[Wave, slice],
    sign: int,
    side: Circles,
) -> None:
    """Add a harmonic of one side of a flange to the rows `block`, if its wave is in `place`."""
    name, m = harmonic
    k = m % sector.sectors
    if (name, k) in place:
        block[:, place[name, k]] += sign * (projection(side, m) @ sector.wave_tie(k))


@dataclass(frozen=True, eq=False)
class _Problem:
    stiffness: Matrix
    mass: Matrix
    shift: float

    @cached_property
    def _plain(self) -> Solve:
        return factorise(scipy.sparse.csr_array(self.stiffness - self.shift * self.mass))

    def free(self, rows: ComplexArray) -> int:
        """Return an upper bound of the number of modes under the constraints `rows`."""
        return int(np.count_nonzero(self.mass.diagonal())) - len(rows)

    def modes(self, rows: ComplexArray, n: int, say: Say) -> tuple[FloatArray, ComplexArray]:
        """Return the lowest modes under the constraints `rows`, unordered."""
        free, size = self.free(rows), self.mass.shape[0]
        if not 0 < n <= free:
            what = f"{n} modes asked of {free} free motions"
            raise input_error("multistage_modes", what, f"Ask for at most {free}.")
        if size <= DENSE or n > size // 3:
            return self._dense(rows, n)
        answers = self._plain(rows.conj().T)
        inner = scipy.linalg.lu_factor(rows @ answers)

        def solve(right: Matrix) -> Matrix:
            free_motion = self._plain(right)
            return free_motion - answers @ scipy.linalg.lu_solve(inner, rows @ free_motion)

        say(f"{n} modes of {size} dofs")
        squares, vectors = lanczos(self.mass, n, solve, self.shift, complex)
        return np.where(np.abs(squares) < RIGID_SQUARE * abs(self.shift), 0.0, squares), vectors

    def _dense(self, rows: ComplexArray, n: int) -> tuple[FloatArray, ComplexArray]:
        basis = scipy.linalg.null_space(rows) if len(rows) else np.eye(self.mass.shape[0])
        K, M = (basis.conj().T @ (a @ basis) for a in (self.stiffness, self.mass))
        squares, vectors = dense_modes(K, M, n, self.shift)
        return squares, basis @ vectors


def _signed(harmonics: Sequence[int]) -> list[int]:
    return sorted({sign * m for m in harmonics for sign in (1, -1)})


def _refuse_fine(side: Circles, name: str, sectors: int, harmonics: Sequence[int]) -> None:
    around = sectors * side.fewest
    most = max(harmonics)
    if 2 * most > around:
        raise input_error(
            "multistage: harmonics",
            f"{most} is above half of the {around} nodes that a circle of the flange of {name!r} has",
            f"Keep harmonics up to {around // 2}, or mesh the flange finer.",
        )


def circles(sector: CyclicSector, members: IntArray, name: str) -> Circles:
    """Return the circles on which the nodes with the dofs `members` lie.

    A node on the cut face that follows is left out, since it is a copy of a place on the other face.

    Raises
    ------
    InputError
        If there are no such nodes, the stage has no axis, or nodes lie on the axis; `name` is the name of the stage.
    """
    where = f"multistage: {name}"
    if sector.axis is None:
        raise input_error(where, "has no axis", "Give the sector of a model with geometry.")
    dofs = sector.structure.dofs
    members = np.setdiff1d(members, np.setdiff1d(sector.followers, sector.shared))
    table = node_table(dofs.take(members))[:, :3]
    if not len(table):
        raise input_error(where, "has no free node on the flange", "Name the nodes of the flange.")
    points = dofs.position[members[table.max(axis=1)]]
    arm = sector.axis.arm(points)
    radius = np.linalg.norm(arm, axis=1)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) or float(radius.max())
    if radius.min() <= CIRCLE_RTOL * size:
        raise input_error(where, "has a node of the flange on the axis", "Take it out of the set.")
    height = points @ sector.axis.unit
    step = CIRCLE_RTOL * max(size, float(radius.max()))
    both = np.column_stack([_groups(radius, step), _groups(height, step)])
    place, owner = np.unique(both, axis=0, return_inverse=True)
    owner = owner.reshape(-1)
    radial = arm / radius[:, None]
    frame = np.stack([radial, np.cross(sector.axis.unit, radial), np.tile(sector.axis.unit, (len(points), 1))], axis=1)
    first, second = _across(sector.axis)
    angle = np.arctan2(arm @ second, arm @ first)
    own = np.where(table >= 0, members[table], -1)
    weight = np.concatenate([np.zeros(0), _weights(angle, owner, sector.pitch)])
    mean = np.array([[radius[owner == c].mean(), height[owner == c].mean()] for c in range(len(place))])
    return Circles(sector, mean, owner, own, angle, weight, frame)


def _groups(values: FloatArray, gap: float) -> IntArray:
    """Return the number of the group of each value, ascending; neighbours in a group differ by at most `gap`, wherever they lie."""
    order = np.argsort(values, kind="stable")
    groups = np.empty(len(values), dtype=np.int64)
    groups[order] = np.append(0, np.cumsum(np.diff(values[order]) > gap))
    return groups


def _same_circles(one: Circles, other: Circles, names: tuple[str, str]) -> tuple[Circles, Circles]:
    """Return both sides with their circles in the same order.

    Raises
    ------
    InputError
        If the stages turn about different axes, or a circle of one stage has no partner on the other.
    """
    a, b = one.sector.axis, other.sector.axis
    assert a is not None
    assert b is not None
    reach = CIRCLE_RTOL * float(max(one.place[:, 0].max(), other.place[:, 0].max())) * 3
    if not np.allclose(a.unit, b.unit) or np.linalg.norm(a.arm(np.array([b.origin]))) > reach:
        raise input_error(
            "multistage", f"{names[0]!r} and {names[1]!r} turn about different axes", "Give them one axis."
        )
    off = np.linalg.norm(one.place[:, None] - other.place[None], axis=2)
    lost = np.flatnonzero(off.min(axis=1) > reach)
    if lost.size or len(one.place) != len(other.place):
        side = (one, other, names) if lost.size else (other, one, names[::-1])
        distance = np.linalg.norm(side[0].place[:, None] - side[1].place[None], axis=2).min(axis=1)
        r, z = side[0].place[int(np.argmax(distance))]
        raise input_error(
            "multistage",
            f"the flange of {side[2][0]!r} has nodes at the radius {r:.6g} m and height {z:.6g} m, that of {side[2][1]!r} has none there",
            "Nodes of both sides lie on the same circles about the axis: name such nodes, or mesh both sides alike along radius and axis.",
        )
    return one, other.reordered(np.argmin(off, axis=1))


def projection(side: Circles, harmonic: int) -> Matrix:
    """Return the (3 c, n) CSR operator that gives a harmonic of the radial, circumferential and axial displacement of a sector.

    For the wave that contains this harmonic it is ``(1/2π) ∮ u e^{-imφ} dφ`` by the trapezoidal rule; for evenly spaced nodes it is
    also the least-squares fit.
    """
    factor = side.weight * np.exp(-1j * harmonic * side.angle)
    values = factor[:, None, None] * side.frame
    rows = np.broadcast_to(3 * side.owner[:, None, None] + np.arange(3)[:, None], values.shape)
    columns = np.broadcast_to(side.dofs[:, None, :], values.shape)
    there = columns >= 0
    shape = (3 * side.count, side.sector.structure.n)
    return scipy.sparse.csr_array((values[there], (rows[there], columns[there])), shape=shape)


def _weights(angle: FloatArray, owner: IntArray, pitch: float) -> FloatArray:
    """Return the fraction of the sector's arc of its circle that belongs to each node."""
    weight = np.zeros(angle.size)
    for circle in range(int(owner.max()) + 1):
        own = np.flatnonzero(owner == circle)
        start = np.angle(np.mean(np.exp(1j * angle[own])))  # keeps the jump of the angle outside the sector
        along = (angle[own] - start + np.pi) % (2 * np.pi)
        order = np.argsort(along)
        sorted_ = along[order]
        ahead = np.append(sorted_[1:], sorted_[0] + pitch)
        behind = np.insert(sorted_[:-1], 0, sorted_[-1] - pitch)
        weight[own[order]] = (ahead - behind) / (2 * pitch)
    return weight


def _across(axis: Axis) -> tuple[FloatArray, FloatArray]:
    """Return two directions perpendicular to the axis, from which angles are counted; they are the same for parallel axes."""
    unit = axis.unit
    first = np.eye(3)[int(np.argmin(np.abs(unit)))]
    first = first - (first @ unit) * unit
    first = first / np.linalg.norm(first)
    return first, np.cross(unit, first)
