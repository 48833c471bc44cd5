"""A figure of the page for a paper: on axes of matplotlib, in the style of `rcParams`, as a file of vectors.

Titles break into lines, ticks do not overlap, and neighbours share the names of axes. The width of a file is in the
units of a journal.
"""

import math
import re
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import plotly.graph_objects as go

from stickslip.errors import StickslipError, input_error, missing_package
from stickslip.report.paper.labels import clear_labels
from stickslip.report.paper.looks import worded
from stickslip.report.paper.panels import Place, arranged, places, set_axes
from stickslip.report.paper.traces import Panel, draw_trace, unknown_kinds
from stickslip.study.store.atomic_write import unwritable

LETTER = 0.55  # mean width of a letter over the size of its font
LINE = 1.3  # height of a line over the size of its font
BESIDE, BELOW = 0.65, 0.45  # inches of a panel for tick labels and titles
LEAST = 0.5  # least share of a panel for its axes
SMALLEST = 4.0  # least size of a tick label, points
INCH = 72.0  # points
MAX_COLUMNS = 8  # columns of a legend
LINES_OF_A_CASE = 3  # largest number of entries of a group that each carry its name
SOLID = ("scatter3d", "mesh3d", "surface", "cone")
INCHES = {"mm": 1 / 25.4, "cm": 1 / 2.54, "in": 1.0, "pt": 1 / 72.27}
LEAST_WIDTH, MOST_WIDTH = 20 / 25.4, 1000 / 25.4  # inches
FORMATS = ("pdf", "svg", "eps", "png")
_LENGTH = re.compile(r"\s*([0-9.]+)\s*([a-z]+)\s*")
# settings for a column of a journal; the user's style is applied after them
STYLE: Any = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "legend.title_fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.5,
    "legend.frameon": False,
    "pdf.fonttype": 42,  # text stays editable
    "ps.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "stickslip",  # the same file from the same result
}
# files hold no date, so that the same result gives the same bytes
_NO_DATE = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}


def require_matplotlib() -> None:
    """Raise a `StickslipError` with the remedy if matplotlib is not installed."""
    try:
        from matplotlib import rcParams  # noqa: F401
    except (ModuleNotFoundError, OSError) as error:
        raise missing_package("matplotlib", error, "figure") from error


def on_paper(figure: go.Figure) -> bool:
    """Return whether a figure of the page can be drawn by matplotlib; solids cannot."""
    return bool(figure.data) and not unknown_kinds(figure.data)


def draw(figure: go.Figure, name: str, ax: Any = None, width: float | None = None) -> Any:
    """Draw a figure of the page by matplotlib; return the figure, or the axes that were given.

    Parameters
    ----------
    figure
        The figure of the page.
    name
        Its name, for errors.
    ax
        Axes to draw in: one for a figure with a single panel, else one a panel in the order of reading. None: a new figure.
    width
        Width of a new figure in inches; None: the width in ``rcParams["figure.figsize"]``.

    Raises
    ------
    InputError
        If the figure is a solid, or there are not as many axes as panels.
    StickslipError
        If matplotlib is not installed.
    """
    _require_flat(figure, name)
    require_matplotlib()
    found = places(figure)
    if ax is None:
        return _new(figure, found, width)
    given = list(ax.flat) if hasattr(ax, "flat") else list(ax) if isinstance(ax, Sequence) else [ax]
    wrong = next((one for one in given if not _is_axes(one)), None)
    if wrong is not None:
        remedy = f"Give {_count(len(found))} of matplotlib: `figure, ax = plt.subplots()` makes them, or `figure.add_subplot()`."
        raise input_error(f"plot({name!r}, ax=…)", f"holds a {type(wrong).__name__}", remedy)
    if len(given) != len(found):
        remedy = f"Give {_count(len(found))}, in the order of reading: `plt.subplots` makes them. Or leave `ax` out."
        raise input_error(f"plot({name!r}, ax=…)", f"has {_count(len(given))}", remedy)
    panels = [_drawn(figure, place, own) for place, own in zip(found, given, strict=True)]
    artists, texts, title = _legend(figure, panels)
    if len(texts) > 1:
        given[0].legend(artists, texts, title=title or None)
    return ax


def _is_axes(one: object) -> bool:
    from matplotlib.axes import Axes

    return isinstance(one, Axes)


def _count(n: int) -> str:
    return "one pair of axes" if n == 1 else f"{n} pairs of axes"


def _require_flat(figure: go.Figure, name: str) -> None:
    if not figure.data:
        raise input_error(f"plot({name!r})", "shows nothing", "Take another figure: result.plots names them.")
    unknown = unknown_kinds(figure.data)
    if any(kind in SOLID for kind in unknown):
        raise input_error(
            f"plot({name!r})",
            "is a picture in three dimensions, which matplotlib does not draw",
            "Take it from the page with its camera button, or write the motion for ParaView: result.export('vtu').",
        )
    if unknown:
        raise StickslipError(f"plot({name!r}): {', '.join(unknown)} is not drawn by matplotlib")


def _new(figure: go.Figure, found: Sequence[Place], width: float | None) -> Any:
    """Draw into a new figure: panels as on the page, or in fewer columns on narrow paper; the legend below them."""
    from matplotlib import rcParams
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    wide = float(rcParams["figure.figsize"][0]) if width is None else width
    cells = arranged(found, wide, figure.layout.height)
    highs = cells.heights
    paper = Figure(figsize=(wide, sum(highs)), layout="constrained")
    FigureCanvasAgg(paper)  # measures texts; a file of any format may be written
    tracks = paper.add_gridspec(len(highs), len(cells.widths), width_ratios=cells.widths, height_ratios=highs)
    panels = []
    for place, (rows, columns) in zip(found, cells.spans, strict=True):
        axes = paper.add_subplot(tracks[rows, columns], projection="polar" if place.polar else None)
        panel = _drawn(figure, place, axes)
        if cells.reflowed:
            name_alone(axes, place, figure.layout, found)
        fit_texts(axes, sum(cells.widths[columns]), sum(highs[rows]))
        panels.append(panel)
    for panel in panels:
        if panel.mappable is not None:
            paper.colorbar(panel.mappable, ax=panel.axes, label=panel.bar_title)
    below = _legend_below(paper, *_legend(figure, panels))
    paper.set_size_inches(wide, sum(highs) + below)
    for panel in panels:
        clear_labels(paper, panel.axes, panel.labels)
    return paper


def _drawn(figure: go.Figure, place: Place, axes: Any) -> Panel:
    panel = Panel(axes, figure.layout, place.traces)
    for trace in place.traces:
        draw_trace(panel, trace)
    set_axes(axes, place, figure.layout)
    return panel


def _legend(figure: go.Figure, panels: Sequence[Panel]) -> tuple[list[Any], list[str], str]:
    """Return artists and texts of the legend, each once, and its title: the names of the groups, if groups are large."""
    groups: dict[str, dict[str, Any]] = {}
    for panel in panels:
        for artist, text, group in panel.handles:
            groups.setdefault(group, {}).setdefault(text, artist)
    titled = [title for title in groups if title]
    named = len(titled) > 1 and max(map(len, groups.values())) <= LINES_OF_A_CASE
    texts = [f"{title}: {text}" if named and title else text for title, own in groups.items() for text in own]
    title = worded(figure.layout.legend.title.text) or ("" if named else " · ".join(titled))
    return [artist for own in groups.values() for artist in own.values()], texts, title


def _legend_below(paper: Any, artists: Sequence[Any], texts: Sequence[str], title: str) -> float:
    """Set the legend below the panels in as many columns as fit; return its height in inches."""
    if len(texts) < 2:  # a single curve needs no name
        return 0.0
    wide = paper.get_size_inches()[0] * paper.dpi
    for columns in range(min(len(texts), MAX_COLUMNS), 0, -1):
        legend = paper.legend(artists, texts, title=title or None, ncols=columns, loc="outside lower center")
        size = legend.get_window_extent(paper.canvas.get_renderer())
        if size.width <= wide or columns == 1:
            break
        legend.remove()
    return float(size.height / paper.dpi)


def inches(length: str) -> float:
    """Return a length such as ``85mm``, ``8.5cm``, ``3.35in`` or ``242pt`` (TeX's points) in inches.

    Raises
    ------
    InputError
        If the text is no length, or the length no possible width of a figure.
    """
    found = _LENGTH.fullmatch(length)
    try:
        size = float(found[1]) * INCHES[found[2]] if found else math.nan
    except (KeyError, ValueError):
        size = math.nan
    if not LEAST_WIDTH <= size <= MOST_WIDTH:
        remedy = "Give 20mm to 1000mm, such as 85mm, 8.5cm, 3.35in or 242pt."
        raise input_error("figure: width", f"is {length!r}", remedy)
    return size


def write_figure(figure: go.Figure, name: str, path: Path, width: str, style: str = "") -> None:
    """Write a figure of the page for a paper.

    Parameters
    ----------
    figure, name
        The figure and its name.
    path
        The file; its ending is the format: pdf, svg, eps or png.
    width
        Width, see `inches`.
    style
        A style of matplotlib, by name or file, whose fonts, sizes and colours of axes override `STYLE`; empty for none.

    Raises
    ------
    InputError
        If the format, the width or the style is unknown, the figure is a solid, or the file cannot be written.
    StickslipError
        If matplotlib is not installed.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        what = f"ends with {path.suffix!r}" if kind else "has no ending"
        raise input_error(f"figure: {path}", what, f"Give one of .{', .'.join(FORMATS)}.")
    wide = inches(width)
    require_matplotlib()
    from matplotlib import rc_context
    from matplotlib import style as styles

    with ExitStack() as settings:
        settings.enter_context(rc_context(STYLE))
        if style:
            try:
                settings.enter_context(styles.context(style))
            except OSError:
                remedy = "Give a file of rcParams, or a name of matplotlib.style.available."
                raise input_error("figure: style", f"{style!r} is none", remedy) from None
        drawn = draw(figure, name, width=wide)
        try:
            drawn.savefig(path, metadata=_NO_DATE.get(kind), dpi=300)
        except OSError as error:
            raise unwritable(path, error) from None


def name_alone(axes: Any, place: Place, layout: Any, others: Sequence[Place]) -> None:
    """Give axes their own tick labels and titles, which the page shows once for a row or column of panels."""
    if place.polar:
        return
    for axis, direction, same in ((axes.xaxis, "x", "across"), (axes.yaxis, "y", "up")):
        axis.set_tick_params(**{"labelbottom" if direction == "x" else "labelleft": True})
        beside = [other for other in others if not other.polar and getattr(other, same) == getattr(place, same)]
        titles = [other.axis(layout, direction).title.text for other in beside]
        if not axis.get_label_text():
            axis.set_label_text(worded(next(filter(None, titles), "")))


def fit_texts(axes: Any, width: float, height: float) -> None:
    """Break titles into lines and thin out ticks, for a panel of a size in inches."""
    across, up = max(width - BESIDE, LEAST * width), max(height - BELOW, LEAST * height)
    for text, room in ((axes.title, width), (axes.xaxis.label, across), (axes.yaxis.label, up)):
        if "$" not in text.get_text():
            letters = int(room * INCH / (LETTER * text.get_fontsize()))
            text.set_text(
                "\n".join(fill(line, max(8, letters), break_long_words=False) for line in text.get_text().split("\n"))
            )
    if axes.name == "polar":
        return
    _thin_out(axes.xaxis, across * INCH, lying=True)
    _thin_out(axes.yaxis, up * INCH, lying=False)
    _turn_names(axes.xaxis, across * INCH)
    _shrink_names(axes.yaxis, up * INCH)


def _thin_out(axis: Any, room: float, *, lying: bool) -> None:
    """Drop the labels of a logarithmic axis that would overlap; powers of ten stay before others."""
    from matplotlib.ticker import FixedFormatter, FixedLocator

    if axis.get_scale() != "log" or not isinstance(axis.get_major_locator(), FixedLocator):
        return
    ticks = np.asarray(axis.get_major_locator().locs)
    texts = [axis.get_major_formatter()(v, k) for k, v in enumerate(ticks)]
    low, high = np.log10(axis.get_view_interval())
    size = _size(axis)
    at = (np.log10(ticks) - low) / (high - low) * room
    order = sorted(range(len(ticks)), key=lambda k: (np.log10(ticks[k]) % 1 > 1e-9, k))
    kept: list[int] = []
    for k in order:
        own = size * (LETTER * len(texts[k]) if lying else 1.0)
        apart = [abs(at[k] - at[j]) - 0.5 * own - 0.5 * size * (LETTER * len(texts[j]) if lying else 1.0) for j in kept]
        if min(apart, default=size) > 0.3 * size:
            kept.append(k)
    axis.set_major_formatter(FixedFormatter([text if k in kept else "" for k, text in enumerate(texts)]))


def _size(axis: Any) -> float:
    """Return the size of the tick labels in points."""
    labels = [*axis.get_ticklabels(), axis.label]
    return float(labels[0].get_fontsize())


def _turn_names(axis: Any, room: float) -> None:
    """Turn the names of bars upright if they would overlap."""
    from matplotlib.category import StrCategoryFormatter

    if not isinstance(axis.get_major_formatter(), StrCategoryFormatter):
        return
    texts = axis.get_major_formatter().format_ticks(axis.get_major_locator()())
    size = _size(axis)
    if sum(LETTER * size * (len(text) + 2) for text in texts) > room:
        axis.set_tick_params(rotation=90)
        _shrink(axis, len(texts), room)


def _shrink_names(axis: Any, room: float) -> None:
    """Make the names of rows smaller if their lines would overlap."""
    from matplotlib.ticker import FixedLocator

    if axis.get_scale() != "log" and isinstance(axis.get_major_locator(), FixedLocator):
        _shrink(axis, len(axis.get_major_locator().locs), room)


def _shrink(axis: Any, lines: int, room: float) -> None:
    if lines and LINE * _size(axis) * lines > room:
        axis.set_tick_params(labelsize=max(SMALLEST, room / lines / LINE))
