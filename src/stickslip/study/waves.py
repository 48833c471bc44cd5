"""What is computed for one travelling wave: its modes at a speed, or its branches over a range of speeds."""

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.model.gyroscopic import gyroscopic_modes
from stickslip.model.modes import normal_modes
from stickslip.reduction.speed_basis import speed_basis
from stickslip.reduction.waves import excited_wave
from stickslip.response.rotating.campbell import campbell
from stickslip.response.rotating.nodal_diameters import NodalDiameterMap
from stickslip.response.rotating.safe import Safe, safe
from stickslip.study.structure_doubts import unfollowed_from
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


def unfollowed_orders(
    waves: Sequence[WaveBranches], model: DiskModel, table: CampbellTable, speeds: FloatArray
) -> list[tuple[int, float]]:
    """Return engine orders that leave all followed modes of their wave below them, and the speed in rpm from which they do."""
    known = {w.wave_number: w.frequencies_hz for w in waves}
    found = []
    for order in sorted(table.engine_orders):
        hertz = known.get(_diagram(order, model))
        rpm = None if hertz is None else unfollowed_from(order, hertz, speeds)
        if rpm is not None:
            found.append((order, rpm))
    return found


def unseen_orders(numbers: Sequence[int], model: DiskModel, table: CampbellTable) -> list[int]:
    """Return engine orders whose wave is not among those that are followed."""
    return sorted(m for m in table.engine_orders if _diagram(m, model) not in numbers)


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
    growth = _growth(model, speed, wave_number, hertz, vectors)
    return WaveModes(wave_number, hertz, moved, growth, perf_counter() - began)


def _growth(
    model: DiskModel, speed: float, wave_number: int, hertz: FloatArray, vectors: Matrix
) -> FloatArray:
    """Return the (m,) derivatives of ω² by Ω²: of ``φᴴ (K + iωD − ω²M) φ = 0``, whose φ counts to second order only."""
    if model.rotating is None or speed == 0:
        return np.zeros(len(hertz))
    x = speed**2
    here, low, high = (model.at(np.sqrt(f * x), wave_number) for f in (1.0, 0.5, 1.5))

    def form(matrix: Matrix) -> ComplexArray:
        return np.asarray(np.sum(vectors.conj() * (matrix @ vectors), axis=0), dtype=complex)

    # the stiffness has degree two in Ω², so that the central difference is exact
    by_x = form((high.stiffness - low.stiffness) / x)
    mass, omega = form(here.mass), 2 * np.pi * hertz
    if not model.rotation.coriolis:
        return np.asarray((by_x / mass).real)
    # Coriolis terms grow with Ω; what is left of the damping dissipates, and does not count here
    turning = 1j * (form(here.damping) - form(here.damping.conj().T)) / 2
    by_omega = 2 * omega * mass - turning
    return np.asarray((2 * omega * (by_x + omega * turning / (2 * x)) / by_omega).real)


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
    growth = {w.wave_number: w.growth for w in waves}

    def of_wave(number: int) -> FloatArray:
        return growth.get(number, growth.get(model.sectors - number, np.zeros(0)))

    margin = table.margin_percent / 100
    return safe(found, speed, table.engine_orders, margin=margin, growth=of_wave)
