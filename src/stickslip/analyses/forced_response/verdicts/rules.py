"""Rules of the verdicts on a forced response, each a function of the finished dataset."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from stickslip.analyses.forced_response.chooser import error_text
from stickslip.analyses.forced_response.problem import MORE_THAN_LOW
from stickslip.analyses.forced_response.verdicts.curve import ATTAINED, Curve, motion_of
from stickslip.analyses.forced_response.verdicts.finding import Finding, Rule, in_time_there, without_place
from stickslip.analyses.forced_response.verdicts.jumps import jumps
from stickslip.analyses.forced_response.verdicts.stable_rules import (
    bifurcated,
    fewer,
    stability,
    unstable_stretches,
)
from stickslip.harmonic.judging import REACH
from stickslip.harmonic.strategies import STRATEGIES, VERIFYING
from stickslip.response.forced.choices import RUNGS
from stickslip.solve.status import Status
from stickslip.study.verdict import from_json
from stickslip.units import LARGEST_PERCENT, millimetres

LARGE_SHIFT = 0.01  # relative change of the peak with a tenth of the retention stiffness
STUCK = 1e-18  # m/N: no structure is so stiff; what moves less sticks to rigid contacts or is held


def unsolved(case: Curve) -> Iterator[Finding]:
    """Take no point that did not converge for one, and doubt a peak that is only the largest of the others."""
    lost = np.flatnonzero(~case.converged)
    if lost.size == case.hz.size:
        remedy = "See run.log for what stopped them, and the size of the loads."
        yield Finding("wrong", "no point converged: there is no peak", remedy)
        return
    marched = case.texts("marched_sentence")
    for i in lost:
        advice = [Status(int(case.status[i])).advice, *filter(None, [marched[i]])]
        why = f"did not converge ({'; '.join(advice)})"
        remedy = f"A smaller step ({case.nearer}) finds most such points."
        if int(case.status[i]) == Status.NOT_PERIODIC:
            why = f"attains no periodic motion ({'; '.join(advice)})"
            remedy = "What is not periodic tells its envelope in time; forced_response.not_periodic_points says at how many such points."
        yield Finding("wrong", why, remedy, (int(i),))
    if lost.size:
        why = f"{lost.size} points did not converge; the peak is the largest of the others, and a larger one may stand among them"
        remedy = f"Take {case.nearer}, or narrow the range to theirs."
        yield Finding("doubtful", why, remedy)


def few_harmonics(case: Curve) -> Iterator[Finding]:
    """Doubt a solution whose own harmonics are predicted to be too few, and one that nothing has judged."""
    for i in np.flatnonzero(case.converged):
        own, solved = case.own_error[i], case.audit[i]
        if case.attained[i] or not np.isnan(solved):
            continue  # what was solved or integrated tells more than a prediction
        if own > case.limit:
            why = f"more harmonics than H = {case.kept[i]} are predicted to change it by {error_text(own)}"
            remedy = f"{_more(case, int(i))}; {in_time_there(case, int(i))}."
            yield Finding("doubtful", why, remedy, (int(i),), float(own), error_text(own))
        elif np.isnan([own, case.reference[i], case.integrated[i]]).all():
            why = f"its harmonics were not examined: nothing says how wrong H = {case.kept[i]} is"
            yield Finding("doubtful", why, f"{_examination(case)}.", (int(i),))


def _more(case: Curve, point: int) -> str:
    """Say how a point gets more harmonics: what kept it from them is the study, the response's work, its limits, or the most there are."""
    if not case.auto:
        return _of_selection(str(case.data.attrs.get("selection", "")))
    if case.own_error[point] <= case.limit:
        return "Its own error was predicted below harmonics.alert_threshold_percent: lower that, and more harmonics are kept"
    if case.supports[point][-1] < case.cap:
        return (
            f"Give {case.nearer}, or a narrower range: the search for up to {case.cap} harmonics ended before, by its share of work or because "
            "no solution was near"
        )
    if case.cap < RUNGS[-1]:
        return (
            f"No more than {case.cap} harmonics were allowed: raise limits.work_s or limits.memory_gb, which set them"
        )
    return f"There are no more than {case.cap} harmonics to be had"


def _of_selection(selection: str) -> str:
    """Say what gives more harmonics where they are not raised along the branch."""
    if selection == "always_low":
        return MORE_THAN_LOW
    if selection in STRATEGIES and selection not in VERIFYING:  # "auto" is five to them
        return 'Give a larger harmonics.high, or harmonics.selection = "guarded_alert" with high = "auto"'
    return 'Give harmonics.high = "auto", or a larger number'


def _examination(case: Curve) -> str:
    if case.rigid:
        return (
            "A contact is rigid, of which no error is predicted: compare with a larger harmonics.high, or see --verify"
        )
    return "--verify-harmonics predicts at every point what more would change, --verify integrates in time at the peak"


def audited(case: Curve) -> Iterator[Finding]:
    """Doubt a solution that more harmonics changed, and that stands all the same."""
    of = case.texts("audit_error_of")
    for i in np.flatnonzero(case.audit > case.limit):
        if not case.attained[i]:
            told = " in ".join(filter(None, (error_text(case.audit[i]), of[i])))
            why = f"solved again with more harmonics than H = {case.kept[i]} it differs by {told}"
            remedy = f"{_more(case, int(i))}; {in_time_there(case, int(i))}."
            yield Finding("doubtful", why, remedy, (int(i),), float(case.audit[i]), told)


def not_audited(case: Curve) -> Iterator[Finding]:
    """Doubt a peak whose few harmonics were accepted by predictions alone; tell of such points elsewhere."""
    few = case.converged & case.few & ~case.exact
    none = case.has("audit_error_percent") and bool(np.isnan(case.audit).all())
    if not none or not case.decides or not few.any() or case.attained[case.peak]:
        return
    if np.isnan(case.reference[few]).any():
        at_peak = case.peak >= 0 and bool(few[case.peak])
        where = ", the peak among them" if at_peak else ""
        why = (
            f"H = {case.low} was accepted at {few.sum()} point{'s' * int(few.sum() != 1)} by predictions alone{where}: none of them "
            "was solved with more to compare"
        )
        audits = "" if case.auto else 'harmonics.high = "auto" audits some; '
        remedy = f"{audits}{_examination(case)}."
        yield Finding("doubtful" if at_peak else "trusted", why, remedy)


def twice_the_harmonics(case: Curve) -> Iterator[Finding]:
    """Doubt what --verify-harmonics predicts to change."""
    for i in np.flatnonzero(case.reference > case.limit):
        if not case.attained[i]:
            why = (
                f"up to {REACH * case.cap} harmonics instead of H = {case.kept[i]} are predicted to change it, in amplitude or phase, by "
                f"{error_text(case.reference[i])}"
            )
            remedy = f"{_more(case, int(i))}."
            told = error_text(case.reference[i])
            yield Finding("doubtful", why, remedy, (int(i),), float(case.reference[i]), told)


def on_other_motions(case: Curve) -> Iterator[Finding]:
    """Tell of neighbours of a branch that stand on different motions; doubt them at the peak, and where either is not known to be one: stable, its harmonics enough."""
    at = case.branch[case.converged[case.branch]]
    if case.stepped or at.size < 2:  # between given frequencies any growth is possible
        return
    for jump in jumps(case.amplitude[at], case.dissipation[at], case.few[at], case.elastic):
        i, j = int(at[jump.step]), int(at[jump.step + 1])
        kept = case.kept[i], case.kept[j]
        sure = case.peak not in (i, j) and case.sure[i] and case.sure[j]
        unlike = "" if sure or kept[0] == kept[1] else f"; or one of H = {kept[0]} and H = {kept[1]} is wrong"
        why = (
            f"the response jumps between {case.hz[i]:.2f} and {case.hz[j]:.2f} Hz ({jump.what}): more than one periodic motion "
            f"exists near there, and which one a machine takes depends on its history{unlike}"
        )
        remedy = f'Take {case.nearer} there, and sweep both ways (direction = "down").'
        yield Finding("trusted" if sure else "doubtful", why, remedy, (i, j), jump.size)


def folds(case: Curve) -> Iterator[Finding]:
    """Tell of a branch that runs backwards: several motions at a frequency; doubt a peak among them."""
    hz = case.hz[case.branch]
    back = [sorted(pair) for pair in pairwise(hz) if case.forward * (pair[1] - pair[0]) < 0]
    if not back:
        return
    low, high = min(b for b, _ in back), max(a for _, a in back)
    inside = low <= case.peak_hz <= high
    doubted = inside and case.peak_stability not in ("stable", "neutral")
    digits = next((d for d in range(2, 6) if round(low, d) != round(high, d)), 6)
    why = (
        f"the response folds between {low:.{digits}f} and {high:.{digits}f} Hz: more than one periodic motion was found there, as a rule one "
        "of them unstable" + (", and the peak stands among them" if inside else "")
    )
    remedy = "Points outside the asked range belong to the fold."
    if inside:
        remedy = 'Which motion a machine takes depends on its history: sweep both ways (direction = "down"), and see --verify.'
    yield Finding("doubtful" if doubted else "trusted", why, remedy)


def in_time(case: Curve) -> Iterator[Finding]:
    """Judge by time integration."""
    for point, said in case.examined("verify_difference_percent"):
        motion, off = motion_of(said), float(said["verify_difference_percent"])
        wanders = 100 * float(said.get("verify_scatter", np.inf))
        if motion == "not periodic" and max(wanders, abs(off)) <= ATTAINED:
            why = (
                f"the motion in time is not periodic: it wanders by {wanders:.2g} % about an average {off:+.2g} % away"
            )
            yield Finding("doubtful", why, "Believe the amplitude to as much.", (point,))
        elif point in case.unstable and point != case.peak:
            continue  # an answer: `unstable_stretches` tells of it
        elif motion in ("left", "not periodic"):
            what = "leaves it for another motion" if motion == "left" else "is not periodic"
            why = f"the motion in time, started from it, {what}: {without_place(said['verify_sentence'])}"
            remedy = "Believe the time integration; sweep the other way for the motion it goes to."
            yield Finding("wrong", why, remedy, (point,))
        elif motion == "not settled":
            why = "a time integration did not settle to a periodic motion"
            remedy = "See the table of checks: it says what drifts or rings on."
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
    """Tell of harmonics at the peak that the amplitude does not hold, where they count in its extreme value."""
    if case.peak < 0 or case.left_out is None:
        return
    harmonic, share, whole = case.left_out
    if share > case.limit:
        own = case.amplitude[case.peak]
        why = (
            f"half of peak to peak is {millimetres(whole)} at {case.output}, {100 * (whole / own - 1):+.2g} % from the amplitude that is told: "
            f"harmonic {harmonic}, which that leaves out, holds {error_text(share)}"
        )
        remedy = 'output.measure = "half_peak_to_peak" tells extreme values.'
        yield Finding("trusted", why, remedy, (case.peak,))


def not_periodic(case: Curve) -> Iterator[Finding]:
    """Tell what a motion in time is like where no balance stands for it: a doubt of that point, which is one of the case where it is the peak."""
    for said in case.rows("not_periodic"):
        hz, sentence = float(said["not_periodic_frequency_hz"]), str(said["not_periodic_sentence"])
        why, off = without_place(sentence), np.abs(case.hz - hz)
        # where a fold passes a frequency twice the peak is meant, as by other checks
        point = case.peak if case.peak >= 0 and off[case.peak] == off.min() else int(off.argmin())
        settled = bool(said["not_periodic_settled"])
        remedy = "Give it more time: forced_response.not_periodic_s."
        if settled:
            remedy = "That is time integration, no balance."
        elif large := fewer(sentence):
            remedy = large
        yield Finding("trusted" if settled else "doubtful", why, remedy, (point,))


def at_the_end(case: Curve) -> Iterator[Finding]:
    """Doubt a largest amplitude that is no resonance, or none at all."""
    if case.peak < 0:
        return
    if case.amplitude[case.peak] < STUCK * case.number("excitation_n"):
        why = f"the output {case.output} does not move: a rigid contact holds it at all frequencies"
        remedy = "Name an output that moves, or raise the load until it slips."
        yield Finding("doubtful", why, remedy)
    elif case.outside:
        asked = f"{case.number('lowest_hz'):.2f} to {case.number('highest_hz'):.2f} Hz"
        why = (
            f"the largest amplitude stands at {case.peak_hz:.2f} Hz, beyond what was asked for ({asked}), where the branch goes round a "
            "fold"
        )
        yield Finding("doubtful", why, f"Widen forced_response.{case.range_key}.")
    elif case.at_the_end and case.hz.size > 1:  # of a frequency alone nobody asked for a peak
        why = f"the largest amplitude stands at the end of the sweep ({case.peak_hz:.2f} Hz); it is no resonance"
        if case.hump >= 0:
            size, hz = 1e3 * case.amplitude[case.hump], case.hz[case.hump]
            why += f"; inside the sweep the largest maximum is {size:.4g} mm at {hz:.2f} Hz"
        remedy = (
            f"Widen forced_response.{case.range_key}. Where contacts shift the resonance, a larger motion of its branch may reach into the "
            "range: [all_motions] looks for it."
        )
        yield Finding("doubtful", why, remedy)


def retention(case: Curve) -> Iterator[Finding]:
    """Doubt a peak that hangs on what is not physical."""
    shift = case.number("retention_peak_shift")
    if abs(shift) > LARGE_SHIFT:
        why = (
            f"the peak changes by {100 * shift:.3g} % when the retention stiffness of rigid bodies is ten times smaller: it "
            "depends on a stiffness that is not physical"
        )
        remedy = "Lower retention.stiffness_n_per_m until the peak stays, or find what holds the body."
        yield Finding("doubtful", why, remedy)


def known_to_the_job(case: Curve) -> Iterator[Finding]:
    """Return what only the model knew."""
    for v in from_json(case.text("known_verdicts") or "[]"):
        yield Finding(v.level, v.why, v.remedy)


RULES: tuple[Rule, ...] = (
    known_to_the_job,
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
    retention,
)
