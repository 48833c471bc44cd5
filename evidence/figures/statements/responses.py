"""Sections 4.5.2, 4.5.4, 6 and 6.1: what one and five harmonics can do, and time integration (fig. 4, 5)."""

from collections.abc import Sequence

import numpy as np

from evidence.figures.evidence import Evidence, Marker
from evidence.figures.reasons import Truncation, lines_of, open_in_time, smallest_in_time
from evidence.figures.solve import HZ, Pair, time_signal
from evidence.figures.statements.statement import (
    ONE_PERCENT,
    OVERLAP,
    THRESHOLD,
    Statement,
    interval,
    judged,
    listed,
    median,
    percent,
    sentence,
    signed,
    span,
    states_said,
)
from stickslip.arrays import FloatArray
from stickslip.response import fields


def statements_before(e: Evidence) -> list[Statement]:
    """Return the rows of sections 4.5.2 to 6."""
    return [*_of_adequacy(e), _of_spectrum(e), *_of_fig4(e)]


def statements_in_time(e: Evidence) -> list[Statement]:
    """Return the rows of section 6.1, at the lowest ratio whose peak is periodic."""
    return [_lift_off(e), *_low_peaks(e), *_of_cycles(e), _warned(e)]


def which(e: Evidence) -> str:
    """Say at which ratio time integration is compared, and why not at the paper's."""
    t = e.in_time
    refused = ", ".join(f"{kind} at {ratio:g}" for ratio, kind in t.refused)
    return f"ratio {t.ratio:g}" + (f" ({refused})" if refused else "")


def _of_adequacy(e: Evidence) -> list[Statement]:
    t = e.in_time
    marks = [m for m in t.markers if m.orbit.found]
    errors = [m.balance / m.orbit.amplitude - 1 for m in marks]
    known = [p for p in e.peaks if p.ratio > t.ratio and p.orbit is not None and p.orbit.found]
    peaks = {p.ratio: p.high.amplitudes.max() / p.orbit.amplitude - 1 for p in known if p.orbit}
    at_peak = t.truncation.errors[min(t.truncation.errors)]
    worst = max(map(abs, [*errors, *peaks.values(), at_peak]))
    sliding = [p for p in e.slipping if p.opened == 0.0]
    good = [p for p in sliding if p.real < ONE_PERCENT]
    return [
        Statement(
            section="4.5.2",
            place="section 6.1, fig. 4a",
            claim="Five harmonics are adequate even in highly nonlinear cases: they coincide with direct time integration, within 1 %",
            number="< 1 %, ratio 2",
            own=f"{which(e)}: {len(marks)} of {len(t.markers)} frequencies periodic, {span(errors)}; {signed(at_peak)} at {t.pair.hertz:.2f} Hz, next to the peak; at the peaks of other ratios "
            + ", ".join(f"{signed(v)} at {r:g}" for r, v in peaks.items())
            + f"; error of the time step {percent(t.step_error, 2)}",
            verdict=judged(worst < ONE_PERCENT) if t.orbit.found else "not tested",
            by=f"largest {percent(worst)}" if t.orbit.found else f"no periodic motion at {listed(e.plan.time_ratios)}",
            why=why_five(e),
        ),
        Statement(
            section="4.5.2",
            claim="One harmonic is adequate in most cases of slip without detachment",
            number="< 1 %",
            own=f"{len(good)} of {len(sliding)} frequencies where contacts slip and none opens are less than 1 % from five harmonics; against time integration at ratio {e.plan.weak:g}: {_weak_in_time(e.weak_markers)}",
            verdict="not tested" if not sliding else judged(len(good) > len(sliding) / 2),
            by=percent(len(good) / len(sliding)) if sliding else "0 such frequencies",
            why=f"Where it is not, contacts slip for {percent(median([p.slip for p in sliding if p not in good]), 2)} of the time (median), where it is for {percent(median([p.slip for p in good]), 2)}: slip alone takes one harmonic off.",
        ),
    ]


def _weak_in_time(markers: Sequence[Marker]) -> str:
    known = [m for m in markers if m.orbit.found]
    errors = [m.low / m.orbit.amplitude - 1 for m in known]
    return f"{len(known)} frequencies, {span(errors)}"


def why_five(e: Evidence) -> str:
    """Say what the harmonics above five do at the strong case: every number is computed."""
    t, cut = e.in_time, e.in_time.truncation
    own = lines_of(e.model, t.pair.problem, t.pair.high)
    timed, shut = smallest_in_time(e.model, t.orbit), open_in_time(e.model, t.orbit)
    names = [x.name for x in own]
    opens = [
        f"{x.name} {percent(shut[x.name], 2)} in time, {percent(x.open, 2)} with five"
        for x in own
        if max(shut[x.name], x.open) > 0.0
    ]
    lifted = f"Open: {'; '.join(opens)}" if opens else "Nothing opens"
    forces = f"smallest normal forces on {'/'.join(names)} {'/'.join(f'{max(timed[n], 0.0):.1f}' for n in names)} N in time, {'/'.join(f'{max(x.smallest, 0.0):.1f}' for x in own)} N with five"
    worst = max(cut.by_line, key=lambda n: abs(cut.by_line[n]))
    ladder = ", ".join(f"{signed(v)} with {k}" for k, v in cut.errors.items())
    reached = f"within 1 % from {cut.within} on" if cut.within else "never within 1 %"
    return (
        f"At {t.pair.hertz:.2f} Hz: {ladder}: {reached}. {lifted}; {forces}. If the contacts see the best of these motions only up to harmonic five, one Newton step moves the amplitude by {signed(cut.whole)}: "
        f"by direction {', '.join(f'{n} {signed(v)}' for n, v in cut.by_direction.items())}, by line {', '.join(f'{n} {signed(v)}' for n, v in cut.by_line.items())}. "
        f"On {worst} the motion above harmonic five is {cut.spring[worst]:.1f} N of spring force beside a friction limit of {cut.limit[worst]:.1f} N, and its points turn between stick and slip {cut.switches[worst][1]:.0f} times a period, "
        f"{cut.switches[worst][0]:.0f} times with five. {_magnified(cut)} Begun at the best of these solutions the motion in time differs by {percent(cut.other_motion, 2)} from that begun at five."
    )


def _magnified(cut: Truncation) -> str:
    numbers = f"friction takes {percent(cut.friction, 2)} of the work, and the amplitude grows by {cut.sensitivity:.2f} % for 1 % of force."
    if cut.sensitivity <= 1.0:
        return "Little damping does not magnify it: " + numbers
    return "The resonance magnifies errors of the forces: " + numbers


def _of_spectrum(e: Evidence) -> Statement:
    found = [p.higher for p in e.slipping]
    return Statement(
        section="4.5.4",
        claim="The first harmonic of the response is typically orders of magnitude larger than all others",
        number="orders of magnitude",
        own=f"largest other harmonic at the tip: median {percent(median(found), 2)} of the first, at most {percent(max(found), 2)}, over {len(found)} slipping frequencies",
        verdict=judged(median(found) < OVERLAP),
        why=f"Median {percent(median(found), 2)}.",
    )


def _of_fig4(e: Evidence) -> list[Statement]:
    ratio = e.plan.strong
    strong = e.pairs[ratio]
    top = max(p.problem.amplitude(p.high) for p in strong)
    far = [p for p in strong if p.problem.amplitude(p.high) < top / 4]
    differ = [p for p in far if p.real > OVERLAP]
    alarms = [p for p in e.every_pair if p.predicted > THRESHOLD]
    quiet = [p for p in e.every_pair if p.predicted <= THRESHOLD]
    missed, false = ([p for p in quiet if p.real > THRESHOLD], [p for p in alarms if p.real <= THRESHOLD])
    alert = e.at(ratio).alert
    few = e.at(ratio).low.points[0].order
    many = [p.omega / HZ for p in alert.points if p.order > few]
    right = [p for p in e.slipping if p not in missed and p not in false]
    return [
        Statement(
            section="6",
            place="Fig. 4a",
            claim="Far from resonance the curves of one and five harmonics overlap",
            own=f"ratio {ratio:g}: {len(far) - len(differ)} of {len(far)} frequencies below a quarter of the peak differ by less than 1 %; the others: {interval([p.hertz for p in differ])}",
            verdict="not tested" if not far else judged(not differ),
            by="" if far else "0 frequencies below a quarter of the peak",
            why=f"At the others contacts slip for {percent(median([p.slip for p in differ]), 2)} of the time (median) although the response is at most {percent(max((p.problem.amplitude(p.high) / top for p in differ), default=np.nan), 2)} of the peak.",
        ),
        Statement(
            section="6",
            place="Fig. 4b",
            claim="The alert speaks if and only if the solution with five harmonics differs",
            own=f"{len(alarms)} alarms at {len(e.every_pair)} frequencies of {len(e.pairs)} ratios; missed {len(missed)}, false {len(false)}; on the branch of ratio {ratio:g} five harmonics: {interval(many)}",
            verdict="not tested" if not alarms else judged(not missed and not false),
            by="" if alarms else "0 alarms",
            why=_misses(missed, false, right),
        ),
    ]


def _misses(missed: Sequence[Pair], false: Sequence[Pair], right: Sequence[Pair]) -> str:
    found = [
        f"{word} {p.hertz:.2f} Hz at {p.ratio:g} ({percent(p.predicted)} predicted, {percent(p.real)} actual)"
        for word, some in (("missed", missed), ("false", false))
        for p in some[:4]
    ]
    return sentence("; ".join([*found, states_said(right, [*missed, *false])]))


def _lift_off(e: Evidence) -> Statement:
    t = e.in_time
    own = lines_of(e.model, t.pair.problem, t.pair.high)
    shut, least = open_in_time(e.model, t.orbit), smallest_in_time(e.model, t.orbit)
    slips = any(x.slip > 0.0 for x in own)
    opens = any(v > 0.0 for v in shut.values())
    return Statement(
        section="6.1",
        claim="In the strongly nonlinear case contact points slip and lift off",
        number="ratio 2",
        own=f"{which(e)}, {t.pair.hertz:.2f} Hz: slip for "
        + ", ".join(f"{percent(x.slip, 2)} on {x.name}" for x in own)
        + " of the time with five harmonics; open in time for "
        + ", ".join(f"{percent(v, 2)} on {n}" for n, v in shut.items()),
        verdict=judged(slips and opens),
        by="" if opens else "nothing lifts off",
        why="Smallest normal forces in time: " + ", ".join(f"{n} {v:.1f} N" for n, v in least.items()) + ".",
    )


def _low_peaks(e: Evidence) -> list[Statement]:
    t = e.in_time
    own = e.at(t.ratio)
    marks = [m for m in t.markers if m.orbit.found]
    top = max(marks, key=lambda m: m.orbit.amplitude, default=None)
    exact = max(t.orbit.amplitude, top.orbit.amplitude if top else 0.0)
    hertz = top.orbit.hertz if top and top.orbit.amplitude >= t.orbit.amplitude else t.orbit.hertz
    low = own.low.amplitudes.max() / exact - 1.0
    shift = own.low.peak.omega / HZ - hertz
    step = np.diff(e.plan.hertz)[0] / max(e.plan.frequencies - 1, 1)
    others = [x for x in e.timing if x.periodic and x.ratio != t.ratio]
    size = ", ".join(f"{signed(x.error('low'))} at {x.ratio:g}" for x in others)
    places = ", ".join(f"{x.low.peak.omega / HZ - x.reference_hertz:+.2g} Hz at {x.ratio:g}" for x in others)
    work = _work_shares(e)
    unknown = [m.orbit.hertz for m in t.markers if not m.orbit.found and abs(m.orbit.hertz - hertz) < abs(shift) + step]
    above = [x.ratio for x in others if x.error("low") > 0.0]
    lower = [x.ratio for x in others if x.low.peak.omega / HZ < x.reference_hertz]
    return [
        Statement(
            section="6.1",
            place="Fig. 4a",
            claim="One harmonic underestimates the amplitude at resonance",
            own=f"{which(e)}: peak of one harmonic {signed(low)} against time integration; on equally spaced frequencies {size}",
            verdict=judged(low < 0.0) if t.orbit.found else "not tested",
            by=(f"the opposite at {listed(above)}" if above else "")
            if t.orbit.found
            else f"no periodic motion at {listed(e.plan.time_ratios)}",
            why=f"For the square of the amplitude the contacts dissipate {signed(work[0])} with one harmonic against time, and {signed(work[1])} with five, at {t.pair.hertz:.2f} Hz.",
        ),
        Statement(
            section="6.1",
            place="Fig. 4a",
            claim="One harmonic overestimates the resonance frequency",
            own=f"{which(e)}: peak of one harmonic {shift:+.2f} Hz from that in time (frequencies {step:g} Hz apart); on equally spaced frequencies {places}",
            verdict=("undecided" if abs(shift) < step or unknown else judged(shift > 0.0))
            if t.orbit.found
            else "not tested",
            by=f"the shift is less than the {step:g} Hz between frequencies in time"
            if abs(shift) < step
            else f"the peak in time may stand at {listed(unknown)} Hz, where no periodic motion was found"
            if unknown
            else f"the opposite at {listed(lower)}"
            if lower
            else "",
            why=f"The peak lies {-shift:.2g} Hz lower; {states_said(_overlapping(e), [t.pair])}.",
        ),
    ]


def _overlapping(e: Evidence) -> list[Pair]:
    return [p for p in e.slipping if p.real < ONE_PERCENT]


def _work_shares(e: Evidence) -> list[float]:
    t = e.in_time
    exact = _work(t.orbit.gap, t.orbit.force)
    points = (t.pair.low, t.pair.high)
    work = [float(np.sum(fields(t.pair.problem, p).energy)) for p in points]
    size = [t.pair.problem.amplitude(p) / t.orbit.amplitude for p in points]
    return [w / exact / a**2 - 1 for w, a in zip(work, size, strict=True)]


def _of_cycles(e: Evidence) -> list[Statement]:
    t = e.in_time
    pair, orbit = t.pair, t.orbit
    swing = orbit.rotation - orbit.rotation.mean()
    own = [time_signal(pair.problem, p, e.model.rotation, len(swing)) for p in (pair.low, pair.high)]
    few, many = (float(np.linalg.norm(v - v.mean() - swing) / np.linalg.norm(swing)) for v in own)
    exact = _work(orbit.gap, orbit.force)
    work = [float(np.sum(fields(pair.problem, p).energy)) / exact - 1 for p in (pair.low, pair.high)]
    where = f"{which(e)}, {pair.hertz:.2f} Hz"
    tested = orbit.found
    cut = t.truncation
    return [
        Statement(
            section="6.1",
            place="Fig. 5a",
            claim="The damper rotation with five harmonics merges with the integration, that with one does not",
            own=f"{where}: root-mean-square difference from the integration {percent(few)} with one, {percent(many)} with five harmonics",
            verdict=judged(many < THRESHOLD < few) if tested else "not tested",
            by="" if tested else f"no periodic motion at {listed(e.plan.time_ratios)}",
            why=f"Five are {percent(many)} off, one {percent(few)}: what five leave out moves the amplitude by {signed(cut.whole)}, {', '.join(f'{signed(v)} on {n}' for n, v in cut.by_line.items())} (see the row of section 4.5.2).",
        ),
        Statement(
            section="6.1",
            place="Fig. 5b, c",
            claim="The hysteresis cycles with one harmonic are not well estimated, those with five are",
            own=f"{where}: energy dissipated in a cycle against the integration {signed(work[0])} with one, {signed(work[1])} with five",
            verdict=judged(abs(work[1]) < THRESHOLD < abs(work[0])) if tested else "not tested",
            by="" if tested else f"no periodic motion at {listed(e.plan.time_ratios)}",
            why=f"The areas differ by {signed(work[0])} and {signed(work[1])}.",
        ),
        Statement(
            section="6.1",
            claim="One harmonic finds an equilibrium with other contact states",
            own=f"{where}: {percent(pair.states)} of the contact directions and instants differ in state between one and five harmonics",
            verdict=judged(pair.states > OVERLAP),
            why=f"Only {percent(pair.states, 2)} differ.",
        ),
    ]


def _work(gap: FloatArray, force: FloatArray) -> float:
    """Return the work of the tangential forces over a closed period, J, as a sum of trapezoids."""
    g, f = (np.concatenate([v[-1:], v])[:, :, :2] for v in (gap, force))
    return float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(g, axis=0)))


def _warned(e: Evidence) -> Statement:
    t = e.in_time
    near = e.pairs.get(t.ratio) or [t.pair]
    rows = []
    for m in t.markers:
        pair = min(near, key=lambda p: abs(p.hertz - m.orbit.hertz))
        if m.orbit.found:
            rows.append((m.orbit.hertz, abs(m.low / m.orbit.amplitude - 1), pair.predicted))
    wrong = [r for r in rows if r[1] > THRESHOLD]
    missed = [r for r in wrong if r[2] <= THRESHOLD]
    return Statement(
        section="6.1",
        place="Fig. 4b",
        claim="The alert warns where one harmonic differs from time integration",
        number="[168, 173] Hz",
        own=f"{which(e)}: one harmonic is more than 5 % off the integration at {len(wrong)} of {len(rows)} frequencies, {interval([r[0] for r in wrong])}; the alert speaks at {len(wrong) - len(missed)} of them",
        verdict="not tested" if not wrong else judged(not missed),
        by="" if wrong else "0 frequencies at which one harmonic is more than 5 % off",
        why=sentence("; ".join(f"{h:.2f} Hz: {percent(p)} predicted, {percent(a)} actual" for h, a, p in missed)),
    )
