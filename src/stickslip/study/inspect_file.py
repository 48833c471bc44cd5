"""Output of ``stickslip inspect``."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from stickslip.errors import InputError
from stickslip.model.facts import facts_of_solid
from stickslip.model.fe.cell_laws import cell_laws
from stickslip.model.readers.ansys_archive import read_ansys_archive
from stickslip.model.readers.calculix_deck import Deck
from stickslip.model.readers.open_model import Model, model_summary, read_model
from stickslip.model.readers.units import Units
from stickslip.study.store.progress import LOG

WIDTH = 26  # characters of the column of names
# options of the command for the arguments of readers
_OPTIONS = {
    "mesh": "--mesh",
    "mass": "part.NAME.mass in a study",
    "nodes": "part.NAME.nodes in a study",
    "ignore": "",
    "use": "Read it in Python, keep it with save_structure (.npz) and give that: use",
}


def inspect_file(path: Path, units: str, modes: int, mesh: Path | None) -> list[str]:
    """Return a summary of a model file, as lines and tables.

    Parameters
    ----------
    path
        Any file supported by `read_model`.
    units
        Name of its unit system.
    modes
        Number of natural frequencies to compute; 0 for none.
    mesh
        File with node positions, for matrix files without them.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    system = Units.named(units)
    LOG.info(f"reading {path} in {system.name}")
    # doubtful numbers are shown with a remark, not refused, since users inspect a file to find them
    try:
        if Path(path).suffix.lower() == ".cdb":  # equations, which a study reads, do not keep from looking at the mesh
            model: Model = read_ansys_archive(path, units=system, linked=True)
        else:
            model = read_model(path, units=system, mesh=mesh, plausible=False)
    except InputError as error:
        raise error.called(_OPTIONS) from None
    found = model_summary(model, n_modes=modes, units=system, say=LOG.info)
    if isinstance(model, Deck):
        materials = [model.materials[name] for name in model.cell_material]
        facts = facts_of_solid(cell_laws(model.mesh, materials, model.temperature), 0)
        found = replace(found, whole_mass=facts.mass, centre=np.array(facts.centre))
    return [f"{name:<{WIDTH}}{value}" for name, value in found.rows()]
