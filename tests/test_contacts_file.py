"""Contacts of a study file: every law runs from one, and what presses or opens a contact at rest."""

import logging
from pathlib import Path

import numpy as np
import pytest
from small_v2 import write_shrouded_deck

import stickslip as ss
from stickslip.assembly.assembling import assemble
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.laws import LAWS
from stickslip.contact.laws.iwan import FourParameter
from stickslip.errors import InputError
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.harmonic_set import to_complex, to_real
from stickslip.study.check import check_study
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study
from stickslip.study.store.netcdf import read_tree

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

CHAIN = """
schema_version = 2
title = "Two masses and a contact"
[part.chain]
shape = "lumped"
masses_kg = [1.0, 1.0]
springs_n_per_m = [["ground", 1, 4e4], [1, 2, 4e4]]
dashpots_n_s_per_m = [["ground", 1, 20.0], [1, 2, 20.0]]
[load.shaker]
on = "chain.m1"
force_n = 5.0
[forced_response]
frequencies_hz = [15.0, 20.0, 25.0]
peak_points = 0
stability = "off"
[solver]
evaluator = "intervals"
[harmonics]
low = 3
high = 3
samples = 64
selection = "always_low"
[output]
points = { first = "chain.m1" }
[contact.joint]
between = ["chain.m2", "ground"]
"""
TANGENTIAL = "tangential_stiffness_n_per_m = 2e4\n"
NORMAL = "normal_stiffness_n_per_m = 2e4\n"
# of each law: what the file says, and the same in Python
WRITTEN = {
    "bonded": (f"{TANGENTIAL}axial_stiffness_n_per_m = 0.0\n{NORMAL}", ss.Bonded(k_t=2e4, k_w=0.0, k_n=2e4)),
    "unilateral_spring": (f"{NORMAL}preload_n = 1.0", ss.UnilateralSpring(k_n=2e4, preload=1.0)),
    "cubic_spring": (f"{TANGENTIAL}cubic_tangential_n_per_m3 = 1e10", ss.CubicSpring(k_t=2e4, cubic_t=1e10)),
    "polynomial_spring": ("along_t = [2e4, 0.0, 1e10]", ss.PolynomialSpring(along_t=(2e4, 0.0, 1e10))),
    "jenkins": (f"{TANGENTIAL}slip_limit_n = 2.0", ss.Jenkins(k_t=2e4, limit=2.0)),
    "elastic_coulomb": (
        f"{TANGENTIAL}axial_stiffness_n_per_m = 0.0\n{NORMAL}friction_coefficient = 0.5\npreload_n = 4.0",
        ss.ElasticCoulomb(k_t=2e4, k_w=0.0, k_n=2e4, mu=0.5, preload=4.0),
    ),
    "coupled_coulomb": (
        f"{TANGENTIAL}axial_stiffness_n_per_m = 1e4\n{NORMAL}friction_coefficient = 0.5\ninterference_m = 2e-4",
        ss.CoupledCoulomb(k_t=2e4, k_w=1e4, k_n=2e4, mu=0.5, preload=4.0),
    ),
    "regularised_coulomb": (
        "transition_velocity_m_per_s = 0.05\nfriction_coefficient = 0.5\npreload_n = 4.0",
        ss.RegularisedCoulomb(mu=0.5, transition_velocity=0.05, preload=4.0),
    ),
    "dahl": (f"{TANGENTIAL}slip_limit_n = 2.0", ss.Dahl(k_t=2e4, limit=2.0)),
    "bouc_wen": (
        f"{TANGENTIAL}beta = 5e3\ngamma = 5e3\nalpha = 0.1",
        ss.BoucWen(k_t=2e4, beta=5e3, gamma=5e3, alpha=0.1),
    ),
    "iwan": (
        f'{TANGENTIAL}slip_limit_n = 2.0\npopulation = {{ kind = "four_parameter", chi = -0.5, beta = 0.5 }}',
        ss.Iwan(k_t=2e4, limit=2.0, population=FourParameter(chi=-0.5, beta=0.5)),
    ),
}


def write(folder, contact, text=CHAIN):
    path = folder / "study.toml"
    path.write_text(text + contact, encoding="utf-8")
    return path


def answered(path):
    study = read_study(path)
    outcome = run_study(study)
    assert outcome is not None
    return read_tree(study.folder / "result.nc")["forced_response"]


def test_every_law_is_written_in_a_file():
    assert list(WRITTEN) == list(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_forces_of_a_study_are_those_of_the_law(name, tmp_path):
    said, law = WRITTEN[name]
    data = answered(write(tmp_path, f'law = "{name}"\n{said}\n'))
    gap, force = ((data[v].values[..., 0] + 1j * data[v].values[..., 1])[:, :, 0] for v in ("gap", "contact_force"))
    assert (data["status"] == 0).all()
    direction = 2 if name == "unilateral_spring" else 0
    for own, told, hertz in zip(gap, force, data["frequency_hz"].values, strict=True):
        period = contact_forces(to_real(own), compile_contacts([law], None, "march"), 64, 2 * np.pi * hertz)
        found = to_complex(period.coefficients)
        assert np.abs(found[1, direction]) > 0.05  # N: the contact has a say
        np.testing.assert_allclose(told, found, rtol=0, atol=1e-9 * np.abs(found).max())


def pressed(folder, contact):
    """Return the static force and gap of a stop between the second mass and the ground."""
    law = 'law = "unilateral_spring"\nnormal_stiffness_n_per_m = 2e4\n'
    found = assemble(read_study(write(folder, law + contact)).model(), 3)
    return found.static_force[0, 2], found.static_gap[0, 2]


def test_an_interference_presses_as_much_as_the_springs_let_it(tmp_path):
    """The chain gives way by 1 / (k/2 + k_n) of the force that the overlap makes: 4e4 N/m twice in a row against 2e4 N/m."""
    force, gap = pressed(tmp_path, "interference_m = 2e-4\n")
    assert force == pytest.approx(-2e4 * 2e-4 / 2)
    assert gap == pytest.approx(1e-4)
    assert pressed(tmp_path, "preload_n = 4.0\n") == pytest.approx((force, gap))
    assert pressed(tmp_path, "gap_m = 1e-3\n") == (0.0, 0.0)


REFUSED = [
    ("gap_m = 1e-4\ninterference_m = 1e-4", "interference_m: is given together with gap_m"),
    ("gap_m = 1e-4\npreload_n = 1.0", "preload_n: is given together with gap_m"),
    ("interference_m = 1e-4\npreload_n = 1.0", "preload_n: is given together with interference_m"),
    ("preload_n = -1.0", "preload_n: must be greater than or equal to 0, got -1.0"),
    ('per = "point"\npreload_pa = 1.0', "preload_pa: is not the key with per = one other than area"),
]


@pytest.mark.parametrize(("said", "told"), REFUSED)
def test_a_contact_at_rest_is_one_thing(said, told, tmp_path):
    law = 'law = "unilateral_spring"\nnormal_stiffness_n_per_m = 2e4\n'
    with pytest.raises(InputError) as error:
        read_study(write(tmp_path, law + said))
    assert f"contact.joint.{told}" in str(error.value)


@pytest.mark.parametrize(
    ("said", "told"),
    [
        (
            "jenkins",
            "interference_m: is given \\(in Python gap=-0.0001\\), and the law jenkins has a normal force that does not depend on how far",
        ),
        (
            "regularised_coulomb",
            "interference_m: is given \\(in Python gap=-0.0001\\), and the law regularised_coulomb has no normal stiffness here",
        ),
    ],
)
def test_an_interference_that_presses_nothing_is_refused(said, told, tmp_path):
    own = WRITTEN[said][0].replace("preload_n = 4.0", "")
    study = read_study(write(tmp_path, f'law = "{said}"\n{own}\ninterference_m = 1e-4\n'))
    with pytest.raises(InputError, match=f"contact.joint.{told}"):
        run_study(study)


def test_a_contact_where_everything_is_clamped_says_so(tmp_path: Path) -> None:
    bars = Path(__file__).parent / "data" / "calculix" / "tied_bars.inp"
    (tmp_path / "bars.inp").write_text(bars.read_text() + "*NSET, NSET=FOOT\nROOT\n")
    path = tmp_path / "study.toml"
    path.write_text(
        'schema_version = 2\ntitle = "t"\n[part.bars]\nfile = "bars.inp"\nunits = "mm-t-s"\n'
        '[contact.foot]\nbetween = ["bars.foot", "ground"]\nlaw = "bonded"\n'
        "normal_stiffness_n_per_m = 1e6\ntangential_stiffness_n_per_m = 1e6\naxial_stiffness_n_per_m = 1e6\n"
        '[load.shaker]\non = "bars.tip"\ndirection = "z"\nforce_n = 1.0\n'
        "[forced_response]\nfrequencies_hz = [100.0]\n"
    )
    with pytest.raises(InputError, match=r"contact.foot.between: every node of 'bars.foot' is clamped"):
        check_study(read_study(path))


def test_shrouds_named_the_wrong_way_round_are_told_so(tmp_path: Path) -> None:
    swapped = {"contact.shroud.between": '["blade.shroud_low", "next.blade.shroud_high"]'}
    study = read_study(write_shrouded_deck(tmp_path, swapped))
    with pytest.raises(InputError) as caught:
        check_study(study)
    said = str(caught.value)
    right = '["blade.SHROUD_HIGH", "next.blade.SHROUD_LOW"]'  # as the file of the model has them
    assert said.endswith(f"With blade.SHROUD_LOW and blade.SHROUD_HIGH exchanged they match: between = {right}.")
    # faces that match neither way keep their own advice
    same = {"contact.shroud.between": '["blade.shroud_low", "next.blade.shroud_low"]'}
    with pytest.raises(InputError) as caught:
        check_study(read_study(write_shrouded_deck(tmp_path / "same", same)))
    assert "exchanged" not in str(caught.value)


def test_a_wave_that_the_wheel_of_a_file_lacks_is_refused_before_anything_is_reduced(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    changes = {"modes.nodal_diameters": "[0, 5]", "vary.load.gas.force_n": "[1.0, 2.0]"}
    path = write_shrouded_deck(tmp_path, changes)
    with caplog.at_level(logging.INFO, "stickslip"), pytest.raises(InputError) as caught:
        check_study(read_study(path))
    assert (
        str(caught.value)
        == f"{path} (force 1 N): modes.nodal_diameters: 5 is above half of 8 sectors. The nodal diameters go from 0 to 4."
    )
    assert "reducing" not in caplog.text
    assert "pairing" not in caplog.text
