"""What the alert said at the points of the first passage, as variables of the dataset."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stickslip.study.collect import HZ, CaseResult


def alert_variables(results: Sequence[CaseResult]) -> dict[str, xr.Variable]:
    """Return load case, frequency and predicted error of every point at which the alert was asked.

    The accepted points do not tell it all: a branch with many harmonics takes the place of points that the alert spoke of.
    """
    asked = [
        (i, point)
        for i, result in enumerate(results)
        for point in result.solved
        if point.stage == "low" and np.isfinite(point.predicted_error)
    ]

    def variable(values: list[float] | list[int], units: str, about: str) -> xr.Variable:
        dtype = np.int64 if units == "1" else np.float64
        return xr.Variable(
            ("alert_point",), np.array(values, dtype=dtype), {"units": units, "long_name": about}
        )

    return {
        "alert_case": variable([i for i, _ in asked], "1", "load case of a point of the alert"),
        "alert_frequency_hz": variable(
            [p.omega / HZ for _, p in asked], "Hz", "frequency at which the alert was asked"
        ),
        "alert_error_percent": variable(
            [100 * p.predicted_error for _, p in asked],
            "percent",
            "error of the few harmonics predicted by the Jacobian Alert",
        ),
    }
