"""Verdicts on bounds over residual tractions, and the terminal tables."""

import numpy as np
import xarray as xr

from stickslip.analyses.columns import record_of
from stickslip.analyses.residual_tractions.records import ResidualTractions
from stickslip.study.analysis import TextTable
from stickslip.study.store.netcdf import one_case
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres

SMALL = 1e-3  # relative width of the bounds, below which residual tractions do not matter
LARGE = 1e-2  # relative width of the bounds, above which there is a warning
FEW = 0.05  # relative change by more harmonics, above which there is a doubt
ENDS = ("smallest", "largest")


def case_verdicts(label: str, found: ResidualTractions) -> list[Verdict]:
    """Return the verdicts on a case."""
    if not found.resonances:
        return []
    verdicts = [_of_width(label, found)]
    if not all(top.inside for top in found.resonances):
        why = "a bound is highest at the end of residual_tractions.frequency_hz, which is no resonance"
        verdicts.append(Verdict("doubtful", label, None, why, "Widen the range."))
    verdicts += [*_of_harmonics(label, found), *_of_branches(label, found)]
    failures = sum(point.failures for point in found.points)
    if failures:
        why = f"from {failures} starts of tractions no motion was found ({found.solves} were), so that the bounds may be wider"
        remedy = "Look at the figure: a bound that jumps back there is one that was missed."
        verdicts.append(Verdict("trusted", label, None, why, remedy))
    return [*verdicts, *_of_ends(label, found)]


def _of_width(label: str, found: ResidualTractions) -> Verdict:
    own, least, most = (top.amplitude for top in found.resonances)
    hertz = [top.frequency_hz for top in found.resonances]
    if most - least <= SMALL * most:
        sticks = any(np.isfinite(top.multiplier).any() for top in found.resonances)
        because = "what sticks does not change it" if sticks else "no contact sticks all the time"
        elsewhere = _widest(found)
        also = f"; elsewhere in the range {elsewhere}" if elsewhere else ""
        why = (
            f"residual tractions leave the resonance as it is, {millimetres(own)} at {hertz[0]:.5g} Hz: {because}{also}"
        )
        return Verdict("trusted", label, None, why)
    why = f"residual tractions can put the resonance anywhere from {millimetres(least)} at {hertz[1]:.5g} Hz to {millimetres(most)} at {hertz[2]:.5g} Hz. The {millimetres(own)} from the model's own start may be off by {100 * (least / own - 1):+.2g} % to {100 * (most / own - 1):+.2g} %"
    return Verdict("trusted", label, None, why, "Design with the largest.", warns=most > (1.0 + LARGE) * least)


def _of_harmonics(label: str, bounds: ResidualTractions) -> list[Verdict]:
    """Doubt resonances that more harmonics are predicted to change; note such changes at other frequencies."""
    kept, remedy = bounds.harmonics, "Raise residual_tractions.harmonics."
    error = np.array([top.harmonics_error for top in bounds.resonances])
    found = []
    if np.isnan(error).any():
        why = f"the error of H = {kept} is not known, as harmonics were not examined"
        found.append(Verdict("doubtful", label, None, why, remedy))
    if (worst := np.flatnonzero(error > FEW)).size:
        k = int(worst[np.argmax(error[worst])])
        names = ("resonance from the model's own start", *(f"{end} resonance" for end in ENDS))
        by = "over 100 %" if error[k] > 1.0 else f"{100 * error[k]:.2g} %"
        why = f"more harmonics than {kept} are predicted to change the {names[k]} by {by}"
        found.append(Verdict("doubtful", label, bounds.resonances[k].frequency_hz, why, remedy))
    each = np.array([np.nan_to_num(point.harmonics_error, nan=0.0).max() for point in bounds.points])
    if (above := np.flatnonzero(each > FEW)).size and not worst.size:
        at = int(above[np.argmax(each[above])])
        by = "over 100 %" if each[at] > 1.0 else f"{100 * each[at]:.2g} %"
        why = f"more harmonics than {kept} are predicted to change the bounds by {by} there, and by more than {100 * FEW:g} % at {above.size} of {each.size} frequencies"
        found.append(Verdict("trusted", label, bounds.points[at].frequency_hz, why, remedy))
    return found


def _of_branches(label: str, bounds: ResidualTractions) -> list[Verdict]:
    """Doubt bounds at frequencies with several motions from one start."""
    hertz = np.array([point.frequency_hz for point in bounds.points if point.branches > 1])
    if not hertz.size:
        return []
    most = max(point.branches for point in bounds.points)
    where = (
        f"at {hertz[0]:.5g} Hz"
        if hertz.size == 1
        else f"at {hertz.size} frequencies from {hertz.min():.5g} to {hertz.max():.5g} Hz"
    )
    why = f"{where} the model's own start has several motions, up to {most}. The bounds contain every motion met by sweeps up and down, so they are wider than residual tractions alone explain. A detached motion may lie outside"
    return [
        Verdict(
            "doubtful",
            label,
            float(hertz[0]),
            why,
            "Ask [all_motions] there which motions there are, and on which of them most starts end.",
        )
    ]


def _widest(bounds: ResidualTractions) -> str:
    """State the frequency at which the bounds are farthest apart; empty if they are equal everywhere."""
    least = np.array([point.least_amplitude for point in bounds.points])
    most = np.array([point.most_amplitude for point in bounds.points])
    width = np.nan_to_num(most / least)
    at = int(np.argmax(width))
    if width[at] - 1.0 <= SMALL:
        return ""
    return f"they leave up to {100 * (width[at] - 1):.2g} % open, at {bounds.points[at].frequency_hz:.5g} Hz"


def _of_ends(label: str, bounds: ResidualTractions) -> list[Verdict]:
    found = []
    for name, end, top in zip(ENDS, bounds.ends, bounds.resonances[1:], strict=False):
        if end.confirmed:
            continue
        if not abs(end.resolved_amplitude / top.amplitude - 1.0) <= SMALL:
            why = f"the {name} resonance was not found again where forces are marched over samples"
            found.append(Verdict("doubtful", label, top.frequency_hz, why, "Take more harmonics."))
            continue
        went = f"goes to {millimetres(end.time_amplitude)}" if np.isfinite(end.time_amplitude) else "diverges"
        why = (
            f"the {name} resonance, {millimetres(top.amplitude)}, is a periodic motion that a machine leaves: in time, begun with its "
            f"tractions, it {went}"
        )
        remedy = "The bound holds; it may be wider than what can be attained."
        found.append(Verdict("trusted", label, top.frequency_hz, why, remedy))
    return found


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables."""
    if "resonance_amplitude" not in data:
        return ()
    head = ("case", "own start mm", "at Hz", "smallest mm", "at Hz", "largest mm", "at Hz", "in time", "motions")
    labels = [str(x) for x in data["case_label"].values]
    rows = []
    for i, label in enumerate(labels):
        found = record_of(ResidualTractions, one_case(data, i))
        if not found.resonances:
            continue
        each = [text for top in found.resonances for text in (f"{1e3 * top.amplitude:.5g}", f"{top.frequency_hz:.3f}")]
        rows.append((label, *each, _in_time(found), str(found.solves)))
    return (TextTable("Resonance over all residual tractions", head, tuple(rows)),)


def _in_time(found: ResidualTractions) -> str:
    if not any(end.time_status for end in found.ends):
        return "not followed"
    words = ["confirmed" if end.confirmed else "left" for end in found.ends]
    return words[0] if words[0] == words[1] else f"smallest {words[0]}, largest {words[1]}"
