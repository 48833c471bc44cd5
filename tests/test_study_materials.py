"""Materials of a study file: kinds, orientations, and what is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from solid_models import box
from test_anisotropic import CUBE, E_CUBE, G_CUBE, NU_CUBE, ORTHO
from typer.testing import CliRunner

from stickslip.assembly.assembling import assemble
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
        (
            'stacking_axis = "x"\nreference = "z"\nsecondary_deg = 45\ntilt_deg = 55.0',
            r"tilt_deg: is 55, and axis 1 of the crystal lies nearer the stacking axis, at 54\.6°.*at most 54\.74",
        ),
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


STEEL = "density_kg_per_m3 = 7850.0\n"
ROWS = """expansion = "secant"
expansion_zero_c = 25.0
[[part.blade.material.over_temperature]]
temperature_c = 20.0
young_modulus_pa = 210e9
poisson_ratio = 0.3
expansion_per_k = 1.0e-5
[[part.blade.material.over_temperature]]
temperature_c = 720.0
young_modulus_pa = 140e9
poisson_ratio = 0.3
expansion_per_k = 1.4e-5
"""


def part_of(folder, material, temperature):
    more = f"[part.blade.temperature]\n{temperature}\n[modes]\nnumber = 2\n" if temperature else "[modes]\nnumber = 2\n"
    return read_study(study(folder, material, more)).model().parts["blade"]


def test_constants_over_temperature_are_those_of_the_part(folder):
    part = part_of(folder, STEEL + ROWS, "uniform_c = 370.0\nstress_free_c = 25.0")
    assert part.solid.laws.each[0] == Material(young_modulus=175e9, poisson_ratio=0.3, density=7850.0)
    assert part.solid.heated
    strain = part.solid.material.expansion.strain(np.array([25.0]), np.array([370.0]))
    assert strain[0, 0] == pytest.approx(1.2e-5 * 345)


def test_temperatures_follow_the_radius_the_nodes_or_a_factor(folder):
    part = part_of(folder, STEEL + ROWS, "radius_m = [0.0, 0.05]\nat_radius_c = [100.0, 600.0]\nfactor = 0.5")
    radius = np.linalg.norm(part.mesh.points[:, :2], axis=1)
    expected = 20 + 0.5 * (100 + 1e4 * np.minimum(radius, 0.05) - 20)
    np.testing.assert_allclose(part.solid.temperature.values, expected)
    rows = "".join(f"{n},{300 + n}\n" for n in part.mesh.numbers[::-1])
    (folder / "heat.csv").write_text(f"node,temperature_c\n{rows}")
    part = part_of(folder, STEEL + ROWS, 'file = "heat.csv"')
    np.testing.assert_allclose(part.solid.temperature.values, 300 + part.mesh.numbers)
    (folder / "short.csv").write_text("node,temperature_c\n1,20.0\n")
    with pytest.raises(InputError, match=r"short\.csv: lacks the temperature of \d+ nodes"):
        part_of(folder, STEEL + ROWS, 'file = "short.csv"')


def test_one_table_heats_what_can_be_heated(folder):
    heat = "[temperature]\nuniform_c = 400.0\n[modes]\nnumber = 2\n"
    cold = read_study(study(folder, STEEL, heat)).model().parts["blade"].solid
    assert cold.temperature is None
    hot = read_study(study(folder, f"{STEEL}expansion_per_k = 1e-5\n", heat)).model()
    assert hot.heated
    moved = hot.static_displacement(0.0)["blade"]
    assert 0.9 < np.ptp(moved[:, 0]) / (1e-5 * 380 * 0.06) < 1.1
    assert not np.allclose(hot.at(0.0).stiffness.toarray(), cold.structure.stiffness.toarray(), rtol=1e-4)


def test_the_factor_of_a_temperature_is_varied(folder):
    more = "[part.blade.temperature]\nuniform_c = 520.0\n[modes]\nnumber = 1\n[vary]\npart.blade.temperature.factor = [0.0, 1.0]\n"
    whole = read_study(study(folder, STEEL + ROWS, more))
    cold, hot = (whole.model(case).parts["blade"].solid.laws.each[0].young_modulus for case in (0, 1))
    assert (cold, hot) == pytest.approx((210e9, 160e9))


@pytest.mark.parametrize(
    ("material", "temperature", "message"),
    [
        (ROWS, "", r"part\.blade\.temperature: is missing, and its material depends on temperature"),
        (
            ROWS.replace('expansion = "secant"\n', ""),
            "uniform_c = 1.0",
            "expansion: is missing with coefficients over temperature",
        ),
        (ROWS.replace("expansion_zero_c = 25.0\n", ""), "uniform_c = 1.0", "expansion_zero_c: is missing with secant"),
        (ROWS.replace('"secant"', '"instantaneous"'), "uniform_c = 1.0", "expansion_zero_c: belongs to secant"),
        ("young_modulus_pa = 2e11\n" + ROWS, "uniform_c = 1.0", "young_modulus_pa: is given over temperature, too"),
        (ROWS.replace("720.0", "10.0"), "uniform_c = 1.0", "over_temperature: must have rising temperatures"),
        (ROWS.replace("poisson_ratio = 0.3\n", "", 1), "uniform_c = 1.0", "poisson_ratio: is missing beside the other"),
        (ROWS, "uniform_c = 1.0\nfile = 'x.csv'", "file: is given together with uniform_c"),
        (ROWS, "radius_m = [0.1, 0.2]", "at_radius_c: is missing beside the other"),
        (ROWS, "factor = 0.5", r"part\.blade\.temperature: gives no temperature"),
        ('expansion = "secant"', "uniform_c = 1.0", "expansion: belongs to coefficients over temperature"),
    ],
)
def test_temperatures_that_do_not_fit_are_refused(folder, material, temperature, message):
    with pytest.raises(InputError, match=message):
        part_of(folder, STEEL + material, temperature)


CONTACT = """
[contact.wall]
between = ["blade.tip", "ground"]
law = "elastic_coulomb"
per = "area"
friction_coefficient = 0.5
tangential_stiffness_n_per_m3 = 1e12
axial_stiffness_n_per_m3 = 1e12
normal_stiffness_n_per_m3 = 2e10
{gap}
[load.shaker]
on = "blade.tip"
direction = [0, 0, 1]
force_n = 1.0
[output]
points.tip = "blade.tip"
[forced_response]
frequency_hz = [1000.0, 1200.0]
"""


@pytest.mark.parametrize("gap", [0.0, 1e-7])
def test_heat_presses_a_bar_against_a_wall(folder, gap):
    """A bar that grows by αΔTL against springs k: force k (αΔTL − gap) / (1 + kL/EA), all along x."""
    bar = (
        "young_moduli_pa = [2e11, 2e11, 2e11]\npoisson_ratios = [0.0, 0.0, 0.0]\nshear_moduli_pa = [1e11, 1e11, 1e11]\n"
    )
    bar += "expansions_per_k = [1.2e-5, 0.0, 0.0]\n"
    more = "[part.blade.temperature]\nuniform_c = 22.0\n" + CONTACT.format(gap=f"gap_m = {gap}" if gap else "")
    found = assemble(read_study(study(folder, bar, more)).model(), 3)
    length, area = 0.06, 0.02 * 0.01
    k = 2e10 * area  # soft, so that the end stays plane
    expected = k * (1.2e-5 * 2.0 * length - gap) / (1 + k * length / (2e11 * area))
    assert -found.static_force[:, 2].sum() == pytest.approx(expected, rel=1e-3)


def test_a_heated_part_is_checked_and_has_its_mass(folder):
    more = "[part.blade.temperature]\nuniform_c = 520.0\n[modes]\nnumber = 1\n"
    path = study(folder, STEEL + ROWS, more)
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 0, done.output
    assert "mass 0.0942 kg" in done.output


WHOLE = STEEL + "young_modulus_pa = 2.1e11\npoisson_ratio = 0.3\n"


def test_a_temperature_without_effect_is_doubted(folder):
    heat = "[temperature]\nuniform_c = 400.0\n[modes]\nnumber = 2\n"
    (said,) = read_study(study(folder, WHOLE, heat)).model().parts["blade"].warnings
    assert said.startswith("part.blade: its temperature has no effect: the material has neither constants")
    assert part_of(folder, STEEL + ROWS, "uniform_c = 400.0").warnings == ()
    assert part_of(folder, WHOLE, "").warnings == ()


def test_temperatures_of_calculix_results_are_the_static_ones(folder):
    """Format as ccx 2.20 writes it; it repeats the temperatures at each mode."""
    mesh = part_of(folder, STEEL, "").mesh
    places = "".join(
        f" -1{n:10d}" + "".join(f"{x:12.5E}" for x in p) + "\n" for n, p in zip(mesh.numbers, mesh.points, strict=True)
    )
    text = f"    1C\n    2C{len(mesh.numbers):30d}{1:38d}\n{places} -3\n"
    for step, head in ((1, "  101 1.000000000"), (2, "  102 2281.658471")):
        values = "".join(f" -1{n:10d}{step * (300.0 + n):12.5E}\n" for n in mesh.numbers)
        text += f"    1PSTEP{step:26d}{1:12d}{step:12d}\n"
        tail = "                     0    1           1" if step == 1 else "                     2    2MODAL      1"
        text += f"  100CL{head}{len(mesh.numbers):12d}{tail}\n -4  NDTEMP      1    1\n -5  T           1    1    0    0\n{values} -3\n"
    (folder / "heat.frd").write_text(text + " 9999\n")
    part = part_of(folder, STEEL + ROWS, 'file = "heat.frd"')
    np.testing.assert_allclose(part.solid.temperature.values, 300 + part.mesh.numbers)


def test_temperatures_beyond_the_table_and_radii_in_mm_are_doubted(folder):
    """Radii in mm, as 20 and 60, would give one temperature in silence."""
    (said,) = part_of(folder, STEEL + ROWS, "radius_m = [20.0, 60.0]\nat_radius_c = [400.0, 500.0]").warnings
    assert said.startswith("part.blade: it lies ")
    assert "far from the radii of its temperature, 20 to 60 m" in said
    (said,) = part_of(folder, STEEL + ROWS, "uniform_c = 1500.0").warnings
    assert said.startswith("part.blade: its temperatures reach 1500 °C, and its constants are those from 20 to ")


def test_temperatures_of_nodes_that_the_part_has_not_are_told(folder):
    numbers = [*part_of(folder, STEEL, "").mesh.numbers, 9001, 9002]
    (folder / "t.csv").write_text("node,temperature_c\n" + "".join(f"{n},{300 + n % 9}\n" for n in numbers))
    (said,) = part_of(folder, STEEL + ROWS, 'file = "t.csv"').warnings
    assert said.startswith(
        "part.blade: t.csv has temperatures of 2 nodes that the part has not, e.g. 9001, without effect."
    )


def test_a_strain_that_no_metal_has_is_doubted_and_a_node_has_one_temperature(folder):
    steel = STEEL + "young_modulus_pa = 2.1e11\npoisson_ratio = 0.3\nexpansion_per_k = 1e-3\n"
    (said,) = part_of(folder, steel, "uniform_c = 420.0").warnings
    assert said.startswith("part.blade: its thermal strain reaches 40 %, beyond that of metals.")
    (folder / "t.csv").write_text("node,temperature_c\n1,20\n2,30\n2,40\n")
    with pytest.raises(InputError, match="has two temperatures of node 2"):
        part_of(folder, STEEL + ROWS, 'file = "t.csv"')


def test_one_row_over_temperature_is_told_alone(folder):
    row = ROWS[: ROWS.rindex("[[")]
    with pytest.raises(InputError) as told:
        part_of(folder, STEEL + row, "uniform_c = 400.0")
    assert str(told.value).endswith(
        "part.blade.material: has one row of over_temperature, at 20 °C. Give another row, or its constants in [material] itself."
    )


def test_a_material_of_a_file_that_becomes_steel_is_doubted(tmp_path):
    """An expansion alone had replaced the deck's titanium by steel, in silence."""
    deck = "*NODE\n" + "".join(
        f"{4 * k + i + 1}, {x}, {y}, {0.1 * k}\n"
        for k in (0, 1)
        for i, (x, y) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1)))
    )
    deck += "*ELEMENT, TYPE=C3D8, ELSET=E\n1, 1, 2, 3, 4, 5, 6, 7, 8\n*MATERIAL, NAME=T\n*ELASTIC\n1.1e11, 0.3\n*DENSITY\n4400.\n"
    deck += "*SOLID SECTION, ELSET=E, MATERIAL=T\n*NSET, NSET=ROOT\n1, 2, 3, 4\n*BOUNDARY\nROOT, 1, 3\n"
    (tmp_path / "d.inp").write_text(deck)
    path = tmp_path / "s.toml"
    head = 'schema_version = 2\n[modes]\nnumber = 2\n[part.b]\nfile = "d.inp"\nunits = "SI"\nsectors = 1\n[part.b.material]\n'
    path.write_text(head + "expansion_per_k = 9e-6\n")
    (said,) = read_study(path).model().parts["b"].warnings
    assert said.startswith(
        "part.b: its material replaces the file's, and density_kg_per_m3, young_modulus_pa, poisson_ratio,"
    )
    path.write_text(head + "young_modulus_pa = 1e11\npoisson_ratio = 0.3\ndensity_kg_per_m3 = 4400.0\n")
    assert read_study(path).model().parts["b"].warnings == ()
