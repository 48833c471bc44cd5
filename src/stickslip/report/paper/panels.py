"""Panels of a plotly figure: their places on paper, axes, scales, ticks, titles, marks and notes, set on axes of matplotlib."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.report.paper.looks import dash, line_width, shade, values_of, worded

LEAST_WIDTH = 1.45  # least width of a panel with its labels, inches
PAGE_WIDTH = 900.0  # px of a figure on the page
PAGE_ROOM = 95.0  # px above and below its panels
LEAST_ASPECT, MOST_ASPECT = 0.4, 0.8  # height of a panel over its width
UPRIGHT = 1.5  # aspect of panels on paper over their aspect on a wide screen
_COINCIDENT = 1e-6  # share of the figure; closer places coincide


@dataclass(frozen=True)
class Place:
    """A panel of a plotly figure.

    Parameters
    ----------
    x, y
        Names of its axes in traces, such as ``x2``; the name of the polar axes twice.
    across, up
        Begin and end in the figure's width and height, from 0 to 1.
    traces
        Traces drawn in it.
    polar
        Whether its axes are polar.
    """

    x: str
    y: str
    across: tuple[float, float]
    up: tuple[float, float]
    traces: Sequence[Any] = field(default_factory=tuple)
    polar: bool = False

    def axis(self, layout: Any, direction: str) -> Any:
        """Return the plotly axis of a direction, ``x`` or ``y``."""
        name = self.x if direction == "x" else self.y
        return layout[f"{direction}axis{name[1:]}"]


def places(figure: Any) -> list[Place]:
    """Return the panels of a figure that have traces, in the order of the traces."""
    found: dict[tuple[str, str], list[Any]] = {}
    for trace in figure.data:
        own = trace.subplot or "polar" if trace.type == "scatterpolar" else ""
        names = (own, own) if own else (trace.xaxis or "x", trace.yaxis or "y")
        found.setdefault(names, []).append(trace)
    return [_place(figure.layout, x, y, traces) for (x, y), traces in found.items()]


def _place(layout: Any, x: str, y: str, traces: Sequence[Any]) -> Place:
    if x.startswith("polar"):
        domain = layout[x].domain
        return Place(x, y, _ends(domain.x), _ends(domain.y), traces, polar=True)
    return Place(x, y, _ends(layout[f"xaxis{x[1:]}"].domain), _ends(layout[f"yaxis{y[1:]}"].domain), traces)


def _ends(domain: Any) -> tuple[float, float]:
    low, high = domain or (0.0, 1.0)
    return float(low), float(high)


@dataclass(frozen=True)
class Cells:
    """Rows and columns of panels.

    Parameters
    ----------
    widths
        Width of each column in inches.
    heights
        Height of each row in inches.
    spans
        Rows and columns that each panel covers.
    reflowed
        Whether panels stand in fewer columns than on the page.
    """

    widths: list[float]
    heights: list[float]
    spans: list[tuple[slice, slice]]
    reflowed: bool = False


def arranged(found: Sequence[Place], wide: float, page_height: float | None) -> Cells:
    """Return the rows and columns of panels.

    Parameters
    ----------
    found
        Panels of the figure on the page.
    wide
        Width of the paper in inches.
    page_height
        Height of the figure on the page in px; None: 480.
    """
    columns = _tracks([place.across for place in found])
    rows = _tracks([place.up for place in found])[::-1]
    across, up = (np.array([high - low for low, high in tracks]) for tracks in (columns, rows))
    page = up * ((page_height or 480.0) - PAGE_ROOM) / (PAGE_WIDTH * across.max())
    aspects = np.clip(UPRIGHT * page, LEAST_ASPECT, MOST_ASPECT)
    widths = wide * across / across.sum()
    fit = max(1, int(wide / LEAST_WIDTH))
    if widths.min() >= LEAST_WIDTH or fit >= len(columns):
        spans = [(_span(rows, place.up), _span(columns, place.across)) for place in found]
        return Cells(widths.tolist(), (aspects * widths.max()).tolist(), spans)
    n = -(-len(found) // fit)
    spans = [(slice(k // fit, k // fit + 1), slice(k % fit, k % fit + 1)) for k in range(len(found))]
    return Cells([wide / fit] * fit, [float(aspects.max()) * wide / fit] * n, spans, reflowed=True)


def _tracks(ranges: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the ranges of single rows or columns; longer ranges span several of them."""
    found: list[tuple[float, float]] = []
    for low, high in sorted(ranges):
        if not found or low >= found[-1][1] - _COINCIDENT:
            found.append((low, high))
    return found


def _span(tracks: Sequence[tuple[float, float]], own: tuple[float, float]) -> slice:
    """Return the rows or columns that a panel covers."""
    inside = [
        k for k, (low, high) in enumerate(tracks) if own[0] - _COINCIDENT <= 0.5 * (low + high) <= own[1] + _COINCIDENT
    ]
    return slice(inside[0], inside[-1] + 1)


def set_axes(axes: Any, place: Place, layout: Any) -> None:
    """Set titles, scales, ranges, ticks and grid of the axes of a panel, then its marks and notes."""
    if place.polar:
        _set_polar(axes, layout[place.x])
    else:
        for direction in ("x", "y"):
            _set_axis(axes, direction, place.axis(layout, direction))
        anchored = [place.axis(layout, d) for d in ("x", "y") if place.axis(layout, d).scaleanchor]
        if anchored:
            axes.set_aspect("equal", adjustable="box" if anchored[0].constrain == "domain" else "datalim")
    _set_notes(axes, place, layout)
    if not place.polar:
        for mark in layout.shapes:
            _set_mark(axes, place, mark)


def _set_axis(axes: Any, direction: str, own: Any) -> None:
    axis = axes.xaxis if direction == "x" else axes.yaxis
    if own.visible is False:
        axis.set_visible(False)
        return
    logarithmic = own.type == "log"
    if logarithmic:
        (axes.set_xscale if direction == "x" else axes.set_yscale)("log")
    if own.title.text:
        axis.set_label_text(worded(own.title.text))
    limits = axes.set_xlim if direction == "x" else axes.set_ylim
    if own.range is not None and all(isinstance(v, int | float | np.number) for v in own.range):
        limits(*([10.0**v for v in own.range] if logarithmic else own.range))
    elif logarithmic:
        axes.autoscale(enable=True, axis=direction)
    _set_ticks(axis, own, limits)
    if own.autorange == "reversed":
        (axes.invert_xaxis if direction == "x" else axes.invert_yaxis)()
    if own.showticklabels is False:
        axis.set_tick_params(labelleft=False, labelbottom=False)


def _set_ticks(axis: Any, own: Any, limits: Any) -> None:
    from matplotlib.ticker import MultipleLocator, NullFormatter, NullLocator

    if own.tickvals is not None:
        low, high = sorted(axis.get_view_interval())
        at = values_of(own.tickvals)
        texts = [worded(str(v)) for v in (own.ticktext if own.ticktext is not None else own.tickvals)]
        plain = axis.get_scale() != "log" and all(_is_number(text) for text in texts)
        if at.dtype.kind == "f" and not plain:
            inside = [k for k, v in enumerate(at) if low <= v <= high]
            axis.set_ticks(at[inside], [texts[k] for k in inside])
            axis.set_minor_locator(NullLocator())
            limits(low, high)
    elif isinstance(own.dtick, int | float) and axis.get_scale() != "log":
        axis.set_major_locator(MultipleLocator(own.dtick))
    elif axis.get_scale() == "log":
        axis.set_minor_formatter(NullFormatter())


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _set_polar(axes: Any, own: Any) -> None:
    if own.angularaxis.direction == "clockwise":
        axes.set_theta_direction(-1)
    if isinstance(own.angularaxis.rotation, int | float):
        axes.set_theta_offset(np.deg2rad(own.angularaxis.rotation))
    if own.angularaxis.tickvals is not None:
        texts = own.angularaxis.ticktext if own.angularaxis.ticktext is not None else own.angularaxis.tickvals
        axes.set_thetagrids(values_of(own.angularaxis.tickvals), [worded(str(v)) for v in texts])
    if own.radialaxis.range is not None:
        axes.set_rlim(*own.radialaxis.range)


def _set_notes(axes: Any, place: Place, layout: Any) -> None:
    """Set the notes of a panel; a note above it, in coordinates of the figure, is its title."""
    for note in layout.annotations:
        if not note.text or note.visible is False:
            continue
        if note.xref == place.x and note.yref == place.y:
            _annotate(axes, note)
        elif note.xref == "paper" and note.yref == "paper" and _titles(place, note):
            axes.set_title(worded(note.text))


def _titles(place: Place, note: Any) -> bool:
    """Whether a note stands centred above a panel, or at its left end."""
    if note.showarrow or note.textangle:
        return False
    middle = abs(note.x - 0.5 * sum(place.across)) < 1e-3
    left = abs(note.x - place.across[0]) < 1e-3
    return bool((middle or left) and 0 <= note.y - place.up[1] < 0.08)


def _annotate(axes: Any, note: Any) -> None:
    at = [
        10.0 ** float(v) if scale == "log" and isinstance(v, int | float) else v
        for v, scale in ((note.x, axes.get_xscale()), (note.y, axes.get_yscale()))
    ]
    shift = (note.ax or 0, -(note.ay or 0)) if note.showarrow is not False else (note.xshift or 0, note.yshift or 0)
    arrow = {"arrowstyle": "->", "linewidth": 0.6} if note.showarrow is not False and note.arrowhead != 0 else None
    axes.annotate(
        worded(note.text),
        at,
        xytext=[0.6 * float(v) for v in shift],
        textcoords="offset points",
        ha=note.xanchor if note.xanchor in ("left", "right", "center") else "center",
        va={"top": "top", "bottom": "bottom"}.get(note.yanchor, "center"),
        fontsize="small",
        arrowprops=arrow,
    )


def _set_mark(axes: Any, place: Place, mark: Any) -> None:
    """Draw a line or a rectangle in this panel; its ends may be shares of the panel."""
    x_ref, y_ref = (mark.xref or "x").split(), (mark.yref or "y").split()
    if x_ref[0] not in (place.x, "paper") or y_ref[0] not in (place.y, "paper") or x_ref[0] == y_ref[0] == "paper":
        return
    shares = [ref[0] == "paper" or ref[-1] == "domain" for ref in (x_ref, y_ref)]
    look = {"linewidth": line_width(mark.line.width), "zorder": 0.5 if mark.layer == "below" else 1.5}
    corners: FloatArray = np.array([[mark.x0, mark.y0], [mark.x1, mark.y1]], dtype=np.float64)
    transform = _blended(axes, shares)
    if mark.type == "line":
        axes.plot(
            *corners.T,
            color=shade(mark.line.color, mark.opacity),
            linestyle=dash(mark.line.dash),
            transform=transform,
            **look,
        )
    elif mark.type == "rect":
        outline = corners[[0, 1, 1, 0], 0], corners[[0, 0, 1, 1], 1]
        fill = shade(mark.fillcolor, mark.opacity, "none")
        axes.fill(
            *outline, facecolor=fill, edgecolor=shade(mark.line.color, None, "black"), transform=transform, **look
        )


def _blended(axes: Any, shares: Sequence[bool]) -> Any:
    from matplotlib.transforms import blended_transform_factory

    x, y = (axes.transAxes if own else axes.transData for own in shares)
    return blended_transform_factory(x, y)
