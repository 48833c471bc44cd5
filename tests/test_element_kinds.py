"""Bricks with incompatible modes or one point, wedges and pyramids, alone and in one mesh: against CalculiX, closed forms and identities."""

import csv
import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from element_decks import CASES, MESHES, deck, name_of, text_of
from scipy.spatial.transform import Rotation
from solid_models import beam_root, box, rigid_motions
from typer.testing import CliRunner

import stickslip as ss
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.fe.cell_laws import cell_laws
from stickslip.model.fe.cell_matrices import hourglass_stiffness
from stickslip.model.fe.elements import EXACT, OWN_SHAPES, Quadrature, cell_groups, own_rule, own_shape_functions
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.mesh.solid_mesh import SolidMesh, by_kind, facets_of, mirrored_cells
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix_deck import assemble_deck, read_deck
from stickslip.model.readers.units import Units

STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
SIZE = (0.03, 0.02, 0.04)
VOLUME = math.prod(SIZE)
INNER = Quadrature(stiffness=3, mass=4, inner="mean")
ONE_POINT = Quadrature(stiffness=1, mass=1, hourglass=5e-4)
TABLE = Path(__file__).parent / "data" / "calculix_2_20_elements.csv"


def calculix(name):
    with TABLE.open() as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return np.array([float(row["frequency_hz"]) for row in rows if row["case"] == name])


def split(mesh, how):
    """Divide the bricks of a box: into two wedges, or into six pyramids on their faces; `how` says which for each brick.

    With tetrahedra outside the pyramids on faces along y and z are two tetrahedra each: faces of the box, if it has one brick across.

    Second-order cells get their mid-side nodes here, so that neighbours of all kinds share them.
    """
    points, cells = [*mesh.points], []
    for cell, kind in zip(mesh.cells, how, strict=True):
        n = cell[:8].tolist()
        if kind == "hex":
            cells.append(n)
        elif kind == "wedges":
            cells += [[n[i] for i in (0, 1, 2, 4, 5, 6)], [n[i] for i in (0, 2, 3, 4, 6, 7)]]
        else:
            points.append(mesh.points[cell[:8]].mean(axis=0))
            top = len(points) - 1
            # faces seen from inside anticlockwise
            faces = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
            for face in faces:
                base = [n[i] for i in face]
                if kind == "pyramids" or (kind == "pyramids, tetrahedra outside" and face in (faces[3], faces[5])):
                    cells.append([*base, top])
                else:  # the diagonal from the smallest node number: neighbours agree
                    base = base[(s := base.index(min(base))) :] + base[:s]
                    cells += [[base[0], base[1], base[2], top], [base[0], base[2], base[3], top]]
    return points, cells


CORNERS = {4: 4, 10: 4, 5: 5, 13: 5, 6: 6, 15: 6, 8: 8, 20: 8}
EDGES = {
    4: [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)],
    5: [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4)],
    6: [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3), (1, 4), (2, 5)],
    8: [(0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)],
}


def distorted(points, size, wave):
    inner = np.all((points > 1e-9) & (points < np.array(size) - 1e-9), axis=1)
    return points + wave * inner[:, None] * np.sin(900 * points)


def mesh_of(how, second=False, size=SIZE, divisions=(2, 2, 2), wave=0.0, bend=0.0):
    """A box of cells; several kinds alternate along x. `wave` moves inner corners and `bend` inner mid-side nodes, in m; node sets ``root`` and ``tip`` at the ends of x."""
    base = box(8, size, divisions)
    layers = np.repeat(np.arange(divisions[0]), divisions[1] * divisions[2])
    how = [how] * len(base.cells) if isinstance(how, str) else [how[i % len(how)] for i in layers]
    points, cells = split(base, how)
    points = list(distorted(np.array(points), size, wave))
    if second:
        middle = {}
        for cell in cells:
            for a, b in EDGES[len(cell)]:
                pair = min(cell[a], cell[b]), max(cell[a], cell[b])
                if pair not in middle:
                    middle[pair] = len(points)
                    points.append((points[pair[0]] + points[pair[1]]) / 2)
        cells = [[*c, *(middle[min(c[a], c[b]), max(c[a], c[b])] for a, b in EDGES[len(c)])] for c in cells]
    width = max(map(len, cells))
    table = np.array([[*c, *[-1] * (width - len(c))] for c in cells])
    points = np.array(points)
    corners = np.zeros(len(points), dtype=bool)
    corners[[n for c in cells for n in c[: CORNERS[len(c)]]]] = True
    points = np.where(corners[:, None], points, distorted(points, size, bend))
    sets = {"root": np.flatnonzero(points[:, 0] < 1e-9), "tip": np.flatnonzero(points[:, 0] > size[0] - 1e-9)}
    return SolidMesh(points, table, sets)


KINDS = {
    "wedges": ("wedges", False, EXACT),
    "wedges, second order": ("wedges", True, EXACT),
    "pyramids": ("pyramids", False, EXACT),
    "pyramids, second order": ("pyramids", True, EXACT),
    "bricks and pyramids": (("hex", "pyramids"), False, EXACT),
    "bricks and pyramids, second order": (("hex", "pyramids"), True, EXACT),
    "wedges and bricks": (("wedges", "hex"), False, EXACT),
    "wedges and bricks, second order": (("wedges", "hex"), True, EXACT),
    "incompatible modes": ("hex", False, INNER),
    "one point": ("hex", False, ONE_POINT),
    "wedges, points of CalculiX": ("wedges", True, Quadrature(stiffness=2, mass=2, axial=5)),
}


@pytest.fixture(params=KINDS)
def body(request):
    how, second, rule = KINDS[request.param]
    return mesh_of(how, second, wave=0.0015, bend=0.0003 if rule == EXACT else 0.0), rule


def assert_passes_the_patch_test(mesh, stiffness):
    """A linear displacement stores its closed-form energy, and no force acts on inner nodes."""
    gradient = np.random.default_rng(0).standard_normal((3, 3))
    strain = (gradient + gradient.T) / 2
    lame, shear = STEEL.lame
    density = lame * np.trace(strain) ** 2 + 2 * shear * np.sum(strain**2)
    u = (mesh.points @ gradient.T).ravel()
    assert u @ (stiffness @ u) == pytest.approx(density * VOLUME, rel=1e-11)
    force = (stiffness @ u).reshape(-1, 3)
    inner = np.all((mesh.points > 1e-9) & (mesh.points < np.array(SIZE) - 1e-9), axis=1)
    assert inner.any()
    assert np.abs(force[inner]).max() < 1e-11 * np.abs(force).max()


def test_uniform_strain_has_the_energy_of_hookes_law(body):
    """The patch test on distorted cells, alone and beside others: energy and equilibrium of inner nodes."""
    mesh, rule = body
    free = SolidMesh(mesh.points, mesh.cells, {})
    assert_passes_the_patch_test(mesh, assemble_solid(free, STEEL, quadrature=rule).stiffness)


@pytest.mark.parametrize("second", [False, True])
def test_all_four_kinds_in_one_mesh_pass_the_patch_test(second):
    how = ("hex", "pyramids, tetrahedra outside", "wedges", "hex", "pyramids, tetrahedra outside")
    mesh = mesh_of(how, second, divisions=(5, 1, 1), wave=0.001, bend=0.0002)
    assert len(by_kind(mesh.cells)) == 4
    solid = assemble_solid(SolidMesh(mesh.points, mesh.cells, {}), STEEL)
    assert_passes_the_patch_test(mesh, solid.stiffness)
    squares = np.linalg.eigvalsh(solid.stiffness.toarray())
    assert np.sum(np.abs(squares) < 1e-9 * squares[-1]) == 6


def test_edges_of_both_orders_are_refused():
    """A brick of 20 nodes beside two wedges of 6 would gape at four edges."""
    first, second = (
        mesh_of(("hex", "wedges"), divisions=(2, 1, 1)),
        mesh_of(("hex", "wedges"), True, divisions=(2, 1, 1)),
    )
    cells = np.full((3, 20), -1)
    cells[0] = second.cells[0]
    cells[1:, :6] = second.cells[1:, :6]
    used = np.unique(cells[cells >= 0])
    own = np.where(cells >= 0, np.searchsorted(used, cells), -1)
    assert len(first.cells) == 3
    with pytest.raises(InputError, match="cells of first and second order share 4 edges"):
        assemble_solid(SolidMesh(second.points[used], own, {}), STEEL)


def test_rigid_motions_strain_nothing_and_carry_the_mass(body):
    mesh, rule = body
    solid = assemble_solid(SolidMesh(mesh.points, mesh.cells, {}), STEEL, quadrature=rule)
    motion = rigid_motions(mesh.points)
    assert abs(solid.stiffness @ motion).max() < 1e-10 * abs(solid.stiffness).max()
    squares = np.linalg.eigvalsh(solid.stiffness.toarray())
    assert np.sum(np.abs(squares) < 1e-9 * squares[-1]) == 6  # nothing else is without energy
    mass = STEEL.density * VOLUME
    energy = motion.T @ (solid.mass @ motion)
    np.testing.assert_allclose(energy[:3, :3], mass * np.eye(3), atol=1e-11 * mass)


@pytest.mark.parametrize("kind", [kind for kind, (_, _, rule) in KINDS.items() if rule == EXACT])
def test_the_tensor_of_inertia_is_that_of_the_box(kind):
    how, second, rule = KINDS[kind]
    mesh = mesh_of(how, second, wave=0.0015)
    solid = assemble_solid(SolidMesh(mesh.points, mesh.cells, {}), STEEL, quadrature=rule)
    centred = rigid_motions(mesh.points - np.array(SIZE) / 2)
    turning = STEEL.density * VOLUME / 12 * (np.sum(np.square(SIZE)) - np.square(SIZE))
    # warped quadrilaterals of wedges and bricks have a Jacobian of degree 4 along an edge, times squares of places
    np.testing.assert_allclose(np.diag(centred.T @ (solid.mass @ centred))[3:], turning, rtol=1e-11)


def test_a_turned_mesh_has_turned_matrices(body):
    mesh, rule = body
    turn = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
    one = assemble_solid(SolidMesh(mesh.points, mesh.cells, {}), STEEL, quadrature=rule)
    other = assemble_solid(SolidMesh(mesh.points @ turn.T, mesh.cells, {}), STEEL, quadrature=rule)
    whole = np.kron(np.eye(len(mesh.points)), turn)
    for name in ("mass", "stiffness"):
        a, b = (getattr(s, name).toarray() for s in (one, other))
        assert np.linalg.norm(whole @ a @ whole.T - b) < 1e-11 * np.linalg.norm(b)


# numberings of the same cell: turns about an axis, and the other end first
PERMUTATIONS = {
    6: [(1, 2, 0, 4, 5, 3), (3, 5, 4, 0, 2, 1)],
    15: [(1, 2, 0, 4, 5, 3, 7, 8, 6, 10, 11, 9, 13, 14, 12), (3, 5, 4, 0, 2, 1, 11, 10, 9, 8, 7, 6, 12, 14, 13)],
    5: [(1, 2, 3, 0, 4)],
    13: [(1, 2, 3, 0, 4, 6, 7, 8, 5, 10, 11, 12, 9)],
    8: [(1, 2, 3, 0, 5, 6, 7, 4), (0, 4, 5, 1, 3, 7, 6, 2), (7, 6, 5, 4, 3, 2, 1, 0)],
}


@pytest.mark.parametrize("kind", KINDS)
def test_other_numberings_of_the_same_cells_give_the_same_matrices(kind):
    how, second, rule = KINDS[kind]
    mesh = mesh_of(how, second, wave=0.0015)
    one = assemble_solid(SolidMesh(mesh.points, mesh.cells, {}), STEEL, quadrature=rule)
    cells = mesh.cells.copy()
    changed = 0
    for width, rows in by_kind(cells):
        for i, row in enumerate(rows):
            ways = PERMUTATIONS.get(width, [])
            if ways:
                cells[row, :width] = cells[row, list(ways[i % len(ways)])]
                changed += 1
    assert changed
    other = assemble_solid(SolidMesh(mesh.points, cells, {}), STEEL, quadrature=rule)
    # the rule of a triangle above degree 2 is a collapsed square, whose points a turn moves: exact where cells are straight
    tolerance = 1e-12 if rule != EXACT else 2e-3
    for name in ("mass", "stiffness"):
        a, b = (getattr(s, name).toarray() for s in (one, other))
        assert np.linalg.norm(a - b) < tolerance * np.linalg.norm(b)


@pytest.mark.parametrize("kind", KINDS)
def test_mirrored_cells_keep_volume_and_frequencies(kind):
    how, second, rule = KINDS[kind]
    mesh = mesh_of(how, second)
    mirrored = SolidMesh(mesh.points * [-1, 1, 1], mirrored_cells(mesh.cells), mesh.node_sets)
    a, b = (natural_frequencies(assemble_solid(m, STEEL, quadrature=rule), 4) for m in (mesh, mirrored))
    np.testing.assert_allclose(a, b, rtol=1e-9)


@pytest.mark.parametrize("width", OWN_SHAPES)
def test_shape_functions_are_one_at_their_node_and_hold_polynomials(width):
    places = OWN_SHAPES[width]
    np.testing.assert_allclose(own_shape_functions(width, places)[0], np.eye(width), atol=1e-14)
    points, weights = own_rule(width, 4, 4)
    values, slopes = own_shape_functions(width, points)
    for powers in itertools.product(range(3), repeat=3):
        if sum(powers) <= (1 if width in (5, 6) else 2):
            np.testing.assert_allclose(
                values @ np.prod(places**powers, axis=1), np.prod(points**powers, axis=1), atol=1e-14
            )
    step = 1e-6
    for axis, along in enumerate(step * np.eye(3)):
        ahead, back = (own_shape_functions(width, points + s * along)[0] for s in (1, -1))
        np.testing.assert_allclose(slopes[:, :, axis], (ahead - back) / (2 * step), atol=1e-8)
    fine = own_rule(width, 9, 9)
    there = own_shape_functions(width, fine[0])[0]
    np.testing.assert_allclose(
        np.einsum("qi,qj,q->ij", values, values, weights), np.einsum("qi,qj,q->ij", there, there, fine[1]), atol=1e-14
    )


@pytest.mark.parametrize(
    ("how", "order"), [("wedges", 4), ("pyramids", 4), (("hex", "pyramids"), 4), (("wedges", "hex"), 4)]
)
def test_frequencies_of_second_order_cells_converge(how, order):
    """Stretch of a clamped bar without Poisson's ratio: an eigenvalue of polynomials of degree p has the order 2 p."""
    rod = Material(young_modulus=210e9, poisson_ratio=0.0, density=7850.0)
    errors = []
    for n in (1, 2, 4):
        mesh = mesh_of(how, True, (0.08, 0.02, 0.02), (2 * n, 1, 1))
        across = np.tile([False, True, True], (len(mesh.points), 1))
        solid = assemble_solid(mesh, rod, held=across)
        exact = math.sqrt(rod.young_modulus / rod.density) / (4 * 0.08)
        errors.append(natural_frequencies(solid, 1)[0] / exact - 1)
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates.min() > order - 0.4


@pytest.mark.parametrize(
    ("how", "second", "rule", "most"),
    [
        ("wedges", True, EXACT, 4e-3),
        ("pyramids", True, EXACT, 4e-3),
        (("hex", "pyramids"), True, EXACT, 4e-3),
        ("hex", False, INNER, 4e-3),
    ],
)
def test_slender_cantilever_bends_like_a_beam(how, second, rule, most):
    """Length over depth 50: rotary inertia and shear take 0.1 % off Bernoulli's frequency, the clamped end adds 0.3 %."""
    rod = Material(young_modulus=210e9, poisson_ratio=0.0, density=7850.0)
    length, depth = 0.5, 0.01
    mesh = mesh_of(how, second, (length, depth, depth), (20, 1, 1))
    exact = beam_root(1) ** 2 / (2 * math.pi) * math.sqrt(rod.young_modulus * depth**2 / 12 / rod.density) / length**2
    found = natural_frequencies(assemble_solid(mesh, rod, quadrature=rule), 2)
    np.testing.assert_allclose(found, exact, rtol=most)


@pytest.mark.parametrize("case", CASES, ids=lambda case: name_of(*case))
def test_frequencies_of_calculix(tmp_path, case):
    """Six frequencies of its own run on the same deck. It prints seven digits; all wedges and mixed meshes agree to 1e-6.

    C3D8I: its incompatible modes are degrees of freedom with mass; here they move as without load, which the stubby block shows. C3D8R:
    its hourglass patterns lose their linear part along z alone, ours along x, y and z, which is the same for parallelepipeds.
    """
    path = tmp_path / "deck.inp"
    path.write_text(text_of(*case))
    one = read_deck(path, units=Units.mm_t_s())
    solid = rotating_solid(one.mesh, one.material, one.axis, quadrature=one.quadrature)
    found = natural_frequencies(solid.at_speed(one.speed or 0.0), 6)
    theirs = calculix(name_of(*case))
    mesh, kinds, _ = case
    few = 3
    if "C3D8I" in kinds:
        tolerance = 4e-3 if mesh == "block" else 2e-4
    elif "C3D8R" in kinds and mesh == "twisted":
        tolerance = 5e-3
    else:
        few, tolerance = 6, 1e-6
    np.testing.assert_allclose(found[:few], theirs[:few], rtol=tolerance)


@pytest.mark.parametrize("inner", ["mean", "centre"])
def test_the_centrifugal_load_of_bricks_with_inner_modes_acts_on_their_nodes_alone(inner):
    """As in CalculiX: ``∫ ρ N r dV`` of the nodes' functions, although the mass is condensed."""
    mesh = mesh_of("hex", wave=0.0015)
    free = SolidMesh(mesh.points, mesh.cells, {})
    plain, rich = (
        rotating_solid(free, STEEL, quadrature=Quadrature(stiffness=3, mass=4, inner=own)) for own in ("", inner)
    )
    np.testing.assert_allclose(rich.centrifugal, plain.centrifugal, atol=1e-12 * np.abs(plain.centrifugal).max())
    assert abs(rich.structure.mass - plain.structure.mass).max() > 1e-3 * abs(plain.structure.mass).max()


def test_inner_modes_converge_to_those_with_their_own_mass(tmp_path):
    """The block of twice as many bricks: condensation costs a quarter, as the modes' own frequencies are twice as high."""
    coarse, fine = {}, {}
    for store, factor in ((coarse, 1), (fine, 2)):
        size, divisions, _ = MESHES["block"]
        mesh = box(8, tuple(np.array(size) / 1e3), tuple(factor * np.array(divisions)))
        store["ours"] = natural_frequencies(assemble_solid(mesh, STEEL, quadrature=INNER), 3)
        store["exact"] = full_frequencies(mesh, 3)
    ratio = (coarse["ours"] / coarse["exact"] - 1) / (fine["ours"] / fine["exact"] - 1)
    assert np.all(ratio > 3)
    np.testing.assert_allclose(coarse["exact"], calculix("block_C3D8I")[:3], rtol=1e-6)


def full_frequencies(mesh, n):
    """Frequencies with the incompatible modes as degrees of freedom with mass, by loops over bricks."""
    from stickslip.model.fe.cell_matrices import cell_stiffness
    from stickslip.model.fe.elements import gradients

    (group,) = cell_groups(SolidMesh(mesh.points, mesh.cells, {}), Quadrature(stiffness=3, mass=3, inner="centre"))
    whole = slice(0, len(mesh.cells))
    slopes, volume = gradients(group.mesh, group.strain, whole)
    K = cell_stiffness(cell_laws(group.mesh, STEEL).elastic(group.strain, whole), slopes, volume)
    values = group.inertia.values
    scalar = STEEL.density * np.einsum("qk,ql,mq->mkl", values, values, volume)
    rows = []
    for i, cell in enumerate(mesh.cells):
        inner = 3 * len(mesh.points) + 9 * i + np.arange(9)
        rows.append(np.concatenate([(3 * cell[:, None] + np.arange(3)).ravel(), inner]))
    rows = np.array(rows)
    n_all = 3 * len(mesh.points) + 9 * len(mesh.cells)
    import scipy

    def assembled(blocks):
        i, j = np.repeat(rows, 33, axis=1).ravel(), np.tile(rows, 33).ravel()
        return scipy.sparse.csc_array((blocks.ravel(), (i, j)), shape=(n_all, n_all))

    free = np.setdiff1d(np.arange(n_all), (3 * mesh.node_sets["root"][:, None] + np.arange(3)).ravel())
    stiff, mass = assembled(K)[free][:, free], assembled(np.kron(scalar, np.eye(3)))[free][:, free]
    squares = scipy.sparse.linalg.eigsh(stiff, n, M=mass, sigma=0, return_eigenvectors=False)
    return np.sort(np.sqrt(squares)) / (2 * math.pi)


def test_hourglass_stiffness_resists_what_one_point_does_not_see():
    """Twelve motions of a brick: four patterns along three axes, each with the energy f E V Σ|∇N|² times eight."""
    mesh = SolidMesh(box(8, SIZE, (1, 1, 1)).points, box(8, SIZE, (1, 1, 1)).cells, {})
    (group,) = cell_groups(mesh, ONE_POINT)
    artificial = hourglass_stiffness(group, cell_laws(mesh, STEEL)).toarray()
    squares = np.linalg.eigvalsh(artificial)
    expected = 8 * 5e-4 * 210e9 * VOLUME * np.sum(8 / 16 / np.square(SIZE))
    np.testing.assert_allclose(squares[-12:], expected, rtol=1e-12)
    assert np.abs(squares[:12]).max() < 1e-12 * expected
    whole = assemble_solid(mesh, STEEL, quadrature=ONE_POINT).stiffness.toarray()
    plain = assemble_solid(mesh, STEEL, quadrature=Quadrature(1, 1, hourglass=1e-300)).stiffness.toarray()
    np.testing.assert_allclose(whole - plain, artificial, atol=1e-12 * np.abs(whole).max())


@pytest.mark.parametrize("kind", KINDS)
def test_matrices_of_rotation_act_on_rigid_motions_as_mechanics_says(kind):
    """Centrifugal force of the whole, Coriolis and softening on translations: total mass times the vectors of mechanics."""
    how, second, rule = KINDS[kind]
    mesh = mesh_of(how, second)
    mesh = SolidMesh(mesh.points, mesh.cells, {})
    axis = Axis((0.0, 0.0, 1.0), (-0.1, 0.0, 0.0))
    solid = rotating_solid(mesh, STEEL, axis, quadrature=rule)
    along = np.tile(np.eye(3), (len(mesh.points), 1))
    mass = STEEL.density * VOLUME
    np.testing.assert_allclose(along.T @ (solid.coriolis @ along), mass * axis.cross, atol=1e-11 * mass)
    np.testing.assert_allclose(along.T @ (solid.spin_softening @ along), mass * np.diag([1, 1, 0]), atol=1e-11 * mass)
    assert abs(solid.coriolis + solid.coriolis.T).max() < 1e-12 * abs(solid.coriolis).max()
    centre = np.array(SIZE) / 2 + [0.1, 0, 0]
    np.testing.assert_allclose(along.T @ solid.centrifugal, mass * centre * [1, 1, 0], atol=1e-11 * mass)


@pytest.mark.parametrize("kind", KINDS)
def test_nonlinear_tangent_is_the_derivative_of_the_force(kind):
    """Green strain in any cell: also the incompatible modes, which keep their linear ratio to the nodes."""
    how, second, rule = KINDS[kind]
    mesh = mesh_of(how, second, wave=0.0015)
    solid = rotating_solid(mesh, STEEL, quadrature=rule)
    rng = np.random.default_rng(1)
    u, v = 1e-3 * rng.standard_normal((2, solid.structure.n))
    terms = solid._terms(u, green=True)
    tangent = solid.structure.stiffness + terms.linear + terms.quadratic + terms.geometric
    step = 1e-4
    slope = (solid._inner_force(u + step * v) - solid._inner_force(u - step * v)) / (2 * step)
    np.testing.assert_allclose(tangent @ v, slope, atol=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("kind", KINDS)
def test_prestress_of_a_spinning_bar_raises_its_frequency_as_that_of_other_cells(kind):
    """Clamped bar at 0.6 of its first bending frequency: the relative change as with bricks of 20 nodes, of whichever cells."""
    how, second, rule = KINDS[kind]
    size, divisions = (0.1, 0.01, 0.01), (12, 1, 1)
    axis = Axis((0.0, 1.0, 0.0), (-0.05, 0.0, 0.0))

    def change(mesh, quadrature):
        solid = rotating_solid(mesh, STEEL, axis, quadrature=quadrature)
        rest, fast = (natural_frequencies(solid.at_speed(speed), 2)[0] for speed in (0.0, 5000.0))
        return fast / rest - 1, rest

    (whole, at_rest), (found, own) = (
        change(box(20, size, divisions), EXACT),
        change(mesh_of(how, second, size, divisions), rule),
    )
    assert 0.2 < whole < 0.9
    # stress stiffness is the same of all; a cell that is too stiff gains less, in the ratio of the squares
    gained, exact = (((ratio + 1) ** 2 - 1) * f**2 for ratio, f in ((found, own), (whole, at_rest)))
    assert gained == pytest.approx(exact, rel=0.03)


def test_facets_of_triangles_and_quadrilaterals():
    """The skin of a mixed box encloses its volume; the far end has the area of the box, from facets of both shapes."""
    from stickslip.model.mesh.facets import lumped_areas

    for second in (False, True):
        mesh = mesh_of(("wedges", "hex"), second)
        a, b, c = (mesh.points[mesh.surface[:, i]] for i in range(3))
        assert np.sum(a * np.cross(b, c)) / 6 == pytest.approx(VOLUME, rel=1e-12)
        top = facets_of(mesh, np.flatnonzero(mesh.points[:, 2] > SIZE[2] - 1e-9))
        kinds = set(np.count_nonzero(top >= 0, axis=1).tolist())
        assert kinds == ({6, 8} if second else {3, 4})
        assert lumped_areas(mesh.points, top).sum() == pytest.approx(SIZE[0] * SIZE[1], rel=1e-12)


def test_rules_for_bricks_are_refused_of_other_cells():
    mesh = mesh_of(("wedges", "hex"))
    with pytest.raises(InputError, match=r"hourglass control to cells of 6 nodes.*each cell its own Quadrature"):
        assemble_solid(mesh, STEEL, quadrature=ONE_POINT)
    with pytest.raises(InputError, match="is a list of 3 for 12 cells"):
        assemble_solid(mesh, STEEL, quadrature=[EXACT] * 3)
    with pytest.raises(InputError, match=r"SolidMesh\.cells: needs rows of 4, 5, 6, 8, 10, 13, 15 or 20 nodes"):
        SolidMesh(mesh.points, mesh.cells[:, :7], {})


def test_cells_beside_others_keep_their_own_rule(tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(deck("plate", ("C3D8I", "C3D6")))
    one = read_deck(path, units=Units.mm_t_s())
    assert one.element_type == "C3D8I, C3D6"
    found = dict(zip(one.cell_types, one.quadrature, strict=True))
    assert found["C3D8I"].inner == "centre"
    assert found["C3D6"] == Quadrature(stiffness=1, mass=1, axial=3)
    assert {rule.inner for rule in one.exact()} == {"mean", ""}
    assert assemble_deck(one).n == 3 * (len(one.mesh.points) - len(one.mesh.node_sets["root"]))


STUDY = """
schema_version = 2
[part.plate]
file = "plate.inp"
units = "mm-t-s"
{key}
[modes]
number = 2
"""


@pytest.mark.parametrize(
    ("mesh", "kind", "key", "said"),
    [
        ("plate", "C3D8I", "", []),
        ("plate", "C3D8R", "", [r"holds 48\.1 % of the strain energy of mode 5 \(3238\.2 Hz.*5 of 6 modes"]),
        ("thin", "C3D8R", "", [r"holds 100 % of the strain energy of mode 1", "24 of 24 C3D8R bricks reach alone"]),
        ("thin", "C3D8R", "hourglass = 0.1", [r"holds 9\d.* % of the strain energy", "24 of 24 C3D8R bricks"]),
        ("block", "C3D8R", "", []),
    ],
)
def test_hourglass_energy_and_single_bricks_are_doubtful(tmp_path, mesh, kind, key, said):
    (tmp_path / "plate.inp").write_text(deck(mesh, (kind,)))
    study = tmp_path / "study.toml"
    study.write_text(STUDY.format(key=key))
    found = CliRunner().invoke(app, ["check", str(study)])
    assert found.exit_code == 0
    text = " ".join(found.output.split())
    assert text.count("DOUBTFUL") == len(said)
    for sentence in said:
        assert re.search(sentence, text)


def test_a_study_has_the_frequencies_of_calculix(tmp_path):
    """The plate of C3D8I through the command line: the numbers of its result file."""
    (tmp_path / "plate.inp").write_text(deck("plate", ("C3D8I",)))
    (tmp_path / "study.toml").write_text(STUDY.format(key='quadrature = "calculix"'))
    result = ss.Study.from_file(tmp_path / "study.toml").run(folder=tmp_path / "results")
    found = np.ravel(result["modes"]["frequency_hz"].values)[:2]
    np.testing.assert_allclose(found, calculix("plate_C3D8I")[:2], rtol=1e-5)


def test_abaqus_decks_have_the_hourglass_stiffness_of_abaqus(tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(deck("thin", ("C3D8R",)))
    assert read_deck(path, units=Units.mm_t_s()).exact().hourglass == 5e-4
    path.write_text("*PREPRINT, ECHO=NO\n" + path.read_text())
    one = read_deck(path, units=Units.mm_t_s())
    assert one.exact().hourglass == one.calculix().hourglass == 5e-3
    assert one.exact(0.02).hourglass == 0.02
