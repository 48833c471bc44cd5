"""A Python model as study tables, for the summary of inputs on the page."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from stickslip.assembly.contact import Contact
from stickslip.assembly.forces import Load
from stickslip.assembly.model import Model
from stickslip.contact.laws import law_name
from stickslip.model.damping import Damping
from stickslip.model.fe.material import ElasticMaterial, Material
from stickslip.model.part import Part
from stickslip.units import HZ, RPM, quantity_of

MANY = 20  # numbers of a list, above which only its ends are shown


def as_tables(model: Model, name: str, keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return the study tables of a model and of its analysis. Keys at their defaults are left out.

    Parameters
    ----------
    model
        The model.
    name, keys
        Name of the analysis, and the keys given for its table.
    """
    found: dict[str, Any] = {
        "part": {n: _part(p) for n, p in model.parts.items()},
        "load": {n: _load(one) for n, one in model.loads.items()},
        "contact": {n: _contact(c) for n, c in model.contacts.items()},
        "output": {"points": {o.name: o.on for o in model.outputs}},
        name: {key: _plain(value) for key, value in keys.items()},
    }
    if model.speed:
        found["rotation"] = {"speed_rpm": model.speed / RPM, "coriolis": model.coriolis}
    if model.retention:
        found["retention"] = {"stiffness_n_per_m": model.retention}
    if model.mistuning is not None:
        found["mistuning"] = {"deviating": ", ".join(model.mistuning.patterns)}
    if model.aerodynamics is not None:
        found["aero"] = {"forces": "influence coefficients"}
    return found


def _plain(value: Any) -> Any:
    """Return a value in the types of JSON and TOML; long lists are shortened to their ends."""
    if isinstance(value, str | int | float | None):
        return value
    found = np.asarray(value, dtype=object if isinstance(value, list | tuple) else None).tolist()
    return [found[0], found[-1]] if isinstance(found, list) and len(found) > MANY else found


def _values(given: Any, *, per_area: bool = False) -> dict[str, Any]:
    """Return the values of a dataclass of quantities that differ from their defaults, by keys of a study file."""
    found = {}
    for entry in fields(given):
        known, value = quantity_of(entry), getattr(given, entry.name)
        default = entry.default if entry.default is not MISSING else None
        if known is not None and value is not None and isinstance(value, int | float | str) and value != default:
            own = value if isinstance(value, str) else value / known.factor
            found[known.key_of(entry.name, per_area=per_area)] = own
    return found


def _part(part: Part) -> dict[str, Any]:
    if part.body is not None:
        return {"shape": "rigid body", "mass_kg": part.body.mass}
    mesh = "" if part.mesh is None else f", {len(part.mesh.points)} nodes"
    found: dict[str, Any] = {"shape": f"{part.structure.n} dof{'s' * (part.structure.n != 1)}{mesh}"}
    if part.sectors > 1:
        found["sectors"] = part.sectors
    own = None if part.solid is None else part.solid.material
    if isinstance(own, Material):
        found["material"] = _values(own) or {"kind": "steel"}
    elif isinstance(own, ElasticMaterial):
        found["material"] = {"kind": own.in_words}
    if part.damping is not None:
        found["damping"] = _damping(part.damping)
    return found


def _damping(damping: Damping) -> dict[str, Any]:
    given = {
        "ratio": damping.ratio,
        "between_hz": damping.between_hz,
        "alpha_per_s": damping.alpha or None,
        "beta_s": damping.beta or None,
        "modal_ratio": damping.modal,
        "loss_factor": damping.loss_factor or None,
    }
    return {key: _plain(value) for key, value in given.items() if value is not None}


def _load(load: Load) -> dict[str, Any]:
    size: dict[str, Any] = {"force_n": load.newton}
    if load.field is not None:
        size = {"pressure": f"{load.newton:g} times {load.field.source}"}
    found = size | {"on": load.on, "harmonic": load.harmonic}
    more = {
        "direction": load.direction and _along(load.direction),
        "engine_order": load.engine_order,
        "phase_deg": float(np.degrees(load.phase)) or None,
        "frequency_hz": load.omega and load.omega / HZ,
        "frequency_ratio": load.omega_ratio,
    }
    return found | {key: value for key, value in more.items() if value is not None}


def _along(direction: tuple[float, float, float]) -> Any:
    """Return the axis parallel to a direction, or else its components."""
    for axis, unit in zip("xyz", np.eye(3), strict=True):
        for sign in (1, -1):
            if np.allclose(direction, sign * unit):
                return axis if sign > 0 else f"-{axis}"
    return [float(c) for c in direction]


def _contact(contact: Contact) -> dict[str, Any]:
    found: dict[str, Any] = {"between": list(contact.between), "law": law_name(contact.law)}
    if contact.pairing != "node_to_node":
        found["pairing"] = contact.pairing
    if contact.share != "interface":
        found["values_of"] = "each square metre" if contact.share == "area" else "each point"
    found |= _values(contact.law, per_area=contact.share == "area")
    if contact.gap:
        found["gap_m" if contact.gap > 0 else "interference_m"] = abs(contact.gap)
    if contact.preload:
        found["preload_pa" if contact.share == "area" else "preload_n"] = contact.preload
    return found
