"""Readers of Nastran files: against files that Nastran wrote, which ship inside pyYeti, its writer, and spoilt files."""

import importlib
import importlib.util
import os
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse

from stickslip import InputError, StickslipError
from stickslip.model import read_nastran_dmig, read_nastran_op2, read_nastran_op4
from stickslip.model.readers.nastran import op4_matrices
from stickslip.model.readers.nastran_bulk import read_nastran_dofs
from stickslip.model.readers.nastran_library import check_lines, check_records, reading
from stickslip.model.readers.units import Units


@pytest.fixture(scope="module")
def samples():
    """Folder of the files that Nastran wrote."""
    found = importlib.util.find_spec("pyyeti")
    if found is None:
        message = "pyYeti, which reads Nastran's binary files and has some, is not installed: make optional"
        if os.environ.get("STICKSLIP_OPTIONAL") == "required":
            pytest.fail(message)
        pytest.skip(message)
    return Path(found.origin).parent / "tests"


@pytest.fixture(scope="module")
def library(samples):
    """Modules of pyYeti by name."""
    names = ("op2", "op4", "bulk", "n2p")
    return {name: importlib.import_module(f"pyyeti.nastran.{name}") for name in names}


# --- files that Nastran wrote


def test_matrices_of_the_a_set_have_the_eigenvalues_that_nastran_found(samples, library):
    folder = samples / "nas2cam_extseout"
    structure = read_nastran_op4(
        folder / "nas2cam.op4",
        mass="maa[-1]",
        stiffness="kaa[-1]",
        geometry=folder / "nas2cam.op2",
        dof_set="a",
        plausible=False,
    )
    squares = scipy.linalg.eigh(structure.stiffness.toarray(), structure.mass.toarray(), eigvals_only=True)
    expected = library["op2"].rdnas2cam(str(folder / "nas2cam"))["lambda"][0]  # six rigid motions
    np.testing.assert_allclose(squares[6:], expected[6:], rtol=2e-7)  # single precision
    assert abs(squares[:6]).max() < 1e-9 * squares[6]
    assert {"x", "y", "z", "rx", "ry", "rz", "mode"} == set(structure.dofs.component)
    modal = np.array(structure.dofs.component) == "mode"
    assert (structure.dofs.node[modal] == -1).all()
    assert np.isfinite(structure.dofs.position[~modal]).all()


def test_external_superelement_is_the_one_that_was_assembled(samples):
    folder = samples / "nas2cam_extseout"
    external = read_nastran_op4(
        folder / "inboard.op4",
        mass="mxx",
        stiffness="kxx",
        geometry=folder / "inboard.asm",
        dof_set="a",
        plausible=False,
    )
    assert external.n == 32  # four grids, eight modal coordinates
    assert external.dofs.component[-8:] == ("mode",) * 8
    # grid 11 has axes of its own: only turned back does the free part carry no force in rigid motion
    motions = rigid_motions(external.dofs)
    scale = abs(external.stiffness).max() * np.linalg.norm(external.dofs.position[0])
    assert abs(external.stiffness[:24, :24] @ motions[:24]).max() < 1e-13 * scale  # else 1e-2


def rigid_motions(dofs):
    """Return the six rigid motions (n, 6) of a table of coordinates along the global axes."""
    motions = np.zeros((len(dofs), 6))
    for row, (component, place) in enumerate(zip(dofs.component, dofs.position, strict=True)):
        if component in "xyz":
            axis = "xyz".index(component)
            motions[row, axis] = 1.0
            motions[row, 3:] = [np.cross(turn, place)[axis] for turn in np.eye(3)]
        elif component in ("rx", "ry", "rz"):
            motions[row, 3 + ("rx", "ry", "rz").index(component)] = 1.0
    return motions


def test_modes_of_a_free_model_begin_with_its_rigid_motions(samples):
    # positions, order and axes are right only together; 278 modes, two output coordinate systems
    results = read_nastran_op2(samples / "nas2cam_extseout" / "full.op2")
    assert results.shapes.shape == (294, 278)
    assert results.frequencies_hz[6] == pytest.approx(1.69880009, rel=1e-7)
    assert (results.frequencies_hz[:6] < 1e-4).all()
    motions, rigid = rigid_motions(results.dofs), results.shapes[:, :6]
    rest = rigid - motions @ np.linalg.lstsq(motions, rigid, rcond=None)[0]
    assert abs(rest).max() < 2e-7 * abs(rigid).max()  # single precision


def test_parts_and_whole_have_the_same_frequencies(samples):
    # the superelements, assembled by Nastran, against our reading of its matrices
    folder = samples / "nas2cam_extseout"
    assembled = read_nastran_op2(folder / "assemble.op2").frequencies_hz
    structure = read_nastran_op4(
        folder / "nas2cam.op4",
        mass="maa[-1]",
        stiffness="kaa[-1]",
        geometry=folder / "nas2cam.op2",
        dof_set="a",
        plausible=False,
    )
    K, M = structure.stiffness.toarray(), structure.mass.toarray()
    ours = np.sqrt(abs(scipy.linalg.eigvalsh(K, M))) / (2 * np.pi)
    np.testing.assert_allclose(ours[6:], assembled[6:], rtol=2e-7)


def test_output_coordinate_systems_are_those_of_the_library(samples, library, tmp_path):
    # grids with output in a rectangular, a cylindrical and a spherical system
    cards = (
        "CORD2R,1,,1.,2.,3.,1.,2.,4.\n,2.,3.,3.\nCORD2C,2,,0.,0.,0.,0.,1.,1.\n,1.,0.,0.\n"
        "CORD2S,3,,0.,1.,0.,0.,1.,5.\n,1.,1.,0.\n"
        "GRID,11,,1.,2.,3.,1\nGRID,12,,4.,5.,6.,2\nGRID,13,,7.,8.,1.,3\nGRID,14,,2.,1.,0.\n"
    )
    (tmp_path / "model.bdf").write_text(cards)
    known = read_nastran_dofs(tmp_path / "model.bdf")
    assert known.turned.tolist() == [11, 12, 13]
    table = library["bulk"].bulk2uset(str(tmp_path / "model.bdf"))[0]
    local = library["n2p"].rbgeom_uset(table)
    rows = np.arange(len(known.ids))
    turned = known.rotation(rows) @ local
    np.testing.assert_allclose(turned, rigid_motions(known.table(rows)), atol=1e-12)


@pytest.mark.parametrize("options", [{"endian": "<"}, {"endian": ">"}, {"binary": False, "digits": 16}])
@pytest.mark.parametrize("sparse", ["dense", "bigmat", "nonbigmat"])
def test_round_trip_through_the_writer_of_the_library(library, tmp_path, options, sparse):
    rng = np.random.default_rng(1)
    half = rng.standard_normal((12, 12)) * (rng.random((12, 12)) < 0.3)
    stiffness, mass = half @ half.T + 5 * np.eye(12), np.diag(rng.uniform(1, 2, 12))
    library["op4"].write(str(tmp_path / "m.op4"), {"mgg": mass, "kgg": stiffness}, sparse=sparse, **options)
    (tmp_path / "m.bdf").write_text("GRID,7,,1.,2.,3.\nGRID,3,,4.,5.,6.\n")
    structure = read_nastran_op4(
        tmp_path / "m.op4",
        mass="MGG",
        stiffness="KGG",
        geometry=tmp_path / "m.bdf",
        dof_set="g",
        units=Units.mm_t_s(),
        plausible=False,
    )
    lengths = np.tile(np.repeat([1e-3, 1.0], 3), 2)
    energy = 1e3 * 1e-6  # t mm²/s² in J
    np.testing.assert_allclose(
        structure.stiffness.toarray(), energy * stiffness / np.outer(lengths, lengths), rtol=1e-14
    )
    np.testing.assert_allclose(structure.mass.toarray(), energy * mass / np.outer(lengths, lengths), rtol=1e-14)
    assert structure.dofs.node.tolist() == [3] * 6 + [7] * 6
    np.testing.assert_allclose(structure.dofs.position[6], [1e-3, 2e-3, 3e-3])


@pytest.mark.parametrize(("precision", "name"), [("single", "rmats"), ("double", "rmat")])
def test_every_layout_that_nastran_writes_holds_the_same_matrix(samples, precision, name):
    folder = samples / "nastran_op4_data"
    paths = sorted(folder.glob(f"{precision}_*_*.op4"))
    paths = [path for path in paths if "badname" not in path.name]
    assert len(paths) >= 18  # three layouts, two byte orders or text, two lengths of integers
    shapes = []
    for path in paths:
        found = op4_matrices(path, [name], lambda _, shape: shapes.append(shape))[name]
        first = op4_matrices(paths[0], [name], lambda *_: None)[name]
        np.testing.assert_allclose(found.toarray(), first.toarray(), rtol=1e-6)
    assert set(shapes) == {(25, 31)}


def test_sizes_are_refused_before_anything_is_allocated(samples):
    # ten million rows and columns, written as a dense matrix
    path = samples / "nastran_op4_data" / "nas_large_dim_dense_binary.op4"
    with pytest.raises(InputError, match=r"matd22a: is 10000001 x 10000001, the g-set"):
        read_nastran_op4(
            path, mass="matd22a", stiffness="matd22a", geometry=samples / "nas2cam_extseout" / "full.op2", dof_set="g"
        )


def test_matrices_of_cards_are_those_of_the_library(samples, library):
    path = samples / "nastran_dmig_data" / "matrix_factory.pch"
    structure = read_nastran_dmig(path, mass="IDENT", stiffness="IDENT", plausible=False)
    expected = library["bulk"].rddmig(str(path), square=True)["ident"]
    np.testing.assert_array_equal(structure.mass.toarray(), expected.to_numpy())
    with pytest.raises(InputError, match=r"RANDM: is not symmetric"):
        read_nastran_dmig(path, mass="IDENT", stiffness="RANDM")
    with pytest.raises(InputError, match=r"CMPLX: is rectangular"):
        read_nastran_dmig(path, mass="IDENT", stiffness="CMPLX")


def test_cards_written_by_the_library(library, tmp_path):
    pandas = importlib.import_module("pandas")
    rng = np.random.default_rng(2)
    half = rng.standard_normal((9, 9))
    stiffness = half @ half.T
    keys = [(node, component) for node in (4, 15, 1000001) for component in (1, 2, 3)]
    index = pandas.MultiIndex.from_tuples(keys, names=["id", "dof"])
    frames = {n: pandas.DataFrame(m, index, index) for n, m in (("kk", stiffness), ("mm", np.eye(9)))}
    library["bulk"].wtdmig(str(tmp_path / "a.pch"), frames)
    structure = read_nastran_dmig(tmp_path / "a.pch", mass="mm", stiffness="kk")
    np.testing.assert_allclose(structure.stiffness.toarray(), stiffness, rtol=1e-8)  # its digits
    assert structure.dofs.node[::3].tolist() == [4, 15, 1000001]


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("nas2cam_extseout/full.op2", read_nastran_op2),
        (
            "nas2cam_extseout/inboard.op4",
            lambda path: read_nastran_op4(path, mass="mxx", stiffness="kxx", geometry=path, dof_set="a"),
        ),
    ],
)
def test_samples_cut_anywhere_are_refused(samples, tmp_path, name, read):
    whole = (samples / name).read_bytes()
    path = tmp_path / Path(name).name
    for share in (0, 0.00001, 0.001, 0.01, 0.1, 0.5, 0.9, 0.99):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match=path.name.replace(".", r"\.")):
            read(path)


def test_what_the_file_does_not_hold_is_named(samples):
    folder = samples / "nas2cam_extseout"

    def read(mass="maa[-1]", geometry="nas2cam.op2", dof_set="a"):
        return read_nastran_op4(
            folder / "nas2cam.op4",
            mass=mass,
            stiffness="kaa[-1]",
            geometry=folder / geometry,
            dof_set=dof_set,
            plausible=False,
        )

    with pytest.raises(InputError, match=r"holds no matrix 'maaa'\. Did you mean 'maa'"):
        read(mass="maaa")
    with pytest.raises(InputError, match=r"holds 3 matrices 'maa'\. Say which: 'maa\[0\]'"):
        read(mass="maa")
    with pytest.raises(InputError, match=r"has no 'maa\[7\]': there are 3"):
        read(mass="maa[7]")
    with pytest.raises(InputError, match=r"is 54 x 54, the g-set of .* has 60.*that size: .*a"):
        read(dof_set="g")
    with pytest.raises(InputError, match="does not say which degrees of freedom are in the a-set"):
        read(geometry="full.op2")
    with pytest.raises(InputError, match="holds no natural frequencies"):
        read_nastran_op2(folder / "nas2cam.op2")


# --- cards written here; no package needed

HEAD = "DMIG    {name:8s}       0       6       2       0\n"
SMALL = (
    HEAD.format(name="KAAX")
    + "DMIG    KAAX           1       1               1       1    2.+3        +\n"
    + "+              1       2   -1.+3\n"
    + "$ a comment\n"
    + "DMIG    KAAX           1       2               1       2  1.5D+3\n"
)
LARGE = (
    "DMIG*   MAAX                           0               6\n"
    "DMIG*   MAAX                           1               1                \n"
    "*                      1               1 2.000000000D+00\n"
    "DMIG,MAAX,1,2,,1,2,3.\n"
)


def read_cards(tmp_path, text, **options):
    (tmp_path / "cards.pch").write_text(text)
    return read_nastran_dmig(tmp_path / "cards.pch", mass="maax", stiffness="kaax", **options)


def test_small_large_and_free_fields(tmp_path):
    text = SMALL + LARGE.replace("DMIG*   MAAX                           0               6\n", HEAD.format(name="MAAX"))
    structure = read_cards(tmp_path, text)
    np.testing.assert_array_equal(structure.stiffness.toarray(), [[2e3, -1e3], [-1e3, 1.5e3]])
    np.testing.assert_array_equal(structure.mass.toarray(), np.diag([2.0, 3.0]))
    assert structure.dofs.component == ("x", "y")
    assert np.isnan(structure.dofs.position).all()


def test_scalar_points_are_modal_coordinates(tmp_path):
    text = SMALL + HEAD.format(name="MAAX") + "DMIG,MAAX,1,1,,1,1,2.\nDMIG,MAAX,900,0,,900,0,1.\n"
    structure = read_cards(tmp_path, text)
    assert structure.dofs.component == ("x", "y", "mode")
    assert structure.dofs.node.tolist() == [1, 1, -1]
    assert structure.dof_set("massless").tolist() == [1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("DMIG    MAAX           0", "DMIG    MASS           0", r"DMIG MAAX has a column before its"),
        ("1.5D+3", "1.5Q+3", r"line 5: '1.5Q\+3' is no number"),
        ("       1       2   -1.+3", "       1       9   -1.+3", "'9' is no component 0 to 6"),
        ("       1       2   -1.+3", "     1.5       2   -1.+3", r"line 3|line 2: '1.5' is no whole"),
        ("       1       2   -1.+3", "       1       1   -1.+3", "gives an entry twice"),
        ("       6       2", "       1       2", "KAAX: is not symmetric"),
        ("1.5D+3", "1.D999", "not finite"),
        ("1.5D+3", "\t1.5D+3", "has a tab"),
    ],
)
def test_spoilt_cards_name_the_place(tmp_path, old, new, message):
    text = SMALL + HEAD.format(name="MAAX") + "DMIG,MAAX,1,1,,1,1,2.\n"
    assert old in text
    with pytest.raises(InputError, match=message):
        read_cards(tmp_path, text.replace(old, new, 1))


def test_missing_cards_are_named(tmp_path):
    with pytest.raises(InputError, match=r"no DMIG matrix 'MAAX'\. Did you mean 'KAAX'"):
        read_cards(tmp_path, SMALL)
    with pytest.raises(InputError, match="It holds none at all"):
        read_cards(tmp_path, "GRID,1,,0.,0.,0.\n")


# --- nothing is passed over in silence; no package needed

WHOLE = SMALL + HEAD.format(name="MAAX") + "DMIG,MAAX,1,1,,1,1,2.\n"


@pytest.mark.parametrize(
    ("card", "message"),
    [
        ("CQUAD4,1,1,1,2,3,4", r"line 8: CQUAD4 is not read, and may change the model\. Write the DMIG"),
        ("SPC1    1       123456  1", "SPC1 is not read"),
        ("PARAM,WTMASS,.00259", "PARAM WTMASS is not read"),
        ("param,ck2,2.", "PARAM ck2 is not read"),
        ("INCLUDE 'more.pch'", r"line 8: includes a file, which is not read\. Write the lines"),
        ("include,more.pch", "includes a file"),
        ("DMIG    KAAX           0       6       2       0", "DMIG KAAX has a second head"),
        ("DMIG,MAAX,1,2,9,1,2,3.", "has a number where none belongs"),
        ("DMIG,MAAX,1,2,,,2,3.", "has a number where none belongs"),
        ("DMIG,MAAX,1,2,,1,2,3.,,+A\n+B,,,1.", r"line 9: continues the card that ends with 'B'"),
        ("GRID\t1\t\t0.", "has a tab"),
        ("=,*(1),=,*(1.)==\n=(5)", r"line 8: repeats cards \(=\), which is not read"),
    ],
)
def test_cards_that_would_be_passed_over_are_refused_by_line(tmp_path, card, message):
    with pytest.raises(InputError, match=message):
        read_cards(tmp_path, f"{WHOLE}{card}\n")


def test_what_surrounds_matrices_is_read_past(tmp_path):
    """Executive and case control, tables and parameters of printing, and whatever follows ENDDATA."""
    before = "SOL 103\nCEND\nINCLUDE 'case.inc'\nBEGIN BULK\nPARAM,POST,-1\nDTI,A,1,2.,ENDREC\nGRID,1,,0.,0.,0.\n"
    structure = read_cards(tmp_path, f"{before}{WHOLE}ENDDATA\nCQUAD4,1\n")
    np.testing.assert_array_equal(structure.stiffness.toarray(), [[2e3, -1e3], [-1e3, 1.5e3]])


@pytest.mark.parametrize("asked", ["kaax", "maax"])
def test_a_matrix_of_moduli_and_phases_is_refused_where_it_is_asked_for(tmp_path, asked):
    head = "DMIG    KAAX           0       6       2       0       {}\n"
    text = WHOLE.replace(HEAD.format(name="KAAX"), head.format(1), 1)
    assert text != WHOLE
    (tmp_path / "a.pch").write_text(text)
    if asked == "maax":
        found = read_nastran_dmig(tmp_path / "a.pch", mass="maax", stiffness="maax")
        assert found.n == 1
        return
    with pytest.raises(InputError, match=r"KAAX: holds moduli and phases \(POLAR\)"):
        read_nastran_dmig(tmp_path / "a.pch", mass="maax", stiffness="kaax")


@pytest.mark.parametrize(
    ("cards", "message"),
    [
        ("GRDSET,,7\nGRID,1,,1.,2.,3.", r"line 1: GRDSET is not read, and says in which systems"),
        ("GRID,1,,0.,0.,0.\nSEQGP,1,5", "line 2: SEQGP is not read, and says in which order"),
        ("CORD1R,7,1,2,3\nGRID,1,7,0.,0.,0.", "CORD1R is not read, and says where a coordinate"),
        ("GRID,1,,0.,0.,0.\nINCLUDE 'more.bdf'", "line 2: includes a file"),
        ("GRID,1,,0.,0.,0.\nGRID,1,,1.,0.,0.", "line 2: grid 1 is there twice"),
        ("GRID,1,7,0.,0.,0.", r"line 1: coordinate system 7 is not in the file\. Add its CORD2"),
        ("GRID,1,,x,0.,0.", "'x' is no number"),
        ("BEGIN BULK\nGRID,1,,0.,0.,0.\nBEGIN SUPER=2\nGRID,2", "line 3: begins the bulk data of another"),
        ("BEGIN BULK\nGRID,1,,0.,0.,0.\n,,,\n,,\nGRID", "line 5"),
    ],
)
def test_geometry_that_would_be_misread_is_refused_by_line(tmp_path, cards, message):
    (tmp_path / "m.bdf").write_text(cards + "\n")
    with pytest.raises(InputError, match=message):
        read_nastran_dofs(tmp_path / "m.bdf")


@pytest.mark.parametrize(
    "cards", ["SPC1,1,123456,7", "RBE2,9,3,123456,7", "MPC,1,3,1,1.,7,1,-1.", "GRID,8,,1.,1.,1.,,123"]
)
def test_constraints_that_matrices_of_the_g_set_do_not_show_are_refused(library, tmp_path, cards):
    matrix = np.eye(18 if cards.startswith("GRID") else 12)
    library["op4"].write(str(tmp_path / "m.op4"), {"mgg": matrix, "kgg": matrix})
    (tmp_path / "m.bdf").write_text(f"GRID,7,,1.,2.,3.\nGRID,3,,4.,5.,6.\n{cards}\n")
    with pytest.raises(InputError, match=r"m\.bdf: line 3: \w+: holds degrees of freedom or ties"):
        read_nastran_op4(tmp_path / "m.op4", mass="mgg", stiffness="kgg", geometry=tmp_path / "m.bdf", dof_set="g")


def test_places_go_through_with_all_their_digits(library, tmp_path):
    place = np.random.default_rng(3).standard_normal(3)
    cards = (
        f"GRID*   {7:16d}{'':16s}{place[0]:16.9e}{place[1]:16.9e}\n*       {place[2]:16.9e}\n"
        f"  GRID,8,,{place[0]!r},{place[1]!r},1.5-3\n"
    )
    (tmp_path / "m.bdf").write_text(cards)
    points = read_nastran_dofs(tmp_path / "m.bdf").points[::6]
    np.testing.assert_array_equal(points[0], [float(f"{x:.9e}") for x in place])
    np.testing.assert_array_equal(points[1], [place[0], place[1], 1.5e-3])


# --- guards around the library; no package needed


def chain(*lengths):
    return b"".join(np.array([n], "<i4").tobytes() + bytes(n) + np.array([n], "<i4").tobytes() for n in lengths)


def test_chain_of_records_is_followed_to_the_end(tmp_path):
    path = tmp_path / "a.op4"
    path.write_bytes(chain(24, 0, 100))
    check_records(path)
    for spoilt in (
        chain(24, 100)[:-4],
        chain(24) + b"\x00",
        chain(24, 100)[:-4] + b"\x01\x00\x00\x00",
        chain(24) + np.array([-8, 0, -8], "<i4").tobytes(),
    ):
        path.write_bytes(spoilt)
        with pytest.raises(InputError, match="chain of records breaks at byte 32 of"):
            check_records(path)
    path.write_bytes(chain(77))
    with pytest.raises(InputError, match="does not start like a binary file of Nastran"):
        check_records(path)


DENSE = """       2       2       6       2KAA     1P,3E23.16
       1       1       2
 2.0000000000000000E+00 1.0000000000000000E+00
       2       1       2
 1.0000000000000000E+00 3.0000000000000000E+00
       3       1       1
 1.0000000000000000E+00
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("       2       1       2", "       2       1 9999999"),
        ("       2       1       2", "       2       1      -2"),
        ("       2       1       2", "      -2       1       2"),
        ("       2       1       2", "       2       0       2"),
        (" 1.0000000000000000E+00 3.0", " 1.0000000\r000000000E+00 3.0"),
        ("       3       1       1\n 1.0000000000000000E+00\n", ""),
        ("       2       2       6", "       2       x       6"),
    ],
)
def test_columns_of_text_are_followed_to_the_end(tmp_path, old, new):
    # pyYeti would take a damaged count at its word, and read empty lines a million times
    path = tmp_path / "a.op4"
    path.write_text(DENSE)
    check_lines(path)
    assert old in DENSE
    path.write_text(DENSE.replace(old, new, 1))
    with pytest.raises(InputError, match=r"a\.op4: matrix 1: breaks off or is garbled"):
        check_lines(path)


def test_what_the_library_raises_names_the_file():
    message = r"a\.op2: cannot be read \(KeyError: 'x'\)"
    with pytest.raises(InputError, match=message), reading(Path("a.op2")):
        raise KeyError("x")


def test_missing_package_is_named(tmp_path, monkeypatch):
    for module in ("pyyeti.nastran.op4", "pyyeti.nastran.bulk"):
        monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / "a.op4").write_text("       1       1       6       2M\n")
    (tmp_path / "a.bdf").write_text("GRID,1,,0.,0.,0.\n")
    with pytest.raises(StickslipError, match=r"pyyeti is not installed.*stickslip\[readers\]"):
        read_nastran_op4(tmp_path / "a.op4", mass="m", stiffness="m", geometry=tmp_path / "a.bdf", dof_set="g")
