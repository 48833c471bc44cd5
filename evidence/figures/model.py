"""The models of the figures: the example study, and the same blades with a damper whose flat side cannot slip."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from evidence.validation.case_two_blades import coarse_example
from stickslip import HarmonicLoad, Sweep, System
from stickslip.arrays import IntArray
from stickslip.study.build import Case, case_of
from stickslip.study.schema import read_study

# Angles and contact lines of a damper whose flat side does not slip: it rests on L1 and R alone, within both friction cones.
GLUED = {
    "flat_angle_deg": "50.0",
    "curved_angle_deg": "70.0",
    "flat_distances_m": "[0.008, 0.023]",
    "curved_distance_m": "0.01",
}


@dataclass(frozen=True, eq=False)
class Model:
    """What the figures need of a system.

    Attributes
    ----------
    system, sweep
        The system, and how its study sweeps.
    load
        Loads for a ratio F_CL/F_HE.
    rotation
        Dof of the damper's rotation about the axial direction.
    contact_dofs
        Dofs of the blades at the contact points, along the excitation.
    flat
        Contacts of the flat side.
    """

    system: System
    sweep: Sweep
    load: Callable[[float], HarmonicLoad]
    rotation: int
    contact_dofs: IntArray
    flat: IntArray


def with_values(text: str, values: Mapping[str, str]) -> str:
    """Return a study file with other values; every key must be there."""
    for key, value in values.items():
        text, found = re.subn(rf"(?m)^{key} = [^#\n]*", f"{key} = {value} ", text)
        if found != 1:
            raise ValueError(f"{key} stands {found} times in the example")
    return text


def model_of(case: Case) -> Model:
    """Return a study's case as the figures need it."""
    structure = case.system.plain_structure
    contact = structure.dof_set("blades.contact").reshape(-1, 3)
    flat = np.array([i for i, side in enumerate(case.contacts.side) if side == "flat"])
    rotation = int(structure.dof_set("damper")[4])
    return Model(case.system, case.sweep, case.load, rotation, contact[:, 0], flat)


def two_blades(values: Mapping[str, str] | None = None) -> Model:
    """Mesh and reduce the example with elements twice as large, and with other `values`."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(with_values(coarse_example(), values or {}), encoding="utf-8")
        return model_of(case_of(read_study(path), None, lambda _: None))
