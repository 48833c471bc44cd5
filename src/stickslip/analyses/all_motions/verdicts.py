"""Verdicts on all motions, and the terminal tables."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from stickslip.analyses.all_motions.records import FoundMotions, SearchedFrequency
from stickslip.analyses.columns import record_of, told_apart
from stickslip.response.all_motions.basins import ALIKE
from stickslip.response.all_motions.found import SPENT
from stickslip.response.all_motions.search import WHOLE
from stickslip.response.bifurcations.side_branch import CLOSES, LEAVES
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres

HIGHER = 1.001  # least ratio of the peak of a higher branch to the peak of the sweep
CHANGED = ALIKE  # relative change by more harmonics that gives a doubt; motions in time closer than this are equal
NAMED = 5  # frequencies that a sentence names


def case_verdicts(label: str, found: FoundMotions) -> list[Verdict]:
    """Return the verdicts on a case."""
    if not found.branches:
        return [Verdict("wrong", label, None, "the search was not finished", "Run it again.")]
    own = [*_higher(label, found), *(v for place in found.places for v in _basins(label, found, place))]
    work = f"{found.tries} deflated solves and {found.starts} starts in time, {found.solves} solves in all"
    if found.spent:
        why = f"the budget of {found.budget} solves ended the search: {work}{_untried(found)}"
        own.append(Verdict("doubtful", label, None, why, "Raise all_motions.solves."))
    own += [*_unfinished(label, found), *_harmonics(label, found)]
    if found.unmarched:
        why = f"what attracts is not known: {found.unmarched}"
        own.append(Verdict("doubtful", label, None, why, "Read the branches as motions that may be unstable."))
    unsolved = sum(place.unsolved for place in found.places)
    if unsolved:
        why = f"{unsolved} starts end on a periodic motion that is no solution with the harmonics kept"
        own.append(Verdict("doubtful", label, None, why, "Raise all_motions.harmonics."))
    if not any(v.rank for v in own):
        count = _counted(len(found.branches), "branch", "branches")
        why = f"{count}, {_counted(found.isolas, 'isola', 'isolas')} among them, by {work}; no search proves that there is no other motion"
        own.append(Verdict("trusted", label, None, why))
    return own


def _untried(found: FoundMotions) -> str:
    """Return the frequencies whose search the budget ended early, as a clause."""
    hertz = [place.hertz for place in found.places if place.spent]
    if not hertz:
        return ""
    named = ", ".join(f"{f:.6g}" for f in hertz[:NAMED]) + ", ..." * (len(hertz) > NAMED)
    return f"; at {len(hertz)} of {len(found.places)} frequencies ({named} Hz) not all was tried"


def _unfinished(label: str, found: FoundMotions) -> Iterator[Verdict]:
    """Doubt branches that are not known to their ends, and frequencies without a known motion."""
    for i, branch in enumerate(found.branches):
        if branch.end not in (CLOSES, LEAVES, WHOLE) and SPENT not in branch.end:
            why = f"branch {i + 1} ({branch.origin}) is not known to its end: {branch.end}"
            yield Verdict("doubtful", label, None, why, "Give all_motions.points more of them, or another range.")
    for place in found.places:
        if not place.motions and not place.spent:
            why = "no motion is known: nothing was started in time"
            yield Verdict("doubtful", label, place.hertz, why, "Raise all_motions.tries, or change harmonics.")


def _harmonics(label: str, found: FoundMotions) -> Iterator[Verdict]:
    """Doubt motions that more harmonics would change, or that have no motion with more harmonics nearby."""
    lost = sum(bool(np.isinf(motion.change)) for _, motion in found.motions)
    off = [(motion.change, place) for place, motion in found.motions if CHANGED < motion.change < np.inf]
    if lost:
        why = f"{_counted(lost, 'motion', 'motions')} with no motion of more harmonics nearby: with these {'it' if lost == 1 else 'they'} may not exist"
        yield Verdict("doubtful", label, None, why, "Raise all_motions.harmonics.")
    if off:
        largest, at = max(off, key=lambda one: one[0])
        why = f"more harmonics would change {_counted(len(off), 'motion', 'motions')} by up to {100 * largest:.2g} %, at {at.hertz:.6g} Hz"
        yield Verdict("doubtful", label, None, why, "Raise all_motions.harmonics.")


def _higher(label: str, found: FoundMotions) -> Iterator[Verdict]:
    """Warn of branches that reach higher than the branch of the sweep."""
    swept = found.swept_peak
    for branch in found.branches:
        if swept > 0.0 and not branch.swept and branch.peak_amplitude > HIGHER * swept:
            kind = "an isola" if branch.isola else "a branch that no sweep meets"
            peak = branch.peak_amplitude
            why = f"{kind} reaches {millimetres(peak)} at {branch.peak_hz:.6g} Hz, {peak / swept:.3g} times the peak of the sweep"
            remedy = "A disturbance can throw the machine there: count on the larger amplitude."
            yield Verdict("trusted", label, None, why, remedy, warns=True)


def _basins(label: str, found: FoundMotions, place: SearchedFrequency) -> Iterator[Verdict]:
    """Warn of starts at a frequency that end on no periodic motion, and of a most likely motion off the sweep's branch."""
    hertz, starts = place.hertz, place.starts
    if not starts:
        return
    if place.aperiodic > 0:
        why = f"{place.aperiodic} of {starts} starts end on no motion of the load's period within the periods allowed"
        remedy = "Ask for all_motions.periods = 2 or 3, or raise all_motions.most_periods."
        yield Verdict("trusted", label, hertz, why, remedy, warns=True)
    if place.diverged > 0:
        why = f"{place.diverged} of {starts} starts grow without bound"
        remedy = "Look for negative damping or stiffness, or lower all_motions.spread."
        yield Verdict("trusted", label, hertz, why, remedy, warns=True)
    yield from _not_reached(label, place)
    known = [motion for motion in place.motions if np.isfinite(motion.share)]
    if not known:
        return
    most = max(known, key=lambda motion: motion.share)
    if not found.branches[most.branch].swept:
        why = (
            f"most starts end on a branch that no sweep meets: {100 * most.share:.3g} % ({100 * most.share_low:.3g} to "
            f"{100 * most.share_high:.3g} %), amplitude {millimetres(most.amplitude)}"
        )
        remedy = "From a random start the machine is more likely to end on that branch than on the sweep's."
        yield Verdict("trusted", label, hertz, why, remedy, warns=True)


def _not_reached(label: str, place: SearchedFrequency) -> Iterator[Verdict]:
    """Note the largest stable motion at a frequency if no start ends on it."""
    stable = [m for m in place.motions if m.stability == "stable" and np.isfinite(m.amplitude)]
    top = max(stable, key=lambda motion: motion.amplitude, default=None)
    if top is None or top.count != 0:
        return
    why = (
        f"the largest stable motion, {millimetres(top.amplitude)}, was reached by none of {place.starts} starts: its share "
        f"of such starts is below {100 * top.share_high:.2g} % with 95 % confidence, not zero"
    )
    remedy = "Count on its amplitude all the same, or raise all_motions.starts and all_motions.spread."
    yield Verdict("trusted", label, place.hertz, why, remedy)


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables: the motions at the searched frequencies."""
    every = ((record_of(FoundMotions, case), head) for case, head in told_apart(data))
    return tuple(_table(found, head) for found, head in every if found.branches)


def _table(found: FoundMotions, head: str) -> TextTable:
    rows = []
    for place, motion in found.motions:
        share = f"{100 * motion.share:.3g} ({100 * motion.share_low:.3g} to {100 * motion.share_high:.3g})"
        rows.append(
            (
                f"{place.hertz:.6g}",
                f"{motion.branch + 1}, {found.branches[motion.branch].origin}",
                f"{1e3 * motion.amplitude:.6g}",
                motion.stability,
                share if place.starts else "-",
            )
        )
    lines = [
        f"Branch {i + 1} ({branch.origin}): {branch.lowest_hz:.6g} to {branch.highest_hz:.6g} Hz, "
        f"up to {millimetres(branch.peak_amplitude, 6)} at {branch.peak_hz:.6g} Hz; {branch.end}"
        for i, branch in enumerate(found.branches)
    ]
    budget = f"{found.solves} solves of a budget of {found.budget}, {found.seconds:.3g} s"
    lines.append(f"{found.tries} deflated solves; {budget}.")
    columns = ("Hz", "branch", "amplitude mm", "stability", "starts that end on it, %")
    return TextTable(f"{head}Motions of {found.output}", columns, tuple(rows), tuple(lines))


def _counted(count: int, one: str, several: str) -> str:
    return f"{count} {one if count == 1 else several}"
