"""Friction force over normal force at each contact point, through a cycle at the peak."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.at_peak.contacts import drawn_samples, state_keys
from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import MUTED, STATE_COLOURS, Plot, colour, legend_above, styled
from stickslip.report.quantities import counted, joined, number

MOST_PANELS = 8  # contacts, one panel each
MOST_POINTS = 8  # curves in a panel
OPEN = 2  # index of the state open, which gives the colour
AT_LIMIT = 0.999  # share of the friction coefficient at which a point reaches its limit


def ratios(response: Response, case: ShownCase, direction: int) -> FloatArray:
    """Return (contact, sample) T/N at the peak of a case; NaN where a contact is open or its law has no normal force.

    T has the sign of the contact force in the tables and in the loops, N is positive in compression, and no mean is removed.
    """
    force = response.periods[case.index].peak_force
    if force.shape[1] != 3:  # the result lacks normal forces
        return np.full((len(force), force.shape[-1]), np.nan)
    along, pressed = force[:, direction], -force[:, 2]
    found: FloatArray = np.divide(along, pressed, out=np.full_like(along, np.nan), where=pressed > 0.0)
    return found


def friction(response: Response, case: ShownCase) -> FloatArray:
    """Return (contact,) friction coefficients; NaN for a law without one, and in early results."""
    own = response.periods[case.index].peak_friction
    return np.full(len(response.labels("contact")), np.nan) if own is None else own


def _panels(response: Response, cases: tuple[ShownCase, ...], direction: int) -> dict[str, list[int]]:
    """Return the points of each contact that come nearest to their limit in any case."""
    with np.errstate(invalid="ignore"):
        used = [np.nan_to_num(np.abs(ratios(response, c, direction))).max(axis=1) for c in cases]
    most = np.max(used, axis=0)
    found = {}
    for group, members in response.groups.items():
        acting = sorted((k for k in members if most[k] > 0.0), key=lambda k: -most[k])[:MOST_POINTS]
        if acting:
            found[group] = sorted(acting)
    kept = sorted(found, key=lambda group: -most[found[group]].max())[:MOST_PANELS]
    return {group: points for group, points in found.items() if group in kept}


def _ratio(response: Response, direction: str) -> Plot | None:
    column = {"t": 0, "w": 1}[direction]
    cases = tuple(c for c in response.peaked if np.isfinite(ratios(response, c, column)).any())
    panels = _panels(response, cases, column) if cases else {}
    if not panels:
        return None
    figure = make_subplots(
        len(panels), 1, subplot_titles=list(panels), shared_xaxes=True, vertical_spacing=0.24 / (len(panels) + 1)
    )
    curves = len(cases) * sum(map(len, panels.values()))
    at = drawn_samples(curves, response.periods[cases[0].index].peak_force.shape[-1])
    for case in cases:
        for row, points in enumerate(panels.values(), 1):
            for trace in _traces(response, case, column, points, at):
                figure.add_trace(trace.update(meta=case.index), row=row, col=1)
    figure.add_trace(_limit_key(), row=1, col=1)
    figure.add_trace(state_keys()[OPEN], row=1, col=1)
    styled(figure, 130 + 230 * len(panels))
    legend_above(figure)
    figure.update_yaxes(title_text=f"T<sub>{direction}</sub>/N", nticks=6)
    figure.update_xaxes(range=[0, 1])
    figure.update_xaxes(title_text="time / period", row=len(panels), col=1)
    caption = f"Friction force along {direction} over normal force through one cycle, in one panel a contact; N is positive in compression. Dashed lines stand at plus and minus the friction coefficient: a point that follows one slips. A curve ends where its point opens."
    drawn, every = sum(map(len, panels.values())), len(response.labels("contact"))
    if drawn < every:
        caption += f" {drawn} of {every} points are drawn, those that come nearest to slipping along {direction}."
    captions = {c.index: _caption(response, c, column) for c in cases}
    title = f"T/N over the cycle at the peak, direction {direction}"
    return Plot(f"friction_ratio_{direction}", title, caption, figure, captions, response.chosen)


def _traces(response: Response, case: ShownCase, direction: int, points: list[int], at: slice) -> list[go.Scatter]:
    """Return the curves of one panel, their limits, and the marks where points are open."""
    whole, names, mu = ratios(response, case, direction), response.labels("contact"), friction(response, case)
    samples = whole.shape[1]
    time = (np.arange(samples) / samples)[at].astype(np.float32)
    found = []
    for k in points:
        found.append(
            go.Scatter(
                x=np.append(time, np.float32(1.0)),
                y=np.append(whole[k, at], whole[k, 0]).astype(np.float32),
                mode="lines",
                line={"color": colour(k), "width": 1.8},
                name=names[k],
                hovertemplate=f"{names[k]}<br>%{{x:.3f}} T: T/N %{{y:.4g}}<extra></extra>",
            )
        )
        where = np.isnan(whole[k, at])
        if where.any():
            mark = {
                "symbol": "square",
                "size": 5,
                "color": STATE_COLOURS[OPEN],
                "line": {"width": 1, "color": colour(k)},
            }
            found.append(
                go.Scatter(
                    x=time[where],
                    y=np.zeros(int(where.sum()), dtype=np.float32),
                    mode="markers",
                    marker=mark,
                    name=f"{names[k]} open",
                    showlegend=False,
                    hovertemplate=f"{names[k]} open at %{{x:.3f}} T<extra></extra>",
                )
            )
    for limit in np.unique(mu[points][np.isfinite(mu[points])]):
        found += [_limit(sign * float(limit)) for sign in (1, -1)]
    return found


def _limit(value: float) -> go.Scatter:
    return go.Scatter(
        x=[0, 1],
        y=[value, value],
        mode="lines",
        line={"color": MUTED, "width": 1.2, "dash": "dash"},
        name=f"{value:+.3g}",
        showlegend=False,
        hovertemplate=f"{value:+.3g}<extra></extra>",
    )


def _limit_key() -> go.Scatter:
    line = {"color": MUTED, "width": 1.2, "dash": "dash"}
    return go.Scatter(x=[None], y=[None], mode="lines", line=line, name="friction coefficient")


def _caption(response: Response, case: ShownCase, direction: int) -> str:
    own, mu, names = ratios(response, case, direction), friction(response, case), response.labels("contact")
    with np.errstate(invalid="ignore"):
        largest = np.nan_to_num(np.abs(own)).max(axis=1)
        reach = largest >= AT_LIMIT * mu
    most = int(np.argmax(largest))
    limit = f", its friction coefficient is {number(float(mu[most]))}" if np.isfinite(mu[most]) else ""
    told = [f"The largest T/N is {number(float(largest[most]))} at {names[most]}{limit}."]
    known = int((np.isfinite(mu) & (largest > 0.0)).sum())
    if known:
        told.append(f"{int(reach.sum())} of {counted(known, 'point')} reach their friction coefficient.")
    opens = np.isnan(own).any(axis=1) & (largest > 0.0)
    if opens.any():
        told.append(
            f"Open during a part of the cycle: {joined([n for n, one in zip(names, opens, strict=True) if one][:12])}."
        )
    return " ".join(told)


def friction_ratio_t(response: Response) -> Plot | None:
    """Draw T/N along the first tangent."""
    return _ratio(response, "t")


def friction_ratio_w(response: Response) -> Plot | None:
    """Draw T/N along the second tangent."""
    return _ratio(response, "w")
