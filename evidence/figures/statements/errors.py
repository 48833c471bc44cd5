"""Section 6.2: predicted and actual errors (fig. 6, 7a)."""

from collections.abc import Sequence

import numpy as np

from evidence.figures.evidence import Evidence
from evidence.figures.solve import Pair
from evidence.figures.statements.statement import (
    LARGE,
    SMALL,
    THRESHOLD,
    Statement,
    Verdict,
    interval,
    judged,
    median,
    percent,
    sentence,
    states_said,
)
from stickslip.arrays import FloatArray

FAINT = 5e-4  # actual errors below it may exceed the predicted ones
DIAGONAL = 0.25  # relative distance from the diagonal that still counts as on it


def statements_of_errors(e: Evidence) -> list[Statement]:
    """Return the rows of figures 6 and 7a."""
    return [_stuck(e), _weak(e), _strong(e), *_sides(e), *_diagonal(e)]


def _stuck(e: Evidence) -> Statement:
    stuck = [p for p in e.every_pair if p.stuck]
    noise = max((max(p.predicted, p.real) for p in stuck), default=np.nan)
    return Statement(
        section="6.2",
        place="Fig. 6",
        claim="Predicted and actual errors are zero where the contacts are in full stick",
        number="0",
        own=f"{len(stuck)} frequencies in full stick: at most {percent(noise, 2)}",
        verdict=judged(noise < 1e-6) if stuck else "not tested",
        by="" if stuck else "0 frequencies in full stick",
        why=f"What is left, {percent(noise, 2)}, is the tolerance of the solver.",
    )


def _weak(e: Evidence) -> Statement:
    ratio = e.plan.weak
    found = e.pairs[ratio]
    some = [p for p in found if not p.stuck]
    worst = max(found, key=lambda p: max(p.predicted, p.real))
    error = max(worst.predicted, worst.real)
    asked = [p.hertz for p in found if p.predicted > THRESHOLD]
    accepted = [p for p in some if p.predicted <= THRESHOLD]
    return Statement(
        section="6.2",
        place="Fig. 6a",
        claim=f"F_CL/F_HE = {ratio:g}: both errors stay below 5 %, one harmonic is enough",
        number="slip in [179, 185] Hz",
        own=f"slip at {interval([p.hertz for p in some])} ({len(some)} of {len(found)} frequencies); largest error {percent(error)}; the alert asks at {len(asked)}",
        verdict="not tested" if not some else judged(error < THRESHOLD),
        by="" if some else "0 frequencies slip",
        why=f"At {worst.hertz:.2f} Hz contacts slip for {percent(worst.slip, 2)} and are open for {percent(worst.opened, 2)} of the time, where one harmonic is accepted for {percent(median([p.slip for p in accepted]), 2)} (median): this ratio is not weak here.",
    )


def _strong(e: Evidence) -> Statement:
    """Judge both ratios that the paper names."""
    verdicts, own = [], []
    for ratio in sorted({e.plan.strong, e.plan.strongest}, reverse=True):
        found = sorted(e.pairs[ratio], key=lambda p: p.hertz)
        asked = [p.predicted > THRESHOLD for p in found]
        runs = int(np.sum(np.diff(np.array([False, *asked]).astype(int)) == 1))
        hertz = [p.hertz for p, a in zip(found, asked, strict=True) if a]
        below = [p for p in found if p.hertz <= e.plan.branch_hertz[1]]
        peak = max(below or found, key=lambda p: p.problem.amplitude(p.high))
        inside = bool(hertz) and min(hertz) <= peak.hertz <= max(hertz)
        ends = asked[0] or asked[-1]
        verdicts.append(inside and runs == 1 and not ends)
        edge = max(found[0].predicted, found[-1].predicted)
        own.append(
            f"ratio {ratio:g}: alarms at {sum(asked)} of {len(found)} frequencies, {interval(hertz)}, in {runs} interval{'' if runs == 1 else 's'}; "
            f"peak with five harmonics at {peak.hertz:.2f} Hz; at most {percent(edge, 2)} predicted at the ends of the range"
            + (f"; {len(e.unsolved[ratio])} frequencies not found" if e.unsolved[ratio] else "")
        )
    same = all(verdicts) or not any(verdicts)
    names = [f"{r:g}" for r in sorted({e.plan.strong, e.plan.strongest}, reverse=True)]
    verdict: Verdict = judged(all(verdicts)) if same else "undecided"
    told = ", ".join(f"{'holds' if v else 'does not hold'} at {r}" for v, r in zip(verdicts, names, strict=True))
    return Statement(
        section="6.2",
        place="Fig. 6b",
        claim="Strong case (2 in the caption, 5 in the text): five harmonics are needed in one interval around the resonance, and not outside it",
        number="[171, 177] Hz",
        own="; ".join(own),
        verdict=verdict,
        by="" if same else told,
        why=_gaps(e),
    )


def _gaps(e: Evidence) -> str:
    """Say what stands between the intervals of alarms."""
    said = []
    for ratio in sorted({e.plan.strong, e.plan.strongest}, reverse=True):
        found = sorted(e.pairs[ratio], key=lambda p: p.hertz)
        hertz = [p.hertz for p in found if p.predicted > THRESHOLD]
        if not hertz:
            said.append(f"no alarm at {ratio:g}")
            continue
        ends = [p for p in (found[0], found[-1]) if p.predicted > THRESHOLD]
        said += [
            f"at {ratio:g} {percent(p.predicted, 2)} are predicted at the end of the range, {p.hertz:.2f} Hz"
            for p in ends
        ]
        between = [p for p in found if min(hertz) < p.hertz < max(hertz) and p.predicted <= THRESHOLD]
        if between:
            said.append(
                f"accepted between alarms at {ratio:g}: {interval([p.hertz for p in between])} ({len(between)}), predicted up to {percent(max(p.predicted for p in between), 2)}, actual up to {percent(max(p.real for p in between), 2)}"
            )
    return sentence("; ".join(said) or "0 frequencies between alarms are accepted, but the peak lies outside")


def _sides(e: Evidence) -> list[Statement]:
    every, some = e.every_pair, e.slipping
    accepted = [p for p in every if p.predicted < THRESHOLD]
    broken = [p for p in accepted if p.real >= THRESHOLD]
    kept = [p for p in accepted if p.real < THRESHOLD and not p.stuck]
    lower = [p for p in some if p.real < p.predicted]
    higher = [p for p in some if p.real > p.predicted]
    loud = [p for p in higher if p.real > FAINT]
    largest = max((p.real for p in loud), default=np.nan)
    return [
        Statement(
            section="6.2",
            place="Fig. 6, 7a",
            claim="Where the predicted error is below 5 % the actual one is, too",
            number="always",
            own=f"{len(broken)} of {len(accepted)} accepted frequencies break it" + _broken(broken),
            verdict=judged(not broken),
            why=sentence(states_said(kept, broken)),
        ),
        Statement(
            section="6.2",
            place="Fig. 6",
            claim="In most cases the actual error is below the predicted one",
            number="most",
            own=f"{len(lower)} of {len(some)} slipping frequencies",
            verdict=judged(len(lower) > len(some) / 2),
            by=percent(len(lower) / len(some)),
            why=sentence(states_said(lower, higher)),
        ),
        Statement(
            section="6.2",
            place="Fig. 7a",
            claim="The actual error exceeds the predicted one only below 0.05 %",
            number="0.05 %",
            own=f"at {len(higher)} frequencies, {len(loud)} of them above 0.05 %"
            + (f"; largest actual error among them {percent(largest)}" if loud else ""),
            verdict=judged(not loud),
            why=f"The prediction is the first Newton step from one harmonic; what it leaves out has either sign, + at {len(loud)} and - at {sum(p.real > FAINT for p in lower)} of the frequencies above 0.05 %; it is {percent(median([abs(p.real / p.predicted - 1) for p in loud]), 2)} of the prediction at the former (median).",
        ),
    ]


def _broken(broken: Sequence[Pair]) -> str:
    return "".join(
        f"; {p.hertz:.2f} Hz at {p.ratio:g}: {percent(p.predicted)} predicted, {percent(p.real)} actual" for p in broken
    )


def _diagonal(e: Evidence) -> list[Statement]:
    some = e.slipping
    band = [p for p in some if SMALL <= p.predicted <= LARGE]
    quotient = np.array([p.real / p.predicted for p in band])
    on = [p for p in band if abs(p.real / p.predicted - 1) <= DIAGONAL]
    off = [p for p in band if p not in on]
    above = [p for p in some if p.predicted > LARGE]
    wide = np.array([p.real / p.predicted for p in above])
    span_of = f"{np.min(quotient):.2g} to {np.max(quotient):.2g}" if band else "none"
    beyond = f"{np.min(wide):.2g} to {np.max(wide):.2g}" if above else "none"
    spread = [_middle_half(v) for v in (quotient, wide)]
    return [
        Statement(
            section="6.2",
            place="Fig. 7a",
            claim="Between 0.5 and 5 % all points lie on the diagonal",
            number="all",
            own=f"{len(on)} of {len(band)} within {percent(DIAGONAL, 2)} of it; actual/predicted {span_of}, median {median(list(quotient)):.3g}",
            verdict="not tested" if not band else judged(not off),
            by="" if band else "0 frequencies in the band",
            why=sentence(states_said(on, off)),
        ),
        Statement(
            section="6.2",
            place="Fig. 7a",
            claim="There the actual error is slightly lower",
            number="slightly",
            own=f"lower at {int(np.sum(quotient < 1))} of {len(band)}, median of actual/predicted {median(list(quotient)):.3g}",
            verdict="not tested"
            if not band
            else judged(bool(np.median(quotient) < 1.0 and np.sum(quotient < 1) > len(band) / 2)),
            by="" if band else "0 frequencies in the band",
            why=f"It is lower at {int(np.sum(quotient < 1))}, higher at {int(np.sum(quotient >= 1))} of {len(band)}; median {median(list(quotient)):.3g}.",
        ),
        Statement(
            section="6.2",
            place="Fig. 7a",
            claim="Above 5 % the proportionality is lost",
            own=f"{len(above)} frequencies: actual/predicted {beyond}, in the band {span_of}; their middle halves spread over factors of {np.exp(spread[1]):.2g} and {np.exp(spread[0]):.2g} (judged by these, as ranges grow with the number of frequencies)",
            verdict="not tested" if not above else judged(spread[1] > spread[0]),
            by="" if above else "0 alarms",
            why=f"The middle half of the quotients spreads over a factor of {np.exp(spread[1]):.2g} above 5 % and of {np.exp(spread[0]):.2g} in the band.",
        ),
        _other_damper(e),
    ]


def _middle_half(quotient: FloatArray) -> float:
    """Return the logarithm of the upper quartile over the lower one; unlike a range it does not grow with the number of values."""
    if not len(quotient):
        return 0.0
    low, high = np.percentile(np.log(quotient), [25, 75])
    return float(high - low)


def _other_damper(e: Evidence) -> Statement:
    second = [p for found in e.second_pairs.values() for p in found if not p.stuck and SMALL <= p.predicted <= LARGE]
    on = [p for p in second if abs(p.real / p.predicted - 1) <= DIAGONAL]
    off = [p for p in second if p not in on]
    other = [p.real / p.predicted for p in second]
    said = f"actual/predicted {min(other):.2g} to {max(other):.2g}, median {median(other):.3g}" if other else "none"
    return Statement(
        section="6.2",
        claim="The interval of proportionality does not depend on the damper",
        own=f"second damper, {len(second)} frequencies that slip in the band: {said}",
        verdict="not tested" if not second else judged(not off),
        by="" if second else "0 frequencies of the second damper lie in the band",
        why=sentence(states_said(on, off)),
    )
