"""Modes where motions have no mass: condensed where stiffness says how they follow, refused by name where nothing does."""

import numpy as np
import pytest
import scipy

from stickslip import InputError
from stickslip.errors import SingularError
from stickslip.model import assemble_deck, normal_modes, read_deck
from stickslip.model.fe.free_solid import inertia_relief
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.mesh.solid_mesh import HEX_EDGES
from stickslip.model.modes import dense_modes
from stickslip.model.readers.open_model import model_summary, read_model
from stickslip.model.structure import Dofs, Structure

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def bricks(path, count, *, held=False, kind="C3D20R"):
    """Write the deck of unit bricks of steel in a row, with 20 nodes each."""
    nodes, cells = {}, []
    for i in range(count):
        corners = [(x + i, y, z) for x, y, z in CORNERS]
        middles = [tuple((a + b) / 2 for a, b in zip(corners[j], corners[k], strict=True)) for j, k in HEX_EDGES]
        cells.append([nodes.setdefault(tuple(map(float, p)), len(nodes) + 1) for p in [*corners, *middles]])
    lines = ["*NODE", *(f"{n}, {x}, {y}, {z}" for (x, y, z), n in nodes.items())]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=E")
    for n, cell in enumerate(cells, 1):
        lines += [f"{n}, " + ", ".join(map(str, cell[:15])) + ",", ", ".join(map(str, cell[15:]))]
    lines += [
        "*MATERIAL, NAME=S",
        "*ELASTIC",
        "2.1e11, 0.3",
        "*DENSITY",
        "7850.",
        "*SOLID SECTION, ELSET=E, MATERIAL=S",
    ]
    if held:
        lines += ["*BOUNDARY", *(f"{n}, 1, 3" for (x, _, _), n in nodes.items() if x == 0.0)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_summary_tells_modes_and_the_singular_mass(tmp_path):
    """One free C3D20R. Before, `stickslip inspect` ended in LinAlgError, "a fault of stickslip"."""
    found = model_summary(read_model(bricks(tmp_path / "one.inp", 1)))
    assert found.rigid_modes == 6
    assert (found.frequencies_hz[6:] > 1000).all()
    assert any("The mass has rank 24 of 60" in text for text in found.remarks)


def test_a_free_brick_that_strains_nothing_in_more_ways_is_refused_at_speed(tmp_path):
    deck = read_deck(bricks(tmp_path / "one.inp", 1))
    solid = rotating_solid(deck.mesh, deck.material, clamped=(), quadrature=deck.quadrature)
    with pytest.raises(SingularError, match=r"without strain in more ways than rigidly.*take C3D20"):
        inertia_relief(solid)
    exact = rotating_solid(deck.mesh, deck.material, clamped=())
    assert inertia_relief(exact) is not None


def test_a_long_row_of_such_bricks_is_refused_by_its_mass(tmp_path):
    """Beyond the size of dense algebra. Each brick of a row has a motion with neither mass nor stiffness; before, "factorise" said so."""
    structure = assemble_deck(read_deck(bricks(tmp_path / "row.inp", 14, held=True)))
    with pytest.raises(SingularError, match=r"mass and stiffness are singular together.*take C3D20"):
        normal_modes(structure, 3)


@pytest.mark.parametrize(("count", "held"), [(1, False), (3, False), (1, True), (2, True)])
def test_few_bricks_with_reduced_integration_have_their_modes(tmp_path, count, held):
    """Of the pencil itself: ``K x = ω² M x``, unit modal masses; as many as the mass has rank; one motion a brick has neither."""
    structure = assemble_deck(read_deck(bricks(tmp_path / "row.inp", count, held=held)))
    K, M = structure.stiffness.toarray(), structure.mass.toarray()
    rank = np.linalg.matrix_rank(M, hermitian=True)
    assert rank < structure.n
    squares, shapes = dense_modes(K, M, rank)
    assert (np.diff(squares) >= 0).all()
    residual = K @ shapes - M @ shapes * squares
    assert np.abs(residual).max() < 1e-9 * np.abs(K).max() * np.abs(shapes).max()
    np.testing.assert_allclose(shapes.T @ M @ shapes, np.eye(rank), atol=1e-9)
    assert normal_modes(structure, 8).rigid == (0 if held else 6)
    with pytest.raises(InputError, match=f"is singular: {rank} of {structure.n} motions have mass"):
        dense_modes(K, M, rank + 1)


def test_a_free_body_keeps_its_rigid_motions_beside_massless_ones():
    """Two masses and a massless point between them: the point follows, springs in series."""
    K = 3.0 * np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    M = np.diag([2.0, 0.0, 2.0])
    for T in (np.eye(3), turn):  # the second hides that a motion has no mass
        squares, shapes = dense_modes(T.T @ K @ T, T.T @ M @ T, 2, -1e-8)
        np.testing.assert_allclose(squares, [0, 1.5], atol=1e-6)
        middle = (T @ shapes)[1]
        np.testing.assert_allclose(middle, (T @ shapes)[[0, 2]].mean(axis=0), atol=1e-12)


def test_multipliers_and_negative_masses_are_named():
    K = np.array([[2.0, -1, 1], [-1, 2, -1], [1, -1, 0]])
    dofs = Dofs(np.arange(1, 4), ("x",) * 3, np.zeros((3, 3)))
    with pytest.raises(InputError, match=r"1 coordinates without mass are multipliers of constraints, node3.x one"):
        dense_modes(K, np.diag([1.0, 1.0, 0.0]), 1, dofs=dofs)
    with pytest.raises(InputError, match="mass: is not positive: a motion, coordinate 1 the most"):
        dense_modes(np.eye(2), np.diag([1.0, -1.0]), 1)
    tiny = np.array([[1e-300, 1e9], [1e9, 1e-300]])  # its scaled terms are no numbers
    with pytest.raises(InputError, match="mass: is not positive: a motion, coordinate 0 the most"):
        dense_modes(np.eye(2), tiny, 1)


def test_the_dense_and_the_sparse_road_agree_on_massless_dofs():
    """A chain of 700 masses of which each third has none: Lanczos, and the same cut short enough for dense algebra."""
    n = 90
    K = scipy.sparse.diags_array([2.0 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]).tocsr()
    M = scipy.sparse.diags_array((np.arange(n) % 3 > 0).astype(float)).tocsr()
    none = scipy.sparse.csr_array((n, n))
    structure = Structure(M, none, K, Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3))), {})
    own = normal_modes(structure, 5).squares
    inverse = scipy.linalg.eigh(M.toarray(), K.toarray(), eigvals_only=True)[::-1][:5]
    np.testing.assert_allclose(own, 1 / inverse, rtol=1e-9)
