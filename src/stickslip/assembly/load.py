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
        ``part`` (a rigid body, at its centre of mass), ``part.set`` (shared equally among its nodes), or a dof ``part.node12.x``.
    newton
        Resultant force, or its amplitude, N.
    direction
        Unit vector in global axes (of the sector, on a wheel); None where `on` is a single dof.
    harmonic
        0: static; h: ``Re(newton e^{i(h ω t + phase)})``.
    phase
        In rad.
    engine_order
        Engine order m on a wheel: harmonic h travels as the wave ``h m``; 0: all sectors alike; None for a single structure.
    omega, omega_ratio
        Frequency of a load with its own frequency, rad/s, or its ratio to the frequency of the other loads; the motion then has two
        frequencies. None: the frequency of the other loads.
    field
        Pressure on the facets of a surface instead of a force. `newton` is then a factor, 1 for the whole field. None: a force.

    Raises
    ------
    InputError
        If the harmonic or the engine order is no count, a number is not finite, or a static load has a phase or an own frequency.
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
        """Whether the load has its own frequency."""
        return self.omega is not None or self.omega_ratio is not None


@dataclass(frozen=True, kw_only=True)
class Output:
    """Point whose motion is reported.

    Parameters
    ----------
    name
        Name of the output; its labels are ``name.x`` and so on.
    on
        ``part.set`` (its first node), a dof ``part.node12.x``, or a part together with `near`.
    near
        (3,) place in m; the nearest node of the part `on` is taken.
    directions
        Reported components, from x, y, z, rx, ry, rz; empty: all components of the point.
    """

    name: str
    on: str
    near: tuple[float, float, float] | None = None
    directions: tuple[str, ...] = ()


def refuse_second(loads: Mapping[str, Load]) -> None:
    """Refuse loads with their own frequency in analyses of one frequency."""
    own = next((name for name, load in loads.items() if load.second), None)
    if own is not None:
        raise input_error(
            f"load.{own}",
            "has a frequency of its own: the motion has two",
            "Ask [quasi_periodic] for it, or leave frequency_hz and frequency_ratio out.",
        )
