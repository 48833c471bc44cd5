"""The seam of harmonic selection: what a strategy sees of a solved frequency, and what it says.

A strategy is a frozen dataclass of its parameters with one method, `judge`. It is called once for every converged solution. What it
answers serves both ways of going through the frequencies (Gastaldi & Berruti 2017, section 4.4): the *double passage*, in which a
response with few harmonics is finished first and only the frequencies that need more are solved again; and the *single passage*, in
which each frequency is settled, and the harmonics of the next one are chosen, before going on.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.event_integrals import Events
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.harmonic.support import ByDof, Harmonics, of_all

Kept = Literal["low", "high"]
Solve = Callable[[FloatArray | StructuredJacobian, FloatArray], FloatArray | None]

FLOOR = 1e-3  # dofs moving less than this share of the largest have no meaningful relative error
# the same over all harmonics: below, a static part or a driven harmonic is what the solver left of zero
NOISE = 1e-6


@dataclass(frozen=True, eq=False)
class ErrorMeasure:
    """The largest relative change over some dofs and harmonics (Gastaldi & Berruti 2017, eq. 22, 23 and 29).

    Parameters
    ----------
    dofs
        Dofs of the structure: outputs, contact dofs, chosen directions.
    harmonics
        Harmonics of which the change is taken: 1; 0 for the static part; those that the excitation drives.

    Raises
    ------
    InputError
        If there are no dofs or no harmonics.
    """

    dofs: IntArray
    harmonics: tuple[int, ...] = (1,)

    def __post_init__(self) -> None:
        if self.dofs.size == 0 or not self.harmonics:
            raise input_error(
                "ErrorMeasure",
                f"has {self.dofs.size} dofs and harmonics {self.harmonics}",
                "Give dofs of the structure (System.outputs, System.alert_dofs) and one harmonic or more.",
            )

    def change(self, before: ComplexArray, moved: ComplexArray) -> tuple[float, int, int]:
        """Return the largest ``|moved| / |before|`` and the position of its dof and its harmonic.

        Parameters
        ----------
        before, moved
            (H+1, n_all) displacement of all dofs and its change, m. In each harmonic, dofs that move less than a thousandth of the
            largest are left out, and harmonics in which all move less than a millionth of the largest motion.
        """
        own = np.array([h for h in self.harmonics if h < len(before)])
        size = np.abs(before[own[:, None], self.dofs])
        gone = np.abs(moved[own[:, None], self.dofs])
        largest = np.max(np.abs(before[:, self.dofs]))
        floor = np.maximum(FLOOR * size.max(axis=1, keepdims=True), NOISE * largest)
        relevant = size > floor
        error = np.where(relevant, gone / np.where(relevant, size, 1.0), 0.0)
        place = int(np.argmax(error))
        row, column = divmod(place, self.dofs.size)
        return float(error.reshape(-1)[place]), column, int(own[row])


@dataclass(frozen=True, eq=False)
class Step:
    """A converged solution at one frequency, as a strategy sees it.

    Attributes
    ----------
    balance
        The periodic problem with the harmonics of the solution.
    reference
        The same problem with the reference support ñH, beyond which no strategy goes.
    smallest
        Harmonics of the first passage, below which no strategy goes.
    x
        Scaled solution of `balance`.
    omega, next_omega
        Frequency of the solution and of the next step, rad/s; equal where there is no next one or it is not known.
    measure
        What an error is taken of.
    solve
        Solution of a linear system from its matrix and right side, None where there is none; None: LU factors.
    before
        Solution with fewer harmonics at the same frequency, where this one repeats it.
    left
        Events that the accepted evaluation left, see `events`.
    by_dof
        Harmonics of each retained coordinate, where these differ: all others of `x` are zero; None: those of `balance` in all.
    """

    balance: HarmonicBalance
    reference: HarmonicBalance
    smallest: Harmonics
    x: FloatArray
    omega: float
    next_omega: float
    measure: ErrorMeasure
    solve: Solve | None = None
    before: "Step | None" = None
    left: Events | None = None
    by_dof: ByDof | None = None

    @property
    def supports(self) -> ByDof:
        """Harmonics of each retained coordinate."""
        return self.by_dof or (self.balance.harmonics,) * self.balance.linear.n

    @cached_property
    def events(self) -> Events | None:
        """Where contacts change their states at the solution; None where that is not known: contacts that are marched or on samples.

        With them, ``reference.forces(padded, omega, events)`` is the forces of more harmonics and evaluates no contact.
        """
        if self.left is not None or not self.balance.compiled.keeps_events:
            return self.left
        found = self.balance.forces(self.x, self.omega).events
        return found if found is not None and found.whole else None


@dataclass(frozen=True, eq=False)
class Verdict:
    """The judgement of a strategy on a solution.

    Attributes
    ----------
    indicator
        The number that was compared with the strategy's threshold: a predicted error, a share of energy, ...
    again
        Harmonics with which this frequency is to be solved again; None: the solution is accepted.
    following
        Harmonics with which the next frequency begins, in a single passage.
    start
        (H+1, n) coefficients from which the repeat starts, m; None: from the solution.
    again_by_dof, following_by_dof
        The same for each retained coordinate, where these differ; `again` and `following` are those of all together.
    """

    indicator: float
    again: Harmonics | None
    following: Harmonics
    start: ComplexArray | None = None
    again_by_dof: ByDof | None = None
    following_by_dof: ByDof | None = None


class Strategy(Protocol):
    """What a passage through the frequencies needs of a strategy; frozen dataclasses implement it."""

    @property
    def threshold(self) -> float:
        """Indicator above which more harmonics are asked for."""
        ...

    @property
    def verifies(self) -> bool:
        """Whether a verdict says how good the solution itself is, so that a double passage can be made of it.

        Strategies that only foretell the next frequency, or raise the harmonics step by step, need a single passage.
        """
        ...

    def judge(self, step: Step) -> Verdict:
        """Say what a converged solution needs."""
        ...


def always_kept(strategy: Strategy) -> Kept | None:
    """Return the support that a strategy keeps at every frequency, which then decides nothing; None: it decides.

    It is told by an attribute `always`, which other strategies need not have.
    """
    kept: Kept | None = getattr(strategy, "always", None)
    return kept


def check_strategy(strategy: object) -> None:
    """Refuse what cannot be asked, before any long computation.

    Raises
    ------
    InputError
        If it has no `judge`, no number as `threshold`, or does not say whether it `verifies`; or is a class.
    """
    name = strategy.__name__ if isinstance(strategy, type) else type(strategy).__name__
    if isinstance(strategy, type):
        raise input_error("Sweep.selection", f"is the class {name}", f"Make one: {name}().")
    if not callable(getattr(strategy, "judge", None)):
        raise input_error(
            "Sweep.selection",
            f"is a {name}, which has no method judge",
            "Give a name or a Strategy.",
        )
    threshold = getattr(strategy, "threshold", None)
    if not isinstance(threshold, (int, float)) or np.isnan(threshold):
        raise input_error(
            f"{name}.threshold",
            f"is {threshold!r}",
            "Give it the indicator above which more harmonics are asked for, as a number.",
        )
    if not isinstance(getattr(strategy, "verifies", None), bool):
        raise input_error(
            f"{name}.verifies",
            "is neither True nor False",
            "True: a verdict says how good the solution itself is.",
        )


def judged(strategy: Strategy, step: Step) -> Verdict:
    """Return what a strategy says of a solution, if it can be done.

    Raises
    ------
    InputError
        If it returns something else than a verdict, or asks for harmonics that the reference does not have.
    """
    verdict: object = strategy.judge(step)
    place = f"{type(strategy).__name__}.judge"
    if not isinstance(verdict, Verdict):
        raise input_error(place, f"returned a {type(verdict).__name__}", "Return a Verdict.")
    each = of_all((verdict.again_by_dof or ()) + (verdict.following_by_dof or ()))
    beyond = {*(verdict.again or ()), *verdict.following, *each} - set(step.reference.harmonics)
    if beyond:
        raise input_error(
            place,
            f"asks for harmonics {', '.join(map(str, sorted(beyond)))}, which the reference does not have",
            "Keep to step.reference.harmonics, or raise Sweep.high.",
        )
    return verdict
