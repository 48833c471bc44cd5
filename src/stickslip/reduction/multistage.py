"""Wheels of different numbers of sectors on one shaft, coupled at their flanges by spatial harmonics of the circumference.

D. Laxalde, J.-P. Lombard and F. Thouverez, "Dynamics of multistage bladed disks systems", Journal of Engineering for Gas Turbines and
Power 129 (2007) 1058-1064. Here a flange is tied in the mean: of both sides the kept harmonics are equal, and forces of these harmonics
alone go across, so that what is left out makes the joint softer, never stiffer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import DENSE, Say, Solve, factorise, silent
from stickslip.model.fe.lanczos import lanczos
from stickslip.model.modes import usual_shift
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.flange import Circles, circles, projection, same_circles
from stickslip.reduction.waves import wave
from stickslip.units import HZ

DEPENDENT = 1e-10  # of the largest eigenvalue of the constraints' Gram matrix: smaller ones say what others say
RIGID = 1e-6  # of the shift: squares below are those of rigid motions, but for rounding

Wave = tuple[str, int]  # stage and wave number


@dataclass(frozen=True, eq=False)
class Flange:
    """Two surfaces of two stages that are bolted together.

    Parameters
    ----------
    stages
        Names of the two.
    dofs
        Of both, on the sectors: the nodes of a sector's piece of the flange.
    harmonics
        Spatial harmonics of the circumference that are tied, from 0 on; those of both senses are.
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
        A sector of each, at its own number of sectors.
    flanges
        What ties them.
    places
        Of each flange the circles on which the nodes of both sides lie.
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
            self._wave(name, nodal_diameter)
            for f in self.flanges
            if nodal_diameter in f.harmonics
            for name in f.stages
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
        """Kept harmonics, of those that vibrate together the lowest."""
        seen: set[Wave] = set()
        lowest = []
        for m in self.harmonics:
            own = set(self.waves(m))
            if not own & seen:
                lowest.append(m)
            seen |= own | {self._wave(name, -k) for name, k in own}
        return tuple(lowest)

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
        What vibrates.
    nodal_diameter
        Of the assembly.
    squares
        (n,) of circular frequencies, rad²/s².
    shapes
        Wave -> (N, n) displacements of sector 0 of the stage in this wave; the whole assembly has unit mass.
    shares
        (stages, n) of each stage in the kinetic energy.
    """

    assembly: Multistage
    nodal_diameter: int
    squares: FloatArray
    shapes: Mapping[Wave, ComplexArray]
    shares: FloatArray

    @property
    def frequencies_hz(self) -> FloatArray:
        """(n,) in Hz."""
        return np.asarray(np.sign(self.squares) * np.sqrt(np.abs(self.squares)) / HZ)

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
        A sector of each wheel by name; all have one axis.
    flanges
        What is tied. The nodes of both sides lie on the same circles about the axis; how many there are on a circle, and at which
        angles, may differ.

    Raises
    ------
    InputError
        If sides have other circles, a stage has no such name, or a harmonic is one too many for the nodes of a circle.
    """
    places = []
    for flange in flanges:
        both = []
        for name, dofs in zip(flange.stages, flange.dofs, strict=True):
            if name not in stages:
                raise input_error(
                    "multistage", f"there is no stage {name!r}", f"There are {', '.join(stages)}."
                )
            both.append(circles(stages[name], dofs, name))
        first, second = same_circles(both[0], both[1], flange.stages)
        for side, name in zip((first, second), flange.stages, strict=True):
            _refuse_fine(side, name, stages[name].sectors, flange.harmonics)
        places.append((first, second))
    return Multistage(dict(stages), tuple(flanges), tuple(places))


def multistage_modes(
    assembly: Multistage, nodal_diameter: int, n: int, *, say: Say = silent
) -> MultistageModes:
    """Return the `n` lowest undamped modes of an assembly in one of its nodal diameters, at rest.

    Parameters
    ----------
    assembly
        From `multistage`.
    nodal_diameter
        One of the kept harmonics.
    n
        Number of modes.
    say
        Called with a sentence before long steps.

    Raises
    ------
    InputError
        If there are fewer modes.
    """
    waves = assembly.waves(nodal_diameter)
    moving = [travelling_wave(assembly.stages[name], k) for name, k in waves]
    counts = np.array([assembly.stages[name].sectors for name, _ in waves])
    mass = scipy.sparse.block_diag(
        [c * scipy.sparse.csr_array(s.mass) for c, s in zip(counts, moving, strict=True)],
        format="csr",
    )
    stiffness = scipy.sparse.block_diag(
        [c * scipy.sparse.csr_array(s.stiffness) for c, s in zip(counts, moving, strict=True)],
        format="csr",
    )
    rows = constraints(assembly, waves)
    free = int(np.count_nonzero(mass.diagonal())) - rows.shape[0]
    if not 0 < n <= free:
        raise input_error(
            "multistage_modes",
            f"{n} modes asked of {free} free motions",
            f"Ask for at most {free}.",
        )
    if mass.shape[0] <= DENSE or n > mass.shape[0] // 3:
        squares, vectors = _dense(stiffness, mass, rows, n)
    else:
        shift = min(usual_shift(s) for s in moving)
        solve = _constrained(stiffness - shift * mass, rows, say)
        say(f"{n} modes of {mass.shape[0]} dofs of {len(waves)} waves")
        squares, vectors = lanczos(mass, n, solve, shift, complex)
        squares = np.where(np.abs(squares) < RIGID * abs(shift), 0.0, squares)
    order = np.argsort(squares)
    squares, vectors = squares[order], vectors[:, order]
    ends = np.cumsum([s.n for s in moving])[:-1]
    pieces = np.split(vectors, ends)
    energy = np.array(
        [
            c * np.sum((x.conj() * (s.mass @ x)).real, axis=0)
            for c, s, x in zip(counts, moving, pieces, strict=True)
        ]
    )
    shares = np.array(
        [energy[[name == own for own, _ in waves]].sum(axis=0) for name in assembly.stages]
    )
    expanded = {
        own: np.asarray(assembly.stages[own[0]].wave_tie(own[1]) @ x)
        for own, x in zip(waves, pieces, strict=True)
    }
    return MultistageModes(assembly, nodal_diameter, squares, expanded, shares / shares.sum(axis=0))


def constraints(assembly: Multistage, waves: Sequence[Wave]) -> ComplexArray:
    """Return the (r, N) orthonormal rows that vanish in what the flanges allow the waves."""
    sizes = [assembly.stages[name].wave_tie(k).shape[1] for name, k in waves]
    ends = np.concatenate([[0], np.cumsum(sizes)])
    place = {own: slice(ends[i], ends[i + 1]) for i, own in enumerate(waves)}
    rows = []
    for flange, sides in zip(assembly.flanges, assembly.places, strict=True):
        for m in _signed(flange.harmonics):
            block = np.zeros((3 * sides[0].count, ends[-1]), dtype=complex)
            for sign, name, side in zip((1, -1), flange.stages, sides, strict=True):
                own = name, m % assembly.stages[name].sectors
                if own in place:
                    block[:, place[own]] += sign * (
                        projection(side, m) @ assembly.stages[name].wave_tie(own[1])
                    )
            if block.any():
                rows.append(block)
    whole = np.vstack([np.zeros((0, ends[-1]), dtype=complex), *rows])
    squares, turn = np.linalg.eigh(whole @ whole.conj().T)
    kept = squares > DEPENDENT * np.max(squares, initial=0.0)
    return np.asarray((turn[:, kept] / np.sqrt(squares[kept])).conj().T @ whole)


def _constrained(shifted: Matrix, rows: ComplexArray, say: Say) -> Solve:
    """Return what solves with a matrix under constraints: forces of the constraints hold them."""
    plain = factorise(scipy.sparse.csr_array(shifted), say=say)
    answers = plain(rows.conj().T)
    inner = scipy.linalg.lu_factor(rows @ answers)

    def solve(right: Matrix) -> Matrix:
        free = plain(right)
        return free - answers @ scipy.linalg.lu_solve(inner, rows @ free)

    return solve


def _dense(
    stiffness: Matrix, mass: Matrix, rows: ComplexArray, n: int
) -> tuple[FloatArray, ComplexArray]:
    basis = scipy.linalg.null_space(rows) if len(rows) else np.eye(mass.shape[0])
    K, M = (basis.conj().T @ (a @ basis) for a in (stiffness, mass))
    squares, vectors = scipy.linalg.eigh(K, M, subset_by_index=(0, n - 1))
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
