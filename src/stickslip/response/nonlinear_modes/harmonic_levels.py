"""Curve of a nonlinear mode with harmonics raised where frequency or damping ratio need more.

The amplitude is measured by the kinetic energy, so that the curve passes internal resonances.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.bordered import PeriodicProblem, State
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.response.continuation.branch import Curve, Followed, Judged
from stickslip.response.equilibrium import preload
from stickslip.response.self_excited.curve import PATIENT
from stickslip.response.self_excited.problem import SelfExcited, contacts_of
from stickslip.solve.branch import Following, Latest
from stickslip.solve.continuation import Point, StepControl
from stickslip.solve.linear import factorised
from stickslip.solve.newton_method import Solution, first_converged, newton

LARGEST = 0.1  # largest change of the shape in a step: with 0.25 the mode of a chain missed two of its four folds
CORRECTIONS = 8  # most Newton steps to a point: beyond a corner a shorter step takes fewer
GROWTH = 2.5  # largest growth of a step, after steps became short at a corner
MORE = 2  # a level with h harmonics is followed by one with MORE h + 1
SAFETY = 1.25  # on predicted changes
AGREE = 0.5  # share of the tolerance by which neighbouring levels may differ
SAME_SHEET_RTOL = 0.3
FAINT_RATIO = 1e-4  # smallest reference of relative changes of the damping ratio
SMALL = 100.0  # number of unknowns at which half the work of a Newton step grows with the unknowns


@dataclass(frozen=True, eq=False)
class ModeCurve(Curve):
    """Motions of a mode over ``ln a`` with several levels of harmonics.

    Parameters
    ----------
    problems
        The mode with the harmonics of each level.
    control
        Step control.
    tolerance
        Relative change of frequency or damping ratio beyond which harmonics are raised.
    decaying
        Whether motions are free decays with the complex eigenvalue λ. Otherwise they are steady motions sustained by
        negative damping.
    """

    problems: tuple[SelfExcited, ...]
    control: StepControl
    tolerance: float
    decaying: bool = False
    wider: dict[int, tuple[SelfExcited, PeriodicProblem] | None] = field(
        default_factory=dict, repr=False
    )  # of each level, made when first needed

    @classmethod
    def of(
        cls,
        problem: SelfExcited,
        span: tuple[float, float],
        points: int,
        most: int = 0,
        tolerance: float = 1e-3,
        *,
        decaying: bool = False,
    ) -> "ModeCurve":
        """Return the curve of a mode with its harmonics and higher levels up to `most`."""
        every = [problem]
        while every[-1].balance.order < most:
            every.append(problem.with_order(min(MORE * every[-1].balance.order + 1, most)))
        length = abs(float(np.log(span[1] / span[0])))
        control = StepControl(scale=length / (points * LARGEST), first=0.05, largest=LARGEST, growth=GROWTH)
        return cls(tuple(every), control, tolerance, decaying)

    @property
    def levels(self) -> int:
        """Number of levels."""
        return len(self.problems)

    @cached_property
    def equations(self) -> tuple[PeriodicProblem, ...]:
        """Periodic problem of each level."""
        return tuple(map(self._equation, self.problems))

    def _equation(self, own: SelfExcited) -> PeriodicProblem:
        family = own.decaying if self.decaying else None
        return own.over_amplitude(family, held=by_energy(own), linear_alone=True)

    def judging(self, level: int) -> tuple[SelfExcited, PeriodicProblem] | None:
        """Return the mode and its periodic problem with the harmonics that judge a level.

        The result is None if a wheel lacks their waves.
        """
        if level not in self.wider:
            made = self.problems[level].judging()
            self.wider[level] = None if made is None else (made, self._equation(made))
        return self.wider[level]

    def linear(self, level: int, y: FloatArray) -> DynamicStiffness:
        """Return the dynamic stiffness at the frequency of a motion."""
        own = self.problems[level]
        return (own.decaying if self.decaying else own.damped)(float(y[-1])).linear

    def frequency_and_damping(self, level: int, y: FloatArray) -> tuple[float, float]:
        """Return frequency, rad/s, and damping ratio of a motion; for a decaying motion |λ| and -Re λ / |λ|."""
        own = self.problems[level]
        omega, ratio = own.omega(y), own.ratio(y)
        if not self.decaying:
            return omega, ratio
        stretch = float(np.hypot(1.0, ratio))
        return omega * stretch, ratio / stretch

    @cached_property
    def static(self) -> FloatArray:
        """(n_retained,) displacement under the static load, m."""
        own = self.problems[0]
        return preload(own.system, own.load.static)

    def problem(self, level: int) -> PeriodicProblem:
        """Return the periodic problem of a level."""
        return self.equations[level]

    def following(self, level: int) -> Following:
        """Return the continuation options of a level.

        The step length measures vibration, frequency and damping, not the mean.
        """
        own = self.problems[level]
        weights = np.ones(own.balance.size + 2)
        weights[: own.balance.linear.n] = 0.0
        few = replace(own.how.newton, max_iterations=CORRECTIONS)
        return Following(
            newton=few, control=self.control, weights=weights, predictor="parabola", corrector="kept_factors"
        )

    def fresh(self, level: int, p: float, near: Sequence[Followed], effort: float) -> Solution:
        """Solve at an amplitude from nearby motions, or from the linear mode about the static state."""
        own, equation = self.problems[level], self.problem(level)
        starts = [self.lifted(n.point.x, n.level, level) for n in near]
        starts.append(own.guess(self.static, float(np.exp(p))))
        options = own.how.newton, replace(PATIENT, linear=own.how.newton.linear)
        attempts = (
            newton(lambda y: equation.linearise(y, p), start, one)
            for one in options[: 2 if effort else 1]
            for start in starts
        )
        return first_converged(attempts)

    def lifted(self, x: FloatArray, level: int, to: int) -> FloatArray:
        """Convert unknowns from one level to another; missing harmonics are zero."""
        return x if level == to else _lifted(self.problems[level], self.problems[to], x)

    def cost(self, level: int) -> float:
        """Return the relative work of a Newton step."""
        return 1.0 + self.problems[level].balance.size / SMALL

    def judge(self, level: int, point: Point, latest: Latest) -> Judged:
        """Predict the change of frequency and damping ratio by a Newton step with the judging harmonics.

        On the last level, the change from fewer harmonics counts, too.
        """
        if level + 1 == self.levels > 1:
            last = self.at_the_cap(level, point)
            return last if last.bound > self.tolerance else Judged(np.fmax(last.bound, self._foretold(level, point)))
        return Judged(self._foretold(level, point))

    def _foretold(self, level: int, point: Point) -> float:
        """Return the change by a Newton step with the judging harmonics; NaN if a wheel lacks their waves."""
        wider = self.judging(level)
        if wider is None:
            return np.nan
        mode, equation = wider
        more = _lifted(self.problems[level], mode, point.x)
        at = equation.linearise(more, point.p)
        inverse = factorised(mode.how.newton.linear, at.jac)
        step = None if inverse is None else inverse(-at.residual)
        return np.inf if step is None else SAFETY * self._change(level, more, more + step)

    def at_the_cap(self, level: int, point: Point) -> Judged:
        """Bound the error on the last level by the difference from the previous level.

        This difference is larger than the error if the series converges.
        """
        fewer = self.problem(level - 1)
        start = self.lifted(point.x, level, level - 1)
        found = newton(lambda y: fewer.linearise(y, point.p), start, self.following(level - 1).newton)
        if not found.status.converged:
            return Judged(np.inf)
        return Judged(self._change(level, self.lifted(found.x, level - 1, level), point.x))

    def quiet(self, level: int, judged: Judged) -> bool:
        """Whether a bound is below the tolerance, or unknown."""
        return not judged.bound > self.tolerance

    def agree(self, fewer: Followed, more: Followed) -> bool:
        """Whether frequency and damping ratio differ by clearly less than the tolerance."""
        return self._between(fewer, more) <= AGREE * self.tolerance

    def near(self, fewer: Followed, more: Followed) -> bool:
        """Whether two motions are too close to lie on different sheets of the curve."""
        return self._between(fewer, more) <= SAME_SHEET_RTOL

    def height(self, found: Followed) -> float:
        """Return the damping ratio."""
        return self.frequency_and_damping(found.level, found.point.x)[1]

    def slips_grossly(self, found: Followed) -> bool:
        """Whether every contact that can slip slips or opens in a motion."""
        own = self.problems[found.level]
        return contacts_of(own, found.point.x, float(np.exp(found.p))).slipping == 1.0

    def _between(self, fewer: Followed, more: Followed) -> float:
        lifted = self.lifted(fewer.point.x, fewer.level, more.level)
        return self._change(more.level, lifted, more.point.x)

    def _change(self, level: int, one: FloatArray, other: FloatArray) -> float:
        """Return the larger of the relative differences of two motions in frequency and damping ratio."""
        (slow, few), (fast, many) = (self.frequency_and_damping(level, y) for y in (one, other))
        size = max(abs(few), abs(many), FAINT_RATIO)
        return max(abs(fast / slow - 1.0), abs(many - few) / size)


def _lifted(own: SelfExcited, other: SelfExcited, x: FloatArray) -> FloatArray:
    """Convert unknowns of a mode to other harmonics."""
    a, b = (replace(p.balance, displacement_scale=1.0) for p in (own, other))
    return np.append(b.unknowns(a.coefficients(x[:-2])), x[-2:])


@dataclass(frozen=True, eq=False)
class Size:
    """Amplitude condition: ``sum_h X_h^H W X_h`` over all harmonics above zero is one, in the scale of the problem.

    Parameters
    ----------
    weight
        (n, n) Hermitian matrix W, a mass.
    """

    weight: ComplexArray

    def value(self, state: State) -> float:
        """Return the residual of the condition."""
        x = _vibration(state)
        return float(np.vdot(x, x @ self.weight.T).real - 1.0)

    def gradient(self, state: State) -> FloatArray:
        """Return the derivative of the residual by the unknowns."""
        slope = 2.0 * _vibration(state) @ self.weight.T
        return _row(state, slope)


@dataclass(frozen=True, eq=False)
class Phase:
    """Phase condition: the share of the linear mode in the first harmonic is real.

    Parameters
    ----------
    row
        (n,) vector whose product with the first harmonic is this share.
    """

    row: ComplexArray

    def value(self, state: State) -> float:
        """Return the residual of the condition."""
        return float((self.row @ _vibration(state)[0]).imag)

    def gradient(self, state: State) -> FloatArray:
        """Return the derivative of the residual by the unknowns."""
        slope = np.zeros_like(_vibration(state))
        slope[0] = 1j * self.row.conj()
        return _row(state, slope)


def by_energy(problem: SelfExcited) -> tuple[Size, Phase]:
    """Return the amplitude and phase conditions of a mode from its kinetic energy.

    The linear mode has size one where its coordinate has amplitude one. The mass matrix is condensed at the frequency
    of the linear mode.
    """
    linear, mode = problem.balance.linear, problem.mode
    own = problem.system.structure.of_harmonic(1)
    spread = linear.output_rows(mode.omega, 1, np.arange(own.n))
    weight = spread.conj().T @ (own.mass @ spread)
    weight = 0.5 * (weight + weight.conj().T)
    shape = mode.shape[linear.retained] / mode.shape[problem.dof]
    weight = weight / np.vdot(shape, weight @ shape).real
    return Size(weight), Phase(shape.conj() @ weight)


def _vibration(state: State) -> ComplexArray:
    """Return the (H, n) harmonics above zero, in the scale of the problem."""
    rows = state.x.reshape(state.setting.balance.n_rows, -1)[1:]
    return np.asarray(rows[0::2] - 1j * rows[1::2])


def _row(state: State, slope: ComplexArray) -> FloatArray:
    """Return the gradient by all unknowns of a function whose differential is ``Re sum_h slope_h^H dX_h``."""
    out = np.zeros(state.y.size)
    rows = np.zeros((state.setting.balance.n_rows, slope.shape[1]))
    rows[1::2], rows[2::2] = slope.real, -slope.imag
    out[: state.x.size] = rows.reshape(-1)
    return out
