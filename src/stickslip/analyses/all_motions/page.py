"""All motions on the page: every branch in one figure, and the basins of attraction."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.report.content import Table, Words
from stickslip.report.plot import MUTED, Plot, colour, styled
from stickslip.report.quantities import NONE, counted, number, quantity, scale_for
from stickslip.report.result import Node
from stickslip.report.section import Block, Card, Section

_SYMBOLS = {"stable": "circle", "unstable": "x", "undecided": "diamond-open", "not examined": "circle-open"}
_ORIGIN = {"sweep": "the sweep", "deflation": "found by deflation", "time": "found in time"}


@dataclass(frozen=True, eq=False)
class Motions(Node):
    """One case."""

    @property
    def names(self) -> list[str]:
        """Of the branches."""
        isola = self.integers("isola")
        return [
            f"{i + 1}: {'isola, ' * bool(isola[i])}{_ORIGIN.get(o, o)}" for i, o in enumerate(self.labels_of("origin"))
        ]


def branches(view: Motions) -> Plot:
    """Show all branches, and the motions at the frequencies that were searched."""
    figure = go.Figure()
    hertz, height = (view.values(n, "branch", "point") for n in ("frequency_hz", "amplitude"))
    scale = scale_for(height, "m")
    for i, name in enumerate(view.names):
        there = np.isfinite(hertz[i])
        figure.add_trace(
            go.Scatter(
                x=hertz[i][there],
                y=scale.factor * height[i][there],
                mode="lines",
                name=name,
                line={"color": colour(i), "width": 1},
                hovertemplate=f"{name}: %{{y:.6g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
            )
        )
    if view.has("motion_branch"):
        _mark(view, figure, scale.factor, scale.unit)
    styled(figure, 480)
    figure.update_xaxes(title_text="frequency (Hz)")
    figure.update_yaxes(title_text=f"amplitude of {view.text('output')} ({scale.unit})", rangemode="tozero")
    spent = " The budget ended the search before all was tried." * bool(view.scalar("spent"))
    caption = (
        f"{_several(len(view.names), 'branch', 'branches')}: the first is what a sweep by arc length meets. At "
        f"{_several(view.integers('searched_hz').size, 'frequency', 'frequencies')} (marks) other motions were searched by "
        f"{int(view.scalar('tries'))} deflated solves and from {int(np.sum(view.integers('starts')))} random states in time, "
        f"{int(view.scalar('solves'))} solves of a budget of {int(view.scalar('budget_solves'))}; what was new was followed.{spent} "
        "Stability is examined at the marks alone: the lines between them are thin, for nobody knows whether a motion there lasts. "
        "Nothing proves that there is no other motion."
    )
    return Plot(f"all_motions{view.key}", "All motions that were found", caption, figure)


def _several(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"


def _mark(view: Motions, figure: go.Figure, factor: float, unit: str) -> None:
    """Mark the motions at the frequencies that were searched by their stability."""
    dims = ("searched", "motion")
    height, hertz = view.values("motion_amplitude", *dims), view.floats("searched_hz")
    words = view.data["motion_stability"].transpose(*dims).values.astype(str)
    where = np.broadcast_to(hertz[:, None], height.shape)
    for word, symbol in _SYMBOLS.items():
        own = words == word
        if not np.any(own):
            continue
        figure.add_trace(
            go.Scatter(
                x=where[own],
                y=factor * height[own],
                mode="markers",
                name=word,
                marker={"symbol": symbol, "size": 9, "color": MUTED, "line": {"width": 1.6, "color": MUTED}},
                hovertemplate=f"{word}: %{{y:.6g}} {unit} at %{{x:.6g}} Hz<extra></extra>",
            )
        )


def branch_table(view: Motions) -> Table:
    """Return the branches."""
    rows = [
        [
            name,
            f"{number(float(low), 6)} to {number(float(high), 6)}",
            quantity(float(peak), "m", 5),
            number(float(hertz), 6),
            end,
        ]
        for name, low, high, peak, hertz, end in zip(
            view.names,
            view.floats("lowest_hz"),
            view.floats("highest_hz"),
            view.floats("peak_amplitude"),
            view.floats("peak_hz"),
            view.labels_of("end"),
            strict=True,
        )
    ]
    head = ["branch", "range (Hz)", "largest amplitude", "at (Hz)", "how it ends"]
    return Table(head, rows, "Branches")


def basin_table(view: Motions) -> Table | Words:
    """Return the motions at each frequency with the share of the starts that ends on them."""
    if not view.has("motion_branch"):
        return Words(("No motion was found at a frequency that was searched.",))
    dims, names = ("searched", "motion"), view.names
    told = ("amplitude", "share", "share_low", "share_high", "multiplier", "change")
    column = {n: view.values(f"motion_{n}", *dims) for n in told}
    number_of = view.data["motion_branch"].transpose(*dims).values.astype(int)
    words = view.data["motion_stability"].transpose(*dims).values.astype(str)
    starts = view.integers("starts")
    others = {
        "none of the load's period": view.integers("aperiodic"),
        "no solution with these harmonics": view.integers("unsolved"),
        "none: it grows without bound": view.integers("diverged"),
    }
    rows = []
    for i, hertz in enumerate(view.floats("searched_hz")):
        for k in np.flatnonzero(number_of[i] >= 0):
            share, low, high = (100 * column[n][i, k] for n in ("share", "share_low", "share_high"))
            ends = f"{number(share, 3)} % ({number(low, 2)} to {number(high, 2)} %) of {starts[i]}"
            rows.append(
                [
                    number(float(hertz), 6),
                    names[number_of[i, k]],
                    quantity(float(column["amplitude"][i, k]), "m", 5),
                    f"**{words[i, k]}**",
                    number(float(column["multiplier"][i, k]), 4),
                    _changed(float(column["change"][i, k])),
                    ends if starts[i] else NONE,
                ]
            )
        rows += [
            [
                number(float(hertz), 6),
                what,
                NONE,
                NONE,
                NONE,
                NONE,
                f"{number(100 * count[i] / starts[i], 3)} % of {starts[i]}",
            ]
            for what, count in others.items()
            if count[i]
        ]
    head = [
        "frequency (Hz)",
        "branch",
        "amplitude",
        "stability",
        "multiplier",
        "change by more harmonics",
        "starts that end on it (95 %)",
    ]
    said = (
        "Starts are drawn in the lowest modes about the mean of the known motions, with sliders that never moved: shares are those of "
        "such starts, with the binomial interval of Clopper and Pearson."
    )
    return Table(head, rows, "Motions and their basins", (said,))


def _changed(share: float) -> str:
    if np.isnan(share):
        return NONE
    return "no motion near" if np.isinf(share) else f"{number(100 * share, 2)} %"


def _cards(view: Motions) -> Sequence[Card]:
    origin, peak = np.array(view.labels_of("origin")), view.floats("peak_amplitude")
    isolas = int(np.sum(view.integers("isola")))
    higher = bool(np.any(peak[origin != "sweep"] > np.max(peak[origin == "sweep"], initial=0.0)))
    note = f"{counted(isolas, 'isola')}" + "; one branch reaches higher than the sweep" * higher
    return [Card(str(len(origin)), "branches of motions", note, higher)]


_BLOCK = Block("all-motions", "All motions", (branches, branch_table, basin_table))
SECTION: Section = Section("all_motions", ("origin",), Motions, (_BLOCK,), by_case=True, cards=_cards)
