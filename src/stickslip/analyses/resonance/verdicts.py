"""Verdicts on resonances, and the terminal tables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.collected import number, told_apart
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict, from_json
from stickslip.units import millimetres

FAR_BELOW = 0.01  # of the maximum beside it: by phase, a peak that is none
ENOUGH = 0.01  # change of the highest peak by twice the harmonics
SPARSE = 12  # values that the terminal prints of each peak


def case_verdicts(
    label: str, case: Mapping[str, xr.Variable], notes: Mapping[str, Mapping[str, Any]], values: Sequence[float]
) -> list[Verdict]:
    """Return what is to be thought of a case from its variables and notes, and the values that were visited, if any."""
    found = list(from_json(str(notes.get("model", {}).get("verdicts", "[]"))))
    problem = str(notes.get("last", {}).get("problem", ""))
    if "maximum" not in case:
        why = f"no peak was found: the range {problem}" if problem else "no peak was found"
        return [*found, Verdict("wrong", label, None, why, "Widen resonance.frequency_hz.")]
    kind, value = case["maximum"].values, case["value"].values
    found += _of_points(label, kind, value)
    found += _of_unmet(label, notes.get("unmet", {}))
    found += _of_joined(label, value, values)
    found += _of_phase(label, case)
    found += _of_harmonics(label, notes.get("harmonics", {}))
    if "overtaking_value" in case:
        found += _of_overtaking(label, case)
    if problem:
        why = f"whether the last value has a peak that none of the followed ones leads to is not known: the range {problem}"
        found.append(Verdict("doubtful", label, None, why, "Widen resonance.frequency_hz."))
    if not any(v.rank for v in found):
        count = int(np.sum(np.any(kind >= 0, axis=1)))
        why = f"{count} peak{'s' * (count > 1)} of {case['output'].values} over {case['parameter'].values}, every point a solution and a maximum"
        if np.unique(value[np.isfinite(value)]).size > 1:
            why += "; followed from the first value, not held against sweeps at the others"
        found.append(Verdict("trusted", label, None, why))
    return found


def _of_points(label: str, kind: np.ndarray, value: np.ndarray) -> list[Verdict]:
    found = []
    for i, own in enumerate(kind):
        lost, low = value[i][own == -1], value[i][own == 0]
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
    """Return doubts of peaks that are known from the last value alone."""
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


def _of_joined(label: str, value: np.ndarray, values: Sequence[float]) -> list[Verdict]:
    """Return notes of peaks that end because they have become another one; those that were followed back end towards the first value."""
    found = []
    for i, row in enumerate(value if values else []):
        own = set(row[np.isfinite(row)].tolist())
        visited = values if values[0] in own else values[::-1]
        last = max((k for k, v in enumerate(visited) if v in own), default=-1)
        if last < 0 or last == len(visited) - 1:
            continue
        why = f"peak {i + 1} ends after {visited[last]:.4g}: at {visited[last + 1]:.4g} it has become one with another peak"
        found.append(Verdict("trusted", label, None, why, "Beyond, both are told as that one."))
    return found


def _of_phase(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    if str(case["by"].values) == "horizontal_tangent":
        return []
    below = case["below"].values
    known = np.isfinite(below)
    if not np.any(below[known] > FAR_BELOW):
        return []
    worst = float(np.max(below[known]))
    why = f"by {case['by'].values} a peak lies {100 * worst:.2g} % below the largest amplitude beside it"
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


def _of_overtaking(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    each = zip(*(case[f"overtaking_{k}"].values for k in ("value", "before", "after")), strict=True)
    return [
        Verdict(
            "trusted",
            label,
            None,
            f"peak {b + 1} overtakes peak {a + 1} at {v:.4g}",
            "Beyond, the highest amplitude is that of another resonance.",
            warns=True,
        )
        for v, a, b in each
    ]


def _values(values: np.ndarray) -> str:
    told = ", ".join(f"{v:.4g}" for v in values[:3])
    return told if values.size <= 3 else f"{told} and {values.size - 3} more"


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints: the peaks of each case."""
    return tuple(_table(case, head) for case, head in told_apart(data) if "maximum" in case)


def _table(case: xr.Dataset, head: str) -> TextTable:
    rows = []
    for i in range(case.sizes["peak"]):
        there = np.flatnonzero(case["maximum"].values[i] > -2)
        few = there if there.size <= SPARSE else there[np.linspace(0, there.size - 1, SPARSE).astype(int)]
        rows += [_row(case, i, int(k)) for k in few]
    columns = ("peak", "value", "Hz", "amplitude mm", "phase deg", "energy mJ", "of friction %")
    lines = []
    if np.isfinite(float(case.attrs.get("smallest_value", np.nan))):
        value, amplitude, hertz = (float(case.attrs[f"smallest_{k}"]) for k in ("value", "amplitude", "frequency_hz"))
        where = f"at {hertz:.6g} Hz" if np.isfinite(hertz) else "where two peaks are equally high"
        lines.append(f"The highest peak is lowest at {value:.6g}: {millimetres(amplitude, 6)} {where}.")
    title = f"{head}Resonances of {case.attrs.get('output', '')} over {case.attrs.get('parameter', '')}"
    return TextTable(title, columns, tuple(rows), tuple(lines))


def _row(case: xr.Dataset, i: int, k: int) -> tuple[str, ...]:
    kind = int(case["maximum"].values[i, k])
    name = str(i + 1)
    if kind == -1:
        return (name, f"{float(case['value'].values[i, k]):.5g}", "not found", *("-",) * 4)

    def of(key: str) -> float:
        return float(case[key].values[i, k])

    energy = of("energy")
    share = 100 * of("friction_energy") / energy if energy > 0.0 else np.nan
    return (
        name if kind == 1 else f"{name}, no maximum",
        f"{of('value'):.5g}",
        f"{of('frequency_hz'):.6g}",
        f"{1e3 * of('amplitude'):.6g}",
        f"{of('phase_deg'):.1f}",
        f"{1e3 * energy:.4g}",
        number(share, 3),
    )
