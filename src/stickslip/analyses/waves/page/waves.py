"""One case of an analysis by waves on the page: frequencies by travelling wave and nodal diameter."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from stickslip.analyses.columns import record_of
from stickslip.analyses.waves.records import Campbell, Flutter, Interference, Modes, hertz, states_that_differ
from stickslip.report.plot import colour
from stickslip.report.result import Node
from stickslip.report.section import Words

NEEDED = ("wave_number", "nodal_diameter", "wave_kind", "frequency_hz")


T = TypeVar("T", Modes, Campbell, Flutter, Interference)


@dataclass(frozen=True, eq=False, kw_only=True)
class Waves(Node, Generic[T]):
    """One case of an analysis by waves, with its record."""

    found: T

    @property
    def sectors(self) -> int:
        """Number of sectors; 1 for a whole structure."""
        return self.found.sectors or 1

    @property
    def rpm(self) -> float:
        """Speed of the rotor; NaN for a range."""
        return np.nan if self.found.speed_rpm is None else self.found.speed_rpm

    @property
    def both(self) -> bool:
        """Whether both directions of a nodal diameter are present."""
        diameters = [w.nodal_diameter for w in self.found.waves]
        return len(set(diameters)) < len(diameters)

    @property
    def waves(self) -> tuple[str, ...]:
        """Names of the waves, such as ``ND 3``, or ``ND 3 forward`` if both directions are present."""
        if self.sectors == 1:
            return ("whole structure",) * len(self.found.waves)
        each = [w.nodal_diameter for w in self.found.waves]
        return tuple(
            f"ND {w.nodal_diameter}{f' {w.kind}' if each.count(w.nodal_diameter) > 1 else ''}" for w in self.found.waves
        )

    @property
    def colours(self) -> tuple[str, ...]:
        """A CSS colour for each wave."""
        return tuple(colour(k) for k in range(len(self.waves)))


def states(nodes: Mapping[str, Node]) -> Words | None:
    """Return the sentence on analyses with different contact states; None if all have the same.

    Parameters
    ----------
    nodes
        Views of the analyses of a result, by name.
    """
    waves = {name: own.found.contacts or "" for name, own in nodes.items() if isinstance(own, Waves)}
    told = states_that_differ(waves)
    return Words((f"{told}.",)) if told else None


def view_of(kind: type[T]) -> Callable[[xr.Dataset], Waves[T]]:
    """Return the function that turns the dataset of a case into the view with its record."""
    return partial(_view, kind)


def _view(kind: type[T], data: xr.Dataset) -> Waves[T]:
    return Waves(data=data, found=record_of(kind, data))


def mode_lines(view: Waves[Modes] | Waves[Interference]) -> list[go.Scatter]:
    """Draw one line a mode over the nodal diameters, separately for each travelling direction."""
    hz, names, waves = hertz(view.found), view.waves, view.found.waves
    diameter, kinds = np.array([w.nodal_diameter for w in waves]), np.array([w.kind for w in waves])
    # with both directions there are two frequencies at a diameter: the standing waves belong to both lines
    groups = [("", np.arange(len(names)))]
    if view.both:
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


NARROW_BAND = 0.1  # width of a family of frequencies over the highest one, below which the axis does not begin at zero


def diameter_axes(figure: go.Figure, view: Waves[Modes] | Waves[Interference]) -> None:
    """Label the axes of a figure over nodal diameters."""
    highest = max(w.nodal_diameter for w in view.found.waves)
    figure.update_xaxes(title_text="nodal diameter", range=[-0.04 * highest - 0.4, 1.04 * highest + 0.4])
    figure.update_xaxes(dtick=1 if highest <= 30 else None)
    hz = hertz(view.found)
    low, high = float(np.nanmin(hz)), float(np.nanmax(hz))
    # a family whose waves differ by little would be one flat line above zero
    near = 0.0 < high - low < NARROW_BAND * high
    zoom = {"range": [low - 0.15 * (high - low), high + 0.15 * (high - low)]} if near else {"rangemode": "tozero"}
    figure.update_yaxes(title_text="frequency (Hz)", **zoom)
