"""Loads on a model, and its outputs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stickslip.assembly.fluid.pressure import PressureField
from stickslip.errors import input_error


@dataclass(frozen=True, kw_only=True)
class Load:
    """A static or harmonic force.

    Parameters
    ----------
    on
        ``part`` (a rigid body: at its centre of mass), ``part.set`` (shared equally among its nodes), or a dof ``part.node12.x``.
    newton
        The whole force, or its amplitude, N.
    direction
        Unit vector in global axes (of the sector, on a wheel); None where `on` is a single dof.
    harmonic
        0: static; h: ``Re(newton e^{i(h ω t + phase)})``.
    phase
        In rad.
    engine_order
        m of a wheel's excitation: harmonic h travels as the wave ``h m``, 0: all sectors alike; None for a single structure.
    omega, omega_ratio
        Of a load that acts with a frequency of its own, a motion of two frequencies: rad/s, or times that of the other loads. None: it acts with theirs.
    field
        Pressure on the facets of a surface in place of a force: `newton` is then its share, 1 for all of it; None: a force.

    Raises
    ------
    InputError
        If a number is no count or not finite, or a static load has a phase.
    """

    on: str
    newton: float
    direction: tuple[float, float, float] | None = None
    harmonic: int = 1
    phase: float = 0.0
    engine_order: int | None = None
    omega: float | None = None
    omega_ratio: float | None = None
    field: PressureField | None = None

    def __post_init__(self) -> None:
        for name, least in (("harmonic", 0), ("engine_order", 0)):
            value = getattr(self, name)
            if value is not None and (not isinstance(value, int | np.integer) or value < least):
                raise input_error(f"Load.{name}", f"must be an integer from {least} on, got {value!r}", "Give a count.")
        if not (math.isfinite(self.newton) and math.isfinite(self.phase)):
            raise input_error("Load", f"has {self.newton} N and a phase of {self.phase} rad", "Give finite numbers.")
        own = [v for v in (self.omega, self.omega_ratio) if v is not None]
        if len(own) > 1 or any(not (math.isfinite(v) and v > 0.0) for v in own) or (own and not self.harmonic):
            raise input_error(
                "Load.omega",
                f"is {self.omega} rad/s, its ratio {self.omega_ratio}, of a load in harmonic {self.harmonic}",
                "Give a load that vibrates one of them, above zero.",
            )
        if self.harmonic == 0 and self.phase:
            raise input_error(
                "Load.phase", f"is {self.phase:g} rad of a static load", "Leave it out, or give a harmonic from 1 on."
            )

    @property
    def second(self) -> bool:
        """Whether it acts with a frequency of its own."""
        return self.omega is not None or self.omega_ratio is not None


@dataclass(frozen=True, kw_only=True)
class Output:
    """A point whose motion is reported.

    Parameters
    ----------
    name
        Its labels are ``name.x`` and so on.
    on
        ``part.set`` (its first node), a dof ``part.node12.x``, or a part together with `near`.
    near
        (3,) place in m; the nearest node of the part `on` is taken.
    directions
        Of x, y, z, rx, ry, rz; those that the point has, if empty.
    """

    name: str
    on: str
    near: tuple[float, float, float] | None = None
    directions: tuple[str, ...] = ()


def refuse_second(loads: Mapping[str, Load]) -> None:
    """Refuse loads with a frequency of their own, where a motion has one frequency."""
    own = next((name for name, load in loads.items() if load.second), None)
    if own is not None:
        raise input_error(
            f"load.{own}",
            "has a frequency of its own: the motion has two",
            "Ask [quasi_periodic] for it, or leave frequency_hz and frequency_ratio out.",
        )
