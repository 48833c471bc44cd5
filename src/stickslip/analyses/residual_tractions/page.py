"""Residual tractions: bounds of the amplitude over frequency and of the resonance, also as bands on the figures of the forced response."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from stickslip.analyses.columns import CaseView
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.residual_tractions.records import ConfirmedEnd, ResidualTractions
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import COLOURS, INK, Plot, log_ticks, styled
from stickslip.report.quantities import NONE, number, percent, quantity, scale_for
from stickslip.report.section import Block, Card, Section, Table
from stickslip.study.file.case_names import Naming

ANALYSIS = "residual_tractions"
# variables that a forced response takes over, and the beginning of their names there
_TAKEN = ("frequency_hz", "least_amplitude", "most_amplitude", "resonance_hz", "resonance_amplitude", "harmonics")
_PREFIX = "traction_"
_OPACITY = 0.22  # of a band in the colour of its case
_NAMES = ("own start", "smallest", "largest")
_EQUAL = 1e-6  # relative difference of equal bounds


def has_width(least: FloatArray, most: FloatArray) -> bool:
    """Whether bounds differ anywhere by more than rounding."""
    known = np.isfinite(least) & np.isfinite(most)
    return bool(np.any(most[known] - least[known] > _EQUAL * np.abs(least[known])))


class Tractions(CaseView[ResidualTractions]):
    """One case."""

    kind = ResidualTractions

    @property
    def least(self) -> FloatArray:
        """Smallest amplitude at each frequency, m."""
        return np.array([point.least_amplitude for point in self.found.points])

    @property
    def most(self) -> FloatArray:
        """Largest amplitude at each frequency, m."""
        return np.array([point.most_amplitude for point in self.found.points])


def band(view: Tractions) -> Plot | None:
    """Draw the smallest and the largest amplitude at each frequency."""
    points, least, most = view.found.points, view.least, view.most
    if not points:
        return None
    hertz = np.array([point.frequency_hz for point in points])
    scale = scale_for(np.concatenate([least, most]), "m")
    figure = go.Figure()
    edge = {"mode": "lines", "line": {"color": COLOURS[0], "width": 1}}
    hover = f"%{{y:.4g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>"
    wide = has_width(least, most)
    if wide:
        figure.add_scatter(x=hertz, y=scale.factor * least, name="smallest", hovertemplate=hover, **edge)
        figure.add_scatter(
            x=hertz,
            y=scale.factor * most,
            name="largest",
            fill="tonexty",
            fillcolor="rgba(0,114,178,0.25)",
            hovertemplate=hover,
            **edge,
        )
    figure.add_scatter(
        x=hertz,
        y=scale.factor * np.array([point.reference_amplitude for point in points]),
        name="own start" if wide else "amplitude",
        mode="lines+markers",
        marker={"size": 5},
        line={"color": INK, "width": 1.4},
        hovertemplate=hover,
    )
    if _open_resonance(view):
        figure.add_scatter(
            x=np.array([top.frequency_hz for top in view.found.resonances[1:]]),
            y=scale.factor * np.array([top.amplitude for top in view.found.resonances[1:]]),
            name="bounds of the resonance",
            mode="markers",
            marker={"symbol": "diamond", "size": 10, "color": COLOURS[1]},
            hovertemplate=hover,
        )
    styled(figure, 480)
    figure.update_xaxes(title_text="frequency (Hz)")
    ticks = log_ticks(scale.factor * np.concatenate([least, most]))
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", type="log", **ticks)
    return Plot(f"residual_tractions{view.key}", "What residual tractions leave open", _caption(view), figure)


def _caption(view: Tractions) -> str:
    least, most, points = view.least, view.most, view.found.points
    text = (
        f"Amplitude of {view.found.output}, H = {view.found.harmonics}: a contact that sticks keeps a traction from before, "
        "and every one within the friction cone is a steady motion. "
    )
    if any(point.branches > 1 for point in points):
        text += "Where the own start has several motions, the band holds all that sweeps up and down met. "
    if not has_width(least, most):
        return text + "The bounds are equal at all frequencies: the answer is unique."
    width = most / least - 1
    at = int(np.nanargmax(width))
    hertz = number(points[at].frequency_hz, 5)
    return (
        text
        + f"The band is widest at {hertz} Hz, {percent(100 * float(width[at]))}. Bounds are found motions; the true band is at least as wide."
    )


def _open_resonance(view: Tractions) -> bool:
    """Whether the resonance has bounds that differ."""
    if not view.found.resonances:
        return False
    _, least, most = (top.amplitude for top in view.found.resonances)
    return has_width(np.atleast_1d(least), np.atleast_1d(most))


def resonances(view: Tractions) -> Table | None:
    """Return a table of the bounds of the resonance, with their check by time integration."""
    tops, ends = view.found.resonances, (None, *view.found.ends) if view.found.ends else (None,) * 3
    if not tops:
        return None
    equal = () if _open_resonance(view) else ("The bounds are equal.",)
    rows = [
        [
            name,
            quantity(top.amplitude, "m"),
            percent(100 * (top.amplitude / tops[0].amplitude - 1)) if top is not tops[0] else "",
            number(top.frequency_hz, 6),
            *_in_time(end),
        ]
        for name, top, end in zip(_NAMES, tops, ends, strict=True)
    ]
    head = ["resonance", "amplitude", "against own start", "at (Hz)", "solved again", "in time", ""]
    return Table(head, rows, "Bounds of the resonance", equal)


def _in_time(end: ConfirmedEnd | None) -> tuple[str, str, str]:
    """Return the amplitudes solved again and in time, and whether they confirm the bound."""
    if end is None:
        return NONE, NONE, ""
    words = ("left in time", "confirmed") if end.time_status else ("not found again", "confirmed, not in time")
    return quantity(end.resolved_amplitude, "m"), quantity(end.time_amplitude, "m"), words[end.confirmed]


def _cards(view: Tractions) -> list[Card]:
    if not _open_resonance(view):
        return []
    own, least, most = (top.amplitude for top in view.found.resonances)
    text = f"{percent(100 * (least / own - 1))} to {percent(100 * (most / own - 1))}"
    return [Card(text, "resonance by residual tractions", f"own start {quantity(own, 'm')}")]


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


def _has_bands(response: Response) -> bool:
    return response.has(f"{_PREFIX}resonance_amplitude") and not response.mistuned


def _per_force(response: Response, case: ShownCase) -> float:
    return 1.0 / case.excitation if response.per_force else 1.0


def _bound(response: Response, case: ShownCase, name: str) -> FloatArray:
    return np.asarray(response.data[f"{_PREFIX}{name}"].values[case.index], dtype=float)


def draw_bands(figure: go.Figure, response: Response, cases: Sequence[ShownCase]) -> str:
    """Draw the band of each of the cases behind its curve; return the sentence for the caption, empty for none."""
    if not _has_bands(response) or response.has("speed_rpm"):
        return ""
    drawn = False
    for case in cases:
        hertz, least, most = (
            _bound(response, case, name) for name in ("frequency_hz", "least_amplitude", "most_amplitude")
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
    if not _has_bands(response):
        return ""
    bounds = np.array([_bound(response, c, "resonance_amplitude") * _per_force(response, c) for c in cases])
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


_BLOCK = Block(ANALYSIS, "Residual tractions", (band, resonances))
SECTION: Section = Section(ANALYSIS, ("frequency_hz",), Tractions, (_BLOCK,), by_case=True, cards=_cards)
