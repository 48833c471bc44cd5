"""The motion of every node at one point of a response: what a result holds, expanded by the model that it was computed of."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.assembly.everywhere import Everywhere, Nodes, everywhere, nodes_of
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.study.analyses.forced.question import FACTOR
from stickslip.units import HZ

AGREE = 1e-6  # relative, of the outputs: the model is that of the result, not another one
CHANGED = (
    "Files of the model have changed since the run, or the study has: run it again, then export."
)


@dataclass(frozen=True, eq=False)
class Body:
    """The nodes of a part, in one sector, and how they move.

    Parameters
    ----------
    nodes
        Where they are.
    sector
        Counted from 0.
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
    """How everything moves at one point of a response.

    Parameters
    ----------
    label
        Of the case.
    hz
        Frequency.
    harmonics
        Those that move anything, from 0.
    bodies
        Part by part, sector by sector.
    outputs
        Label of each output -> its part and node number.
    sectors
        How many sectors of a wheel there are: 1 or all.
    lag
        Share of the period by which a sector is ahead of the one before it.
    axis
        That sectors are turned about.
    pitch
        Angle of a sector in rad.
    """

    label: str
    hz: float
    harmonics: tuple[int, ...]
    bodies: tuple[Body, ...]
    outputs: dict[str, tuple[str, int]]
    sectors: int
    lag: float
    axis: Axis
    pitch: float


def point_of(data: xr.Dataset, case: int, hz: float | None) -> int:
    """Return the index of the peak of a case, or of its converged point nearest to a frequency.

    Raises
    ------
    InputError
        If there is no such case, or no point of it has converged.
    """
    cases = data.sizes["case"]
    if not 0 <= case < cases:
        remedy = f"Give a number from 0 to {cases - 1}, in the order of [vary]."
        raise input_error("export: case", f"is {case}, and the result has {cases}", remedy)
    values = data["retained_displacement"].values
    solved = np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
    mine = np.flatnonzero((data["point_case"].values == case) & solved)
    if not mine.size:
        raise input_error(
            "export", f"no point of case {case} has converged", "Export another case."
        )
    if hz is None:
        peak = int(data["peak_point"].values[case])
        if peak in mine:
            return peak
        raise input_error("export", f"case {case} has no peak", "Give a frequency: hz = ...")
    every = data["frequency_hz"].values[mine]
    if not every.min() <= hz <= every.max():
        raise input_error(
            "export: hz",
            f"is {hz:g}, and case {case} goes from {every.min():.6g} to {every.max():.6g} Hz",
            "Give a frequency of the response; the nearest point that was computed is taken.",
        )
    return int(mine[np.argmin(np.abs(every - hz))])


def as_complex(values: FloatArray) -> ComplexArray:
    """Return the complex numbers that a result holds as pairs in its last dimension."""
    return np.asarray(values[..., 0] + 1j * values[..., 1])


def motion_of(data: xr.Dataset, model: Model, case: int, point: int, *, wheel: bool) -> Motion:
    """Return how everything moves at a point.

    Parameters
    ----------
    data
        The forced response.
    model
        Of the case.
    case, point
        Position among the cases, and among all points.
    wheel
        Whether all sectors are wanted, not one.

    Raises
    ------
    InputError
        If the model is not that of the result.
    """
    hz = float(data["frequency_hz"].values[point])
    retained = as_complex(data["retained_displacement"].values[point])
    most = int(np.flatnonzero(np.abs(retained).max(axis=1, initial=0.0)).max(initial=1))
    retained = retained[: most + 1]
    reported = as_complex(data["output_displacement"].values[point])[: most + 1]
    labels = [str(label) for label in data["output"].values]
    whole, field = _expanded(data, model, hz, retained, (labels, reported))
    sectors = whole.sectors if wheel else 1
    pitch = 2 * np.pi / whole.sectors
    bodies = tuple(
        _turned(Body(nodes, 0, nodes.of(field)), whole, n, model.axis, pitch * n)
        for n in range(sectors)
        for nodes in nodes_of(model)
    )
    return Motion(
        label=str(data["case_label"].values[case]) if "case_label" in data else "",
        hz=hz,
        harmonics=tuple(h for h in range(most + 1) if np.any(field[h])),
        bodies=bodies,
        outputs=dict(_places(model, whole)),
        sectors=sectors,
        lag=whole.order / whole.sectors % 1.0,
        axis=model.axis,
        pitch=pitch,
    )


def _expanded(
    data: xr.Dataset,
    model: Model,
    hz: float,
    retained: ComplexArray,
    reported: tuple[list[str], ComplexArray],
) -> tuple[Everywhere, ComplexArray]:
    """Return the model with its way back and the motion of all dofs, which has to hold the outputs of the result."""
    most, labels = len(retained) - 1, [str(label) for label in data["retained"].values]
    highest = FACTOR * int(data.attrs.get("high_order", most))
    # how many modes the waves of a wheel keep may depend on the other waves
    ways = [(most, False)]
    ways += [(highest, False), (highest, True)] if model.sectors > 1 else []
    names, wanted = reported
    worst = np.inf
    for harmonics, every_wave in ways:
        whole = everywhere(model, harmonics, every_wave=every_wave)
        if list(whole.system.retained_labels) != labels or not set(names) <= {*whole.output_labels}:
            raise input_error("export", "the model has other contacts or outputs than the result", CHANGED)  # fmt: skip
        field = whole.field(hz * HZ, retained)
        order = [whole.output_labels.index(name) for name in names]
        found = field[:, whole.outputs[order]]
        worst = min(worst, float(np.abs(found - wanted).max() / max(np.abs(wanted).max(), 1e-300)))
        if worst <= AGREE:
            return whole, field
    what = (
        f"the outputs of the model move otherwise than those of the result, by {100 * worst:.2g} %"
    )
    raise input_error("export", what, CHANGED)


def _turned(body: Body, whole: Everywhere, sector: int, axis: Axis, angle: float) -> Body:
    """Return what a body is in another sector."""
    if sector == 0:
        return body
    phases = np.array([whole.phase(h, sector) for h in range(len(body.amplitudes))])
    nodes = replace(body.nodes, points=axis.turned(body.nodes.points, angle))
    moved = phases[:, None, None] * body.amplitudes @ axis.rotation(angle).T
    return Body(nodes, sector, moved)


def _places(model: Model, whole: Everywhere) -> Iterator[tuple[str, tuple[str, int]]]:
    table = model.places.dofs
    for label, dof in zip(whole.output_labels, whole.outputs, strict=True):
        yield label, (table.part[dof], max(int(table.node[dof]), 0))


def numbers_of(motion: Motion) -> tuple[list[IntArray], list[IntArray]]:
    """Return node and cell numbers of each body, from 1, none twice: those of the model's files where they are so, else counted through."""
    nodes = [body.nodes.numbers for body in motion.bodies]
    cells = [body.nodes.cell_numbers for body in motion.bodies]
    return _once(nodes), _once([np.zeros(0, dtype=np.int64) if c is None else c for c in cells])


def _once(numbers: list[IntArray]) -> list[IntArray]:
    every = np.concatenate(numbers)
    if every.size and every.min() >= 1 and np.unique(every).size == every.size:
        return numbers
    counted = np.arange(1, every.size + 1)
    return np.split(counted, np.cumsum([own.size for own in numbers])[:-1])
