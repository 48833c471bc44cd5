"""Motions with two frequencies on the page: envelopes, and their combined frequencies."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.columns import CaseView
from stickslip.analyses.quasi_periodic.records import QuasiPeriodic, TwoFrequencies
from stickslip.arrays import FloatArray
from stickslip.report.plot import Plot, colour, styled
from stickslip.report.quantities import NONE, counted, fixed, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section, Table
from stickslip.units import HZ

SHOWN = 6  # motions drawn one by one
FAINT = 1e-4  # share of the largest amplitude, below which combined frequencies are not drawn


class TwoTonesView(CaseView[QuasiPeriodic]):
    """One case."""

    kind = QuasiPeriodic

    @property
    def name(self) -> str:
        """Label of the output shown."""
        return str(self.found.output_name[0])

    @property
    def there(self) -> list[TwoFrequencies]:
        """The motions found that have a second frequency."""
        return [point for point in self.found.points if np.isfinite(point.second)]

    @property
    def drawn(self) -> list[TwoFrequencies]:
        """An even selection of these motions."""
        there = self.there
        few = np.unique(np.linspace(0, len(there) - 1, min(SHOWN, len(there))).round().astype(int))
        return [there[i] for i in few] if there else []


def _label(point: TwoFrequencies) -> str:
    """Name a motion by its frequencies."""
    return f"{point.first / HZ:.5g} and {point.second / HZ:.5g} Hz"


def _known(every: Sequence[FloatArray]) -> FloatArray:
    own = np.concatenate(every)
    return np.asarray(own[np.isfinite(own)])


def envelopes(view: TwoTonesView) -> Plot | None:
    """Draw largest and smallest amplitude over the first frequency."""
    points = view.found.points
    if len(points) < 2:
        return None
    hz = np.array([point.first / HZ for point in points])
    figure = go.Figure()
    sizes = {w: np.array([getattr(point, w)[0] for point in points]) for w in ("largest", "least", "rms")}
    scale = scale_for(sizes["largest"][np.isfinite(sizes["largest"])], "m")
    for i, (word, own) in enumerate(sizes.items()):
        figure.add_scatter(
            x=hz,
            y=scale.factor * own,
            mode="lines+markers",
            name={"rms": "root mean square"}.get(word, f"{word} amplitude"),
            line={"color": colour(i), "width": 2},
            hovertemplate=f"%{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra>{word}</extra>",
        )
    styled(figure, 440)
    figure.update_xaxes(title_text="first frequency (Hz)")
    figure.update_yaxes(title_text=f"{view.name} ({scale.unit})", rangemode="tozero")
    caption = "The amplitude is half of peak to peak in a period of the first frequency. It varies between the two curves as the phases drift past each other. Without a second tone both curves coincide."
    return Plot(f"two_frequencies{view.key}", "Envelope over the first frequency", caption, figure)


def over_phase(view: TwoTonesView) -> Plot | None:
    """Draw the amplitude over the phase of the second frequency."""
    if not view.drawn:
        return None
    figure = go.Figure()
    scale = scale_for(_known([point.envelope for point in view.found.points]), "m")
    for i, point in enumerate(view.drawn):
        phases = point.envelope.size
        figure.add_scatter(
            x=360.0 * np.arange(phases) / phases,
            y=scale.factor * point.envelope,
            mode="lines",
            name=_label(point),
            line={"color": colour(i), "width": 2},
            hovertemplate=f"%{{y:.5g}} {scale.unit} at %{{x:.0f}}°<extra>{_label(point)}</extra>",
        )
    styled(figure, 420)
    figure.update_xaxes(title_text="phase of the second frequency where a period begins (degrees)")
    figure.update_yaxes(title_text=f"amplitude of {view.name} ({scale.unit})", rangemode="tozero")
    caption = "Half of peak to peak over one period of the first frequency, for each phase of the second one at which that may begin."
    return Plot(f"two_frequencies_phase{view.key}", "Slow change of the amplitude", caption, figure)


def combined(view: TwoTonesView) -> Plot | None:
    """Draw the amplitudes of the combined frequencies."""
    if not view.drawn:
        return None
    figure = go.Figure()
    scale = scale_for(_known([point.amplitude[:, 0] for point in view.found.points]), "m")
    for i, point in enumerate(view.drawn):
        hz, sizes = point.indices @ np.array([point.first / HZ, point.second / HZ]), point.amplitude[:, 0]
        known = np.isfinite(sizes) & (sizes > FAINT * np.nanmax(sizes[1:]))
        known[0] = False
        names = [f"{j} f1 {k:+d} f2" for j, k in point.indices[known]]
        figure.add_scatter(
            x=np.abs(hz[known]),
            y=scale.factor * sizes[known],
            mode="markers",
            name=_label(point),
            text=names,
            marker={"color": colour(i), "size": 8},
            hovertemplate=f"%{{text}}: %{{y:.4g}} {scale.unit} at %{{x:.5g}} Hz<extra></extra>",
        )
    styled(figure, 420)
    figure.update_xaxes(title_text="frequency (Hz)")
    figure.update_yaxes(type="log", title_text=f"amplitude of {view.name} ({scale.unit})", exponentformat="power")
    caption = "Amplitudes of the combined frequencies j f1 + k f2 that were kept; below zero they are shown at their absolute value."
    return Plot(f"two_frequencies_lines{view.key}", "Combined frequencies", caption, figure)


def motions(view: TwoTonesView) -> Table:
    """Return a table with one row a motion."""
    points = view.found.points
    timed = any(point.time_largest is not None for point in points)
    head = [
        "first (Hz)",
        "second (Hz)",
        "",
        "least",
        "largest",
        "root mean square",
        "farthest from the mean",
        "combined",
        "left out (%)",
        *(["in time"] if timed else []),
        "why",
    ]
    return Table(head, [_row(point, timed=timed) for point in points], "Motions")


def _row(point: TwoFrequencies, *, timed: bool) -> list[str]:
    second, left = point.second / HZ, point.left_out
    sizes = [float(own[0]) for own in (point.least, point.largest, point.rms, point.extreme)]
    return [
        fixed(point.first / HZ, 3),
        fixed(second, 3) if np.isfinite(second) else NONE,
        point.kind,
        *(quantity(own, "m", 4) if np.isfinite(own) else NONE for own in sizes),
        str(point.combined),
        number(100 * left, 2) if np.isfinite(left) else NONE,
        *([_in_time(point)] if timed else []),
        point.why,
    ]


def _in_time(point: TwoFrequencies) -> str:
    if point.time_largest is None or point.time_least is None or not np.isfinite(point.time_largest[0]):
        return NONE
    off = np.nan if point.time_off is None else point.time_off
    told = f", {number(100 * off, 2)} % off" if np.isfinite(off) else ""
    return f"{quantity(float(point.time_least[0]), 'm', 4)} to {quantity(float(point.time_largest[0]), 'm', 4)}{told}"


def _cards(view: TwoTonesView) -> list[Card]:
    there = view.there
    if not there:
        return [Card("0", "motions with two frequencies", "none was found")]
    top = max(there, key=lambda point: point.largest[0])
    return [
        Card(
            quantity(float(top.largest[0]), "m", 4),
            "largest amplitude with two frequencies",
            f"{_label(top)}; {counted(len(there), 'motion')}",
            False,
        )
    ]


_BLOCK = Block("two-frequencies", "Motions with two frequencies", (envelopes, over_phase, combined, motions))
SECTION: Section = Section("quasi_periodic", ("first_hz",), TwoTonesView, (_BLOCK,), by_case=True, cards=_cards)
