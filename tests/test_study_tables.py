"""The study file of schema 2: tables made from dataclasses, refusals that name key, value and remedy, [vary]."""

import json
import math
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from small_v2 import EXAMPLES, write_four_masses, write_shrouded_deck, write_shrouded_sector, write_two_blades

from stickslip.contact.laws import LAWS
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import FourParameter, Iwan
from stickslip.errors import InputError, input_error, together
from stickslip.model.mesh.blade_pair import BladePair
from stickslip.model.mesh.sector import BladedSector, Shroud
from stickslip.model.rigid.dampers import FlatCurvedDamper
from stickslip.study.analysis import named
from stickslip.study.file.case_names import namings
from stickslip.study.file.example import Kind, example_decks, example_text
from stickslip.study.file.harmonics import Harmonics
from stickslip.study.file.model.bodies import Direction
from stickslip.study.file.model.contacts import ContactTable, keys_of
from stickslip.study.file.quantities import build, table_of
from stickslip.study.file.study import read_file
from stickslip.study.file.tables import json_schema, study_tables
from stickslip.study.models.cost import memory_gb, waves_gb
from stickslip.study.models.parts import damper_of
from stickslip.study.models.study import read_study
from stickslip.study.questions import ANALYSES
from stickslip.units import quantity


def refused(path: Path) -> str:
    with pytest.raises(InputError) as error:
        read_study(path)
    return str(error.value)


# errors carry fields


def test_an_error_says_place_problem_and_remedy_and_gives_its_arguments_other_names():
    error = input_error("a.inp", "is in doubt", "Give $units or leave it.", units="units=…")
    assert (error.place, error.problem) == ("a.inp", "is in doubt")
    assert str(error) == "a.inp: is in doubt. Give units=… or leave it."
    theirs = error.called({"units": "part.blade.units"}).inside("study.toml")
    assert str(theirs) == "study.toml: a.inp: is in doubt. Give part.blade.units or leave it."


def test_a_dollar_in_a_remedy_without_words_is_left_alone():
    assert input_error("p", "costs", "Pay 5 $mass.").remedy == "Pay 5 $mass."


def test_several_errors_make_one_with_a_line_each_and_survive_a_process():
    import pickle

    both = together([input_error("a", "is wrong", "Mend it."), input_error("b", "too", "Too.")])
    again = pickle.loads(pickle.dumps(both))
    assert str(again).splitlines() == ["a: is wrong. Mend it.", "b: too. Too."]
    assert [other.place for other in again.inside("f").others] == ["f: b"]


# tables are made from the dataclasses


@pytest.mark.parametrize("cls", [BladePair, FlatCurvedDamper, BladedSector])
def test_an_empty_table_builds_the_dataclass_with_its_defaults(cls):
    made = build(cls, table_of(cls)())
    expected = BladedSector(platform=None) if cls is BladedSector else cls()
    assert made == expected


def test_a_table_bears_the_name_of_its_dataclass_or_its_own():
    assert table_of(BladePair).__name__ == "BladePair"
    assert table_of(BladePair, name="PrismBlades").__name__ == "PrismBlades"
    named_after = {"Airfoil", "DiskProfile", "FirstLoading", "FourParameter", "Platform", "Shroud", "UniformBand"}
    assert named_after <= json.loads(json_schema())["$defs"].keys()


def lists_of(schema: object, key: str = "") -> list[tuple[str, dict]]:
    """Return the keys of a JSON schema whose value is a list that may not be empty, with what is asked of it."""
    if isinstance(schema, list):
        return [found for own in schema for found in lists_of(own, key)]
    if not isinstance(schema, dict):
        return []
    own = [(key, schema)] if schema.get("type") == "array" and schema.get("minItems", 0) > 0 else []
    names = {k: key if k in ("anyOf", "items", "additionalProperties") else k for k in schema}
    return own + [found for k, value in schema.items() for found in lists_of(value, names[k])]


def test_a_list_has_a_fixed_length_or_may_have_one_entry():
    lists = lists_of(json.loads(json_schema()))
    free = {key: each["minItems"] for key, each in lists if each["minItems"] != each.get("maxItems")}
    assert {"masses_kg", "directions", "points_m", "nodes", "pattern"} - free.keys() <= {"pattern"}
    assert {key: least for key, least in free.items() if least != 1} == {"flat_distances_m": 2, "over_temperature": 2}


def test_keys_end_with_their_unit_and_become_si():
    table = table_of(BladePair)(twist_deg=8.0, pitch_m=0.06)
    made = build(BladePair, table)
    assert (made.twist, made.pitch) == (math.radians(8), 0.06)


def test_tables_of_a_table_become_the_dataclass_of_a_field():
    table = table_of(BladedSector).model_validate({"shroud": {"face_angle_deg": -20.0}})
    assert build(BladedSector, table).shroud == Shroud(face_angle=math.radians(-20))


@pytest.mark.parametrize("name", LAWS)
def test_every_law_can_be_written_in_a_study(name, tmp_path):
    needed = [key for key, need in keys_of(name, per_area=False).items() if need]
    values = {key: [1.0] if key.startswith("along") else 0.5 for key in needed}
    if name in ("cubic_spring", "polynomial_spring"):
        values |= {"cubic_spring": {"cubic_normal_n_per_m3": 1.0}, "polynomial_spring": {"along_n": [1.0]}}[name]
    if name in ("bonded", "jenkins", "iwan", "dahl", "bouc_wen"):
        values["normal_stiffness_n_per_m"] = 1.0
    table = ContactTable.model_validate({"between": ["a.b", "c.d"], "law": name} | values)
    assert type(table.library()) is LAWS[name]


def test_an_iwan_law_has_its_population():
    given = {"between": ["a.b", "c.d"], "law": "iwan", "tangential_stiffness_n_per_m": 1.0, "slip_limit_n": 1.0}
    made = ContactTable.model_validate(
        given | {"population": {"kind": "four_parameter", "chi": -0.5, "beta": 0.1, "sliders": 5}}
    ).library()
    assert made.population == FourParameter(chi=-0.5, beta=0.1, n_sliders=5)
    assert ContactTable.model_validate(given).library() == Iwan(k_t=1.0, limit=1.0)
    with pytest.raises(ValidationError, match=r"is not known, got 'four_paramter'. Did you mean 'four_parameter'"):
        ContactTable.model_validate(given | {"population": {"kind": "four_paramter"}})
    with pytest.raises(ValidationError, match=r"is no parameter of the law jenkins.*it belongs to iwan"):
        ContactTable.model_validate(given | {"law": "jenkins", "population": {"kind": "uniform_band"}})


def test_the_schema_lists_tables_and_keys():
    schema = json.loads(json_schema())
    assert {"part", "contact", "load", "vary", "forced_response", "modes"} <= set(schema["properties"])
    assert "friction_coefficient" in schema["$defs"]["Contact"]["properties"]
    assert schema["$defs"]["FlatCurved"]["properties"]["mass_kg"]["exclusiveMinimum"] == 0
    described = [p for d in schema["$defs"].values() for p in d.get("properties", {}).values()]
    assert all("description" in p for p in described)


# none is meant by an empty list, or what reads it refuses it
MAY_BE_EMPTY = {
    "Contact": {"along_t", "along_w", "along_n"},
    "FileModel": {"at_speed", "clamped"},
    "FirstLoading": {"displacement", "force"},
    "Harmonics": {"low", "high", "alert_over"},
    "Lumped": {"names", "springs_n_per_m", "dashpots_n_s_per_m"},
    "ModalSynthesisTable": {"passage_hz_per_s"},
    "PrismBlades": {"nodes_at"},
    "Surface": {"normals", "names", "areas_m2"},
}


def test_a_list_holds_something_unless_nothing_has_a_meaning():
    found = {}
    for table, kind in json.loads(json_schema())["$defs"].items():
        for key, given in kind.get("properties", {}).items():
            lists = [one for one in given.get("anyOf", [given]) if one.get("type") == "array"]
            if any(not one.get("minItems") for one in lists):
                found.setdefault(table, set()).add(key)
    assert found == MAY_BE_EMPTY


def _chosen(folder, k):
    """Return the shape of the damper of the kind `damper` when its choice `k` is the one that is not commented out."""
    before, *dampers = re.split(r"(?=^(?:# )?\[part\.damper\])", example_text("damper"), flags=re.MULTILINE)
    last, after = dampers[-1].split("\n\n", 1)
    dampers[-1] = last
    path = folder / f"damper{k}.toml"
    path.write_text(
        before + re.sub(r"^# (?=\[|\w+ = )", "", dampers[k], flags=re.MULTILINE) + "\n\n" + after, encoding="utf-8"
    )
    return read_study(path).tables.part["damper"].shape


@pytest.mark.parametrize("kind", get_args(Kind))
def test_the_examples_that_ship_are_those_of_the_repository(kind, tmp_path):
    folders = {"blades": "two_blades", "sector": "shrouded_sector", "wheel": "friction_ring", "masses": "four_masses"}
    same = {"own_blades": "own_blades", "mistuned": "mistuned_wheel"}  # with choices, which are comments
    if kind in same:
        written = EXAMPLES / same[kind]
        assert tomllib.loads(example_text(kind)) == tomllib.loads((written / "study.toml").read_text(encoding="utf-8"))
        for name, content in example_decks(kind).items():
            assert content == (written / name).read_bytes()
    elif kind == "damper":
        assert _chosen(tmp_path, 0) == "wedge"
        assert _chosen(tmp_path, 1) == "cylinder"
    elif kind in folders:
        written = (EXAMPLES / folders[kind] / "study.toml").read_text(encoding="utf-8")
        own, head = example_text(kind), written.partition("[vary]")[0]
        assert own == written if kind != "wheel" else own.startswith(f"{head}[vary]")
        if kind == "wheel":  # the peaks whose stability is undecided are left out, and named
            few, every = (tomllib.loads(s)["vary"]["contact"]["groove"] for s in (own, written))
            left_out = set(every["slip_limit_n"]) - set(few["slip_limit_n"])
            assert {3.0, 3.2, 10.0} < left_out
            assert set(few["slip_limit_n"]) < set(every["slip_limit_n"])
            assert "3, 3.2 and 10 N" in own
    else:
        path = tmp_path / "study.toml"
        path.write_text(example_text(kind), encoding="utf-8")
        assert len(refused(path).splitlines()) == 1  # the deck is not there
        assert "part.blade.file: there is no file" in refused(path)


# examples


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("two_blades", 80),
        ("four_masses", 24),
        ("shrouded_sector", 80),
        ("root_joint", 60),
        ("backbone", 40),
        ("load_levels", 25),
        ("kept_forces", 35),
        ("third_frequency", 25),
    ],
)
def test_the_examples_are_short_and_good(name, most):
    path = EXAMPLES / name / "study.toml"
    lines = path.read_text(encoding="utf-8").splitlines()
    code = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    assert len(code) <= most
    assert read_study(path).asked


def test_the_two_blades_have_nine_cases_and_share_their_parts():
    study = read_study(EXAMPLES / "two_blades" / "study.toml")
    labels = [case.label for case in study.cases()]
    assert labels[0] == "ratio 250"
    assert len(labels) == 9
    assert len({case.digest for case in study.cases()}) == 9


def test_the_damper_takes_its_apex_from_the_platforms(tmp_path):
    tables = read_study(write_two_blades(tmp_path)).tables
    damper = damper_of(tables, "damper")
    assert damper.apex == BladePair().wedge_apex
    assert damper == FlatCurvedDamper(apex=BladePair().wedge_apex, centre=damper.centre)


def test_what_a_damper_says_of_itself_counts_before_its_platforms(tmp_path):
    tables = read_study(write_two_blades(tmp_path, {"part.damper.curved_angle_deg": "44.0"})).tables
    damper = damper_of(tables, "damper")
    assert damper.curved_angle == pytest.approx(math.radians(44.0))
    assert (damper.apex, damper.flat_angle) == (BladePair().wedge_apex, FlatCurvedDamper().flat_angle)


# models


def test_a_study_becomes_a_model(tmp_path):
    model = read_study(write_four_masses(tmp_path)).model()
    stiffness = model.parts["chain"].structure.stiffness
    expected = 4e4 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    expected[3, 3] = 4e4
    assert np.allclose(stiffness, expected)
    assert [c.acts for c in model.contacts.values()] == ["tangential", "tangential", "normal"]
    assert model.contacts["stop"].gap == 1e-3
    assert model.loads["shaker"].newton == 5.0


def test_a_law_and_its_share_reach_the_model(tmp_path):
    model = read_study(write_two_blades(tmp_path)).model()
    contact = model.contacts["flat"]
    assert contact.law == ElasticCoulomb(k_t=450e6, k_w=450e6, k_n=520e6, mu=0.6)
    assert contact.share == "interface"
    assert model.loads["shaker"].newton == 442.0 / 2000
    assert model.loads["pull"].harmonic == 0


def test_a_friction_coefficient_that_varies_meshes_nothing_again(tmp_path):
    path = write_two_blades(tmp_path, {"vary.contact.flat.friction_coefficient": "[0.3]"})
    study = read_study(path)
    first, other = (study.model(), study.replace({"contact.curved.friction_coefficient": 0.1}).model())
    assert first.parts["blades"] is other.parts["blades"]
    assert other.contacts["curved"].law.mu == 0.1
    coarser = study.replace({"part.blades.foot_size_m": 0.02})
    assert coarser.model().parts["blades"] is not first.parts["blades"]
    assert coarser.model().parts["damper"] is not first.parts["damper"]


def test_what_a_model_depends_on_changes_its_digest_and_nothing_else_does(tmp_path):
    path = write_shrouded_deck(tmp_path)
    study = read_study(path)
    digest = study.cases()[0].digest
    same = {"title": "another", "modes.number": 3, "output.folder": "elsewhere", "limits.work_s": 100.0}
    assert study.replace(same).cases()[0].digest == digest
    for key, value in {"rotation.speed_rpm": 1.0, "contact.shroud.gap_m": 1e-6}.items():
        other = {key: value} | ({"contact.shroud.preload_n": 0.0} if "gap" in key else {})
        assert study.replace(other).cases()[0].digest != digest
    at_rest = study.cases()[0].digest_at_rest
    for key, value in {"load.gas.force_n": 3.0, "output.peak": "tip.x"}.items():
        driven = study.replace({key: value}).cases()[0]
        assert driven.digest != digest
        assert driven.digest_at_rest == at_rest
    assert study.replace({"rotation.speed_rpm": 1.0}).cases()[0].digest_at_rest != at_rest
    deck = tmp_path / "sector.inp"
    deck.write_text(deck.read_text(encoding="ascii") + "** changed\n", encoding="ascii")
    assert study.cases()[0].digest != digest


def test_sets_of_a_deck_are_found_whatever_their_capitals(tmp_path):
    model = read_study(write_shrouded_deck(tmp_path)).model()
    assert model.contacts["shroud"].between == ("blade.SHROUD_HIGH", "next.blade.SHROUD_LOW")
    assert model.parts["blade"].sectors == 8


def test_a_copy_stands_where_it_is_placed_and_shares_its_original(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(
        'schema_version = 2\n[part.a]\nshape = "rigid_body"\nmass_kg = 1.0\ninertia_kg_m2 = [1.0, 1.0, 1.0]\n'
        "centre_m = [1.0, 0.0, 0.0]\n[part.a.surfaces.side]\npoints_m = [[1.5, 0.0, 0.0]]\nnormal = [1.0, 0.0, 0.0]\n"
        '[part.b]\nof = "a"\nplaced = { turn_deg = 90.0, move_m = [0.0, 0.0, 2.0] }\n',
        encoding="utf-8",
    )
    parts = read_study(path).model().parts
    assert parts["b"].template is parts["a"]
    assert np.allclose(parts["b"].surfaces["side"].position, [[0.0, 1.5, 2.0]])
    assert np.allclose(parts["a"].surfaces["side"].frame[0, :, 2], [1.0, 0.0, 0.0])
    assert np.isclose(np.linalg.det(parts["a"].surfaces["side"].frame[0]), 1.0)


# refusals: file, key, value, remedy


WRONG = [
    ({"contact.flat.friction": "0.3"}, "contact.flat.friction: unknown key 'friction'"),
    (
        {"contact.flat.slip_limit_n": "3.0"},
        "contact.flat.slip_limit_n: is no parameter of the law elastic_coulomb, got 3.0; it belongs to jenkins",
    ),
    (
        {"contact.flat.law": '"jenkins"'},
        "contact.flat.slip_limit_n: is missing, the law jenkins needs it. Add it: friction force",
    ),
    (
        {"contact.flat.law": '"elastic_coulom"'},
        "contact.flat.law: is not known, got 'elastic_coulom'. Did you mean 'elastic_coulomb'?",
    ),
    (
        {"contact.flat.friction_coefficient": "-0.1"},
        "contact.flat.friction_coefficient: must be greater than or equal to 0, got -0.1.",
    ),
    ({"contact.flat.per": '"area"'}, "Give normal_stiffness_n_per_m3, or another per."),
    (
        {"contact.flat.between": '["damper.flat", "blades.underside_3"]'},
        "there is no surface or set 'blades.underside_3'. Did you mean 'blades.underside_2'?",
    ),
    (
        {"contact.flat.between": '["damber.flat", "blades.underside_1"]'},
        "contact.flat.between: there is no part 'damber'. Did you mean 'damper'?",
    ),
    ({"contact.flat.between": '["damper.flat", "next.blades.underside_1"]'}, "'blades' is no sector of a wheel"),
    ({"contact.flat.between": '["ground", "blades.underside_1"]'}, "Give ['blades.underside_1', 'ground']."),
    ({"load.shaker.ratio_of": '"load.pul"'}, "load.shaker.ratio_of: 'load.pul' is no load. Did you mean 'load.pull'?"),
    ({"load.shaker.engine_order": "3"}, "load.shaker.engine_order: is of a wheel, but no part is a sector of one."),
    ({"load.shaker.direction": '"q"'}, "load.shaker.direction: is no direction, got 'q'."),
    ({"contact.flat.tangent": '"q"'}, "contact.flat.tangent: is no direction, got 'q'."),
    ({"load.shaker.harmonic": "0"}, "forced_response: has no harmonic load to respond to."),
    ({"load.shaker.harmonic": "2", "harmonics.low": "1"}, "load.shaker.harmonic: 2 is not kept by harmonics.low = 1."),
    (
        {"load.shaker.force_n": "3.0"},
        "load.shaker.force_n: needs one of force_n, ratio_of and pressure, got force_n and ratio_of.",
    ),
    (
        {"part.blades.pitch_m": "-1.0"},
        "part.blades.pitch_m: must be greater than 0, got -1.0. It means: distance of the two blades along x in m",
    ),
    (
        {"part.blades.shape": '"prism_blade"'},
        "part.blades.shape: is not known, got 'prism_blade'. Did you mean 'prism_blades'?",
    ),
    ({"part.blades.pich_m": "0.05"}, "part.blades.pich_m: unknown key 'pich_m'. Did you mean 'pitch_m'?"),
    ({"part.blades.hub_chord_m": "0.2"}, "part.blades.hub_chord_m: the airfoil's hub section"),
    (
        {"part.blades.nodes_at": '["damper.flt"]'},
        "part.blades.nodes_at: there is no surface 'damper.flt' of a flat_curved part. Did you mean 'damper.flat'?",
    ),
    ({"part.damper.mass_kg": "0.0"}, "part.damper.mass_kg: must be greater than 0, got 0.0."),
    (
        {"material.young_modulus_pa": "210.0"},
        "material.young_modulus_pa: no solid has 210 Pa, which is 2.1e+11 Pa if it is in GPa.",
    ),
    ({"output.peak": '"tip1.q"'}, "output.peak: there is no output 'tip1.q'. Did you mean 'tip1.z'?"),
    ({"output.folder": '"../out"'}, "output.folder: must be a folder inside the study's folder"),
    (
        {"forced_response.frequency_hz": "[207.0, 185.0]"},
        "forced_response.frequency_hz: must be the lower before the higher",
    ),
    ({"campbell.speeds_rpm": "[0.0, 1.0]"}, "campbell.engine_orders: is missing. Add it: engine orders"),
    (
        {"schema_version": "1"},
        "schema_version: this version of stickslip reads 2, got 1. The tables have changed: [blades]",
    ),
    ({"schema_version": "3"}, "Write schema_version = 2, or install the stickslip that the file was written for."),
    ({"load.pull.force_n": "nan"}, "load.pull.force_n: must be a finite number, got nan."),
    ({"materiel.density_kg_per_m3": "1.0"}, "materiel: unknown key 'materiel'. Did you mean 'material'?"),
    ({"part.blades.platform_gap_m": '"1 mm"'}, "part.blades.platform_gap_m: must be a number, got '1 mm'."),
    ({"reduction.fixed_interface_modes": "2.5"}, "reduction.fixed_interface_modes: must be a whole number, got 2.5."),
    ({"forced_response.peak_points": "true"}, "forced_response.peak_points: must be a whole number, got True."),
    (
        {"harmonics.selection": '"always_hihg"'},
        "harmonics.selection: is not known, got 'always_hihg'. Did you mean 'always_high'?",
    ),
    ({"solver.evaluator": '"event"'}, "solver.evaluator: is not known, got 'event'. Did you mean 'events'?"),
    (
        {"harmonics.low": "7", "harmonics.high": "5"},
        "harmonics.high: must not be below low = 7, got 5. Raise it, or lower low.",
    ),
    (
        {"harmonics.samples": "32", "harmonics.high": "5"},
        "harmonics.samples: must be at least 8 times high = 5, got 32.",
    ),
    (
        {"harmonics.low": "9"},
        "harmonics.samples: must be at least 8 times low = 9, got 64. Give at least 72, better 128.",
    ),
    (
        {"harmonics.samples": "32"},
        "harmonics.samples: must be at least 8 times the harmonic 5 that high = 'auto' begins with, got 32. Give at least 40, better 64.",
    ),
    (
        {"forced_response.stability": '"yes"'},
        "forced_response.stability: is not known, got 'yes'. Known: all, auto, off, peak. It means: where stability is examined",
    ),
    (
        {"harmonics.alert_over": '"contact"'},
        "harmonics.alert_over: must be answer, along, outputs, contacts or a list of labels, got 'contact'. Did you mean 'contacts'?",
    ),
    (
        {"part.damper.inertia_kg_m2": "[1.0e-5, 1.0e-6, 1.0e-6]"},
        "part.damper.inertia_kg_m2: the largest moment exceeds the sum of the other two",
    ),
    ({"part.damper.inertia_kg_m2": "[1.0e-5, 1.0e-6]"}, "part.damper.inertia_kg_m2: has the wrong number of entries"),
    (
        {"part.damper.flat_distances_m": "[0.0075, -0.0050]"},
        "part.damper.flat_distances_m[1]: must be greater than 0, got -0.005.",
    ),
    ({"part.blades.pitch_m": "0.009"}, "part.blades.pitch_m: 0.009 m leaves no room for platforms"),
    ({"part.damper.mass_kg": f'"{"9" * 10_000}"'}, "part.damper.mass_kg: must be a number, got '999"),
    (
        {"part.damper.shape": '"flat_curvd"', "vary.part.damper.mass_kg": "[0.01]"},
        "part.damper.shape: is not known, got 'flat_curvd'. Did you mean 'flat_curved'?",
    ),
    (
        {"part.damper.mass_kg": "-0.02", "vary.part.damper.mass_kg": "[0.01]"},
        "study.toml: part.damper.mass_kg: must be greater than 0, got -0.02.",
    ),
    ({"vary.load.shaker.ratios": "[1, 2]"}, "vary.load.shaker.ratios: there is no key 'ratios'. Did you mean 'ratio'?"),
    (
        {"vary.part.damber.mass_kg": "[1.0]"},
        "vary.part.damber.mass_kg: there is no key 'damber'. Did you mean 'damper'?",
    ),
    ({"vary.part.blades.mass_kg": "[1.0]"}, "vary.part.blades.mass_kg: there is no key 'mass_kg'."),
    ({"vary.load.shaker.ratio": "[20, -1]"}, "vary.load.shaker.ratio: must be greater than 0, got -1."),
    ({"vary.load.shaker.ratio": "20"}, "vary.load.shaker.ratio: must be a list of values, got 20."),
    (
        {"vary.contact.flat.friction_coefficient": "[0.1, 0.2]"},
        "must be of one length: contact.flat.friction_coefficient has 2, load.shaker.ratio has 1.",
    ),
]


@pytest.mark.parametrize("given", [{"high": 41}, {"low": 41}, {"low": [2], "high": [2, 41]}])
def test_without_samples_the_harmonics_are_named_that_need_more(given):
    key, value = [*given.items()][-1]
    said = f"needs at least 328 samples of a period.*256 where it is not given, got {re.escape(str(value))}"
    with pytest.raises(ValidationError, match=rf"{said}.*Add samples = 512, or lower {key}") as told:
        Harmonics.model_validate(given)
    assert told.value.errors()[0]["ctx"]["key"] == key
    Harmonics.model_validate(given | {"samples": 512})


@pytest.mark.parametrize(("changes", "said"), WRONG, ids=[said[:50] for _, said in WRONG])
def test_what_is_wrong_is_told_with_file_key_value_and_remedy(changes, said, tmp_path):
    path = write_two_blades(tmp_path, changes)
    told = refused(path)
    assert said in told
    assert told.startswith(str(path))


def test_all_problems_of_a_file_are_told_at_once(tmp_path):
    path = write_two_blades(
        tmp_path, {"part.damper.mass_kg": "-1.0", "load.pull.force": "1.0", "contact.flat.law": '"x"'}
    )
    assert len(refused(path).splitlines()) == 3


WHEEL = [
    ({"load.gas.engine_order": "-1"}, "load.gas.engine_order: must be greater than or equal to 0, got -1."),
    (
        {"modes.nodal_diameters": "[0, 5]"},
        "modes.nodal_diameters: 5 is above half of 8 sectors. The nodal diameters go from 0 to 4.",
    ),
    (
        {"campbell.nodal_diameters": "[0, 1]"},
        "campbell.engine_orders: 2 excites the nodal diameter 2, which is not computed.",
    ),
    ({"contact.shroud.between": '["blade.shroud_hgh", "next.blade.shroud_low"]'}, "Did you mean 'blade.shroud_high'?"),
    (
        {"contact.shroud.between": '["blade.shroud_high", "next.blade.shroud_lw"]'},
        "Did you mean 'next.blade.shroud_low'?",
    ),
    ({"part.blade.shroud.span": "1.5"}, "part.blade.shroud.span: must be less than or equal to 1, got 1.5."),
    ({"part.blade.shroud.thickness_m": "1.0"}, "part.blade.shroud.span: 1.0 puts the shroud into the blade's foot."),
]


@pytest.mark.parametrize(("changes", "said"), WHEEL, ids=[said[:50] for _, said in WHEEL])
def test_what_is_wrong_of_a_wheel_is_told(changes, said, tmp_path):
    assert said in refused(write_shrouded_sector(tmp_path, changes))


def test_a_wheel_without_engine_order_is_told_to_have_one(tmp_path):
    path = write_shrouded_sector(tmp_path)
    path.write_text(path.read_text(encoding="utf-8").replace("engine_order = 2\n", ""), encoding="utf-8")
    assert "load.gas.engine_order: is missing on a wheel of 8 sectors." in refused(path)


def test_a_file_that_is_not_there_is_told_before_anything_is_read(tmp_path):
    path = write_shrouded_deck(tmp_path)
    (tmp_path / "sector.inp").unlink()
    assert f"part.blade.file: there is no file {tmp_path / 'sector.inp'}." in refused(path)


DECK = [
    (
        {"part.blade.sectors": "9"},
        "part.blade.sectors: is 9, but the deck's cyclic symmetry has 8. Give sectors = 8, or leave it out.",
    ),
    ({"part.blade.units": '"mm-t-s"'}, "Correct part.blade.units, or give part.blade.plausible = false where"),
    (
        {"part.blade.clamped": '["TIPP"]'},
        "part.blade.clamped[0]: the file has no set 'TIPP' of free nodes. Did you mean 'TIP'?",
    ),
]


@pytest.mark.parametrize(("changes", "said"), DECK, ids=[said[:50] for _, said in DECK])
def test_what_a_deck_contradicts_is_told_with_keys_of_the_study(changes, said, tmp_path):
    study = read_study(write_shrouded_deck(tmp_path, changes))
    with pytest.raises(InputError) as error:
        study.model()
    assert said in str(error.value)
    assert str(error.value).startswith(f"{study.path}: ")


def test_a_speed_of_what_no_speed_changes_is_refused(tmp_path):
    path = write_four_masses(tmp_path, {"rotation.speed_rpm": "100.0"})
    with pytest.raises(
        InputError,
        match=r"rotation.speed_rpm: is 100, but no part is a mesh, a rigid body or matrices at several speeds",
    ):
        read_study(path)


@pytest.mark.parametrize("write", [write_two_blades, write_shrouded_sector, write_shrouded_deck])
def test_what_is_too_large_is_refused_before_it_is_meshed(write, tmp_path):
    study = read_study(write(tmp_path))
    meshes = [part.mesh for part in study.model().parts.values() if part.mesh is not None]
    nodes = sum(len(mesh.points) for mesh in meshes)
    with pytest.raises(InputError, match=r"limits\.memory_gb: the parts, some") as error:
        study.replace({"limits.memory_gb": 0.3})
    told = float(str(error.value).partition("some ")[2].partition(" nodes")[0])
    assert nodes / 2.5 < told < nodes * 2.5
    with pytest.raises(InputError, match=r"limits\.work_s: the parts, some .* s, the limit"):
        study.replace({"limits.work_s": 0.1})


def test_modes_of_waves_of_a_large_sector_are_refused_beforehand(tmp_path):
    """Factors of what waves share grow faster than the nodes; a forced response alone needs none of them."""
    fine = {f"part.blade.{name}_size_m": 0.004 for name in ("disk", "platform", "airfoil")}
    study = read_study(write_shrouded_sector(tmp_path))
    with pytest.raises(InputError, match=r"limits\.memory_gb: the parts, some") as error:
        study.replace(fine | {"limits.work_s": 1e6})
    told = error.value.problem
    nodes = float(told.partition("some ")[2].partition(" nodes")[0])
    assert float(told.partition("at ")[2].partition(" GB")[0]) == pytest.approx(waves_gb(nodes), rel=0.05)
    assert waves_gb(nodes) > 1.5 * memory_gb(nodes)
    # what was measured
    for nodes, gigabytes in ((37_683, 4.35), (99_500, 14.9)):
        assert waves_gb(nodes) == pytest.approx(gigabytes, rel=0.1)


def test_axes_are_words_for_directions():
    table = TypeAdapter(Direction)
    assert table.validate_python("z") == [0.0, 0.0, 1.0]
    assert table.validate_python("-x") == [-1.0, 0.0, 0.0]
    assert table.validate_python([1.0, 2.0, 3.0]) == [1.0, 2.0, 3.0]


def test_a_campbell_diagram_of_masses_is_refused(tmp_path):
    changes = {"campbell.speeds_rpm": "[0.0, 100.0]\nengine_orders = [1]"}
    told = refused(write_four_masses(tmp_path, changes))
    assert "campbell: needs a part that a speed changes, and none is a mesh or has matrices at several speeds." in told


def test_what_is_no_file_and_no_toml_is_told(tmp_path):
    assert "there is no such file" in refused(tmp_path / "none.toml")
    assert "is a folder. Give the study file itself" in refused(tmp_path)
    path = tmp_path / "study.toml"
    path.write_text("a = = 1", encoding="utf-8")
    assert f"is a folder. Give {path}." in refused(tmp_path)
    assert "is not valid TOML" in refused(path)
    path.write_bytes(b"\xff\xfe")
    assert "is not UTF-8 text" in refused(path)
    path.write_text("#" * 1_000_001, encoding="utf-8")
    assert "is larger than 1000000 bytes" in refused(path)


def test_a_link_out_of_the_folder_is_refused(tmp_path):
    home = tmp_path / "home"
    path = write_four_masses(home)
    (home / "results").symlink_to(tmp_path)
    told = "output.folder: leads out of the study's folder, got 'results', which is a link to"
    assert f"{path}: {told} {tmp_path.resolve()}. Remove the link" in refused(path)


# what a study varies


def test_lists_of_one_table_run_together_and_several_tables_multiply(tmp_path):
    path = write_four_masses(tmp_path)
    text = path.read_text(encoding="utf-8") + (
        "[[vary]]\nload.shaker.force_n = [1.0, 2.0]\ncontact.brake.slip_limit_n = [3.0, 4.0]\n"
        '[[vary]]\nforced_response.direction = ["up", "down"]\n'
    )
    path.write_text(text, encoding="utf-8")
    cases = read_study(path).cases()
    assert [case.label for case in cases] == [
        "force 1 N, direction up",  # the slip limit runs with the force, which tells the cases apart
        "force 1 N, direction down",
        "force 2 N, direction up",
        "force 2 N, direction down",
    ]
    assert cases[3].settings.contact["brake"].slip_limit_n == 4.0
    assert cases[3].settings.forced_response.direction == "down"
    assert cases[0].digest == cases[1].digest != cases[2].digest


def labels_of(tmp_path, *lines):
    path = write_four_masses(tmp_path)
    path.write_text("\n".join([path.read_text(encoding="utf-8"), *lines]), encoding="utf-8")
    return [case.label for case in read_study(path).cases()]


def test_names_of_cases_may_be_given(tmp_path):
    together = ["[[vary]]", "load.shaker.force_n = [1.0, 2.0]", "contact.brake.slip_limit_n = [3.0, 3.0]"]
    names = 'name = ["light", "heavy"]'
    assert labels_of(tmp_path, *together, names) == ["light", "heavy"]
    more = ["[[vary]]", 'forced_response.direction = ["up", "down"]']
    assert labels_of(tmp_path, *together, names, *more)[:2] == ["light, direction up", "light, direction down"]


def test_names_of_cases_are_the_shortest_that_tell_them_apart(tmp_path):
    doubled = ["[[vary]]", "load.shaker.force_n = [1.0, 1.0]", "contact.brake.slip_limit_n = [3.0, 4.0]"]
    assert labels_of(tmp_path, *doubled) == ["slip limit 3 N", "slip limit 4 N"]
    twice = [
        "[[vary]]",
        "contact.brake.slip_limit_n = [3.0, 4.0]",
        "[[vary]]",
        "contact.link.slip_limit_n = [1.0, 2.0]",
    ]
    assert labels_of(tmp_path, *twice)[1] == "brake slip limit 3 N, link slip limit 2 N"
    fixed = ["[[vary]]", "contact.brake.slip_limit_n = [3.0]", "[[vary]]", "contact.link.slip_limit_n = [1.0, 2.0]"]
    assert labels_of(tmp_path, *fixed) == ["slip limit 1 N", "slip limit 2 N"]
    assert labels_of(tmp_path, *fixed[:2]) == ["slip limit 3 N"]
    close = ["[vary]", "load.shaker.force_n = [1.0000001, 1.0000002, 2.0]"]
    assert labels_of(tmp_path, *close) == ["force 1.0000001 N", "force 1.0000002 N", "force 2 N"]


@pytest.mark.parametrize(
    ("key", "values", "names"),
    [
        ("part.damper.mass_kg", [0.005, 0.01, 0.02], ["mass 5 g", "mass 10 g", "mass 20 g"]),
        ("part.damper.masses_kg", [[0.01], [0.02]], ["masses 10 g", "masses 20 g"]),
        ("part.damper.masses_kg", [[0.01, 0.02]], ["masses [10 20] g"]),
        ("load.pull.force_n", [20000, 50000], ["force 20 kN", "force 50 kN"]),
        ("load.pull.force_n", [500, 1000, 2000], ["force 500 N", "force 1000 N", "force 2000 N"]),
        ("load.pull.force_n", [0.05, 0.1], ["force 0.05 N", "force 0.1 N"]),
        ("contact.a.normal_stiffness_n_per_m", [2e4, 1e5], ["normal stiffness 20 N/mm", "normal stiffness 100 N/mm"]),
        ("contact.a.normal_stiffness_n_per_m", [4.5e8], ["normal stiffness 450 N/µm"]),
        ("contact.a.gap_m", [0, 1e-4, 0.0025], ["gap 0 mm", "gap 0.1 mm", "gap 2.5 mm"]),
        ("material.young_modulus_pa", [2.1e11], ["young modulus 210 GPa"]),
        ("contact.a.law", ["jenkins", "iwan"], ["law jenkins", "law iwan"]),
        ("rotation.speed_rpm", [3000.0, 12000.0], ["speed 3000 rpm", "speed 12000 rpm"]),
    ],
)
def test_numbers_in_names_have_the_prefix_that_an_engineer_writes(key, values, names):
    found = namings({key: values})[key]
    assert [found.name(value) for value in values] == names


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ('"light"', "vary.name: must be a list of texts, got 'light'"),
        ('["light", 2]', "vary.name: must be a list of texts"),
        ('["light"]', "vary.name: has 1 for 2 cases"),
        ('["light", "light"]', "vary: has several cases called 'light'"),
    ],
)
def test_names_of_cases_that_do_not_fit_are_refused(tmp_path, names, said):
    with pytest.raises(InputError, match=re.escape(said)):
        labels_of(tmp_path, "[[vary]]", "load.shaker.force_n = [1.0, 2.0]", f"name = {names}")


def test_a_key_may_be_varied_that_the_file_leaves_out(tmp_path):
    path = write_four_masses(tmp_path, {"vary.contact.stop.preload_n": "[0.0, 1.0]"})
    path.write_text(path.read_text(encoding="utf-8").replace(", gap_m = 1e-3", ""), encoding="utf-8")
    assert [c.tables.contact["stop"].preload for c in read_file(path).cases] == [0.0, 1.0]


def test_values_that_are_lists_themselves_vary(tmp_path):
    path = write_two_blades(tmp_path, {"vary.load.shaker.direction": '["x"]'})
    model = read_study(path).model()
    assert model.loads["shaker"].direction == (1.0, 0.0, 0.0)


@pytest.mark.parametrize("table", ["[vary]", "[[vary]]"])
def test_one_value_of_a_varied_key_is_refused_and_another_vary_is_taken(tmp_path, table):
    path, key = write_four_masses(tmp_path), "load.shaker.force_n"
    path.write_text(f"{path.read_text(encoding='utf-8')}\n{table}\n{key} = [2.0, 3.0]\n")
    study = read_study(path)
    with pytest.raises(InputError, match=r"is varied.*\[2\.0, 3\.0\].*\{\"vary\": \{") as caught:
        study.replace({key: 7.0})
    assert len(str(caught.value).splitlines()) == 1
    alone = study.replace({"vary": {key: [7.0]}})
    without = study.replace({"vary": {}, key: 7.0})
    for one in (alone, without):
        assert [c.tables.load["shaker"].force_n for c in one.file.cases] == [7.0]


def test_replacing_keys_is_checked_like_the_file(tmp_path):
    study = read_study(write_four_masses(tmp_path))
    assert study.replace({"load.shaker.force_n": 2.0}).model().loads["shaker"].newton == 2.0
    with pytest.raises(InputError, match=r"unknown key 'forc_n'. Did you mean 'force_n'"):
        study.replace({"load.shaker.forc_n": 2.0})
    assert tomllib.loads(study.text)["load"]["shaker"]["force_n"] == 5.0


@pytest.mark.parametrize("name", ANALYSES)
def test_a_file_is_judged_by_the_table_of_the_analysis(name):
    assert study_tables().model_fields[name].annotation == named(name).table | None


def test_a_unit_without_words_or_without_one_per_area_is_asked_for() -> None:
    with pytest.raises(
        InputError, match=r"a moment is shared, and its unit 'n_m' has none per area\. Add the pair to `PER_AREA`"
    ):
        quantity("a moment", "n_m", shared=True)

    @dataclass(frozen=True)
    class Lever:
        moment: float = quantity("a moment", "n_m")

    with pytest.raises(InputError, match=r"'a moment': has the unit 'n_m' without words\. Add it to `IN_WORDS`"):
        table_of(Lever)
