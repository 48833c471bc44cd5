"""Traces of plotly as artists on axes of matplotlib: lines with markers, areas, bars, maps, polar curves."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.report.paper.labels import Label, label_at
from stickslip.report.paper.looks import (
    PLOTLY_MARKER,
    colour_map,
    dash,
    line_width,
    marker_size,
    shade,
    symbol,
    values_of,
    worded,
)

_FLAT = ("scatter", "scattergl", "bar", "heatmap", "histogram", "scatterpolar")


@dataclass
class Panel:
    """Axes while traces are drawn into them.

    Parameters
    ----------
    axes
        Axes of matplotlib.
    layout
        Layout of the plotly figure.
    traces
        All traces of these axes.
    handles
        Entries of the legend so far: artist, text and group.
    last
        Coordinates of the last line, the possible lower edge of an area.
    stacked
        Height of the bars so far, by place and sign.
    mappable
        Artist of the colour bar; None without a bar.
    bar_title
        Title of the colour bar.
    labels
        Texts beside points so far.
    """

    axes: Any
    layout: Any
    traces: Sequence[Any] = ()
    handles: list[tuple[Any, str, str]] = field(default_factory=list)
    last: tuple[Any, Any] | None = None
    stacked: dict[Any, float] = field(default_factory=dict)
    mappable: Any = None
    bar_title: str = ""
    labels: list[Label] = field(default_factory=list)


def unknown_kinds(traces: Any) -> list[str]:
    """Return the kinds of traces that are not drawn on paper, such as ``mesh3d``."""
    return sorted({trace.type for trace in traces} - set(_FLAT))


def draw_trace(panel: Panel, trace: Any) -> None:
    """Draw one trace, unless it is hidden."""
    if trace.visible in (False, "legendonly"):
        return
    artist = _DRAWN[trace.type](panel, trace)
    if artist is not None and trace.showlegend is not False and trace.name:
        panel.handles.append((artist, worded(trace.name), worded(trace.legendgrouptitle.text)))


def _scatter(panel: Panel, trace: Any) -> Any:
    return _curve(panel, trace, values_of(trace.x), values_of(trace.y))


def _polar(panel: Panel, trace: Any) -> Any:
    return _curve(panel, trace, np.deg2rad(values_of(trace.theta)), values_of(trace.r))


def _curve(panel: Panel, trace: Any, x: Any, y: Any) -> Any:
    """Draw line, area, error bars, markers and texts of a trace; return the artist for the legend."""
    n = min(len(x), len(y))
    x, y = x[:n], y[:n]
    mode = trace.mode or ("lines+markers" if n < 20 else "lines")
    if trace.fill:
        _area(panel, trace, x, y)
    if trace.type != "scatterpolar":
        _error_bars(panel, trace, x, y)
    panel.last = (x, y)
    many = "markers" in mode and _is_many(trace.marker)
    artist = None
    if "lines" in mode or ("markers" in mode and not many):
        (artist,) = panel.axes.plot(x, y, **_line_look(trace, mode, with_markers=not many))
    if many:
        dots = _dots(panel, trace, x, y)
        artist = artist or dots
    if "text" in mode:
        _texts(panel, trace, x, y)
    return artist


def _is_many(marker: Any) -> bool:
    """Whether each marker has a look of its own."""
    parts = (marker.color, marker.size, marker.symbol, marker.opacity, marker.line.color, marker.line.width)
    return any(isinstance(v, list | tuple | np.ndarray) for v in parts)


def _line_look(trace: Any, mode: str, *, with_markers: bool) -> dict[str, Any]:
    colour = trace.line.color if trace.line.color is not None else trace.marker.color
    if _is_many(trace.marker) and trace.line.color is None:
        colour = None
    opacity = trace.opacity
    look: dict[str, Any] = {"color": shade(colour, opacity), "linewidth": line_width(trace.line.width)}
    look["linestyle"] = dash(trace.line.dash) if "lines" in mode else "none"
    if trace.type == "scatter" and trace.line.shape in ("hv", "vh", "hvh"):
        look["drawstyle"] = {"hv": "steps-post", "vh": "steps-pre", "hvh": "steps-mid"}[trace.line.shape]
    if "markers" in mode and with_markers:
        marker, is_open = symbol(trace.marker.symbol)
        own = shade(trace.marker.color if trace.marker.color is not None else trace.line.color, opacity)
        own = (*own[:3], own[3] * float(trace.marker.opacity if trace.marker.opacity is not None else 1.0))
        edge = trace.marker.line
        look |= {
            "marker": marker,
            "markersize": marker_size(trace.marker.size),
            "markerfacecolor": "none" if is_open else own,
            "markeredgecolor": own if edge.color is None or is_open else shade(edge.color, opacity),
            "markeredgewidth": line_width(edge.width) if edge.width or is_open or marker in "x+|_" else 0.0,
        }
    return look


def _dots(panel: Panel, trace: Any, x: Any, y: Any) -> Any:
    """Draw markers, each in its own colour, size and symbol; return the markers with the first symbol."""
    n, marker = len(x), trace.marker
    given = marker.symbol
    symbols = np.array(list(given)[:n] if isinstance(given, list | tuple | np.ndarray) else [given or "circle"] * n)
    sizes = np.array([marker_size(v) for v in _each(marker.size, PLOTLY_MARKER, n)])
    rims = np.array([line_width(v) for v in _each(marker.line.width, 0.0, n)])
    colours = _dot_colours(panel, trace, n)
    drawn = None
    for name in dict.fromkeys(symbols):
        own = np.flatnonzero(symbols == name)
        shape, is_open = symbol(str(name))
        look: dict[str, Any] = {
            "s": sizes[own] ** 2,
            "marker": shape,
            "linewidths": np.maximum(rims[own], line_width(1.0) if is_open else 0.0),
        }
        look |= _own_colours(colours, own, trace, is_open=is_open)
        points = panel.axes.scatter(x[own], y[own], **look, zorder=2.5)
        drawn = drawn or points
        if "cmap" in look and (marker.showscale or marker.coloraxis):
            panel.mappable, panel.bar_title = points, _bar_title(panel, marker)
    return drawn


def _each(given: Any, default: float, n: int) -> FloatArray:
    """Return a number for each of `n` markers."""
    return np.broadcast_to(values_of(default if given is None else given), (n,))


def _own_colours(colours: dict[str, Any], own: Any, trace: Any, *, is_open: bool) -> dict[str, Any]:
    """Return the colours of some markers: their faces, or their rims if they are open."""
    if "cmap" in colours:
        return {**colours, "c": colours["c"][own]}
    chosen = [colours["c"][k] for k in own]
    if is_open:
        return {"facecolors": "none", "edgecolors": chosen}
    rim = trace.marker.line.color
    return {"c": chosen} | ({"edgecolors": shade(rim)} if isinstance(rim, str) else {})


def _dot_colours(panel: Panel, trace: Any, n: int) -> dict[str, Any]:
    given = trace.marker.color
    opacity = trace.marker.opacity if isinstance(trace.marker.opacity, int | float) else trace.opacity
    if given is None or isinstance(given, str):
        return {"c": [shade(given if given is not None else trace.line.color, opacity)] * n}
    colours = values_of(given)
    if colours.dtype.kind != "f":
        return {"c": [shade(str(v), opacity) for v in given]}
    shared = getattr(panel.layout, trace.marker.coloraxis) if trace.marker.coloraxis else trace.marker
    return {
        "c": colours,
        "cmap": colour_map(shared.colorscale),
        "vmin": shared.cmin,
        "vmax": shared.cmax,
        "alpha": opacity,
    }


def _bar_title(panel: Panel, owner: Any) -> str:
    shared = getattr(panel.layout, owner.coloraxis) if owner.coloraxis else owner
    return worded(shared.colorbar.title.text)


def _area(panel: Panel, trace: Any, x: Any, y: Any) -> None:
    colour = shade(trace.fillcolor if trace.fillcolor is not None else trace.line.color, None)
    colour = colour if trace.fillcolor is not None else (*colour[:3], 0.3)
    axes = panel.axes
    if trace.fill == "toself":
        axes.fill(*_closed_pieces(x, y, colour), linewidth=0, zorder=1)
    elif trace.fill == "tonexty" and panel.last is not None:
        below = panel.last
        axes.fill(np.concatenate([x, below[0][::-1]]), np.concatenate([y, below[1][::-1]]), color=colour, linewidth=0)
    elif trace.fill == "tozeroy":
        axes.fill_between(x, y, color=colour, linewidth=0)


def _closed_pieces(x: FloatArray, y: FloatArray, colour: Any) -> list[Any]:
    """Return the outlines that NaN separate, as arguments of `Axes.fill`."""
    cuts = np.flatnonzero(np.isnan(x) | np.isnan(y))
    pieces: list[Any] = []
    for own in np.split(np.arange(len(x)), cuts):
        inside = own[~np.isnan(x[own]) & ~np.isnan(y[own])]
        if inside.size:
            pieces += [x[inside], y[inside], colour]
    return pieces


def _error_bars(panel: Panel, trace: Any, x: Any, y: Any) -> None:
    ranges = {}
    for name, given in (("xerr", trace.error_x), ("yerr", trace.error_y)):
        if given.array is not None:
            up = values_of(given.array)
            ranges[name] = [up if given.arrayminus is None else values_of(given.arrayminus), up]
    if ranges:
        colour = trace.error_y.color or trace.marker.color or trace.line.color
        one = colour if isinstance(colour, str) else None
        panel.axes.errorbar(x, y, **ranges, fmt="none", ecolor=shade(one), elinewidth=line_width(1.4), capsize=2)


def _texts(panel: Panel, trace: Any, x: Any, y: Any) -> None:
    n = len(x)
    texts = [trace.text] * n if isinstance(trace.text, str) else trace.text
    if texts is None:
        return
    places = (
        [trace.textposition or "middle center"] * n
        if not isinstance(trace.textposition, list | tuple)
        else trace.textposition
    )
    told = [one for one in zip(x, y, (worded(str(text)) for text in texts), places, strict=False) if one[2].strip()]
    colour = shade(trace.textfont.color if isinstance(trace.textfont.color, str) else None, None, "black")
    moves = len(told) == 1 and "markers" in str(trace.mode) and n > 1  # the label of a curve, not of a point
    for own_x, own_y, text, place in told:
        stand, align = place.split()
        side = {"left": -1, "right": 1}.get(align, 0), {"top": 1, "bottom": -1}.get(stand, 0)
        note = label_at(panel.axes, text.strip(), (own_x, own_y), side, colour)
        panel.labels.append(Label(note, x if moves else x[:0], y if moves else y[:0]))


def _bars(panel: Panel, trace: Any) -> Any:
    lying = trace.orientation == "h"
    places, lengths = (_joined(v) for v in ((trace.y, trace.x) if lying else (trace.x, trace.y)))
    places = places if places.size else np.arange(lengths.size, dtype=np.float64)
    base = values_of(trace.base) if trace.base is not None else np.zeros(len(places))
    stacks = panel.layout.barmode in ("stack", "relative")
    if stacks:
        keys = [(str(v), n < 0) for v, n in zip(places, lengths, strict=True)]
        base = np.array([panel.stacked.get(key, 0.0) for key in keys])
        panel.stacked |= {k: float(b + n) for k, b, n in zip(keys, base, np.nan_to_num(lengths), strict=True)}
    colour = trace.marker.color
    own = shade(colour, trace.opacity) if colour is None or isinstance(colour, str) else [shade(v) for v in colour]
    width, places = _bar_places(panel, trace, places, stacks=stacks)
    if lying:
        return panel.axes.barh(places, lengths, width, left=base, color=own)
    return panel.axes.bar(places, lengths, width, bottom=base, color=own)


def _joined(given: Any) -> Any:
    """Return the places of bars; names on two levels become one name."""
    nested = isinstance(given, list | tuple) and len(given) == 2 and not isinstance(given[0], str | int | float)
    return np.array([", ".join(map(str, pair)) for pair in zip(*given, strict=True)]) if nested else values_of(given)


def _bar_places(panel: Panel, trace: Any, places: Any, *, stacks: bool) -> tuple[float, Any]:
    """Return the width of bars and their places, side by side with the bars of other traces in the panel."""
    if isinstance(trace.width, int | float):
        return float(trace.width), places
    if places.dtype.kind != "f":
        return 0.8, places
    apart = np.diff(np.unique(places))
    room = 0.8 * float(apart.min() if apart.size else 1.0)
    beside = [t for t in panel.traces if t.type == "bar"]
    if stacks or panel.layout.barmode == "overlay" or len(beside) < 2:
        return room, places
    own = next(k for k, t in enumerate(beside) if t is trace)
    return room / len(beside), places + room * ((own + 0.5) / len(beside) - 0.5)


def _heatmap(panel: Panel, trace: Any) -> None:
    z = np.asarray(trace.z, dtype=np.float64)
    names = [None if v is None else values_of(v) for v in (trace.x, trace.y)]
    at = [
        np.arange(size, dtype=np.float64) if own is None or own.dtype.kind != "f" else own
        for own, size in zip(names, z.shape[::-1], strict=True)
    ]
    drawn = panel.axes.pcolormesh(
        *at,
        np.ma.masked_invalid(z),
        cmap=colour_map(trace.colorscale),
        vmin=trace.zmin,
        vmax=trace.zmax,
        edgecolor="face",
        linewidth=0.1,
    )
    for axis, own, places in zip((panel.axes.xaxis, panel.axes.yaxis), names, at, strict=True):
        if own is not None and own.dtype.kind != "f":
            axis.set_ticks(places, [worded(v) for v in own])
    if trace.showscale is not False:
        panel.mappable, panel.bar_title = drawn, _bar_title(panel, trace)


def _histogram(panel: Panel, trace: Any) -> Any:
    values = values_of(trace.x)
    return panel.axes.hist(values, bins="auto", color=shade(trace.marker.color), edgecolor="white", linewidth=0.3)[2]


_DRAWN: Mapping[str, Callable[[Panel, Any], Any]] = {
    "scatter": _scatter,
    "scattergl": _scatter,
    "scatterpolar": _polar,
    "bar": _bars,
    "heatmap": _heatmap,
    "histogram": _histogram,
}
