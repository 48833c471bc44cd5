"""Motions without a period, in time: envelope, statistics and spectrum, and the test whether they have settled.

A motion that never repeats has no amplitude, but once settled, its windows agree in largest amplitude, mean and root
mean square. The integration continues until they do, or until a budget of work is spent. Only the second half counts.
"""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import LinearSide
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.quasi_periodic.problem import TorusMotion, TwoTones
from stickslip.response.time.settling import overflowed
from stickslip.response.time.start import TransientStart, start_from_harmonics
from stickslip.response.time.stepping.marcher import FINE, prepared, with_enough_steps
from stickslip.response.time.transient import TimeStepping, integrate

KEPT = 32  # stored samples in a period
WINDOWS = 4  # compared windows of the second half
MIN_PERIODS, MAX_PERIODS = 128, 2048  # periods
ALIKE = 0.02  # relative spread between settled windows
WORK = 8e10  # floating-point operations of an integration, usually 20 s
PEAKS = 6  # reported peaks of a spectrum
FAINT = 1e-3  # smallest reported peak, over the largest
FEW_STEPS = 256  # in a period of the faster frequency, for comparison with a balance
SHORT = 40  # largest number of periods of the first load until both loads repeat, for a comparison
LONG = 20  # largest number of such repetitions


@dataclass(frozen=True, eq=False)
class Course:
    """Time history over many periods of a reference frequency, which may differ from the motion's frequency.

    Attributes
    ----------
    omega
        Reference frequency, rad/s.
    samples
        (periods, KEPT, outputs) displacements, m.
    largest, least
        (periods, outputs) largest and smallest displacement in each period, m.
    mean, square
        (periods, outputs) mean, and mean of the square, m and m².
    final
        State at the end.
    overflowed
        Whether the motion overflowed; the history ends before.
    seconds
        Computing time, s.
    steps, angle
        Steps in a period, and phase angle per step of the fastest contact that opens or closes, rad.
    """

    omega: float
    samples: FloatArray
    largest: FloatArray
    least: FloatArray
    mean: FloatArray
    square: FloatArray
    final: TransientStart
    overflowed: bool
    seconds: float
    steps: int = 0
    angle: float = 0.0

    @property
    def coarse(self) -> bool:
        """Whether the step is too long for the impacts of the stiffest opening contact."""
        return self.angle > FINE

    @property
    def periods(self) -> int:
        """Number of periods."""
        return len(self.mean)

    @property
    def amplitude(self) -> FloatArray:
        """(periods, outputs) half of peak to peak in each period, m."""
        return np.asarray(0.5 * (self.largest - self.least))


@dataclass(frozen=True, eq=False)
class Statistics:
    """Statistics of the second half of a time history.

    Attributes
    ----------
    largest, least
        (outputs,) largest and smallest amplitude of a period, half of peak to peak, m.
    mean, rms
        (outputs,) mean, and root mean square about it, m.
    extreme
        (outputs,) largest distance from the mean, m.
    spread
        Largest relative difference between windows of equal length, in largest amplitude and root mean square.
    hertz, peaks
        (outputs, PEAKS) frequencies (Hz) and amplitudes (m) of the largest peaks of the spectrum; NaN if there are
        fewer.
    periods
        Number of periods in the second half.
    """

    largest: FloatArray
    least: FloatArray
    mean: FloatArray
    rms: FloatArray
    extreme: FloatArray
    spread: float
    hertz: FloatArray
    peaks: FloatArray
    periods: int

    @property
    def settled(self) -> bool:
        """Whether the statistics have settled: all windows agree."""
        return self.spread <= ALIKE


@by_one_thread
def course(  # noqa: PLR0913
    structure: LinearSide,
    contacts: Interface,
    load: HarmonicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart,
    *,
    steps: int = 512,
    work: float = WORK,
    least: int = MIN_PERIODS,
    most: int = MAX_PERIODS,
) -> Course:
    """Integrate in time until the windows of the second half agree, or the work is spent.

    Parameters
    ----------
    structure, contacts, load
        One structure, or all sectors of a wheel.
    omega
        Frequency of the load, rad/s.
    outputs
        Reported dofs.
    start
        State at t = 0.
    steps
        Smallest number of steps in a period. It is doubled while opening contacts are too stiff for the step.
    work
        Budget of floating-point operations as counted by `step_work`, independent of the computer.
    least, most
        Smallest and largest number of periods.
    """
    steps = -(-steps // KEPT) * KEPT
    marcher = with_enough_steps(
        lambda n: prepared(structure, contacts.gap_operator, contacts.laws, load, omega, n, contacts.weights),
        start,
        steps,
    )
    steps, state, record = marcher.steps, marcher.begun(start), marcher.record()
    rows = marcher.modes.basis[outputs].T
    found: list[tuple[FloatArray, ...]] = []
    began, lost, until, angle = perf_counter(), False, least, 0.0
    while len(found) < most and len(found) * marcher.work < work:
        lost = marcher.march(state, record) < 0 or overflowed(state.x, record.motion)
        if lost:
            break
        motion, angle = record.motion @ rows, max(angle, marcher.turn(record))
        found.append(
            (
                motion[steps // KEPT - 1 :: steps // KEPT],
                motion.max(axis=0),
                motion.min(axis=0),
                motion.mean(axis=0),
                np.mean(motion**2, axis=0),
            )
        )
        if len(found) == until:
            if statistics(_course(omega, found, marcher.end(state), False, 0.0)).settled:
                break
            until = min(2 * until, most)
    end = start if lost else marcher.end(state)
    made = _course(omega, found, end, lost, perf_counter() - began, rows.shape[1])
    return replace(made, steps=steps, angle=angle)


def _course(
    omega: float, found: list[tuple[FloatArray, ...]], final: TransientStart, lost: bool, seconds: float, width: int = 0
) -> Course:
    if not found:
        none = np.zeros((0, width))
        return Course(omega, np.zeros((0, KEPT, width)), none, none, none, none, final, lost, seconds)
    samples, largest, least, mean, square = (np.array(own) for own in zip(*found, strict=True))
    return Course(omega, samples, largest, least, mean, square, final, lost, seconds)


def statistics(motion: Course) -> Statistics:
    """Return statistics of the second half of a time history; NaN with too few periods to compare."""
    outputs = motion.mean.shape[1]
    half = motion.periods // 2
    half -= half % WINDOWS
    if half < WINDOWS or motion.overflowed:
        nothing = np.full(outputs, np.nan)
        none = np.full((outputs, PEAKS), np.nan)
        return Statistics(nothing, nothing, nothing, nothing, nothing, np.inf, none, none, half)
    amplitude, largest, least = (a[-half:] for a in (motion.amplitude, motion.largest, motion.least))
    mean = motion.mean[-half:].mean(axis=0)
    square = motion.square[-half:].mean(axis=0)
    rms = np.sqrt(np.maximum(square - mean**2, 0.0))
    windows = amplitude.reshape(WINDOWS, -1, outputs).max(axis=1)
    own = motion.square[-half:].reshape(WINDOWS, -1, outputs).mean(axis=1)
    sizes = np.sqrt(np.maximum(own - mean**2, 0.0))
    spread = max(_spread(windows), _spread(sizes))
    hertz, peaks = _spectrum(motion.samples[-half:].reshape(-1, outputs) - mean, motion.omega)
    return Statistics(
        amplitude.max(axis=0),
        amplitude.min(axis=0),
        mean,
        rms,
        np.maximum(largest.max(axis=0) - mean, mean - least.min(axis=0)),
        spread,
        hertz,
        peaks,
        half,
    )


def _spread(windows: FloatArray) -> float:
    """Return the largest difference between windows (WINDOWS, outputs), relative to the largest value of an output."""
    size = np.max(np.abs(windows), axis=0)
    moving = size > FAINT * float(np.max(size, initial=0.0))
    return float(np.max(np.ptp(windows, axis=0)[moving] / size[moving], initial=0.0))


def _spectrum(samples: FloatArray, omega: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies (Hz) and amplitudes of the largest spectral peaks of samples (n, outputs).

    A period has `KEPT` samples.
    """
    n, outputs = samples.shape
    window = np.hanning(n)
    lines = np.abs(np.fft.rfft(samples * window[:, None], axis=0)) * (2.0 / window.sum())
    hertz, peaks = (np.full((outputs, PEAKS), np.nan) for _ in range(2))
    step = omega / (2.0 * np.pi) * KEPT / n
    for output in range(outputs):
        own = lines[:, output]
        tops = np.flatnonzero((own[1:-1] >= own[:-2]) & (own[1:-1] > own[2:])) + 1
        tops = tops[np.argsort(own[tops])[::-1][:PEAKS]]
        tops = tops[own[tops] > FAINT * own.max(initial=0.0)]
        for place, top in enumerate(tops):
            a, b, c = np.log(np.maximum(own[top - 1 : top + 2], 1e-300))
            shift = 0.5 * (a - c) / (a - 2.0 * b + c) if a - 2.0 * b + c < 0.0 else 0.0
            hertz[output, place] = (top + shift) * step
            peaks[output, place] = float(np.exp(b - 0.25 * (a - c) * shift))
    return hertz, peaks


def second_tone_in_time(problem: TwoTones, motion: TorusMotion, load: HarmonicLoad) -> Statistics:
    """Return the statistics of a motion with a self-excited second tone.

    Time integration starts from the balance's solution, under the first load.
    """
    system, omega = problem.system, motion.omegas[0]
    contacts = system.interface
    start = start_from_harmonics(_folded(motion), omega / _turns(motion)[0], contacts.gap_operator, contacts.laws)
    outputs = np.asarray(system.outputs)
    return statistics(course(system.structure, contacts, load, omega, outputs, start, steps=FEW_STEPS))


def _turns(motion: TorusMotion) -> tuple[int, int]:
    """Return the numbers of periods of both frequencies after which the motion nearly repeats."""
    ratio = motion.omegas[1] / motion.omegas[0]
    choices = [(p, max(1, round(ratio * p))) for p in range(1, SHORT + 1)]
    return min(choices, key=lambda c: (round(abs(ratio - c[1] / c[0]), 9), c[0]))


def _folded(motion: TorusMotion) -> ComplexArray:
    """Return the motion as harmonics of the near-common divisor of both frequencies."""
    p, q = _turns(motion)
    orders = [j * p + k * q for j, k in motion.indices]
    out = np.zeros((max(abs(h) for h in orders) + 1, motion.coefficients.shape[1]), dtype=complex)
    for h, row in zip(orders, motion.coefficients, strict=True):
        out[abs(h)] += row if h >= 0 else row.conj()
    out[0] = out[0].real
    return out


def two_loads_in_time(
    problem: TwoTones, motion: TorusMotion, first: HarmonicLoad, second: HarmonicLoad
) -> tuple[FloatArray, FloatArray, float] | None:
    """Integrate under loads with a rational frequency ratio near the motion's.

    The result is compared with the balance at this ratio.

    Parameters
    ----------
    problem, motion
        Problem and its motion.
    first, second
        Loads of the first and of the second frequency.

    Returns
    -------
    tuple or None
        Largest and smallest amplitude (outputs,) in time, m, and the root-mean-square difference from the balance,
        relative to the vibration. None for loads that beat too slowly, or without a solution at the ratio.
    """
    p, q = _turns(motion)
    base = motion.omegas[0] / p
    if p == q:
        return None  # the beat is longer than the integration
    near = problem.solve((motion.omegas[0], q * base), motion.x)
    if not near.converged:
        return None
    system, outputs = problem.system, np.asarray(problem.system.outputs)
    contacts = system.interface
    forces: dict[int, ComplexArray] = {}
    for turns, own in ((p, first), (q, second)):
        for h, f in own.harmonics.items():
            forces[turns * h] = forces.get(turns * h, np.zeros_like(f)) + f
    load = HarmonicLoad(first.static, forces)
    steps = FEW_STEPS * max(p, q)
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
