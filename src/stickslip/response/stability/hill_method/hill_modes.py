"""Modes of the dynamic stiffness of each harmonic, for a disturbance with a complex exponent.

The modes are computed with mean springs in place of the contacts. Viscous damping may couple them; loss factors and
aerodynamic forces act as in the harmonic balance.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix, as_array
from stickslip.harmonic.matrices import is_diagonal
from stickslip.model.structure import Structure
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.contact_coordinates import own_motions
from stickslip.response.system import System

RAISED = 8  # largest number of fourfold increases of the mass weight α that makes the stiffness definite
COUPLED = 1e-9  # coupling of modes, relative to the largest entry, that is rounding


@dataclass(frozen=True, eq=False)
class HillModes:
    """Modes ``u = Φ q`` of the structure of one harmonic, with ``Φᴴ(K + α M)Φ = 1``.

    They are scaled by the frequency of the motion.

    Attributes
    ----------
    stiffness, mass
        (n,) of each mode; the mass times ω².
    damping, rest, loss
        (n, n) damping times ω, non-Hermitian part of the stiffness, and hysteretic stiffness with a phase lead of a
        quarter period; all (n,) if only `springs` couple the modes.
    springs
        (r, n) factor of the damping ``-springsᴴ springs`` times ω, for stiffness-proportional damping without the mean
        springs.
    ports
        (m, n) gaps at the ports of the contacts.
    omega
        Frequency of the motion, rad/s.
    feedback
        Tabulated aerodynamic force on the modes, whose frozen form is in the matrices; None without one.
    """

    stiffness: FloatArray
    mass: FloatArray
    damping: Matrix
    rest: Matrix
    loss: Matrix
    springs: Matrix
    ports: Matrix
    omega: float
    feedback: Feedback | None

    @property
    def ratios(self) -> FloatArray:
        """(n,) frequencies of the modes over the frequency of the motion; infinite without mass."""
        with np.errstate(divide="ignore"):
            return np.sqrt(np.abs(self.stiffness) / self.mass)

    def diagonal(self, z: complex, sign: float) -> ComplexArray | None:
        """Return the (n,) dynamic stiffness at ``z = σ + ih`` without the part of `springs`.

        It is None if the stiffness is not diagonal.
        """
        if self.damping.ndim == 2 or self.feedback is not None:
            return None
        more = z * self.damping + self.rest + 1j * sign * self.loss
        return np.asarray(self.stiffness + z * z * self.mass + more)

    def dynamic(self, z: complex, sign: float) -> ComplexArray:
        """Return the (n, n) dynamic stiffness at ``z = σ + ih``; `sign` is the sign of the frequency."""
        out = z * self.damping + self.rest + 1j * sign * self.loss
        out = np.diag(out) if out.ndim == 1 else out
        out = out - z * (self.springs.conj().T @ self.springs)
        out.flat[:: len(out) + 1] += self.stiffness + z * z * self.mass
        return np.asarray(out if self.feedback is None else out - self._air(self.feedback, z))

    def _air(self, force: Feedback, z: complex) -> ComplexArray:
        """Return the tabulated minus the frozen aerodynamic force at the frequency of the disturbance."""
        s = self.omega * z.imag
        stiff, damp = force.influence.frozen(force.phase_angle, force.reference)
        if s >= 0.0:
            table = force.influence.of_wave(force.phase_angle, s)
        else:
            table = force.influence.of_wave(-force.phase_angle, -s).conj()
        P = force.patterns
        return np.asarray(P @ (table - stiff - self.omega * z * damp) @ P.conj().T)


def hill_modes(
    structure: Structure,
    gap_operator: Matrix,
    springs: FloatArray,
    ports: IntArray,
    omega: float,
    feedback: Feedback | None,
) -> HillModes:
    """Return the modes of the structure of a harmonic.

    Parameters
    ----------
    structure
        Structure with possibly complex, unsymmetric matrices and coordinates without mass.
    gap_operator
        (3 n_contacts, n).
    springs
        (3 n_contacts,) mean springs of the contacts, N/m.
    ports
        Rows of the gap operator where contacts differ from their mean springs.
    omega
        Frequency of the motion, rad/s.
    feedback
        Tabulated aerodynamic force, whose frozen form is in the structure; None without one.
    """
    m, c, k, rows = (as_array(a) for a in (structure.mass, structure.damping, structure.stiffness, gap_operator))
    k = k + rows.T @ (springs[:, None] * rows)
    loss = np.zeros_like(k) if structure.loss is None else as_array(structure.loss)
    even, mass = 0.5 * (k + k.conj().T), 0.5 * (m + m.conj().T)
    shift = omega**2
    for _ in range(RAISED):
        try:
            values, basis = scipy.linalg.eigh(mass, even + shift * mass)
            break
        except np.linalg.LinAlgError:
            shift *= 4.0
    else:
        raise np.linalg.LinAlgError("the stiffness of a harmonic is not bounded by its mass")
    values = np.maximum(values, 0.0)
    parts = [basis.conj().T @ a @ basis for a in (omega * c, k - even, loss)]
    held = np.sqrt(np.maximum(springs, 0.0))[:, None] * (rows @ basis)
    share = _share_of_springs(parts[0], held)
    held = np.sqrt(share) * held[springs > 0.0] if share > 0.0 else held[:0]
    without = [parts[0] + held.conj().T @ held, *parts[1:]]
    if all(is_diagonal(a, COUPLED) for a in without):
        parts = [np.diagonal(a).copy() for a in without]
    else:
        held = held[:0]
    own = None
    if feedback is not None and feedback.influence.depends_on_frequency:
        inside = replace(feedback.influence, beyond="nearest")
        own = replace(feedback, patterns=basis.conj().T @ feedback.patterns, influence=inside)
    damping, rest, lossy = parts
    return HillModes(
        1.0 - shift * values, omega**2 * values, damping, rest, lossy, held, rows[ports] @ basis, omega, own
    )


@dataclass(frozen=True, eq=False)
class HillSide:
    """Linear structure for disturbances of a motion: harmonic h of a disturbance of wave k' is the wave ``k' + h m``.

    Attributes
    ----------
    system
        One structure, or a tuned wheel with every wave.
    springs, ports
        From `contact_tangents`.
    omega
        Frequency of the motion, rad/s.
    """

    system: System
    springs: FloatArray
    ports: IntArray
    omega: float
    known: dict[int, HillModes]

    @property
    def waves(self) -> int:
        """Number of possible waves of a disturbance."""
        wheel = self.system.structure.wheel
        return 1 if wheel is None else wheel.sectors

    def wave_of(self, wave: int, harmonic: int) -> int:
        """Return the wave number of a harmonic of a disturbance of a wave."""
        wheel = self.system.structure.wheel
        return 0 if wheel is None else (wave + harmonic * wheel.engine_order) % wheel.sectors

    def modes(self, wave: int, harmonic: int) -> HillModes:
        """Return the linear structure for a harmonic of a disturbance of a wave."""
        number = self.wave_of(wave, harmonic)
        if number not in self.known:
            self.known[number] = self._made(number)
        return self.known[number]

    def _made(self, number: int) -> HillModes:
        side, gaps = self.system.structure, self.system.interface.gap_operator
        wheel = side.wheel
        if wheel is None:
            structure, force = side.of_harmonic(1), side.feedback_of(1)
            return hill_modes(structure, gaps, self.springs, self.ports, self.omega, force)
        wave, force = wheel.waves[number], wheel.feedback.get(number)
        if wheel.multipliers.size:
            way = own_motions(wave, wheel.multipliers)
            n = way.shape[1]
            k, c, m = (as_array(a)[:n, :n] for a in (wave.stiffness, wave.damping, wave.mass))
            loss = None if wave.loss is None else as_array(wave.loss)[:n, :n]
            wave = Structure(m, c, k, wave.dofs.take(np.arange(n)), loss=loss)
            gaps = as_array(gaps) @ way
            force = None if force is None else replace(force, patterns=force.patterns[:n])
        return hill_modes(wave, gaps, self.springs, self.ports, self.omega, force)


def _share_of_springs(damping: Matrix, held: Matrix) -> float:
    """Return the share of the mean springs that is missing in the coupling damping, by least squares."""
    springs = held.conj().T @ held
    off = springs - np.diag(np.diagonal(springs))
    size = float(np.vdot(off, off).real)
    return -float(np.vdot(off, damping).real) / size if size > 0.0 else 0.0
