"""Rules of stability: doubts, unstable stretches, bifurcations."""

from collections.abc import Iterator

import numpy as np

from stickslip.analyses.forced_response.problem import ALONE, MOST_IN_TIME, TOO_MANY
from stickslip.analyses.forced_response.records.quantities import MOTION
from stickslip.analyses.forced_response.verdicts.curve import ATTAINED, Curve
from stickslip.analyses.forced_response.verdicts.finding import Finding, in_time_there, without_place
from stickslip.units import millimetres

UNDECIDED = MOTION["undecided"]
LEFT = "unstable: a machine does not stay there"
LEAVING = dict.fromkeys(
    ("period doubling", "branch point"), 'forced_response.bifurcations = "branches" follows what leaves there.'
)
FEWER = f"No more time helps: fewer modes in [reduction] or fewer contact points may bring the model below {MOST_IN_TIME} coordinates; else it stays open."
OPEN = "No more time helps, and no fewer modes: it stays open. More harmonics make the errors of multipliers smaller."
IN_TIME_TELLS = "; an integration in time (--verify) tells more"  # what a verdict says as its remedy


def stability(case: Curve) -> Iterator[Finding]:
    """Doubt what the multipliers leave open, and take no unstable motion for a peak; an unstable stretch of the branch is an answer."""
    for point, said in case.examined("stability_verdict"):
        word, why = said["stability_verdict"], without_place(said["stability_sentence"])
        why = why.removesuffix(IN_TIME_TELLS)
        if word == "unstable" and point == case.peak:
            why = f"a machine does not stay there: {why}"
            remedy = "Look for the motion it leaves for: sweep the other way, or see --verify."
            yield Finding("wrong", why, remedy, (point,))
        elif word == "neutral" and point == case.peak:
            remedy = "Damping decides whether a machine keeps this motion: give [damping], or a contact that slips."
            yield Finding("trusted", f"the peak is {why}", remedy, (point,))
        elif word == "undecided" and not case.attained[point] and point not in case.known:
            why = f"whether it is stable: {why}"
            told = [why, *(str(s["not_periodic_sentence"]) for s in case.rows("not_periodic"))]
            known = next(filter(None, map(fewer, told)), "")
            remedy = known or f"{in_time_there(case, point)}, and sees whether the motion stays."
            yield Finding("doubtful", why, remedy, (point,))


def unstable_stretches(case: Curve) -> Iterator[Finding]:
    """Tell where the branch is unstable, and what larger motion is: neither marks the case."""
    off = case.unstable
    larger, hz = case.number("unstable_peak_amplitude"), case.number("unstable_peak_frequency_hz")
    if np.isfinite(larger):
        there = [
            without_place(str(said["not_periodic_sentence"]))
            for said in case.rows("not_periodic")
            if abs(float(said["not_periodic_frequency_hz"]) / hz - 1.0) < ATTAINED / 100
        ]
        why = f"the largest motion, {millimetres(larger)} at {hz:.4g} Hz, is unstable; the peak is the largest motion that a machine keeps"
        yield Finding("trusted", "; ".join([why, *there[:1]]), "See the stability of the points.")
    elif off.size:
        low, high = case.hz[off].min(), case.hz[off].max()
        why = f"{off.size} of {case.hz.size} points, {low:.4g} to {high:.4g} Hz, are unstable: a machine does not stay there"
        yield Finding("trusted", why, 'forced_response.bifurcations = "all" locates where that begins.')


def bifurcated(case: Curve) -> Iterator[Finding]:
    """Tell where the branch loses its stability."""
    unjudged = case.floats("motion_stability") == UNDECIDED
    if unjudged.any() and case.has("bifurcations_limits"):
        judged = np.isin(case.floats("motion_stability"), (0, 1, UNDECIDED))
        hz = case.hz[unjudged]
        why = (
            f"bifurcations may be missed: {hz.size} of {judged.sum()} motions along the branch could not be judged, between "
            f"{hz.min():.2f} and {hz.max():.2f} Hz"
        )
        remedy = "More harmonics make the errors of multipliers smaller; --verify integrates in time at the peak."
        yield Finding("trusted", why, remedy)
    left = {float(said["side_branch_frequency_hz"]) for said in case.rows("side_branch")}
    for said in case.rows("bifurcation"):
        if said["bifurcation_kind"] == "fold":  # the rule of folds tells of these
            continue
        remedy = LEAVING.get(str(said["bifurcation_kind"]), "")
        if float(said["bifurcation_frequency_hz"]) in left:
            remedy = "The branch that leaves there is drawn with the response."
        yield Finding("trusted", str(said["bifurcation_sentence"]), remedy)


def fewer(sentence: str) -> str:
    """Return what to do where a model has too many coordinates to be integrated in time, which no more time helps; empty where it has not."""
    if f"coordinates {TOO_MANY} {MOST_IN_TIME}" not in sentence:
        return ""
    return OPEN if ALONE in sentence else FEWER
