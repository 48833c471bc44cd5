"""Resonance peaks over a design parameter: amplitude, frequency, phase, energy."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.columns import CaseView
from stickslip.analyses.resonance.records import PeakCurve, Resonances
from stickslip.arrays import FloatArray
from stickslip.report.plot import INK, MUTED, Plot, colour, ring, styled
from stickslip.report.quantities import NONE, counted, joined, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section, Table

_BY = {
    "horizontal_tangent": "the largest amplitude of the output, where its response has a horizontal tangent",
    "phase_quadrature": "where the output is a quarter of a period behind the force",
    "variable_phase": "where the output has the phase of the largest amplitude beside the last peak",
}


class Peaks(CaseView[Resonances]):
    """One case."""

    kind = Resonances

    @property
    def amplitude(self) -> FloatArray:
        """Amplitudes of all points of all peaks, m."""
        return np.concatenate([peak.amplitude for peak in self.found.peaks])


def amplitudes(view: Peaks) -> Plot:
    """Draw the amplitude of the peaks over the parameter, the minimum of the highest peak, and overtakings."""
    found, scale = view.found, scale_for(view.amplitude, "m")
    figure = _over_parameter(found, [scale.factor * peak.amplitude for peak in found.peaks], scale.unit)
    figure.update_yaxes(title_text=f"amplitude of {found.output} ({scale.unit})", rangemode="tozero")
    parts = [
        f"{counted(len(found.peaks), 'peak')} followed over {found.parameter}: {_BY[found.by]}.",
        "Dashed: the curve has met a minimum of the response, and is no peak any more." * _any_minimum(found),
    ]
    if found.smallest is not None:
        x, y, hertz = found.smallest
        _mark(figure, np.array([x]), scale.factor * np.array([y]), "lowest", INK)
        where = f"at {number(hertz, 6)} Hz" if np.isfinite(hertz) else "where two are equally high"
        parts.append(f"The highest peak is lowest at **{number(x, 5)}**: {quantity(y, 'm', 5)} {where}.")
    if met := found.overtakings:
        places, heights = np.array([m.value for m in met]), np.array([m.amplitude for m in met])
        _mark(figure, places, scale.factor * heights, "overtaken", MUTED)
        told = [f"peak {m.before + 1} by peak {m.after + 1} at {number(m.value, 4)}" for m in met]
        parts.append(f"Overtaken: {joined(told)}.")
    return Plot(f"resonances{view.key}", "Amplitude of the peaks", " ".join(p for p in parts if p), figure)


def frequencies(view: Peaks) -> Plot:
    """Draw the frequency of the peaks."""
    figure = _over_parameter(view.found, [peak.frequency_hz for peak in view.found.peaks], "Hz")
    figure.update_yaxes(title_text="frequency (Hz)")
    caption = "Frequency of each peak, in the colours of the figure above."
    return Plot(f"resonance_frequency{view.key}", "Frequency of the peaks", caption, figure)


def phases(view: Peaks) -> Plot:
    """Draw the phase of the output against the force."""
    figure = _over_parameter(view.found, [peak.phase_deg for peak in view.found.peaks], "°")
    figure.update_yaxes(title_text="phase of the output (°)")
    caption = (
        "Phase of the output against the force at each peak. Where it is not −90° a peak in quadrature would be another one: several forces, several "
        "modes or damping are in the way."
    )
    return Plot(f"resonance_phase{view.key}", "Phase at the peaks", caption, figure)


def energies(view: Peaks) -> Plot:
    """Draw the work of the loads in a period, and the part dissipated by contacts."""
    peaks = view.found.peaks
    scale = scale_for(np.concatenate([peak.energy for peak in peaks]), "J")
    figure = _over_parameter(view.found, [scale.factor * peak.energy for peak in peaks], scale.unit)
    for i, peak in enumerate(peaks):
        figure.add_scatter(
            x=peak.value[peak.known],
            y=scale.factor * peak.friction_energy[peak.known],
            mode="lines",
            name=f"peak {i + 1}, contacts",
            line={"color": colour(i), "width": 1.4, "dash": "dot"},
            hovertemplate=f"contacts take %{{y:.4g}} {scale.unit} at %{{x:.5g}}<extra></extra>",
        )
    figure.update_yaxes(title_text=f"energy of a period ({scale.unit})", rangemode="tozero")
    caption = "Solid lines show the work of the loads in a period of the first harmonic, which equals the dissipation. Dotted lines show the contacts' share."
    return Plot(f"resonance_energy{view.key}", "Dissipated energy", caption, figure)


def peak_table(view: Peaks) -> Table:
    """Return a table of the peaks."""
    rows = [
        _row(i + 1, peak, k) for i, peak in enumerate(view.found.peaks) for k in np.flatnonzero(peak.known).tolist()
    ]
    head = ["peak", view.found.parameter, "frequency (Hz)", "amplitude", "phase (°)", "energy", "of friction"]
    return Table(head, rows, "Peaks")


def _row(number_of: int, peak: PeakCurve, k: int) -> list[str]:
    energy = float(peak.energy[k])
    share = 100 * float(peak.friction_energy[k]) / energy if energy > 0.0 else np.nan
    word = {1: "", 0: " (no maximum)", -1: " (not found)"}[int(peak.maximum[k])]
    return [
        f"{number_of}{word}",
        number(float(peak.value[k]), 6),
        number(float(peak.frequency_hz[k]), 6),
        quantity(float(peak.amplitude[k]), "m", 5),
        number(float(peak.phase_deg[k]), 4),
        quantity(energy, "J", 4),
        f"{number(share, 3)} %" if np.isfinite(share) else NONE,
    ]


def _over_parameter(found: Resonances, each: Sequence[FloatArray], unit: str) -> go.Figure:
    """Draw a quantity of each peak over the parameter."""
    figure = go.Figure()
    for i, (peak, own) in enumerate(zip(found.peaks, each, strict=True)):
        value, kind = peak.value[peak.known], peak.maximum[peak.known]
        for low in (False, True):
            shown = np.where((kind == 0) == low, own[peak.known], np.nan)
            if low and not np.any(np.isfinite(shown)):
                continue
            figure.add_scatter(
                x=value,
                y=shown,
                mode="lines+markers",
                name=f"peak {i + 1}{', no maximum' * low}",
                line={"color": colour(i), "width": 2, "dash": "dash" if low else "solid"},
                marker={"size": 5},
                hovertemplate=f"peak {i + 1}: %{{y:.6g}} {unit} at %{{x:.6g}}<extra></extra>",
            )
    styled(figure, 440)
    figure.update_xaxes(title_text=found.parameter)
    return figure


def _mark(figure: go.Figure, x: FloatArray, y: FloatArray, name: str, shade: str) -> None:
    figure.add_scatter(
        x=x,
        y=y,
        mode="markers",
        name=name,
        marker=ring(shade, 13, 2),
        hovertemplate=f"{name}: %{{y:.6g}} at %{{x:.6g}}<extra></extra>",
    )


def _any_minimum(found: Resonances) -> bool:
    return any(bool(np.any(peak.maximum == 0)) for peak in found.peaks)


def _cards(view: Peaks) -> Sequence[Card]:
    found = view.found
    if found.smallest is not None:
        value, amplitude, _ = found.smallest
        note = f"lowest, at {found.parameter} = {number(value, 4)}"
        return [Card(quantity(amplitude, "m", 4), "highest resonance", note)]
    if not np.any(np.isfinite(view.amplitude)):
        return []
    span = f"{counted(len(found.peaks), 'peak')} over {found.parameter}"
    return [Card(quantity(float(np.nanmax(view.amplitude)), "m", 4), "highest resonance", span)]


_BLOCK = Block("resonances", "Resonances over a parameter", (amplitudes, frequencies, phases, energies, peak_table))
SECTION: Section = Section("resonance", ("maximum",), Peaks, (_BLOCK,), by_case=True, cards=_cards)
