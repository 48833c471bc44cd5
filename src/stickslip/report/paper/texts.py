"""Texts that fit on a panel: titles in lines, ticks that do not overlap, axis names shared with a neighbour."""

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np

from stickslip.report.paper.looks import worded
from stickslip.report.paper.panels import Place

LETTER = 0.55  # mean width of a letter over the size of its font
LINE = 1.3  # height of a line over the size of its font
BESIDE, BELOW = 0.65, 0.45  # inches of a panel for tick labels and titles
LEAST = 0.5  # least share of a panel for its axes
SMALLEST = 4.0  # least size of a tick label, points
INCH = 72.0  # points


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
