"""Motions with two given frequencies, and their envelope."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.judging import driven_by, judging_indices
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.travelling import condense_side
from stickslip.harmonic.two_frequency import (
    MAX_DENSE_UNKNOWNS,
    Indices,
    TorusBalance,
    TorusLinearisation,
    TorusPath,
    TorusSide,
    closed_path,
    half_plane,
    torus_balance,
)
from stickslip.model.blas_threads import by_one_thread
from stickslip.operators import Bordered, Jacobian
from stickslip.response.equilibrium import preload
from stickslip.response.system import NO_DOFS, System
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.linear import solve_with
from stickslip.solve.newton_method import Newton, Solution, newton
from stickslip.solve.status import Status

GRID = 64  # phases of each frequency, over which the largest distance from the mean is taken
LEVELS = 8  # steps of the second load if Newton's method fails at full load
MOST_RAISES = 6
FAINT = 0.01  # smallest reference for the change of a coordinate, over the largest coordinate
STEP_LEAVES = 1e-4  # relative residual of the error-estimating step by a Krylov method
STEP_MORE = 40  # additional combined frequencies in the Newton step that estimates the error
BEYOND = 4  # additional order of the combined frequencies in the error estimate
SHARE = 0.5  # of the tolerance, up to which combined frequencies are omitted


@dataclass(frozen=True, eq=False)
class TorusMotion:
    """Motion with two frequencies.

    Attributes
    ----------
    indices
        (j, k) of the combined frequencies ``jω1 + kω2``.
    omegas
        ω1 and ω2, rad/s.
    coefficients
        (len(indices), n) complex displacement of all dofs, m.
    x
        Unknowns of the balance.
    status
        How the solver ended.
    iterations
        Newton steps.
    residual
        Largest entry of the scaled residual.
    slip
        Error of the second phase in the contacts after one cycle of the first, rad.
    unsettled
        Number of contacts whose state did not repeat on a characteristic.
    left_out
        Largest relative change of a coordinate (root mean square) by a Newton step with further combined frequencies;
        NaN if not computed.
    """

    indices: Indices
    omegas: tuple[float, float]
    coefficients: ComplexArray
    x: FloatArray
    status: Status
    iterations: int
    residual: float
    slip: float
    unsettled: int = 0
    left_out: float = float("nan")

    @property
    def converged(self) -> bool:
        """Whether the motion is a solution."""
        return self.status.converged and bool(np.all(np.isfinite(self.coefficients)))

    @property
    def order(self) -> int:
        """Largest sum of harmonics."""
        return max(abs(j) + abs(k) for j, k in self.indices)

    def values(self, dofs: IntArray, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return the (..., len(dofs)) displacements of dofs at phases (rad), m."""
        angles = np.multiply.outer(np.asarray(first), [j for j, _ in self.indices])
        angles = angles + np.multiply.outer(np.asarray(second), [k for _, k in self.indices])
        return np.asarray((np.exp(1j * angles) @ self.coefficients[:, dofs]).real)

    def at_times(self, dofs: IntArray, times: FloatArray, phase: float = 0.0) -> FloatArray:
        """Return the (times, len(dofs)) displacements at times (s), m.

        `phase` is the phase of the second frequency at t = 0.
        """
        return self.values(dofs, self.omegas[0] * times, self.omegas[1] * times + phase)


@dataclass(frozen=True, eq=False)
class Envelope:
    """Amplitude modulation of a motion with two frequencies.

    Attributes
    ----------
    phase
        (n,) phase of the second frequency at the beginning of a cycle of the first, rad.
    amplitude
        (n, outputs) half of peak to peak over this cycle, m.
    rms
        (outputs,) root mean square about the mean, m.
    """

    phase: FloatArray
    amplitude: FloatArray
    rms: FloatArray

    @property
    def largest(self) -> FloatArray:
        """(outputs,) largest amplitude, m."""
        return np.asarray(self.amplitude.max(axis=0))

    @property
    def least(self) -> FloatArray:
        """(outputs,) smallest amplitude, m."""
        return np.asarray(self.amplitude.min(axis=0))


def envelope(motion: TorusMotion, dofs: IntArray, phases: int = 96) -> Envelope:
    """Return half of peak to peak over one period of the first frequency, by the initial phase of the second."""
    ratio = motion.omegas[1] / motion.omegas[0]
    a_turn = max(256, int(32 * motion.order * max(1.0, ratio)))
    along = 2.0 * np.pi * np.arange(a_turn + 1) / a_turn
    begins = 2.0 * np.pi * np.arange(phases) / phases
    amplitude = np.array([0.5 * np.ptp(motion.values(dofs, along, begin + ratio * along), axis=0) for begin in begins])
    size = np.sum(np.abs(motion.coefficients[1:, dofs]) ** 2, axis=0)
    return Envelope(begins, amplitude, np.sqrt(0.5 * size))


@dataclass(frozen=True, eq=False)
class _Evaluation:
    residual: FloatArray
    jac: Jacobian
    seconds_contact: float


@dataclass(frozen=True, eq=False)
class TwoTones:
    """System under two loads of different frequencies; `two_tones` makes one.

    Attributes
    ----------
    system
        System of structure and contacts.
    balance
        Equations of the balance.
    newton
        Options of Newton's method.
    """

    system: System
    balance: TorusBalance
    newton: Newton = Newton()  # noqa: RUF009  # frozen

    def with_indices(self, indices: Indices) -> "TwoTones":
        """Return the problem with other combined frequencies."""
        return replace(self, balance=self.balance.with_indices(indices))

    def path(self, ratio: float, refine: float = 1.0) -> TorusPath:
        """Return the sampling path on the torus."""
        return closed_path(ratio, self.balance.order, refine)

    def motion(self, x: FloatArray, omegas: tuple[float, float], solution: Solution, path: TorusPath) -> TorusMotion:
        """Return unknowns as a motion."""
        balance = self.balance
        full = balance.side.recover(balance.indices, omegas, balance.coefficients(x))
        return TorusMotion(
            balance.indices,
            omegas,
            full,
            x,
            solution.status,
            solution.iterations,
            solution.residual_norm,
            path.slip(omegas[1] / omegas[0]),
            balance.forces(x, omegas, path).unsettled,
        )

    def stuck(self, omegas: tuple[float, float]) -> FloatArray:
        """Return the unknowns of the motion with all contacts stuck about the static state."""
        balance, side = self.balance, self.balance.side
        rows = self.system.springs.restricted(side.first.retained)
        operator = rows.gap_operator
        springs = operator.T @ (rows.stuck_stiffness()[:, None] * operator.toarray())
        stiffness, _ = side.stiffness(balance.indices, omegas)
        load, _, _ = side.load(balance.indices, omegas)
        q = np.zeros((len(balance.indices), side.n), dtype=complex)
        q[0, np.searchsorted(side.first.retained, self.system.retained)] = preload(self.system, side.first.load.static)
        for place in range(1, len(q)):
            if np.any(load[place]):
                q[place] = np.linalg.solve(stiffness[place] + springs, load[place])
        return balance.unknowns(q)

    def solve(
        self, omegas: tuple[float, float], start: FloatArray | None = None, path: TorusPath | None = None
    ) -> TorusMotion:
        """Return the motion at two frequencies, rad/s.

        Parameters
        ----------
        omegas
            ω1 and ω2.
        start
            Initial unknowns; None: stuck contacts, and if this fails, continuation of the second load from zero.
        path
            Sampling of the torus; None: the result of the method `path`.
        """
        check_frequencies(omegas)
        path = path or self.path(omegas[1] / omegas[0])
        x = self.stuck(omegas) if start is None else start
        solution = self.corrected(x, omegas, path)
        if not solution.status.converged:
            solution = self._raised(omegas, path, solution)
        return self.motion(solution.x, omegas, solution, path)

    def corrected(self, x: FloatArray, omegas: tuple[float, float], path: TorusPath) -> Solution:
        """Return the result of Newton's method from the unknowns `x`."""

        def evaluate(v: FloatArray) -> _Evaluation:
            at = self.balance.linearise(v, omegas, path)
            return _Evaluation(at.residual, at.jac, at.seconds_contact)

        return newton(evaluate, x, self.newton)

    def _raised(self, omegas: tuple[float, float], path: TorusPath, failed: Solution) -> Solution:
        """Raise the second load from zero, with linear extrapolation through the last two steps."""
        x = self._at_level(0.0).stuck(omegas)
        before: FloatArray | None = None
        solution, spent = failed, failed.iterations
        for step in range(LEVELS + 1):
            level = step / LEVELS
            guess = x if before is None else 2.0 * x - before
            solution = self._at_level(level).corrected(guess, omegas, path)
            spent += solution.iterations
            if not solution.status.converged:
                break
            before, x = (None if step == 0 else x), solution.x
        return replace(solution, iterations=spent)

    def _at_level(self, level: float) -> "TwoTones":
        side = self.balance.side
        load = side.second.load
        less = HarmonicLoad(load.static, {h: level * f for h, f in load.harmonics.items()})
        own = replace(side, second=side.second.with_load(less))
        return replace(self, balance=replace(self.balance, side=own))


@by_one_thread
def two_tones(
    system: System,
    first: HarmonicLoad,
    second: HarmonicLoad,
    order: int,
    *,
    waves: tuple[int, int] | None = None,
    more: IntArray = NO_DOFS,
    newton_options: Newton | None = None,
) -> TwoTones:
    """Set up the motion under two loads of different frequencies.

    Parameters
    ----------
    system
        System of structure and contacts; a tuned wheel needs all its waves.
    first
        Load with the static part and the harmonics of ω1.
    second
        Load with the harmonics of ω2; its static part is not used.
    order
        Largest sum of harmonics ``|j| + |k|``.
    waves
        Wave numbers of both frequencies on a tuned wheel. Loads are given in the coordinates of their own waves.
    more
        Dofs retained in addition to the contact dofs.
    newton_options
        Solver options; None: defaults.

    Raises
    ------
    InputError
        If a tuned wheel lacks waves, or `torus_balance` refuses the input.
    """
    side = torus_side(system, first, second, order, waves, more)
    balance = torus_balance(side, system.interface, order)
    return TwoTones(system, balance, newton_options or Newton())


def torus_side(
    system: System,
    first: HarmonicLoad,
    second: HarmonicLoad,
    order: int,
    waves: tuple[int, int] | None = None,
    more: IntArray = NO_DOFS,
) -> TorusSide:
    """Condense the linear structure; arguments as in `two_tones`."""
    structure = system.structure
    retained = np.union1d(system.retained, more)
    zero = HarmonicLoad(np.zeros(structure.n))
    second = HarmonicLoad(zero.static, second.harmonics)
    wheel = structure.wheel
    if wheel is None:
        one = condense_side(structure, retained, first, order)
        return TorusSide(one, one.with_load(second), {0: one.with_load(zero)})
    if waves is None or not wheel.has_every_wave:
        raise input_error(
            "quasi_periodic",
            "of a tuned wheel needs the wave numbers of both frequencies and all waves",
            "Give `waves`, and reduce every wave.",
        )

    def travelling(wave: int, load: HarmonicLoad) -> DynamicStiffness:
        return condense_side(wheel.travelling_as(wave), retained, load, order)

    still = {k: travelling(k, zero) for k in range(wheel.sectors)}
    own = waves[0] % wheel.sectors, waves[1] % wheel.sectors
    return TorusSide(travelling(own[0], first), travelling(own[1], second), still, (own[0], own[1], wheel.sectors))


def check_frequencies(omegas: tuple[float, float]) -> None:
    """Raise `InputError` unless both frequencies are positive and different."""
    if not all(np.isfinite(w) and w > 0.0 for w in omegas) or omegas[0] == omegas[1]:
        raise input_error(
            "quasi_periodic",
            f"has the frequencies {omegas[0]:g} and {omegas[1]:g} rad/s",
            "Give two different ones above zero; loads of one frequency are a matter of forced_response.",
        )


Solving = Callable[[TwoTones, FloatArray, TorusPath], TorusMotion]


def with_enough(
    problem: TwoTones, motion: TorusMotion, most: int, tolerance: float, solve: Solving
) -> tuple[TwoTones, TorusMotion]:
    """Add combined frequencies until the omitted ones would change the motion by less than `tolerance`.

    The combined frequencies with the largest response to contact forces are added, not all up to an order, since almost
    any order has some combined frequency near a lightly damped resonance.

    Parameters
    ----------
    problem, motion
        Initial problem and motion.
    most
        Largest sum of harmonics. The error estimate includes sums up to `BEYOND` more, and the judging set of the
        loads.
    tolerance
        Relative tolerance of the root mean square.
    solve
        Function that solves a problem from unknowns on a path.

    Returns
    -------
    TwoTones, TorusMotion
        Last converged problem and motion; `left_out` is the estimated effect of the omitted frequencies.
    """
    side = problem.balance.side
    own_tones = [(h, 0) for h in driven_by(side.first.load)]
    own_tones += [(0, h) for h in driven_by(side.second.load)]
    candidates = tuple(dict.fromkeys((*half_plane(most + BEYOND), *judging_indices(own_tones))))
    highest = max(abs(j) + abs(k) for j, k in candidates)
    for raised in range(MOST_RAISES + 1):
        ratio = motion.omegas[1] / motion.omegas[0]
        path = closed_path(ratio, highest, 0.5)
        size = np.sum(np.abs(problem.balance.coefficients(motion.x)[1:]) ** 2)
        own = set(problem.balance.indices[1:])
        more = tuple(i for i in candidates if i not in own)
        moved = problem.balance.left_out(motion.x, motion.omegas, path, more)
        square = np.sum(np.abs(moved) ** 2, axis=1) / size
        plain = float(np.sqrt(np.sum(square)))
        motion = replace(motion, left_out=plain)
        within = np.flatnonzero([abs(j) + abs(k) <= most for j, k in more])
        order = within[np.argsort(square[within], kind="stable")]
        rest = np.cumsum(square[order])
        stays = SHARE * tolerance
        if rest[-1] <= tolerance**2 or room(problem) < 1 or raised == MOST_RAISES:
            told = off_by(problem, motion, path, [more[i] for i in np.argsort(square)[::-1]])
            motion = replace(motion, left_out=max(plain, told))
            if motion.left_out <= tolerance or room(problem) < 1 or raised == MOST_RAISES:
                break
            stays *= plain / motion.left_out  # resonance amplifies the omitted frequencies
        added = order[rest > stays**2][::-1][: room(problem)]
        if not added.size:
            break
        wider = problem.with_indices((*problem.balance.indices, *(more[i] for i in sorted(added))))
        start = wider.balance.from_other(problem.balance, motion.x)
        found = solve(wider, start, wider.path(ratio))
        if not found.converged:
            told = off_by(problem, motion, path, [more[i] for i in np.argsort(square)[::-1]])
            motion = replace(motion, left_out=max(motion.left_out, told))
            break
        problem, motion = wider, found
    return problem, motion


def off_by(problem: TwoTones, motion: TorusMotion, path: TorusPath, more: Sequence[tuple[int, int]]) -> float:
    """Return the relative change of a motion by a Newton step with more combined frequencies.

    It is the root mean square of the most changed coordinate.

    Parameters
    ----------
    problem, motion
        Problem and its solved motion.
    path
        Sampling path, fine enough for the larger set.
    more
        Combined frequencies by decreasing importance; the step takes as many as it can.
    """
    few = max(0, min(STEP_MORE, room(problem)))
    wider = problem.balance.with_indices((*motion.indices, *more[:few]))
    x = wider.from_other(problem.balance, motion.x)
    at = wider.linearise(x, motion.omegas, path)
    jac: Jacobian = at.jac
    right = at.residual
    if not any(np.any(force) for force in wider.side.second.load.harmonics.values()):
        jac, right = _with_free_tone(wider, x, at)
    found = solve_with(to_tolerance(problem.newton.linear, STEP_LEAVES), jac, right)
    if found is None:
        return np.inf
    step = found[: x.size]
    size = np.linalg.norm(wider.coefficients(x)[1:], axis=0)
    change = np.linalg.norm(wider.coefficients(step)[1:], axis=0)
    return float(np.max(change / np.maximum(size, FAINT * np.max(size))))


def _with_free_tone(balance: TorusBalance, x: FloatArray, at: TorusLinearisation) -> tuple[Bordered, FloatArray]:
    """Return Jacobian and residual with the second frequency as an unknown and a fixed phase of the second tone."""
    own = balance.coefficients(x)
    along = balance.unknowns(np.array([1j * k * row for (_, k), row in zip(balance.indices, own, strict=True)]))
    return Bordered(at.jac, at.by_second, along, 0.0), np.append(at.residual, 0.0)


def room(problem: TwoTones) -> int:
    """Return the number of combined frequencies that may be added."""
    return MAX_DENSE_UNKNOWNS // (2 * problem.balance.side.n) - len(problem.balance.indices)


def farthest(motion: TorusMotion, dofs: IntArray) -> FloatArray:
    """Return the (k,) largest distances of coordinates from their mean, m, over both phases of a motion."""
    phases = 2.0 * np.pi * np.arange(GRID) / GRID
    first, second = np.meshgrid(phases, phases)
    values = motion.values(dofs, first, second)
    return np.asarray(np.abs(values - motion.coefficients[0, dofs].real).max(axis=(0, 1)))
