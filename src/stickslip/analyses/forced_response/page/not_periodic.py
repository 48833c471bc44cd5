"""Motions without a period: envelope and spectrum in time."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.page.tables import sentences
from stickslip.arrays import FloatArray
from stickslip.report.content import Table
from stickslip.report.plot import Plot, colour, styled
from stickslip.report.quantities import NONE, fixed, number, quantity, scale_for

NEEDED = ("not_periodic_case", "not_periodic_amplitudes")


def amplitudes_in_time(response: Response) -> Plot | None:
    """Draw the amplitude in each of the last periods."""
    if not response.has(*NEEDED):
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
    if not response.has(*NEEDED):
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
