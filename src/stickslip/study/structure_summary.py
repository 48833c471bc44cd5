"""What the commands for bladed disks print at their end: tables of text."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.response.rotating.safe import Interference, Safe
from stickslip.study.static_state import StaticState
from stickslip.study.structure_results import WaveBranches, WaveModes
from stickslip.study.structure_store import RPM, wave_name

MOST_PAIRS = 30  # of an interference table on the screen
NEARBY = 0.2  # margin up to which the tangent of a frequency over the speed is good to a digit after the point


@dataclass(frozen=True)
class TextTable:
    """A table as text.

    Parameters
    ----------
    title
        Its heading.
    head
        Names of the columns.
    rows
        Cells.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class StructureSummary:
    """What a command prints at its end.

    Parameters
    ----------
    tables
        To print.
    warnings
        In words.
    result
        The result's file.
    files
        All files of the run.
    """

    tables: tuple[TextTable, ...]
    warnings: tuple[str, ...]
    result: Path
    files: tuple[Path, ...]


def modes_tables(
    waves: Sequence[WaveModes], reference: FloatArray | None, sectors: int, rpm: float
) -> tuple[TextTable, ...]:
    """Return the natural frequencies at a speed, and their differences from the reference."""
    n = waves[0].frequencies_hz.size
    head = ("wave", "kind", *(f"{m + 1}" for m in range(n)))
    parted = any(2 * w.wave_number > sectors for w in waves)
    names = [_names(w.wave_number, sectors, parted=parted) for w in waves]
    rows = tuple(
        (*name, *(f"{f:.7g}" for f in w.frequencies_hz))
        for name, w in zip(names, waves, strict=True)
    )
    tables = [TextTable(f"Natural frequencies in Hz {at_speed(rpm)}", head, rows)]
    if reference is not None:
        off = np.array([w.frequencies_hz for w in waves]) / reference - 1
        worst = np.unravel_index(np.nanargmax(np.abs(off)), off.shape)
        title = (
            f"Relative differences from the reference; the largest is {off[worst]:.2e} "
            f"({names[worst[0]][0]}, mode {worst[1] + 1})"
        )
        rows = tuple(
            (*name, *(f"{d:.1e}" if np.isfinite(d) else "-" for d in row))
            for name, row in zip(names, off, strict=True)
            if np.isfinite(row).any()
        )
        tables.append(TextTable(title, head, rows))
    return tuple(tables)


def campbell_tables(
    waves: Sequence[WaveBranches], speeds: FloatArray, sectors: int
) -> tuple[TextTable, ...]:
    """Return frequencies at the ends of the speed range, and the crossings by speed."""
    ends = (f"{speeds[0] / RPM:g} rpm", f"{speeds[-1] / RPM:g} rpm")
    parted = any(2 * w.wave_number > sectors for w in waves)
    rows = tuple(
        (
            _label(w.wave_number, sectors, parted),
            f"{m + 1}",
            f"{branch[0]:.6g}",
            f"{branch[-1]:.6g}",
        )
        for w in waves
        for m, branch in enumerate(w.frequencies_hz.T)
    )
    first = TextTable("Frequencies in Hz", ("wave", "mode", *ends), rows)
    crossings = sorted(
        (
            float(speed),
            float(hertz),
            int(order),
            _label(w.wave_number, sectors, parted),
            int(mode) + 1,
        )
        for w in waves
        for speed, hertz, order, mode in zip(
            w.speeds, w.crossings_hz, w.engine_orders, w.modes, strict=True
        )
    )
    found = tuple(
        (f"{speed / RPM:.1f}", f"{hertz:.2f}", f"{order}", name, f"{mode}")
        for speed, hertz, order, name, mode in crossings
    )
    head = ("rpm", "Hz", "engine order", "wave", "mode")
    return first, TextTable("Crossings with engine orders that excite the mode", head, found)


def safe_tables(found: Safe) -> tuple[TextTable, ...]:
    """Return the pairs of engine order and mode, the nearest first."""
    near = len(found.resonances)
    rpm = found.speed_range[0] / RPM
    shown = found.points[: max(MOST_PAIRS, near)]
    table = found.frequencies
    parted = not np.array_equal(table.frequencies_hz, table.forward_hz)
    rows = tuple(
        (
            f"{p.engine_order}", _label(p.wave_number, table.sectors, parted), f"{p.mode + 1}", f"{p.frequency_hz:.6g}",
            *_meeting(p),
            _verdict(p, found),
        )
        for p in shown
    )  # fmt: skip
    title = f"At {rpm:g} rpm: {near} near resonances within {100 * found.allowed:g} %"
    if len(shown) < len(found.points):
        title += f"; the nearest {len(shown)} of {len(found.points)} pairs"
    head = (
        "engine order",
        "wave",
        "mode",
        f"Hz at {rpm:g} rpm",
        "resonance at rpm",
        "margin %",
        "",
    )
    return (TextTable(title, head, rows),)


def _meeting(point: Interference) -> tuple[str, str]:
    """Write the speed of a resonance and its margin; far from the speed they are extrapolated too far for more digits."""
    rpm, percent = point.speed / RPM, 100 * point.margin
    if not np.isfinite(rpm):
        return "never", "-"
    if abs(point.margin) > NEARBY:
        return f"~{float(f'{rpm:.2g}'):.0f}", f"{percent:+.0f}"
    return f"{rpm:.1f}", f"{percent:+.2f}"


def _verdict(point: Interference, found: Safe) -> str:
    if abs(point.margin) <= found.allowed:
        return "NEAR"
    return "order not judged" if point.engine_order in found.not_judged else "clear"


def static_table(state: StaticState | None) -> tuple[TextTable, ...]:
    """Return what the centrifugal load does, or nothing where nothing turns."""
    if state is None:
        return ()
    head = ("rpm", "largest displacement mm", "largest strain %", "largest rotation deg")
    cells = (
        f"{state.rpm:g}",
        f"{1e3 * state.displacement:.4g}",
        f"{100 * state.strain:.3g}",
        f"{np.degrees(state.rotation):.3g}",
    )
    return (TextTable("Static displacement under the centrifugal load", head, (cells,)),)


def at_speed(rpm: float) -> str:
    """Return a speed in words."""
    return f"at {rpm:g} rpm" if rpm else "at rest"


def _names(number: int, sectors: int, *, parted: bool = True) -> tuple[str, str]:
    """Return the name of a wave and its kind; where nothing parts the directions, both have the frequencies."""
    diameter, kind = wave_name(number, sectors)
    if sectors == 1:
        return "whole", ""
    return f"ND {diameter}", kind if parted or kind == "standing" else "both ways"


def _label(number: int, sectors: int, parted: bool) -> str:
    """Return the name of a wave, with its direction where that matters."""
    name, kind = _names(number, sectors)
    return f"{name} {kind}" if parted and kind in ("backward", "forward") else name
