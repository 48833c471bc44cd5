"""Periodic solutions without a nearby one: methods with limited Newton steps, and homotopies as the last.

In a homotopy the excitation grows first, then the higher harmonics join.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.branch import (
    Followed,
    OneLevel,
    Route,
    branch_of,
    following_vibration,
    steps_through,
    vibration_weights,
)
from stickslip.response.equilibrium import bonded_start, preload
from stickslip.response.system import System
from stickslip.solve.fallbacks import Homotopy, solve_robustly, steps_at_most
from stickslip.solve.newton_method import Newton, Solution, first_converged, newton

# shares of the excitation at which contacts do not change their states: the problem is linear there
FAINT = (1e-2, 1e-3, 1e-5)
BACK = 1e-3  # share of the smallest excitation at which a path has returned to rest


def without_branch(
    system: System,
    balance: AnyBalance,
    options: Newton,
    omega: float,
    near: Sequence[FloatArray] = (),
    effort: float = 1.0,
) -> Solution:
    """Solve at one frequency from several starts.

    They are nearby motions, the static equilibrium with bonded vibration, few harmonics, and `solve_robustly`.

    Parameters
    ----------
    system
        System of `balance`.
    balance
        The periodic problem.
    options
        Corrector options.
    omega
        Frequency, rad/s.
    near
        (size,) unknowns of nearby motions.
    effort
        Share of the Newton steps of `steps_at_most` for all attempts, including homotopies and other globalisations; 0:
        Newton's method only.
    """
    starts = _starts(system, balance, options, omega, near)
    if effort:
        return solve_robustly(
            lambda x: balance.linearise(x, omega),
            starts,
            options,
            _ways(system, balance, omega),
            vibration_weights(balance),
            steps=steps_at_most(balance.size, effort),
        )
    return first_converged(newton(lambda x: balance.linearise(x, omega), start, options) for start in starts)


def plain_sweep(
    system: System,
    balance: AnyBalance,
    omega_range: tuple[float, float],
    points: int,
    options: Newton,
    over: Callable[[], bool] = bool,
) -> list[Followed]:
    """Return the response of `balance` between two frequencies in the order of the branch, including failed points.

    `over` is called after each solution; True ends the sweep.
    """
    first, last = omega_range
    way = following_vibration(balance, steps_through(last - first, points), options)
    curve = OneLevel(balance, way, partial(without_branch, system, balance, options))
    return branch_of(_until(over, follow(curve, Route(first=first, last=last, points=points))))


def _until(over: Callable[[], bool], every: Iterable[Followed]) -> Iterator[Followed]:
    for one in every:
        yield one
        if over():
            return


def _ways(system: System, balance: AnyBalance, omega: float) -> Iterator[Homotopy]:
    yield from homotopies(balance, omega, at_rest(system, balance, omega)[0].real)


def at_rest(system: System, balance: AnyBalance, omega: float) -> ComplexArray:
    """Return the (1, n_retained) static equilibrium, m; zero at coordinates that only the balance retains."""
    rest = np.zeros((1, balance.linear.n), dtype=complex)
    own = np.searchsorted(balance.linear.retained, system.retained)
    rest[0, own] = preload(system.at(omega), balance.linear.load_at(omega).static)
    return rest


def _starts(
    system: System, balance: AnyBalance, options: Newton, omega: float, near: Sequence[FloatArray]
) -> Iterator[FloatArray]:
    """Yield scaled unknowns as starts of Newton's method."""
    yield from near
    guess = balance.coefficients(bonded_start(balance, omega, system))
    guess[:1] = at_rest(system, balance, omega)
    yield balance.unknowns(guess)
    few = balance.with_harmonics(lowest_harmonics(balance))
    if few.order < balance.order:
        solution = newton(lambda x: few.linearise(x, omega), few.unknowns(guess), options)
        if solution.status.converged:
            yield balance.unknowns(few.coefficients(solution.x))


@dataclass(frozen=True, eq=False)
class GrowingLoad:
    """Balance at one frequency under a share p of its excitation and the full static load.

    Attributes
    ----------
    balance
        The periodic problem.
    omega
        Frequency, rad/s.
    excitation
        (size,) scaled load without its static part.
    joined
        (m,) share of the contact forces in the equations of each row of coefficients; None: all of them.
    """

    balance: HarmonicBalance
    omega: float
    excitation: FloatArray
    joined: FloatArray | None = None

    def linearise(self, x: FloatArray, p: float) -> Linearisation:
        """Return residual and derivatives at the scaled unknowns `x` and the share `p`."""
        period = None
        if self.joined is not None:
            period = _weighted(self.balance.forces(x, self.omega), self.joined)
        at = self.balance.linearise(x, self.omega, period)
        left = (1.0 - p) * self.excitation
        return replace(at, residual=at.residual + left, by_omega=-self.excitation)


@dataclass(frozen=True, eq=False)
class JoiningHarmonics:
    """Balance at one frequency with a share p of the contact forces in the equations of its higher harmonics.

    At p = 0 these equations are linear, and the lower harmonics are nearly independent of them.

    Attributes
    ----------
    balance
        The periodic problem.
    omega
        Frequency, rad/s.
    higher
        (m,) one for rows of coefficients that join, zero for others.
    """

    balance: HarmonicBalance
    omega: float
    higher: FloatArray

    def linearise(self, x: FloatArray, p: float) -> Linearisation:
        """Return residual and derivatives at the scaled unknowns `x` and the share `p`."""
        balance = self.balance
        period = balance.forces(x, self.omega)
        joined = _weighted(period, 1.0 - (1.0 - p) * self.higher)
        at = balance.linearise(x, self.omega, joined)
        return replace(at, by_omega=balance.scaled_forces(self.higher[:, None] * period.coefficients))


def _weighted(period: ContactPeriod, share: FloatArray) -> ContactPeriod:
    """Return contact forces scaled by a `share` (m,) in the equations of each row of coefficients."""
    return replace(
        period,
        coefficients=share[:, None] * period.coefficients,
        blocks=share[:, None] * period.blocks,
        by_omega=None if period.by_omega is None else share[:, None] * period.by_omega,
        events=None,
    )


def growing_load(balance: HarmonicBalance, omega: float) -> GrowingLoad:
    """Return the homotopy in the excitation at the frequency `omega` (rad/s)."""
    load = balance.linear_load(omega).copy()
    load[0] = 0.0
    return GrowingLoad(balance, omega, load.reshape(-1) / balance.force_scale)


def homotopies(balance: AnyBalance, omega: float, static: FloatArray) -> Iterator[Homotopy]:
    """Yield homotopies from a linear problem to the balance at one frequency.

    First the excitation grows from almost zero, where no contact changes its state and the problem is linear. Damping
    bounds the motion under every share of the excitation. The path therefore reaches the full excitation, through folds
    if necessary (degree theory; Allgower & Georg 1990). During this homotopy contacts act on harmonics up to the
    highest driven one only: each further harmonic adds folds, and with all of them the path takes ten times as many
    steps. Then the contact forces of the higher harmonics join. Where several motions coexist, the result may differ
    from the motions at neighbouring frequencies.

    Parameters
    ----------
    balance
        The periodic problem.
    omega
        Frequency, rad/s.
    static
        (n_retained,) static equilibrium, m.
    """
    if not isinstance(
        balance, HarmonicBalance
    ):  # rigid contacts are not linear in the excitation; a local balance lacks some equations
        return
    at_rest = balance.unknowns(static[None].astype(complex))
    growing = growing_load(balance, omega)
    h = np.array(balance.harmonics)
    rows = np.concatenate([h[:1], np.repeat(h[1:], 2)])
    higher = (rows > lowest_harmonics(balance)[-1]).astype(float)
    if not np.any(higher):
        yield Homotopy((growing,), at_rest, FAINT, BACK * FAINT[-1])
        return
    few = replace(growing, joined=1.0 - higher)
    legs = (few, JoiningHarmonics(balance, omega, higher))
    yield Homotopy(legs, at_rest, FAINT, BACK * FAINT[-1])


def lowest_harmonics(balance: AnyBalance) -> tuple[int, ...]:
    """Return the harmonics up to the highest driven one, and at least up to the first."""
    driven = max(balance.linear.load.harmonics, default=balance.order)
    return tuple(h for h in balance.harmonics if h <= max(driven, 1))
