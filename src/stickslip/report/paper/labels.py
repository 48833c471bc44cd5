"""Labels of curves on paper: each beside its own curve, clear of other labels and of lines."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray

APART = 2.5  # points between a label and its point
SAMPLED = 400  # places along a line at which it is looked for in a label
ALIGN = {-1: "right", 0: "center", 1: "left"}
STAND = {-1: "top", 0: "center", 1: "bottom"}


@dataclass(frozen=True, eq=False)
class Label:
    """A text beside a point of a curve.

    Parameters
    ----------
    note
        Annotation of matplotlib.
    x, y
        Points of the curve to which the label may move; empty if it stays.
    """

    note: Any
    x: FloatArray
    y: FloatArray


def label_at(axes: Any, text: str, place: tuple[Any, Any], side: tuple[int, int], colour: Any) -> Any:
    """Return an annotation beside a place of axes; `side` is -1, 0 or 1 across and up."""
    note = axes.annotate(text, place, xytext=(0, 0), textcoords="offset points", fontsize="small", color=colour)
    _move(note, place, side)
    return note


def clear_labels(paper: Any, axes: Any, labels: Sequence[Label]) -> None:
    """Move labels that overlap others or lie on lines to another point of their curve; hide those without a clear place.

    Parameters
    ----------
    paper
        The figure, in its final size.
    axes
        Its axes.
    labels
        Labels in these axes. Those that stay are placed first.
    """
    if not labels:
        return
    paper.draw_without_rendering()  # settles the layout
    renderer = paper.canvas.get_renderer()
    inside, lines = axes.get_window_extent(renderer), _sampled(axes)
    taken = [own.note.get_window_extent(renderer) for own in labels if not own.x.size]
    for own in labels:
        if not own.x.size:
            continue
        crossing = None
        for place, side in _places(own):
            _move(own.note, place, side)
            box = own.note.get_window_extent(renderer)
            if any(box.overlaps(other) for other in taken) or not _within(box, inside):
                continue
            if not _hit(box, lines):
                taken.append(box)
                break
            crossing = crossing or (place, side, box)
        else:
            own.note.set_visible(crossing is not None)
            if crossing is not None:  # rather on a line than on another label
                _move(own.note, *crossing[:2])
                taken.append(crossing[2])


def _places(own: Label) -> Iterator[tuple[tuple[Any, Any], tuple[int, int]]]:
    """Yield points and sides of a label: its own first, then those along the curve."""
    across, up = own.note.get_position()
    yield own.note.xy, (int(np.sign(across)), int(np.sign(up)))
    for i, place in enumerate(zip(own.x, own.y, strict=True)):
        toward = 1 if i == 0 else -1 if i == own.x.size - 1 else 0
        for up in (1, -1):
            yield place, (toward, up)


def _move(note: Any, place: tuple[Any, Any], side: tuple[int, int]) -> None:
    note.xy = place
    note.set_position((APART * side[0], APART * side[1]))
    note.set_horizontalalignment(ALIGN[side[0]])
    note.set_verticalalignment(STAND[side[1]])


def _sampled(axes: Any) -> FloatArray:
    """Return places (n, 2) in pixels along all lines of axes."""
    found = [np.zeros((0, 2))]
    for line in axes.lines:
        points = line.get_transform().transform(np.column_stack(line.get_data()))
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) > 1:
            at = np.linspace(0.0, len(points) - 1.0, SAMPLED)
            found.append(np.column_stack([np.interp(at, np.arange(len(points)), points[:, k]) for k in (0, 1)]))
    return np.vstack(found)


def _hit(box: Any, points: FloatArray) -> bool:
    return bool(np.any((points > [box.x0, box.y0]).all(axis=1) & (points < [box.x1, box.y1]).all(axis=1)))


def _within(box: Any, outer: Any) -> bool:
    return bool(box.x0 >= outer.x0 and box.x1 <= outer.x1 and box.y0 >= outer.y0 and box.y1 <= outer.y1)
