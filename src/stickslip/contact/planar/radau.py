"""Tables of the Radau IIA collocation on [0, 1] with `STAGES` nodes (Hairer & Wanner 1996, section IV.5).

The last node is 1.
"""

from typing import Any

import numpy as np

from stickslip.arrays import FloatArray

STAGES = 8
# options of functions that only compiled code calls: without wrappers for Python, which take long to compile
INNER: Any = {"cache": True, "error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
# options of functions with a single caller, with which they are compiled instead of separately
PART: Any = {**INNER, "inline": "always"}


def _nodes(stages: int) -> FloatArray:
    """Return zeros of P_s - P_{s-1} on [0, 1]."""
    of = np.zeros(stages + 1)
    of[stages], of[stages - 1] = 1.0, -1.0
    series = np.polynomial.legendre.Legendre(of)
    roots = np.sort(series.roots().real)
    for _ in range(3):
        roots[:-1] -= series(roots[:-1]) / series.deriv()(roots[:-1])
    roots[-1] = 1.0
    return 0.5 * (roots + 1.0)


def _legendre(at: FloatArray, degree: int) -> FloatArray:
    return np.polynomial.legendre.legvander(2.0 * at - 1.0, degree)


NODES = np.concatenate([[0.0], _nodes(STAGES)])  # start of a piece and its stages
_VALUES = _legendre(NODES, STAGES)
_TO_LEGENDRE = np.linalg.inv(_VALUES)
_RATE = np.column_stack(
    [2.0 * np.polynomial.legendre.Legendre.basis(j).deriv()(2.0 * NODES - 1.0) for j in range(STAGES + 1)]
)
RATE = np.ascontiguousarray((_RATE @ _TO_LEGENDRE)[1:])  # (s, s + 1) derivative at the stages
BEND = np.ascontiguousarray(RATE[-1] @ (_RATE @ _TO_LEGENDRE))  # second derivative at the end
HIGHEST = np.ascontiguousarray(_TO_LEGENDRE[-1])  # coefficient of the Legendre polynomial of degree s
FINE = 16  # points at which the polynomial of a piece is checked between its nodes
TO_FINE = np.ascontiguousarray(_legendre(np.arange(1, FINE + 1) / FINE, STAGES) @ _TO_LEGENDRE)
BARYCENTRIC = np.array([1.0 / np.prod(c - np.delete(NODES, i)) for i, c in enumerate(NODES)])
# exact for polynomials of degree 2 s - 2
WEIGHTS = np.linalg.solve(_legendre(NODES[1:], STAGES - 1).T, np.eye(STAGES)[0])

# Times and their rates at the nodes of a piece. The second kind is for pieces up to the opening of the contact, where θ
# is a power of the remaining time. It ends just before: at zero limit θ jumps to the direction of the motion, which no
# polynomial can follow.
POWER = 3
NEARLY = 0.97
EVEN, CROWDED = 0, 1
TIMES = np.vstack([NODES, 1.0 - (1.0 - NEARLY * NODES) ** POWER])
PACE = np.vstack([np.ones(STAGES + 1), NEARLY * POWER * (1.0 - NEARLY * NODES) ** (POWER - 1)])
