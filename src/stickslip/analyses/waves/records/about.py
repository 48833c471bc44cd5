"""The model in the results: mass, size, axis, effects of rotation, skin for drawings."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.facts import facts_of
from stickslip.analyses.waves.doubts import static_doubts
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.statics import StaticState
from stickslip.study.store.netcdf import variable
from stickslip.study.verdict import Verdict, doubt, to_json
from stickslip.units import RPM

STATIC = ("static_rpm", "static_displacement_m", "static_strain", "static_rotation_rad")
ABOUT = "model"  # note of what is told here
NUMBERS = {
    "sectors": ("", "1", "number of sectors of the wheel; 1 for a whole structure"),
    "stages": ("", "1", "the wheels of an assembly"),
    "stage_name": ("stage", "1", "name of each stage of an assembly of wheels"),
    "stage_sectors": ("stage", "1", "number of sectors of each stage"),
    "stage_waves": ("wave", "1", "waves of the stages that vibrate together"),
    "axis_direction": ("xyz", "1", "direction of the axis of rotation"),
    "axis_origin": ("xyz", "m", "a point of the axis of rotation"),
    "speed_rpm": ("", "rpm", "speed of the rotor; NaN for a range"),
    "rotation": ("", "1", "what of the rotation is in the numbers"),
    "contacts": ("", "1", "what contacts do: static, stuck, open, or none"),
    "mass_kg": ("", "kg", "mass of the model (one sector)"),
    "centre_m": ("xyz", "m", "centre of mass"),
    "box_low_m": ("xyz", "m", "lower corner of the box around all nodes"),
    "box_high_m": ("xyz", "m", "upper corner of the box around all nodes"),
    "dofs": ("", "1", "number of free dofs"),
    "nodes": ("", "1", "number of nodes"),
    "elements": ("", "1", "number of elements; 0 for matrices"),
    "static_rpm": ("", "rpm", "speed of the static displacement"),
    "static_displacement_m": ("", "m", "largest static displacement under the centrifugal load"),
    "static_strain": ("", "1", "largest principal strain under the centrifugal load"),
    "static_rotation_rad": ("", "rad", "largest rotation under the centrifugal load"),
    "skin_point": ("skin_point xyz", "m", "points of the skin"),
    "skin_triangle": ("face corner", "1", "triangles of the skin"),
    "skin_cut": ("face", "1", "1 on a cyclic face, inside the wheel"),
}


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


def told(note: Mapping[str, Any]) -> dict[str, xr.Variable]:
    """Return the variables of a note about a model."""
    return {
        name: variable(dims, note[name], units, long_name)
        for name, (dims, units, long_name) in NUMBERS.items()
        if name in note
    }
