"""Cyclic symmetry: the wheel has the union of its waves, pairing by geometry, transforms, names."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from cyclic_models import mass_ring, random_sector, wedge
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.cyclic import CyclicSector, cyclic_sector, travelling_wave
from stickslip.reduction.full_wheel import wheel, wheel_shape
from stickslip.reduction.turning import dof_rotation, node_table
from stickslip.reduction.waves import Wave, excited_wave, to_sectors, to_waves, wave

TILTED = Axis((0.3, -0.4, 0.8), (0.1, 0.2, -0.3))


def dense(matrix):
    return matrix.toarray() if scipy.sparse.issparse(matrix) else matrix


def squares(structure):
    """Squares of circular frequencies by a dense solver, which shares nothing with the package's."""
    return scipy.linalg.eigvalsh(dense(structure.stiffness), dense(structure.mass))


def union(sector):
    waves = [travelling_wave(sector, k) for k in range(sector.sectors)]
    return np.sort(np.concatenate([squares(w) for w in waves]))


@pytest.mark.parametrize("sectors", [1, 2, 3, 6, 7])
def test_ring_of_masses_has_its_closed_form(sectors):
    sector = mass_ring(sectors, mass=2.0, stiffness=5.0, coupling=3.0)
    for k in range(sectors):
        found = squares(travelling_wave(sector, k))
        exact = (5.0 + 2 * 3.0 * (1 - math.cos(2 * math.pi * k / sectors))) / 2.0
        assert found == pytest.approx([exact], rel=1e-13)


@settings(max_examples=30)
@given(
    sectors=st.integers(1, 7),
    seed=st.integers(0, 1000),
    hub=st.integers(0, 2),
    axis=st.sampled_from([Axis(), TILTED, Axis((0.0, -2.0, 0.0))]),
    free=st.booleans(),
)
def test_wheel_has_the_union_of_the_waves(sectors, seed, hub, axis, free):
    """Random sectors, also with nodes on the axis, singular ones, wheels of one and two sectors."""
    sector = cyclic_sector(random_sector(sectors, seed, hub=hub, free=free, axis=axis), sectors, axis=axis)
    whole = squares(wheel(sector))
    np.testing.assert_allclose(union(sector), whole, rtol=1e-9, atol=1e-11 * whole[-1])


def test_wheel_of_a_solid_ring_has_the_union_of_the_waves():
    sector = cyclic_sector(assemble_solid(wedge(5), Material()), 5)
    whole = squares(wheel(sector))
    np.testing.assert_allclose(union(sector), whole, rtol=1e-8)


def test_free_ring_has_six_rigid_motions_in_the_first_two_diameters():
    sector = cyclic_sector(assemble_solid(wedge(6, clamp=False), Material()), 6)
    rigid = [np.count_nonzero(np.abs(squares(travelling_wave(sector, k))) < 1.0) for k in range(6)]
    assert rigid == [2, 2, 0, 0, 0, 2]  # axial motion and turning; in each whirl two translations and tilts


def test_every_mode_of_a_wave_is_one_of_the_wheel():
    """Shapes, not only frequencies: the expanded wave solves the assembled wheel."""
    sector = cyclic_sector(random_sector(5, 3, hub=1, axis=TILTED), 5, axis=TILTED)
    whole = wheel(sector)
    for k in range(5):
        structure = travelling_wave(sector, k)
        values, vectors = scipy.linalg.eigh(dense(structure.stiffness), dense(structure.mass))
        shape = wheel_shape(sector, k, vectors[:, 2])
        own = np.concatenate([shape[:, sector.independent].ravel(), shape[0, sector.shared]])
        residual = whole.stiffness @ own - values[2] * (whole.mass @ own)
        assert np.linalg.norm(residual) < 1e-11 * np.linalg.norm(whole.stiffness @ own)
        # the high face of each sector moves as the low face of the next one
        np.testing.assert_allclose(shape[:, sector.high], np.roll(shape, -1, axis=0)[:, sector.low], atol=1e-12)


def test_wave_matrices_are_the_blocks_of_the_transformed_wheel():
    """Eq. 41: in the sectors' own frames the Fourier matrix makes the wheel block-diagonal."""
    sector = cyclic_sector(random_sector(4, 1), 4)
    m, n_s = sector.independent.size, 4
    turn = [dense(sector.turn(n))[np.ix_(sector.independent, sector.independent)] for n in range(n_s)]
    frames = scipy.linalg.block_diag(*turn)
    fourier = np.exp(2j * np.pi * np.outer(np.arange(n_s), np.arange(n_s)) / n_s) / 2
    W = frames @ np.kron(fourier, np.eye(m))
    whole = wheel(sector)
    for name in ("mass", "damping", "stiffness"):
        blocks = [dense(getattr(travelling_wave(sector, k), name)) for k in range(n_s)]
        found = W.conj().T @ dense(getattr(whole, name)) @ W
        np.testing.assert_allclose(found, scipy.linalg.block_diag(*blocks), atol=1e-12)


@pytest.mark.parametrize("sectors", [5, 6])
def test_opposite_waves_are_conjugate(sectors):
    sector = cyclic_sector(random_sector(sectors, 2), sectors)
    for k in range(1, sectors):
        one, other = travelling_wave(sector, k), travelling_wave(sector, sectors - k)
        for name in ("mass", "damping", "stiffness", "basis"):
            np.testing.assert_allclose(dense(getattr(one, name)), dense(getattr(other, name)).conj(), atol=1e-13)


@pytest.mark.parametrize("sectors", [1, 2, 5, 6])
def test_standing_waves_are_real_and_all_waves_hermitian(sectors):
    sector = cyclic_sector(random_sector(sectors, 4, hub=1), sectors)
    for k in range(sectors):
        structure = travelling_wave(sector, k)
        real = not np.iscomplexobj(structure.stiffness.data)
        assert real == (2 * k % sectors == 0)
        assert abs(structure.stiffness - structure.stiffness.conj().T).max() == 0.0
    assert not np.iscomplexobj(sector.tie.data)


def test_it_does_not_matter_which_sector_is_modelled():
    """The same ring, modelled at another angle and cut at another place."""
    material = Material()
    one = cyclic_sector(assemble_solid(wedge(6), material), 6)
    for start in (1.0, -2.5):
        other = cyclic_sector(assemble_solid(wedge(6, start=start), material), 6)
        for k in (0, 1, 3):
            np.testing.assert_allclose(squares(travelling_wave(other, k)), squares(travelling_wave(one, k)), rtol=1e-7)


@settings(max_examples=20)
@given(sectors=st.integers(1, 9), seed=st.integers(0, 1000))
def test_transforms_are_unitary_inverses(sectors, seed):
    rng = np.random.default_rng(seed)
    u, v = rng.standard_normal((2, sectors, 4))
    waves = to_waves(u)
    np.testing.assert_allclose(to_sectors(waves), u, atol=1e-13)
    assert np.vdot(waves, to_waves(v)) == pytest.approx(np.vdot(u, v), abs=1e-12)
    n, j = np.meshgrid(np.arange(sectors), np.arange(sectors))
    fourier = np.exp(-2j * np.pi * n * j / sectors) / math.sqrt(sectors)  # eq. 39, as printed
    np.testing.assert_allclose(waves, fourier @ u, atol=1e-12)


def test_shape_of_a_wave_has_one_travelling_wave_coordinate():
    sector = mass_ring(5)
    shape = wheel_shape(sector, 2, np.array([1.0]))
    waves = to_waves(shape)
    expected = np.zeros((5, 2), dtype=complex)
    expected[2] = math.sqrt(5) * shape[0]
    np.testing.assert_allclose(waves, expected, atol=1e-13)


def test_names_of_waves():
    kinds = [wave(k, 6).kind for k in range(6)]
    assert kinds == ["standing", "backward", "backward", "standing", "forward", "forward"]
    assert [wave(k, 5).kind for k in range(5)] == ["standing", *["backward"] * 2, *["forward"] * 2]
    assert [wave(k, 7).nodal_diameter for k in range(7)] == [0, 1, 2, 3, 3, 2, 1]
    assert wave(-1, 24) == Wave(23, 24)
    assert wave(2, 24).phase_angle == pytest.approx(math.pi / 6)
    assert wave(0, 1).kind == wave(1, 2).kind == "standing"
    assert (wave(12, 24).phase, wave(0, 24).phase) == (-1.0, 1.0)
    with pytest.raises(InputError, match=r"wave_number: must be from 0 to 5, got 6"):
        Wave(6, 6)
    with pytest.raises(InputError, match="sectors: must be a whole number"):
        wave(1, 0)


def test_engine_order_meets_the_blades_as_the_wave_it_names():
    """A pressure that stands in space, seen from the blades of a wheel that turns."""
    sectors, speed = 7, 3.0
    time = np.linspace(0, 2 * np.pi / speed, 64, endpoint=False)
    for order in (1, 3, 5, 9, -2):
        angle = 2 * np.pi * np.arange(sectors)[:, None] / sectors + speed * time
        force = np.cos(order * angle)
        omega = abs(order) * speed
        amplitude = 2 * (force @ np.exp(-1j * omega * time)) / time.size
        amplitude = amplitude if order > 0 else amplitude.conj()
        strength = np.abs(to_waves(amplitude))
        assert np.argmax(strength) == excited_wave(order, sectors)
    assert excited_wave(5, 24, harmonic=3) == 15


def without(structure, nodes):
    """The structure with nodes clamped; sets lose them."""
    free = np.flatnonzero(~np.isin(structure.dofs.node, nodes))
    place = np.full(structure.n, -1)
    place[free] = np.arange(free.size)
    sets = {name: place[i][place[i] >= 0] for name, i in structure.sets.items()}
    cut = [m[free][:, free] for m in (structure.mass, structure.damping, structure.stiffness)]
    return Structure(*cut, structure.dofs.take(free), sets)


def test_clamped_nodes_on_both_faces_are_no_obstacle():
    structure = random_sector(6, faces=4)
    sector = cyclic_sector(structure, 6)
    pair = structure.dofs.node[[sector.low[0], sector.high[0]]]
    clamped = cyclic_sector(without(structure, pair), 6)
    assert clamped.low.size == sector.low.size - 3
    np.testing.assert_allclose(union(clamped), squares(wheel(clamped)), rtol=1e-9)


def test_pairs_are_found_whatever_the_order():
    sector = cyclic_sector(random_sector(6, 5, faces=5), 6)
    position = sector.structure.dofs.position
    turned = Axis().turned(position[sector.low], 2 * math.pi / 6)
    np.testing.assert_allclose(position[sector.high], turned, atol=1e-12)
    component = np.array(sector.structure.dofs.component)
    np.testing.assert_array_equal(component[sector.low], component[sector.high])


def test_unmatched_nodes_are_listed():
    structure = random_sector(6, faces=4)
    sector = cyclic_sector(structure, 6)
    moved = structure.dofs.position.copy()
    node = structure.dofs.node[sector.low[0]]
    partner = structure.dofs.node[sector.high[0]]
    moved[structure.dofs.node == node, 2] += 0.01
    torn = replace(structure, dofs=replace(structure.dofs, position=moved))
    with pytest.raises(InputError) as caught:
        cyclic_sector(torn, 6)
    message = str(caught.value)
    assert "1 of 4 nodes of 'cyclic_low', turned by 60°" in message
    assert f"node {node} at (" in message
    assert f"nearest node {partner} off by 0.01 m" in message
    with pytest.raises(
        InputError, match=r"1 of 4 nodes of 'cyclic_high'.*Clamp the nodes of both faces or of neither\. Mesh both"
    ):
        cyclic_sector(torn, 6)
    assert cyclic_sector(torn, 6, tolerance=0.02).low.size == sector.low.size


def test_node_clamped_on_one_face_only_is_named():
    structure = random_sector(6, faces=4)
    node = structure.dofs.node[cyclic_sector(structure, 6).low[0]]
    with pytest.raises(InputError, match=r"1 of 4 nodes of 'cyclic_high', turned by -60°"):
        cyclic_sector(without(structure, [node]), 6)


def test_wrong_number_of_sectors_is_recognised():
    structure = random_sector(24)
    with pytest.raises(InputError, match=r"are 15° apart, 23 sectors need 15.652°. Say sectors=24"):
        cyclic_sector(structure, 23)


def test_wrong_number_of_sectors_is_recognised_though_nodes_are_clamped_on_one_face():
    structure = random_sector(24, faces=6)
    node = structure.dofs.node[structure.sets["cyclic_low"][0]]
    with pytest.raises(InputError, match=r"are 15° apart, 12 sectors need 30°. Say sectors=24"):
        cyclic_sector(without(structure, [node]), 12)


def test_the_set_that_was_meant_is_named_first():
    """A wrong set on either side; the same set twice; sets that no other one meets."""
    structure = random_sector(24, faces=6)
    low, high = (structure.sets[f"cyclic_{side}"] for side in ("low", "high"))
    inner = np.setdiff1d(np.arange(structure.n), np.concatenate([low, high]))
    sets = {"LO": low, "HI": high, "ALL": np.arange(structure.n), "inner": inner}
    named = replace(structure, sets=sets)
    for one, other, words in [
        ("LO", "inner", "The set 'HI' meets 'LO': name it as the high face."),
        ("inner", "HI", "The set 'LO' meets 'HI': name it as the low face."),
        ("LO", "LO", "are 0° apart, 24 sectors need 15°. The set 'HI' meets 'LO': name it as the high face."),
    ]:
        with pytest.raises(InputError) as caught:
            cyclic_sector(named, 24, low=one, high=other)
        assert str(caught.value).endswith(words)
        assert str(caught.value).count(" nearest node ") <= 2  # one a face where none fits
    lonely = replace(structure, sets={"LO": low, "inner": inner})
    with pytest.raises(InputError, match=r"° apart: name the two cut faces of a sector, or check the number"):
        cyclic_sector(lonely, 24, low="LO", high="inner")


def test_swapped_faces_are_recognised_though_one_lacks_nodes():
    structure = random_sector(24)
    node = structure.dofs.node[structure.sets["cyclic_low"][0]]
    with pytest.raises(InputError, match=r"are swapped: 'cyclic_low' lies 15° behind"):
        cyclic_sector(without(structure, [node]), 24, low="cyclic_high", high="cyclic_low")


def test_swapped_faces_are_recognised():
    structure = random_sector(24)
    with pytest.raises(InputError, match=r"are swapped: 'cyclic_low' lies 15° behind 'cyclic_high'"):
        cyclic_sector(structure, 24, low="cyclic_high", high="cyclic_low")
    with pytest.raises(InputError, match=r"are -15° apart, 20 sectors need 18°.*swap them"):
        cyclic_sector(structure, 20, low="cyclic_high", high="cyclic_low")


def test_component_missing_on_one_face_is_named():
    structure = random_sector(6)
    sector = cyclic_sector(structure, 6)
    y = next(i for i in sector.low if structure.dofs.component[i] == "y")
    sets = dict(structure.sets)
    sets["cyclic_low"] = np.setdiff1d(sets["cyclic_low"], [y])
    with pytest.raises(InputError, match=r"has x z, its partner .* has x y z"):
        cyclic_sector(replace(structure, sets=sets), 6)
    sets["cyclic_high"] = np.setdiff1d(sets["cyclic_high"], sector.high[sector.low == y])
    torn = cyclic_sector(replace(structure, sets=sets), 6)
    with pytest.raises(InputError, match="has x without y"):
        travelling_wave(torn, 1)


def test_unknown_set_and_bad_pairs_are_refused():
    structure = random_sector(6)
    with pytest.raises(InputError, match=r"there is no set 'lo'"):
        cyclic_sector(structure, 6, low="lo")
    with pytest.raises(InputError, match=r"name .* more than once"):
        CyclicSector(structure, 6, np.array([0, 1]), np.array([3, 3]))
    with pytest.raises(InputError, match="outside the structure's"):
        CyclicSector(structure, 6, np.array([0]), np.array([structure.n]))
    with pytest.raises(InputError, match="have shapes"):
        CyclicSector(structure, 6, np.array([0]), np.array([1, 2]))
    with pytest.raises(InputError, match="sectors: must be a whole number from 1, got 0"):
        CyclicSector(structure, 0, np.array([0]), np.array([1]))


def test_sets_and_names_of_the_wheel():
    structure = random_sector(3, hub=1)
    sector = cyclic_sector(structure, 3)
    whole = wheel(sector)
    assert whole.n == 3 * sector.independent.size + 3
    third = whole.dofs.take(whole.dof_set("sector2.inner"))
    own = structure.dofs.take(structure.dof_set("inner"))
    np.testing.assert_allclose(third.position, Axis().turned(own.position, 4 * math.pi / 3))
    assert third.labels[0] == f"sector2.{own.labels[0]}"
    assert whole.dof_set("inner").size == 3 * own.node.size
    assert "cyclic_high" not in whole.sets
    wave_sets = travelling_wave(sector, 1)
    assert wave_sets.dofs.take(wave_sets.dof_set("inner")).labels == own.labels
    assert wave_sets.dofs.component[-1] == "axis"
    assert travelling_wave(sector, 0).dofs.component[-1] == "z"


def test_two_nodes_may_not_share_a_partner():
    """With a tolerance beyond the distance of nodes the pairs are no longer one to one, and that is said."""
    structure = random_sector(6, faces=3)
    low = np.unique(structure.dofs.node[structure.dof_set("cyclic_low")])
    position = structure.dofs.position.copy()
    for node in low[1:]:
        position[structure.dofs.node == node] = position[structure.dofs.node == low[0]]
    piled = replace(structure, dofs=replace(structure.dofs, position=position))
    with pytest.raises(InputError, match="several nodes of 'cyclic_low' meet one of 'cyclic_high'"):
        cyclic_sector(piled, 6, tolerance=5.0)


def test_nodes_on_the_axis_in_neither_face_are_named():
    """Every sector would get a copy of its own; one face is enough to tell that they are shared."""
    structure = random_sector(4, hub=2, axis=TILTED)
    low, high = (structure.dof_set(f"cyclic_{side}") for side in ("low", "high"))
    shared = np.intersect1d(low, high)
    lower, upper = (face[~np.isin(face, shared)] for face in (low, high))
    once = replace(structure, sets={"cyclic_low": low, "cyclic_high": upper})
    assert wheel(cyclic_sector(once, 4, axis=TILTED)).n == 4 * (structure.n - 6 - 6) + 6
    without = replace(structure, sets={"cyclic_low": lower, "cyclic_high": upper})
    with pytest.raises(InputError, match="2 nodes on the axis are in neither face"):
        cyclic_sector(without, 4, axis=TILTED)


def test_axis_off_the_origin_matters():
    structure = random_sector(6, axis=TILTED)
    with pytest.raises(InputError, match=r"2 of 2 nodes of 'cyclic_low'.*axis \(0.3, -0.4, 0.8\) through"):
        cyclic_sector(structure, 6, axis=replace(TILTED, origin=(0.0, 0.0, 0.0)))


def test_vectors_of_all_kinds_are_turned():
    """Displacements and rotations of nodes and rigid bodies turn, modal coordinates do not."""
    node = np.array([7, 7, 7, -1, -1, -1, -1, -1, -1, -1, 7, 7, 7])
    component = ("x", "z", "y", "x", "y", "z", "mode", "rx", "ry", "rz", "rx", "ry", "rz")
    position = np.zeros((13, 3))
    position[3:10] = 1.0
    position[6] = np.nan
    dofs = Dofs(node, component, position)
    R = TILTED.rotation(0.7)
    turned = dense(dof_rotation(dofs, R, "test"))
    where = [np.array([0, 2, 1]), np.array([3, 4, 5]), np.array([7, 8, 9]), np.array([10, 11, 12])]
    for rows in where:
        np.testing.assert_allclose(turned[np.ix_(rows, rows)], R)
    assert turned[6, 6] == 1.0
    assert np.count_nonzero(turned) == 4 * 9 + 1
    np.testing.assert_allclose(turned @ turned.T, np.eye(13), atol=1e-15)


def test_bodies_beside_nodes_are_told_apart_by_their_places():
    position = np.array([[0.0, 0.0, 0.0]] * 2 + [[1.0, 0.0, 0.0]] * 2 + [[2.0, 0.0, 0.0]])
    dofs = Dofs(np.array([3, 3, -1, -1, -1]), ("x", "y", "x", "y", "x"), position)
    np.testing.assert_array_equal(node_table(dofs)[:, :2], [[0, 1], [2, 3], [4, -1]])


def test_a_component_that_appears_twice_is_named():
    dofs = Dofs(np.array([3, 3]), ("x", "x"), np.zeros((2, 3)))
    with pytest.raises(InputError, match=r"node3.x appears twice"):
        dof_rotation(dofs, np.eye(3), "test")


@pytest.mark.parametrize("wave_number", [0, 1, 3])
@pytest.mark.parametrize("hub", [0, 1])
@pytest.mark.parametrize("sparse", [True, False])
def test_a_wave_is_the_projection_on_its_tie(wave_number, hub, sparse):
    """Symmetric matrices, Hermitian ones and one that is neither; what is Hermitian to rounding becomes it to the last digit."""
    sector = cyclic_sector(random_sector(6, hub=hub, sparse=sparse), 6)
    rng = np.random.default_rng(7)
    skew = rng.standard_normal((sector.structure.n,) * 2)
    rounding = 1 + 1e-15 * rng.standard_normal(skew.shape)
    kind = scipy.sparse.csr_array if sparse else np.asarray
    uneven, symmetric = kind(skew), kind(dense(sector.structure.stiffness) * rounding)
    hermitian = kind(dense(sector.structure.mass) + 0.1j * (skew - skew.T))
    own = replace(sector.structure, damping=uneven, stiffness=symmetric, mass=hermitian)
    sector = replace(sector, structure=own)
    tie = sector.wave_tie(wave_number).toarray()
    found = travelling_wave(sector, wave_number)
    for name in ("mass", "damping", "stiffness"):
        matrix, expected = getattr(found, name), tie.conj().T @ dense(getattr(own, name)) @ tie
        assert scipy.sparse.issparse(matrix) == sparse
        size = np.abs(expected).max()
        np.testing.assert_allclose(dense(matrix), expected, atol=1e-14 * size, rtol=0)
        if name != "damping":
            np.testing.assert_array_equal(dense(matrix), dense(matrix).conj().T)
