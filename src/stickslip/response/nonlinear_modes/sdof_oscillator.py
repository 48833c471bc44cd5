"""Backbone as an oscillator of one degree of freedom: frequency, damping and force at every amplitude.

Damping of ``-2 ζ ω`` times the mass sustains the motion of a nonlinear mode. A force of the frequency Ω that sustains
it instead follows from the balance of the first harmonic, weighted by the shape ψ of unit modal mass:

    D(Ω, a) a = ψᴴ f ,    D = ω² - Ω² + i (2 ζ ω² + (Ω - ω) ψᴴ C ψ) .

Friction forces do not depend on the frequency of a motion, dashpot forces do. M. Krack, L. Panning-von Scheidt and J.
Wallaschek, "On the computation of the slow dynamics of nonlinear modes of mechanical systems", Mechanical Systems and
Signal Processing 42 (2014) 71-87, use ``2 i ζ ω Ω`` for all damping.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.nonlinear_modes.backbone import Backbone, ModePoint

MIN_BACKBONE_POINTS = 4  # for interpolation
LINEAR = 1e-3  # relative difference from frequency and damping of the linear mode, below which a backbone begins linear
BELOW = 1e-6  # smallest amplitude of the linear continuation, over the first amplitude
STEPS_TO_LEAST = 6  # Newton steps to the frequency that needs the least force
INSIDE = 24  # positions between two points at which the force is evaluated


@dataclass(frozen=True, eq=False)
class Oscillation:
    """Oscillator at points of its backbone, all arrays (p,).

    Parameters
    ----------
    amplitude
        Modal amplitude, kg^0.5 m.
    omega, ratio
        Frequency, rad/s, and damping ratio of the nonlinear mode.
    force
        Complex modal force at level 1, N kg^-0.5.
    viscous
        ``ψᴴ C ψ``, 1/s: damping that grows with the frequency; its imaginary part is gyroscopic.
    """

    amplitude: FloatArray
    omega: FloatArray
    ratio: FloatArray
    force: ComplexArray
    viscous: ComplexArray

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return the modal dynamic stiffness D at frequencies, rad/s."""
        rate = 2.0 * self.ratio * self.omega**2 + (omega - self.omega) * self.viscous
        return np.asarray(self.omega**2 - omega**2 + 1j * rate)

    @property
    def eigenvalue(self) -> ComplexArray:
        """(p,) eigenvalue λ near ``-ζω + iω`` of the free motion, 1/s: ``D(Ω) = (iΩ - λ) (iΩ + ψᴴ C ψ + λ)``."""
        half = 0.5 * self.viscous
        rest = self.omega**2 + 1j * (2.0 * self.ratio * self.omega**2 - self.omega * self.viscous)
        return np.asarray(1j * np.sqrt(rest - half**2) - half)

    def polynomial(self) -> FloatArray:
        """Return (p, 5) coefficients of ``|D(Ω)|²`` in powers of Ω, the highest first."""
        turn, damp = self.viscous.imag, self.viscous.real
        real = self.omega**2 + self.omega * turn
        rest = 2.0 * self.ratio * self.omega**2 - self.omega * damp
        one = np.ones_like(real)
        return np.stack(
            [one, 2.0 * turn, turn**2 - 2.0 * real + damp**2, 2.0 * (rest * damp - turn * real), real**2 + rest**2],
            axis=-1,
        )

    def resonance(self) -> FloatArray:
        """Return the frequencies, rad/s, that need the least force for each amplitude."""
        q = self.polynomial()
        omega = self.omega.copy()
        for _ in range(STEPS_TO_LEAST):
            slope = ((4 * omega + 3 * q[..., 1]) * omega + 2 * q[..., 2]) * omega + q[..., 3]
            omega = omega - slope / ((12 * omega + 6 * q[..., 1]) * omega + 2 * q[..., 2])
        return omega


@dataclass(frozen=True, eq=False)
class ModalOscillator:
    """Backbone under a load; `modal_oscillator` makes one.

    The position on the backbone is the accumulated change of ln a from its beginning; it grows also where the amplitude
    turns back.

    Parameters
    ----------
    backbone
        The nonlinear mode.
    load
        Load at level 1.
    place
        (p,) ascending positions of the points.
    motion
        (p, H+1, n) displacements of the points, m. The phase of the first harmonic is continuous along the backbone.
    begins
        Position of the first point of the backbone; the linear mode precedes it.
    change
        (p,) predicted relative change of frequency or damping ratio with more harmonics, the larger one.
    """

    backbone: Backbone
    load: HarmonicLoad
    place: FloatArray
    motion: ComplexArray
    begins: float
    numbers: PchipInterpolator
    change: FloatArray

    @property
    def ends(self) -> tuple[float, float]:
        """First and last position on the backbone."""
        return float(self.place[0]), float(self.place[-1])

    def at(self, place: FloatArray) -> Oscillation:
        """Return the oscillator at positions on the backbone."""
        v = self.numbers(place)
        return Oscillation(
            np.exp(v[..., 0]), np.exp(v[..., 1]), v[..., 2], v[..., 3] + 1j * v[..., 4], v[..., 5] + 1j * v[..., 6]
        )

    def needed(self, place: FloatArray) -> FloatArray:
        """Return the smallest load level that sustains the motions at positions on the backbone."""
        here = self.at(place)
        own = np.abs(here.stiffness(here.resonance())) * here.amplitude
        with np.errstate(divide="ignore"):
            return np.asarray(own / np.abs(here.force))

    def by_harmonics(self, place: float) -> float:
        """Return the predicted relative change of frequency or damping ratio with more harmonics.

        It is the larger one of the neighbouring points; NaN if unknown.
        """
        if place < self.begins:
            return 0.0
        after = int(np.clip(np.searchsorted(self.place, place), 1, self.place.size - 1))
        return float(np.max(self.change[after - 1 : after + 1]))

    @cached_property
    def table(self) -> FloatArray:
        """Positions of the points of the backbone, and intermediate ones."""
        gaps = np.linspace(self.place[:-1], self.place[1:], INSIDE, endpoint=False)
        return np.append(gaps.T.reshape(-1), self.place[-1])

    @cached_property
    def needed_in_table(self) -> FloatArray:
        """Smallest load levels at the positions of `table`."""
        return self.needed(self.table)

    @cached_property
    def _first(self) -> PchipInterpolator:
        shape = self.motion[:, 1] / self.at(self.place).amplitude[:, None]
        return PchipInterpolator(self.place, np.stack([shape.real, shape.imag]), axis=1)

    def first(self, place: FloatArray) -> ComplexArray:
        """Return (p, n) first harmonics of all dofs at positions, m, in the phase of the backbone."""
        parts = self._first(place)
        return np.asarray((parts[0] + 1j * parts[1]) * self.at(place).amplitude[:, None])

    @cached_property
    def _all(self) -> PchipInterpolator:
        # the vibration scales with the amplitude, the mean does not
        size = self.at(self.place).amplitude[:, None, None]
        relative = np.concatenate([self.motion[:, :1], self.motion[:, 1:] / size], axis=1)
        return PchipInterpolator(self.place, np.stack([relative.real, relative.imag]), axis=1)

    def displacement(self, place: FloatArray, dofs: IntArray | None = None) -> ComplexArray:
        """Return (p, H+1, k) displacements of dofs at positions, m, in the phase of the backbone; None: all dofs."""
        parts = self._all(place) if dofs is None else self._all(place)[..., dofs]
        found = parts[0] + 1j * parts[1]
        found[:, 1:] *= self.at(place).amplitude[:, None, None]
        return np.asarray(found)

    def gaps(self, place: FloatArray) -> ComplexArray:
        """Return (p, H+1, 3 n_contacts) gaps t, w, n of all contacts at positions, m, in the phase of the backbone."""
        operator = self.backbone.system.interface.gap_operator
        motion = self.displacement(place)
        flat = motion.reshape(-1, motion.shape[2])
        return np.asarray((operator @ flat.T).T.reshape(*motion.shape[:2], -1))

    def coarser(self) -> "ModalOscillator":
        """Return the oscillator from every second point of the backbone, to estimate the interpolation error."""
        points = self.backbone.points
        kept = [p for i, p in enumerate(points) if i % 2 == 0 or i == len(points) - 1]
        return modal_oscillator(replace(self.backbone, points=tuple(kept)), self.load)


@by_one_thread
def modal_oscillator(backbone: Backbone, load: HarmonicLoad) -> ModalOscillator:
    """Make the oscillator of a nonlinear mode under a harmonic load.

    Parameters
    ----------
    backbone
        The mode with its static load.
    load
        Forces on all dofs, N; the harmonic forces are level 1.

    Raises
    ------
    InputError
        If the load drives another harmonic than the first, does not drive the mode, or has another static part than the
        backbone; or if the backbone has too few converged points.
    """
    points = [p for p in backbone.points if p.status.converged]
    if len(points) < MIN_BACKBONE_POINTS:
        raise input_error(
            "modal_synthesis",
            f"the backbone has {len(points)} points that converged, and {MIN_BACKBONE_POINTS} are the fewest",
            "Follow it over more amplitudes, or with more points.",
        )
    force = _driving(backbone, load)
    mass, damping = (getattr(backbone.system.structure.of_harmonic(1), m) for m in ("mass", "damping"))
    motion = _transported([p.coefficients for p in points], mass)
    begins_linear = _is_linear(backbone, points[0])
    logs = np.log([p.modal_amplitude for p in points])
    rows = [
        [logs[i], np.log(p.omega), p.ratio, *_parts(np.vdot(shape, force)), *_parts(np.vdot(shape, damping @ shape))]
        for i, p in enumerate(points)
        for shape in [motion[i, 1] / p.modal_amplitude]
    ]
    place = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(logs)))])
    begins, change = 0.0, np.array([p.change for p in points])
    if begins_linear:  # below the first point the mode is linear: its motion is proportional to the amplitude
        less = np.log(BELOW)
        faint = motion[:1].copy()
        faint[:, 1:] *= BELOW
        motion = np.concatenate([faint, motion])
        rows = [[rows[0][0] + less, *rows[0][1:]], *rows]
        place = np.append(0.0, place - less)
        begins, change = -less, np.append(0.0, change)
    kept = np.append(True, np.diff(place) > 0.0)
    numbers = PchipInterpolator(place[kept], np.array(rows)[kept])
    return ModalOscillator(backbone, load, place[kept], motion[kept], float(begins), numbers, change[kept])


def _driving(backbone: Backbone, load: HarmonicLoad) -> ComplexArray:
    """Return the force of the first harmonic, after checking that it drives this mode."""
    others = sorted(h for h, f in load.harmonics.items() if h != 1 and np.any(f))
    if others:
        raise input_error(
            "modal_synthesis",
            f"a load drives harmonic {others[0]}, and the mode answers to the first",
            "Leave it out, or ask for the forced response.",
        )
    force = load.harmonics.get(1)
    if force is None or not np.any(force):
        raise input_error("modal_synthesis", "no load drives the mode", "Give a harmonic load.")
    if np.any(np.abs(load.static - backbone.load.static) > 1e-9 * backbone.load.scale):
        raise input_error(
            "modal_synthesis",
            "the static load differs from the backbone's",
            "Follow the nonlinear mode under the same static load.",
        )
    return force


def _is_linear(backbone: Backbone, first: ModePoint) -> bool:
    mode = backbone.mode
    return abs(first.omega / mode.omega - 1.0) < LINEAR and abs(first.ratio - mode.ratio) < LINEAR * max(
        abs(mode.ratio), LINEAR
    )


def _transported(motions: Sequence[ComplexArray], mass: Matrix) -> ComplexArray:
    """Return (p, H+1, n) motions with a continuous phase of the first harmonic; missing harmonics are zero."""
    most = max(len(m) for m in motions)
    out = np.zeros((len(motions), most, motions[0].shape[1]), dtype=complex)
    for i, own in enumerate(motions):
        out[i, : len(own)] = own
        if i:
            turn = np.vdot(mass @ out[i - 1, 1], own[1])
            phase = np.exp(-1j * np.angle(turn) * np.arange(len(own)))
            out[i, : len(own)] *= phase[:, None]
    return out


def _parts(value: complex) -> tuple[float, float]:
    return float(np.real(value)), float(np.imag(value))
