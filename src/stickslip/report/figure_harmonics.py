"""Which harmonics were kept at which frequency, one row of panels a load case."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import IntArray
from stickslip.report.plot import ALARM, Plot, absent, styled
from stickslip.report.quantities import counted
from stickslip.report.result import RATIO, Case, Result

SHOWN = 12  # load cases that stay legible below one another
EDGE = 0.01  # of the frequency range, so that marks at its ends are whole
ROW, LINE = 46, 13  # height of a panel and of each of its harmonics, pixels


def kept_harmonics(result: Result) -> Plot:
    """Draw a mark for every harmonic that an accepted solution keeps, against frequency."""
    key, title = "harmonics", "Harmonics kept at each frequency"
    cases = [c for c in result.cases if np.any(result.integers("case") == c.index)][-SHOWN:]
    if not cases:
        return absent(key, title, "no point of the run has been computed yet")
    figure = make_subplots(
        len(cases),
        1,
        shared_xaxes=True,
        vertical_spacing=0.25 / len(cases) if len(cases) > 1 else 0.0,
        subplot_titles=[f"{RATIO} = {c.label}" for c in cases],
    )
    highest = int(result.high_harmonics[-1])
    for row, case in enumerate(cases, 1):
        figure.add_trace(_marks(result, case), row=row, col=1)
        lost = np.flatnonzero(~result.converged & (result.integers("case") == case.index))
        if lost.size:
            figure.add_trace(_lost(result, lost, highest), row=row, col=1)
    styled(figure, 90 + len(cases) * (ROW + LINE * highest))
    figure.update_layout(showlegend=False)
    ticks = [int(h) for h in result.high_harmonics if h > 0]
    figure.update_yaxes(tickvals=ticks, range=[0.3, highest + 0.9])
    figure.update_yaxes(title_text="harmonic", row=(len(cases) + 1) // 2, col=1)
    hz = result.floats("frequency_hz")
    aside = EDGE * float(hz.max() - hz.min())
    figure.update_xaxes(range=[float(hz.min()) - aside, float(hz.max()) + aside])
    figure.update_xaxes(title_text="frequency (Hz)", row=len(cases), col=1)
    return Plot(key, title, _caption(result, cases), figure)


def _marks(result: Result, case: Case) -> go.Scatter:
    at = result.points(case)
    at = at[result.converged[at]]
    row, harmonic = np.nonzero(result.kept[at, 1:])
    return go.Scatter(
        x=result.floats("frequency_hz")[at][row],
        y=harmonic + 1,
        mode="markers",
        name=case.label,
        marker={"symbol": "square", "size": 6, "color": case.colour},
        hovertemplate="%{x:.2f} Hz: harmonic %{y} is kept<extra></extra>",
    )


def _lost(result: Result, at: IntArray, highest: int) -> go.Scatter:
    return go.Scatter(
        x=result.floats("frequency_hz")[at],
        y=np.full(at.size, highest + 0.5),
        mode="markers",
        name="did not converge",
        marker={"symbol": "x", "size": 7, "color": ALARM},
        hovertemplate="not converged<br>%{x:.2f} Hz<extra></extra>",
    )


def _caption(result: Result, cases: list[Case]) -> str:
    good = result.converged
    more = int(np.sum(result.more & good))
    text = (
        f"A mark stands for a harmonic that the accepted solution keeps, chosen by <code>{result.selection}</code>; the static term is "
        f"always kept. {more} of {counted(int(good.sum()), 'accepted point')} keep other harmonics than H = {result.low_name}"
    )
    used = np.flatnonzero(result.kept[good].any(axis=0)) if good.any() else np.zeros(0, dtype=int)
    unused = [str(h) for h in result.high_harmonics if h not in used]
    text += f"; no point keeps {', '.join(unused)}." if unused and good.any() else "."
    if len(cases) < len(result.cases):
        text += f" The {len(cases)} most nonlinear of {len(result.cases)} load cases are drawn."
    return text
