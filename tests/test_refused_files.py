"""Files that are refused: decks, archives, results, matrices and tables, each with the place, the problem and the remedy."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ansys_files import record, result_file
from test_deck_links import ROOT, STEEL, bricks
from test_readers_ansys import ARCHIVE, cube
from test_readers_deck import CUBE, deck_of
from test_readers_matrices import DATA
from test_readers_nastran import LARGE, SMALL

from stickslip import InputError
from stickslip.model import read_ansys_archive, read_ansys_results, read_deck, read_nastran_dmig
from stickslip.model.npz import read_npz
from stickslip.model.readers.abaqus import read_coordinate_matrix
from stickslip.model.readers.ansys_binary import open_records, read_ansys_nodes
from stickslip.model.readers.frd import read_frd
from stickslip.model.readers.matrix_files import read_matrix
from stickslip.model.readers.measured_columns import read_columns
from stickslip.model.readers.node_table import csv_columns

BAR = bricks() + STEEL + ROOT
NODE = "*NODE\n50, 0.4, 0.05, 0.05\n51, 0.4, 0.05, 0.05\n"
LINE = "*NSET, NSET=LINE\n13, 14\n"
SURFACE = "*SURFACE, NAME=S1, TYPE=NODE\nLINE\n"
PAIR = "*SURFACE, NAME=LO, TYPE=NODE\n1\n*SURFACE, NAME=HI, TYPE=NODE\n{high}\n"
TIE = "*TIE, NAME=T, CYCLIC SYMMETRY\nLO\n"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            "*TRANSFORM, NSET=R, TYPE=R\n1., 0., 0.\n",
            "line 32, *TRANSFORM: needs one line with six numbers. Give two points.",
        ),
        (NODE + "*RIGID BODY, REF NODE=50\n", "line 35, *RIGID BODY: names no nodes. Give NSET= or ELSET=."),
        (
            "*PREPRINT, ECHO=NO\n"
            + NODE
            + LINE
            + SURFACE
            + "*COUPLING, CONSTRAINT NAME=C, REF NODE=50, SURFACE=S1\n*DISTRIBUTING\n",
            "*COUPLING: couples nodes on one line, which have no rotation. Name nodes off a line.",
        ),
        (NODE + "*MPC\nBEAM, 50, 51\n", "line 36, *MPC: nodes [50, 51] lie at one place. Tie them by equations."),
        (
            NODE + "*MPC\nPLANE, 5, 9, 13, 50\n",
            "line 36, *MPC: nodes [5, 9, 13] span no plane. Name 3 nodes that do first.",
        ),
        (
            NODE + "*ELEMENT, TYPE=SPRINGA, ELSET=SP\n91, 50, 51\n*SPRING, ELSET=SP\n\n8000.\n",
            "line 37, *SPRING: nodes [50, 51] lie at one place and give it no direction. Use SPRING2 or DASHPOT2",
        ),
        (
            "*ORIENTATION, NAME=O\n1., 0., 0.\n*SOLID SECTION, ELSET=E, MATERIAL=S, ORIENTATION=O\n",
            "line 32, *ORIENTATION: needs a line with two points. Give six",
        ),
        (
            PAIR.format(high=2) + TIE,
            "line 36, *TIE: needs one line with two surfaces. Add it.",
        ),
        (
            PAIR.format(high=2).replace("LO, TYPE=NODE", "LO, TYPE=CUTTING") + TIE.replace("LO\n", "LO, HI\n"),
            "*SURFACE: a surface of TYPE=CUTTING is not read. Use TYPE=NODE or ELEMENT.",
        ),
        (
            PAIR.format(high=2).replace("TYPE=NODE\n1\n", "TYPE=NODE\n") + TIE.replace("LO\n", "LO, HI\n"),
            "*SURFACE: holds no nodes. List node sets or element faces.",
        ),
        (
            "*SURFACE, NAME=ON, TYPE=NODE\n13\n*SURFACE, NAME=OF\n*TIE, NAME=T\nON, OF\n",
            "line 34, *SURFACE: holds no faces. List element faces.",
        ),
    ],
)
def test_decks_are_refused_by_line(more: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as told:
        deck_of(tmp_path, BAR + more)
    assert said in str(told.value)


def text(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def member(path: Path, name: str, content: bytes) -> Path:
    """Write an archive of one member."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(name, content)
    return path


def array(version: tuple[int, int], values: np.ndarray, claimed: int | None = None) -> bytes:
    """Return a member of an archive; `claimed`: entries that its header tells of."""
    stream = io.BytesIO()
    np.lib.format.write_array(stream, values, version=version)
    whole = stream.getvalue()
    return whole if claimed is None else whole.replace(f"({values.size},)".encode(), f"({claimed},)".encode())


def complex_modes() -> bytes:
    """Return a file of results whose only mode says that it is complex."""
    whole = result_file([1.0], np.ones((1, 2, 3)), {1: (0, 0, 0), 2: (1, 1, 1)})
    solution = np.zeros(200, dtype=np.int64)
    solution[[2, 19, 20, 21, 22]] = 2, 3, 1, 2, 3
    solution[104] = len(record(solution)) // 4
    plain = record(solution)
    solution[18] = 1
    assert whole.count(plain) == 1
    return whole.replace(plain, record(solution))


def spoilt(path: Path, whole: str, old: str, new: str) -> Path:
    assert old in whole
    return text(path, whole.replace(old, new, 1))


def _results(path: Path, content: bytes) -> object:
    path.write_bytes(content)
    return read_ansys_results(path)


def sparse(path: Path, shape: list[int]) -> Path:
    """Write a diagonal matrix of two rows in SciPy's layout, with another shape."""
    np.savez(path, format="csr", data=np.ones(2), indices=np.arange(2), indptr=np.arange(3), shape=np.array(shape))
    return path


TWO_NODES = {1: (0.0, 0.0, 0.0), 2: (1.0, 1.0, 1.0)}
LONG = "9" * 140_000  # longer than a field of a CSV file may be


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (
            lambda p: read_npz(member(p / "a.npz", "notes.txt", b"1")),
            "a.npz: notes.txt: is no array. Give a file of numpy.savez.",
        ),
        (
            lambda p: read_npz(member(p / "a.npz", "a.npy", array((1, 0), np.array([None])))),
            "a.npz: array 'a': has the type object, only numbers and texts are read. Python objects are never loaded",
        ),
        (
            lambda p: read_npz(member(p / "a.npz", "a.npy", array((1, 0), np.zeros(7), 9))),
            "a.npz: array 'a': its header asks for 72 bytes of a member of 184. The file is damaged or was cut short",
        ),
        (
            lambda p: read_npz(member(p / "a.npz", "a.npy", array((3, 0), np.zeros(7)))),
            "a.npz: cannot be read (array format (3, 0)). The file is damaged or was cut short",
        ),
        (
            lambda p: read_coordinate_matrix(text(p / "K.mtx", "0 1 2.0\n1 1 3.0\n")),
            "K.mtx: has row or column 0. Rows are counted from 1.",
        ),
        (
            lambda p: read_ansys_archive(
                spoilt(
                    p / "a.cdb", cube(), "ET,1,185\n", "ETBLOCK,        1,        1\n(2i9,19a9)\n        1\n       -1\n"
                )
            ),
            "a.cdb: line 3: a type of elements lacks its element. The file was cut short: write or copy it again.",
        ),
        (
            lambda p: read_ansys_nodes(spoilt(p / "a.cdb", ARCHIVE, "CMBLOCK,TIP     ,NODE,       2", "CMBLOCK,TIP")),
            "a.cdb: line 8: is no head of a component. The file was cut short: write or copy it again.",
        ),
        (
            lambda p: open_records(text(p / "a.full", "cut"), 4),
            "a.full: has 0 words, a header needs more than",
        ),
        (
            lambda p: _results(p / "a.rst", result_file([], np.zeros((0, 2, 3)), TWO_NODES)),
            "a.rst: holds no result. Expand the modes: MXPAND.",
        ),
        (
            lambda p: _results(p / "a.rst", complex_modes()),
            "a.rst: holds complex modes. Give undamped modes: MODOPT,LANB.",
        ),
        (
            lambda p: read_deck(
                spoilt(
                    p / "a.inp", CUBE, "5, 6, 7, 8\n", "5, 6, 7, 8\n*ELEMENT, TYPE=C3D8\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
                )
            ),
            "a.inp: defines element 1 twice. Give it once.",
        ),
        (
            lambda p: read_deck(spoilt(p / "a.inp", CUBE, "99, 5., 5., 5.", "8, 5., 5., 5.")),
            "a.inp: defines node 8 twice, at different places. Give each node once.",
        ),
        (
            lambda p: read_matrix(text(p / "K.csv", "1,2\n"), "stiffness", None),
            "K.csv: unknown kind of matrix file '.csv'. Use .mtx, .npz or .h5.",
        ),
        (
            lambda p: read_matrix(sparse(p / "K.npz", shape=[2, 2, 2]), "stiffness", None),
            "K.npz: has a shape that is no pair. The file is damaged or was cut short",
        ),
        (
            lambda p: read_matrix(
                text(p / "K.mtx", "%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n3 1 1.0\n"),
                "stiffness",
                None,
            ),
            "K.mtx: entry 1: row 3, column 1 is outside a matrix of 2 equations. The matrix and the list of its dofs",
        ),
        (
            lambda p: read_columns(text(p / "m.csv", f"hz,um\n1,{LONG}\n")),
            "m.csv: is no CSV file (field larger than field limit (131072)). Separate by commas.",
        ),
        (
            lambda p: read_columns(text(p / "m.csv", "frequency_hz;amplitude_um\n8,0;1,0\n")),
            "m.csv: line 1: is one column, got 'frequency_hz;amplitude_um'. Separate the columns by commas, and write 1.5",
        ),
        (
            lambda p: csv_columns(text(p / "n.csv", f"node,x\n1,{LONG}\n"), ("node",)),
            "n.csv: is no CSV file (field larger than field limit (131072)). Separate by commas.",
        ),
        (
            lambda p: read_nastran_dmig(
                text(p / "c.pch", "+A      1\n" + SMALL + LARGE), mass="maax", stiffness="kaax"
            ),
            "c.pch: line 1: continues no card. The file was cut short, or its cards are not in order.",
        ),
        (
            lambda p: read_nastran_dmig(
                spoilt(p / "c.pch", SMALL + LARGE, "  1.5D+3", "\t1.5D+3"), mass="maax", stiffness="kaax"
            ),
            "c.pch: line 5: has a tab, which fixed fields cannot have. Use blanks.",
        ),
        (
            lambda p: read_frd(spoilt(p / "r.frd", (DATA / "brick_static.frd").read_text(), "    2C", "    9C")).nodes,
            "r.frd: holds no nodes. Ask for output with *NODE FILE in the deck.",
        ),
    ],
)
def test_files_are_refused_by_name_with_the_remedy(read: Callable[[Path], object], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as told:
        read(tmp_path)
    assert said in str(told.value)
