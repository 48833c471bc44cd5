"""Anisotropic materials of decks: the deck's own order of constants, orientations, and what is refused."""

import numpy as np
import pytest
from test_anisotropic import AXES, ORTHO
from test_readers_deck import CUBE, deck_of

from stickslip import InputError, Units
from stickslip.model.axis import Axis
from stickslip.model.deck import write_deck
from stickslip.model.fe.material import ElasticMaterial, Orientation, elastic_material
from stickslip.model.fe.solid import assemble_solid
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix_deck import assemble_deck, read_deck
from stickslip.model.readers.open_model import model_summary

ENGINEERING = "120e9, 30e9, 12e9, 0.28, 0.31, 0.35, 6e9, 5e9,\n4e9"
BELOW = {"ORTHO": [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5)]}
BELOW["ANISO"] = [(i, j) for j in range(6) for i in range(j + 1)]


def in_order_of_decks(matrix):
    """The matrix with the shears in the order 12, 13, 23."""
    places = [0, 1, 2, 3, 5, 4]
    return matrix[np.ix_(places, places)]


def constants(kind, matrix):
    """Lines of eight numbers, written out of the matrix."""
    if kind == "ENGINEERING CONSTANTS":
        return ENGINEERING
    own = in_order_of_decks(matrix)
    numbers = [f"{own[pair]:.10e}" for pair in BELOW[kind]]
    return ",\n".join(", ".join(numbers[i : i + 8]) for i in range(0, len(numbers), 8))


def text(kind, matrix=ORTHO, axes=""):
    named = ", ORIENTATION=Axes" if axes else ""
    orientation = f"*ORIENTATION, NAME=AXES{axes}\n" if axes else ""
    deck = CUBE.replace("*ELASTIC\n2.1e11, 0.3", f"*ELASTIC, TYPE={kind}\n{constants(kind, matrix)}")
    return deck.replace("MATERIAL=STEEL\n", f"MATERIAL=STEEL{named}\n").replace("*SOLID", f"{orientation}*SOLID")


@pytest.mark.parametrize("kind", ["ORTHO", "ENGINEERING CONSTANTS", "ANISO", "Orthotropic", "engineering constants"])
def test_all_orders_of_constants_are_one_material(tmp_path, kind):
    deck = deck_of(tmp_path, text(kind.upper().removesuffix("TROPIC")))
    found = deck.material.matrices(None)
    np.testing.assert_allclose(found, ORTHO, rtol=1e-8, atol=1e-8 * np.abs(ORTHO).max())


def test_a_full_matrix_has_the_shears_12_13_23(tmp_path):
    rng = np.random.default_rng(5)
    root = rng.standard_normal((6, 6))
    matrix = 1e10 * (root @ root.T + 3 * np.eye(6))
    found = deck_of(tmp_path, text("ANISO", matrix)).material.matrices(None)
    np.testing.assert_allclose(found, matrix, rtol=1e-9)


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("\n0., 2., 0., -3., 1., 0.", Orientation(((0, -1, 0), (1, 0, 0), (0, 0, 1)))),
        (
            ", SYSTEM=RECTANGULAR, DEFINITION=COORDINATES\n0., 2., 0., -3., 1., 0.\n3, 90.",
            Orientation(((-1, 0, 0), (0, -1, 0), (0, 0, 1))),
        ),
        ("\n1., 0., 0., 0., 1., 0., 0., 0., 0.\n1, 90.", Orientation(((1, 0, 0), (0, 0, -1), (0, 1, 0)))),
        (", SYSTEM=Cylindrical\n-9., 1., 2., -9., 1., 4.", Orientation(around=Axis((0, 0, 2), (-9, 1, 2)))),
    ],
)
def test_orientations_are_as_the_manual_says(tmp_path, written, expected):
    deck = deck_of(tmp_path, text("ORTHO", axes=written))
    assert list(deck.materials) == ["STEEL in AXES"] == list(set(deck.cell_material))
    points = np.array([[0.5, 1.0, 2.0], [-3.0, 4.0, 5.0]])
    np.testing.assert_allclose(deck.material.orientation.at(points), expected.at(points), atol=1e-12)


def test_units_of_an_orientation_are_those_of_the_deck(tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(text("ORTHO", axes=", SYSTEM=C\n500., 0., 0., 500., 0., 1."))
    deck = read_deck(path, units=Units.mm_kg_s(), plausible=False)
    assert deck.material.orientation.around == Axis((0, 0, 1), (0.5, 0, 0))


def test_one_material_in_two_orientations_is_two(tmp_path):
    second = "*ELEMENT, TYPE=C3D8, ELSET=Other\n2, 5, 6, 7, 8, 15, 16, 17, 18\n"
    nodes = "15, 0., 0., 2.\n16, 1., 0., 2.\n17, 1., 1., 2.\n18, 0., 1., 2.\n99,"
    both = text("ORTHO", axes="\n1., 0., 0., 0., 1., 0.").replace("99,", nodes).replace("*NSET", second + "*NSET", 1)
    both += "*ORIENTATION, NAME=B\n0., 1., 0., 0., 0., 1.\n*SOLID SECTION, ELSET=OTHER, MATERIAL=STEEL, ORIENTATION=B\n"
    deck = deck_of(tmp_path, both)
    assert deck.cell_material == ("STEEL in AXES", "STEEL in B")
    remarks = model_summary(deck, n_modes=1).remarks
    assert sum("E 1.2e+11, 3e+10, 1.2e+10 Pa along its axes" in remark for remark in remarks) == 2


@pytest.mark.parametrize("where", [*AXES, "global"])
def test_a_written_deck_is_read_again(tmp_path, where):
    deck = deck_of(tmp_path, CUBE)
    material = elastic_material(ORTHO, 1600.0, AXES.get(where))
    write_deck(deck.mesh, material, tmp_path / "own.inp")
    again = read_deck(tmp_path / "own.inp")
    assert isinstance(again.material, ElasticMaterial)
    direct = deck.mesh.__class__(deck.mesh.points, deck.mesh.cells, deck.mesh.node_sets)

    expected = natural_frequencies(assemble_solid(direct, material, quadrature=deck.quadrature), 6)
    np.testing.assert_allclose(natural_frequencies(assemble_deck(again), 6), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        (", SYSTEM=SPHERICAL\n1., 0., 0., 0., 1., 0.", "SYSTEM=SPHERICAL is not read"),
        (", SYSTEM=Z RECTANGULAR\n1., 0., 0., 0., 1., 0.", "SYSTEM=Z RECTANGULAR is not read"),
        (", DEFINITION=NODES\n1, 2, 3", "DEFINITION=NODES is not read"),
        ("\n1., 0., 0., 0., 1.", "two points"),
        ("\n1., 0., 0., 3., 0., 0.", "line 32: .*span no plane"),
        ("\n1., 0., 0., 0., 1., 0., 5., 0., 0.", "third point as origin"),
        ("\n1., 0., 0., 0., 1., 0.\n4, 20.", "turns about the axis 4"),
        (", SYSTEM=C\n1., 0., 0., 1., 0., 0.", "has no length"),
        (", LOCAL DIRECTIONS=3\n1., 0., 0., 0., 1., 0.", "LOCAL DIRECTIONS is not read"),
    ],
)
def test_other_orientations_are_refused_by_line(tmp_path, axes, message):
    with pytest.raises(InputError, match=message):
        deck_of(tmp_path, text("ORTHO", axes=axes))


HEATED = (
    CUBE.replace(
        "2.1e11, 0.3\n", "2.1e11, 0.3, 20.\n1.4e11, 0.3, 720.\n*EXPANSION, ZERO=25.\n1.e-5, 20.\n1.4e-5, 720.\n"
    )
    + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 40.\n"
)


def test_temperatures_of_a_deck_are_initial_ones_and_those_of_its_steps(tmp_path):
    steps = "*STEP\n*STATIC\n*TEMPERATURE\nNALL, 300.\nTOP, 500.\n7, 600.\n*END STEP\n"
    deck = deck_of(tmp_path, HEATED + steps)
    assert deck.temperature.start.tolist() == [40.0] * 8
    assert deck.temperature.values.tolist() == [500.0] * 6 + [600.0, 500.0]  # TOP names BOTTOM, too
    expansion = deck.material.expansion
    assert (expansion.kind, expansion.zero) == ("secant", 25.0)
    assert expansion.coefficients.at(np.array([370.0]))[0, 0] == pytest.approx(1.2e-5)
    assert deck_of(tmp_path, HEATED).temperature.values.tolist() == [40.0] * 8
    anew = deck_of(tmp_path, HEATED + steps + "*STEP\n*TEMPERATURE, OP=NEW\n3, 90.\n*END STEP\n")
    assert anew.temperature.values.tolist() == [40.0, 40.0, 90.0] + [40.0] * 5


def test_a_deck_at_rest_has_its_initial_temperature(tmp_path):
    cold = CUBE.replace("2.1e11, 0.3", f"{2.1e11 - 0.7e11 * 20 / 700!r}, 0.3")
    hz = natural_frequencies(assemble_deck(deck_of(tmp_path, cold)), 3)
    steps = "*STEP\n*STATIC\n*TEMPERATURE\nNALL, 300.\n*END STEP\n"
    np.testing.assert_allclose(natural_frequencies(assemble_deck(deck_of(tmp_path, HEATED + steps)), 3), hz, rtol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("NALL, 40.", "TOP, 40.", None),
        ("NALL, 40.", "7, 40.", r"\*INITIAL CONDITIONS: 7 nodes have no initial temperature, e\.g\. 1"),
        ("NALL, 40.", "NALL", "names no temperature"),
        ("TYPE=TEMPERATURE", "TYPE=TEMPERATURE, FILE=x.frd", "temperatures of a file or a subroutine"),
        ("ZERO=25.", "ZERO=25., TYPE=ANISO", "TYPE=ANISO is not read"),
        ("ZERO=25.", "ZERO=warm", "ZERO 'warm' is no finite number"),
    ],
)
def test_heat_that_is_not_read_is_refused_by_line(tmp_path, old, new, message):
    text = HEATED.replace(old, new)
    if message is None:
        assert deck_of(tmp_path, text).temperature is not None
        return
    with pytest.raises(InputError, match=message):
        deck_of(tmp_path, text)


def test_temperatures_that_a_deck_computes_are_not_read_in_silence(tmp_path):
    deck = deck_of(tmp_path, HEATED + "*STEP\n*HEAT TRANSFER, STEADY STATE\n*END STEP\n")
    assert "*HEAT TRANSFER: temperatures that this step computes; the given ones are taken" in deck.ignored[-1]
    cold = deck_of(tmp_path, CUBE + "*STEP\n*HEAT TRANSFER, STEADY STATE\n*END STEP\n")
    assert "HEAT TRANSFER" not in " ".join(cold.ignored)
