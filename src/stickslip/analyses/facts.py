"""Facts of a model in every analysis: mass, size, counts, axis, effects of rotation."""

from typing import Any

import numpy as np

from stickslip.assembly.model import Model


def facts_of(model: Model, rpm: float) -> dict[str, Any]:
    """Return numbers and texts about a model; `rpm` is the speed of the rotor, NaN for a range."""
    facts = model.facts
    return {
        "sectors": model.sectors,
        "axis_direction": np.asarray(model.axis.unit),
        "axis_origin": np.asarray(model.axis.origin, dtype=float),
        "rotation": _in_words(model, rpm),
        "mass_kg": facts.mass,
        "centre_m": np.asarray(facts.centre),
        "box_low_m": np.asarray(facts.low),
        "box_high_m": np.asarray(facts.high),
        "dofs": facts.dofs,
        "nodes": facts.nodes,
        "elements": facts.elements,
    }


def _in_words(model: Model, rpm: float) -> str:
    """Name the effects of rotation in the numbers."""
    if not model.rotates:
        return "matrices as read, unchanged by speed"
    if rpm == 0:
        return "at rest"
    speed = "at each speed" if np.isnan(rpm) else f"{rpm:g} rpm"
    coriolis = "with" if model.coriolis else "without"
    return f"{speed}, {model.tangent} tangent, {coriolis} Coriolis forces"
