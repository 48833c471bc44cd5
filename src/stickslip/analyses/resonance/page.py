"""Resonance peaks over a design parameter: amplitude, frequency, phase, energy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import FloatArray
from stickslip.report.content import Table
from stickslip.report.node import Node
from stickslip.report.plot import INK, MUTED, Plot, colour, ring, styled
from stickslip.report.quantities import NONE, counted, joined, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section

_BY = {
    "horizontal_tangent": "the largest amplitude of the output, where its response has a horizontal tangent",
    "phase_quadrature": "where the output is a quarter of a period behind the force",
    "variable_phase": "where the output has the phase of the largest amplitude beside the last peak",
}


@dataclass(frozen=True, eq=False)
class Peaks(Node):
    """One case."""

    @property
    def count(self) -> int:
        """Number of peaks."""
        return int(self.data.sizes["peak"])

    def curve(self, name: str, i: int) -> FloatArray:
        """Return a quantity of a peak along its curve."""
        there = self.values("maximum", "peak", "point")[i] > -2
        return np.asarray(self.values(name, "peak", "point")[i][there])


def amplitudes(view: Peaks) -> Plot:
    """Show the amplitude of the peaks over the parameter, the lowest place of the highest, and where one overtakes another."""
    scale = scale_for(view.floats("amplitude"), "m")
    figure = _over_parameter(view, "amplitude", scale.factor, scale.unit)
    figure.update_yaxes(title_text=f"amplitude of {view.text('output')} ({scale.unit})", rangemode="tozero")
    parts = [
        f"{counted(view.count, 'peak')} followed over {view.text('parameter')}: {_BY[view.text('by')]}.",
        "Dashed: the curve has met a minimum of the response, and is no peak any more." * _any_minimum(view),
    ]
    if np.isfinite(view.scalar("smallest_value")):
        x, y, hertz = (view.scalar(f"smallest_{k}") for k in ("value", "amplitude", "frequency_hz"))
        _mark(figure, np.array([x]), scale.factor * np.array([y]), "lowest", INK)
        where = f"at {number(hertz, 6)} Hz" if np.isfinite(hertz) else "where two are equally high"
        parts.append(f"The highest peak is lowest at **{number(x, 5)}**: {quantity(y, 'm', 5)} {where}.")
    if view.has("overtaking_value"):
        met, height = view.floats("overtaking_value"), view.floats("overtaking_amplitude")
        _mark(figure, met, scale.factor * height, "overtaken", MUTED)
        told = [
            f"peak {a + 1} by peak {b + 1} at {number(float(v), 4)}"
            for v, a, b in zip(met, view.integers("overtaking_before"), view.integers("overtaking_after"), strict=True)
        ]
        parts.append(f"Overtaken: {joined(told)}.")
    return Plot(f"resonances{view.key}", "Amplitude of the peaks", " ".join(p for p in parts if p), figure)


def frequencies(view: Peaks) -> Plot:
    """Show the frequency of the peaks."""
    figure = _over_parameter(view, "frequency_hz", 1.0, "Hz")
    figure.update_yaxes(title_text="frequency (Hz)")
    caption = "Frequency of each peak, in the colours of the figure above."
    return Plot(f"resonance_frequency{view.key}", "Frequency of the peaks", caption, figure)


def phases(view: Peaks) -> Plot:
    """Show how far the output is behind the force."""
    figure = _over_parameter(view, "phase_deg", 1.0, "°")
    figure.update_yaxes(title_text="phase of the output (°)")
    caption = (
        "Phase of the output against the force at each peak. Where it is not −90° a peak in quadrature would be another one: several forces, several "
        "modes or damping are in the way."
    )
    return Plot(f"resonance_phase{view.key}", "Phase at the peaks", caption, figure)


def energies(view: Peaks) -> Plot:
    """Show what the loads put in, and the part of it that friction takes."""
    scale = scale_for(view.floats("energy"), "J")
    figure = _over_parameter(view, "energy", scale.factor, scale.unit)
    for i in range(view.count):
        own = scale.factor * view.curve("friction_energy", i)
        figure.add_trace(
            go.Scatter(
                x=view.curve("value", i),
                y=own,
                mode="lines",
                name=f"peak {i + 1}, contacts",
                line={"color": colour(i), "width": 1.4, "dash": "dot"},
                hovertemplate=f"contacts take %{{y:.4g}} {scale.unit} at %{{x:.5g}}<extra></extra>",
            )
        )
    figure.update_yaxes(title_text=f"energy of a period ({scale.unit})", rangemode="tozero")
    caption = "Work of the loads over a period of the first harmonic, which is what is dissipated; dotted, the part that the contacts take."
    return Plot(f"resonance_energy{view.key}", "Dissipated energy", caption, figure)


def peak_table(view: Peaks) -> Table:
    """Return the peaks."""
    rows = []
    for i in range(view.count):
        columns = [
            view.curve(k, i)
            for k in ("value", "frequency_hz", "amplitude", "phase_deg", "energy", "friction_energy", "maximum")
        ]
        for value, hertz, height, phase, energy, friction, kind in zip(*columns, strict=True):
            share = 100 * friction / energy if energy > 0.0 else np.nan
            word = {1: "", 0: " (no maximum)", -1: " (not found)"}[int(kind)]
            rows.append(
                [
                    f"{i + 1}{word}",
                    number(float(value), 6),
                    number(float(hertz), 6),
                    quantity(float(height), "m", 5),
                    number(float(phase), 4),
                    quantity(float(energy), "J", 4),
                    f"{number(float(share), 3)} %" if np.isfinite(share) else NONE,
                ]
            )
    head = ["peak", view.text("parameter"), "frequency (Hz)", "amplitude", "phase (°)", "energy", "of friction"]
    return Table(head, rows, "Peaks")


def _over_parameter(view: Peaks, name: str, factor: float, unit: str) -> go.Figure:
    figure = go.Figure()
    for i in range(view.count):
        value, own, kind = (view.curve(k, i) for k in ("value", name, "maximum"))
        for low in (False, True):
            shown = np.where((kind == 0) == low, factor * own, np.nan)
            if low and not np.any(np.isfinite(shown)):
                continue
            figure.add_trace(
                go.Scatter(
                    x=value,
                    y=shown,
                    mode="lines+markers",
                    name=f"peak {i + 1}{', no maximum' * low}",
                    line={"color": colour(i), "width": 2, "dash": "dash" if low else "solid"},
                    marker={"size": 5},
                    hovertemplate=f"peak {i + 1}: %{{y:.6g}} {unit} at %{{x:.6g}}<extra></extra>",
                )
            )
    styled(figure, 440)
    figure.update_xaxes(title_text=view.text("parameter"))
    return figure


def _mark(figure: go.Figure, x: FloatArray, y: FloatArray, name: str, shade: str) -> None:
    figure.add_trace(
        go.Scatter(
            x=x,
            y=y,
            mode="markers",
            name=name,
            marker=ring(shade, 13, 2),
            hovertemplate=f"{name}: %{{y:.6g}} at %{{x:.6g}}<extra></extra>",
        )
    )


def _any_minimum(view: Peaks) -> bool:
    return bool(np.any(view.integers("maximum") == 0))


def _cards(view: Peaks) -> Sequence[Card]:
    known = view.floats("amplitude")
    if np.isfinite(view.scalar("smallest_value")):
        note = f"lowest, at {view.text('parameter')} = {number(view.scalar('smallest_value'), 4)}"
        return [Card(quantity(view.scalar("smallest_amplitude"), "m", 4), "highest resonance", note)]
    if not np.any(np.isfinite(known)):
        return []
    span = f"{counted(view.count, 'peak')} over {view.text('parameter')}"
    return [Card(quantity(float(np.nanmax(known)), "m", 4), "highest resonance", span)]


_BLOCK = Block("resonances", "Resonances over a parameter", (amplitudes, frequencies, phases, energies, peak_table))
SECTION: Section = Section("resonance", ("maximum",), Peaks, (_BLOCK,), by_case=True, cards=_cards)
