"""The blade pair's geometry and mesh."""

import math
import subprocess
import sys
import threading

import numpy as np
import pytest

from stickslip.errors import InputError, StickslipError
from stickslip.model.mesh.blade_pair import BladePair, mesh_blade_pair
from stickslip.model.mesh.solid_mesh import write_mesh
from stickslip.model.rigid.dampers import FlatCurvedDamper

COARSE = {"airfoil_size": 0.02, "platform_size": 0.012, "foot_size": 0.02}


@pytest.fixture(scope="module")
def mesh():
    return mesh_blade_pair(BladePair(**COARSE), FlatCurvedDamper().contact_points())


def volumes(mesh):
    corner = mesh.points[mesh.cells[:, :4]]
    return np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6


def test_contact_nodes_are_the_dampers_points(mesh):
    points = FlatCurvedDamper().contact_points()
    # blade 2 is a copy moved by the pitch: one rounding each way
    np.testing.assert_allclose(mesh.points[mesh.node_sets["contact"]], points.position, rtol=0, atol=1e-16)
    lines = [mesh.node_sets[f"contact_{line}"] for line in ("L1", "L2", "R")]
    np.testing.assert_array_equal(np.concatenate(lines), mesh.node_sets["contact"])


def test_damper_and_blades_agree_by_default():
    np.testing.assert_allclose(FlatCurvedDamper().apex, BladePair().wedge_apex, rtol=1e-14)


def test_other_angles_and_apex_match_too():
    angles = {"flat_angle": math.radians(40), "curved_angle": math.radians(50)}
    pair = BladePair(**COARSE, **angles)
    # the steeper shank leaves less room under the flat side
    damper = FlatCurvedDamper(apex=pair.wedge_apex, flat_distances=(0.002, 0.026), **angles)
    points = damper.contact_points()
    found = mesh_blade_pair(pair, points)
    np.testing.assert_allclose(found.points[found.node_sets["contact"]], points.position, atol=1e-9)


def test_blades_are_equal(mesh):
    n, m = len(mesh.points) // 2, len(mesh.cells) // 2
    offset = np.array([BladePair().pitch, 0.0, 0.0])
    np.testing.assert_array_equal(mesh.points[n:], mesh.points[:n] + offset)
    np.testing.assert_array_equal(mesh.cells[m:], mesh.cells[:m] + n)


def test_elements_are_positive_and_in_vtk_order(mesh):
    assert volumes(mesh).min() > 0
    ends = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]  # of VTK's mid-side nodes 4..9
    for k, (a, b) in enumerate(ends):
        middle = (mesh.points[mesh.cells[:, a]] + mesh.points[mesh.cells[:, b]]) / 2
        np.testing.assert_allclose(mesh.points[mesh.cells[:, 4 + k]], middle, atol=1e-12)


def test_skin_encloses_the_volume(mesh):
    """Divergence theorem: a closed skin, oriented outward, has the volume of the elements."""
    a, b, c = mesh.points[mesh.surface].transpose(1, 0, 2)
    enclosed = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    assert enclosed == pytest.approx(volumes(mesh).sum(), rel=1e-10)


def test_sets_are_where_they_should_be(mesh):
    pair = BladePair()
    root = mesh.points[mesh.node_sets["root"]]
    assert root[:, 2].min() == pytest.approx(-pair.foot_height)
    assert root[:, 2].max() == pytest.approx(0, abs=1e-12)
    tip1, mid1, tip2 = mesh.points[mesh.node_sets["output"]]
    top = pair.platform_height + pair.airfoil_length
    assert mid1[2] == pytest.approx(top - pair.airfoil_length / 2)
    assert tip1[2] == tip2[2] == pytest.approx(top)
    assert tip2[0] - tip1[0] == pytest.approx(pair.pitch)


@pytest.mark.parametrize("span", [0.0, 0.3])
def test_force_stands_on_the_first_airfoil_at_its_span(mesh, span):
    pair = BladePair(**COARSE, force_span=span)
    if span != BladePair().force_span:
        mesh = mesh_blade_pair(pair, FlatCurvedDamper().contact_points())
    (force,) = mesh.points[mesh.node_sets["force"]]
    assert force[2] == pytest.approx(pair.platform_height + span * pair.airfoil_length)
    # within the airfoil's chord and thickness of blade 1, which stands at x = 0
    assert abs(force[1]) < pair.hub_chord / 2
    assert abs(force[0]) < pair.hub_thickness + pair.camber * pair.hub_chord


def test_below_zero_the_force_stands_on_the_shank_away_from_the_damper():
    pair = BladePair(**COARSE, force_span=-0.25)
    mesh = mesh_blade_pair(pair, FlatCurvedDamper().contact_points())
    (force,) = mesh.points[mesh.node_sets["force"]]
    np.testing.assert_allclose(force, [-pair.shank_thickness / 2, 0.0, 0.75 * pair.shank_tops[1]], atol=1e-9)


def test_meshing_in_a_thread_gives_the_same_mesh(mesh):
    made = []
    points = FlatCurvedDamper().contact_points()
    thread = threading.Thread(target=lambda: made.append(mesh_blade_pair(BladePair(**COARSE), points)))
    thread.start()
    thread.join()
    np.testing.assert_array_equal(made[0].points, mesh.points)
    np.testing.assert_array_equal(made[0].cells, mesh.cells)


@pytest.mark.parametrize("suffix", [".vtu", ".msh"])
def test_written_mesh_reads_back(mesh, tmp_path, suffix):
    import meshio

    write_mesh(mesh, tmp_path / f"blades{suffix}")
    back = meshio.read(tmp_path / f"blades{suffix}")
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(back.cells_dict["tetra10"], mesh.cells)
    np.testing.assert_array_equal(np.flatnonzero(back.point_data["contact"]), np.sort(mesh.node_sets["contact"]))


def test_unknown_mesh_format_is_refused(mesh, tmp_path):
    with pytest.raises(InputError, match=r"unknown mesh format '\.stl'.*Use \.vtu or \.msh"):
        write_mesh(mesh, tmp_path / "blades.stl")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"airfoil_length": -0.1}, "BladePair.airfoil_length: must be positive"),
        ({"camber": math.nan}, "BladePair.camber: must be finite, got nan"),
        ({"flat_angle": 2.0}, r"BladePair.flat_angle: must lie in \(0, 1.571\), got 2.0"),
        ({"pitch": 0.008}, "BladePair.pitch: 0.008 m leaves no room.*overlap"),
        ({"platform_height": 0.010}, "BladePair.platform_height.*above the foot"),
        ({"force_span": 0.5}, r"BladePair.force_span: must lie in \(-1, 0.5\), got 0.5"),
        ({"force_span": -1e-6}, "BladePair.force_span: -1e-06 puts the force 6.98e-08 m from an end"),
        ({"force_span": -1 + 1e-9}, "BladePair.force_span: .*from an end of the shank"),
        ({"hub_chord": 0.060}, "overhangs the platform"),
        ({"foot_depth": 0.010}, "smaller than the shank"),
        ({"foot_width": 0.057}, "the feet overlap"),
    ],
)
def test_bad_geometry_is_named(change, message):
    with pytest.raises(InputError, match=message):
        BladePair(**change)


@pytest.mark.parametrize(
    ("damper", "missed"),
    [
        (FlatCurvedDamper(apex=(0.025, BladePair().wedge_apex[1] + 1e-4)), "L1.1 at"),
        (FlatCurvedDamper(curved_distance=0.045), "R.1 at"),
        (FlatCurvedDamper(sections=(-0.03, 0.0, 0.01)), "L2.1 at"),
        (FlatCurvedDamper(flat_angle=math.radians(44)), "L1.2 at"),
    ],
)
def test_points_off_the_platform_are_listed(damper, missed):
    with pytest.raises(InputError, match=f"non-matching node sets.*{missed}.*wedge_apex"):
        mesh_blade_pair(BladePair(**COARSE), damper.contact_points())


def test_missing_gmsh_or_library_is_explained(monkeypatch):
    points = FlatCurvedDamper().contact_points()
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(StickslipError, match=r"pip install 'stickslip\[fe\]'"):
        mesh_blade_pair(BladePair(), points)

    class Broken:
        def find_spec(self, name, path=None, target=None):
            if name == "gmsh":
                raise OSError("libGLU.so.1: cannot open shared object file")

    monkeypatch.delitem(sys.modules, "gmsh")
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    with pytest.raises(StickslipError, match=r"libGLU\.so\.1.*libglu1-mesa libxft2 libxcursor1"):
        mesh_blade_pair(BladePair(), points)


def test_importing_the_models_loads_no_mesher():
    code = (
        "import sys, stickslip.model.mesh.solid_mesh, stickslip.model.fe.solid; "
        "sys.exit(bool({'gmsh', 'skfem', 'meshio'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
