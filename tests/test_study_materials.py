"""Materials of a study file: kinds, orientations, and what is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from solid_models import box
from test_anisotropic import CUBE, E_CUBE, G_CUBE, NU_CUBE, ORTHO
from typer.testing import CliRunner

from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.model.deck import write_deck
from stickslip.model.fe.material import ElasticMaterial, Material
from stickslip.model.modes import natural_frequencies
from stickslip.study.models.study import read_study

CRYSTAL = (
    f"young_modulus_pa = {E_CUBE}\npoisson_ratio = {NU_CUBE}\nshear_modulus_pa = {G_CUBE}\ndensity_kg_per_m3 = 8700.0\n"
)
NINE = "young_moduli_pa = [120e9, 30e9, 12e9]\npoisson_ratios = [0.28, 0.31, 0.35]\nshear_moduli_pa = [6e9, 5e9, 4e9]\n"
VOIGT = [0, 1, 2, 4, 5, 3]  # places of 11, 22, 33, 23, 13, 12 in our order


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    home = tmp_path_factory.mktemp("materials")
    write_deck(box(20, (0.06, 0.02, 0.01), (3, 1, 1)), Material(), home / "blade.inp")
    return home


def study(folder, material, more="[modes]\nnumber = 3\n"):
    text = (
        f'schema_version = 2\n[part.blade]\nfile = "blade.inp"\nunits = "SI"\n[part.blade.material]\n{material}\n{more}'
    )
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


def material_of(folder, material):
    return read_study(study(folder, material)).model().parts["blade"].solid.material


def axes_of(folder, orientation):
    found = material_of(folder, f"{CRYSTAL}[part.blade.material.orientation]\n{orientation}")
    return found.orientation.at(np.array([[3.0, 4.0, 5.0]]))[0]


def test_three_constants_are_a_cubic_crystal(folder):
    found = material_of(folder, CRYSTAL)
    np.testing.assert_allclose(found.matrices(None), CUBE, rtol=1e-12, atol=1e-3)
    assert found.density == 8700.0


def test_nine_constants_and_a_matrix_are_one_material(folder):
    nine = material_of(folder, NINE)
    matrix = material_of(folder, f"elasticity_pa = {ORTHO[np.ix_(VOIGT, VOIGT)].tolist()}\n")
    np.testing.assert_allclose(nine.matrices(None), ORTHO, rtol=1e-12, atol=1e-3)
    np.testing.assert_allclose(matrix.matrices(None), ORTHO, rtol=1e-12, atol=1e-3)
    assert nine.density == 7850.0
    assert isinstance(material_of(folder, "young_modulus_pa = 2e11"), Material)


def test_axes_by_two_directions_and_by_euler_angles(folder):
    np.testing.assert_allclose(axes_of(folder, 'axis_1 = "y"\naxis_2 = [0, 1, 1]'), np.eye(3)[:, [1, 2, 0]], atol=1e-12)
    expected = Rotation.from_euler("ZXZ", [20, 30, 40], degrees=True).as_matrix()
    np.testing.assert_allclose(axes_of(folder, "euler_deg = [20, 30, 40]"), expected, atol=1e-12)


def test_axes_about_a_cylinder(folder):
    found = axes_of(folder, 'around = "z"\naround_origin_m = [0, 0, 7]\naxis_1 = "y"\naxis_2 = "z"')
    radial, tangential, axial = np.array([3, 4, 0]) / 5, np.array([-4, 3, 0]) / 5, np.array([0, 0, 1])
    np.testing.assert_allclose(found, np.column_stack([tangential, axial, radial]), atol=1e-12)
    np.testing.assert_allclose(axes_of(folder, 'around = "z"')[:, 0], radial, atol=1e-12)


def test_axes_of_a_casting_have_the_angles_of_the_foundry(folder):
    """Axis 3 is tilted by 12 degrees towards 70 degrees about x from z; axis 1 begins at 25 degrees from z."""
    casting = 'stacking_axis = "x"\nreference = [0.3, 0, 2]\ntilt_deg = {}\nazimuth_deg = 70\nsecondary_deg = 25\n'
    upright = axes_of(folder, casting.format(0))
    np.testing.assert_allclose(upright[:, 2], [1, 0, 0], atol=1e-12)
    # about x from z: towards −y
    angle = np.radians(25)
    np.testing.assert_allclose(upright[:, 0], [0, -np.sin(angle), np.cos(angle)], atol=1e-12)
    tilted = axes_of(folder, casting.format(12))
    tilt, azimuth = np.radians([12, 70])
    third = [np.cos(tilt), -np.sin(tilt) * np.sin(azimuth), np.sin(tilt) * np.cos(azimuth)]
    np.testing.assert_allclose(tilted[:, 2], third, atol=1e-12)
    # the tilt alone: the turn from the upright axes has the angle of the tilt
    turn = Rotation.from_matrix(tilted @ upright.T)
    assert np.degrees(turn.magnitude()) == pytest.approx(12)
    assert np.linalg.det(tilted) == pytest.approx(1)


def test_the_tilt_of_a_crystal_is_varied(folder):
    casting = 'stacking_axis = "x"\nreference = "z"\ntilt_deg = 0.0\n'
    more = "[modes]\nnumber = 2\n[vary]\npart.blade.material.orientation.tilt_deg = [0.0, 15.0]\n"
    path = study(folder, f"{CRYSTAL}[part.blade.material.orientation]\n{casting}", more)
    whole = read_study(path)
    first = [natural_frequencies(whole.model(case).parts["blade"].structure, 1)[0] for case in (0, 1)]
    assert first[0] / first[1] < 0.999


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (f"{NINE}young_modulus_pa = 2e11", r"young_modulus_pa: is given together with young_moduli_pa"),
        (NINE.replace("shear_moduli_pa", "#"), r"shear_moduli_pa: is missing beside young_moduli_pa"),
        (f"{NINE}elasticity_pa = {np.eye(6).tolist()}", "young_moduli_pa: is given together with elasticity_pa"),
        ("shear_modulus_pa = 1e11", "young_modulus_pa: is missing beside shear_modulus_pa"),
        (CRYSTAL.replace("0.38", "0.6"), "poisson_ratio: must be less than 0.5"),
        (NINE.replace("0.28", "2.8"), "young_moduli_pa: belongs to no stable material"),
        (NINE.replace("e9", ""), "no solid has 120 Pa, which is 1.2e[+]11 Pa if it is in GPa"),
        (f"elasticity_pa = {np.triu(np.ones((6, 6))).tolist()}", "elasticity_pa: is no symmetric matrix"),
        (f"elasticity_pa = {np.eye(5).tolist()}", "elasticity_pa"),
        ("[part.blade.material.orientation]\neuler_deg = [1, 2, 3]", "orientation: belongs to an anisotropic material"),
    ],
)
def test_materials_that_are_no_material_are_refused(folder, material, message):
    with pytest.raises(InputError, match=f"part.blade.material.*{message}"):
        read_study(study(folder, material))


@pytest.mark.parametrize(
    ("orientation", "message"),
    [
        ("", "axis_1: names no axes"),
        ('axis_1 = "x"', "axis_2: is missing beside the other"),
        ('axis_1 = "x"\naxis_2 = "-x"', "span no plane"),
        ('axis_1 = "x"\naxis_2 = "y"\neuler_deg = [1, 2, 3]', "euler_deg: is given together with axis_1"),
        ('stacking_axis = "x"', "reference: is missing beside the other"),
        ("euler_deg = [1, 2, 3]\ntilt_deg = 5.0", "tilt_deg: goes together with stacking_axis"),
        ("euler_deg = [1, 2, 3]\naround_origin_m = [0, 0, 1]", "around_origin_m: goes together with around"),
        ('stacking_axis = "x"\nreference = "z"\ntilt_deg = 91.0', "tilt_deg"),
    ],
)
def test_axes_that_are_no_axes_are_refused(folder, orientation, message):
    with pytest.raises(InputError, match=rf"part.blade.material.orientation.*{message}"):
        read_study(study(folder, f"{CRYSTAL}[part.blade.material.orientation]\n{orientation}"))


def test_a_beam_has_an_isotropic_material(tmp_path):
    beam = '[part.beam]\nshape = "beam"\nlength_m = 0.4\narea_m2 = 1e-4\nsecond_moment_m4 = 1e-9\n'
    (tmp_path / "s.toml").write_text(f"schema_version = 2\n{beam}[material]\n{CRYSTAL}[modes]\nnumber = 2\n")
    with pytest.raises(InputError, match=r"part.beam.material: is anisotropic, and beams are not"):
        read_study(tmp_path / "s.toml").model()


def test_the_check_of_a_crystal_runs(folder):
    path = study(folder, CRYSTAL)
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 0, done.output
    assert isinstance(read_study(path).model().parts["blade"].solid.material, ElasticMaterial)
