"""Verdicts on synthesised responses, and the terminal tables."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stickslip.analyses.columns import number, record_of, told_apart
from stickslip.analyses.modal_synthesis.records import ModalSynthesis, SynthesisLevel
from stickslip.response.nonlinear_modes.single_mode_validity import ALONE
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Level, Verdict
from stickslip.units import HZ

ASK = "Ask for [forced_response] there."
REMEDIES = {
    "trusted": "",
    "doubtful": "modal_synthesis.direct = true shows the error.",
    "refused": ASK,
    "beyond": "Widen modal_synthesis.amplitude_mm, or ask for [forced_response] there.",
}
APART = "[all_motions] searches for motions that a sweep does not reach."
BESIDE = "The direct solutions beside it show the error."
FAST = 0.05  # relative change of the amplitude in a radian, above which a passage is doubtful
WRONG = 0.02  # largest relative error of the peak against the direct solution
ALONG = 0.05  # the same of the curve where the mode answers alone
FEW = 4  # largest number of levels that are named one by one


def percent(share: float, *, unit: bool = True) -> str:
    """Write a fraction in percent with at most three digits; above 1000 % as a bound."""
    value = 100 * share
    if not np.isfinite(value):
        return "-"
    if abs(value) > 1000.0:
        text = "over 1000" if value > 0 else "below -1000"
    elif abs(value) >= 9.95:
        text = f"{value:.0f}"
    else:
        text = _short(value)
    return f"{text} %" if unit else text


def _short(value: float) -> str:
    """Write a number below ten with two digits; below 0.001 as a bound."""
    if abs(value) < 1e-3:
        return "0" if value == 0.0 else "< 0.001"
    digits = max(0, 1 - int(np.floor(np.log10(abs(value)))))
    return f"{value:.{digits}f}".rstrip("0").rstrip(".")


def case_verdicts(label: str, case: ModalSynthesis) -> list[Verdict]:
    """Return the verdicts on a case."""
    if not case.levels:
        return []
    found = []
    for answer, told in REMEDIES.items():
        there = [level for level in case.levels if level.answer == answer]
        for remedy, apart in ((told, False), (APART, True)):
            own = [level for level in there if bool(np.isfinite(level.detached_peak)) == apart]
            if own:
                found.append(_of_answer(label, case, answer, own, remedy))
    if not any(level.shown for level in case.levels):
        why = "nothing is left: at no level the nonlinear mode answers alone"
        found.append(Verdict("wrong", label, None, why, "Ask for [forced_response]."))
    return [*found, *_of_direct(label, case), *_of_passages(label, case)]


def _of_answer(label: str, case: ModalSynthesis, answer: str, own: Sequence[SynthesisLevel], remedy: str) -> Verdict:
    """Return one verdict on all levels with the same answer and remedy, with the reason of the worst level."""
    worst = own[int(np.argmax(np.nan_to_num([level.foreign for level in own], nan=0.0)))]
    span = _levels(own)
    what = {
        "trusted": f"the nonlinear mode answers alone at {span}",
        "doubtful": f"the response at {span} is doubtful",
        "refused": f"the response at {span} is refused, since the mode is not alone",
        "beyond": f"no peak at {span}",
    }[answer]
    level: Level = "trusted" if answer == "trusted" else "doubtful"
    at = "" if len(own) == 1 else f"at {worst.level:g} "
    why = f"{what}: {at}{worst.why}"
    if answer in ("trusted", "doubtful"):
        why += f". {_of_peaks(own)}"
    solved = remedy == REMEDIES["doubtful"] and case.direct
    return Verdict(level, label, None, why, BESIDE if solved else remedy)


def _of_peaks(own: Sequence[SynthesisLevel]) -> str:
    """State that the verdict concerns the peaks, and the narrowest range around them in which the mode answers alone."""
    around = [level for level in own if np.isfinite(level.alone_from)]
    said = "This is said of the peak" if len(own) == 1 else "This is said of the peaks"
    if not around:
        return f"{said}: the rest of the curve may be off by more, since the other modes change it by more than {percent(ALONE)}"
    few = min(around, key=lambda level: (level.alone_to / HZ) / (level.alone_from / HZ))
    low, high = few.alone_from / HZ, few.alone_to / HZ
    level = "" if len(own) == 1 else f" at level {few.level:g}"
    wider = " and in a wider range at the others" if len(around) == len(own) > 1 else ""
    rest = [one for one in own if not np.isfinite(one.alone_from)]
    if rest:
        wider = f", and at {_levels(rest)} not even at the peak"
    return f"{said}: along the curve the other modes stay below {percent(ALONE)} from {low:.5g} to {high:.5g} Hz{level}{wider}"


def _of_direct(label: str, case: ModalSynthesis) -> list[Verdict]:
    known = [(abs(e), level) for level in case.levels if (e := level.direct_error) is not None and np.isfinite(e)]
    if not known:
        return []
    error, worst = max(known, key=lambda found: found[0])
    why = f"synthesised peaks differ from direct ones by up to {percent(error)}, at level {worst.level:g}"
    found = [_against(label, why, off=error > WRONG)]
    along = [(abs(e), level) for level in case.levels if (e := level.along_error) is not None and np.isfinite(e)]
    if along:
        error, worst = max(along, key=lambda found: found[0])
        hertz = np.nan if worst.along_error_omega is None else worst.along_error_omega / HZ
        why = f"where the other modes stay below {percent(ALONE)} synthesised curves differ from direct ones by up to {percent(error)}, at level {worst.level:g} and {hertz:.5g} Hz"
        found.append(_against(label, why, off=error > ALONG))
    return found


def _against(label: str, why: str, *, off: bool) -> Verdict:
    return Verdict("doubtful" if off else "trusted", label, None, why, "Believe the direct ones." if off else "")


def _of_passages(label: str, case: ModalSynthesis) -> list[Verdict]:
    rates = case.passage_hz_per_s
    if rates is None or not rates.size:
        return []
    found = []
    fast = [(level.passage_change > FAST, level) for level in case.levels]
    if any(own.any() for own, _ in fast):
        rate = min(float(rates[own].min()) for own, _ in fast if own.any())
        levels = [level for own, level in fast if own.any()]
        why = f"in passages from {rate:g} Hz/s on at {_levels(levels)} the amplitude changes by more than {percent(FAST)} in a radian of the vibration"
        found.append(Verdict("doubtful", label, None, why, "Integrate in time where the peak counts."))
    left = [level for level in case.levels if np.any(np.isfinite(level.passage_change) & (level.passage_finished == 0))]
    if left:
        why = f"a passage at {_levels(left)} left the nonlinear mode at its end"
        found.append(Verdict("doubtful", label, None, why, "Raise modal_synthesis.amplitude_mm."))
    return found


def _levels(among: Sequence[SynthesisLevel]) -> str:
    """Name a few levels one by one; of many, state the number and the range."""
    levels = [one.level for one in among]
    if len(levels) == 1:
        return f"level {levels[0]:g}"
    if len(levels) <= FEW:
        return f"levels {', '.join(f'{v:g}' for v in levels[:-1])} and {levels[-1]:g}"
    return f"{len(levels)} levels from {min(levels):g} to {max(levels):g}"


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables: the levels of each case."""
    found = []
    for one, head in told_apart(data):
        case = record_of(ModalSynthesis, one)
        if case.levels:
            found.append(_table(case, head))
            found += _passages(case, head)
    return tuple(found)


def _table(case: ModalSynthesis, head: str) -> TextTable:
    direct = case.direct
    rows = []
    for level in case.levels:
        row = [
            f"{level.level:g}",
            number(1e3 * level.peak),
            number(level.peak_omega / HZ, 7),
            percent(max(level.output, level.gaps), unit=False),
            percent(level.foreign, unit=False),
            _range(level),
            level.answer,
        ]
        if direct:
            row += [
                number(1e3 * _known(level.direct_peak)),
                percent(_known(level.direct_error), unit=False),
                percent(_known(level.along_error), unit=False),
            ]
        rows.append(tuple(row))
    beside = ("direct mm", "error %", "along %") if direct else ()
    lines = [
        f"others: motion of the other modes over the motion of the mode, at the peak; predicted error: at the peak; alone: range around the peak where the others stay below {percent(ALONE)}"
    ]
    if direct:
        lines.append(
            "error: of the peak against the direct one; along: the largest along the curve where the mode is alone"
        )
    columns = ("level", "peak mm", "Hz", "others %", "predicted error %", "alone Hz", "answer", *beside)
    return TextTable(f"{head}Responses of one nonlinear mode, {case.output}", columns, tuple(rows), tuple(lines))


def _known(value: float | None) -> float:
    return np.nan if value is None else value


def _range(level: SynthesisLevel) -> str:
    low, high = level.alone_from / HZ, level.alone_to / HZ
    return f"{low:.5g} to {high:.5g}" if np.isfinite(low) else "-"


def _passages(case: ModalSynthesis, head: str) -> list[TextTable]:
    """Return the table of the peaks of passages."""
    rows = [
        (
            f"{level.level:g}",
            f"{passage.rate:g}",
            number(1e3 * passage.peak),
            number(passage.hertz),
            percent(passage.share, unit=False),
            percent(passage.change, unit=False),
        )
        for level, passage in case.passages
    ]
    columns = ("level", "Hz/s", "peak mm", "at Hz", "of the steady one %", "change in a radian %")
    return [TextTable(f"{head}Passages through resonance, {case.output}", columns, tuple(rows))] if rows else []
