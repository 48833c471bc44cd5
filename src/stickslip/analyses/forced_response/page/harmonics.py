"""Harmonics kept over frequency, one row of panels a case."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import IntArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import ALARM, Plot, styled
from stickslip.report.quantities import counted, runs

_SHOWN = 12  # cases that stay legible below one another
_EDGE = 0.01  # of the frequency range, so that marks at its ends are whole
_ROW, _LINE, _PANEL = (46, 13, 200)  # height of a panel, of each of its harmonics, and of all of these at most, pixels
_TICKS = 12  # harmonics that an axis names


def kept_harmonics(response: Response) -> Plot | None:
    """Draw a mark for every harmonic that an accepted solution keeps, against frequency."""
    cases = [c for c in response.cases if np.any(response.point_case == c.index)][-_SHOWN:]
    if not cases or not response.decides:
        return None
    spacing = 0.25 / len(cases) if len(cases) > 1 else 0.0
    titles = [c.label for c in cases]
    figure = make_subplots(len(cases), 1, shared_xaxes=True, vertical_spacing=spacing, subplot_titles=titles)
    highest = max((int(h) for h in np.flatnonzero(response.kept.any(axis=0))), default=1)
    for row, case in enumerate(cases, 1):
        figure.add_trace(_marks(response, case), row=row, col=1)
        lost = np.flatnonzero(~response.converged & (response.point_case == case.index))
        if lost.size:
            figure.add_trace(_lost(response, lost, highest), row=row, col=1)
    styled(figure, 90 + len(cases) * (_ROW + min(_LINE * highest, _PANEL)))
    figure.update_layout(showlegend=False)
    ticks = [int(h) for h in response.high_harmonics if 0 < h <= highest]
    if len(ticks) > _TICKS:
        ticks = [1, *range(5, highest + 1, 5)]
    figure.update_yaxes(tickvals=ticks, range=[0.3, highest + 0.9])
    figure.update_yaxes(title_text="harmonic", row=(len(cases) + 1) // 2, col=1)
    hz = response.hz
    aside = _EDGE * float(hz.max() - hz.min())
    figure.update_xaxes(range=[float(hz.min()) - aside, float(hz.max()) + aside])
    figure.update_xaxes(title_text="frequency (Hz)", row=len(cases), col=1)
    return Plot("harmonics", "Harmonics kept at each frequency", _caption(response, cases), figure)


def _marks(response: Response, case: ShownCase) -> go.Scatter:
    at = response.points(case)
    at = at[response.converged[at]]
    row, harmonic = np.nonzero(response.kept[at, 1:])
    return go.Scatter(
        x=response.hz[at][row],
        y=harmonic + 1,
        mode="markers",
        name=case.short,
        marker={"symbol": "square", "size": 6 if response.kept.shape[1] <= _TICKS else 4, "color": case.colour},
        hovertemplate="%{x:.2f} Hz: harmonic %{y} is kept<extra></extra>",
    )


def _lost(response: Response, at: IntArray, highest: int) -> go.Scatter:
    return go.Scatter(
        x=response.hz[at],
        y=np.full(at.size, highest + 0.5),
        mode="markers",
        name="did not converge",
        marker={"symbol": "x", "size": 7, "color": ALARM},
        hovertemplate="not converged<br>%{x:.2f} Hz<extra></extra>",
    )


def _caption(response: Response, cases: list[ShownCase]) -> str:
    good = response.converged
    text = (
        f"A mark stands for a harmonic that the accepted solution keeps, chosen by `{response.selection}`; the "
        f"static term is always kept. {int(np.sum(response.more & good))} of {counted(int(good.sum()), 'accepted point')} "
        f"keep other harmonics than H = {response.low_name}"
    )
    used = np.flatnonzero(response.kept[good].any(axis=0)) if good.any() else np.zeros(0, dtype=int)
    unused = [int(h) for h in response.high_harmonics if h not in used]
    text += f"; no point keeps {runs(unused)}." if unused and good.any() else "."
    if len(cases) < len(response.cases):
        text += f" The last {len(cases)} of {len(response.cases)} cases are drawn."
    return text
