"""Verdicts on bounds over residual tractions, and the terminal tables."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stickslip.study.analysis import TextTable
from stickslip.study.store.netcdf import one_case
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres

SMALL = 1e-3  # relative width below which residual tractions change nothing that counts
LARGE = 1e-2  # above which the user is warned
FEW = 0.05  # relative change by more harmonics above which those kept are too few
ENDS = ("smallest", "largest")


def case_verdicts(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return what is to be thought of a case from its variables."""
    if "resonance_amplitude" not in case:
        return []
    height, hertz = case["resonance_amplitude"].values, case["resonance_hz"].values
    found = [_of_width(label, case, height, hertz)]
    if not np.all(case["resonance_inside"].values):
        why = "a bound is highest at the end of residual_tractions.frequency_hz, which is no resonance"
        found.append(Verdict("doubtful", label, None, why, "Widen the range."))
    found += [*_of_harmonics(label, case), *_of_branches(label, case)]
    failures = int(case["failures"].values.sum())
    if failures:
        count = int(case["solves"].values.sum())
        why = f"from {failures} starts of tractions no motion was found ({count} were), so that the bounds may be wider"
        found.append(
            Verdict(
                "trusted", label, None, why, "Look at the figure: a bound that jumps back there is one that was missed."
            )
        )
    return [*found, *_of_ends(label, case)]


def _of_width(label: str, case: Mapping[str, xr.Variable], height: np.ndarray, hertz: np.ndarray) -> Verdict:
    own, least, most = (float(h) for h in height)
    if most - least <= SMALL * most:
        because = (
            "no contact sticks all the time"
            if not np.isfinite(case["multiplier"].values).any()
            else "what sticks does not change it"
        )
        elsewhere = _widest(case)
        also = f"; elsewhere in the range {elsewhere}" if elsewhere else ""
        why = (
            f"residual tractions leave the resonance as it is, {millimetres(own)} at {hertz[0]:.5g} Hz: {because}{also}"
        )
        return Verdict("trusted", label, None, why)
    why = (
        f"the resonance is {millimetres(own)} from the model's own start, and by residual tractions alone anywhere from {millimetres(least)} at "
        f"{hertz[1]:.5g} Hz to {millimetres(most)} at {hertz[2]:.5g} Hz ({100 * (least / own - 1):+.2g} % to {100 * (most / own - 1):+.2g} %): so far "
        "the answer of forced_response may be off because of them"
    )
    return Verdict("trusted", label, None, why, "Design with the largest.", warns=most > (1.0 + LARGE) * least)


def _of_harmonics(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Doubt resonances that more harmonics are predicted to change; tell of other frequencies."""
    if "resonance_harmonics_error" not in case:
        return []
    kept, remedy = int(case["harmonics"].values), "Raise residual_tractions.harmonics."
    error, hertz = case["resonance_harmonics_error"].values, case["resonance_hz"].values
    found = []
    if np.isnan(error).any():
        why = f"harmonics were not examined: nothing says how wrong H = {kept} is"
        found.append(Verdict("doubtful", label, None, why, remedy))
    if (worst := np.flatnonzero(error > FEW)).size:
        k = int(worst[np.argmax(error[worst])])
        names = ("resonance from the model's own start", *(f"{end} resonance" for end in ENDS))
        by = "over 100 %" if error[k] > 1.0 else f"{100 * error[k]:.2g} %"
        why = f"more harmonics than {kept} are predicted to change the {names[k]} by {by}"
        found.append(Verdict("doubtful", label, float(hertz[k]), why, remedy))
    each = np.nanmax(np.nan_to_num(case["harmonics_error"].values, nan=0.0), axis=1)
    if (above := np.flatnonzero(each > FEW)).size and not worst.size:
        at = int(above[np.argmax(each[above])])
        by = "over 100 %" if each[at] > 1.0 else f"{100 * each[at]:.2g} %"
        why = f"more harmonics than {kept} are predicted to change the bounds by {by} there, and by more than {100 * FEW:g} % at {above.size} of {each.size} frequencies"
        found.append(Verdict("trusted", label, float(case["frequency_hz"].values[at]), why, remedy))
    return found


def _of_branches(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Doubt bounds at frequencies with several motions from one start."""
    several = case["branches"].values > 1
    if not several.any():
        return []
    hertz = case["frequency_hz"].values[several]
    where = (
        f"at {hertz[0]:.5g} Hz"
        if hertz.size == 1
        else f"at {hertz.size} frequencies from {hertz.min():.5g} to {hertz.max():.5g} Hz"
    )
    why = (
        f"{where} the model's own start has several motions, up to {int(np.max(case['branches'].values))}: the bounds hold all that sweeps up and "
        "down met, so that they are wide for another reason than residual tractions, and a detached motion may lie outside"
    )
    return [
        Verdict(
            "doubtful",
            label,
            float(hertz[0]),
            why,
            "Ask [all_motions] there which motions there are, and on which of them most starts end.",
        )
    ]


def _widest(case: Mapping[str, xr.Variable]) -> str:
    """Say where the bounds are farthest apart; nothing where they are one everywhere."""
    least, most = (case[f"{end}_amplitude"].values for end in ("least", "most"))
    width = np.nan_to_num(most / least)
    at = int(np.argmax(width))
    if width[at] - 1.0 <= SMALL:
        return ""
    hertz = float(case["frequency_hz"].values[at])
    return f"they leave up to {100 * (width[at] - 1):.2g} % open, at {hertz:.5g} Hz"


def _of_ends(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    if "confirmed" not in case:
        return []
    found = []
    height, hertz = case["resonance_amplitude"].values[1:], case["resonance_hz"].values[1:]
    for k, end in enumerate(ENDS):
        if case["confirmed"].values[k]:
            continue
        again, time = (float(case[f"{name}_amplitude"].values[k]) for name in ("resolved", "time"))
        if not abs(again / height[k] - 1.0) <= SMALL:
            why = f"the {end} resonance was not found again where forces are marched over samples"
            found.append(Verdict("doubtful", label, float(hertz[k]), why, "Take more harmonics."))
            continue
        went = f"goes to {millimetres(time)}" if np.isfinite(time) else "diverges"
        why = (
            f"the {end} resonance, {millimetres(height[k])}, is a periodic motion that a machine leaves: in time, begun with its tractions, it "
            f"{went}"
        )
        found.append(
            Verdict(
                "trusted", label, float(hertz[k]), why, "The bound holds; it may be wider than what can be attained."
            )
        )
    return found


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints."""
    if "resonance_amplitude" not in data:
        return ()
    head = ("case", "own start mm", "at Hz", "smallest mm", "at Hz", "largest mm", "at Hz", "in time", "motions")
    labels = [str(x) for x in data["case_label"].values]
    rows = []
    for i, label in enumerate(labels):
        case = one_case(data, i)
        if "resonance_amplitude" not in case:
            continue
        height, hertz = case["resonance_amplitude"].values, case["resonance_hz"].values
        each = [text for h, f in zip(height, hertz, strict=True) for text in (f"{1e3 * h:.5g}", f"{f:.3f}")]
        rows.append((label, *each, _in_time(case), str(int(case["solves"].sum()))))
    return (TextTable("Resonance over all residual tractions", head, tuple(rows)),)


def _in_time(case: xr.Dataset) -> str:
    if "confirmed" not in case:
        return "not followed"
    if not any(str(word) for word in case["time_status"].values):
        return "not followed"
    words = ["confirmed" if ok else "left" for ok in case["confirmed"].values]
    return words[0] if words[0] == words[1] else f"smallest {words[0]}, largest {words[1]}"
