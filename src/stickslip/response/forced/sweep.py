"""Options of a forced response: range, harmonics, limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.compiled import Evaluator, check_evaluator
from stickslip.errors import check_choice, input_error
from stickslip.harmonic.harmonic_set import Harmonics, harmonics_of, multiples
from stickslip.harmonic.selection import strategy_named
from stickslip.harmonic.selection.strategy import Strategy, always_kept, check_strategy
from stickslip.harmonic.strategies import STRATEGIES
from stickslip.response.continuation.branch import steps_through
from stickslip.response.forced.choices import PUBLISHED, RUNGS, SELECTION, AmplitudeOf, Passages, RelativeTo, Rescue
from stickslip.solve.continuation import StepControl
from stickslip.solve.newton_method import Newton

Direction = Literal["up", "down"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """Options of a forced response.

    Parameters
    ----------
    omega_range
        Smallest and largest excitation frequency, rad/s.
    low
        Initial harmonics: the highest one, or a list such as (1, 3, 5). The static term is always kept.
    high
        ``auto``: harmonics are raised along the branch (5, 9, 15, 25, 41; twice these for a load in harmonic 2 alone)
        until the estimated error is below the threshold, and audited. A number or a list: harmonics of the repeats,
        which are the reference of the published Jacobian Alert; no point has more. Strategies that do not verify take 5
        for ``auto``.
    cap
        Highest harmonic of ``auto``; points that need more are doubtful.
    samples
        Samples per period of the contact forces.
    evaluator
        Evaluation of piecewise-linear laws. ``events`` has no sampling error, which would add small corners and folds
        to branches.
    threshold
        Predicted error (fraction) above which a frequency is repeated.
    selection
        Name of a strategy of `stickslip.harmonic.selection` (``guarded_alert``, the published ``jacobian_alert``, ...),
        a strategy object, or the same harmonics at every frequency (``always_low``, ``always_high``).
    passages
        ``double``: complete the response with few harmonics, then repeat the points that need more; ``single``: settle
        each of the equally spaced frequencies before the next. Strategies that predict the harmonics of the next
        frequency always use ``single``. Not used with ``high = "auto"``.
    error_harmonics
        Harmonics of the predicted error; None: the driven ones.
    relative_to
        Reference of the predicted error. ``answer``: the vector of an output's complex amplitudes, or 1 % of the
        largest output of its unit if that is more. ``each``: each harmonic of each dof separately, without those that
        hardly move, as published.
    amplitude_of
        Definition of an output's amplitude: ``first``, of the driven harmonics; ``half_peak_to_peak``; ``rms``, over a
        period about the mean.
    points
        Smallest number of points of the first passage; curved parts of the branch get more.
    frequencies
        Number of equally spaced frequencies to step through instead of following the branch by arc length; 0: arc
        length.
    at
        Listed frequencies to step through instead, rad/s, ascending (or descending if the direction is ``down``), all
        within the range.
    direction
        ``up``: from the smallest frequency to the largest; ``down``: the reverse, which finds other motions near folds.
    peak_points
        Largest number of points added to resolve the peak.
    rescue
        Attempts at a failed frequency. ``off``: the corrector from neighbours, from the bonded vibration and from few
        harmonics, without a branch between listed frequencies. ``in_time``: then from time integration, if the motion
        repeats; if not, the point records this. ``all``: homotopies and other globalisations before time integration,
        300 Newton steps at a point of 60 unknowns.
    newton
        Corrector options.
    """

    omega_range: tuple[float, float]
    low: int | Sequence[int] = 1
    high: int | Sequence[int] | Literal["auto"] = "auto"
    cap: int = RUNGS[-1]
    samples: int = 256
    evaluator: Evaluator = "events"
    threshold: float = 0.05
    selection: str | Strategy = SELECTION
    passages: Passages = "double"
    error_harmonics: Sequence[int] | None = None
    relative_to: RelativeTo = "answer"
    amplitude_of: AmplitudeOf = "first"
    points: int = 40
    frequencies: int = 0
    at: tuple[float, ...] = ()
    direction: Direction = "up"
    peak_points: int = 12
    rescue: Rescue = "all"
    newton: Newton = Newton()  # noqa: RUF009  # frozen

    def __post_init__(self) -> None:
        first, last = self.omega_range
        if not 0.0 < first < last < np.inf:
            raise input_error(
                "Sweep.omega_range",
                f"must be positive and growing, got {first:g} to {last:g} rad/s",
                "Widen the range; `at` solves at single frequencies in it." if first == last else "Swap the two ends.",
            )
        check_evaluator(self.evaluator)
        if isinstance(self.selection, str):
            hint = "'guarded_alert' repeats where it matters."
            check_choice("Sweep.selection", self.selection, STRATEGIES, hint)
        else:
            check_strategy(self.selection)
        _check_steps(self)
        hint = "'double' repeats what needs more harmonics."
        check_choice("Sweep.passages", self.passages, get_args(Passages), hint)
        hint = "'answer' judges what is reported."
        check_choice("Sweep.relative_to", self.relative_to, get_args(RelativeTo), hint)
        hint = "'first' is that of the harmonics that loads drive."
        check_choice("Sweep.amplitude_of", self.amplitude_of, get_args(AmplitudeOf), hint)
        check_choice("Sweep.rescue", self.rescue, get_args(Rescue), "'off' gives up sooner.")
        if np.isnan(self.threshold):
            raise input_error("Sweep.threshold", "is not a number", "0.05 is 5 %.")
        if isinstance(self.high, str):
            check_choice("Sweep.high", self.high, ("auto",), "5 repeats with five harmonics.")
        for name in ("samples", "points", "frequencies", "peak_points", "cap"):
            value, least = getattr(self, name), 0 if name in {"frequencies", "peak_points"} else 1
            if not isinstance(value, (int, np.integer)) or value < least:
                raise input_error(
                    f"Sweep.{name}", f"must be an integer of at least {least}, got {value!r}", "Give a count."
                )
        low, high = self.low_harmonics, self.high_harmonics
        if len(low) < 2 or not set(low) <= set(high):  # the static term and another
            raise input_error(
                "Sweep",
                f"harmonics low = {self.low}, high = {self.high}",
                "Give low at least harmonic 1, and high all of low and more.",
            )
        taken = self.error_harmonics
        if taken is not None and (len(taken) == 0 or not set(taken) <= set(low)):
            raise input_error(
                "Sweep.error_harmonics",
                f"are {taken}, the first passage keeps {', '.join(map(str, low))}",
                "A relative change needs harmonics that the first passage has; 0 is the static part.",
            )

    @property
    def low_harmonics(self) -> Harmonics:
        """Harmonics of the first passage."""
        return harmonics_of(self.low, "Sweep.low")

    @property
    def high_harmonics(self) -> Harmonics:
        """Harmonics of the reference, or the most that ``auto`` takes."""
        if self.auto:
            return self.supports[-1]
        if isinstance(self.high, str):
            return harmonics_of(max(PUBLISHED, self.low_harmonics[-1]))
        return harmonics_of(self.high, "Sweep.high")

    @property
    def auto(self) -> bool:
        """Whether harmonics are raised along the branch until the estimated error is small."""
        return self.high == "auto" and self.strategy.verifies

    @property
    def supports(self) -> tuple[Harmonics, ...]:
        """Harmonics of each level of ``auto``, the fewest first.

        They are multiples of the common divisor of the initial harmonics.
        """
        low = self.low_harmonics
        step = multiples(low, low[-1])[1]
        rungs = sorted({*(step * rung for rung in RUNGS if step * rung < self.cap), self.cap})
        more = (multiples(low, rung) for rung in rungs if rung >= low[-1] + step)
        return (low, *dict.fromkeys(more))

    @property
    def strategy(self) -> Strategy:
        """Strategy that chooses harmonics."""
        if not isinstance(self.selection, str):
            return self.selection
        strategy = strategy_named(self.selection)
        # the indicators of other strategies are no errors
        return strategy_named(self.selection, self.threshold) if strategy.verifies else strategy

    @property
    def single(self) -> bool:
        """Whether each frequency is settled before the next one."""
        strategy = self.strategy
        decides = always_kept(strategy) is None
        return decides and (self.passages == "single" or not strategy.verifies) and not self.auto

    @property
    def ends(self) -> tuple[float, float]:
        """Return first and last frequency of the response in the direction of the sweep, rad/s."""
        first, last = self.omega_range
        return (first, last) if self.direction == "up" else (last, first)

    @property
    def forward(self) -> float:
        """1 for growing frequencies, -1 for falling ones."""
        return 1.0 if self.direction == "up" else -1.0

    @property
    def grid(self) -> FloatArray:
        """Frequencies to step through, rad/s, in their order; empty where the branch is followed by arc length."""
        return np.sort(self.at)[:: int(self.forward)] if self.at else self.spaced(self.frequencies)

    def spaced(self, count: int) -> FloatArray:
        """Return `count` equally spaced frequencies in the direction of the sweep, rad/s."""
        return np.linspace(*self.omega_range, count)[:: int(self.forward)]

    @property
    def control(self) -> StepControl:
        """Step control of the branch: a step is at most the range over `points`."""
        first, last = self.omega_range
        control = steps_through(last - first, self.points)
        listed = self.rescue != "all" and self.grid.size > 0
        return replace(control, max_points=0) if listed else control

    @property
    def first_harmonics(self) -> Harmonics:
        """Harmonics of the first passage: the reference's for ``always_high``, otherwise the low ones."""
        high = always_kept(self.strategy) == "high"
        return self.high_harmonics if high else self.low_harmonics


def _check_steps(sweep: Sweep) -> None:
    """Refuse invalid frequency lists and directions."""
    hint = "'up' goes from the first frequency to the last."
    check_choice("Sweep.direction", sweep.direction, get_args(Direction), hint)
    if not sweep.at:
        return
    if sweep.frequencies:
        raise input_error("Sweep", "has both frequencies and at", "Give one of them.")
    first, last = sweep.omega_range
    steps = np.diff(sweep.at)
    inside = all(first <= omega <= last for omega in sweep.at)
    if not (inside and (np.all(steps > 0.0) or np.all(steps < 0.0))):
        raise input_error(
            "Sweep.at",
            f"must grow or fall strictly within {first:g} to {last:g} rad/s, got {len(sweep.at)} frequencies",
            "Sort them, leave out what is twice, and widen omega_range to hold them.",
        )
    if steps.size and steps[0] < 0.0 and sweep.direction == "up":
        raise input_error("Sweep.at", "falls, and the direction is up", "Give direction='down', or sort it.")
