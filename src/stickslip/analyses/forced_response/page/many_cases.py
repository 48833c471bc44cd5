"""Studies of more cases than a panel can name: panels that share a scale, a map of all peaks, parallel axes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase, families_of, first_number
from stickslip.report.plot import COLOURS, Plot, log_ticks, ramp, styled
from stickslip.report.quantities import Scale, number, scale_for
from stickslip.study.coordinates import as_number, naming_of, varied_values
from stickslip.study.file.case_names import Naming, without_common_words

FEW = 8  # largest number of cases in the legend of a panel
MOST_PANELS = 12
MOST_IN_PANELS = 30  # cases; of more cases, three are named
MOST_ROWS = 40  # rows of a map with one row a curve
_COLOURS = (COLOURS[2], COLOURS[0], COLOURS[1])  # for the smallest, the middle and the largest peak
_SCALE = [
    [0.0, "#f3f6fa"],
    [0.35, "#a9c6e2"],
    [0.7, "#3b7db8"],
    [1.0, "#0b2a57"],
]  # from the smallest peak to the largest
_LINES = [[0.0, "#009e73"], [0.5, "#5b6673"], [1.0, "#d55e00"]]
_FEW_COLUMNS = 12  # largest number of columns of a map with numbers in its cells
_ROW_HEIGHT, _AROUND = 26, 150  # px of a map


@dataclass(frozen=True)
class Panel:
    """Cases that share a panel.

    Parameters
    ----------
    title
        Common values of these cases; empty for a single panel.
    cases
        The cases, each with its colour.
    names
        The name of each case in the legend.
    """

    title: str
    cases: tuple[ShownCase, ...]
    names: tuple[str, ...]


def panels(response: Response) -> tuple[Panel, ...]:
    """Return the panels of the curves of all cases: one for up to `FEW`, else one for each curve over the first number.

    Empty if there would be too many panels or cases; `extremes` then chooses three cases.
    """
    cases = response.cases
    if len(cases) <= FEW:
        return (Panel("", cases, tuple(c.short for c in cases)),)
    key = first_number(response.data)[0]
    curves: Mapping[str, Sequence[ShownCase]] = families_of(response.data, key, cases)
    if 2 * len(curves) > len(cases):  # texts, or values that hardly recur: the cases form no curves
        curves = {"": cases}
    found = [_panel(name, part) for name, family in curves.items() for part in _parts(family)]
    return _coloured(found) if len(found) <= MOST_PANELS and len(cases) <= MOST_IN_PANELS else ()


def _parts(family: Sequence[ShownCase]) -> list[Sequence[ShownCase]]:
    """Cut a long family into parts of about equal length."""
    n = -(-len(family) // FEW)
    ends = [round(k * len(family) / n) for k in range(n + 1)]
    return [family[a:b] for a, b in pairwise(ends)]


def _panel(name: str, cases: Sequence[ShownCase]) -> Panel:
    own = tuple(_without(case.short, name) for case in cases)
    title = name or (f"{own[0]} to {own[-1]}" if len(own) > 1 else own[0])
    return Panel(title, tuple(cases), own)


def _coloured(found: Sequence[Panel]) -> tuple[Panel, ...]:
    """Give cases with the same name in several panels the same colour."""
    names = list(dict.fromkeys(name for panel in found for name in panel.names))
    if len(names) > FEW:
        return tuple(found)
    colours = dict(zip(names, ramp(len(names)), strict=True))
    return tuple(
        replace(p, cases=tuple(replace(c, colour=colours[n]) for c, n in zip(p.cases, p.names, strict=True)))
        for p in found
    )


def _without(name: str, shared: str) -> str:
    """Return the parts of a name that are not shared."""
    left = name.split(", ")
    for part in shared.split(", ") if shared else ():
        if part in left:
            left.remove(part)
    return ", ".join(left) or name


def extremes(response: Response) -> tuple[ShownCase, ...]:
    """Return the cases with the smallest, the middle and the largest peak, in three colours."""
    known = sorted((c for c in response.peaked if np.isfinite(response.peak_response(c))), key=response.peak_response)
    chosen = [known[k] for k in sorted({0, len(known) // 2, len(known) - 1})] if known else []
    return tuple(replace(c, colour=colour) for c, colour in zip(chosen, _COLOURS[-len(chosen) :], strict=True))


def all_peaks(response: Response, key: str, curves: Mapping[str, Sequence[ShownCase]], caption: str) -> Plot:
    """Draw the peaks of all cases: as a map with one row a curve over the first number, or on parallel axes where few values recur.

    Parameters
    ----------
    response
        The response.
    key
        First varied number.
    curves
        Cases with a peak, by curve.
    caption
        Description of the figure.
    """
    cases = [case for curve in curves.values() for case in curve]
    columns = sorted({case.value for case in cases})
    scale = scale_for(np.array([response.peak_response(c) for c in cases]), response.unit)
    if len(curves) <= MOST_ROWS and 2 * len(cases) >= len(curves) * len(columns):
        figure = _map(response, curves, columns, scale, naming_of(response.data, key))
        about = f"Peak {response.quantity} in {scale.unit}. {_ABOUT_MAP}"
        return Plot("optimisation", "Peaks of all cases", f"{about}{caption}", figure)
    return Plot("optimisation", "Peaks of all cases", f"{_ABOUT_AXES}{caption}", _parallel(response, cases, scale))


_ABOUT_MAP = (
    "The darker, the larger the peak; a frame marks the smallest one, a question mark a peak that is not trusted. "
)
_ABOUT_AXES = "Each line is a case. Drag along an axis to choose a range of it. "


def _bar(scale: Scale, response: Response, drawn: FloatArray) -> dict[str, object]:
    """Return the colour bar for logarithms of peaks."""
    ticks = log_ticks(drawn)
    at = np.array(ticks.get("tickvals", []), dtype=float)
    inside = (at >= drawn.min()) & (at <= drawn.max())
    texts = np.array(ticks.get("ticktext", []), dtype=object)[inside].tolist()
    title = {"text": f"peak {response.quantity} ({scale.unit})", "side": "right"}
    return {"title": title, "tickvals": np.log10(at[inside]).tolist(), "ticktext": texts, "thickness": 14}


def _map(
    response: Response,
    curves: Mapping[str, Sequence[ShownCase]],
    columns: Sequence[float],
    scale: Scale,
    naming: Naming,
) -> go.Figure:
    size = np.full((len(curves), len(columns)), np.nan)
    marks = np.full(size.shape, "", dtype=object)
    told = np.full((*size.shape, 2), "", dtype=object)
    for row, curve in enumerate(curves.values()):
        for case in curve:
            at = row, columns.index(case.value)
            size[at] = response.peak_response(case) * scale.factor
            marks[at] = "?" * bool(response.trust(case))
            told[at] = case.named, f"{response.place(case)}{f', {response.level(case)}' * bool(response.trust(case))}"
    texts = [
        [f"{number(float(v), 3)}{mark}" if np.isfinite(v) else "" for v, mark in zip(*row, strict=True)]
        for row in zip(size, marks, strict=True)
    ]
    title, y = without_common_words(list(curves))
    numbered = len(columns) <= _FEW_COLUMNS  # a colour bar beside the numbers would only take their place
    figure = go.Figure(
        go.Heatmap(
            x=[number(naming.shown(v), 4) for v in columns],
            y=y,
            z=np.log10(size),
            text=texts,
            texttemplate="%{text}" if numbered else None,
            customdata=told,
            hovertemplate=f"%{{customdata[0]}}<br>%{{text}} {scale.unit} at %{{customdata[1]}}<extra></extra>",
            colorscale=_SCALE,
            colorbar=_bar(scale, response, size[np.isfinite(size)]),
            showscale=not numbered,
            xgap=1,
            ygap=1,
        )
    )
    row, column = divmod(int(np.nanargmin(size)), len(columns))
    corners = {"x0": column - 0.5, "x1": column + 0.5, "y0": row - 0.5, "y1": row + 0.5}
    figure.add_shape(type="rect", **corners, line={"color": COLOURS[1], "width": 2.4})
    styled(figure, _AROUND + _ROW_HEIGHT * len(y))
    figure.update_xaxes(type="category", showgrid=False, title_text=naming.title)
    figure.update_yaxes(type="category", showgrid=False, autorange="reversed", title_text=title)
    return figure


def _parallel(response: Response, cases: Sequence[ShownCase], scale: Scale) -> go.Figure:
    keys, values = varied_values(response.data)
    peak = np.array([response.peak_response(c) for c in cases]) * scale.factor
    own = values[[c.index for c in cases]]
    axes = [_axis(naming_of(response.data, key), own[:, k]) for k, key in enumerate(keys) if len(set(own[:, k])) > 1]
    axes.append({"label": f"peak ({scale.unit})", "values": peak})
    axes.append({"label": "at (Hz)", "values": np.array([response.peak_hz(c) for c in cases])})
    line = {"color": np.log10(peak), "colorscale": _LINES, "showscale": True, "colorbar": _bar(scale, response, peak)}
    figure = styled(go.Figure(go.Parcoords(dimensions=axes, line=line, labelfont={"size": 12})), 500)
    figure.update_layout(margin={"l": 70, "r": 70, "t": 60, "b": 30})
    return figure


def _axis(naming: Naming, values: FloatArray) -> dict[str, object]:
    """Return one of the parallel axes: numbers in the unit of the names, texts evenly spaced."""
    numbers = np.array([as_number(v) for v in values])
    if np.isfinite(numbers).all():
        return {"label": naming.title, "values": np.array([naming.shown(v) for v in numbers])}
    texts = list(dict.fromkeys(map(str, values)))
    at = np.array([texts.index(str(v)) for v in values])
    return {"label": naming.title, "values": at, "tickvals": list(range(len(texts))), "ticktext": texts}
