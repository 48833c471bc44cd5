"""What holds for each figure of the report, looked at whenever a test draws one."""

import re
from functools import wraps

import numpy as np
import plotly.graph_objects as go

from stickslip.report.plot import Plot

PREFIXED = re.compile(r"\([pnµmkMG](m|N|J|W|m/N|rad|rad/N)\)$")  # an axis whose unit was chosen by its numbers
SIZES = 1e-4, 1e6  # between which the largest number of such an axis lies


def look_at_each_plot() -> None:
    """Let each figure be looked at when it is made."""
    made = Plot.__init__

    @wraps(made)
    def looked_at(plot: Plot, *args: object, **words: object) -> None:
        made(plot, *args, **words)  # type: ignore[arg-type]
        wrong = [*nameless(plot.figure), *of_another_size(plot.figure)]
        assert not wrong, f"{plot.key}: {'; '.join(wrong)}"

    if not hasattr(made, "__wrapped__"):
        Plot.__init__ = looked_at  # type: ignore[method-assign]


def nameless(figure: go.Figure) -> list[str]:
    """Return what a legend would list as "trace 3": what is drawn without a name, unless it is left out of the legend."""
    listed = [(i, t) for i, t in enumerate(figure.data) if listed_in_a_legend(t)]
    shown = figure.layout.showlegend
    if shown is False or (shown is None and len(listed) < 2):
        return []
    return [f"what is drawn as number {i} has no name" for i, t in listed if not t.name]


def listed_in_a_legend(trace: go.Scatter) -> bool:
    """Return whether a trace stands in a legend unless the figure has none."""
    return trace.type in ("scatter", "bar") and trace.showlegend is not False


def of_another_size(figure: go.Figure) -> list[str]:
    """Return the axes with a prefix in their unit whose numbers have another size."""
    found = []
    for axis in figure.select_yaxes():
        title = axis.title.text or ""
        number = axis.plotly_name.removeprefix("yaxis")
        own = [
            np.asarray(t.y, dtype=float)
            for t in figure.data
            if t.type == "scatter" and t.y is not None and (t.yaxis or "y") == f"y{number}"
        ]
        largest = max(
            (float(np.abs(y[np.isfinite(y)]).max()) for y in own if np.isfinite(y).any()),
            default=0.0,
        )
        if PREFIXED.search(title) and largest and not SIZES[0] < largest < SIZES[1]:
            found.append(f"{title!r} with numbers up to {largest:.3g}")
    return found
