"""Matrices of Abaqus and of neutral files, and the one call that opens any of them."""

import contextlib
import gzip
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip import InputError, Structure, Units, read_model
from stickslip.model import (
    assemble_deck,
    model_summary,
    natural_frequencies,
    read_abaqus_matrices,
    read_deck,
    read_matrix_files,
    save_structure,
)
from stickslip.model.readers.abaqus import read_coordinate_matrix
from stickslip.model.readers.matrix_files import read_matrix_market
from stickslip.model.readers.node_table import NodeTable

DATA = Path(__file__).parent / "data" / "calculix"
MM = Units.mm_t_s()


def brick() -> Structure:
    """Two 20-node bricks as they stand in the deck, in SI."""
    return assemble_deck(read_deck(DATA / "brick_matrix.inp", units=MM))


def in_mm(structure: Structure) -> tuple[scipy.sparse.coo_array, scipy.sparse.coo_array]:
    """Mass in t, stiffness in N/mm."""
    return scipy.sparse.coo_array(structure.mass / 1e3), scipy.sparse.coo_array(structure.stiffness / 1e3)


# ---- Abaqus: no file of the real solver was at hand; these are written as its manual describes


def write_abaqus(path, matrix, dofs, triangle, separator=","):
    """Write ``row node, row dof, column node, column dof, value`` as ``*MATRIX INPUT`` takes it."""
    direction = ["xyz".index(c) + 1 for c in dofs.component]
    lines = ["** ", "** MATRIX INPUT", "*MATRIX INPUT, NAME=K, TYPE=SYMMETRIC"]
    for r, c, v in zip(*matrix.coords, matrix.data, strict=True):
        if (triangle == "lower" and c > r) or (triangle == "upper" and c < r):
            continue
        fields = [dofs.node[r], direction[r], dofs.node[c], direction[c]]
        lines.append(separator.join([*(f"{f:6d}" for f in fields), f" {v:.16e}"]))
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("triangle", ["lower", "upper", "both"])
def test_abaqus_matrices(tmp_path, triangle):
    structure = brick()
    mass, stiffness = in_mm(structure)
    write_abaqus(tmp_path / "job_STIF1.mtx", stiffness, structure.dofs, triangle)
    write_abaqus(tmp_path / "job_MASS1.mtx", mass, structure.dofs, "lower")
    found = read_abaqus_matrices(
        tmp_path / "job_STIF1.mtx", tmp_path / "job_MASS1.mtx", nodes=DATA / "brick_matrix.inp", units=MM
    )
    np.testing.assert_array_equal(found.dofs.node, structure.dofs.node)
    np.testing.assert_allclose(found.stiffness.toarray(), structure.stiffness.toarray(), rtol=1e-13)
    np.testing.assert_allclose(found.mass.toarray(), structure.mass.toarray(), rtol=1e-13)
    np.testing.assert_allclose(found.dofs.position, structure.dofs.position, atol=1e-12)
    assert set(found.sets) == {"NALL", "TIP"}
    opened = read_model(tmp_path / "job_STIF1.mtx", nodes=DATA / "brick_matrix.inp", units=MM)
    assert isinstance(opened, Structure)
    assert (opened.stiffness - found.stiffness).nnz == 0


def small_abaqus(tmp_path, stiffness, mass="1,1,1,1,1.0\n1,2,1,2,1.0\n7,1,7,1,2.0\n"):
    """Two nodes: node 1 moves along x and y, node 7 along x."""
    (tmp_path / "K.mtx").write_text(stiffness)
    (tmp_path / "M.mtx").write_text(mass)
    (tmp_path / "nodes.csv").write_text("node,x,y,z\n7,1,0,0\n1,0,0,0\n")
    return read_abaqus_matrices(tmp_path / "K.mtx", tmp_path / "M.mtx", nodes=tmp_path / "nodes.csv", plausible=False)


STIFF = "1,1,1,1,3.0\n1,2,1,2,1.0\n7,1,1,1,-2.0\n7,1,7,1,2.0\n"


def test_abaqus_by_hand(tmp_path):
    """``[[3, 0, -2], [0, 1, 0], [-2, 0, 2]]`` and ``diag(1, 1, 2)``, written from paper."""
    structure = small_abaqus(tmp_path, STIFF)
    assert structure.dofs.labels == ("node1.x", "node1.y", "node7.x")
    np.testing.assert_array_equal(structure.stiffness.toarray(), [[3, 0, -2], [0, 1, 0], [-2, 0, 2]])
    np.testing.assert_array_equal(structure.mass.toarray(), np.diag([1, 1, 2]))
    held = small_abaqus(tmp_path, STIFF.replace("1,2,1,2,1.0", "1,2,1,2,1.0e+36"))
    assert held.dofs.labels == ("node1.x", "node7.x")
    np.testing.assert_array_equal(held.stiffness.toarray(), [[3, -2], [-2, 2]])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("7,1,1,1,-2.0", "-7,1,1,1,-2.0", r"entry 3: names the internal node -7"),
        ("7,1,1,1,-2.0", "7,8,1,1,-2.0", r"entry 3: names the directions 8 and 1"),
        ("7,1,1,1,-2.0", "7,1,1,-2.0", r"line 3: needs 5 numbers, got 4"),
        ("7,1,1,1,-2.0", "7,1,1,1,-2.0\n1,1,7,1,-2.5", "is not symmetric: row 1, column 3"),
        ("7,1,1,1,-2.0", "7,1,1,1,-2.0\n7,1,1,1,-2.0", "row 3, column 1 more than once"),
        ("7,1,1,1,-2.0", "8,1,1,1,-2.0\n8,1,8,1,1.", r"lacks 1 nodes, e\.g\. 8"),
        ("7,1,7,1,2.0", "7,1,7,1,2.0e999", "no finite number"),
        (STIFF, "** nothing\n", "holds no entries"),
    ],
)
def test_damaged_abaqus_files_are_named(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        small_abaqus(tmp_path, STIFF.replace(old, new))


def test_abaqus_coordinate_format(tmp_path):
    (tmp_path / "K.mtx").write_text("1 1 3.0\n2 2 1.0\n3 1 -2.0\n3 3 2.0\n")
    found = read_coordinate_matrix(tmp_path / "K.mtx").toarray()
    np.testing.assert_array_equal(found, [[3, 0, -2], [0, 1, 0], [-2, 0, 2]])
    (tmp_path / "K.mtx").write_text("1 1 3.0\n900000000000 1 -2.0\n")
    with pytest.raises(InputError, match="900000000000 equations, but has 2 entries"):
        read_coordinate_matrix(tmp_path / "K.mtx")
    (tmp_path / "K.mtx").write_text("0 1 3.0\n")
    with pytest.raises(InputError, match="counted from 1"):
        read_coordinate_matrix(tmp_path / "K.mtx")


# ---- neutral files


def write_table(path, structure, units=MM):
    tip = set(structure.sets["TIP"].tolist())
    rows = ["node,component,x,y,z,set"]
    for i, (n, c, p) in enumerate(
        zip(structure.dofs.node, structure.dofs.component, structure.dofs.position, strict=True)
    ):
        x, y, z = p / units.length
        name = "TIP" if i in tip else ""
        rows.append(f"{n},{c},{float(x)!r},{float(y)!r},{float(z)!r},{name}")
    path.write_text("\n".join(rows) + "\n")
    return path


def write_matrix(path, matrix, name):
    kind = "".join(path.suffixes)
    if kind.startswith(".mtx"):
        scipy.io.mmwrite(str(path.with_suffix("")) if kind.endswith("gz") else str(path), matrix, symmetry="symmetric")
        if kind.endswith("gz"):
            plain = path.with_suffix("")
            path.write_bytes(gzip.compress(plain.read_bytes()))
    elif kind == ".npz":
        scipy.sparse.save_npz(path, scipy.sparse.csc_array(matrix))
    else:
        import h5py

        csr = scipy.sparse.csr_array(matrix)
        with h5py.File(path, "a") as file:
            group = file.create_group(name)
            for key in ("data", "indices", "indptr"):
                group.create_dataset(key, data=getattr(csr, key), compression="gzip")
            group["shape"] = np.array(csr.shape)
    return path


@pytest.mark.parametrize("kind", ["mtx", "mtx.gz", "npz", "h5"])
def test_neutral_files(tmp_path, kind):
    structure = brick()
    mass, stiffness = in_mm(structure)
    table = write_table(tmp_path / "dofs.csv", structure)
    K = write_matrix(tmp_path / f"K.{kind}", stiffness, "stiffness")
    M = write_matrix(tmp_path / f"M.{kind}", mass, "mass")
    found = read_matrix_files(K, M, nodes=table, units=MM)
    np.testing.assert_allclose(found.stiffness.toarray(), structure.stiffness.toarray(), rtol=1e-14, atol=1e-3)
    np.testing.assert_allclose(found.mass.toarray(), structure.mass.toarray(), rtol=1e-14, atol=1e-18)
    np.testing.assert_allclose(found.dofs.position, structure.dofs.position, atol=1e-15)
    assert found.dofs.labels == structure.dofs.labels
    np.testing.assert_array_equal(found.sets["TIP"], np.sort(structure.sets["TIP"]))
    opened = read_model(K, mass=M, nodes=table, units=MM)
    np.testing.assert_allclose(natural_frequencies(opened, 3), natural_frequencies(structure, 3))


def test_all_in_one_hdf5_file_and_dense(tmp_path):
    h5py = pytest.importorskip("h5py")
    structure = brick()
    mass, stiffness = in_mm(structure)
    table = write_table(tmp_path / "dofs.csv", structure)
    with h5py.File(tmp_path / "model.h5", "w") as file:
        file["stiffness"], file["mass"] = stiffness.toarray(), mass.toarray()
        file["damping"] = 1e-5 * stiffness.toarray()
    path = tmp_path / "model.h5"
    found = read_matrix_files(path, path, damping=path, nodes=table, units=MM)
    np.testing.assert_allclose(found.damping, 1e-5 * structure.stiffness.toarray(), rtol=1e-12, atol=1e-3)
    assert isinstance(read_model(path, nodes=table, units=MM), Structure)
    with h5py.File(path, "a") as file:
        del file["mass"]
        file["mass"] = h5py.ExternalLink("other.h5", "mass")
    with pytest.raises(InputError, match="holds no mass"):
        read_matrix_files(path, path, nodes=table, units=MM)
    with h5py.File(path, "a") as file:
        del file["mass"]
        file.create_dataset("mass", shape=(10**7, 10**7), dtype="f8", chunks=(10, 10))
    with pytest.raises(InputError, match="more than it can hold"):
        read_matrix_files(path, path, nodes=table, units=MM)


TABLE = "node,component,x,y,z\n1,x,0,0,0\n1,ry,0,0,0\n-1,mode,,,\n"


def two_by_two(
    tmp_path, text="%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n1 1 1.0\n2 2 1.0\n3 3 1.0\n", table=TABLE
):
    (tmp_path / "M.mtx").write_text(
        "%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n1 1 1.0\n2 2 1.0\n3 3 1.0\n"
    )
    (tmp_path / "K.mtx").write_text(text)
    (tmp_path / "dofs.csv").write_text(table)
    return read_matrix_files(tmp_path / "K.mtx", tmp_path / "M.mtx", nodes=tmp_path / "dofs.csv", plausible=False)


def test_modal_dofs_need_no_position(tmp_path):
    structure = two_by_two(tmp_path)
    assert structure.dofs.labels == ("node1.x", "node1.ry", "mode")
    assert np.isnan(structure.dofs.position[2]).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("3 3 3\n", "line 1: is no Matrix Market"),
        (
            "%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n1 1 1.0\n2 2 1.0\n",
            "has 2 entries, its header says 3",
        ),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 1000000000000\n1 1 1.0\n", "header says 1000000000000"),
        ("%%MatrixMarket matrix coordinate real symmetric\n900000000 900000000 1\n1 1 1.0\n", "900000000 x 900000000"),
        ("%%MatrixMarket matrix coordinate real symmetric\n%\n\n3 3 1\n1 1 a\n", r"line 5: 'a' is no finite number"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 1\n4 1 1.0\n", "row 4, column 1 is outside"),
        (
            "%%MatrixMarket matrix coordinate real general\n3 3 2\n1 1 1.0\n1 2 1.0\n",
            "is not symmetric: row 1, column 2",
        ),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 2\n1 1 1.0\n1 1 1.0\n", "more than once"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 2\n1 2 1.0\n2 1 1.0\n", "both sides of the diagonal"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 1\n1 1 nan\n", "'nan' is no finite number"),
        ("%%MatrixMarket matrix coordinate pattern symmetric\n3 3 1\n1 1\n", "no Matrix Market matrix of numbers"),
        ("%%MatrixMarket matrix array real general\n2 2\n1\n0\n0\n1\n", "is of 2 x 2, the model has 3 dofs"),
        ("%%MatrixMarket matrix coordinate real symmetric", r"line 2: needs 3 counts, got ''"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3\n", r"line 2: needs 3 counts, got '3 3'"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 1 1\n", r"line 2: needs 3 counts, got '3 3 1 1'"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 -1\n", r"line 2: needs 3 counts, got '3 3 -1'"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 a\n", r"line 2: needs 3 counts, got '3 3 a'"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 -3 1\n1 1 1.0\n", r"line 2: needs 3 counts, got '3 -3 1'"),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 3 0\n1 1 1.0\n", "has 1 entries, its header says 0"),
        ("%%MatrixMarket matrix array real general\n3 3 9\n", r"line 2: needs 2 counts, got '3 3 9'"),
        ("%%MatrixMarket matrix array real general\n3\n", r"line 2: needs 2 counts, got '3'"),
    ],
)
def test_damaged_matrix_market_files_are_named(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        two_by_two(tmp_path, text)


@pytest.mark.parametrize("symmetry", ["general", "symmetric", "hermitian", "skew-symmetric"])
@pytest.mark.parametrize("sparse", [True, False])
@pytest.mark.parametrize("dtype", [float, complex, int])
def test_matrix_market_as_scipy_writes_it(tmp_path, symmetry, sparse, dtype):
    rng = np.random.default_rng(5)
    A = rng.integers(-9, 9, (4, 4)) * (1 + (0.5j if dtype is complex else 0))
    A = {"general": A, "symmetric": A + A.T, "hermitian": A + A.conj().T, "skew-symmetric": A - A.T}[symmetry].astype(
        dtype
    )
    A[abs(A) < 2] = 0
    path = tmp_path / "A.mtx"
    stored = "symmetric" if symmetry == "hermitian" and dtype is not complex else symmetry
    scipy.io.mmwrite(str(path), scipy.sparse.coo_array(A) if sparse else A, symmetry=stored)
    found = read_matrix_market(path, 4)
    assert scipy.sparse.issparse(found) == sparse
    np.testing.assert_array_equal(found.toarray() if sparse else found, A)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("component", "kind", r"has no column 'component'"),
        ("1,ry,0,0,0", "1,u,0,0,0", r"line 3: component 'u'"),
        ("1,ry,0,0,0", "1,x,0,0,0", "lists node 1, x twice"),
        ("1,ry,0,0,0", "1,ry,0,0", "line 3: has 4 fields, the header 5"),
        ("1,ry,0,0,0", "1,ry,0,0,a", "column 'z' holds 'a'"),
        ("1,ry,0,0,0", "1.5,ry,0,0,0", "the node 1.5 is no whole number"),
        (TABLE, "", "is empty"),
    ],
)
def test_damaged_tables_are_named(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        two_by_two(tmp_path, table=TABLE.replace(old, new))


def test_npz_with_odd_arrays(tmp_path):
    two_by_two(tmp_path)
    K = tmp_path / "K.npz"

    def read():
        return read_matrix_files(K, tmp_path / "M.mtx", nodes=tmp_path / "dofs.csv", plausible=False)

    np.savez(K, np.eye(3))
    assert read().n == 3
    for arrays, message in (
        ({"a": np.eye(3), "b": np.eye(3)}, "holds no stiffness, but a, b"),
        ({"stiffness": np.array(["a"])}, "no matrix of numbers"),
        (
            {
                "format": "csr",
                "data": np.ones(1),
                "indices": np.zeros(1, int),
                "indptr": np.array([0, 1, 1, 9]),
                "shape": np.array([3, 3]),
            },
            "do not fit together",
        ),
        (
            {
                "format": "coo",
                "data": np.ones(1),
                "row": np.array([7]),
                "col": np.array([0]),
                "shape": np.array([3, 3]),
            },
            "do not fit together",
        ),
        (
            {
                "format": "coo",
                "data": np.ones(1),
                "row": np.array([0]),
                "col": np.array([0]),
                "shape": np.array([3, 10**12]),
            },
            "is of 3 x 1000000000000",
        ),
        (
            {
                "format": "coo",
                "data": np.ones(1),
                "row": np.array([0.5]),
                "col": np.array([0]),
                "shape": np.array([3, 3]),
            },
            "no integers",
        ),
    ):
        np.savez(K, **arrays)
        with pytest.raises(InputError, match=message):
            read()


@settings(max_examples=60)
@given(data=st.data())
def test_garbled_neutral_files_are_named_or_read(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("garble")
    kind = data.draw(st.sampled_from(["mtx", "npz", "h5", "csv"]))
    two_by_two(folder)
    path = folder / f"K.{kind}"
    if kind == "csv":
        path = folder / "dofs.csv"
    elif kind != "mtx":
        write_matrix(path, scipy.sparse.eye_array(3), "stiffness")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(bytes(content[: data.draw(st.integers(0, len(content)))]))
    matrix = folder / "K.mtx" if kind == "csv" else path
    with contextlib.suppress(InputError):  # any other error fails the test
        read_matrix_files(matrix, folder / "M.mtx", nodes=folder / "dofs.csv", plausible=False)


# ---- opening and inspecting


def test_open_structure_files(tmp_path):
    save_structure(brick(), tmp_path / "brick.npz")
    found = read_model(tmp_path / "brick.npz")
    summary = model_summary(found, n_modes=3)
    volume = 10 * 10 * 21 / 1e9  # of the box, about
    assert summary.mass == pytest.approx([7850 * volume] * 3, rel=0.2)
    assert summary.symmetric
    assert summary.rigid_modes == 0
    assert summary.dofs == 72
    assert summary.sets["TIP"] == 24
    assert len(summary.frequencies_hz) == 3
    assert ("dofs", "72") in summary.rows()
    assert summary.remarks == ()


def test_summary_of_a_free_body(tmp_path):
    """Unheld: six rigid modes, the exact mass and the exact centre."""
    text = (DATA / "brick_matrix.inp").read_text().split("*BOUNDARY")[0]
    (tmp_path / "free.inp").write_text(text)
    deck = read_model(tmp_path / "free.inp", units=MM)
    summary = model_summary(deck, units=MM)
    assert summary.rigid_modes == 6
    # a cube of 10 mm, and one whose corner (20, 10, 10) was moved by (1, 1, 0.5): of its trilinear map by hand
    corners = deck.mesh.points[deck.mesh.cells[:, :8]]
    volumes, moments = zip(*(volume_and_moment(c) for c in corners), strict=True)
    np.testing.assert_allclose(summary.mass, 7850 * sum(volumes), rtol=1e-12)
    np.testing.assert_allclose(summary.centre, sum(moments) / sum(volumes), rtol=1e-12)
    np.testing.assert_allclose(summary.box, [[0, 0, 0], [0.021, 0.011, 0.0105]], atol=1e-15)
    assert any("not held" in text for text in summary.remarks)


def volume_and_moment(corners):
    """Integrate 1 and x over a trilinear hexahedron with 3 Gauss points a direction."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    signs = np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
    )
    volume, moment = 0.0, np.zeros(3)
    for i, a in enumerate(nodes):
        for j, b in enumerate(nodes):
            for k, c in enumerate(nodes):
                one = 1 + signs * np.array([a, b, c])
                shape = one.prod(axis=1) / 8
                slope = np.column_stack([signs[:, m] * np.delete(one, m, axis=1).prod(axis=1) / 8 for m in range(3)])
                weight = weights[i] * weights[j] * weights[k] * np.linalg.det(corners.T @ slope)
                volume += weight
                moment += weight * (shape @ corners)
    return volume, moment


def test_summary_doubts_units():
    structure = read_model(DATA / "brick_matrix.sti.gz", plausible=False)
    assert any("looks like mm-t-s" in text for text in model_summary(structure).remarks)


def test_summary_of_results_and_waves():
    results = read_model(DATA / "brick.frd.gz", units=MM)
    summary = model_summary(results)
    assert summary.nodes == 32
    assert summary.frequencies_hz[0] == pytest.approx(18243.46074)
    assert summary.cells == 2
    assert summary.remarks == ("field DISP at 6 steps",)
    ring = model_summary(read_model(DATA / "ring_modes.frd.gz", units=MM))
    assert len(ring.frequencies_hz) == 14
    assert ring.remarks[-1].endswith("modes: 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6")
    wave = model_summary(read_model(DATA / "ring2.sti.gz", units=MM), units=MM)
    assert wave.mass is None
    assert wave.symmetric
    assert any("travelling wave" in text for text in wave.remarks)


def test_unsymmetric_matrices_are_told(tmp_path):
    structure = brick()
    tilted = structure.stiffness.tolil()
    tilted[0, 5] += 1e9
    unsymmetric = Structure(structure.mass, structure.damping, tilted.tocsr(), structure.dofs)
    summary = model_summary(unsymmetric)
    assert not summary.symmetric
    assert summary.frequencies_hz is None


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("job.xyz", r"no reader for files '\.xyz'.*\.inp"),
        ("job", "a file without suffix"),
        ("job.op4", "read_nastran_op4"),
        (
            "wing.bdf",
            r"wing\.bdf: line 3: CHEXA: a model of Nastran's bulk data is not read, this one of CHEXA, CONM2, RBE2",
        ),
        ("dmig.bdf", "read_nastran_dmig"),
        ("job.inp", "no such file"),
        ("K.mtx", r"is one matrix, not a whole model. Give mass="),
        ("A_STIF1.mtx", r"is one matrix, not a whole model. Give mass="),
        ("K.npz", "holds the arrays arr_0, and no stiffness"),
    ],
)
def test_what_cannot_be_opened_is_asked_for(tmp_path, name, message):
    two_by_two(tmp_path)
    (tmp_path / "A_STIF1.mtx").write_text(STIFF)
    bulk = "BEGIN BULK\nGRID,1,,0.,0.,0.\nCHEXA,1,1,1,2,3,4,5,6\n,7,8\nCONM2*  50\nRBE2,60,9,123456,5\nENDDATA\n"
    (tmp_path / "wing.bdf").write_text(bulk)
    (tmp_path / "dmig.bdf").write_text("BEGIN BULK\nGRID,1,,0.,0.,0.\nDMIG,K2GG,0,6,1,0\nENDDATA\n")
    np.savez(tmp_path / "K.npz", np.eye(3))
    with pytest.raises(InputError, match=message):
        read_model(tmp_path / name)


def test_the_dofs_of_nodes_are_wide_whatever_a_file_has():
    """Readers of binary files have numbers of 32 bits and positions in whole millimetres."""
    table = NodeTable(np.array([3, 7], dtype=np.int32), np.array([[1, 2, 3], [4, 5, 6]]), {}, "a.inp")
    dofs = table.dofs(np.array([7, 7, 3], dtype=np.int32), ("x", "y", "x"))
    assert (dofs.node.dtype, dofs.position.dtype) == (np.int64, np.float64)
    np.testing.assert_array_equal(dofs.position, [[4, 5, 6], [4, 5, 6], [1, 2, 3]])
