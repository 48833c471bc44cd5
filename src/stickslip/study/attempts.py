"""Every solution that a run computed, accepted or not, and what the strategy said of it, as variables of the dataset."""

from collections.abc import Sequence
from typing import get_args

import numpy as np
import xarray as xr

from stickslip.arrays import IntArray
from stickslip.response.forced.problem import Stage
from stickslip.response.forced.response import ForcedPoint
from stickslip.solve.status import Status
from stickslip.study.collect import HZ, CaseResult, unknowns
from stickslip.study.netcdf import variable

STAGES = get_args(Stage)


def alert_variables(results: Sequence[CaseResult]) -> dict[str, xr.Variable]:
    """Return load case, frequency and predicted error of every first solution that an alert was asked about.

    The accepted points do not tell it all: a branch with many harmonics takes the place of points that the alert spoke of.
    """
    asked = [
        (i, point)
        for i, result in enumerate(results)
        for point in result.solved
        if point.stage == "low" and not np.isnan(point.predicted_error)
    ]
    return {
        "alert_case": _whole("alert_point", [i for i, _ in asked], "load case of such a point"),
        "alert_frequency_hz": _real(
            "alert_point",
            [p.omega / HZ for _, p in asked],
            "Hz",
            "frequency at which the alert was asked",
        ),
        "alert_error_percent": _real(
            "alert_point",
            [100 * p.predicted_error for _, p in asked],
            "percent",
            "error of the first solution that the alert predicted",
        ),
        "alert_repeated": _whole(
            "alert_point", [int(p.asked.size > 0) for _, p in asked], "1 if it asked for more"
        ),
    }


def attempt_variables(results: Sequence[CaseResult], high: int) -> dict[str, xr.Variable]:
    """Return one entry for each solution computed, in the order in which they came.

    Parameters
    ----------
    results
        Finished load cases.
    high
        Highest harmonic of the dataset.
    """
    every = [(i, p) for i, r in enumerate(results) for p in r.solved]
    points = [p for _, p in every]
    found = {
        "attempt_case": _whole("attempt", [i for i, _ in every], "load case of a solution"),
        "attempt_frequency_hz": _real(
            "attempt", [p.omega / HZ for p in points], "Hz", "frequency of a solution"
        ),
        "attempt_stage": _whole(
            "attempt", [STAGES.index(p.stage) for p in points], "when it was made"
        ),
        "attempt_kept": kept(points, high, "attempt"),
        "attempt_unknowns": _whole("attempt", [unknowns(p) for p in points], "real unknowns"),
        "attempt_indicator": _real(
            "attempt",
            [p.predicted_error for p in points],
            "1",
            "what the strategy compared with its threshold, NaN where it was not asked",
        ),
        "attempt_repeated": _whole(
            "attempt", [int(p.asked.size > 0) for p in points], "1 if it asked for more"
        ),
        "attempt_status": _whole("attempt", [int(p.status) for p in points], "how it ended"),
        "attempt_newton_iterations": _whole(
            "attempt", [p.iterations for p in points], "Newton iterations"
        ),
        "attempt_seconds": _real("attempt", [p.seconds_total for p in points], "s", "time it took"),
    }
    found["attempt_stage"].attrs |= {
        "flag_values": np.arange(len(STAGES)),
        "flag_meanings": " ".join(STAGES),
    }
    found["attempt_status"].attrs |= status_flags()
    return found


def kept(points: Sequence[ForcedPoint], high: int, dimension: str) -> xr.Variable:
    """Return 1 for every harmonic from 0 to `high` that a solution keeps, else 0."""
    table = np.zeros((len(points), high + 1), dtype=np.int64)
    for row, point in zip(table, points, strict=True):
        row[point.harmonics] = 1
    return variable(f"{dimension} harmonic", table, "1", "1 if the solution keeps the harmonic")


def status_flags() -> dict[str, IntArray | str]:
    """Return the attributes that say what a status means."""
    return {
        "flag_values": np.array([int(s) for s in Status], dtype=np.int64),
        "flag_meanings": " ".join(s.name.lower() for s in Status),
    }


def _whole(dimension: str, values: Sequence[int], about: str) -> xr.Variable:
    return variable(dimension, np.array(values, dtype=np.int64), "1", about)


def _real(dimension: str, values: Sequence[float], units: str, about: str) -> xr.Variable:
    return variable(dimension, np.array(values, dtype=np.float64), units, about)
