"""Self-excited vibration in time: motion from near a limit cycle, and the dominant wave of the whole wheel."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import LinearSide
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.system import System
from stickslip.response.time.sectors import whole_wheel
from stickslip.response.time.settling import last_third, overflowed, period_harmonics, remaining_change
from stickslip.response.time.start import TransientStart
from stickslip.response.time.stepping.marcher import prepared

KEPT = 32  # stored samples in a period
LAST = 4  # last periods, whose phases give the frequency
WINDOW = 16  # periods of a window in which waves are separated
SMALL = 1e-2  # amplitude of a wave over the largest, below which it has decayed
STEADY = 1e-2  # relative change of an amplitude over the last third, below which it is steady

UNSETTLED = "not settled yet"  # beginning of sentences after too few periods

Outcome = Literal["one wave", "several waves", "decays", "grows", "not settled"]


@dataclass(frozen=True, eq=False)
class Marched:
    """Motion integrated over many periods of a reference frequency.

    Parameters
    ----------
    omega
        Reference frequency, rad/s.
    first
        (periods, n_outputs) complex amplitudes of the first harmonic in each period, m.
    samples
        (periods · `KEPT`, n_outputs) displacements, m.
    final
        State at the end.
    overflowed
        Whether the motion overflowed; the stored periods end before.
    """

    omega: float
    first: ComplexArray
    samples: FloatArray
    final: TransientStart
    overflowed: bool

    @property
    def amplitude(self) -> FloatArray:
        """(n_outputs,) amplitude of the last period, m."""
        return np.asarray(np.abs(self.first[-1]))

    @property
    def frequency(self) -> FloatArray:
        """(n_outputs,) frequency at the end, rad/s, from the phase gain of the last periods."""
        if len(self.first) < 2:
            return np.full(self.first.shape[1], np.nan)
        last = self.first[-min(len(self.first), LAST) :]
        gained = np.angle(np.sum(np.conj(last[:-1]) * last[1:], axis=0))
        return np.asarray(self.omega * (1.0 + gained / (2.0 * np.pi)))


@by_one_thread
def march_periods(  # noqa: PLR0913
    structure: LinearSide,
    contacts: Interface,
    load: HarmonicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart,
    periods: int,
    steps: int = 1024,
    *,
    settles: float = 0.0,
) -> Marched:
    """Integrate a structure with contacts over periods of a reference frequency.

    The motion may have another frequency.

    Parameters
    ----------
    structure, contacts, load
        One structure, or all sectors of a wheel.
    omega
        Reference frequency, rad/s.
    outputs
        Reported dofs.
    start
        State at t = 0.
    periods
        Largest number of periods.
    steps
        Steps in a period.
    settles
        Estimated remaining relative change of the largest amplitude at which the integration ends early; 0: never.
    """
    steps = -(-steps // KEPT) * KEPT
    marcher = prepared(structure, contacts.gap_operator, contacts.laws, load, omega, steps, contacts.weights)
    state, record = marcher.begun(start), marcher.record()
    rows = marcher.modes.basis[outputs].T
    first: list[ComplexArray] = []
    samples: list[FloatArray] = []
    changes: list[float] = []
    lost = False
    for _ in range(periods):
        began = state.x[: marcher.n].copy()
        lost = marcher.march(state, record) < 0 or overflowed(state.x, record.motion)
        if lost:
            break
        first.append(period_harmonics(began, record.motion, 1)[1] @ rows)
        samples.append(record.motion[steps // KEPT - 1 :: steps // KEPT] @ rows)
        size = np.abs(first[-1])
        if len(first) > 1:
            changes.append(abs(float(size.max() - np.abs(first[-2]).max())) / float(size.max()))
        if settles and remaining_change(changes) < settles:
            break
    none = np.zeros((0, len(outputs)))
    return Marched(
        omega,
        np.array(first) if first else none.astype(complex),
        np.concatenate(samples) if samples else none,
        marcher.end(state),
        lost,
    )


@dataclass(frozen=True, eq=False)
class WaveHistory:
    """Waves in a motion of all sectors over time.

    Parameters
    ----------
    time
        (windows,) s.
    amplitude
        (windows, n_s) amplitude of each wave number at one dof of the sectors, m.
    omega
        (windows, n_s) frequency of each wave, rad/s; meaningless for small waves.
    spread
        (windows, n_s) relative change of each amplitude within the window, such as by beating.
    """

    time: FloatArray
    amplitude: FloatArray
    omega: FloatArray
    spread: FloatArray

    @property
    def waves(self) -> tuple[int, ...]:
        """Wave numbers present at the end, the largest amplitude first."""
        last = self._last
        order = np.argsort(-last, kind="stable")
        return tuple(int(k) for k in order if last[k] > SMALL * last.max(initial=0.0))

    @property
    def outcome(self) -> Outcome:
        """Outcome of the motion."""
        total = np.sqrt(np.sum(self.amplitude**2, axis=1))
        if len(total) < 3 or not np.all(np.isfinite(total)):
            return "grows" if len(total) and not np.all(np.isfinite(total)) else "not settled"
        stretch = min(last_third(len(total)), len(total) - 1)
        if total[-1] < SMALL * total.max() and total[-1] < total[-1 - stretch]:
            return "decays"
        own = self.amplitude[:, list(self.waves)]
        change = np.abs(own[-1] - own[-1 - stretch]) / total[-1]
        if np.any(change > STEADY):
            return "grows" if np.all(np.diff(total[-1 - stretch :]) > 0.0) else "not settled"
        return "one wave" if len(self.waves) == 1 else "several waves"

    @property
    def sentence(self) -> str:
        """Outcome in words."""
        waves = self.waves
        named = " and ".join(str(k) for k in waves[:4])
        return {
            "one wave": f"wave {named} wins",
            "several waves": f"waves {named} coexist",
            "decays": "the motion dies",
            "grows": f"{UNSETTLED}: the motion still grows, wave {waves[0] if waves else 0} most",
            "not settled": f"{UNSETTLED}: waves {named} are there",
        }[self.outcome]

    @property
    def _last(self) -> FloatArray:
        stretch = min(last_third(len(self.amplitude)), len(self.amplitude))
        return np.asarray(np.mean(self.amplitude[-stretch:], axis=0))


def wave_history(marched: Marched, window: int = WINDOW) -> WaveHistory:
    """Return the waves of a motion from outputs at the same dof of all sectors, in their order.

    In each window of `window` periods, the motion of a wave number is split by the sign of its frequency, since waves k
    and -k have the same instantaneous shape and travel in opposite directions.
    """
    sectors = marched.samples.shape[1]
    length = window * KEPT
    count = len(marched.samples) // length
    shape = np.fft.fft(marched.samples[: count * length], axis=1) / sectors
    parts = shape.reshape(count, length, sectors)
    taper = np.hanning(length + 1)[:-1, None]
    spectrum = np.fft.fft(parts * taper, axis=1)
    frequency = np.fft.fftfreq(length, d=1.0 / KEPT)
    forward = np.fft.ifft(spectrum * (frequency > 0.0)[:, None], axis=1)
    power = np.sum(np.abs(forward) ** 2, axis=1) / np.sum(taper**2)
    turned = np.angle(np.sum(np.conj(forward[:, :-1]) * forward[:, 1:], axis=1))
    middle = forward[:, length // 4 : -(length // 4)] / taper[length // 4 : -(length // 4)]
    size = np.abs(middle)
    spread = (size.max(axis=1) - size.min(axis=1)) / np.maximum(size.max(axis=1), np.finfo(float).tiny)
    period = 2.0 * np.pi / marched.omega
    return WaveHistory(
        (np.arange(count) + 0.5) * window * period,
        2.0 * np.sqrt(power),
        turned * KEPT * marched.omega / (2.0 * np.pi),
        spread,
    )


def mixed_start(motions: Sequence[tuple[ComplexArray, float]], like: TransientStart) -> TransientStart:
    """Return the state at t = 0 of a sum of motions.

    Each has complex amplitudes (n,) and a frequency, rad/s. Law states are taken from `like`.
    """
    moved = sum((a.real for a, _ in motions), np.zeros_like(like.displacement))
    rate = sum(((1j * omega * a).real for a, omega in motions), np.zeros_like(like.velocity))
    return replace(like, displacement=moved, velocity=rate)


def all_in_time(
    system: System, load: HarmonicLoad, output: int, most: int
) -> tuple[LinearSide, Interface, HarmonicLoad, IntArray]:
    """Return structure, contacts and static load of all sectors for time integration, and the output of each sector.

    Parameters
    ----------
    system
        A single structure, or the wave of a tuned wheel.
    load
        Its load; of a wheel the static load of a sector.
    output
        Coordinate of the output.
    most
        Largest number of coordinates of all sectors.

    Raises
    ------
    StickslipError
        If the model is too large.
    """
    side = system.structure
    if side.wheel is None:
        return side, system.interface, load, np.array([output])
    if side.n * side.wheel.sectors > most:
        raise StickslipError(
            f"time integration marches all sectors, {side.n * side.wheel.sectors} coordinates, more than {most}"
        )
    whole = whole_wheel(system)
    own = whole.structure.n // side.wheel.sectors
    static = np.tile(load.static[:own], side.wheel.sectors)
    return whole.structure, whole.contacts, HarmonicLoad(static), output + own * np.arange(side.wheel.sectors)
