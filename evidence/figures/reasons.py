"""Why two solutions differ: what contacts do, line by line, and what the harmonics left out do to the amplitude."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from evidence.figures.model import Model
from evidence.figures.solve import Orbit, Pair, orbit
from stickslip.arrays import BoolArray, ComplexArray, FloatArray
from stickslip.contact.law import OPEN, SLIP
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.harmonic_set import to_complex, to_real
from stickslip.response import ForcedPoint, ForcedProblem, fields, forced_problem, signals
from stickslip.solve.newton_method import newton

ORDERS = (5, 7, 9, 15, 25)  # highest harmonics of the ladder to the motion in time
DIRECTIONS = ("t", "w", "n")
ONE_PERCENT = 0.01
SAMPLES = 1024
LOUDER = 1.02  # factor on the excitation, for the sensitivity


@dataclass(frozen=True)
class Line:
    """What the points of one contact line do over a period.

    Attributes
    ----------
    name
        Of the line.
    smallest, mean
        Smallest and mean normal force of its points, N.
    open, slip
        Share of the time, mean over its points, in which they are open and slip.
    switches
        Changes between stick and slip in a period, mean over its points.
    """

    name: str
    smallest: float
    mean: float
    open: float
    slip: float
    switches: float


def lines_of(model: Model, problem: ForcedProblem, point: ForcedPoint) -> list[Line]:
    """Return what every line does at a solution."""
    found = signals(problem, point)
    normal, state = -found.force[:, 2], found.state
    slips = state[:, 0] == SLIP
    turns = np.sum(slips != np.roll(slips, 1, axis=-1), axis=-1)
    shut = np.all(state == OPEN, axis=1)
    out = []
    for name, own in _places(model.lines):
        values = (
            normal[own].min(),
            normal[own].mean(),
            shut[own].mean(),
            np.any(state[own] == SLIP, axis=1).mean(),
            turns[own].mean(),
        )
        out.append(Line(name, *(float(v) for v in values)))
    return out


def smallest_in_time(model: Model, motion: Orbit) -> dict[str, float]:
    """Return the smallest normal force of each line in a motion in time, N."""
    normal = -motion.force[:, :, 2]
    return {name: float(normal[:, own].min()) for name, own in _places(model.lines)}


def open_in_time(model: Model, motion: Orbit) -> dict[str, float]:
    """Return the share of the time in which each line is open in a motion in time, mean over its points."""
    shut = motion.force[:, :, 2] >= 0.0
    return {name: float(np.mean(shut[:, own])) for name, own in _places(model.lines)}


def _places(lines: Sequence[str]) -> list[tuple[str, list[int]]]:
    order = sorted(range(len(lines)), key=lambda i: lines[i])
    return [(name, list(own)) for name, own in groupby(order, key=lambda i: lines[i])]


@dataclass(frozen=True, kw_only=True)
class Truncation:
    """What the harmonics above five do at one frequency.

    Attributes
    ----------
    errors
        Of the amplitude against the motion in time, for each of the highest harmonics that was found.
    whole
        Error that Newton's first step foretells where the contacts see only harmonics up to five of the solution with most.
    by_line, by_direction
        The same where only the gaps of one line, or of one direction, are cut off.
    spring, limit
        Root mean square over a period of the tangential spring forces of the motion above harmonic five, and mean of the friction limit, N, of each line.
    switches
        Changes between stick and slip in a period with five and with most harmonics, of each line.
    friction
        Share of friction in the work dissipated.
    sensitivity
        Relative change of the amplitude over that of the excitation.
    other_motion
        Relative difference of the amplitudes of the motions in time that begin at the solution with most harmonics and at five.
    """

    errors: dict[int, float]
    whole: float
    by_line: dict[str, float]
    by_direction: dict[str, float]
    spring: dict[str, float]
    limit: dict[str, float]
    switches: dict[str, tuple[float, float]]
    friction: float
    sensitivity: float
    other_motion: float

    @property
    def within(self) -> int | None:
        """Smallest highest harmonic from which on all errors are below 1 %."""
        good = None
        for order in sorted(self.errors, reverse=True):
            if not abs(self.errors[order]) < ONE_PERCENT:
                break
            good = order
        return good


def truncation(model: Model, pair: Pair, known: Orbit) -> Truncation:
    """Find what the harmonics above five do at the frequency of a pair, whose motion in time is known."""
    ladder = _ladder(model, pair)
    errors = {k: p.amplitude(q) / known.amplitude - 1.0 for k, (p, q) in ladder.items()}
    problem, best = ladder[max(ladder)]
    cut = _Cut(model, pair.problem, problem, best)
    n = len(model.lines)
    line, direction = (
        np.repeat(np.array(model.lines)[:, None], 3, axis=1),
        np.broadcast_to(np.array(DIRECTIONS), (n, 3)),
    )
    names = list(dict.fromkeys(model.lines))
    lines5, most = ({x.name: x for x in lines_of(model, p, q)} for p, q in ((pair.problem, pair.high), (problem, best)))
    work = float(np.sum(fields(problem, best).energy))
    return Truncation(
        errors=errors,
        whole=cut.effect(np.ones((n, 3), dtype=bool)),
        by_line={name: cut.effect(line == name) for name in names},
        by_direction={name: cut.effect(direction == name) for name in DIRECTIONS},
        spring={name: cut.spring(line[:, 0] == name) for name in names},
        limit={name: cut.friction(line[:, 0] == name) * most[name].mean for name in names},
        switches={name: (lines5[name].switches, most[name].switches) for name in names},
        friction=work / _input(model, problem, best),
        sensitivity=_sensitivity(model, pair),
        other_motion=abs(orbit(model, problem, best).amplitude / known.amplitude - 1.0),
    )


def _ladder(model: Model, pair: Pair) -> dict[int, tuple[ForcedProblem, ForcedPoint]]:
    """Solve the frequency of a pair with more and more harmonics, each from the solution before."""
    known = pair.high
    out = {known.order: (pair.problem, known)}
    for order in ORDERS:
        if order <= known.order:
            continue
        sweep = replace(pair.problem.sweep, high=order)
        problem = forced_problem(model.system, model.load(pair.ratio), sweep)
        found = solved_from(problem, known, order)
        if found is None:
            break
        out[order], known = (problem, found), found
    return out


def solved_from(problem: ForcedProblem, known: ForcedPoint, order: int) -> ForcedPoint | None:
    """Solve with harmonics up to `order` from a solution with fewer, at its frequency; None where that fails."""
    balance = problem.balance(tuple(range(order + 1)))
    begin = np.zeros((order + 1, known.coefficients.shape[1]), dtype=complex)
    begin[: len(known.coefficients)] = known.coefficients
    found = newton(lambda x: balance.linearise(x, known.omega), balance.unknowns(begin), problem.sweep.newton)
    if not found.status.converged:
        return None
    return replace(known, coefficients=balance.coefficients(found.x), harmonics=np.arange(order + 1))


def _input(model: Model, problem: ForcedProblem, point: ForcedPoint) -> float:
    """Return the work of the excitation in a period, J."""
    force = model.load(1.0).harmonics[1]
    scale = _loudness(model, problem)
    motion = problem.low.linear.recover(point.omega, point.coefficients)[1]
    return float(abs(np.pi * scale * np.imag(np.conj(force) @ motion)))


def _loudness(model: Model, problem: ForcedProblem) -> float:
    unit, own = (np.linalg.norm(v.harmonics[1]) for v in (model.load(1.0), problem.low.linear.load))
    return float(own / unit)


def _sensitivity(model: Model, pair: Pair) -> float:
    sweep = pair.problem.sweep
    problem = forced_problem(model.system, model.load(pair.ratio / LOUDER), sweep)
    found = solved_from(problem, pair.high, pair.high.order)
    if found is None:
        return np.nan
    grown = problem.amplitude(found) / pair.problem.amplitude(pair.high)
    return float(np.log(grown) / np.log(LOUDER))


class _Cut:
    """Contacts that see a solution with many harmonics only up to those of another problem."""

    def __init__(self, model: Model, few: ForcedProblem, many: ForcedProblem, best: ForcedPoint) -> None:
        self.model, self.few, self.many, self.best = model, few, many, best
        self.order = few.high.harmonics[-1]
        self.operator = many.low.interface.gap_operator
        self.gaps: ComplexArray = best.coefficients @ self.operator.T
        self.whole = self._forces(self.gaps)
        self.balance = few.high
        self.kept = best.coefficients[: self.order + 1]
        at = self.balance.linearise(self.balance.unknowns(self.kept), best.omega)
        self.jacobian = at.dense_jac()

    def _forces(self, gaps: ComplexArray) -> ComplexArray:
        period = contact_forces(to_real(gaps), self.many.low.compiled, SAMPLES, self.best.omega)
        return to_complex(period.coefficients)

    def effect(self, cut: BoolArray) -> float:
        """Return the change of the amplitude, a fraction, where these gaps (n_contacts, 3) lose the harmonics above."""
        gaps = self.gaps.copy()
        gaps[self.order + 1 :, cut.reshape(-1)] = 0.0
        off = (self._forces(gaps) - self.whole)[: self.order + 1] @ self.operator
        b = self.balance
        right = b.unknowns(off) * (b.displacement_scale / b.force_scale)
        change = b.coefficients(-np.linalg.solve(self.jacobian, right))
        moved = self.few.amplitude_of(self.best.omega, self.kept + change)
        return moved / self.many.amplitude(self.best) - 1.0

    def spring(self, own: BoolArray) -> float:
        """Return the root mean square of the spring forces along t above the order, mean over these contacts, N."""
        stiffness = self.model.system.interface.stuck_stiffness().reshape(-1, 3)[own, 0]
        above = self.gaps.reshape(len(self.gaps), -1, 3)[self.order + 1 :, own, 0]
        rms: FloatArray = np.sqrt(np.sum(np.abs(above) ** 2, axis=0) / 2.0)
        return float(np.mean(stiffness * rms))

    def friction(self, own: BoolArray) -> float:
        """Return the mean friction coefficient of these contacts."""
        laws = np.array(self.model.system.interface.laws, dtype=object)[own]
        return float(np.mean([law.mu for law in laws]))


def used_friction(model: Model, problem: ForcedProblem, point: ForcedPoint) -> dict[str, float]:
    """Return the largest share of its friction limit that a point of each line reaches while it is closed."""
    force = signals(problem, point).force
    mu = np.array([law.mu for law in model.system.interface.laws])  # type: ignore[attr-defined]
    limit = mu[:, None] * -force[:, 2]
    closed = limit > 0.0
    share = np.where(closed, np.max(np.abs(force[:, :2]), axis=1) / np.where(closed, limit, 1.0), 0.0)
    return {name: float(share[own].max()) for name, own in _places(model.lines)}
