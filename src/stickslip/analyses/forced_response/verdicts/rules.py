"""Rules of the verdicts on a forced response, each a function of the finished dataset: accuracy, stability, physics and model."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip.analyses.forced_response.chooser import error_text
from stickslip.analyses.forced_response.physics.limits import GIVE_DAMPING
from stickslip.analyses.forced_response.problem import ALONE, MORE_THAN_LOW, MOST_IN_TIME, TOO_MANY
from stickslip.analyses.forced_response.records.columns import (
    MOTION,
    BifurcationRows,
    BifurcationSearch,
    KnownVerdicts,
    ModelChanges,
    MotionAtPeak,
    MotionsInTime,
    OperatingRange,
    OtherMotions,
    PhysicsVerdicts,
    SideBranches,
    StiffnessChange,
    each,
    holds,
)
from stickslip.analyses.forced_response.verdicts.curve import ATTAINED, Curve, motion_of
from stickslip.analyses.operation import MARGIN
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.harmonic.strategies import STRATEGIES, VERIFYING
from stickslip.response.forced.choices import RUNGS
from stickslip.response.forced.collected import jumps
from stickslip.solve.status import Status
from stickslip.study.verdict import Level, from_json
from stickslip.units import LARGEST_PERCENT, millimetres

IN_TIME = "run with --verify, which integrates in time at the peak"


@dataclass(frozen=True)
class Finding:
    """A finding of a rule.

    Parameters
    ----------
    level, why, remedy
        As in `Verdict`; a ``trusted`` finding is a note without doubt.
    points
        Indices of its points in the case; none: the case as a whole.
    size
        Rank among several findings of a rule; the largest is shown for all.
    value
        The size as text, for a sentence about several points.
    """

    level: Level
    why: str
    remedy: str
    points: tuple[int, ...] = ()
    size: float = 0.0
    value: str = ""


Rule = Callable[[Curve], Iterator[Finding]]


def in_time_there(case: Curve, point: int) -> str:
    """Return the remedy of a time integration at a point; in a sweep ``--verify`` integrates only at the peak."""
    if point == case.peak or case.range_key == "speed_rpm":
        return IN_TIME
    return f"run forced_response.frequencies_hz = [{case.hz[point]:.2f}] alone with --verify, which integrates in time there"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _direction(case: Curve) -> str:
    """Return the key that turns the sweep round."""
    return f'forced_response.direction = "{"down" if case.forward > 0 else "up"}"'


def _other_way(case: Curve) -> str:
    return f"Sweep the other way ({_direction(case)})"


def _beyond(case: Curve) -> str:
    """Return the key of the range, and the end at which the largest amplitude stands."""
    middle = 0.5 * (case.numbers.lowest_hz + case.numbers.highest_hz)
    place = "below" if case.peak_hz < middle else "beyond"
    at = case.points.speed_rpm[case.peak]
    shown = f"{at:.5g} rpm" if case.range_key == "speed_rpm" and np.isfinite(at) else f"{case.peak_hz:.5g} Hz"
    return f"forced_response.{case.range_key} to values {place} {shown}"


def without_place(sentence: str) -> str:
    """Return the sentence of a check without the leading frequency, which the verdict states itself, and without its full stop."""
    head, found, rest = sentence.partition(" Hz: ")
    return (rest if found and head.replace(".", "").isdigit() else sentence).removesuffix(".")


UNDECIDED = MOTION["undecided"]
LEFT = "unstable: a machine does not stay there"
LEAVING = dict.fromkeys(
    ("period doubling", "branch point"), 'forced_response.bifurcations = "branches" follows what leaves there.'
)
FEWER = f"Keep fewer modes in [reduction] or fewer contact points, for less than {MOST_IN_TIME} coordinates in all. More time does not help, and otherwise stability stays undecided."
OPEN = "Raise harmonics.high: more harmonics make the errors of multipliers smaller. Neither more time nor fewer modes help."
IN_TIME_TELLS = "; an integration in time (--verify) tells more"  # remedy of a verdict


def stability(case: Curve) -> Iterator[Finding]:
    """Doubt a peak with undecided multipliers, and reject an unstable motion as peak; an unstable range elsewhere is an answer."""
    for point, said in case.examined:
        word, why = str(said.stability_verdict), without_place(str(said.stability_sentence))
        why = why.removesuffix(IN_TIME_TELLS)
        if word == "unstable" and point == case.peak:
            why = f"a machine does not stay there: {why}"
            remedy = f"{_other_way(case)} for the motion it leaves for, or run with --verify."
            yield Finding("wrong", why, remedy, (point,))
        elif word == "neutral" and point == case.peak and not lacks_damping(case):
            remedy = "Give [damping], or a contact that slips: damping decides whether a machine keeps this motion."
            yield Finding("trusted", f"the peak is {why}", remedy, (point,))
        elif word == "undecided" and not case.attained[point] and point not in case.known:
            why = f"stability {why}"
            told = [why, *map(str, case.read(MotionsInTime).not_periodic_sentence)]
            known = next(filter(None, map(fewer, told)), "")
            remedy = known or f"{_capital(in_time_there(case, point))}, and sees whether the motion stays."
            if case.steps:
                remedy = f"Give forced_response.steps_per_period = {2 * case.steps}."
            yield Finding("doubtful", why, remedy, (point,))


def unstable_stretches(case: Curve) -> Iterator[Finding]:
    """Report unstable ranges of the branch and larger unstable motions; neither affects the level of the case."""
    off = case.unstable
    larger, hz = case.numbers.unstable_peak_amplitude, case.numbers.unstable_peak_frequency_hz
    if np.isfinite(larger):
        there = [
            without_place(str(said.not_periodic_sentence))
            for said in each(case.read(MotionsInTime))
            if abs(said.not_periodic_frequency_hz / hz - 1.0) < ATTAINED / 100
        ]
        why = f"the largest motion, {millimetres(larger)} at {hz:.4g} Hz, is unstable; the peak is the largest motion that a machine keeps"
        yield Finding("trusted", "; ".join([why, *there[:1]]), "The chapter Checks has the stability of each point.")
    elif off.size:
        low, high = case.hz[off].min(), case.hz[off].max()
        why = f"{off.size} of {case.hz.size} points, {low:.4g} to {high:.4g} Hz, are unstable: a machine does not stay there"
        yield Finding("trusted", why, 'forced_response.bifurcations = "all" locates where that begins.')


def bifurcated(case: Curve) -> Iterator[Finding]:
    """Report the loss of stability at bifurcations of the branch."""
    unjudged = case.stability.motion_stability == UNDECIDED
    if unjudged.any() and holds(BifurcationSearch, case.data):
        judged = np.isin(case.stability.motion_stability, (0, 1, UNDECIDED))
        hz = case.hz[unjudged]
        why = (
            f"bifurcations may be missed: {hz.size} of {judged.sum()} motions along the branch could not be judged, between "
            f"{hz.min():.2f} and {hz.max():.2f} Hz"
        )
        remedy = f"Raise harmonics.high, which makes the errors of multipliers smaller, or {IN_TIME}."
        yield Finding("trusted", why, remedy)
    left = case.read(SideBranches).side_branch_frequency_hz
    for said in each(case.read(BifurcationRows)):
        if said.bifurcation_kind == "fold":  # the rule `folds` reports these
            continue
        remedy = LEAVING.get(str(said.bifurcation_kind), "")
        if said.bifurcation_frequency_hz in left:
            remedy = "The branch that leaves there is drawn with the response."
        yield Finding("trusted", str(said.bifurcation_sentence), remedy)


def fewer(sentence: str) -> str:
    """Return the remedy for a model with too many coordinates for time integration; empty for a smaller model."""
    if f"coordinates {TOO_MANY} {MOST_IN_TIME}" not in sentence:
        return ""
    return OPEN if ALONE in sentence else FEWER


LARGEST_ROTATION_RAD = 0.1  # limit of linear kinematics
LARGEST_STRAIN = 3e-3
LARGER = 0.01  # least relative excess of another motion over the peak
SOFTER = 0.1  # relative change of the contact stiffness in sentences
DECIDED = 0.05  # relative change of a peak by softer contacts, above which there is a note
LEAST_PERCENT, LEAST_HZ = 1e-3, 1e-6  # smallest changes of a peak that are stated as numbers
LARGEST_SLIP_FACETS = 0.5  # slip over the size of a facet: contact points must stay opposite each other


def physics(case: Curve) -> Iterator[Finding]:
    """Return the findings of the job about modes and loads."""
    for v in from_json(case.read(PhysicsVerdicts).physics_verdicts or "[]"):
        yield Finding(v.level, v.why, v.remedy)


def small_motions(case: Curve) -> Iterator[Finding]:
    """Doubt motions too large for linear kinematics."""
    own = case.read(MotionAtPeak)
    rotation, strain, slip = own.peak_rotation_rad, own.peak_strain_rms, own.peak_slip_facets
    told = [f"a part turns by {rotation:.2g} rad, more than {LARGEST_ROTATION_RAD:g}"] * bool(
        rotation > LARGEST_ROTATION_RAD
    )
    told += [
        f"the root mean square of the strain is {100 * strain:.2g} %, more than {100 * LARGEST_STRAIN:g} %"
    ] * bool(strain > LARGEST_STRAIN)
    told += [f"a contact slips by {slip:.2g} of a facet, more than {LARGEST_SLIP_FACETS:g}"] * bool(
        slip > LARGEST_SLIP_FACETS
    )
    if told:
        why = f"the motion at the peak is too large for linear kinematics: {'; '.join(told)}"
        remedy = "Check units, load.NAME.force_n and [damping]; if they are right, a model of large motions is needed."
        yield Finding("doubtful", why, remedy)


def model_itself(case: Curve) -> Iterator[Finding]:
    """Doubt a peak that changes by more than the threshold with more modes or fewer contact points."""
    own = case.read(ModelChanges)
    for change, hertz, what, remedy in (
        (
            own.modes_peak_change,
            own.modes_frequency_change_hz,
            "with half again as many modes in the reduction",
            "Raise reduction.fixed_interface_modes, or what else sets their number.",
        ),
        (
            own.points_peak_change,
            own.points_frequency_change_hz,
            f"with half the points of its contacts ({own.points_left_out} left out)",
            "Mesh the contacts more finely, or give them more points, and compare.",
        ),
    ):
        if abs(change) > case.limit:
            why = f"the peak changes by {100 * change:+.2g} % and {hertz:+.3g} Hz {what}"
            yield Finding("doubtful", why, remedy)


def other_motions(case: Curve) -> Iterator[Finding]:
    """Report other motions at the peak; doubt the peak if one of them is larger."""
    for said in each(case.read(OtherMotions)):
        size, hz = float(said.another_amplitude), float(said.another_frequency_hz)
        larger = size > (1.0 + LARGER) * float(np.nan_to_num(case.numbers.peak_amplitude))
        word = str(said.another_stability)
        state = {
            "stable": ", which is stable",
            "undecided": ", whose stability is undecided",
            "neutral": ", which is neutral",
        }.get(word, ", whose stability was not examined")
        why = (
            f"another motion of {millimetres(size)} exists at {hz:.2f} Hz, where the response has {millimetres(float(said.another_known))}: "
            f"found from {said.another_start}{state}"
        )
        remedy = "Add [all_motions], which looks for all of them: the history of a machine decides which one it takes."
        yield Finding("doubtful" if larger else "trusted", why, remedy, size=size)


def contact_stiffness(case: Curve) -> Iterator[Finding]:
    """Note a peak that changes by more than `DECIDED` with contacts 10 % softer; it is only as accurate as the contact stiffness."""
    if abs(SOFTER * case.read(StiffnessChange).stiffness_peak_slope) > DECIDED:
        yield Finding(
            "trusted",
            f"the contact stiffness decides the peak, which changes {_softer(case)}",
            "Know it to a few per cent, from a measured stuck frequency for example, or vary it ([vary]).",
        )


def _softer(case: Curve) -> str:
    """Return the effect of softer contacts on a peak, to first order; empty if unknown."""
    own = case.read(StiffnessChange)
    slope, hertz = own.stiffness_peak_slope, own.stiffness_frequency_slope_hz
    if not np.isfinite(slope):
        return ""
    percent = -100 * SOFTER * slope
    size = f"{percent:+.2g} %" if abs(percent) >= LEAST_PERCENT else f"less than {LEAST_PERCENT:g} %"
    moved = f" and {-SOFTER * hertz:+.2g} Hz" if abs(hertz) >= LEAST_HZ else ""
    return f"by {size}{moved} with contacts {100 * SOFTER:g} % softer"


def told_of_model(case: Curve) -> list[str]:
    """Return the changes of a trusted peak by modes, contact points and contact stiffness."""
    told, own = [], case.read(ModelChanges)
    for change, hertz, what in (
        (own.modes_peak_change, own.modes_frequency_change_hz, "half again as many modes"),
        (own.points_peak_change, own.points_frequency_change_hz, "half the contact points"),
    ):
        if np.isfinite(change):
            told.append(f"by {100 * change:+.2g} % and {hertz:+.2g} Hz with {what}")
    return told + [said for said in (_softer(case),) if said]


PHYSICS_RULES: tuple[Rule, ...] = (physics, small_motions, model_itself, contact_stiffness, other_motions)


LARGE_SHIFT = 0.01  # relative change of the peak with a tenth of the retention stiffness
STUCK = 1e-18  # m/N, below the compliance of any structure: such a point sticks to a rigid contact or is held


def unsolved(case: Curve) -> Iterator[Finding]:
    """Mark unconverged points as wrong, and doubt a peak found among the remaining points."""
    lost = np.flatnonzero(~case.converged)
    if lost.size == case.hz.size:
        remedy = "Read the causes in run.log, and check load.NAME.force_n and the contact stiffness."
        yield Finding("wrong", "no point converged: there is no peak", remedy)
        return
    for i in lost:
        status, marched = Status(int(case.points.status[i])), str(case.points.marched_sentence[i])
        advice = [status.advice, *filter(None, [marched])]
        why = f"did not converge ({'; '.join(advice)})"
        remedy = f"Take {case.nearer}: a smaller step finds most such points."
        if status == Status.NOT_PERIODIC:
            why = f"attains no periodic motion ({'; '.join(advice)})"
            remedy = (
                "Raise forced_response.not_periodic_points, the number of points whose envelope in time is computed."
            )
        yield Finding("wrong", why, remedy, (int(i),))
    if lost.size:
        why = f"{lost.size} points did not converge; the peak is the largest of the others, and one of these points may be larger"
        remedy = f"Take {case.nearer}, or narrow the range to these points."
        yield Finding("doubtful", why, remedy)


def few_harmonics(case: Curve) -> Iterator[Finding]:
    """Doubt a solution with too large a predicted error, and a solution without any judgement."""
    if case.steps:
        yield from _coarse(case)
        return
    for i in np.flatnonzero(case.converged):
        own, solved = case.own_error[i], case.audit[i]
        if case.attained[i] or not np.isnan(solved):
            continue  # an audit or a time integration is more reliable than a prediction
        if own > case.limit:
            why = f"more harmonics than H = {case.kept[i]} are predicted to change it by {error_text(own)}"
            remedy = f"{_more(case, int(i))}; {in_time_there(case, int(i))}."
            yield Finding("doubtful", why, remedy, (int(i),), float(own), error_text(own))
        elif np.isnan([own, case.reference[i], case.integrated[i]]).all():
            why = f"the error of H = {case.kept[i]} is not known, as its harmonics were not examined"
            yield Finding("doubtful", why, f"{_capital(_examination(case))}.", (int(i),))


def _coarse(case: Curve) -> Iterator[Finding]:
    """Doubt motions found by shooting that shorter time steps are expected to change."""
    for i in np.flatnonzero(case.converged & (case.own_error > case.limit)):
        own = float(case.own_error[i])
        why = f"shorter time steps than {case.steps} a period are expected to change it by {error_text(own)}"
        remedy = f"Give forced_response.steps_per_period = {2 * case.steps}, and compare."
        yield Finding("doubtful", why, remedy, (int(i),), own, error_text(own))


def _more(case: Curve, point: int) -> str:
    """Return the remedy for too few harmonics, by their limit: study, work of the response, [limits], or `RUNGS`."""
    if not case.auto:
        return _of_selection(str(case.data.attrs.get("selection", "")))
    if case.own_error[point] <= case.limit:
        return "Lower harmonics.alert_threshold_percent to keep more harmonics; the predicted error is below it"
    if case.supports[point][-1] < case.cap:
        return f"Give {case.nearer}, or a narrower range. The search for up to {case.cap} harmonics used up its share of work, or found no solution nearby"
    if case.cap < RUNGS[-1]:
        return f"Raise limits.work_s or limits.memory_gb, which allow {case.cap} harmonics at most"
    return f"Judge it in time, as no study keeps more than {case.cap} harmonics"


def _of_selection(selection: str) -> str:
    """Return the keys that give more harmonics if they are not raised along the branch."""
    if selection == "always_low":
        return MORE_THAN_LOW
    if selection in STRATEGIES and selection not in VERIFYING:  # they read "auto" as five harmonics
        return 'Give a larger harmonics.high, or harmonics.selection = "guarded_alert" with high = "auto"'
    return 'Give harmonics.high = "auto", or a larger number'


def _examination(case: Curve) -> str:
    if case.rigid:
        return "compare with a larger harmonics.high; no error is predicted for rigid contacts"
    return f"run with --verify-harmonics, which predicts at every point what more would change, or {IN_TIME}"


def audited(case: Curve) -> Iterator[Finding]:
    """Doubt an accepted solution that changed with more harmonics."""
    for i in np.flatnonzero(case.audit > case.limit):
        if not case.attained[i]:
            told = " in ".join(filter(None, (error_text(case.audit[i]), str(case.points.audit_error_of[i]))))
            why = f"solved again with more harmonics than H = {case.kept[i]} it differs by {told}"
            remedy = f"{_more(case, int(i))}; {in_time_there(case, int(i))}."
            yield Finding("doubtful", why, remedy, (int(i),), float(case.audit[i]), told)


def not_audited(case: Curve) -> Iterator[Finding]:
    """Doubt a peak with few harmonics that rests on predictions alone; note such points elsewhere."""
    few = case.converged & case.few & ~case.exact
    none = case.audits and bool(np.isnan(case.audit).all())
    if not none or not case.decides or not few.any() or case.attained[case.peak]:
        return
    if np.isnan(case.reference[few]).any():
        at_peak = case.peak >= 0 and bool(few[case.peak])
        where = ", the peak among them" if at_peak else ""
        why = f"H = {case.low} was accepted at {few.sum()} point{'s' * int(few.sum() != 1)} by predictions alone{where}; none was solved with more harmonics"
        audits = "" if case.auto else 'give harmonics.high = "auto", which audits some; or '
        remedy = f"{_capital(audits + _examination(case))}."
        yield Finding("doubtful" if at_peak else "trusted", why, remedy)


def twice_the_harmonics(case: Curve) -> Iterator[Finding]:
    """Doubt points whose predicted change by --verify-harmonics is too large."""
    for i in np.flatnonzero(case.reference > case.limit):
        if not case.attained[i]:
            why = (
                f"up to {JUDGED_MULTIPLE * case.cap} harmonics instead of H = {case.kept[i]} are predicted to change it, in amplitude or phase, by "
                f"{error_text(case.reference[i])}"
            )
            remedy = f"{_more(case, int(i))}."
            told = error_text(case.reference[i])
            yield Finding("doubtful", why, remedy, (int(i),), float(case.reference[i]), told)


def lacks_damping(case: Curve) -> bool:
    """Return whether a verdict on the physics of the case says that damping is missing."""
    told = from_json(case.read(PhysicsVerdicts).physics_verdicts or "[]")
    return any(v.level != "trusted" and v.remedy.startswith(GIVE_DAMPING) for v in told)


def on_other_motions(case: Curve) -> Iterator[Finding]:
    """Note neighbouring points on different motions; doubt them at the peak, and if either is not known to be stable with enough harmonics."""
    at = case.branch[case.converged[case.branch]]
    if case.stepped or at.size < 2:  # neighbouring listed frequencies may have any ratio of amplitudes
        return
    if not case.data.sizes.get("contact", 0):
        return  # linear: one motion at each frequency
    for jump in jumps(case.amplitude[at], case.dissipation[at], case.few[at], case.elastic):
        i, j = int(at[jump.step]), int(at[jump.step + 1])
        if case.peak in (i, j) and lacks_damping(case):
            continue  # missing damping is told, and the size of the peak is no other motion
        kept = case.kept[i], case.kept[j]
        sure = case.peak not in (i, j) and case.sure[i] and case.sure[j]
        unlike = "" if sure or kept[0] == kept[1] else f"; or one of H = {kept[0]} and H = {kept[1]} is wrong"
        why = f"the response jumps between {case.hz[i]:.2f} and {case.hz[j]:.2f} Hz ({jump.what}): a machine takes one of several periodic motions, depending on its history{unlike}"
        remedy = f"Take {case.nearer} there, and sweep the other way, too ({_direction(case)})."
        yield Finding("trusted" if sure else "doubtful", why, remedy, (i, j), jump.size)


def folds(case: Curve) -> Iterator[Finding]:
    """Note folds of the branch, with several motions at one frequency; doubt a peak among them."""
    hz = case.hz[case.branch]
    back = [sorted(pair) for pair in pairwise(hz) if case.forward * (pair[1] - pair[0]) < 0]
    if not back:
        return
    low, high = min(b for b, _ in back), max(a for _, a in back)
    inside = low <= case.peak_hz <= high
    doubted = inside and case.peak_stability not in ("stable", "neutral")
    digits = next((d for d in range(2, 6) if round(low, d) != round(high, d)), 6)
    why = (
        f"the response folds between {low:.{digits}f} and {high:.{digits}f} Hz: several periodic motions exist there, and as a rule one is unstable"
        + (", and the peak stands among them" if inside else "")
    )
    remedy = "Points outside the asked range belong to the fold."
    if inside:
        remedy = (
            f"{_other_way(case)}, too, and run with --verify: the history of a machine decides which motion it takes."
        )
    yield Finding("doubtful" if doubted else "trusted", why, remedy)


def in_time(case: Curve) -> Iterator[Finding]:
    """Judge points by time integration."""
    for point, said in case.checks:
        motion, off, wanders = motion_of(said), float(said.verify_difference_percent), float(100 * said.verify_scatter)
        if motion == "not periodic" and max(wanders, abs(off)) <= ATTAINED:
            why = (
                f"the motion in time is not periodic: it wanders by {wanders:.2g} % about an average {off:+.2g} % away"
            )
            yield Finding("doubtful", why, f"Allow {max(wanders, abs(off)):.2g} % for it in the amplitude.", (point,))
        elif point in case.unstable and point != case.peak:
            continue  # no doubt: `unstable_stretches` reports it
        elif motion in ("left", "not periodic"):
            what = "leaves it for another motion" if motion == "left" else "is not periodic"
            why = f"the motion in time, started from it, {what}: {without_place(str(said.verify_sentence))}"
            remedy = f"{_other_way(case)} for the motion it goes to, and believe the time integration."
            yield Finding("wrong", why, remedy, (point,))
        elif motion == "next to it":
            why = f"the motion in time ends on another motion {off:+.2g} % away, to which more harmonics do not lead"
            remedy = "Believe the time integration; the table of checks compares both motions."
            yield Finding("doubtful", why, remedy, (point,))
        elif motion == "not settled":
            why = "a time integration did not settle to a periodic motion"
            remedy = "Give [damping] to what rings on and [retention] to what drifts; the table of checks names it."
            yield Finding("doubtful", why, remedy, (point,))
        elif not abs(off) <= (allowed := case.allowed_in_time(point)):
            why = f"time integration and harmonic balance differ by {_difference_text(off)}, more than {allowed:g} %"
            remedy = f"{_more(case, point)}; the table of checks says which of the two is wrong."
            yield Finding("doubtful", why, remedy, (point,), abs(off))
        elif case.outputs_off[point] > case.limit:
            why = f"time integration and harmonic balance differ by {error_text(case.outputs_off[point])} in an output, phase included"
            remedy = f"{_more(case, point)}; believe the time integration."
            yield Finding("doubtful", why, remedy, (point,), float(case.outputs_off[point]))


def _difference_text(percent: float) -> str:
    if abs(percent) < LARGEST_PERCENT:
        return f"{percent:+.3g} %"
    return "no finite amount" if not np.isfinite(percent) else f"over {LARGEST_PERCENT:g} %"


def beside_the_amplitude(case: Curve) -> Iterator[Finding]:
    """Note harmonics at the peak that are not part of the amplitude but matter in its extreme value."""
    if case.peak < 0 or case.left_out is None:
        return
    harmonic, share, whole = case.left_out
    if share > case.limit:
        own = case.amplitude[case.peak]
        why = f"half of peak to peak is {millimetres(whole)} at {case.output}, {100 * (whole / own - 1):+.2g} % from the amplitude reported; harmonic {harmonic}, which the amplitude leaves out, holds {error_text(share)}"
        remedy = 'output.measure = "half_peak_to_peak" reports extreme values.'
        yield Finding("trusted", why, remedy, (case.peak,))


def not_periodic(case: Curve) -> Iterator[Finding]:
    """Report the motion in time at points without a valid balance solution: a doubt of the point, and at the peak of the case."""
    for said in each(case.read(MotionsInTime)):
        sentence = str(said.not_periodic_sentence)
        why, off = without_place(sentence), np.abs(case.hz - said.not_periodic_frequency_hz)
        # if a branch passes the frequency twice, the finding belongs to the peak, as in other checks
        point = case.peak if case.peak >= 0 and off[case.peak] == off.min() else int(off.argmin())
        settled = bool(said.not_periodic_settled)
        remedy = "Give it more time: forced_response.not_periodic_s."
        if settled:
            remedy = "That is time integration, no balance."
        elif large := fewer(sentence):
            remedy = large
        yield Finding("trusted" if settled else "doubtful", why, remedy, (point,))


def at_the_end(case: Curve) -> Iterator[Finding]:
    """Doubt a largest amplitude that is no resonance, or that is missing."""
    if case.peak < 0:
        return
    if case.amplitude[case.peak] < STUCK * case.numbers.excitation_n:
        why = f"the output {case.output} does not move: a rigid contact holds it at all frequencies"
        remedy = "Name an output that moves, or raise the load until it slips."
        yield Finding("doubtful", why, remedy)
    elif case.outside:
        asked = f"{case.numbers.lowest_hz:.2f} to {case.numbers.highest_hz:.2f} Hz"
        why = (
            f"the largest amplitude stands at {case.peak_hz:.2f} Hz, beyond what was asked for ({asked}), where the branch goes round a "
            "fold"
        )
        yield Finding("doubtful", why, f"Widen forced_response.{case.range_key} to hold {case.peak_hz:.4g} Hz.")
    elif case.at_the_end and case.hz.size > 1:  # a single frequency has no peak
        why = f"the largest amplitude stands at the end of the sweep ({case.peak_hz:.2f} Hz); it is no resonance"
        if case.hump >= 0:
            size, hz = 1e3 * case.amplitude[case.hump], case.hz[case.hump]
            why += f"; inside the sweep the largest maximum is {size:.4g} mm at {hz:.2f} Hz"
        remedy = (
            f"Widen {_beyond(case)}. Where contacts shift the resonance, a larger motion of its branch may reach into the "
            "range: [all_motions] looks for it."
        )
        yield Finding("doubtful", why, remedy)


COARSE = 0.5  # step over the half-power width above which a resonance may be missed: four points a width show each


def coarse_steps(case: Curve) -> Iterator[Finding]:
    """Doubt a peak among equally spaced frequencies that are too far apart to show every resonance as narrow as this one."""
    width = 2.0 * case.numbers.peak_damping * case.peak_hz
    if case.peak < 0 or not case.stepped or case.range_key == "frequencies_hz" or not width > 0.0:
        return
    hz = np.unique(case.hz[case.branch])
    step = float(np.diff(hz).max()) if hz.size > 1 else 0.0
    if step > COARSE * width:
        why = f"the frequencies are up to {step:.2g} Hz apart, and the resonance at the peak is {width:.2g} Hz wide at half power: a larger one may stand between them"
        enough = int(np.ceil((hz[-1] - hz[0]) / (COARSE * width))) + 1
        yield Finding(
            "doubtful", why, f"Give forced_response.frequencies = {enough}, or points, which follow the curve."
        )


def retention(case: Curve) -> Iterator[Finding]:
    """Doubt a peak that depends on the retention stiffness, which is not physical."""
    shift = case.numbers.retention_peak_shift
    if abs(shift) > LARGE_SHIFT:
        why = (
            f"the peak changes by {100 * shift:.3g} % when the retention stiffness of rigid bodies is ten times smaller: it "
            "depends on a stiffness that is not physical"
        )
        remedy = "Lower retention.stiffness_n_per_m until the peak stays, or find what holds the body."
        yield Finding("doubtful", why, remedy)


def operation(case: Curve) -> Iterator[Finding]:
    """Note whether the peak lies in the operating range of the machine, or its margin, and the largest amplitude there."""
    own = case.read(OperatingRange)
    if not own.range.known or case.peak < 0:
        return
    low, high = (own.shown(hz) for hz in (case.numbers.lowest_hz, case.numbers.highest_hz))
    left = own.range.beyond(low, high)
    if left:
        why = f"the sweep leaves out {left} of the operating range, {own.range}"
        yield Finding("doubtful", why, f"Widen forced_response.{case.range_key}.")
    if case.at_the_end:  # no resonance: its own doubt
        return
    peak = own.shown(case.peak_hz)
    where = own.range.where(peak)
    here = f"{peak:.5g} {own.range.unit}"
    if where == "inside":
        why = f"the peak lies inside the operating range, {own.range}: {here}"
        yield Finding("trusted", why, "The machine runs at this resonance: judge its amplitude, or shift it.")
        return
    why = f"the peak lies outside the operating range, {own.range}: {here} is {where} it"
    size, hz = case.largest_in_operation
    if np.isfinite(size):
        why += f", and the largest amplitude in it is {millimetres(size)} at {own.shown(hz):.5g} {own.range.unit}"
    yield Finding("trusted", why, MARGIN)


def known_to_the_job(case: Curve) -> Iterator[Finding]:
    """Return the verdicts that the job stored because they need the model."""
    for v in from_json(case.read(KnownVerdicts).known_verdicts or "[]"):
        yield Finding(v.level, v.why, v.remedy)


RULES: tuple[Rule, ...] = (
    known_to_the_job,
    operation,
    unsolved,
    in_time,
    stability,
    unstable_stretches,
    bifurcated,
    not_periodic,
    audited,
    few_harmonics,
    twice_the_harmonics,
    not_audited,
    on_other_motions,
    beside_the_amplitude,
    folds,
    at_the_end,
    coarse_steps,
    retention,
)
