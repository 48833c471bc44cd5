"""Sections 4.4, 4.5.3 and 6.3: what the alert costs and how exact it is (fig. 7b). Costs are counts, and medians of interleaved repeats."""

import numpy as np

from evidence.figures.evidence import Evidence
from evidence.figures.solve import Curve
from evidence.figures.statements.statement import (
    ONE_PERCENT,
    THRESHOLD,
    Statement,
    below,
    judged,
    listed,
    percent,
    signed,
)
from evidence.figures.timing import Timing

PUBLISHED = 0.43  # 43 of 100 minutes
LEFT_MOST = 3  # of the points of fig. 7b
SAME = 1.1  # times that of one harmonic: still called the same time
SOLVER = 1e-6  # relative difference of two peaks that the solver's tolerance makes


def statement_of_passages(e: Evidence) -> Statement:
    """Return the row of section 4.4: both passages against five harmonics at once."""
    some = [t for t in e.timing if t.whole and not t.repeated_all.lost and t.repeated_all.solved]
    verdicts = {}
    for t in some:
        verdicts[t.ratio] = below(t.share("repeated_all", "high"), 1.0, _work(t, "repeated_all"))
    worse = [r for r, v in verdicts.items() if v == "does not hold"]
    open_ = [r for r, v in verdicts.items() if v == "undecided"]
    steps = [sum(c.steps for c in (getattr(t, which) for t in some)) for which in ("repeated_all", "high")]
    return Statement(
        section="4.4",
        claim="The passage with one harmonic and that with five from q + Δq cost together at most what five cost directly",
        number="lower or equal",
        own="both passages over one, CPU time: "
        + ", ".join(f"{t.share('repeated_all', 'high').said()} at {t.ratio:g}" for t in some)
        + "; work of all Jacobians (unknowns to the third power): "
        + ", ".join(f"{percent(_work(t, 'repeated_all'), 2)} at {t.ratio:g}" for t in some),
        verdict="not tested" if not some else "does not hold" if worse else "undecided" if open_ else "holds",
        by="0 ratios with every frequency found"
        if not some
        else f"dearer at {listed(worse)}, undecided at {listed(open_)}, of {len(some)} ratios"
        if worse or open_
        else "",
        why=f"Newton steps of all ratios: {steps[0]} in both passages, {steps[1]} with five at once.",
    )


def statement_of_control(e: Evidence) -> Statement:
    """Return the row of section 4.5.3: error against time."""
    some = [t for t in e.timing if t.periodic]
    errors = {t.ratio: abs(t.error("alert")) for t in some}
    worst = max(errors, key=lambda r: errors[r], default=np.nan)
    limit = ONE_PERCENT + THRESHOLD
    five = {t.ratio: t.error("high") for t in some}
    overall = max(errors.values(), default=np.nan)
    return Statement(
        section="4.5.3",
        claim="With the alert the error against time integration is at most 1 % + 5 %",
        number="6 %",
        own=f"at resonance at most {percent(overall)}, at {worst:g}, over the ratios {listed(list(errors))}",
        verdict="not tested" if not some else judged(overall <= limit),
        by="" if some else "0 ratios with a periodic motion",
        why=f"Five harmonics themselves are {signed(five.get(worst, np.nan))} off there (see the row of section 4.5.2).",
    )


def statements_of_cost(e: Evidence) -> list[Statement]:
    """Return the rows of figure 7b."""
    known = [t for t in e.timing if np.isfinite(t.reference)]
    same = [t for t in known if not t.repeats]
    asked = [t for t in known if t.repeats]
    low_bad = [t.ratio for t in known if abs(t.error("low")) > THRESHOLD]
    silent = [r for r in low_bad if r in {t.ratio for t in same}]
    return [
        _same_error(same),
        _same_time(same[:LEFT_MOST]),
        Statement(
            section="6.3",
            place="Fig. 7b",
            claim="From some ratio on one harmonic is more than 5 % off, and there the alert asks for five",
            number="from point four on",
            own=f"one harmonic beyond 5 % at {listed(low_bad)}; repeats at {listed([t.ratio for t in asked])}",
            verdict="not tested" if not low_bad else judged(not silent),
            by="" if low_bad else "0 ratios at which one harmonic is beyond 5 %",
            why=f"No repeat at {listed(silent)}.",
        ),
        _alert_is_five(asked),
        _share(asked),
    ]


def _same_error(same: list[Timing]) -> Statement:
    gap = max((abs(t.error("alert") - t.error("low")) for t in same), default=np.nan)
    return Statement(
        section="6.3",
        place="Fig. 7b",
        claim="At high ratios the alert has the error of one harmonic",
        number="the three left-most points",
        own=f"ratios {listed([t.ratio for t in same])}: peaks the same within {percent(gap, 2)}",
        verdict=judged(gap < SOLVER) if same else "not tested",
        by="" if same else "0 ratios at which the alert asks nowhere",
        why=f"They differ by {percent(gap, 2)}.",
    )


def _same_time(same: list[Timing]) -> Statement:
    verdicts = {t.ratio: below(t.share("alert", "low"), SAME, _work(t, "alert", "low")) for t in same}
    counts = ", ".join(
        f"{percent(_work(t, 'alert', 'low'), 3)} of that work and {percent(_unknowns(t, 'alert', 'low'), 3)} of the unknowns at {t.ratio:g}"
        for t in same
    )
    worse = [r for r, v in verdicts.items() if v == "does not hold"]
    open_ = [r for r, v in verdicts.items() if v == "undecided"]
    large = {t.ratio: _large(t) for t in same}
    return Statement(
        section="6.3",
        place="Fig. 7b",
        claim="At high ratios the alert has the time of one harmonic",
        number="the three left-most points",
        own="CPU time over that of one harmonic, and work of all Jacobians (unknowns to the third power): "
        + ", ".join(f"{t.share('alert', 'low').said()} at {t.ratio:g}" for t in same)
        + f"; {counts}",
        verdict="not tested" if not same else "does not hold" if worse else "undecided" if open_ else "holds",
        by="0 ratios at which the alert asks nowhere"
        if not same
        else f"above {SAME:g} times at {listed(worse)}, undecided at {listed(open_)}"
        if worse or open_
        else f"within {SAME:g} times",
        why="The verdict takes one Jacobian of the large system at each frequency that slips: "
        + ", ".join(f"{n} at {r:g}" for r, n in large.items())
        + ".",
    )


def _large(t: Timing) -> int:
    most = max(t.alert.sizes)
    return sum(size == most for size in t.alert.sizes) if most > max(t.low.sizes) else 0


def _alert_is_five(asked: list[Timing]) -> Statement:
    gaps = {t.ratio: abs(t.error("alert") - t.error("high")) for t in asked}
    worst = max(gaps, key=lambda r: gaps[r], default=np.nan)
    said = ", ".join(f"{signed(t.error('alert'))} / {signed(t.error('high'))} at {t.ratio:g}" for t in asked)
    orders = ", ".join(f"{t.alert.peak.order} at {t.ratio:g}" for t in asked)
    return Statement(
        section="6.3",
        place="Fig. 7b",
        claim="Where the alert asks, its error at resonance equals that of five harmonics",
        number="0.8 % both",
        own=f"alert / five: {said}",
        verdict="not tested" if not asked else judged(max(gaps.values()) < 1e-3),
        by="0 ratios at which the alert asks" if not asked else f"at most {percent(gaps[worst], 2)} apart",
        why=f"Largest difference at {worst:g}. Harmonics at the peak of the alert: {orders}.",
    )


def _share(asked: list[Timing]) -> Statement:
    """Judge 43 % at the lowest ratio at which every frequency was found; the others are listed."""
    some = [t for t in asked if t.whole]
    claim = "In the strong case the alert takes 43 % of the time of five harmonics"
    if not some:
        return Statement(
            section="6.3",
            place="Fig. 7b",
            claim=claim,
            number="43 against 100 min",
            own="no repeats",
            verdict="not tested",
            by="0 ratios with repeats and every frequency found",
        )
    strong = min(some, key=lambda t: t.ratio)
    share = strong.share("alert", "high")
    others = [t for t in some if t is not strong]
    return Statement(
        section="6.3",
        place="Fig. 7b",
        claim=claim,
        number="43 against 100 min",
        own=f"ratio {strong.ratio:g}, {strong.repeats} of {len(strong.high.points)} frequencies solved again: CPU time {share.said()}, medians {strong.median('alert'):.2f} and {strong.median('high'):.2f} s of {len(strong.seconds['alert'])} interleaved repeats; "
        f"{_counts(strong)}; other ratios: "
        + "; ".join(
            f"{t.ratio:g}: {t.share('alert', 'high').said()}, unknowns {percent(_unknowns(t, 'alert', 'high'), 2)}, {t.repeats} repeats"
            for t in others
        ),
        verdict=below(share, PUBLISHED),
        by=f"{share.median / PUBLISHED:.2g} times the paper's share",
        why=f"{strong.repeats} of {len(strong.high.points)} frequencies are solved twice: {_per_point(strong.high):.1f} evaluations a frequency with five harmonics at once, {_repeated(strong):.1f} a repeat.",
    )


def _counts(t: Timing) -> str:
    return (
        f"unknowns {t.alert.unknowns} of {t.high.unknowns} ({percent(_unknowns(t, 'alert', 'high'), 2)}), Newton steps {t.alert.steps} of {t.high.steps}, "
        f"evaluations of contacts with their Jacobian {len(t.alert.sizes)} of {len(t.high.sizes)}, of the large system {_large(t)} of {len(t.high.sizes)}"
    )


def _per_point(response: Curve) -> float:
    return len(response.sizes) / len(response.points)


def _repeated(t: Timing) -> float:
    return _large(t) / max(t.repeats, 1)


def _unknowns(t: Timing, one: str, other: str) -> float:
    few, many = (getattr(t, which).unknowns for which in (one, other))
    return float(few / many)


def _work(t: Timing, one: str, other: str = "high") -> float:
    """Return the quotient of the work of all Jacobians: their sizes, each to the third power, as of a factorisation."""
    few, many = (np.sum(np.array(getattr(t, which).sizes, dtype=float) ** 3) for which in (one, other))
    return float(few / many)
