"""Checks of a forced response on the page: stability, non-periodic motions, time integration, retention."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import ExaminedRows, MotionsInTime, Shots, TimeChecks, read
from stickslip.analyses.forced_response.stability.stable_words import FEW, all_lines, counts_line, of_case, runs_line
from stickslip.arrays import FloatArray
from stickslip.report.plot import Plot, colour, styled
from stickslip.report.quantities import (
    NONE,
    amplitude,
    fixed,
    number,
    percent,
    quantity,
    scale_for,
)
from stickslip.report.section import Table, Words
from stickslip.response.stability.found import modulus_text

BY_MOTION = ", the motion in time being "  # part of the sentence on a point with undecided multipliers


def stability(response: Response) -> list[Table | Words]:
    """Return a table with one row an examined point: verdict and multiplier."""
    found = response.rows(ExaminedRows)
    if not found:
        return []
    rows = [
        [
            case.short,
            fixed(float(own.stability_frequency_hz), 3),
            str(own.stability_verdict),
            _decided(own),
            modulus_text(float(own.stability_multiplier)) if np.isfinite(own.stability_multiplier) else NONE,
            _error(float(own.stability_multiplier_error)),
        ]
        for case, own in found
    ]
    text = "Does a small disturbance of the motion die? In each period it is multiplied by the largest multiplier. Above 1 by more than its error, the machine leaves the motion. If the error bar contains 1, time integration decides, or stability stays undecided."
    head = ["frequency (Hz)", "verdict", "decided by", "largest multiplier", "its error"]
    told = any(str(own.stability_sentence) for _, own in found)
    every = response.table("", (), head, rows, folded=f"All {len(rows)} points")
    if told and len(response.cases) > 1 and len(rows) > FEW:
        return [_stability_of_cases(response, text), every]
    lines = all_lines(response.data, [c.label for c in response.cases]) if told else ()
    if len(rows) > FEW:
        return [Words((text,), "Stability", lines), every]
    return [response.table("Stability", (text,), head, rows, items=lines)]


def _stability_of_cases(response: Response, text: str) -> Table:
    """Return a table with one row a case: known points, verdicts along the branch, and the peak."""
    rows = []
    for case in response.cases:
        points = of_case(response.data, case.index)
        if not points:
            rows.append([case.short, counts_line(response.data, case.index) or NONE, NONE, NONE])
            continue
        peak = min(points, key=lambda p: abs(p.hz - response.peak_hz(case)))
        size = f", multiplier {modulus_text(peak.multiplier, peak.error)}" if np.isfinite(peak.multiplier) else ""
        known, _, verdicts = runs_line(points).partition(": ")
        count = counts_line(response.data, case.index) or f"all {known}"
        rows.append([case.short, count, verdicts, f"{peak.verdict}{size}"])
    head = ["examined", "verdicts of the examined points", "nearest to the peak"]
    return response.table("Stability", (text,), head, rows, numeric=False)


def shooting(response: Response) -> Table | None:
    """Return a table with one row a case solved by shooting: residual of the period, and error by the time step."""
    known = [(c, read(Shots, response.data, c.index)) for c in response.cases]
    known = [(c, own) for c, own in known if own.shot_steps.size]
    if not known:
        return None
    rows = [
        [
            case.short,
            fixed(own.shot_steps.size, 0),
            fixed(own.shot_steps[0], 0),
            _largest(own.shot_residual),
            _largest(own.shot_step_error_percent),
            fixed(own.shot_periods.sum(), 0),
            fixed(own.shot_corrections.sum(), 0),
        ]
        for case, own in known
    ]
    text = "Each motion is a state that repeats after a period. The residual is the distance of the state after a period from that before, relative to the vibration. The error of the time step is estimated with twice as many steps, four times where a contact opens; above the threshold a point is doubtful."
    head = ["motions", "steps a period", "largest residual", "largest error of the step (%)", "periods", "corrections"]
    return response.table("Shooting", (text,), head, rows)


def _largest(values: FloatArray) -> str:
    known = values[~np.isnan(values)]
    return number(float(known.max()), 2) if known.size else NONE


def _decided(own: ExaminedRows) -> str:
    if str(own.stability_verdict) not in ("stable", "unstable"):
        return NONE
    return "motion in time" if BY_MOTION in str(own.stability_sentence) else "multiplier"


def _error(error: float) -> str:
    """Write the error of a multiplier; empty if no force acts on more harmonics."""
    if not np.isfinite(error):
        return "not known"
    return number(error, 2) if error > 0.0 else "none"


def amplitudes_in_time(response: Response) -> Plot | None:
    """Draw the amplitude in each of the last periods."""
    amplitudes = read(MotionsInTime, response.data).not_periodic_amplitudes
    if not np.any(np.isfinite(amplitudes)):
        return None
    scale = scale_for(amplitudes, "m")
    figure = go.Figure()
    for i, (case, march) in enumerate(response.rows(MotionsInTime)):
        own, told = march.not_periodic_amplitudes, f"{march.not_periodic_frequency_hz:.2f} Hz"
        name = f"{case.short}, {told}" if case.short else told
        figure.add_scatter(
            x=np.arange(own.size),
            y=scale.factor * own,
            mode="lines+markers",
            name=name,
            line={"color": colour(i), "width": 1.4},
            marker={"size": 4},
            hovertemplate=f"%{{y:.4g}} {scale.unit}<extra>{name}</extra>",
        )
    styled(figure, 380)
    figure.update_xaxes(title_text="period")
    figure.update_yaxes(title_text=f"half of peak to peak ({scale.unit})", rangemode="tozero")
    caption = "Where no stable periodic motion was found, the motion was integrated in time from the nearest solution. The figure shows half of peak to peak in each of its last periods. Another start may end elsewhere."
    return Plot("not_periodic", "What is not periodic, in time", caption, figure)


def statistics_in_time(response: Response) -> Table | None:
    """Return a table with one row a motion: envelope, root mean square, spectrum, and whether it has settled."""
    found = response.rows(MotionsInTime)
    if not found:
        return None
    report = response.labels("output").index(response.data.attrs["report_output"])
    rows = [
        [
            case.short,
            fixed(float(own.not_periodic_frequency_hz), 3),
            _size(own.not_periodic_largest[report]),
            _size(own.not_periodic_least[report]),
            _size(own.not_periodic_rms[report]),
            _size(own.not_periodic_mean[report]),
            _lines(own.not_periodic_line_hz, own.not_periodic_line_amplitude),
            f"{own.not_periodic_periods}",
            f"{'yes' if own.not_periodic_settled else 'no'}, {number(100 * float(own.not_periodic_spread), 2)} %"
            if np.isfinite(own.not_periodic_spread)
            else NONE,
        ]
        for case, own in found
    ]
    head = [
        "frequency (Hz)",
        "largest amplitude",
        "least",
        "root mean square",
        "mean",
        "largest lines of the spectrum",
        "periods",
        "settled, spread",
    ]
    text = (
        "Amplitudes are half of peak to peak in a period, over the later half of the march. It has settled "
        "where the largest amplitudes and root mean squares of four windows of that half are alike."
    )
    items = response.sentences((case, own.not_periodic_sentence) for case, own in found)
    return response.table("What is not periodic", (text,), head, rows, items=items)


def _size(metres: float) -> str:
    return quantity(float(metres), "m", 4) if np.isfinite(metres) else NONE


def _lines(hz: FloatArray, heights: FloatArray) -> str:
    known = [
        f"{number(float(f), 5)} Hz: {quantity(float(a), 'm', 3)}"
        for f, a in zip(hz, heights, strict=True)
        if np.isfinite(f)
    ]
    return "\n".join(known[:4]) or NONE


_SETTLED = {0: "not settled", 1: "settled", -1: NONE}  # for older results, which do not name the motion


def time_integration(response: Response) -> Table | None:
    """Compare time integration with harmonic balance."""
    found = response.rows(TimeChecks)
    if not found:
        return None
    rows = [
        [
            case.short,
            fixed(float(own.verify_frequency_hz), 3),
            amplitude(float(own.verify_transient), response.length, 5),
            amplitude(float(own.verify_balance), response.length, 5),
            percent(float(own.verify_difference_percent)),
            str(own.verify_motion) or _SETTLED[int(own.verify_settled)],
            fixed(float(own.verify_periods), 0) if own.verify_periods >= 0 else NONE,
        ]
        for case, own in found
    ]
    off = np.abs([float(own.verify_difference_percent) for _, own in found])
    finite = off[np.isfinite(off)]
    worst = percent(float(finite.max())) if finite.size else NONE
    ways = ["by time integration", "by harmonic balance"]
    head = ["frequency (Hz)", *ways, "difference", "motion in time", "periods"]
    text = f"Amplitude of {response.output_name}: the two independent ways differ by at most {worst}."
    items = response.sentences((case, own.verify_sentence) for case, own in found)
    return response.table("Time integration", (text,), head, rows, items=items)


def retention(response: Response) -> Table | None:
    """Report the change of the peak by the retention stiffness of rigid bodies."""
    shift = {c: response.numbers_of[c.index].retention_peak_shift for c in response.cases}
    known = [c for c in response.cases if np.isfinite(shift[c])]
    if not known:
        return None
    worst = max(known, key=lambda c: abs(shift[c]))
    moved = {c: number(response.numbers_of[c.index].retention_frequency_shift_hz) for c in known}
    rows = [[c.short, percent(100 * shift[c]), moved[c]] for c in known]
    rows += [[c.short, "no periodic motion found", NONE] for c in response.cases if c not in known]
    text = (
        "With a retention stiffness ten times smaller the peak changes most"
        f"{worst.where}: by {percent(100 * shift[worst])}."
    )
    head = ["change of the peak", "change of its frequency (Hz)"]
    return response.table("Retention", (text,), head, rows)
