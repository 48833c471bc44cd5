"""What is computed for one travelling wave: its modes at a speed, or its branches over a range of speeds."""

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.model.gyroscopic import gyroscopic_modes
from stickslip.model.modes import normal_modes
from stickslip.reduction.waves import excited_wave
from stickslip.response.campbell import campbell
from stickslip.response.nodal_diameters import NodalDiameterMap
from stickslip.response.safe import Safe, safe
from stickslip.study.speed_basis import speed_basis
from stickslip.study.structure_model import DiskModel
from stickslip.study.structure_results import WaveBranches, WaveModes
from stickslip.study.structure_tables import CampbellTable, SafeTable


def waves_of_modes(diameters: Sequence[int] | None, model: DiskModel, speed: float) -> list[int]:
    """Return the wave numbers of nodal diameters (all if None); forward waves too where Coriolis forces part them."""
    half = model.sectors // 2
    found = sorted(range(half + 1) if diameters is None else diameters)
    if model.rotation.coriolis and speed > 0 and model.rotating is not None:
        found += [model.sectors - d for d in reversed(found) if 0 < 2 * d < model.sectors]
    return found


def waves_of_campbell(table: CampbellTable, model: DiskModel) -> list[int]:
    """Return the wave numbers of the nodal diameters asked for; else those that the engine orders excite."""
    if table.nodal_diameters is not None:
        return waves_of_modes(table.nodal_diameters, model, 1.0)
    return sorted({_diagram(m, model) for m in table.engine_orders})


def _diagram(engine_order: int, model: DiskModel) -> int:
    """Return the wave number in whose diagram an engine order has its crossings."""
    wave = excited_wave(engine_order, model.sectors)
    # without Coriolis forces both directions have the same frequencies, and one diagram
    return wave if model.rotation.coriolis else min(wave, model.sectors - wave)


def solve_wave(
    model: DiskModel, speed: float, wave_number: int, n_modes: int, *, shapes: bool
) -> WaveModes:
    """Return the lowest modes of a wave at a speed in rad/s.

    Raises
    ------
    InputError
        If the wave has fewer modes.
    """
    began = perf_counter()
    structure = model.at(speed, wave_number)
    if model.rotation.coriolis and speed > 0 and model.rotating is not None:
        turning = gyroscopic_modes(structure, n_modes)
        hertz, vectors = turning.frequencies_hz, turning.shapes
    else:
        modes = normal_modes(structure, n_modes)
        hertz, vectors = modes.frequencies_hz, np.asarray(modes.shapes, dtype=complex)
    moved = np.zeros((n_modes, 0, 3), dtype=complex)
    if shapes:
        moved = _unit(model.on_skin(np.asarray(structure.expand(vectors), dtype=complex)))
    return WaveModes(wave_number, hertz, moved, perf_counter() - began)


def _unit(shapes: ComplexArray) -> ComplexArray:
    """Return shapes (m, n, 3) whose largest displacement has length 1 and is real along its largest component."""
    out = np.zeros_like(shapes)
    for i, shape in enumerate(shapes):
        length = np.linalg.norm(shape, axis=1)
        top = int(length.argmax())
        if length[top] > 0:
            leading = shape[top, np.abs(shape[top]).argmax()]
            out[i] = shape * (abs(leading) / leading / length[top])
    return out


def follow_wave(
    model: DiskModel,
    wave_number: int,
    table: CampbellTable,
    speeds: FloatArray,
) -> WaveBranches:
    """Return the branches of a wave over `speeds` (rad/s) and their crossings with the engine orders that excite it."""
    began = perf_counter()
    orders = [m for m in table.engine_orders if _diagram(m, model) == wave_number]
    coriolis = model.rotation.coriolis
    small = speed_basis(
        lambda speed: model.at(speed, wave_number),
        (float(speeds[0]), float(speeds[-1])),
        table.modes,
        coriolis=coriolis,
    )
    found = campbell(small.at, speeds, table.modes, orders, coriolis=coriolis)
    crossings = found.crossings
    return WaveBranches(
        wave_number,
        found.frequencies_hz,
        np.array([c.engine_order for c in crossings], dtype=np.int64),
        np.array([c.mode for c in crossings], dtype=np.int64),
        np.array([c.speed for c in crossings]),
        np.array([c.frequency_hz for c in crossings]),
        small.error,
        perf_counter() - began,
    )


def interference(
    waves: Sequence[WaveModes], model: DiskModel, table: SafeTable, speed: float
) -> Safe:
    """Return what the engine orders meet at a speed in rad/s."""
    known = {w.wave_number: w.frequencies_hz for w in waves}
    half = model.sectors // 2
    diameters = np.arange(half + 1)
    backward = np.array([known[int(d)] for d in diameters])
    forward = np.array([known.get(model.sectors - int(d), known[int(d)]) for d in diameters])
    found = NodalDiameterMap(model.sectors, diameters, backward, forward)
    return safe(found, speed, table.engine_orders, margin=table.margin_percent / 100)
