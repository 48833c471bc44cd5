"""Verdicts on a run-up, and the terminal tables."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from stickslip.analyses.columns import record_of
from stickslip.analyses.operation import MARGIN
from stickslip.analyses.run_up.records import FastRunUp, Line, RunUp
from stickslip.study.analysis import TextTable
from stickslip.study.store.netcdf import one_case
from stickslip.study.verdict import Verdict, from_json
from stickslip.units import millimetres

TOO_FAST = 0.05  # share neglected by slowly varying amplitudes, above which there is a doubt
BETWEEN = 1e-5  # error of the model between its speeds, above which there is a doubt
UNKNOWN = Verdict(
    "trusted",
    why="no motion of the run-up was examined for stability",
    remedy="A [forced_response] at the speed of a peak does.",
)


def case_verdicts(label: str, found: RunUp) -> list[Verdict]:
    """Return the verdicts on a case and on its models."""
    if not found.lines:
        return []
    told = [replace(v, case=label) for v in (*from_json(found.doubts), UNKNOWN)]
    told += [replace(v, case=label) for v in _in_operation(found)]
    own = [v for line in found.lines for v in _of_line(label, found, line)]
    own += [v for fast in found.fast for v in _of_fast(label, fast)]
    return [*told, *(own or [Verdict("trusted", label, None, _followed(found))])]


def _followed(found: RunUp) -> str:
    most = max(found.points[line.peak_point].error for line in found.lines)
    return f"every engine order was followed; more harmonics are predicted to change their peaks by {100 * most:.2g} % at most"


def _in_operation(found: RunUp) -> Iterator[Verdict]:
    """Note the peaks inside the operating range or their margin, with the largest amplitude inside; doubt speeds left out."""
    own, speeds = found.operating, found.line_speed_rpm
    if not own.known:
        return
    if own.unit == "rpm" and speeds is not None and (own.lowest < speeds.min() or own.highest > speeds.max()):
        why = f"the run-up leaves out some of the operating speeds, {own}: it covers {speeds.min():.5g} to {speeds.max():.5g} rpm"
        yield Verdict("doubtful", why=why, remedy="Widen run_up.speeds_rpm.")
    for line in found.lines:
        size, rpm = found.largest_in_operation(line)
        peak = own.at(line.peak_speed_rpm, line.engine_order)
        here = f"{peak:.5g} {own.unit}"
        largest = f"the largest amplitude in it is {millimetres(size)} at {rpm:.5g} rpm" if np.isfinite(size) else ""
        name = f"engine order {line.engine_order}"
        if line.peak_inside and not own.margin(peak):
            remedy = "The machine runs at this resonance: judge its amplitude, or shift it."
            yield Verdict("trusted", why=f"{name}: the peak lies inside the {own.name}, {own}: {here}", remedy=remedy)
        elif line.peak_inside:
            why = f"{name}: the peak lies outside the {own.name}, {own}: {here} is {own.where(peak)} it"
            yield Verdict("trusted", why=f"{why}, and {largest}" if largest else why, remedy=MARGIN)
        elif largest:
            yield Verdict("trusted", why=f"{name}: no resonance inside the speeds; of the {own.name}, {own}, {largest}")


def _of_line(label: str, found: RunUp, line: Line) -> Iterator[Verdict]:
    name, hertz, top = f"engine order {line.engine_order}", line.peak_frequency_hz, found.peak(line)
    if top is None:
        yield Verdict(
            "wrong", label, None, f"{name}: no point has a solution", "See the forced response at one of the speeds."
        )
        return
    if line.failed:
        why = f"{name}: {line.failed} of {len(found.along(line))} points have no solution"
        remedy = "Give more points, or look at a [forced_response] at such a speed."
        yield Verdict("doubtful", label, None, why, remedy)
    if top.error > found.limit:
        why = f"{name}: missing harmonics may change the peak by {100 * top.error:.2g} %"
        yield Verdict("doubtful", label, hertz, why, "Raise harmonics.high.")
    if np.isnan(top.error):
        why = f"{name}: whether more harmonics than H = {top.harmonic} change the peak was not examined"
        yield Verdict("doubtful", label, hertz, why, 'harmonics.high = "auto" examines it.')
    if line.speed_error > BETWEEN:
        why = f"{name}: between the speeds at which the model was assembled its matrices are off by {line.speed_error:.1e}"
        remedy = "Take a narrower range of speeds, or a smaller run_up.tolerance."
        yield Verdict("doubtful", label, None, why, remedy)
    if not line.peak_inside:
        why = f"{name}: the largest amplitude is at an end of the range"
        yield Verdict("trusted", label, hertz, why, "Widen speeds_rpm to see the resonance.")


def _of_fast(label: str, fast: FastRunUp) -> Iterator[Verdict]:
    name = f"engine order {fast.engine_order} at {fast.rate:g} rpm/s"
    if not fast.finished:
        why = f"{name}: the fast run-up was not followed to its end"
        yield Verdict("doubtful", label, None, why, "Take a smaller range of speeds, or another rate.")
    elif fast.peak_at_end:
        # without a peak there is no error of a peak
        why = f"{name}: the largest amplitude is at an end of the range"
        yield Verdict("trusted", label, None, why, "Widen speeds_rpm to see the peak.")
        return
    if fast.neglected > TOO_FAST:
        why = f"{name}: the amplitude varies so fast that {100 * fast.neglected:.2g} % of its change is left out, and the peak may be off by as much"
        yield Verdict("doubtful", label, None, why, "Take a slower rate, or integrate in time.")


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables."""
    told = []
    for k, label in enumerate(data["case_label"].values):
        found = record_of(RunUp, one_case(data, k))
        head = f"{label}: " if label and data.sizes["case"] > 1 else ""
        if found.lines:
            told.append(_peaks(found, head))
        if found.fast:
            told.append(_fast(found.fast, head))
    return tuple(told)


def _peaks(found: RunUp, head: str) -> TextTable:
    rows = []
    for line in found.lines:
        own, top = found.along(line), found.peak(line)
        rows.append(
            (
                f"{line.engine_order}",
                f"{line.wave_number}",
                f"{1e3 * line.peak_amplitude:.5g}",
                f"{line.peak_speed_rpm:.6g}",
                f"{line.peak_frequency_hz:.6g}",
                "-" if top is None else f"{100 * top.slipping:.0f} %",
                f"{len(own)}",
                f"{max(point.harmonic for point in own)}",
                f"{line.failed}",
                f"{line.newton_steps}",
                "" if line.peak_inside else "end of the range",
            )
        )
    names = ("engine order", "wave", "peak mm", "at rpm", "at Hz", "slipping", "points", "H", "failed", "Newton", "")
    errors = max(line.speed_error for line in found.lines)
    speeds = found.lines[0].static_normal_n.size
    lines = [f"the model was assembled at {speeds} speeds; between them it is off by {errors:.1e} at most"]
    if any(line.common_modes for line in found.lines):
        lines.append(
            "what the modes of three speeds span is kept at all: at some speed another mode would take the place of one kept"
        )
    return TextTable(f"{head}Run-up along engine orders", names, tuple(rows), tuple(lines))


def _fast(every: tuple[FastRunUp, ...], head: str) -> TextTable:
    """Return the table of fast run-ups and steady peaks."""
    rows = tuple(
        (
            f"{fast.engine_order}",
            f"{fast.rate:g}",
            f"{1e3 * fast.peak_amplitude:.5g}",
            f"{fast.ratio:.4f}",
            f"{fast.peak_speed_rpm:.6g}",
            f"{fast.shift_rpm:+.4g}",
            f"{fast.harmonic}",
            f"{100 * fast.neglected:.2g} %",
        )
        for fast in every
    )
    names = ("engine order", "rpm/s", "peak mm", "of the steady one", "at rpm", "shift rpm", "H", "left out")
    return TextTable(f"{head}Fast run-up", names, rows)
