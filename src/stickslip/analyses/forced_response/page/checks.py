"""Checks of a forced response on the page: stability, motions without a period, time integration, retention."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
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
from stickslip.study.verdict import said

BY_MOTION = ", the motion in time being "  # in the sentence of a point whose multipliers leave it undecided


def stability(response: Response) -> list[Table | Words]:
    """Return a table with one row an examined point: verdict and multiplier."""
    names = [f"stability_{word}" for word in ("case", "frequency_hz", "verdict", "multiplier", "multiplier_error")]
    if not response.has(*names):
        return []
    case = response.integers(names[0])
    hz, size, error = (response.floats(name) for name in (names[1], *names[3:]))
    verdict = [str(text) for text in response.data[names[2]].values]
    told_each = response.has("stability_sentence")
    told = response.labels_of("stability_sentence") if told_each else [""] * len(verdict)
    by = ["motion in time" if BY_MOTION in text else "multiplier" for text in told]
    rows = [
        [
            response.cases[int(case[i])].short,
            fixed(float(hz[i]), 3),
            verdict[i],
            by[i] if verdict[i] in ("stable", "unstable") else NONE,
            modulus_text(float(size[i])) if np.isfinite(size[i]) else NONE,
            _error(float(error[i])),
        ]
        for i in range(len(verdict))
    ]
    text = (
        "Whether a small disturbance of the motion dies. Each is multiplied by so much in a period; above 1 by more "
        "than its error a machine does not stay there. Where the error reaches 1 the motion in time decides, or nothing does."
    )
    head = ["frequency (Hz)", "verdict", "decided by", "largest multiplier", "its error"]
    lines = all_lines(response.data, [c.label for c in response.cases]) if told_each else ()
    if len(rows) > FEW:
        every = response.table("", (), head, rows, folded=f"All {len(rows)} points")
        return [Words((text,), "Stability", lines), every]
    return [response.table("Stability", (text,), head, rows, items=lines)]


def _error(error: float) -> str:
    """Write the error of a multiplier; empty if no force acts on more harmonics."""
    if not np.isfinite(error):
        return "not known"
    return number(error, 2) if error > 0.0 else "none"


_IN_TIME = ("not_periodic_case", "not_periodic_amplitudes")


def amplitudes_in_time(response: Response) -> Plot | None:
    """Draw the amplitude in each of the last periods."""
    if not response.has(*_IN_TIME):
        return None
    amplitudes = response.values("not_periodic_amplitudes", "not_periodic", "turn")
    if not np.any(np.isfinite(amplitudes)):
        return None
    case, hz = response.integers("not_periodic_case"), response.floats("not_periodic_frequency_hz")
    scale = scale_for(amplitudes[np.isfinite(amplitudes)], "m")
    figure = go.Figure()
    for i, own in enumerate(amplitudes):
        label = response.cases[int(case[i])].short
        name = f"{label}, {hz[i]:.2f} Hz" if label else f"{hz[i]:.2f} Hz"
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
    if not response.has(*_IN_TIME):
        return None
    case, hz = response.integers("not_periodic_case"), response.floats("not_periodic_frequency_hz")
    sizes = {
        word: response.values(f"not_periodic_{word}", "not_periodic", "output")[:, _report(response)]
        for word in ("largest", "least", "rms", "mean")
    }
    spread, periods = (response.floats(f"not_periodic_{w}") for w in ("spread", "periods"))
    settled = response.integers("not_periodic_settled")
    lines, heights = (response.values(f"not_periodic_line_{w}", "not_periodic", "line") for w in ("hz", "amplitude"))
    rows = [
        [
            response.cases[int(case[i])].short,
            fixed(float(hz[i]), 3),
            *(quantity(float(sizes[w][i]), "m", 4) if np.isfinite(sizes[w][i]) else NONE for w in sizes),
            _lines(lines[i], heights[i]),
            f"{int(periods[i])}",
            f"{'yes' if settled[i] else 'no'}, {number(100 * float(spread[i]), 2)} %"
            if np.isfinite(spread[i])
            else NONE,
        ]
        for i in range(hz.size)
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
    items = sentences(response, "not_periodic_sentence")
    return response.table("What is not periodic", (text,), head, rows, items=items)


def _report(response: Response) -> int:
    outputs = [str(name) for name in response.data["output"].values]
    return outputs.index(response.data.attrs["report_output"])


def _lines(hz: FloatArray, heights: FloatArray) -> str:
    known = [
        f"{number(float(f), 5)} Hz: {quantity(float(a), 'm', 3)}"
        for f, a in zip(hz, heights, strict=True)
        if np.isfinite(f)
    ]
    return "\n".join(known[:4]) or NONE


def sentences(response: Response, name: str) -> list[str]:
    """List the outcome of each check in words."""
    if not response.has(name):
        return []
    each = [str(s) for s in response.data[name].values]
    rows = f"{name.removesuffix('_sentence')}_case"
    at = response.integers(rows) if response.has(rows) else np.arange(len(each))
    labels = [response.cases[int(k)].label for k in at]
    return [said(label, text) for label, text in zip(labels, each, strict=True)]


def time_integration(response: Response) -> Table | None:
    """Compare time integration with harmonic balance."""
    words = ("case", "frequency_hz", "transient", "balance", "difference_percent")
    names = [f"verify_{word}" for word in words]
    if not response.has(*names):
        return None
    columns = [response.floats(name) for name in names]
    nothing = np.full(len(columns[0]), np.nan)
    periods = response.floats("verify_periods") if response.has("verify_periods") else nothing
    motion = [NONE] * len(columns[0])
    if response.has("verify_settled"):
        motion = [("not settled", "settled")[int(k)] for k in response.integers("verify_settled")]
    if response.has("verify_motion"):
        told = response.labels_of("verify_motion")
        motion = [word or known for word, known in zip(told, motion, strict=True)]
    rows = [
        [
            response.cases[int(case)].short if np.isfinite(case) else NONE,
            fixed(float(hz), 3),
            amplitude(float(transient), response.length, 5),
            amplitude(float(balance), response.length, 5),
            percent(float(off)),
            word,
            fixed(float(n), 0),
        ]
        for case, hz, transient, balance, off, word, n in zip(*columns, motion, periods, strict=True)
    ]
    finite = np.abs(columns[-1][np.isfinite(columns[-1])])
    worst = percent(float(finite.max())) if finite.size else NONE
    ways = ["by time integration", "by harmonic balance"]
    head = ["frequency (Hz)", *ways, "difference", "motion in time", "periods"]
    text = f"Amplitude of {response.output_name}: the two independent ways differ by at most {worst}."
    items = sentences(response, "verify_sentence")
    return response.table("Time integration", (text,), head, rows, items=items)


def retention(response: Response) -> Table | None:
    """Report the change of the peak by the retention stiffness of rigid bodies."""
    shift = {c: response.number_of("retention_peak_shift", c) for c in response.cases}
    known = [c for c in response.cases if np.isfinite(shift[c])]
    if not known:
        return None
    worst = max(known, key=lambda c: abs(shift[c]))
    moved = {c: number(response.number_of("retention_frequency_shift_hz", c)) for c in known}
    rows = [[c.short, percent(100 * shift[c]), moved[c]] for c in known]
    rows += [[c.short, "no periodic motion found", NONE] for c in response.cases if c not in known]
    text = (
        "With a retention stiffness ten times smaller the peak changes most"
        f"{worst.where}: by {percent(100 * shift[worst])}."
    )
    head = ["change of the peak", "change of its frequency (Hz)"]
    return response.table("Retention", (text,), head, rows)
