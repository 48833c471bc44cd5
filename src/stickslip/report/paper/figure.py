"""A figure of the page on axes of matplotlib, with the fonts, sizes and line widths of `rcParams`."""

from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go

from stickslip.errors import StickslipError, input_error, missing_package
from stickslip.report.paper.looks import worded
from stickslip.report.paper.panels import Place, arranged, places, set_axes
from stickslip.report.paper.texts import fit_texts, name_alone
from stickslip.report.paper.traces import Panel, draw_trace, unknown_kinds

MAX_COLUMNS = 8  # columns of a legend
LINES_OF_A_CASE = 3  # largest number of entries of a group that each carry its name
SOLID = ("scatter3d", "mesh3d", "surface", "cone")


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
