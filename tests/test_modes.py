"""Modes against dense eigensolutions and closed forms: complex, free, repeated, massless, unstable."""

import math

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
import scipy.spatial
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.errors import InputError, SingularError
from stickslip.model.fe.factorisation import factorise
from stickslip.model.fe.lanczos import lanczos
from stickslip.model.matrices import chain
from stickslip.model.modes import Modes, lowest_modes, natural_frequencies, normal_modes
from stickslip.model.rigid.motion import refuse_unheld
from stickslip.model.structure import Dofs, Structure, join, nodal_dofs

pytestmark = pytest.mark.kernel

RNG = np.random.default_rng(11)


def structure(mass, stiffness, dofs=None):
    """Wrap matrices; without damping."""
    n = stiffness.shape[0]
    table = dofs or Dofs(np.arange(n), ("x",) * n, np.column_stack([np.arange(n), *np.zeros((2, n))]))
    return Structure(mass, 0.0 * stiffness, stiffness, table)


def sparse(matrix):
    return scipy.sparse.csr_array(matrix)


def ring(n, phase=0.0):
    """Unit masses on a closed chain of unit springs, joined with a phase at the last one."""
    matrix = 2 * np.eye(n, dtype=complex) - np.eye(n, k=1) - np.eye(n, k=-1)
    matrix[0, -1], matrix[-1, 0] = -np.exp(-1j * phase), -np.exp(1j * phase)
    return sparse(matrix if phase else matrix.real)


def ring_squares(n, phase=0.0):
    """Closed form: a wave exp(i κ j) closes where κ n = phase + 2 π m."""
    return np.sort(2 - 2 * np.cos((phase + 2 * np.pi * np.arange(n)) / n))


def grid(shape, spring=1.0):
    """A free block of unit masses with springs along edges and diagonals, as a solid in 3-D."""
    points = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    points = points.reshape(-1, 3).astype(float)
    pairs = scipy.spatial.cKDTree(points).query_pairs(1.8, output_type="ndarray")
    along = points[pairs[:, 1]] - points[pairs[:, 0]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    rows = np.repeat(np.arange(len(pairs)), 6)
    columns = (3 * pairs[:, :, None] + np.arange(3)).reshape(-1)
    stretch = scipy.sparse.csr_array((np.hstack([-along, along]).ravel(), (rows, columns)))
    return points, spring * (stretch.T @ stretch)


def check(found: Modes, K, M, squares, tolerance=1e-9):
    """Compare squares; shapes must be M-orthonormal and solve the eigenproblem."""
    scale = abs(squares).max()
    np.testing.assert_allclose(found.squares, squares, atol=tolerance * scale, rtol=0)
    unit = found.shapes.conj().T @ (M @ found.shapes)
    np.testing.assert_allclose(unit, np.eye(len(squares)), atol=1e-10)
    rest = K @ found.shapes - (M @ found.shapes) * found.squares
    assert np.abs(rest).max() < 1e-8 * abs(K).max()


@pytest.mark.parametrize("phase", [0.0, 0.7])
def test_ring_has_its_closed_form_spectrum_with_every_pair(phase):
    """Without a phase all frequencies but one are double; with one the matrix is Hermitian."""
    n = 900  # large enough for the sparse solver
    K, M = ring(n, phase), sparse(np.eye(n))
    found = normal_modes(structure(M, K), 21)
    check(found, K, M, ring_squares(n, phase)[:21], 1e-10)
    assert np.iscomplexobj(found.shapes) == (phase != 0)
    assert found.rigid == (0 if phase else 1)


@settings(deadline=None, max_examples=8)
@given(size=st.integers(401, 460), n=st.integers(1, 30), hermitian=st.booleans(), seed=st.integers(0, 2**16))
def test_random_matrices_agree_with_dense_algebra(size, n, hermitian, seed):
    rng = np.random.default_rng(seed)

    def draw(count):
        part = scipy.sparse.random_array((size, count), density=0.02, rng=rng)
        if hermitian:
            part = part + 1j * scipy.sparse.random_array((size, count), density=0.02, rng=rng)
        return sparse(part)

    left, right = draw(size), draw(size)
    K = sparse(left @ left.conj().T + 0.1 * scipy.sparse.eye_array(size))
    M = sparse(right @ right.conj().T + scipy.sparse.eye_array(size))
    exact = scipy.linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:n]
    check(normal_modes(structure(M, K), n), K, M, exact)


def test_a_free_body_has_six_rigid_modes_and_no_more():
    points, K = grid((10, 6, 5))
    dofs = nodal_dofs(points, np.arange(len(points)))
    M = sparse(scipy.sparse.diags_array(np.repeat(RNG.uniform(1, 2, len(points)), 3)))
    found = normal_modes(structure(M, K, dofs), 12)
    assert found.rigid == 6
    assert np.all(found.squares[:6] == 0)
    assert np.all(found.squares[6:] > 1e-3)
    exact = scipy.linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:12]
    # the reciprocals of the rigid modes, 1 / shift, are 1e6 times those of the others: so is rounding
    check(found, K, M, np.where(np.arange(12) < 6, 0.0, exact), 1e-8)
    outside = found.shapes[:, :6]
    motions = np.zeros((len(dofs), 6))  # by hand: translations, and rotations about the origin
    for i, axis in enumerate(np.eye(3)):
        motions[i::3, i] = 1.0
        motions[:, 3 + i] = np.cross(axis, points).ravel()
    motions = np.linalg.qr(motions)[0]
    outside = outside - motions @ (motions.T @ outside)
    assert np.abs(outside).max() < 1e-8 * np.abs(found.shapes[:, :6]).max()
    np.testing.assert_array_equal(natural_frequencies(structure(M, K, dofs), 6), 0.0)


def test_a_free_body_without_a_shift_is_named():
    points, K = grid((10, 6, 5))
    dofs = nodal_dofs(points, np.arange(len(points)))
    M = scipy.sparse.eye_array(len(dofs), format="csr")
    with pytest.raises(SingularError, match=r"normal_modes: one body is not held.*300 nodes.*rotation about z"):
        normal_modes(structure(M, K, dofs), 3, shift=0.0)


@pytest.mark.parametrize("spring", [1e-9, 1.0])
def test_a_weak_support_is_not_taken_for_a_rigid_motion(spring):
    """Its frequency is that of the whole mass on the spring, to the ratio of the stiffnesses."""
    n = 700
    K = ring(n).tolil()
    K[0, 0] += spring
    found = normal_modes(structure(sparse(np.eye(n)), sparse(K)), 1)
    assert found.rigid == 0
    if spring < 1:
        assert found.squares[0] == pytest.approx(spring / n, rel=1e-4)


@pytest.mark.parametrize("size", [90, 900])  # dense, and Lanczos
def test_dofs_without_mass_follow_the_others(size):
    """Twin: condense them statically."""
    K = ring(size) + 0.01 * scipy.sparse.eye_array(size)
    heavy = np.arange(size) % 3 == 0
    M = sparse(np.diag(np.where(heavy, 1.5, 0.0)))
    dense = K.toarray()
    light = dense[np.ix_(~heavy, ~heavy)]
    coupling = dense[np.ix_(heavy, ~heavy)]
    condensed = dense[np.ix_(heavy, heavy)] - coupling @ np.linalg.solve(light, coupling.T)
    exact = np.linalg.eigvalsh(condensed)[:9] / 1.5
    check(normal_modes(structure(M, sparse(K)), 9), K, M, exact)


def test_more_modes_than_the_mass_has_are_refused():
    n = 900
    K = sparse(ring(n) + scipy.sparse.eye_array(n))
    few = np.zeros(n)
    few[:5] = 1.0
    with pytest.raises(InputError, match=r"6 asked of a structure with 900 dofs, of which 5 have mass"):
        normal_modes(structure(sparse(np.diag(few)), K), 6)
    rank_one = scipy.sparse.csr_array(np.outer(few, few))
    with pytest.raises(InputError, match="whose mass has the rank 1"):
        normal_modes(structure(rank_one, K), 3)
    assert len(normal_modes(structure(rank_one, K), 1).squares) == 1
    with pytest.raises(InputError, match="1 asked of 900 dofs whose mass has the rank 0"):
        lanczos(0 * rank_one, 1, factorise(K), 0.0, float)


def test_equal_bodies_keep_all_their_frequencies():
    one = chain(450, 1.0, 1e4)
    whole = join(a=one, b=one, c=one)
    many = structure(sparse(whole.mass), sparse(whole.stiffness), whole.dofs)
    single = normal_modes(structure(sparse(one.mass), sparse(one.stiffness)), 3).squares
    found = normal_modes(many, 9)
    np.testing.assert_allclose(found.squares, np.repeat(single, 3), rtol=1e-10)


@pytest.mark.parametrize(("arms", "n"), [(9, 120), (33, 30)])
def test_equal_frequencies_of_one_body_are_all_found(arms, n):
    """Equal chains on one common mass: motions that leave it at rest have equal frequencies, as many as arms but one."""
    single = np.diag(np.full(n, 2.0)) - np.eye(n, k=1) - np.eye(n, k=-1)
    K = scipy.linalg.block_diag(*[single] * arms, [[float(arms)]])
    K[-1, np.arange(arms) * n] = K[np.arange(arms) * n, -1] = -1.0
    M = np.eye(len(K))
    exact = scipy.linalg.eigh(K, M, eigvals_only=True)[: 2 * arms + 1]
    assert np.ptp(exact[1:arms]) < 1e-10 * exact[arms]
    check(normal_modes(structure(sparse(M), sparse(K)), 2 * arms + 1), K, M, exact)
    if arms > 9:  # fewer than are equal
        check(normal_modes(structure(sparse(M), sparse(K)), arms - 1), K, M, exact[: arms - 1])


def test_diverging_modes_have_a_negative_square():
    n = 500
    K = sparse(ring(n) - 1e-3 * scipy.sparse.eye_array(n))
    M = sparse(np.eye(n))
    found = normal_modes(structure(M, K), 5, shift=-2e-3)
    np.testing.assert_allclose(found.squares, ring_squares(n)[:5] - 1e-3, atol=1e-12)
    assert found.frequencies_hz[0] == pytest.approx(-math.sqrt(1e-3) / (2 * math.pi))
    assert natural_frequencies(structure(M, K), 5)[0] == 0


@pytest.mark.parametrize("phase", [0.0, 0.7])
@pytest.mark.parametrize("shift", [None, -1e-3])
def test_squares_far_below_the_shift_are_found(phase, shift):
    """Three of −50 beside many near zero: without the count of pivots the modes nearest to the shift came back."""
    n = 900
    push = np.zeros(n)
    push[[100, 400, 700]] = 50.0
    K = ring(n, phase) - scipy.sparse.diags_array(push, format="csr")
    exact = np.linalg.eigvalsh(K.toarray())[:6]
    assert exact[2] < -40
    found = normal_modes(structure(sparse(np.eye(n)), K), 6, shift=shift)
    np.testing.assert_allclose(found.squares, exact, atol=1e-8)
    assert np.all(natural_frequencies(structure(sparse(np.eye(n)), K), 3) == 0)


def test_multipliers_are_no_diverging_motions():
    """A dof without mass and stiffness that ties two others has a negative pivot at any shift."""
    n = 900
    K = scipy.sparse.lil_array((n + 1, n + 1))
    K[:n, :n] = ring(n) + 0.1 * scipy.sparse.eye_array(n)
    K[n, 0], K[n, 5], K[0, n], K[5, n] = 1.0, -1.0, 1.0, -1.0
    M = sparse(np.diag(np.append(np.ones(n), 0.0)))
    free = np.delete(np.eye(n), 5, axis=1)
    free[5, 0] = 1.0
    tied = free.T @ K.toarray()[:n, :n] @ free
    exact = scipy.linalg.eigvalsh(tied, free.T @ free)[:5]
    told = []
    found = normal_modes(structure(M, scipy.sparse.csr_array(K)), 5, say=told.append)
    np.testing.assert_allclose(found.squares, exact, atol=1e-10)
    assert sum("factorising" in line for line in told) == 1


def test_steps_are_told():
    told = []
    normal_modes(structure(sparse(np.eye(500)), ring(500)), 4, say=told.append)
    assert [line.split()[0] for line in told] == ["factorising", "4"]


def test_lanczos_ends_where_nothing_is_left():
    """The whole spectrum of a matrix of few dofs: the Krylov space is everything."""
    K = ring(30).toarray() + np.eye(30)
    values, vectors = lanczos(np.eye(30), 30, factorise(K), 0.0, float)
    np.testing.assert_allclose(np.sort(values), ring_squares(30) + 1, rtol=1e-12)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(30), atol=1e-12)


def test_lowest_modes_does_not_need_a_solution_where_it_is_dense():
    values, _ = lowest_modes(np.diag([3.0, 1.0, 2.0]), np.eye(3), 2, None)
    np.testing.assert_allclose(values, [1.0, 2.0])


def two_blocks(clamped):
    """A block whose nodes `clamped` are fixed beside a free one, with the dofs that are left."""
    points, K = grid((4, 3, 3))
    free = np.setdiff1d(np.arange(len(points)), clamped)
    kept = (3 * free[:, None] + np.arange(3)).ravel()
    first = nodal_dofs(points[free], free)
    second = nodal_dofs(points + np.array([10.0, 0, 0]), np.arange(100, 100 + len(points)))
    whole = scipy.sparse.block_diag([K[kept][:, kept], K], format="csr")
    return whole, Dofs(
        np.concatenate([first.node, second.node]),
        first.component + second.component,
        np.vstack([first.position, second.position]),
    )


def test_free_bodies_are_named_with_their_motions():
    with pytest.raises(SingularError) as error:
        refuse_unheld(*two_blocks([0, 2, 3]), "place")
    text = str(error.value)
    assert text.startswith("place: one body is not held")
    assert "36 nodes: 100, 101, 102, 103, 104, …" in text
    assert "translation along x, translation along y, translation along z, rotation about x" in text
    assert "Clamp it" in text
    with pytest.raises(SingularError, match=r"2 bodies are not held.*the first, the body of dof node100"):
        refuse_unheld(*two_blocks([0]), "place")


@pytest.mark.parametrize("dense", [False, True])
def test_a_hinged_body_turns_about_its_hinge(dense):
    """Two fixed points leave one rotation, about the line through them: (0, 1, 0) to (0, 1, 2)."""
    points, K = grid((4, 3, 3))
    ends = [i for i, p in enumerate(points) if tuple(p) in {(0, 1, 0), (0, 1, 2)}]
    free = np.setdiff1d(np.arange(len(points)), ends)
    kept = (3 * free[:, None] + np.arange(3)).ravel()
    held = K[kept][:, kept]
    with pytest.raises(SingularError, match=r"rotation about \(0, 0, -?1\) through \(0, 1, .*\) m"):
        refuse_unheld(held.toarray() if dense else held, nodal_dofs(points[free], free), "place")


def test_held_bodies_pass():
    whole, dofs = two_blocks([0, 2, 3])
    first = np.flatnonzero(dofs.node < 100)
    refuse_unheld(whole[first][:, first], dofs.take(first), "place")


def test_rotational_dofs_turn_with_the_body():
    """Bending and stretching of a beam element in a plane are two bodies to the graph; bending alone can shift and turn."""
    table = Dofs(np.repeat([1, 2], 3), ("x", "y", "rz") * 2, np.repeat([[0.0, 0, 0], [2.0, 0, 0]], 3, axis=0))
    bending = np.array([[12.0, 12, -12, 12], [12, 16, -12, 8], [-12, -12, 12, -12], [12, 8, -12, 16]])
    K = np.zeros((6, 6))
    K[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = bending
    K[np.ix_([0, 3], [0, 3])] = [[5.0, -5.0], [-5.0, 5.0]]
    with pytest.raises(SingularError, match=r"2 bodies are not held.*translation along y, rotation about z"):
        refuse_unheld(K, table, "place")
    refuse_unheld(K[3:, 3:], table.take(np.arange(3, 6)), "place")
