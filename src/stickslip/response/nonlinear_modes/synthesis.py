"""Nonlinear modal synthesis: forced response at any load level from one backbone, without further solutions.

At each amplitude of the backbone, the frequencies at which a load level sustains it are roots of a quartic polynomial
in Ω (see `sdof_oscillator`): one below and one above the resonance. There is no root where the amplitude needs a higher
level at every frequency. Peaks therefore lie where the smallest level that sustains the amplitude equals the load
level. Each stretch of the backbone below the load level is a curve: the first contains small amplitudes, the others are
detached.

Design curves follow from the same backbone: the peak over the load level, and over quantities that scale like it.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy.optimize

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator
from stickslip.response.parameter import Discretisation
from stickslip.response.system import System

POINTS = 161  # amplitudes of a curve, each with a frequency on either side of the resonance
REAL = 1e-6  # relative imaginary part of a real root: at a double root, rounding enters as a square root
DIFFERENCE = 1e-5  # step of the position for derivatives
PEAK_PLACE_RTOL = 1e-9  # tolerance of a peak's position
TWICE = 2.0
# share of the level for the first motion of a mode that begins linear; below, responses are proportional to their level
FAINT_LEVEL = 1e-3
CONTACT_FORCE_RTOL = 1e-9  # relative difference of contact forces that counts as none


@dataclass(frozen=True, eq=False)
class Synthesised:
    """Response at one level, curve by curve, all arrays (p,).

    Parameters
    ----------
    level
        Factor on the harmonic load.
    place
        Position on the backbone.
    omega
        Frequency, rad/s, in the order of the curve.
    amplitude
        Modal amplitude, kg^0.5 m.
    phase
        Phase of the motion relative to the backbone, rad.
    curve
        0: the curve from small amplitudes; 1 and so on: detached curves.
    stable
        Whether slow changes of amplitude and phase of this mode decay.
    resonances
        Points at which both sides of a curve meet.
    """

    level: float
    place: FloatArray
    omega: FloatArray
    amplitude: FloatArray
    phase: FloatArray
    curve: IntArray
    stable: BoolArray
    resonances: "tuple[Resonance, ...]" = ()

    @property
    def peaks(self) -> "tuple[Resonance, ...]":
        """Peaks, one for each curve."""
        return tuple(r for r in self.resonances if r.top)

    def alone(self, curve: int) -> "Synthesised":
        """Return one of the curves."""
        own = self.curve == curve
        return replace(
            self,
            place=self.place[own],
            omega=self.omega[own],
            amplitude=self.amplitude[own],
            phase=self.phase[own],
            curve=self.curve[own],
            stable=self.stable[own],
        )


@dataclass(frozen=True)
class Resonance:
    """Point at which both sides of a response curve meet: no smaller level sustains its amplitude.

    Parameters
    ----------
    level
        Factor on the harmonic load.
    place
        Position on the backbone.
    omega
        Frequency, rad/s.
    amplitude
        Modal amplitude, kg^0.5 m.
    top
        Whether it is a peak. Otherwise it is the smallest amplitude of a detached curve.
    """

    level: float
    place: float
    omega: float
    amplitude: float
    top: bool


@by_one_thread
def resonances(oscillator: ModalOscillator, level: float) -> list[Resonance]:
    """Return the resonances of a level in the order of the backbone.

    Parameters
    ----------
    oscillator
        Backbone and load.
    level
        Factor on the harmonic load, above zero.
    """
    table = oscillator.table
    excess = np.log(oscillator.needed_in_table / checked_level(level))
    found = []
    for i in np.flatnonzero(np.sign(excess[:-1]) * np.sign(excess[1:]) <= 0.0):
        if excess[i] == excess[i + 1] or excess[i + 1] == 0.0:
            continue

        def more(place: float) -> float:
            return float(np.log(oscillator.needed(np.array([place]))[0] / level))

        place = float(scipy.optimize.brentq(more, table[i], table[i + 1], xtol=PEAK_PLACE_RTOL))
        here = oscillator.at(np.array([place]))
        omega = float(here.resonance()[0])
        found.append(Resonance(level, place, omega, float(here.amplitude[0]), bool(excess[i] < 0.0)))
    return found


@by_one_thread
def synthesise(oscillator: ModalOscillator, level: float, points: int = POINTS) -> Synthesised:
    """Return the forced response at a level.

    Parameters
    ----------
    oscillator
        Backbone and load.
    level
        Factor on the harmonic load, above zero.
    points
        Number of amplitudes of a curve, each with a frequency on either side of the resonance.
    """
    found = resonances(oscillator, level)
    meets = [r.place for r in found]
    first, last = oscillator.ends
    parts: list[tuple[FloatArray, FloatArray]] = []
    for a, b in pairwise([first, *meets, last]):
        middle = oscillator.needed(np.array([0.5 * (a + b)]))[0]
        if b > a and middle <= level:
            parts.append(_curve(oscillator, level, a, b, points, a in meets, b in meets))
    place = np.concatenate([p for p, _ in parts]) if parts else np.zeros(0)
    omega = np.concatenate([w for _, w in parts]) if parts else np.zeros(0)
    curve = np.repeat(np.arange(len(parts)), [p.size for p, _ in parts])
    here = oscillator.at(place)
    phase = np.angle(here.force / here.stiffness(omega)) if parts else np.zeros(0)
    stable = _stable(oscillator, place, omega)
    return Synthesised(level, place, omega, here.amplitude, phase, curve.astype(np.int64), stable, tuple(found))


def at_resonance(oscillator: ModalOscillator, found: Resonance) -> Synthesised:
    """Return a resonance as a response of one point, stable where it is a peak."""
    place, omega = np.array([found.place]), np.array([found.omega])
    here = oscillator.at(place)
    phase = np.angle(here.force / here.stiffness(omega))
    no, stable = np.zeros(1, dtype=np.int64), np.array([found.top])
    return Synthesised(found.level, place, omega, here.amplitude, phase, no, stable, (found,))


@by_one_thread
def motions_at(oscillator: ModalOscillator, level: float, omega: float) -> FloatArray:
    """Return the positions of the steady motions at a frequency, rad/s, in the order of the backbone."""
    table = oscillator.table

    def more(place: FloatArray) -> FloatArray:
        here = oscillator.at(place)
        own = np.abs(here.stiffness(np.full(place.shape, omega))) * here.amplitude
        return np.asarray(np.log(own / (level * np.abs(here.force))))

    excess = more(table)
    at = np.flatnonzero(np.sign(excess[:-1]) * np.sign(excess[1:]) < 0.0)
    found = [scipy.optimize.brentq(lambda s: float(more(np.array([s]))[0]), table[i], table[i + 1]) for i in at]
    return np.array(found)


@by_one_thread
def free_motions(oscillator: ModalOscillator) -> FloatArray:
    """Return the positions of limit cycles: zeros of the damping, which aerodynamic forces may make negative."""
    table = oscillator.table
    ratio = oscillator.at(table).ratio
    at = np.flatnonzero(ratio[:-1] * ratio[1:] < 0.0)
    found = [
        scipy.optimize.brentq(lambda s: float(oscillator.at(np.array([s])).ratio[0]), table[i], table[i + 1])
        for i in at
    ]
    return np.array(found)


def _curve(
    oscillator: ModalOscillator,
    level: float,
    first: float,
    last: float,
    points: int,
    closes_below: bool,
    closes_above: bool,
) -> tuple[FloatArray, FloatArray]:
    """Return positions and frequencies of a stretch of the backbone: up below the resonance, then down above it."""
    # the frequency varies like a square root where both sides meet, so positions are dense there
    share = np.linspace(0.0, 1.0, points)
    if closes_below and closes_above:
        share = 0.5 - 0.5 * np.cos(np.pi * share)
    elif closes_above:
        share = 1.0 - (1.0 - share) ** 2
    elif closes_below:
        share = share**2
    place = first + (last - first) * share
    corners = oscillator.place[(oscillator.place > first) & (oscillator.place < last)]
    place = np.union1d(place, corners)
    below, above = _sides(oscillator, level, place)
    if closes_above:
        below[-1] = above[-1] = oscillator.at(place[-1:]).resonance()[0]
    if closes_below:
        below[0] = above[0] = oscillator.at(place[:1]).resonance()[0]
    low, high = np.isfinite(below), np.isfinite(above)
    upward, downward = (place[low], below[low]), (place[high][::-1], above[high][::-1])
    twice = 1 if closes_above and low[-1] and high[-1] else 0
    return (np.concatenate([upward[0], downward[0][twice:]]), np.concatenate([upward[1], downward[1][twice:]]))


def _sides(oscillator: ModalOscillator, level: float, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the frequencies below and above the resonance at which the level sustains the amplitudes.

    They are NaN where there is none.
    """
    here = oscillator.at(place)
    q = here.polynomial()
    q[:, 4] -= (level * np.abs(here.force) / here.amplitude) ** 2
    scale = here.omega  # of the roots
    companion = np.zeros((place.size, 4, 4))
    companion[:, 1:, :-1] = np.eye(3)
    companion[:, 0] = -q[:, 1:] / scale[:, None] ** np.arange(1, 5)
    roots = np.linalg.eigvals(companion) * scale[:, None]
    top = here.resonance()[:, None]
    real = (np.abs(roots.imag) < REAL * np.abs(roots)) & (roots.real > 0.0)
    below = np.max(np.where(real & (roots.real <= top), roots.real, -np.inf), axis=1)
    above = np.min(np.where(real & (roots.real > top), roots.real, np.inf), axis=1)
    return np.where(np.isfinite(below), below, np.nan), np.where(np.isfinite(above), above, np.nan)


def _stable(oscillator: ModalOscillator, place: FloatArray, omega: FloatArray) -> BoolArray:
    """Return whether slow changes of amplitude and phase decay at each point; see `passage` for their equation."""
    first, last = oscillator.ends
    low = np.clip(place - DIFFERENCE, first, last)
    high = np.clip(place + DIFFERENCE, first, last)
    ends = [oscillator.at(one) for one in (low, high)]
    here = oscillator.at(place)
    stiffness = here.stiffness(omega)
    logs = [np.log(e.stiffness(omega) * e.amplitude / e.force) for e in ends]
    turned = logs[1] - logs[0]
    turned = turned.real + 1j * np.angle(np.exp(1j * turned.imag))  # a logarithm may jump by 2πi
    grown = np.log(ends[1].amplitude / ends[0].amplitude)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_size = turned / grown
    rate = 1j * omega + here.viscous + here.eigenvalue
    # d/dt (ln a + iθ) = (level f exp(-iθ) / a - D) / rate
    by_amplitude, by_phase = -stiffness * by_size / rate, -1j * stiffness / rate
    trace = by_amplitude.real + by_phase.imag
    determinant = by_amplitude.real * by_phase.imag - by_amplitude.imag * by_phase.real
    return np.asarray((trace < 0.0) & (determinant > 0.0))


def checked_level(level: float) -> float:
    """Return a load level, after checking that it is above zero."""
    if not 0.0 < level < np.inf:
        raise input_error("modal_synthesis: levels", f"holds {level}", "Give factors above zero.")
    return level


@dataclass(frozen=True, eq=False)
class PeakCurve:
    """Resonances of a mode along its backbone, all arrays (p,).

    Parameters
    ----------
    place
        Positions on the backbone.
    level
        Load level of each resonance.
    omega
        Frequency, rad/s.
    amplitude
        Amplitude of the output in the first harmonic, m.
    top
        Whether the resonance is a peak: the amplitude grows with the level.
    """

    place: FloatArray
    level: FloatArray
    omega: FloatArray
    amplitude: FloatArray
    top: BoolArray


@by_one_thread
def peak_curve(oscillator: ModalOscillator, dof: int) -> PeakCurve:
    """Return the resonances of all levels from the backbone: each of its points is the resonance of one level."""
    after = oscillator.table >= oscillator.begins
    place, level = oscillator.table[after], oscillator.needed_in_table[after]
    here = oscillator.at(place)
    motion = oscillator.displacement(place, np.array([dof]))[:, 1, 0]
    return PeakCurve(place, level, here.resonance(), np.abs(motion), np.gradient(level) > 0.0)


def is_homogeneous(oscillator: ModalOscillator, how: Discretisation | None = None) -> bool:
    """Whether contact forces are proportional to displacements: laws without a preload, gap or limit of their own.

    The motion is then proportional to static and vibration loads together, and one backbone serves all static loads.
    The test uses the motion of largest amplitude.
    """
    backbone = oscillator.backbone
    balance = (how or Discretisation()).balance(backbone.system, oscillator.load, np.array([backbone.dof]))
    last = max(backbone.solutions, key=lambda p: p.modal_amplitude)
    motion = last.coefficients[: balance.order + 1, balance.linear.retained]
    one, two = (_forces(balance, factor * motion, last.omega) for factor in (1.0, TWICE))
    size = float(np.max(np.abs(two), initial=0.0))
    return bool(np.max(np.abs(two - TWICE * one), initial=0.0) <= CONTACT_FORCE_RTOL * size)


def _forces(balance: HarmonicBalance, motion: ComplexArray, omega: float) -> FloatArray:
    x = balance.unknowns(motion)
    return np.asarray(balance.forces(x, omega).coefficients)


def level_to_solve(own: ModalOscillator, level: float) -> float:
    """Return the level to solve: for a very small one a larger one without slip, to which the response is proportional."""
    faint = FAINT_LEVEL * float(own.needed(np.array([own.begins]))[0])
    if own.begins == 0.0 or level >= faint or len(resonances(own, faint)) > 1:
        return level
    return faint


def change_of_peak(coarser: ModalOscillator, found: Resonance) -> float:
    """Return the relative change of a peak with another oscillator, such as one with every second point of the mode."""
    other = [r.amplitude for r in resonances(coarser, found.level) if r.top]
    return min((abs(a / found.amplitude - 1.0) for a in other), default=np.inf)


def direct_response(
    system: System, load: HarmonicLoad, level: float, sweep: Sweep, dof: int
) -> tuple[FloatArray, FloatArray]:
    """Return frequencies, rad/s, and amplitudes of a coordinate, m, by harmonic balance; `level` is a factor on the harmonic loads."""
    raised = HarmonicLoad(load.static, {h: level * f for h, f in load.harmonics.items()})
    linear = forced_problem(system, raised, sweep).high.linear
    points = accepted_points(list(forced_response(system, raised, sweep)))
    amplitude = [abs(linear.recover(p.omega, p.coefficients)[1, dof]) if p.converged else np.nan for p in points]
    return np.array([p.omega for p in points]), np.array(amplitude)
