"""Facts of a model in every analysis: mass, size, counts, axis, effects of rotation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.assembly.model import Model
from stickslip.column import column, columns_of

NOTE = "model"  # name of the note about the model


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelFacts:
    """Facts of the model of a case."""

    sectors: int | None = column("1", "number of sectors of the wheel; 1 for a whole structure", default=None)
    stages: str | None = column("1", "the wheels of an assembly", default=None)
    stage_name: Any = column("1", "name of each stage of an assembly of wheels", along="stage", default=None)
    stage_sectors: IntArray | None = column("1", "number of sectors of each stage", along="stage", default=None)
    stage_waves: Any = column("1", "waves of the stages that vibrate together", along="wave", default=None)
    axis_direction: FloatArray | None = column("1", "direction of the axis of rotation", along="xyz", default=None)
    axis_origin: FloatArray | None = column("m", "a point of the axis of rotation", along="xyz", default=None)
    speed_rpm: float | None = column("rpm", "speed of the rotor; NaN for a range", default=None)
    rotation: str | None = column("1", "what of the rotation is in the numbers", default=None)
    contacts: str | None = column("1", "what contacts do: static, stuck, open, or none", default=None)
    mass_kg: float | None = column("kg", "mass of the model (one sector)", default=None)
    centre_m: FloatArray | None = column("m", "centre of mass", along="xyz", default=None)
    box_low_m: FloatArray | None = column("m", "lower corner of the box around all nodes", along="xyz", default=None)
    box_high_m: FloatArray | None = column("m", "upper corner of the box around all nodes", along="xyz", default=None)
    dofs: int | None = column("1", "number of free dofs", default=None)
    nodes: int | None = column("1", "number of nodes", default=None)
    elements: int | None = column("1", "number of elements; 0 for matrices", default=None)
    static_rpm: float | None = column("rpm", "speed of the static displacement", default=None)
    static_displacement_m: float | None = column(
        "m", "largest static displacement under the centrifugal load and thermal strain", default=None
    )
    static_strain: float | None = column(
        "1", "largest principal strain under both, less the free thermal strain", default=None
    )
    static_rotation_rad: float | None = column("rad", "largest rotation under both", default=None)
    skin_point: FloatArray | None = column("m", "points of the skin", along="skin_point xyz", default=None)
    skin_triangle: IntArray | None = column("1", "triangles of the skin", along="face corner", default=None)
    skin_cut: IntArray | None = column("1", "1 on a cyclic face, inside the wheel", along="face", default=None)


def facts_in(notes: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the facts in the note of a job about its model, by the fields of `ModelFacts`."""
    note = notes.get(NOTE, {})
    return {name: note[name] for name in columns_of(ModelFacts) if name in note}


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
    meshed = any(part.solid is not None for part in model.parts.values())
    stiffness = "matrices of another program" if model.matrices_at_speed and not meshed else f"{model.tangent} tangent"
    return f"{speed}, {stiffness}, {coriolis} Coriolis forces"
