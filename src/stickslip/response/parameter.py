"""Periodic motion over any parameter: solution branches at one frequency, and shared functions of such analyses."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.compiled import Evaluator, check_evaluator
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.parameters import AtFrequency, BalanceAt, law_field, load_level, rebuilt
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.branch import OneLevel, Route, branch_of, following_vibration, steps_through
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.system import System
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import Newton, Solution
from stickslip.solve.status import Status
from stickslip.units import check_quantities, quantity

Build = Callable[[float], tuple[System, HarmonicLoad]]
Parameter = str | Build
LoadName = Literal["excitation", "static_load"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Discretisation:
    """Discretisation and solver of a periodic motion.

    Parameters
    ----------
    order
        Highest harmonic; the static term is always kept.
    samples
        Samples per period of the contact forces.
    evaluator
        Evaluation of piecewise-linear laws; ``events`` has no sampling error, so that amplitudes are smooth in every
        parameter.
    newton
        Corrector options.

    Raises
    ------
    InputError
        If the evaluator is unknown, or there is no harmonic or no sample.
    """

    order: int = quantity("highest harmonic", default=5, least=1)
    samples: int = quantity("samples per period", default=256, least=1)
    evaluator: Evaluator = "events"
    newton: Newton = Newton()  # noqa: RUF009  # frozen

    def __post_init__(self) -> None:
        check_evaluator(self.evaluator)
        check_quantities(self)

    def balance(self, system: System, load: HarmonicLoad, more: IntArray) -> HarmonicBalance:
        """Set up the periodic problem; the dofs `more` are retained in addition to the contact dofs."""
        linear = system.condensed(load, self.order, more)
        return harmonic_balance(linear, system.interface, self.order, self.samples, self.evaluator)


@dataclass(frozen=True, eq=False)
class ParameterPoint:
    """Point of a branch along a parameter.

    Attributes
    ----------
    value
        Value of the parameter.
    omega
        Frequency, rad/s.
    coefficients
        (order+1, n) complex displacement of all dofs of the structure, m.
    status
        How the solver ended; a point that did not converge is no solution.
    iterations
        Newton steps.
    forward
        Whether the parameter grows along the branch here; it changes at a fold.
    """

    value: float
    omega: float
    coefficients: ComplexArray
    status: Status
    iterations: int
    forward: bool

    @property
    def converged(self) -> bool:
        """Whether the point is a solution."""
        return self.status.converged


def parameter_family(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    first: float,
    made: Callable[[System, HarmonicLoad], HarmonicBalance],
) -> BalanceAt:
    """Return the balances of `made` as a function of a parameter; see `branch_in_parameter`."""
    if callable(parameter):
        build = parameter
        return rebuilt(lambda value: made(*build(value)), first)
    balance = made(system, load)
    if parameter in get_args(LoadName):
        return load_level(balance, parameter)  # type: ignore[arg-type]  # one of the two, by the test above
    return law_field(balance, parameter)


@by_one_thread
def branch_in_parameter(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    span: tuple[float, float],
    omega: float,
    points: int = 40,
    discretisation: Discretisation | None = None,
) -> Iterator[ParameterPoint]:
    """Follow the periodic motion at one frequency while a parameter varies, around folds.

    Parameters
    ----------
    system
        Structure, contacts and outputs.
    load
        Static and harmonic forces on all dofs, N.
    parameter
        ``excitation`` or ``static_load``: a factor on the harmonic or static forces. A field of the contact laws
        (``mu``, ``preload``, ``limit``, ``k_t``, ``k_n``, ``initial_gap`` and so on): its value for all contacts that
        have it. A function ``value -> (system, load)`` varies anything else. For the frequency itself see
        `forced_response`.
    span
        First and last value of the parameter; the last may be the smaller one.
    omega
        Frequency, rad/s.
    points
        Smallest number of points; more are added where the motion changes fast.
    discretisation
        Harmonics, samples, solver.

    Yields
    ------
    ParameterPoint
        Points in the order of the branch, the last one at the end of the span. Where the branch is lost, a point
        without convergence follows, and a restart a little further on.

    Raises
    ------
    InputError
        If the parameter is unknown, the span is empty, or the frequency or the number of points is not positive.
    """
    first, last = span
    if not (np.isfinite(first) and np.isfinite(last) and first != last):
        raise input_error("span", f"goes from {first} to {last}", "Give two different values.")
    if not (0.0 < omega < np.inf and points >= 1):
        raise input_error(
            "omega, points",
            f"must be positive, got {omega} rad/s and {points} points",
            "For the static problem see `preload`.",
        )
    how = discretisation or Discretisation()
    family = parameter_family(
        system, load, parameter, first, lambda s, f: how.balance(s, f, np.zeros(0, dtype=np.int64))
    )
    way = following_vibration(family(first), steps_through(abs(last - first), points), how.newton)

    def begin(value: float, near: Sequence[FloatArray], effort: float) -> Solution:
        changed = system_at(system, parameter, value, family(value))
        return without_branch(changed, family(value), how.newton, omega, near, effort)

    curve = OneLevel(AtFrequency(family, omega), way, begin)
    route = Route(first=first, last=last, points=points, leaves=False)
    for found in branch_of(follow(curve, route)):
        yield _parameter_point(family, omega, found.point)


def system_at(system: System, parameter: Parameter, value: float, balance: HarmonicBalance) -> System:
    """Return the system behind the `balance` of a value of the parameter."""
    changed = parameter(value)[0] if callable(parameter) else system
    return replace(changed, interface=replace(changed.interface, laws=balance.interface.laws))


def _parameter_point(family: BalanceAt, omega: float, point: Point) -> ParameterPoint:
    balance = family(point.p)
    motion = balance.linear.recover(omega, balance.coefficients(point.x))
    growing = bool(point.tangent[-1] > 0.0)
    return ParameterPoint(point.p, omega, motion, point.solution.status, point.solution.iterations, growing)
