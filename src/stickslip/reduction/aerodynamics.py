"""Aerodynamic influence coefficients of a bladed disk: forces on a blade from its own vibration and its neighbours'.

Sector n carries the force ``f_n = P Σ_j L_j(ω) Pᴴ u_{n+j}`` on the right-hand side. The columns of P are force patterns: for a
mode, mass matrix times shape; for a point, a unit force. In a wave each sector leads the previous one by θ, and the sum becomes
``G(ω) = Σ_j L_j(ω) e^{ijθ}``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix, as_array
from stickslip.errors import input_error
from stickslip.model.structure import Structure
from stickslip.units import HZ, RPM

Beyond = Literal["refuse", "nearest"]
LARGEST = 5000  # dofs of a full matrix: 0.4 GB of complex numbers
EDGE = 1e-9  # excess over the range of a table, relative to its highest frequency, that is rounding
OUTSIDE = 'Add rows of more frequencies, keep fewer harmonics, or say beyond = "nearest" in [aero].'
SAME_ANGLE = 1e-6  # rad: tolerance of phase angles in files


def _none() -> FloatArray:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class InfluenceCoefficients:
    """Complex coefficients by neighbour, frequency and speed.

    Parameters
    ----------
    distances
        (d,) different whole numbers j: the motion of sector n + j acts on sector n. Coefficients of other distances are zero.
    values
        (s, f, d, m, m) L_j at each speed, frequency and distance, between m patterns: rows are forces, columns motions.
    frequencies
        (f,) ascending, rad/s; empty if f is 1 and the coefficients hold at any frequency. Real and imaginary part are interpolated
        by monotone cubics (PCHIP), whose slope is continuous.
    speeds
        (s,) ascending, rad/s; empty if s is 1 and the coefficients hold at any speed. Interpolation is linear.
    beyond
        Treatment of frequencies outside the table: ``refuse`` them, or take the ``nearest``. Speeds outside are always refused.

    Raises
    ------
    InputError
        If shapes do not agree, numbers are not finite, or frequencies or speeds do not ascend.
    """

    distances: IntArray
    values: ComplexArray
    frequencies: FloatArray = field(default_factory=_none)
    speeds: FloatArray = field(default_factory=_none)
    beyond: Beyond = "refuse"

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=complex)
        own = {
            "values": values,
            "distances": np.asarray(self.distances, dtype=np.int64),
            "frequencies": np.asarray(self.frequencies, dtype=float),
            "speeds": np.asarray(self.speeds, dtype=float),
        }
        for name, array in own.items():
            object.__setattr__(self, name, array)
        wanted = (max(self.speeds.size, 1), max(self.frequencies.size, 1), self.distances.size)
        if values.ndim != 5 or values.shape[:3] != wanted or values.shape[3] != values.shape[4]:
            raise input_error(
                "InfluenceCoefficients.values",
                f"has shape {values.shape} for {wanted} speeds, frequencies and distances",
                "Give (speeds, frequencies, distances, m, m).",
            )
        if not np.all(np.isfinite(values)):
            raise input_error("InfluenceCoefficients.values", "has NaN or infinite entries", "Check the table.")
        if np.unique(self.distances).size != self.distances.size:
            raise input_error(
                "InfluenceCoefficients.distances",
                f"has a neighbour twice: {self.distances.tolist()}",
                "Give each once.",
            )
        for name in ("frequencies", "speeds"):
            axis = getattr(self, name)
            if axis.size and (axis[0] < 0 or np.any(np.diff(axis) <= 0)):
                raise input_error(f"InfluenceCoefficients.{name}", "do not ascend from zero on", "Sort them.")

    def __repr__(self) -> str:
        """Describe the coefficients in a line, without their numbers."""
        return (
            f"<InfluenceCoefficients: neighbours {self.distances.tolist()}; {self.patterns} patterns; "
            f"{max(self.frequencies.size, 1)} frequencies; {max(self.speeds.size, 1)} speeds>"
        )

    @property
    def patterns(self) -> int:
        """Number m of modes or points."""
        return int(self.values.shape[-1])

    @property
    def depends_on_frequency(self) -> bool:
        """Whether coefficients of several frequencies are given."""
        return self.frequencies.size > 1

    @property
    def refuses(self) -> bool:
        """Whether frequencies outside of the table are refused."""
        return self.depends_on_frequency and self.beyond == "refuse"

    def at_speed(self, speed: float) -> "InfluenceCoefficients":
        """Return the coefficients at a speed in rad/s; an `InputError` names the range if the speed is outside of it."""
        if not self.speeds.size:
            return self
        low, high = self.speeds[[0, -1]]
        if not low * (1 - 1e-12) <= speed <= high * (1 + 1e-12):
            raise input_error(
                "aero.file",
                f"has coefficients for {low / RPM:.6g} to {high / RPM:.6g} rpm, and the rotor turns at {speed / RPM:.6g} rpm",
                "Add rows of this speed, or leave the column speed_rpm out if they hold at any.",
            )
        flat = self.values.reshape(self.speeds.size, -1)
        mixed = np.array([np.interp(speed, self.speeds, part) for part in flat.real.T], dtype=float)
        other = np.array([np.interp(speed, self.speeds, part) for part in flat.imag.T], dtype=float)
        values = (mixed + 1j * other).reshape(1, *self.values.shape[1:])
        return replace(self, values=values, speeds=_none())

    def at(self, omega: float) -> ComplexArray:
        """Return the (d, m, m) coefficients at ω in rad/s; the table must have a single speed.

        Raises
        ------
        InputError
            If ω is outside of the table, with its range.
        """
        if not self.depends_on_frequency:
            return np.asarray(self._one_speed[0])
        here = self._inside(omega)
        return np.asarray(self._through(here)[..., 0] + 1j * self._through(here)[..., 1])

    def slope(self, omega: float) -> ComplexArray:
        """Return the (d, m, m) derivatives with respect to ω."""
        if not self.depends_on_frequency or self._inside(omega) != omega:
            return np.zeros(self.values.shape[2:], dtype=complex)
        parts = self._through(omega, 1)
        return np.asarray(parts[..., 0] + 1j * parts[..., 1])

    def of_wave(self, phase_angle: float, omega: float) -> ComplexArray:
        """Return the (m, m) ``G = Σ_j L_j e^{ijθ}`` for an inter-blade phase angle θ in rad."""
        return _summed(self.at(omega), self._phases(phase_angle))

    def slope_of_wave(self, phase_angle: float, omega: float) -> ComplexArray:
        """Return the (m, m) derivative of `of_wave` with respect to ω."""
        return _summed(self.slope(omega), self._phases(phase_angle))

    def frozen(self, phase_angle: float, reference: float) -> tuple[ComplexArray, ComplexArray]:
        """Return the (m, m) stiffness and damping of the frozen form, to subtract from the wave's matrices; exact at ω_r.

        Parameters
        ----------
        phase_angle
            θ in rad.
        reference
            ω_r in rad/s.
        """
        L, phases = self.at(reference), self._phases(phase_angle)
        return _summed(L.real, phases), _summed(L.imag / reference, phases)

    def force(self, phase_angle: float, omega: complex, reference: float) -> ComplexArray:
        """Return the (m, m) G of a wave at ω in rad/s, from the table or, if it has one frequency, from the frozen form.

        Parameters
        ----------
        phase_angle
            θ in rad.
        omega
            ω in rad/s; complex for the frozen form of a motion that grows or decays.
        reference
            ω_r of the frozen form, rad/s.
        """
        if self.depends_on_frequency:
            return self.of_wave(phase_angle, omega.real)
        stiff, damp = self.frozen(phase_angle, reference)
        return np.asarray(stiff + 1j * omega * damp)

    def require(self, low: float, high: float, what: str) -> None:
        """Refuse a table that does not cover the frequencies from `low` to `high`, rad/s, which `what` needs.

        Raises
        ------
        InputError
            With both ranges, unless `beyond` is ``nearest``.
        """
        if not self.refuses:
            return
        first, last = (float(f) for f in self.frequencies[[0, -1]])
        if low < first - EDGE * last or high > last * (1 + EDGE):
            raise input_error(
                "aero.file",
                f"has coefficients for {first / HZ:.6g} to {last / HZ:.6g} Hz, and {what} needs {low / HZ:.6g} to {high / HZ:.6g} Hz",
                OUTSIDE,
            )

    def _phases(self, phase_angle: float) -> ComplexArray:
        return np.asarray(np.exp(1j * phase_angle * self.distances))

    @property
    def _one_speed(self) -> ComplexArray:
        if self.speeds.size > 1:
            raise input_error("InfluenceCoefficients", "are those of several speeds", "Take at_speed first.")
        return np.asarray(self.values[0])

    def _inside(self, omega: float) -> float:
        """Return ω; outside the table return its nearest end, or refuse (`beyond`)."""
        low, high = (float(f) for f in self.frequencies[[0, -1]])
        held = min(max(omega, low), high)
        if abs(held - omega) <= EDGE * high or self.beyond == "nearest":
            return held
        raise input_error(
            "aero.file",
            f"has coefficients for {low / HZ:.6g} to {high / HZ:.6g} Hz, asked for {omega / HZ:.6g} Hz",
            OUTSIDE,
        )

    @cached_property
    def _through(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        parts = np.stack([self._one_speed.real, self._one_speed.imag], axis=-1)
        return PchipInterpolator(self.frequencies, parts)


def from_phase_angles(
    angles: Sequence[float] | FloatArray, values: ComplexArray, *, sectors: int | None = None
) -> tuple[IntArray, ComplexArray]:
    """Return distances and influence coefficients from the coefficients G of waves, by the discrete Fourier transform.

    Parameters
    ----------
    angles
        (N,) inter-blade phase angles in rad, evenly spaced over the whole circle from zero on, in any order.
    values
        (N, ...) G of each angle.
    sectors
        Number of sectors; None: not checked. N may be smaller: blades farther apart than N/2 are then uncoupled.

    Returns
    -------
    distances
        (N,) from −(N−1)/2 to N/2.
    values
        (N, ...) ``L_j = Σ G(θ) e^{−ijθ} / N``.

    Raises
    ------
    InputError
        If two angles are the same, angles are not evenly spaced, or there are more of them than sectors.
    """
    turned = np.mod(np.asarray(angles, dtype=float) + SAME_ANGLE, 2 * np.pi) - SAME_ANGLE
    order = np.argsort(turned)
    count = turned.size
    same = np.flatnonzero(np.diff(turned[order]) < SAME_ANGLE)
    if same.size:
        first, second = sorted(np.degrees(np.asarray(angles)[order[same[0] : same[0] + 2]]))
        same_angle = f"{first:g} and {second:g} degrees are the same angle"
        raise input_error("from_phase_angles: angles", same_angle, "Leave one of the two out.")
    even = 2 * np.pi * np.arange(count) / max(count, 1)
    if not count or np.abs(turned[order] - even).max() > SAME_ANGLE:
        raise input_error(
            "from_phase_angles: angles",
            f"{count} angles are not spread evenly over the circle from zero on",
            "Give all wave numbers, or coefficients by neighbour.",
        )
    if sectors is not None and count > sectors:
        raise input_error(
            "from_phase_angles: angles",
            f"there are {count} of them on {sectors} sectors",
            "A wheel has no more waves than sectors.",
        )
    spread = np.fft.fft(np.asarray(values)[order], axis=0) / count
    distances = np.arange(count) - (count - 1) // 2
    return distances, np.asarray(spread[distances % count])


def one_twice(numbers: Sequence[int] | IntArray, sectors: int) -> tuple[int, int] | None:
    """Return the first two neighbours, or wave numbers, that coincide modulo the sectors; None if all differ."""
    found: dict[int, int] = {}
    for own in (int(number) for number in numbers):
        if own % sectors in found:
            return found[own % sectors], own
        found[own % sectors] = own
    return None


def to_phase_angles(distances: IntArray, values: ComplexArray, angles: Sequence[float] | FloatArray) -> ComplexArray:
    """Return G (a, ...) at inter-blade phase angles (a,) in rad from coefficients (d, ...) by neighbour."""
    phases = np.exp(1j * np.outer(np.asarray(angles), distances))
    return np.asarray(np.tensordot(phases, values, axes=1))


@dataclass(frozen=True, eq=False)
class Feedback:
    """The aerodynamic force on one wave, in its coordinates: ``f = P G(ω) Pᴴ q``.

    Parameters
    ----------
    patterns
        (n, m) P.
    phase_angle
        θ in rad.
    influence
        Coefficients of one speed.
    reference
        ω_r in rad/s, frequency at which the frozen form (added stiffness and damping) equals the force.
    """

    patterns: Matrix
    phase_angle: float
    influence: InfluenceCoefficients
    reference: float

    def __post_init__(self) -> None:
        if not 0 < self.reference < np.inf:
            raise input_error("Feedback.reference", f"must be above zero, got {self.reference}", "Give rad/s.")
        if self.patterns.shape[1] != self.influence.patterns:
            raise input_error(
                "Feedback.patterns",
                f"are {self.patterns.shape[1]}, and the coefficients are those of {self.influence.patterns}",
                "Give a column for each mode or point.",
            )

    @property
    def conjugate(self) -> "Feedback":
        """The force on the wave in the opposite direction, which has the conjugate patterns."""
        return replace(self, patterns=np.conj(self.patterns), phase_angle=-self.phase_angle)

    def in_coordinates(self, way: Matrix) -> "Feedback":
        """Return the force in new coordinates; `way` (n, n_new) maps them to the present ones."""
        return replace(self, patterns=np.asarray(way.conj().T @ self.patterns))

    def stiffness(self) -> Matrix:
        """Return the (n, n) stiffness that the frozen form subtracts, N/m."""
        return self._outer(self.influence.frozen(self.phase_angle, self.reference)[0])

    def frozen(self, structure: Structure) -> Structure:
        """Return the wave with the frozen form of the force in its matrices: exact at ω_r, and real for the whole wheel.

        ``K − P Σ_j Re(L_j) e^{ijθ} Pᴴ`` and ``C − P Σ_j Im(L_j)/ω_r e^{ijθ} Pᴴ`` are in general not Hermitian. The wave in the
        opposite direction has their conjugates.
        """
        if structure.n > LARGEST:
            raise input_error(
                "aero",
                f"its force would fill a matrix of {structure.n} dofs",
                "Reduce the sector first: give it a table [reduction].",
            )
        stiff, damp = self.influence.frozen(self.phase_angle, self.reference)
        K, C = (as_array(m) for m in (structure.stiffness, structure.damping))
        return replace(structure, stiffness=K - self._outer(stiff), damping=C - self._outer(damp))

    def force(self, omega: complex) -> ComplexArray:
        """Return the (m, m) G at ω in rad/s.

        Coefficients of one frequency give the frozen form, also for complex ω (a motion that grows or decays).
        """
        return self.influence.force(self.phase_angle, omega, self.reference)

    def beyond_frozen(self, omega: complex) -> tuple[ComplexArray, ComplexArray]:
        """Return the (m, m) difference between G(ω) and the frozen form, and its derivative with respect to ω.

        A table is evaluated at the real part of ω.
        """
        stiff, damp = self.influence.frozen(self.phase_angle, self.reference)
        slope = self.influence.slope_of_wave(self.phase_angle, omega.real)
        return self.force(omega) - stiff - 1j * omega * damp, slope - 1j * damp

    def _outer(self, inner: ComplexArray) -> Matrix:
        product = self.patterns @ inner @ self.patterns.conj().T
        standing = abs(np.sin(self.phase_angle)) < 1e-12 and np.isrealobj(self.patterns)
        return np.asarray(product.real if standing else product)


def _summed(values: Matrix, phases: ComplexArray) -> ComplexArray:
    return np.asarray(np.tensordot(phases, values, axes=1), dtype=complex)
