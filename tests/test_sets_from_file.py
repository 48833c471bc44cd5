"""What a study takes from a file beside the mesh: sets that it picks itself, and the file's own rotation."""

import numpy as np
import pytest
from solid_models import box
from test_readers_ansys import cube

import stickslip as ss
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.structure import Structure
from stickslip.model.structure_file import save_structure

SETS = """
[part.block.sets]
ends = { pattern = "t?P*" }
slab = { box_m = [[0.03, 1, 1], [0.07, 0, 0]] }
ring = { cylinder_m = [[0.05, 0, 0], [0.2, 0, 0]], radius_m = [0.015, 0.025] }
few = { nodes = [45, 30, 12] }
both = { pattern = "tip", box_m = [[0, 0.01, -1], [1, 1, 1]] }
"""


def study(folder, file, more=""):
    (folder / "study.toml").write_text(f'schema_version = 2\n[part.block]\nfile = "{file}"\nunits = "SI"\n{SETS}{more}')
    return ss.Study.from_file(folder / "study.toml")


@pytest.fixture
def block(tmp_path):
    mesh = box(8, (0.1, 0.02, 0.02), (4, 2, 2))
    write_deck(mesh, Material(), tmp_path / "block.inp", axis=Axis((1, 0, 0)), run=CalculixRun())
    return mesh


def wanted(points):
    x, y, z = points.T
    from_axis = np.hypot(y, z)
    return {
        "ends": x > 0.0999,
        "slab": (x > 0.029) & (x < 0.071),
        "ring": (x > 0.049) & (from_axis > 0.0149) & (from_axis < 0.0251),
        "few": np.isin(np.arange(len(points)), [11, 29, 44]),  # the deck counts from 1
        "both": (x > 0.0999) & (y > 0.0099),
    }


def test_sets_of_a_mesh_are_picked_by_names_box_and_cylinder(block, tmp_path):
    part = study(tmp_path, "block.inp").model().parts["block"]
    for name, inside in wanted(block.points).items():
        assert inside.any()
        assert np.array_equal(part.mesh.node_sets[name], np.flatnonzero(inside))
        assert part.structure.sets[name].size == 3 * inside.sum()


def test_sets_of_matrices_hold_the_dofs_of_what_is_picked(block, tmp_path):
    whole = study(tmp_path, "block.inp").model().parts["block"].structure
    kept = {name: own for name, own in whole.sets.items() if name not in wanted(block.points)}
    save_structure(Structure(whole.mass, whole.damping, whole.stiffness, whole.dofs, kept), tmp_path / "block.npz")
    part = study(tmp_path, "block.npz").model().parts["block"].structure
    for name in wanted(block.points):
        assert np.array_equal(np.sort(part.sets[name]), np.sort(whole.sets[name]))


@pytest.mark.parametrize(
    ("key", "message"),
    [
        (
            "far = { box_m = [[5, 5, 5], [6, 6, 6]] }",
            r"sets\.far: picks none .*between \[0, 0, 0\] and \[0\.1, 0\.02, 0\.02\] m",
        ),
        ('far = { pattern = "tpi*" }', r"sets\.far\.pattern: fits no set .*'tpi\*'.*TIP"),
        ("tip = { box_m = [[0, 0, 0], [1, 1, 1]] }", r"sets\.tip: is the name of a set of the file"),
        ("far = { nodes = [12, 99, 100] }", r"sets\.far\.nodes: the file has no node 99 that moves, nor 1 more"),
        ("far = {}", r"sets\.far\.pattern: picks nothing"),
        ("far = { radius_m = [0, 1] }", r"sets\.far\.pattern: picks nothing"),
        ("far = { cylinder_m = [[0, 0, 0], [0, 0, 1]] }", r"sets\.far\.radius_m: is missing"),
        ("far = { cylinder_m = [[0, 0, 0], [0, 0, 1]], radius_m = [1, 1] }", r"radius_m: must rise"),
    ],
)
def test_sets_that_pick_nothing_are_refused(block, tmp_path, key, message):
    with pytest.raises(InputError, match=message):
        study(tmp_path, "block.inp", key).model()


ARCHIVE = """
schema_version = 2
[part.cube]
file = "cube.cdb"
units = "mm-t-s"
sectors = 4
"""
PAIRS = "CP,1,UX,40,20\nCP,2,UY,40,20\nCP,3,UX,80,60 ! from CPCYC\n"


def archive(folder, commands, keys=""):
    (folder / "cube.cdb").write_text(cube() + commands)
    (folder / "study.toml").write_text(ARCHIVE + keys)
    return ss.Study.from_file(folder / "study.toml").model()


def test_coupled_pairs_and_rotation_of_an_archive_are_taken(tmp_path):
    speed = "\n[rotation]\nspeed_rpm = 9000.0"
    model = archive(tmp_path, PAIRS + "OMEGA,0,0,942.477796\n", speed)
    mesh = model.parts["cube"].mesh
    low, high = (mesh.numbers[mesh.node_sets[name]].tolist() for name in ("cyclic_low", "cyclic_high"))
    assert (low, high) == ([10, 20, 50, 60], [10, 40, 50, 80])  # two of them on the axis
    assert model.neighbours is not None
    assert not any("turns" in text for text in model.warnings)
    model = archive(tmp_path, PAIRS + "OMEGA,0,0,942.477796\n", speed.replace("9000", "100"))
    assert "part.cube: its file turns at 9000 rpm, the model at 100 rpm." in model.warnings


@pytest.mark.parametrize(
    ("commands", "keys", "message"),
    [
        (PAIRS + "OMEGA,0,0,942.477796", "", r"rotation\.speed_rpm: is missing, .*part\.cube turns at 9000 rpm"),
        (PAIRS + "CMOMEGA,ROTOR,0,0,9", "", r"line \d+: rotates by CMOMEGA"),
        (PAIRS + "CE,R5.0,DEFI,1,2,0.0", "", r"line \d+: is an equation without terms"),
        ("CP,1,UX,20,40,60", "", r"low_face: is missing with 4 sectors, and the file has no cyclic tie"),
        ("CP,1,UX,20,60", "", r"part\.cube\.sectors: is 4, and the file couples 1 pairs"),
    ],
)
def test_what_an_archive_says_is_not_dropped(tmp_path, commands, keys, message):
    with pytest.raises(InputError, match=message):
        archive(tmp_path, commands, keys)


def test_rotation_of_a_deck_in_other_words_is_refused(block, tmp_path):
    deck = tmp_path / "block.inp"
    deck.write_text(deck.read_text() + "*STEP\n*STATIC\n*DLOAD\nEALL, ROTA, 9., 0., 0., 0., 1., 0., 0.\n*END STEP\n")
    with pytest.raises(InputError, match="rotates by ROTA, and rotation is read as CENTRIF alone"):
        study(tmp_path, "block.inp").model()
