"""Reasons why a solver stopped, with advice, and the method that found a solution."""

from enum import IntEnum


class Status(IntEnum):
    """Reason why a solver stopped; result files hold these numbers."""

    CONVERGED = 0
    TOO_MANY_ITERATIONS = 1
    STALLED = 2
    SINGULAR = 3
    NOT_FINITE = 4
    STEP_TOO_SMALL = 5
    LOCAL_MINIMUM = 6
    NOT_PERIODIC = 7

    @property
    def converged(self) -> bool:
        """Whether the point is a solution."""
        return self is Status.CONVERGED

    @property
    def advice(self) -> str:
        """Meaning of the status, and advice."""
        return _ADVICE[self]


_ADVICE = {
    Status.CONVERGED: "converged",
    Status.TOO_MANY_ITERATIONS: "Newton used all its iterations; a smaller frequency step usually helps",
    Status.STALLED: "no step reduced the residual; contact states switch here, use more samples or a smaller step",
    Status.SINGULAR: "the Jacobian is singular. If no contact holds a rigid body, give it a retention stiffness. With very many contacts the Krylov method found no step; take more products or a shorter continuation step",
    Status.NOT_FINITE: "the iteration left the finite numbers; check loads and stiffnesses",
    Status.STEP_TOO_SMALL: "the continuation step shrank below its smallest value",
    Status.LOCAL_MINIMUM: "the residual has a minimum that is not zero; start nearer to the solution",
    Status.NOT_PERIODIC: "integrated in time from rest the motion does not repeat itself in the period of the load, nor does it with half the step: no balance stands for it",
}


class Rung(IntEnum):
    """Method that found a solution, in the order in which methods are tried; result files may hold these numbers."""

    FULL_STEPS = 0
    DAMPED_STEP = 1
    SHORTER_STEP = 2
    OTHER_GLOBALISATION = 3
    HOMOTOPY = 4
    IN_TIME = 5
