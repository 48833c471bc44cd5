"""Synthesised responses over the backbone, peaks over the level, passages, and verdicts."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.modal_synthesis.percents import percent
from stickslip.arrays import BoolArray, FloatArray
from stickslip.report.content import Table
from stickslip.report.node import Node
from stickslip.report.plot import INK, MUTED, Plot, colour, log_ticks, ramp, ring, styled
from stickslip.report.quantities import NONE, counted, joined, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section

NAME = "modal_synthesis"
MAX_NAMED_CURVES = 24  # curves that get a name of their own


@dataclass(frozen=True, eq=False)
class Synthesised(Node):
    """One case."""

    @property
    def levels(self) -> FloatArray:
        """Factors on the harmonic loads."""
        return self.floats("level")

    @property
    def answers(self) -> tuple[str, ...]:
        """What is thought of each level."""
        return tuple(self.labels_of("answer"))

    @property
    def shown(self) -> list[int]:
        """Levels that have a response."""
        return [i for i, a in enumerate(self.answers) if a in ("trusted", "doubtful")]

    def tint(self, level: int) -> str:
        """Return the colour of a level: from dark for the lowest to gold for the highest."""
        order = np.argsort(np.argsort(self.levels))
        return ramp(self.levels.size)[int(order[level])]


def responses(view: Synthesised) -> Plot | None:
    """Show the responses, the nonlinear mode through their peaks, and direct solutions where there are any."""
    if not view.has("amplitude") or not view.shown:
        return None
    hertz, amplitude, stable, curve, alone = (
        view.values(n, "level", "point") for n in ("frequency_hz", "amplitude", "stable", "curve", "alone")
    )
    scale, figure = scale_for(amplitude, "m"), go.Figure()
    direct = view.has("direct_amplitude")
    for i in view.shown if direct else ():
        # below the curves, so that they hide nothing
        figure.add_scatter(
            x=view.values("direct_frequency_hz", "level", "direct_point")[i],
            y=scale.factor * view.values("direct_amplitude", "level", "direct_point")[i],
            mode="markers",
            name="direct solution",
            legendgroup="direct",
            showlegend=i == view.shown[0],
            opacity=0.7,
            marker=ring(view.tint(i), 5, 0.8),
            hovertemplate=f"direct, level {number(float(view.levels[i]))}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
        )
    every = -(-len(view.shown) // MAX_NAMED_CURVES)
    for k, i in enumerate(view.shown):
        label = f"level {number(float(view.levels[i]))}"
        doubt = ", doubtful" if view.answers[i] == "doubtful" else ""
        named = k % every != 0
        for keep, width, opacity in ((True, 2.0, 1.0), (False, 1.0, 0.6)):
            for steady in (1, 0):
                y = _where(amplitude[i], curve[i], (stable[i] == steady) & ((alone[i] == 1) == keep))
                if not np.any(np.isfinite(y)):
                    continue
                dash = ("solid" if keep else "dash") if steady else "dot"
                figure.add_scatter(
                    x=hertz[i],
                    y=scale.factor * y,
                    mode="lines",
                    name=f"{label}{doubt}",
                    legendgroup=label,
                    showlegend=not named,
                    opacity=opacity,
                    line={"color": view.tint(i), "width": width, "dash": dash},
                    hovertemplate=f"{label}{doubt}{'' if keep else ', other modes above 5 %'}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
                )
                named = True
        figure.add_scatter(
            x=[view.floats("peak_frequency_hz")[i]],
            y=[scale.factor * view.floats("peak_amplitude")[i]],
            mode="markers",
            legendgroup=label,
            showlegend=False,
            marker={"symbol": "diamond" if doubt else "circle", "size": 7, "color": view.tint(i)},
            hovertemplate=f"peak of {label}{doubt}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
        )
    mode, height = view.floats("backbone_frequency_hz"), view.floats("backbone_amplitude")
    near = (height >= np.nanmin(amplitude)) & (height <= 1.2 * np.nanmax(amplitude))
    figure.add_scatter(
        x=mode[near],
        y=scale.factor * height[near],
        mode="lines",
        name="nonlinear mode",
        line={"color": INK, "width": 1.4, "dash": "dash"},
        hovertemplate=f"nonlinear mode: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
    )
    styled(figure, 560)
    figure.update_layout(legend_tracegroupgap=0)
    span = np.concatenate([hertz[i] for i in view.shown])
    figure.update_xaxes(title_text="frequency (Hz)", range=[np.nanmin(span), np.nanmax(span)])
    figure.update_yaxes(
        type="log",
        title_text=f"amplitude of {view.text('output')} ({scale.unit})",
        **log_ticks(scale.factor * amplitude[np.isfinite(amplitude)]),
    )
    caption = (
        "Each curve is the response at a level of the loads, from the nonlinear mode, the other modes added as linear ones. The answer of a level, trusted "
        "(dot) or doubtful (diamond), is that of its peak. Thin and dashed: something slips and the other modes move by more than 5 % of the mode, or change "
        "the amplitude by more than that; the curve may be far off there. Dotted: unstable in the mode's own amplitude and phase."
    )
    caption += f" Rings are solved directly.{_along(view)}" if direct else ""
    left = [i for i, a in enumerate(view.answers) if a in ("refused", "beyond")]
    caption += f" {counted(len(left), 'level')} not shown: see the table." if left else ""
    return Plot(f"modal_synthesis{view.key}", "Responses from one nonlinear mode", caption, figure)


def _where(amplitude: FloatArray, curve: FloatArray, own: BoolArray) -> FloatArray:
    """Return the amplitudes of some points and the first beyond each run, so that runs meet; gaps elsewhere and between curves."""
    next_to = own.copy()
    same = curve[1:] == curve[:-1]
    next_to[1:] |= own[:-1] & same
    return np.where(next_to & (curve >= 0), amplitude, np.nan)


def _share(value: float) -> str:
    """Write a share in per cent, as the terminal does."""
    return percent(value) if np.isfinite(value) else NONE


def _along(view: Synthesised) -> str:
    """Say how far the curves are from the direct ones where the mode is alone."""
    error = np.abs(view.floats("along_error")) if view.has("along_error") else np.zeros(0)
    if not np.any(np.isfinite(error)):
        return ""
    worst = int(np.nanargmax(error))
    return (
        f" Where the lines around the peaks are full they differ from them by up to {_share(float(error[worst]))}, at level "
        f"{number(float(view.levels[worst]))} and {number(float(view.floats('along_error_hz')[worst]), 5)} Hz."
    )


def peaks(view: Synthesised) -> Plot | None:
    """Show the peak over its level, each place of the backbone being one."""
    if not view.has("resonance_level"):
        return None
    level, amplitude = view.floats("resonance_level"), view.floats("backbone_amplitude")
    known = np.isfinite(level) & (level > 0.0) & (amplitude > 0.0)
    per = np.where(known, amplitude / np.where(known, level, 1.0), np.nan)
    scale, figure = scale_for(per[known], "m"), go.Figure()
    figure.add_scatter(
        x=level[known],
        y=scale.factor * per[known],
        mode="lines",
        name="nonlinear mode",
        line={"color": colour(0), "width": 2},
        hovertemplate=f"%{{y:.5g}} {scale.unit} per level at level %{{x:.5g}}<extra></extra>",
    )
    if view.has("direct_peak_amplitude"):
        figure.add_scatter(
            x=view.levels,
            y=scale.factor * view.floats("direct_peak_amplitude") / view.levels,
            mode="markers",
            name="direct solution",
            marker=ring(INK, 14, 1.0),
            hovertemplate=f"direct: %{{y:.5g}} {scale.unit} per level<extra></extra>",
        )
    for answer, symbol, tint in (
        ("trusted", "circle", colour(0)),
        ("doubtful", "diamond-open", colour(1)),
        ("refused", "x", MUTED),
    ):
        own = [i for i, a in enumerate(view.answers) if a == answer]
        if own:
            at = np.interp(np.log(view.levels[own]), np.log(level[known]), per[known])
            figure.add_scatter(
                x=view.levels[own],
                y=scale.factor * at,
                mode="markers",
                name=answer,
                marker={"symbol": symbol, "size": 9, "color": tint},
                hovertemplate=f"{answer}: level %{{x:.5g}}<extra></extra>",
            )
    styled(figure, 420)
    figure.update_xaxes(type="log", title_text="level of the loads", **log_ticks(level[known]))
    figure.update_yaxes(title_text=f"peak per level ({scale.unit})", rangemode="tozero")
    caption = "Peak of the mode over the level of the harmonic loads, divided by it: horizontal where nothing slips."
    if int(view.scalar("homogeneous", 0)):
        caption += (
            " All contact laws here are homogeneous, so that this is also the optimisation curve of the static loads: with static loads s times as large "
            "the peak under the same vibration loads is that of the level 1/s, s times as large."
        )
    return Plot(f"modal_synthesis_peaks{view.key}", "Peak per load over the level", caption, figure)


def passages(view: Synthesised) -> Plot | None:
    """Show the amplitude while the frequency is swept."""
    if not view.has("passage_amplitude"):
        return None
    amplitude = view.values("passage_amplitude", "level", "rate", "moment")
    if not np.any(np.isfinite(amplitude)):
        return None
    hertz = view.values("passage_frequency_hz", "level", "rate", "moment")
    scale, figure = scale_for(amplitude, "m"), go.Figure()
    for i in view.shown:
        for j, rate in enumerate(view.floats("passage_hz_per_s")):
            name = f"level {number(float(view.levels[i]))}, {number(float(rate))} Hz/s"
            figure.add_scatter(
                x=hertz[i, j],
                y=scale.factor * amplitude[i, j],
                mode="lines",
                name=name,
                line={"color": view.tint(i), "width": 1.5, "dash": ("solid", "dash", "dot", "dashdot")[j % 4]},
                hovertemplate=f"{name}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
            )
    styled(figure, 500)
    figure.update_xaxes(title_text="frequency of the loads (Hz)")
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", rangemode="tozero")
    caption = "The frequency runs through the resonance at a constant rate, from the steady motion at its beginning: the slowly varying amplitude of the nonlinear mode."
    return Plot(f"modal_synthesis_passage{view.key}", "Passage through resonance", caption, figure)


def table(view: Synthesised) -> Table | None:
    """Return the levels, their peaks, and why they are trusted or not."""
    if not view.has("level"):
        return None
    head = [
        "level",
        "peak",
        "at (Hz)",
        "answer of the peak",
        "motion of the other modes",
        "predicted error of the peak",
        "alone around the peak (Hz)",
    ]
    head.append("why")
    rows = []
    for i, answer in enumerate(view.answers):
        peak, hertz, foreign, low, high = (
            float(view.floats(n)[i])
            for n in ("peak_amplitude", "peak_frequency_hz", "foreign", "alone_from_hz", "alone_to_hz")
        )
        moves = max(float(view.floats(n)[i]) for n in ("others_in_output", "others_in_gaps"))
        row = [
            number(float(view.levels[i])),
            quantity(peak, "m", 5),
            number(hertz, 7) if np.isfinite(hertz) else NONE,
            f"**{answer}**" if answer != "trusted" else answer,
            _share(moves),
            _share(foreign),
            f"{number(low, 5)} to {number(high, 5)}" if np.isfinite(low) else "nowhere" if np.isfinite(peak) else NONE,
        ]
        rows.append([*row, view.labels_of("why")[i]])
    said = (
        "Predicted and found errors, and the answer, are those of the peak. **Alone**: from where to where around the peak nothing slips, or the "
        "other modes move by at most 5 % of the mode and change the amplitude by at most that."
    )
    return Table(head, rows, "Levels", (said,), worded=True, items=_cycles(view))


def against_direct(view: Synthesised) -> Table | None:
    """Return the differences from the direct solutions, of the peaks and along the curves."""
    if not view.has("direct_error"):
        return None
    names = ("peak_amplitude", "direct_peak_amplitude", "direct_error", "along_error", "along_error_hz")
    columns = [view.floats(n) for n in names]
    rows = []
    for i in range(view.levels.size):
        peak, direct, error, along, hertz = (float(c[i]) for c in columns)
        rows.append(
            [
                number(float(view.levels[i])),
                quantity(peak, "m", 5),
                quantity(direct, "m", 5),
                _share(error),
                _share(along),
                number(hertz, 5),
            ]
        )
    head = ["level", "peak", "direct peak", "error of the peak", "largest along the curve, where alone", "at (Hz)"]
    return Table(head, rows, "Against direct solutions")


def passage_peaks(view: Synthesised) -> Table | None:
    """Return the peak of each passage beside the steady one."""
    if not view.has("passage_peak_amplitude"):
        return None
    peak, hertz, share, change = (
        view.values(f"passage_{n}", "level", "rate") for n in ("peak_amplitude", "peak_frequency_hz", "share", "change")
    )
    rows = [
        [
            number(float(view.levels[i])),
            number(float(rate)),
            quantity(float(peak[i, j]), "m", 5),
            number(float(hertz[i, j]), 5),
            quantity(float(view.floats("peak_amplitude")[i]), "m", 5),
            _share(float(share[i, j])),
            _share(float(change[i, j])),
        ]
        for i in view.shown
        for j, rate in enumerate(view.floats("passage_hz_per_s"))
        if np.isfinite(peak[i, j])
    ]
    head = ["level", "rate (Hz/s)", "peak", "at (Hz)", "steady peak", "share of it", "change in a radian"]
    return Table(head, rows, "Passages") if rows else None


def _cycles(view: Synthesised) -> list[str]:
    """Return the amplitudes at which the mode goes on without any load."""
    if not view.has("cycle_amplitude"):
        return []
    each = joined([quantity(float(a), "m", 4) for a in view.floats("cycle_amplitude")])
    return [f"The damping of the mode is zero at {each}: limit cycles, which `[limit_cycle]` examines."]


def _cards(view: Synthesised) -> list[Card]:
    words = {"trusted": "trusted", "doubtful": "doubtful", "refused": "refused", "beyond": "beyond the mode"}
    each = {answer: view.answers.count(answer) for answer in words}
    note = joined([f"{n} {words[answer]}" for answer, n in each.items() if n and answer != "trusted"])
    return [
        Card(
            f"{each['trusted']} of {len(view.answers)}",
            "peaks of levels trusted to one nonlinear mode",
            note or "no other is doubtful or refused",
            bool(note),
        )
    ]


_BLOCK = Block(
    "modal-synthesis", "Nonlinear modal synthesis", (responses, peaks, passages, passage_peaks, table, against_direct)
)
SECTION: Section = Section(NAME, ("level",), Synthesised, (_BLOCK,), by_case=True, cards=_cards)
