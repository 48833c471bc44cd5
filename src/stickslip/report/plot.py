"""Figures of a section, and their common style."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
from markupsafe import Markup

from stickslip.arrays import FloatArray

FONT = "Inter, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif"
INK, MUTED, GRID, ALARM = "#1c2530", "#5b6673", "#e4e8ed", "#c0262d"
# Okabe and Ito's colours, distinct for colour-blind readers and in grey
STATE_COLOURS = ("#0072b2", "#e69f00", "#d8dce2")
STATE_NAMES = ("stick", "slip", "open")
STATE_SCALE = [[a, colour] for k, colour in enumerate(STATE_COLOURS) for a in (k / 3, (k + 1) / 3)]
STABILITY_SYMBOLS = {"stable": "circle", "unstable": "x", "undecided": "diamond-open", "not examined": "circle-open"}
_NARROW = 0.5  # decades: below, 1-2-5 ticks may leave an axis without any
_FEW_DECADES = 2.5  # up to here 1-2-5 ticks are far enough apart
# Okabe and Ito's colours without black and yellow, then darker ones: readable on white, distinct side by side
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7b3294", "#8c564b")
BROKEN = ("dash", "dot", "dashdot", "longdash")  # lines that a solid one is told apart from
DASHES = ("solid", *BROKEN)
# from navy over purple and red to dark gold, in grey as well
_STOPS = ((20, 24, 96), (112, 30, 158), (200, 44, 110), (232, 100, 40), (212, 156, 0))

# layout of all figures
_LAYOUT = {
    "autosize": True,
    "paper_bgcolor": "white",
    "plot_bgcolor": "white",
    "font": {"family": FONT, "size": 13, "color": INK},
    "hoverlabel": {"font": {"family": FONT, "size": 12}},
    "legend": {
        "title": {"font": {"size": 12}},
        "font": {"size": 12},
        "x": 1.02,
        "y": 1,
        "tracegroupgap": 12,
        "groupclick": "toggleitem",
    },
}
_AXIS = {
    "showline": True,
    "mirror": True,
    "linecolor": MUTED,
    "gridcolor": GRID,
    "zeroline": False,
    "automargin": True,
    "ticks": "outside",
    "ticklen": 4,
    "tickcolor": MUTED,
    "tickfont": {"size": 12},
    "exponentformat": "power",
    "title": {"standoff": 8, "font": {"size": 14}},
}
# one template, validated once: ten times as fast as the same settings for every axis of every figure
_TEMPLATE = go.layout.Template(layout={**_LAYOUT, "xaxis": _AXIS, "yaxis": _AXIS})
_ROW_ABOVE = {"orientation": "h", "x": 0, "xanchor": "left", "yref": "container", "y": 0.995, "yanchor": "top"}


@dataclass(frozen=True, eq=False)
class Plot:
    """One numbered figure of the page.

    Parameters
    ----------
    key
        Name of the figure in the page and in Python, unique.
    title
        Heading of the figure.
    caption
        Sentences on the content of the figure, with numbers from the data.
    figure
        The figure.
    case_captions
        Case -> words added to the caption while that case is chosen; empty if the figure does not depend on the choice. Traces of such a
        figure carry the case in ``meta``.
    chosen
        The case shown first.
    controls
        HTML above the figure for scripts that change it; already escaped.
    folded
        Line shown while the figure is folded away; empty for an open figure.
    """

    key: str
    title: str
    caption: str
    figure: go.Figure
    case_captions: Mapping[int, str] = field(default_factory=dict)
    chosen: int = -1
    controls: Markup = field(default_factory=Markup)
    folded: str = ""

    def __post_init__(self) -> None:
        """Hide the traces of other cases, for a reader without scripts and for the first view."""
        for trace in self.figure.data if self.case_captions else ():
            trace.visible = trace.meta is None or trace.meta == self.chosen


def colour(index: int) -> str:
    """Return the CSS colour of a line by its number."""
    return COLOURS[index % len(COLOURS)]


def ramp(n: int) -> list[str]:
    """Return `n` colours from dark to gold, all readable on white."""
    stops = np.array(_STOPS, dtype=float)
    at = np.linspace(0, len(stops) - 1, n)
    mix = np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(3)], axis=1)
    return [f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in mix]


def legend_above(figure: go.Figure) -> None:
    """Put the legend in a row above the panels, away from the tool bar on the right."""
    figure.update_layout(legend=_ROW_ABOVE, margin={"t": 74})


def shade(figure: go.Figure, low: float, high: float, *, along: str = "x") -> None:
    """Shade a range of the abscissa of all panels, or of the ordinate, below the curves."""
    look = {"fillcolor": GRID, "opacity": 0.7, "line_width": 0, "layer": "below"}
    if along == "x":
        figure.add_vrect(x0=low, x1=high, **look)
    else:
        figure.add_hrect(y0=low, y1=high, **look)


def ring(colour: object, size: float, width: float = 1.4) -> dict[str, object]:
    """Return an open circle as a marker."""
    line = {"width": width}
    return {"symbol": "circle-open", "size": size, "color": colour, "line": line}


def log_ticks(values: FloatArray) -> dict[str, object]:
    """Return the ticks of a logarithmic axis over the positive `values`, written as plain numbers."""
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return {}
    low, high = np.log10(positive.min()), np.log10(positive.max())
    if 0 < high - low < _NARROW:
        ticks = _even_ticks(float(positive.min()), float(positive.max()))
    else:
        steps = (1, 2, 5) if high - low < _FEW_DECADES else (1,)
        decades = range(int(np.floor(low)), int(np.ceil(high)) + 1)
        ticks = [step * 10.0**k for k in decades for step in steps]
    return {"tickmode": "array", "tickvals": ticks, "ticktext": [f"{t:.12g}" for t in ticks]}


def _even_ticks(low: float, high: float) -> list[float]:
    """Return about five round numbers from `low` to `high`, equally far apart."""
    size = 10.0 ** np.floor(np.log10((high - low) / 5))
    size *= next((k for k in (5, 2) if k * size <= (high - low) / 5), 1)
    return [float(k * size) for k in range(int(low // size), int(high // size) + 2)]


def styled(figure: go.Figure, height: int, *, legend_title: str = "") -> go.Figure:
    """Give `figure` the look of the page; return it."""
    margin = {"l": 70, "r": 20, "t": 56 if figure.layout.annotations else 40, "b": 55}
    figure.update_layout(template=_TEMPLATE, height=height, margin=margin, legend_title_text=legend_title)
    figure.update_annotations(font_size=13)
    return figure


def key_marker(name: str, symbol: str, group: str, group_title: str = "") -> go.Scatter:
    """Return a legend entry that explains a marker and draws nothing."""
    mark = {"symbol": symbol, "size": 9, "color": MUTED, "line": {"width": 1.4, "color": MUTED}}
    title = {"text": group_title} if group_title else None
    shared = {"x": [None], "y": [None], "mode": "markers", "legendgroup": group}
    return go.Scatter(name=name, marker=mark, legendgrouptitle=title, **shared)


def as_base64(values: npt.NDArray[np.generic]) -> str:
    """Return the bytes of an array, row by row, as the text that the page's scripts read."""
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
