"""Mass, centre of mass, size and counts of a model."""

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.model.fe.elements import chunks, gradients, shape_functions
from stickslip.model.fe.solid import Material, Materials
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.structure import Structure
from stickslip.study.structure_results import Facts

DEGREE = 4  # integrates volume and first moment of straight-edged cells of second order exactly


def facts_of_solid(mesh: SolidMesh, material: Materials, dofs: int) -> Facts:
    """Return the facts of a mesh, of which `dofs` are free; clamped nodes count."""
    shape = shape_functions(mesh.cells.shape[1], DEGREE)
    each = [material] * len(mesh.cells) if isinstance(material, Material) else material
    density = np.array([one.density for one in each])
    mass, moment = 0.0, np.zeros(3)
    for piece in chunks(mesh, shape):
        _, weights = gradients(mesh, shape, piece)
        places = np.einsum("qk,mkx->mqx", shape.values, mesh.points[mesh.cells[piece]])
        weights = weights * density[piece][:, None]
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
    """Return what matrices tell: the mass that moves with the free translations, and where the free nodes are."""
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
