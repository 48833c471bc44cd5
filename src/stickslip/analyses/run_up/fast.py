"""Fast run-ups along the engine orders, compared with the steady peaks."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from stickslip.analyses.run_up.problem import Along, Question, RunUpPoint
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import SingularError
from stickslip.response.rotating.envelope import EnvelopePoint, SweepInTime, envelope
from stickslip.study.analysis import Notes
from stickslip.study.store.progress import LOG, advance
from stickslip.units import RPM

NOTE = "fast"
MAX_FAST_HARMONIC = 7  # harmonic beyond which a fast run-up does not go, but for those that loads drive
NO_SOLUTION = (SingularError, FloatingPointError, np.linalg.LinAlgError)
JUDGED_PEAK_SHARE = 0.5  # share of the peak above which the second derivative is held against the first


def fast_run_ups(question: Question, points: Sequence[RunUpPoint], notes: Notes) -> None:
    """Compute all fast run-ups missing in the notes, and store each when finished."""
    jobs = [(along, rate) for along in question.lines for rate in question.rates]
    for i, (along, rate) in enumerate(jobs):
        name = name_of(along.order, rate)
        if notes.get(name) is None:
            order = _order(along, points)
            try:
                told = _swept(along, rate, order)
            except NO_SOLUTION as error:  # the steady motions count
                LOG.info(f"engine order {along.order} at {rate:g} rpm/s: {error}")
                told = _nothing(along, order)
            notes.put(name, told)
        advance(0.95 + 0.05 * (i + 1) / len(jobs), f"engine order {along.order} at {rate:g} rpm/s")


def name_of(order: int, rate: float) -> str:
    """Return the name of the note of a fast run-up."""
    return f"{NOTE}.{order}.{rate!r}"


def _order(along: Along, points: Sequence[RunUpPoint]) -> int:
    """Return the highest harmonic that the steady points of an engine order keep, and the load drives."""
    own = [p.order for p in points if p.engine_order == along.order and p.converged]
    return max(min(max(own, default=1), MAX_FAST_HARMONIC), *along.problem.driven)


def _swept(along: Along, rate: float, order: int) -> dict[str, Any]:
    """Return the note of one fast run-up."""
    sweep = along.sweep
    how = SweepInTime(
        ends=sweep.ends,
        rate=along.order * RPM * rate,
        harmonics=order,
        samples=max(sweep.samples, 8 * order),
        evaluator=sweep.evaluator,
    )
    driven = list(along.problem.driven)
    outputs = along.model.system.outputs
    followed = list(_kept(envelope(along.model.system, along.model.load, how), driven, outputs))
    speed = np.array([omega for omega, _, _ in followed]) / along.order / RPM
    moving = np.array([amplitude for _, amplitude, _ in followed])
    amplitude = np.linalg.norm(moving, axis=1)
    finished = bool(followed[-1][2])
    if not finished:
        LOG.info(f"engine order {along.order} at {rate:g} rpm/s: ended at {speed[-1]:.1f} rpm")
    time = np.abs(speed - speed[0]) / rate
    share = neglected(time, moving[:, 0], driven[0] * along.order * RPM * speed)
    return {
        "speed_rpm": speed,
        "amplitude": amplitude,
        "harmonic": order,
        "finished": int(finished),
        "neglected": share,
    }


def _nothing(along: Along, order: int) -> dict[str, Any]:
    """Return the note of a fast run-up that could not begin."""
    return {
        "speed_rpm": np.array([along.sweep.ends[0] / along.order / RPM]),
        "amplitude": np.array([np.nan]),
        "harmonic": order,
        "finished": 0,
        "neglected": float("nan"),
    }


def _kept(
    points: Iterator[EnvelopePoint], driven: list[int], outputs: Any
) -> Iterator[tuple[float, ComplexArray, bool]]:
    """Yield frequency, driven harmonics (d,) of all outputs, and whether a step was solved; nothing else is kept of a step."""
    for point in points:
        yield point.omega, point.coefficients[driven][:, outputs[0]], point.converged


def neglected(time: FloatArray, amplitude: ComplexArray, omega: FloatArray) -> float:
    """Return the ratio of the second derivative of an amplitude to 2ω times the first, around the largest amplitude.

    Parameters
    ----------
    time, omega
        (n,) time, and frequency of the harmonic, s and rad/s.
    amplitude
        (n,) complex.
    """
    if time.size < 3:
        return float("nan")
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    slopes = np.diff(amplitude) / np.diff(time)
    first = (before * slopes[1:] + after * slopes[:-1]) / (before + after)
    second = 2 * (slopes[1:] - slopes[:-1]) / (before + after)
    size = np.abs(amplitude[1:-1])
    near = size > JUDGED_PEAK_SHARE * size.max()
    weight = (before + after)[near]  # so that many short steps do not count more
    there = np.sum(weight * np.abs(second[near]) ** 2)
    here = np.sum(weight * np.abs(2 * omega[1:-1][near] * first[near]) ** 2)
    return float(np.sqrt(there / here)) if here > 0.0 else float("nan")
