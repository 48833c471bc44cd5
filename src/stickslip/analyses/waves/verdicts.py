"""Verdicts on the analyses by waves, and their terminal tables."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.columns import record_of, told_apart
from stickslip.analyses.operation import of_resonances
from stickslip.analyses.waves.records import (
    Campbell,
    Flutter,
    Interference,
    Modes,
    OfWaves,
    Pair,
    Wave,
    WaveBranches,
    WaveFlutter,
    WheelMode,
    hertz,
    is_parted,
    label,
    labels,
    stages,
    states_that_differ,
    with_contacts,
)
from stickslip.analyses.waves.tables import FlutterTable
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.assembly.statics import MOST_DISPLACEMENT, MOST_ROTATION, MOST_STRAIN, StaticState
from stickslip.report.quantities import counted
from stickslip.response.rotating.flutter import damping_ratio
from stickslip.response.rotating.safe import Safe
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM, millimetres

BASIS_ERROR = 1e-4  # relative, of frequencies in a Campbell diagram, above which there is a warning
APART = 0.1  # difference of energy method and eigenvalue over the largest damping, above which there is a doubt
PERCENT = 100.0
FLUTTERS = "The wheel flutters: friction may limit the vibration, more damping or another blade prevent it."
MORE = "Add damping, or change the blade."
MOST_ROWS = 40  # modes of a mistuned wheel on the screen
LEAST = 5  # least damped modes of a mistuned wheel on the screen
MOST_PAIRS = 30  # rows of an interference table on the screen
NEARBY = 0.2  # largest margin at which the tangent of a frequency over speed justifies digits after the point


WAVES = ("modes", "campbell", "flutter", "safe")  # tables of these analyses


def contact_notes(settings: Any) -> tuple[Verdict, ...]:
    """Note that analyses of one study hold the contacts of the model differently."""
    asked = {name: getattr(settings, name, None) for name in WAVES}
    why = states_that_differ({name: own.contacts for name, own in asked.items() if own is not None})
    remedy = "Give them the same `contacts` to compare frequencies."
    return (Verdict("trusted", why=why, remedy=remedy),) if why else ()


def basis_doubts(waves: Sequence[WaveBranches]) -> tuple[Verdict, ...]:
    """Doubt a Campbell diagram whose reduced basis is too small."""
    remedy = "Ask for more campbell.modes, or for a narrower range of speeds."
    poor = [w for w in waves if not w.error <= BASIS_ERROR]
    said = [
        f"wave number {w.wave_number}: frequencies between the speeds of the basis are off by up to {w.error:.1e}, relative"
        for w in poor
    ]
    return tuple(Verdict("doubtful", why=why, remedy=remedy) for why in said)


def static_doubts(state: StaticState | None, *, contacts: bool = False) -> tuple[Verdict, ...]:
    """Doubt centrifugal displacements too large for linear statics; they lack the restraint of `contacts`, if any."""
    if state is None or not state.too_large:
        return ()
    alone = ", without the restraint of contacts," if contacts else ""
    why = f"frequencies at {state.speed / RPM:g} rpm are in doubt, as the static displacement{alone} is too large for linear statics: up to {millimetres(state.displacement)} at a radius of {millimetres(state.radius)} (limit {100 * MOST_DISPLACEMENT:g} % of the radius), strains up to {100 * state.strain:.3g} % (limit {100 * MOST_STRAIN:g} %), rotations up to {state.rotation:.3g} rad (limit {MOST_ROTATION:g} rad)"
    remedy = "Check the speed (rpm), the material (Young's modulus in Pa, density in kg/m3) and the supports."
    return (Verdict("doubtful", why=why, remedy=remedy),)


def safe_doubts(found: Safe) -> tuple[Verdict, ...]:
    """Doubt engine orders above the computed modes of their nodal diameters, and state the number of modes needed."""
    orders = found.not_judged
    if not orders:
        return ()
    sectors, per_order = found.frequencies.sectors, found.speed_range[1] / HZ
    highest = {m: float(found.frequencies.of_wave(m).max()) for m in orders}
    n_modes = found.frequencies.frequencies_hz.shape[1]
    ratio = max(m * per_order * (1 + found.allowed) / max(highest[m], 1e-300) for m in orders)
    diameters = {min(m % sectors, -m % sectors) for m in orders}
    excited = [m * per_order for m in orders]
    why = f"engine orders {in_ranges(orders)} are not judged; with the margin they excite nodal diameters {in_ranges(diameters)} at {_span(excited)} Hz, above the highest computed modes ({_span(list(highest.values()))} Hz)"
    remedy = f"Raise safe.modes, now {n_modes}, to {_more(n_modes, ratio)} or more."
    return (Verdict("doubtful", why=why, remedy=remedy, not_judged=f"EO {in_ranges(orders)}"),)


def campbell_doubts(
    unfollowed: Sequence[tuple[int, float]], unseen: Sequence[int], waves: Sequence[WaveBranches]
) -> tuple[Verdict, ...]:
    """Doubt engine orders above the followed modes, and engine orders that excite nodal diameters left out.

    Parameters
    ----------
    unfollowed
        Engine order, and speed in rpm above which it lies over all followed modes that it excites.
    unseen
        Engine orders whose nodal diameter has no diagram.
    waves
        All waves with a diagram.
    """
    said = []
    if unfollowed:
        named = ", ".join(f"{m} (from {rpm:.4g} rpm)" for m, rpm in unfollowed)
        n_modes = waves[0].frequencies_hz.shape[1]
        why = (
            f"above the followed modes of the nodal diameters that they excite, engine orders are not judged: {named}; other "
            "modes may cross them there"
        )
        short = ", ".join(f"EO {m} above {rpm:.4g} rpm" for m, rpm in unfollowed)
        said.append((why, f"Raise campbell.modes, now {n_modes}.", short))
    if unseen:
        why = (
            f"engine orders {in_ranges(unseen)} have no crossings here, because campbell.nodal_diameters leaves out the nodal "
            "diameters that they excite"
        )
        remedy = "Add their nodal diameters to campbell.nodal_diameters, or leave this key out."
        said.append((why, remedy, f"EO {in_ranges(unseen)}"))
    return tuple(Verdict("doubtful", why=why, remedy=remedy, not_judged=short) for why, remedy, short in said)


def in_operation(found: Campbell) -> Iterator[Verdict]:
    """Note the crossings within the operating speeds, or the margin of the nearest one; doubt speeds outside the diagram."""
    own, rpm = found.operating, found.speeds_rpm
    if own.unit == "rpm" and (own.lowest < rpm.min() or own.highest > rpm.max()):
        why = f"the operating speeds, {own}, reach beyond the diagram, {rpm.min():.5g} to {rpm.max():.5g} rpm"
        yield Verdict("doubtful", why=why, remedy="Widen campbell.speeds_rpm.")
    yield from of_resonances(own, found.met, "crossing")


def safe_in_operation(found: Interference) -> Iterator[Verdict]:
    """Note the resonances within the operating range, or the margin of the nearest one; doubt a diagram of another speed."""
    own, rpm = found.operating, found.speed_rpm
    if own.known and own.unit == "rpm" and rpm is not None and own.margin(rpm):
        why = f"the diagram is drawn at {rpm:.5g} rpm, {own.where(rpm)} the operating speeds, {own}: frequencies there are extrapolated"
        yield Verdict("doubtful", why=why, remedy="Give safe.speed_rpm a speed at which the machine runs.")
    yield from of_resonances(own, found.met, "resonance")


def unfollowed_from(order: int, hertz: FloatArray, speeds: FloatArray) -> float | None:
    """Return the speed in rpm above which an engine order lies over all modes; None if there is none in the range.

    Parameters
    ----------
    order
        Engine order.
    hertz
        (s, m) frequencies of the wave that it excites.
    speeds
        (s,) in rad/s, ascending.
    """
    # squares of frequencies are nearly straight in the square of the speed
    above = (order * speeds / HZ) ** 2 - hertz.max(axis=1) ** 2
    where = np.flatnonzero(above > 0)
    if not where.size:
        return None
    first, squares = int(where[0]), (speeds / RPM) ** 2
    if first == 0:
        return float(np.sqrt(squares[0]))
    share = above[first - 1] / (above[first - 1] - above[first])
    return float(np.sqrt(squares[first - 1] + share * (squares[first] - squares[first - 1])))


def in_ranges(numbers: Sequence[int] | set[int]) -> str:
    """Write whole numbers with ranges for three or more in a row: 1, 2, 5-9."""
    runs: list[list[int]] = []
    for number in sorted(set(numbers)):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    words = []
    for run in runs:
        words += [f"{run[0]}-{run[-1]}"] if len(run) > 2 else [str(n) for n in run]
    return ", ".join(words)


def _more(n_modes: int, ratio: float) -> int:
    """Estimate the number of modes up to `ratio` times the highest frequency, in proportion to frequency as for blades."""
    return max(n_modes + 1, math.ceil(n_modes * min(ratio, 100.0)))


def _span(values: Sequence[float]) -> str:
    low, high = f"{min(values):.4g}", f"{max(values):.4g}"
    return low if low == high else f"{low} to {high}"


def unstable_wheel(eigenvalues: ComplexArray, asked: FlutterTable) -> list[Verdict]:
    """Report a mistuned wheel with less damping than required; its least damped mode comes first."""
    damping = damping_ratio(eigenvalues)
    if damping[0] >= asked.required_percent / PERCENT:
        return []
    grows = int(np.count_nonzero(damping < 0))
    what = f"{grows} of its modes grow" if grows else f"it has less than the {asked.required_percent:g} % required"
    why = f"the wheel whose sectors differ has a least damping of {PERCENT * damping[0]:.4g} % at {eigenvalues[0].imag / HZ:.5g} Hz: {what}"
    return [Verdict("trusted", why=why, remedy=FLUTTERS if grows else MORE, warns=True)]


def unstable(waves: Sequence[WaveFlutter], total: FloatArray, sectors: int, asked: FlutterTable) -> list[Verdict]:
    """Report waves with less damping than required, the least stable first."""
    required = asked.required_percent / PERCENT
    rows = [(total[i, m], i, m) for i, m in np.argwhere(total < required)]
    if not rows:
        return []
    worst, i, m = min(rows)
    name = label(waves[i].wave_number, sectors, parted=True)
    what = "grows" if worst < 0 else f"has less damping than the {asked.required_percent:g} % required"
    why = f"{name}, mode {m + 1} {what}: damping {PERCENT * worst:.4g} % at {waves[i].frequencies_hz[m]:.5g} Hz{others(rows, worst)}"
    return [Verdict("trusted", why=why, remedy=FLUTTERS if worst < 0 else MORE, warns=True)]


def others(rows: Sequence[tuple[float, int, int]], worst: float) -> str:
    """Count the waves, and the modes if their number differs, that grow or have too little damping."""
    alike = [row for row in rows if row[0] < 0 or worst >= 0]
    if len(alike) == 1:
        return ""
    count, are = len({i for _, i, _ in alike}), "grow" if worst < 0 else "have too little"
    of = f"{len(alike)} modes of {count} wave{'s' if count > 1 else ''}"
    return f"; {of if len(alike) > count else f'{count} waves'} {are} in all"


def energy_doubts(energy: FloatArray, by_eigenvalue: FloatArray) -> list[Verdict]:
    """Doubt the energy method if the eigenvalue differs: the fluid then changes the mode."""
    size = np.abs(by_eigenvalue).max(initial=0.0)
    off = np.abs(energy - by_eigenvalue).max(initial=0.0)
    if not off > APART * size:
        return []
    why = f"energy method and eigenvalue differ by up to {PERCENT * off:.3g} % of critical damping"
    remedy = (
        "The fluid changes the modes: trust the eigenvalues, and give coefficients between all modes near each other."
    )
    return [Verdict("doubtful", why=why, remedy=remedy)]


def summary(data: xr.Dataset, kind: type[Any], tables: Callable[[Any], Sequence[TextTable]]) -> tuple[TextTable, ...]:
    """Return the tables of each case, and the effects of the centrifugal load; equal cases share their tables."""
    found = []
    for case, head in told_apart(data):
        own: OfWaves = record_of(kind, case)
        if own.waves:
            found += [TextTable(f"{head}{t.title}", t.head, t.rows) for t in (*tables(own), *_static(own))]
    return tuple(found)


def modes_tables(found: Modes) -> list[TextTable]:
    """Return the natural frequencies at a speed, and their differences from the reference."""
    names = _names(found.waves)
    head = ("wave", "kind", *(f"{m + 1}" for m in range(hertz(found).shape[1])))

    def of(values: Sequence[FloatArray | None], form: str) -> tuple[tuple[str, ...], ...]:
        return tuple(
            (*name, *(format(f, form) for f in own)) for name, own in zip(names, values, strict=True) if own is not None
        )

    title = with_contacts(f"Natural frequencies in Hz {_at(found)}", found.contacts)
    tables = [TextTable(title, head, of([w.frequencies_hz for w in found.waves], ".7g"))]
    if found.waves[0].shares is not None:
        title = "The same in Hz, all harmonics held that flanges do not couple"
        tables.append(TextTable(title, head, of([w.stiffest_hz for w in found.waves], ".7g")))
        tables.append(_stage_table(found, names, head))
    if any(w.damped_hz is not None and np.isfinite(w.damped_hz).any() for w in found.waves):
        tables.append(_damped_table(found, names, head))
    tables += _wheel_table(found.wheel_modes)
    off = np.array([w.difference for w in found.waves if w.difference is not None])
    if np.isfinite(off).any():
        worst = np.unravel_index(np.nanargmax(np.abs(off)), off.shape)
        title = (
            f"Relative differences from the reference; the largest is {off[worst]:.2e} "
            f"({names[worst[0]][0]}, mode {worst[1] + 1})"
        )
        rows = tuple(
            (*name, *(f"{d:.1e}" if np.isfinite(d) else "-" for d in own))
            for name, own in zip(names, off, strict=True)
            if np.isfinite(own).any()
        )
        tables.append(TextTable(title, head, rows))
    return tables


def _stage_table(found: Modes, names: Sequence[tuple[str, str]], head: tuple[str, ...]) -> TextTable:
    """Return the share of each stage in the energy of each mode."""
    rows = tuple(
        (name, stage, *(f"{share:.1%}" for share in shares))
        for (name, _), own in zip(names, found.waves, strict=True)
        if own.shares is not None
        for stage, shares in zip(stages(found), own.shares.T, strict=True)
    )
    return TextTable("Share of each stage in the kinetic energy", (head[0], "stage", *head[2:]), rows)


def _damped_table(found: Modes, names: Sequence[tuple[str, str]], head: tuple[str, ...]) -> TextTable:
    """Return frequency and damping of the eigenvalues with aerodynamic forces."""
    rows = tuple(
        (*name, *(f"{f:.7g} ({100 * d:.4g} %)" for f, d in zip(own.damped_hz, own.damping, strict=True)))
        for name, own in zip(names, found.waves, strict=True)
        if own.damped_hz is not None and own.damping is not None
    )
    title = with_contacts("Damped frequencies in Hz and damping ratios in the flow", found.contacts)
    return TextTable(title, head, rows)


def _wheel_table(modes: Sequence[WheelMode]) -> list[TextTable]:
    """Return the modes of a mistuned wheel; none for a tuned one."""
    rows = []
    for i, mode in enumerate(modes[:MOST_ROWS]):
        share, waves, n = mode.sector_share, mode.wave_share, len(mode.sector_share)
        blade, k = int(np.argmax(share)), int(np.argmax(waves))
        both = waves[k] + (waves[(n - k) % n] if 0 < 2 * k != n else 0.0)
        rows.append(
            (
                str(i + 1),
                f"{mode.frequency_hz:.7g}",
                f"{mode.localisation:.3f}",
                f"{blade} ({100 * share[blade]:.0f} %)",
                f"{min(k, n - k)} ({100 * both:.0f} %)",
            )
        )
    more = len(modes) - len(rows)
    title = "Modes of the wheel, its sectors as they differ" + (f"; {more} more in the result" if more > 0 else "")
    head = ("mode", "Hz", "localisation", "largest blade", "nodal diameters")
    return [TextTable(title, head, tuple(rows))] if rows else []


def flutter_tables(found: Flutter) -> list[TextTable]:
    """Return the damping of each wave, and the least stable one; of a mistuned wheel also its least damped modes."""
    names, total, required = labels(found), found.damping, found.required_damping
    i, m = found.least_wave, found.least_mode
    rows = tuple(
        _flutter_row(names[w], found.waves[w], n, required)
        for n in range(total.shape[1])
        for w in np.argsort([w.phase_angle_deg for w in found.waves], kind="stable")
    )
    head = ("wave", "phase angle deg", "mode", "Hz", "by energy %", "by eigenvalue %", "with structure %", "")
    title = (
        f"{with_contacts(f'Flutter margins {_at(found)}', found.contacts)}: the least stable is {names[i]}, mode {m + 1}, with "
        f"{100 * (total[i, m] - required):.4g} %"
    )
    tables = [TextTable(title, head, rows)]
    if found.wheel_modes:
        rows = tuple(
            (f"{mode.frequency_hz:.6g}", f"{100 * mode.damping:.4g}", "UNSTABLE" if mode.damping < 0 else "")
            for mode in found.wheel_modes[:LEAST]
        )
        title = f"The wheel, its sectors as they differ: least damping {100 * found.wheel_modes[0].damping:.4g} %"
        tables.append(TextTable(title, ("Hz", "with structure %", ""), rows))
    return tables


def _flutter_row(name: str, wave: WaveFlutter, mode: int, required: float) -> tuple[str, ...]:
    damping = [float(own[mode]) for own in (wave.by_energy, wave.by_eigenvalue, wave.damping)]
    told = "UNSTABLE" if damping[-1] < 0 else "below required" if damping[-1] < required else ""
    shares = (f"{100 * d:.4g}" for d in damping)
    return (name, f"{wave.phase_angle_deg:.1f}", f"{mode + 1}", f"{wave.frequencies_hz[mode]:.6g}", *shares, told)


def campbell_tables(found: Campbell) -> list[TextTable]:
    """Return frequencies at the ends of the speed range, and the crossings by speed."""
    names = labels(found)
    rows = tuple(
        (name, f"{m + 1}", f"{branch[0]:.6g}", f"{branch[-1]:.6g}")
        for name, own in zip(names, found.waves, strict=True)
        for m, branch in enumerate(own.frequencies_hz.T)
    )
    head = ("wave", "mode", f"{found.speeds_rpm[0]:g} rpm", f"{found.speeds_rpm[-1]:g} rpm")
    crossings = ((c.speed_rpm, c.frequency_hz, c.engine_order, wave, c.mode) for wave, c in found.crossings)
    met = tuple(
        (f"{rpm:.1f}", f"{hz:.2f}", f"{order}", names[wave], f"{mode + 1}")
        for rpm, hz, order, wave, mode in sorted(crossings)
    )
    title = with_contacts("Crossings with engine orders that excite the mode", found.contacts)
    return [
        TextTable(with_contacts("Frequencies in Hz", found.contacts), head, rows),
        TextTable(title, ("rpm", "Hz", "engine order", "wave", "mode"), met),
    ]


def safe_tables(found: Interference) -> list[TextTable]:
    """Return the pairs of engine order and mode, the nearest first."""
    names, pairs, near = labels(found), len(found.pairs), sum(pair.near for pair in found.pairs)
    shown = min(max(MOST_PAIRS, near), pairs)
    rows = tuple(_pair(pair, names) for pair in found.pairs[:shown])
    at = with_contacts(f"At {found.speed_rpm:g} rpm", found.contacts)
    title = f"{at}: {counted(near, 'near resonance')} within {found.margin_percent:g} %"
    if shown < pairs:
        title += f"; the nearest {shown} of {pairs} pairs"
    head = ("engine order", "wave", "mode", f"Hz at {found.speed_rpm:g} rpm", "resonance at rpm", "margin %", "")
    return [TextTable(title, head, rows)]


def _pair(pair: Pair, names: Sequence[str]) -> tuple[str, ...]:
    verdict = "NEAR" if pair.near else "clear" if pair.judged else "order not judged"
    meeting = _meeting(pair.resonance_rpm, pair.margin)
    hz = f"{pair.frequency_hz:.6g}"
    return f"{pair.engine_order}", names[pair.wave], f"{pair.mode + 1}", hz, *meeting, verdict


def _meeting(rpm: float, margin: float) -> tuple[str, str]:
    """Write the speed of a resonance and its margin with few digits if extrapolated far."""
    if not np.isfinite(rpm):
        return "never", "-"
    if abs(margin) > NEARBY:
        return f"~{float(f'{rpm:.2g}'):.0f}", f"{100 * margin:+.0f}"
    return f"{rpm:.1f}", f"{100 * margin:+.2f}"


def _static(found: OfWaves) -> list[TextTable]:
    """Return the effects of the centrifugal load; none without rotation."""
    told = found.static_rpm, found.static_displacement_m, found.static_strain, found.static_rotation_rad
    rpm, displacement, strain, rotation = (np.nan if value is None else value for value in told)
    if not np.isfinite(rpm):
        return []
    head = ("rpm", "largest displacement mm", "largest strain %", "largest rotation deg")
    cells = f"{rpm:g}", f"{1e3 * displacement:.4g}", f"{100 * strain:.3g}", f"{np.degrees(rotation):.3g}"
    return [TextTable("Static displacement under the centrifugal load and thermal strain", head, (cells,))]


def _at(found: Modes | Flutter) -> str:
    return f"at {found.speed_rpm:g} rpm" if found.speed_rpm else "at rest"


def _names(waves: Sequence[Wave]) -> list[tuple[str, str]]:
    """Return names and kinds of the waves; without splitting both directions share the frequencies."""
    if waves[0].kind == "whole":
        return [("whole", "")] * len(waves)
    parted = is_parted(waves)
    return [(f"ND {w.nodal_diameter}", w.kind if parted or w.kind == "standing" else "both ways") for w in waves]
