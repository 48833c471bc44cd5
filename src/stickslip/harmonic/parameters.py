"""The periodic problem as a function of any parameter: a load level, a field of the contact laws, or a user's function.

A family returns the harmonic balance for each value of the parameter. All members have the scales of the first one, so
that an unknown means the same displacement for every value. Residual and Jacobian are exact; the derivative of the
residual by the parameter is a central difference. This is exact for loads, and it only sets the direction of a branch,
never a solution.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.operators import Jacobian

BalanceAt = Callable[[float], HarmonicBalance]
LoadPart = Literal["excitation", "static_load"]

DIFFERENCE = 1e-5  # relative to the parameter: about the cube root of the rounding error
KEPT = 8  # cached members of a family


@dataclass(frozen=True, eq=False)
class ParameterLinearisation:
    """Residual and derivatives at one state and one value of the parameter; `jac_p` is computed at first use."""

    residual: FloatArray
    jac: Jacobian
    seconds_contact: float
    by_parameter: Callable[[], FloatArray]

    @cached_property
    def jac_p(self) -> FloatArray:
        """(size,) derivative of the residual by the parameter."""
        return self.by_parameter()


@dataclass(frozen=True, eq=False)
class AtFrequency:
    """The periodic problem at one frequency as an equation in another parameter, for continuation.

    Parameters
    ----------
    family
        Function from the parameter to the harmonic balance.
    omega
        Frequency, rad/s.
    """

    family: BalanceAt
    omega: float

    def linearise(self, x: FloatArray, p: float) -> ParameterLinearisation:
        """Evaluate at scaled unknowns `x` and the value `p` of the parameter."""
        at = self.family(p).linearise(x, self.omega)
        return ParameterLinearisation(
            at.residual, at.jac, at.seconds_contact, lambda: by_parameter(self.family, x, self.omega, p)
        )


def by_parameter(family: BalanceAt, x: FloatArray, omega: float, p: float) -> FloatArray:
    """Return the (size,) derivative of the residual by the parameter at fixed `x` and `omega`."""
    return difference(lambda v: family(v).linearise(x, omega).residual, p)


def difference(function: Callable[[float], FloatArray], p: float) -> FloatArray:
    """Return the derivative of `function` at `p` by a central difference.

    It is one-sided at p = 0, because most parameters must not be negative.
    """
    step = DIFFERENCE * abs(p)
    if step == 0.0:
        return (function(DIFFERENCE) - function(0.0)) / DIFFERENCE
    return (function(p + step) - function(p - step)) / (2.0 * step)


def load_level(balance: HarmonicBalance, part: LoadPart) -> BalanceAt:
    """Return the family whose parameter is a factor on the harmonic or on the static load.

    Parameters
    ----------
    balance
        The problem at factor one.
    part
        ``excitation``: all harmonics; ``static_load``: the static forces.
    """
    load = balance.linear.load

    @lru_cache(maxsize=KEPT)
    def member(factor: float) -> HarmonicBalance:
        if part == "excitation":
            scaled = HarmonicLoad(load.static, {h: factor * f for h, f in load.harmonics.items()})
        else:
            scaled = HarmonicLoad(factor * load.static, load.harmonics)
        return replace(balance, linear=balance.linear.with_load(scaled))

    return member


def law_field(balance: HarmonicBalance, name: str) -> BalanceAt:
    """Return the family whose parameter is a field of the contact laws, such as ``mu``, ``preload`` or ``initial_gap``.

    Parameters
    ----------
    balance
        The problem; other fields keep their values.
    name
        Field of the laws. For a law with normal stiffness and preload but without a field ``initial_gap``, that value
        is converted to the preload ``-k_n initial_gap``.

    Raises
    ------
    InputError
        If no law has the field.
    """
    laws = balance.interface.laws
    if not any(_has(law, name) for law in laws):
        known = sorted({f for law in laws for f in _fields(law)})
        raise input_error(
            "parameter",
            f"{name!r} is no field of the contact laws",
            f"Give 'excitation', 'static_load', or one of {', '.join(known)}.",
        )

    @lru_cache(maxsize=KEPT)
    def member(value: float) -> HarmonicBalance:
        varied = tuple(_with(law, name, value) if _has(law, name) else law for law in laws)
        interface = replace(balance.interface, laws=varied)
        compiled = interface.compiled(balance.compiled.evaluator)
        return replace(balance, interface=interface, compiled=compiled)

    return member


def rebuilt(build: BalanceAt, first: float) -> BalanceAt:
    """Return the family of balances that `build` makes, all with the scales of the balance at `first`.

    Raises
    ------
    InputError
        If the unknowns of a member differ from those of the first one.
    """
    reference = build(first)

    @lru_cache(maxsize=KEPT)
    def member(value: float) -> HarmonicBalance:
        made = build(value)
        if not np.array_equal(made.linear.retained, reference.linear.retained):
            raise input_error(
                "parameter",
                f"the retained dofs differ between {value:g} and {first:g}",
                "Keep contacts and dofs the same for all values.",
            )
        return replace(made, displacement_scale=reference.displacement_scale, force_scale=reference.force_scale)

    return member


def _fields(law: ContactLaw) -> set[str]:
    return {f.name for f in fields(law)}  # type: ignore[arg-type]  # laws are dataclasses


def _has(law: ContactLaw, name: str) -> bool:
    own = _fields(law)
    return name in own or (name == "initial_gap" and {"preload", "k_n"} <= own)


def _with(law: ContactLaw, name: str, value: float) -> ContactLaw:
    if name in _fields(law):
        return replace(law, **{name: value})  # type: ignore[type-var]  # a dataclass: it has fields
    # a clearance acts as a negative preload
    return replace(law, preload=-law.stuck_stiffness()[2] * value)  # type: ignore[type-var]
