"""Synthesised responses over the backbone, peaks over the level, passages, and what is to be thought of them."""

from dataclasses import dataclass
from html import escape

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import FloatArray
from stickslip.report.node import Node
from stickslip.report.plot import INK, MUTED, Plot, colour, log_ticks, styled
from stickslip.report.quantities import NONE, counted, joined, number, percent, quantity, scale_for
from stickslip.report.section import Block, Card, Section
from stickslip.report.tables import shortened

NAME = "modal_synthesis"
MOST = 12  # curves that get a name of their own


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


def responses(view: Synthesised) -> Plot | None:
    """Show the responses, the nonlinear mode through their peaks, and direct solutions where there are any."""
    if not view.has("amplitude") or not view.shown:
        return None
    hertz, amplitude = (view.values(n, "level", "point") for n in ("frequency_hz", "amplitude"))
    stable, curve = (view.values(n, "level", "point") for n in ("stable", "curve"))
    scale, figure = scale_for(amplitude, "m"), go.Figure()
    direct = view.has("direct_amplitude")
    for i in view.shown:
        label = f"level {number(float(view.levels[i]))}"
        doubt = ", doubtful" if view.answers[i] == "doubtful" else ""
        for part in range(int(curve[i].max()) + 1):
            own = curve[i] == part
            for held, dash in ((1, "solid"), (0, "dot")):
                y = np.where(stable[i][own] == held, scale.factor * amplitude[i][own], np.nan)
                if not np.any(np.isfinite(y)):
                    continue
                figure.add_scatter(
                    x=hertz[i][own], y=y, mode="lines", name=f"{label}{doubt}", legendgroup=label,
                    showlegend=part == 0 and held == 1 and i < MOST, line={"color": colour(i), "width": 1.8, "dash": dash},
                    hovertemplate=f"{label}{doubt}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
                )  # fmt: skip
        if direct:
            figure.add_scatter(
                x=view.values("direct_frequency_hz", "level", "direct_point")[i],
                y=scale.factor * view.values("direct_amplitude", "level", "direct_point")[i],
                mode="markers", name="direct solution", legendgroup="direct", showlegend=i == view.shown[0],
                marker={"color": colour(i), "size": 5, "symbol": "circle-open"},
                hovertemplate=f"direct, {label}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
            )  # fmt: skip
    mode, height = view.floats("backbone_frequency_hz"), view.floats("backbone_amplitude")
    near = (height >= np.nanmin(amplitude)) & (height <= 1.2 * np.nanmax(amplitude))
    figure.add_scatter(
        x=mode[near], y=scale.factor * height[near], mode="lines", name="nonlinear mode",
        line={"color": INK, "width": 1.4, "dash": "dash"}, hovertemplate=f"nonlinear mode: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
    )  # fmt: skip
    styled(figure, 480)
    span = np.concatenate([hertz[i] for i in view.shown])
    figure.update_xaxes(title_text="frequency (Hz)", range=[np.nanmin(span), np.nanmax(span)])
    figure.update_yaxes(type="log", title_text=f"amplitude of {escape(view.text('output'))} ({scale.unit})", **log_ticks(scale.factor * amplitude[np.isfinite(amplitude)]))  # fmt: skip
    caption = (
        "Each curve is the response at a level of the loads, from the nonlinear mode alone, the other modes added as linear ones. Dotted: unstable in "
        "the mode's own amplitude and phase."
    )
    caption += " Circles are solved directly." if direct else ""
    left = [i for i, a in enumerate(view.answers) if a in ("refused", "beyond")]
    caption += f" {counted(len(left), 'level')} not shown: see the table." if left else ""
    return Plot(f"modal_synthesis{view.key}", "Responses from one nonlinear mode", caption, figure)


def peaks(view: Synthesised) -> Plot | None:
    """Show the peak over its level, each place of the backbone being one."""
    if not view.has("resonance_level"):
        return None
    level, amplitude = view.floats("resonance_level"), view.floats("backbone_amplitude")
    known = np.isfinite(level) & (level > 0.0) & (amplitude > 0.0)
    per = np.where(known, amplitude / np.where(known, level, 1.0), np.nan)
    scale, figure = scale_for(per[known], "m"), go.Figure()
    figure.add_scatter(
        x=level[known], y=scale.factor * per[known], mode="lines", name="nonlinear mode", line={"color": colour(0), "width": 2},
        hovertemplate=f"%{{y:.5g}} {scale.unit} per level at level %{{x:.5g}}<extra></extra>",
    )  # fmt: skip
    for answer, symbol, tint in (("trusted", "circle", colour(0)), ("doubtful", "diamond-open", colour(1)), ("refused", "x", MUTED)):  # fmt: skip
        own = [i for i, a in enumerate(view.answers) if a == answer]
        if own:
            at = np.interp(np.log(view.levels[own]), np.log(level[known]), per[known])
            figure.add_scatter(
                x=view.levels[own], y=scale.factor * at, mode="markers", name=answer,
                marker={"symbol": symbol, "size": 9, "color": tint}, hovertemplate=f"{answer}: level %{{x:.5g}}<extra></extra>",
            )  # fmt: skip
    if view.has("direct_peak_amplitude"):
        figure.add_scatter(
            x=view.levels, y=scale.factor * view.floats("direct_peak_amplitude") / view.levels, mode="markers", name="direct solution",
            marker={"symbol": "circle-open", "size": 11, "color": INK}, hovertemplate=f"direct: %{{y:.5g}} {scale.unit} per level<extra></extra>",
        )  # fmt: skip
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
                x=hertz[i, j], y=scale.factor * amplitude[i, j], mode="lines", name=name,
                line={"color": colour(i), "width": 1.5, "dash": ("solid", "dash", "dot", "dashdot")[j % 4]},
                hovertemplate=f"{name}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
            )  # fmt: skip
    styled(figure, 440)
    figure.update_xaxes(title_text="frequency of the loads (Hz)")
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", rangemode="tozero")
    caption = "The frequency runs through the resonance at a constant rate, from the steady motion at its beginning: the slowly varying amplitude of the nonlinear mode."
    return Plot(f"modal_synthesis_passage{view.key}", "Passage through resonance", caption, figure)


def table(view: Synthesised) -> str:
    """Return the levels, their peaks, and why they are trusted or not."""
    if not view.has("level"):
        return ""
    direct = view.has("direct_error")
    head = ["level", "peak", "at (Hz)", "answer", "other modes"]
    head += ["direct peak", "error", "why"] if direct else ["why"]
    rows = []
    for i, answer in enumerate(view.answers):
        peak, hertz, foreign = (float(view.floats(n)[i]) for n in ("peak_amplitude", "peak_frequency_hz", "foreign"))  # fmt: skip
        row = [
            number(float(view.levels[i])), quantity(peak, "m", 5), number(hertz, 7) if np.isfinite(hertz) else NONE,
            f"<b>{answer}</b>" if answer != "trusted" else answer,
            percent(foreign) if np.isfinite(foreign) else NONE,
        ]  # fmt: skip
        if direct:
            error = float(view.floats("direct_error")[i])
            row += [quantity(float(view.floats("direct_peak_amplitude")[i]), "m", 5), f"{number(100 * error, 2)} %" if np.isfinite(error) else NONE]  # fmt: skip
        rows.append([*row, escape(view.labels_of("why")[i])])
    return f"<h3>Levels</h3>{shortened(head, rows, 'levels')}{_cycles(view)}"


def _cycles(view: Synthesised) -> str:
    """Return the amplitudes at which the mode goes on without any load."""
    if not view.has("cycle_amplitude"):
        return ""
    each = joined([quantity(float(a), "m", 4) for a in view.floats("cycle_amplitude")])
    return f"<p>The damping of the mode is zero at {each}: limit cycles, which <code>[limit_cycle]</code> examines.</p>"


def _cards(view: Synthesised) -> list[Card]:
    shown, every = len(view.shown), len(view.answers)
    left = every - shown
    return [Card(f"{shown} of {every}", "levels from one nonlinear mode", f"{left} refused or beyond it" if left else "the mode answers alone", left > 0)]  # fmt: skip


_BLOCK = Block("modal-synthesis", "Nonlinear modal synthesis", (responses, peaks, passages, table))
SECTION: Section = Section(NAME, ("level",), Synthesised, (_BLOCK,), by_case=True, cards=_cards)
