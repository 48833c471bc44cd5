"""Parts of several kinds of cells in studies: contacts and pressures on triangles and quadrilaterals, drawn and exported."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from element_decks import deck
from solid_models import box
from test_element_kinds import mesh_of

import stickslip as ss
from stickslip.assembly.full_field import Nodes
from stickslip.errors import InputError
from stickslip.model.deck import write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh, by_kind, cell_blocks, facets_of, write_mesh
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.readers.frd import read_frd
from stickslip.model.readers.units import Units
from stickslip.study.exchange.frd import _mesh

SIZE, DIVISIONS = (0.1, 0.02, 0.01), (4, 1, 1)
STUDY = """
schema_version = 2
[part.low]
file = "beam.inp"
units = "SI"
[part.high]
of = "low"
placed = [{{ mirror = "z" }}, {{ move_m = [0, 0, 0.02] }}]
[reduction]
fixed_interface_modes = 12
[damping]
ratio = 0.01
between_hz = [500, 3000]
[contact.faces]
between = ["low.TOP", "high.TOP"]
pairing = "{pairing}"
law = "elastic_coulomb"
{extra}
normal_stiffness_{per} = 2e{n}
tangential_stiffness_{per} = 1e{n}
axial_stiffness_{per} = 1e{n}
friction_coefficient = 0.5
{preload}
[load.pull]
{load}
[forced_response]
frequency_hz = [700, 1300]
points = 5
peak_points = 0
stability = "off"
[harmonics]
high = 1
selection = "always_low"
[output]
points = {{ tip = "low.TIPS" }}
peak = "tip.{axis}"
"""
BY_AREA = {
    "pairing": "segment_to_segment",
    "per": "n_per_m3",
    "n": 10,
    "preload": "preload_pa = 1e9",
    "extra": 'per = "area"',
}
BY_NODE = {"pairing": "node_to_node", "per": "n_per_m", "n": 6, "preload": "preload_n = 1e6", "extra": ""}
FORCE = {"load": 'on = "low.TIPS"\nforce_n = 3.0\ndirection = "y"', "axis": "y"}
PRESSURE = {"load": 'on = "low.BELOW"\npressure = "field.csv"', "axis": "z"}


def beam(mesh):
    """The box with its faces as node sets."""
    x, _, z = mesh.points.T
    free = x > 1e-9
    sets = {
        "root": np.flatnonzero(~free),
        "TOP": np.flatnonzero((z > SIZE[2] - 1e-9) & (x > SIZE[0] / 2 - 1e-9)),
        "BELOW": np.flatnonzero((z < 1e-9) & free),
        "TIPS": np.flatnonzero(x > SIZE[0] - 1e-9),
    }
    return SolidMesh(mesh.points, mesh.cells, sets)


def amplitudes(folder, mesh, **words):
    folder.mkdir()
    write_deck(beam(mesh), Material(), folder / "beam.inp")
    x, y = np.meshgrid(np.linspace(0, SIZE[0], 41), np.linspace(0, SIZE[1], 11))
    rows = [f"{a},{b},0.0,{2e3 * a:.6e},0.0" for a, b in zip(x.ravel(), y.ravel(), strict=True)]
    (folder / "field.csv").write_text("\n".join(["x_m,y_m,z_m,real_pa,imag_pa", *rows]) + "\n")
    (folder / "study.toml").write_text(STUDY.format(**words))
    result = ss.Study.from_file(folder / "study.toml").run()
    return result, np.ravel(result["forced_response"]["amplitude"].values)


@pytest.mark.parametrize(("contact", "load"), [(BY_AREA, FORCE), (BY_NODE, FORCE), (BY_AREA, PRESSURE)])
def test_contacts_and_pressures_act_on_facets_of_both_shapes(tmp_path, contact, load):
    """Wedges and bricks of second order for bricks alone: the same beams to the error of the mesh."""
    mixed = mesh_of(("wedges", "hex"), True, SIZE, DIVISIONS)
    faces = facets_of(mixed, beam(mixed).node_sets["TOP"])
    assert set(np.count_nonzero(faces >= 0, axis=1).tolist()) == {6, 8}
    result, found = amplitudes(tmp_path / "mixed", mixed, **contact, **load)
    _, plain = amplitudes(tmp_path / "plain", box(20, SIZE, DIVISIONS), **contact, **load)
    assert found.size == plain.size >= 5
    # lateral motions are small: wedges are not symmetric to the middle
    np.testing.assert_allclose(found, plain, rtol=0, atol=0.01 * plain.max())
    if contact is BY_NODE:
        assert exported(result, tmp_path) == ({15: 8, 20: 4}, {"wedge15": 8, "hexahedron20": 4})


def exported(result, folder):
    """Cells by kind in the .frd and the .vtu of a result."""
    meshio = pytest.importorskip("meshio")
    (path,) = result.export("frd", folder, units="mm-t-s")
    back = read_frd(path, units=Units.mm_t_s())
    vtu = meshio.read(next(p for p in result.export("vtu", folder) if p.suffix == ".vtu"))
    kinds = {}
    for block in vtu.cells:
        kinds[block.type] = kinds.get(block.type, 0) + len(block.data)
    return {width: len(rows) for width, rows in by_kind(back.mesh.cells)}, kinds


def test_pyramids_are_written_as_meshes_and_results_have_them(tmp_path):
    """VTK has them; an .frd file has bricks with one node for their upper face instead."""
    meshio = pytest.importorskip("meshio")
    mesh = mesh_of(("wedges", "hex", "pyramids"), True, SIZE, (6, 1, 1))
    counts = {width: len(rows) for width, rows in by_kind(mesh.cells)}
    assert counts == {13: 12, 15: 4, 20: 2}
    write_mesh(mesh, tmp_path / "mesh.vtu")
    back = {block.type: block.data for block in meshio.read(tmp_path / "mesh.vtu").cells}
    for name, cells in cell_blocks(mesh.cells):
        np.testing.assert_array_equal(back[name], cells)
    nodes = Nodes(
        "beam", mesh.numbers, mesh.points, mesh.cells, mesh.cell_numbers, np.zeros((len(mesh.points), 3), int)
    )
    bodies = (SimpleNamespace(nodes=nodes),)
    text = "\n".join(["    1C", *_mesh(SimpleNamespace(bodies=bodies), Units.si()), " 9999", ""])
    (tmp_path / "mesh.frd").write_text(text)
    found = read_frd(tmp_path / "mesh.frd").mesh
    assert {width: len(rows) for width, rows in by_kind(found.cells)} == {15: 4, 20: 14}
    with pytest.raises(InputError, match="the mesh has pyramids, which CalculiX does not have"):
        write_deck(mesh, Material(), tmp_path / "mesh.inp")


def test_wedges_of_calculix_come_back_from_its_results(tmp_path):
    """A deck of wedges and bricks and the mesh that ccx 2.20 writes for it: the same order of nodes."""
    path = tmp_path / "deck.inp"
    path.write_text(deck("block", ("C3D20R", "C3D15")))
    one = read_deck(path, units=Units.mm_t_s())
    back = read_frd(Path(__file__).parent / "data" / "calculix" / "mixed_cells.frd.gz", units=Units.mm_t_s())
    assert back.mesh.cells.tolist() == one.mesh.cells.tolist()
