"""Motion of every node, recovered from a result."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.assembly.full_field import Everywhere, Felt, Nodes, as_it_is, everywhere, nodes_of
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.harmonic.decaying import DecayingStiffness
from stickslip.model.axis import Axis
from stickslip.study.exchange.chosen import Chosen
from stickslip.study.store.progress import LOG

AGREE = 1e-6  # relative difference of the outputs, above which the model is not the one of the result
CHANGED = "Files of the model have changed since the run, or the study has: run it again, then export."


@dataclass(frozen=True, eq=False)
class Body:
    """Nodes of a part in one sector, and their motion.

    Parameters
    ----------
    nodes
        Nodes with positions.
    sector
        Index of the sector, from 0.
    amplitudes
        (H+1, n, 3) coefficients of ``u(t) = Re Σ U_h exp(i h ω t)`` in m along the global axes.
    """

    nodes: Nodes
    sector: int
    amplitudes: ComplexArray

    def at(self, angle: float) -> FloatArray:
        """Return the vibration (n, 3) in m at an angle ωt, without the mean displacement."""
        h = np.arange(1, len(self.amplitudes))
        turned = np.exp(1j * h * angle)[:, None, None] * self.amplitudes[1:]
        return np.asarray(turned.real.sum(axis=0))

    @property
    def mean(self) -> FloatArray:
        """(n, 3) mean displacement in m."""
        return np.asarray(self.amplitudes[0].real)


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of all parts.

    Parameters
    ----------
    label
        Label of the case.
    hz
        Frequency in Hz.
    harmonics
        Harmonics with nonzero motion, from 0.
    bodies
        Parts in their order, sector by sector.
    outputs
        Label of each output -> its sector, part and node number.
    sectors
        Number of sectors described: 1 or all.
    lag
        Fraction of the period by which a sector leads the previous one; None if each sector has its own motion.
    axis
        Rotation axis of the wheel.
    pitch
        Sector angle in rad.
    """

    label: str
    hz: float
    harmonics: tuple[int, ...]
    bodies: tuple[Body, ...]
    outputs: dict[str, tuple[int, str, int]]
    sectors: int
    lag: float | None
    axis: Axis
    pitch: float


def motion_of(chosen: Chosen, model: Model, *, wheel: bool) -> Motion:
    """Return the motion of all parts.

    Parameters
    ----------
    chosen
        The motion of the result.
    model
        The model of its case.
    wheel
        Whether to return all sectors instead of one; a mistuned wheel always has all.

    Raises
    ------
    InputError
        If the model does not belong to the result.
    """
    whole, fields = expanded(chosen, model.undriven if chosen.free else model)
    sectors = whole.sectors if wheel or not whole.alike else 1
    pitch = 2 * np.pi / whole.sectors
    bodies = tuple(
        _turned(nodes, _of_sector(whole, fields, n), n, model.axis, pitch * n)
        for n in range(sectors)
        for nodes in nodes_of(model)
    )
    return Motion(
        label=chosen.label,
        hz=chosen.hz,
        harmonics=tuple(h for h in range(fields.shape[1]) if np.any(fields[:, h])),
        bodies=bodies,
        outputs=dict(_places(model, whole)),
        sectors=sectors,
        lag=whole.order / whole.sectors % 1.0 if whole.alike else None,
        axis=model.axis,
        pitch=pitch,
    )


def expanded(chosen: Chosen, model: Model) -> tuple[Everywhere, ComplexArray]:
    """Return the assembled model with its expansion to all dofs, and the motion of all dofs of its sectors.

    The outputs must agree with the result.
    """
    # the number of modes kept for a wave may depend on the other waves, so other sets of waves are tried
    ways = [(chosen.orders[0], chosen.wave_number is not None)]
    if model.sectors > 1 and model.mistuning is None and not chosen.free:
        ways += [(chosen.orders[-1], False), (chosen.orders[-1], True)]
    worst = np.inf
    for k, (harmonics, every_wave) in enumerate(ways):
        LOG.info("reducing the model again, with the way back to all nodes" if k == 0 else "with other waves")
        whole = everywhere(model, harmonics, every_wave=every_wave, wave_number=chosen.wave_number)
        more, order = _coordinates(chosen, whole)
        fields = whole.fields(chosen.omega, chosen.retained[:, order], more, _felt(chosen))
        at = whole.outputs[[whole.output_labels.index(name) for name in chosen.outputs]]
        found = fields[at[:, 0], :, at[:, 1]].T
        size = max(np.abs(chosen.reported).max(), 1e-300)
        worst = min(worst, float(np.abs(found - chosen.reported).max() / size))
        if worst <= AGREE:
            return whole, fields
    what = f"the outputs of the model differ from the outputs of the result by {100 * worst:.2g} %"
    raise input_error("export", what, CHANGED)


def _coordinates(chosen: Chosen, whole: Everywhere) -> tuple[IntArray, IntArray]:
    """Return the coordinates not retained by contacts, and the order of the result's coordinates."""
    names = whole.system.structure.dofs.labels
    known = {label: k for k, label in enumerate(chosen.labels)}
    retained = [int(i) for i in whole.system.retained]
    extra = sorted({*known} - {names[i] for i in retained})
    more = np.array([i for i, name in enumerate(names) if name in extra], dtype=np.int64)
    every = np.union1d(retained, more).astype(np.int64)
    if {names[i] for i in every} != {*known} or not {*chosen.outputs} <= {*whole.output_labels}:
        what = "the model has other contacts or outputs than the result"
        raise input_error("export", what, CHANGED)
    return more, np.array([known[names[i]] for i in every], dtype=np.int64)


def _felt(chosen: Chosen) -> Felt:
    """Return the function that gives the linear side of a motion: unchanged, with mass damping, or decaying."""
    if chosen.decays:
        return lambda side: DecayingStiffness(side, chosen.decays)
    if chosen.rate:
        return lambda side: side.with_mass_damping(chosen.rate)
    return as_it_is


def _of_sector(whole: Everywhere, fields: ComplexArray, sector: int) -> ComplexArray:
    """Return the motion (H+1, N) of a sector, in the axes of the first sector rotated to its position."""
    if not whole.alike:
        return np.asarray(fields[sector])
    phases = np.array([whole.phase(h, sector) for h in range(fields.shape[1])])
    return np.asarray(phases[:, None] * fields[0] if sector else fields[0])


def _turned(nodes: Nodes, field: ComplexArray, sector: int, axis: Axis, angle: float) -> Body:
    """Return nodes and motion of a part in a sector."""
    if sector == 0:
        return Body(nodes, 0, nodes.of(field))
    moved = replace(nodes, points=axis.turned(nodes.points, angle))
    return Body(moved, sector, nodes.of(field) @ axis.rotation(angle).T)


def _places(model: Model, whole: Everywhere) -> Iterator[tuple[str, tuple[int, str, int]]]:
    table = model.places.dofs
    for label, (sector, dof) in zip(whole.output_labels, whole.outputs, strict=True):
        yield label, (int(sector), table.part[dof], max(int(table.node[dof]), 0))


def numbers_of(motion: Motion) -> tuple[list[IntArray], list[IntArray]]:
    """Return unique node and cell numbers of each body, from 1: the numbers in the model's files if unique, else consecutive ones."""
    nodes = [body.nodes.numbers for body in motion.bodies]
    cells = [body.nodes.cell_numbers for body in motion.bodies]
    return _once(nodes), _once([np.zeros(0, dtype=np.int64) if c is None else c for c in cells])


def _once(numbers: list[IntArray]) -> list[IntArray]:
    every = np.concatenate(numbers)
    if every.size and every.min() >= 1 and np.unique(every).size == every.size:
        return numbers
    counted = np.arange(1, every.size + 1)
    return np.split(counted, np.cumsum([own.size for own in numbers])[:-1])
