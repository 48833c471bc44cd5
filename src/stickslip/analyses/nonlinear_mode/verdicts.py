"""Verdicts on nonlinear modes, and the terminal tables."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from stickslip.analyses.collected import number, told_apart
from stickslip.response.nonlinear_modes.backbone import MEETS, OVER
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres, millimetres_between

NONE = 1e-9  # damping ratio below which there is none
LIFTS, AGAIN = "lift-off", "taken up again"  # in the words of `Backbone.end`


def case_verdicts(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return what is to be thought of a case from its variables."""
    each = [_of_branch(label, case, i) for i in range(case["mode"].size if "mode" in case else 0)]
    sound = [i for i, own in enumerate(each) if all(v.level == "trusted" for v in own)]
    found = [v for own in each for v in own]
    return [*found, Verdict("trusted", label, None, _followed(case, sound))] if sound else found


def branch_name(case: Mapping[str, xr.Variable] | xr.Dataset, i: int) -> str:
    """Return the name of a mode of a wave."""
    wave, mode = (int(np.asarray(case[n].values)[i]) for n in ("wave_number", "mode"))
    return f"mode {mode}" if wave < 0 else f"wave {wave}, mode {mode}"


def _followed(case: Mapping[str, xr.Variable], sound: Sequence[int]) -> str:
    """Say of modes without doubts over which amplitudes they were followed, and the largest damping ratio of them."""
    every = case["mode"].size
    amplitude, ratios = case["amplitude"].values[sound], case["largest_damping_ratio"].values[sound]
    most = sound[int(np.argmax(ratios))]
    ratio, at = (float(case[f"largest_damping_{n}"].values[most]) for n in ("ratio", "amplitude"))
    who = branch_name(case, most) if every == 1 else f"{len(sound)} of {every} modes"
    damping = f"the largest damping ratio is {100 * ratio:.3g} %" if abs(ratio) > NONE else "without damping"
    where = f" at {millimetres(at)}" if abs(ratio) > NONE else ""
    of = f", of {branch_name(case, most)}" if every > 1 and where else ""
    sizes = millimetres_between(float(np.nanmin(amplitude)), float(np.nanmax(amplitude)))
    return f"{who} followed from {sizes}: {damping}{where}{of}"


def _of_branch(label: str, case: Mapping[str, xr.Variable], i: int) -> list[Verdict]:
    name = branch_name(case, i)
    problem, end = str(case["problem"].values[i]), str(case["end"].values[i])
    if problem:
        return [Verdict("doubtful", label, None, f"{name}: {problem.removesuffix('.').removeprefix(f'{name}: ')}")]
    found = []
    if end.startswith(LIFTS):
        why = f"{name}: {end}"
        found.append(
            Verdict(
                "trusted",
                label,
                None,
                why,
                "Beyond it contacts hold nothing together that vibrates periodically in this mode.",
            )
        )
    elif not end.startswith(("amplitude reached", "gross slip")):
        found.append(Verdict("doubtful", label, None, f"{name}: {end}", "Give it more points, or more harmonics."))
    found += _of_resonances(label, name, end)
    status = case["status"].values[i]
    gaps = int(np.count_nonzero(status > 0))
    solved = np.flatnonzero(status == 0)
    lost = solved.size > 0 and bool(np.any(status[: solved[-1]] > 0))
    if lost or AGAIN in end:
        why = f"{name}: it was lost and taken up again further on; {gaps} of its points are no motions"
        found.append(Verdict("doubtful", label, None, why, "What lies beyond may be another mode."))
    return found + _of_harmonics(label, name, case, i)


def _of_resonances(label: str, name: str, end: str) -> list[Verdict]:
    """Return what is to be thought of harmonics that meet other modes."""
    told = [text for text in end.split("; ") if MEETS in text]
    over = [text for text in told if text.startswith(OVER)]
    if over:
        remedy = "Give nonlinear_mode.amplitude_mm around it, with more points: other motions of the same amplitude exist there."
        return [Verdict("doubtful", label, None, f"{name}: {'; '.join(over)}", remedy)]
    if not told:
        return []
    remedy = "Several motions of one amplitude may exist there, and a forced response near it has more than one peak."
    return [Verdict("trusted", label, None, f"{name}: {'; '.join(told)}", remedy, warns=True)]


def _of_harmonics(label: str, name: str, case: Mapping[str, xr.Variable], i: int) -> list[Verdict]:
    """Return what is to be thought of the harmonics of a mode."""
    solved = case["status"].values[i] == 0
    change, wanted = case["change"].values[i][solved], float(case["accuracy"].values[i])
    if change.size and np.all(np.isnan(change)):
        why = f"{name}: was solved with one set of harmonics alone"
        return [Verdict("doubtful", label, None, why, "Raise nonlinear_mode.most_harmonics.")]
    above = change[change > wanted]
    if not above.size:
        return []
    most = float(above[np.isfinite(above)].max(initial=0.0))
    by = f"by up to {100 * most:.2g} %" if most else "by an unknown amount"
    why = f"{name}: frequency or damping ratio of {above.size} of its {change.size} motions still change {by} with the last harmonics"
    return [
        Verdict(
            "doubtful", label, None, why, "Raise nonlinear_mode.most_harmonics, or nonlinear_mode.accuracy_percent."
        )
    ]


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints: the modes of each case."""
    return tuple(_table(case, head) for case, head in told_apart(data) if "mode" in case)


def _table(case: xr.Dataset, head: str) -> TextTable:
    rows = []
    for i in range(case.sizes["branch"]):
        hertz = case["frequency_hz"].values[i] if "frequency_hz" in case else np.zeros(0)
        known = hertz[np.isfinite(hertz)]
        rows.append(
            (
                branch_name(case, i),
                f"{float(case['mode_frequency_hz'][i]):.6g}",
                f"{known.min():.6g} to {known.max():.6g}" if known.size else "-",
                f"{100 * float(case['mode_damping_ratio'][i]):+.4g}",
                number(100 * float(case["largest_damping_ratio"][i])),
                number(1e3 * float(case["largest_damping_amplitude"][i])),
                str(case["problem"][i].values) or str(case["end"][i].values),
            )
        )
    columns = ("mode", "Hz, stuck", "Hz", "damping %, stuck", "most damping %", "at mm", "end")
    return TextTable(
        f"{head}Nonlinear modes over the amplitude of {case.attrs.get('output', '')}", columns, tuple(rows)
    )
