"""Faces of a sector that neither a cyclic tie nor a contact holds are doubted; parts without such faces are not."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from solid_models import box

from stickslip.assembly.joints.cyclic_faces import MeetingFaces, _sets, meeting_faces, uncoupled, untied_faces
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import Part, solid_part
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.readers.units import Units
from stickslip.study.models.study import read_study

EXAMPLES = Path(__file__).parents[1] / "examples"
STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)


def wedge(width: int, sectors: int = 24, share: float = 1.0) -> SolidMesh:
    """A sector of a ring between the radii 0.2 and 0.3 m; `share` of the pitch, its cut faces the sets ``a`` and ``b``."""
    flat = box(width, (0.1, 1.0, 0.02), (3, 2, 2))
    pitch = 2 * np.pi / sectors
    radius, angle = 0.2 + flat.points[:, 0], share * pitch * (flat.points[:, 1] - 0.5)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), flat.points[:, 2]])
    sides = {"a": np.flatnonzero(flat.points[:, 1] == 0.0), "b": np.flatnonzero(flat.points[:, 1] == 1.0)}
    return SolidMesh(points, flat.cells, flat.node_sets | sides)


def doubts(mesh: SolidMesh, touched: tuple[str, ...] = (), **others) -> list[str]:
    part = solid_part(mesh, STEEL, others.pop("axis", Axis()), clamped=(), **others)
    return untied_faces({"blade": part}, touched)


@pytest.mark.parametrize("width", [4, 8, 10, 20])
def test_the_faces_of_a_sector_meet_for_every_kind_of_cell(width: int) -> None:
    mesh = wedge(width)
    (found,) = meeting_faces(mesh, Axis())
    assert found.sectors == 24
    assert set(found.low) == set(mesh.node_sets["a"])
    assert set(found.high) == set(mesh.node_sets["b"])
    # of the skin: two cut faces, two plane sides, the inner and the outer one
    pitch = np.pi / 12
    whole = 2 * 0.002 + pitch * (0.3**2 - 0.2**2) + pitch * 0.02 * 0.5
    assert found.share == pytest.approx(0.002 / whole, rel=2e-3)  # facets are flat


def test_a_sector_alone_is_told_its_number_of_sectors_its_sets_and_its_axis() -> None:
    (said,) = doubts(wedge(20))
    assert "looks like one of 24 sectors of a wheel, and is computed alone: 'a' and 'b' meet when turned by 15°" in said
    assert 'Give sectors = 24, low_face = "a", high_face = "b"; or sectors = 1' in said
    mesh = wedge(8)
    lying = replace(mesh, points=mesh.points[:, [2, 0, 1]], node_sets={})
    (said,) = doubts(lying)
    assert "two faces, " in said
    assert "axis_direction = [1.0, 0.0, 0.0]" in said


@pytest.mark.parametrize("share", [0.99, 0.999])
def test_faces_with_a_gap_are_no_sector(share: float) -> None:
    assert doubts(wedge(8, share=share)) == []


def test_held_faces_planes_of_symmetry_and_blocks_are_no_sector() -> None:
    mesh = wedge(8)
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    held[np.union1d(mesh.node_sets["a"], mesh.node_sets["b"]), 1] = True  # one direction, as at planes of symmetry
    assert doubts(mesh, held=held) == []
    assert doubts(mesh, alone=True) == []
    assert doubts(wedge(8, sectors=2)) == []
    for size in ((0.1, 0.1, 0.1), (0.1, 0.02, 0.01)):
        block = box(8, size, (2, 2, 2))
        assert doubts(replace(block, points=block.points - np.array(size) / 2)) == []


def test_faces_in_contact_are_no_doubt_and_a_wheel_names_what_is_missing() -> None:
    mesh = wedge(8)
    wheel = {"sectors": 24, "faces": ("low", "high")}
    between = ("blade.b", "next.blade.a")
    (said,) = doubts(mesh, **wheel)
    assert "'a' and 'b' of neighbouring sectors touch, but nothing holds them: they pass through each other" in said
    assert (
        'Give a contact between = ["blade.b", "next.blade.a"], tie them with low_face = "a" and high_face = "b"' in said
    )
    assert doubts(mesh, between, **wheel) == []
    assert doubts(mesh, sectors=24, faces=("a", "b")) == []
    assert doubts(mesh, sectors=30, faces=("low", "high")) == []  # of another wheel: they do not touch


def test_a_whole_wheel_is_no_sector() -> None:
    """Blades of a whole wheel have faces that meet after a turn, too: twelve of 24 sectors, each by itself."""
    one = wedge(8)
    turned = [Axis().turned(one.points, 2 * np.pi * k / 12) for k in range(12)]
    cells = [one.cells + k * len(one.points) for k in range(12)]
    assert doubts(SolidMesh(np.vstack(turned), np.vstack(cells), {})) == []
    assert len(doubts(SolidMesh(np.vstack(turned[:3]), np.vstack(cells[:3]), {}))) == 1


def test_copies_are_no_doubt() -> None:
    part = solid_part(wedge(8), STEEL, clamped=())
    assert untied_faces({"one": part, "other": replace(part, template=part)}, ()) == []


def test_sectors_without_ties_and_contacts_are_uncoupled() -> None:
    part: Part = solid_part(wedge(8), STEEL, clamped=(), sectors=24, faces=("low", "high"))
    assert uncoupled({"blade": part}, ("blade.b", "ground"))
    assert not uncoupled({"blade": part}, ("blade.b", "next.blade.a"))
    assert not uncoupled({"blade": replace(part, faces=("a", "b"))}, ())
    assert not uncoupled({"blade": replace(part, sectors=1)}, ())


def without_tie(folder: Path, keys: str) -> Path:
    """The sector of examples/sector_deck without its cyclic tie, as a study that asks for modes."""
    lines, kept = (EXAMPLES / "sector_deck" / "sector.inp").read_text().splitlines(), []
    for line in lines:
        if line.startswith("*"):
            wanted = not line.startswith(("*TIE", "*CYCLIC", "*SURFACE"))
        if wanted:
            kept.append(line)
    (folder / "sector.inp").write_text("\n".join(kept) + "\n")
    study = folder / "study.toml"
    study.write_text(
        f'schema_version = 2\n[part.blade]\nfile = "sector.inp"\nunits = "SI"\n{keys}\n[rotation]\nspeed_rpm = 0\n[modes]\n'
    )
    return study


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("", [r"looks like one of 24 sectors .*low_face = \"CYCLIC_LOW\", high_face = \"CYCLIC_HIGH\""]),
        ("sectors = 1", []),
        ("plausible = false", []),
        ('sectors = 24\nlow_face = "CYCLIC_LOW"\nhigh_face = "CYCLIC_HIGH"', []),
        ('sectors = 24\ncyclic = "none"', ["of neighbouring sectors touch", "nothing couples the 24 sectors"]),
    ],
)
def test_a_deck_whose_tie_was_forgotten_is_doubted(tmp_path: Path, keys: str, words: list[str]) -> None:
    warnings = read_study(without_tie(tmp_path, keys)).model().warnings
    assert len(warnings) == len(words)
    for said, word in zip(warnings, words, strict=True):
        assert re.search(word, said)


@pytest.mark.parametrize("name", ["calculix_wheel", "own_blades", "root_joint", "sector_deck", "two_stages"])
def test_decks_of_examples_are_not_doubted(name: str) -> None:
    model = read_study(EXAMPLES / name / "study.toml").model()
    assert untied_faces(model.parts, [n for one in model.contacts.values() for n in one.between]) == []


def test_supports_of_one_cyclic_face_hold_its_partners_as_in_a_deck_with_a_tie(tmp_path: Path) -> None:
    """CalculiX accepts no support on the dependent face, so that a deck without its tie is held on one face only."""
    keys = 'sectors = 24\nlow_face = "CYCLIC_{}"\nhigh_face = "CYCLIC_{}"'
    model = read_study(without_tie(tmp_path, keys.format("LOW", "HIGH"))).model()
    tied = read_study(EXAMPLES / "sector_deck" / "study.toml").model()
    one, other = (m.parts["blade"].solid for m in (model, tied))
    np.testing.assert_array_equal(one.moving, other.moving)
    assert model.neighbours.low.size == tied.neighbours.low.size
    swapped = read_study(without_tie(tmp_path, keys.format("HIGH", "LOW"))).model()
    with pytest.raises(InputError, match="are swapped: 'CYCLIC_LOW' lies 15° behind 'CYCLIC_HIGH'"):
        _ = swapped.warnings


def test_the_order_of_the_faces_in_the_tie_of_a_deck_is_free(tmp_path: Path) -> None:
    """Master and slave of *TIE may be exchanged: the low face is found by geometry, and nothing changes."""
    text = (EXAMPLES / "sector_deck" / "sector.inp").read_text()
    assert "LOW, HIGH\n" in text
    (tmp_path / "sector.inp").write_text(text.replace("LOW, HIGH\n", "HIGH, LOW\n"))
    decks = [
        read_deck(path, units=Units.si()) for path in (EXAMPLES / "sector_deck" / "sector.inp", tmp_path / "sector.inp")
    ]
    for name, nodes in decks[0].mesh.node_sets.items():
        np.testing.assert_array_equal(decks[1].mesh.node_sets[name], nodes)
    np.testing.assert_array_equal(decks[0].held, decks[1].held)


def test_sets_that_meet_are_told_the_largest_first_and_no_set_with_itself():
    """Nodes on the axis lie on both faces: turned, their set meets itself."""
    heights = np.linspace(0.0, 1.0, 4)
    axis, low = (np.array([[r, 0.0, z] for r in radii for z in heights]) for radii in ((0.0,), (0.4, 0.7, 1.0)))
    points = np.vstack([axis, low, Axis().turned(low, np.pi / 3), [[0.5, 0.2, 0.5]] * 5])
    centre, here, there = np.arange(4), np.arange(4, 16), np.arange(16, 28)
    sets = {
        "AXIS": centre,
        "RIM_HIGH": there[8:],
        "RIM_LOW": here[8:],
        "LOW": here,
        "HIGH": there,
        "INSIDE": np.arange(28, 33),
        "FEW": here[:2],
        "FEW_HIGH": there[:2],
    }
    found = MeetingFaces(6, Axis(), np.r_[centre, here], np.r_[centre, there], 0.2)
    assert _sets(SolidMesh(points, np.zeros((0, 4), dtype=int), sets), found) == [
        ("LOW", "HIGH"),
        ("RIM_LOW", "RIM_HIGH"),
    ]
