"""How far apart two ends of Newton's method may lie: bounds for tests, computed beside the assertion.

Newton's method ends at a residual r below its tolerance, and there it is off by about J⁻¹ r. How much that is depends on the last digits that
LAPACK's kernels make, and these on the processor: a typed tolerance that holds on one processor fails on another. The bound is
``10 |r| |J⁻¹|``, with the largest entry of r and the largest sum of the absolute entries in a row of the inverse. For an answer
that is read from the unknowns, the rows are those of the inverse as that answer sees it.
"""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.law import PAIRS
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness
from stickslip.response.recovery import Fields, fields
from stickslip.solve.iterate import EPS, Evaluation
from stickslip.solve.newton_method import Newton

SAFETY = 10.0  # times the linear error
FINE = Newton(tolerance=1e-13)  # where the default leaves a bound that says nothing
WORTH = 1e-5  # of what is compared: a wider bound would let errors pass


def unknowns_bound(x: FloatArray, *ends: Evaluation) -> float:
    """Return how far apart the ends of Newton's method, of which `x` is one, may lie in any unknown: the sum of the bounds of all."""
    bound = sum(_reached(end) * _norm(_inverse(end)) for end in ends)
    return _worth("unknowns", bound, float(np.abs(x).max()))


def _worth(name: str, bound: float, size: float) -> float:
    assert bound < WORTH * size, f"{name}: a bound of {bound / size:.2g} of the largest says nothing"
    return bound


def _reached(end: Evaluation) -> float:
    """Return ten times the residual; what is below rounding counts as rounding."""
    return SAFETY * max(float(np.abs(end.residual).max()), EPS)


def _inverse(end: Evaluation) -> FloatArray:
    jac = end.jac if isinstance(end.jac, np.ndarray) else end.jac.dense()
    return np.asarray(np.linalg.inv(jac))


def _norm(rows: FloatArray | ComplexArray) -> float:
    return float(np.abs(rows).sum(axis=-1).max())


@dataclass(frozen=True, eq=False)
class Answer(Fields):
    """What a solved point of a response gives; `off` bounds what Newton's method left of `outputs`, `gaps` (m) and `forces` (N)."""

    off: dict[str, float]


def answer_at(problem: ForcedProblem, point: ForcedPoint) -> Answer:
    """Return the fields at a solved point, one Newton step with all digits further on, with their bounds."""
    balance = with_stiffness(problem.balance(point.support))
    x = balance.unknowns(point.coefficients)
    end = balance.linearise(x, point.omega)
    whole = _inverse(end)
    x = x - whole @ end.residual
    end = balance.linearise(x, point.omega)
    point = replace(point, coefficients=balance.coefficients(x))
    inverse = whole.reshape(balance.n_rows, balance.linear.n, -1)
    inverse *= balance.displacement_scale * _reached(end)
    gaps = np.array([balance.interface.gap_operator @ row for row in inverse])
    gaps = gaps.reshape(balance.n_rows, -1, 3, balance.size)
    forces, blocks = np.zeros_like(gaps), balance.forces(x, point.omega).blocks
    for pair, (force, gap) in enumerate(PAIRS[: blocks.shape[1]]):
        forces[:, :, force] += np.einsum("cij,jck->ick", blocks[:, pair], gaps[:, :, gap])
    outputs = np.asarray(problem.system.outputs)
    seen = [
        balance.linear.output_rows(point.omega, h, outputs) @ row
        for h, row in zip(balance.harmonics, _complex(inverse), strict=True)
    ]
    moved = {"outputs": np.array(seen), "gaps": _complex(gaps), "forces": _complex(forces)}
    off = {name: _norm(rows) for name, rows in moved.items()}
    return Answer(**vars(fields(problem, point)), off=off)


def _complex(rows: FloatArray) -> ComplexArray:
    """Return the amplitudes ``C - i S`` of real rows: that of harmonic 0, and two of each other one."""
    return np.concatenate([rows[:1], rows[1::2] - 1j * rows[2::2]])


def allowed(name: str, *answers: Answer) -> float:
    """Return how far apart the `outputs`, `gaps` or `forces` of answers to one question may lie."""
    bound = sum(answer.off[name] for answer in answers)
    size = max(float(np.abs(getattr(answer, name)).max()) for answer in answers)
    assert bound < WORTH * size, f"{name}: a bound of {bound / size:.2g} of the largest says nothing"
    return bound
