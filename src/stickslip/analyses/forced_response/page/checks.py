"""Checks of a forced response on the page: stability, motions without a period, time integration, retention."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import ExaminedRows, MotionsInTime, TimeChecks, read
from stickslip.analyses.forced_response.stability.stable_words import FEW, all_lines
from stickslip.arrays import FloatArray
from stickslip.report.content import Table, Words
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
from stickslip.response.stability.found import modulus_text

BY_MOTION = ", the motion in time being "  # in the sentence of a point whose multipliers leave it undecided


def stability(response: Response) -> list[Table | Words]:
    """Return a table with one row an examined point: verdict and multiplier."""
    found = read(ExaminedRows, response.data)
    if found.stability_case is None:
        return []
    told, size = [str(text) for text in found.stability_sentence], found.stability_multiplier
    by = ["motion in time" if BY_MOTION in text else "multiplier" for text in told]
    rows = [
        [
            response.cases[case].short,
            fixed(float(found.stability_frequency_hz[i]), 3),
            verdict,
            by[i] if verdict in ("stable", "unstable") else NONE,
            modulus_text(float(size[i])) if np.isfinite(size[i]) else NONE,
            _error(float(found.stability_multiplier_error[i])),
        ]
        for i, (case, verdict) in enumerate(zip(found.stability_case, map(str, found.stability_verdict), strict=True))
    ]
    text = (
        "Whether a small disturbance of the motion dies. Each is multiplied by so much in a period; above 1 by more "
        "than its error a machine does not stay there. Where the error reaches 1 the motion in time decides, or nothing does."
    )
    head = ["frequency (Hz)", "verdict", "decided by", "largest multiplier", "its error"]
    lines = all_lines(response.data, [c.label for c in response.cases]) if any(told) else ()
    if len(rows) > FEW:
        every = response.table("", (), head, rows, folded=f"All {len(rows)} points")
        return [Words((text,), "Stability", lines), every]
    return [response.table("Stability", (text,), head, rows, items=lines)]


def _error(error: float) -> str:
    """Write the error of a multiplier; empty if no force acts on more harmonics."""
    if not np.isfinite(error):
        return "not known"
    return number(error, 2) if error > 0.0 else "none"


def amplitudes_in_time(response: Response) -> Plot | None:
    """Draw the amplitude in each of the last periods."""
    found = read(MotionsInTime, response.data)
    amplitudes = found.not_periodic_amplitudes
    if found.not_periodic_case is None or not np.any(np.isfinite(amplitudes)):
        return None
    scale = scale_for(amplitudes[np.isfinite(amplitudes)], "m")
    figure = go.Figure()
    for i, (case, hz, own) in enumerate(
        zip(found.not_periodic_case, found.not_periodic_frequency_hz, amplitudes, strict=True)
    ):
        label = response.cases[case].short
        name = f"{label}, {hz:.2f} Hz" if label else f"{hz:.2f} Hz"
        figure.add_trace(
            go.Scatter(
                x=np.arange(own.size),
                y=scale.factor * own,
                mode="lines+markers",
                name=name,
                line={"color": colour(i), "width": 1.4},
                marker={"size": 4},
                hovertemplate=f"%{{y:.4g}} {scale.unit}<extra>{name}</extra>",
            )
        )
    styled(figure, 380)
    figure.update_xaxes(title_text="period")
    figure.update_yaxes(title_text=f"half of peak to peak ({scale.unit})", rangemode="tozero")
    caption = (
        "Where no periodic motion was found, or one that disturbances leave, this is the motion in time: the amplitude of each of its last "
        "periods, half of peak to peak. It is time integration from the motion of the nearest point that was found, no balance itself; another start may end elsewhere."
    )
    return Plot("not_periodic", "What is not periodic, in time", caption, figure)


def statistics_in_time(response: Response) -> Table | None:
    """Return a table with one row a motion: envelope, root mean square, spectrum, and whether it has settled."""
    found = read(MotionsInTime, response.data)
    if found.not_periodic_case is None:
        return None
    report = response.labels("output").index(response.data.attrs["report_output"])
    sizes = [
        own[:, report]
        for own in (
            found.not_periodic_largest,
            found.not_periodic_least,
            found.not_periodic_rms,
            found.not_periodic_mean,
        )
    ]
    spread = found.not_periodic_spread
    rows = [
        [
            response.cases[case].short,
            fixed(float(found.not_periodic_frequency_hz[i]), 3),
            *(quantity(float(own[i]), "m", 4) if np.isfinite(own[i]) else NONE for own in sizes),
            _lines(found.not_periodic_line_hz[i], found.not_periodic_line_amplitude[i]),
            f"{found.not_periodic_periods[i]}",
            f"{'yes' if found.not_periodic_settled[i] else 'no'}, {number(100 * float(spread[i]), 2)} %"
            if np.isfinite(spread[i])
            else NONE,
        ]
        for i, case in enumerate(found.not_periodic_case)
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
    items = response.sentences(found.not_periodic_case, found.not_periodic_sentence)
    return response.table("What is not periodic", (text,), head, rows, items=items)


def _lines(hz: FloatArray, heights: FloatArray) -> str:
    known = [
        f"{number(float(f), 5)} Hz: {quantity(float(a), 'm', 3)}"
        for f, a in zip(hz, heights, strict=True)
        if np.isfinite(f)
    ]
    return "\n".join(known[:4]) or NONE


_SETTLED = {0: "not settled", 1: "settled", -1: NONE}  # where older results do not name the motion


def time_integration(response: Response) -> Table | None:
    """Compare time integration with harmonic balance."""
    found = read(TimeChecks, response.data)
    if found.verify_case is None:
        return None
    off, periods = found.verify_difference_percent, found.verify_periods
    rows = [
        [
            response.cases[case].short,
            fixed(float(found.verify_frequency_hz[i]), 3),
            amplitude(float(found.verify_transient[i]), response.length, 5),
            amplitude(float(found.verify_balance[i]), response.length, 5),
            percent(float(off[i])),
            str(found.verify_motion[i]) or _SETTLED[int(found.verify_settled[i])],
            fixed(float(periods[i]), 0) if periods[i] >= 0 else NONE,
        ]
        for i, case in enumerate(found.verify_case)
    ]
    finite = np.abs(off[np.isfinite(off)])
    worst = percent(float(finite.max())) if finite.size else NONE
    ways = ["by time integration", "by harmonic balance"]
    head = ["frequency (Hz)", *ways, "difference", "motion in time", "periods"]
    text = f"Amplitude of {response.output_name}: the two independent ways differ by at most {worst}."
    items = response.sentences(found.verify_case, found.verify_sentence)
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
