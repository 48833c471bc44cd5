"""Keyword decks: what is read, what is refused by line, what is listed; unit systems."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip import InputError, Material, Units
from stickslip.model import assemble_deck, chain, natural_frequencies, read_deck
from stickslip.model.readers.keywords import PARAMETERS
from stickslip.model.readers.units import check_material, doubt_about_units, in_si
from stickslip.model.structure import Dofs, Structure

CUBE = """** a unit cube of eight nodes, and a ninth that belongs to nothing
*Heading
 Würfel
*NODE, NSET=Nall
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.,
4, 0., 1., 0.
** a comment among the data
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
99, 5., 5., 5.
*ELEMENT, TYPE=C3D8, ELSET=Eall
1, 1, 2, 3, 4,
5, 6, 7, 8
*NSET, NSET=BOTTOM, GENERATE
1, 4
*NSET, NSET=TOP
8, 7,
BOTTOM
*NSET, NSET=TOP
6, 5, 8
*MATERIAL, NAME=Steel
*ELASTIC
2.1e11, 0.3
*DENSITY
7850.
*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL
*BOUNDARY
BOTTOM, 1, 3
"""


def deck_of(tmp_path, text, **options):
    path = tmp_path / "deck.inp"
    path.write_text(text)
    return read_deck(path, **options)


def test_a_deck_says_what_it_holds(tmp_path):
    deck = deck_of(tmp_path, CUBE)
    assert deck.material == Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
    assert deck.mesh.cells.tolist() == [list(range(8))]
    assert deck.mesh.numbers.tolist() == list(range(1, 9))
    assert deck.ignored == ("1 nodes that belong to no cell",)
    # order of the set is kept, each node stands once, clamped ones are taken out
    assert deck.mesh.numbers[deck.mesh.node_sets["TOP"]].tolist() == [8, 7, 6, 5]
    assert deck.mesh.numbers[deck.mesh.node_sets["root"]].tolist() == [1, 2, 3, 4]
    assert "BOTTOM" not in deck.mesh.node_sets
    assert deck.speed is None
    assert deck.sectors is None
    structure = assemble_deck(deck)
    assert structure.n == 12
    assert structure.sets["TOP"].tolist() == [9, 10, 11, 6, 7, 8, 3, 4, 5, 0, 1, 2]


def test_supports_of_single_directions(tmp_path):
    """A roller in z at one corner more: the dof is gone, its neighbours stay."""
    deck = deck_of(tmp_path, CUBE + "7, 3, 3\n8, 2\n")
    structure = assemble_deck(deck)
    names = set(zip(structure.dofs.node.tolist(), structure.dofs.component, strict=True))
    assert (7, "z") not in names
    assert (8, "y") not in names
    assert {(7, "x"), (7, "y"), (8, "x"), (8, "z")} <= names
    assert structure.n == 10
    assert structure.sets["TOP"].size == 10
    deck = deck_of(tmp_path, CUBE + "*STEP\n*BOUNDARY, OP=NEW\n1, ENCASTRE\n2, PINNED\n*END STEP\n")
    assert assemble_deck(deck).n == 18


def test_two_materials_are_assembled_each_with_its_own(tmp_path):
    """Two cubes on top of each other, the upper one of half density: mass is the sum, cell by cell."""
    upper = "\n".join(f"{n + 4}, {x}, {y}, 2." for n, x, y in ((5, 0, 0), (6, 1, 0), (7, 1, 1), (8, 0, 1)))
    text = CUBE.replace("99, 5., 5., 5.\n", upper + "\n").replace(
        "*NSET, NSET=BOTTOM", "*ELEMENT, TYPE=C3D8, ELSET=UP\n2, 5, 6, 7, 8, 9, 10, 11, 12\n*NSET, NSET=BOTTOM", 1
    )
    text = text.split("*BOUNDARY")[0]
    text += "*MATERIAL, NAME=LIGHT\n*DENSITY\n3925.\n*ELASTIC\n1e11, 0.2\n*SOLID SECTION, ELSET=UP, MATERIAL=LIGHT\n"
    deck = deck_of(tmp_path, text)
    assert deck.cell_material == ("STEEL", "LIGHT")
    with pytest.raises(InputError, match=r"there are 2: LIGHT, STEEL.*assemble_deck"):
        _ = deck.material
    structure = assemble_deck(deck)
    along = (np.array(structure.dofs.component) == "x").astype(float)
    assert along @ structure.mass @ along == pytest.approx(7850 + 3925)
    assert np.sum(natural_frequencies(structure, 7) == 0) == 6


def test_a_deck_with_one_part_as_abaqus_writes_it(tmp_path):
    nodes, rest = CUBE.split("*ELEMENT")
    cells, rest = rest.split("*NSET", maxsplit=1)
    material = rest.split("*MATERIAL")[1].split("*SOLID")[0]
    text = (
        f'*Part, name=Part-1\n{nodes}*ELEMENT{cells}*Solid Section, elset=Eall, material="Steel"\n,\n*End Part\n'
        "*Assembly, name=Assembly\n*Instance, name=Part-1-1, part=Part-1\n*End Instance\n"
        '*Nset, nset="Bottom face", instance=Part-1-1, generate\n 1, 4, 1\n*End Assembly\n'
        f'*MATERIAL{material}*Boundary\n"Bottom face", ENCASTRE\n'
    )
    deck = deck_of(tmp_path, text)
    assert assemble_deck(deck).n == 12
    moved = text.replace("part=Part-1\n*End", "part=Part-1\n 0., 0., 5.\n*End")
    with pytest.raises(InputError, match="several instances, or a moved one"):
        deck_of(tmp_path, moved)


def test_elements_that_are_not_read_can_be_left_out(tmp_path):
    text = CUBE + "*ELEMENT, TYPE=T3D2, ELSET=SPR\n77, 7, 6\n"
    with pytest.raises(InputError, match="elements of type T3D2 are not read"):
        deck_of(tmp_path, text)
    deck = deck_of(tmp_path, text, ignore=("ELEMENT",))
    assert any("T3D2" in entry for entry in deck.ignored)
    assert len(deck.mesh.cells) == 1


@pytest.mark.parametrize(
    ("kind", "remedy"),
    [
        ("C3D8H", "elements of type C3D8H are not read"),
        ("C3D8RH", "elements of type C3D8RH are not read"),
        ("C3D8IH", "elements of type C3D8IH are not read"),
        ("C3D20RH", "elements of type C3D20RH are not read"),
        ("C3D10HS", "elements of type C3D10HS are not read"),
        ("C3D20RT", "elements of type C3D20RT are not read"),
    ],
)
def test_bricks_of_another_kind_are_not_taken_as_plain_ones(tmp_path, kind, remedy):
    """Hybrid elements and those of temperature have other unknowns."""
    with pytest.raises(InputError, match=rf"line 15, \*ELEMENT: .*{remedy}"):
        deck_of(tmp_path, CUBE.replace("TYPE=C3D8,", f"TYPE={kind},"))


def test_what_makes_an_element_another_is_told(tmp_path):
    ten = CUBE.replace("99, 5., 5., 5.\n", "".join(f"{n}, {n / 10}, .5, .5\n" for n in range(9, 12)))
    ten = ten.replace("1, 1, 2, 3, 4,\n5, 6, 7, 8\n", "1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10\n")
    (told,) = [t for t in deck_of(tmp_path, ten.replace("C3D8", "C3D10M")).ignored if "C3D10M" in t]
    assert told == "what makes C3D10M another element than its plain kind"


def test_blank_and_missing_coordinates_are_zero(tmp_path):
    """As in CalculiX and Abaqus."""
    whole = deck_of(tmp_path, CUBE).mesh.points
    text = (
        CUBE.replace("\n1, 0., 0., 0.\n", "\n1,,,\n")
        .replace("\n2, 1., 0., 0.\n", "\n2, 1.\n")
        .replace("\n5, 0., 0., 1.\n", "\n5, , , 1.,\n")
    )
    assert text.count(",,") == 1
    assert len(text) == len(CUBE) - 20
    np.testing.assert_array_equal(deck_of(tmp_path, text).mesh.points, whole)


def test_node_sets_of_elements(tmp_path):
    text = CUBE.split("*BOUNDARY", maxsplit=1)[0] + "*NSET, NSET=SKIN, ELSET=EALL\n"
    deck = deck_of(tmp_path, text)
    assert deck.mesh.numbers[deck.mesh.node_sets["SKIN"]].tolist() == list(range(1, 9))
    with pytest.raises(InputError, match=r"no element set 'EAL'. Did you mean 'EALL'"):
        deck_of(tmp_path, text.replace("ELSET=EALL\n", "ELSET=EAL\n"))


def test_rotation_and_axis(tmp_path):
    load = (
        "*STEP\n*STATIC\n*DLOAD\nEall, CENTRIF, 1.E4, 0.1, 0., 0., 1., 0., 0.\nEALL, GRAV, 9.81, 0.,0.,-1.\n*END STEP\n"
    )
    deck = deck_of(tmp_path, CUBE + load, units=Units(1.0, 1.0, 0.5))
    assert deck.speed == pytest.approx(200.0)  # 100 rad each half second
    assert deck.axis.unit.tolist() == [1.0, 0.0, 0.0]
    assert deck.axis.origin == (0.1, 0.0, 0.0)
    assert any("GRAV" in text for text in deck.ignored)


def test_included_files_stay_in_the_folder(tmp_path):
    (tmp_path / "parts").mkdir()
    nodes = CUBE.split("*ELEMENT", maxsplit=1)[0]
    (tmp_path / "parts" / "nodes.inc").write_text(nodes)
    deck = deck_of(tmp_path, CUBE.replace(nodes, "*INCLUDE, INPUT=parts/nodes.inc\n"))
    assert len(deck.mesh.points) == 8
    (tmp_path.parent / "outside.inc").write_text(nodes)
    with pytest.raises(InputError, match=r"line 1, \*INCLUDE: .*lies outside the deck's folder"):
        deck_of(tmp_path, "*INCLUDE, INPUT=../outside.inc\n" + CUBE)
    with pytest.raises(InputError, match="include each other"):
        deck_of(tmp_path, CUBE + "*INCLUDE, INPUT=deck.inp\n")
    with pytest.raises(InputError, match=r"nodes\.inx: there is no such file"):
        deck_of(tmp_path, CUBE + "*INCLUDE, INPUT=parts/nodes.inx\n")


def test_keywords_that_change_the_model_are_refused(tmp_path):
    text = CUBE + "*Embedded Element\nEALL\n"
    with pytest.raises(
        InputError, match=r"deck\.inp: line 33, \*EMBEDDED ELEMENT: \*EMBEDDED ELEMENT changes the model"
    ):
        deck_of(tmp_path, text)
    deck = deck_of(tmp_path, text, ignore=("*Embedded element",))
    assert "*EMBEDDED ELEMENT (deck.inp: line 33), as asked" in deck.ignored


def test_surplus_nodes_and_prescribed_displacements_are_told(tmp_path):
    """CalculiX leaves out nodes beyond those of the element, and holds a prescribed displacement in a *FREQUENCY step."""
    text = CUBE.replace("5, 6, 7, 8\n", "5, 6, 7, 8, 9\n").replace("BOTTOM, 1, 3\n", "BOTTOM, 1, 3, 0.1\n")
    deck = deck_of(tmp_path, text)
    assert deck.ignored[:2] == (
        "the surplus nodes of 1 elements C3D8, which have 8 (deck.inp: line 15)",
        f"the prescribed displacement of 0.1 ({tmp_path / 'deck.inp'}: line 32): its nodes are held at 0",
    )
    assert assemble_deck(deck).n == 12


def test_contacts_of_a_deck_are_told(tmp_path):
    deck = deck_of(tmp_path, CUBE + "*CONTACT PAIR, INTERACTION=I\nA, B\n")
    assert deck.ignored[0] == "*CONTACT PAIR (deck.inp: line 33): its surfaces are free until a study couples them"


def test_loads_and_what_is_beyond_small_vibration_are_told(tmp_path):
    more = "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 20.\n"
    deck = deck_of(tmp_path, CUBE + "*EXPANSION\n1.e-5\n*CLOAD\n7, 1, 5.\n" + more)
    assert deck.ignored[0] == "*CLOAD (deck.inp: line 35)"
    assert "TEMPERATURE" not in " ".join(deck.ignored)
    deck = deck_of(tmp_path, CUBE + more)
    assert deck.ignored[-1].endswith("line 33, *INITIAL CONDITIONS, on which no material depends")
    deck = deck_of(tmp_path, CUBE + "*DLOAD, AMPLITUDE=RAMP\nEALL, CENTRIF, 1.E4, 0.,0.,0., 0.,0.,1.\n")
    assert deck.ignored[0].startswith("AMPLITUDE of *DLOAD")


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            "*DENSTY\n7850.\n",
            r"line 33, \*DENSTY: \*DENSTY is not known, and may change the model\. Did you mean 'DENSITY'",
        ),
        ("*FIXED MASS SCALING, FACTOR=4.\n", r"line 33.*\*FIXED MASS SCALING is not known"),
        ("*MASS, ELSET=E\n3.\n", r"line 33, \*MASS: there is no element set 'E'"),
        ("*DAMPING, BETA=1e-5\n", r"line 33, \*DAMPING: damping is not read from decks\. State it in the study"),
        ("*MODAL DAMPING\n1, 2, 0.01\n", "damping is not read from decks"),
        ("*INITIAL CONDITIONS, TYPE=STRESS\nEALL, 1e8\n", "TYPE=STRESS change the stiffness"),
        ("*BOUNDARY, TYPE=VELOCITY\n7, 1, 1, 0.\n", r"line 33, \*BOUNDARY: TYPE=VELOCITY is not read"),
        ("*BOUNDARY, OP=NW\n7, 1, 1\n", "OP=NW is not known"),
        ("*BOUNDARY, SUBMODEL, STEP=1\n7, 1, 1\n", r"line 33, \*BOUNDARY: the parameter SUBMODEL is not read"),
        ("*DLOAD\nHALF, CENTRIF, 1., 0.,0.,0., 0.,0.,1.\n", "rotates 'HALF', which is not the set of all elements"),
        ("*CYCLIC SYMMETRY MODEL, N=4, ELSET=HALF\n0.,0.,0.,0.,0.,1.\n", "there is no element set 'HALF'"),
        (
            "*NSET, NSET=A, GEN\n1, 4\n",
            r"line 33, \*NSET: the parameter GEN is not read.*Known: ELSET, GENERATE, INPUT",
        ),
        ("*SURFACE, NAME=A, COMBINE=UNION\nB, C\n", "the parameter COMBINE is not read"),
        ("*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL, COMPOSITE\n", "the parameter COMPOSITE is not read"),
        ("*ELEMENT, TYPE=C3D8, ELSET=B, OFFSET=9\n", "the parameter OFFSET is not read"),
        ("*MATERIAL, NAME=A\n*DENSITY, DEPENDENCIES=1\n7., , 1.\n", "the parameter DEPENDENCIES is not read"),
        ("*STEP, NLGEO\n", "the parameter NLGEO is not read.*Did you mean 'NLGEOM'"),
    ],
)
def test_what_may_change_the_model_is_refused_by_line(tmp_path, more, message):
    with pytest.raises(InputError, match=message):
        deck_of(tmp_path, CUBE + more)


HARMLESS = """*PREPRINT, ECHO=NO, MODEL=NO, HISTORY=NO, CONTACT=NO
*NSET, NSET=PICKED, INTERNAL, INSTANCE=PART-1-1, UNSORTED
7
*ELSET, ELSET=_SURF_S2, INTERNAL, INSTANCE=PART-1-1, GENERATE
1, 1, 1
*SURFACE, NAME=SURF, TYPE=ELEMENT, INTERNAL
_SURF_S2, S2
*SECTION CONTROLS, NAME=EC-1, HOURGLASS=ENHANCED
*SURFACE INTERACTION, NAME=INT
*FRICTION
0.2,
*AMPLITUDE, NAME=RAMP, TIME=TOTAL TIME
0., 0., 1., 1.
*CONDUCTIVITY
40.
*STEP, NAME=STEP-1, NLGEOM=NO, INC=100, PERTURBATION, UNSYMM=YES
*FREQUENCY, EIGENSOLVER=LANCZOS, NORMALIZATION=MASS
10, , , , ,
*BOUNDARY, OP=MOD, AMPLITUDE=RAMP
7, 1, 1, 0.
*CLOAD, OP=NEW
*DLOAD, OP=NEW
*RESTART, WRITE, FREQUENCY=0
*OUTPUT, FIELD, VARIABLE=PRESELECT
*NODE FILE, GLOBAL=YES
U
*EL FILE
S, E
*NODE PRINT, NSET=NALL, TOTALS=ONLY
U
*END STEP
"""


def test_what_exporters_write_passes_without_a_word(tmp_path):
    deck = deck_of(tmp_path, CUBE + HARMLESS)
    assert deck.ignored == ("1 nodes that belong to no cell",)
    assert assemble_deck(deck).n == 11


def test_an_initial_operation_takes_the_rotation_away(tmp_path):
    turns = "*STEP\n*DLOAD\nEALL, CENTRIF, 1.E4, 0.,0.,0., 0.,0.,1.\n*END STEP\n"
    assert deck_of(tmp_path, CUBE + turns).speed == pytest.approx(100.0)
    assert deck_of(tmp_path, CUBE + turns + "*STEP\n*DLOAD, OP=NEW\n*END STEP\n").speed is None


def moved_into_files(folder, text):
    """Return the deck with the data of each keyword that is read in a file of its own, named by INPUT."""
    lines, data = [], {}
    for line in text.splitlines():
        if line.startswith("*") and not line.startswith("**"):
            word = line[1:].split(",")[0].strip().upper()
            own = word in PARAMETERS and "INPUT" in PARAMETERS[word]
            lines.append(f"{line}, INPUT=data/{len(data)}.txt" if own else line)
            data[len(data)] = []
            to = data[len(data) - 1] if own else lines
        else:
            to.append(line)
    (folder / "data").mkdir()
    for number, rows in data.items():
        if rows:
            (folder / "data" / f"{number}.txt").write_text("** a comment\n" + "\n".join(rows) + "\n")
    return "\n".join(lines) + "\n"


def test_data_in_files_of_their_own_are_read_for_every_keyword(tmp_path):
    """Before, `*NODE, INPUT=` and `*ELEMENT, INPUT=` were dropped without a word: half the mass, three times the frequency."""
    whole = CUBE.split("\n", 1)[1]
    one = deck_of(tmp_path, whole)
    text = moved_into_files(tmp_path, whole)
    assert text.count("INPUT=") == 8
    other = deck_of(tmp_path, text)
    for name in ("points", "cells", "numbers"):
        np.testing.assert_array_equal(getattr(one.mesh, name), getattr(other.mesh, name))
    assert {k: v.tolist() for k, v in one.mesh.node_sets.items()} == {
        k: v.tolist() for k, v in other.mesh.node_sets.items()
    }
    assert one.materials == other.materials
    assert other.ignored == one.ignored


def test_half_a_mesh_in_a_file_is_half_the_mass(tmp_path):
    upper = "\n".join(f"{n + 4}, {x}, {y}, 2." for n, x, y in ((5, 0, 0), (6, 1, 0), (7, 1, 1), (8, 0, 1)))
    (tmp_path / "nodes.txt").write_text(upper + "\n")
    (tmp_path / "cells.txt").write_text("2, 5, 6, 7, 8, 9, 10, 11, 12\n")
    more = "*NODE, INPUT=nodes.txt\n*ELEMENT, TYPE=C3D8, ELSET=Eall, INPUT=cells.txt\n*NSET, NSET=TOP"
    text = CUBE.replace("99, 5., 5., 5.\n", "").replace("*NSET, NSET=TOP", more, 1)
    structure = assemble_deck(deck_of(tmp_path, text.split("*BOUNDARY")[0]))
    along = (np.array(structure.dofs.component) == "x").astype(float)
    assert along @ structure.mass @ along == pytest.approx(2 * 7850)


def test_files_of_data_obey_the_rules_of_include(tmp_path):
    (tmp_path.parent / "outside.txt").write_text("1, 0., 0., 0.\n")
    with pytest.raises(InputError, match=r"\*NODE: the included file '\.\./outside\.txt' lies outside"):
        deck_of(tmp_path, CUBE + "*NODE, INPUT=../outside.txt\n")
    with pytest.raises(InputError, match=r"none\.txt: there is no such file"):
        deck_of(tmp_path, CUBE + "*ELSET, ELSET=A, INPUT=none.txt\n")
    (tmp_path / "keyword.txt").write_text("*NODE\n1, 0., 0., 0.\n")
    with pytest.raises(InputError, match=r"keyword\.txt: line 1, \*NODE: is a keyword in a file of data"):
        deck_of(tmp_path, CUBE + "*NODE, INPUT=keyword.txt\n")
    (tmp_path / "short.txt").write_text("1, 0., 0., 0., 0.\n")
    with pytest.raises(InputError, match=r"short\.txt: line 1: needs 4 numbers"):
        deck_of(tmp_path, CUBE + "*NODE, INPUT=short.txt\n")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("TYPE=C3D8", "TYPE=S4", "elements of type S4 are not read"),
        ("TYPE=C3D8", "TYPE=C3D20", r"line 17: the last element has 8 nodes of 20"),
        ("5, 6, 7, 8\n", "5, 6, 7, 88\n", r"lacks 1 nodes, e\.g\. 88"),
        ("5, 6, 7, 8\n", "5, 6, 7, x8\n", "the node 'x8' is no whole number"),
        ("6, 1., 0., 1.", "6, 1., 0., 1., 2.", r"line 11: needs 4 numbers, got 5"),
        ("6, 1., 0., 1.", ", 1., 0., 1.", r"line 11: '' is no finite number"),
        ("6, 1., 0., 1.", "6, 1., nan, 1.", r"line 11: 'nan' is no finite number"),
        ("99, 5., 5., 5.", "8, 5., 5., 5.", "defines node 8 twice"),
        ("8, 7,\n", "8, 77,\n", "there is no node 77"),
        ("8, 7,\n", "8, TOPS,\n", "the node 'TOPS' is no whole number"),
        ("ELSET=EALL, M", "ELSET=ALL, M", r"no element set 'ALL'. Did you mean 'EALL'"),
        ("MATERIAL=STEEL", "MATERIAL=STEAL", r"material 'STEAL' has no \*ELASTIC.*STEEL"),
        ("*DENSITY\n7850.\n", "", r"material 'STEEL' has no \*DENSITY"),
        ("2.1e11, 0.3", "2.1e11", r"needs 2 numbers, got 1"),
        ("2.1e11, 0.3", "2.1e11, 0.3\n2.0e11, 0.3, 400.", "several rows without temperatures"),
        ("2.1e11, 0.3", "2.1e11, 0.3, 20.\n2.0e11, 0.3, 10.", r"temperatures \[20\.0, 10\.0\], which do not rise"),
        ("*ELASTIC", "*ELASTIC, TYPE=ORTHO", "line 27: needs 9 numbers, got 2"),
        ("*ELASTIC", "*ELASTIC, TYPE=LAMINA", r"line 26, \*ELASTIC: TYPE=LAMINA is not read"),
        (
            "*ELASTIC\n2.1e11, 0.3",
            f"*ELASTIC, TYPE=ORTHO\n{'2e11, ' * 8}\n1e11",
            r"line 26, \*ELASTIC: belongs to no stable",
        ),
        ("MATERIAL=STEEL", "MATERIAL=STEEL, ORIENTATION=AXIS", "there is no orientation 'AXIS'"),
        ("*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n", "", r"1 elements have no material, e\.g\. 1"),
        ("BOTTOM, 1, 3\n", "BOTTEM, 1, 3\n", r"no node set 'BOTTEM'. Did you mean 'BOTTOM'"),
        ("BOTTOM, 1, 3\n", "BOTTOM, 3, 1\n", "directions 3 to 1"),
        ("*NODE, NSET=Nall", "*NODE, SYSTEM=C", "SYSTEM=C are not read"),
        ("7850.", "7.85e-9", r"line 30, \*SOLID SECTION: in SI the density is 7.85e-09"),
        ("*ELEMENT, TYPE=C3D8, ELSET=Eall", "*ELEMENT, ELSET=Eall", "lacks the parameter TYPE"),
        ("\n1, 4\n*NSET", "\n1, 4, 0\n*NSET", "first, last, step"),
    ],
)
def test_damaged_decks_are_named(tmp_path, old, new, message):
    assert old in CUBE
    with pytest.raises(InputError, match=message):
        deck_of(tmp_path, CUBE.replace(old, new, 1))


def test_decks_without_the_mesh(tmp_path):
    for text, message in (
        ("1 1 2.0\n", "has no keyword line"),
        ("*MATERIAL, NAME=A\n", r"has no \*NODE"),
        ("*NODE\n1, 0., 0., 0.\n", r"has no \*ELEMENT"),
    ):
        with pytest.raises(InputError, match=message):
            deck_of(tmp_path, text)


def test_cyclic_ties(tmp_path):
    tie = "*SURFACE, NAME=LO, TYPE=NODE\nBOTTOM\n*SURFACE, NAME=HI\nEALL, S1\n*TIE, NAME=T{}\nLO, HI\n"
    with pytest.raises(InputError, match="'LO' is a surface of nodes, which others cannot follow"):
        deck_of(tmp_path, CUBE + tie.format("").replace("LO, HI", "HI, LO"))
    with pytest.raises(InputError, match=r"there is no surface 'HJ'. Known: HI, LO"):
        deck_of(tmp_path, CUBE + tie.format(", CYCLIC SYMMETRY").replace("LO, HI", "LO, HJ"))
    model = "*CYCLIC SYMMETRY MODEL, N=4, NGRAPH=1, TIE=T\n0.,0.,0.,0.,0.,1.\n"
    load = "*DLOAD\nEALL, CENTRIF, 1., 0., 0., 0., 1., 0., 0.\n"
    with pytest.raises(InputError, match="its axis differs from the axis of the cyclic symmetry"):
        deck_of(tmp_path, CUBE + model + load)
    assert deck_of(tmp_path, CUBE + model).sectors == 4


# ---- units


@pytest.mark.parametrize(
    ("units", "density", "modulus"),
    [
        (Units.si(), 7850.0, 2.1e11),
        (Units.mm_t_s(), 7.85e-9, 2.1e5),
        (Units.mm_kg_ms(), 7.85e-6, 210.0),
        (Units.mm_kg_s(), 7.85e-6, 2.1e8),
        (Units.inch_lbf_s(), 7.3453e-4, 3.0458e7),
        (Units.foot_slug_s(), 15.2315, 4.3859e9),
    ],
)
def test_steel_is_steel_in_every_system(units, density, modulus):
    """Handbook numbers of one material: each system's units of density and stress."""
    assert density * units.density == pytest.approx(7850, rel=1e-4)
    assert modulus * units.stress == pytest.approx(2.1e11, rel=1e-4)
    check_material(density * units.density, modulus * units.stress, units, "deck")
    if units.name not in ("SI", "foot-slug-s"):
        with pytest.raises(InputError, match=f"looks like .*{units.name}"):
            check_material(density, modulus, Units.si(), "deck")


def test_units_by_name():
    assert Units.named("MM-T-S") == Units.mm_t_s()
    with pytest.raises(InputError, match=r"unknown unit system 'mm-t'.*Did you mean 'mm-t-s'"):
        Units.named("mm-t")
    with pytest.raises(InputError, match=r"Units\.mass: must be positive, got 0"):
        Units(1.0, 0.0, 1.0)


@given(st.sampled_from(["x", "rx", "mode"]), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_a_vibration_is_the_same_in_all_units(kind, length, mass, time):
    """Frequencies are per unit of time; kinetic energy of a unit velocity has the units of its coordinates."""
    raw = chain(3, 2.0, 5.0, 1e-3)
    dofs = Dofs(np.arange(3), ("x", kind, "x"), np.zeros((3, 3)))
    raw = Structure(raw.mass, raw.damping, raw.stiffness, dofs)
    structure = in_si(raw, Units(length, mass, time))
    np.testing.assert_allclose(time * natural_frequencies(structure, 3), natural_frequencies(raw, 3), rtol=1e-9)
    scale = np.array([length, length if kind == "x" else 1.0, length])  # one unit of each coordinate
    velocity = np.array([0.3, -0.2, 0.1])
    energy = mass * length**2 / time**2
    np.testing.assert_allclose(
        (velocity * scale / time) @ structure.mass @ (velocity * scale / time),
        energy * (velocity @ raw.mass @ velocity),
        rtol=1e-12,
    )


def test_doubt_needs_a_box():
    flat = chain(3, 1e-12, 1.0)
    assert doubt_about_units(flat, Units.si()) is None
