"""Travelling waves against CalculiX: its cyclic matrices and frequencies from its matrices of one free sector."""

import csv
import gzip

import numpy as np
import pytest
import scipy.sparse

from evidence.validation.reference_data import COMPLETE
from stickslip.model.modes import natural_frequencies
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave

FOLDER = COMPLETE / "calculix"
SECTORS = 24
pytestmark = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="the folder with CalculiX results does not lie beside the repository"
)


def matrix(name, n):
    """A matrix of CalculiX's storage: lines `row column value`, counted from 1, upper triangle."""
    with gzip.open(FOLDER / name, "rt") as file:
        table = np.loadtxt(file)
    row, column = table[:, :2].astype(int).T - 1
    upper = scipy.sparse.csr_array((table[:, 2], (row, column)), shape=(n, n))
    return (upper + upper.T - scipy.sparse.diags_array(upper.diagonal())).tocsr()


def equations(stem):
    """(n, 2) node and direction (0, 1, 2) of each equation."""
    with gzip.open(FOLDER / f"{stem}.dof.gz", "rt") as file:
        return np.array([[int(part) for part in line.split(".")] for line in file]) - [0, 1]


def nodes_of_deck(name):
    """Positions of the nodes of a deck by number."""
    lines = (FOLDER / name).read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("*NODE"))
    points = {}
    for line in lines[start + 1 :]:
        if line.startswith("*"):
            break
        number, *place = line.split(",")
        points[int(number)] = [float(x) for x in place]
    return points


@pytest.fixture(scope="module")
def sector():
    """The free sector, paired by geometry; the faces' nodes from the list of pairs, shuffled."""
    table = equations("n24_coarse_matrix_free")
    n = len(table)
    points = nodes_of_deck("n24_coarse_matrix_free.inp")
    pairs = np.loadtxt(FOLDER / "n24_coarse_cyclic_pairs.csv", delimiter=",", skiprows=1, dtype=int)
    dofs = Dofs(
        table[:, 0],
        tuple("xyz"[direction] for direction in table[:, 1]),
        np.array([points[number] for number in table[:, 0]]),
    )
    faces = np.random.default_rng(0).permuted(pairs.T, axis=1)
    sets = {
        name: np.flatnonzero(np.isin(dofs.node, nodes))
        for name, nodes in zip(("cyclic_low", "cyclic_high"), faces, strict=True)
    }
    M, K = (matrix(f"n24_coarse_matrix_free.{kind}.gz", n) for kind in ("mas", "sti"))
    found = cyclic_sector(Structure(M, scipy.sparse.csr_array((n, n)), K, dofs, sets), SECTORS)
    partner = dict(pairs.tolist())
    assert [partner[number] for number in dofs.node[found.low]] == dofs.node[found.high].tolist()
    return found


def frequencies(diameter):
    with (FOLDER / "n24_coarse_frequencies.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if r["case"] == "free"]
    return np.array([float(r["frequency_hz"]) for r in rows if int(r["nodal_diameter"]) == diameter])


def compare(sector, diameter):
    exact = frequencies(diameter)
    found = natural_frequencies(travelling_wave(sector, diameter), len(exact))
    np.testing.assert_allclose(found, exact, rtol=1e-6)  # it prints seven digits


@pytest.mark.parametrize("diameter", [0, 3, 12])
def test_frequencies_of_some_diameters(sector, diameter):
    compare(sector, diameter)


@pytest.mark.validation
@pytest.mark.parametrize("diameter", [1, 2, 4, 5, 6, 7, 8, 9, 10, 11])
def test_frequencies_of_the_other_diameters(sector, diameter):
    compare(sector, diameter)


def test_matrices_at_three_diameters(sector):
    """It keeps the high face where we keep the low one, and stores [[R, -I], [I, R]]."""
    table = equations("n24_coarse_matrix_cyc3")
    n = len(table)
    ours = travelling_wave(sector, 3)
    tie = sector.wave_tie(3)
    key = {
        (a, b): i
        for i, (a, b) in enumerate(zip(sector.structure.dofs.node, sector.structure.dofs.component, strict=True))
    }
    rows = np.array([key[node, "xyz"[direction]] for node, direction in table])
    turn = tie[rows]  # unitary: its rows are the dofs that CalculiX keeps
    assert abs(turn @ turn.conj().T - scipy.sparse.eye_array(n)).max() < 1e-12
    for kind, mine in (("mas", ours.mass), ("sti", ours.stiffness)):
        pair = matrix(f"n24_coarse_matrix_cyc3.{kind}.gz", 2 * n)
        theirs = pair[:n, :n] + 1j * pair[n:, :n]
        found = turn @ mine @ turn.conj().T
        difference = scipy.sparse.linalg.norm(found - theirs) / scipy.sparse.linalg.norm(theirs)
        assert difference < 1e-12
