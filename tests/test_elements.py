"""Every kind of cell: against plain loops, patch and mass tests, curved volumes, and what is refused."""

import math

import numpy as np
import pytest
from solid_models import KINDS, box, plain_matrices, rigid_motions, without_sets

from evidence.models.annulus import annular_sector
from stickslip.errors import InputError
from stickslip.model.fe.elements import Quadrature, shape_functions
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.mesh.solid_mesh import SolidMesh, write_mesh

STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
SIZE = (0.03, 0.02, 0.04)
VOLUME = math.prod(SIZE)


def relative(found, exact):
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize("width", KINDS)
def test_matrices_against_plain_loops(width):
    """Straight-edged tetrahedra are integrated exactly by any rule; hexahedra have the same Gauss points, so they may be curved."""
    mesh = without_sets(box(width, SIZE, (1, 1, 2), 0.002 if width in (8, 20) else 0.0))
    solid = assemble_solid(mesh, STEEL)
    mass, stiffness = plain_matrices(mesh, STEEL)
    assert relative(solid.mass.toarray(), mass) < 1e-13
    assert relative(solid.stiffness.toarray(), stiffness) < 1e-13


def test_materials_of_cells_against_plain_loops():
    """Every other cell of another material, through which mid-side nodes are shared."""
    mesh = without_sets(box(20, SIZE, (1, 2, 2), 0.002))
    light = Material(young_modulus=110e9, poisson_ratio=0.34, density=4430.0)
    materials = [STEEL, light, light, STEEL]
    parts = [plain_matrices(SolidMesh(mesh.points, mesh.cells[[i]], {}), one) for i, one in enumerate(materials)]
    solid = assemble_solid(mesh, materials)
    for found, exact in zip((solid.mass, solid.stiffness), zip(*parts, strict=True), strict=True):
        assert relative(found.toarray(), sum(exact)) < 1e-13
    with pytest.raises(InputError, match="material: is a list of 3 for 4 cells"):
        assemble_solid(mesh, materials[:3])


@pytest.mark.parametrize("width", KINDS)
def test_rigid_motions_strain_nothing_and_carry_the_mass(width):
    mesh = without_sets(box(width, SIZE, (2, 1, 2), 0.002))
    solid = assemble_solid(mesh, STEEL)
    motion = rigid_motions(mesh.points)
    assert abs(solid.stiffness @ motion).max() < 1e-10 * abs(solid.stiffness).max()
    straight = without_sets(box(width, SIZE, (2, 1, 2)))
    centred = rigid_motions(straight.points - np.array(SIZE) / 2)
    mass = STEEL.density * VOLUME
    turning = mass / 12 * (np.sum(np.square(SIZE)) - np.square(SIZE))
    exact = np.diag([mass] * 3 + list(turning))
    energy = centred.T @ (assemble_solid(straight, STEEL).mass @ centred)
    np.testing.assert_allclose(energy, exact, atol=1e-12 * mass)


@pytest.mark.parametrize("width", KINDS)
def test_uniform_strain_has_the_energy_of_hookes_law(width):
    """The patch test on distorted cells; Σ w det J is their exact volume, which flat faces keep that of the box inside it."""
    mesh = without_sets(box(width, SIZE, (2, 2, 2)))
    inner = np.all((mesh.points > 1e-9) & (mesh.points < np.array(SIZE) - 1e-9), axis=1)
    corners = np.unique(mesh.cells[:, : 4 if width in (4, 10) else 8])
    moved = mesh.points + 0.002 * inner[:, None] * np.sin(900 * mesh.points)
    assert inner[corners].any()
    mesh = SolidMesh(moved, mesh.cells, {})
    solid = assemble_solid(mesh, STEEL)
    gradient = np.random.default_rng(0).standard_normal((3, 3))
    strain = (gradient + gradient.T) / 2
    lame, shear = STEEL.lame
    density = lame * np.trace(strain) ** 2 + 2 * shear * np.sum(strain**2)
    u = (mesh.points @ gradient.T).ravel()
    assert u @ (solid.stiffness @ u) == pytest.approx(density * VOLUME, rel=1e-11)
    # inner nodes are in equilibrium
    force = (solid.stiffness @ u).reshape(-1, 3)
    assert np.abs(force[inner]).max() < 1e-11 * np.abs(force).max()


def test_mass_of_a_curved_ring_converges_with_the_fourth_order():
    """Three points of each arc are on the circle: the area between is of third order an arc, odd terms cancel."""
    exact = STEEL.density * math.pi * (0.2**2 - 0.1**2) * 0.03 / 2
    errors = []
    for around in (4, 8, 16):
        mesh = annular_sector(0.1, 0.2, 0.03, sectors=2, divisions=(1, around, 1))
        solid = assemble_solid(SolidMesh(mesh.points, mesh.cells, {}), STEEL)
        along = np.tile([0.0, 0.0, 1.0], len(mesh.points))
        errors.append(abs(along @ (solid.mass @ along) / exact - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, 4.0, atol=0.1)
    assert errors[-1] < 1e-5


@pytest.mark.parametrize("width", KINDS)
def test_skin_encloses_the_volume(width):
    """Gauss's theorem with the outward normals of flat triangles; each edge is met once in either sense."""
    mesh = box(width, SIZE, (2, 1, 3))
    a, b, c = (mesh.points[mesh.surface[:, i]] for i in range(3))
    assert np.sum(a * np.cross(b, c)) / 6 == pytest.approx(VOLUME, rel=1e-12)
    edges = np.concatenate([mesh.surface[:, [i, (i + 1) % 3]] for i in range(3)])
    assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}
    assert len(np.unique(edges, axis=0)) == len(edges)


@pytest.mark.parametrize("width", KINDS)
def test_meshes_are_written_and_read(width, tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = box(width, SIZE, (1, 1, 2))
    for suffix in ("vtu", "msh"):
        write_mesh(mesh, tmp_path / f"box.{suffix}")
        back = meshio.read(tmp_path / f"box.{suffix}")
        np.testing.assert_array_equal(back.cells[0].data, mesh.cells)
        np.testing.assert_array_equal(back.points, mesh.points)


def test_calculix_rule_has_four_points():
    shape = shape_functions(10, Quadrature.calculix().mass)
    assert shape.values.shape == (4, 10)
    mesh = without_sets(box(10, SIZE, (1, 1, 1)))
    exact, coarse = (assemble_solid(mesh, STEEL, quadrature=q) for q in (Quadrature(), Quadrature.calculix()))
    # strains of a straight-edged cell are linear, so four points are enough for the stiffness, not for the mass
    assert relative(coarse.stiffness.toarray(), exact.stiffness.toarray()) < 1e-13
    assert relative(coarse.mass.toarray(), exact.mass.toarray()) > 0.1
    along = np.tile([1.0, 0.0, 0.0], len(mesh.points))
    assert along @ (coarse.mass @ along) == pytest.approx(STEEL.density * VOLUME, rel=1e-12)


@pytest.mark.parametrize("degree", [0, 13])
def test_impossible_rules_are_named(degree):
    with pytest.raises(InputError, match=f"Quadrature.mass: must be a degree.*got {degree}"):
        Quadrature(mass=degree)


@pytest.mark.parametrize("width", KINDS)
def test_cells_inside_out_are_named_by_the_numbers_of_their_solver(width):
    mesh = box(width, SIZE, (2, 1, 1))
    cells = mesh.cells.copy()
    corners = 4 if width in (4, 10) else 8
    cells[-1, :corners] = cells[-1, [0, 2, 1, 3] if corners == 4 else [0, 3, 2, 1, 4, 7, 6, 5]]
    numbers = 100 + np.arange(len(mesh.points))
    turned = SolidMesh(mesh.points, cells, {}, numbers, 7000 + np.arange(len(cells)))
    middle = ", ".join(f"{x:.6g}" for x in mesh.points[cells[-1]].mean(axis=0))
    message = (
        rf"1 of {len(cells)} cells.* Jacobian: cell {7000 + len(cells) - 1} \(nodes "
        rf"{100 + cells[-1, 0]}, {100 + cells[-1, 1]}, .*near \({middle}\) m.*node order"
    )
    with pytest.raises(InputError, match=message):
        assemble_solid(turned, STEEL)


def test_flat_cells_are_refused_however_small_the_mesh():
    mesh = box(10, SIZE, (1, 1, 1))
    tiny = SolidMesh(mesh.points * 1e-6, mesh.cells, {})
    assemble_solid(tiny, STEEL)
    flat = SolidMesh(mesh.points * [1.0, 1.0, 0.0], mesh.cells, {})
    with pytest.raises(InputError, match=r"6 of 6 cells have a zero.*and 1 more"):
        assemble_solid(flat, STEEL)


def test_neighbours_that_do_not_share_a_mid_side_node_are_refused():
    mesh = box(20, SIZE, (2, 1, 1))
    cells = mesh.cells.copy()
    shared = int(np.intersect1d(cells[0, 8:], cells[1, 8:])[0])
    cells[1, cells[1] == shared] = len(mesh.points)
    doubled = SolidMesh(np.vstack([mesh.points, mesh.points[shared]]), cells, {})
    with pytest.raises(InputError, match=rf"do not share .*node ({shared}|{len(mesh.points)}) of"):
        assemble_solid(doubled, STEEL)
    # a corner at the place of a mid-side node of the neighbour, as cells of half the size would have it
    cells = mesh.cells.copy()
    cells[1, 8] = cells[0, 0]
    used, cells = np.unique(cells, return_inverse=True)
    mixed = SolidMesh(mesh.points[used], cells.reshape(2, 20), {})
    with pytest.raises(InputError, match=r"Jacobian|a corner or the middle of another"):
        assemble_solid(mixed, STEEL)


def test_meshes_that_cannot_be_are_refused():
    mesh = box(8, SIZE, (1, 1, 1))
    for cells, message in [
        (mesh.cells[:, :7], r"rows of 4, 5, 6, 8, 10, 13, 15 or 20 nodes, got \[7\]"),
        (mesh.cells[0], r"got an array of shape \(8,\)"),
        (mesh.cells + 1, "from 1 to 8, but there are 8 points"),
        (mesh.cells - 1, r"nodes, got \[7\].*-1 fills the ends of shorter rows"),
        (np.roll(np.pad(mesh.cells[:, :6], ((0, 0), (0, 2)), constant_values=-1), 1, axis=1), "from -1 to"),
    ]:
        with pytest.raises(InputError, match=message):
            SolidMesh(mesh.points, cells, {})
    with pytest.raises(InputError, match=r"SolidMesh.numbers: has shape \(3,\) for 8"):
        SolidMesh(mesh.points, mesh.cells, {}, np.arange(3))


def test_sets_clamps_and_numbers():
    mesh = box(8, SIZE, (2, 1, 1))
    numbers = 10 * np.arange(len(mesh.points))
    sides = {
        "cyclic_low": np.flatnonzero(mesh.points[:, 1] == 0),
        "cyclic_high": np.flatnonzero(mesh.points[:, 1] > 0.019),
    }
    sector = SolidMesh(mesh.points, mesh.cells, {**mesh.node_sets, **sides}, numbers)
    solid = assemble_solid(sector, STEEL)
    free = np.setdiff1d(sides["cyclic_low"], mesh.node_sets["root"])
    assert 0 < len(free) < len(sides["cyclic_low"])
    np.testing.assert_array_equal(solid.dofs.node[solid.dof_set("cyclic_low")[::3]], numbers[free])
    both = assemble_solid(sector, STEEL, clamped=("root", "tip"))
    assert set(both.sets) == set(sides)
    assert both.n == solid.n - 3 * len(mesh.node_sets["tip"])
    with pytest.raises(InputError, match=r"no node set 'tipp'\. Did you mean 'tip'"):
        assemble_solid(sector, STEEL, clamped=("tipp",))
    other = SolidMesh(mesh.points, mesh.cells, {**mesh.node_sets, "side": sides["cyclic_low"]})
    with pytest.raises(InputError, match=r"node set 'side'.*holds clamped nodes"):
        assemble_solid(other, STEEL)
