"""Coulomb friction on a rigid unilateral contact: the law, and its forces over one period by projection.

The predicted force ``p`` would keep the contact as it is: it is the force that equilibrium requires, plus a penalty
times the forbidden motion, sliding along the tangents and penetration along the normal. Coulomb's and Signorini's laws
are then projections without memory, ``N = max(0, -p_n)`` and ``T = min(max(p_t, -mu N), mu N)``. A projection
multiplies each sample by 0 or 1, so that a derivative block contains products of the Fourier basis with a weight:
Toeplitz and Hankel parts of the weight's spectrum.
"""

from dataclasses import dataclass
from typing import ClassVar, NoReturn

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.element import element_step
from stickslip.contact.law import NN, OPEN, SLIP, STICK, TN, TT, UNCOUPLED_TANGENTS
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.quantities import check_not_negative, friction_coefficient
from stickslip.errors import InputError, input_error
from stickslip.units import check_quantities


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidCoulomb:
    """Set-valued Coulomb friction and Signorini's condition (Nacivet et al. 2003).

    The law is the limit of `ElasticCoulomb` for infinite stiffness. Each tangent sticks without moving while its force
    stays below ``mu N``, and slips against ``mu N`` otherwise. The force is not a function of the gap: harmonic balance
    cannot evaluate it, and `dynamic_lagrangian` solves for it.

    Parameters
    ----------
    mu
        Friction coefficient, the same for both tangents, which are independent.
    preload
        None: the normal direction is rigid and unilateral, ``g + initial_gap >= 0``, ``N >= 0``, one of them zero, and
        N follows from equilibrium. A preload is then part of the static load, or an interference. A number: a constant
        normal load N_0 in N presses the contact at all times, the limit is ``mu N_0``, and the normal direction is
        free.
    initial_gap
        Normal gap at zero displacement, m; negative for an interference.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range, or both a constant load and a gap are given.
    """

    mu: float = friction_coefficient()
    preload: float | None = None
    initial_gap: float = 0.0

    kernel = element_step
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_not_negative(self, "preload")
        if self.preload is not None and self.initial_gap != 0.0:
            raise input_error(
                "RigidCoulomb",
                f"has a constant normal load of {self.preload:g} N and a gap of {self.initial_gap:g} m",
                "Leave out one of them: a contact under a constant load never opens.",
            )

    def softened(self, stiffness: float) -> ElasticCoulomb | Jenkins:
        """Return the penalty law that tends to this law as `stiffness` (N/m) grows."""
        if self.preload is not None:
            return Jenkins(k_t=stiffness, k_w=stiffness, limit=self.mu * self.preload)
        return ElasticCoulomb(
            k_t=stiffness if self.mu > 0.0 else 0.0,
            k_w=stiffness if self.mu > 0.0 else 0.0,
            k_n=stiffness,
            mu=self.mu,
            preload=-stiffness * self.initial_gap,
        )

    def parameters(self) -> NoReturn:
        """Refuse: the force does not follow from a gap."""
        raise self._refusal()

    def initial_state(self) -> NoReturn:
        """Refuse: the force does not follow from a gap."""
        raise self._refusal()

    def stuck_stiffness(self) -> FloatArray:
        """Refuse: the stiffness is infinite."""
        raise self._refusal()

    def _refusal(self) -> InputError:
        return input_error(
            "RigidCoulomb",
            "has no stiffness, its force is no function of the gap",
            "Solve with dynamic_lagrangian, or take RigidCoulomb.softened(stiffness).",
        )


ROUNDING = 1e-9  # relative excess over the limit below which a force counts as not slipping


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
        (n_contacts, 5, m, m) derivatives of the force coefficients by the coefficients of the predictions; order TT,
        WW, NN, TN, WN.
    stuck
        (n_contacts, 2) tangents that stick throughout the period.
    """

    force: FloatArray
    state: IntArray
    blocks: FloatArray
    stuck: BoolArray


def project(predicted: FloatArray, mu: FloatArray, constant: FloatArray, order: int) -> RigidPeriod:
    """Project predicted forces onto the forces allowed by Coulomb's and Signorini's laws.

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
    """Return the (n, m, m) matrices that multiply a signal by `weight` (n, samples), in Fourier coefficients."""
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
