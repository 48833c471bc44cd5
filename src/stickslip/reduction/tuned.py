"""A wheel of equal sectors under an engine order: each temporal harmonic is a travelling wave of its own.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, appendices 1 and 2.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.relative import in_relative_coordinates
from stickslip.reduction.waves import excited_wave, wave
from stickslip.reduction.whole_wheel import (
    Reduce,
    kept_places,
    reduced_wave,
    refuse_reduced,
    refuse_unequal,
)


@dataclass(frozen=True, eq=False)
class TunedWheel:
    """One sector of a wheel whose sectors all do the same, one after the other; `tuned_wheel` makes one.

    Harmonic h of the vibration has the wave number ``h m mod n_s`` of the engine order m, and its structure is that of this
    wave. The first coordinates are the gaps of the contacts, in all waves alike; the others differ from wave to wave.

    Parameters
    ----------
    waves
        Wave number -> structure, in gaps and other coordinates.
    sectors
        Number of sectors.
    engine_order
        m.
    harmonics
        Highest temporal harmonic for which there is a wave.
    """

    waves: Mapping[int, Structure]
    sectors: int
    engine_order: int
    harmonics: int

    def __repr__(self) -> str:
        """Return what it is in a line, without its matrices."""
        waves = ", ".join(str(k) for k in sorted(self.waves))
        return (
            f"<TunedWheel: {self.sectors} sectors; engine order {self.engine_order}; harmonics 0 to {self.harmonics}; "
            f"waves {waves}; {self.n} coordinates>"
        )

    def of_harmonic(self, harmonic: int) -> Structure:
        """Return the structure that temporal harmonic `harmonic` (0: the mean) vibrates as.

        Raises
        ------
        InputError
            If the wheel was made for fewer harmonics.
        """
        if not 0 <= harmonic <= self.harmonics:
            raise input_error(
                "TunedWheel",
                f"was made for harmonics up to {self.harmonics}, asked for {harmonic}",
                "Give tuned_wheel more harmonics.",
            )
        return self.waves[excited_wave(self.engine_order, self.sectors, harmonic)]

    @property
    def dofs(self) -> Dofs:
        """Table of the coordinates."""
        return self.of_harmonic(0).dofs

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.of_harmonic(0).n

    def project(self, load: Matrix, harmonic: int) -> Matrix:
        """Return the load on the coordinates of a load (n_full,) on the sector's dofs in a harmonic, N."""
        return self.of_harmonic(harmonic).project(load)

    def expand(self, vector: Matrix, harmonic: int) -> Matrix:
        """Return the displacements (n_full,) of sector 0 from coordinates (n,) in a harmonic."""
        return self.of_harmonic(harmonic).expand(vector)


def tuned_wheel(
    sector: CyclicSector,
    engine_order: int,
    harmonics: int,
    gaps: tuple[Matrix, Matrix | None],
    *,
    keep: IntArray | None = None,
    n_modes: int = 0,
    reduce: Reduce = craig_bampton,
    names: Sequence[str] = (),
) -> tuple[TunedWheel, Matrix]:
    """Reduce the travelling waves that an engine order excites, and write them in the gaps of the contacts.

    Parameters
    ----------
    sector
        One sector.
    engine_order
        m; harmonic h travels with the wave number ``h m mod n_s``.
    harmonics
        Highest temporal harmonic.
    gaps
        Two operators (3 n_contacts, n) on the displacements of a sector in its own axes: ``gap = own u^(0) + next u^(1)``,
        rows t, w, n of each contact. The second is None for contacts inside a sector; see `neighbour_gaps`.
    keep
        (k,) dofs of the sector that stay physical in the reduction, those of the contacts among them and none of the high
        face; None: nothing is reduced.
    n_modes
        Number of modes of each wave beside them.
    reduce
        `craig_bampton`, `rubin`, or any function ``(wave, keep, n_modes) -> Structure`` whose first coordinates are the
        dofs `keep` of the wave, as many coordinates in every wave.
    names
        Names of the contacts.

    Returns
    -------
    wheel
        For `System`, which then solves for the gaps of one sector alone.
    gap_operator
        (3 n_contacts, n) from its coordinates to the gaps.

    Raises
    ------
    InputError
        If operators do not fit, dofs of the contacts are not kept, gaps depend on each other in one of the waves, or
        `reduce` returns something else than described.
    """
    own, following = gaps
    n = sector.structure.n
    refuse_reduced("tuned_wheel", sector)
    for operator in (own, following):
        if operator is not None and (operator.shape[1] != n or operator.shape[0] % 3):
            raise input_error(
                "tuned_wheel: gaps",
                f"an operator has shape {operator.shape} for a sector of {n} dofs",
                "Give three rows (t, w, n) a contact.",
            )
    wanted = {excited_wave(engine_order, sector.sectors, h) for h in range(harmonics + 1)}
    place = None if keep is None else kept_places("tuned_wheel", sector, keep)
    if place is not None:
        _refuse_lost_contacts(sector, place, own, following)
    waves: dict[int, Structure] = {}
    operator = own
    for k in sorted(wanted):
        mirror = waves.get(sector.sectors - k)
        if mirror is not None and k > 0:
            waves[k] = _conjugate(mirror)
            continue
        if place is None:
            moving = travelling_wave(sector, k)
        else:
            moving = reduced_wave("tuned_wheel", reduce, sector, k, place, n_modes)
        whole = own if following is None else own + wave(k, sector.sectors).phase * following
        waves[k], operator = in_relative_coordinates(moving, whole @ moving.basis, names)
    if place is not None:
        refuse_unequal("tuned_wheel", waves)
    return TunedWheel(waves, sector.sectors, engine_order, harmonics), operator.real  # ones alone


def _refuse_lost_contacts(
    sector: CyclicSector, place: IntArray, own: Matrix, following: Matrix | None
) -> None:
    """Refuse contacts on dofs that the reduction does not keep: few modes know little of forces there."""
    operators = [own] if following is None else [own, following]
    used = np.unique(np.concatenate([operator.nonzero()[1] for operator in operators]))
    # what lies on the high face moves with its partners on the low one
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


def _conjugate(structure: Structure) -> Structure:
    """Return the wave that travels the other way."""
    parts = (structure.mass, structure.damping, structure.stiffness)
    mass, damping, stiffness = (matrix.conj() for matrix in parts)
    basis = None if structure.basis is None else structure.basis.conj()
    loss = None if structure.loss is None else structure.loss.conj()
    return Structure(mass, damping, stiffness, structure.dofs, structure.sets, basis, loss)
