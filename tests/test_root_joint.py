"""Bodies pressed together or tied on faces that do not match, from decks and a study file (journey J8)."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from blocks import two_planes
from hypothesis import given
from hypothesis import strategies as st
from small_v2 import changed
from typer.testing import CliRunner

from stickslip.api.result import Result
from stickslip.assembly.assembling import assemble
from stickslip.cli import app
from stickslip.contact.mortar import mortar_tie
from stickslip.errors import InputError
from stickslip.model.deck import write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.facets import KINDS
from stickslip.study.models.study import read_study
from stickslip.study.store.netcdf import read_tree

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

EXAMPLE = Path(__file__).parents[1] / "examples" / "root_joint"
_spec = importlib.util.spec_from_file_location("make_decks", EXAMPLE / "make_decks.py")
make_decks = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(make_decks)

YOUNG, LENGTH, STIFFNESS = 2e11, 0.02, 5e13
# of two bars against each other and a contact: an overlap d presses by d / (2 L / E + 1 / k_n)
EXACT = 1e-6 / (2 * LENGTH / YOUNG + 1 / STIFFNESS)
STEEL = Material(young_modulus=YOUNG, poisson_ratio=0.0)  # one-dimensional under uniform pressure
LAW = f"""
law = "elastic_coulomb"
per = "area"
normal_stiffness_n_per_m3 = {STIFFNESS}
tangential_stiffness_n_per_m3 = {STIFFNESS}
axial_stiffness_n_per_m3 = {STIFFNESS}
friction_coefficient = 0.3
"""
PARTS = """
schema_version = 2
title = "Two blocks"
[part.lower]
file = "lower.inp"
units = "SI"
[part.upper]
file = "upper.inp"
units = "SI"
"""
SHAKEN = """
[load.shaker]
on = "upper.bottom"
force_n = 1.0
direction = "z"
[forced_response]
frequencies_hz = [1000.0, 1100.0]
peak_points = 0
[harmonics]
low = 1
high = 1
selection = "always_low"
[output]
points = { shaken = "upper.bottom" }
"""
COARSE = ([0.0, 0.4, 1.0], [0.0, 0.5, 1.0])
FINE = ([0.0, 0.3, 0.7, 1.0], [0.0, 0.35, 0.6, 1.0])


def deck(path, grid, low, held, quadratic=False):
    """Write a block on a grid over the unit of 10 mm, from the height `low`; a face of it is held."""
    heights = np.linspace(low, low + LENGTH, 3)
    lines = (0.01 * np.asarray(grid[0]), 0.01 * np.asarray(grid[1]), heights)
    faces = {
        "bottom": lambda at: at[:, 2] == heights[0],
        "top": lambda at: at[:, 2] == heights[-1],
        "side": lambda at: at[:, 0] == 0.0,
    }
    mesh = make_decks.block(lines, sets=faces, quadratic=quadratic)
    write_deck(mesh, STEEL, path, clamped=held)


def blocks(folder, lower, upper, more, held=("top",), quadratic=False):
    deck(folder / "lower.inp", lower, 0.0, ("bottom",), quadratic)
    deck(folder / "upper.inp", upper, LENGTH, held, quadratic)
    path = folder / "study.toml"
    path.write_text(PARTS + more, encoding="utf-8")
    return path


def answered(path, analysis="forced_response"):
    found = CliRunner().invoke(app, ["run", str(path), "--no-report"])
    assert found.exit_code == 0, found.output
    return read_tree(path.parent / "results" / "result.nc")[analysis]


def misses(folder, pairing, more, held, quadratic=False):
    """Return how far the pressure of the contact points is off, as a share of the exact one."""
    study = blocks(folder, COARSE, FINE, more.format(pairing) + SHAKEN, held, quadratic)
    found = assemble(read_study(study).model(), 1)
    return np.abs(-found.static_force[:, 2] / found.contacts.area / EXACT - 1.0).max()


CONTACT = '[contact.joint]\nbetween = ["lower.top", "upper.bottom"]\npairing = "{}"\ninterference_m = 1e-6\n' + LAW
JOINED = (
    '[join.joint]\nbetween = ["lower.top", "upper.bottom"]\npairing = "{}"\n'
    '[contact.press]\nbetween = ["upper.top", "ground"]\ninterference_m = 1e-6\n' + LAW
)


def test_uniform_pressure_passes_through_faces_that_do_not_match(tmp_path):
    data = answered(blocks(tmp_path, COARSE, FINE, CONTACT.format("segment_to_segment") + SHAKEN))
    assert data.sizes["contact"] >= 50
    pressure = -data["static_force"].values[0, :, 2] / data["contact_area"].values
    np.testing.assert_allclose(pressure, EXACT, rtol=1e-10)
    np.testing.assert_allclose(data["contact_area"].sum(), 1e-4, rtol=1e-12)


def test_quadratic_faces_pass_it_and_contacts_of_nodes_do_not(tmp_path):
    assert misses(tmp_path, "segment_to_segment", CONTACT, ("top",), quadratic=True) < 1e-10
    assert 0.1 < misses(tmp_path, "node_to_segment", CONTACT, ("top",)) < 0.3


def test_a_join_in_the_mean_passes_constant_stress_and_one_of_nodes_does_not(tmp_path):
    """The end of a joined bar is pressed by an overlap with the ground; only a uniform stress presses it uniformly."""
    assert misses(tmp_path, "segment_to_segment", JOINED, ()) < 1e-10
    assert 1e-3 < misses(tmp_path, "node_to_segment", JOINED, ()) < 0.1


def stuck(folder, joint):
    folder.mkdir()
    study = blocks(folder, FINE, FINE, joint + "[modes]\nnumber = 5\ncontacts = 'stuck'\n", ())
    return answered(study, "modes")["frequency_hz"].values.ravel()


def test_a_stuck_contact_tends_to_the_join_as_it_stiffens(tmp_path):
    """On faces that match: first order in the flexibility of the contact. There a join of nodes is one in the mean."""
    between = 'between = ["upper.bottom", "lower.top"]\n'
    tied, nodes = (
        stuck(tmp_path / way, f'[join.joint]\n{between}pairing = "{way}"\n')
        for way in ("segment_to_segment", "node_to_node")
    )
    np.testing.assert_allclose(tied, nodes, rtol=1e-9)
    errors = []
    for k in (1e15, 1e16, 1e17):
        own = LAW.replace(str(STIFFNESS), str(k))
        joint = f'[contact.joint]\n{between}pairing = "segment_to_segment"\n{own}'
        errors.append(np.abs(stuck(tmp_path / f"{k:g}", joint) / tied - 1.0).max())
    assert errors[2] < 1e-3
    np.testing.assert_allclose(np.divide(errors[:2], errors[1:]), 10.0, rtol=0.2)


def command(*words):
    found = CliRunner().invoke(app, [str(word) for word in words])
    assert found.exit_code == 0, found.output
    return " ".join(found.output.split())


@pytest.mark.validation
def test_a_root_in_its_slot_from_decks_to_the_page(tmp_path):
    """The example on a coarser mesh: pressed by the pull, its resonance falls as the flanks begin to slip."""
    blade = make_decks.blade(across=1, along=2, up=1, above=2)
    write_deck(blade, Material(), tmp_path / "blade.inp", clamped=())
    lugs = make_decks.joined(make_decks.lug(-1), make_decks.lug(1))
    write_deck(lugs, Material(), tmp_path / "disk.inp", clamped=("held",))
    text = changed(
        (EXAMPLE / "study.toml").read_text(encoding="utf-8"),
        {
            "forced_response.frequency_hz": "[2060.0, 2140.0]",
            "forced_response.frequencies": "5",
            "forced_response.peak_points": "0",
            "harmonics.high": "1",
            "harmonics.selection": '"always_low"',
            "harmonics.samples": "32",
        },
    )
    study = tmp_path / "study.toml"
    study.write_text(text, encoding="utf-8")
    assert "static equilibrium: 192 of 192 contact points are pressed" in command("check", study)
    command("run", study)
    data = read_tree(tmp_path / "results" / "result.nc")["forced_response"]
    # both flanks together carry the pull
    force = np.einsum("pxd,pd->px", data["contact_frame"].values, data["static_force"].values[0])
    np.testing.assert_allclose(force.sum(axis=0), [0.0, 0.0, -5000.0], atol=1e-6)
    small, large = (data["peak_amplitude"].values[i] / f for i, f in ((0, 4.0), (1, 20.0)))
    assert large < 0.7 * small
    assert data["peak_frequency_hz"].values[1] < data["peak_frequency_hz"].values[0]
    # the page maps the flanks: at the larger force more of them slips
    drawn = Result.from_file(tmp_path / "results").plot("surface").data
    shares = [(t.meta, t.marker.color) for t in drawn if t.marker.color is not None]
    slip = [np.mean([color for meta, color in shares if meta == case]) for case in (0, 1)]
    assert slip[1] > slip[0] + 5
    state = data["peak_state"].values[1]
    exact = 100 * (state == 1).any(axis=1).mean()
    assert slip[1] == pytest.approx(exact, rel=1e-5)


ROCKED = """
[contact.joint]
between = ["upper.bottom", "lower.top"]
pairing = "node_to_node"
friction_coefficient = 0.3
{}
[load.push]
on = "upper.top"
force_n = 2000.0
direction = [0.0, 0.0, -1.0]
harmonic = 0
[load.shaker]
on = "upper.top"
force_n = 250.0
direction = "x"
[damping]
ratio = 0.01
between_hz = [3000.0, 9000.0]
[reduction]
fixed_interface_modes = 8
[forced_response]
frequencies_hz = [4000.0, 4100.0]
peak_points = 0
stability = "off"
[harmonics]
low = 3
high = 3
samples = 96
selection = "always_high"
[output]
points = {{ top = "upper.top" }}
"""


def test_rigid_contacts_of_meshes_are_the_limit_of_stiff_ones(tmp_path):
    """A block that rocks, slips and lifts off on another one: gaps of two flexible bodies become coordinates."""
    grid = ([0.0, 0.5, 1.0], [0.0, 1.0])
    found = []
    for name, law in (("rigid", 'law = "rigid_coulomb"'), ("stiff", LAW.replace(str(STIFFNESS), "1e15"))):
        (tmp_path / name).mkdir()
        own = law.replace("friction_coefficient = 0.3\n", "")
        data = answered(blocks(tmp_path / name, grid, grid, ROCKED.format(own), ()))
        assert (data["status"] == 0).all()
        found.append(data)
    rigid, stiff = found
    for name, off in (("static_force", 0.01), ("amplitude", 0.02)):
        a, b = (data[name].values for data in (rigid, stiff))
        assert np.abs(a - b).max() < off * np.abs(b).max()
    assert set(np.unique(rigid["peak_state"])) == {0, 1, 2}
    weight = rigid["static_force"].values[0, :, 2].sum()
    assert weight == pytest.approx(-2000.0, rel=1e-9)


# surfaces that cannot meet, and contacts that do nothing


def told(folder, contact, low=LENGTH, held=()):
    """Return what `check` says of two blocks, the upper one at a height, with its exit code."""
    blocks(folder, COARSE, FINE, "", held)
    deck(folder / "upper.inp", FINE, low, held)
    study = folder / "study.toml"
    study.write_text(PARTS + contact + SHAKEN, encoding="utf-8")
    found = CliRunner().invoke(app, ["check", str(study)])
    return found.exit_code, " ".join(found.output.split()).lower()  # decks have names in capitals


def between(first, second, name="joint", pairing="segment_to_segment"):
    return f'[contact.{name}]\nbetween = ["{first}", "{second}"]\npairing = "{pairing}"\n{LAW}'


REFUSED = [
    (
        between("lower.top", "upper.top"),
        LENGTH,
        "contact.joint.between: 'lower.top' and 'upper.top' look the same way: their outward normals, (0.00, 0.00, 1.00) and (0.00, 0.00, 1.00), are 180° from opposite. Name the faces that meet, or check how the parts are placed, turned and mirrored. 'upper.bottom' lies nearer than 'upper.top': are surfaces swapped?",
    ),
    (
        between("lower.side", "upper.bottom"),
        LENGTH,
        "'lower.side' and 'upper.bottom' do not face each other: their outward normals, (-1.00, 0.00, 0.00) and (0.00, 0.00, -1.00), are 90° from opposite",
    ),
    (between("lower.top", "upper.root"), LENGTH, "there is no surface or set 'upper.root'"),
    (
        between("lower.top", "upper.bottom") + '[join.weld]\nbetween = ["lower.top", "upper.bottom"]\n',
        LENGTH,
        "contact.joint.between: names the surfaces that join.weld ties for good",
    ),
    (
        between("lower.root", "ground", pairing="node_to_node"),
        LENGTH,
        "contact.joint.between: no point of the contact can move: its nodes are clamped",
    ),
]


@pytest.mark.parametrize(("contact", "low", "said"), REFUSED)
def test_surfaces_that_cannot_meet_are_refused(contact, low, said, tmp_path):
    code, found = told(tmp_path, contact, low)
    assert code == 2
    assert said.lower() in found


WARNED = [
    (
        between("lower.top", "upper.bottom"),
        LENGTH - 5e-4,
        "contact.joint: lower.top and upper.bottom overlap by up to 0.0005 m as they are placed, at (",
    ),
    (
        between("lower.top", "upper.bottom"),
        LENGTH + 1e-4,
        "contact.joint: lower.top and upper.bottom lie apart by 0.0001 m",
    ),
    (
        between("lower.side", "ground", pairing="node_to_node"),
        LENGTH,
        "contact.joint: lower.side borders on clamped nodes, 1, 4, 7; the facets between them and it, 2 beside 2, take no part in the contact.",
    ),
    (
        between("lower.top", "upper.bottom") + between("upper.bottom", "lower.top", "again"),
        LENGTH,
        "contact.again lies on the same points as contact.joint: their forces add up.",
    ),
]


@pytest.mark.parametrize(("contact", "low", "said"), WARNED)
def test_what_is_doubtful_of_a_contact_is_told(contact, low, said, tmp_path):
    code, found = told(tmp_path, contact, low, ("top",))
    assert code == 0, found
    assert said.lower() in found


def test_a_contact_that_is_right_is_not_warned_of(tmp_path):
    code, found = told(tmp_path, between("lower.top", "upper.bottom"))
    assert code == 0, found
    assert "contact.joint" not in found


# weights of the tie

grids = st.lists(st.floats(0.2, 1.0), min_size=1, max_size=3).map(
    lambda steps: np.concatenate([[0.0], np.cumsum(steps) / np.sum(steps)])
)
kinds = st.sampled_from(["tri", "quad", "tri6", "quad8"])


@given(st.tuples(grids, grids), st.tuples(grids, grids), st.tuples(kinds, kinds))
def test_a_tie_in_the_mean_moves_along_with_linear_fields(grid_a, grid_b, kind):
    a, b = two_planes(grid_a, grid_b, kind)
    weights = mortar_tie(a, b)
    fields = [np.column_stack([np.ones(len(s.points)), s.points[:, :2]]) for s in (a, b)]
    np.testing.assert_allclose(weights @ fields[1], fields[0], atol=1e-11)


@given(st.tuples(grids, grids), st.tuples(grids, grids), st.tuples(kinds, kinds))
def test_a_tie_in_the_mean_passes_a_constant_stress(grid_a, grid_b, kind):
    """The consistent loads of side A go over into those of side B."""
    a, b = two_planes(grid_a, grid_b, kind)
    loads = [consistent_areas(side) for side in (a, b)]
    np.testing.assert_allclose(mortar_tie(a, b).T @ loads[0], loads[1], atol=1e-11 * loads[0].sum())


def consistent_areas(side):
    """Return ``∫ N dA`` of each node, by the weights of plane triangles and rectangles."""
    shares = {3: [1 / 3] * 3, 4: [1 / 4] * 4, 6: [0.0] * 3 + [1 / 3] * 3, 8: [-1 / 12] * 4 + [1 / 3] * 4}
    out = np.zeros(len(side.points))
    for row in side.facets:
        nodes = row[row >= 0]
        corners = side.points[nodes[: 3 if nodes.size in (3, 6) else 4]]
        area = np.linalg.norm(np.cross(corners[1] - corners[0], corners[-1] - corners[0]))
        np.add.at(out, nodes, area * np.array(shares[nodes.size]) / (2 if nodes.size in (3, 6) else 1))
    return out


@pytest.mark.parametrize("kind", ["quad", "tri6", "quad8"])
def test_a_node_tied_in_the_mean_follows_nodes_nearby(kind):
    steps = np.linspace(0.0, 1.0, 13), np.linspace(0.0, 1.0, 12)
    a, b = two_planes((steps[0], steps[0]), (steps[1], steps[1]), (kind, kind))
    weights = mortar_tie(a, b).tocoo()
    apart = np.linalg.norm(a.points[weights.row, :2] - b.points[weights.col, :2], axis=1)
    assert apart.max() < 5 / 12


def test_a_side_that_reaches_beyond_the_other_is_refused():
    a, b = two_planes((COARSE[0], COARSE[1]), ([0.0, 0.5, 0.8], COARSE[1]))
    with pytest.raises(InputError, match="20 % of side A have nothing of side B opposite"):
        mortar_tie(a, b)
    assert set(KINDS) == {3, 4, 6, 8}  # those of `kinds`
