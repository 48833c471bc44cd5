"""A wheel of equal sectors under an engine order: each temporal harmonic is a travelling wave.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, appendices 1 and 2.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import InputError, input_error
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.contact_coordinates import in_relative_coordinates, nodal_coordinates
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.waves import excited_wave, wave
from stickslip.reduction.whole_wheel import (
    Reduce,
    goes_both_ways,
    kept_places,
    reduced_wave,
    refuse_reduced,
    refuse_unequal,
)

Gaps = tuple[Matrix, Matrix | None]
Write = Callable[[int], tuple[Structure, Matrix]]  # wave number -> the wave in other coordinates, and its gap operator


@dataclass(frozen=True, eq=False)
class TunedWheel:
    """One sector of a wheel whose sectors all do the same, one after the other; `tuned_wheel` makes one.

    Under engine order m, harmonic h of the vibration is the wave ``h m mod n_s`` and has the structure of this wave. The first
    coordinates have the same meaning in all waves: the gaps of the contacts, or the kept dofs of a sector; a neighbour's dof with
    contact is the sector's own dof in another phase. The other coordinates differ from wave to wave.

    Parameters
    ----------
    waves
        Wave number -> structure in these coordinates.
    sectors
        Number of sectors.
    engine_order
        Engine order m.
    harmonics
        Highest temporal harmonic for which there is a wave.
    multipliers
        Coordinates that are constraint forces; there are such if contacts act on a dof in several phases (`NodalCoordinates`).
    feedback
        Wave number -> aerodynamic force on it, in these coordinates; the waves hold its frozen form (`with_aerodynamics`).
    """

    waves: Mapping[int, Structure]
    sectors: int
    engine_order: int
    harmonics: int
    multipliers: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    feedback: Mapping[int, Feedback] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Describe the wheel in a line, without its matrices."""
        waves = ", ".join(str(k) for k in sorted(self.waves))
        return (
            f"<TunedWheel: {self.sectors} sectors; engine order {self.engine_order}; harmonics 0 to {self.harmonics}; "
            f"waves {waves}; {self.n} coordinates>"
        )

    @property
    def wheel(self) -> "TunedWheel":
        """The tuned wheel itself (see `LinearSide`)."""
        return self

    @property
    def speed_follows_frequency(self) -> bool:
        """Whether the speed changes with the frequency (see `LinearSide`)."""
        return False

    @property
    def reduced(self) -> bool:
        """Whether coordinates without contact are condensed (see `LinearSide`)."""
        return True

    def at_frequency(self, omega: float) -> "TunedWheel":
        """Return the wheel, which is the same at every frequency (see `LinearSide`)."""
        return self

    def of_harmonic(self, harmonic: int) -> Structure:
        """Return the structure of the wave of temporal harmonic `harmonic` (0: the mean).

        Raises
        ------
        InputError
            If the wheel was made for fewer harmonics and lacks the wave of this one.
        """
        if harmonic < 0 or (harmonic > self.harmonics and not self.has_every_wave):
            raise input_error(
                "TunedWheel",
                f"was made for harmonics up to {self.harmonics}, asked for {harmonic}",
                "Give tuned_wheel more harmonics.",
            )
        return self.waves[excited_wave(self.engine_order, self.sectors, harmonic)]

    def feedback_of(self, harmonic: int) -> Feedback | None:
        """Return the aerodynamic force on temporal harmonic `harmonic`, or None.

        The structure from `of_harmonic` contains the frozen form of this force.
        """
        return self.feedback.get(excited_wave(self.engine_order, self.sectors, harmonic))

    def with_aerodynamics(self, feedback: Mapping[int, Feedback]) -> "TunedWheel":
        """Return the wheel with an aerodynamic force on each wave.

        The matrices contain its frozen form; the force itself is stored for use at known frequencies.

        Parameters
        ----------
        feedback
            Wave number -> force, in the coordinates of the wheel.
        """
        waves = {k: feedback[k].frozen(own) for k, own in self.waves.items()}
        return replace(self, waves=waves, feedback=dict(feedback))

    @property
    def dofs(self) -> Dofs:
        """Table of the coordinates."""
        return self.of_harmonic(0).dofs

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.of_harmonic(0).n

    @property
    def has_every_wave(self) -> bool:
        """Whether every wave number has a structure, which time integration of all sectors needs."""
        return all(k in self.waves for k in range(self.sectors))

    def travelling_as(self, wave_number: int) -> "TunedWheel":
        """Return the wheel under another engine order; it must have every wave."""
        return replace(self, engine_order=wave_number)

    def grounded(self, springs: Matrix) -> "TunedWheel":
        """Return the wheel with springs, a sparse matrix (n, n) in N/m, from its coordinates to the ground."""
        waves = {k: wave.grounded(springs) for k, wave in self.waves.items()}
        return replace(self, waves=waves)

    def project(self, load: Matrix, harmonic: int) -> Matrix:
        """Return the (n,) load on the coordinates in a harmonic from the load (n_full,) on the sector's dofs, N."""
        return self.of_harmonic(harmonic).project(load)

    def expand(self, vector: Matrix, harmonic: int) -> Matrix:
        """Return the displacements (n_full,) of sector 0 from coordinates (n,) in a harmonic."""
        return self.of_harmonic(harmonic).expand(vector)


def tuned_wheel(  # noqa: PLR0913
    sector: CyclicSector,
    engine_order: int,
    harmonics: int,
    gaps: Gaps,
    *,
    keep: IntArray | None = None,
    n_modes: int = 0,
    reduce: Reduce = craig_bampton,
    names: Sequence[str] = (),
    relative: bool | None = None,
    waves: Sequence[int] = (),
) -> tuple[TunedWheel, Matrix]:
    """Reduce the travelling waves that an engine order excites, to coordinates with the same gap operator for all waves.

    Parameters
    ----------
    sector
        One sector. It may contain joined parts without cyclic faces, such as a disk segment with its blade and rigid dampers.
    engine_order
        Engine order m; harmonic h travels with the wave number ``h m mod n_s``.
    harmonics
        Highest temporal harmonic.
    gaps
        Two operators (3 n_contacts, n) on the displacements of a sector in its own axes: ``gap = own u^(0) + next u^(1)``,
        rows t, w, n of each contact. The second is None for contacts inside a sector; see `stickslip.contact.neighbours`.
    keep
        (k,) dofs of the sector that stay physical in the reduction, with the dofs of all contacts and without dofs of the high
        face; None: nothing is reduced.
    n_modes
        Number of modes of each wave in addition to the kept dofs.
    reduce
        `craig_bampton`, `rubin`, or any function ``(wave, keep, n_modes) -> Structure`` whose first coordinates are the
        dofs `keep` of the wave, with the same number of coordinates for every wave.
    names
        Names of the contacts.
    relative
        True: the gaps are coordinates, which halves the unknowns (`in_relative_coordinates`). False: the kept dofs are coordinates,
        in the order of `keep` (`nodal_coordinates`), for outputs on nodes of contacts and for dependent gaps. None: True if gaps
        are independent.
    waves
        Further wave numbers to reduce, for stability and for time integration of all sectors.

    Returns
    -------
    wheel
        For `System`, which then solves for one sector only.
    gap_operator
        (3 n_contacts, n) from its coordinates to the gaps, real.

    Raises
    ------
    InputError
        If operators do not fit, dofs of the contacts are not kept, gaps that become coordinates are dependent in one of the waves,
        or `reduce` does not return the structure described above.
    """
    _refuse_misfits(sector, gaps)
    orders = range(harmonics + 1)
    excited = {excited_wave(engine_order, sector.sectors, h) for h in orders}
    wanted = sorted(excited | {k % sector.sectors for k in waves})
    place = None if keep is None else kept_places("tuned_wheel", sector, keep)
    if place is not None:
        _refuse_lost_contacts(sector, place, *gaps)
    moving = _moving(sector, wanted, place, n_modes, reduce)

    def gap_coordinates(k: int) -> tuple[Structure, Matrix]:
        return in_relative_coordinates(moving[k], _gaps_of(sector, k, gaps) @ moving[k].basis, names)

    first = moving[wanted[0]]
    if relative is not False:
        try:
            written, operator = _written(sector, wanted, moving, gap_coordinates)
            return TunedWheel(written, sector.sectors, engine_order, harmonics), operator.real
        except InputError:
            if relative:
                raise
    known = np.arange(sector.independent.size) if place is None else place
    nodal = nodal_coordinates(sector, known, first.n, gaps)

    def node_coordinates(k: int) -> tuple[Structure, Matrix]:
        return nodal.of_wave(moving[k], wave(k, sector.sectors).phase), nodal.operator

    written, operator = _written(sector, wanted, moving, node_coordinates)
    wheel = TunedWheel(written, sector.sectors, engine_order, harmonics, nodal.multipliers)
    return wheel, operator


def _moving(
    sector: CyclicSector, wanted: Sequence[int], place: IntArray | None, n_modes: int, reduce: Reduce
) -> dict[int, Structure]:
    """Return the travelling waves; if dofs are kept, they are reduced, and conjugates of other waves are left out."""
    if place is None:
        return {k: travelling_wave(sector, k) for k in wanted}
    moving: dict[int, Structure] = {}
    for k in wanted:
        if not _mirrored(sector, moving, k):
            moving[k] = reduced_wave("tuned_wheel", reduce, sector, k, place, n_modes)
    refuse_unequal("tuned_wheel", moving)
    return moving


def _refuse_misfits(sector: CyclicSector, gaps: Gaps) -> None:
    """Refuse a sector that is already reduced, and operators that do not fit its dofs."""
    refuse_reduced("tuned_wheel", sector)
    n = sector.structure.n
    for operator in gaps:
        if operator is not None and (operator.shape[1] != n or operator.shape[0] % 3):
            raise input_error(
                "tuned_wheel: gaps",
                f"an operator has shape {operator.shape} for a sector of {n} dofs",
                "Give three rows (t, w, n) a contact.",
            )


def _gaps_of(sector: CyclicSector, wave_number: int, gaps: Gaps) -> Matrix:
    """Return the operator from the displacements of sector 0 to the gaps in a wave."""
    own, following = gaps
    return own if following is None else own + wave(wave_number, sector.sectors).phase * following


def _mirrored(sector: CyclicSector, waves: Mapping[int, Structure], k: int) -> bool:
    """Whether wave k is the conjugate of one of `waves`."""
    other = waves.get(sector.sectors - k)
    return other is not None and k > 0 and goes_both_ways(sector, other)


def _written(
    sector: CyclicSector, wanted: Sequence[int], moving: Mapping[int, Structure], write: Write
) -> tuple[dict[int, Structure], Matrix]:
    """Return the waves in other coordinates and their gap operator, which must be the same for all."""
    waves: dict[int, Structure] = {}
    operators: dict[int, Matrix] = {}
    for k in wanted:
        if _mirrored(sector, {j: moving[j] for j in waves if j in moving}, k):
            waves[k] = conjugate(waves[sector.sectors - k])
        else:
            waves[k], operators[k] = write(k)
    common = operators[wanted[0]]
    for k, operator in operators.items():
        if operator.shape != common.shape or np.any(operator != common):
            raise input_error(
                "tuned_wheel: gaps",
                f"a gap that there is in wave {wanted[0]} is none in wave {k}, or the other way round",
                "Take nodal coordinates (relative=False).",
            )
    return waves, common


def _refuse_lost_contacts(sector: CyclicSector, place: IntArray, own: Matrix, following: Matrix | None) -> None:
    """Refuse contacts on dofs that are not kept: a few modes describe the response to forces there badly."""
    operators = [own] if following is None else [own, following]
    used = np.unique(np.concatenate([operator.nonzero()[1] for operator in operators]))
    # dofs on the high face follow their partners on the low one
    lost = np.setdiff1d(sector.wave_tie(0)[used].nonzero()[1], place)
    if lost.size:
        free = sector.independent
        dofs = sector.structure.dofs
        name = dofs.labels[free[lost[0]]] if lost[0] < free.size else "a dof on the axis"
        raise input_error(
            "tuned_wheel: keep",
            f"lacks {name}, on which a contact acts, {lost.size} such dofs in all",
            "Keep the dofs of the contacts; the partners on the low face of those on the high one.",
        )


def conjugate(structure: Structure) -> Structure:
    """Return the wave that travels in the opposite direction."""
    parts = (structure.mass, structure.damping, structure.stiffness)
    mass, damping, stiffness = (matrix.conj() for matrix in parts)
    basis = None if structure.basis is None else structure.basis.conj()
    loss = None if structure.loss is None else structure.loss.conj()
    return Structure(mass, damping, stiffness, structure.dofs, structure.sets, basis, loss)
