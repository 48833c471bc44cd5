"""Limit cycles: damping and frequency over the amplitude, stability, and the wave that wins in time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.content import Table, Words
from stickslip.report.node import Node
from stickslip.report.plot import INK, Plot, colour, log_ticks, styled
from stickslip.report.quantities import NONE, counted, joined, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section

_SYMBOLS = {"stable": "circle", "unstable": "x", "undecided": "diamond-open", "not examined": "circle-open"}
_READING = (
    "Damping ratio of the motion of each amplitude: below zero it grows, above it decays, and where the curve crosses the line it "
    "goes on by itself. Crossings upward attract motions of the same wave, crossings downward repel them: beyond these friction "
    "cannot bound the motion."
)
_JOINED = (
    "Straight lines join the amplitudes that were looked at and the limit cycles, which lie between these and have harmonics enough of "
    "their own."
)


@dataclass(frozen=True, eq=False)
class Cycles(Node):
    """One case."""

    @property
    def names(self) -> list[str]:
        """Of the modes that were followed."""
        waves, modes = self.integers("wave_number"), self.integers("mode")
        return [f"mode {m}" if k < 0 else f"wave {k}, mode {m}" for k, m in zip(waves, modes, strict=True)]

    @property
    def cycles(self) -> int:
        """Number of limit cycles."""
        return int(self.data.sizes.get("cycle", 0)) if self.has("cycle_amplitude") else 0

    def of_branch(self, i: int, name: str, at_cycles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the amplitudes of a mode in their order, its limit cycles among them, and a variable there.

        Parameters
        ----------
        i
            The mode.
        name
            The variable.
        at_cycles
            (cycles,) the variable at all limit cycles.
        """
        amplitude = self.values("amplitude", "branch", "point")[i]
        known = np.isfinite(amplitude)
        own = self.values(name, "branch", "point")[i][known]
        amplitude = amplitude[known]
        if self.cycles:
            mine = self.integers("cycle_branch") == i
            amplitude = np.append(amplitude, self.floats("cycle_amplitude")[mine])
            own = np.append(own, at_cycles[mine])
        order = np.argsort(amplitude, kind="stable")
        return amplitude[order], own[order]


def damping(view: Cycles) -> Plot | None:
    """Show the damping that each amplitude has; limit cycles are its zeros."""
    if not view.has("amplitude"):
        return None
    figure = _over_amplitude(view, "damping_ratio", 100.0, np.zeros(view.cycles))
    for i, name in enumerate(view.names):
        figure.data[i].name = name
    figure.add_hline(y=0.0, line={"color": INK, "width": 1})
    _mark(view, figure, np.zeros(view.cycles))
    figure.update_yaxes(title_text="damping ratio of the motion (%)")
    return Plot(f"limit_cycles{view.key}", "Damping over the amplitude", _caption(view), figure)


def frequencies(view: Cycles) -> Plot | None:
    """Show the frequency of the motions."""
    if not view.has("amplitude"):
        return None
    own = view.floats("cycle_frequency_hz") if view.cycles else np.zeros(0)
    figure = _over_amplitude(view, "frequency_hz", 1.0, own)
    _mark(view, figure, own)
    figure.update_yaxes(title_text="frequency (Hz)")
    caption = (
        "With the amplitude the frequency goes from that of the mode with all contacts stuck towards that without friction. Limit cycles are "
        f"marked as above. {_JOINED}"
    )
    return Plot(f"limit_cycle_frequency{view.key}", "Frequency over the amplitude", caption, figure)


def waves_in_time(view: Cycles) -> Plot | None:
    """Show what becomes of all unstable waves together."""
    if not view.has("wave_amplitude"):
        return None
    figure = go.Figure()
    time, amplitude = view.floats("time"), view.values("wave_amplitude", "window", "wave")
    scale = scale_for(amplitude, "m")
    largest = amplitude.max(axis=0)
    shown = [k for k in range(amplitude.shape[1]) if largest[k] > 1e-3 * largest.max()]
    for i, k in enumerate(shown):
        figure.add_trace(
            go.Scatter(
                x=time,
                y=scale.factor * amplitude[:, k],
                mode="lines",
                name=f"wave {k}",
                line={"color": colour(i), "width": 1.8},
                hovertemplate=f"wave {k}: %{{y:.4g}} {scale.unit} at %{{x:.4g}} s<extra></extra>",
            )
        )
    styled(figure, 420)
    figure.update_xaxes(title_text="time (s)")
    figure.update_yaxes(title_text=f"amplitude of each wave ({scale.unit})", rangemode="tozero")
    caption = (
        "All sectors in time from a mixed start, 30 % of the limit cycle of each unstable wave, or its mode where slip begins if none was "
        f"found: **{view.text('outcome')}**. Waves are told apart by the motion of all sectors at "
        "one time and by the direction in which they turn; another start may end elsewhere."
    )
    return Plot(f"competing_waves{view.key}", "Competing waves in time", caption, figure)


def cycle_table(view: Cycles) -> Table | Words:
    """Return the limit cycles, and the modes that have none."""
    if not view.has("wave_number"):
        least = 100 * float(np.nanmin(view.floats("linear_damping_ratio")))
        told = f"No mode that was looked at grows with contacts stuck: the least damping ratio is {number(least)} %."
        return Words((told,))
    names = view.names
    rows = [_row(view, names, c) for c in range(view.cycles)]
    head = ["mode", "amplitude", "frequency (Hz)", "harmonics", "stability", "multiplier", "in time"]
    return Table(head, rows, "Limit cycles", items=_without(view, names))


def _row(view: Cycles, names: Sequence[str], c: int) -> list[str]:
    def value(name: str) -> float:
        return float(view.floats(f"cycle_{name}")[c])

    word = view.labels_of("cycle_stability")[c]
    wave = int(view.integers("cycle_growing_wave")[c])
    grows = f", wave {wave} grows" if word == "unstable" and wave >= 0 else ""
    multiplier = f"{number(value('multiplier'), 5)} ± {number(value('multiplier_error'), 2)}"
    in_time = NONE
    if view.has("cycle_time_amplitude") and np.isfinite(value("time_amplitude")):
        off = 100 * (value("time_amplitude") / value("amplitude") - 1.0)
        told = f"{number(off, 2)} % off"
        if word == "unstable":  # to be near it after so many periods is no confirmation
            told += "; unstable, no confirmation"
        in_time = f"{quantity(value('time_amplitude'), 'm', 5)} ({told})"
    few = "" if int(view.integers("cycle_enough")[c]) else " (not enough)"
    return [
        names[int(view.integers("cycle_branch")[c])],
        quantity(value("amplitude"), "m", 5),
        number(value("frequency_hz"), 7),
        f"{int(view.integers('cycle_harmonics')[c])}{few}",
        f"**{word}**{grows}",
        multiplier if np.isfinite(value("multiplier")) else NONE,
        in_time,
    ]


def _without(view: Cycles, names: Sequence[str]) -> list[str]:
    """Say which modes friction cannot bound."""
    most, lost = view.floats("largest_damping_ratio"), _unbounded(view)
    if not lost:
        return []
    said = [f"{names[i]} (at most {number(100 * most[i])} %)" for i in lost]
    return [f"**Friction cannot bound** {joined(said)}: the damping is negative at every amplitude."]


def _unbounded(view: Cycles) -> list[int]:
    """Return the modes that friction cannot bound."""
    ratio, most = view.floats("mode_damping_ratio"), view.floats("largest_damping_ratio")
    return [i for i in range(len(view.names)) if ratio[i] < 0 and not most[i] > 0]


def _over_amplitude(view: Cycles, name: str, factor: float, at_cycles: FloatArray) -> go.Figure:
    figure = go.Figure()
    every = view.values("amplitude", "branch", "point")
    scale = scale_for(np.array([np.nanmedian(every)]), "m")
    for i, label in enumerate(view.names):
        amplitude, own = view.of_branch(i, name, at_cycles)
        figure.add_trace(
            go.Scatter(
                x=scale.factor * amplitude,
                y=factor * own,
                mode="lines",
                name=label,
                line={"color": colour(i), "width": 2},
                hovertemplate=f"{label}: %{{y:.6g}} at %{{x:.5g}} {scale.unit}<extra></extra>",
            )
        )
    styled(figure, 460)
    ticks = log_ticks(scale.factor * every[np.isfinite(every)])
    output = view.text("output")
    title = f"amplitude of {output} ({scale.unit})"
    figure.update_xaxes(type="log", title_text=title, **ticks)
    figure.update_layout(meta={"factor": scale.factor, "unit": scale.unit})
    return figure


def _mark(view: Cycles, figure: go.Figure, heights: FloatArray) -> None:
    """Mark limit cycles by what their stability is."""
    if not view.cycles:
        return
    amplitude, words = view.floats("cycle_amplitude"), np.array(view.labels_of("cycle_stability"))
    factor, unit = figure.layout.meta["factor"], figure.layout.meta["unit"]
    which: IntArray = view.integers("cycle_branch")
    for word, symbol in _SYMBOLS.items():
        own = words == word
        if not np.any(own):
            continue
        lines = [colour(int(i)) for i in which[own]]
        figure.add_trace(
            go.Scatter(
                x=factor * amplitude[own],
                y=heights[own],
                mode="markers",
                name=word,
                marker={"symbol": symbol, "size": 11, "color": lines, "line": {"width": 2, "color": lines}},
                hovertemplate=f"{word} limit cycle: %{{x:.5g}} {unit}<extra></extra>",
            )
        )


def _caption(view: Cycles) -> str:
    top = view.floats("largest_damping_ratio")
    parts = [_READING]
    if view.cycles:
        words = view.labels_of("cycle_stability")
        counts = [counted(words.count(word), f"{word} limit cycle") for word in _SYMBOLS if word in words]
        parts.append(f"There are {joined(counts)} (marked).")
    bounded = [f"{name} {number(100 * float(t))} %" for name, t in zip(view.names, top, strict=True) if np.isfinite(t)]
    if bounded:
        parts.append(f"Most damping: {joined(bounded)}.")
    return " ".join(parts)


def linear_table(view: Cycles) -> Table | None:
    """Return the damping of all modes that were looked at, contacts stuck."""
    if not view.has("linear_damping_ratio"):
        return None
    waves = view.integers("linear_wave")
    hertz, ratio = (view.values(f"linear_{n}", "linear", "mode") for n in ("frequency_hz", "damping_ratio"))
    head = ["wave", *(f"mode {m + 1}: Hz, damping %" for m in range(hertz.shape[1]))]
    rows = [
        ["–" if k < 0 else str(k), *(_small(float(f), float(z)) for f, z in zip(own, damped, strict=True))]
        for k, own, damped in zip(waves, hertz, ratio, strict=True)
    ]
    return Table(head, rows, "Modes with contacts stuck")


def _small(hertz: float, ratio: float) -> str:
    if not np.isfinite(hertz):
        return NONE
    text = f"{number(hertz, 5)}, {number(100 * ratio, 3)}"
    return f"**{text}**" if ratio < 0 else text


def _cards(view: Cycles) -> list[Card]:
    if not view.has("wave_number"):
        return [Card("0", "modes grow by themselves", "contacts stuck")]
    words = view.labels_of("cycle_stability") if view.cycles else ()
    note = f"{words.count('unstable')} unstable, {counted(len(view.names), 'mode')} followed"
    lost = len(_unbounded(view))
    if lost:
        note += f"; friction cannot bound {counted(lost, 'mode')}"
    return [Card(str(words.count("stable")), "stable limit cycles", note, lost > 0)]


_BLOCK = Block(
    "limit-cycles", "Vibration that nothing drives", (damping, frequencies, cycle_table, waves_in_time, linear_table)
)
SECTION: Section = Section("limit_cycle", ("linear_damping_ratio",), Cycles, (_BLOCK,), by_case=True, cards=_cards)
