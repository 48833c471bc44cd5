"""Constraint equations and couplings of ANSYS archives: as the equations of a deck, by command and as CDWRITE writes them."""

import numpy as np
import pytest
import scipy
from test_readers_ansys import cube

from stickslip import InputError, Material, Units
from stickslip.model import assemble_solid, read_ansys_archive
from stickslip.model.readers.ansys_equations import read_ansys_links

STEEL = Material()


def frequencies(path, **options):
    mesh = read_ansys_archive(path, units=Units.mm_t_s(), linked=True)
    links = read_ansys_links(path, mesh, **options)
    structure = assemble_solid(mesh, STEEL, clamped=(), links=links)
    return scipy.linalg.eigh(structure.stiffness.toarray(), structure.mass.toarray(), eigvals_only=True)


def by_null_space(path, rows):
    """Return the same from the null space of the equations, a dense matrix on all dofs."""
    free = assemble_solid(read_ansys_archive(path, units=Units.mm_t_s(), linked=True), STEEL, clamped=())
    table = {(int(n), c): i for i, (n, c) in enumerate(zip(free.dofs.node, free.dofs.component, strict=True))}
    matrix = np.zeros((len(rows), free.n))
    for i, terms in enumerate(rows):
        for node, component, value in terms:
            matrix[i, table[node, component]] = value
    null = scipy.linalg.null_space(matrix)
    return scipy.linalg.eigh(
        null.T @ free.stiffness.toarray() @ null, null.T @ free.mass.toarray() @ null, eigvals_only=True
    )


WRITTEN = """CE,R5.0,DEFI,       3,       1,  0.00000000
CE,R5.0,NODE,        10,UX  ,  1.00000000    ,        20,UY  , -2.00000000
CE,R5.0,NODE,        70,UZ  ,  0.50000000
"""
THREE = [[(10, "x", 1.0), (20, "y", -2.0), (70, "z", 0.5)]]


@pytest.mark.parametrize(
    ("more", "rows"),
    [
        ("CE,1,0,10,UX,1,20,UY,-2,70,UZ,0.5\n", THREE),
        ("CE,1,0,10,UX,1,20,UY,-2\nCE,1,,70,UZ,0.5\n", THREE),
        (WRITTEN, THREE),
        ("CP,1,UY,10,20,30\n", [[(10, "y", 1), (20, "y", -1)], [(10, "y", 1), (30, "y", -1)]]),
        ("CP,1,ALL,10,20\n", [[(10, c, 1), (20, c, -1)] for c in "xyz"]),
    ],
)
def test_equations_against_their_null_space(tmp_path, more, rows):
    path = tmp_path / "cube.cdb"
    path.write_text(cube() + more)
    expected = by_null_space(path, rows)
    np.testing.assert_allclose(frequencies(path), expected, rtol=1e-9, atol=1e-9 * expected[-1])


def test_equations_along_turned_axes_of_a_node(tmp_path):
    """Node 10 has its axes turned by 30 degrees about z."""
    path = tmp_path / "cube.cdb"
    lines = cube().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("       10"))
    lines[at] += f"{30.0:21.13E}"
    path.write_text("\n".join([*lines, "CE,1,0,10,UX,1,20,UZ,-1"]) + "\n")
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    expected = by_null_space(path, [[(10, "x", c), (10, "y", s), (20, "z", -1.0)]])
    np.testing.assert_allclose(frequencies(path), expected, rtol=1e-9, atol=1e-9 * expected[-1])


def test_pairs_of_cyclic_faces_are_no_equations(tmp_path):
    path = tmp_path / "cube.cdb"
    path.write_text(cube() + "CP,1,UX,10,20\n")
    mesh = read_ansys_archive(path, linked=True)
    assert read_ansys_links(path, mesh, cyclic=True) is None
    assert read_ansys_links(path, mesh).equations.shape == (1, 24)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("CE,1,0.5,10,UX,1,20,UX,-1\n", r"line 21: is no homogeneous equation with a number \(1,0.5,10"),
        ("CE,1,0,10,ROTX,1,20,UX,-1\n", "constrains 'ROTX', and solids have UX, UY and UZ"),
        ("CE,1,0,11,UX,1,20,UX,-1\n", "names node 11, which belongs to no solid"),
        ("CE,1,0,10,UX\n", "has the term '10', 'UX', ''"),
        ("CE,1,0,10,UX,one\n", "has the term '10', 'UX', 'one'"),
        ("CP,1,UX\n", "couples 1,UX"),
    ],
)
def test_what_is_no_equation_is_named_by_line(tmp_path, more, message):
    path = tmp_path / "cube.cdb"
    path.write_text(cube() + more)
    mesh = read_ansys_archive(path, linked=True)
    with pytest.raises(InputError, match=message):
        read_ansys_links(path, mesh)
    if more.startswith("CE"):
        with pytest.raises(InputError, match=r"constrains the model \(CE\).* Use the archive in a study"):
            read_ansys_archive(path)
