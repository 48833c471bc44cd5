"""Bounds over residual tractions as a band on the figures of the forced response."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.residual_tractions.page import has_width
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.quantities import percent
from stickslip.study.file.case_names import Naming

ANALYSIS = "residual_tractions"
_TAKEN = ("frequency_hz", "least_amplitude", "most_amplitude", "resonance_hz", "resonance_amplitude", "harmonics")
_PREFIX = "traction_"
_OPACITY = 0.22


def with_bands(data: xr.Dataset, tree: xr.DataTree) -> xr.Dataset:
    """Return a forced response with the bounds over residual tractions, if the same result has them for all cases."""
    if ANALYSIS not in tree.children:
        return data
    own = tree[ANALYSIS].to_dataset()
    known = "case_label" in own and "case_label" in data
    alike = known and np.array_equal(own["case_label"].values, data["case_label"].values)
    output = {str(x) for x in own["output"].values} if "output" in own else set()
    if not alike or "resonance_amplitude" not in own or len(output) != 1:
        return data
    taken = {name: own[name].rename(None) for name in _TAKEN if name in own}
    return data.assign({f"{_PREFIX}{name}": value.variable for name, value in taken.items()})


def _has(response: Response) -> bool:
    return response.has(f"{_PREFIX}resonance_amplitude") and not response.mistuned


def _per_force(response: Response, case: ShownCase) -> float:
    return 1.0 / case.excitation if response.per_force else 1.0


def _of(response: Response, case: ShownCase, name: str) -> FloatArray:
    return np.asarray(response.data[f"{_PREFIX}{name}"].values[case.index], dtype=float)


def draw_bands(figure: go.Figure, response: Response, cases: Sequence[ShownCase]) -> str:
    """Draw the band of each of the cases behind its curve; return the sentence for the caption, empty for none."""
    if not _has(response) or response.has("speed_rpm"):
        return ""
    drawn = False
    for case in cases:
        hertz, least, most = (
            _of(response, case, name) for name in ("frequency_hz", "least_amplitude", "most_amplitude")
        )
        known = np.isfinite(least) & np.isfinite(most)
        if not has_width(least, most):
            continue
        scale = response.scale.factor * _per_force(response, case)
        shared = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", "legendgroup": "tractions"}
        figure.add_scatter(x=hertz[known], y=least[known] * scale, showlegend=False, **shared)
        figure.add_scatter(
            x=hertz[known],
            y=most[known] * scale,
            fill="tonexty",
            fillcolor=_faint(case.colour),
            name="residual tractions",
            showlegend=not drawn,
            **shared,
        )
        drawn = True
    if not drawn:
        return " Residual tractions leave it as it is: the bounds are equal."
    return f" The band shows the motions that residual tractions allow, with H = {_harmonics(response)}."


def _faint(colour: str) -> str:
    return colour.replace("rgb(", "rgba(").replace(")", f",{_OPACITY})")


def _harmonics(response: Response) -> int:
    return int(np.max(response.data[f"{_PREFIX}harmonics"].values))


def draw_peak_bands(
    figure: go.Figure, response: Response, cases: list[ShownCase], factor: float, naming: Naming
) -> str:
    """Draw the bounds of the peaks in the first column of an optimisation curve; return the sentence for the caption.

    Parameters
    ----------
    figure
        The figure of the curves.
    response
        The response.
    cases
        Cases of one curve by the value of the varied key.
    factor
        Factor from the unit of the response to the unit of the figure.
    naming
        Naming of the varied key.
    """
    if not _has(response):
        return ""
    bounds = np.array([_of(response, c, "resonance_amplitude") * _per_force(response, c) for c in cases])
    known = np.isfinite(bounds).all(axis=1)
    if not known.any():
        return ""
    x = np.array([naming.shown(c.value) for c in cases])[known]
    least, most = (bounds[known, k] * factor for k in (1, 2))
    if not has_width(least, most):
        return " Residual tractions leave the peaks as they are: the bounds are equal."
    shared = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", "showlegend": False}
    figure.add_scatter(x=x, y=least, row=1, col=1, **shared)
    figure.add_scatter(
        x=x, y=most, fill="tonexty", fillcolor="rgba(0,114,178,0.25)", name="residual tractions", row=1, col=1, **shared
    )
    width = 100 * (bounds[known, 2] / bounds[known, 1] - 1)
    return f" The band shows the peak over all residual tractions, up to {percent(float(width.max()))} wide."
