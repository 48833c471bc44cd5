"""Verdicts on all motions, and the terminal tables."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stickslip.analyses.collected import told_apart
from stickslip.response.all_motions.basins import ALIKE
from stickslip.response.all_motions.found import SPENT
from stickslip.response.all_motions.search import WHOLE
from stickslip.response.bifurcations.side_branch import CLOSES, LEAVES
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres

HIGHER = 1.001  # times the swept peak, from where a branch is said to reach higher
CHANGED = ALIKE  # relative change by more harmonics from which it is said: starts in time are told apart by as much
NAMED = 5  # frequencies


def case_verdicts(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return what is to be thought of a case from its variables."""
    if "origin" not in case:
        return [Verdict("wrong", label, None, "the search was not finished", "Run it again.")]
    found = [*_higher(label, case), *_basins(label, case)]
    solves, budget = int(case["solves"].values), int(case["budget_solves"].values)
    tries, starts = int(case["tries"].values), int(np.sum(case["starts"].values))
    work = f"{tries} deflated solves and {starts} starts in time, {solves} solves in all"
    if int(case["spent"].values):
        why = f"the budget of {budget} solves ended the search: {work}{_untried(case)}"
        found.append(Verdict("doubtful", label, None, why, "Raise all_motions.solves."))
    found += [*_unfinished(label, case), *_harmonics(label, case)]
    unmarched = str(case["unmarched"].values)
    if unmarched:
        why = f"what attracts is not known: {unmarched}"
        found.append(Verdict("doubtful", label, None, why, "Read the branches as motions that may be unstable."))
    unsolved = int(np.sum(case["unsolved"].values))
    if unsolved:
        why = f"{unsolved} starts end on a periodic motion that is no solution with the harmonics kept"
        found.append(Verdict("doubtful", label, None, why, "Raise all_motions.harmonics."))
    if not any(v.rank for v in found):
        count = len(case["origin"].values)
        isolas = int(np.sum(case["isola"].values))
        why = f"{_counted(count, 'branch', 'branches')}, {_counted(isolas, 'isola', 'isolas')} among them, by {work}; no search proves that there is no other motion"
        found.append(Verdict("trusted", label, None, why))
    return found


def _untried(case: Mapping[str, xr.Variable]) -> str:
    """Return at which frequencies the budget left something untried."""
    hertz = case["searched_hz"].values[case["searched_spent"].values > 0]
    if not hertz.size:
        return ""
    named = ", ".join(f"{f:.6g}" for f in hertz[:NAMED]) + ", ..." * (hertz.size > NAMED)
    return f"; at {hertz.size} of {case['searched_hz'].size} frequencies ({named} Hz) not all was tried"


def _unfinished(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return the branches that are not known to their ends, and the frequencies at which no motion is known."""
    found = []
    for i, end in enumerate(case["end"].values):
        if str(end) not in (CLOSES, LEAVES, WHOLE) and SPENT not in str(end):
            why = f"branch {i + 1} ({case['origin'].values[i]}) is not known to its end: {end}"
            found.append(
                Verdict("doubtful", label, None, why, "Give all_motions.points more of them, or another range.")
            )
    none = np.zeros((case["searched_hz"].size, 0))
    known = case["motion_branch"].values if "motion_branch" in case else none
    for place in np.flatnonzero(~np.any(known >= 0, axis=1) & (case["searched_spent"].values == 0)):
        why = "no motion is known: nothing was started in time"
        found.append(
            Verdict(
                "doubtful",
                label,
                float(case["searched_hz"].values[place]),
                why,
                "Raise all_motions.tries, or change harmonics.",
            )
        )
    return found


def _harmonics(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return what more harmonics would change in the motions that were found."""
    if "motion_change" not in case:
        return []
    change = case["motion_change"].values
    lost, off = int(np.sum(np.isinf(change))), np.isfinite(change) & (change > CHANGED)
    found = []
    if lost:
        why = f"{_counted(lost, 'motion', 'motions')} with no motion of more harmonics nearby: with these {'it' if lost == 1 else 'they'} may not exist"
        found.append(Verdict("doubtful", label, None, why, "Raise all_motions.harmonics."))
    if np.any(off):
        at = int(np.nanargmax(np.max(np.where(off, change, 0.0), axis=1)))
        largest, count = float(np.max(change[off])), int(np.sum(off))
        why = f"more harmonics would change {_counted(count, 'motion', 'motions')} by up to {100 * largest:.2g} %, at {case['searched_hz'].values[at]:.6g} Hz"
        found.append(Verdict("doubtful", label, None, why, "Raise all_motions.harmonics."))
    return found


def _higher(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return the branches that reach higher than the one of the sweep."""
    origin, peak, hertz = (case[k].values for k in ("origin", "peak_amplitude", "peak_hz"))
    swept = float(np.max(peak[origin == "sweep"], initial=0.0))
    found: list[Verdict] = []
    if swept == 0.0:
        return found
    for i in np.flatnonzero((origin != "sweep") & (peak > HIGHER * swept)):
        kind = "an isola" if case["isola"].values[i] else "a branch that no sweep meets"
        why = f"{kind} reaches {millimetres(peak[i])} at {hertz[i]:.6g} Hz, {peak[i] / swept:.3g} times the peak of the sweep"
        remedy = "A disturbance can throw the machine there: count on the larger amplitude."
        found.append(Verdict("trusted", label, None, why, remedy, warns=True))
    return found


def _basins(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return where most starts end on no motion of the sweep's branch, or on none that repeats."""
    found = []
    origin, hertz = case["origin"].values, case["searched_hz"].values
    branch, share = case["motion_branch"].values, case["motion_share"].values
    for i, starts in enumerate(case["starts"].values):
        if not starts:
            continue
        aperiodic = int(case["aperiodic"].values[i])
        if aperiodic > 0:
            why = f"{aperiodic} of {starts} starts end on no motion of the load's period within the periods allowed"
            found.append(
                Verdict(
                    "trusted",
                    label,
                    float(hertz[i]),
                    why,
                    "Ask for all_motions.periods = 2 or 3, or raise all_motions.most_periods.",
                    warns=True,
                )
            )
        diverged = int(case["diverged"].values[i])
        if diverged > 0:
            why = f"{diverged} of {starts} starts grow without bound"
            found.append(
                Verdict(
                    "trusted",
                    label,
                    float(hertz[i]),
                    why,
                    "Look for negative damping or stiffness, or lower all_motions.spread.",
                    warns=True,
                )
            )
        found += _not_reached(label, case, i)
        if not np.any(np.isfinite(share[i])):
            continue
        most = int(np.nanargmax(share[i]))
        low = 100 * case["motion_share_low"].values[i, most]
        high = 100 * case["motion_share_high"].values[i, most]
        if origin[branch[i, most]] != "sweep":
            why = (
                f"most starts end on a branch that no sweep meets: {100 * share[i, most]:.3g} % ({low:.3g} to {high:.3g} %), amplitude "
                f"{millimetres(case['motion_amplitude'].values[i, most])}"
            )
            found.append(
                Verdict(
                    "trusted",
                    label,
                    float(hertz[i]),
                    why,
                    "The branch of the sweep is not what the machine is most likely to do.",
                    warns=True,
                )
            )
    return found


def _not_reached(label: str, case: Mapping[str, xr.Variable], i: int) -> list[Verdict]:
    """Return the largest stable motion at a frequency where no start ends on it."""
    height = np.where(case["motion_stability"].values[i] == "stable", case["motion_amplitude"].values[i], np.nan)
    if not np.any(np.isfinite(height)):
        return []
    k = int(np.nanargmax(height))
    if case["motion_count"].values[i, k] != 0:
        return []
    high = 100 * case["motion_share_high"].values[i, k]
    why = (
        f"the largest stable motion, {millimetres(height[k])}, was reached by none of {int(case['starts'].values[i])} starts: its share "
        f"of such starts is below {high:.2g} % with 95 % confidence, not zero"
    )
    remedy = "Count on its amplitude all the same, or raise all_motions.starts and all_motions.spread."
    return [Verdict("trusted", label, float(case["searched_hz"].values[i]), why, remedy)]


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints: the motions at the frequencies that were searched."""
    return tuple(_table(case, head) for case, head in told_apart(data) if "origin" in case)


def _table(case: xr.Dataset, head: str) -> TextTable:
    rows = []
    branch = case["motion_branch"].values if "motion_branch" in case else np.zeros((0, 0), int)
    for i, own in enumerate(branch):
        for k in np.flatnonzero(own >= 0):
            of = {
                n: case[f"motion_{n}"].values[i, k]
                for n in ("amplitude", "stability", "count", "share", "share_low", "share_high")
            }
            starts = int(case["starts"].values[i])
            share = f"{100 * of['share']:.3g} ({100 * of['share_low']:.3g} to {100 * of['share_high']:.3g})"
            rows.append(
                (
                    f"{case['searched_hz'].values[i]:.6g}",
                    f"{own[k] + 1}, {case['origin'].values[own[k]]}",
                    f"{1e3 * of['amplitude']:.6g}",
                    str(of["stability"]),
                    share if starts else "-",
                )
            )
    title = f"{head}Motions of {case.attrs.get('output', '')}"
    lines = [
        f"Branch {i + 1} ({case['origin'].values[i]}): {case['lowest_hz'].values[i]:.6g} to {case['highest_hz'].values[i]:.6g} Hz, "
        f"up to {millimetres(peak, 6)} at {case['peak_hz'].values[i]:.6g} Hz; {case['end'].values[i]}"
        for i, peak in enumerate(case["peak_amplitude"].values)
    ]
    solves, most = int(case.attrs["solves"]), int(case.attrs["budget_solves"])
    budget = f"{solves} solves of a budget of {most}, {float(case.attrs['seconds']):.3g} s"
    lines.append(f"{int(case.attrs['tries'])} deflated solves; {budget}.")
    columns = ("Hz", "branch", "amplitude mm", "stability", "starts that end on it, %")
    return TextTable(title, columns, tuple(rows), tuple(lines))


def _counted(count: int, one: str, several: str) -> str:
    return f"{count} {one if count == 1 else several}"
