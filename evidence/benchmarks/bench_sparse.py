"""The optional factorisation against SciPy's, on the stiffness of a sector: CPU time of factors and of solutions.

Both run in one process, one thread each. `docs/theory/sparse.md` has the comparison of more packages at more sizes.
"""

from importlib.util import find_spec
from time import process_time
from typing import Any

import numpy as np
import scipy.sparse

from evidence.benchmarks.bench_scale import sector
from stickslip.model.fe.factorisation import factorise

FINENESS = 0.4  # of the element sizes: 16 k nodes
RIGHT = 50  # right-hand sides


def timed(matrix: scipy.sparse.csr_array, right: np.ndarray, backend: str) -> tuple[float, float]:
    """Return CPU seconds of the factorisation and of the solutions, and check these."""
    start = process_time()
    factors = factorise(matrix, backend=backend)
    middle = process_time()
    answer = factors(right)
    end = process_time()
    rest = np.linalg.norm(matrix @ answer - right) / np.linalg.norm(right)
    if not rest < 1e-8:
        raise ArithmeticError(f"{backend}: residual {rest:.1e}")
    return middle - start, end - middle


def run() -> list[dict[str, Any]]:
    """Compare the two; without the package only SuperLU is timed."""
    stiffness = sector(FINENESS).stiffness
    right = np.random.default_rng(0).standard_normal((stiffness.shape[0], RIGHT))
    note = f"{stiffness.shape[0]} dofs, {RIGHT} right-hand sides, one thread"
    factor, solve = timed(stiffness, right, "superlu")
    seconds = {
        "name": "sparse/superlu_seconds",
        "value": factor + solve,
        "goal": "<= 60 s",
        "holds": factor + solve <= 60,
        "note": f"{note}; factors {factor:.1f} s",
    }
    if find_spec("feral") is None:
        seconds["note"] += "; the extra `sparse` is not installed, nothing to compare with"
        return [seconds]
    quick = timed(stiffness, right, "feral")
    ratio = sum(quick) / (factor + solve)
    return [
        seconds,
        {
            "name": "sparse/feral_over_superlu",
            "value": ratio,
            "goal": "<= 0.8",
            "holds": ratio <= 0.8,
            "note": f"{note}; factors {quick[0]:.1f} s",
        },
    ]
