"""Rigid contacts over one period: predicted forces projected on the contact laws.

The prediction ``p`` is the force that would keep the contact as it is: the force that equilibrium asks for, plus a penalty times what
the laws forbid, sliding along the tangents and penetration along the normal. Coulomb's and Signorini's laws are then projections,
``N = max(0, -p_n)`` and ``T = min(max(p_t, -mu N), mu N)``, which hold nothing of the past. A projection multiplies by 0 or 1 at
each sample, so that a derivative block is a matrix of products of the Fourier basis with a weight: Toeplitz and Hankel parts of its
spectrum.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.law import NN, OPEN, SLIP, STICK, TN, TT, UNCOUPLED_TANGENTS

ROUNDING = 1e-9  # share of the limit by which a force that only touches it may exceed it


@dataclass(frozen=True, eq=False)
class RigidPeriod:
    """Corrected forces over one period.

    Attributes
    ----------
    force
        (n_contacts, 3, samples) forces (T_t, T_w, -N), N.
    state
        (n_contacts, 2, samples): 0 stick, 1 slip, 2 open.
    blocks
        (n_contacts, 5, m, m) derivatives of the coefficients of the forces by those of the predictions; order TT, WW, NN, TN, WN.
    stuck
        (n_contacts, 2) tangents that stick throughout the period.
    """

    force: FloatArray
    state: IntArray
    blocks: FloatArray
    stuck: BoolArray


def project(predicted: FloatArray, mu: FloatArray, constant: FloatArray, order: int) -> RigidPeriod:
    """Project predicted forces on the forces that Coulomb's and Signorini's laws allow.

    Parameters
    ----------
    predicted
        (n_contacts, 3, samples) predicted forces t, w, n, N.
    mu
        (n_contacts,) friction coefficients.
    constant
        (n_contacts,) constant normal loads, N; NaN if the contact is unilateral, with the predicted normal force.
    order
        Highest harmonic of the derivatives.
    """
    unilateral = np.isnan(constant)[:, None]
    normal = np.where(unilateral, np.maximum(-predicted[:, 2], 0.0), constant[:, None])
    limit = mu[:, None] * normal
    tangential = predicted[:, :2]
    sign = np.sign(tangential)
    slips = np.abs(tangential) > limit[:, None] * (1.0 + ROUNDING)
    force = np.empty_like(predicted)
    force[:, :2] = np.where(slips, sign * limit[:, None], tangential)
    force[:, 2] = np.where(unilateral, -normal, 0.0)
    pressed = unilateral & (normal > 0.0)
    is_open = unilateral & (normal <= 0.0)
    state = np.where(is_open[:, None], OPEN, np.where(slips, SLIP, STICK))
    m = 2 * order + 1
    blocks = np.empty((predicted.shape[0], UNCOUPLED_TANGENTS, m, m))
    blocks[:, NN] = weighted_products(pressed.astype(float), order)
    for d in range(2):
        blocks[:, TT + d] = weighted_products((~slips[:, d]).astype(float), order)
        by_normal = -mu[:, None] * sign[:, d] * (slips[:, d] & pressed)
        blocks[:, TN + d] = weighted_products(by_normal, order)
    return RigidPeriod(force, state, blocks, ~np.any(slips | is_open[:, None], axis=2))


def weighted_products(weight: FloatArray, order: int) -> FloatArray:
    """Return the (n, m, m) matrices from the Fourier coefficients of a signal to the coefficients of `weight` (n, samples) times the signal."""
    samples = weight.shape[1]
    spectrum = np.fft.fft(weight, axis=1)[:, np.arange(2 * order + 1) % samples] / samples
    cos, sin = spectrum.real, -spectrum.imag
    h = np.arange(1, order + 1)
    apart, sign = np.abs(h[:, None] - h), np.sign(h[:, None] - h)
    both = h[:, None] + h
    out = np.empty((weight.shape[0], 2 * order + 1, 2 * order + 1))
    out[:, 0, 0] = cos[:, 0]
    out[:, 0, 1::2], out[:, 0, 2::2] = cos[:, h], sin[:, h]
    out[:, 1::2, 0], out[:, 2::2, 0] = 2.0 * cos[:, h], 2.0 * sin[:, h]
    out[:, 1::2, 1::2] = cos[:, apart] + cos[:, both]
    out[:, 2::2, 2::2] = cos[:, apart] - cos[:, both]
    out[:, 2::2, 1::2] = sin[:, both] + sign * sin[:, apart]
    out[:, 1::2, 2::2] = sin[:, both] - sign * sin[:, apart]
    return out
