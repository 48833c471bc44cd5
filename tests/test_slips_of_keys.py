"""Keys that were meant: in another unit, with their value there; misspelt, told before and instead of what then is missing."""

import math

import pytest
from small_v2 import EXAMPLES, write_four_masses

import stickslip as ss
from stickslip.errors import InputError
from stickslip.study.file.suffixes import meant_key, nearest_key, unit_of
from stickslip.study.models.study import read_study

UNITS = [
    ("m", 1.0, (1, 0, 0, 0)),
    ("mm", 1e-3, (1, 0, 0, 0)),
    ("n_per_mm", 1e3, (0, 1, -2, 0)),
    ("n_per_um", 1e6, (0, 1, -2, 0)),
    ("n_per_mm3", 1e9, (-2, 1, -2, 0)),
    ("kg_m2", 1.0, (2, 1, 0, 0)),
    ("t_per_mm3", 1e12, (-3, 1, 0, 0)),
    ("kg_per_m3", 1.0, (-3, 1, 0, 0)),
    ("n_s_per_m", 1.0, (0, 1, -1, 0)),
    ("hz", 2 * math.pi, (0, 0, -1, 1)),
    ("rad_per_s", 1.0, (0, 0, -1, 1)),
    ("percent", 1e-2, (0, 0, 0, 0)),
    ("psi", 6894.757, (-1, 1, -2, 0)),
]


@pytest.mark.parametrize(("ending", "size", "powers"), UNITS, ids=[u[0] for u in UNITS])
def test_an_ending_of_a_key_is_a_unit(ending, size, powers):
    unit = unit_of(ending)
    assert unit is not None
    assert math.isclose(unit.size, size, rel_tol=1e-6)
    assert unit.powers == powers


@pytest.mark.parametrize("ending", ["", "per", "n_per", "ratio", "m7", "per_m_per_s"])
def test_what_is_no_unit_is_none(ending):
    assert unit_of(ending) is None


CONVERTED = [
    ("speed_hz", ["speed_rpm"], 100.0, "Did you mean 'speed_rpm'? 100 Hz are 6000 rpm."),
    ("speed_hz", ["speed_rpm"], "x", "Did you mean 'speed_rpm'? 1 Hz is 60 rpm."),
    ("speed_hz", ["speed_rpm"], True, "Did you mean 'speed_rpm'? 1 Hz is 60 rpm."),
    ("frequency_rpm", ["frequency_hz"], [600, 1200.0], "Did you mean 'frequency_hz'? 600, 1200 rpm are 10, 20 Hz."),
    ("length_mm", ["length_m", "length_unit"], 1, "Did you mean 'length_m'? 1 mm is 0.001 m."),
    ("turn_rad", ["turn_deg"], math.pi, "Did you mean 'turn_deg'? 3.14159 rad are 180 °."),
    ("k_n_per_mm", ["k_n_per_m"], 5.0, "Did you mean 'k_n_per_m'? 5 N/mm are 5000 N/m."),
    ("young_modulus_gpa", ["young_modulus_pa"], 210.0, "Did you mean 'young_modulus_pa'? 210 GPa are 2.1e+11 Pa."),
    ("ratio_percent", ["ratio"], 0.5, "Did you mean 'ratio'? 0.5 % are 0.005."),
    ("accuracy", ["accuracy_percent"], 2.0, "Did you mean 'accuracy_percent'?"),
    ("stiffness_n", ["stiffness_n_per_m"], 2.0, "Did you mean 'stiffness_n_per_m'?"),
    ("mass_m", ["mass_kg"], 2.0, "Did you mean 'mass_kg'?"),
    ("colour", ["speed_rpm"], 2.0, "Known: speed_rpm."),
]


@pytest.mark.parametrize(("word", "known", "value", "said"), CONVERTED, ids=[f"{c[0]}={c[2]}" for c in CONVERTED])
def test_a_key_in_another_unit_is_converted(word, known, value, said):
    assert nearest_key(word, known, value) == said
    assert meant_key(word, known) == (known[0] if said.startswith("Did") else "")


MISSPELT = [
    (
        "engine_order =",
        "engine_ordre =",
        ["load.gas.engine_ordre: unknown key 'engine_ordre'. Did you mean 'engine_order'?"],
    ),
    (
        "friction_coefficient",
        "friction_coeficient",
        ["contact.shroud.friction_coeficient: unknown key 'friction_coeficient'. Did you mean 'friction_coefficient'?"],
    ),
    (
        "normal_stiffness_n_per_m ",
        "normal_stiffness_n_per_mm ",
        ["contact.shroud.normal_stiffness_n_per_mm: unknown key", "600000 N/mm are 6e+08 N/m."],
    ),
    ("\nlaw = ", "\nlwa = ", ["contact.shroud.lwa: unknown key 'lwa'. Did you mean 'law'?"]),
    ("\nbetween = ", "\nbetwen = ", ["contact.shroud.betwen: unknown key 'betwen'. Did you mean 'between'?"]),
    ("\nfile = ", "\nfille = ", ["part.blade.fille: unknown key 'fille'. Did you mean 'file'?"]),
    ("speed_rpm = ", 'axis = "y"\nspeed_rpm = ', ["rotation.axis: unknown key 'axis'. The axis belongs to the part"]),
    (
        "\nfile = ",
        '\nclamped = "root"\nfile = ',
        ["part.blade.clamped: must be a list, got 'root'. Write clamped = ['root']. It means"],
    ),
    ("speed_rpm = ", "speed_hz = ", ["rotation.speed_hz: unknown key 'speed_hz'. Did you mean 'speed_rpm'? "]),
]


@pytest.mark.parametrize(("right", "wrong", "said"), MISSPELT, ids=[m[1].strip() for m in MISSPELT])
def test_a_misspelt_key_is_told_and_not_what_it_stands_for(right, wrong, said, tmp_path):
    path = tmp_path / "study.toml"
    text = (EXAMPLES / "sector_deck" / "study.toml").read_text(encoding="utf-8")
    assert right in text
    path.write_text(text.replace(right, wrong), encoding="utf-8")
    (tmp_path / "sector.inp").touch()  # a missing file would be told, too
    with pytest.raises(InputError) as error:
        read_study(path)
    told = str(error.value)
    assert len(told.splitlines()) == 1
    for part in said:
        assert part in told


def test_unknown_keys_come_before_what_is_missing(tmp_path):
    path = write_four_masses(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("\non = ", "\nwhere = "), encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_study(path)
    first, *others = str(error.value).splitlines()
    assert "unknown key 'where'" in first
    assert any(".on: is missing. Add it" in line for line in others)


def test_vary_and_python_name_the_key_in_its_unit(tmp_path):
    path = write_four_masses(tmp_path, {"vary.load.shaker.force_kn": "[1.0]"})
    with pytest.raises(InputError, match=r"no key 'force_kn'. Did you mean 'force_n'\? 1 kN is 1000 N"):
        read_study(path)
    model = read_study(write_four_masses(tmp_path / "right")).model()
    with pytest.raises(InputError, match=r"frequency_rpm.*Did you mean 'frequency_hz'\? 600 rpm are 10 Hz"):
        ss.Model(parts=model.parts, loads=model.loads).forced_response(frequency_rpm=600.0)


def test_what_elastic_coulomb_needs_between_single_dofs_is_said(tmp_path):
    """Both stiffnesses have no effect there: 0 is enough, as the message and `stickslip keys` say."""
    path = write_four_masses(tmp_path)
    text = path.read_text(encoding="utf-8")
    old = 'law = "jenkins", tangential_stiffness_n_per_m = 2e4, slip_limit_n = 2.0'
    new = 'law = "elastic_coulomb", tangential_stiffness_n_per_m = 2e4, friction_coefficient = 0.5, preload_n = 4.0'
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_study(path)
    axial, normal = str(error.value).splitlines()
    assert "axial_stiffness_n_per_m: is missing, the law elastic_coulomb needs it" in axial
    assert "(0 between single dofs, which move along one line) in N/m" in axial
    assert "(0 where the normal force stays the preload, as between single dofs) in N/m" in normal
    more = f"{new}, axial_stiffness_n_per_m = 0.0, normal_stiffness_n_per_m = 0.0"
    path.write_text(text.replace(old, more), encoding="utf-8")
    assert read_study(path).model().contacts["brake"].law.k_n == 0.0
