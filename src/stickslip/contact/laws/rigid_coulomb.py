"""Coulomb friction on a rigid unilateral contact: no stiffness anywhere."""

from dataclasses import dataclass
from typing import ClassVar, NoReturn

from stickslip.arrays import FloatArray
from stickslip.contact.element import element_step
from stickslip.contact.law import UNCOUPLED_TANGENTS
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.quantities import check_not_negative, friction_coefficient
from stickslip.errors import InputError, input_error
from stickslip.units import check_quantities


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidCoulomb:
    """Set-valued Coulomb friction and Signorini's condition (Nacivet et al. 2003): the limit of `ElasticCoulomb` as it stiffens.

    Each tangent sticks without moving while its force stays below ``mu N``, and slips against ``mu N`` otherwise. The force is no
    function of the gap: harmonic balance cannot evaluate it, and `dynamic_lagrangian` solves for it.

    Parameters
    ----------
    mu
        Friction coefficient, the same for both tangents, which are independent.
    preload
        None: the normal direction is rigid and unilateral, ``g + initial_gap >= 0``, ``N >= 0``, one of them zero, and N follows from
        equilibrium. A preload then comes with the static load, or as interference. A number: a constant normal load N_0 in N presses
        the contact at all times, the limit is ``mu N_0``, and the normal direction is free.
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
        """Return the penalty law that tends to this one as `stiffness` (N/m) grows."""
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
        """Refuse: there is no force to compute from a gap."""
        raise self._refusal()

    def initial_state(self) -> NoReturn:
        """Refuse: there is no force to compute from a gap."""
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
