"""Study files: what is read, and what every kind of bad input is told."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError
from stickslip.study.assembly import contact_laws
from stickslip.study.build import sweep_of
from stickslip.study.contacts import NEEDS
from stickslip.study.example import example_text
from stickslip.study.schema import LARGEST_FILE, Study, json_schema, read_study

ROOT = Path(__file__).parents[1]


def written(folder: Path, *changes: tuple[str, str], more: str = "") -> Path:
    """Write the example with texts or, named by their key, values changed; every change must hit one place."""
    text = example_text()
    for old, new in changes:
        pattern = rf"(?<=\n{old} = )(\[[^\]]*\]|[^\s#]+)" if old.isidentifier() else re.escape(old)
        text, hits = re.subn(pattern, lambda _, new=new: new, text)
        assert hits == 1, f"{old!r} is {hits} times in the example"
    path = folder / "study.toml"
    path.write_text(text + more, encoding="utf-8")
    return path


def read(folder: Path, *changes: tuple[str, str], more: str = "") -> Study:
    return read_study(written(folder, *changes, more=more))


def complaint(folder: Path, *changes: tuple[str, str], more: str = "") -> str:
    with pytest.raises(InputError) as caught:
        read(folder, *changes, more=more)
    return str(caught.value)


def test_example_in_the_repository_is_the_one_that_ships() -> None:
    assert (ROOT / "examples/two_blades/study.toml").read_text(encoding="utf-8") == example_text()


def test_example_becomes_library_objects(tmp_path: Path) -> None:
    study = read(tmp_path)
    blades = study.tables.blades.library()
    damper = study.tables.damper.library(blades)
    assert blades.flat_angle == pytest.approx(np.pi / 4, rel=1e-15)
    assert damper.apex == blades.wedge_apex
    assert len(damper.contact_points().names) == 9
    assert study.tables.material.library().density == 7850.0
    assert study.folder == tmp_path.resolve() / "results"
    sweep = sweep_of(study.tables)
    lowest, highest = study.tables.sweep.frequency_hz
    assert sweep.omega_range == (2 * np.pi * lowest, 2 * np.pi * highest)
    assert sweep.threshold == pytest.approx(0.05, rel=1e-15)


def test_hash_follows_numbers_and_not_words(tmp_path: Path) -> None:
    plain = read(tmp_path).content_hash
    assert (
        read(tmp_path, ("schema_version = 1", "# more words\nschema_version = 1")).content_hash
        == plain
    )
    assert read(tmp_path, ("memory_gb", "3.0")).content_hash == plain
    assert read(tmp_path, ("centrifugal_n", "442.5")).content_hash != plain


SINGLE = {
    "negative mass": (
        ("mass_kg", "-0.1"),
        "damper.mass_kg: must be greater than 0, got -0.1. Give mass of the damper in kg, greater than zero.",
    ),
    "not a number": (
        ("centrifugal_n", "nan"),
        "loads.centrifugal_n: must be a finite number, got nan. Give centrifugal load on the damper in N, greater than zero.",
    ),
    "infinite": (
        ("density_kg_per_m3", "inf"),
        "material.density_kg_per_m3: must be a finite number, got inf. Give density in kg/m³, greater than zero (steel: 7850).",
    ),
    "misspelt key": (
        ("mass_kg =", "mas_kg ="),
        "damper.mas_kg: unknown key 'mas_kg'. Did you mean 'mass_kg'?",
    ),
    "misspelt table": (
        ("[material]", "[materiel]"),
        "materiel: unknown key 'materiel'. Did you mean 'material'?",
    ),
    "missing key": (
        ("foot_size_m = ", "# "),
        "blades.foot_size_m: is missing. Add it: element size in shank and foot in m.",
    ),
    "range reversed": (
        ("frequency_hz", "[220.0, 150.0]"),
        "sweep.frequency_hz: must be the lower before the higher, got [220.0, 150.0]. Give the lower frequency first.",
    ),
    "text for a number": (
        ("platform_gap_m", '"1 mm"'),
        "blades.platform_gap_m: must be a number, got '1 mm'. Give clearance between neighbouring platforms along x in m.",
    ),
    "half a mode": (
        ("fixed_interface_modes", "2.5"),
        (
            "reduction.fixed_interface_modes: must be a whole number, got 2.5. "
            "Give number of fixed-interface modes kept beside the static ones, 1 to 500."
        ),
    ),
    "truth for a number": (
        ("peak_points", "true"),
        "sweep.peak_points: must be a whole number, got True. Give most points added to resolve the peak, 0 to 100.",
    ),
    "unknown selection": (
        ("selection", '"always_hihg"'),
        "harmonics.selection: is not known, got 'always_hihg'. Did you mean 'always_high'?",
    ),
    "unknown evaluator": (
        ("evaluator", '"event"'),
        "solver.evaluator: is not known, got 'event'. Did you mean 'events'?",
    ),
    "high below low": (
        ("low", "7"),
        "harmonics.high: must not be below low = 7, got 5. Raise it, or lower low.",
    ),
    "too few samples": (
        ("samples", "32"),
        "harmonics.samples: must be at least 8 times high = 5, got 32. Give at least 40, better a power of two.",
    ),
    "impossible inertia": (
        ("inertia_kg_m2", "[1.0e-5, 1.0e-6, 1.0e-6]"),
        "damper.inertia_kg_m2: the largest moment exceeds the sum of the other two",
    ),
    "lines swapped": (
        ("flat_distances_m", "[0.0075, 0.0050]"),
        "damper.flat_distances_m: need 0 < L1 < L2 (metres from the apex), got (0.0075, 0.005)",
    ),
    "blades overlap": (
        ("pitch_m", "0.009"),
        "blades.pitch_m: 0.009 m leaves no room for platforms",
    ),
    "ratio twice": (
        ("ratios", "[20, 5, 20]"),
        "loads.ratios: holds a number twice, got [20.0, 5.0, 20.0]. Give every ratio once.",
    ),
    "no ratio": (
        ("ratios", "[]"),
        "loads.ratios: has the wrong number of entries, got []. Give ratios of centrifugal load to excitation amplitude",
    ),
    "zero ratio": (
        ("ratios", "[20, 0]"),
        "loads.ratios.1: must be greater than 0, got 0. Give ratios of centrifugal load to excitation amplitude",
    ),
    "absolute folder": (
        ("folder", '"/var/results"'),
        (
            "output.folder: must be a folder inside the study's folder, got '/var/results'. "
            "Give a plain relative name such as 'results'."
        ),
    ),
    "folder above": (
        ("folder", '"a/../../b"'),
        (
            "output.folder: must be a folder inside the study's folder, got 'a/../../b'. "
            "Give a plain relative name such as 'results'."
        ),
    ),
    "newer layout": (
        ("schema_version", "2"),
        (
            "schema_version: this version of stickslip reads 1, got 2. Write schema_version = 1, or install the stickslip that the "
            "file was written for."
        ),
    ),
}


@pytest.mark.parametrize("name", SINGLE)
def test_bad_input_is_named_with_value_and_remedy(tmp_path: Path, name: str) -> None:
    change, message = SINGLE[name]
    said = complaint(tmp_path, change)
    assert f"{tmp_path / 'study.toml'}: {message}" in said
    if name not in {"misspelt key", "misspelt table"}:
        assert "\n" not in said, "one mistake, one line"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "normal_stiffness_n_per_m = 25e6",
            "normal_stiffness_n_per_m = 0.0",
            (
                "contact.curved.normal_stiffness_n_per_m: must be greater than 0, got 0.0. Give normal stiffness of the whole "
                "interface in N/m, greater than zero: nothing else holds the damper."
            ),
        ),
        (
            'law = "elastic_coulomb"\nnormal_stiffness_n_per_m = 25e6',
            'law = "elastic_columb"\nnormal_stiffness_n_per_m = 25e6',
            "contact.curved.law: is not known, got 'elastic_columb'. Did you mean 'elastic_coulomb'?",
        ),
    ],
    ids=["zero contact stiffness", "unknown law"],
)
def test_bad_contact_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert complaint(tmp_path, (old, new)) == f"{tmp_path / 'study.toml'}: {message}"


# the example's curved side under another law, and what it then says
CURVED = """[contact.curved]
law = "elastic_coulomb"
normal_stiffness_n_per_m = 25e6
tangential_stiffness_n_per_m = 20e6
axial_stiffness_n_per_m = 450e6
friction_coefficient = 0.6
"""


def curved(law: str, **values: float) -> tuple[str, str]:
    """Return the change that gives the curved side a law with some keys."""
    keys = "".join(f"{key} = {value}\n" for key, value in values.items())
    return CURVED, f'[contact.curved]\nlaw = "{law}"\n{keys}'


NORMAL = {"normal_stiffness_n_per_m": 24e6}
PLANE = NORMAL | {"tangential_stiffness_n_per_m": 18e6}
BOTH = PLANE | {"axial_stiffness_n_per_m": 450e6}
OF_LAWS = {
    "elastic_coulomb": (
        BOTH | {"friction_coefficient": 0.3},
        ElasticCoulomb(k_t=6e6, k_w=150e6, k_n=8e6, mu=0.3),
    ),
    "coupled_coulomb": (
        PLANE | {"friction_coefficient": 0.3},
        CoupledCoulomb(k_t=6e6, k_n=8e6, mu=0.3),
    ),
    "jenkins": (BOTH | {"slip_limit_n": 90.0}, Jenkins(k_t=6e6, k_w=150e6, k_n=8e6, limit=30.0)),
    "iwan": (BOTH | {"slip_limit_n": 90.0}, Iwan(k_t=6e6, k_w=150e6, k_n=8e6, limit=30.0)),
    "unilateral_spring": (NORMAL, UnilateralSpring(k_n=8e6)),
    "bonded": (BOTH, Bonded(k_t=6e6, k_w=150e6, k_n=8e6)),
}


def test_every_law_of_the_file_is_tested() -> None:
    assert set(OF_LAWS) == set(NEEDS)


@pytest.mark.parametrize("name", OF_LAWS)
def test_laws_share_the_stiffness_of_a_side_among_its_points(tmp_path: Path, name: str) -> None:
    values, expected = OF_LAWS[name]
    tables = read(tmp_path, curved(name, **values)).tables
    points = tables.damper.library(tables.blades.library()).contact_points()
    laws = contact_laws(tables, points)
    assert points.side == ("flat",) * 6 + ("curved",) * 3
    assert {type(law) for law in laws[:6]} == {ElasticCoulomb}
    for law in laws[6:]:
        assert type(law) is type(expected)
        np.testing.assert_allclose(law.parameters(), expected.parameters(), rtol=1e-15)


def test_law_with_the_keys_of_another_is_told_key_by_key(tmp_path: Path) -> None:
    said = complaint(tmp_path, ('"elastic_coulomb"\nnormal_stiffness_n_per_m = 25e6', '"jenkins"\nnormal_stiffness_n_per_m = 25e6'))  # fmt: skip
    at = f"{tmp_path / 'study.toml'}: contact.curved"
    assert said.splitlines() == [
        (
            f"{at}.friction_coefficient: is no parameter of the law jenkins, got 0.6. Remove it, or choose a law that has it: "
            "elastic_coulomb, coupled_coulomb."
        ),
        (
            f"{at}.slip_limit_n: is missing, the law jenkins needs it. Add it: friction force in N at which the whole interface "
            "has slipped, along either tangent, greater than zero."
        ),
    ]


@pytest.mark.parametrize("key", ["tangential_stiffness_n_per_m", "axial_stiffness_n_per_m"])
def test_stiffness_that_a_law_needs_is_missed(tmp_path: Path, key: str) -> None:
    values = BOTH | {"friction_coefficient": 0.3}
    del values[key]
    said = complaint(tmp_path, curved("elastic_coulomb", **values))
    assert f"contact.curved.{key}: is missing, the law elastic_coulomb needs it. Add it: " in said


def test_slip_limit_must_be_positive(tmp_path: Path) -> None:
    said = complaint(tmp_path, curved("iwan", **(BOTH | {"slip_limit_n": -1.0})))
    assert "contact.curved.slip_limit_n: must be greater than 0, got -1.0. Give friction force" in said  # fmt: skip
    assert "\n" not in said


def test_law_and_evaluator_belong_to_what_numbers_depend_on(tmp_path: Path) -> None:
    plain = read(tmp_path).content_hash
    assert read(tmp_path, ("evaluator", '"intervals"')).content_hash != plain
    assert read(tmp_path, curved("bonded", **BOTH)).content_hash != plain
    assert sweep_of(read(tmp_path, ("evaluator", '"march"')).tables).evaluator == "march"


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    said = complaint(
        tmp_path,
        ("mass_kg", "-1"),
        ("density_kg_per_m3", "0"),
        ("frequency_hz", "[220, 150]"),
        ("pitch_m", "0.009"),
        ("folder", '".."'),
    ).splitlines()
    assert [line.split(": ")[1] for line in said] == [
        "blades.pitch_m",
        "material.density_kg_per_m3",
        "damper.mass_kg",
        "sweep.frequency_hz",
        "output.folder",
    ]


def test_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (home / "results").symlink_to(tmp_path)
    said = complaint(home)
    assert said == (
        f"{home / 'study.toml'}: output.folder: leads out of the study's folder, got 'results', which is "
        f"{tmp_path.resolve()}. Give a plain relative name such as 'results'."
    )


def test_files_that_are_no_study(tmp_path: Path) -> None:
    missing = tmp_path / "none.toml"
    with pytest.raises(
        InputError, match=r"none\.toml: there is no such file\. Check the name, or write an example"
    ):
        read_study(missing)
    with pytest.raises(InputError, match=r"is not a file\. Name the study file itself"):
        read_study(tmp_path)
    bad = tmp_path / "bad.toml"
    bad.write_text("[blades\n")
    with pytest.raises(
        InputError, match=r"bad.toml: is not valid TOML: .*line 1.*\. Correct the line named\."
    ):
        read_study(bad)
    bad.write_bytes(b"title = '\xff'")
    with pytest.raises(InputError, match=r"is not UTF-8 text \(byte 9\)\. Save it as UTF-8"):
        read_study(bad)
    bad.write_bytes(b"#" * (LARGEST_FILE + 1))
    with pytest.raises(
        InputError, match=rf"is larger than {LARGEST_FILE} bytes\. A study file is a few kilobytes"
    ):
        read_study(bad)
    bad.write_text("x = " + "[" * 100_000)
    with pytest.raises(InputError, match="is not valid TOML"):
        read_study(bad)


def test_long_values_are_cut_in_messages(tmp_path: Path) -> None:
    said = complaint(tmp_path, ("mass_kg", f'"{"9" * 10_000}"'))
    assert len(said) < 400
    assert "damper.mass_kg: must be a number, got '999" in said


def test_schema_is_json_and_knows_every_table() -> None:
    schema = json.loads(json_schema())
    tables = [
        "blades",
        "material",
        "reduction",
        "damping",
        "damper",
        "contact",
        "loads",
        "sweep",
        "harmonics",
        "solver",
        "retention",
        "limits",
        "output",
    ]
    assert set(tables) < set(schema["properties"])
    assert schema["additionalProperties"] is False
    assert schema["$defs"]["Damper"]["properties"]["mass_kg"]["exclusiveMinimum"] == 0
    described = [p for d in schema["$defs"].values() for p in d.get("properties", {}).values()]
    assert all("description" in p for p in described)
