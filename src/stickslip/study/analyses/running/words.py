"""What is said of a finished run-up: verdicts, and the tables of the terminal."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from stickslip.study.analyses.analysis import TextTable
from stickslip.study.analyses.verdict import Verdict
from stickslip.study.keep.netcdf import one_case

BETWEEN = 1e-5  # error between the speeds of the model above which there is a doubt
UNKNOWN = Verdict(
    "trusted",
    why="no motion of the run-up was examined for stability",
    remedy="A [forced_response] at the speed of a peak does.",
)


def verdicts_of(case: xr.Dataset, label: str, limit: float) -> list[Verdict]:
    """Return what is to be thought of a case."""
    found = [v for i in range(case.sizes["line"]) for v in _of_line(case, i, label, limit)]
    return found or [Verdict("trusted", label, None, "every engine order was followed")]


def _of_line(case: xr.Dataset, i: int, label: str, limit: float) -> Iterator[Verdict]:
    order = int(case["engine_orders"].values[i])
    own = case["points_order"].values == order
    name, hertz = f"engine order {order}", float(case["peak_frequency_hz"].values[i])
    failed, total = int(case["failed"].values[i]), int(own.sum())
    top = int(case["peak_point"].values[i])
    if top < 0:
        yield Verdict("wrong", label, None, f"{name}: no point has a solution", "See the forced response at one of the speeds.")  # fmt: skip
        return
    if failed:
        yield Verdict(
            "doubtful",
            label,
            None,
            f"{name}: {failed} of {total} points have no solution",
            "Give more points, or look at a [forced_response] at such a speed.",
        )
    error = float(case["error"].values[top])
    if error > limit:
        yield Verdict(
            "doubtful",
            label,
            hertz,
            f"{name}: missing harmonics may change the peak by {100 * error:.2g} %",
            "Raise harmonics.high.",
        )
    between = float(case["speed_error"].values[i])
    if between > BETWEEN:
        yield Verdict(
            "doubtful",
            label,
            None,
            f"{name}: between the speeds at which the model was assembled its matrices are off by {between:.1e}",
            "Take a narrower range of speeds, or a smaller run_up.tolerance.",
        )
    if not case["peak_inside"].values[i]:
        yield Verdict(
            "trusted",
            label,
            hertz,
            f"{name}: the largest amplitude is at an end of the range",
            "Widen speeds_rpm to see the resonance.",
        )


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints."""
    found = []
    for k in range(data.sizes["case"]):
        case = one_case(data, k) if data.sizes["case"] > 1 else data.isel(case=0)
        label = str(data["case_label"].values[k])
        head = f"{label}: " if label and data.sizes["case"] > 1 else ""
        found.append(_peaks(case, head))
    return tuple(found)


def _peaks(case: xr.Dataset, head: str) -> TextTable:
    rows = []
    for i, order in enumerate(case["engine_orders"].values.astype(int)):
        own = case["points_order"].values == order
        top = int(case["peak_point"].values[i])
        slip = "-" if top < 0 else f"{100 * case['slipping'].values[top]:.0f} %"
        rows.append(
            (
                f"{order}",
                f"{int(case['wave_number'].values[i])}",
                f"{1e3 * case['peak_amplitude'].values[i]:.5g}",
                f"{case['peak_speed_rpm'].values[i]:.6g}",
                f"{case['peak_frequency_hz'].values[i]:.6g}",
                slip,
                f"{own.sum()}",
                f"{int(case['harmonic'].values[own].max())}",
                f"{int(case['failed'].values[i])}",
                f"{int(case['newton_steps'].values[i])}",
                "" if case["peak_inside"].values[i] else "end of the range",
            )
        )
    names = ("engine order", "wave", "peak mm", "at rpm", "at Hz", "slipping", "points", "H", "failed", "Newton", "")  # fmt: skip
    speeds = case["static_speed_rpm"].values
    errors = float(np.max(case["speed_error"].values))
    lines = [
        f"the model was assembled at {speeds.size} speeds; between them it is off by {errors:.1e} at most"
    ]
    if np.any(case["common_modes"].values == 1):
        lines.append(
            "what the modes of three speeds span is kept at all: at some speed another mode would take the place of one kept"
        )
    return TextTable(f"{head}Run-up along engine orders", names, tuple(rows), tuple(lines))
