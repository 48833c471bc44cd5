"""Verdicts on synthesised responses, and the terminal tables."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stickslip.analyses.collected import number, told_apart
from stickslip.analyses.modal_synthesis.percents import percent
from stickslip.arrays import FloatArray, IntArray
from stickslip.response.nonlinear_modes.single_mode_validity import ALONE
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Level, Verdict

ASK = "Ask for [forced_response] there."
REMEDIES = {
    "trusted": "",
    "doubtful": "modal_synthesis.direct = true shows the error.",
    "refused": ASK,
    "beyond": "Widen modal_synthesis.amplitude_mm, or ask for [forced_response] there.",
}
APART = "[all_motions] searches for motions that a sweep does not reach."
BESIDE = "The direct solutions beside it show the error."
FAST = 0.05  # relative change in a radian beyond which a passage is doubtful
WRONG = 0.02  # of the peak, against the direct solution
ALONG = 0.05  # of the curve where the mode answers alone, against the direct solution
FEW = 4  # levels that are named each


def case_verdicts(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return what is to be thought of a case from its variables."""
    if "level" not in case:
        return []
    answers = [str(a) for a in case["answer"].values]
    apart = np.isfinite(case["detached_peak_amplitude"].values)
    found = [
        _of_answer(label, case, answer, own, remedy)
        for answer, told in REMEDIES.items()
        for remedy, among in ((told, ~apart), (APART, apart))
        if (own := np.flatnonzero((np.array(answers) == answer) & among)).size
    ]
    if not set(answers) & {"trusted", "doubtful"}:
        why = "nothing is left: at no level the nonlinear mode answers alone"
        found.append(Verdict("wrong", label, None, why, "Ask for [forced_response]."))
    return [*found, *_of_direct(label, case), *_of_passages(label, case)]


def _of_answer(label: str, case: Mapping[str, xr.Variable], answer: str, own: IntArray, remedy: str) -> Verdict:
    """Return one verdict on all levels with the same answer and remedy: that of the worst of them."""
    foreign = np.nan_to_num(case["foreign"].values[own], nan=0.0)
    worst = int(own[int(np.argmax(foreign))])
    levels = case["level"].values[own]
    span = _levels(levels)
    what = {
        "trusted": f"the nonlinear mode answers alone at {span}",
        "doubtful": f"the response at {span} is doubtful",
        "refused": f"the response at {span} is refused, since the mode is not alone",
        "beyond": f"no peak at {span}",
    }[answer]
    level: Level = "trusted" if answer == "trusted" else "doubtful"
    at = "" if own.size == 1 else f"at {case['level'].values[worst]:g} "
    why = f"{what}: {at}{case['why'].values[worst]!s}"
    if answer in ("trusted", "doubtful"):
        why += f". {_of_peaks(case, own)}"
    solved = remedy == REMEDIES["doubtful"] and "direct_error" in case
    return Verdict(level, label, None, why, BESIDE if solved else remedy)


def _of_peaks(case: Mapping[str, xr.Variable], own: IntArray) -> str:
    """Say that this is the peak, and within which frequencies around it the mode answers alone: the narrowest of some levels."""
    low, high = (case[name].values[own] for name in ("alone_from_hz", "alone_to_hz"))
    around = np.flatnonzero(np.isfinite(low))
    said = "This is said of the peak" if own.size == 1 else "This is said of the peaks"
    if not around.size:
        return f"{said}: the rest of the curve may be off by more, since the other modes change it by more than {percent(ALONE)}"
    few = int(around[int(np.argmin(high[around] / low[around]))])
    level = "" if own.size == 1 else f" at level {case['level'].values[own[few]]:g}"
    wider = " and in a wider range at the others" if around.size == own.size > 1 else ""
    rest = np.delete(own, around)
    if rest.size:
        wider = f", and at {_levels(case['level'].values[rest])} not even at the peak"
    return f"{said}: along the curve the other modes stay below {percent(ALONE)} from {low[few]:.5g} to {high[few]:.5g} Hz{level}{wider}"


def _of_direct(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    if "direct_error" not in case:
        return []
    error = np.abs(case["direct_error"].values)
    shown = np.isfinite(error)
    if not np.any(shown):
        return []
    worst = int(np.nanargmax(np.where(shown, error, np.nan)))
    level = case["level"].values
    why = f"synthesised peaks differ from direct ones by up to {percent(error[worst])}, at level {level[worst]:g}"
    off = bool(error[worst] > WRONG)
    found = [Verdict("doubtful" if off else "trusted", label, None, why, "Believe the direct ones." if off else "")]
    along = np.abs(case["along_error"].values)
    if np.any(np.isfinite(along)):
        worst = int(np.nanargmax(along))
        off = bool(along[worst] > ALONG)
        hertz = case["along_error_hz"].values[worst]
        why = f"where the other modes stay below {percent(ALONE)} synthesised curves differ from direct ones by up to {percent(along[worst])}, at level {level[worst]:g} and {hertz:.5g} Hz"
        found.append(
            Verdict("doubtful" if off else "trusted", label, None, why, "Believe the direct ones." if off else "")
        )
    return found


def _of_passages(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    if "passage_change" not in case:
        return []
    change, finished = case["passage_change"].values, case["passage_finished"].values
    found, known = [], np.isfinite(change)
    fast = known & (change > FAST)
    if np.any(fast):
        rate = float(np.min(case["passage_hz_per_s"].values[np.any(fast, axis=0)]))
        levels = case["level"].values[np.any(fast, axis=1)]
        why = f"in passages from {rate:g} Hz/s on at {_levels(levels)} the amplitude changes by more than {percent(FAST)} in a radian of the vibration"
        found.append(Verdict("doubtful", label, None, why, "Integrate in time where the peak counts."))
    left = known & (finished == 0)
    if np.any(left):
        why = f"a passage at {_levels(case['level'].values[np.any(left, axis=1)])} left the nonlinear mode at its end"
        found.append(Verdict("doubtful", label, None, why, "Raise modal_synthesis.amplitude_mm."))
    return found


def _levels(levels: FloatArray) -> str:
    """Name levels: each of a few, the number and the range of many."""
    if levels.size == 1:
        return f"level {levels[0]:g}"
    if levels.size <= FEW:
        return f"levels {', '.join(f'{v:g}' for v in levels[:-1])} and {levels[-1]:g}"
    return f"{levels.size} levels from {levels.min():g} to {levels.max():g}"


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints: the levels of each case."""
    found = []
    for case, head in told_apart(data):
        if "level" in case:
            found.append(_table(case, head))
            found += _passages(case, head)
    return tuple(found)


def _table(case: xr.Dataset, head: str) -> TextTable:
    direct = "direct_error" in case
    rows = []
    for i in range(case.sizes["level"]):
        row = [
            f"{float(case['level'][i]):g}",
            number(1e3 * float(case["peak_amplitude"][i])),
            number(float(case["peak_frequency_hz"][i]), 7),
            percent(float(max(case["others_in_output"][i], case["others_in_gaps"][i])), unit=False),
            percent(float(case["foreign"][i]), unit=False),
            _range(case, i),
            str(case["answer"][i].values),
        ]
        if direct:
            row += [
                number(1e3 * float(case["direct_peak_amplitude"][i])),
                percent(float(case["direct_error"][i]), unit=False),
                percent(float(case["along_error"][i]), unit=False),
            ]
        rows.append(tuple(row))
    beside = ("direct mm", "error %", "along %") if direct else ()
    lines = [
        f"others: motion of the other modes over that of the mode, at the peak; predicted error: that of the peak; alone: where around the peak the others stay below {percent(ALONE)}"
    ]
    if direct:
        lines.append(
            "error: of the peak against the direct one; along: the largest along the curve where the mode is alone"
        )
    columns = ("level", "peak mm", "Hz", "others %", "predicted error %", "alone Hz", "answer", *beside)
    return TextTable(
        f"{head}Responses of one nonlinear mode, {case.attrs.get('output', '')}", columns, tuple(rows), tuple(lines)
    )


def _range(case: xr.Dataset, i: int) -> str:
    low, high = (float(case[name][i]) for name in ("alone_from_hz", "alone_to_hz"))
    return f"{low:.5g} to {high:.5g}" if np.isfinite(low) else "-"


def _passages(case: xr.Dataset, head: str) -> list[TextTable]:
    """Return the peaks of the passages."""
    if "passage_peak_amplitude" not in case:
        return []
    rows = []
    for i in range(case.sizes["level"]):
        for j in range(case.sizes["rate"]):
            peak = float(case["passage_peak_amplitude"][i, j])
            if np.isfinite(peak):
                rows.append(
                    (
                        f"{float(case['level'][i]):g}",
                        f"{float(case['passage_hz_per_s'][j]):g}",
                        number(1e3 * peak),
                        number(float(case["passage_peak_frequency_hz"][i, j])),
                        percent(float(case["passage_share"][i, j]), unit=False),
                        percent(float(case["passage_change"][i, j]), unit=False),
                    )
                )
    columns = ("level", "Hz/s", "peak mm", "at Hz", "of the steady one %", "change in a radian %")
    return (
        [TextTable(f"{head}Passages through resonance, {case.attrs.get('output', '')}", columns, tuple(rows))]
        if rows
        else []
    )
