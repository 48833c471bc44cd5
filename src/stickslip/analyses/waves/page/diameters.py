"""Frequencies over nodal diameters, for the nodal-diameter map and the SAFE diagram."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.waves.page.waves import Waves
from stickslip.report.plot import colour


def mode_lines(view: Waves) -> list[go.Scatter]:
    """One line a mode over the nodal diameters, each travelling direction for itself."""
    hz = view.floats("frequency_hz")
    diameter, kinds = view.integers("nodal_diameter"), view.data["wave_kind"].values
    names = np.array(view.waves)
    # with both directions there are two frequencies at a diameter: the standing waves belong to both lines
    groups = [("", np.arange(len(names)))]
    if len(set(diameter)) < len(diameter):
        groups = [
            (f", {way}", np.flatnonzero((kinds == way) | (kinds == "standing"))) for way in ("forward", "backward")
        ]
    traces = []
    for mode in range(hz.shape[1]):
        for g, (suffix, members) in enumerate(groups):
            order = members[np.argsort(diameter[members], kind="stable")]
            traces.append(
                go.Scatter(
                    x=diameter[order],
                    y=hz[order, mode],
                    mode="lines+markers",
                    name=f"mode {mode + 1}{suffix}",
                    text=[f"{names[w]}, {kinds[w]} wave" for w in order],
                    line={"color": colour(mode), "width": 1.4, "dash": "dot" if g else "solid"},
                    marker={"size": 7, "color": colour(mode), "symbol": "diamond" if g else "circle"},
                    hovertemplate=f"mode {mode + 1}, %{{text}}: %{{y:.6g}} Hz<extra></extra>",
                )
            )
    return traces


def diameter_axes(figure: go.Figure, view: Waves) -> None:
    """Label the axes of a figure over nodal diameters."""
    highest = int(view.integers("nodal_diameter").max())
    figure.update_xaxes(title_text="nodal diameter", range=[-0.04 * highest - 0.4, 1.04 * highest + 0.4])
    figure.update_xaxes(dtick=1 if highest <= 30 else None)
    figure.update_yaxes(title_text="frequency (Hz)", rangemode="tozero")
