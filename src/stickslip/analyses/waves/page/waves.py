"""The dataset of an analysis by waves with the accesses that figures and tables need: frequencies by travelling wave and nodal diameter."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.report.plot import colour
from stickslip.report.result import Node

NEEDED = ("wave_number", "nodal_diameter", "wave_kind", "frequency_hz")


@dataclass(frozen=True, eq=False)
class Waves(Node):
    """One case of an analysis by waves."""

    @property
    def sectors(self) -> int:
        """Number of sectors; 1 for a whole structure."""
        return int(self.scalar("sectors", 1))

    @property
    def kinds(self) -> list[str]:
        """Kind of each wave: standing, forward, backward or whole."""
        return [str(kind) for kind in self.data["wave_kind"].values]

    @property
    def waves(self) -> tuple[str, ...]:
        """Names of the waves, such as ``ND 3``, or ``ND 3 forward`` if both directions are present."""
        diameters = self.integers("nodal_diameter")
        if self.sectors == 1:
            return ("whole structure",) * len(diameters)
        names = []
        for diameter, kind in zip(diameters, self.kinds, strict=True):
            both = np.count_nonzero(diameters == diameter) > 1
            names.append(f"ND {diameter}{f' {kind}' if both else ''}")
        return tuple(names)

    @property
    def colours(self) -> tuple[str, ...]:
        """A CSS colour for each wave."""
        return tuple(colour(k) for k in range(len(self.waves)))


def mode_lines(view: Waves) -> list[go.Scatter]:
    """Draw one line a mode over the nodal diameters, separately for each travelling direction."""
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
