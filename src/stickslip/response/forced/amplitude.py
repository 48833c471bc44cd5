"""Definition of the amplitude of a response, and of its relative error."""

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.selection.strategy import ErrorMeasure
from stickslip.model.structure import ROTATIONS
from stickslip.response.forced.choices import AmplitudeOf
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System

SAMPLES_A_HARMONIC = 16  # in a period; Newton's method starts at the highest sample
REFINED = 4  # Newton steps


def amplitudes(motion: ComplexArray, driven: Harmonics, of: AmplitudeOf) -> FloatArray:
    """Return the (k,) amplitudes of k displacements.

    Parameters
    ----------
    motion
        (H+1, k) complex coefficients, m.
    driven
        Harmonics that the load drives.
    of
        ``first``: amplitude of the driven harmonic, or the norm of several. ``half_peak_to_peak``: half the distance
        from the smallest to the largest displacement in a period. ``rms``: root mean square about the mean.
    """
    if of == "first":
        rows = [h for h in driven if h < len(motion)]
        return np.asarray(np.linalg.norm(motion[rows], axis=0))
    if of == "rms":
        return np.asarray(np.sqrt(0.5) * np.linalg.norm(motion[1:], axis=0))
    return np.asarray(0.5 * (extremes(motion) + extremes(-motion)))


def extremes(motion: ComplexArray) -> FloatArray:
    """Return the (k,) largest displacements in a period about the mean, m, of complex coefficients (H+1, k)."""
    h = np.arange(1, len(motion))[:, None]
    count = SAMPLES_A_HARMONIC * max(len(motion) - 1, 1)
    angles = 2 * np.pi * np.arange(count) / count
    signal = np.real(np.exp(1j * np.outer(angles, h)) @ motion[1:])
    at = angles[np.argmax(signal, axis=0)]
    for _ in range(REFINED):
        turned = motion[1:] * np.exp(1j * h * at)
        slope, bend = (np.sum((1j * h) ** d * turned, axis=0).real for d in (1, 2))
        step = np.divide(slope, bend, out=np.zeros_like(slope), where=bend < 0.0)
        at = at - np.clip(step, -0.5 * angles[1], 0.5 * angles[1])
    found = np.sum(motion[1:] * np.exp(1j * h * at), axis=0).real
    return np.asarray(np.maximum(found, signal.max(axis=0)))


def error_measure(
    system: System, sweep: Sweep, driven: Harmonics, dofs: IntArray, places: IntArray | None = None
) -> ErrorMeasure:
    """Return the error measure over `dofs`.

    `places` are their positions among the compared dofs, unless all dofs are compared.

    If the amplitude includes more than the driven harmonics, all harmonics except the mean count.
    """
    at = dofs if places is None else places
    chosen = driven if sweep.error_harmonics is None else tuple(sweep.error_harmonics)
    if sweep.relative_to == "each":
        return ErrorMeasure(at, chosen)
    every = sweep.error_harmonics is None and sweep.amplitude_of != "first"
    turns = np.isin(np.array(system.structure.dofs.component)[dofs], ROTATIONS)
    return ErrorMeasure(at, None if every else chosen, turns.astype(np.int64))
