"""Protocol of contact laws: parameters in a frozen dataclass, behaviour in one compiled step.

The step maps displacement, velocity and state at one sample of one contact to force and new state, with the derivatives
of this map. It has no data of its own, so that the same law serves harmonic balance and the static preload. All steps
have the same signature: the marching code is compiled once for this signature and receives the step as a first-class
function. For a law in a user's script, only its step is compiled.
"""

from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass, replace
from functools import cached_property
from importlib import import_module
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.errors import input_error
from stickslip.units import quantity_of

STICK, SLIP, OPEN = 0, 1, 2  # status of a tangent

# Derivative blocks of a contact, force by gap, in the order of `ContactPeriod.blocks`; a law fills the first 5, 7 or 9.
TT, WW, NN, TN, WN, TW, WT, NT, NW = range(9)
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 2), (1, 2), (0, 1), (1, 0), (2, 0), (2, 1))
UNCOUPLED_TANGENTS, COUPLED_TANGENTS, FULLY_COUPLED = 5, 7, 9


class ContactLaw(Protocol):
    """Protocol of contact laws; frozen dataclasses implement it.

    Attributes
    ----------
    kernel
        Step compiled by `law_kernel`.
    pairs
        Number of derivative blocks that can differ from zero: 5 if the tangents are independent, 7 if they are coupled, 9 if the
        normal force also depends on them.
    """

    @property
    def kernel(self) -> Any: ...  # noqa: D102

    @property
    def pairs(self) -> int: ...  # noqa: D102

    def parameters(self) -> FloatArray:
        """Return the (n_parameters,) array passed to the step.

        Its length is the same for all laws of a class with the same number of states.
        """
        ...

    def initial_state(self) -> FloatArray:
        """Return the (n_state,) state before t = 0; NaN entries are replaced by one step at the last sample before t = 0."""
        ...

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n of the contact that neither slips nor opens, N/m."""
        ...


MEMBERS = ("kernel", "pairs", "parameters", "initial_state", "stuck_stiffness")  # of a law

Law = TypeVar("Law", bound=ContactLaw)


def check_law_members(place: str, law: object) -> None:
    """Refuse an object that is not a contact law, before any computation.

    Parameters
    ----------
    place
        Name of the contact's law, for the message.
    law
        The object.

    Raises
    ------
    InputError
        If it is a class or not a dataclass, or lacks a member.
    """
    name = law.__name__ if isinstance(law, type) else type(law).__name__
    if isinstance(law, type):
        raise input_error(place, f"is the class {name}", f"Make one: {name}(...), with its parameters.")
    if isinstance(law, str):
        raise input_error(
            place, f"is the text {law!r}", "Give a law with its parameters: stickslip.Jenkins(k_t=2e4, limit=2.0)."
        )
    known = dir(law)  # `dir` does not read the kernel, which would compile it
    lacking = [] if isinstance(law, Rigid) else [member for member in MEMBERS if member not in known]
    if lacking:
        remedy = "docs/extending.md shows a law; stickslip.contact.check_law tries one."
        raise input_error(place, f"is a {name}, which has no {', '.join(lacking)}", remedy)
    if not is_dataclass(law):
        raise input_error(
            place, f"is a {name}, which is no dataclass", "Write @dataclass(frozen=True) above its class."
        )


def scaled(law: Law, factor: float) -> Law:
    """Return the law whose forces are `factor` times those of `law`.

    The factor is a share of an interface, or the area for a law per area.

    Parameters
    ----------
    law
        A dataclass whose force-like fields are marked as ``shared`` (`stickslip.units.quantity`); a field ``preload``
        always counts.
    factor
        Above zero.

    Raises
    ------
    InputError
        If the factor is not 1 and no field is marked.
    """
    if factor == 1.0:
        return law
    changed: dict[str, Any] = {}
    for entry in fields(law):  # type: ignore[arg-type]
        known, value = quantity_of(entry), getattr(law, entry.name)
        if value is not None and (entry.name == "preload" or (known is not None and known.shared)):
            own = np.asarray(value) * factor
            changed[entry.name] = tuple(own.tolist()) if own.ndim else float(own)
    if not changed:
        raise input_error(
            type(law).__name__,
            "does not say which of its parameters are shared among contact points",
            "Mark stiffnesses and forces with stickslip.units.quantity(..., shared=True), or give the law of each point.",
        )
    return replace(law, **changed)  # type: ignore[type-var]


@runtime_checkable
class Restoring(Protocol):
    """A law without memory whose force may oppose large displacements although its stiffness at rest is zero."""

    def restores(self) -> BoolArray:
        """Return the (3,) directions t, w, n along which the force opposes every large displacement."""
        ...


def holding_directions(law: ContactLaw) -> BoolArray:
    """Return the (3,) directions t, w, n along which a closed, sticking contact opposes displacements."""
    holds = law.stuck_stiffness() > 0.0
    return holds | law.restores() if isinstance(law, Restoring) else holds


@runtime_checkable
class Rigid(Protocol):
    """A law whose force is not a function of its gap: a sticking contact does not move, and its force is a reaction.

    Attributes
    ----------
    mu
        Friction coefficient.
    preload
        Constant normal load, N; None: the normal force is a reaction as well.
    initial_gap
        Normal gap at zero displacement, m.
    """

    @property
    def mu(self) -> float: ...  # noqa: D102

    @property
    def preload(self) -> float | None: ...  # noqa: D102

    @property
    def initial_gap(self) -> float: ...  # noqa: D102

    def softened(self, stiffness: float) -> ContactLaw:
        """Return the law with springs of `stiffness` (N/m), which tends to this law as `stiffness` grows."""
        ...


def softened(laws: Iterable[ContactLaw], stiffness: float) -> tuple[ContactLaw, ...]:
    """Return the laws with springs of `stiffness` (N/m) instead of rigid contacts."""
    return tuple(law.softened(stiffness) if isinstance(law, Rigid) else law for law in laws)


def held_stiffness(laws: Iterable[ContactLaw], holds: BoolArray, rigid: float) -> FloatArray:
    """Return the (3 p,) stiffnesses t, w, n in N/m of p contacts: zero where `holds` (p,) is False.

    Rigid laws have the stiffness `rigid`.
    """
    own = zip(softened(laws, rigid), holds, strict=True)
    rows = [law.stuck_stiffness() if held else np.zeros(3) for law, held in own]
    return np.array(rows, dtype=float).reshape(-1)


@runtime_checkable
class PiecewiseLinear(Protocol):
    """A law that is a sum of elementary contacts; a period is evaluated by intervals or exact events."""

    def elements(self) -> FloatArray:
        """Return (n_elements, 7) rows k_t, k_w, k_n, mu, preload, residual traction or NaN, unilateral; see `contact.element`."""
        ...


@runtime_checkable
class PlanarFriction(Protocol):
    """A law with isotropic planar friction; a period is evaluated at located events."""

    def planar(self) -> FloatArray | None:
        """Return the (4,) tangential stiffness, normal stiffness, friction coefficient and preload; None: the law is marched."""
        ...


@runtime_checkable
class NormalContact(Protocol):
    """A law of planar friction with the normal force of a piecewise-linear contact, whose transitions can be located.

    Attributes
    ----------
    mu
        Friction coefficient.
    """

    @property
    def mu(self) -> float: ...  # noqa: D102

    def normal_contact(self) -> PiecewiseLinear | None:
        """Return the law without friction; None if the normal force is constant."""
        ...


@runtime_checkable
class ResidualTraction(Protocol):
    """A law with sliders that may start from a given traction."""

    def unstretched(self) -> ContactLaw:
        """Return the law without a residual traction at rest."""
        ...


@runtime_checkable
class PressedOrOpen(Protocol):
    """A law whose state at rest is either a preload or a clearance, never both."""

    def at_rest(self, preload: float, gap: float) -> ContactLaw:
        """Return the law with a further normal force, N, and a further clearance, m, at rest."""
        ...


def law_kernel(step: Callable[..., None]) -> Any:
    """Compile the step of a law.

    Parameters
    ----------
    step
        Function ``step(displacement, velocity, state, parameters, force, new_state, jac, status)`` that numba can
        compile. It reads the first four and fills the others: ``force`` (3,) = (T_t, T_w, -N) in N, ``new_state``
        (n_state,), ``jac`` (3 + n_state, 6 + n_state) derivatives of force and new state by displacement, velocity and
        state (zero on entry), ``status`` (2,) of each tangent: 0 stick, 1 slip, 2 open.

    Returns
    -------
    object
        Value of the class attribute `kernel` of the law, without an annotation; the step is compiled when the attribute
        is first read.

    Notes
    -----
    The compiled code is stored on disk beside the file of the step. A step typed at a prompt has no file and is
    compiled in every session.
    """
    return _Kernel(step)


def kernel_in(name: str) -> Any:
    """Return the kernel of a step in ``contact/steps``.

    Its module is imported, with numba, when the kernel is first read.
    """
    return _Kernel(name)


class _Kernel:
    """Descriptor that compiles or loads a step when the kernel is first read, after the check of a study file."""

    def __init__(self, step: Callable[..., None] | str) -> None:
        self.step = step

    def __get__(self, law: object, cls: type) -> Any:
        return self.compiled

    @cached_property
    def compiled(self) -> Any:
        if isinstance(self.step, str):
            return import_module(f"stickslip.contact.steps.{self.step}").step
        from stickslip.contact.addresses import compiled_step

        return compiled_step(self.step)
