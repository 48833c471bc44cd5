"""The periodic problem with extra unknowns and as many conditions.

Together they are one equation ``F(y, p) = 0`` for the solvers of `stickslip.solve`. A resonance peak is a periodic
motion with unknown frequency whose amplitude has a horizontal tangent; for a motion of given amplitude, the level of
the excitation is unknown, too. The Jacobian of the harmonic balance gets a border: a column for each extra unknown and
a row for each condition. Inside the border it stays an array or products, as before.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.parameters import BalanceAt, ParameterLinearisation, difference
from stickslip.operators import Bordered, Inverse, Jacobian

WANDERED = 3.0  # |ln(ω / scale)| at which a corrector has left the solution it looks for


@dataclass(frozen=True, eq=False)
class Setting:
    """The periodic problem and its frequency, as functions of extra unknowns and the parameter.

    Attributes
    ----------
    balance
        The periodic problem.
    omega
        Frequency, rad/s; NaN if the extra unknowns are out of bounds.
    slopes
        (m,) derivative of `omega` by the extra unknowns; zero for unknowns that change the balance.
    linear_alone
        Whether extra unknowns change only the linear forces of the balance.
    by_level
        Function from a state to the (size,) derivative of the balance by the extra unknown other than the frequency;
        None if unknown.
    """

    balance: HarmonicBalance
    omega: float
    slopes: FloatArray
    linear_alone: bool = False
    by_level: "Callable[[State], FloatArray] | None" = None


Invert = Callable[[Jacobian], Inverse | None]
Settings = Callable[[FloatArray, float], Setting]  # of the extra unknowns (m,) and the parameter


def unknown_frequency(family: BalanceAt, scale: float) -> Settings:
    """Return the settings of a problem whose only extra unknown is ``ln(ω / scale)``, `scale` in rad/s.

    Its parameter is the parameter of `family`.
    """

    def setting(extra: FloatArray, p: float) -> Setting:
        near = abs(extra[0]) < WANDERED
        omega = scale * float(np.exp(extra[0])) if near else np.nan
        return Setting(family(p), omega, np.array([omega]))

    return setting


class Condition(Protocol):
    """An additional equation for the motion and the extra unknowns."""

    def value(self, state: "State") -> float:
        """Return the residual of the condition; infinite if it is undefined."""
        ...

    def gradient(self, state: "State") -> FloatArray:
        """Return the (size + m,) derivative of the value by the unknowns of the balance and the extra unknowns."""
        ...


@dataclass(frozen=True, eq=False)
class State:
    """A bordered problem at one state, as the argument of its conditions.

    Attributes
    ----------
    problem
        The bordered problem.
    y
        (size + m,) unknowns of the balance and extra unknowns.
    p
        Parameter.
    setting
        The balance and its frequency at this state.
    """

    problem: "PeriodicProblem"
    y: FloatArray
    p: float
    setting: Setting

    @property
    def x(self) -> FloatArray:
        """(size,) unknowns of the balance."""
        return self.y[: self.setting.balance.size]

    @property
    def extra(self) -> FloatArray:
        """(m,) extra unknowns."""
        return self.y[self.setting.balance.size :]

    @cached_property
    def at(self) -> Linearisation:
        """Residual and derivatives of the balance."""
        return self.setting.balance.linearise(self.x, self.setting.omega, self._contacts[0])

    @cached_property
    def residual(self) -> FloatArray:
        """(size,) residual of the balance; derivatives are computed at first use."""
        return self.setting.balance.residual(self.x, self.setting.omega, self._contacts[0])

    @property
    def seconds_contact(self) -> float:
        """Time of the contact evaluation."""
        return self._contacts[1]

    @cached_property
    def _contacts(self) -> tuple[ContactPeriod, float]:
        """Contacts over one period, and the time of their evaluation."""
        start = perf_counter()
        period = self.setting.balance.forces(self.x, self.setting.omega)
        return period, perf_counter() - start

    @cached_property
    def columns(self) -> FloatArray:
        """(size, m) derivatives of the balance by the extra unknowns.

        They are exact for the frequency, and central differences for the others.
        """
        own = [
            slope * self.at.jac_p if slope != 0.0 else self._by_level(place)
            for place, slope in enumerate(self.setting.slopes)
        ]
        return np.stack(own, axis=1)

    def _by_level(self, place: int) -> FloatArray:
        """Return the derivative of the balance by an extra unknown other than the frequency."""
        known = self.setting.by_level
        return self.by_extra(place, State.changed_residual) if known is None else known(self)

    def changed_residual(self) -> FloatArray:
        """Return the part of the balance's residual that extra unknowns change."""
        balance, omega = self.setting.balance, self.setting.omega
        if self.setting.linear_alone:
            return balance.linear_residual(self.x, omega)
        return self.residual

    @cached_property
    def inverse(self) -> Inverse | None:
        """Solver of systems with ``[J, ∂r/∂z; row]``; None if singular.

        z is the first extra unknown, and `row` the row of the problem.
        """
        n = self.x.size
        row = np.eye(1, n + 1, n)[0] if self.problem.row is None else self.problem.row
        return self.problem.invert(Bordered(self.at.jac, self.columns[:, 0], row[:n], float(row[n])))

    @cached_property
    def along(self) -> FloatArray | None:
        """(size + 1,) tangent of the motion and the first extra unknown; None if undetermined.

        Its product with the row is 1.
        """
        n = self.x.size
        return None if self.inverse is None else self.inverse(np.eye(1, n + 1, n)[0])

    def moved(self, step: FloatArray) -> "State":
        """Return the state after a `step` (size + m,), for the same parameter."""
        return self.problem.state(self.y + step, self.p)

    def by_extra(self, place: int, function: Callable[["State"], FloatArray]) -> FloatArray:
        """Return the derivative of a function of states by an extra unknown, a central difference."""
        here = np.zeros(self.y.size)
        place += self.setting.balance.size
        here[place] = 1.0
        value = float(self.y[place])
        return difference(lambda v: function(self.moved((v - value) * here)), value)


@dataclass(frozen=True, eq=False)
class PeriodicProblem:
    """A periodic problem with extra unknowns and as many conditions; an equation in a parameter.

    The unknowns y are the unknowns of the balance, followed by the extra ones; the residual is the residual of the
    balance, followed by the values of the conditions.

    Parameters
    ----------
    settings
        Function from the extra unknowns and the parameter to balance and frequency.
    conditions
        One for each extra unknown.
    invert
        Function from a Jacobian to a solver for the systems of the conditions, None if singular; it limits the accuracy
        of the conditions.
    row
        (size + 1,) last row of the equations for the tangent of the motion and the first extra unknown. None: this
        unknown grows by one, which is impossible at a fold.
    by_parameter
        Function from a state to the derivative of all equations by the parameter; None: a central difference.
    """

    settings: Settings
    conditions: tuple[Condition, ...]
    invert: Invert
    row: FloatArray | None = None
    by_parameter: Callable[[State], FloatArray] | None = None

    def state(self, y: FloatArray, p: float) -> State:
        """Return the problem at the unknowns `y` and the parameter `p`; nothing is evaluated yet."""
        return State(self, y, p, self.settings(y[y.size - len(self.conditions) :], p))

    def residual(self, y: FloatArray, p: float) -> FloatArray:
        """Return the (size + m,) residual."""
        state = self.state(y, p)
        return np.append(state.residual, [c.value(state) for c in self.conditions])

    def linearise(self, y: FloatArray, p: float) -> "ParameterLinearisation | Evaluated":
        """Evaluate the equations at the unknowns `y` (size + m,) and the parameter `p`; infinite out of bounds."""
        state, n = self.state(y, p), y.size
        if not 0.0 <= state.setting.omega < np.inf:
            return ParameterLinearisation(np.full(n, np.inf), np.eye(n), 0.0, lambda: np.zeros(n))
        values = np.array([c.value(state) for c in self.conditions])
        return Evaluated(state, values)


@dataclass(frozen=True, eq=False)
class Evaluated:
    """The equations at one state; derivatives are computed at first use, and thus never for rejected trials.

    Parameters
    ----------
    state
        The state.
    values
        (m,) values of the conditions.
    """

    state: State
    values: FloatArray

    @cached_property
    def residual(self) -> FloatArray:
        """(size + m,) residual."""
        return np.append(self.state.residual, self.values)

    @property
    def seconds_contact(self) -> float:
        """Time spent in contact forces."""
        return self.state.seconds_contact

    @cached_property
    def jac(self) -> Bordered:
        """Derivative by all unknowns."""
        state, values = self.state, self.values
        n = state.y.size
        rows = np.zeros((values.size, n))
        for row, condition, value in zip(rows, state.problem.conditions, values, strict=True):
            if np.isfinite(value):
                row[:] = condition.gradient(state)
        size = n - values.size
        return Bordered(state.at.jac, state.columns, rows[:, :size], rows[:, size:])

    @cached_property
    def jac_p(self) -> FloatArray:
        """(size + m,) derivative by the parameter."""
        state, known = self.state, self.state.problem.by_parameter
        if known is not None:
            return known(state)
        return difference(lambda v: state.problem.residual(state.y, v), state.p)
