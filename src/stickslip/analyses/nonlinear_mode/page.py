"""Nonlinear modes: frequency and damping ratio over the amplitude and the energy, and backbones over frequency responses."""

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.columns import CaseView
from stickslip.analyses.forced_response.page.curves import abscissa
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.nonlinear_mode.records import ModeBranch, NonlinearModes
from stickslip.arrays import FloatArray
from stickslip.report.plot import INK, Plot, colour, log_ticks, styled
from stickslip.report.quantities import NONE, joined, number, quantity, scale_for
from stickslip.report.result import Node
from stickslip.report.section import Block, Card, Section, Table

NAME = "nonlinear_mode"
_READING = "A free motion of each amplitude decays with this damping ratio, which includes all damping of the model. Below zero the motion grows. The curve includes the mean and all harmonics, and turns back at folds."

_ENERGY = "The energy is twice the mean kinetic energy of all harmonics, per sector on a wheel. With linear springs it is the total energy."


class Modes(CaseView[NonlinearModes]):
    """One case."""

    kind = NonlinearModes


def frequencies(view: Modes) -> Plot | None:
    """Draw the frequency over the amplitude."""
    figure = _over_amplitude(view, [branch.frequency_hz for branch in view.found.branches])
    if figure is None:
        return None
    figure.update_yaxes(title_text="frequency (Hz)")
    caption = "As the amplitude grows, the frequency goes from the stuck mode's towards the frequency without friction."
    return Plot(f"nonlinear_mode_frequency{view.key}", "Frequency over the amplitude", caption, figure)


def damping(view: Modes) -> Plot | None:
    """Draw the damping ratio over the amplitude."""
    ratios = [branch.damping_ratio for branch in view.found.branches]
    figure = _over_amplitude(view, [100.0 * ratio for ratio in ratios])
    if figure is None:
        return None
    if np.nanmin(np.concatenate(ratios)) < 0.0:
        figure.add_hline(y=0.0, line={"color": INK, "width": 1})
    figure.update_yaxes(title_text="damping ratio (%)")
    return Plot(f"nonlinear_mode_damping{view.key}", "Damping over the amplitude", _READING, figure)


def energies(view: Modes) -> list[Plot]:
    """Draw frequency and damping ratio over the energy."""
    found, branches = [], view.found.branches
    for own, title, key, caption in (
        ([b.frequency_hz for b in branches], "frequency (Hz)", "energy", _ENERGY),
        (
            [100.0 * b.damping_ratio for b in branches],
            "damping ratio (%)",
            "energy_damping",
            "The same of the damping ratio.",
        ),
    ):
        figure = _over(view, [b.energy for b in branches], own, "energy", "J")
        if figure is not None:
            figure.update_yaxes(title_text=title)
            heading = f"{title.split(' (')[0].capitalize()} over the energy"
            found.append(Plot(f"nonlinear_mode_{key}{view.key}", heading, caption, figure))
    return found


def table(view: Modes) -> Table:
    """Return a table of the modes: start, largest damping, and reason of the end."""
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
    return Table(head, [_row(branch) for branch in view.found.branches])


def _row(branch: ModeBranch) -> list[str]:
    orders = branch.harmonics[branch.harmonics > 0]
    most = branch.largest_damping_ratio
    return [
        branch.name,
        number(branch.mode_frequency_hz, 6),
        number(100 * branch.mode_damping_ratio, 4),
        number(100 * most, 4) if np.isfinite(most) else NONE,
        quantity(branch.largest_damping_amplitude, "m", 4),
        quantity(branch.gross_slip_amplitude, "m", 4),
        f"{int(orders.min())} to {int(orders.max())}" if orders.size else NONE,
        branch.problem or branch.end,
    ]


def over_responses(nodes: Mapping[str, Node]) -> Plot | None:
    """Draw backbones over frequency responses; peaks lie on them unless another mode takes part."""
    modes, response = nodes.get(NAME), nodes.get("forced_response")
    if not isinstance(modes, Modes) or not isinstance(response, Response):
        return None
    output = modes.found.output
    labels = response.labels("output")
    if output not in labels or response.has("speed_rpm"):
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
    for i, branch in enumerate(modes.found.branches):
        own, hertz, label = branch.amplitude[branch.known], branch.frequency_hz[branch.known], branch.name
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
    caption = f"Amplitude of {output} in the first harmonic, all responses and the backbone of {joined(drawn)}. A peak lies on a backbone if its mode alone answers the load and little damping is added. A peak beside it shows other modes, or a load that shares the damping unequally."
    return Plot("backbones", "Backbones over the frequency responses", caption, figure)


def _over_amplitude(view: Modes, own: Sequence[FloatArray]) -> go.Figure | None:
    title = f"amplitude of {view.found.output}"
    return _over(view, [branch.amplitude for branch in view.found.branches], own, title, "m")


def _over(
    view: Modes, over: Sequence[FloatArray], own: Sequence[FloatArray], title: str, unit: str
) -> go.Figure | None:
    """Draw a quantity of each mode over another one; None if no mode has a point."""
    every = np.concatenate(over)
    if not np.any(np.isfinite(every)):
        return None
    figure = go.Figure()
    scale = scale_for(np.array([np.nanmedian(every)]), unit)
    for i, (branch, x, y) in enumerate(zip(view.found.branches, over, own, strict=True)):
        figure.add_scatter(
            x=scale.factor * x[branch.known],
            y=y[branch.known],
            mode="lines",
            name=branch.name,
            line={"color": colour(i), "width": 2},
            hovertemplate=f"{branch.name}: %{{y:.6g}} at %{{x:.5g}} {scale.unit}<extra></extra>",
        )
    styled(figure, 440)
    ticks = log_ticks(scale.factor * every[np.isfinite(every)])
    figure.update_xaxes(type="log", title_text=f"{title} ({scale.unit})", **ticks)
    return figure


def _cards(view: Modes) -> list[Card]:
    known = [branch for branch in view.found.branches if np.isfinite(branch.largest_damping_ratio)]
    if not known:
        return []
    most = max(known, key=lambda branch: branch.largest_damping_ratio)
    said = f"{most.name} at {quantity(most.largest_damping_amplitude, 'm')}"
    if (on := most.most_on_resonance) is not None:
        said += f"; up to {number(100 * float(most.damping_ratio[on]))} % on an internal resonance"
    return [Card(f"{number(100 * most.largest_damping_ratio)} %", "most damping of a mode", said)]


_BLOCK = Block("nonlinear-modes", "Nonlinear modes", (frequencies, damping, energies, table))
SECTION: Section = Section(NAME, ("mode", "frequency_hz"), Modes, (_BLOCK,), by_case=True, cards=_cards)
