"""Mass, centre of mass, size and counts of a model."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.model.fe.cell_laws import CellLaws
from stickslip.model.fe.elements import Quadrature, cell_groups, chunks, gradients
from stickslip.model.part import Part
from stickslip.model.structure import Structure
from stickslip.units import RPM

UNLIKE = 300.0  # ratio of two sizes that suggests wrong units: millimetres and metres differ by 1000
SAME_SPEED = 1e-4  # relative difference of equal speeds, which files write with few digits
DEGREE = 4  # integrates volume and first moment of straight-edged cells of second order exactly


@dataclass(frozen=True)
class Facts:
    """Mass, size and counts of a model.

    Parameters
    ----------
    mass
        Mass of the model (one sector) in kg; NaN if unknown.
    centre
        (3,) centre of mass in m; NaN if positions are unknown.
    low, high
        (3,) corners of the box around all nodes in m.
    dofs, nodes, elements
        Counts; elements is 0 for models of matrices.
    """

    mass: float
    centre: tuple[float, float, float]
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    dofs: int
    nodes: int
    elements: int


def facts_of_part(part: Part) -> Facts:
    """Return the facts of a part."""
    if "facts" not in part.memo:
        part.memo["facts"] = _facts_of_part(part)
    found: Facts = part.memo["facts"]
    return found


def _facts_of_part(part: Part) -> Facts:
    if part.body is not None:
        x, y, z = part.body.centre
        places = [points.position for points in part.surfaces.values()]
        corners = np.vstack([np.array([[x, y, z]]), *places])
        low, high = _triple(corners.min(axis=0)), _triple(corners.max(axis=0))
        return Facts(part.body.mass, (x, y, z), low, high, 6, 0, 0)
    if part.mesh is not None and part.solid is not None:
        found = facts_of_solid(part.solid.laws, part.structure.n)
        return _with_points(found, part.mesh.points, part.solid.point_mass)
    return facts_of_matrices(part.structure)


def _with_points(facts: Facts, points: FloatArray, point_mass: FloatArray | None) -> Facts:
    """Add the point masses (nodes,) in kg of a part at the points (nodes, 3) of its nodes."""
    if point_mass is None:
        return facts
    mass = facts.mass + float(point_mass.sum())
    centre = (facts.mass * np.array(facts.centre) + point_mass @ points) / mass
    return replace(facts, mass=mass, centre=_triple(centre))


def facts_of_parts(parts: Iterable[Part]) -> Facts:
    """Return the facts of several parts together."""
    found = [facts_of_part(part) for part in parts]
    if len(found) == 1:
        return found[0]
    mass = np.array([f.mass for f in found])
    centre = mass @ np.array([f.centre for f in found]) / mass.sum()
    return Facts(
        mass=float(mass.sum()),
        centre=_triple(centre),
        low=_triple(np.fmin.reduce([f.low for f in found])),
        high=_triple(np.fmax.reduce([f.high for f in found])),
        dofs=sum(f.dofs for f in found),
        nodes=sum(f.nodes for f in found),
        elements=sum(f.elements for f in found),
    )


LARGEST_SIZE_M = (
    20.0  # corner to corner: rotors measure up to 7 m, and a blade of 21 mm is larger if its mm are read as m
)


def unlike_units(parts: Mapping[str, Part]) -> list[str]:
    """Return a sentence for each part, or pair of parts, whose size or material differs so much that units are probably wrong."""
    names = list(parts)
    found = [
        f"part.{name} measures {_size(part):.3g} m from corner to corner: are its coordinates in mm?"
        for name, part in parts.items()
        if part.solid is not None and _size(part) > LARGEST_SIZE_M
    ]
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            for what, unit, measure in _MEASURES:
                a, b = measure(parts[one]), measure(parts[other])
                if a > 0 and b > 0 and not 1 / UNLIKE < a / b < UNLIKE:
                    found.append(
                        f"part.{one} has {what} {a:.3g} {unit}, part.{other} {b:.3g} {unit}: is a unit of one of them wrong?"
                    )
    return found


def other_speeds(parts: Mapping[str, Part], speed: float) -> list[str]:
    """Return a sentence for each part whose file has another speed than the model's `speed` in rad/s."""
    return [
        f"part.{name}: its file turns at {part.own_speed / RPM:.6g} rpm, the model at {speed / RPM:.6g} rpm."
        for name, part in parts.items()
        if part.template is None and abs(part.own_speed - speed) > SAME_SPEED * part.own_speed > 0
    ]


def _size(part: Part) -> float:
    """Return the diagonal of the box around a part's nodes, m; 0 if unknown."""
    facts = facts_of_part(part)
    box = np.array(facts.high) - np.array(facts.low)
    return float(np.linalg.norm(box)) if np.all(np.isfinite(box)) else 0.0


def _of_material(name: str) -> Callable[[Part], float]:
    """Return a function that reads the property `name` of a part's first material; 0 without a material."""

    def number(part: Part) -> float:
        if part.solid is None:
            return 0.0
        material = part.solid.material
        return float(getattr(material[0] if isinstance(material, Sequence) else material, name))

    return number


_MEASURES: tuple[tuple[str, str, Callable[[Part], float]], ...] = (
    ("a size of", "m", _size),
    ("a Young's modulus of", "Pa", _of_material("young_modulus")),
    ("a density of", "kg/m³", _of_material("density")),
)


def facts_of_solid(laws: CellLaws, dofs: int) -> Facts:
    """Return the facts of a mesh and its materials with `dofs` free dofs; clamped nodes count."""
    mesh = laws.mesh
    density = laws.density(slice(0, len(mesh.cells)))
    mass, moment = 0.0, np.zeros(3)
    for group in cell_groups(mesh, Quadrature(DEGREE, DEGREE)):
        shape, own = group.strain, group.mesh
        for piece in chunks(own, shape):
            _, weights = gradients(own, shape, piece)
            places = np.einsum("qk,mkx->mqx", shape.values, own.points[own.cells[piece]])
            weights = weights * density[group.rows[piece]][:, None]
            mass += float(weights.sum())
            moment += np.einsum("mq,mqx->x", weights, places)
    return Facts(
        mass=mass,
        centre=_triple(moment / mass),
        low=_triple(mesh.points.min(axis=0)),
        high=_triple(mesh.points.max(axis=0)),
        dofs=dofs,
        nodes=len(mesh.points),
        elements=len(mesh.cells),
    )


def facts_of_matrices(structure: Structure) -> Facts:
    """Return the facts of matrices: the mass that moves with free translations, and the box of the free nodes."""
    components = np.array(structure.dofs.component)
    known = np.asarray(np.isfinite(structure.dofs.position).all(axis=1))
    position = structure.dofs.position[known]
    mass, centre = float("nan"), np.full(3, np.nan)
    # row sums for one direction: with consistent matrices they are shares of the mass
    along = np.asarray(components == "x")
    if along.any():
        shares = np.real(structure.mass @ along.astype(float))[along]
        mass = float(shares.sum())
        if known[along].all():
            centre = shares @ structure.dofs.position[along] / mass
    return Facts(
        mass=mass,
        centre=_triple(centre),
        low=_triple(position.min(axis=0)) if len(position) else (np.nan,) * 3,
        high=_triple(position.max(axis=0)) if len(position) else (np.nan,) * 3,
        dofs=structure.n,
        nodes=len(np.unique(structure.dofs.node[structure.dofs.node >= 0])),
        elements=0,
    )


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z
