"""Where the nodes lie: positions and sets from whichever file or mesh the user has."""

from dataclasses import replace
from pathlib import Path

from stickslip.errors import input_error
from stickslip.model.mesh import SolidMesh
from stickslip.model.readers.frd import frd_nodes
from stickslip.model.readers.node_table import NodeTable, csv_nodes, deck_nodes, mesh_nodes
from stickslip.model.readers.units import Units

READERS = {".inp": deck_nodes, ".frd": frd_nodes, ".csv": csv_nodes}


def find_nodes(source: SolidMesh | Path | str, units: Units) -> NodeTable:
    """Return the nodes of a mesh or file, positions in the unit of length of `units`.

    Parameters
    ----------
    source
        A mesh (in metres), or a deck ``.inp``, results ``.frd`` or a CSV file ``node, x, y, z`` in `units`.
    units
        Of the model.

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
