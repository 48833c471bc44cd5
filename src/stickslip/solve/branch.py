"""Branches of ``F(x, p) = 0``: the equation, points, lengths, and options."""

import math
from dataclasses import dataclass, replace
from typing import Literal, Protocol, get_args

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import check_choice
from stickslip.operators import Jacobian
from stickslip.solve.newton_method import Newton, Solution

Parametrisation = Literal["arc_length", "natural", "local"]
Predictor = Literal["tangent", "secant", "parabola"]
Corrector = Literal["newton", "kept_factors"]


class ParameterEvaluation(Protocol):
    """Residual, Jacobian and parameter derivative at one state."""

    @property
    def residual(self) -> FloatArray:
        """(n,) residual."""
        ...

    @property
    def jac(self) -> Jacobian:
        """(n, n) derivative by x."""
        ...

    @property
    def jac_p(self) -> FloatArray:
        """(n,) derivative by p."""
        ...

    @property
    def seconds_contact(self) -> float:
        """Time spent in contact forces."""
        ...


class Problem(Protocol):
    """An equation with one parameter."""

    def linearise(self, x: FloatArray, p: float) -> ParameterEvaluation:
        """Evaluate residual and derivatives at (x, p)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class StepControl:
    """Step control of a continuation.

    Lengths are changes of x relative to its size, and changes of p relative to `scale`.

    Parameters
    ----------
    scale
        Change of the parameter that counts as length one.
    first, smallest, largest
        Step lengths.
    max_points
        Number of points after which a branch ends, even if it has not reached its end.
    growth
        Factor on the step length after a correction with a single Newton step on a nearly straight piece of the branch.
    """

    scale: float
    first: float = 0.1
    smallest: float = 1e-3
    largest: float = 0.25
    max_points: int = 500
    growth: float = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Following:
    """Options of a continuation: corrector, step control, measure of length.

    Parameters
    ----------
    newton
        Corrector.
    control
        Step control.
    weights
        (n,) share of each unknown in the length of a step.
    parametrisation
        Quantity that a step prescribes. ``arc_length``: the distance along the direction of travel (Keller 1977).
        ``local``: the unknown, or p, that changes most (Rheinboldt & Burkardt 1983). ``natural``: p; the branch ends at
        a fold with `Status.STEP_TOO_SMALL`.
    predictor
        Direction of travel. ``tangent`` costs at most one linear system per point and detects corners and folds at
        once. ``secant`` through the last two points costs nothing. ``parabola`` adds the curvature between the last two
        points to the tangent.
    corrector
        ``newton``, or ``kept_factors``: Newton steps that reuse factors while they converge; the tangent reuses them if
        the branch hardly turned. This corrector gives up early, and a shorter step follows; the shortest steps use
        ``newton``.
    """

    newton: Newton
    control: StepControl
    weights: FloatArray
    parametrisation: Parametrisation = "arc_length"
    predictor: Predictor = "tangent"
    corrector: Corrector = "newton"

    def __post_init__(self) -> None:
        for name, choices in (("parametrisation", Parametrisation), ("predictor", Predictor), ("corrector", Corrector)):
            check_choice(f"Following.{name}", getattr(self, name), get_args(choices))


@dataclass(frozen=True, eq=False)
class Point:
    """A point of a branch, with all data to continue from it.

    Attributes
    ----------
    x, p
        The solution and its parameter.
    tangent
        (n + 1,) direction of travel, with unit length in the measure of the step control; the last entry is for p. With
        the predictor ``secant`` it is the direction from the previous point.
    step
        Length of the next step.
    solution
        Result of the corrector; x is a solution only if its status says so.
    orientation
        Sign of the determinant of the Jacobian bordered by the tangent; it is constant along a path. 0 if it was not
        computed (secants), NaN if the linear solver gives no determinant.
    mark
        Name of the event located here; empty for points of regular steps.
    bend
        (n + 1,) half the change of direction divided by the length of the last step, for the predictor ``parabola``;
        None if unknown.
    """

    x: FloatArray
    p: float
    tangent: FloatArray
    step: float
    solution: Solution
    orientation: float
    mark: str = ""
    bend: FloatArray | None = None

    @property
    def y(self) -> FloatArray:
        """(n + 1,) unknowns and parameter."""
        return np.append(self.x, self.p)


@dataclass(frozen=True, eq=False)
class Measure:
    """Norm of steps, by weights (n + 1,) of x and p."""

    weights: FloatArray

    @property
    def p(self) -> float:
        """Weight of p."""
        return float(self.weights[-1])

    def of(self, vector: FloatArray) -> float:
        """Return the length of a vector (n + 1,)."""
        return math.sqrt(self.row(vector) @ vector)

    def row(self, vector: FloatArray) -> FloatArray:
        """Return the row (n + 1,) whose product with a second vector is their inner product."""
        return self.weights**2 * vector

    def cosine(self, a: FloatArray, b: FloatArray) -> float:
        """Return the cosine of the angle between two vectors (n + 1,)."""
        return float(self.row(a) @ b) / (self.of(a) * self.of(b))


def measure_at(x: FloatArray, following: Following) -> Measure:
    """Return the measure of length near `x`.

    Changes of x are relative to its size, changes of p relative to the scale of the step control.
    """
    own = following.weights
    weights = np.empty(own.size + 1)
    weights[-1] = 1.0 / following.control.scale
    sized = own * x
    size = math.sqrt(sized.dot(sized))
    np.divide(own, size if size > 0.0 else 1.0, out=weights[:-1])
    return Measure(weights)


def upward(size: int) -> FloatArray:
    """Return the direction (size,) of growing p at constant x."""
    direction = np.zeros(size)
    direction[-1] = 1.0
    return direction


def tangent_at(
    problem: Problem, y: FloatArray, previous: FloatArray, following: Following, at: ParameterEvaluation | None = None
) -> tuple[FloatArray, float]:
    """Return the unit tangent on the side of `previous` and its orientation; `previous` itself if it is undetermined.

    Parameters
    ----------
    problem
        The equation.
    y
        (n + 1,) unknowns and parameter of a point of the branch.
    previous
        (n + 1,) direction of travel so far.
    following
        Measure of length, and linear solver.
    at
        The evaluation at `y` if it is known; None: the equation is evaluated.
    """
    measure = measure_at(y[:-1], following)
    if at is None:
        at = problem.linearise(y[:-1], float(y[-1]))
    row = measure.row(previous)
    linear = following.newton.linear
    tangent, sign = linear.solve_bordered(at.jac, at.jac_p, row[:-1], float(row[-1]), upward(y.size))
    if tangent is None:
        return previous, 0.0
    return tangent / measure.of(tangent), sign


@dataclass(eq=False)
class Latest:
    """A problem that remembers its latest evaluation, because the tangent needs the Jacobian of the last iterate.

    A corrector does not overwrite the Jacobian of its converged iterate.
    """

    problem: Problem
    x: FloatArray | None = None
    p: float = np.nan
    at: ParameterEvaluation | None = None

    def linearise(self, x: FloatArray, p: float) -> ParameterEvaluation:
        """Evaluate residual and derivatives at (x, p)."""
        self.x, self.p, self.at = x, p, self.problem.linearise(x, p)
        return self.at

    def known(self, x: FloatArray, p: float) -> ParameterEvaluation | None:
        """Return the latest evaluation if it was made at (x, p)."""
        if self.x is None or self.p != p:
            return None
        return self.at if self.x is x or np.array_equal(self.x, x) else None


def reversed_point(point: Point) -> Point:
    """Return the point with the opposite direction of travel; the curvature is unchanged."""
    return replace(point, tangent=-point.tangent, orientation=-point.orientation)
