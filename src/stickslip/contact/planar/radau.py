"""Tables of the Radau IIA collocation on [0, 1] with `STAGES` nodes, the last of them at 1 (Hairer & Wanner 1996, section IV.5)."""

from typing import Any

import numpy as np

from stickslip.arrays import FloatArray

STAGES = 8
# Of compiled functions that only compiled ones call: their arrays need no way in from Python, which takes long to compile.
INNER: Any = {"cache": True, "error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
# Of those that one function alone calls: they are compiled with it, and not once before.
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


NODES = np.concatenate([[0.0], _nodes(STAGES)])  # the start of a piece and its stages
_VALUES = _legendre(NODES, STAGES)
_TO_LEGENDRE = np.linalg.inv(_VALUES)
_RATE = np.column_stack(
    [2.0 * np.polynomial.legendre.Legendre.basis(j).deriv()(2.0 * NODES - 1.0) for j in range(STAGES + 1)]
)
RATE = np.ascontiguousarray((_RATE @ _TO_LEGENDRE)[1:])  # (s, s + 1) derivative at the stages
BEND = np.ascontiguousarray(RATE[-1] @ (_RATE @ _TO_LEGENDRE))  # second derivative at the end
HIGHEST = np.ascontiguousarray(_TO_LEGENDRE[-1])  # coefficient of the Legendre polynomial of degree s
FINE = 16  # points between which a polynomial of a piece is looked at
TO_FINE = np.ascontiguousarray(_legendre(np.arange(1, FINE + 1) / FINE, STAGES) @ _TO_LEGENDRE)
BARYCENTRIC = np.array([1.0 / np.prod(c - np.delete(NODES, i)) for i, c in enumerate(NODES)])
# exact for polynomials of degree 2 s - 2
WEIGHTS = np.linalg.solve(_legendre(NODES[1:], STAGES - 1).T, np.eye(STAGES)[0])

# Times and their pace on the nodes of a piece; the second kind ends where the contact opens, near which θ is a power of the time left. It
# ends just before: where the limit is zero θ jumps to the direction of the motion, which no polynomial follows.
POWER = 3
NEARLY = 0.97
EVEN, CROWDED = 0, 1
TIMES = np.vstack([NODES, 1.0 - (1.0 - NEARLY * NODES) ** POWER])
PACE = np.vstack([np.ones(STAGES + 1), NEARLY * POWER * (1.0 - NEARLY * NODES) ** (POWER - 1)])
