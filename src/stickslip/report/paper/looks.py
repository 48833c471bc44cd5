"""Colours, lines, markers and texts of plotly in the terms of matplotlib."""

import re
from collections.abc import Sequence
from html import unescape
from typing import Any

import numpy as np

from stickslip.report.plot import COLOURS

PLOTLY_LINE = 2.0  # default width of a line in plotly, px
PLOTLY_MARKER = 6.0  # default size of a marker in plotly, px
_DASHES = {"dash": "--", "dot": ":", "dashdot": "-.", "longdash": (0, (8, 3)), "longdashdot": (0, (8, 3, 1, 3))}
_MARKERS = {
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "triangle-up": "^",
    "triangle-down": "v",
    "triangle-left": "<",
    "triangle-right": ">",
    "cross": "P",
    "x": "X",
    "star": "*",
    "x-thin": "x",
    "cross-thin": "+",
    "hexagon": "h",
    "pentagon": "p",
    "square-x": "s",
    "circle-x": "o",
    "line-ns": "|",
    "line-ew": "_",
}
_NUMBERS = re.compile(r"rgba?\(([^)]*)\)")
_BREAK = re.compile(r"<br\s*/?>")
_LOWERED, _RAISED = re.compile(r"<sub>(.*?)</sub>"), re.compile(r"<sup>(.*?)</sup>")
_BOLD, _SLANTED = re.compile(r"<b>(.*?)</b>"), re.compile(r"<(?:i|em)>(.*?)</(?:i|em)>")
_TAG = re.compile(r"<[^>]+>")


def worded(text: str | None) -> str:
    """Return a text of plotly, with its few HTML tags, as matplotlib sets it."""
    plain = _BREAK.sub("\n", (text or "").replace("$", r"\$"))
    plain = _LOWERED.sub(r"$_{\\mathrm{\1}}$", plain)
    plain = _RAISED.sub(r"$^{\\mathrm{\1}}$", plain)
    return unescape(_TAG.sub("", _SLANTED.sub(r"\1", _BOLD.sub(r"\1", plain))))


def shade(colour: Any, opacity: float | None = None, default: str = COLOURS[0]) -> tuple[float, ...]:
    """Return a CSS colour as red, green, blue and opacity from 0 to 1."""
    from matplotlib.colors import to_rgba

    given = default if colour is None else str(colour)
    found = _NUMBERS.fullmatch(given.replace(" ", ""))
    if found:
        parts = [float(v) for v in found[1].split(",")]
        values = (*(v / 255 for v in parts[:3]), *(parts[3:] or [1.0]))
    else:
        values = to_rgba(given)
    return (*values[:3], values[3] * (1.0 if opacity is None else float(opacity)))


def dash(style: str | None) -> Any:
    """Return the line style of matplotlib for a style of plotly: a name, a list of lengths, or none for solid."""
    if style and style[0].isdigit():
        return (0, tuple(float(v) for v in re.findall(r"[\d.]+", style)))
    return _DASHES.get(style or "", "-")


def symbol(name: str | None) -> tuple[str, bool]:
    """Return the marker of matplotlib for a symbol of plotly, and whether it is open."""
    given = name or "circle"
    own = given.removesuffix("-dot").removesuffix("-open")
    return _MARKERS.get(own, "o"), "-open" in given and not own.endswith("-thin")


def colour_map(scale: Sequence[Sequence[Any]] | None) -> Any:
    """Return a colour scale of plotly, pairs of position and colour, as a colour map; equal positions are a step."""
    from matplotlib import colormaps
    from matplotlib.colors import LinearSegmentedColormap

    if not scale:
        return colormaps["viridis"]
    return LinearSegmentedColormap.from_list("own", [(float(at), shade(colour)) for at, colour in scale], N=512)


def values_of(given: Any) -> np.ndarray:
    """Return coordinates as numbers, None as NaN; words stay words."""
    if given is None:
        return np.zeros(0)
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        return np.asarray([str(v) for v in given])


def line_width(width: float | None) -> float:
    """Return the width of a line in points: the width in `rcParams`, scaled by the ratio to plotly's default."""
    from matplotlib import rcParams

    return float(rcParams["lines.linewidth"]) * (1.0 if width is None else float(width) / PLOTLY_LINE)


def marker_size(size: float | None) -> float:
    """Return the size of a marker in points: two thirds of `rcParams`, scaled by the ratio to plotly's default."""
    from matplotlib import rcParams

    return float(rcParams["lines.markersize"]) * (1.0 if size is None else float(size) / PLOTLY_MARKER) / 1.5
