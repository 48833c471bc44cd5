"""Wheels of different numbers of sectors on one shaft, coupled at their flanges by spatial harmonics of the circumference.

D. Laxalde, F. Thouverez and J.-P. Lombard, "Dynamics of multistage bladed disks systems", ASME Turbo Expo 2007, GT2007-27051. Here a flange
is tied in the mean: of both sides the kept harmonics are equal, and forces of these harmonics
alone go across, so that what is left out makes the joint softer, never stiffer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.dense_modes import dense_modes
from stickslip.model.fe.factorisation import DENSE, Say, Solve, factorise, silent
from stickslip.model.fe.lanczos import lanczos
from stickslip.model.modes import usual_shift
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.flange import Circles, circles, projection, same_circles
from stickslip.reduction.waves import wave
from stickslip.units import HZ

DEPENDENT = 1e-10  # of the largest eigenvalue of the constraints' Gram matrix: smaller ones say what others say
RIGID_SQUARE = 1e-6  # of the shift: squares below are those of rigid motions, but for rounding

Wave = tuple[str, int]  # stage and wave number


@dataclass(frozen=True, eq=False)
class Flange:
    """Two surfaces of two stages that are bolted together.

    Parameters
    ----------
    stages
        Names of the two.
    dofs
        Dofs of both sides: the nodes on each sector's piece of the flange.
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

        Harmonic m of the circumference is part of wave ``m mod n_s`` of a stage, and a wave has all harmonics ``k + j n_s``: kept
        harmonics that are aliases on one stage tie different waves of another.
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
        """Nodal diameters of the assembly: the lowest kept harmonic of each group that vibrates together."""
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
        """Waves, up to half the sectors of their stage, that occur in no nodal diameter of the assembly, as no kept harmonic belongs to them."""
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
        (n,) the same with all other harmonics of these waves fixed at the flanges: an upper bound for the effect of neglected harmonics;
        infinite where fewer modes remain.
    shapes
        Wave -> (N, n) displacements of sector 0 of the stage in this wave; the whole assembly has unit mass.
    shares
        (stages, n) share of each stage in the kinetic energy.
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
        """(n,) `stiffest` in Hz."""
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
    """Put wheels together at their flanges.

    Parameters
    ----------
    stages
        One sector of each wheel by name; all have the same axis.
    flanges
        Flanges. The nodes of both sides lie on the same circles about the axis; their number on a circle and their angles may
        differ.

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
        first, second = same_circles(both[0], both[1], flange.stages)
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
    """Return the matrices of sectors as those of whole wheels, uncoupled."""
    each = [c * scipy.sparse.csr_array(a) for c, a in zip(counts, matrices, strict=True)]
    return scipy.sparse.block_diag(each, format="csr")


def constraints(assembly: Multistage, waves: Sequence[Wave], *, held: bool = False) -> ComplexArray:
    """Return the (r, N) orthonormal rows that vanish in what the flanges allow the waves; `held`: harmonics that are not kept vanish, too."""
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
    """Add a harmonic of a side of a flange, where its wave is one of those at hand."""
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
        """Return how many motions with mass constraints leave, or a few more."""
        return int(np.count_nonzero(self.mass.diagonal())) - len(rows)

    def modes(self, rows: ComplexArray, n: int, say: Say) -> tuple[FloatArray, ComplexArray]:
        """Return the lowest modes in what constraints allow, in no order."""
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
