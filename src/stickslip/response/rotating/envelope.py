"""Fast run-up: slowly varying amplitudes of a vibration with swept frequency, on a wheel a pseudo-travelling wave.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, end of appendix 1.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray, as_array
from stickslip.contact.compiled import Evaluator
from stickslip.contact.interface import add_contact_jacobian
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance, Linearisation, harmonic_balance
from stickslip.harmonic.engine_order_line import TurningStiffness
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics, harmonics_of, to_complex, to_real
from stickslip.harmonic.structured import real_matrix
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton

FIRST, SMALLEST, LARGEST = 1e-4, 1e-9, 1 / 150  # steps over the duration of the sweep
# error of a step over its difference from the prediction: 2/11 with equal steps
SHARE = 0.2
JUDGED_PEAK_SHARE = 0.5  # share of the peak, above which the second derivative is compared with the first
GROWTH, SHRINK, SAFE = 2.0, 0.3, 0.85


@dataclass(frozen=True, eq=False)
class EnvelopePoint:
    """State at one time of a sweep.

    Attributes
    ----------
    time
        Time since the beginning of the sweep, s.
    omega
        Instantaneous frequency, rad/s.
    coefficients
        (H+1, n) complex amplitudes of all coordinates, m: ``u(t) = Re Σ Q_h(t) exp(i h φ(t))`` with ``dφ/dt = omega``.
    converged
        Whether the step was solved; a failed step ends the sweep.
    """

    time: float
    omega: float
    coefficients: ComplexArray
    converged: bool = True


@dataclass(frozen=True, kw_only=True)
class SweepInTime:
    """Options of a sweep in time.

    Parameters
    ----------
    ends
        First and last frequency, rad/s; the last may be the lower one.
    rate
        Sweep rate, above zero, rad/s².
    harmonics
        Highest harmonic, or the kept harmonics.
    samples, evaluator
        As in `Sweep`.
    tolerance
        Error of a step, relative to the largest amplitude so far.
    """

    ends: tuple[float, float]
    rate: float
    harmonics: int | Harmonics = 1
    samples: int = 256
    evaluator: Evaluator = "events"
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        if not (self.rate > 0.0 and self.tolerance > 0.0 and min(self.ends) > 0.0):
            raise input_error(
                "SweepInTime",
                f"has rate {self.rate:g}, tolerance {self.tolerance:g}, frequencies {self.ends}",
                "All are above zero; the direction is that of the ends.",
            )

    @property
    def seconds(self) -> float:
        """Duration of the sweep, s."""
        return abs(self.ends[1] - self.ends[0]) / self.rate

    def omega(self, time: float) -> float:
        """Return the frequency after a time, rad/s."""
        return self.ends[0] + self.signed_rate * time

    @property
    def signed_rate(self) -> float:
        """Sweep rate, rad/s²; negative for falling frequencies."""
        return float(np.copysign(self.rate, self.ends[1] - self.ends[0]))


def envelope(system: System, load: HarmonicLoad, sweep: SweepInTime) -> Iterator[EnvelopePoint]:
    """Compute the amplitudes of all harmonics while the frequency is swept at a constant rate.

    Each harmonic above the static one obeys

        (2ihω M + C) dQ_h/dt + (Z_h(ω) + i h dω/dt M) Q_h + F_c,h(Q) = F_h ,

    the equation of motion without the second derivative of the amplitude, which would add spurious motions
    ``exp(-2iωt)`` driven by the contact forces. The static term follows without delay. Contact forces are computed for
    the periodic motion with the instantaneous amplitudes. Steps use the second-order backward difference formula, with
    a length controlled by the difference between prediction and solution.

    Parameters
    ----------
    system
        Structure or wheel. On an engine-order line, matrices and static load follow the instantaneous speed.
    load
        Static and harmonic forces, N.
    sweep
        Range, rate, harmonics.

    Yields
    ------
    EnvelopePoint
        The steady motion at the first frequency, then one point for each step. If a step fails, the last point is not
        converged.

    Raises
    ------
    InputError
        If contacts are rigid, or the load drives a harmonic that is not kept.
    """
    if system.interface.rigid:
        raise input_error("envelope", "needs contact forces that follow from gaps", "Give the contacts a stiffness.")
    flow = _flow(system, load, sweep)
    omega = sweep.ends[0]
    balance = flow.at(omega)
    began = without_branch(system, balance, Newton(), omega)
    motion = balance.linear.recover(omega, balance.coefficients(began.x))
    points = [_Step(0.0, motion)]
    yield EnvelopePoint(0.0, omega, motion, began.status.converged)
    step = FIRST * sweep.seconds if began.status.converged else 0.0
    largest = max(flow.size(motion), 1e-300)
    while step > 0.0 and points[-1].time < sweep.seconds * (1 - 1e-12):
        step = min(step, sweep.seconds - points[-1].time, LARGEST * sweep.seconds)
        new = flow.step(points, step)
        off = np.inf if new is None else SHARE * flow.size(new - _ahead(points, step)) / largest
        if new is not None and off <= sweep.tolerance:
            time = points[-1].time + step
            points = [*points[-2:], _Step(time, new)]
            largest = max(largest, flow.size(new))
            yield EnvelopePoint(time, sweep.omega(time), new)
        step *= _longer(off / sweep.tolerance)
        if step < SMALLEST * sweep.seconds:
            yield EnvelopePoint(points[-1].time, sweep.omega(points[-1].time), points[-1].q, False)
            return


def _longer(error: float) -> float:
    """Return the factor on the step length.

    `error` is the error of the step over the allowed one, infinite for a failed step.
    """
    if np.isinf(error):
        return SHRINK
    share = SAFE * max(error, 1e-12) ** (-1 / 3)
    return float(np.clip(share, SHRINK, GROWTH))


@dataclass(frozen=True, eq=False)
class _Step:
    """Amplitudes (H+1, n) of all coordinates at a time."""

    time: float
    q: ComplexArray


@dataclass(frozen=True, eq=False)
class _Flow:
    """Slow flow: each step solves a balance on the retained coordinates, with the others condensed."""

    system: System
    balance: HarmonicBalance
    sweep: SweepInTime
    moving: IntArray  # coordinates that are displacements

    def at(self, omega: float) -> HarmonicBalance:
        """Return the balance at a frequency; on an engine-order line with the matrices of its speed."""
        linear = self.balance.linear
        if isinstance(linear, TurningStiffness):
            return replace(self.balance, linear=linear.at(omega))
        return self.balance

    def size(self, q: ComplexArray) -> float:
        """Return the norm of the vibration, m, without the static part."""
        return float(np.linalg.norm(q[1:, self.moving]))

    def step(self, points: list[_Step], step: float) -> ComplexArray | None:
        """Return the amplitudes after a step; None without convergence."""
        omega = self.sweep.omega(points[-1].time + step)
        now, known = _derivative(points, step)
        small = self._condensed(omega, now, known)
        ahead = self.balance.unknowns(_ahead(points, step)[:, self.balance.linear.retained])
        found = newton(lambda x: self._linearised(small, x, omega), ahead, Newton())
        if not found.status.converged:
            return None
        return small.spread(self.balance.coefficients(found.x))

    def _condensed(self, omega: float, now: float, known: ComplexArray) -> "_Condensed":
        """Return the equations of a step on the retained coordinates.

        The derivative of the amplitudes is ``now q + known``.
        """
        side = self.system.structure.at_frequency(omega)
        force = self.balance.linear.load_at(omega).coefficients(self.balance.order)
        rate, parts = self.sweep.signed_rate, []
        for h in range(self.balance.order + 1):
            structure = side.of_harmonic(h)
            stiffness = as_array(structure.stiffness)
            if h == 0:
                parts.append(_Condensed.one(stiffness.real + 0j, force[0], self.balance.linear.retained))
                continue
            mass, damping = as_array(structure.mass), as_array(structure.damping)
            if structure.loss is not None:
                stiffness = stiffness + 1j * as_array(structure.loss)
            s = 1j * h * omega
            slow = 2 * s * mass + damping
            matrix = stiffness + s * damping + s**2 * mass + 1j * h * rate * mass + now * slow
            load = force[h] - slow @ known[h]
            parts.append(_Condensed.one(matrix, load, self.balance.linear.retained))
        return _Condensed.of(parts)

    def _linearised(self, small: "_Condensed", x: FloatArray, omega: float) -> Linearisation:
        balance = self.balance
        harmonics, n = list(balance.harmonics), balance.linear.n
        factor = balance.displacement_scale / balance.force_scale
        period = balance.forces(x, omega)
        jac = factor * real_matrix(small.stiffness[harmonics])
        add_contact_jacobian(period.blocks, balance.rows.columns, balance.rows.values, n, factor, jac)
        q = to_complex(x.reshape(balance.n_rows, n)) * balance.displacement_scale
        force = np.einsum("hij,hj->hi", small.stiffness[harmonics], q) - small.load[harmonics]
        rows = to_real(force)
        balance.rows.add_forces(period.coefficients, rows)
        return Linearisation(rows.reshape(-1) / balance.force_scale, jac, np.zeros(x.size), 0.0)


@dataclass(frozen=True, eq=False)
class _Condensed:
    """Equations ``S q = g`` of the retained coordinates of harmonics 0 to H.

    The other coordinates are ``own - through q``.
    """

    stiffness: ComplexArray  # (H+1, r, r)
    load: ComplexArray  # (H+1, r)
    own: ComplexArray  # (H+1, i)
    through: ComplexArray  # (H+1, i, r)
    near: IntArray
    far: IntArray

    @classmethod
    def one(cls, matrix: ComplexArray, load: ComplexArray, near: IntArray) -> "_Condensed":
        """Condense one harmonic."""
        far = np.setdiff1d(np.arange(len(load)), near)
        inside, across = matrix[np.ix_(far, far)], matrix[np.ix_(far, near)]
        solved = np.linalg.solve(inside, np.column_stack([across, load[far]]))
        back = matrix[np.ix_(near, far)] @ solved
        return cls(
            matrix[np.ix_(near, near)] - back[:, :-1],
            load[near] - back[:, -1],
            solved[:, -1],
            solved[:, :-1],
            near,
            far,
        )

    @classmethod
    def of(cls, parts: list["_Condensed"]) -> "_Condensed":
        """Stack the harmonics."""
        return cls(
            np.array([part.stiffness for part in parts]),
            np.array([part.load for part in parts]),
            np.array([part.own for part in parts]),
            np.array([part.through for part in parts]),
            parts[0].near,
            parts[0].far,
        )

    def spread(self, q: ComplexArray) -> ComplexArray:
        """Return the amplitudes (H+1, n) of all coordinates from the retained ones."""
        out = np.empty((len(q), self.near.size + self.far.size), dtype=complex)
        out[:, self.near] = q
        out[:, self.far] = self.own - np.einsum("hij,hj->hi", self.through, q)
        return out


def _flow(system: System, load: HarmonicLoad, sweep: SweepInTime) -> _Flow:
    harmonics = harmonics_of(sweep.harmonics)
    linear = system.condensed(load, harmonics[-1])
    balance = harmonic_balance(linear, system.interface, harmonics, sweep.samples, sweep.evaluator, "dense")
    moving = np.setdiff1d(np.arange(system.structure.n), system.structure.multipliers)
    return _Flow(system, balance, sweep, moving)


def _derivative(points: list[_Step], step: float) -> tuple[float, ComplexArray]:
    """Return the second-order backward difference of amplitudes.

    It is the factor of the new ones, and the sum of the known terms.
    """
    last = points[-1]
    if len(points) < 2:
        return 1.0 / step, -last.q / step
    ratio = step / (last.time - points[-2].time)
    rest = -(1 + ratio) * last.q + ratio**2 / (1 + ratio) * points[-2].q
    return (1 + 2 * ratio) / ((1 + ratio) * step), np.asarray(rest / step)


def _ahead(points: list[_Step], step: float) -> ComplexArray:
    """Extrapolate the polynomial through the last points, at most three, by a step."""
    time = points[-1].time + step
    found = np.zeros_like(points[-1].q)
    for one in points:
        others = [(time - o.time) / (one.time - o.time) for o in points if o is not one]
        found += np.prod(others) * one.q
    return found


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
    weight = (before + after)[near]  # many short steps must not count more
    there = np.sum(weight * np.abs(second[near]) ** 2)
    here = np.sum(weight * np.abs(2 * omega[1:-1][near] * first[near]) ** 2)
    return float(np.sqrt(there / here)) if here > 0.0 else float("nan")
