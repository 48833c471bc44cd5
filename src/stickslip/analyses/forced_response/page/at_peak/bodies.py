"""Figures of rigid bodies at the peak, and of the energy dissipated by contacts."""

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.curves import abscissa
from stickslip.analyses.forced_response.page.many_cases import FEW, extremes
from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import Plot, colour, legend_above, log_ticks, styled
from stickslip.report.quantities import Scale, number, percent, quantity, scale_for
from stickslip.report.section import Words
from stickslip.study.file.case_names import CASE

_DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
ENERGY = "Energy dissipated in a cycle"
_STILL = "At the peak nothing is dissipated: no point slips."
_NO_POINT = "No point dissipates energy at any frequency."
_NOTHING = 1e-12  # J a cycle: rounding error of newtons times micrometres
_STAYS = 1e-6  # mean position along an axis over the largest one or the motion, below which it is rounding
_AXIS_LINES = (
    {"color": "#0072b2", "dash": "solid", "width": 2},
    {"color": "#d55e00", "dash": "dash", "width": 2},
    {"color": "#009e73", "dash": "dot", "width": 2},
)


def rigid_bodies(response: Response) -> dict[str, list[int]]:
    """Return the bodies with all six coordinates retained: name -> positions along ``retained``."""
    labels = response.labels("retained")
    place = {label: k for k, label in enumerate(labels)}
    names = dict.fromkeys(label.rpartition(".")[0] for label in labels)
    found = {n: [place.get(f"{n}.{d}", -1) for d in _DIRECTIONS] for n in names if n}
    return {n: at for n, at in found.items() if min(at) >= 0}


def body_motion(response: Response, case: ShownCase, at: list[int], samples: int = 96) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates of a rigid body over one period at the peak.

    Parameters
    ----------
    response, case
        The response, and the index of the case.
    at
        Positions of x, y, z, rx, ry, rz along ``retained``.
    samples
        Number of samples a period.

    Returns
    -------
    mean
        (6,) static part: metres and radians.
    motion
        (6, samples + 1) motion about it.
    """
    parts = response.fields.retained_displacement[response.peak(case)][:, at]
    coefficients = np.nan_to_num(parts[..., 0] + 1j * parts[..., 1])
    harmonic = np.asarray(response.data["harmonic"].values, dtype=np.float64)[1:]
    wave = np.exp(2j * np.pi * harmonic[:, None] * np.arange(samples + 1) / samples)
    return coefficients[0].real, np.real(coefficients[1:].T @ wave)


def _caption(response: Response, case: ShownCase, at: list[int]) -> str:
    mean, motion = body_motion(response, case, at)
    largest = np.ptp(motion, axis=1) / 2
    move, turn = int(np.argmax(largest[:3])), int(np.argmax(largest[3:]))
    seen = np.where(np.abs(mean[:3]) > _STAYS * max(np.abs(mean[:3]).max(), largest[move]), mean[:3], 0.0)
    means = ", ".join(f"{c} {quantity(float(m), 'm')}" for c, m in zip("xyz", seen, strict=True))
    return (
        f"Largest translation {quantity(float(largest[move]), 'm')} along {'xyz'[move]}, largest rotation "
        f"{quantity(float(largest[3 + turn]), 'rad')} about {'xyz'[turn]} (half of peak to peak). Mean position, taken "
        f"out of the curves: {means}."
    )


def _traces(figure: go.Figure, case: ShownCase, motion: FloatArray, angle: Scale, orbit: tuple[int, int]) -> None:
    """Add translation, rotation and orbit of one case."""
    time = np.linspace(0, 1, motion.shape[1])
    for name, line, move, turn in zip("xyz", _AXIS_LINES, motion[:3], motion[3:], strict=True):
        drawn = go.Scatter(x=time, name=name, mode="lines", line=line, legendgroup=name, meta=case.index)
        figure.add_trace(go.Scatter(drawn, y=move * 1e6), 1, 1)
        figure.add_trace(go.Scatter(drawn, y=turn * angle.factor, showlegend=False), 1, 2)
    x, y = (motion[k] * 1e6 for k in orbit)
    line = {"color": case.colour, "width": 2}
    path = go.Scatter(x=x, y=y, mode="lines", line=line, name="orbit", meta=case.index)
    figure.add_trace(path.update(showlegend=False), 1, 3)


def _body(response: Response, name: str, at: list[int]) -> Plot:
    motions = {c: body_motion(response, c, at)[1] for c in response.peaked}
    angle = scale_for(np.concatenate([m[3:].ravel() for m in motions.values()]), "rad")
    # the plane in which the body moves most
    sizes = np.max([np.ptp(m[:3], axis=1) for m in motions.values()], axis=0)
    first, second = sorted(np.argsort(-sizes, kind="stable")[:2].tolist())
    titles = ("translation", "rotation", f"orbit in the {'xyz'[first]}–{'xyz'[second]} plane")
    figure = make_subplots(1, 3, horizontal_spacing=0.1, subplot_titles=titles)
    for case, motion in motions.items():
        _traces(figure, case, motion, angle, (first, second))
    styled(figure, 380)
    legend_above(figure)
    for column, unit in ((1, "µm"), (2, angle.unit)):
        figure.update_xaxes(title_text="time / period", col=column)
        figure.update_yaxes(title_text=f"motion about the mean ({unit})", col=column)
    figure.update_xaxes(title_text=f"{'xyz'[first]} (µm)", col=3)
    figure.update_yaxes(title_text=f"{'xyz'[second]} (µm)", scaleanchor="x3", constrain="domain", col=3)
    caption = f"Rigid-body motion of {name} about its mean position, in the axes of the model."
    captions = {c.index: _caption(response, c, at) for c in response.peaked}
    title = f"Motion of {name} at the peak"
    return Plot(f"motion_{name}", title, caption, figure, captions, response.chosen)


def bodies(response: Response) -> list[Plot]:
    """Draw the motion of each rigid body over one period at the peak, and its orbit."""
    if not response.peaked or not np.isfinite(response.fields.retained_displacement).any():
        return []
    return [_body(response, name, at) for name, at in rigid_bodies(response).items()]


def group_colours(response: Response) -> dict[str, str]:
    """Return the CSS colour of each contact of the model."""
    return {name: colour(k) for k, name in enumerate(response.groups)}


def _energy_caption(response: Response, case: ShownCase) -> str:
    names = response.labels("contact")
    energy = response.fields.dissipated_energy[response.peak(case)]
    total = float(np.nansum(energy))
    if total <= _NOTHING:
        return _STILL
    most = int(np.nanargmax(energy))
    text = f"At the peak {quantity(total, 'J')} are lost in a cycle by the contacts{response.of_sector}, {percent(100 * float(energy[most]) / total)} of it at {names[most]}"
    shares = {g: 100 * float(np.nansum(energy[at])) / total for g, at in response.groups.items()}
    largest = max(shares, key=lambda g: shares[g])
    return text + (
        f"; {largest} takes {percent(shares[largest])}."
        if len(response.groups[largest]) > 1 and len(shares) > 1
        else "."
    )


def _energy_traces(figure: go.Figure, response: Response, values: FloatArray, total: FloatArray) -> None:
    """Add bars at the peak (left) and curves against frequency (right) of all cases."""
    names, colours = response.labels("contact"), group_colours(response)
    bars = {group: (colours[group], [names[k] for k in at], at) for group, at in response.groups.items()}
    for case in response.cases:
        peak = response.peak(case)
        for group, (bar, x, members) in bars.items() if peak >= 0 else ():
            figure.add_bar(
                x=x,
                y=values[peak, members],
                marker_color=bar,
                meta=case.index,
                name=group,
                legendgroup=group,
                showlegend=False,
                hovertemplate="%{x}: %{y:.3g}<extra></extra>",
                row=1,
                col=1,
            )
        if peak >= 0 and not np.nansum(np.abs(values[peak])):  # else the panel of this case would be blank
            said = {"x": [names[len(names) // 2]], "y": [0.5], "text": ["nothing is dissipated"], "mode": "text"}
            figure.add_scatter(**said, meta=case.index, showlegend=False, hoverinfo="skip", row=1, col=1)
    named = response.cases if len(response.cases) <= FEW else extremes(response)
    for case in named:
        at, line = response.points(case), {"color": case.colour, "width": 1.6}
        y = np.where(total[at] > 0, total[at], np.nan)
        curve = go.Scatter(x=abscissa(response)[0][at], y=y, mode="lines", name=case.short, line=line)
        figure.add_trace(curve.update(showlegend=len(response.cases) > 1), 1, 2)


def energy(response: Response) -> Plot | Words | None:
    """Draw the energy dissipated per cycle: by contact at the peak, in total against frequency; a sentence if there is none."""
    values = response.fields.dissipated_energy
    if not np.isfinite(values).any():
        return None
    total = np.where(response.converged, np.nansum(values, axis=1), np.nan)
    total = np.where(total < _NOTHING, 0.0, total)
    if not np.any(total > 0.0):  # no empty axes
        return Words([_STILL, _NO_POINT], ENERGY) if np.isfinite(total).any() else None
    values = np.where(np.abs(values) < _NOTHING, 0.0, values)
    bars, sums = scale_for(values, "J"), scale_for(total, "J")
    _, over, unit = abscissa(response)
    titles = ("at the peak, by contact point", f"all contacts, against {over}")
    figure = make_subplots(1, 2, horizontal_spacing=0.12, subplot_titles=titles)
    _energy_traces(figure, response, values * bars.factor, total * sums.factor)
    styled(figure, 400, legend_title=CASE)
    figure.update_yaxes(title_text=f"energy ({bars.unit})", rangemode="tozero", col=1)
    drawn = total[np.isfinite(total) & (total > 0)] * sums.factor
    if drawn.size:
        top = float(drawn.max())
        span = [np.log10(max(top * 1e-6, float(drawn.min()) / 1.5)), np.log10(1.6 * top)]
        figure.update_yaxes(type="log", range=span, **log_ticks(drawn), col=2)
    figure.update_yaxes(title_text=f"energy ({sums.unit})", col=2)
    figure.update_xaxes(title_text=f"{over} ({unit})", col=2)
    key = Markup(", ").join(
        Markup('<b style="color:{}">{}</b>').format(c, g) for g, c in group_colours(response).items()
    )
    named = "" if len(response.cases) <= FEW else "Right: the smallest, the middle and the largest peak. "
    told = Markup("Work of the friction forces in one cycle. Left: coloured by contact ({}). {}{}")
    caption = told.format(key, named, _widest_range(response, total))
    captions = {c.index: _energy_caption(response, c) for c in response.peaked}
    return Plot("energy", ENERGY, caption, figure, captions, response.chosen)


def _widest_range(response: Response, total: FloatArray) -> str:
    """Name the case in which friction dissipates over the widest range."""
    x, _, unit = abscissa(response)
    widths = []
    for case in response.cases:
        at = response.points(case)
        lossy = x[at][np.nan_to_num(total[at]) > 0.01 * np.nanmax(np.append(total[at], 0.0))]
        widths.append(float(np.ptp(lossy)) if lossy.size else 0.0)
    if not any(widths):  # a single point in each case
        return ""
    widest = int(np.argmax(widths))
    return (
        f"Friction acts over the widest range, {number(widths[widest])} {unit} with more than a hundredth of the case's "
        f"maximum{',' if response.cases[widest].where else ''}{response.cases[widest].where}."
    )
