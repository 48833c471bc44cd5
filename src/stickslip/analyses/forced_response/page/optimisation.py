"""Optimisation curves: peaks over the first varied number, measured peaks, and the values at which friction works."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.many_cases import FEW, all_peaks
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.verdicts.working_range import MIN_PEAKS, TITLE, range_lines, working_ranges
from stickslip.analyses.residual_tractions.page import draw_peak_bands
from stickslip.arrays import BoolArray, FloatArray
from stickslip.model.readers.measured_columns import same
from stickslip.report.cases import ShownCase, families_of, first_number
from stickslip.report.plot import GRID, INK, MUTED, Plot, log_ticks, ramp, styled
from stickslip.report.quantities import Scale, counted, joined, number, percent, scale_for
from stickslip.report.section import Words
from stickslip.study.coordinates import naming_of
from stickslip.study.file.case_names import Naming

SURE = {"standard deviation": 2.0, "half-width": 1.0}  # error bars within which computed and measured peaks agree
WITHIN = {"standard deviation": "two standard deviations", "half-width": "the half-width"}
_SYMBOLS = ("diamond-open", "square-open", "triangle-up-open", "cross-open", "star-open")
_LOWEST = 0.99  # longest downward error bar on a logarithmic axis, as a share of the value


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured peaks in the units of the page.

    Parameters
    ----------
    response
        The response with the computed peaks.
    values
        (n,) values of the varied key on the abscissa.
    others
        (n,) other varied keys with their values, as text; empty if unknown.
    amplitude, amplitude_error
        (n,) in the unit of `Response.peak_response`; NaN if unknown.
    hz, hz_error
        (n,) peak frequency, Hz.
    """

    response: Response
    values: FloatArray
    others: tuple[str, ...]
    amplitude: FloatArray
    amplitude_error: FloatArray
    hz: FloatArray
    hz_error: FloatArray

    @property
    def ends(self) -> FloatArray:
        """Amplitudes and upper ends of their error bars, for the range of an axis."""
        found = np.concatenate([self.amplitude, self.amplitude + np.nan_to_num(self.amplitude_error)])
        return np.asarray(found[np.isfinite(found)])

    def draw(self, figure: go.Figure, scale: Scale, naming: Naming) -> None:
        """Draw the points with error bars into both panels, one symbol for each value of the other varied keys."""
        figure.update_layout(legend_groupclick="togglegroup")
        of_amplitude = (self.amplitude * scale.factor, self.amplitude_error * scale.factor)
        for k, name in enumerate(dict.fromkeys(self.others)):
            at = np.array([other == name for other in self.others])
            for row, unit, (y, error) in ((1, scale.unit, of_amplitude), (2, "Hz", (self.hz, self.hz_error))):
                barred = np.isfinite(error)
                for own in (at & np.isfinite(y) & barred, at & np.isfinite(y) & ~barred):
                    if own.any():
                        points = self._points(own, y, error, unit)
                        points.x = [naming.shown(v) for v in self.values[own]]
                        label = ", ".join(filter(None, ["measured", name]))
                        told = any(t.legendgroup == f"measured{k}" for t in figure.data)
                        points.update(name=label, legendgroup=f"measured{k}", showlegend=not told)
                        points.marker.symbol = _SYMBOLS[k % len(_SYMBOLS)]
                        figure.add_trace(points, row=row, col=1)

    def _points(self, own: BoolArray, y: FloatArray, error: FloatArray, unit: str) -> go.Scatter:
        """Return a trace of points, either all with error bars or all without."""
        source = self.response.text("measured_source")
        points = go.Scatter(
            y=y[own],
            mode="markers",
            text=[source] * int(own.sum()),
            marker={"size": 9, "color": INK, "line": {"width": 1.6}},
            hovertemplate=f"measured, %{{x:.4g}}<br>%{{y:.4g}} {unit}<br>%{{text}}<extra></extra>",
        )
        if np.isfinite(error[own]).any():
            down = np.minimum(error[own], _LOWEST * y[own])
            points.error_y = {"array": error[own], "arrayminus": down, "thickness": 1.4, "width": 5}
        return points

    def caption(self, cases: Sequence[ShownCase]) -> str:
        """State the source of the points, the meaning of their bars, and the number of computed peaks that agree."""
        source = self.response.text("measured_source")
        of = f" from {source}" if source else ""
        n = counted(len(self.values), "point")
        text = f" Measured: {n}{of} (`{self.response.text('measured_file')}`)"
        bars = [
            f"{kind} of {what}"
            for what, name in (("amplitudes", "measured_amplitude"), ("frequencies", "measured_frequency_hz"))
            if (kind := self._bar(name))
        ]
        text += f"; bars: {joined(bars)}." if bars else ", without error bars."
        return text + self._agreement(cases)

    def _bar(self, name: str) -> str:
        found = self.response.data.get(f"{name}_error")
        return "" if found is None else str(found.attrs.get("error", ""))

    def _agreement(self, cases: Sequence[ShownCase]) -> str:
        """Compare computed and measured peaks at common values."""
        pairs = [(i, self._case(i, cases)) for i in range(len(self.values))]
        found = []
        for name, what, y, error, computed in (
            ("measured_amplitude", "amplitudes", self.amplitude, self.amplitude_error, self.response.peak_response),
            ("measured_frequency_hz", "frequencies", self.hz, self.hz_error, self.response.peak_hz),
        ):
            both = [(y[i], error[i], computed(c)) for i, c in pairs if c is not None and np.isfinite(y[i])]
            if not both:
                continue
            tested, bars, made = np.array(both).T
            worst = int(np.argmax(np.abs(made / tested - 1)))
            said = f"{what} by up to {percent(100 * abs(made[worst] / tested[worst] - 1))}"
            barred = np.isfinite(bars)
            if barred.any():
                kind = self._bar(name)
                inside = int(np.sum(np.abs(made - tested)[barred] <= SURE[kind] * bars[barred]))
                said += f" ({inside} of {int(barred.sum())} within {WITHIN[kind]})"
            found.append(said)
        return f" Where both are known they differ in {joined(found)}." if found else ""

    def _case(self, point: int, cases: Sequence[ShownCase]) -> ShownCase | None:
        """Return the only case that agrees with a measured point."""
        found = [c for c in cases if same(self.values[point], c.value) and _agrees(self.others[point], c)]
        return found[0] if len(found) == 1 else None


def measured_of(response: Response, key: str) -> Measured | None:
    """Return the measurements over the abscissa of the curves; None for none."""
    if not response.has("measured_value") or response.text("measured_key") != key:
        return None
    values = response.values("measured_value")
    nothing = np.full(values.size, np.nan)

    def known(name: str) -> FloatArray:
        return response.values(name) if response.has(name) else nothing

    others = response.labels_of("measured_others")
    factor = _per_page(response, values)
    return Measured(
        response=response,
        values=values,
        others=others,
        amplitude=known("measured_amplitude") * factor,
        amplitude_error=known("measured_amplitude_error") * factor,
        hz=known("measured_frequency_hz"),
        hz_error=known("measured_frequency_hz_error"),
    )


def _per_page(response: Response, values: FloatArray) -> FloatArray:
    """Return (n,) factors from measured amplitudes to the unit of the page; NaN if the force is unknown."""
    measured = response.data.get("measured_amplitude")
    per_force = measured is not None and measured.attrs.get("units") == "m/N"
    if per_force == response.per_force:
        return np.ones(values.size)
    force = response.values("measured_excitation_n")
    return 1 / force if response.per_force else force


def _agrees(others: str, case: ShownCase) -> bool:
    """Return whether a case has the same other varied values as a measured point."""
    return not others or set(others.split(", ")) <= set(case.assigned)


def where_friction_works(response: Response) -> Words | None:
    """State the values at which all contacts stick, friction works, or contacts slide freely."""
    lines = range_lines(response.data)
    if not lines:
        return None
    return Words(heading=TITLE, items=lines)


def what_is_needed(response: Response) -> Words | None:
    """State the values missing for an optimisation curve, if a number is varied with too few of them."""
    key, n = first_number(response.data)[0], len(response.cases)
    if not key or n >= MIN_PEAKS:
        return None
    text = f"Curves over {naming_of(response.data, key).title}, and where friction works, need {MIN_PEAKS} values or more; there are {n}. Add values to [vary]."
    return Words((text,))


def shade_working_range(figure: go.Figure, response: Response, *, logarithmic: bool) -> str:
    """Shade the values at which friction works; return the sentence for the caption, empty for none."""
    ranges = working_ranges(response.data)
    stretches = ranges[0].stretches if len(ranges) == 1 and ranges[0].judged else []
    if not stretches:
        return ""
    naming = ranges[0].naming
    values = np.unique([naming.shown(p.value) for p in ranges[0].peaks])
    middles = np.sqrt(values[1:] * values[:-1]) if logarithmic else (values[1:] + values[:-1]) / 2
    edges = np.array([values[0], *middles, values[-1]])
    for stretch in stretches:
        at = np.searchsorted(values, sorted(naming.shown(p.value) for p in stretch))
        figure.add_vrect(
            x0=float(edges[at[0]]),
            x1=float(edges[at[-1] + 1]),
            fillcolor=GRID,
            opacity=0.6,
            line_width=0,
            layer="below",
        )
    return " Shaded, to halfway to the neighbouring cases: where friction works."


def _optimum_caption(response: Response, cases: list[ShownCase]) -> str:
    peak, hz = ([of(c) for c in cases] for of in (response.peak_response, response.peak_hz))
    within = [response.resonates(c) for c in cases]
    best = int(np.argmin(np.where(within, peak, np.inf) if any(within) else peak))
    text = (
        f"Among the cases computed the peak is smallest{cases[best].where}: "
        f"{percent(100 * peak[best] / max(peak))} of the largest one. "
    )
    if best in (0, len(peak) - 1):
        text += "No value beyond it was computed: the optimum may lie there. "
    if not all(within):
        ends = joined([c.label for c, inside in zip(cases, within, strict=True) if not inside])
        text += f"At {ends} the largest amplitude stands at the end of the sweep, which is no resonance. "
    known = [k for k, inside in enumerate(within) if inside]
    if len(known) < 2:
        return text
    a, b = known[0], known[-1]
    return text + (
        f"Between the values the peak moves by {number(abs(hz[b] - hz[a]))} Hz, "
        f"from {number(hz[a], 5)} Hz{cases[a].where} to {number(hz[b], 5)} Hz{cases[b].where}."
    )


def optimisation(response: Response) -> Plot | None:
    """Draw peak amplitude and frequency against the first varied number (Gastaldi and Berruti 2017, fig. 9); of too many curves a map."""
    key = first_number(response.data)[0]
    known = (c for c in response.peaked if np.isfinite(response.peak_response(c)))
    cases = sorted(known, key=lambda c: c.value)
    measured = measured_of(response, key)
    if not key or len(cases) < (1 if measured else MIN_PEAKS):
        return None
    curves_of = families_of(response.data, key, cases)
    if len(curves_of) > FEW:
        return all_peaks(response, key, curves_of, _optimum_caption(response, cases))
    peak = {c: response.peak_response(c) for c in cases}
    scale, naming = scale_for(np.array(list(peak.values())), response.unit), naming_of(response.data, key)
    figure = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.62, 0.38])
    banded = [draw_peak_bands(figure, response, own, scale.factor, naming) for own in curves_of.values()]
    colours = ramp(len(curves_of)) if len(curves_of) > 1 else [MUTED]
    for (name, family), line in zip(curves_of.items(), colours, strict=True):
        edge = {"width": 1, "color": "white"}
        mark = {"size": 10, "color": [c.colour for c in family] if line == MUTED else line, "line": edge}
        curves = ((scale.unit, [peak[c] * scale.factor for c in family]), ("Hz", [response.peak_hz(c) for c in family]))
        for row, (unit, y) in enumerate(curves, 1):
            figure.add_scatter(
                x=[naming.shown(c.value) for c in family],
                y=y,
                mode="lines+markers",
                line={"color": line, "width": 1.3},
                marker=mark,
                name=name,
                legendgroup=name,
                showlegend=row == 1 and len(curves_of) > 1,
                text=[c.named for c in family],
                hovertemplate=f"%{{text}}<br>%{{y:.4g}} {unit}<extra></extra>",
                row=row,
                col=1,
            )
    styled(figure, 480)
    if measured:
        measured.draw(figure, scale, naming)
    values = np.array([naming.shown(v) for v in np.unique([c.value for c in cases])])
    wide = values[0] > 0 and values[-1] > 5 * values[0]
    ticks = {"tickvals": values, "ticktext": [number(float(v), 4) for v in values]}
    figure.update_xaxes(title_text=naming.title, row=2)
    figure.update_xaxes(type="log" if wide else "linear", **(ticks if len(values) < 15 else {}))
    drawn = np.array([*peak.values(), *(measured.ends if measured else ())]) * scale.factor
    figure.update_yaxes(title_text=f"peak {response.quantity} ({scale.unit})", type="log", **log_ticks(drawn), row=1)
    figure.update_yaxes(title_text="peak frequency (Hz)", row=2)
    caption = _optimum_caption(response, cases) + (measured.caption(cases) if measured else "")
    caption += next(filter(None, banded), "")
    caption += shade_working_range(figure, response, logarithmic=bool(wide))
    return Plot("optimisation", "Optimisation curves", caption, figure)
