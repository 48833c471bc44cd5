"""Reductions and dampings of a study file: each method against the part kept whole, each form of damping against closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest
from small_v2 import write_shrouded_sector
from test_assembly_copies import answered, halves
from test_cli import refused

from stickslip.assembly.assembling import assemble
from stickslip.errors import InputError
from stickslip.model.damping import Damping
from stickslip.model.matrices import chain
from stickslip.model.modes import normal_modes
from stickslip.model.part import structure_part
from stickslip.reduction.choice import Reduction
from stickslip.reduction.truncation import FrequencyError, ModesBelow
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

BEAM = """
schema_version = 2
[part.rod]
shape = "beam"
length_m = 0.5
area_m2 = 1e-4
second_moment_m4 = 1e-9
elements = 20
[material]
young_modulus_pa = 2.1e11
poisson_ratio = 0.3
density_kg_per_m3 = 7850.0
{tables}
[contact.brake]
between = ["rod.tip", "ground"]
law = "jenkins"
tangential_stiffness_n_per_m = 5e3
slip_limit_n = 1.0
[load.shaker]
on = "rod.node10.z"
force_n = 3.0
[forced_response]
frequency_hz = [50.0, 70.0]
"""
RAYLEIGH = "[damping]\nratio = 0.01\nbetween_hz = [30.0, 300.0]\n"


def study(folder: Path, tables: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(BEAM.format(tables=tables))
    return folder / "study.toml"


def model(folder: Path, tables: str):
    return read_study(study(folder, tables)).model()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return model(tmp_path_factory.mktemp("whole"), RAYLEIGH)


@pytest.mark.parametrize(
    ("keys", "tolerance"),
    [
        ("fixed_interface_modes = 12", 1e-5),
        ("up_to_hz = 4000.0", 2e-4),
        ("up_to_hz = 1000.0\nfactor = 10.0", 5e-5),
        ("up_to_hz = 1000.0\nfrequency_error = 1e-5", 1e-5),
        ('method = "rubin"\nfree_interface_modes = 8', 1e-6),
        ('method = "rubin"\nup_to_hz = 2000.0', 1e-5),
        ('method = "none"', 1e-12),
    ],
)
def test_each_reduction_gives_frequencies_and_response_of_the_whole_part(tmp_path, whole, keys, tolerance):
    found = model(tmp_path, f"{RAYLEIGH}[part.rod.reduction]\n{keys}\n")
    small, full = assemble(found, 3), assemble(whole, 3)
    assert (small.counts["reduced"] < full.counts["reduced"]) == ("none" not in keys)
    for name in ("free_reduced", "stuck_reduced"):
        mine, theirs = getattr(small.frequencies, name)[:3], getattr(full.frequencies, name)[:3]
        np.testing.assert_allclose(mine, theirs, rtol=tolerance)
    one, other = answered(found), answered(whole)
    for mine, theirs in zip(one, other, strict=True):
        assert np.abs(mine.outputs - theirs.outputs).max() <= 100 * tolerance * np.abs(theirs.outputs).max()


def test_a_number_above_that_of_the_modes_keeps_all():
    structure = chain(6, 1.0, 1e4)
    reduced = Reduction(500).of(structure, np.array([5]))
    assert reduced.n == 6
    assert Reduction(2, "rubin").of(structure, np.array([5])).n == 3
    assert "rubin, 2 modes" in repr(structure_part(structure, reduction=Reduction(2, "rubin")))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('method = "rubin"', "free_interface_modes: is missing with rubin"),
        ('method = "rubin"\nfixed_interface_modes = 3', "is no key of the method rubin"),
        ('method = "none"\nup_to_hz = 3.0', "is no key of the method none"),
        ("free_interface_modes = 3", "is no key of the method craig_bampton"),
        ("fixed_interface_modes = 3\nup_to_hz = 9.0", "is given together with"),
        ("frequency_error = 1e-3", "goes together with up_to_hz"),
        ("up_to_hz = 9.0\nfactor = 2.0\nfrequency_error = 1e-3", "is given together with factor"),
        ("interface_modes = 3", "unknown key 'interface_modes'"),
    ],
)
def test_keys_that_do_not_fit_are_refused(tmp_path, keys, message):
    path = study(tmp_path, f"[part.rod.reduction]\n{keys}\n")
    assert message in refused("check", str(path))


def test_shapes_of_joins_need_a_join(tmp_path):
    path = study(tmp_path, "[reduction]\ninterface_modes = 3\n")
    said = refused("check", str(path))
    assert "reduction.interface_modes: is 3, and nothing is joined" in said


def test_reductions_without_a_file_are_refused_alike():
    with pytest.raises(InputError, match=r"Reduction.method: is 'guyan'"):
        Reduction(3, "guyan")
    with pytest.raises(InputError, match=r"Reduction.n_modes: is an error of frequencies"):
        Reduction(FrequencyError(1e-3, 100.0), "rubin")


@pytest.mark.parametrize("keys", ['method = "rubin"\nfree_interface_modes = 12', "up_to_hz = 2500.0"])
def test_waves_of_a_wheel_are_reduced_in_the_same_ways(tmp_path, keys):
    path = write_shrouded_sector(tmp_path)
    text = path.read_text()
    path.write_text(text.replace("fixed_interface_modes = 6", keys))
    frequencies = assemble(read_study(path).model(), 1).frequencies
    assert frequencies.stuck_full[0] > 100.0
    np.testing.assert_allclose(frequencies.stuck_reduced[:2], frequencies.stuck_full[:2], rtol=2e-3)
    np.testing.assert_allclose(frequencies.free_reduced[:2], frequencies.free_full[:2], rtol=2e-3)


def test_shapes_stand_for_joined_nodes():
    """Two tied halves, 4 shared nodes: as many shapes as dofs are exact, few are near."""
    plain = halves("node_to_node", n_modes=10)
    full = assemble(plain, 3)
    for count, tolerance in ((12, 1e-9), (7, 2e-2)):
        model = halves("node_to_node", n_modes=10, interface_modes=count)
        small = assemble(model, 3)
        assert small.counts["reduced"] == full.counts["reduced"] - 12 + count
        for name in ("free_reduced", "stuck_reduced"):
            mine, theirs = getattr(small.frequencies, name), getattr(full.frequencies, name)
            np.testing.assert_allclose(mine[:4], theirs[:4], rtol=tolerance)
        # the answer to static forces on what stays is exact however few there are
        np.testing.assert_allclose(small.static_gap, full.static_gap, atol=1e-12)
        for mine, theirs in zip(answered(model), answered(plain), strict=True):
            assert np.abs(mine.outputs - theirs.outputs).max() <= 5 * tolerance * np.abs(theirs.outputs).max()


def ratios(structure) -> np.ndarray:
    """Return the damping ratio of each mode."""
    modes = normal_modes(structure, structure.n)
    rates = np.einsum("im,ij,jm->m", modes.shapes, structure.damping, modes.shapes)
    return rates / (2 * np.sqrt(modes.squares))


@pytest.mark.parametrize("reduction", ["", "[part.rod.reduction]\nfixed_interface_modes = 8\n"])
@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ("ratio = 0.01\nbetween_hz = [30.0, 300.0]", None),
        ("alpha_per_s = 3.0\nbeta_s = 1e-5", lambda w: 3.0 / (2 * w) + 1e-5 * w / 2),
        ("alpha_per_s = 3.0", lambda w: 3.0 / (2 * w)),
        ("modal_ratio = 0.004", lambda w: 0.004 + 0 * w),
        (
            "modal_ratios = [0.01, 0.002]",
            lambda w: np.where(np.arange(w.size) < 2, [0.01, 0.002] + [0.0] * (w.size - 2), 0.0),
        ),
    ],
)
def test_each_form_of_damping_gives_its_ratios(tmp_path, keys, expected, reduction):
    found = assemble(model(tmp_path, f"[damping]\n{keys}\n{reduction}"), 1).system.plain_structure
    omega = np.sqrt(normal_modes(found, found.n).squares)
    if expected is None:
        low, high = 2 * math.pi * 30.0, 2 * math.pi * 300.0

        def expected(w):
            return 0.01 * (low * high / w + w) / (low + high)

    np.testing.assert_allclose(ratios(found), expected(omega), rtol=1e-6, atol=1e-9)


def test_a_loss_factor_stands_beside_viscous_damping(tmp_path):
    found = assemble(model(tmp_path, "[damping]\nalpha_per_s = 3.0\nloss_factor = 0.02\n"), 1)
    structure = found.system.plain_structure
    np.testing.assert_allclose(structure.loss, 0.02 * structure.stiffness)
    np.testing.assert_allclose(structure.damping, 3.0 * structure.mass)


def test_a_part_has_its_own_damping(tmp_path):
    own = f"{RAYLEIGH}[part.rod.damping]\nloss_factor = 0.02\n"
    found = assemble(model(tmp_path, own), 1).system.plain_structure
    assert not np.any(found.damping)
    np.testing.assert_allclose(found.loss, 0.02 * found.stiffness)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("ratio = 0.01", "damping.between_hz: is missing"),
        ("between_hz = [1.0, 2.0]", "damping.ratio: is missing"),
        ("ratio = 0.1\nbetween_hz = [2.0, 1.0]", "lower before the higher"),
        ("modal_ratio = 0.1\nalpha_per_s = 1.0", "is given in several forms"),
        ("modal_ratios = []", "modal_ratios"),
        ("", "is given in no number"),
    ],
)
def test_dampings_that_do_not_fit_are_refused(tmp_path, keys, message):
    assert message in refused("check", str(study(tmp_path, f"[damping]\n{keys}\n")))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"ratio": 0.1}, "damping.between_hz: is missing"),
        ({"ratio": -0.1, "between_hz": (1.0, 2.0)}, "must not be negative"),
        ({"ratio": 0.1, "between_hz": (2.0, 2.0)}, "0 < low < high"),
        ({"modal": (0.1, -0.2)}, "damping.modal: must not be negative"),
        ({"alpha": math.nan}, "damping.alpha"),
        ({"alpha": 1.0, "modal": 0.1}, "several forms"),
    ],
)
def test_wrong_dampings_are_named(given, message):
    with pytest.raises(InputError, match=message):
        Damping(**given)


def test_structural_damping_is_not_integrated_in_time(tmp_path):
    text = BEAM.replace('"jenkins"', '"elastic_coulomb"').replace(
        "slip_limit_n = 1.0",
        "friction_coefficient = 0.3\nnormal_stiffness_n_per_m = 1e5\naxial_stiffness_n_per_m = 5e3\npreload_n = 3.0",
    )
    (tmp_path / "study.toml").write_text(text.format(tables="[damping]\nloss_factor = 0.01\n"))
    said = refused("run", str(tmp_path / "study.toml"), "--verify")
    assert "damping.loss_factor" in said


def test_all_modes_below_a_frequency_are_told_in_words():
    assert "ModesBelow(up_to_hz=100" in Reduction(ModesBelow(100.0)).in_words
