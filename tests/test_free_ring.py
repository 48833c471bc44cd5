"""A ring that nothing holds, or that is held along its axis alone, from decks whose coordinates have few digits, as meshers write them.

Frequencies: CalculiX 2.20 with the same decks (C3D8, one of 12 sectors, `*FREQUENCY` with `*SELECT CYCLIC SYMMETRY MODES`).
"""

import numpy as np
import pytest

import stickslip as ss
from stickslip.assembly import Model
from stickslip.errors import StickslipError
from stickslip.model.fe.free_solid import inertia_relief, rigid_motions
from stickslip.model.part import solid_part
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.readers.units import Units

FREE = {
    0: [0, 0, 1536.218, 5732.688],
    1: [0, 0, 2333.173, 7227.736],
    2: [673.2496, 2526.994, 4067.578, 10853.11],
    3: [1834.31, 6059.25],
}
HELD_ALONG_THE_AXIS = {
    0: [0, 694.139, 5731.84, 11059.3],
    1: [0, 666.547, 7227.10, 11201.2],
    2: [974.958, 2527.23, 10852.2, 11655.5],
    3: [1951.82, 6059.40, 12489.6, 15028.8],
}
STUDY = """schema_version = 2
[part.ring]
file = "ring.inp"
units = "mm-t-s"
quadrature = "calculix"
[modes]
number = 4
nodal_diameters = [0, 1, 2, 3]
"""


def ring(path, digits, axis="z", *, along=False, sectors=12, cells=3, tolerance=0.001):
    """Write the deck of a sector of a ring of 200 to 400 mm, 20 mm thick: 3 x 3 x 1 bricks; coordinates in mm with so many digits."""
    node = np.arange(2 * (cells + 1) ** 2).reshape(2, cells + 1, cells + 1) + 1  # axial, around, out
    lines = ["*NODE, NSET=NALL"]
    for k, j, i in np.ndindex(node.shape):
        r, angle = 100 + 100 * i / cells, 2 * np.pi / sectors * j / cells
        place = [r * np.cos(angle), r * np.sin(angle), 20.0 * k]
        place = place if axis == "z" else [place[2], *place[:2]]
        lines.append(f"{node[k, j, i]}, " + ", ".join(f"{x:.{digits}g}" for x in place))
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=EALL")
    for number, (j, i) in enumerate(np.ndindex(cells, cells), 1):
        corners = [node[k, j + b, i + a] for k in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines.append(", ".join(map(str, [number, *corners])))
    for name, nodes in (("LOW", node[:, 0]), ("HIGH", node[:, -1]), ("HELD", node[0, 1:, 0])):
        lines += [f"*NSET, NSET={name}", *map(str, nodes.ravel())]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3", "*DENSITY", "7.85e-9"]
    lines += ["*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL"]
    lines += ["*SURFACE, NAME=SLOW, TYPE=NODE", "LOW", "*SURFACE, NAME=SHIGH, TYPE=NODE", "HIGH"]
    lines += [f"*TIE, CYCLIC SYMMETRY, NAME=T, POSITION TOLERANCE={tolerance}", "SLOW, SHIGH"]
    lines += [f"*CYCLIC SYMMETRY MODEL, N={sectors}, TIE=T", "0, 0, 0, " + ("0, 0, 1" if axis == "z" else "1, 0, 0")]
    if along:
        lines += ["*BOUNDARY", "HELD, 3" if axis == "z" else "HELD, 1"]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(("digits", "axis"), [(6, "z"), (8, "x"), (15, "z")])
@pytest.mark.parametrize("along", [False, True])
def test_frequencies_are_those_of_calculix_with_any_digits(tmp_path, digits, axis, along):
    ring(tmp_path / "ring.inp", digits, axis, along=along)
    (tmp_path / "study.toml").write_text(STUDY)
    found = ss.Study.from_file(tmp_path / "study.toml").run()["modes"]
    for wave, wanted in (HELD_ALONG_THE_AXIS if along else FREE).items():
        own = found.frequency_hz.values.squeeze()[wave][: len(wanted)]
        # six digits printed by CalculiX; a rigid motion turns faces against each other that differ by 2e-6 of their size
        np.testing.assert_allclose(own, wanted, rtol=2e-5, atol=0.05)


def test_a_tolerance_beyond_the_radius_moves_nodes_as_well(tmp_path):
    """It had no effect: nodes within the tolerance of the axis stay where they are."""
    ring(tmp_path / "ring.inp", 6, tolerance=500)
    mesh = read_deck(tmp_path / "ring.inp", units=Units.mm_t_s()).mesh
    low, high = (mesh.points[mesh.node_sets[f"cyclic_{side}"]] for side in ("low", "high"))
    radius = [np.sort(np.hypot(side[:, 0], side[:, 1])) for side in (low, high)]
    np.testing.assert_allclose(*radius, rtol=1e-15)


@pytest.mark.parametrize(
    ("digits", "axis", "along", "count"),
    [(d, "z", False, 2) for d in range(6, 16)]
    + [(d, "x", False, 2) for d in (6, 8, 15)]
    + [(d, axis, True, 1) for d in (6, 8, 15) for axis in "xz"],
)
def test_a_sector_keeps_the_rigid_motions_that_its_tie_allows(tmp_path, digits, axis, along, count):
    ring(tmp_path / "ring.inp", digits, axis, along=along)
    solid, tie = tied(tmp_path / "ring.inp")
    assert rigid_motions(solid, tie).shape[1] == count
    exact = tmp_path / "exact.inp"
    ring(exact, 16, axis, along=along)
    found, wanted = (inertia_relief(*tied(path))[0] for path in (tmp_path / "ring.inp", exact))
    # nodes are off by 5e-7 of the sector at six digits, cells by twenty times as much of their size
    assert np.abs(found - wanted).max() < 1e-4 * np.abs(wanted).max()


@pytest.mark.parametrize("sectors", [3, 60, 600])
def test_a_tie_hinders_what_is_across_the_axis_however_many_sectors_there_are(tmp_path, sectors):
    """A sector of 600 gives way across the axis by 1 % of the motion alone; coordinates of six digits hinder by 1e-6."""
    ring(tmp_path / "ring.inp", 6, sectors=sectors, cells=1)
    assert rigid_motions(*tied(tmp_path / "ring.inp")).shape[1] == 2


def tied(path):
    """Return the solid of a deck and the tie of its sector at wave number 0."""
    deck = read_deck(path, units=ss.Units.mm_t_s())
    part = solid_part(
        deck.mesh,
        deck.material,
        clamped=(),
        sectors=deck.sectors,
        axis=deck.axis,
        held=deck.held if deck.held.any() else None,
    )
    return part.solid, Model(parts={"ring": part}).neighbours.ties["ring"]


def test_the_position_tolerance_of_the_deck_is_used(tmp_path):
    """Five digits: faces match to 5e-3 mm, and frequencies are CalculiX's of exact ones to the digits of the coordinates."""
    (tmp_path / "study.toml").write_text(STUDY)
    ring(tmp_path / "ring.inp", 5)
    with pytest.raises(StickslipError, match=r"6 of 8 nodes of 'cyclic_low'.*meet none of 'cyclic_high'"):
        ss.Study.from_file(tmp_path / "study.toml").run()
    ring(tmp_path / "ring.inp", 5, tolerance=0.01)
    found = ss.Study.from_file(tmp_path / "study.toml").run()["modes"]
    for wave, wanted in FREE.items():
        np.testing.assert_allclose(
            found.frequency_hz.values.squeeze()[wave][: len(wanted)], wanted, rtol=1e-4, atol=0.05
        )
    deck = read_deck(tmp_path / "ring.inp", units=Units.mm_t_s())
    pairs = deck.axis.turned(deck.mesh.points[deck.mesh.node_sets["cyclic_low"]], 2 * np.pi / 12)
    high = deck.mesh.points[deck.mesh.node_sets["cyclic_high"]]
    assert max(np.linalg.norm(high - place, axis=1).min() for place in pairs) < 1e-15
