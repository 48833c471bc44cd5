"""Nonlinear modes: frequency and damping ratio over the amplitude and the energy, and backbones over frequency responses."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.curves import abscissa
from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import FloatArray
from stickslip.report.content import Table
from stickslip.report.node import Node
from stickslip.report.plot import INK, Plot, colour, log_ticks, styled
from stickslip.report.quantities import NONE, joined, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section

NAME = "nonlinear_mode"
_READING = (
    "The damping ratio is that at which a free motion of each amplitude decays, all damping of the model included; below zero it grows. "
    "The curve is that of the motion with its mean and its harmonics, in the order in which it was followed: it turns back where it folds."
)

_ENERGY = "The energy is twice the mean kinetic energy of all harmonics, of a wheel that of one sector; where all springs are linear it is the whole."


@dataclass(frozen=True, eq=False)
class Modes(Node):
    """One case."""

    @property
    def names(self) -> list[str]:
        """Of the modes."""
        waves, modes = self.integers("wave_number"), self.integers("mode")
        return [f"mode {m}" if k < 0 else f"wave {k}, mode {m}" for k, m in zip(waves, modes, strict=True)]

    def along(self, i: int, *names: str) -> list[FloatArray]:
        """Return variables along a mode; NaN where it was lost."""
        known = self.values("status", "branch", "point")[i] >= 0
        return [self.values(name, "branch", "point")[i][known] for name in names]


def frequencies(view: Modes) -> Plot | None:
    """Show the frequency over the amplitude."""
    figure = _over(view, "amplitude", "frequency_hz", 1.0, "m")
    if figure is None:
        return None
    figure.update_yaxes(title_text="frequency (Hz)")
    caption = "With the amplitude the frequency goes from that of the mode with all contacts stuck towards that without friction."
    return Plot(f"nonlinear_mode_frequency{view.key}", "Frequency over the amplitude", caption, figure)


def damping(view: Modes) -> Plot | None:
    """Show the damping ratio over the amplitude."""
    figure = _over(view, "amplitude", "damping_ratio", 100.0, "m")
    if figure is None:
        return None
    if np.nanmin(view.values("damping_ratio", "branch", "point")) < 0.0:
        figure.add_hline(y=0.0, line={"color": INK, "width": 1})
    figure.update_yaxes(title_text="damping ratio (%)")
    return Plot(f"nonlinear_mode_damping{view.key}", "Damping over the amplitude", _READING, figure)


def energies(view: Modes) -> list[Plot]:
    """Show frequency and damping ratio over the energy."""
    found = []
    for name, factor, title, key, caption in (
        ("frequency_hz", 1.0, "frequency (Hz)", "energy", _ENERGY),
        ("damping_ratio", 100.0, "damping ratio (%)", "energy_damping", "The same of the damping ratio."),
    ):
        figure = _over(view, "energy", name, factor, "J")
        if figure is not None:
            figure.update_yaxes(title_text=title)
            heading = f"{title.split(' (')[0].capitalize()} over the energy"
            found.append(Plot(f"nonlinear_mode_{key}{view.key}", heading, caption, figure))
    return found


def table(view: Modes) -> Table:
    """Return the modes: where they begin, how much they damp, how they end."""
    head = [
        "mode",
        "Hz, stuck",
        "damping %, stuck",
        "most damping %",
        "at",
        "all contacts slip from",
        "harmonics",
        "end",
    ]
    rows = []
    for i, name in enumerate(view.names):
        most, at, gross = (
            float(view.floats(n)[i])
            for n in ("largest_damping_ratio", "largest_damping_amplitude", "gross_slip_amplitude")
        )
        own = view.values("harmonics", "branch", "point")[i]
        orders = own[own > 0]
        kept = f"{int(orders.min())} to {int(orders.max())}" if orders.size else NONE
        rows.append(
            [
                name,
                number(float(view.floats("mode_frequency_hz")[i]), 6),
                number(100 * float(view.floats("mode_damping_ratio")[i]), 4),
                number(100 * most, 4) if np.isfinite(most) else NONE,
                quantity(at, "m", 4),
                quantity(gross, "m", 4),
                kept,
                view.labels_of("problem")[i] or view.labels_of("end")[i],
            ]
        )
    return Table(head, rows)


def over_responses(nodes: Mapping[str, Node]) -> Plot | None:
    """Draw backbones over frequency responses: the peaks lie on them as long as the modes stand alone."""
    modes, response = nodes.get(NAME), nodes.get("forced_response")
    if not isinstance(modes, Modes) or not isinstance(response, Response):
        return None
    output = modes.text("output")
    labels = response.labels("output")
    if output not in labels or response.has("speed_rpm") or not modes.has("amplitude"):
        return None
    amplitude = response.values("amplitude", "point", "output")[:, labels.index(output)]
    amplitude = np.where(response.converged, amplitude, np.nan)
    if not np.any(np.isfinite(amplitude)):
        return None
    scale, figure = scale_for(amplitude, "m"), go.Figure()
    x, name, unit = abscissa(response)
    for case in response.cases:
        at = response.points(case)
        figure.add_scatter(
            x=x[at],
            y=scale.factor * amplitude[at],
            mode="lines",
            line={"color": case.colour, "width": 1.6},
            name=case.short if len(response.cases) > 1 else "response",
            hovertemplate=f"{case.named}<br>%{{x:.2f}} {unit}: %{{y:.4g}} {scale.unit}<extra></extra>",
        )
    drawn = []
    low, high = np.nanmin(amplitude), np.nanmax(amplitude)
    for i, label in enumerate(modes.names):
        own, hertz = modes.along(i, "amplitude", "frequency_hz")
        shown = (own >= 0.5 * low) & (own <= 2.0 * high)
        shown &= (hertz >= x.min()) & (hertz <= x.max())
        if not np.any(shown):
            continue
        drawn.append(label)
        figure.add_scatter(
            x=np.where(shown, hertz, np.nan),
            y=scale.factor * np.where(shown, own, np.nan),
            mode="lines",
            name=label,
            line={"color": INK, "width": 2.2, "dash": ("dash", "dot", "dashdot")[i % 3]},
            hovertemplate=f"{label}: %{{y:.4g}} {scale.unit} at %{{x:.5g}} Hz<extra></extra>",
        )
    if not drawn:
        return None
    styled(figure, 520)
    figure.update_xaxes(title_text=f"{name} ({unit})")
    ticks = log_ticks(scale.factor * amplitude)
    figure.update_yaxes(title_text=f"amplitude of {output} ({scale.unit})", type="log", **ticks)
    caption = (
        f"Amplitude of {output} in the first harmonic, all responses and the backbone of {joined(drawn)}. A peak lies on a backbone as long as its "
        "mode alone answers the load and little damping is added; a peak beside it tells of other modes or of a load that shares the damping unequally."
    )
    return Plot("backbones", "Backbones over the frequency responses", caption, figure)


def _over(view: Modes, over: str, name: str, factor: float, unit: str) -> go.Figure | None:
    if not view.has(over, name) or not np.any(np.isfinite(view.values(over))):
        return None
    figure, every = go.Figure(), view.values(over, "branch", "point")
    scale = scale_for(np.array([np.nanmedian(every)]), unit)
    for i, label in enumerate(view.names):
        along, own = view.along(i, over, name)
        figure.add_scatter(
            x=scale.factor * along,
            y=factor * own,
            mode="lines",
            name=label,
            line={"color": colour(i), "width": 2},
            hovertemplate=f"{label}: %{{y:.6g}} at %{{x:.5g}} {scale.unit}<extra></extra>",
        )
    styled(figure, 440)
    title = "energy" if over == "energy" else f"amplitude of {view.text('output')}"
    ticks = log_ticks(scale.factor * every[np.isfinite(every)])
    figure.update_xaxes(type="log", title_text=f"{title} ({scale.unit})", **ticks)
    return figure


def _cards(view: Modes) -> list[Card]:
    most = view.floats("largest_damping_ratio")
    if not np.any(np.isfinite(most)):
        return []
    i = int(np.nanargmax(most))
    at = quantity(float(view.floats("largest_damping_amplitude")[i]), "m")
    return [Card(f"{number(100 * float(most[i]))} %", "most damping of a mode", f"{view.names[i]} at {at}")]


_BLOCK = Block("nonlinear-modes", "Nonlinear modes", (frequencies, damping, energies, table))
SECTION: Section = Section(NAME, ("mode", "frequency_hz"), Modes, (_BLOCK,), by_case=True, cards=_cards)
