"""Protocol of harmonic selection: input of a strategy at a solved frequency, and its verdict.

A strategy is a frozen dataclass of its parameters with one method, `judge`, which is called once for every converged
solution. Its verdict serves both passages through the frequencies (Gastaldi & Berruti 2017, section 4.4). In the
*double passage*, the whole response is first solved with few harmonics, and only the frequencies that need more are
solved again. In the *single passage*, each frequency is completed, and the harmonics of the next one are chosen, before
going on.
"""

import numbers
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.event_integrals import Events
from stickslip.errors import StickslipError, input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import ByDof, Harmonics, of_all
from stickslip.harmonic.structured import StructuredJacobian

Kept = Literal["low", "high"]
Solve = Callable[[FloatArray | StructuredJacobian, FloatArray], FloatArray | None]

SHARE = 0.01  # share of the largest output with the same unit: smaller outputs are compared with this instead
FLOOR = 1e-3  # share of the largest dof below which a relative error has no meaning
# the same share over all harmonics: smaller static parts or driven harmonics are residuals of the solver
NOISE = 1e-6


@dataclass(frozen=True, eq=False)
class ErrorMeasure:
    """The largest relative change over some dofs.

    With `units`, it is the error of the *response*: the change of each dof, as a vector of its complex amplitudes,
    relative to that vector or to 1 % of the largest one with the same unit, whichever is larger. A dof nearly at rest
    is thus compared with the others, and a unit without motion is left out. Without units, it is the error *as
    published* (Gastaldi & Berruti 2017, eq. 22, 23 and 29): each harmonic is compared alone, and dofs that move less
    than a thousandth of the largest are left out.

    Parameters
    ----------
    dofs
        Dofs of the structure: outputs, contact dofs, chosen directions.
    harmonics
        Harmonics of the change: 1; 0 for the static part; those of the excitation. None: all except the static part,
        only for an error of the response.
    units
        (k,) number of the unit of each dof, which separates lengths from rotations. None: error as published.

    Raises
    ------
    InputError
        If there are no dofs or no harmonics, or all harmonics without units.
    """

    dofs: IntArray
    harmonics: tuple[int, ...] | None = (1,)
    units: IntArray | None = None

    def __post_init__(self) -> None:
        none = self.harmonics is None and self.units is None
        if self.dofs.size == 0 or none or self.harmonics == ():
            raise input_error(
                "ErrorMeasure",
                f"has {self.dofs.size} dofs and harmonics {self.harmonics}",
                "Give dofs of the structure (System.outputs, System.alert_dofs) and one harmonic or more.",
            )

    def rows(self, fewer: int, more: int) -> int:
        """Return the number of compared rows (harmonics from 0 on) of two motions with `fewer` and `more` rows.

        These are the common rows, or all if all harmonics count.
        """
        return max(fewer, more) if self.harmonics is None else min(fewer, more)

    def change(self, before: ComplexArray, moved: ComplexArray) -> tuple[float, int, int]:
        """Return the largest relative change, the position of its dof, and its harmonic.

        Parameters
        ----------
        before, moved
            (H+1, n_all) displacement of all dofs and its change, m.
        """
        scales = self.scales(before, len(moved))
        gone = np.abs(_rows(moved, scales.harmonics)[:, self.dofs])
        if self.units is None:
            error = np.divide(gone, scales.size, out=np.zeros_like(gone), where=scales.size > 0.0)
        else:
            whole = np.linalg.norm(gone, axis=0, keepdims=True)
            # the harmonic with the largest change represents the whole vector
            whole = np.where(gone == gone.max(axis=0, keepdims=True), whole, 0.0)
            error = np.divide(whole, scales.size, out=np.zeros_like(gone), where=scales.size > 0.0)
        place = int(np.argmax(error))
        row, column = divmod(place, self.dofs.size)
        return float(error.reshape(-1)[place]), column, int(scales.harmonics[row])

    def scales(self, before: ComplexArray, rows: int) -> "Scales":
        """Return the reference of changes for each harmonic and dof.

        Parameters
        ----------
        before
            (H+1, n_all) displacement of all dofs, m.
        rows
            Number of harmonics of the change, from 0 on.
        """
        if self.harmonics is None:
            own = np.arange(1, max(len(before), rows))
        else:
            own = np.array([h for h in self.harmonics if h < len(before)])
        size = np.abs(_rows(before, own)[:, self.dofs])
        largest = np.max(np.abs(before[:, self.dofs]))
        if self.units is None:
            floor = np.maximum(FLOOR * size.max(axis=1, keepdims=True), NOISE * largest)
            return Scales(own, np.where(size > floor, size, 0.0))
        whole = np.linalg.norm(size, axis=0)
        for unit in np.unique(self.units):
            same = self.units == unit
            most = np.max(whole[same])
            # a solver residual beside a static part, or beside harmonics that do not count, is not a motion
            still = most <= NOISE * np.max(np.abs(before[:, self.dofs[same]]))
            whole[same] = 0.0 if still else np.maximum(whole[same], SHARE * most)
        return Scales(own, np.broadcast_to(whole, size.shape))


@dataclass(frozen=True, eq=False)
class Scales:
    """References of relative changes.

    Attributes
    ----------
    harmonics
        (k,) harmonics that count.
    size
        (k, n_dofs) reference, m; 0 where a change does not count.
    """

    harmonics: IntArray
    size: FloatArray


def _rows(motion: ComplexArray, harmonics: IntArray) -> ComplexArray:
    """Return the rows of some harmonics of a motion (H+1, n); zeros beyond its highest one."""
    known = harmonics[harmonics < len(motion)]
    if known.size == harmonics.size:
        return motion[harmonics]
    out = np.zeros((harmonics.size, motion.shape[1]), dtype=complex)
    out[: known.size] = motion[known]
    return out


@dataclass(frozen=True, eq=False)
class Step:
    """A converged solution at one frequency, the input of a strategy.

    Attributes
    ----------
    balance
        The periodic problem with the harmonics of the solution.
    reference
        The same problem with the reference support ñH, the largest that a strategy may choose.
    smallest
        Harmonics of the first passage, the smallest set that a strategy may choose.
    x
        Scaled solution of `balance`.
    omega, next_omega
        Frequency of the solution and of the next step, rad/s; equal if there is no next one or it is unknown.
    measure
        Measure of the error.
    solve
        Function from matrix and right side to the solution of a linear system, None if there is none; None: LU factors.
    before
        Solution with fewer harmonics at the same frequency, if this one is a repeat.
    left
        Events found by the accepted evaluation, see `events`.
    by_dof
        Harmonics of each retained coordinate, if these differ; the others are zero in `x`. None: the harmonics of
        `balance` for all.
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
        """Events of the contacts at the solution; None if unknown, for contacts that are marched or on samples.

        With them, ``reference.forces(padded, omega, events)`` returns the forces in more harmonics without evaluating a contact.
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
        The number compared with the strategy's threshold: a predicted error, a share of energy, ...
    again
        Harmonics with which this frequency must be solved again; None: the solution is accepted.
    following
        Harmonics of the next frequency in a single passage.
    start
        (H+1, n) coefficients from which the repeat starts, m; None: from the solution.
    again_by_dof, following_by_dof
        The same for each retained coordinate, if these differ; `again` and `following` are then their unions.
    """

    indicator: float
    again: Harmonics | None
    following: Harmonics
    start: ComplexArray | None = None
    again_by_dof: ByDof | None = None
    following_by_dof: ByDof | None = None


class Strategy(Protocol):
    """Protocol of strategies of harmonic selection; frozen dataclasses implement it."""

    @property
    def threshold(self) -> float:
        """Indicator above which more harmonics are needed."""
        ...

    @property
    def verifies(self) -> bool:
        """Whether a verdict estimates the error of the solution itself, as a double passage needs.

        Strategies that only predict the next frequency, or raise the harmonics step by step, need a single passage.
        """
        ...

    def judge(self, step: Step) -> Verdict:
        """Return the verdict on a converged solution."""
        ...


def always_kept(strategy: Strategy) -> Kept | None:
    """Return which support a fixed strategy keeps at every frequency; None for a strategy that decides.

    Fixed strategies have an attribute `always`.
    """
    kept: Kept | None = getattr(strategy, "always", None)
    return kept


MEANT = {
    "threshold": "Give it the indicator above which more harmonics are asked for, as a number.",
    "verifies": "True: a verdict says how good the solution itself is.",
}


def check_strategy(strategy: object) -> None:
    """Refuse an invalid strategy, before any long computation.

    Raises
    ------
    InputError
        If it has no `judge`, no number as `threshold`, or lacks `verifies`; or is a class.
    """
    name = strategy.__name__ if isinstance(strategy, type) else type(strategy).__name__
    if isinstance(strategy, type):
        raise input_error("Sweep.selection", f"is the class {name}", f"Make one: {name}().")
    if not callable(getattr(strategy, "judge", None)):
        raise input_error(
            "Sweep.selection",
            f"is a {name}, which has no method judge",
            "Give it judge(self, step) -> Verdict, or a name.",
        )
    for member in ("threshold", "verifies"):
        if not hasattr(strategy, member):
            raise input_error(f"{name}.{member}", "is missing", MEANT[member])
    threshold = strategy.threshold  # type: ignore[attr-defined]  # just looked for
    if not isinstance(threshold, (int, float)) or np.isnan(threshold):
        raise input_error(
            f"{name}.threshold",
            f"is {threshold!r}",
            MEANT["threshold"],
        )
    if not isinstance(strategy.verifies, bool):  # type: ignore[attr-defined]  # just looked for
        raise input_error(f"{name}.verifies", "is neither True nor False", MEANT["verifies"])


def judged(strategy: Strategy, step: Step) -> Verdict:
    """Return the verdict of a strategy on a solution, after checking it.

    Raises
    ------
    InputError
        If the strategy returns no `Verdict`, or requests harmonics that the reference does not have; if a user's
        strategy raises any error, or returns an indicator that is not a finite number.
    """
    place = f"{type(strategy).__name__}.judge"
    own = type(strategy).__module__.partition(".")[0] != __name__.partition(".")[0]
    verdict: object = _of_a_user(strategy, step, place) if own else strategy.judge(step)
    if not isinstance(verdict, Verdict):
        raise input_error(place, f"returned a {type(verdict).__name__}", "Return a Verdict.")
    if own:
        _check_verdict(verdict, step, place)
    each = of_all((verdict.again_by_dof or ()) + (verdict.following_by_dof or ()))
    beyond = {*(verdict.again or ()), *verdict.following, *each} - set(step.reference.harmonics)
    if beyond:
        raise input_error(
            place,
            f"asks for harmonics {', '.join(map(str, sorted(beyond)))}, which the reference does not have",
            "Keep to step.reference.harmonics, or raise Sweep.high.",
        )
    indicator: object = verdict.indicator
    if own and not (isinstance(indicator, numbers.Real) and np.isfinite(float(indicator))):
        raise input_error(
            place,
            f"returned the indicator {indicator!r}",
            f"Return a finite number: above the threshold, {strategy.threshold:g}, it asks for more harmonics.",
        )
    return verdict


def _check_verdict(verdict: Verdict, step: Step, place: str) -> None:
    """Refuse harmonics and a start of a user's verdict that have another form than asked for."""
    for name in ("again", "following"):
        value: object = getattr(verdict, name)
        some = isinstance(value, (tuple, list)) and all(isinstance(h, numbers.Integral) for h in value)
        if not some and not (name == "again" and value is None):
            remedy = "Return a tuple of harmonics, such as (0, 1, 2, 3)" + ", or None: accepted." * (name == "again")
            raise input_error(place, f"returned {name} = {_short(value)}", remedy.rstrip(".") + ".")
    start: object = verdict.start
    n = step.balance.linear.n
    if start is not None and not (isinstance(start, np.ndarray) and start.ndim == 2 and start.shape[1] == n):
        remedy = f"Return an array of (harmonics, {n}) coefficients, one column a retained coordinate, or None."
        raise input_error(place, f"returned start = {_short(start)}", remedy)


def _short(value: object) -> str:
    """Return a value in few words."""
    return f"an array of shape {value.shape}" if isinstance(value, np.ndarray) else repr(value)


def _of_a_user(strategy: Strategy, step: Step, place: str) -> object:
    """Return the result of a user's `judge`; errors that it raises name it, with the line."""
    try:
        return strategy.judge(step)
    except StickslipError:
        raise
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)[1:]
        home = str(Path(__file__).parents[2])
        line = next((f for f in reversed(frames) if "site-packages" not in f.filename and home not in f.filename), None)
        remedy = f"See {Path(line.filename).name}, line {line.lineno}." if line else "Let it take (self, step)."
        raise input_error(place, f"raises {type(error).__name__}: {error}", remedy) from error
