"""Verdicts on motions with two frequencies, and the terminal tables."""

from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr

from stickslip.analyses.collected import number, told_apart
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import millimetres_between

LARGE = 0.02  # left out, or off from time integration, above which a motion is doubtful whatever was asked for
SLIP = 5e-3  # rad a turn, the same


def case_verdicts(label: str, case: Mapping[str, xr.Variable]) -> list[Verdict]:
    """Return what is to be thought of a case from its variables."""
    points = case["kind"].size if "kind" in case else 0
    found = [v for i in range(points) for v in _of_point(label, case, i)]
    if points and not found:
        worst = np.nanmax(np.append(case["left_out"].values, np.nan_to_num(0.0)))
        why = f"{points} motions, combined frequencies left out would change the motion by at most {100 * worst:.2g} %"
        found.append(Verdict("trusted", label, None, f"{why}; compared with time integration"))
    return found


def _of_point(label: str, case: Mapping[str, xr.Variable], i: int) -> list[Verdict]:
    def number(name: str) -> float:
        return float(case[name].values[i])

    hz, kind, why = number("first_hz"), str(case["kind"].values[i]), str(case["why"].values[i])
    if kind == "not found":
        remedy = "Give quasi_periodic.second_hz, more harmonics, or nearer frequencies_hz."
        return [Verdict("wrong", label, hz, f"no motion was found: {why.removesuffix('.')}", remedy)]
    if kind == "no second tone":
        return [_without(label, hz, why, str(case["unknown"].values[i]))]
    found = list(_unexamined(label, case, i))
    found += _left_out(label, hz, number("left_out"), float(case.get("accuracy", LARGE)))
    if number("slip") > SLIP:
        off = f"contacts were marched at a ratio by which the second phase is off by {number('slip'):.2g} rad a turn"
        found.append(
            Verdict("doubtful", label, hz, off, "Take frequencies whose ratio is nearer to one of small numbers.")
        )
    away = number("time_off") if "time_off" in case else np.nan
    if away > LARGE:
        told = f"time integration is {100 * away:.2g} % off"
        found.append(
            Verdict("doubtful", label, hz, told, "Lower quasi_periodic.accuracy_percent, or look for another motion.")
        )
    if "time_largest" in case and not np.isfinite(away):
        ends = [(float(case[n].values[i, 0]), float(case[f"time_{n}"].values[i, 0])) for n in ("largest", "least")]
        size = ends[0][0]
        apart = max(abs(b - t) for b, t in ends) / size
        if apart > 2 * LARGE:
            told = f"in time the amplitude goes from {millimetres_between(ends[1][1], ends[0][1])}, the balance has {millimetres_between(ends[1][0], size)}"
            found.append(Verdict("doubtful", label, hz, told, "The motion may be left, or not be settled in time."))
    return found


def _left_out(label: str, hz: float, share: float, asked: float) -> list[Verdict]:
    """Return a doubt where combined frequencies left out count, or count more than was asked for."""
    if share <= min(asked, LARGE):
        return []
    left = f"combined frequencies left out would change the motion by {100 * share:.2g} %"
    if share <= LARGE:
        left += f", more than the {100 * asked:.3g} % that is asked for"
    remedy = "Raise quasi_periodic.most_harmonics, or ask for less: accuracy_percent."
    return [Verdict("doubtful", label, hz, left, remedy)]


def _without(label: str, hz: float, why: str, unknown: str) -> Verdict:
    if not unknown:
        return Verdict("trusted", label, hz, f"there is no second tone: {why}")
    told = f"no second tone was found: {why}; whether anything else grows is not known: {unknown.removesuffix('.')}"
    remedy = "Give quasi_periodic.second_hz, or see forced_response --verify."
    return Verdict("doubtful", label, hz, told, remedy)


def _unexamined(label: str, case: Mapping[str, xr.Variable], i: int) -> Iterator[Verdict]:
    """Yield a doubt where no time integration says whether the motion is left."""
    hz, told = float(case["first_hz"].values[i]), "its stability was not examined"
    if "time_largest" not in case:
        remedy = "Set quasi_periodic.in_time = true, of a single structure."
        yield Verdict("doubtful", label, hz, told, remedy)
    elif not np.isfinite(case["time_largest"].values[i, 0]):
        told += ": time integration came to nothing"
        remedy = "Take frequencies whose ratio is nearer to one of small numbers, but not to 1."
        yield Verdict("doubtful", label, hz, told, remedy)


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints: the motions of each case."""
    return tuple(_table(case, head) for case, head in told_apart(data) if "kind" in case)


def _table(case: xr.Dataset, head: str) -> TextTable:
    rows = [
        (
            number(float(case["first_hz"][i])),
            number(float(case["second_hz"][i])),
            str(case["kind"][i].values),
            number(1e3 * float(case["least"][i, 0])),
            number(1e3 * float(case["largest"][i, 0])),
            number(1e3 * float(case["rms"][i, 0])),
            str(int(case["combined"][i])),
            number(100 * float(case["left_out"][i])),
        )
        for i in range(case.sizes["point"])
    ]
    columns = ("first Hz", "second Hz", "", "least mm", "largest mm", "rms mm", "combined", "left out %")
    name = str(case["output_name"].values[0])
    return TextTable(f"{head}Motions with two frequencies, amplitude of {name}", columns, tuple(rows))
