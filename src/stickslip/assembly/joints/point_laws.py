"""The law of a contact point: the contact's preload and gap, and the point's share of the area."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.contact import Contact
from stickslip.contact.law import ContactLaw, PressedOrOpen, Rigid, scaled
from stickslip.contact.laws import LAWS, law_name
from stickslip.errors import InputError, input_error


def at_rest(key: str, contact: Contact) -> ContactLaw:
    """Return the law with the preload and the gap of the contact."""
    law: Any = contact.law
    if contact.preload == 0.0 and contact.gap == 0.0:
        return contact.law
    if isinstance(contact.law, Rigid):
        pressed = contact.preload > 0.0
        changed: ContactLaw = (
            replace(law, preload=contact.preload)
            if pressed
            else replace(law, initial_gap=law.initial_gap + contact.gap)
        )
        return changed
    own = {entry.name for entry in fields(law)} if is_dataclass(law) else set()
    missing = [n for n in ("preload", "k_n") if n not in own or getattr(law, n) is None]
    if missing:
        raise _at_rest_alike(key, contact, *_without(law, missing))
    if contact.gap != 0.0 and law.k_n == 0.0:
        raise _at_rest_alike(key, contact, "has no normal stiffness here: its pressure is constant")
    if isinstance(law, PressedOrOpen):
        return law.at_rest(contact.preload, contact.gap)
    pressed = law.preload + contact.preload - law.k_n * contact.gap
    found: ContactLaw = replace(law, preload=pressed)
    return found


def _without(law: Any, missing: list[str]) -> tuple[str, ...]:
    """Return why a law without fields takes no preload and no gap; and what helps, if it is a law of one's own."""
    if law_name(law) in tuple(LAWS):
        return ("has a normal force that does not depend on how far the bodies are apart",)
    names = " and no field ".join(f"`{name}`" for name in missing)
    return (
        f"has no field {names}: the contact's preload and gap go into the law as preload - k_n * gap",
        "Give the law the fields `preload` (N at zero gap, N) and `k_n` (normal stiffness, N/m), or leave it out and press by the law's own parameters.",
    )


def _at_rest_alike(
    key: str,
    contact: Contact,
    why: str,
    remedy: str = "Choose a law that is pressed and lifts off, such as elastic_coulomb, or leave it out.",
) -> InputError:
    """Refuse a preload, gap or interference without effect, by its key and its name in Python."""
    preload = "preload_pa" if contact.share == "area" else "preload_n"
    word = preload if contact.preload else "gap_m" if contact.gap > 0.0 else "interference_m"
    given = f"preload={contact.preload:g}" if contact.preload else f"gap={contact.gap:g}"
    return input_error(
        f"{key}.{word}", f"is given (in Python {given}), and the law {law_name(contact.law)} {why}", remedy
    )


def shared(key: str, contact: Contact, law: ContactLaw, area: FloatArray) -> tuple[ContactLaw, ...]:
    """Return the law of each point."""
    p, known = len(area), bool(np.all(np.isfinite(area)))
    alike = isinstance(law, Rigid) and law.preload is None  # nothing of it is shared
    if contact.share == "point" or alike:
        return (law,) * p
    if contact.share == "interface":
        factors = area / area.sum() if known else np.full(p, 1.0 / p)
    elif known:
        factors = area
    else:
        raise input_error(
            f"{key}.law",
            f"is given per area, and the points of {contact.between[0]!r} have none: they span no facets, and no body tells their areas",
            "Give the law of the whole interface or of a point, name a set that holds whole facets, or let a rigid body with areas come first.",
        )
    made: dict[float, ContactLaw] = {}
    try:
        return tuple(made.setdefault(f, scaled(law, f)) for f in map(float, factors))
    except InputError as error:
        raise error.inside(f"{key}.law") from None
