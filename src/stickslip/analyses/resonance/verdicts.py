"""Verdicts on resonances, and the terminal tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.columns import number, record_of, told_apart
from stickslip.analyses.resonance.records import PeakCurve, Resonances
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict, from_json
from stickslip.units import millimetres

FAR_BELOW = 0.01  # largest relative difference of a peak by phase from the maximum beside it
ENOUGH = 0.01  # largest relative change of the highest peak by more harmonics
SPARSE = 12  # values that the terminal prints of each peak


def case_verdicts(
    label: str, case: Resonances, notes: Mapping[str, Mapping[str, Any]], values: Sequence[float]
) -> list[Verdict]:
    """Return the verdicts on a case from its record, the notes of its job, and the visited values, if any."""
    found = list(from_json(str(notes.get("model", {}).get("verdicts", "[]"))))
    problem = str(notes.get("last", {}).get("problem", ""))
    if not case.peaks:
        why = f"no peak was found: the range {problem}" if problem else "no peak was found"
        return [*found, Verdict("wrong", label, None, why, "Widen resonance.frequency_hz.")]
    found += _of_points(label, case)
    found += _of_unmet(label, notes.get("unmet", {}))
    found += _of_joined(label, case, values)
    found += _of_phase(label, case)
    found += _of_harmonics(label, notes.get("harmonics", {}))
    found += _of_overtaking(label, case)
    if problem:
        why = f"whether the last value has a peak that none of the followed ones leads to is not known: the range {problem}"
        found.append(Verdict("doubtful", label, None, why, "Widen resonance.frequency_hz."))
    if not any(v.rank for v in found):
        count = sum(bool(np.any(peak.maximum >= 0)) for peak in case.peaks)
        why = f"{count} peak{'s' * (count > 1)} of {case.output} over {case.parameter}, every point a solution and a maximum"
        value = np.concatenate([peak.value for peak in case.peaks])
        if np.unique(value[np.isfinite(value)]).size > 1:
            why += "; followed from the first value, not held against sweeps at the others"
        found.append(Verdict("trusted", label, None, why))
    return found


def _of_points(label: str, case: Resonances) -> list[Verdict]:
    found = []
    for i, peak in enumerate(case.peaks):
        lost, low = peak.value[peak.maximum == -1], peak.value[peak.maximum == 0]
        if lost.size:
            why = f"peak {i + 1} was not found at {_values(lost)}"
            found.append(Verdict("doubtful", label, None, why, "Give values closer together, or resonance.span."))
        if low.size:
            why = (
                f"peak {i + 1} is no maximum at {_values(low)}: it has met a minimum of the response and is gone there"
            )
            found.append(
                Verdict(
                    "doubtful", label, None, why, "Do not read these as peaks; where the curve folds, the peak ends."
                )
            )
    return found


def _of_unmet(label: str, noted: Mapping[str, Any]) -> list[Verdict]:
    """Doubt peaks that were followed back from the last value and that no sweep has confirmed."""
    found = []
    which, value = (np.atleast_1d(noted.get(k, [])) for k in ("peak", "value"))
    for peak in np.unique(which):
        own = value[which == peak]
        why = f"peak {int(peak) + 1} at {_values(own)} was followed back from the last value: a sweep at this value was not seen to reach it"
        if own.size > 1:
            why = why.replace("a sweep at this value was", "sweeps at these values were")
        found.append(
            Verdict(
                "doubtful", label, None, why, "The other peaks there are what a sweep meets; ask for [all_motions]."
            )
        )
    return found


def _of_joined(label: str, case: Resonances, values: Sequence[float]) -> list[Verdict]:
    """Note peaks that end because they merge with another one; peaks followed back end towards the first value."""
    found = []
    for i, peak in enumerate(case.peaks if values else ()):
        own = set(peak.value[np.isfinite(peak.value)].tolist())
        visited = values if values[0] in own else values[::-1]
        last = max((k for k, v in enumerate(visited) if v in own), default=-1)
        if last < 0 or last == len(visited) - 1:
            continue
        why = f"peak {i + 1} ends after {visited[last]:.4g}: at {visited[last + 1]:.4g} it has become one with another peak"
        found.append(Verdict("trusted", label, None, why, "Beyond, both are told as that one."))
    return found


def _of_phase(label: str, case: Resonances) -> list[Verdict]:
    if case.by == "horizontal_tangent":
        return []
    below = np.concatenate([peak.below for peak in case.peaks])
    known = np.isfinite(below)
    if not np.any(below[known] > FAR_BELOW):
        return []
    worst = float(np.max(below[known]))
    why = f"by {case.by} a peak lies {100 * worst:.2g} % below the largest amplitude beside it"
    return [Verdict("doubtful", label, None, why, 'Take by = "horizontal_tangent".')]


def _of_harmonics(label: str, noted: Mapping[str, Any]) -> list[Verdict]:
    if "change" not in noted:
        return []
    change, order = float(noted["change"]), int(noted["order"])
    what = f"the highest peak, at {float(noted['value']):.4g},"
    remedy = "Raise resonance.harmonics."
    if not np.isfinite(change):
        why = f"{what} was not found with {order} harmonics"
        return [Verdict("doubtful", label, None, why, remedy)]
    if abs(change) <= ENOUGH:
        return []
    return [Verdict("doubtful", label, None, f"{what} changes by {100 * change:+.2g} % with {order} harmonics", remedy)]


def _of_overtaking(label: str, case: Resonances) -> list[Verdict]:
    remedy = "Beyond, another resonance is higher."
    each = [f"peak {met.after + 1} overtakes peak {met.before + 1} at {met.value:.4g}" for met in case.overtakings]
    return [Verdict("trusted", label, None, why, remedy, warns=True) for why in each]


def _values(values: np.ndarray) -> str:
    told = ", ".join(f"{v:.4g}" for v in values[:3])
    return told if values.size <= 3 else f"{told} and {values.size - 3} more"


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables: the peaks of each case."""
    every = ((record_of(Resonances, case), head) for case, head in told_apart(data))
    return tuple(_table(found, head) for found, head in every if found.peaks)


def _table(found: Resonances, head: str) -> TextTable:
    rows = []
    for i, peak in enumerate(found.peaks):
        there = np.flatnonzero(peak.known)
        few = there if there.size <= SPARSE else there[np.linspace(0, there.size - 1, SPARSE).astype(int)]
        rows += [_row(str(i + 1), peak, int(k)) for k in few]
    columns = ("peak", "value", "Hz", "amplitude mm", "phase deg", "energy mJ", "of friction %")
    lines = []
    if found.smallest is not None:
        value, amplitude, hertz = found.smallest
        where = f"at {hertz:.6g} Hz" if np.isfinite(hertz) else "where two peaks are equally high"
        lines.append(f"The highest peak is lowest at {value:.6g}: {millimetres(amplitude, 6)} {where}.")
    title = f"{head}Resonances of {found.output} over {found.parameter}"
    return TextTable(title, columns, tuple(rows), tuple(lines))


def _row(name: str, peak: PeakCurve, k: int) -> tuple[str, ...]:
    kind, value = int(peak.maximum[k]), float(peak.value[k])
    if kind == -1:
        return (name, f"{value:.5g}", "not found", *("-",) * 4)
    energy = float(peak.energy[k])
    share = 100 * float(peak.friction_energy[k]) / energy if energy > 0.0 else np.nan
    return (
        name if kind == 1 else f"{name}, no maximum",
        f"{value:.5g}",
        f"{peak.frequency_hz[k]:.6g}",
        f"{1e3 * peak.amplitude[k]:.6g}",
        f"{peak.phase_deg[k]:.1f}",
        f"{1e3 * energy:.4g}",
        number(share, 3),
    )
