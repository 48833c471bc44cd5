"""What a section of the page holds, and the look all figures share."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import FloatArray

FONT = "Inter, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif"
INK, MUTED, GRID, ALARM = "#1c2530", "#5b6673", "#e4e8ed", "#c0262d"
# Okabe and Ito's colours, distinct for colour-blind readers and in grey
STATE_COLOURS = ("#0072b2", "#e69f00", "#d8dce2")
STATE_NAMES = ("stick", "slip", "open")
_FEW_DECADES = 2.5  # up to here 1-2-5 ticks are far enough apart
LEFT_SIDE, RIGHT_SIDE = "#0072b2", "#d55e00"


@dataclass(frozen=True, eq=False)
class Plot:
    """One numbered figure of the page.

    Parameters
    ----------
    key
        Name of the figure in the page, unique.
    title
        Its heading.
    caption
        HTML: what to see, in words and numbers taken from the data.
    figure
        The figure, or None where the result does not hold it; the caption then says so.
    case_captions
        Load case -> HTML added to the caption while that case is chosen; empty if the figure does not depend
        on the choice. Traces of such a figure carry the load case in ``meta``.
    controls
        HTML above the figure, for scripts that change it.
    """

    key: str
    title: str
    caption: str
    figure: go.Figure | None = None
    case_captions: Mapping[int, str] = field(default_factory=dict)
    controls: str = ""


def absent(key: str, title: str, reason: str) -> Plot:
    """Return the place of a figure that this result cannot show."""
    return Plot(key, title, f"Not shown: {reason}.")


def legend_above(figure: go.Figure) -> None:
    """Put the legend in a row above the panels, away from the tool bar on the right."""
    row = {
        "orientation": "h",
        "x": 0,
        "xanchor": "left",
        "yref": "container",
        "y": 0.995,
        "yanchor": "top",
    }
    figure.update_layout(legend=row, margin={"t": 74})


def log_ticks(values: FloatArray) -> dict[str, object]:
    """Ticks of a logarithmic axis over the positive `values`, written as plain numbers."""
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return {}
    low, high = np.log10(positive.min()), np.log10(positive.max())
    steps = (1, 2, 5) if high - low < _FEW_DECADES else (1,)
    ticks = [
        step * 10.0**k for k in range(int(np.floor(low)), int(np.ceil(high)) + 1) for step in steps
    ]
    return {"tickmode": "array", "tickvals": ticks, "ticktext": [f"{t:.12g}" for t in ticks]}


def styled(figure: go.Figure, height: int, *, legend_title: str = "") -> go.Figure:
    """Give `figure` the look of the page; returns it."""
    figure.update_layout(
        template="none",
        height=height,
        autosize=True,
        font={"family": FONT, "size": 13, "color": INK},
        margin={"l": 70, "r": 20, "t": 40, "b": 55},
        paper_bgcolor="white",
        plot_bgcolor="white",
        hoverlabel={"font": {"family": FONT, "size": 12}},
        legend={
            "title": {"text": legend_title, "font": {"size": 12}},
            "font": {"size": 12},
            "x": 1.02,
            "y": 1,
            "tracegroupgap": 12,
            "groupclick": "toggleitem",
        },
    )
    axis = {
        "showline": True,
        "linecolor": MUTED,
        "mirror": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": MUTED,
        "gridcolor": GRID,
        "zeroline": False,
        "automargin": True,
        "title": {"standoff": 8, "font": {"size": 14}},
        "exponentformat": "power",
        "tickfont": {"size": 12},
    }
    figure.update_xaxes(**axis)
    figure.update_yaxes(**axis)
    figure.update_annotations(font_size=13)
    return figure


def key_marker(name: str, symbol: str, group: str, group_title: str = "") -> go.Scatter:
    """Return a legend entry that explains a marker and draws nothing."""
    return go.Scatter(
        x=[None],
        y=[None],
        mode="markers",
        name=name,
        legendgroup=group,
        legendgrouptitle={"text": group_title} if group_title else None,
        marker={
            "symbol": symbol,
            "size": 9,
            "color": MUTED,
            "line": {"width": 1.4, "color": MUTED},
        },
    )
