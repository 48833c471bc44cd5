"""Bifurcations of the response on the page: marks on its curves, side branches, and a table."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.summary import beside_bifurcations
from stickslip.report.cases import ShownCase
from stickslip.report.content import Table, Words
from stickslip.report.plot import MUTED, key_marker
from stickslip.report.quantities import NONE, counted, fixed, number, quantity

SYMBOLS = {
    "fold": "triangle-left",
    "period doubling": "square",
    "Neimark-Sacker": "star",
    "branch point": "cross",
    "jump of multipliers": "hourglass",
}
ROWS = ("frequency_hz", "frequency_error_hz", "amplitude", "multiplier_error")


def mark_bifurcations(figure: go.Figure, response: Response, over: float) -> str:
    """Draw the bifurcations of a response and its side branches; return the sentence for the caption, empty for none.

    Parameters
    ----------
    figure, response
        The figure of the curves, and their response.
    over
        Abscissa of a frequency of 1 Hz.
    """
    if not response.has("bifurcation_case", "bifurcation_kind"):
        return ""
    branches = 0
    for case in response.cases:
        branches += _branches(figure, response, case, over)
    if branches:
        figure.add_trace(key_marker("branch that leaves (dotted)", "line-ew", "bifurcations"))
    kinds = [str(kind) for kind in response.data["bifurcation_kind"].values]
    for kind, symbol in SYMBOLS.items():
        own = [i for i, k in enumerate(kinds) if k == kind]
        if own:
            figure.add_trace(_marks(response, own, kind, symbol, over))
    found = [counted(kinds.count(kind), kind) for kind in SYMBOLS if kind in kinds]
    told = f" Located on the branch: {', '.join(found)}." if found else ""
    if branches:
        told += f" Dotted: {branches} that leave{'s' * (branches == 1)} there."
    return told


def _marks(response: Response, own: list[int], kind: str, symbol: str, over: float) -> go.Scatter:
    case, hz, size = (response.values(f"bifurcation_{n}") for n in ("case", *ROWS[:3:2]))
    told = response.labels_of("bifurcation_sentence")
    scale = response.scale
    by = [_divisor(response, int(case[i])) for i in own]
    return go.Scatter(
        x=hz[own] * over,
        y=size[own] / by * scale.factor,
        mode="markers",
        name=kind,
        legendgroup="bifurcations",
        marker={"symbol": symbol, "size": 10, "color": "white", "line": {"width": 1.8, "color": MUTED}},
        customdata=[[told[i]] for i in own],
        hovertemplate="%{customdata[0]}<extra></extra>",
    )


def _branches(figure: go.Figure, response: Response, case: ShownCase, over: float) -> int:
    """Draw the branches of a case; return how many."""
    if not response.has("side_point_case"):
        return 0
    at = np.flatnonzero(response.integers("side_point_case") == case.index)
    number_of = response.integers("side_point_branch")
    hz, size = (response.values(f"side_point_{n}") for n in ("frequency_hz", "amplitude"))
    every = np.unique(number_of[at])
    for branch in every:
        own = at[number_of[at] == branch]
        figure.add_trace(
            go.Scatter(
                x=hz[own] * over,
                y=size[own] / _divisor(response, case.index) * response.scale.factor,
                mode="lines",
                name="leaves the response",
                legendgroup="bifurcations",
                showlegend=False,
                line={"color": case.colour, "width": 1.4, "dash": "dot"},
                hovertemplate="%{x:.2f}: %{y:.4g}<br>a branch that leaves the response<extra></extra>",
            )
        )
    return int(every.size)


def _divisor(response: Response, case: int) -> float:
    return response.cases[case].excitation if response.per_force else 1.0


def bifurcations(response: Response) -> Table | Words | None:
    """Return a table with one row a bifurcation: frequency, kind, and the crossing multiplier."""
    if not response.has("bifurcations_limits"):
        return None
    labels = [c.label for c in response.cases]
    title, lines = "Bifurcations", list(beside_bifurcations(response.data, labels))
    text = "Where multipliers of the motion cross the unit circle along the branch, or it turns back."
    if not response.has("bifurcation_case"):
        return Words((text,), title, lines)
    case = response.integers("bifurcation_case")
    hz, off, size, error = (response.values(f"bifurcation_{name}") for name in ROWS)
    parts = response.values("bifurcation_multiplier", "bifurcation", "part")
    kinds = response.labels_of("bifurcation_kind")
    rows = [
        [
            response.cases[int(case[i])].short,
            kinds[i],
            fixed(float(hz[i]), 4),
            _known(float(off[i])),
            quantity(float(size[i]), response.length),
            _complex(*parts[i]),
            _known(float(error[i])),
        ]
        for i in range(len(hz))
    ]
    head = ["kind", "frequency (Hz)", "± (Hz)", "amplitude", "multiplier", "±"]
    return response.table(title, (text,), head, rows, items=lines)


def _known(error: float) -> str:
    return number(error, 2) if np.isfinite(error) else "not known"


def _complex(real: float, imaginary: float) -> str:
    if not np.isfinite(real):
        return NONE
    if abs(imaginary) < 1e-6:
        return number(real, 5)
    return f"{number(real, 5)} ± {number(abs(imaginary), 5)}i"
