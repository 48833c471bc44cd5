"""Residual tractions: the band that they leave open over frequency, and of the resonance."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import FloatArray
from stickslip.report.content import Table
from stickslip.report.node import Node
from stickslip.report.plot import COLOURS, INK, Plot, log_ticks, styled
from stickslip.report.quantities import NONE, number, percent, quantity, scale_for
from stickslip.report.section import Block, Card, Section

_NAMES = ("own start", "smallest", "largest")
_EQUAL = 1e-6  # relative difference of bounds that are one


def has_width(least: FloatArray, most: FloatArray) -> bool:
    """Whether bounds differ anywhere by more than rounding."""
    known = np.isfinite(least) & np.isfinite(most)
    return bool(np.any(most[known] - least[known] > _EQUAL * np.abs(least[known])))


@dataclass(frozen=True, eq=False)
class Tractions(Node):
    """One case."""


def band(view: Tractions) -> Plot | None:
    """Show the smallest and the largest amplitude at each frequency."""
    if not view.has("frequency_hz"):
        return None
    hertz = view.floats("frequency_hz")
    own, least, most = (view.floats(f"{name}_amplitude") for name in ("reference", "least", "most"))
    scale = scale_for(np.concatenate([least, most]), "m")
    figure = go.Figure()
    edge = {"mode": "lines", "line": {"color": COLOURS[0], "width": 1}}
    hover = f"%{{y:.4g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>"
    wide = has_width(least, most)
    if wide:
        figure.add_scatter(x=hertz, y=scale.factor * least, name="smallest", hovertemplate=hover, **edge)
        figure.add_scatter(
            x=hertz,
            y=scale.factor * most,
            name="largest",
            fill="tonexty",
            fillcolor="rgba(0,114,178,0.25)",
            hovertemplate=hover,
            **edge,
        )
    figure.add_scatter(
        x=hertz,
        y=scale.factor * own,
        name="own start" if wide else "amplitude",
        mode="lines+markers",
        marker={"size": 5},
        line={"color": INK, "width": 1.4},
        hovertemplate=hover,
    )
    if _open_resonance(view):
        figure.add_scatter(
            x=view.floats("resonance_hz")[1:],
            y=scale.factor * view.floats("resonance_amplitude")[1:],
            name="bounds of the resonance",
            mode="markers",
            marker={"symbol": "diamond", "size": 10, "color": COLOURS[1]},
            hovertemplate=hover,
        )
    styled(figure, 480)
    figure.update_xaxes(title_text="frequency (Hz)")
    ticks = log_ticks(scale.factor * np.concatenate([least, most]))
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", type="log", **ticks)
    return Plot(f"residual_tractions{view.key}", "What residual tractions leave open", _caption(view), figure)


def _caption(view: Tractions) -> str:
    least, most = (view.floats(f"{name}_amplitude") for name in ("least", "most"))
    text = (
        f"Amplitude of {view.text('output')}, H = {int(view.scalar('harmonics', 0))}: a contact that sticks keeps a traction from before, "
        "and every one within the friction cone is a steady motion. "
    )
    if view.has("branches") and np.nanmax(view.floats("branches")) > 1:
        text += "Where the own start has several motions, the band holds all that sweeps up and down met. "
    if not has_width(least, most):
        return text + "The bounds are equal at all frequencies: the answer is unique."
    width = most / least - 1
    at = int(np.nanargmax(width))
    hertz = number(float(view.floats("frequency_hz")[at]), 5)
    return (
        text
        + f"The band is widest at {hertz} Hz, {percent(100 * float(width[at]))}. Bounds are found motions; the true band is at least as wide."
    )


def _open_resonance(view: Tractions) -> bool:
    """Whether there are bounds of the resonance, and they differ."""
    if not view.has("resonance_amplitude"):
        return False
    _, least, most = view.floats("resonance_amplitude")
    return has_width(np.atleast_1d(least), np.atleast_1d(most))


def resonances(view: Tractions) -> Table | None:
    """Return the bounds of the resonance, and what time integration says of them."""
    if not view.has("resonance_amplitude"):
        return None
    equal = () if _open_resonance(view) else ("The bounds are equal.",)
    height, hertz = view.floats("resonance_amplitude"), view.floats("resonance_hz")
    rows = []
    for k, name in enumerate(_NAMES):
        again = time = NONE
        told = ""
        if k and view.has("confirmed"):
            again, time = (
                quantity(float(view.floats(f"{what}_amplitude")[k - 1]), "m") for what in ("resolved", "time")
            )
            followed = view.labels_of("time_status")[k - 1]
            ends = ("left in time", "confirmed") if followed else ("not found again", "confirmed, not in time")
            told = ends[view.integers("confirmed")[k - 1]]
        off = percent(100 * float(height[k] / height[0] - 1)) if k else ""
        rows.append([name, quantity(float(height[k]), "m"), off, number(float(hertz[k]), 6), again, time, told])
    head = ["resonance", "amplitude", "against own start", "at (Hz)", "solved again", "in time", ""]
    return Table(head, rows, "Bounds of the resonance", equal)


def _cards(view: Tractions) -> list[Card]:
    if not _open_resonance(view):
        return []
    own, least, most = (float(h) for h in view.floats("resonance_amplitude"))
    text = f"{percent(100 * (least / own - 1))} to {percent(100 * (most / own - 1))}"
    return [Card(text, "resonance by residual tractions", f"own start {quantity(own, 'm')}")]


_BLOCK = Block("residual_tractions", "Residual tractions", (band, resonances))
SECTION: Section = Section("residual_tractions", ("frequency_hz",), Tractions, (_BLOCK,), by_case=True, cards=_cards)
