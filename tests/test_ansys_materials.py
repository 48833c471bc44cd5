"""Orthotropic and anisotropic materials of ANSYS archives, in element coordinate systems."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_anisotropic import ORTHO, SKEWED
from test_readers_ansys import cube

import stickslip as ss
from stickslip import InputError, Units
from stickslip.model.axis import Axis
from stickslip.model.fe.material import Material
from stickslip.model.readers.ansys_archive import ansys_passed_over
from stickslip.model.readers.ansys_materials import ansys_cell_materials
from stickslip.study.models.study import read_study

NINE = {
    "EX": 120e3, "EY": 30e3, "EZ": 12e3, "PRXY": 0.28, "PRXZ": 0.31, "PRYZ": 0.35, "GXY": 6e3, "GXZ": 5e3, "GYZ": 4e3,
}  # fmt: skip
PLAIN = cube().partition("MPDATA")[0]


def constants(values=NINE, number=3):
    lines = [f"MPDATA,R5.0, 1,{name:4},{number:8d}, 1, {value:.9E}," for name, value in values.items()]
    return "\n".join([*lines, f"MP,DENS,{number},1.6E-9", ""])


def table(matrix, number=3, option="", label="ANEL"):
    """The lines of a table of 21 constants, in MPa, as CDWRITE writes them."""
    numbers = [matrix[i, j] for i in range(6) for j in range(i, 6)]
    lines = [f"TB,{label},{number:8d},   1,  21,{option}", "TBTEM,  0.00000000    ,   1"]
    lines += [
        f"TBDAT,{first + 1:7d}," + ",".join(f"{v:.9E}" for v in numbers[first : first + 3]) for first in range(0, 21, 3)
    ]
    return "\n".join([*lines, f"MP,DENS,{number},1.6E-9", ""])


def materials(tmp_path, text):
    path = tmp_path / "cube.cdb"
    path.write_text(text)
    return ss.model.read_ansys_materials(path, units=Units.mm_t_s())


def test_nine_constants_are_the_orthotropic_material(tmp_path):
    found = materials(tmp_path, PLAIN + constants())[3]
    np.testing.assert_allclose(found.matrices(None), ORTHO, rtol=1e-9, atol=1.0)
    assert found.density == pytest.approx(1600.0)


@pytest.mark.parametrize(
    ("label", "option"), [("ANEL", ""), ("ANEL", "0"), ("ELAS", "AELS"), ("ANEL", "1"), ("ELAS", "AELF")]
)
def test_tables_of_21_constants_are_stiffness_or_flexibility(tmp_path, label, option):
    """In the order x, y, z, xy, yz, xz."""
    root = np.random.default_rng(3).standard_normal((6, 6))
    matrix = 1e4 * (root @ root.T + 3 * np.eye(6))
    given = np.linalg.inv(matrix) if option in ("1", "AELF") else matrix
    found = materials(tmp_path, PLAIN + table(given, option=option, label=label))[3]
    np.testing.assert_allclose(found.matrices(None), 1e6 * matrix, rtol=1e-7)
    assert ansys_passed_over(tmp_path / "cube.cdb") == ()


@pytest.mark.parametrize(
    ("label", "option"), [("ELAS", ""), ("ELAS", "ISOT"), ("ELAS", "OELM"), ("HYPE", "AELS"), ("ANEN", "0")]
)
def test_tables_that_are_not_read_are_refused_by_name(tmp_path, label, option):
    (tmp_path / "cube.cdb").write_text(PLAIN + table(np.eye(6), option=option, label=label))
    with pytest.raises(
        InputError, match=rf"gives a material by a table \(TB,{label}\), and of these only ANEL and ELAS"
    ):
        ansys_passed_over(tmp_path / "cube.cdb")


def test_isotropic_constants_written_out_stay_isotropic(tmp_path):
    same = {"EX": 210e3, "EY": 210e3, "EZ": 210e3, "PRXY": 0.3, "PRYZ": 0.3, "PRXZ": 0.3, "GXY": 210e3 / 2.6}
    (found,) = materials(tmp_path, PLAIN + constants(same)).values()
    assert isinstance(found, Material)


def with_system(system, lines):
    head = "        3        1        1        1        0        0"
    assert PLAIN.count(head) == 1
    return PLAIN.replace(head, f"        3        1        1        1{system:9d}        0") + lines


@pytest.mark.parametrize("short", [True, False])
def test_axes_of_an_element_system_are_turned_about_z_x_and_y(tmp_path, short):
    if short:
        lines = "LOCAL,12,0,1.,2.,3.,20.,30.,-40.\n"
    else:
        lines = "LOCAL,R5.0,LOC,      12,  0,  1.0,  2.0,  3.0\nLOCAL,R5.0,ANG,      12,  0,  20.0,  30.0,  -40.0\n"
    path = tmp_path / "cube.cdb"
    path.write_text(with_system(12, lines + constants()))
    (found,) = ansys_cell_materials(path, [9], Units.mm_t_s(), plausible=True)
    axes = found.orientation.at(np.zeros((1, 3)))[0]
    np.testing.assert_allclose(axes, Rotation.from_euler("ZXY", [20, 30, -40], degrees=True).as_matrix(), atol=1e-12)


def test_a_cylindrical_system_lies_about_its_z_axis(tmp_path):
    lines = "LOCAL,R5.0,LOC,      12,  1,  -50.0,  20.0,  3.0\nLOCAL,R5.0,ANG,      12,  1,  0.,  90.0,  0.\n"
    path = tmp_path / "cube.cdb"
    path.write_text(with_system(12, lines + constants()))
    (found,) = ansys_cell_materials(path, [9], Units.mm_t_s(), plausible=True)
    around = found.orientation.around
    np.testing.assert_allclose([*around.unit, *around.origin], [0, -1, 0, -0.05, 0.02, 0.003], atol=1e-12)


def test_a_study_takes_the_materials_of_an_archive(tmp_path):
    lines = "LOCAL,12,0,,,,{},{},{}\n".format(*Rotation.from_matrix(SKEWED.axes).as_euler("ZXY", degrees=True))
    block = "CMBLOCK,HELD,NODE,       4\n(8i10)\n        10        20        30        40\n"
    (tmp_path / "cube.cdb").write_text(with_system(12, block + lines + constants()))
    (tmp_path / "s.toml").write_text(
        'schema_version = 2\n[part.blade]\nfile = "cube.cdb"\nunits = "mm-t-s"\nclamped = ["held"]\n[modes]\nnumber = 2\n'
    )
    part = read_study(tmp_path / "s.toml").model().parts["blade"]
    mesh = part.mesh
    expected = ss.model.elastic_material(ORTHO, 1600.0, SKEWED)
    own = ss.model.assemble_solid(mesh, expected)
    np.testing.assert_allclose(part.structure.stiffness.toarray(), own.stiffness.toarray(), rtol=1e-6, atol=1.0)
    assert part.solid.axis == Axis()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (constants({n: v for n, v in NINE.items() if n not in ("GYZ", "PRXZ")}), "lacks GYZ, PRXZ"),
        (constants({**NINE, "PRXY": 3.0}), "material 3: orthotropic_stiffness: belongs to no stable material"),
        (constants({"EX": 127e3, "NUXY": 0.38, "GXY": 130e3}), "lacks EY, EZ"),
        (table(-np.eye(6)), r"line 27, .*no stable|line \d+: belongs to no stable"),
        (table(np.eye(6)).replace(",   1,  21", ",   2,  21"), "depends on temperature"),
        (table(1e4 * np.eye(6)) + "TBDAT,22,5.\n", "is no line of the 21 constants"),
    ],
)
def test_incomplete_materials_are_refused(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        materials(tmp_path, PLAIN + text)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("", r"in the coordinate system 12, which is not in the file \(LOCAL\)"),
        ("LOCAL,12,2,0,0,0\n", "neither Cartesian nor cylindrical"),
        ("LOCAL,R5.0,LOC,12,1,0,0,0\nLOCAL,R5.0,PRM,12,1,0.5,1.\n", "is elliptical"),
        ("LOCAL,12,0,x\n", "has no numbers"),
    ],
)
def test_other_element_systems_are_refused_by_element(tmp_path, lines, message):
    path = tmp_path / "cube.cdb"
    path.write_text(with_system(12, lines + constants()))
    with pytest.raises(InputError, match=f"element 9: .*{message}"):
        ansys_cell_materials(path, [9], Units.mm_t_s(), plausible=True)
    path.write_text(with_system(12, lines + constants({"EX": 210e3, "NUXY": 0.3})))
    assert len(ansys_cell_materials(path, [9], Units.mm_t_s(), plausible=True)) == 1
