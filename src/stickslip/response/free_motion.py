"""A damper whose mean position nothing determines.

A contact that slips or opens in every cycle forgets its mean position. When all contacts do, the coordinates of a free damper that no
normal spring holds may drift: the Jacobian is singular, and the static part of the solution along them means nothing.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.response.forced.problem import ForcedPoint, ForcedProblem

SINGULAR = 1e-9  # smallest over largest singular value of the balanced Jacobian below which a coordinate counts as undetermined


@dataclass(frozen=True, slots=True)
class Drift:
    """How well the contacts hold the free body at one point.

    Attributes
    ----------
    ratio
        Smallest over largest singular value of the static block of the Jacobian of the contacts alone, condensed to the free body.
    coordinate
        Name of the coordinate that is held least.
    """

    ratio: float
    coordinate: str

    @property
    def undetermined(self) -> bool:
        """Whether the coordinate may drift."""
        return self.ratio < SINGULAR


def drift(problem: ForcedProblem, point: ForcedPoint) -> Drift:
    """Find the least held coordinate of the periodic problem at a point.

    Parameters
    ----------
    problem
        System, load and sweep.
    point
        A point of the response, converged or not.
    """
    balance = problem.balance(point.support)
    jac = balance.linearise(balance.unknowns(point.coefficients), point.omega).dense_jac()
    # balance rows and columns first: translations and rotations differ by orders of magnitude
    scale = np.sqrt(np.maximum(np.max(np.abs(jac), axis=0), np.finfo(float).tiny))
    _, values, right = np.linalg.svd(jac / scale[:, None] / scale[None, :])
    labels = problem.system.retained_labels
    worst = int(np.argmax(np.abs(right[-1])))
    return Drift(float(values[-1] / values[0]), labels[worst % len(labels)])
