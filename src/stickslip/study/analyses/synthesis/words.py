"""What is told of synthesised responses: verdicts, and what the terminal prints."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stickslip.arrays import IntArray
from stickslip.study.analyses.analysis import TextTable
from stickslip.study.analyses.verdict import Level, Verdict
from stickslip.study.keep.netcdf import alike, one_case

ASK = "Ask for [forced_response] there."
REMEDIES = {
    "trusted": "",
    "doubtful": "modal_synthesis.direct = true shows the error.",
    "refused": ASK,
    "beyond": "Widen modal_synthesis.amplitude_mm, or ask for [forced_response] there.",
}
APART = "[all_motions] searches for motions that a sweep does not reach."
FAST = 0.05  # relative change in a radian beyond which a passage is doubtful
WRONG = 0.02  # of the peak, against the direct solution


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


def _of_answer(
    label: str, case: Mapping[str, xr.Variable], answer: str, own: IntArray, remedy: str
) -> Verdict:
    """Return one verdict on all levels with the same answer and remedy: that of the worst of them."""
    foreign = np.nan_to_num(case["foreign"].values[own], nan=0.0)
    worst = int(own[int(np.argmax(foreign))])
    levels = case["level"].values[own]
    span = f"level {levels[0]:g}" if own.size == 1 else f"{own.size} levels from {levels.min():g} to {levels.max():g}"  # fmt: skip
    what = {
        "trusted": f"the nonlinear mode answers alone at {span}",
        "doubtful": f"the response at {span} is doubtful",
        "refused": f"the response at {span} is refused, since the mode is not alone",
        "beyond": f"no peak at {span}",
    }[answer]
    level: Level = "trusted" if answer == "trusted" else "doubtful"
    at = "" if own.size == 1 else f"at {case['level'].values[worst]:g} "
    why = f"{what}: {at}{case['why'].values[worst]!s}"
    return Verdict(level, label, None, why, remedy)


def _of_direct(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    if "direct_error" not in case:
        return []
    error = np.abs(case["direct_error"].values)
    shown = np.isfinite(error)
    if not np.any(shown):
        return []
    worst = int(np.nanargmax(np.where(shown, error, np.nan)))
    why = f"synthesised peaks differ from direct ones by up to {100 * error[worst]:.2g} %, at level {case['level'].values[worst]:g}"
    off = bool(error[worst] > WRONG)
    return [Verdict("doubtful" if off else "trusted", label, None, why, "Believe the direct ones." if off else "")]  # fmt: skip


def _of_passages(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    if "passage_change" not in case:
        return []
    change, finished = case["passage_change"].values, case["passage_finished"].values
    found, known = [], np.isfinite(change)
    if np.any(known & (change > FAST)):
        rate = float(np.min(case["passage_hz_per_s"].values[np.any(known & (change > FAST), axis=0)]))  # fmt: skip
        why = f"from {rate:g} Hz/s on the amplitude changes by more than {100 * FAST:g} % in a radian of the vibration"
        found.append(Verdict("doubtful", label, None, why, "Integrate in time where the peak counts."))  # fmt: skip
    if np.any(known & (finished == 0)):
        why = "a passage left the nonlinear mode at its end"
        found.append(Verdict("doubtful", label, None, why, "Raise modal_synthesis.amplitude_mm."))
    return found


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints: the levels of each case."""
    found = []
    groups = alike(data)
    for group in groups:
        case = one_case(data, group[0])
        labels = [str(data["case_label"].values[i]) for i in group if len(groups) > 1]
        head = f"{'; '.join(labels)}: " if labels else ""
        if "level" in case:
            found.append(_table(case, head))
    return tuple(found)


def _table(case: xr.Dataset, head: str) -> TextTable:
    direct = "direct_error" in case
    rows = []
    for i in range(case.sizes["level"]):
        row = [
            f"{float(case['level'][i]):g}",
            _number(1e3 * float(case["peak_amplitude"][i])),
            _number(float(case["peak_frequency_hz"][i]), 7),
            _number(100 * float(case["foreign"][i]), 2),
            str(case["answer"][i].values),
        ]
        if direct:
            row += [_number(1e3 * float(case["direct_peak_amplitude"][i])), _number(100 * float(case["direct_error"][i]), 2)]  # fmt: skip
        rows.append(tuple(row))
    beside = ("direct mm", "error %") if direct else ()
    columns = ("level", "peak mm", "Hz", "other modes %", "answer", *beside)
    return TextTable(f"{head}Responses of one nonlinear mode, {case.attrs.get('output', '')}", columns, tuple(rows))  # fmt: skip


def _number(value: float, digits: int = 5) -> str:
    return f"{value:.{digits}g}" if np.isfinite(value) else "-"
