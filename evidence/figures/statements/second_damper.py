"""Section 7: the second damper (fig. 9 to 11). What rests on slipping contacts is judged only where contacts slip and all lines carry load."""

from collections.abc import Sequence

import numpy as np

from evidence.figures.evidence import Evidence, Peaks
from evidence.figures.reasons import Line, lines_of, used_friction
from evidence.figures.solve import HZ, Pair
from evidence.figures.statements.statement import (
    ONE_PERCENT,
    OVERLAP,
    THRESHOLD,
    Statement,
    Verdict,
    judged,
    listed,
    percent,
    sentence,
)
from stickslip.response import fields, signals

STUCK, SOME = (230.0, 30.0)  # ratios above which the paper's damper sticks, and below which some points slip
SHUT = 0.5  # of the time: a line that is open for more carries no load
TIMES = 2.0  # an optimum that is so many times as high as the other damper's is no working range


def statements_of_second_damper(e: Evidence) -> list[Statement]:
    """Return the rows of section 7, in the order of the paper."""
    state = {p.ratio: lines_of(e.second, p.high.problem, p.high.peak) for p in e.second_peaks}
    return [
        _fully_stuck(e, state),
        _optimisation(e, state),
        _some_slip(e, state),
        _overlap(e, state),
        _never(e, state),
        _glued(e, state),
        _near_stuck(e, state),
        *_cycles(e, state),
        _not_effective(e, state),
    ]


def _flat(e: Evidence) -> list[str]:
    return list(dict.fromkeys(e.second.lines[i] for i in e.second.flat))


def _missing(e: Evidence, ratio: float, lines: Sequence[Line], slip: bool = True) -> str:
    """Say what the case lacks for a statement about slip at a ratio; nothing if it is tested."""
    said = [
        f"{x.name} is open for {percent(x.open, 2)} of the time" for x in lines if x.name in _flat(e) and x.open > SHUT
    ]
    if slip and not any(x.slip > 0.0 for x in lines):
        peaks = next(p for p in e.second_peaks if p.ratio == ratio)
        most = used_friction(e.second, peaks.high.problem, peaks.high.peak)
        used = ", ".join(f"{name} {percent(v, 2)}" for name, v in most.items())
        said.append(f"0 points slip (at most of their friction limit: {used})")
    return f"at {ratio:g} {' and '.join(said)}" if said else ""


def _tested(e: Evidence, state: dict[float, list[Line]], ratios: Sequence[float], slip: bool = True) -> str:
    """Say what is missing at each of some ratios; nothing if all are tested."""
    said = [_missing(e, r, state[r], slip) for r in ratios]
    found = [text for text in said if text]
    more = f"; the same or alike at {len(found) - 2} more" if len(found) > 2 else ""
    return "; ".join(found[:2]) + more


def _verdict(missing: str, holds: bool) -> Verdict:
    return "not tested" if missing else judged(holds)


def _states(lines: Sequence[Line]) -> str:
    return ", ".join(f"{x.name} slips {percent(x.slip, 2)} and is open {percent(x.open, 2)}" for x in lines)


def _peaks(e: Evidence, ratio: float) -> Peaks:
    return next(p for p in e.second_peaks if p.ratio == ratio)


def _fully_stuck(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    high = [r for r in state if r > STUCK]
    moving = [x for r in high for x in state[r] if x.slip > 0.0 or x.open > 0.0]
    missing = _tested(e, state, high, slip=False) if high else "0 ratios above 230"
    return Statement(
        section="7",
        claim="Above a ratio of 230 the damper is fully stuck",
        number="> 230",
        own=f"peak at {listed(high)}: " + "; ".join(_states(state[r]) for r in high) + " of the time",
        verdict=_verdict(missing, not moving),
        by=missing,
        why=sentence(
            "; ".join(
                f"{x.name} slips for {percent(x.slip, 2)} and is open for {percent(x.open, 2)} of the time, {x.mean:.1f} N on average"
                for x in moving
            )
        ),
    )


def _optimisation(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    ratios = [r for r in state if r >= min(e.second_plan.ratios)]
    gaps = {
        p.ratio: abs(p.alert.amplitudes.max() / p.low.amplitudes.max() - 1) for p in e.second_peaks if p.ratio in ratios
    }
    asked = {p.ratio: p.alert.repeats for p in e.second_peaks if p.ratio in ratios}
    missing = _tested(e, state, e.second_plan.ratios)
    return Statement(
        section="7",
        place="Fig. 9",
        claim=f"On the optimisation curves of the {e.second_plan.mode} the alert confirms one harmonic at every ratio",
        own=f"{e.second_plan.hertz[0]:g} to {e.second_plan.hertz[1]:g} Hz: largest difference of a peak {percent(max(gaps.values()), 2)}; points solved again: "
        + ", ".join(f"{n} at {r:g}" for r, n in asked.items()),
        verdict=_verdict(missing, not any(asked.values())),
        by=missing,
        why=sentence("; ".join(f"{_states(state[r])} of the time at {r:g}" for r, n in asked.items() if n)),
    )


def _some_slip(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    ratios = [r for r in e.second_plan.ratios if r < SOME]
    slip = {r: any(x.slip > 0.0 for x in state[r]) for r in ratios}
    missing = _tested(e, state, ratios, slip=False) if ratios else "0 ratios below 30"
    return Statement(
        section="7",
        claim="Below a ratio of 30 at least some of the contact points reach slip",
        number="< 30",
        own="; ".join(f"peak at {r:g}: {_states(state[r])} of the time" for r in ratios),
        verdict=_verdict(missing, all(slip.values())),
        by=missing,
        why=sentence(_tested(e, state, ratios)),
    )


def _overlap(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    own, worst = [], 0.0
    for ratio in e.second_plan.ratios:
        pair = e.second_pairs[ratio]
        few, many = (
            np.array([p.problem.amplitude(x) for p, x in zip(pair, points, strict=True)])
            for points in ([p.low for p in pair], [p.high for p in pair])
        )
        peaks = _peaks(e, ratio)
        top = peaks.high.amplitudes.max()
        gap = float(np.max(np.abs(few - many)) / top)
        height = abs(peaks.low.amplitudes.max() / top - 1)
        worst = max(worst, gap, height)
        own.append(f"{ratio:g}: largest difference {percent(gap, 2)} of the peak, peaks {percent(height, 2)}")
    missing = _tested(e, state, e.second_plan.ratios)
    return Statement(
        section="7",
        place="Fig. 10",
        claim="At 23.4 and 11.7 the curves with one and five harmonics overlap",
        number="overlap",
        own="; ".join(own),
        verdict=_verdict(missing, worst < OVERLAP),
        by=missing,
        why=sentence("; ".join(f"{_states(state[r])} of the time at the peak of {r:g}" for r in e.second_plan.ratios)),
    )


def _never(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    asked = {r: _peaks(e, r).alert.repeats for r in e.second_plan.ratios}
    missing = _tested(e, state, e.second_plan.ratios)
    return Statement(
        section="7",
        place="Fig. 10",
        claim="The alert never asks for more than one harmonic",
        number="never",
        own="points solved again: " + ", ".join(f"{n} at {r:g}" for r, n in asked.items()),
        verdict=_verdict(missing, not any(asked.values())),
        by=missing,
        why=sentence(_where_asked(e)),
    )


def _where_asked(e: Evidence) -> str:
    said = []
    for ratio in e.second_plan.ratios:
        loud = [p for p in e.second_pairs[ratio] if p.predicted > THRESHOLD]
        if loud:
            worst = max(loud, key=lambda p: p.predicted)
            lines = lines_of(e.second, worst.problem, worst.high)
            said.append(
                f"{ratio:g}: {percent(worst.predicted, 2)} predicted at {worst.hertz:.2f} Hz, {percent(worst.real, 2)} actual, where {_states(lines)} of the time"
            )
    return "; ".join(said) or "0 of the equally spaced frequencies ask"


def _glued(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    slip = {r: max(x.slip for x in lines if x.name in _flat(e)) for r, lines in state.items()}
    moving = [r for r in slip if slip[r] > 0.0]
    missing = _tested(e, state, list(state), slip=False)
    return Statement(
        section="7",
        claim="The flat side does not slip, even at ratios lower than the rig can impose",
        number="even lower than on the rig",
        own="slip of the flat side at the peak, at most: "
        + ", ".join(f"{percent(v, 2)} of the time at {r:g}" for r, v in slip.items()),
        verdict=_verdict(missing, not moving),
        by=missing,
        why=sentence("; ".join(f"{_states(state[r])} of the time at {r:g}" for r in moving)),
    )


def _near_stuck(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    stuck, last = _peaks(e, max(p.ratio for p in e.second_peaks)), _peaks(e, e.second_plan.ratios[-1])
    missing = _tested(e, state, [stuck.ratio, last.ratio], slip=False)
    shift = last.high.peak.omega / stuck.high.peak.omega - 1
    height = last.high.amplitudes.max() * last.ratio / (stuck.high.amplitudes.max() * stuck.ratio)
    return Statement(
        section="7",
        claim="At 11.7 the dynamics of the damper are quite close to full stick",
        own=f"peak at {last.ratio:g}: {last.high.peak.omega / HZ:.2f} Hz, {percent(shift, 2)} from that at {stuck.ratio:g}; amplitude for a unit of force {percent(height)} of it (judged by the frequency)",
        verdict=_verdict(missing, abs(shift) < ONE_PERCENT),
        by=missing,
        why=f"The frequency differs by {percent(shift, 2)}.",
    )


def _cycles(e: Evidence, state: dict[float, list[Line]]) -> list[Statement]:
    ratio = e.second_plan.ratios[-1]
    pair = max(e.second_pairs[ratio], key=lambda p: p.problem.amplitude(p.high))
    missing = _missing(e, ratio, state[ratio])
    cycles = _cycle_difference(pair)
    few, many = (fields(pair.problem, p).forces[1] for p in (pair.low, pair.high))
    first = float(np.linalg.norm(few - many) / np.linalg.norm(many))
    where = f"{pair.hertz:.2f} Hz, ratio {ratio:g}"
    lines = _states(lines_of(e.second, pair.problem, pair.high))
    return [
        Statement(
            section="7",
            place="Fig. 11",
            claim="The hysteresis cycles with one and five harmonics overlap at resonance",
            number="overlap",
            own=f"{where}: root-mean-square difference of the tangential forces {percent(cycles)} of their swing, of the outputs {percent(pair.real, 2)}",
            verdict=_verdict(missing, cycles < OVERLAP),
            by=missing,
            why=f"{lines} of the time; contact states differ at {percent(pair.states, 2)} of the directions and instants.",
        ),
        Statement(
            section="7",
            claim="The first harmonic of the contact forces is equal in both cases",
            number="equal",
            own=f"{where}: difference {percent(first, 2)}",
            verdict=_verdict(missing, first < ONE_PERCENT),
            by=missing,
            why=f"{lines} of the time; contact states differ at {percent(pair.states, 2)} of the directions and instants.",
        ),
    ]


def _cycle_difference(pair: Pair) -> float:
    few, many = (signals(pair.problem, p).force[:, :2] for p in (pair.low, pair.high))
    few, many = (v - v.mean(axis=-1, keepdims=True) for v in (few, many))
    return float(np.linalg.norm(few - many) / np.linalg.norm(many))


def _best(peaks: Sequence[Peaks]) -> tuple[float, float]:
    """Return the ratio with the smallest peak for a unit of force, and that over the stuck one."""
    unit = peaks[0].high.amplitudes.max() * peaks[0].ratio
    found = [(p.high.amplitudes.max() * p.ratio / unit, p.ratio) for p in peaks]
    height, ratio = min(found)
    return ratio, height


def _not_effective(e: Evidence, state: dict[float, list[Line]]) -> Statement:
    measured = [p for p in e.second_peaks if p.ratio >= min(e.second_plan.ratios)]
    (at, own), (beyond, lowest), (first_at, first) = (_best(p) for p in (measured, e.second_peaks, e.peaks))
    missing = _tested(e, state, [p.ratio for p in measured], slip=False)
    return Statement(
        section="7",
        claim="Such a damper should be much more nonlinear to be effective (judged: how far it lowers the peak down to 11.7)",
        own=f"smallest peak for a unit of force down to {min(e.second_plan.ratios):g}: {percent(own)} of the stuck one, at {at:g}; down to {e.second_peaks[-1].ratio:g}: {percent(lowest)} at {beyond:g}; first damper, first bending: {percent(first)} at {first_at:g}",
        verdict=_verdict(missing, own > TIMES * first),
        by=missing,
        why=f"It lowers the peak to {percent(own)}, the first damper to {percent(first)}.",
    )
