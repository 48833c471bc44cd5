"""Verdicts on a run-up, and the terminal tables."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray
from stickslip.study.analysis import TextTable
from stickslip.study.store.netcdf import one_case
from stickslip.study.verdict import Verdict

TOO_FAST = 0.05  # share that slowly varying amplitudes leave out, above which there is a doubt
BETWEEN = 1e-5  # error between the speeds of the model above which there is a doubt
UNKNOWN = Verdict(
    "trusted",
    why="no motion of the run-up was examined for stability",
    remedy="A [forced_response] at the speed of a peak does.",
)


def verdicts_of(case: xr.Dataset, label: str, limit: float) -> list[Verdict]:
    """Return what is to be thought of a case."""
    found = [v for i in range(case.sizes["line"]) for v in _of_line(case, i, label, limit)]
    found += _of_fast(case, label)
    return found or [Verdict("trusted", label, None, _followed(case))]


def _followed(case: xr.Dataset) -> str:
    most = float(case["error"].values[case["peak_point"].values].max())
    return f"every engine order was followed; more harmonics are predicted to change their peaks by {100 * most:.2g} % at most"


def _of_line(case: xr.Dataset, i: int, label: str, limit: float) -> Iterator[Verdict]:
    order = int(case["engine_orders"].values[i])
    own = case["points_order"].values == order
    name, hertz = f"engine order {order}", float(case["peak_frequency_hz"].values[i])
    failed, total = int(case["failed"].values[i]), int(own.sum())
    top = int(case["peak_point"].values[i])
    if top < 0:
        yield Verdict(
            "wrong", label, None, f"{name}: no point has a solution", "See the forced response at one of the speeds."
        )
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
    if np.isnan(error):
        h = int(case["harmonic"].values[top])
        why = f"{name}: whether more harmonics than H = {h} change the peak was not examined"
        yield Verdict("doubtful", label, hertz, why, 'harmonics.high = "auto" examines it.')
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


def _of_fast(case: xr.Dataset, label: str) -> Iterator[Verdict]:
    for i in range(case.sizes.get("fast", 0)):
        order, rate = (int(case["fast_order"].values[i]), float(case["fast_rate_rpm_per_s"].values[i]))
        name = f"engine order {order} at {rate:g} rpm/s"
        if not case["fast_finished"].values[i]:
            yield Verdict(
                "doubtful",
                label,
                None,
                f"{name}: the fast run-up was not followed to its end",
                "Take a smaller range of speeds, or another rate.",
            )
        elif case["fast_peak_speed_rpm"].values[i] in _ends(case["fast_speed_rpm"].values[i]):
            # no peak was passed, whose error could be told
            yield Verdict(
                "trusted",
                label,
                None,
                f"{name}: the largest amplitude is at an end of the range",
                "Widen speeds_rpm to see the peak.",
            )
            continue
        share = float(case["fast_neglected"].values[i])
        if share > TOO_FAST:
            yield Verdict(
                "doubtful",
                label,
                None,
                f"{name}: the amplitude varies so fast that {100 * share:.2g} % of its change is left out, and the peak may be off by as much",
                "Take a slower rate, or integrate in time.",
            )


def _ends(speeds: FloatArray) -> FloatArray:
    """Return the first and the last speed of a fast run-up, which may be padded with NaN."""
    return np.asarray(speeds[np.isfinite(speeds)][[0, -1]])


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return what the terminal prints."""
    found = []
    for k in range(data.sizes["case"]):
        case = one_case(data, k) if data.sizes["case"] > 1 else data.isel(case=0)
        label = str(data["case_label"].values[k])
        head = f"{label}: " if label and data.sizes["case"] > 1 else ""
        found.append(_peaks(case, head))
        if case.sizes.get("fast"):
            found.append(_fast(case, head))
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
    names = ("engine order", "wave", "peak mm", "at rpm", "at Hz", "slipping", "points", "H", "failed", "Newton", "")
    speeds = case["static_speed_rpm"].values
    errors = float(np.max(case["speed_error"].values))
    lines = [f"the model was assembled at {speeds.size} speeds; between them it is off by {errors:.1e} at most"]
    if np.any(case["common_modes"].values == 1):
        lines.append(
            "what the modes of three speeds span is kept at all: at some speed another mode would take the place of one kept"
        )
    return TextTable(f"{head}Run-up along engine orders", names, tuple(rows), tuple(lines))


def _fast(case: xr.Dataset, head: str) -> TextTable:
    """Return the fast run-ups beside the steady peaks."""
    columns = (
        "order",
        "rate_rpm_per_s",
        "peak_amplitude",
        "ratio",
        "peak_speed_rpm",
        "shift_rpm",
        "harmonic",
        "neglected",
    )
    rows = tuple(
        (
            f"{m:.0f}",
            f"{rate:g}",
            f"{1e3 * peak:.5g}",
            f"{ratio:.4f}",
            f"{rpm:.6g}",
            f"{shift:+.4g}",
            f"{h:.0f}",
            f"{100 * off:.2g} %",
        )
        for m, rate, peak, ratio, rpm, shift, h, off in zip(
            *(case[f"fast_{name}"].values for name in columns), strict=True
        )
    )
    names = ("engine order", "rpm/s", "peak mm", "of the steady one", "at rpm", "shift rpm", "H", "left out")
    return TextTable(f"{head}Fast run-up", names, rows)
