"""Time-step error of a periodic motion: corrections towards twice and four times as many steps."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.response.time.period_map import Derivative, Image, PeriodMap
from stickslip.response.time.settling import period_harmonics
from stickslip.response.time.stepping.marcher import Marcher
from stickslip.response.time.stepping.step_tangent import tangent_operators

COARSE = 0.01  # of the largest harmonic: a step that errs by more has not found the motion
NEUTRAL_DISTANCE = 0.05  # distance of the growth from 1 below which its error is looked for
JUMP = 1.5  # times the largest friction force: a change within a step that passes over stick
TURNS = 2.0  # the same of first order: of the derivative, which feels where in a step a slider turns
RICHARDSON = 4.0 / 3.0  # error of a method of second order over its change when the step is halved
ERRATIC = 10.0  # the most: where the second of two changes is as large as the first nothing says that more steps lead anywhere


@dataclass(frozen=True, eq=False)
class StepErrors:
    """Estimates of what the step makes wrong.

    Parameters
    ----------
    motion
        Of the harmonics of the outputs, relative to the largest; infinite where more steps overflow.
    growth
        Of the largest modulus of the multipliers, where that is close to 1 or a contact opens or closes; infinite where a slider
        turns within a step, which no derivative sees; 0 elsewhere.
    """

    motion: float
    growth: float


def step_errors(
    mapping: PeriodMap,
    finer: Callable[[int], Marcher],
    state: FloatArray,
    found: Derivative,
    outputs: IntArray,
    order: int,
) -> StepErrors:
    """Compare a periodic motion with twice as many steps; where a contact opens or closes with four times as many, too.

    Parameters
    ----------
    mapping, state
        The period map and its fixed point.
    finer
        Gives the same structure with so many times as many steps.
    found
        Derivative of the map there.
    outputs, order
        What is compared, and up to which harmonic.
    """
    image, growth = mapping.period(state), mapping.floquet(found).growth
    known = harmonics(mapping, state, image, outputs, order)[1:]
    fine, there = _corrected(mapping, finer(2), state, found)
    moved = fine.period(there)
    if not moved.failures >= 0:
        return StepErrors(np.inf, np.inf)
    size, jumps = float(np.max(np.abs(known), initial=0.0)), _jumps(image)
    change = _change(known, harmonics(fine, there, moved, outputs, order)[1:], size)
    opens = _opens(image) or _opens(moved)
    if RICHARDSON * change > COARSE or not opens:
        error = np.inf if jumps or opens else 0.0
        if error == 0.0 and abs(growth - 1.0) < NEUTRAL_DISTANCE:
            error = TURNS * abs(fine.floquet(fine.derivative(there)).growth - growth)
        return StepErrors(RICHARDSON * change, error)
    motions, growths = [known], [growth]
    for marcher in (fine.marcher, finer(4)):
        fine, there = _corrected(mapping, marcher, state, found)
        found = fine.derivative(there)
        if not found.image.failures >= 0:
            return StepErrors(np.inf, np.inf)
        state = there + found.inverse() @ (found.image.state - there)
        motions.append(harmonics(fine, state, fine.period(state), outputs, order)[1:])
        growths.append(fine.floquet(found).growth)
    first, second = (_change(a, b, size) for a, b in pairwise(motions))
    motion = _scattered(max(first, change), second, RICHARDSON)
    error = _scattered(abs(growths[1] - growth), abs(growths[2] - growths[1]), TURNS)
    return StepErrors(motion, np.inf if jumps else error)


def _change(one: ComplexArray, other: ComplexArray, size: float) -> float:
    return float(np.max(np.abs(other - one), initial=0.0)) / size if size > 0.0 else 0.0


def _corrected(
    mapping: PeriodMap, marcher: Marcher, state: FloatArray, found: Derivative
) -> tuple[PeriodMap, FloatArray]:
    """Return the map with finer steps, and a state corrected towards its fixed point with the derivative at hand."""
    fine = replace(mapping, marcher=marcher, linear=tangent_operators(marcher))
    return fine, state + found.inverse() @ (fine.image(state).state - state)


def _scattered(first: float, second: float, least: float) -> float:
    """Return the error of the first of three values by their two changes, of which chance has its part; infinite if they are lost.

    Changes that go on falling as these two did add up to a geometric series; `least` bounds its sum over the first change.
    """
    if not np.isfinite(first + second):
        return np.inf
    falls = first - second > first / ERRATIC
    return max(least, first / (first - second)) * first if falls else ERRATIC * max(first, second)


def _opens(image: Image) -> bool:
    """Return whether a contact is open for a part of the period: it presses with nothing there."""
    is_open = image.record.force[:, :, 2] == 0.0
    return bool(np.any(np.any(is_open, axis=0) & ~np.all(is_open, axis=0)))


def _jumps(image: Image) -> bool:
    """Return whether a friction force changes sides from one step to the next: from its largest value to the opposite one."""
    force = image.record.force[:, :, :2]
    largest = np.max(np.abs(force), axis=0, initial=0.0)
    return bool(np.any(np.abs(np.diff(force, axis=0)) > JUMP * largest[None]))


def harmonics(mapping: PeriodMap, state: FloatArray, image: Image, outputs: IntArray, order: int) -> ComplexArray:
    """Return the (order + 1, n_outputs) harmonics of a period from a state, m."""
    marcher = mapping.marcher
    began = mapping.start_of(state).x[: marcher.n]
    modal = period_harmonics(began, image.record.motion, order)
    return np.asarray(modal @ marcher.modes.basis[outputs].T)
