"""A bladed disk with shrouds of structured bricks: contacts of nine points between neighbours, any number of sectors, mistuned."""

import math

import numpy as np

from stickslip.assembly import BladeMistuning, Mistuning, Model, pattern
from stickslip.assembly.contact import Contact
from stickslip.assembly.forces import Load, Output
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.model.damping import Damping
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import solid_part
from stickslip.reduction.choice import Reduction

RADII = (0.100, 0.115, 0.130, 0.150, 0.170, 0.190, 0.194, 0.198, 0.202)
DISK, SHROUD = 2, 6  # radii up to where the disk reaches, and from where the shroud begins
ANGLES = (-0.5, -0.12, 0.12, 0.5)  # of a pitch
DEPTH = (-0.02, 0.0, 0.02)


def shrouded_sector(sectors: int) -> SolidMesh:
    """Return a sector: a piece of a ring, a blade, a shroud whose two faces have nine nodes each."""
    pitch = 2 * math.pi / sectors
    number = np.arange(len(RADII) * len(ANGLES) * len(DEPTH)).reshape(len(RADII), len(ANGLES), 3)
    points = np.array(
        [[r * math.cos(a * pitch), r * math.sin(a * pitch), z] for r in RADII for a in ANGLES for z in DEPTH]
    )
    cells = []
    for i in range(len(RADII) - 1):
        for j in range(3) if i < DISK or i >= SHROUD else (1,):
            for k in range(2):
                low = number[i : i + 2, j : j + 2, k]
                high = number[i : i + 2, j : j + 2, k + 1]
                cells.append([part[a, b] for part in (low, high) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))])
    used, at = np.unique(np.array(cells), return_inverse=True)
    place = np.full(len(points), -1)
    place[used] = np.arange(used.size)
    sets = {
        "root": place[number[0].ravel()],
        "cyclic_low": place[number[1 : DISK + 1, 0].ravel()],
        "cyclic_high": place[number[1 : DISK + 1, -1].ravel()],
        "shroud_low": place[number[SHROUD:, 0].ravel()],
        "shroud_high": place[number[SHROUD:, -1].ravel()],
        "blade": place[number[DISK + 1 :, 1:3].ravel()],
        "tip": place[number[-1, 1, 1:2]],
    }
    return SolidMesh(points[used], at.reshape(-1, 8), sets)


def mistuned_wheel(
    sectors: int = 36,
    engine_order: int = 5,
    *,
    deviation: float = 0.01,
    seed: int = 1,
    newton: float = 20.0,
    modes: int = 20,
) -> Model:
    """Return a wheel of shrouded blades whose frequencies scatter; no deviation at all: None of it."""
    law = ElasticCoulomb(k_t=3e6, k_w=3e6, k_n=4e6, mu=0.3, preload=5.0)
    scatter = BladeMistuning(of="sector.blade", deviations=pattern(sectors, "normal", deviation, seed), modes=3)
    return Model(
        parts={
            "sector": solid_part(
                shrouded_sector(sectors),
                Material(),
                sectors=sectors,
                reduction=Reduction(modes),
                damping=Damping(modal=0.002),
            )
        },
        contacts={
            "shroud": Contact(
                between=("sector.shroud_high", "next.sector.shroud_low"), law=law, tangent=(1.0, 0.0, 0.0)
            )
        },
        loads={"gas": Load(on="sector.tip", newton=newton, direction=(0.0, 1.0, 1.0), engine_order=engine_order)},
        outputs=(Output(name="tip", on="sector.tip"),),
        mistuning=Mistuning(blades={"scatter": scatter}) if deviation else None,
    )
