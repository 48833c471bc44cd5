"""Bifurcations of the response on the page: marks on its curves, side branches, and a table."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import BifurcationRows, BifurcationSearch, SidePoints, read
from stickslip.analyses.forced_response.summary import beside_bifurcations
from stickslip.report.cases import ShownCase
from stickslip.report.plot import MUTED, key_marker
from stickslip.report.quantities import NONE, counted, fixed, number, quantity
from stickslip.report.section import Table, Words

SYMBOLS = {
    "fold": "triangle-left",
    "period doubling": "square",
    "Neimark-Sacker": "star",
    "branch point": "cross",
    "jump of multipliers": "hourglass",
}


def mark_bifurcations(figure: go.Figure, response: Response, cases: Sequence[ShownCase], over: float) -> None:
    """Draw the bifurcations of some cases and their side branches.

    Parameters
    ----------
    figure, response
        The figure of the curves, and their response.
    cases
        The cases that the figure shows.
    over
        Abscissa of a frequency of 1 Hz.
    """
    shown = {case.index for case in cases}
    found = [(case, own) for case, own in response.rows(BifurcationRows) if case.index in shown]
    drawn = [_branches(figure, response, case, over) for case in cases] if found else []
    if any(drawn):
        figure.add_trace(key_marker("branch that leaves (dotted)", "line-ew", "bifurcations"))
    kinds = [str(own.bifurcation_kind) for _, own in found]
    for kind in SYMBOLS:
        if kind in kinds:
            figure.add_trace(
                _marks(response, kind, [own for own, k in zip(found, kinds, strict=True) if k == kind], over)
            )


def located(response: Response) -> str:
    """Return the sentence of a caption on the bifurcations of all cases; empty for none."""
    kinds = [str(own.bifurcation_kind) for _, own in response.rows(BifurcationRows)]
    if not kinds:
        return ""
    counts = [counted(kinds.count(kind), kind) for kind in SYMBOLS if kind in kinds]
    told = f" Located on the branch: {', '.join(counts)}." if counts else ""
    sides = [read(SidePoints, response.data, case.index).side_point_branch for case in response.cases]
    branches = sum(np.unique(side).size for side in sides)
    if branches:
        told += f" Dotted: {branches} that leave{'s' * (branches == 1)} there."
    return told


def _marks(response: Response, kind: str, found: list[tuple[ShownCase, BifurcationRows]], over: float) -> go.Scatter:
    factor = response.scale.factor
    return go.Scatter(
        x=np.array([float(own.bifurcation_frequency_hz) * over for _, own in found]),
        y=np.array([float(own.bifurcation_amplitude) / _divisor(response, c) * factor for c, own in found]),
        mode="markers",
        name=kind,
        legendgroup="bifurcations",
        marker={"symbol": SYMBOLS[kind], "size": 10, "color": "white", "line": {"width": 1.8, "color": MUTED}},
        customdata=[[str(own.bifurcation_sentence)] for _, own in found],
        hovertemplate="%{customdata[0]}<extra></extra>",
    )


def _branches(figure: go.Figure, response: Response, case: ShownCase, over: float) -> int:
    """Draw the branches of a case; return their number."""
    found = read(SidePoints, response.data, case.index)
    every = np.unique(found.side_point_branch)
    for branch in every:
        own = found.side_point_branch == branch
        figure.add_scatter(
            x=found.side_point_frequency_hz[own] * over,
            y=found.side_point_amplitude[own] / _divisor(response, case) * response.scale.factor,
            mode="lines",
            name="leaves the response",
            legendgroup="bifurcations",
            showlegend=False,
            line={"color": case.colour, "width": 1.4, "dash": "dot"},
            hovertemplate="%{x:.2f}: %{y:.4g}<br>a branch that leaves the response<extra></extra>",
        )
    return int(every.size)


def _divisor(response: Response, case: ShownCase) -> float:
    return case.excitation if response.per_force else 1.0


def bifurcations(response: Response) -> Table | Words | None:
    """Return a table with one row a bifurcation: frequency, kind, and the crossing multiplier."""
    if not any(read(BifurcationSearch, response.data, c.index).bifurcations_limits for c in response.cases):
        return None
    labels = [c.label for c in response.cases]
    title, lines = "Bifurcations", list(beside_bifurcations(response.data, labels))
    text = "Where multipliers of the motion cross the unit circle along the branch, or it turns back."
    found = response.rows(BifurcationRows)
    if not found:
        return Words((text,), title, lines)
    rows = [
        [
            case.short,
            str(own.bifurcation_kind),
            fixed(float(own.bifurcation_frequency_hz), 4),
            _known(float(own.bifurcation_frequency_error_hz)),
            quantity(float(own.bifurcation_amplitude), response.length),
            _complex(*own.bifurcation_multiplier),
            _known(float(own.bifurcation_multiplier_error)),
        ]
        for case, own in found
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
