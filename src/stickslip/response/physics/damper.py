"""Largest damping by friction and the shifted frequency of a mode, by describing functions.

Every contact that slips is a spring of the complex stiffness ``k η(x)``, with one slip ratio x of all contacts: the amplitude of their gaps over
that at which they begin to slip. From stuck (x = 1) to sliding (x large) each mode is followed by its shape. It is an estimate, no bound: for
chains of masses it was right within a factor of 1.5, where normal loads stay as they are.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.response.physics.friction import Friction
from stickslip.response.physics.modes import Range, modes_up_to
from stickslip.response.system import System
from stickslip.units import HZ

SLIP_RATIOS = np.geomspace(1.0, 1e4, 20)  # amplitude over that at which slip begins
BEYOND = 1.3  # frequencies of modes that span the motions, over the highest of the range
INDEPENDENT = 1e-10  # least share of a motion that the others do not span
SMALLEST_DAMPING = 1e-4  # ratio below which friction does nothing that is worth a word


def complex_stiffness(ratio: float) -> complex:
    """Return the stiffness of a spring with a slider over that of the spring: its first harmonic at an amplitude of `ratio` times that at which it slips."""
    if ratio <= 1.0:
        return 1.0 + 0.0j
    angle = np.arccos(1.0 - 2.0 / ratio)
    return complex((angle - 0.5 * np.sin(2.0 * angle)) / np.pi, 4.0 / np.pi * (ratio - 1.0) / ratio**2)


@dataclass(frozen=True)
class DampedMode:
    """What friction can do to a mode.

    Attributes
    ----------
    stuck, ends
        Frequency of the excitation with contacts stuck and with contacts that slide freely, rad/s.
    best
        Where friction damps it most, rad/s.
    ratio
        Damping ratio by friction there.
    """

    stuck: float
    best: float
    ratio: float
    ends: float

    def apart(self, omega: float) -> float:
        """Return how far a frequency in rad/s lies from those between sticking and sliding."""
        low, high = sorted((self.stuck, self.ends))
        return max(low - omega, omega - high, 0.0)

    def __str__(self) -> str:
        stuck, best, ends = (omega / HZ for omega in (self.stuck, self.best, self.ends))
        damping = f"up to {100 * self.ratio:.2g} % of critical at {best:.2f} Hz"
        return f"the mode at {stuck:.2f} Hz (sticking) by {damping}, on its way to {ends:.2f} Hz (sliding)"


def damped_modes(
    system: System, friction: Friction, springs: FloatArray, harmonic: int, within: Range
) -> list[DampedMode]:
    """Return what friction can do to the modes that pass a range of frequencies.

    Parameters
    ----------
    system
        What vibrates; along an engine-order line at the middle of the range.
    friction
        Of its contacts.
    springs
        (3 n_contacts,) stiffnesses with contacts stuck, N/m.
    harmonic
        That drives the modes.
    within
        Frequencies of the excitation.

    Notes
    -----
    Motions are spanned by the modes with contacts stuck and those with contacts sliding, up to `BEYOND` of the range.
    """
    here = system.at(within.middle)
    slips = friction.slips & (springs > 0.0)
    if not slips.any():
        return []
    highest = BEYOND * harmonic * within.highest
    shapes = [
        m.shape for own in (springs, np.where(slips, 0.0, springs)) for m in modes_up_to(here, highest, own, harmonic)
    ]
    if not shapes:
        return []
    structure, gaps = here.structure.of_harmonic(harmonic), here.interface.gap_operator
    way = _spanned(structure.mass, np.array(shapes).T)
    moved = gaps @ way
    stiffness = way.conj().T @ (structure.stiffness @ way)
    rest, slider = (
        (moved.conj().T * own) @ moved for own in (np.where(slips, 0.0, springs), np.where(slips, springs, 0.0))
    )
    squares = _followed(0.5 * (stiffness + stiffness.conj().T) + rest, slider)
    roots = np.sqrt(squares) / harmonic
    damping = roots.imag / np.abs(roots)
    found = []
    for omega, ratio in zip(np.abs(roots).T, damping.T, strict=True):
        top = int(np.argmax(ratio))
        inside = [within.holds(omega[k]) for k in (0, top)]
        if any(inside) and ratio[top] > SMALLEST_DAMPING:
            found.append(DampedMode(float(omega[0]), float(omega[top]), float(ratio[top]), float(omega[-1])))
    return found


def _spanned(mass: ComplexArray, shapes: ComplexArray) -> ComplexArray:
    """Return motions of unit mass that span the shapes."""
    square, turn = np.linalg.eigh(shapes.conj().T @ (mass @ shapes))
    kept = square > INDEPENDENT * square[-1]
    return np.asarray(shapes @ (turn[:, kept] / np.sqrt(square[kept])))


def _followed(rest: ComplexArray, slider: ComplexArray) -> ComplexArray:
    """Return the (20, m) squares of the frequencies of each mode from stuck to sliding."""
    values, vectors = np.linalg.eigh(rest + slider)
    every = [values.astype(complex)]
    for ratio in SLIP_RATIOS[1:]:
        own, shapes = np.linalg.eig(rest + complex_stiffness(float(ratio)) * slider)
        shapes = shapes / np.linalg.norm(shapes, axis=0)
        order = _partners(np.abs(vectors.conj().T @ shapes))
        vectors = shapes[:, order]
        every.append(own[order])
    return np.array(every)


def _partners(alike: FloatArray) -> IntArray:
    """Return for each row the column that it is most alike, none twice."""
    order = np.zeros(len(alike), dtype=np.int64)
    alike = alike.copy()
    for _ in order:
        row, column = np.unravel_index(int(np.argmax(alike)), alike.shape)
        order[row] = column
        alike[row, :] = alike[:, column] = -1.0
    return order
