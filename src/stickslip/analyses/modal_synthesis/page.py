"""Synthesised responses over the backbone, peaks over the level, passages, and verdicts."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.columns import CaseView
from stickslip.analyses.modal_synthesis.records import ModalSynthesis, SynthesisLevel
from stickslip.analyses.modal_synthesis.verdicts import percent
from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.report.plot import INK, MUTED, Plot, colour, log_ticks, ramp, ring, styled
from stickslip.report.quantities import NONE, counted, joined, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section, Table
from stickslip.units import HZ

NAME = "modal_synthesis"
NOTHING = np.zeros(0)
MAX_NAMED_CURVES = 24  # largest number of curves with names


class Synthesised(CaseView[ModalSynthesis]):
    """One case."""

    kind = ModalSynthesis

    @property
    def levels(self) -> FloatArray:
        """Factors on the harmonic loads."""
        return np.array([one.level for one in self.found.levels])

    @property
    def shown(self) -> list[SynthesisLevel]:
        """Levels that have a response."""
        return [one for one in self.found.levels if one.shown]

    def answered(self, *answers: str) -> list[SynthesisLevel]:
        """Return the levels with one of some answers, such as ``trusted``."""
        return [one for one in self.found.levels if one.answer in answers]

    def tint(self, level: SynthesisLevel) -> str:
        """Return the colour of a level: from dark for the lowest to gold for the highest."""
        order = np.argsort(np.argsort(self.levels))
        return ramp(self.levels.size)[int(order[self.found.levels.index(level)])]


def responses(view: Synthesised) -> Plot | None:
    """Draw the responses, the nonlinear mode through their peaks, and direct solutions if there are any."""
    found, shown = view.found, view.shown
    amplitude = np.concatenate([one.amplitude for one in found.levels])
    if not amplitude.size or not shown:
        return None
    scale, figure = scale_for(amplitude, "m"), go.Figure()
    direct = any(one.direct_amplitude.size for one in found.levels)
    for one in shown if direct else ():
        # below the curves, so that they hide nothing
        figure.add_scatter(
            x=one.direct_omega / HZ,
            y=scale.factor * one.direct_amplitude,
            mode="markers",
            name="direct solution",
            legendgroup="direct",
            showlegend=one is shown[0],
            opacity=0.7,
            marker=ring(view.tint(one), 5, 0.8),
            hovertemplate=f"direct, level {number(one.level)}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
        )
    every = -(-len(shown) // MAX_NAMED_CURVES)
    for k, one in enumerate(shown):
        label = f"level {number(one.level)}"
        doubt = ", doubtful" if one.answer == "doubtful" else ""
        named = k % every != 0
        for keep, width, opacity in ((True, 2.0, 1.0), (False, 1.0, 0.6)):
            for steady in (1, 0):
                y = _where(one.amplitude, one.curve, (one.stable == steady) & ((one.alone == 1) == keep))
                if not np.any(np.isfinite(y)):
                    continue
                dash = ("solid" if keep else "dash") if steady else "dot"
                figure.add_scatter(
                    x=one.omega / HZ,
                    y=scale.factor * y,
                    mode="lines",
                    name=f"{label}{doubt}",
                    legendgroup=label,
                    showlegend=not named,
                    opacity=opacity,
                    line={"color": view.tint(one), "width": width, "dash": dash},
                    hovertemplate=f"{label}{doubt}{'' if keep else ', other modes above 5 %'}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
                )
                named = True
        figure.add_scatter(
            x=[one.peak_omega / HZ],
            y=[scale.factor * one.peak],
            mode="markers",
            legendgroup=label,
            showlegend=False,
            marker={"symbol": "diamond" if doubt else "circle", "size": 7, "color": view.tint(one)},
            hovertemplate=f"peak of {label}{doubt}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
        )
    mode, height = _backbone(found)
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
    span = np.concatenate([one.omega / HZ for one in shown])
    figure.update_xaxes(title_text="frequency (Hz)", range=[np.nanmin(span), np.nanmax(span)])
    figure.update_yaxes(
        type="log",
        title_text=f"amplitude of {found.output} ({scale.unit})",
        **log_ticks(scale.factor * amplitude[np.isfinite(amplitude)]),
    )
    caption = "Each curve is the response at a level of the loads: the nonlinear mode, with the other modes added as linear ones. A dot (trusted) or a diamond (doubtful) marks the peak of each level. Curves are thin and dashed where contacts slip and the other modes exceed 5 % of the mode, or change the amplitude by more; they may be far off there. Dotted curves are unstable in the mode's own amplitude and phase."
    caption += f" Rings are solved directly.{_along(view)}" if direct else ""
    left = view.answered("refused", "beyond")
    caption += f" {counted(len(left), 'level')} not shown: see the table." if left else ""
    return Plot(f"modal_synthesis{view.key}", "Responses from one nonlinear mode", caption, figure)


def _backbone(found: ModalSynthesis) -> tuple[FloatArray, FloatArray]:
    """Return frequency, Hz, and amplitude, m, along the nonlinear mode."""
    hertz, amplitude = found.backbone_frequency_hz, found.backbone_amplitude
    return (NOTHING, NOTHING) if hertz is None or amplitude is None else (hertz, amplitude)


def _where(amplitude: FloatArray, curve: IntArray, own: BoolArray) -> FloatArray:
    """Return the amplitudes of some points and of the first point after each run, so that runs meet; NaN elsewhere."""
    next_to = own.copy()
    same = curve[1:] == curve[:-1]
    next_to[1:] |= own[:-1] & same
    return np.where(next_to & (curve >= 0), amplitude, np.nan)


def _share(value: float) -> str:
    """Write a share in per cent, as the terminal does."""
    return percent(value) if np.isfinite(value) else NONE


def _along(view: Synthesised) -> str:
    """State the largest difference of the curves from direct solutions where the mode answers alone."""
    known = [(abs(e), one) for one in view.found.levels if (e := one.along_error) is not None and np.isfinite(e)]
    if not known:
        return ""
    error, worst = max(known, key=lambda found: found[0])
    hertz = np.nan if worst.along_error_omega is None else worst.along_error_omega / HZ
    return (
        f" Full lines differ from them around the peaks by up to {_share(error)}, at level "
        f"{number(worst.level)} and {number(hertz, 5)} Hz."
    )


def peaks(view: Synthesised) -> Plot | None:
    """Draw the peak over the level of the loads; each place on the backbone is the peak of one level."""
    level, amplitude = view.found.resonance_level, view.found.backbone_amplitude
    if level is None or amplitude is None:
        return None
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
    if view.found.direct:
        direct = [(one.level, one.direct_peak) for one in view.found.levels if one.direct_peak is not None]
        figure.add_scatter(
            x=np.array([of for of, _ in direct]),
            y=np.array([scale.factor * peak / of for of, peak in direct]),
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
        own = np.array([one.level for one in view.answered(answer)])
        if own.size:
            at = np.interp(np.log(own), np.log(level[known]), per[known])
            figure.add_scatter(
                x=own,
                y=scale.factor * at,
                mode="markers",
                name=answer,
                marker={"symbol": symbol, "size": 9, "color": tint},
                hovertemplate=f"{answer}: level %{{x:.5g}}<extra></extra>",
            )
    styled(figure, 420)
    figure.update_xaxes(type="log", title_text="level of the loads", **log_ticks(level[known]))
    figure.update_yaxes(title_text=f"peak per level ({scale.unit})", rangemode="tozero")
    caption = "Peak of the mode divided by the level of the harmonic loads. It is horizontal where nothing slips."
    if view.found.homogeneous:
        caption += (
            " All contact laws here are homogeneous, so that this is also the optimisation curve of the static loads: with static loads s times as large "
            "the peak under the same vibration loads is s times the peak of the level 1/s."
        )
    return Plot(f"modal_synthesis_peaks{view.key}", "Peak per load over the level", caption, figure)


def passages(view: Synthesised) -> Plot | None:
    """Draw the amplitude while the frequency is swept."""
    rates = view.found.passage_hz_per_s
    every = [one.passage_amplitude for one in view.found.levels]
    if rates is None or not np.any(np.isfinite(every)):
        return None
    scale, figure = scale_for(np.array(every), "m"), go.Figure()
    for one in view.shown:
        for j, rate in enumerate(rates.tolist()):
            name = f"level {number(one.level)}, {number(rate)} Hz/s"
            figure.add_scatter(
                x=one.passage_omega[j] / HZ,
                y=scale.factor * one.passage_amplitude[j],
                mode="lines",
                name=name,
                line={"color": view.tint(one), "width": 1.5, "dash": ("solid", "dash", "dot", "dashdot")[j % 4]},
                hovertemplate=f"{name}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
            )
    styled(figure, 500)
    figure.update_xaxes(title_text="frequency of the loads (Hz)")
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", rangemode="tozero")
    caption = "The figure shows the slowly varying amplitude of the nonlinear mode. The frequency runs through the resonance at a constant rate, beginning with the steady motion."
    return Plot(f"modal_synthesis_passage{view.key}", "Passage through resonance", caption, figure)


def table(view: Synthesised) -> Table | None:
    """Return a table of the levels: peak, verdict and reason."""
    if not view.found.levels:
        return None
    head = [
        "level",
        "peak",
        "at (Hz)",
        "answer of the peak",
        "motion of the other modes",
        "predicted error of the peak",
        "alone around the peak (Hz)",
        "why",
    ]
    rows = [_row(one) for one in view.found.levels]
    said = "Predicted and found errors, and the answer, refer to the peak. **Alone** is the range around the peak where nothing slips, or where the other modes stay within 5 % of the mode and change the amplitude by at most as much."
    return Table(head, rows, "Levels", (said,), worded=True, items=_cycles(view))


def _row(one: SynthesisLevel) -> list[str]:
    hertz, low, high = one.peak_omega / HZ, one.alone_from / HZ, one.alone_to / HZ
    nowhere = "nowhere" if np.isfinite(one.peak) else NONE
    return [
        number(one.level),
        quantity(one.peak, "m", 5),
        number(hertz, 7) if np.isfinite(hertz) else NONE,
        f"**{one.answer}**" if one.answer != "trusted" else one.answer,
        _share(max(one.output, one.gaps)),
        _share(one.foreign),
        f"{number(low, 5)} to {number(high, 5)}" if np.isfinite(low) else nowhere,
        one.why,
    ]


def against_direct(view: Synthesised) -> Table | None:
    """Return a table of the differences from direct solutions, at the peaks and along the curves."""
    if not view.found.direct:
        return None
    rows = []
    for one in view.found.levels:
        known = (one.direct_peak, one.direct_error, one.along_error, one.along_error_omega)
        peak, error, along, omega = (np.nan if value is None else value for value in known)
        lengths = [quantity(size, "m", 5) for size in (one.peak, peak)]
        rows.append([number(one.level), *lengths, _share(error), _share(along), number(omega / HZ, 5)])
    head = ["level", "peak", "direct peak", "error of the peak", "largest along the curve, where alone", "at (Hz)"]
    return Table(head, rows, "Against direct solutions")


def passage_peaks(view: Synthesised) -> Table | None:
    """Return a table of the peak of each passage beside the steady peak."""
    rows = [
        [
            number(one.level),
            number(passage.rate),
            quantity(passage.peak, "m", 5),
            number(passage.hertz, 5),
            quantity(one.peak, "m", 5),
            _share(passage.share),
            _share(passage.change),
        ]
        for one, passage in view.found.passages
    ]
    head = ["level", "rate (Hz/s)", "peak", "at (Hz)", "steady peak", "share of it", "change in a radian"]
    return Table(head, rows, "Passages") if rows else None


def _cycles(view: Synthesised) -> list[str]:
    """Return the sentence on limit cycles: amplitudes at which the damping of the mode is zero."""
    amplitudes = view.found.cycle_amplitude
    if amplitudes is None:
        return []
    each = joined([quantity(a, "m", 4) for a in amplitudes.tolist()])
    return [f"The damping of the mode is zero at {each}: limit cycles, which `[limit_cycle]` examines."]


def _cards(view: Synthesised) -> list[Card]:
    words = {"trusted": "trusted", "doubtful": "doubtful", "refused": "refused", "beyond": "beyond the mode"}
    each = {answer: len(view.answered(answer)) for answer in words}
    note = joined([f"{n} {words[answer]}" for answer, n in each.items() if n and answer != "trusted"])
    return [
        Card(
            f"{each['trusted']} of {len(view.found.levels)}",
            "peaks of levels trusted to one nonlinear mode",
            note or "no other is doubtful or refused",
            bool(note),
        )
    ]


_BLOCK = Block(
    "modal-synthesis", "Nonlinear modal synthesis", (responses, peaks, passages, passage_peaks, table, against_direct)
)
SECTION: Section = Section(NAME, ("level",), Synthesised, (_BLOCK,), by_case=True, cards=_cards)
