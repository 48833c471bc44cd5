"""Readers of ANSYS files: against files that ANSYS wrote, files written here, and cut or spoilt ones.

The files of ANSYS ship inside the package ansys-mapdl-reader, whose own reading is one of the judges (`make test-optional`).
"""

import importlib.util
import os
import warnings
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from ansys_files import HALF, ZLIB, full_file, record, result_file
from hypothesis import given
from hypothesis import strategies as st

from stickslip import InputError, Material, Structure
from stickslip.model import (
    assemble_solid,
    natural_frequencies,
    read_ansys_archive,
    read_ansys_full,
    read_ansys_materials,
    read_ansys_results,
)
from stickslip.model.facts import facts_of_solid
from stickslip.model.fe.cell_laws import cell_laws
from stickslip.model.fe.elements import Quadrature
from stickslip.model.mesh.solid_mesh import by_kind
from stickslip.model.readers.ansys_archive import ansys_passed_over
from stickslip.model.readers.ansys_binary import Records, read_ansys_nodes, rotations
from stickslip.model.readers.units import Units

INCH = Units.inch_lbf_s()
# of the models in file.full and file.rst, which store them: psi and lbf s²/in⁴
TITANIUM = Material(young_modulus=16.9e6 * INCH.stress, poisson_ratio=0.31, density=4.1408e-4 * INCH.density)


@pytest.fixture(scope="module")
def samples():
    """Folder of the files that ANSYS wrote."""
    try:
        found = importlib.util.find_spec("ansys.mapdl.reader")
    except ModuleNotFoundError:
        found = None
    if found is None:
        message = "ansys-mapdl-reader, which has the files of ANSYS, is not installed: make optional"
        if os.environ.get("STICKSLIP_OPTIONAL") == "required":
            pytest.fail(message)
        pytest.skip(message)
    return Path(found.origin).parent / "examples"


@pytest.fixture(scope="module")
def theirs(samples):
    """The other reader, as a judge."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its own dependencies, when it is imported
        from ansys.mapdl import reader
    return reader


# --- files that ANSYS wrote


def test_matrices_have_the_frequencies_that_ansys_found(samples):
    structure = read_ansys_full(samples / "file.full", nodes=samples / "file.rst", units=INCH)
    expected = [1283.2004, 1283.2004, 5781.9749, 6919.3989, 6919.3989, 10172.615]
    assert structure.n == 900  # 963 coordinates without the 63 of the clamped end
    np.testing.assert_allclose(natural_frequencies(structure, 6), expected, rtol=1e-7)  # its digits


def test_matrices_are_those_of_the_other_reader(samples, theirs):
    structure = read_ansys_full(samples / "file.full", plausible=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table, k, m = theirs.read_binary(str(samples / "file.full")).load_km(sort=True)
    key = {(int(node), "xyz"[c]): row for row, (node, c) in enumerate(table)}
    rows = [key[node, c] for node, c in zip(structure.dofs.node, structure.dofs.component, strict=True)]
    for ours, half in ((structure.stiffness, k), (structure.mass, m)):
        full = (half + half.T - scipy.sparse.diags(half.diagonal())).tocsr()[rows][:, rows]
        assert abs(ours - full).max() == 0.0


def test_our_elements_assemble_the_stiffness_of_ansys(samples):
    theirs = read_ansys_full(samples / "file.full", nodes=samples / "HexBeam.cdb", units=INCH)
    mesh = read_ansys_archive(samples / "HexBeam.cdb", units=INCH)
    ours = assemble_solid(mesh, TITANIUM, clamped=(), quadrature=Quadrature(stiffness=3, mass=5))
    rows = same_rows(ours, theirs)
    difference = abs(ours.stiffness[rows][:, rows] - theirs.stiffness).max()
    assert difference < 1e-12 * abs(theirs.stiffness).max()  # 2.5e-13 measured: rounding of the file
    np.testing.assert_allclose(ours.dofs.position[rows], theirs.dofs.position, atol=1e-15)


def test_fourteen_points_assemble_the_mass_of_ansys(samples):
    # the rule that SOLID186 uses for its mass; scikit-fem has no such rule, so this is a twin in plain NumPy
    theirs = read_ansys_full(samples / "file.full", nodes=samples / "HexBeam.cdb", units=INCH)
    mesh = read_ansys_archive(samples / "HexBeam.cdb", units=INCH)
    mass = hexahedron_mass(mesh, TITANIUM.density)
    node = np.searchsorted(mesh.numbers, theirs.dofs.node)
    component = np.array(theirs.dofs.component)
    scalar = mass[np.ix_(node, node)] * (component[:, None] == component)
    assert abs(scalar - theirs.mass.toarray()).max() < 1e-11 * abs(theirs.mass).max()


def test_free_frequencies_and_modes_belong_to_our_elements(samples):
    results = read_ansys_results(samples / "file.rst", units=INCH)
    expected = [7366.49504, 7366.49504, 11504.89524, 17285.70459, 17285.70459, 20137.19299]
    np.testing.assert_allclose(results.frequencies_hz, expected, rtol=0, atol=5.1e-6)  # its digits
    assert results.sectors == 1
    assert not results.harmonic_indices.any()
    mesh = read_ansys_archive(samples / "HexBeam.cdb", units=INCH)
    ours = assemble_solid(mesh, TITANIUM, clamped=(), quadrature=Quadrature(stiffness=3, mass=5))
    mass = scipy.sparse.kron(hexahedron_mass(mesh, TITANIUM.density), np.eye(3)).tocsr()
    shapes = results.shapes[same_rows_of(results.dofs, ours.dofs)]
    # this mass is singular, so the roles are changed: M v = v (K + shift M) / (square + shift)
    shift, K, M = 1e9, ours.stiffness.toarray(), mass.toarray()
    inverse = scipy.linalg.eigh(M, K + shift * M, eigvals_only=True, subset_by_index=(951, 956))
    squares = (1 / inverse - shift)[::-1]
    found = np.sqrt(squares) / (2 * np.pi)
    np.testing.assert_allclose(found, results.frequencies_hz, rtol=1e-9)
    rest = ours.stiffness @ shapes - mass @ shapes * squares
    assert abs(rest).max() < 2e-6 * abs(ours.stiffness @ shapes).max()  # as far as ANSYS iterated
    np.testing.assert_allclose(shapes.T @ mass @ shapes, np.eye(6), atol=1e-8)  # of unit mass in SI


def test_modes_are_those_of_the_other_reader(samples, theirs):
    results = read_ansys_results(samples / "file.rst")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        judge = theirs.read_binary(str(samples / "file.rst"))
        for mode in range(6):
            numbers, displacement = judge.nodal_solution(mode)
            np.testing.assert_array_equal(results.dofs.node[::3], numbers)
            np.testing.assert_array_equal(results.shapes[:, mode], displacement.ravel())
        np.testing.assert_array_equal(results.dofs.position[::3], judge.mesh.nodes)


@pytest.mark.parametrize(("name", "width", "cells"), [("HexBeam.cdb", 20, 40), ("TetBeam.cdb", 4, 3913)])
def test_meshes_are_those_of_the_other_reader(samples, theirs, name, width, cells):
    mesh = read_ansys_archive(samples / name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        judge = theirs.Archive(str(samples / name))
    assert mesh.cells.shape == (cells, width)
    numbers = mesh.numbers[mesh.cells]
    for ours, element in zip(numbers, judge.elem, strict=True):
        np.testing.assert_array_equal(ours, element[10:])
    rows = np.searchsorted(judge.nnum, mesh.numbers)
    np.testing.assert_allclose(mesh.points, judge.nodes[rows], rtol=1e-15)  # it rounds its own way
    for component, members in judge.node_components.items():
        np.testing.assert_array_equal(mesh.numbers[mesh.node_sets[component.lower()]], members)


def test_material_of_an_archive(samples):
    assert read_ansys_materials(samples / "HexBeam.cdb") == {
        1: Material(young_modulus=70e9, poisson_ratio=0.35, density=2700.0)
    }


def test_a_sector_with_wedges_has_the_cells_and_volumes_of_the_other_reader(samples, theirs):
    """Bricks and wedges of SOLID185; the judge counts the volume of wedges negative, in VTK's own numbering of them."""
    mesh = read_ansys_archive(samples / "sector.cdb")
    assert {width: len(rows) for width, rows in by_kind(mesh.cells)} == {6: 4, 8: 101}
    grid = theirs.Archive(str(samples / "sector.cdb")).grid
    volume = np.abs(grid.compute_cell_sizes()["Volume"]).sum()
    assert facts_of_solid(cell_laws(mesh, Material(density=1.0)), 0).mass == pytest.approx(volume, rel=1e-5)


def test_samples_cut_anywhere_are_refused(samples, tmp_path):
    for name, read in (("file.full", read_ansys_full), ("file.rst", read_ansys_results)):
        whole = (samples / name).read_bytes()
        # what follows the last record that is read may be missing
        for share in (0, 0.0003, 0.001, 0.01, 0.1, 0.2, 0.4):
            path = tmp_path / name
            path.write_bytes(whole[: int(share * len(whole))])
            with pytest.raises(InputError, match=rf"{name}"):
                read(path)


def test_wrong_units_are_named(samples):
    with pytest.raises(InputError, match=r"mass is 0\.00203 kg in a box.*inch-lbf-s"):
        read_ansys_full(samples / "file.full", nodes=samples / "file.rst")


def same_rows(ours: Structure, theirs: Structure):
    return same_rows_of(ours.dofs, theirs.dofs)


def same_rows_of(ours, theirs):
    """Return the rows of the table `ours` that stand for those of `theirs`."""
    key = {pair: row for row, pair in enumerate(zip(ours.node.tolist(), ours.component, strict=True))}
    return np.array([key[pair] for pair in zip(theirs.node.tolist(), theirs.component, strict=True)])


def hexahedron_mass(mesh, density):
    """Return the (n, n) mass matrix of one component of 20-node bricks by Irons' rule of 14 points."""
    b, c = np.sqrt(19 / 30), np.sqrt(19 / 33)
    faces = b * np.vstack([np.eye(3), -np.eye(3)])
    corners = c * np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    places = np.vstack([faces, corners])
    weights = np.r_[np.full(6, 320 / 361), np.full(8, 121 / 361)]
    mass = np.zeros((len(mesh.points), len(mesh.points)))
    for place, weight in zip(places, weights, strict=True):
        shape = brick(place)
        # differences are exact: along each coordinate the shape functions are quadratic
        slope = [(brick(place + d) - brick(place - d)) / 2 for d in np.eye(3)]
        for cell in mesh.cells:
            volume = abs(np.linalg.det(np.array(slope) @ mesh.points[cell]))
            mass[np.ix_(cell, cell)] += density * weight * volume * np.outer(shape, shape)
    return mass


BRICK = np.array(
    [
        *[(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
        *[(0, -1, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1), (0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1)],
        *[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)],
    ]
)


def brick(place):
    """Return the 20 shape functions of the serendipity brick at `place` in [-1, 1]³."""
    values = np.empty(20)
    for i, node in enumerate(BRICK):
        factors = 1 + node * place
        if i < 8:
            values[i] = factors.prod() / 8 * ((node * place).sum() - 2)
        else:
            middle = int(np.flatnonzero(node == 0)[0])
            values[i] = (1 - place[middle] ** 2) * np.delete(factors, middle).prod() / 4
    return values


# --- files written here


def small_model():
    """Return mass and stiffness (9, 9) of three nodes, positive definite and full."""
    rng = np.random.default_rng(3)
    half = rng.standard_normal((9, 9))
    return np.eye(9) * 2.0 + 0.1 * (half + half.T), half @ half.T + 9 * np.eye(9)


ARCHIVE = """/COM, three nodes
NBLOCK,6,SOLID,         7,         3
(3i9,6e21.13e3)
        2        0        0 0.0000000000000E+000 0.0000000000000E+000 0.0000000000000E+000 9.0000000000000E+001
        5        0        0 1.0000000000000E+003
        7        0        0 1.0000000000000E+003 2.0000000000000E+003-3.0000000000000E+003
N,R5.3,LOC,       -1,
CMBLOCK,TIP     ,NODE,       2  ! users node component definition
(8i10)
         5        -7
"""


@pytest.mark.parametrize("packed", ["", "windows"])
def test_full_file_written_here(tmp_path, packed):
    mass, stiffness = small_model()
    damping = 0.01 * stiffness
    path, nodes = tmp_path / "file.full", tmp_path / "nodes.cdb"
    path.write_bytes(full_file(mass, stiffness, [7, 2, 5], held=[3, 4, 5], damping=damping, packed=packed))
    nodes.write_text(ARCHIVE)
    units = Units.mm_t_s()
    structure = read_ansys_full(path, nodes=nodes, units=units, plausible=False)
    rows = [6, 7, 8, 0, 1, 2]  # sorted by number, node 2 held
    assert structure.dofs.node.tolist() == [5, 5, 5, 7, 7, 7]
    assert structure.dofs.component == ("x", "y", "z") * 2
    np.testing.assert_allclose(structure.dofs.position[3], [1.0, 2.0, -3.0])
    np.testing.assert_allclose(structure.mass.toarray(), 1e3 * mass[np.ix_(rows, rows)])
    np.testing.assert_allclose(structure.stiffness.toarray(), 1e3 * stiffness[np.ix_(rows, rows)])
    np.testing.assert_allclose(structure.damping.toarray(), 1e3 * damping[np.ix_(rows, rows)])
    assert structure.dof_set("tip").tolist() == list(range(6))


def test_rotations_are_turned_and_converted_too(tmp_path):
    rng = np.random.default_rng(5)
    half = rng.standard_normal((12, 12))
    mass, stiffness = np.eye(12), half @ half.T  # in global axes
    block = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # node 2 is turned by 90° about z
    turn = scipy.linalg.block_diag(block, block, np.eye(6))
    path, nodes = tmp_path / "file.full", tmp_path / "nodes.cdb"
    content = full_file(mass, turn.T @ stiffness @ turn, [2, 5], kinds=(1, 2, 3, 4, 5, 6))
    path.write_bytes(content)
    nodes.write_text(ARCHIVE)
    structure = read_ansys_full(path, nodes=nodes, units=Units.mm_t_s(), plausible=False)
    assert structure.dofs.component == ("x", "y", "z", "rx", "ry", "rz") * 2
    length = np.tile(np.repeat([1e-3, 1.0], 3), 2)
    expected = 1e-3 * stiffness / np.outer(length, length)  # t mm²/s² is 1e-3 J
    np.testing.assert_allclose(structure.stiffness.toarray(), expected, rtol=1e-12, atol=1e-9)
    mixed = full_file(mass, stiffness, [2, 5], kinds=(1, 2, 3, 4, 5, 6), header={7: 6})
    at = mixed.index(record(np.array([6, 6])))
    mixed = mixed[:at] + record(np.array([5, 7])) + mixed[at + len(record(np.array([6, 6]))) :]
    path.write_bytes(mixed)
    with pytest.raises(InputError, match="coordinates of each node: 2 node numbers, 2 counts that sum to 12"):
        read_ansys_full(path)


def test_coordinates_without_mass_are_named_and_empty_ones_left_out(tmp_path):
    mass, stiffness = small_model()
    mass[4], mass[:, 4] = 0, 0
    for matrix in (mass, stiffness):
        matrix[8], matrix[:, 8] = 0, 0
    (tmp_path / "file.full").write_bytes(full_file(mass, stiffness, [1, 2, 3]))
    structure = read_ansys_full(tmp_path / "file.full")
    assert structure.n == 8
    assert structure.dof_set("massless").tolist() == [4]


def test_nodal_systems_are_turned_into_the_global_axes(tmp_path):
    mass, stiffness = small_model()  # in global axes, nodes 2, 5, 7
    turn = scipy.linalg.block_diag([[0, -1, 0], [1, 0, 0], [0, 0, 1]], np.eye(6))  # 90° about z
    path, nodes = tmp_path / "file.full", tmp_path / "nodes.cdb"
    path.write_bytes(full_file(turn.T @ mass @ turn, turn.T @ stiffness @ turn, [2, 5, 7]))
    nodes.write_text(ARCHIVE)
    structure = read_ansys_full(path, nodes=nodes, plausible=False)
    np.testing.assert_allclose(structure.stiffness.toarray(), stiffness, atol=1e-13)
    np.testing.assert_allclose(structure.mass.toarray(), mass, atol=1e-14)
    path.write_bytes(full_file(mass, stiffness, [2, 5, 7], held=[1]))
    with pytest.raises(InputError, match=r"node 2 has axes of its own and only some free comp"):
        read_ansys_full(path, nodes=nodes, plausible=False)


def test_nodal_angles_turn_about_z_then_new_x_then_new_y(tmp_path):
    (tmp_path / "nodes.cdb").write_text(ARCHIVE.replace("(3i9,6e21.13e3)", "(3i9,6e21.13e3)"))
    known = read_ansys_nodes(tmp_path / "nodes.cdb")
    assert known.angles[0].tolist() == [90.0, 0.0, 0.0]
    angles = np.array([[20.0, -35.0, 50.0]])
    turn = rotations(type(known)(np.array([1]), np.zeros((1, 3)), angles, {}), np.array([1]))[0]
    from scipy.spatial.transform import Rotation

    expected = Rotation.from_euler("ZXY", [20.0, -35.0, 50.0], degrees=True).as_matrix()
    np.testing.assert_allclose(turn, expected, atol=1e-15)


def test_cyclic_results_have_signed_indices_and_turned_shapes(tmp_path):
    nodes = {4: (1.0, 0.0, 0.0), 2: (0.0, 1.0, 0.0)}
    frequencies = [10.0, 20.0, 20.0, 30.0]
    shapes = np.arange(24.0).reshape(4, 2, 3)
    angles = np.array([[90.0, 0, 0], [0, 0, 0]])
    path = tmp_path / "file.rst"
    path.write_bytes(result_file(frequencies, shapes, nodes, angles=angles, harmonic=[0, 1, 1, 3], sectors=6))
    results = read_ansys_results(path, units=Units.mm_t_s())
    assert results.sectors == 6
    assert results.harmonic_indices.tolist() == [0, 1, -1, 3]
    assert results.dofs.node.tolist() == [2, 2, 2, 4, 4, 4]
    np.testing.assert_allclose(results.dofs.position[3], [1e-3, 0, 0])
    np.testing.assert_allclose(results.frequencies_hz, frequencies)
    unit = np.sqrt(1e3)  # of the square root of a tonne
    np.testing.assert_allclose(results.shapes[:3, 1] * unit, shapes[1, 1])
    np.testing.assert_allclose(results.shapes[3:, 1] * unit, [-shapes[1, 0, 1], shapes[1, 0, 0], shapes[1, 0, 2]])


@given(
    st.lists(st.sampled_from([0, 0, 0, 1, 1, -7, 123456]), min_size=1, max_size=32),
    st.sampled_from(["", "windows", "bits"]),
    st.booleans(),
)
def test_packed_records_unpack_to_what_was_packed(numbers, packed, real):
    content = np.array(numbers, dtype=float if real else int)
    words = np.frombuffer(record(content, packed=packed), "<i4")
    file = Records(Path("a.rst"), words)
    read = (file.reals if real else file.integers)(0, 32, "numbers")
    np.testing.assert_array_equal(read, content)


# --- spoilt files


def test_files_cut_anywhere_are_refused(tmp_path):
    mass, stiffness = small_model()
    path = tmp_path / "file.full"
    whole = full_file(mass, stiffness, [1, 2, 3])
    for length in (*range(0, 60, 4), *range(60, len(whole) - 4, 76)):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match=r"file\.full"):
            read_ansys_full(path)
    path = tmp_path / "file.rst"
    whole = result_file([1.0, 2.0], np.ones((2, 2, 3)), {1: (0, 0, 0), 2: (1, 1, 1)})
    for length in (*range(0, 60, 4), *range(60, len(whole) - 4, 76)):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match=r"file\.rst"):
            read_ansys_results(path)


@given(st.integers(0, 10**6), st.sampled_from([-1, 0, 1, 7, 255, 2**31 - 1, -(2**31)]))
def test_spoilt_words_never_do_more_than_raise(tmp_path_factory, place, word):
    folder = tmp_path_factory.mktemp("spoilt")
    mass, stiffness = small_model()
    whole = {
        "file.full": full_file(mass, stiffness, [1, 2, 3], packed="windows"),
        "file.rst": result_file([1.0, 2.0], np.ones((2, 2, 3)), {1: (0, 0, 0), 2: (1, 1, 1)}),
    }
    for name, read in (("file.full", read_ansys_full), ("file.rst", read_ansys_results)):
        words = np.frombuffer(whole[name], "<i4").copy()
        words[place % len(words)] = word
        (folder / name).write_bytes(words.tobytes())
        try:
            read(folder / name)
        except InputError as error:
            assert name in str(error)  # noqa: PT017  # a spoilt number may also be a valid one


def test_nodes_of_results_that_the_geometry_lacks_are_named(tmp_path):
    whole = result_file([1.0], np.ones((1, 2, 3)), {1: (0, 0, 0), 2: (1, 1, 1)})
    spoilt = whole.replace(record(np.array([1, 2])), record(np.array([1, 7])))
    assert spoilt != whole
    (tmp_path / "a.rst").write_bytes(spoilt)
    with pytest.raises(InputError, match=r"has 1 nodes that the file of nodes lacks, e\.g\. 7"):
        read_ansys_results(tmp_path / "a.rst")


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({10: 1}, r"lumped mass matrix\. Run again after LUMPM,OFF"),
        ({13: 1}, r"unsymmetric matrices\. Turn gyroscopic"),
        ({20: 12}, r"12 constraint equations.*Remove CE, CP"),
        ({0: 4}, r"frontal solver"),
        ({62: 1}, r"one part of a distributed analysis.*COMBINE,FULL"),
        ({33: 0}, r"lacks the mass or the stiffness"),
        ({1: 10**9}, r"tells of 1000000000 equations"),
        ({8: 2}, r"stiffness matrix: has 9 terms or more, should have 2"),
    ],
)
def test_full_files_that_are_no_structure_are_refused(tmp_path, header, message):
    mass, stiffness = small_model()
    (tmp_path / "file.full").write_bytes(full_file(mass, stiffness, [1, 2, 3], header=header))
    with pytest.raises(InputError, match=message):
        read_ansys_full(tmp_path / "file.full")


def test_other_fields_are_refused(tmp_path):
    mass, stiffness = small_model()
    (tmp_path / "a.full").write_bytes(full_file(mass, stiffness, [1, 2, 3], kinds=(1, 2, 20)))
    with pytest.raises(InputError, match=r"of the kinds \[20\].*displacements and rotations"):
        read_ansys_full(tmp_path / "a.full")


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({7: 0}, "holds a static analysis, not a modal one"),
        ({48: 9}, "holds 2 of the model's 9 nodes, one part of a distributed analysis"),
    ],
)
def test_results_of_other_analyses_are_refused(tmp_path, header, message):
    nodes = {1: (0, 0, 0), 2: (1, 1, 1)}
    (tmp_path / "a.rst").write_bytes(result_file([1.0], np.ones((1, 2, 3)), nodes, header=header))
    with pytest.raises(InputError, match=message):
        read_ansys_results(tmp_path / "a.rst")


def test_files_of_another_kind_are_named(tmp_path):
    mass, stiffness = small_model()
    whole = full_file(mass, stiffness, [1, 2, 3])
    (tmp_path / "a.rst").write_bytes(whole)
    with pytest.raises(InputError, match=r"is a file of kind 4 \(\.full\), not \.rst"):
        read_ansys_results(tmp_path / "a.rst")
    (tmp_path / "b.full").write_bytes(np.frombuffer(whole, "<i4").byteswap().tobytes())
    with pytest.raises(InputError, match="byte order of a big-endian machine"):
        read_ansys_full(tmp_path / "b.full")
    (tmp_path / "c.full").write_text(ARCHIVE * 5)
    with pytest.raises(InputError, match=r"no binary file of ANSYS.*read_ansys_archive for \.cdb"):
        read_ansys_full(tmp_path / "c.full")
    with pytest.raises(InputError, match=r"there is no such file\. Did you mean 'b\.full'\?"):
        read_ansys_full(tmp_path / "bb.full")


@pytest.mark.parametrize(("flag", "message"), [(ZLIB, "packed with zlib"), (HALF, "numbers, at most")])
def test_records_packed_otherwise(flag, message):
    words = np.frombuffer(record(np.arange(8)), "<u4").copy()
    words[1] |= flag
    with pytest.raises(InputError, match=message):
        Records(Path("a.full"), words.view("<i4")).integers(0, 8, "numbers")


# --- archives written here

BRICKS = """ET,1,185
NBLOCK,6,SOLID,         8,         8
(3i9,6e21.13e3)
{nodes}N,R5.3,LOC,       -1,
EBLOCK,19,SOLID,         1,         1
(19i9)
        3        1        1        1        0        0        0        0        8        0        9{cell}
       -1
MPDATA,R5.0, 1,EX  ,       3, 1, 2.1E+05,
MPDATA,R5.0, 1,PRXY,       3, 1, 0.3,
MP,DENS,3,7.85E-9
MPDATA,R5.0, 1,EX  ,       4, 1, 2.1E+05,
"""


def cube(cell=(10, 20, 30, 40, 50, 60, 70, 80)):
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    nodes = "".join(
        f"{10 * (i + 1):9d}{0:9d}{0:9d}" + "".join(f"{c * 10.0:21.13E}" for c in corner) + "\n"
        for i, corner in enumerate(corners)
    )
    return BRICKS.format(nodes=nodes, cell="".join(f"{n:9d}" for n in cell))


def test_archive_written_here(tmp_path):
    path = tmp_path / "cube.cdb"
    path.write_text(cube())
    units = Units.mm_t_s()
    mesh = read_ansys_archive(path, units=units)
    assert mesh.cells.tolist() == [list(range(8))]
    assert mesh.numbers.tolist() == list(range(10, 90, 10))
    assert mesh.cell_numbers.tolist() == [9]
    materials = read_ansys_materials(path, units=units)
    assert list(materials) == [3]  # material 4 has no density
    structure = assemble_solid(mesh, materials[3], clamped=())
    assert structure.mass.sum() / 3 == pytest.approx(7850e-6)  # a cubic centimetre of steel
    with pytest.raises(InputError, match=r"material 3.*7.85e-09 kg.*mm-t-s"):
        read_ansys_materials(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("ET,1,185", "ET,1,181", r"elements of the types \[181\].*SOLID185, 186 and 187"),
        ("ET,1,185", "ET,1,200", "no elements SOLID185"),
        ("ET,1,185", "ET,1,186", r"element 9, SOLID186: has 8 nodes, regular are 20.*EMID,ADD"),
        ("ET,1,185", "ET,1,1O5", r"line 1: '1O5' is no whole number"),
        ("NBLOCK", "NBLOK", "no block of nodes"),
        ("(3i9,6e21.13e3)", "(3i9 6e21)", r"line 3: '\(3i9 6e21\)' is no format"),
        ("         8,         8\n(3i9", "         8,         9\n(3i9", "block of nodes ends after 8 of 9"),
        ("0.0000000000000E+00", "0.00000o0000000E+00", r"line 4: .* does not hold numbers only"),
        ("EBLOCK,19,SOLID", "EBLOCK,19,", "without the word SOLID"),
        ("       80\n", "\n", "an element has 7 of its 8 nodes"),
        ("       -1\nMP", "MP", "has no end"),
        ("       80\n", "       70\n", "element 9, SOLID185: has repeated nodes that make it no wedge"),
        ("       80\n", "       81\n", "has elements at node 81, which is not there"),
    ],
)
def test_spoilt_archives_name_the_place(tmp_path, old, new, message):
    text = cube()
    assert old in text
    (tmp_path / "cube.cdb").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_ansys_archive(tmp_path / "cube.cdb")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("MPDATA,R5.0, 1,EY  ,       3, 1, 1.1E+05,", "material 3: MPDATA: is orthotropic and lacks EZ, GXY"),
        ("MPDATA,R5.0, 2,EX  ,       3, 1, 1.1E+05, 1.0E+05,", "EX depends on temperature"),
        ("MP,EX,3,much", "'much' is no number"),
    ],
)
def test_materials_that_are_not_read_are_refused(tmp_path, line, message):
    (tmp_path / "cube.cdb").write_text(cube() + line + "\n")
    with pytest.raises(InputError, match=message):
        read_ansys_materials(tmp_path / "cube.cdb", units=Units.mm_t_s())


def test_component_with_a_wild_range_is_refused(tmp_path):
    text = ARCHIVE.replace("        -7", "-999999999")
    (tmp_path / "a.cdb").write_text(text)
    with pytest.raises(InputError, match="range that ends at -999999999"):
        read_ansys_archive(tmp_path / "a.cdb")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("KEYOP,       1, 2,       3", r"line \d+: KEYOPT\(2\) = 3 of SOLID185: another integration than full"),
        ("KEYOPT,1,2,1", r"KEYOPT\(2\) = 1 of SOLID185"),
        ("keyo,1,6,1", r"KEYOPT\(6\) = 1 of SOLID185: a pressure of its own"),
        ("ET,1,185,,2", r"KEYOPT\(2\) = 2 of SOLID185"),
        ("KEYOPT,1,15,1", r"KEYOPT\(15\) = 1 of SOLID185: what is not read"),
    ],
)
def test_options_that_make_a_brick_another_are_refused(tmp_path, line, message):
    (tmp_path / "cube.cdb").write_text(f"{cube()}\n{line}\n")
    with pytest.raises(InputError, match=message):
        read_ansys_archive(tmp_path / "cube.cdb")


@pytest.mark.parametrize("line", ["KEYOP,1,2,0", "KEYOP,1,5,1", "KEYOPT,7,2,3", "KEYOPT,1,2"])
def test_options_that_change_nothing_are_passed_over(tmp_path, line):
    (tmp_path / "cube.cdb").write_text(f"{cube()}\n{line}\n")
    assert len(read_ansys_archive(tmp_path / "cube.cdb").cells) == 1


def test_what_an_archive_says_and_a_study_has_to_say_is_told(tmp_path):
    path = tmp_path / "cube.cdb"
    path.write_text(cube() + "\nD,10,UX,0\nD,10,UY,0\nDMPRAT, 0.\nBETAD, 1e-6\nTB,BISO,1\n")
    lines = path.read_text().splitlines()
    supports, damping = ansys_passed_over(path)
    assert (
        supports
        == f"2 commands D (from line {lines.index('D,10,UX,0') + 1} on), supports: name sets of nodes that are clamped"
    )
    assert damping.startswith("1 commands BETAD (from line ")
    path.write_text(cube() + "\nTB,HYPER,3\n")
    with pytest.raises(InputError, match=r"line \d+: gives a material by a table \(TB,HYPER\)"):
        ansys_passed_over(path)
    path.write_text(cube())
    assert ansys_passed_over(path) == ()


def in_format(text: str, given: str, widths: tuple[int, ...], real: int, digits: int) -> str:
    """Return an archive with its block of nodes in another format."""
    head, _, body = text.partition("(3i9,6e21.13e3)\n")
    rows, end = [], body.index("N,R5.3")
    for line in body[:end].splitlines():
        whole = [line[9 * i : 9 * i + 9] for i in range(3)]
        numbers = [line[27 + 21 * i : 48 + 21 * i] for i in range(3)]
        row = "".join(f"{int(n):{w}d}" for n, w in zip(whole, widths, strict=False))
        rows.append(row + "".join(f"{float(x or 0):{real}.{digits}E}" for x in numbers))
    return f"{head}{given}\n" + "\n".join(rows) + "\n" + body[end:]


@pytest.mark.parametrize(
    ("given", "widths", "real", "digits"),
    [
        ("(3i7,6e22.13)", (7, 7, 7), 22, 13),
        ("(1i7,2i9,6e21.13)", (7, 9, 9), 21, 13),
        ("(1i9,2i9,6e21.13)", (9, 9, 9), 21, 13),
        ("(2i9,6e21.13)", (9, 9), 21, 13),
        ("(1i9,3e20.9e3)", (9,), 20, 9),
        ("(3i8,6e16.9)", (8, 8, 8), 16, 9),
    ],
)
def test_nodes_in_the_formats_of_other_versions(tmp_path, given, widths, real, digits):
    whole, other = tmp_path / "whole.cdb", tmp_path / "other.cdb"
    whole.write_text(cube())
    other.write_text(in_format(cube(), given, widths, real, digits))
    np.testing.assert_array_equal(read_ansys_archive(other).points, read_ansys_archive(whole).points)
