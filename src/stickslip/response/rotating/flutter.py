"""Flutter of one wave: aerodynamic damping by the energy method and by eigenvalues.

The wave is reduced to its lowest undamped modes. The energy method uses the modes in still fluid and the work of the
fluid on each in a period. The eigenvalue method couples all modes, with coefficients at the frequency of the motion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.errors import input_error
from stickslip.model.modes import normal_modes
from stickslip.model.structure import Structure
from stickslip.reduction.aerodynamics import Feedback, InfluenceCoefficients

SPARE = 6  # additional modes, which the fluid may couple with the requested ones
TAKES_PART = 1e-9  # pattern amplitude of a mode over the largest, below which the fluid does not act on it
ITERATIONS = 60
SETTLED = 1e-12  # relative change of an eigenvalue that ends the iteration


@dataclass(frozen=True, eq=False)
class FlutterOfWave:
    """Modes of a wave in the flow, by ascending frequency in still fluid.

    Parameters
    ----------
    frequencies
        (n,) frequencies in still fluid, rad/s.
    amplitudes
        (n, m) amplitudes of the patterns in each mode of unit mass: ``Pᴴ φ``.
    by_energy
        (n,) aerodynamic damping ratio ``ζ = −W/(4πE)``.
    in_flow
        (n,) eigenvalues with the fluid and without structural dissipation, 1/s.
    damped
        (n,) eigenvalues with the fluid and structural dissipation, 1/s.
    """

    frequencies: FloatArray
    amplitudes: ComplexArray
    by_energy: FloatArray
    in_flow: ComplexArray
    damped: ComplexArray

    @property
    def by_eigenvalue(self) -> FloatArray:
        """(n,) aerodynamic damping ratio ``−Re λ / |λ|``."""
        return damping_ratio(self.in_flow)

    @property
    def total(self) -> FloatArray:
        """(n,) damping ratio of fluid and structure together."""
        return damping_ratio(self.damped)


def damping_ratio(eigenvalues: ComplexArray) -> FloatArray:
    """Return ``−Re λ / |λ|`` of eigenvalues (n,); negative where a motion grows."""
    return np.asarray(-eigenvalues.real / np.abs(eigenvalues))


def flutter_of_wave(
    structure: Structure, feedback: Feedback, n_modes: int, *, ratios: float | Sequence[float] = 0.0
) -> FlutterOfWave:
    """Return the damping of the lowest modes of a wave in a flow.

    Parameters
    ----------
    structure
        The wave without the fluid: its damping, Coriolis terms (the skew part) and structural damping are included.
    feedback
        Aerodynamic force, in coordinates of the wave.
    n_modes
        Number of modes.
    ratios
        Additional damping ratios of the modes, lowest first, or one for all.

    Raises
    ------
    InputError
        If the wave has fewer modes, a mode does not vibrate, or its frequency is outside the table of coefficients.

    Notes
    -----
    ``W = π Im(Qᴴ G Q)`` and ``E = ½ ω² Qᴴ M Q``. The eigenvalue method differs by terms of second order in the
    coefficients: with half the coefficients the difference is a quarter. Structural damping has the sign for positive
    frequencies.
    """
    heavy = int(np.count_nonzero(structure.mass.diagonal()))
    count = min(heavy, 2 * n_modes + SPARE)
    modes = normal_modes(structure, max(count, n_modes))
    shapes = np.asarray(modes.shapes)
    if np.any(modes.squares[:n_modes] <= 0):
        raise input_error(
            "flutter",
            f"{int(np.count_nonzero(modes.squares[:n_modes] <= 0))} of {n_modes} modes do not vibrate",
            "Clamp the structure, let contacts stick, or give a speed at which it is stable.",
        )
    still = np.diag(modes.squares).astype(complex)
    damping = shapes.conj().T @ (structure.damping @ shapes)
    turning = (damping - damping.conj().T) / 2
    given = np.atleast_1d(np.asarray(ratios, dtype=float))
    zeta = np.full(modes.squares.size, given[0]) if given.size == 1 else np.zeros(modes.squares.size)
    if given.size > 1:
        zeta[: given.size] = given[: modes.squares.size]
    own = damping + np.diag(2 * zeta * np.sqrt(np.maximum(modes.squares, 0.0)))
    lossy = still
    if structure.loss is not None:
        lossy = still + 1j * (shapes.conj().T @ (structure.loss @ shapes))
    P = shapes.conj().T @ feedback.patterns
    felt = np.abs(P) > TAKES_PART * np.abs(P).max(axis=0, initial=0.0)
    P = np.where(felt, P, 0.0)
    found = [_mode(i, still, lossy, turning, own, P, feedback) for i in range(n_modes)]
    frequencies, amplitudes, energy, flow, damped = zip(*found, strict=True)
    return FlutterOfWave(
        np.array(frequencies), np.array(amplitudes), np.array(energy), np.array(flow), np.array(damped)
    )


def _mode(
    i: int,
    still: ComplexArray,
    lossy: ComplexArray,
    turning: ComplexArray,
    damping: ComplexArray,
    P: Matrix,
    feedback: Feedback,
) -> tuple[float, ComplexArray, float, complex, complex]:
    none = np.zeros_like(still)
    start = 1j * np.sqrt(still[i, i].real), np.eye(len(still))[i].astype(complex)
    value, vector = _nearest(still, turning, none, start)
    omega = value.imag
    amplitude = P.conj().T @ vector
    if not np.any(amplitude):
        damped = _nearest(lossy, damping, none, (value, vector))[0]
        return omega, amplitude, 0.0, 1j * omega, damped
    force = feedback.force(omega)
    energy = -float((amplitude.conj() @ force @ amplitude).imag) / (2 * omega**2)
    pair = value, vector

    def felt(eigenvalue: complex) -> Matrix:
        # matrices are evaluated at the complex eigenvalue, a table at the frequency
        known = feedback.influence.depends_on_frequency
        inner = feedback.force(eigenvalue.imag if known else -1j * eigenvalue)
        return np.asarray(P @ inner @ P.conj().T)

    in_flow = followed_mode(still, turning, felt, pair)
    both = followed_mode(lossy, damping, felt, in_flow)
    return omega, amplitude, energy, in_flow[0], both[0]


def followed_mode(
    stiffness: ComplexArray,
    damping: ComplexArray,
    force: Callable[[complex], Matrix],
    start: tuple[complex, ComplexArray],
) -> tuple[complex, ComplexArray]:
    """Return the eigenvalue and shape, in modes of unit mass, with the aerodynamic force at this eigenvalue."""
    pair = start
    for _ in range(ITERATIONS):
        found = _nearest(stiffness, damping, force(pair[0]), pair)
        if abs(found[0] - pair[0]) <= SETTLED * abs(found[0]):
            return found
        pair = found
    return pair


def _nearest(
    stiffness: ComplexArray, damping: ComplexArray, force: ComplexArray, near: tuple[complex, ComplexArray]
) -> tuple[complex, ComplexArray]:
    """Return the eigenvalue with positive frequency whose shape is closest to a given one, and the shape."""
    n = len(stiffness)
    zero, one = np.zeros((n, n)), np.eye(n)
    values, vectors = np.linalg.eig(np.block([[zero, one], [force - stiffness, -damping]]))
    shapes = vectors[:n] / np.linalg.norm(vectors[:n], axis=0)
    like = np.abs(near[1].conj() @ shapes)
    like[values.imag <= 0] = -1.0
    best = int(like.argmax())
    return complex(values[best]), shapes[:, best]


def least_stable_curve(
    influence: InfluenceCoefficients,
    angles: FloatArray,
    waves: Sequence[tuple[FloatArray, ComplexArray]],
    phase_angles: FloatArray,
    reference: float,
) -> FloatArray:
    """Return the aerodynamic damping ratio (n, a) of each mode at any inter-blade phase angle, by the energy method.

    Parameters
    ----------
    influence
        Coefficients of one speed.
    angles
        (a,) inter-blade phase angles, rad.
    waves
        Frequencies (n,), rad/s, and amplitudes (n, m) of the modes at the phase angles of the wheel.
    phase_angles
        (w,) phase angles of the wheel, rad.
    reference
        Frequency of the frozen form, rad/s, as in `Feedback`.

    Notes
    -----
    Between two waves, frequency and amplitudes of a mode are interpolated linearly in the angle; the coefficients are
    exact.
    """
    turn = 2 * np.pi
    order = np.argsort(np.mod(phase_angles, turn))
    known = np.mod(phase_angles, turn)[order]
    wrapped = np.concatenate([known[-1:] - turn, known, known[:1] + turn])
    own = [waves[i] for i in order]
    own = [own[-1], *own, own[0]]
    omegas = np.array([frequencies for frequencies, _ in own])
    work = np.array([np.einsum("ni,nj->nij", amplitudes, amplitudes.conj()) for _, amplitudes in own])
    out = np.empty((omegas.shape[1], angles.size))
    for a, angle in enumerate(np.mod(angles, turn)):
        right = int(np.clip(np.searchsorted(wrapped, angle), 1, wrapped.size - 1))
        share = (angle - wrapped[right - 1]) / (wrapped[right] - wrapped[right - 1])
        omega = (1 - share) * omegas[right - 1] + share * omegas[right]
        outer = (1 - share) * work[right - 1] + share * work[right]
        for n in range(omega.size):
            if np.any(outer[n]):
                G = influence.force(float(angle), float(omega[n]), reference)
                out[n, a] = -np.sum(G * outer[n].T).imag / (2 * omega[n] ** 2)
            else:
                out[n, a] = 0.0
    return out
