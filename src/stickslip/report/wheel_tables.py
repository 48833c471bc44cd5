"""Tables and boxes of the pages of bladed disks, as HTML."""

import json
from collections.abc import Mapping
from html import escape

import numpy as np

from stickslip.report.page_parts import versions
from stickslip.report.quantities import NONE, counted, fixed, number, percent, quantity
from stickslip.report.tables import html_table
from stickslip.report.wheel_result import WheelResult

_SHOWN = 60  # rows of a table on the page; the rest is in the file


def cards(results: Mapping[str, WheelResult]) -> str:
    """Return the boxes at the top: what came out, in one number each."""
    found = []
    if "modes" in results:
        hz = results["modes"].floats("frequency_hz")
        waves = (
            counted(len(hz), "nodal diameter")
            if results["modes"].sectors > 1
            else "a whole structure"
        )
        found.append(
            (f"{number(hz.min(), 5)} Hz", "lowest natural frequency", f"{hz.size} modes, {waves}")
        )
    if "campbell" in results:
        n = int(results["campbell"].data.sizes.get("crossing", 0))
        found.append((str(n), "crossings with engine orders", _speeds(results["campbell"])))
    if "safe" in results:
        result = results["safe"]
        near = int(result.integers("pair_near").sum())
        margin, rpm = number(result.scalar("margin_percent")), number(result.scalar("speed_rpm"), 5)
        found.append((str(near), f"near resonances at {rpm} rpm", f"margin {margin} %"))
    if "modes" in results and results["modes"].has("difference"):
        off = np.abs(results["modes"].floats("difference"))
        found.append(
            (percent(100 * float(np.nanmax(off))), "largest difference from the reference",
             f"of {np.count_nonzero(np.isfinite(off))} frequencies")
        )  # fmt: skip
    boxes = "".join(
        f'<div class="card"><b>{big}</b><span>{what}</span><small>{more}</small></div>'
        for big, what, more in found
    )
    return f'<div class="cards">{boxes}</div>'


def _speeds(result: WheelResult) -> str:
    rpm = result.floats("speed_rpm")
    return f"{number(float(rpm.min()), 5)} to {number(float(rpm.max()), 5)} rpm"


def notes(results: Mapping[str, WheelResult]) -> str:
    """Return the warnings of all runs, and what was not finished."""
    lines = []
    for command, result in results.items():
        if result.scalar("complete", 1) == 0:
            lines.append(f"{command}: interrupted; the same command goes on.")
        stored = json.loads(result.text("warnings", "[]"))
        lines += [str(line) for line in stored]
    items = "".join(f"<li>{escape(line)}</li>" for line in dict.fromkeys(lines))
    return f'<div class="box bad"><b>Warnings</b><ul>{items}</ul></div>' if items else ""


def model_facts(result: WheelResult) -> str:
    """Return mass, centre, size and counts of the model."""
    low, high = result.numbers("box_low_m"), result.numbers("box_high_m")
    each = " of a sector" if result.sectors > 1 else ""
    rows = [
        [f"mass{each}", quantity(1e3 * result.scalar("mass_kg"), "g", 6)],
        [f"centre of mass{each}", _lengths(result.numbers("centre_m"))],
        ["box from", _lengths(low)],
        ["box to", _lengths(high)],
        ["free degrees of freedom", fixed(result.scalar("dofs"), 0)],
        [
            "nodes, elements",
            f"{fixed(result.scalar('nodes'), 0)}, {fixed(result.scalar('elements'), 0)}",
        ],
        ["rotation", escape(result.text("rotation"))],
        *_static(result),
    ]
    if result.sectors > 1:
        rows.insert(0, ["sectors", str(result.sectors)])
        wheel = result.sectors * result.scalar("mass_kg")
        rows.insert(2, ["mass of the wheel", quantity(1e3 * wheel, "g", 6)])
    return html_table([], rows, numeric=False)


def _static(result: WheelResult) -> list[list[str]]:
    """Return what the centrifugal load does, where something turns."""
    displacement = result.scalar("static_displacement_m")
    if not np.isfinite(displacement):
        return []
    rpm = number(result.scalar("static_rpm"), 5)
    strain, degrees = (
        result.scalar("static_strain"),
        np.degrees(result.scalar("static_rotation_rad")),
    )
    return [
        [f"largest static displacement at {rpm} rpm", f"{number(1e3 * displacement, 4)} mm"],
        ["with strains and rotations up to", f"{percent(100 * strain, 3)}, {number(degrees, 3)}°"],
    ]


def _lengths(values: np.ndarray) -> str:
    if values.size != 3 or not np.isfinite(values).all():
        return NONE
    return f"({', '.join(number(float(v) * 1e3, 5) for v in values)}) mm"


def frequencies(result: WheelResult) -> str:
    """Return the natural frequencies: a row a wave, a column a mode."""
    hz = result.floats("frequency_hz")
    head = ["wave", *(f"mode {m + 1} (Hz)" for m in range(hz.shape[1]))]
    # where nothing parts the directions, both have the frequencies
    parted = len(set(result.integers("nodal_diameter"))) < len(hz)
    kinds = [
        str(kind) if parted or kind == "standing" else "both ways"
        for kind in result.data["wave_kind"].values
    ]
    rows = [
        [
            f"{escape(name)}, {escape(str(kind))}" if result.sectors > 1 else name,
            *(number(f, 7) for f in row),
        ]
        for name, kind, row in zip(result.waves, kinds, hz, strict=True)
    ]
    return html_table(head, rows)


def comparison(result: WheelResult) -> str:
    """Return the relative differences from the reference, a row a wave."""
    off = result.floats("difference")
    known = np.abs(off[np.isfinite(off)])
    if not known.size:
        return "<p>The reference has none of these frequencies.</p>"
    head = ["wave", *(f"mode {m + 1}" for m in range(off.shape[1]))]
    rows = [
        [escape(name), *(_share(float(d)) for d in row)]
        for name, row in zip(result.waves, off, strict=True)
        if np.isfinite(row).any()
    ]
    worst = np.unravel_index(np.nanargmax(np.abs(off)), off.shape)
    text = (
        f"<p>{counted(known.size, 'frequency').replace('frequencys', 'frequencies')} compared; the largest relative difference is "
        f"{_share(float(off[worst]))}, at {escape(result.waves[worst[0]])}, mode {worst[1] + 1}.</p>"
    )
    return text + html_table(head, rows)


def _share(value: float) -> str:
    """Write a relative difference, in parts of a million where it is small."""
    if not np.isfinite(value):
        return NONE
    return f"{number(1e6 * value)} ppm" if abs(value) < 1e-4 else percent(100 * value, 3)


def crossings(result: WheelResult) -> str:
    """Return the crossings of a Campbell diagram in the order of speed."""
    if not result.has("crossing_speed_rpm"):
        return "<p>No engine order meets a mode that it excites within the speeds.</p>"
    names, rpm = result.waves, result.floats("crossing_speed_rpm")
    order, hz = result.integers("crossing_engine_order"), result.floats("crossing_frequency_hz")
    wave, mode = result.integers("crossing_wave"), result.integers("crossing_mode")
    rows = [
        [number(float(rpm[i]), 6), number(float(hz[i]), 6), f"{order[i]}", escape(names[wave[i]]), str(mode[i] + 1)]
        for i in np.argsort(rpm, kind="stable")
    ]  # fmt: skip
    head = ["speed (rpm)", "frequency (Hz)", "engine order", "wave", "mode"]
    return html_table(head, rows[:_SHOWN]) + _left_out(len(rows), "crossings")


def interference(result: WheelResult) -> str:
    """Return the pairs of engine order and mode, the nearest first."""
    names = result.waves
    margin = result.floats("pair_margin")
    columns = ("pair_engine_order", "pair_wave", "pair_mode", "pair_near")
    order, wave, mode, near = (result.integers(name) for name in columns)
    own, excitation = result.floats("pair_frequency_hz"), result.floats("pair_excitation_hz")
    judged = result.integers("pair_judged") if result.has("pair_judged") else np.ones_like(near)
    meeting = np.full(len(margin), np.nan)
    if result.has("pair_resonance_rpm"):
        meeting = result.floats("pair_resonance_rpm")
    rows = []
    for i in np.argsort(np.abs(margin), kind="stable"):
        verdict = "near resonance" if near[i] else "clear" if judged[i] else "order not judged"
        rows.append(
            [f"{order[i]}", escape(names[wave[i]]), str(mode[i] + 1), number(float(own[i]), 6),
             number(float(excitation[i]), 6), _rpm(float(meeting[i]), float(margin[i])),
             percent(100 * float(margin[i]), 3) if np.isfinite(margin[i]) else NONE, f"<b>{verdict}</b>" if near[i] else verdict]
        )  # fmt: skip
    at = f"at {number(result.scalar('speed_rpm'), 5)} rpm"
    head = [
        "engine order",
        "wave",
        "mode",
        f"mode {at} (Hz)",
        f"excitation {at} (Hz)",
        "resonance at (rpm)",
        "margin in speed",
        "",
    ]
    return html_table(head, rows[:_SHOWN]) + _left_out(len(rows), "pairs")


def _rpm(value: float, margin: float) -> str:
    """Write the speed of a resonance; far from the operating speed it is extrapolated too far for many digits."""
    if not np.isfinite(value):
        return "never" if np.isinf(value) else NONE
    return number(value, 6) if abs(margin) <= 0.2 else f"~{float(f'{value:.2g}'):.0f}"


def _left_out(n: int, word: str) -> str:
    return f"<p>The other {n - _SHOWN} {word} are in the result file.</p>" if n > _SHOWN else ""


def provenance(results: Mapping[str, WheelResult]) -> str:
    """Say who made each result, with what, from which study."""
    parts = []
    for command, result in results.items():
        rows = [
            ["file", escape(result.path.name)],
            ["created", escape(result.text("created", NONE))],
            ["wall time", quantity(result.scalar("wall_seconds"), "s")],
            ["model", f"<code>{escape(result.text('model_hash', NONE)[:16])}</code>"],
            ["stickslip", escape(result.text("stickslip_version", NONE))],
        ]
        rows += [[escape(k), escape(v)] for k, v in versions(result.text("versions", "{}")).items()]
        study = escape(result.text("study_toml"))
        parts.append(
            f"<details><summary>stickslip {escape(command)}</summary>{html_table([], rows, numeric=False)}<pre>{study}</pre></details>"
        )
    return "".join(parts)
