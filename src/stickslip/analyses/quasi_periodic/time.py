"""Time integration of motions with two frequencies."""

import numpy as np

from stickslip.analyses.quasi_periodic.problem import Question
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.quasi_periodic.in_time import course, statistics
from stickslip.response.quasi_periodic.problem import TorusMotion, TwoTones
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.transient import TimeStepping, integrate

STEPS = 256  # in a period of the faster frequency
SHORT = 40  # turns of the first phase that two loads may take to repeat themselves in a comparison
LONG = 20  # such repetitions at most


def compared(
    question: Question, problem: TwoTones, motion: TorusMotion, kind: str
) -> tuple[FloatArray, FloatArray, float] | None:
    """Return largest and smallest amplitude (outputs,) in time, and the difference from the balance (NaN for a self-excited tone); None for one tone."""
    if kind == "two loads":
        return _two_loads(question, problem, motion)
    if kind != "second tone":
        return None
    system = question.model.system
    contacts = system.interface
    start = start_from_harmonics(
        _folded(motion), motion.omegas[0] / _turns(motion)[0], contacts.gap_operator, contacts.laws
    )
    found = statistics(
        course(
            system.structure, contacts, question.first, motion.omegas[0], np.asarray(system.outputs), start, steps=STEPS
        )
    )
    return found.largest, found.least, np.nan


def _turns(motion: TorusMotion) -> tuple[int, int]:
    """Return how many turns of both phases nearly close."""
    ratio = motion.omegas[1] / motion.omegas[0]
    choices = [(p, max(1, round(ratio * p))) for p in range(1, SHORT + 1)]
    return min(choices, key=lambda c: (round(abs(ratio - c[1] / c[0]), 9), c[0]))


def _folded(motion: TorusMotion) -> ComplexArray:
    """Return the motion as harmonics of the frequency of which both are nearly multiples."""
    p, q = _turns(motion)
    orders = [j * p + k * q for j, k in motion.indices]
    out = np.zeros((max(abs(h) for h in orders) + 1, motion.coefficients.shape[1]), dtype=complex)
    for h, row in zip(orders, motion.coefficients, strict=True):
        out[abs(h)] += row if h >= 0 else row.conj()
    out[0] = out[0].real
    return out


def _two_loads(
    question: Question, problem: TwoTones, motion: TorusMotion
) -> tuple[FloatArray, FloatArray, float] | None:
    """Integrate loads in a ratio of whole numbers near that of the motion, and compare with the balance at that ratio."""
    p, q = _turns(motion)
    base = motion.omegas[0] / p
    if p == q:
        return None  # they beat more slowly than is marched
    near = problem.solve((motion.omegas[0], q * base), motion.x)
    if not near.converged:
        return None
    system, outputs = question.model.system, np.asarray(question.model.system.outputs)
    contacts = system.interface
    forces: dict[int, ComplexArray] = {}
    for turns, own in ((p, question.first), (q, question.second)):
        for h, f in own.harmonics.items():
            forces[turns * h] = forces.get(turns * h, np.zeros_like(f)) + f
    load = HarmonicLoad(question.first.static, forces)
    steps = STEPS * max(p, q)
    found = integrate(
        system.structure,
        contacts.gap_operator,
        contacts.laws,
        load,
        base,
        outputs,
        start_from_harmonics(_folded(near), base, contacts.gap_operator, contacts.laws),
        TimeStepping(steps_per_period=steps, max_periods=LONG, harmonics=max(load.harmonics), tolerance=1e-4),
        weights=contacts.weights,
    )
    times = 2.0 * np.pi / base * np.arange(1, steps + 1) / steps
    balance = near.at_times(outputs, times)
    vibrates = balance - balance.mean(axis=0)
    off = float(np.linalg.norm(found.outputs - balance) / np.linalg.norm(vibrates))
    each = found.outputs[: steps // p * p].reshape(p, -1, outputs.size)
    amplitude = 0.5 * np.ptp(each, axis=1)
    return amplitude.max(axis=0), amplitude.min(axis=0), off
