"""The picture of the page on contact points."""

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from evidence.sections.cases import MOST, Found, Series

FIGURE = Path(__file__).parents[2] / "docs" / "images" / "contact_points.png"
COLOURS = {"bending": "#1f5a9e", "leaning": "#c8641e", "torsion": "#3a8a4d"}
TICKS = (1, 2, 3, 5, 7, 11)
SHOWN = (1, 2, 3, MOST)
SHADES = ("#b8b8b8", "#e0a030", "#1f5a9e", "#000000")


def _errors(axes: Axes, found: Found, which: int) -> None:
    """Draw the distances from the most sections."""
    for series in (s for s in found.series if s.kept == "5"):
        weak = series.ratio == max(series.case.ratios)
        counts = series.counts[:-1]
        values = [100 * abs(series.off(count)[which]) for count in counts]
        axes.plot(
            counts,
            values,
            "o-" if weak else "s--",
            color=COLOURS[series.case.name],
            ms=4,
            lw=1.2,
            label=f"{series.case.name}, ratio {series.ratio:g}",
        )
    axes.set(xscale="log", yscale="log", xlabel="sections", xlim=(0.9, 18))
    counts = np.array([1.0, float(MOST)])
    law = axes.get_ylim()[1] / counts**2
    axes.plot(counts, law, color="black", lw=0.8, ls=":")
    axes.text(counts[1], law[1], "1/n²", va="bottom", ha="right", fontsize=8)
    axes.set_xticks(TICKS, [str(tick) for tick in TICKS])
    axes.minorticks_off()
    word = ("amplitude", "frequency")[which]
    axes.set_ylabel(f"{word} of the peak, % off {MOST} sections", fontsize=9)
    axes.grid(alpha=0.3)


def _curves(axes: Axes, series: Series) -> None:
    """Draw the response with some numbers of sections."""
    for count, shade in zip(SHOWN, SHADES, strict=True):
        one = series.of(count)
        axes.plot(
            one.curve[0], 1e6 * one.curve[1], color=shade, lw=1.3, ls="--" if count == MOST else "-", label=f"{count}"
        )
    axes.set(xlabel="frequency, Hz", ylabel="amplitude, µm")
    axes.set_title(f"{series.case.title}, ratio {series.ratio:g}", fontsize=9)
    axes.legend(title="sections", fontsize=8, title_fontsize=8)
    axes.grid(alpha=0.3)


def _per_point(axes: Axes, found: Found) -> None:
    """Draw the peak's frequency over the sections, per area and per point."""
    best = found.strong
    for series, label, style in ((best, "per area", "o-"), (found.per_point, "per point", "s--")):
        peaks = series.peaks
        axes.plot([p.count for p in peaks], [p.hertz for p in peaks], style, ms=4, label=label)
    axes.set(xlabel="sections", ylabel="frequency of the peak, Hz")
    axes.set_title(f"{best.case.title}, ratio {best.ratio:g}", fontsize=9)
    axes.legend(title="stiffness", fontsize=8, title_fontsize=8)
    axes.grid(alpha=0.3)


def draw(found: Found, path: Path = FIGURE) -> None:
    """Write the picture."""
    figure, axes = plt.subplots(2, 3, figsize=(12.5, 7.2), layout="constrained")
    _errors(axes[0, 0], found, 0)
    _errors(axes[0, 1], found, 1)
    axes[0, 0].legend(fontsize=7)
    _per_point(axes[0, 2], found)
    for place, name in zip(axes[1], COLOURS, strict=True):
        own = [s for s in found.series if s.case.name == name and s.kept == "5"]
        _curves(place, min(own, key=lambda s: s.ratio))
    figure.savefig(path, dpi=68)
    plt.close(figure)
