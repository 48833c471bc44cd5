"""All motions on the page: every branch in one figure, and the basins of attraction."""

from collections.abc import Iterator, Sequence

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.all_motions.records import FoundMotions, SearchedFrequency
from stickslip.analyses.columns import CaseView
from stickslip.report.plot import MUTED, STABILITY_SYMBOLS, Plot, colour, styled
from stickslip.report.quantities import NONE, counted, number, quantity, scale_for
from stickslip.report.section import Block, Card, Section, Table, Words

_ORIGIN = {"sweep": "the sweep", "deflation": "found by deflation", "time": "found in time"}


class Motions(CaseView[FoundMotions]):
    """One case."""

    kind = FoundMotions

    @property
    def names(self) -> list[str]:
        """Names of the branches."""
        return [
            f"{i + 1}: {'isola, ' * b.isola}{_ORIGIN.get(b.origin, b.origin)}"
            for i, b in enumerate(self.found.branches)
        ]


def branches(view: Motions) -> Plot:
    """Draw all branches, and the motions at the searched frequencies."""
    figure, found = go.Figure(), view.found
    scale = scale_for(np.concatenate([branch.amplitude for branch in found.branches]), "m")
    for i, (name, branch) in enumerate(zip(view.names, found.branches, strict=True)):
        there = np.isfinite(branch.frequency_hz)
        figure.add_scatter(
            x=branch.frequency_hz[there],
            y=scale.factor * branch.amplitude[there],
            mode="lines",
            name=name,
            line={"color": colour(i), "width": 1},
            hovertemplate=f"{name}: %{{y:.6g}} {scale.unit} at %{{x:.6g}} Hz<extra></extra>",
        )
    _mark(found, figure, scale.factor, scale.unit)
    styled(figure, 480)
    figure.update_xaxes(title_text="frequency (Hz)")
    figure.update_yaxes(title_text=f"amplitude of {found.output} ({scale.unit})", rangemode="tozero")
    spent = " The budget ended the search before all was tried." * bool(found.spent)
    caption = (
        f"{_several(len(found.branches), 'branch', 'branches')}; a sweep by arc length meets the first. At "
        f"{_several(len(found.places), 'frequency', 'frequencies')} (marks) other motions were searched by "
        f"{found.tries} deflated solves and from {found.starts} random states in time, "
        f"{found.solves} solves of a budget of {found.budget}. New motions were followed.{spent} "
        "Stability is examined at the marks alone; thin lines between them are not examined. "
        "Nothing proves that there is no other motion."
    )
    return Plot(f"all_motions{view.key}", "All motions that were found", caption, figure)


def _several(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"


def _mark(found: FoundMotions, figure: go.Figure, factor: float, unit: str) -> None:
    """Mark the motions at the searched frequencies by their stability."""
    for word, symbol in STABILITY_SYMBOLS.items():
        own = [(place, motion) for place, motion in found.motions if motion.stability == word]
        if not own:
            continue
        figure.add_scatter(
            x=np.array([place.hertz for place, _ in own]),
            y=factor * np.array([motion.amplitude for _, motion in own]),
            mode="markers",
            name=word,
            marker={"symbol": symbol, "size": 9, "color": MUTED, "line": {"width": 1.6, "color": MUTED}},
            hovertemplate=f"{word}: %{{y:.6g}} {unit} at %{{x:.6g}} Hz<extra></extra>",
        )


def branch_table(view: Motions) -> Table:
    """Return a table of the branches."""
    rows = [
        [
            name,
            f"{number(branch.lowest_hz, 6)} to {number(branch.highest_hz, 6)}",
            quantity(branch.peak_amplitude, "m", 5),
            number(branch.peak_hz, 6),
            branch.end,
        ]
        for name, branch in zip(view.names, view.found.branches, strict=True)
    ]
    head = ["branch", "range (Hz)", "largest amplitude", "at (Hz)", "how it ends"]
    return Table(head, rows, "Branches")


def basin_table(view: Motions) -> Table | Words:
    """Return a table of the motions at each frequency, with the share of starts that end on them."""
    if not view.found.motions:
        return Words(("No motion was found at a frequency that was searched.",))
    rows = [row for place in view.found.places for row in _basins(place, view.names)]
    head = [
        "frequency (Hz)",
        "branch",
        "amplitude",
        "stability",
        "multiplier",
        "change by more harmonics",
        "starts that end on it (95 %)",
    ]
    said = "Random starts lie in the lowest modes about the mean of the known motions, with sliders that never moved. Shares count these starts, with the binomial interval of Clopper and Pearson."
    return Table(head, rows, "Motions and their basins", (said,))


def _basins(place: SearchedFrequency, names: Sequence[str]) -> Iterator[list[str]]:
    """Yield the rows of a frequency: its motions, and the outcome of the other starts."""
    hertz, starts = number(place.hertz, 6), place.starts
    for motion in place.motions:
        share, low, high = 100 * motion.share, 100 * motion.share_low, 100 * motion.share_high
        yield [
            hertz,
            names[motion.branch],
            quantity(motion.amplitude, "m", 5),
            f"**{motion.stability}**",
            number(motion.multiplier, 4),
            _changed(motion.change),
            f"{number(share, 3)} % ({number(low, 2)} to {number(high, 2)} %) of {starts}" if starts else NONE,
        ]
    others = {
        "none of the load's period": place.aperiodic,
        "no solution with these harmonics": place.unsolved,
        "none: it grows without bound": place.diverged,
    }
    for what, count in others.items():
        if count:
            yield [hertz, what, NONE, NONE, NONE, NONE, f"{number(100 * count / starts, 3)} % of {starts}"]


def _changed(share: float) -> str:
    if np.isnan(share):
        return NONE
    return "no motion near" if np.isinf(share) else f"{number(100 * share, 2)} %"


def _cards(view: Motions) -> Sequence[Card]:
    found = view.found
    higher = any(b.peak_amplitude > found.swept_peak for b in found.branches if not b.swept)
    note = f"{counted(found.isolas, 'isola')}" + "; one branch reaches higher than the sweep" * higher
    return [Card(str(len(found.branches)), "branches of motions", note, higher)]


_BLOCK = Block("all-motions", "All motions", (branches, branch_table, basin_table))
SECTION: Section = Section("all_motions", ("origin",), Motions, (_BLOCK,), by_case=True, cards=_cards)
