"""Bricks of ANSYS archives with repeated nodes: wedges, pyramids and tetrahedra, and element types in a block."""

import itertools

import numpy as np
import pytest
from solid_models import box
from test_element_kinds import mesh_of

import stickslip as ss
from stickslip.errors import InputError
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.mesh.solid_mesh import SolidMesh, by_kind
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.ansys_archive import read_ansys_archive, regular_nodes

STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)
# shapes of SOLID185 in the words of ANSYS: I, J, K, L, M, N, O, P
SHAPES = {
    6: "0 1 2 2 4 5 6 6",
    5: "0 1 2 3 4 4 4 4",
    4: "0 1 2 2 4 4 4 4",
    8: "0 1 2 3 4 5 6 7",
}
# mid-side nodes of SOLID186 (Q to B) among the nodes of the regular cell
MIDDLES = {
    15: [*(0, 1, 2, 2, 3, 4, 5, 5), *(6, 7, 2, 8), *(9, 10, 5, 11), *(12, 13, 14, 14)],
    13: [*(0, 1, 2, 3, 4, 4, 4, 4), *(5, 6, 7, 8), *(4, 4, 4, 4), *(9, 10, 11, 12)],
    10: [*(0, 1, 2, 2, 3, 3, 3, 3), *(4, 5, 2, 6), *(3, 3, 3, 3), *(7, 8, 9, 9)],
    20: list(range(20)),
    6: [0, 1, 2, 2, 3, 4, 5, 5],
    5: [0, 1, 2, 3, 4, 4, 4, 4],
    4: [0, 1, 2, 2, 3, 3, 3, 3],
    8: list(range(8)),
}


def turns():
    """The 24 numberings of a brick's corners after turns."""
    for axes in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), axes] = signs
            if np.linalg.det(turn) > 0:
                moved = (CUBE - 0.5) @ turn.T + 0.5
                yield [int(np.abs(CUBE - place).sum(axis=1).argmin()) for place in moved]


def collapsed_mass(points, nodes):
    """Mass matrix of a brick with repeated nodes by 5 Gauss points a direction, summed on its distinct nodes."""
    x, w = np.polynomial.legendre.leggauss(5)
    found = np.zeros((len(points), len(points)))
    cube = 2 * CUBE - 1
    for i, j, k in itertools.product(range(5), repeat=3):
        factors = 1 + cube * [x[i], x[j], x[k]]
        values = np.prod(factors, axis=1) / 8
        slopes = np.stack([cube[:, a] * np.prod(np.delete(factors, a, axis=1), axis=1) / 8 for a in range(3)], axis=1)
        volume = np.linalg.det(points[nodes].T @ slopes) * w[i] * w[j] * w[k]
        np.add.at(found, np.ix_(nodes, nodes), volume * np.outer(values, values))
    return found


@pytest.mark.parametrize("width", SHAPES)
def test_repeated_nodes_are_recognised_in_every_numbering(width):
    """The mass matrix of the cell is that of the collapsed brick, whose shape functions are the same."""
    shape = np.array([int(i) for i in SHAPES[width].split()])
    points = CUBE + 0.1 * np.random.default_rng(2).uniform(-1, 1, CUBE.shape)
    for turn in turns():
        nodes = shape[turn]
        cell = regular_nodes(nodes + 1)
        assert cell is not None
        assert len(cell) == width
        used, local = np.unique(cell - 1, return_inverse=True)
        solid = assemble_solid(SolidMesh(points[used], local[None], {}), STEEL)
        exact = STEEL.density * collapsed_mass(points, nodes)[np.ix_(used, used)]
        np.testing.assert_allclose(solid.mass.toarray()[::3, ::3], exact, rtol=0, atol=1e-12 * exact.max())


@pytest.mark.parametrize(
    "nodes", ["1 2 3 4 5 6 7 7", "1 2 3 1 5 6 7 5", "1 1 1 1 5 6 7 8", "1 2 1 4 5 6 7 8", "1 1 2 2 3 3 3 3"]
)
def test_other_repetitions(nodes):
    """A collapsed edge at any place is a wedge; seven nodes, crossed diagonals and flat shapes are nothing known."""
    cell = regular_nodes(np.array([int(n) for n in nodes.split()]))
    assert (cell is None) == (nodes not in ("1 2 3 1 5 6 7 5", "1 1 1 1 5 6 7 8"))


def archive(mesh, types="ET,1,{kind}\n", kind=186):
    """An archive of a mesh, its cells written as bricks of one type."""
    lines = [
        "/PREP7",
        types.format(kind=kind).rstrip(),
        f"NBLOCK,6,SOLID,{len(mesh.points):10d},{len(mesh.points):10d}",
        "(3i9,6e21.13e3)",
    ]
    for i, place in enumerate(mesh.points, 1):
        lines.append(f"{i:9d}{0:9d}{0:9d}" + "".join(f"{x:21.13E}" for x in place))
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{len(mesh.cells):10d},{len(mesh.cells):10d}", "(19i9)"]
    for number, cell in enumerate(mesh.cells, 1):
        own = cell[cell >= 0]
        nodes = (own[MIDDLES[len(own)]] + 1).tolist()
        row = [1, 1, 1, 1, 0, 0, 0, 0, len(nodes), 0, number, *nodes]
        lines += ["".join(f"{n:9d}" for n in row[first : first + 19]) for first in range(0, 19, 19)]
        lines += ["".join(f"{n:9d}" for n in row[19:])] if len(row) > 19 else []
    lines += ["       -1"]
    for name, value in (("EX", 210e9), ("NUXY", 0.3), ("DENS", 7850.0)):
        lines.append(f"MPDATA,R5.0, 1,{name:4},       1, 1, {value:.9E},")
    root = mesh.node_sets["root"] + 1
    lines += [f"CMBLOCK,ROOTS,NODE,{len(root):8d}", "(8i10)"]
    lines += ["".join(f"{n:10d}" for n in root[first : first + 8]) for first in range(0, len(root), 8)]
    return "\n".join([*lines, "FINISH", ""])


HOW = ("hex", "pyramids, tetrahedra outside", "wedges")


@pytest.mark.parametrize(("kind", "second"), [(185, False), (186, True)])
def test_archives_of_all_shapes_are_the_same_mesh(tmp_path, kind, second):
    mesh = mesh_of(HOW, second, (0.06, 0.01, 0.01), (6, 1, 1))
    path = tmp_path / "model.cdb"
    path.write_text(archive(mesh, kind=kind))
    found = read_ansys_archive(path)
    kinds = {width: len(rows) for width, rows in by_kind(found.cells)}
    assert kinds == ({10: 16, 13: 4, 15: 4, 20: 2} if second else {4: 16, 5: 4, 6: 4, 8: 2})
    np.testing.assert_array_equal(np.sort(found.node_sets["roots"]), np.sort(mesh.node_sets["root"]))
    one, other = (
        natural_frequencies(assemble_solid(SolidMesh(m.points, m.cells, {"root": mesh.node_sets["root"]}), STEEL), 4)
        for m in (mesh, found)
    )
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_study_of_an_archive_of_all_shapes(tmp_path):
    """Through the command line's road: the same as the mesh itself, and first bending as fine bricks, to the error of six cells."""
    size = (0.06, 0.01, 0.01)
    mesh = mesh_of(HOW, True, size, (6, 1, 1))
    (tmp_path / "model.cdb").write_text(archive(mesh))
    (tmp_path / "study.toml").write_text(
        'schema_version = 2\n[part.bar]\nfile = "model.cdb"\nunits = "SI"\nclamped = ["ROOTS"]\n[modes]\nnumber = 3\n'
    )
    result = ss.Study.from_file(tmp_path / "study.toml").run()
    plain = natural_frequencies(assemble_solid(box(20, size, (12, 2, 2)), STEEL), 3)
    found = np.ravel(result["modes"]["frequency_hz"].values)[:3]
    np.testing.assert_allclose(found, natural_frequencies(assemble_solid(mesh, STEEL), 3), rtol=1e-8)
    np.testing.assert_allclose(found[:2], plain[:2], rtol=0.02)


def test_element_types_in_a_block(tmp_path):
    """As ANSYS writes them since 2023 R1; options stand behind the element."""
    mesh = mesh_of("hex", False, (1.0, 1.0, 1.0), (1, 1, 1))
    block = "ETBLOCK,        1,        1\n(2i9,19a9)\n        1      185" + "{options}" + "\n       -1\n"
    path = tmp_path / "model.cdb"
    path.write_text(archive(mesh, block.format(options="        0" * 18)))
    assert read_ansys_archive(path).cells.shape == (1, 8)
    path.write_text(archive(mesh, block.format(options="        0        2" + "        0" * 16)))
    with pytest.raises(InputError, match=r"line 4: KEYOPT\(2\) = 2 of SOLID185: another integration than full"):
        read_ansys_archive(path)
    path.write_text(archive(mesh, block.format(options="").replace("(2i9,19a9)", "(2i9;19a9)")))
    with pytest.raises(InputError, match=r"line 3: '\(2i9;19a9\)' is no format such as \(2i9,19a9\)"):
        read_ansys_archive(path)
    path.write_text(archive(mesh, block.format(options="").replace("       -1\n", "")))
    with pytest.raises(InputError, match=r"line 5: the block of element types has no end \(-1\)"):
        read_ansys_archive(path)


def test_mid_side_nodes_that_disagree_are_refused_by_number(tmp_path):
    mesh = mesh_of(HOW, True, (0.06, 0.01, 0.01), (6, 1, 1))
    text = archive(mesh)
    wedge = next(i for i, cell in enumerate(mesh.cells) if np.count_nonzero(cell >= 0) == 15)
    last = f"{mesh.cells[wedge, 14] + 1:9d}"
    assert text.count(last + last + "\n") >= 1
    path = tmp_path / "model.cdb"
    path.write_text(text.replace(last + last + "\n", last + f"{1:9d}" + "\n", 1))
    with pytest.raises(InputError, match=rf"element {wedge + 1}, SOLID186: has repeated nodes that make it no wedge"):
        read_ansys_archive(path)
