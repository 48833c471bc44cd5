"""The figure of the page on all strategies."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from evidence.strategies.compare import FLOOR, MANY, THRESHOLD, Comparison

FIGURE = Path(__file__).parents[2] / "docs" / "images" / "strategies.png"
MARKERS = ("v", "^", "o", "s", "D", "P", "X", "*", "<", ">", "p", "h", "d", "8")


def _panel(axes: Axes, comparison: Comparison, cost: str) -> None:
    many = comparison.of(MANY)
    colours = mpl.colormaps["tab20"](np.linspace(0.0, 1.0, 20))
    for i, o in enumerate(comparison.outcomes):
        x = getattr(o, cost) / getattr(many, cost)
        y = max(o.at_peak, FLOOR) if np.isfinite(o.at_peak) else np.nan
        axes.plot(
            100 * x,
            100 * y,
            MARKERS[i % len(MARKERS)],
            color=colours[i],
            ms=8,
            mec="black",
            mew=0.5,
            alpha=0.85,
            label=o.entry.title,
        )
    axes.axhline(100 * THRESHOLD, color="black", lw=0.8, ls="--")
    axes.set(yscale="log", ylim=(70 * FLOOR, 100))
    axes.set_xlim(left=0.0)
    axes.grid(alpha=0.3)


def draw(found: Sequence[Comparison], path: Path = FIGURE) -> None:
    """Write the figure."""
    figure, axes = plt.subplots(2, len(found), figsize=(4 * len(found), 7.4), layout="constrained", squeeze=False)
    for column, comparison in enumerate(found):
        _panel(axes[0, column], comparison, "unknowns")
        _panel(axes[1, column], comparison, "seconds")
        axes[0, column].set_title(comparison.case.name.replace("_", " "))
        axes[0, column].set_xlabel("harmonic-unknowns, % of always_high")
        axes[1, column].set_xlabel("CPU time, % of always_high")
    for row in axes:
        row[0].set_ylabel("error at resonance, %")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=9)
    figure.savefig(path, dpi=90)
    plt.close(figure)
