"""Slider positions before t = 0: free, prescribed, or from a static state.

A spring whose slider never moves keeps its initial state for ever. The start is the slider position, the field
``slider`` of a law. Forces depend only on the gap minus this position, so that shifted gaps give the forces of any
start.
"""

from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.element import K_N, K_T, K_W, PRELOAD
from stickslip.contact.interface import Interface
from stickslip.contact.law import UNCOUPLED_TANGENTS, ContactLaw
from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.bouc_wen import BoucWen
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.dahl import Dahl
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import input_error

FORGETS = (BoucWen, Dahl)  # a mean force relaxes over many cycles, so that the steady force is unique


@dataclass(frozen=True, eq=False)
class Starts:
    """The springs of an interface whose initial slider position is free.

    Attributes
    ----------
    interface
        The interface with all springs unstretched at zero displacement, Iwan elements as Jenkins elements in parallel.
    given
        Interface with the initial positions of the model.
    first
        (n_contacts + 1,) contact c of the model consists of contacts first[c] to before first[c + 1] of `interface`.
    stiffness
        (n, 2) stiffness of each spring along t and w, N/m; zero if its start is not free.
    planar
        (n,) whether the friction force is limited as a vector in the plane.
    friction, constant
        (n,) parameters of the friction limit ``friction N + constant``, N being the normal force.
    """

    interface: Interface
    given: Interface
    first: IntArray
    stiffness: FloatArray
    planar: np.ndarray
    friction: FloatArray
    constant: FloatArray

    def limits(self, normal: FloatArray) -> FloatArray:
        """Return the friction limits, N, for normal forces (n, ...), which are positive in compression."""
        shape = (-1,) + (1,) * (normal.ndim - 1)
        pushed = self.friction.reshape(shape) * np.maximum(normal, 0.0)
        return np.asarray(pushed + self.constant.reshape(shape))

    def law(self, contact: int, slider: FloatArray) -> ContactLaw:
        """Return the law of a contact of `interface` with the initial slider position (2,), m."""
        own: Any = self.interface.laws[contact]
        if np.any(self.stiffness[contact]):
            own = replace(own, slider=(float(slider[0]), float(slider[1])))
        begun: ContactLaw = own
        return begun

    def started(self, sliders: FloatArray) -> Interface:
        """Return the interface with initial slider positions (n, 2), m."""
        laws = tuple(self.law(c, s) for c, s in enumerate(sliders))
        return replace(self.interface, laws=laws)


def starts_of(interface: Interface) -> Starts:
    """Return the springs of an interface whose initial slider position is free.

    Raises
    ------
    InputError
        If a contact is rigid, or a user's law has a state without a known initial position of its springs.
    """
    given: list[ContactLaw] = []
    of_contact = [0]
    for name, law in zip(interface.names, interface.laws, strict=True):
        given += _parts(name, law)
        of_contact.append(len(given))
    laws = [_without_start(law) for law in given]
    first = np.array(of_contact, dtype=np.int64)
    each = np.repeat(np.arange(interface.n_contacts), np.diff(first))
    names = tuple(
        interface.names[c] if b - a == 1 else f"{interface.names[c]}[{k}]"
        for c, (a, b) in enumerate(pairwise(of_contact))
        for k in range(b - a)
    )
    rows = (3 * each[:, None] + np.arange(3)).reshape(-1)
    operator = scipy.sparse.csr_array(interface.gap_operator)[rows]
    weights = None if interface.weights is None else interface.weights[each]
    has = [hasattr(law, "slider") for law in laws]
    stiffness = np.array(
        [law.stuck_stiffness()[:2] if own else np.zeros(2) for law, own in zip(laws, has, strict=True)]
    ).reshape(-1, 2)
    return Starts(
        Interface(names, tuple(laws), operator, weights),
        Interface(names, tuple(given), operator, weights),
        first,
        stiffness,
        np.array([own and law.pairs > UNCOUPLED_TANGENTS for law, own in zip(laws, has, strict=True)], dtype=bool),
        np.array([getattr(law, "mu", 0.0) if own else 0.0 for law, own in zip(laws, has, strict=True)]),
        np.array([getattr(law, "limit", 0.0) if own else 0.0 for law, own in zip(laws, has, strict=True)]),
    )


def _parts(name: str, law: ContactLaw) -> list[ContactLaw]:
    """Return the parallel laws of which a law consists."""
    if isinstance(law, Iwan):
        return [_of_element(row) for row in law.elements() if np.any(row[[K_T, K_W, K_N]])]
    if isinstance(law, RigidCoulomb):
        raise input_error(
            f"contact {name}",
            "is rigid: its force is no function of its gap, and has no spring that starts somewhere",
            "Give it a stiffness, such as elastic_coulomb has.",
        )
    known = _fields(law)
    if "slider" in known and not known & {"mu", "limit"}:
        raise input_error(
            f"contact {name}",
            f"is {type(law).__name__}, which has a slider and neither a field mu nor a field limit",
            "Name the friction coefficient mu, or the constant limit limit: it bounds what the spring may be stretched by.",
        )
    remembers = law.initial_state().size and not isinstance(law, (Bonded, *FORGETS))
    if "slider" not in known and remembers and _holds(law):
        raise input_error(
            f"contact {name}",
            f"is {type(law).__name__}, which remembers something and does not say where its springs start",
            "Give the law a field slider = (t, w), from which its springs are unstretched, and a field mu or limit.",
        )
    return [law]


def _fields(law: Any) -> set[str]:
    return {entry.name for entry in fields(law)} if is_dataclass(law) else set()


def _without_start(law: Any) -> ContactLaw:
    """Return a law whose springs are unstretched at zero displacement."""
    none: dict[str, None] = {n: None for n in ("slider", "residual_traction") if n in _fields(law)}
    without: ContactLaw = replace(law, **none) if none else law
    return without


def _holds(law: ContactLaw) -> bool:
    """Whether a law resists tangential displacement when stuck; with normal springs only, it keeps no traction."""
    return bool(np.any(law.stuck_stiffness()[:2] > 0.0))


def _of_element(row: FloatArray) -> ContactLaw:
    """Return an elementary contact with constant limit as a law."""
    k_t, k_w, k_n = (float(row[k]) for k in (K_T, K_W, K_N))
    if np.isinf(row[PRELOAD]):
        return Bonded(k_t=k_t, k_w=k_w, k_n=k_n)
    return Jenkins(k_t=k_t, k_w=k_w, k_n=k_n, limit=float(row[PRELOAD]))


OneSlider = ElasticCoulomb | CoupledCoulomb  # laws with one slider, whose limit follows the normal force


def freezable(name: str, law: ContactLaw) -> bool:
    """Return whether a law has a slider that can start from a static state; False for springs without a slider.

    Parameters
    ----------
    name
        Name of the contact, for messages.
    law
        Law of the contact.

    Raises
    ------
    InputError
        If the state of the law is more than one slider position, or the law prescribes its start.
    """
    if isinstance(law, OneSlider):
        if isinstance(law, ElasticCoulomb) and law.residual_traction is not None:
            raise input_error(
                f"contact {name}",
                "has a residual traction, and its slider is to start from the static state",
                "Leave one of them out.",
            )
        return True
    springs = isinstance(law, Bonded | UnilateralSpring)
    if isinstance(law, RigidCoulomb) or (not springs and law.initial_state().size):
        raise input_error(
            f"contact {name}",
            f"is {type(law).__name__}, which has no single slider under the normal force that a static state could leave somewhere",
            "Take ElasticCoulomb or CoupledCoulomb, or leave the sliders where they start.",
        )
    return False


def sharing_friction(law: ContactLaw, share: float) -> ContactLaw:
    """Return a law with a share of its friction coefficient and springs unstretched at zero displacement.

    Laws without a slider are unchanged.
    """
    return replace(law, mu=share * law.mu, slider=None) if isinstance(law, OneSlider) else law


def left_behind(law: ContactLaw, gap: FloatArray, force: FloatArray) -> ContactLaw:
    """Return a law whose slider starts where the spring has the `force` (3,) at the `gap` (3,).

    Laws without a slider are unchanged.
    """
    if not isinstance(law, OneSlider):
        return law
    k = law.stuck_stiffness()
    places = [float(gap[d] - force[d] / k[d]) if k[d] > 0.0 else 0.0 for d in range(2)]
    return replace(law, slider=(places[0], places[1]))
