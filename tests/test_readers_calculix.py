"""Files that CalculiX 2.20 wrote (tests/data/calculix) and the reference sector, where it lies beside the repository."""

import csv
import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from stickslip import InputError, Structure, Units
from stickslip.model import (
    assemble_deck,
    model_summary,
    natural_frequencies,
    read_calculix_matrices,
    read_deck,
    read_frd,
    rotating_solid,
)
from stickslip.model.readers.node_table import mesh_nodes
from stickslip.model.readers.open_model import read_structure
from stickslip.model.readers.positions import doubt_about_positions
from stickslip.reduction import CyclicSector, cyclic_sector, travelling_wave

DATA = Path(__file__).parent / "data" / "calculix"
REFERENCE = Path(__file__).parent.parent.parent / "shared" / "reference" / "calculix"
MM = Units.mm_t_s()
PRINTED = 1.1e-5  # Hz: an .frd file gives five decimals, cut, not rounded
STORED = 1e-12  # matrices are stored with 14 digits
needs_reference = pytest.mark.skipif(
    not REFERENCE.is_dir(), reason="../shared/reference/calculix is not beside the repository"
)


def apart(a, b) -> float:
    """Relative difference of two matrices in the Frobenius norm."""
    norm = scipy.sparse.linalg.norm
    return float(norm(scipy.sparse.csr_array(a - b)) / norm(scipy.sparse.csr_array(b)))


def copied(folder: Path, *names: str) -> Path:
    """Copy files of the data folder, unpacked, so that a test can spoil them."""
    for name in names:
        content = (DATA / name).read_bytes()
        content = gzip.decompress(content) if name.endswith(".gz") else content
        (folder / name.removesuffix(".gz")).write_bytes(content)
    return folder


@pytest.fixture
def brick_folder(tmp_path):
    return copied(tmp_path, "brick_matrix.sti.gz", "brick_matrix.mas.gz", "brick_matrix.dof", "brick_matrix.inp")


# ---- matrices


def test_matrices_give_the_frequencies_of_the_results_file():
    structure = read_calculix_matrices(DATA / "brick_matrix", units=MM)
    results = read_frd(DATA / "brick.frd.gz", units=MM)
    found = natural_frequencies(structure, 6)
    printed = [f.frequency_hz for f in results.fields]
    np.testing.assert_allclose(found, printed, rtol=1e-10, atol=PRINTED)
    assert structure.n == 72
    assert set(structure.sets) == {"NALL", "TIP"}  # ROOT is clamped
    assert set(structure.dofs.node[structure.sets["TIP"]]) == set(range(210, 250, 10)) | {260, 290, 310, 320}


def test_modes_of_the_results_file_are_those_of_the_matrices():
    structure = read_calculix_matrices(DATA / "brick_matrix.sti.gz", units=MM)
    field = read_frd(DATA / "brick.frd.gz", units=MM).field("DISP", 3)
    row = {node: i for i, node in enumerate(field.nodes)}
    shape = np.array(
        [
            field.values[row[n], "xyz".index(c)]
            for n, c in zip(structure.dofs.node, structure.dofs.component, strict=True)
        ]
    )
    square = (2 * np.pi * field.frequency_hz) ** 2
    assert shape @ structure.mass @ shape == pytest.approx(1.0, rel=1e-5)  # printed with 6 digits
    assert shape @ structure.stiffness @ shape == pytest.approx(square, rel=1e-4)


def test_units_are_converted_once():
    """The same numbers read as mm-t-s and as SI differ by the units of each quantity."""
    si = read_calculix_matrices(DATA / "brick_matrix", units=Units.si(), plausible=False)
    mm = read_calculix_matrices(DATA / "brick_matrix", units=MM)
    assert apart(mm.stiffness, 1e3 * si.stiffness) < STORED  # N/mm
    assert apart(mm.mass, 1e3 * si.mass) < STORED  # t
    np.testing.assert_allclose(mm.dofs.position, 1e-3 * si.dofs.position, rtol=1e-15)


def test_a_results_file_is_converted_once_in_every_unit_of_time():
    """Modes in mm, kg and ms beside the same numbers in SI: frequencies by 1/ms, mass-normalised shapes by 1/sqrt(mass)."""
    own = Units(1e-3, 4.0, 1e-3, "mm-4kg-ms")
    plain, found = (read_frd(DATA / "brick.frd.gz", units=u) for u in (Units.si(), own))
    np.testing.assert_allclose(found.nodes.points, 1e-3 * plain.nodes.points, rtol=1e-15)
    for a, b in zip(plain.fields, found.fields, strict=True):
        assert b.frequency_hz == pytest.approx(1e3 * a.frequency_hz, rel=1e-14)
        assert (a.name, a.nodes.tolist()) == (b.name, b.nodes.tolist())
        np.testing.assert_allclose(b.values, a.values / 2.0, rtol=1e-15)


def test_wrong_units_are_named():
    with pytest.raises(InputError, match=r"in SI its mass .* that looks like mm-t-s\."):
        read_calculix_matrices(DATA / "brick_matrix")
    with pytest.raises(InputError, match=r"SOLID SECTION: in SI the density .* looks like mm-t-s\."):
        read_deck(DATA / "brick_matrix.inp")


@pytest.mark.parametrize("source", ["frd", "csv", "mesh"])
def test_positions_from_elsewhere(brick_folder, source):
    expected = read_calculix_matrices(brick_folder / "brick_matrix", units=MM)
    deck = read_deck(brick_folder / "brick_matrix.inp", units=MM)
    (brick_folder / "brick_matrix.inp").unlink()
    with pytest.raises(InputError, match=r"positions of the nodes .* Give mesh="):
        read_calculix_matrices(brick_folder / "brick_matrix", units=MM)
    if source == "frd":
        mesh = DATA / "brick.frd.gz"
    elif source == "mesh":
        mesh = deck.mesh
    else:
        mesh = brick_folder / "nodes.csv"
        table = mesh_nodes(deck.mesh)
        rows = [
            f"{n},{x},{y},{z}," + ("TIP" if n == 240 else "")
            for n, (x, y, z) in zip(table.numbers, table.points / MM.length, strict=True)
        ]
        mesh.write_text("\n".join(["node,x,y,z,set", *rows]))
    found = read_calculix_matrices(brick_folder / "brick_matrix", units=MM, mesh=mesh)
    np.testing.assert_allclose(found.dofs.position, expected.dofs.position, atol=1e-15)
    if source == "csv":
        assert list(found.dofs.node[found.sets["TIP"]]) == [240, 240, 240]


def test_a_cyclic_export_is_complex_hermitian_in_our_convention():
    """``[[R, -I], [I, R]]``: the independent check assembles the sector and ties it by hand."""
    stored = read_calculix_matrices(DATA / "ring2", units=MM)
    assert np.iscomplexobj(stored.stiffness)
    assert apart(stored.stiffness, stored.stiffness.conj().T) == 0
    sector = assemble_deck(read_deck(DATA / "ring2.inp", units=MM))
    tied = tied_by_hand(sector, stored, 12, 2, ("cyclic_low", "cyclic_high"))
    assert apart(tied.stiffness, stored.stiffness) < 1e-12
    assert apart(tied.mass, stored.mass) < 1e-12


def tied_by_hand(sector: Structure, stored: Structure, sectors: int, wave: int, faces: tuple[str, str]) -> Structure:
    """Put ``u_high = e^{iθ} R u_low`` into the sector, keeping the dofs of `stored`: no code of reduction/."""
    pitch, phase = 2 * np.pi / sectors, 2 * np.pi * wave / sectors
    turn = np.array([[np.cos(pitch), -np.sin(pitch), 0], [np.sin(pitch), np.cos(pitch), 0], [0, 0, 1]])
    place = {key: i for i, key in enumerate(zip(stored.dofs.node, stored.dofs.component, strict=True))}
    P = np.zeros((sector.n, stored.n), dtype=complex)
    for i, key in enumerate(zip(sector.dofs.node, sector.dofs.component, strict=True)):
        if key in place:
            P[i, place[key]] = 1.0
    low, high = (sector.sets[name].reshape(-1, 3) for name in faces)
    turned = sector.dofs.position[low[:, 0]] @ turn.T
    _, partner = cKDTree(sector.dofs.position[high[:, 0]]).query(turned)
    for a, b in zip(low, high[partner], strict=True):
        P[a] = np.exp(-1j * phase) * turn.T @ P[b]
    P = scipy.sparse.csr_array(P)
    K, M = (P.conj().T @ m @ P for m in (sector.stiffness, sector.mass))
    return replace(stored, mass=M, stiffness=K)


# ---- decks


@pytest.mark.parametrize("stem", ["brick_matrix", "one_c3d4", "one_c3d10", "one_c3d8", "one_c3d20r"])
def test_decks_assemble_to_the_stored_matrices(stem):
    """Every plain kind of element, distorted, integrated as the solver does."""
    deck = read_deck(DATA / f"{stem}.inp", units=MM)
    stored = read_calculix_matrices(DATA / stem, units=MM)
    ours = assemble_deck(deck)
    assert list(ours.dofs.node) == list(stored.dofs.node)
    assert apart(ours.stiffness, stored.stiffness) < STORED
    assert apart(ours.mass, stored.mass) < STORED
    assert deck.ignored == ()


def test_deck_with_a_cyclic_tie_gives_every_nodal_diameter():
    deck = read_deck(DATA / "ring2.inp", units=MM)
    assert deck.sectors == 12
    # CalculiX takes no support on the dependent face: the tie carries it over
    assert len(deck.mesh.node_sets["root"]) == 6
    sector = cyclic_sector(assemble_deck(deck), deck.sectors, axis=deck.axis)
    fields = read_frd(DATA / "ring_modes.frd.gz", units=MM).fields
    for diameter in range(7):
        printed = {f.frequency_hz for f in fields if f.nodal_diameter == diameter}
        found = natural_frequencies(travelling_wave(sector, diameter), 4)
        for frequency in printed:
            assert np.abs(found - frequency).min() < PRINTED


def test_cyclic_faces_of_element_faces(tmp_path):
    """The same ring, its faces given as element faces; supports along the axis cross the tie as well."""
    copied(tmp_path, "ring2.inp", "ring_nodes.inc")
    expected = read_deck(tmp_path / "ring2.inp", units=MM)
    text = (tmp_path / "ring2.inp").read_text()
    for name, nodes, faces in (("S_LO", "CYC_LO", "1, S3\n3, S3"), ("S_HI", "CYC_HI", "2, S5\n4, S5")):
        text = text.replace(
            f"*SURFACE, NAME={name}, TYPE=NODE\n{nodes}\n", f"*SURFACE, NAME={name}, TYPE=ELEMENT\n{faces}\n"
        )
    (tmp_path / "faces.inp").write_text(text)
    found = read_deck(tmp_path / "faces.inp", units=MM)
    for name in ("cyclic_low", "cyclic_high", "root"):
        assert set(found.mesh.node_sets[name]) == set(expected.mesh.node_sets[name])
    (tmp_path / "axial.inp").write_text(text.replace("BORE, 1, 3", "BORE, 3, 3"))
    held = read_deck(tmp_path / "axial.inp", units=MM).held
    assert held.sum(axis=0).tolist() == [0, 0, 6]
    (tmp_path / "oblique.inp").write_text(text.replace("BORE, 1, 3", "BORE, 1, 1"))
    with pytest.raises(InputError, match="on the cyclic faces are not the same after a turn"):
        read_deck(tmp_path / "oblique.inp", units=MM)
    (tmp_path / "none.inp").write_text(text.replace("1, S3", "1, S7"))
    with pytest.raises(InputError, match="'S7' is no face of C3D8"):
        read_deck(tmp_path / "none.inp", units=MM)


@needs_reference
def test_reference_sector_at_rest():
    """Deck and stored matrices agree; frequencies are those that CalculiX printed with seven digits."""
    stem = REFERENCE / "n24_coarse_matrix_free"
    stored = read_calculix_matrices(stem)
    deck = read_deck(f"{stem}.inp")
    ours = assemble_deck(deck)
    assert apart(ours.stiffness, stored.stiffness) < 1e-10
    assert apart(ours.mass, stored.mass) < 1e-10
    sector = cyclic_sector(stored, 24, low="CYC_LO", high="CYC_HI")
    found = natural_frequencies(travelling_wave(sector, 1), 5)
    np.testing.assert_allclose(found, printed_frequencies("free", 1), rtol=1e-6)


@pytest.mark.validation
@needs_reference
def test_reference_sector_at_every_nodal_diameter():
    stored = read_calculix_matrices(REFERENCE / "n24_coarse_matrix_free")
    sector = cyclic_sector(stored, 24, low="CYC_LO", high="CYC_HI")
    for diameter in range(13):
        found = natural_frequencies(travelling_wave(sector, diameter), 5)
        np.testing.assert_allclose(found, printed_frequencies("free", diameter), rtol=1e-6)
    cyclic = read_calculix_matrices(REFERENCE / "n24_coarse_matrix_cyc3")
    found = natural_frequencies(cyclic, 5)
    np.testing.assert_allclose(found, printed_frequencies("free", 3), rtol=1e-6)


@needs_reference
def test_reference_sector_with_preload():
    """Stored matrices of the untied sector, and the deck's own speed, axis and tie."""
    stem = REFERENCE / "n24_coarse_matrix_pre"
    mass = REFERENCE / "n24_coarse_matrix_free.mas.gz"
    stored = read_calculix_matrices(stem, mass=mass)
    expected = printed_frequencies("one_sector_prestressed_8000rpm", None)
    np.testing.assert_allclose(natural_frequencies(stored, 10), expected, rtol=1e-6)
    sector = preloaded_sector()
    found = natural_frequencies(travelling_wave(sector, 0), 5)
    expected = printed_frequencies("prestressed_8000rpm", 0)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.validation
@needs_reference
def test_reference_sector_with_preload_at_every_nodal_diameter():
    sector = preloaded_sector()
    for diameter in range(13):
        found = natural_frequencies(travelling_wave(sector, diameter), 5)
        expected = printed_frequencies("prestressed_8000rpm", diameter)
        np.testing.assert_allclose(found, expected, rtol=1e-6)


def preloaded_sector() -> CyclicSector:
    """Return the reference sector at the speed that its deck names, tied in the static solution."""
    deck = read_deck(REFERENCE / "n24_coarse_cyc_pre.inp")
    assert deck.speed == pytest.approx(8000 * 2 * np.pi / 60, rel=1e-10)
    solid = rotating_solid(deck.mesh, deck.material, deck.axis, quadrature=deck.quadrature)
    rest = cyclic_sector(solid.structure, deck.sectors, axis=deck.axis)
    return replace(rest, structure=solid.at_speed(deck.speed, tie=rest.tie))


def printed_frequencies(case: str, diameter: int | None) -> list[float]:
    with (REFERENCE / "n24_coarse_frequencies.csv").open() as file:
        rows = list(csv.DictReader(file))
    wanted = "" if diameter is None else str(diameter)
    return [float(r["frequency_hz"]) for r in rows if (r["case"], r["nodal_diameter"]) == (case, wanted)]


# ---- results


def test_static_results():
    """A bending force of 100 N: the deflection of the same matrices, and stresses in Pa."""
    results = read_frd(DATA / "brick_static.frd", units=MM)
    assert results.mesh is not None
    assert results.mesh.cells.shape == (2, 20)
    structure = read_calculix_matrices(DATA / "brick_matrix", units=MM)
    force = np.zeros(structure.n)
    loaded = (structure.dofs.node == 210) & (np.array(structure.dofs.component) == "z")
    force[loaded] = 100.0
    u = scipy.sparse.linalg.spsolve(structure.stiffness.tocsc(), force)
    field = results.field("DISP")
    tip = field.values[field.nodes == 240][0]
    np.testing.assert_allclose(tip, u[structure.dofs.node == 240], rtol=1e-5)
    assert field.frequency_hz is None
    stress = results.field("STRESS")
    assert stress.components == ("SXX", "SYY", "SZZ", "SXY", "SYZ", "SZX")
    assert 1e6 < np.abs(stress.values).max() < 1e8
    with pytest.raises(InputError, match=r"no field 'TEMP'.*DISP at step 1"):
        results.field("TEMP")


def test_a_bricks_nodes_stand_in_vtk_order():
    """CalculiX writes upright edges before top ones; ours are checked by where mid-side nodes lie."""
    mesh = read_frd(DATA / "brick.frd.gz", units=MM).mesh
    corners = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    at = mesh.points[mesh.cells]
    for middle, (a, b) in enumerate(corners, 8):
        np.testing.assert_allclose(at[:, middle], (at[:, a] + at[:, b]) / 2, atol=1e-12)
    deck = read_deck(DATA / "brick_matrix.inp", units=MM).mesh
    np.testing.assert_array_equal(mesh.cells, deck.cells)


def in_short_format(line: str) -> str:
    """Return a line of an .frd file with node numbers in five columns instead of ten."""
    if line.startswith(" -1") and len(line) > 20:
        return line[:3] + line[8:]
    if line.startswith(" -2") and len(line) > 20:
        return line[:3] + "".join(line[k + 5 : k + 10] for k in range(3, 103, 10))
    if line.startswith(("    2C", "    3C")):
        return line[:73] + "0"
    return line[:74] + "0" if line.startswith("  100C") else line


def test_short_format_of_results(tmp_path):
    copied(tmp_path, "brick.frd.gz")
    lines = (tmp_path / "brick.frd").read_text().splitlines()
    (tmp_path / "short.frd").write_text("\n".join(map(in_short_format, lines)) + "\n")
    short, long = (read_frd(tmp_path / name, units=MM) for name in ("short.frd", "brick.frd"))
    np.testing.assert_array_equal(short.mesh.cells, long.mesh.cells)
    np.testing.assert_array_equal(short.mesh.numbers, long.mesh.numbers)
    for a, b in zip(short.fields, long.fields, strict=True):
        np.testing.assert_array_equal(a.values, b.values)


@pytest.mark.parametrize("end", ["\r\n", "\n"])
def test_line_ends_and_marks_of_other_systems(brick_folder, end):
    copied(brick_folder, "brick.frd.gz")
    expected = read_calculix_matrices(DATA / "brick_matrix", units=MM)
    for path in brick_folder.iterdir():
        text = path.read_text().replace("\n", end)
        path.write_bytes("\ufeff".encode() + text.encode())
    found = read_calculix_matrices(brick_folder / "brick_matrix", units=MM)
    assert apart(found.stiffness, expected.stiffness) == 0
    assert list(found.sets) == list(expected.sets)
    assert len(read_frd(brick_folder / "brick.frd", units=MM).fields) == 6
    assert assemble_deck(read_deck(brick_folder / "brick_matrix.inp", units=MM)).n == 72


# ---- damage


def spoil(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("sti", "72 72  2.0397135136089e+06\n", "", r"lacks the diagonal|71 equations"),
        ("sti", "72 72  2.0397135136089e+06\n", "72 72  2.0397", "ends in the middle of a line"),
        ("sti", "72 72 ", "73 73 ", "73 equations, the .dof file lists 72"),
        ("sti", "71 72 ", "71 71 ", "row 71, column 71 more than once"),
        ("sti", "71 72 ", "71 72.5 ", "column 72.5 is no whole number"),
        ("sti", "71 72 ", "0 72 ", "row 0, column 72 is outside"),
        ("mas", "1 1 ", "1 1 nan ", r"line 1: needs 3 numbers, got 4"),
        ("mas", "1 2 ", "1 x2 ", r"line 2: 'x2' is no finite number"),
        ("dof", "20.1", "20.9", r"line 1: needs node\.direction, got '20\.9'"),
        ("dof", "20.2", "20.1", "names a dof twice"),
        ("dof", "20.1", "21.1", r"brick_matrix\.inp: lacks 1 nodes, e\.g\. 21"),
    ],
)
def test_damaged_matrices_are_named(brick_folder, name, old, new, message):
    spoil(brick_folder / f"brick_matrix.{name}", old, new)
    with pytest.raises(InputError, match=message):
        read_calculix_matrices(brick_folder / "brick_matrix", units=MM)


def test_infinite_entries_and_missing_files(brick_folder):
    path = brick_folder / "brick_matrix.mas"
    first = path.read_text().splitlines()[0]
    spoil(path, first, "1 1 inf")
    with pytest.raises(InputError, match=r"line 1: 'inf' is no finite number"):
        read_calculix_matrices(brick_folder / "brick_matrix", units=MM)
    path.unlink()
    with pytest.raises(InputError, match=r"the mass is not there.*give mass="):
        read_calculix_matrices(brick_folder / "brick_matrix", units=MM)


def test_packed_files_are_bounded(brick_folder):
    whole = gzip.compress((brick_folder / "brick_matrix.sti").read_bytes())
    (brick_folder / "brick_matrix.sti").unlink()
    (brick_folder / "brick_matrix.sti.gz").write_bytes(whole[:-20])
    with pytest.raises(InputError, match="no whole gzip file"):
        read_calculix_matrices(brick_folder / "brick_matrix", units=MM)
    (brick_folder / "brick_matrix.sti.gz").write_bytes(gzip.compress(b"1 1 1.0\n" * 3_000_000))
    with pytest.raises(InputError, match="more than 200 times its size"):
        read_calculix_matrices(brick_folder / "brick_matrix", units=MM)


def test_a_pair_that_is_none_is_named(tmp_path):
    copied(tmp_path, "ring2.sti.gz", "ring2.mas.gz", "ring2.dof", "ring2.inp", "ring_nodes.inc")
    n = len((tmp_path / "ring2.dof").read_text().split())
    lines = (tmp_path / "ring2.sti").read_text().splitlines()
    last = f"{2 * n} {2 * n} "
    lines = [last + " 1.0e+05" if line.startswith(last) else line for line in lines]
    (tmp_path / "ring2.sti").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match="not the pair of a travelling wave"):
        read_calculix_matrices(tmp_path / "ring2", units=MM)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (" 9999", "", "does not end with 9999"),
        (" -3\n    3C", "    3C", r"line \d+: a block does not end with -3"),
        ("    2C                            32", "    2C                            99", "header says 99"),
        ("    2C                            32", "    2C                    1000000000", "header says"),
        (
            " 1.00000E+01 0.00000E+00 0.00000E+00\n",
            " 1.0000xE+01 0.00000E+00 0.00000E+00\n",
            r"' 1\.0000xE\+01' is no finite number",
        ),
        (" -2        10        20", " -2        10        2x", "is no whole number"),
        ("    32                                     1\n", "    32                                     2\n", "binary"),
    ],
)
def test_damaged_results_are_named(tmp_path, old, new, message):
    copied(tmp_path, "brick.frd.gz")
    spoil(tmp_path / "brick.frd", old, new)
    with pytest.raises(InputError, match=message):
        read_frd(tmp_path / "brick.frd", units=MM)


@settings(max_examples=40)
@given(data=st.data())
def test_files_that_were_cut_never_pass(tmp_path_factory, data):
    """A cut file is named; without its end it cannot be right."""
    folder = copied(
        tmp_path_factory.mktemp("cut"),
        "brick_matrix.sti.gz",
        "brick_matrix.mas.gz",
        "brick_matrix.dof",
        "brick_matrix.inp",
        "brick.frd.gz",
    )
    name = data.draw(st.sampled_from(["brick_matrix.sti", "brick_matrix.mas", "brick_matrix.dof", "brick.frd"]))
    content = (folder / name).read_bytes()
    # the last line of an .frd file says no more than that it is whole
    kept = data.draw(st.integers(0, len(content) - (8 if name.endswith("frd") else 1)))
    (folder / name).write_bytes(content[:kept])
    with pytest.raises(InputError):
        read_frd(folder / name) if name.endswith("frd") else read_calculix_matrices(folder / "brick_matrix", units=MM)


@settings(max_examples=40)
@given(data=st.data())
def test_garbled_files_are_named_or_read(tmp_path_factory, data):
    """A changed byte is found, or gives another number: never another error."""
    folder = copied(
        tmp_path_factory.mktemp("garble"),
        "brick_matrix.sti.gz",
        "brick_matrix.mas.gz",
        "brick_matrix.dof",
        "brick_matrix.inp",
        "brick.frd.gz",
    )
    name = data.draw(st.sampled_from(sorted(p.name for p in folder.iterdir())))
    content = bytearray((folder / name).read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    (folder / name).write_bytes(bytes(content))
    for read in (
        lambda: read_frd(folder / "brick.frd", units=MM),
        lambda: read_deck(folder / "brick_matrix.inp", units=MM, plausible=False),
        lambda: read_calculix_matrices(folder / "brick_matrix", units=MM, plausible=False),
    ):
        try:
            read()
        except InputError as error:
            assert str(error).count(": ") >= 1  # noqa: PT017  # place, then problem


def other_mesh(deck):
    """Return the mesh with the same node numbers at other places, in a box of the same size."""
    mesh = deck.mesh
    return replace(mesh, points=mesh.points[np.random.default_rng(0).permutation(len(mesh.points))])


def test_positions_of_another_mesh_are_refused():
    """A rigid rotation about them strains the model; 30 % of the terms remain with another mesh of the sector of 24 blades."""
    deck = read_deck(DATA / "brick_matrix.inp", units=MM)
    with pytest.raises(InputError, match="do not fit the stiffness of brick_matrix: a rigid rotation"):
        read_calculix_matrices(DATA / "brick_matrix", units=MM, mesh=other_mesh(deck))
    taken = read_calculix_matrices(DATA / "brick_matrix", units=MM, mesh=other_mesh(deck), plausible=False)
    remarks = model_summary(taken, n_modes=0).remarks
    assert any("probably belong to another mesh" in text for text in remarks)


@needs_reference
def test_preload_is_no_doubt_about_positions():
    """Stresses at 8000 rpm leave 1.4e-4 of the terms, far below the limit of 5e-3."""
    structure = read_calculix_matrices(
        REFERENCE / "n24_coarse_matrix_pre.sti.gz", mass=REFERENCE / "n24_coarse_matrix_free.mas.gz"
    )
    assert doubt_about_positions(structure) is None
    turned = replace(structure, dofs=replace(structure.dofs, position=structure.dofs.position[:, [1, 2, 0]]))
    assert doubt_about_positions(turned) is not None


def test_results_are_no_structure() -> None:
    path = DATA / "brick_static.frd"
    with pytest.raises(InputError, match=r"part\.blade\.file: brick_static\.frd holds results, .*Give a deck"):
        read_structure("part.blade.file", path)
