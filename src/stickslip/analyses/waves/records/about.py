"""The model in the results: mass, size, axis, effects of rotation, skin for drawings."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip.analyses.facts import facts_of
from stickslip.analyses.waves.doubts import static_doubts
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.statics import StaticState
from stickslip.study.verdict import Verdict, doubt, to_json
from stickslip.units import RPM

STATIC = ("static_rpm", "static_displacement_m", "static_strain", "static_rotation_rad")


def about(
    model: Model, contacts: ContactsAs, rpm: float, highest: float, more: Sequence[Verdict] = ()
) -> dict[str, Any]:
    """Return the note about a model.

    Parameters
    ----------
    model
        The model.
    contacts
        State of its contacts: stuck, sliding or open.
    rpm
        Speed of the rotor; NaN for a range.
    highest
        Speed of the reported static displacement, rad/s.
    more
        Additional entries of the note.
    """
    state = model.static_state(highest)
    doubts = static_doubts(state, contacts=bool(model.contacts))
    note = facts_of(model, rpm) | {
        "speed_rpm": rpm,
        "contacts": contacts if model.contacts else "none",
        "verdicts": to_json([*map(doubt, model.warnings), *doubts, *more]),
    }
    return note | _static(state)


def _static(state: StaticState | None) -> dict[str, float]:
    if state is None:
        return dict.fromkeys(STATIC, np.nan)
    found = state.speed / RPM, state.displacement, state.strain, state.rotation
    return dict(zip(STATIC, found, strict=True))


def skin_note(model: Model) -> dict[str, Any]:
    """Return the note about the skin, for drawings of mode shapes."""
    skin = model.skin
    assert skin is not None
    return {"skin_point": skin.points, "skin_triangle": skin.triangles, "skin_cut": skin.cut}
