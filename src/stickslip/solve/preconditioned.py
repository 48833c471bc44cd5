"""Jacobians known by their products that can make a preconditioner, as Krylov methods see them."""

from collections.abc import Callable
from typing import Protocol, TypeGuard

from stickslip.arrays import FloatArray
from stickslip.operators import Jacobian, JacobianOperator
from stickslip.solve.linear import Assembling, is_assembling

Solve = Callable[[FloatArray], FloatArray]
Product = Callable[[FloatArray, FloatArray], FloatArray]


class Preconditioned(JacobianOperator, Protocol):
    """A Jacobian known by its products that can make a preconditioner."""

    @property
    def problem(self) -> object:
        """What it is the Jacobian of; what is kept from one of its Jacobians serves the others."""
        ...

    def preconditioner(self) -> object | None:
        """Return what of a new preconditioner is costly, such as factors; None if there is none."""
        ...

    def preconditioned_by(self, kept: object) -> tuple[Solve, Product]:
        """Return how to solve ``P x = y``, with P from what was kept and from this Jacobian, and ``J v`` as a function of v and ``P v``."""
        ...


class Graded(Preconditioned, Protocol):
    """One that has a better preconditioner where its own does not do."""

    def better_preconditioner(self, kept: object) -> object | None:
        """Return what of a better preconditioner than `kept` is costly; None if there is none."""
        ...


class Either(Preconditioned, Assembling, Protocol):
    """A Jacobian for which there is a choice."""


def is_preconditioned(jac: Jacobian) -> TypeGuard[Preconditioned]:
    """Whether a Jacobian makes a preconditioner."""
    return hasattr(type(jac), "preconditioned_by")


def is_either(jac: Jacobian) -> TypeGuard[Either]:
    """Whether there is a choice."""
    return is_preconditioned(jac) and is_assembling(jac)


def is_graded(jac: Preconditioned) -> TypeGuard[Graded]:
    """Whether a Jacobian has a better preconditioner, too."""
    return hasattr(type(jac), "better_preconditioner")
