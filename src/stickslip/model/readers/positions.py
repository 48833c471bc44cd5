"""Positions and node sets from any file or mesh, and a check of positions against the stiffness."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

from stickslip.errors import input_error
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.frd import frd_nodes
from stickslip.model.readers.node_table import NodeTable, csv_nodes, deck_nodes, mesh_nodes
from stickslip.model.readers.units import Units
from stickslip.model.structure import Structure

BALANCED_ROW = 1e-4  # force of a rigid translation on a row over the sum of its entries: less means no support
ROTATION_STRAIN = 5e-3  # force of a rigid rotation over the sum of its terms; preload stresses alone cause about 1e-4
MAX_ROWS = 5000  # largest number of rows examined
MIN_FREE_DOFS = 12  # smallest number of dofs away from supports for a judgement
READERS = {".inp": deck_nodes, ".frd": frd_nodes, ".csv": csv_nodes}


def find_nodes(source: SolidMesh | Path | str, units: Units) -> NodeTable:
    """Return the nodes of a mesh or file, positions in the unit of length of `units`.

    Parameters
    ----------
    source
        A mesh (in metres), or a deck ``.inp``, results ``.frd`` or a CSV file ``node, x, y, z`` in `units`.
    units
        Unit system of the model.

    Raises
    ------
    InputError
        If the file is of another kind or cannot be read.
    """
    if isinstance(source, SolidMesh):
        table = mesh_nodes(source)
        return replace(table, points=table.points / units.length)
    path = Path(source)
    suffix = Path(path.stem).suffix if path.suffix == ".gz" else path.suffix
    if suffix not in READERS:
        raise input_error(
            str(path),
            f"nodes are not read from {suffix or 'a file without suffix'!r}",
            f"Give a mesh, or a file {', '.join(READERS)}.",
        )
    return READERS[suffix](path)


def doubt_about_positions(structure: Structure) -> str | None:
    """Return a sentence if the positions probably belong to another mesh; None if they fit the stiffness.

    A rigid rotation causes no strain. Stiffness times rotation therefore vanishes away from supports and cyclic faces, unless
    the positions belong to other nodes. Supports and faces are found by the forces of rigid translations.

    Parameters
    ----------
    structure
        Structure in any units; coordinates other than x, y and z are not checked.
    """
    dofs, position = structure.dofs, structure.dofs.position
    if set(dofs.component) != {"x", "y", "z"} or not np.isfinite(position).all():
        return None
    stiffness = scipy.sparse.csr_array(structure.stiffness)
    component = np.array(["xyz".index(c) for c in dofs.component])
    translations = np.eye(3)[component]
    row = np.asarray(abs(stiffness) @ np.ones(structure.n))
    balanced = (np.abs(stiffness @ translations) <= BALANCED_ROW * row[:, None]).all(axis=1)
    rows = np.flatnonzero(balanced)
    if len(rows) < MIN_FREE_DOFS:
        return None
    rows = rows[:: len(rows) // MAX_ROWS + 1]
    part = scipy.sparse.coo_array(stiffness[rows])
    # rotation about each row's own node, so that only positions relative to its neighbours count
    turns = np.stack([np.cross(axis, position) for axis in np.eye(3)], axis=2)  # node, component, axis
    away = np.einsum("mc,mca->ma", part @ translations, turns[rows])
    force = np.linalg.norm(part @ turns[np.arange(structure.n), component] - away)
    arms = np.linalg.norm(position[part.col] - position[rows[part.row]], axis=1)
    scale = np.linalg.norm(np.bincount(part.row, np.abs(part.data) * arms))
    if force <= ROTATION_STRAIN * scale:
        return None
    return f"a rigid rotation about these positions strains the model ({force / scale:.0%} of the terms remain)"
