"""The parametric sector: its geometry, its mesh, the regular ring, and the decks written of them."""

import math
import re

import numpy as np
import pytest

from evidence.models.annulus import annular_sector
from stickslip.errors import InputError, StickslipError
from stickslip.model.axis import Axis
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.mesh import sector_mesh
from stickslip.model.mesh.sector import Airfoil, BladedSector, DiskProfile, Platform, Shroud
from stickslip.model.mesh.sector_mesh import mesh_sector
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave

COARSE = {"disk_size": 0.025, "platform_size": 0.015, "airfoil_size": 0.020}
SHROUDED = BladedSector(shroud=Shroud(gap=0.0004), **COARSE)
ON_FACE = 1e-7  # m, by which gmsh may miss a surface


@pytest.fixture(scope="module")
def mesh():
    return mesh_sector(SHROUDED)


def volumes(mesh):
    corner = mesh.points[mesh.cells[:, :4]]
    return np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6


def at(mesh, name):
    return mesh.points[mesh.node_sets[name]]


def angles(points):
    return np.arctan2(points[:, 1], points[:, 0])


@pytest.mark.parametrize(
    ("name", "angle"),
    [
        ("cyclic", SHROUDED.pitch),
        ("platform", SHROUDED.pitch - 0.0008 / 0.187),
        ("shroud", SHROUDED.pitch - 0.0004 / (0.187 + 0.105)),
    ],
)
def test_high_faces_are_low_faces_turned(mesh, name, angle):
    turned = Axis().turned(at(mesh, f"{name}_low"), angle)
    assert np.abs(turned - at(mesh, f"{name}_high")).max() < 1e-15
    assert len(turned) > 8


def test_cyclic_faces_are_the_cut_planes_within_the_disk(mesh):
    for name, sign in (("cyclic_low", -1), ("cyclic_high", 1)):
        points = at(mesh, name)
        np.testing.assert_allclose(angles(points), sign * SHROUDED.pitch / 2, atol=ON_FACE)
        radius = np.hypot(points[:, 0], points[:, 1])
        assert radius.min() == pytest.approx(0.060)
        assert radius.max() == pytest.approx(0.170)


def test_node_sets_lie_on_their_faces(mesh):
    # mid-side nodes are on chords, which dip below a cylinder: at most by the sagitta of an element
    radius = {name: np.hypot(*at(mesh, name).T[:2]) for name in ("root", "tip")}
    assert radius["root"].max() == pytest.approx(0.060, abs=ON_FACE)
    assert radius["root"].min() > 0.060 - 0.025**2 / 0.060 / 8
    assert radius["tip"].max() > SHROUDED.shroud_radius + 0.002 - ON_FACE
    under = at(mesh, "platform_under")
    rise = (0.183 - under[:, 0]) / math.tan(math.radians(20))
    side = 0.183 * math.tan(SHROUDED.platform_angle / 2)
    np.testing.assert_allclose(np.abs(under[:, 1]), side - rise, atol=ON_FACE)
    shroud = at(mesh, "shroud_high")
    tilted = Axis().turned(shroud, -SHROUDED.shroud_angle / 2)
    np.testing.assert_allclose(tilted[:, 1], tilted[:, 2] * math.tan(math.radians(20)), atol=ON_FACE)


def test_contact_faces_do_not_touch_cut_faces(mesh):
    cut = np.concatenate([mesh.node_sets[name] for name in ("cyclic_low", "cyclic_high", "root")])
    for name in ("platform_low", "platform_high", "platform_under", "shroud_low", "shroud_high"):
        assert not np.isin(mesh.node_sets[name], cut).any()


def test_elements_are_upright_and_all_nodes_used(mesh):
    assert volumes(mesh).min() > 0
    np.testing.assert_array_equal(np.unique(mesh.cells), np.arange(len(mesh.points)))


def test_volume_is_that_of_the_parts(mesh):
    # Pappus for the disk, prisms for the rest; the straight-edged mesh and the overlaps of the parts differ from it
    r, z = SHROUDED.disk.outline.T
    step = r * np.roll(z, -1) - np.roll(r, -1) * z
    moment = abs(np.sum(step * (r + np.roll(r, -1)))) / 6
    x, y = SHROUDED.platform_outline().T
    neck = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2 * 0.034
    y, z = np.mean([SHROUDED.airfoil.section(s) for s in (0.0, 0.5, 1.0)], axis=0).T
    blade = abs(np.sum(y * np.roll(z, -1) - np.roll(y, -1) * z)) / 2 * 0.105
    ring = SHROUDED.shroud_radius * SHROUDED.shroud_angle * 0.026 * 0.004
    expected = moment * SHROUDED.pitch + neck + blade + ring
    assert volumes(mesh).sum() == pytest.approx(expected, rel=0.02)


def test_equal_geometries_give_equal_meshes(mesh):
    again = mesh_sector(SHROUDED)
    np.testing.assert_array_equal(again.points, mesh.points)
    np.testing.assert_array_equal(again.cells, mesh.cells)


@pytest.mark.parametrize(
    "geometry",
    [
        BladedSector(sectors=12, platform=None, **COARSE),
        BladedSector(platform=None, shroud=Shroud(span=0.6, face_angle=0.0), **COARSE),
        BladedSector(platform=Platform(gap=0.0), shroud=Shroud(face_angle=-0.3), **COARSE),
        BladedSector(sectors=36, disk=DiskProfile(web_width=0.05, rim_width=0.05), **COARSE),  # a disk of one width
    ],
)
def test_other_wheels_have_matching_faces_too(geometry):
    found = mesh_sector(geometry)
    turned = Axis().turned(at(found, "cyclic_low"), geometry.pitch)
    assert np.abs(turned - at(found, "cyclic_high")).max() < 1e-15
    assert volumes(found).min() > 0
    assert ("shroud_low" in found.node_sets) == (geometry.shroud is not None)
    assert ("platform_under" in found.node_sets) == (geometry.platform is not None)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BladedSector(sectors=2), "BladedSector.sectors: must be at least 3, got 2"),
        (lambda: BladedSector(sectors=90), r"platform.neck_width: .* reaches into the neighbours"),
        (lambda: BladedSector(disk_size=0.0), "BladedSector.disk_size: must be positive"),
        (lambda: DiskProfile(bore_radius=0.1), "do not grow in this order"),
        (lambda: DiskProfile(web_width=math.nan), "DiskProfile.web_width: must be positive"),
        (lambda: Airfoil(hub_thickness=0.1), "not below the chord"),
        (lambda: Shroud(span=1.2), r"must lie in \(0, 1\]"),
        (lambda: Shroud(face_angle=1.5), r"Shroud.face_angle: must lie in \[-1.309, 1.309\], got 1.5"),
        (lambda: BladedSector(platform=Platform(depth=0.04)), "exceeds the rim's width"),
        (lambda: BladedSector(platform=Platform(underside_angle=0.9)), "inside the rim"),
        (lambda: BladedSector(airfoil=Airfoil(hub_chord=0.05)), "overhangs the platform"),
        (lambda: BladedSector(airfoil=Airfoil(hub_chord=0.05), platform=None), "overhangs the rim"),
        (
            lambda: BladedSector(disk=DiskProfile(rim_height=0.00005), platform=None),
            "too low for what the curved rim carries",
        ),
        (lambda: BladedSector(airfoil=Airfoil(tip_chord=0.1, tip_thickness=0.09)), "reaches into the neighbour's"),
        (
            lambda: BladedSector(airfoil=Airfoil(tip_chord=0.2), shroud=Shroud(face_angle=0.0)),
            "cut through the airfoil",
        ),
        (lambda: BladedSector(shroud=Shroud(span=0.01)), "into the blade's foot"),
        (lambda: BladedSector(shroud=Shroud(span=0.99)), "end at the tip"),
        (lambda: BladedSector(shroud=Shroud(gap=0.2)), "leaves no shroud"),
        (lambda: BladedSector(shroud=Shroud(thickness=0.0001)), "stick out of the round shroud"),
    ],
)
def test_geometry_that_cannot_be_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_faces_in_pieces_are_named(monkeypatch):
    # a blade broader than its shroud's faces: what the check of the geometry would have refused
    monkeypatch.setattr(BladedSector, "_check_shroud", lambda self: None)
    broad = BladedSector(airfoil=Airfoil(tip_chord=0.2), shroud=Shroud(span=0.7, depth=0.15, face_angle=0.0), **COARSE)
    with pytest.raises(StickslipError, match=r"shroud face at .* came out in"):
        mesh_sector(broad)


# --- the regular ring -------------------------------------------------------------------------------------------------


def test_ring_has_its_mass_and_matching_faces():
    ring = annular_sector(0.1, 0.2, 0.03, sectors=8, divisions=(3, 3, 2))
    structure = assemble_solid(ring, Material(), clamped=())
    ones = np.zeros(structure.n)
    ones[2::3] = 1.0
    mass = 7850.0 * math.pi * (0.2**2 - 0.1**2) * 0.03 / 8
    # three parabolas of 15 degrees for an arc of 45: sides of order 4
    assert ones @ structure.mass @ ones == pytest.approx(mass, rel=1e-5)
    turned = Axis().turned(at(ring, "cyclic_low"), math.pi / 4)
    np.testing.assert_allclose(turned, at(ring, "cyclic_high"), atol=1e-15)
    np.testing.assert_allclose(np.hypot(*at(ring, "root").T[:2]), 0.1, rtol=1e-14)
    np.testing.assert_array_equal(np.unique(ring.cells), np.arange(len(ring.points)))


def test_a_disk_may_be_cut_in_any_number_of_sectors():
    # the same elements cut in 3 and in 6: wave k of 3 sectors holds the waves k and k + 3 of 6
    def frequencies(sectors, around, wave_number):
        ring = annular_sector(0.1, 0.2, 0.02, sectors=sectors, divisions=(2, around, 1))
        sector = cyclic_sector(assemble_solid(ring, Material()), sectors)
        return natural_frequencies(travelling_wave(sector, wave_number), 6)

    for wave_number in (0, 1):
        whole = frequencies(3, 4, wave_number)
        parts = [frequencies(6, 2, k) for k in (wave_number, wave_number + 3)]
        np.testing.assert_allclose(np.sort(np.concatenate(parts))[:6], whole, rtol=1e-9)


# --- decks ------------------------------------------------------------------------------------------------------------

MATERIAL = Material(young_modulus=1.1e11, poisson_ratio=0.31, density=4430.0)


def test_deck_gives_back_mesh_sets_material_and_speed(mesh, tmp_path):
    path = tmp_path / "wheel.inp"
    write_deck(mesh, MATERIAL, path, sectors=24, run=CalculixRun(speed=500.0))
    deck = read_deck(path)
    assert deck.material == MATERIAL
    assert deck.sectors == 24
    assert deck.speed == pytest.approx(500.0, rel=1e-13)
    np.testing.assert_array_equal(deck.mesh.cells, mesh.cells)
    np.testing.assert_allclose(deck.mesh.points, mesh.points, rtol=1e-13)
    np.testing.assert_array_equal(deck.mesh.numbers, np.arange(1, len(mesh.points) + 1))
    for name in ("tip", "platform_under", "shroud_low", "shroud_high"):
        theirs = deck.mesh.node_sets[name.upper()]
        np.testing.assert_array_equal(np.sort(theirs), np.sort(mesh.node_sets[name]))
    # CalculiX holds no dependent node: those of the low face follow the high face's, and the reader knows
    _, _, text = path.read_text().partition("*NSET, NSET=CLAMPED\n")
    clamped = np.array(re.findall(r"\d+", text.partition("*")[0]), dtype=int) - 1
    expected = np.setdiff1d(mesh.node_sets["root"], mesh.node_sets["cyclic_low"])
    np.testing.assert_array_equal(clamped, expected)
    np.testing.assert_array_equal(np.sort(deck.mesh.node_sets["root"]), mesh.node_sets["root"])


def test_deck_keeps_node_numbers_and_tells_steps(tmp_path):
    ring = annular_sector(0.1, 0.2, 0.03, sectors=8)
    path = tmp_path / "ring.inp"
    write_deck(ring, MATERIAL, path, run=CalculixRun(matrices=True, speed=2.0))
    text = path.read_text()
    assert "TYPE=C3D20" in text
    assert "CENTRIF, 4.0000000000000e+00, 0.0" in text
    assert "*STEP, PERTURBATION\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n" in text
    assert "CYCLIC SYMMETRY MODEL" not in text
    assert max(len(line.split(",")) for line in text.splitlines()) <= 16
    write_deck(ring, MATERIAL, path, sectors=8, run=CalculixRun(nodal_diameters=(2, 3)))
    text = path.read_text()
    # every frequency of a cyclic model comes twice
    assert "*FREQUENCY\n20\n*SELECT CYCLIC SYMMETRY MODES, NMIN=2, NMAX=3\n" in text
    assert "*STATIC" not in text


def test_decks_that_cannot_be_are_refused(tmp_path):
    ring = annular_sector(0.1, 0.2, 0.03, sectors=8)
    path = tmp_path / "ring.inp"
    with pytest.raises(InputError, match=r"lacks the node sets \['bolts'\]"):
        write_deck(ring, MATERIAL, path, clamped=("bolts",))
    with pytest.raises(InputError, match="asks for a cyclic model"):
        write_deck(ring, MATERIAL, path, run=CalculixRun(nodal_diameters=(0, 1)))
    with pytest.raises(InputError, match="without a speed"):
        CalculixRun(n_modes=0)
    assert not path.exists()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (StickslipError("the sector's parts do not hang together"), "the sector's parts do not hang together"),
        (
            RuntimeError("invalid boundary mesh"),
            "gmsh could not mesh the sector: invalid boundary mesh. Change the element sizes slightly",
        ),
    ],
)
def test_what_gmsh_cannot_mesh_is_told(error: Exception, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(sector_mesh, "_mesh", fail)
    with pytest.raises(StickslipError) as caught:
        mesh_sector(SHROUDED)
    assert str(caught.value) == said
    assert (caught.value is error) == isinstance(error, StickslipError)


@pytest.mark.parametrize("worst", [1.0, 0.5, -0.2])
def test_elements_are_refused_below_a_share_of_the_regular_tetrahedron(worst: float) -> None:
    """A regular one has the quality 1; lower by a factor, it has that factor, as long as its longest edge lies in its base."""
    base = np.array([[np.cos(a), np.sin(a), 0.0] for a in 2 * np.pi / 3 * np.arange(3)])
    apex = np.array([[0.0, 0.0, math.sqrt(2)]])
    regular = np.vstack([base, apex])

    def lowered(factor: float) -> np.ndarray:
        return regular * [1.0, 1.0, factor]

    cells = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])
    sector_mesh._check_shapes(np.vstack([regular, lowered(1.001 * sector_mesh.FLATTEST)]), cells)
    for factor in (0.999 * sector_mesh.FLATTEST, worst * sector_mesh.FLATTEST / 2, -1.0):
        points = np.vstack([regular, lowered(factor)])
        with pytest.raises(StickslipError, match=rf"an element of quality {factor:.3g} at \[") as told:
            sector_mesh._check_shapes(points, cells)
        assert str(told.value).endswith("; change the element sizes slightly")
