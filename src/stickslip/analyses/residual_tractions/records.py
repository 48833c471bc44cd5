"""Journal records of bounds at a frequency."""

import json
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.response.residual_tractions.bounds import Bound, TractionBounds

Stage = Literal["point", "least", "most"]
ENDS = ("reference", "least", "most")


@dataclass(frozen=True, eq=False)
class TractionRecord:
    """Bounds at a frequency.

    Parameters
    ----------
    stage
        ``point`` of the range; ``least`` and ``most``: where that bound is highest.
    omega
        rad/s.
    amplitude
        (3,) of the motion from the model's own start, the smallest, the largest, m; NaN where no motion was found.
    coefficients
        (3, H+1, n) displacements of all dofs, m.
    sliders, multipliers
        (3, n_springs, 2) as of `Bound`.
    springs
        JSON list of names.
    solves, failures
        Motions solved for, and starts from which none was found.
    branches
        As of `TractionBounds`.
    errors
        (3,) as of `Bound`.
    """

    stage: Stage
    omega: float
    amplitude: FloatArray
    coefficients: ComplexArray
    sliders: FloatArray
    multipliers: FloatArray
    springs: str
    solves: int
    failures: int
    branches: int = 1
    errors: FloatArray = field(default_factory=lambda: np.full(3, np.nan))


def to_record(bounds: TractionBounds, stage: Stage) -> TractionRecord:
    """Return bounds as a record."""
    each = [getattr(bounds, end) for end in ENDS]

    def every(name: str) -> FloatArray:
        return np.array([getattr(one, name) for one in each])

    return TractionRecord(
        stage,
        bounds.omega,
        every("amplitude"),
        np.array([one.coefficients for one in each]),
        every("sliders"),
        every("multipliers"),
        json.dumps(bounds.springs),
        bounds.solves,
        bounds.failures,
        bounds.branches,
        every("error"),
    )


def of_record(record: TractionRecord) -> TractionBounds:
    """Return the bounds of a record."""
    reference, least, most = (
        Bound(
            float(record.amplitude[k]),
            record.coefficients[k],
            record.sliders[k],
            record.multipliers[k],
            float(record.errors[k]),
        )
        for k in range(len(ENDS))
    )
    names = tuple(json.loads(record.springs))
    return TractionBounds(record.omega, reference, least, most, names, record.solves, record.failures, record.branches)
