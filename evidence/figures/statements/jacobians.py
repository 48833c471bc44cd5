"""Section 6.2: how alike the Jacobians of one and five harmonics are (eq. 30, 31)."""

import numpy as np

from evidence.figures.evidence import Evidence
from evidence.figures.solve import Pair
from evidence.figures.statements.statement import THRESHOLD, Statement, judged, median, percent, rank_correlation, span

ALERTED_OFF = 1 - 0.994  # how far the mean of Γ's diagonal is from 1 in the paper's case above tolerance
WEAK, STRONG = 0.032, 0.04  # ΔJ of the paper's weak case, and what is exceeded beyond the tolerance
ZEROS = (0.997, 0.968)  # shares of zero terms off Γ's diagonal that the paper prints, weak and above tolerance


def statements_of_jacobians(e: Evidence) -> list[Statement]:
    """Return the rows of ΔJ% and Γ."""
    quiet = [p for p in e.slipping if p.predicted <= THRESHOLD]
    loud = [p for p in e.slipping if p.predicted > THRESHOLD]
    return [
        _stuck(e),
        _change(quiet, loud),
        _weak_trace(quiet),
        _zeros(quiet),
        _less(quiet, loud),
        _subtle(quiet, loud),
    ]


def _stuck(e: Evidence) -> Statement:
    stuck = [p.similarity for p in e.every_pair if p.stuck]
    change = max((s.change for s in stuck), default=np.nan)
    trace = max((abs(s.mean_diagonal - 1) for s in stuck), default=np.nan)
    return Statement(
        section="6.2",
        claim="In full stick ΔJ% = 0 and Γ is the identity",
        number="0",
        own=f"{len(stuck)} frequencies: ΔJ at most {percent(change, 2)}, the mean of Γ's diagonal at most {percent(trace, 2)} from 1",
        verdict=judged(max(change, trace) < 1e-6) if stuck else "not tested",
        by="" if stuck else "0 frequencies in full stick",
        why=f"ΔJ is {percent(change, 2)}.",
    )


def _units(some: list[Pair]) -> str:
    own, raw = ([v(p) for p in some] for v in (lambda p: p.similarity.change, lambda p: p.change_si))
    return f"{percent(median(own))} ({span(own)}), in metres and radians {percent(median(raw))} ({span(raw)})"


def _change(quiet: list[Pair], loud: list[Pair]) -> Statement:
    some = [*quiet, *loud]
    change, states = [p.similarity.change for p in some], [p.states for p in some]
    natural = [p.similarity.change for p in quiet], [p.similarity.change for p in loud]
    raw = [p.change_si for p in quiet], [p.change_si for p in loud]
    holds = [median(a) < STRONG < min(b, default=0.0) for a, b in (natural, raw)]
    small = [p.states for p in quiet if p.similarity.change <= STRONG]
    large = [p.states for p in quiet if p.similarity.change > STRONG]
    both = all(holds) or not any(holds)
    return Statement(
        section="6.2",
        claim="ΔJ% is some 3 % in a weakly nonlinear case and above 4 % beyond the tolerance",
        number="3.2 %; > 4 %",
        own=f"medians (ranges) in units in which every stuck contact weighs the same: {len(quiet)} accepted frequencies {_units(quiet)}; {len(loud)} alerted {_units(loud)}",
        verdict="not tested" if not quiet or not loud else judged(holds[0]) if both else "undecided",
        by=""
        if both
        else f"{'holds' if holds[0] else 'does not hold'} with equal contacts, {'holds' if holds[1] else 'does not'} in metres and radians",
        why=f"Units do not explain it: in metres and radians the medians are {median(raw[0]) / median(natural[0]):.2g} and {median(raw[1]) / median(natural[1]):.2g} times as large. ΔJ follows the contact states that differ between one and five harmonics "
        f"(rank correlation {rank_correlation(change, states):.2f} over {len(some)} frequencies): {percent(median(small), 2)} of the contact directions and instants where ΔJ is at most 4 % ({len(small)} accepted), {percent(median(large), 2)} where it is more ({len(large)} accepted).",
    )


def _said(p: Pair) -> str:
    s = p.similarity
    return f"{p.hertz:.2f} Hz at {p.ratio:g}, Err1 = {percent(p.predicted)}: trace {s.trace:.4g} of {s.size}, mean {s.mean_diagonal:.4f}, {percent(s.zero_share)} of the others below {s.tolerance:g}"


def _weak_trace(quiet: list[Pair]) -> Statement:
    weak = max(quiet, key=lambda p: p.predicted)
    off = abs(weak.similarity.mean_diagonal - 1)
    return Statement(
        section="6.2",
        claim="Γ is quite similar to the identity in a weak case: its trace is its size",
        number="363.002 of 363; mean of the diagonal 0.9995",
        own=_said(weak),
        verdict=judged(off < ALERTED_OFF),
        by=f"{percent(off)} off, the paper's alerted case {percent(ALERTED_OFF)}",
        why=f"{percent(weak.states, 2)} of the contact directions and instants differ in state there, median of all accepted {percent(median([p.states for p in quiet]), 2)}; these have a median of {percent(median([abs(p.similarity.mean_diagonal - 1) for p in quiet]), 2)} off.",
    )


def _zeros(quiet: list[Pair]) -> Statement:
    shares = [p.similarity.zero_share for p in quiet]
    weak = max(quiet, key=lambda p: p.predicted)
    nearest = max(quiet, key=lambda p: p.similarity.zero_share)
    order = rank_correlation(shares, [p.states for p in quiet])
    return Statement(
        section="6.2",
        claim="In the weak case nearly all terms of Γ off the diagonal are zero",
        number=percent(ZEROS[0]),
        own=f"{percent(weak.similarity.zero_share)} below {weak.similarity.tolerance:g} at {weak.hertz:.2f} Hz, ratio {weak.ratio:g}; {span(shares)} over {len(quiet)} accepted frequencies, median {percent(median(shares))}",
        verdict=judged(weak.similarity.zero_share > ZEROS[0] - 0.02),
        why=f"The paper does not say what counts as zero (here {weak.similarity.tolerance:g}). The share falls with the contact states that differ between one and five harmonics (rank correlation {order:.2f}): {percent(nearest.similarity.zero_share)} are zero where {percent(nearest.states, 2)} of the directions and instants differ ({nearest.hertz:.2f} Hz at {nearest.ratio:g}), {percent(weak.similarity.zero_share)} where {percent(weak.states, 2)} do.",
    )


def _less(quiet: list[Pair], loud: list[Pair]) -> Statement:
    off, zeros = (
        [[v(p) for p in some] for some in (quiet, loud)]
        for v in (lambda p: abs(p.similarity.mean_diagonal - 1), lambda p: p.similarity.zero_share)
    )
    holds = bool(quiet and loud) and median(off[1]) > median(off[0]) and median(zeros[1]) < median(zeros[0])
    return Statement(
        section="6.2",
        claim="Above tolerance Γ is less similar to the identity",
        number="trace 362.9, mean 0.994, 96.8 % zero",
        own=f"medians of accepted and alerted frequencies: mean of the diagonal {percent(median(off[0]), 2)} and {percent(median(off[1]), 2)} off, zero terms {percent(median(zeros[0]))} and {percent(median(zeros[1]))}",
        verdict="not tested" if not quiet or not loud else judged(holds),
        by="" if loud else "0 alarms",
        why=f"{percent(median(off[1]), 2)} off against {percent(median(off[0]), 2)}.",
    )


def _subtle(quiet: list[Pair], loud: list[Pair]) -> Statement:
    natural, raw = (
        [[v(p) for p in some] for some in (quiet, loud)] for v in (lambda p: p.similarity.change, lambda p: p.change_si)
    )
    if not quiet or not loud:
        return Statement(
            section="6.2",
            claim="ΔJ% varies too subtly to tell acceptable from unacceptable cases",
            own="no alarm",
            verdict="not tested",
            by="0 alarms",
        )
    inside = [sum(v >= min(b) for v in a) for a, b in (natural, raw)]
    return Statement(
        section="6.2",
        claim="ΔJ% varies too subtly to tell acceptable from unacceptable cases",
        own=f"of {len(quiet)} accepted frequencies {inside[0]} have a ΔJ above the smallest of the {len(loud)} alerted ones, in metres and radians {inside[1]}",
        verdict=judged(all(inside)),
        why=f"A threshold would separate them in one of the units: {inside[0]} and {inside[1]} beyond it.",
    )
