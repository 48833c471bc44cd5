"""The whole wheel, reduced wave by wave: a model for contacts between its sectors.

Every wave number is reduced on its own, so only matrices of the size of a sector are factorised. Back in physical coordinates
all sectors have the same kept dofs, and the matrices are block-circulant.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.basis import dof_indices, is_hermitian
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.turning import dof_rotation
from stickslip.reduction.waves import to_sectors, to_waves, wave

Reduce = Callable[[Structure, IntArray, int], Structure]
ForceOnWave = Callable[[int, Structure], Feedback]


@dataclass(frozen=True, eq=False)
class ReducedWheel:
    """A wheel reduced to kept dofs and some modes of every sector; `reduced_wheel` makes one.

    Parameters
    ----------
    structure
        The wheel: for each sector the kept dofs in global axes, then modal coordinates. Sets as in `wheel`: ``tip`` of all
        sectors, ``sector3.tip`` of one.
    sector
        The full sector.
    waves
        Reduced travelling waves of the wave numbers 0 to n_s/2, since the others are their conjugates; all wave numbers if complex
        matrices distinguish the two directions.
    to_global
        (m, m) rotation of a sector's coordinates by one pitch.
    """

    structure: Structure
    sector: CyclicSector
    waves: tuple[Structure, ...]
    to_global: FloatArray

    def __repr__(self) -> str:
        """Describe the wheel in a line, without its matrices."""
        own = self.structure.n // self.sector.sectors
        return f"<ReducedWheel: {self.sector.sectors} sectors of {own} coordinates; {self.structure!r}>"

    def expand(self, vector: Matrix) -> Matrix:
        """Return the (n_s, n) displacements of all sectors, each in its own axes, from coordinates of the wheel.

        Parameters
        ----------
        vector
            (N,) real or complex coordinates on `structure`.
        """
        if np.shape(vector) != (self.structure.n,):
            raise input_error(
                "ReducedWheel.expand",
                f"got shape {np.shape(vector)} for {self.structure.n} coordinates",
                "Give one state of the whole wheel.",
            )
        own = self._own_axes(np.asarray(vector).reshape(self.sector.sectors, -1))
        waves = to_waves(own)
        full = np.array([self._expanded(k, waves[k]) for k in range(self.sector.sectors)])
        sectors = to_sectors(full)
        both_ways = len(self.waves) <= self.sector.sectors // 2 + 1
        return sectors.real if both_ways and np.isrealobj(vector) else sectors

    def load(self, force: Matrix, wave_number: int = 0) -> ComplexArray:
        """Return the (N,) load on the wheel's coordinates from a load that travels around it.

        Parameters
        ----------
        force
            (n,) load on the sector's dofs in N, real or complex: sector n carries ``R^n force exp(2πi k n / n_s)``. Forces on the
            cut faces are one sector's share, as in an assembled load.
        wave_number
            k: 0 for a steady centrifugal load, `excited_wave` of an engine order.
        """
        force = np.asarray(force)
        if force.shape != (self.sector.structure.n,):
            raise input_error(
                "ReducedWheel.load: force",
                f"has shape {force.shape} for a sector of {self.sector.structure.n} dofs",
                "Give one number a dof of the sector.",
            )
        own = wave(wave_number, self.sector.sectors)
        reduced = self._projected(own.wave_number, force)
        phases = np.exp(1j * own.phase_angle * np.arange(own.sectors))
        sectors = phases[:, None] * reduced
        turned = [self._turn(n) @ sectors[n] for n in range(own.sectors)]
        return np.concatenate(turned)

    def _own_axes(self, sectors: Matrix) -> Matrix:
        return np.array([self._turn(n).T @ row for n, row in enumerate(sectors)])

    def _turn(self, number: int) -> FloatArray:
        return np.asarray(np.linalg.matrix_power(self.to_global, number))

    def _expanded(self, k: int, coordinates: Matrix) -> Matrix:
        if k < len(self.waves):
            return self.waves[k].expand(coordinates)
        mirrored = self.waves[self.sector.sectors - k]
        return np.conj(mirrored.expand(np.conj(coordinates)))

    def _projected(self, k: int, force: Matrix) -> Matrix:
        if k < len(self.waves):
            return self.waves[k].project(force)
        return np.conj(self.waves[self.sector.sectors - k].project(np.conj(force)))


def reduced_wheel(
    sector: CyclicSector,
    keep: IntArray,
    n_modes: int,
    *,
    reduce: Reduce = craig_bampton,
    feedback: ForceOnWave | None = None,
) -> ReducedWheel:
    """Reduce all travelling waves of a wheel and return to the coordinates of its sectors.

    Parameters
    ----------
    sector
        One sector of a full model.
    keep
        (k,) dofs that stay physical in every sector: contacts between sectors, excitation, outputs; none of
        the high face or on the axis. All components of a node, if the axis rotates them.
    n_modes
        Number of modes kept for every wave number, which is also the number of modal coordinates of every sector.
    reduce
        `craig_bampton`, `rubin`, or any function ``(wave, keep, n_modes) -> Structure`` whose first coordinates are the
        dofs `keep` of the wave, with the same number of coordinates for every wave.
    feedback
        Function from a wave number and the reduced wave to the aerodynamic force on it, whose frozen form is added; None: no force.
        The forces on waves k and n_s − k must be conjugates (`Feedback.conjugate`).

    Returns
    -------
    ReducedWheel
        The reduced wheel; its spectrum is the union of the spectra of the reduced travelling waves.

    Raises
    ------
    InputError
        If a kept dof is not among the coordinates of a travelling wave, or `reduce` does not return the structure described above.

    Notes
    -----
    With the reduced ``A_k`` of wave number k, sectors n and m are coupled by ``Σ_k A_k exp(2πi k (n − m) / n_s) / n_s``
    (Krack, Salles & Thouverez 2017, eq. 41); it is real for real sectors, since ``A_{n_s−k}`` is then the conjugate of ``A_k``.
    """
    refuse_reduced("reduced_wheel", sector)
    keep = dof_indices("reduced_wheel", sector.structure, keep)
    place = kept_places("reduced_wheel", sector, keep)
    half = sector.sectors // 2 + 1
    waves = tuple(reduced_wave("reduced_wheel", reduce, sector, k, place, n_modes) for k in range(half))
    both_ways = all(goes_both_ways(sector, w) for w in waves)
    if not both_ways:
        rest = range(half, sector.sectors)
        waves += tuple(reduced_wave("reduced_wheel", reduce, sector, k, place, n_modes) for k in rest)
    refuse_unequal("reduced_wheel", dict(enumerate(waves)))
    if feedback is not None:
        waves = tuple(feedback(k, own).frozen(own) for k, own in enumerate(waves))
    size = waves[0].n
    turn = np.eye(size)
    if sector.axis is not None:
        table = sector.structure.dofs.take(keep)
        rotation = sector.axis.rotation(sector.pitch)
        turn[: keep.size, : keep.size] = dof_rotation(table, rotation, "reduced_wheel").toarray()

    def physical(name: str) -> Matrix:
        matrix = _circulant([getattr(w, name) for w in waves], sector.sectors, turn)
        return matrix.real if both_ways else matrix

    has_loss = sector.structure.loss is not None

    structure = Structure(
        physical("mass"),
        physical("damping"),
        physical("stiffness"),
        _dofs(sector, waves[0].dofs, keep.size),
        _sets(waves[0], sector.sectors),
        loss=physical("loss") if has_loss else None,
    )
    return ReducedWheel(structure, sector, waves, turn)


def goes_both_ways(sector: CyclicSector, moving: Structure) -> bool:
    """Whether the opposite wave is the conjugate of `moving`, because real matrices do not distinguish the directions."""
    own = (moving.stiffness, moving.mass)
    return not sector.structure.is_complex and all(is_hermitian(matrix) for matrix in own)


def refuse_reduced(who: str, sector: CyclicSector) -> None:
    """Refuse a sector that is a reduced model, since a second reduction would lose its full field."""
    if sector.structure.basis is not None:
        raise input_error(
            f"{who}: sector", "is a reduced model already", "Give the sector of the full model: it is reduced here."
        )


def reduced_wave(
    who: str, reduce: Reduce, sector: CyclicSector, wave_number: int, place: IntArray, n_modes: int
) -> Structure:
    """Return a travelling wave reduced by `reduce`, after checking its result.

    Parameters
    ----------
    who
        Name of the caller, for messages.
    reduce
        Function of reduction, which may be a user's.
    sector, wave_number
        The sector and its wave.
    place
        (k,) coordinates of the wave that must come first in the result.
    n_modes
        Number of modes, passed to `reduce`.

    Raises
    ------
    InputError
        If the result is no structure of the same model, or its first coordinates are not the dofs of `place`.
    """
    moving = travelling_wave(sector, wave_number)
    reduced = reduce(moving, place, n_modes)
    wanted = "Return a Structure whose first coordinates are the dofs `keep`, with a `basis` that leads to the sector."
    if not isinstance(reduced, Structure):
        raise input_error(f"{who}: reduce", f"returned {type(reduced).__name__}", wanted)
    shape = None if reduced.basis is None else reduced.basis.shape
    if shape != (sector.structure.n, reduced.n):
        problem = (
            f"returned a structure of {reduced.n} dofs with a basis of shape {shape} for {sector.structure.n} dofs"
        )
        raise input_error(f"{who}: reduce", problem, wanted)
    rows = reduced.expand(np.eye(reduced.n))[sector.independent[place]]
    if not np.allclose(rows, np.eye(place.size, reduced.n), rtol=0, atol=1e-9):
        problem = "returned a structure whose first coordinates are not the kept dofs in their order"
        raise input_error(f"{who}: reduce", problem, wanted)
    return reduced


def refuse_unequal(who: str, waves: Mapping[int, Structure]) -> None:
    """Refuse waves with different numbers of coordinates: harmonics and sectors could not be assembled."""
    sizes = {k: wave.n for k, wave in waves.items()}
    if len(set(sizes.values())) > 1:
        few, many = min(sizes, key=sizes.__getitem__), max(sizes, key=sizes.__getitem__)
        raise input_error(
            f"{who}: reduce",
            f"left {sizes[few]} coordinates of wave {few} and {sizes[many]} of wave {many}",
            "Give a number of modes, the same for all waves, instead of a frequency or an error.",
        )


def kept_places(who: str, sector: CyclicSector, keep: IntArray) -> IntArray:
    """Return the positions of a sector's kept dofs among the coordinates of a travelling wave."""
    keep = dof_indices(who, sector.structure, keep)
    free = sector.independent
    lost = np.setdiff1d(keep, free)
    if lost.size:
        raise input_error(
            f"{who}: keep",
            f"{sector.structure.dofs.labels[lost[0]]} is on the high face or on the axis, {lost.size} such dofs in all",
            "Keep the partners on the low face.",
        )
    return np.searchsorted(free, keep)


def _circulant(blocks: list[Matrix], sectors: int, turn: FloatArray) -> ComplexArray:
    """Return the matrix of the wheel, in global axes, from its waves 0 to n_s/2 or from all waves."""
    waves = np.array([blocks[k] if k < len(blocks) else np.conj(blocks[sectors - k]) for k in range(sectors)])
    first = np.fft.ifft(waves, axis=0)  # coupling of sector n with sector 0, in sector axes
    size = len(turn)
    turns = [np.linalg.matrix_power(turn, n) for n in range(sectors)]
    matrix = np.empty((sectors, size, sectors, size), dtype=complex)
    for n in range(sectors):
        for m in range(sectors):
            matrix[n, :, m] = turns[n] @ first[(n - m) % sectors] @ turns[m].T
    return np.asarray(matrix.reshape(sectors * size, sectors * size))


def _dofs(sector: CyclicSector, own: Dofs, kept: int) -> Dofs:
    position = np.tile(own.position, (sector.sectors, 1, 1))
    if sector.axis is not None:
        for n in range(sector.sectors):
            position[n, :kept] = sector.axis.turned(own.position[:kept], n * sector.pitch)
    parts = [f"sector{n}.{p}" if p else f"sector{n}" for n in range(sector.sectors) for p in own.part]
    return Dofs(
        np.tile(own.node, sector.sectors), own.component * sector.sectors, position.reshape(-1, 3), tuple(parts)
    )


def _sets(own: Structure, sectors: int) -> dict[str, IntArray]:
    sets = {}
    for name, index in own.sets.items():
        copies = [index + n * own.n for n in range(sectors)]
        sets[name] = np.concatenate(copies)
        sets.update({f"sector{n}.{name}": copy for n, copy in enumerate(copies)})
    return sets
