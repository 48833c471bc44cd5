"""What a strategy is judged by: the solution with twice the harmonics of the reference, near the low-order one.

Near needs a definition, because friction with lift-off may have several periodic motions at a frequency: folds, and contacts that stick,
whose mean traction is not unique. (The tractions are no choice here: each support solves the same equations with the same laws.) From the
low-order solution q, Newton's method is begun with 2ñH harmonics at the solution with ñH begun at q, and at q itself; where neither
converges, at the solution with ñH begun at ``q + Δq``; where that does not, either, the branches with 2ñH through the truths of the neighbouring frequencies are followed to this one. What
converges are candidates. The *truth* is the candidate with the smallest error measure from q: no alarm is missed where a solution within
the threshold exists, and an alarm is false there. Where candidates lie on both sides of the threshold the point is marked: what is said of
it depends on the sheet. Where there is no candidate the point is marked as without truth, and counted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from evidence.strategies.cases import SelectionCase
from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.forced.response import forced_response
from stickslip.solve.newton_method import Newton, newton

NEWTON = Newton(max_iterations=25)
CLEAR = 5e-3  # error below which no other candidate is looked for: a nearer one would change no verdict


@dataclass(frozen=True, eq=False)
class Truth:
    """A low-order solution and what it should have been.

    Attributes
    ----------
    low
        Point of the first passage, converged.
    reference
        The truth, with 2ñH harmonics; None where none was found.
    error
        Error of `low` (eq. 29) against it, a fraction; NaN where there is none.
    high_error
        Error of `low` against the solution with ñH harmonics that led to the truth; NaN where none did.
    errors
        Of all candidates, growing.
    """

    low: ForcedPoint
    reference: ForcedPoint | None
    error: float
    high_error: float
    errors: tuple[float, ...]

    def divided(self, threshold: float) -> bool:
        """Whether candidates lie on both sides of a threshold."""
        return bool(self.errors) and self.errors[0] <= threshold < self.errors[-1]


def judging_problem(case: SelectionCase) -> ForcedProblem:
    """Return the forced response of a case with the judge's support as its reference."""
    return forced_problem(case.system, case.load, case.sweep(high=2 * case.high, selection="always_low"))


def low_order_points(case: SelectionCase) -> list[ForcedPoint]:
    """Return the first passage of a case, found and not found."""
    sweep = case.sweep(selection="always_low")
    return accepted_points(list(forced_response(case.system, case.load, sweep)))


def truths(case: SelectionCase, points: Sequence[ForcedPoint]) -> list[Truth]:
    """Return the truth of each converged low-order point, in their order."""
    problem = judging_problem(case)
    middle = problem.balance(tuple(range(case.high + 1)))
    found = [_direct(problem, middle, p) for p in points if p.converged]
    known = {i: t.reference for i, t in enumerate(found) if t.reference is not None}
    for order in (range(len(found)), reversed(range(len(found)))):
        for i in order:
            if found[i].reference is None:
                found[i] = _led(problem, found[i].low, i, known)
                reference = found[i].reference
                if reference is not None:
                    known[i] = reference
    return found


def reference_points(case: SelectionCase) -> list[ForcedPoint]:
    """Return the response with twice the harmonics of the reference on the frequencies of a case, followed as a branch; converged or marked."""
    sweep = case.sweep(low=2 * case.high, high=2 * case.high, selection="always_low")
    return accepted_points(list(forced_response(case.system, case.load, sweep)))


def _solved(balance: HarmonicBalance, omega: float, start: FloatArray) -> FloatArray | None:
    solution = newton(lambda v: balance.linearise(v, omega), start, NEWTON)
    return solution.x if solution.status.converged else None


def _direct(problem: ForcedProblem, middle: HarmonicBalance, point: ForcedPoint) -> Truth:
    """Return the nearest of the solutions that Newton's method finds."""
    omega, few, many = point.omega, problem.low, problem.high
    x = few.unknowns(point.coefficients)
    candidates: list[tuple[float, float, ForcedPoint]] = []
    for start in ("through", "at once", "predicted"):
        high_error = np.nan
        if start == "at once":
            begin: FloatArray | None = many.unknowns(point.coefficients)
        else:
            first = middle.unknowns(point.coefficients)
            if start == "predicted":
                first = jacobian_alert(few, middle, x, omega, problem.measure, problem.alert_solve).start
            begin = _solved(middle, omega, first)
            if begin is not None:
                high_error = _error(problem, point, middle, begin)
                begin = many.unknowns(middle.coefficients(begin))
        solved = None if begin is None else _solved(many, omega, begin)
        if solved is not None:
            candidates.append((_error(problem, point, many, solved), high_error, _reference(many, point, solved)))
        if candidates and (candidates[-1][0] < CLEAR or start == "at once"):
            break
    return _nearest(point, candidates)


def _led(problem: ForcedProblem, point: ForcedPoint, index: int, known: Mapping[int, ForcedPoint]) -> Truth:
    """Return the nearest of the solutions to which the branches of the neighbours lead."""
    candidates = []
    for neighbour in (index - 1, index + 1):
        if neighbour in known:
            end = problem.along_branch(known[neighbour], point.omega, problem.high)
            if end.solution.status.converged and end.p == point.omega:
                error = _error(problem, point, problem.high, end.x)
                candidates.append((error, np.nan, _reference(problem.high, point, end.x)))
    return _nearest(point, candidates)


def _nearest(point: ForcedPoint, candidates: list[tuple[float, float, ForcedPoint]]) -> Truth:
    if not candidates:
        return Truth(point, None, np.nan, np.nan, ())
    error, _, reference = min(candidates, key=lambda c: c[0])
    # one with NaN tells nothing of ñH: another way to the same truth may
    ways = [c for c in candidates if c[0] <= error * (1 + 1e-6) and np.isfinite(c[1])]
    high_error = ways[0][1] if ways else np.nan
    return Truth(point, reference, error, high_error, tuple(sorted(c[0] for c in candidates)))


def _error(problem: ForcedProblem, point: ForcedPoint, balance: HarmonicBalance, x: FloatArray) -> float:
    return problem.real_error(point, _reference(balance, point, x))


def _reference(balance: HarmonicBalance, point: ForcedPoint, x: FloatArray) -> ForcedPoint:
    return replace(point, coefficients=balance.coefficients(x), harmonics=np.array(balance.harmonics), stage="high")
