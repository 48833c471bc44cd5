"""The pictures."""

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np

from evidence.figures.evidence import Evidence, Marker, Peaks
from evidence.figures.model import Model
from evidence.figures.solve import STEPS, Curve, Pair, time_signal
from stickslip.response import signals

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

LOW, HIGH, TIME, ALERT = "black", "#c1272d", "#1f5fa8", "#2c8a3d"
THRESHOLD = 5.0  # percent
SMALLEST = 1e-4  # percent: errors below are drawn there
DPI = 80
MICRO = 1e6


def draw_all(evidence: Evidence, folder: Path) -> list[Path]:
    """Draw every picture into a folder and return the files."""
    pictures: dict[str, Callable[[Evidence], Figure]] = {
        "seed_fig1": block_norms,
        "seed_fig4": forced_responses,
        "seed_fig5": time_and_cycles,
        "seed_fig6": errors_by_frequency,
        "seed_fig7": errors_and_times,
        "seed_fig9": optimisation,
        "seed_fig10": second_responses,
        "seed_fig11": second_cycles,
    }
    files = []
    for name, draw in pictures.items():
        figure = draw(evidence)
        files.append(folder / f"{name}.png")
        figure.savefig(files[-1], dpi=DPI, metadata={"Software": None})
        plt.close(figure)
    return files


def block_norms(evidence: Evidence) -> Figure:
    """Draw fig. 1: how strongly harmonics are coupled."""
    found = evidence.norms
    figure, axes = plt.subplots(1, 4, figsize=(15.5, 4.0), layout="constrained")
    titles = ("a) J, full stick", "a) the same, frozen sliders", "b) J, weak coupling", "c) ΔJ, strong coupling")
    for axis, matrix, title in zip(axes, (found.stuck, found.frozen, found.weak, found.missing), titles, strict=True):
        shown = np.log10(np.where(matrix > 0.0, np.maximum(matrix, 1e-4), np.nan))
        image = axis.imshow(shown, cmap="viridis", vmin=-4, vmax=0.5)
        for (row, column), value in np.ndenumerate(matrix):
            if value > 0.0:
                text = f"{value:.2g}" if value >= 1e-4 else "<1e-4"
                colour = "white" if value < 0.1 else "black"
                axis.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)
        axis.set(title=title, xlabel="harmonic of motion", ylabel="harmonic of force")
    figure.colorbar(image, ax=axes, label="log₁₀ of the largest singular value", shrink=0.85)
    return figure


def forced_responses(evidence: Evidence) -> Figure:
    """Draw fig. 4: responses, motions in time, and what the alert chooses, at the weak and the strong ratio."""
    plan = evidence.plan
    figure, rows = plt.subplots(2, 2, figsize=(11, 7.4), layout="constrained")
    timed = evidence.in_time
    for row, ratio, markers in zip(rows, (timed.ratio, plan.weak), (timed.markers, evidence.weak_markers), strict=True):
        peaks = evidence.at(ratio)
        _both(row[0], peaks)
        _markers(row[0], markers)
        _both(row[1], peaks)
        _alert(row[1], peaks.alert)
        centre = peaks.high.hertz[np.argmax(peaks.high.amplitudes)]
        for axis, letter in zip(row, "ab", strict=True):
            axis.set(
                xlim=(max(centre - 14, plan.branch_hertz[0]), min(centre + 9, plan.branch_hertz[1])),
                title=f"{letter}) $F_{{CL}}/F_{{HE}}$ = {ratio:g}",
                xlabel="frequency, Hz",
                ylabel="tip amplitude, µm",
            )
            axis.legend(fontsize=8)
            axis.grid(alpha=0.3)
    return figure


def _both(axis: Axes, peaks: Peaks) -> None:
    for name, colour, style in (("low", LOW, "--"), ("high", HIGH, "-")):
        response: Curve = getattr(peaks, name)
        label = f"H = {response.points[0].order}"
        hertz, height = response.line
        axis.plot(hertz, MICRO * height, style, color=colour, lw=1.3, label=label)
        for hertz in response.lost:
            axis.axvline(hertz, color=colour, lw=0.6, ls=":")


def _markers(axis: Axes, markers: list[Marker]) -> None:
    for found, face, label in ((True, TIME, "time integration"), (False, "none", "the same, not periodic")):
        some = [m.orbit for m in markers if m.orbit.found == found]
        if some:
            axis.plot(
                [o.hertz for o in some],
                [MICRO * o.amplitude for o in some],
                "o",
                ms=5,
                color=TIME,
                mfc=face,
                label=label,
            )


def _alert(axis: Axes, response: Curve) -> None:
    few = min(p.order for p in response.points)
    for many, marker in ((False, "o"), (True, "D")):
        chosen = [i for i, p in enumerate(response.points) if (p.order > few) == many]
        if chosen:
            axis.plot(
                response.hertz[chosen],
                MICRO * response.amplitudes[chosen],
                marker,
                ms=4,
                color=ALERT,
                mfc=ALERT if many else "none",
                label=f"alert: H = {response.points[chosen[0]].order}",
            )


def time_and_cycles(evidence: Evidence) -> Figure:
    """Draw fig. 5: the damper's rotation and the cycles of three contact points at the peak."""
    pair, orbit = evidence.in_time.pair, evidence.in_time.orbit
    figure, axes = plt.subplots(2, 2, figsize=(10.5, 7.2), layout="constrained")
    axis = axes[0, 0]
    phase = np.arange(1, STEPS + 1) / STEPS
    for point, colour, style in ((pair.low, LOW, "--"), (pair.high, HIGH, "-")):
        turned = time_signal(pair.problem, point, evidence.model.rotation, STEPS)
        axis.plot(phase, 1e3 * turned, style, color=colour, label=f"H = {point.order}")
    axis.plot(phase, 1e3 * orbit.rotation, ":", color=TIME, lw=2, label="time integration")
    axis.set(
        title=f"a) {pair.hertz:.2f} Hz, $F_{{CL}}/F_{{HE}}$ = {pair.ratio:g}",
        xlabel="time / period",
        ylabel="damper rotation, mrad",
    )
    axis.legend(fontsize=8)
    axis.grid(alpha=0.3)
    names = evidence.model.system.interface.names
    for axis, contact, letter in zip(axes.flat[1:], _middle(evidence.model), "bcd", strict=False):
        _cycles(axis, pair, contact)
        axis.plot(
            MICRO * _closed(orbit.gap[:, contact, 0]),
            _closed(orbit.force[:, contact, 0]),
            ":",
            color=TIME,
            lw=2,
            label="time integration",
        )
        axis.set_title(f"{letter}) contact point {names[contact]}")
        axis.legend(fontsize=8)
    return figure


def _middle(model: Model) -> list[int]:
    """Return the middle contact point of each of three lines."""
    lines = list(dict.fromkeys(model.lines))
    places = [[i for i, own in enumerate(model.lines) if own == line] for line in lines]
    return [own[len(own) // 2] for own in places][:3]


def _closed(values: np.ndarray) -> np.ndarray:
    return np.append(values, values[:1])


def _cycles(axis: Axes, pair: Pair, contact: int) -> None:
    for point, colour, style in ((pair.low, LOW, "--"), (pair.high, HIGH, "-")):
        found = signals(pair.problem, point)
        axis.plot(
            MICRO * _closed(found.gap[contact, 0]),
            _closed(found.force[contact, 0]),
            style,
            color=colour,
            lw=1.3,
            label=f"H = {point.order}",
        )
    axis.set(xlabel="tangential displacement, µm", ylabel="tangential force, N")
    axis.grid(alpha=0.3)


def errors_by_frequency(evidence: Evidence) -> Figure:
    """Draw fig. 6: predicted and actual error against frequency."""
    plan = evidence.plan
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.0), layout="constrained")
    for axis, ratio, letter in zip(axes, (plan.weak, plan.strong, plan.strongest), "abc", strict=True):
        found = evidence.pairs[ratio]
        hertz = [p.hertz for p in found]
        for name, colour, style in (("predicted", ALERT, "-"), ("real", HIGH, "--")):
            values = 100 * np.array([getattr(p, name) for p in found])
            axis.plot(hertz, np.maximum(values, SMALLEST), style, color=colour, label=name)
        axis.axhline(THRESHOLD, color="grey", lw=0.8)
        for lost in evidence.unsolved[ratio]:
            axis.axvline(lost, color="grey", lw=0.6, ls=":")
        axis.set(
            xlim=plan.hertz,
            yscale="log",
            title=f"{letter}) $F_{{CL}}/F_{{HE}}$ = {ratio:g}",
            xlabel="frequency, Hz",
            ylabel=f"error, % (at least {SMALLEST:g})",
        )
        axis.legend(fontsize=8)
        axis.grid(alpha=0.3)
    return figure


def errors_and_times(evidence: Evidence) -> Figure:
    """Draw fig. 7: a) actual against predicted error; b) error at resonance against CPU time."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5.2), layout="constrained")
    colours = mpl.colormaps["plasma"](np.linspace(0.0, 0.9, len(evidence.pairs)))
    for (ratio, found), colour in zip(evidence.pairs.items(), colours, strict=True):
        some = [p for p in found if p.predicted > 0.0]
        x, y = (np.maximum([100 * getattr(p, name) for p in some], SMALLEST) for name in ("predicted", "real"))
        left.plot(x, y, "o", ms=4, color=colour, alpha=0.8, label=f"{ratio:g}")
    ends = np.array([SMALLEST, 1e3])
    left.plot(ends, ends, "k-", lw=0.8)
    left.axvline(THRESHOLD, color="grey", lw=0.8)
    left.axhline(THRESHOLD, color="grey", lw=0.8)
    left.set(
        xscale="log",
        yscale="log",
        xlim=ends,
        ylim=ends,
        aspect="equal",
        title="a) every frequency that slips",
        xlabel="predicted error, %",
        ylabel="actual error, %",
    )
    left.legend(title="$F_{CL}/F_{HE}$", fontsize=7, loc="lower right")
    left.grid(alpha=0.3)
    _times(right, evidence)
    return figure


def _times(axis: Axes, evidence: Evidence) -> None:
    for name, colour, style, label in (
        ("low", LOW, "--o", "H = 1"),
        ("high", HIGH, "-s", "H = 5"),
        ("alert", ALERT, "-D", "alert"),
    ):
        some = [t for t in evidence.timing if np.isfinite(t.reference)]
        x = [t.median(name) for t in some]
        ends = np.array([np.quantile(t.seconds[name], (0.25, 0.75)) for t in some]).reshape(-1, 2)
        y = [max(100 * abs(t.error(name)), 1e-2) for t in some]
        axis.plot(x, y, style, color=colour, ms=5, lw=1.0, label=label, mfc="none")
        axis.hlines(y, ends[:, 0], ends[:, 1], color=colour, lw=2.5, alpha=0.4)
        full = [i for i, t in enumerate(some) if t.periodic]
        axis.plot([x[i] for i in full], [y[i] for i in full], style[-1], color=colour, ms=5)
        for t, a, b in zip(some, x, y, strict=True):
            axis.annotate(f"{t.ratio:g}", (a, b), fontsize=7, xytext=(3, 3), textcoords="offset points")
    axis.axhline(THRESHOLD, color="grey", lw=0.8)
    axis.set(
        xscale="log",
        yscale="log",
        title="b) numbers: $F_{CL}/F_{HE}$; hollow: not all motions periodic",
        xlabel=f"CPU time of {evidence.plan.timing_frequencies} frequencies, median and quartiles, s",
        ylabel="error at resonance against time integration, %",
    )
    axis.legend(fontsize=8)
    axis.grid(alpha=0.3, which="both")


def optimisation(evidence: Evidence) -> Figure:
    """Draw fig. 9: amplitude and frequency of the peak against the ratio, for the second and the first damper."""
    figure, rows = plt.subplots(2, 2, figsize=(11, 8.2), layout="constrained")
    mode = evidence.second_plan.mode
    for row, peaks, title in zip(
        rows,
        (evidence.second_peaks, evidence.peaks),
        (f"second damper, {mode}", "first damper, first bending"),
        strict=True,
    ):
        _optimisation(row[0], row[1], peaks)
        row[0].set_title(title)
    return figure


def _optimisation(left: Axes, right: Axes, peaks: list[Peaks]) -> None:
    ratios = [p.ratio for p in peaks]
    unit = ratios[0] * peaks[0].high.amplitudes.max()
    for name, colour, style, label in (
        ("low", LOW, "--o", "H = 1"),
        ("high", HIGH, "-s", "H = 5"),
        ("alert", ALERT, ":D", "alert"),
    ):
        curves: list[Curve] = [getattr(p, name) for p in peaks]
        per_force = [r * c.amplitudes.max() / unit for r, c in zip(ratios, curves, strict=True)]
        left.plot(ratios, per_force, style, color=colour, ms=4, lw=1.0, label=label)
        hertz = [c.hertz[np.argmax(c.amplitudes)] for c in curves]
        right.plot(ratios, hertz, style, color=colour, ms=4, lw=1.0, label=label)
    judged = [(p.ratio, p.orbit) for p in peaks if p.orbit is not None and p.orbit.found]
    if judged:
        left.plot(
            [r for r, _ in judged],
            [r * o.amplitude / unit for r, o in judged],
            "x",
            color=TIME,
            ms=8,
            label="time integration at the peak of H = 5",
        )
    left.set(yscale="log", ylabel="peak amplitude for a unit of force, stuck = 1")
    right.set(ylabel="frequency of the peak, Hz")
    for axis in (left, right):
        axis.set(xscale="log", xlabel="$F_{CL}/F_{HE}$")
        axis.set_xticks(ratios, [f"{r:g}" for r in ratios], rotation=45, fontsize=8)
        axis.tick_params(axis="x", which="minor", bottom=False, labelbottom=False)
        axis.legend(fontsize=8)
        axis.grid(alpha=0.3, which="both")


def second_responses(evidence: Evidence) -> Figure:
    """Draw fig. 10: responses with the second damper."""
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    plan = evidence.second_plan
    shown = [p for p in evidence.second_peaks if p.ratio in plan.ratios]
    for axis, peaks, letter in zip(axes, shown, "ab", strict=True):
        _both(axis, peaks)
        _alert(axis, peaks.alert)
        centre = peaks.high.hertz[np.argmax(peaks.high.amplitudes)]
        axis.set(
            xlim=(max(0.94 * centre, plan.hertz[0]), min(1.06 * centre, plan.hertz[1])),
            title=f"{letter}) $F_{{CL}}/F_{{HE}}$ = {peaks.ratio:g}",
            xlabel="frequency, Hz",
            ylabel="tip amplitude, µm",
        )
        axis.legend(fontsize=8)
        axis.grid(alpha=0.3)
    return figure


def second_cycles(evidence: Evidence) -> Figure:
    """Draw fig. 11: cycles of three contact points at the peak of the second damper."""
    ratio = evidence.second_plan.ratios[-1]
    pair = max(evidence.second_pairs[ratio], key=lambda p: p.problem.amplitude(p.high))
    names = evidence.second.system.interface.names
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    for axis, contact in zip(axes, _middle(evidence.second), strict=False):
        _cycles(axis, pair, contact)
        axis.set_title(f"{names[contact]}, {pair.hertz:.2f} Hz, $F_{{CL}}/F_{{HE}}$ = {ratio:g}")
        axis.legend(fontsize=8)
    return figure
