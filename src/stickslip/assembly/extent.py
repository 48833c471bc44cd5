"""Size and stiffness of the bodies of a model, the scales of its motions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.assembly.response_request import asked
from stickslip.model.facts import facts_of_part
from stickslip.model.part import Part


@dataclass(frozen=True, eq=False)
class Extent:
    """Size and stiffness of a model's meshes.

    Parameters
    ----------
    stiff_volume
        Young's modulus times volume of all elastic parts, J, the scale of the mean strain; NaN where a part has no mesh.
    labels, from_clamp
        Outputs, and the distance of each from the nearest clamped node of its part, m; NaN without clamped nodes.
    """

    stiff_volume: float
    labels: tuple[str, ...]
    from_clamp: FloatArray


def extent_of(model: Model, harmonics: int) -> Extent:
    """Return size and stiffness of a model; `harmonics` as in `assemble`."""
    volumes = [_stiff_volume(part) for part in model.parts.values() if part.body is None]
    labels, table = asked(model, harmonics).labels, model.places.dofs
    away = [_from_clamp(model.parts[table.part[d]], table.position[d]) for d in labels.dofs]
    return Extent(float(sum(volumes)), labels.names, np.array(away, dtype=float))


def _stiff_volume(part: Part) -> float:
    """Return the largest Young's modulus times the volume that follows from the smallest density, J."""
    solid = part.solid if part.template is None else part.template.solid
    if solid is None:
        return float("nan")
    own = solid.material
    every = list(own) if isinstance(own, Sequence) else [own]
    volume = facts_of_part(part).mass / min(m.density for m in every)
    return float(volume * max(m.young_modulus for m in every))


def _from_clamp(part: Part, position: FloatArray) -> float:
    if part.mesh is None or not np.all(np.isfinite(position)):
        return float("nan")
    clamped = np.ones(len(part.mesh.points), dtype=bool)
    table = part.structure.dofs
    free = np.unique(table.node[table.node >= 0])
    clamped[np.isin(part.mesh.numbers, free)] = False
    if not clamped.any() or clamped.all():
        return float("nan")
    return float(np.linalg.norm(part.mesh.points[clamped] - position, axis=1).min())
