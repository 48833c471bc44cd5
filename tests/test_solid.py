"""Solids, damping and modes against closed forms."""

import math

import numpy as np
import pytest
from solid_models import rigid_motions, without_sets

from stickslip.errors import InputError
from stickslip.model.damping import rayleigh_damping
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.matrices import lumped
from stickslip.model.mesh.blade_pair import BladePair, mesh_blade_pair
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import natural_frequencies
from stickslip.model.rigid.dampers import FlatCurvedDamper

STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
CUBE_TETS = [(0, 1, 3, 7), (0, 5, 1, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 6, 4, 7)]
TET_EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]


def prism(size, cells, bulge=0.0):
    """Mesh a box by cubes of six tetrahedra; `bulge` curves the mid-side nodes."""
    grid = np.stack(np.meshgrid(*(np.arange(c + 1) for c in cells), indexing="ij"), -1)
    stride = np.array([(cells[1] + 1) * (cells[2] + 1), cells[2] + 1, 1])
    corner = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    base = grid[:-1, :-1, :-1].reshape(-1, 3)
    cubes = (base[:, None] + corner) @ stride
    tets = cubes[:, CUBE_TETS].reshape(-1, 4)
    points = grid.reshape(-1, 3) * (np.array(size) / cells)
    edges = np.sort(tets[:, TET_EDGES].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middle = points[unique].mean(axis=1)
    middle = middle + bulge * np.sin(9 * middle / np.max(size)) * middle[:, ::-1]
    cells10 = np.hstack([tets, len(points) + inverse.reshape(-1, 6)])
    points = np.vstack([points, middle])
    root = np.flatnonzero(points[:, 2] < 1e-12)
    return SolidMesh(points, cells10, {"root": root, "tip": np.array([len(points) - 1])})


@pytest.mark.parametrize("bulge", [0.0, 0.01])
def test_free_body_has_six_motions_without_strain(bulge):
    mesh = without_sets(prism((0.03, 0.02, 0.04), (2, 1, 3), bulge))
    solid = assemble_solid(mesh, STEEL)
    motion = rigid_motions(mesh.points)
    force = solid.stiffness @ motion
    assert np.abs(force).max() < 1e-10 * abs(solid.stiffness).max()
    frequencies = natural_frequencies(solid, 7)
    # round-off of the eigensolver, as a fraction of the first elastic frequency
    assert frequencies[5] < 1e-3 * frequencies[6]


def test_mass_and_inertia_of_a_box():
    size = np.array([0.03, 0.02, 0.04])
    mesh = without_sets(prism(size, (2, 1, 3)))
    solid = assemble_solid(mesh, STEEL)
    centred = SolidMesh(mesh.points - size / 2, mesh.cells, {})
    motion = rigid_motions(centred.points)
    mass = STEEL.density * size.prod()
    turning = mass / 12 * (np.sum(size**2) - size**2)
    energy = motion.T @ (solid.mass @ motion)
    np.testing.assert_allclose(energy, np.diag([mass] * 3 + list(turning)), atol=1e-12 * mass)


def test_uniform_strain_has_the_energy_of_hookes_law():
    size = (0.03, 0.02, 0.04)
    mesh = without_sets(prism(size, (2, 1, 3)))
    solid = assemble_solid(mesh, STEEL)
    gradient = np.random.default_rng(0).standard_normal((3, 3))
    strain = (gradient + gradient.T) / 2
    lame, shear = STEEL.lame
    density = lame * np.trace(strain) ** 2 + 2 * shear * np.sum(strain**2)
    u = (mesh.points @ gradient.T).ravel()
    assert u @ (solid.stiffness @ u) == pytest.approx(density * np.prod(size), rel=1e-11)


def test_blade_pair_has_the_mass_of_its_volume():
    pair = BladePair(airfoil_size=0.02, platform_size=0.012, foot_size=0.02)
    mesh = mesh_blade_pair(pair, FlatCurvedDamper().contact_points())
    corner = mesh.points[mesh.cells[:, :4]]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1]).sum() / 6
    solid = assemble_solid(without_sets(mesh), STEEL)
    along = np.tile([0.0, 1.0, 0.0], len(mesh.points))
    assert along @ (solid.mass @ along) == pytest.approx(STEEL.density * volume, rel=1e-12)
    box = pair.foot_width * pair.foot_depth * pair.foot_height
    shank = pair.shank_thickness * pair.platform_depth * pair.platform_height
    assert 2 * (box + shank) < volume < 4 * (box + shank)


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_slender_cantilever_bends_like_a_beam(nu):
    """First mode of a prism in both planes against Euler-Bernoulli.

    At ν = 0 the beam's assumptions hold but for shear and rotary inertia, which lower the frequency
    by the order of (depth / length)² = 0.25 % at most. At ν = 0.3 the solid's clamp also hinders
    the section from contracting: up to about depth / length, 5 %, of stiffness near the root is
    affected by less than ν² / (1 − ν²).
    """
    size, length = (0.006, 0.010), 0.2
    material = Material(young_modulus=210e9, poisson_ratio=nu, density=7850.0)
    found = natural_frequencies(assemble_solid(prism((*size, length), (1, 1, 20)), material), 2)
    speed = math.sqrt(material.young_modulus / material.density)
    for f, depth in zip(found, size, strict=True):
        beam = 1.8751040687**2 * speed * depth / math.sqrt(12) / (2 * math.pi * length**2)
        assert f == pytest.approx(beam, rel=0.004 if nu == 0.0 else 0.012)


def test_root_is_removed_and_sets_are_node_major():
    mesh = prism((0.01, 0.01, 0.02), (1, 1, 2))
    solid = assemble_solid(mesh, STEEL)
    assert solid.n == 3 * (len(mesh.points) - len(mesh.node_sets["root"]))
    assert set(solid.sets) == {"tip"}
    tip = solid.dofs.take(solid.dof_set("tip"))
    assert tip.component == ("x", "y", "z")
    np.testing.assert_array_equal(tip.node, len(mesh.points) - 1)
    np.testing.assert_array_equal(tip.position[0], mesh.points[-1])


def test_clamped_sets_and_loose_nodes_are_named():
    mesh = prism((0.01, 0.01, 0.02), (1, 1, 2))
    clamped = SolidMesh(mesh.points, mesh.cells, mesh.node_sets | {"tip": np.array([0])})
    with pytest.raises(InputError, match=r"node set 'tip'.*holds clamped nodes, e\.g\. 0"):
        assemble_solid(clamped, STEEL)
    loose = SolidMesh(np.vstack([mesh.points, [[1.0, 1.0, 1.0]]]), mesh.cells, {})
    with pytest.raises(InputError, match="1 nodes belong to no element"):
        assemble_solid(loose, STEEL)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"young_modulus": 0.0}, "Material.young_modulus: must be positive"),
        ({"density": math.nan}, "Material.density: must be positive, got nan"),
        ({"poisson_ratio": 0.5}, r"Material.poisson_ratio: must lie in \[0, 0.5\), got 0.5"),
    ],
)
def test_bad_material_is_named(change, message):
    with pytest.raises(InputError, match=message):
        Material(**change)


def test_rayleigh_damping_has_its_ratio_at_both_frequencies():
    """Two oscillators at the two frequencies: C = 2 ζ ω m of each."""
    mass, omega = np.array([2.0, 3.0]), 2 * math.pi * np.array([150.0, 600.0])
    damped = rayleigh_damping(lumped(mass, np.diag(mass * omega**2)), 0.002, (150.0, 600.0))
    np.testing.assert_allclose(damped.damping, np.diag(2 * 0.002 * omega * mass), rtol=1e-12)


@pytest.mark.parametrize(
    ("ratio", "between", "message"), [(-0.1, (1, 2), "must not be negative"), (0.1, (2, 1), "needs 0 < low < high")]
)
def test_bad_damping_is_named(ratio, between, message):
    solid = assemble_solid(prism((0.01, 0.01, 0.02), (1, 1, 2)), STEEL)
    with pytest.raises(InputError, match=message):
        rayleigh_damping(solid, ratio, between)
