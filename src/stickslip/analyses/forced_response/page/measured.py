"""Measured peaks over the optimisation curves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import BoolArray, FloatArray
from stickslip.model.readers.measured_columns import same
from stickslip.report.cases import ShownCase
from stickslip.report.plot import INK
from stickslip.report.quantities import Scale, counted, joined, percent

SURE = {"standard deviation": 2.0, "half-width": 1.0}  # bars within which a computed peak agrees
WITHIN = {"standard deviation": "two standard deviations", "half-width": "the half-width"}
_SYMBOLS = ("diamond-open", "square-open", "triangle-up-open", "cross-open", "star-open")
_LOWEST = 0.99  # of a value, the longest bar downwards on a logarithmic axis


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

    def draw(self, figure: go.Figure, scale: Scale) -> None:
        """Draw the points with error bars into both panels, one symbol for each value of the other varied keys."""
        figure.update_layout(legend_groupclick="togglegroup")
        of_amplitude = (self.amplitude * scale.factor, self.amplitude_error * scale.factor)
        for k, name in enumerate(dict.fromkeys(self.others)):
            at = np.array([other == name for other in self.others])
            for column, unit, (y, error) in ((1, scale.unit, of_amplitude), (2, "Hz", (self.hz, self.hz_error))):
                barred = np.isfinite(error)
                for own in (at & np.isfinite(y) & barred, at & np.isfinite(y) & ~barred):
                    if own.any():
                        points = self._points(own, y, error, unit)
                        label = ", ".join(filter(None, ["measured", name]))
                        told = any(t.legendgroup == f"measured{k}" for t in figure.data)
                        points.update(name=label, legendgroup=f"measured{k}", showlegend=not told)
                        points.marker.symbol = _SYMBOLS[k % len(_SYMBOLS)]
                        figure.add_trace(points, row=1, col=column)

    def _points(self, own: BoolArray, y: FloatArray, error: FloatArray, unit: str) -> go.Scatter:
        """Return a trace of points, either all with error bars or all without."""
        source = self.response.text("measured_source")
        points = go.Scatter(
            x=self.values[own],
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
    """Return the function from measured amplitudes to those of the page; NaN if the force is unknown."""
    measured = response.data.get("measured_amplitude")
    per_force = measured is not None and measured.attrs.get("units") == "m/N"
    if per_force == response.per_force:
        return np.ones(values.size)
    force = response.values("measured_excitation_n")
    return 1 / force if response.per_force else force


def _agrees(others: str, case: ShownCase) -> bool:
    """Return whether a case has the other varied values of a point."""
    return not others or set(others.split(", ")) <= set(case.label.split(", "))
