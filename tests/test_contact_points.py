"""Contact points of rigid dampers: the areas that they stand for, and stiffness per area that converges with them."""

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip import Study
from stickslip.assembly import copy_of, place_of
from stickslip.errors import InputError
from stickslip.model.part import damper_part
from stickslip.model.rigid.dampers import CylinderDamper, FlatCurvedDamper, WedgeDamper, nearest

DEG = math.pi / 180
LENGTH, WIDTH = 0.048, 0.027
FLAT = FlatCurvedDamper(length=LENGTH, flat_between=(0.002, 0.002 + WIDTH), curved_width=0.001)
WEDGE = WedgeDamper(left_angle=40 * DEG, right_angle=65 * DEG, top_width=0.004, height=0.012, length=0.05, mass=0.09)
CYLINDER = CylinderDamper(left_angle=40 * DEG, radius=0.006, length=0.04, mass=0.05, contact_width=0.0005)

# a damper that hangs between two grounds: springs and inertia of its own alone
STUDY = """
schema_version = 2
title = "A damper between two grounds"

[part.damper]
shape = "flat_curved"
apex_m = [0.0, 0.0]
flat_angle_deg = 45.0
curved_angle_deg = 45.0
sections_m = [-0.016, 0.0, 0.016]
{extent}

[part.held]
shape = "lumped"
masses_kg = [1.0]
springs_n_per_m = [["ground", 1, 1e6]]

[contact.flat]
between = ["damper.flat", "ground"]
law = "elastic_coulomb"
friction_coefficient = 0.6
{flat}

[contact.curved]
between = ["damper.curved", "ground"]
law = "elastic_coulomb"
friction_coefficient = 0.6
{curved}

[load.pull]
on = "damper"
direction = "z"
force_n = 400.0
harmonic = 0

[load.shaker]
on = "damper"
direction = "x"
force_n = 40.0

[forced_response]
frequencies_hz = [300.0]
stability = "off"

[harmonics]
low = 3
high = 3
selection = "always_high"

[output]
points = {{ damper = "damper" }}
"""
EXTENT = "length_m = 0.048\nflat_between_m = [0.002, 0.029]\ncurved_width_m = 0.001"
WHOLE = {"flat": (5.2e7, 4.5e7, 4.5e7), "curved": (2.5e7, 2e7, 4.5e7)}
AREAS = {"flat": LENGTH * WIDTH, "curved": LENGTH * 0.001}
WORDS = ("normal", "tangential", "axial")


def side_of(name: str, per: str) -> str:
    """The keys of a contact; per point, the stiffness of the side over the points of the first study."""
    by = {"area": AREAS[name], "interface": 1.0, "point": {"flat": 6, "curved": 3}[name]}[per]
    unit = "n_per_m3" if per == "area" else "n_per_m"
    lines = [f"{word}_stiffness_{unit} = {k / by!r}" for word, k in zip(WORDS, WHOLE[name], strict=True)]
    return "\n".join([f'per = "{per}"', *lines])


def study(folder: Path, per: str = "area", extent: str = EXTENT) -> Study:
    path = folder / "study.toml"
    sides = {name: side_of(name, per) for name in WHOLE}
    path.write_text(STUDY.format(extent=extent, **sides), encoding="utf-8")
    return Study.from_file(path)


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=8, unique=True), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_stretches_add_up_to_the_side_and_hold_what_is_nearest(places, before, after):
    places, low, high = sorted(places), min(places) - before, max(places) + after
    parts = nearest(places, low, high)
    assert parts.sum() == pytest.approx(high - low, abs=1e-12)
    assert np.all(parts >= 0.0)
    ends = low + np.concatenate([[0.0], np.cumsum(parts)])
    for i, (a, b) in enumerate(itertools.pairwise(ends)):
        middle = (a + b) / 2
        assert abs(middle - places[i]) <= min(abs(middle - p) for p in places) + 1e-12


def test_the_ends_of_a_side_have_the_shares_of_the_trapezoidal_rule():
    np.testing.assert_allclose(nearest((0.0, 1.0, 2.0, 3.0), 0.0, 3.0), [0.5, 1.0, 1.0, 0.5])
    np.testing.assert_allclose(nearest((0.0, 1.0, 3.0), -1.0, 3.5), [1.5, 1.5, 1.5])


@pytest.mark.parametrize("uneven", [False, True])
def test_areas_add_up_to_the_side(uneven):
    places = (-0.019, -0.0185, 0.004, 0.012) if uneven else (-0.01, 0.0, 0.01)
    flat = replace(FLAT, sections=places, flat_distances=(0.003, 0.004, 0.02))
    part = damper_part(flat)
    assert part.surfaces["flat"].area.sum() == pytest.approx(LENGTH * WIDTH)
    assert part.surfaces["curved"].area.sum() == pytest.approx(LENGTH * 0.001)
    assert list(dict.fromkeys(n.split(".")[0] for n in part.surfaces["flat"].names)) == ["L1", "L2", "L3"]
    wedge = damper_part(replace(WEDGE, sections=places))
    for side, angle in (("left", 40 * DEG), ("right", 65 * DEG)):
        assert wedge.surfaces[side].area.sum() == pytest.approx(0.012 / math.sin(angle) * 0.05)
    cylinder = damper_part(replace(CYLINDER, sections=places))
    assert cylinder.surfaces["right"].area.sum() == pytest.approx(0.0005 * 0.04)


def test_a_shape_that_does_not_tell_has_no_areas_and_a_copy_has_those_of_its_template():
    bare = damper_part(FlatCurvedDamper())
    assert bare.surfaces["flat"].area is None
    assert bare.surfaces["curved"].area is None
    part = damper_part(FLAT)
    copied = copy_of(part, place_of(turn=0.3, move=(1.0, 0.0, 0.0)))
    np.testing.assert_array_equal(copied.surfaces["flat"].area, part.surfaces["flat"].area)


def stuck(made: Study) -> np.ndarray:
    """Stiffness of the damper's six dofs, all points stuck."""
    model = made.model()
    matrix = model.at(0.0, contacts="stuck").stiffness
    dofs = model.places.own("damper")
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)[np.ix_(dofs, dofs)]


def test_a_section_cut_in_two_at_its_place_changes_nothing(tmp_path):
    made = study(tmp_path)
    whole = stuck(made)
    cut = [-0.016, -1e-10, 1e-10, 0.016]
    assert len(made.replace({"part.damper.sections_m": cut}).model().pairs.names) == 12
    twice = stuck(made.replace({"part.damper.sections_m": cut}))
    np.testing.assert_allclose(twice, whole, rtol=1e-7, atol=1e-9 * np.abs(whole).max())


@pytest.mark.parametrize("count", [1, 2, 3, 8])
def test_the_stiffness_against_a_tilt_has_the_error_of_the_midpoint_rule(count, tmp_path):
    places = [(i + 0.5) / count * LENGTH - LENGTH / 2 for i in range(count)]
    pairs = study(tmp_path).replace({"part.damper.sections_m": places}).model().pairs
    flat = [i for i, group in enumerate(pairs.groups) if group == "flat"]
    k = np.array([pairs.laws[i].k_n for i in flat])
    y = pairs.position[flat, 1]
    assert k.sum() == pytest.approx(WHOLE["flat"][0])
    assert k @ y**2 == pytest.approx((1 - 1 / count**2) * WHOLE["flat"][0] * LENGTH**2 / 12, abs=1e-3)


def sections(made: Study, count: int) -> Study:
    places = [(i + 0.5) / count * LENGTH - LENGTH / 2 for i in range(count)]
    return made.replace({"part.damper.sections_m": places})


def test_a_study_per_area_gives_the_same_response_with_more_sections(tmp_path):
    found = []
    for count in (3, 6):
        result = sections(study(tmp_path), count).run(fresh=True)
        data = result.data["forced_response"]
        assert data.sizes["contact"] == 3 * count
        assert data["contact_area"].sum() == pytest.approx(sum(AREAS.values()))
        found.append(data["amplitude"].sel(output="damper.x").item())
    assert found[0] > 0.0
    assert found[1] == pytest.approx(found[0], rel=1e-9)  # along x all sections do the same


def test_stiffness_of_the_whole_side_is_shared_alike_and_that_of_points_grows_with_them(tmp_path):
    area = {count: stuck(sections(study(tmp_path), count)) for count in (3, 6)}
    whole = stuck(sections(study(tmp_path, "interface"), 3))
    equal = stuck(sections(study(tmp_path, "interface", extent=""), 3))
    point = {count: stuck(sections(study(tmp_path, "point"), count)) for count in (3, 6)}
    for found in (whole, equal, point[3]):
        np.testing.assert_allclose(found, area[3], rtol=1e-9, atol=1e-9 * np.abs(area[3]).max())
    along = np.ix_(range(3), range(3))
    np.testing.assert_allclose(area[6][along], area[3][along], rtol=1e-9, atol=1.0)
    np.testing.assert_allclose(point[6][along], 2 * area[3][along], rtol=1e-9, atol=1.0)


BODY = 'shape = "rigid_body"\nmass_kg = 0.1\ninertia_kg_m2 = [1e-5, 1e-5, 1e-5]\ncentre_m = [0.0, 0.0, 0.0]\n'
ROUND = 'shape = "cylinder"\nradius_m = 0.006\nlength_m = 0.04\nleft_angle_deg = 40.0\nmass_kg = 0.05\n'
WRONG = [
    (
        {"part.damper.length_m": None},
        'part.damper.length_m: is missing, and contact.flat has per = "area": the points of \'damper.flat\' have no area. Add it, or give the contact per = "interface"',
    ),
    ({"part.damper.flat_between_m": None}, "part.damper.flat_between_m: is missing, and contact.flat has"),
    ({"part.damper.curved_width_m": None}, "part.damper.curved_width_m: is missing, and contact.curved has"),
    (
        {"part.damper.length_m": 0.03},
        "part.damper.length_m: must hold all sections within half of it, 0.015 m, of y = 0; they are (-0.016, 0.0, 0.016), got 0.03. Give the whole length",
    ),
    (
        {"part.damper.flat_between_m": [0.003, 0.029]},
        "part.damper.flat_between_m: must hold all lines of the flat side, at (0.002, 0.029) m from the apex, got (0.003, 0.029). Give the nearer",
    ),
    ({"part.damper.curved_width_m": 0.0}, "part.damper.curved_width_m: must be greater than 0, got 0.0"),
]


@pytest.mark.parametrize(("changes", "said"), WRONG)
def test_what_has_no_area_is_refused_with_file_key_and_remedy(changes, said, tmp_path):
    made = study(tmp_path)
    with pytest.raises(InputError) as caught:
        made.replace(changes)
    assert said in str(caught.value)
    assert "study.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (ROUND, "part.damper.contact_width_m: is missing, and contact.flat has"),
        (
            BODY
            + "[part.damper.surfaces.left]\npoints_m = [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]\nnormal = [0.0, 0.0, 1.0]\n",
            "part.damper.surfaces.left.areas_m2: is missing, and contact.flat has",
        ),
        (
            BODY
            + "[part.damper.surfaces.left]\npoints_m = [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]\nnormal = [0.0, 0.0, 1.0]\nareas_m2 = [1e-4]\n",
            "surfaces.left.areas_m2: has 1 entries for 2 points",
        ),
    ],
)
def test_other_bodies_say_which_key_is_missing(body, said, tmp_path):
    contact = f'[contact.flat]\nbetween = ["damper.left", "ground"]\nlaw = "elastic_coulomb"\nfriction_coefficient = 0.6\n{side_of("flat", "area")}\n'
    path = tmp_path / "study.toml"
    path.write_text(f'schema_version = 2\ntitle = "One side"\n[part.damper]\n{body}\n{contact}\n[modes]\n')
    with pytest.raises(InputError) as caught:
        Study.from_file(path)
    assert said in str(caught.value)
