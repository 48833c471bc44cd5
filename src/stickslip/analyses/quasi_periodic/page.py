"""Motions with two frequencies: envelopes, and the combined frequencies that they are made of."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.report.content import Table
from stickslip.report.node import Node
from stickslip.report.plot import Plot, colour, styled
from stickslip.report.quantities import NONE, counted, fixed, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section

SHOWN = 6  # motions drawn one by one
FAINT = 1e-4  # of the largest: combined frequencies that are not drawn


@dataclass(frozen=True, eq=False)
class TwoTonesView(Node):
    """One case."""

    @property
    def name(self) -> str:
        """Of the output that is drawn."""
        return self.labels_of("output_name")[0]

    @property
    def there(self) -> list[int]:
        """Positions of the motions that were found, with a second frequency."""
        return [i for i, hz in enumerate(self.floats("second_hz")) if np.isfinite(hz)]

    @property
    def drawn(self) -> list[int]:
        """Some of them, evenly taken."""
        there = self.there
        few = np.unique(np.linspace(0, len(there) - 1, min(SHOWN, len(there))).round().astype(int))
        return [there[i] for i in few] if there else []

    def label(self, i: int) -> str:
        """Name a motion by its frequencies."""
        first, second = (float(self.floats(f"{n}_hz")[i]) for n in ("first", "second"))
        return f"{first:.5g} and {second:.5g} Hz"


def envelopes(view: TwoTonesView) -> Plot | None:
    """Show how far the amplitude goes up and down over the first frequency."""
    if not view.has("largest") or view.data.sizes["point"] < 2:
        return None
    hz = view.floats("first_hz")
    figure = go.Figure()
    sizes = {w: view.values(w, "point", "output")[:, 0] for w in ("largest", "least", "rms")}
    scale = scale_for(sizes["largest"][np.isfinite(sizes["largest"])], "m")
    for i, (word, own) in enumerate(sizes.items()):
        figure.add_trace(
            go.Scatter(
                x=hz,
                y=scale.factor * own,
                mode="lines+markers",
                name={"rms": "root mean square"}.get(word, f"{word} amplitude"),
                line={"color": colour(i), "width": 2},
                hovertemplate=f"%{{y:.5g}} {scale.unit} at %{{x:.6g}} Hz<extra>{word}</extra>",
            )
        )
    styled(figure, 440)
    figure.update_xaxes(title_text="first frequency (Hz)")
    figure.update_yaxes(title_text=f"{view.name} ({scale.unit})", rangemode="tozero")
    caption = (
        "The amplitude, half of peak to peak in a period of the first frequency, goes up and down between its least and its largest value "
        "as the phases drift past each other. Where there is no second tone both are one."
    )
    return Plot(f"two_frequencies{view.key}", "Envelope over the first frequency", caption, figure)


def over_phase(view: TwoTonesView) -> Plot | None:
    """Show the amplitude over the phase of the second frequency."""
    if not view.drawn:
        return None
    figure = go.Figure()
    own = view.values("envelope", "point", "phase")
    scale = scale_for(own[np.isfinite(own)], "m")
    degrees = 360.0 * np.arange(own.shape[1]) / own.shape[1]
    for place, i in enumerate(view.drawn):
        figure.add_trace(
            go.Scatter(
                x=degrees,
                y=scale.factor * own[i],
                mode="lines",
                name=view.label(i),
                line={"color": colour(place), "width": 2},
                hovertemplate=f"%{{y:.5g}} {scale.unit} at %{{x:.0f}}°<extra>{view.label(i)}</extra>",
            )
        )
    styled(figure, 420)
    figure.update_xaxes(title_text="phase of the second frequency where a period begins (degrees)")
    figure.update_yaxes(title_text=f"amplitude of {view.name} ({scale.unit})", rangemode="tozero")
    caption = "Half of peak to peak over one period of the first frequency, for each phase of the second one at which that may begin."
    return Plot(f"two_frequencies_phase{view.key}", "Slow change of the amplitude", caption, figure)


def combined(view: TwoTonesView) -> Plot | None:
    """Show the amplitudes of the combined frequencies."""
    if not view.drawn:
        return None
    figure = go.Figure()
    index = np.asarray(view.data["index"].transpose("point", "index", "tone").values)
    sizes = np.asarray(view.data["amplitude"].transpose("point", "index", "output").values)[:, :, 0]
    scale = scale_for(sizes[np.isfinite(sizes)], "m")
    for place, i in enumerate(view.drawn):
        hz = index[i] @ np.array([view.floats("first_hz")[i], view.floats("second_hz")[i]])
        known = np.isfinite(sizes[i]) & (sizes[i] > FAINT * np.nanmax(sizes[i][1:]))
        known[0] = False
        names = [f"{j} f1 {k:+d} f2" for j, k in index[i][known]]
        figure.add_trace(
            go.Scatter(
                x=np.abs(hz[known]),
                y=scale.factor * sizes[i][known],
                mode="markers",
                name=view.label(i),
                text=names,
                marker={"color": colour(place), "size": 8},
                hovertemplate=f"%{{text}}: %{{y:.4g}} {scale.unit} at %{{x:.5g}} Hz<extra></extra>",
            )
        )
    styled(figure, 420)
    figure.update_xaxes(title_text="frequency (Hz)")
    figure.update_yaxes(type="log", title_text=f"amplitude of {view.name} ({scale.unit})", exponentformat="power")
    caption = "Amplitudes of the combined frequencies j f1 + k f2 that were kept; below zero they are shown at their absolute value."
    return Plot(f"two_frequencies_lines{view.key}", "Combined frequencies", caption, figure)


def motions(view: TwoTonesView) -> Table:
    """Return a row a motion."""
    kinds, reasons = view.labels_of("kind"), view.labels_of("why")
    largest, least, rms, extreme = (
        view.values(w, "point", "output")[:, 0] for w in ("largest", "least", "rms", "extreme")
    )
    timed = view.has("time_largest")
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
    rows = []
    for i, kind in enumerate(kinds):
        second = float(view.floats("second_hz")[i])
        lengths = [quantity(float(v[i]), "m", 4) if np.isfinite(v[i]) else NONE for v in (least, largest, rms, extreme)]
        left = float(view.floats("left_out")[i])
        rows.append(
            [
                fixed(float(view.floats("first_hz")[i]), 3),
                fixed(second, 3) if np.isfinite(second) else NONE,
                kind,
                *lengths,
                str(int(view.integers("combined")[i])),
                number(100 * left, 2) if np.isfinite(left) else NONE,
                *([_in_time(view, i)] if timed else []),
                reasons[i],
            ]
        )
    return Table(head, rows, "Motions")


def _in_time(view: TwoTonesView, i: int) -> str:
    ends = [float(view.values(f"time_{w}", "point", "output")[i, 0]) for w in ("least", "largest")]
    if not np.isfinite(ends[1]):
        return NONE
    off = float(view.floats("time_off")[i])
    told = f", {number(100 * off, 2)} % off" if np.isfinite(off) else ""
    return f"{quantity(ends[0], 'm', 4)} to {quantity(ends[1], 'm', 4)}{told}"


def _cards(view: TwoTonesView) -> list[Card]:
    there = view.there
    if not there:
        return [Card("0", "motions with two frequencies", "none was found")]
    largest = view.values("largest", "point", "output")[:, 0]
    top = max(there, key=lambda i: largest[i])
    return [
        Card(
            quantity(float(largest[top]), "m", 4),
            "largest amplitude with two frequencies",
            f"{view.label(top)}; {counted(len(there), 'motion')}",
            False,
        )
    ]


_BLOCK = Block("two-frequencies", "Motions with two frequencies", (envelopes, over_phase, combined, motions))
SECTION: Section = Section("quasi_periodic", ("first_hz",), TwoTonesView, (_BLOCK,), by_case=True, cards=_cards)
