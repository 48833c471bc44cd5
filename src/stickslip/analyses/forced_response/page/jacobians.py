"""Jacobians with few and with many harmonics on the page: ΔJ and Γ over frequency, and the blocks between harmonics."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.curves import abscissa
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import Jacobians, read
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import Plot, styled
from stickslip.report.quantities import number, percent
from stickslip.report.section import Chooser, chooser
from stickslip.study.file.case_names import CASE

_FAINT = 1e-3  # relative to the block of a stuck contact: smaller blocks are drawn white
_SCALE = "YlGnBu"
_NUMBERED = 8  # largest number of harmonics for numbers in the blocks


def jacobian_change(response: Response) -> Plot | None:
    """Draw ΔJ and the mean of the diagonal of Γ against frequency (Gastaldi and Berruti 2017, section 6.2)."""
    own = read(Jacobians, response.data)
    if not np.isfinite(own.jacobian_change_percent).any():
        return None
    x, name, unit = abscissa(response)
    figure = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06)
    for case in response.cases:
        at = response.points(case)
        for row, values in enumerate((own.jacobian_change_percent, own.gamma_mean_diagonal), 1):
            figure.add_trace(_curve(response, case, x[at], values[at], unit, first=row == 1), row=row, col=1)
    styled(figure, 480)
    figure.update_yaxes(title_text="ΔJ (%)", rangemode="tozero", row=1, col=1)
    figure.update_yaxes(title_text="mean of diag Γ", row=2, col=1)
    figure.update_xaxes(title_text=f"{name} ({unit})", row=2, col=1)
    return Plot(
        "jacobian_change",
        f"Change of the Jacobian from H = {response.low_name} to more harmonics",
        _caption(response, own),
        figure,
    )


def _curve(response: Response, case: ShownCase, x: FloatArray, y: FloatArray, unit: str, *, first: bool) -> go.Scatter:
    several = len(response.cases) > 1
    return go.Scatter(
        x=x,
        y=y,
        mode="lines+markers",
        name=case.short if several else "points",
        legendgroup=f"case {case.index}",
        legendgrouptitle={"text": CASE} if several and first and case is response.cases[0] else None,
        showlegend=several and first,
        line={"color": case.colour, "width": 1.6},
        marker={"size": 5, "color": case.colour},
        hovertemplate=f"{case.named}<br>%{{x:.2f}} {unit}: %{{y:.4g}}<extra></extra>",
    )


def _caption(response: Response, own: Jacobians) -> str:
    worst = int(np.nanargmax(own.jacobian_change_percent))
    case = response.cases[response.point_case[worst]]
    reference = int(np.max(own.jacobian_reference))
    return (
        f"Above: ΔJ, the relative difference of the Jacobian at the solution with H = {response.low_name} from that at the solution with "
        f"harmonics up to {reference} (Gastaldi and Berruti 2017, eq. 30). Below: the mean of the diagonal of Γ (eq. 31), 1 for equal Jacobians. "
        f"Largest ΔJ: {percent(float(own.jacobian_change_percent[worst]))} at {number(float(response.hz[worst]), 5)} Hz{case.where}. "
        "Neither predicts the error of the response."
    )


def jacobian_blocks(response: Response) -> list[Chooser | Plot]:
    """Draw the blocks of the Jacobian between harmonics at the peak, and the neglected blocks, with buttons for the case.

    Source: Gastaldi and Berruti 2017, fig. 1.
    """
    each = {c: read(Jacobians, response.data, c.index) for c in response.cases}
    known = {c: own for c, own in each.items() if np.isfinite(own.jacobian_block_norm).any()}
    if not known:
        return []
    chosen = response.chosen if any(c.index == response.chosen for c in known) else next(iter(known)).index
    titles = ["J at the peak", "ΔJ, neglected"]
    figure = make_subplots(1, 2, shared_yaxes=True, horizontal_spacing=0.06, subplot_titles=titles)
    largest = max(float(np.nanmax(own.jacobian_block_norm)) for own in known.values())
    for case, own in known.items():
        for column, norms in enumerate((own.jacobian_block_norm, own.neglected_block_norm), 1):
            figure.add_trace(_map(case, norms, largest, bar=column == 1), row=1, col=column)
    styled(figure, 480)
    figure.update_xaxes(title_text="harmonic of motion", constrain="domain", dtick=1 if _few(known) else None)
    figure.update_yaxes(autorange="reversed", dtick=1 if _few(known) else None)
    figure.update_yaxes(title_text="harmonic of force", col=1)
    captions = {c.index: _of_blocks(response, c, own) for c, own in known.items()}
    text = (
        "Each block is the effect of the motion in one harmonic on the forces in another, its largest singular value; 1 is as stiff as structure and stuck contact. "
        "In full stick only the diagonal is there: harmonics are uncoupled. "
    )
    buttons = chooser(CASE, tuple(known), chosen)
    if buttons is None:
        return [Plot("jacobian_blocks", _TITLE, text + captions[chosen], figure)]
    return [buttons, Plot("jacobian_blocks", _TITLE, text, figure, captions, chosen)]


_TITLE = "Blocks of the Jacobian between harmonics"


def _few(known: dict[ShownCase, Jacobians]) -> bool:
    return all(len(own.jacobian_block_norm) <= _NUMBERED for own in known.values())


def _map(case: ShownCase, norms: FloatArray, largest: float, *, bar: bool) -> go.Heatmap:
    shown = np.where(norms >= _FAINT, norms, np.nan)
    harmonics = np.arange(len(norms))
    low, high = np.log10(_FAINT), np.log10(max(largest, 10 * _FAINT))
    written = [[f"{v:.2g}" if np.isfinite(v) else "" for v in row] for row in shown]
    return go.Heatmap(
        x=harmonics,
        y=harmonics,
        z=np.log10(shown),
        zmin=low,
        zmax=high,
        colorscale=_SCALE,
        showscale=bar,
        colorbar={"title": {"text": "log₁₀ of the norm", "side": "right"}},
        text=written,
        texttemplate="%{text}" if len(norms) <= _NUMBERED else None,
        hovertemplate="motion in %{x}, force in %{y}: %{text}<extra></extra>",
        meta=case.index,
    )


def _of_blocks(response: Response, case: ShownCase, own: Jacobians) -> str:
    off = own.jacobian_block_norm[~np.eye(len(own.jacobian_block_norm), dtype=bool)]
    told = f"At the peak, {number(response.peak_hz(case), 5)} Hz, the largest block off the diagonal has {number(float(np.nanmax(off)))}"
    if not np.isfinite(own.neglected_block_norm).any():
        return f"{told}."
    return (
        f"{told}. Right: ΔJ at {number(own.neglected_frequency_hz, 5)} Hz, where the Jacobian changes most, "
        f"what H = {response.low_name} neglects: up to {number(float(np.nanmax(own.neglected_block_norm)))}."
    )
