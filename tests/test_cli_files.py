"""What ``stickslip inspect`` says of files, and what ``check`` says of studies whose files are wrong."""

import re
from pathlib import Path

import numpy as np
import pytest
from small_v2 import write_example_deck
from test_cli import done, refused

from stickslip.errors import InputError
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.readers.units import Units
from stickslip.model.structure_file import save_structure
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("peak_alone")

ROOT = Path(__file__).parents[1]
CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)


def write_deck(path: Path, length: float = 1.0) -> Path:
    """Write a cantilever of two cubes of a tenth of a metre (SI) or of other units as a deck."""
    points = 0.1 * np.vstack([CUBE, CUBE[[1, 3, 5, 7]] + [1, 0, 0]]) / length
    lines = ["*NODE, NSET=ALL", *(f"{i + 1}, {', '.join(map(repr, map(float, p)))}" for i, p in enumerate(points))]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=E", "1, 1, 2, 4, 3, 5, 6, 8, 7", "2, 2, 9, 10, 4, 6, 11, 12, 8"]
    lines += ["*NSET, NSET=FOOT", "1, 3, 5, 7", "*NSET, NSET=TIP", "9, 10, 11, 12"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850."]
    lines += ["*SOLID SECTION, ELSET=E, MATERIAL=STEEL"]
    path.write_text("\n".join(lines) + "\n")
    return path


def file_study(folder: Path, more: str = "", model: str = "deck.inp", units: str = "SI") -> Path:
    path = folder / "study.toml"
    path.write_text(
        f'schema_version = 2\n[part.stub]\nfile = "{model}"\nunits = "{units}"\n{more}\n[modes]\nnumber = 3\n'
    )
    return path


def inspected(*words: str) -> dict[str, str]:
    return {line[:26].strip(): line[26:].strip() for line in done(*words).splitlines()}


def test_inspect_says_what_is_in_a_file(tmp_path: Path) -> None:
    said = done("inspect", str(write_deck(tmp_path / "deck.inp")), "--frequencies", "8")
    rows = {line[:26].strip(): line[26:].strip() for line in said.splitlines()}
    assert rows["nodes"] == "12"
    assert rows["dofs"] == "36"
    assert rows["set FOOT"] == "4 nodes"
    assert rows["rigid modes"] == "6"
    assert len(rows["frequencies (Hz)"].split(",")) == 8
    # beside the six rigid ones
    assert float(rows["frequencies (Hz)"].split(",")[6]) > 100.0
    assert "none.inp" in refused("inspect", str(tmp_path / "none.inp"))
    (tmp_path / "notes.txt").write_text("x")
    assert "no reader for files '.txt'" in refused("inspect", str(tmp_path / "notes.txt"))
    assert "unknown unit system 'furlong'" in refused("inspect", str(tmp_path / "deck.inp"), "--units", "furlong")


def test_inspect_gives_the_whole_mass_and_names_what_sets_hold(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp")
    deck.write_text(deck.read_text() + "*BOUNDARY\nFOOT, 1, 3\n")
    rows = inspected("inspect", str(deck), "--frequencies", "0")
    whole = 2 * 7850 * 1e-3
    assert float(rows["mass (kg)"]) == pytest.approx(whole, rel=1e-5)
    assert float(rows["free mass x, y, z (kg)"].split(",")[0]) < 0.9 * whole
    assert rows["centre of mass (m)"] == "0.1, 0.05, 0.05"
    assert rows["set TIP"] == "4 nodes"
    model = read_study(file_study(tmp_path)).model()
    assert model.facts.mass == pytest.approx(whole, rel=1e-12)  # as the commands say
    save_structure(model.parts["stub"].structure, tmp_path / "beam.npz")
    assert inspected("inspect", str(tmp_path / "beam.npz"))["set TIP"] == "12 dofs"


def test_a_picture_is_no_deck(tmp_path: Path) -> None:
    picture = tmp_path / "picture.inp"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    assert f"{picture}: is no text: byte 9 is zero" in refused("inspect", str(picture))
    assert "is no text" in refused("check", str(file_study(tmp_path, model="picture.inp")))


def test_a_misspelt_keyword_of_a_material_is_named(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp")
    text = deck.read_text()
    deck.write_text(text.replace("*ELASTIC", "*ELASTICX"))
    said = refused("inspect", str(deck))
    assert "*ELASTICX is not known, and may change the model. Did you mean 'ELASTIC'?" in said
    deck.write_text(re.sub(r"\*ELASTIC\n.*\n", "", text))
    said = refused("inspect", str(deck))
    assert "material 'STEEL' has no *ELASTIC. Add it to *MATERIAL, NAME=STEEL. " in said
    deck.write_text(text.replace("MATERIAL=STEEL", "MATERIAL=STEAL"))
    assert "Did you mean 'STEEL'?" in refused("inspect", str(deck))


def test_remedies_are_options_and_keys_not_arguments(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp")
    deck.write_text(deck.read_text() + "*SUBMODEL\n")
    said = refused("check", str(file_study(tmp_path)))
    assert "*SUBMODEL changes the model and is not read. Let the solver write its matrices and read these." in said
    assert "ignore" not in said + refused("inspect", str(deck))
    (tmp_path / "job.sti").write_text("1 1 1.0\n")
    (tmp_path / "job.dof").write_text("1.1\n")
    assert "Give --mesh (a deck .inp" in refused("inspect", str(tmp_path / "job.sti"))
    said = refused("check", str(file_study(tmp_path, model="job.sti")))
    assert "Give part.stub.mesh (a deck .inp" in said


def test_units_that_give_absurd_numbers_are_doubted(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    said = refused("check", str(file_study(tmp_path, units="mm-t-s")))
    assert "that looks like SI" in said
    assert "Correct part.stub.units, or give part.stub.plausible = false" in said


@pytest.mark.parametrize("plausible", [True, False])
def test_matrices_with_the_mesh_of_another_job(tmp_path: Path, *, plausible: bool) -> None:
    data = ROOT / "tests" / "data" / "calculix"
    for end in (".sti.gz", ".mas.gz", ".dof"):
        (tmp_path / f"brick_matrix{end}").write_bytes((data / f"brick_matrix{end}").read_bytes())
    deck = read_deck(data / "brick_matrix.inp", units=Units.mm_t_s())
    points = 1e3 * np.random.default_rng(0).permutation(deck.mesh.points)
    rows = [f"{n},{x},{y},{z}" for n, (x, y, z) in zip(deck.mesh.numbers, points, strict=True)]
    (tmp_path / "other.csv").write_text("\n".join(["node,x,y,z", *rows]) + "\n")
    words = ("--mesh", str(tmp_path / "other.csv"), "--units", "mm-t-s", "--frequencies", "0")
    said = done("inspect", str(tmp_path / "brick_matrix.sti.gz"), *words)
    assert "they probably belong to another mesh" in said
    more = f'mesh = "other.csv"\nplausible = {str(plausible).lower()}'
    study = file_study(tmp_path, more, "brick_matrix.sti.gz", "mm-t-s")
    if plausible:
        said = refused("check", str(study))
        assert "other.csv: its nodes do not fit the stiffness of brick_matrix" in said
        assert "or part.stub.plausible = false where they are right" in said
    else:
        done("check", str(study))


def without_tie(path: Path) -> Path:
    """Take the cyclic tie out of the deck of a study, so that the study has to name faces and sectors."""
    deck = path.parent / "sector.inp"
    lines, kept = iter(deck.read_text().splitlines()), []
    for line in lines:
        if line.startswith(("*TIE", "*CYCLIC SYMMETRY MODEL")):
            next(lines)
        else:
            kept.append(line)
    deck.write_text("\n".join(kept) + "\n")
    return path


@pytest.mark.parametrize(
    ("low", "high", "sectors", "said"),
    [("CYCLIC_LOW", "CYCLIC_HIGH", 23, "15.652°"), ("CYCLIC_LOW", "CYCLIC_HIHG", 24, "Did you mean 'CYCLIC_HIGH'?")],
)
def test_faces_that_do_not_match_are_told_by_the_keys_of_the_study(
    tmp_path: Path, low: str, high: str, sectors: int, said: str
) -> None:
    faces = {"part.blade.low_face": f'"{low}"', "part.blade.high_face": f'"{high}"', "part.blade.sectors": str(sectors)}
    text = refused("check", str(without_tie(write_example_deck(tmp_path, faces))))
    assert "study.toml: part.blade" in text
    assert said in text


def test_a_cyclic_tie_without_a_number_of_sectors_is_refused(tmp_path: Path) -> None:
    path = write_example_deck(tmp_path)
    deck = tmp_path / "sector.inp"
    lines = deck.read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("*CYCLIC SYMMETRY MODEL"))
    deck.write_text("\n".join(lines[:at] + lines[at + 2 :]) + "\n")
    assert "nothing says how many sectors there are" in refused("check", str(path))


def test_a_material_that_no_solid_is_names_deck_and_line(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "bar.inp")
    deck.write_text(deck.read_text().replace("7850.", "-7850."))
    with pytest.raises(InputError, match=r"bar\.inp: line \d+, .*'STEEL': Material\.density: must"):
        read_deck(deck, plausible=False)
