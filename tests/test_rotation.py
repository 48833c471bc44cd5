"""Rotating solids against closed forms, a shooting solution, invariances and the orders of their differences."""

import math

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from solid_models import beam_root, box, rigid_motions, without_sets

from evidence.models.annulus import annular_sector
from stickslip.errors import InputError, SingularError, StickslipError
from stickslip.model.axis import Axis
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import gyroscopic_modes, natural_frequencies

STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
BAR = Material(young_modulus=210e9, poisson_ratio=0.0, density=7850.0)
SIZE = (0.03, 0.02, 0.04)
SKEW = Axis((1.0, 2.0, -0.5), (0.01, 0.02, -0.03))


def relative(found, exact):
    return np.linalg.norm((found - exact).ravel()) / np.linalg.norm(exact.ravel())


def dense(matrix):
    return matrix.toarray()


# ---- load, spin softening, Coriolis: actions on rigid motions ---------------------------------------------------------


@pytest.mark.parametrize("width", [4, 10, 8, 20])
def test_matrices_of_inertia_act_on_rigid_motions_as_mechanics_says(width):
    """A free body: forces and moments of dS, of 2 Ω G v and of the centrifugal field, from mass and inertia tensor."""
    mesh = without_sets(box(width, SIZE, (1, 2, 1)))
    mesh = SolidMesh(mesh.points + np.array([0.1, -0.05, 0.02]), mesh.cells, {})
    solid = rotating_solid(mesh, STEEL, SKEW)
    mass, e, cross = STEEL.density * math.prod(SIZE), SKEW.unit, SKEW.cross
    perpendicular = np.eye(3) - np.outer(e, e)
    motion = rigid_motions(mesh.points)
    shifts = motion[:, :3]
    np.testing.assert_allclose(shifts.T @ (solid.spin_softening @ shifts), mass * perpendicular, atol=1e-12 * mass)
    np.testing.assert_allclose(shifts.T @ (solid.coriolis @ shifts), mass * cross, atol=1e-12 * mass)
    G = dense(solid.coriolis)
    assert np.abs(G + G.T).max() < 1e-15 * np.abs(G).max()
    centre = np.array(SIZE) / 2 + [0.1, -0.05, 0.02]
    speed = 300.0
    load = solid.centrifugal_load(speed)
    assert relative(shifts.T @ load, speed**2 * mass * perpendicular @ (centre - SKEW.origin)) < (1e-12)
    # the load has the potential Ω²/2 ∫ρ r²: turning the body about the axis does no work, nor does shifting it along
    spin = np.cross(e, mesh.points - SKEW.origin).ravel()
    assert abs(spin @ load) < 1e-12 * np.linalg.norm(spin) * np.linalg.norm(load)
    assert abs(np.tile(e, len(mesh.points)) @ load) < 1e-12 * np.abs(load).sum()


def test_spin_softening_against_the_mass():
    """Across the axis it is the mass, along the axis nothing."""
    mesh = without_sets(box(10, SIZE, (1, 1, 1)))
    solid = rotating_solid(mesh, STEEL)
    M, S = solid.structure.mass, solid.spin_softening
    across = scipy.sparse.diags_array(np.tile([1.0, 1.0, 0.0], len(mesh.points)))
    assert abs(S - M @ across).max() == 0.0


@settings(max_examples=20)
@given(
    direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    origin=st.tuples(*[st.floats(-1, 1)] * 3),
    seed=st.integers(0, 99),
)
def test_every_axis_gives_skew_coriolis_and_softening_between_nothing_and_the_mass(direction, origin, seed):
    """0 ≤ vᵀSv ≤ vᵀMv, equal when v has no component along the axis; Coriolis forces do no work; shifts of the axis load evenly."""
    mesh = box(8, SIZE, (2, 1, 1), 0.001)
    axis = Axis(direction, origin)
    solid = rotating_solid(mesh, STEEL, axis)
    M, S, G = solid.structure.mass, solid.spin_softening, solid.coriolis
    v = np.random.default_rng(seed).standard_normal((solid.structure.n // 3, 3))
    across = (v - np.outer(v @ axis.unit, axis.unit)).ravel()
    v = v.ravel()
    energy = v @ (M @ v)
    assert -1e-13 * energy <= v @ (S @ v) <= energy * (1 + 1e-13)
    assert v @ (S @ v) == pytest.approx(across @ (M @ across), rel=1e-10)
    assert abs(v @ (G @ v)) < 1e-13 * energy
    through_zero = rotating_solid(mesh, STEEL, Axis(direction)).centrifugal
    whole = assemble_solid(without_sets(mesh), STEEL).mass
    shift = np.tile(axis.arm(np.zeros((1, 3)))[0], len(mesh.points))
    expected = through_zero + (whole @ shift)[solid.moving]
    np.testing.assert_allclose(solid.centrifugal, expected, atol=1e-12 * max(np.abs(expected).max(), 1e-9))


# ---- static displacement ------------------------------------------------------------------------------------------------


def test_energy_of_a_stretched_bar_converges_with_the_fourth_order():
    """A bar from the axis outward: u = ρΩ²(L² x − x³/3)/(2E), energy 2 ρ²Ω⁴ A L⁵/(15 E); its own width adds (d/L)⁴."""
    length, depth, speed = 1.0, 0.01, 500.0
    errors = []
    exact = 2 * (BAR.density * speed**2 * depth) ** 2 * length**5 / (15 * BAR.young_modulus)
    for n in (1, 2, 4):
        mesh = box(20, (length, depth, depth), (n, 1, 1))
        mesh = SolidMesh(mesh.points - [0, depth / 2, depth / 2], mesh.cells, mesh.node_sets)
        solid = rotating_solid(mesh, BAR)
        u = solid.displacement(speed)
        errors.append(abs(u @ solid.centrifugal_load(speed) / exact - 1))
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.05)
    tip = solid.structure.dofs.take(solid.structure.dof_set("tip"))
    stretch = u[solid.structure.dof_set("tip")][np.array(tip.component) == "x"]
    exact_tip = BAR.density * speed**2 * length**3 / (3 * BAR.young_modulus)
    np.testing.assert_allclose(stretch, exact_tip, rtol=1e-4)


def test_stretch_of_a_bar_of_two_materials():
    """Tension from the outside inward; the tip moves by ∫ N/(EA): exact at the nodes but for the bar's width."""
    length, depth, speed = 1.0, 0.01, 500.0
    light = Material(young_modulus=110e9, poisson_ratio=0.0, density=4430.0)
    mesh = box(20, (length, depth, depth), (4, 1, 1))
    middle = mesh.points[mesh.cells].mean(axis=1)[:, 0]
    materials = [BAR if x < length / 2 else light for x in middle]
    mesh = SolidMesh(mesh.points - [0, depth / 2, depth / 2], mesh.cells, mesh.node_sets)
    solid = rotating_solid(mesh, materials)
    half = length / 2
    outer = light.density * speed**2 / 2
    outer *= length**2 * (length - half) - (length**3 - half**3) / 3
    pull = light.density * speed**2 * (length**2 - half**2) / 2
    inner = BAR.density * speed**2 * half**3 / 3 + pull * half
    exact = outer / light.young_modulus + inner / BAR.young_modulus
    u = solid.displacement(speed)[solid.structure.dof_set("tip")[::3]]
    np.testing.assert_allclose(u, exact, rtol=2e-4)


def ring_displacement(r, a, b, speed, material):
    """A free rotating disk with a hole in plane stress (Timoshenko & Goodier, Theory of Elasticity, art. 32)."""
    nu, E = material.poisson_ratio, material.young_modulus
    factor = material.density * speed**2 * (3 + nu) * (1 - nu) / (8 * E)
    inner = a**2 + b**2 + (1 + nu) / (1 - nu) * (a * b / r) ** 2 - (1 + nu) / (3 + nu) * r**2
    return factor * r * inner


def radial_tie(mesh):
    """Displacements that are radial and depend on the radius alone, as those of a full ring do."""
    radius = np.hypot(mesh.points[:, 0], mesh.points[:, 1])
    unit = mesh.points[:, :2] / radius[:, None]
    _, which = np.unique(np.round(radius, 9), return_inverse=True)
    rows = (3 * np.arange(len(radius))[:, None] + np.arange(2)).ravel()
    tie = scipy.sparse.csr_array((unit.ravel(), (rows, np.repeat(which, 2))))
    return scipy.sparse.vstack([tie, scipy.sparse.csr_array((1, tie.shape[1]))]).tocsr(), radius


def test_stretch_of_a_disk_with_a_hole_converges_with_the_fourth_order():
    a, b, speed = 0.1, 0.3, 600.0
    errors = []
    for n in (1, 2, 4):
        mesh = annular_sector(a, b, 0.02, sectors=6, divisions=(2 * n, n, 1))
        tie, radius = radial_tie(mesh)
        u = rotating_solid(mesh, BAR, clamped=()).displacement(speed, tie=tie).reshape(-1, 3)
        found = np.einsum("ni,ni->n", u[:, :2], mesh.points[:, :2]) / radius
        exact = ring_displacement(radius, a, b, speed, BAR)
        errors.append(np.abs(found / exact - 1).max())
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.6)
    assert errors[-1] < 1e-4


def test_stretch_of_a_thin_ring():
    """u = ρΩ²R³/E, up to the square of thickness over radius."""
    radius, thick, speed = 0.5, 0.005, 400.0
    mesh = annular_sector(radius - thick / 2, radius + thick / 2, thick, sectors=36, divisions=(1, 1, 1))
    tie, _ = radial_tie(mesh)
    u = rotating_solid(mesh, BAR, clamped=()).displacement(speed, tie=tie).reshape(-1, 3)
    stretch = np.linalg.norm(u, axis=1)
    exact = BAR.density * speed**2 * radius**3 / BAR.young_modulus
    # the mean is right to (t/R)²/12; from the inside to the outside it falls by about t/R
    assert stretch.mean() == pytest.approx(exact, rel=1e-4)
    assert np.ptp(stretch) < 2 * thick / radius * exact


def test_finite_stretch_of_a_bar_against_a_shooting_solution():
    """St. Venant-Kirchhoff in one dimension: P = E F (F² − 1)/2, P' = −ρΩ² x, x' = F; strains of 3 %."""
    length, depth = 1.0, 0.01
    speed = math.sqrt(0.06 * BAR.young_modulus / BAR.density) / length
    mesh = box(20, (length, depth, depth), (8, 1, 1))
    mesh = SolidMesh(mesh.points - [0, depth / 2, depth / 2], mesh.cells, mesh.node_sets)
    solid = rotating_solid(mesh, BAR)
    E, push = BAR.young_modulus, BAR.density * speed**2

    def stretch(P):  # the root near 1 of E F (F² − 1)/2 = P
        return scipy.optimize.brentq(lambda F: E * F * (F**2 - 1) / 2 - P, 0.9, 1.5, xtol=1e-15)

    def end(P0):
        found = scipy.integrate.solve_ivp(
            lambda _, y: [stretch(y[1]), -push * y[0]], (0, length), [0.0, P0], rtol=1e-10, atol=1e-10
        )
        return found.y[:, -1]

    P0 = scipy.optimize.brentq(lambda P: end(P)[1], push / 2, push, xtol=1e-3)
    exact = end(P0)[0] - length
    u = solid.displacement(speed, nonlinear=True)
    tip = solid.structure.dof_set("tip")[::3]
    linear = solid.displacement(speed)[tip].mean()
    assert abs(linear / exact - 1) > 0.01
    # the bar's width: its own centrifugal load, (d/L)², and ν = 0
    np.testing.assert_allclose(u[tip], exact, rtol=2e-4)


# ---- tangents -----------------------------------------------------------------------------------------------------------


LIGHT = Material(young_modulus=110e9, poisson_ratio=0.34, density=4430.0)


@pytest.fixture(scope="module", params=["steel", "steel and titanium"])
def plate(request):
    material = STEEL if request.param == "steel" else [STEEL, LIGHT]
    return rotating_solid(box(20, SIZE, (2, 1, 1), 0.001), material, SKEW)


def test_nonlinear_tangent_is_the_derivative_of_the_residual(plate):
    """Differences of displacements at nearby speeds: d u/d(Ω²) solves with the tangent (implicit function theorem)."""
    square = 4e7
    speeds = [math.sqrt(square * (1 + s)) for s in (-1e-3, 1e-3)]
    low, high = (plate.displacement(s, nonlinear=True) for s in speeds)
    slope = (high - low) / (2e-3 * square)
    u = plate.displacement(math.sqrt(square), nonlinear=True)
    tangent = plate.at_speed(math.sqrt(square), tangent="nonlinear").stiffness
    force = plate.centrifugal + plate.spin_softening @ u
    assert relative(tangent @ slope, force) < 1e-6


def test_orders_of_the_differences_between_the_tangents(plate):
    """The linear state misses terms of the fourth order in the speed, the textbook's tangent some of the second."""

    def stiffness(speed, tangent):
        return dense(plate.at_speed(speed, tangent=tangent).stiffness)

    gaps = {"consistent": [], "textbook": []}
    for speed in (4000.0, 8000.0):
        exact = stiffness(speed, "nonlinear")
        for tangent, values in gaps.items():
            values.append(np.linalg.norm(stiffness(speed, tangent) - exact))
    assert math.log2(np.divide(*gaps["consistent"][::-1])) == pytest.approx(4.0, abs=0.1)
    assert math.log2(np.divide(*gaps["textbook"][::-1])) == pytest.approx(2.0, abs=0.1)
    assert gaps["consistent"][1] < 0.05 * gaps["textbook"][1]


def test_stiffness_is_a_polynomial_of_the_speed(plate):
    """Three speeds determine it; at a fourth it holds. At rest it is the stiffness at rest, bit for bit."""
    rest = plate.structure.stiffness
    assert abs(plate.at_speed(0.0).stiffness - rest).max() == 0.0
    for tangent in ("consistent", "textbook"):
        at = [dense(plate.at_speed(s, tangent=tangent).stiffness) for s in (3e3, 5e3, 6e3, 9e3)]
        squares = np.array([9.0, 25.0, 36.0, 81.0])
        fit = np.linalg.lstsq(np.vander(squares[:3], 3), np.array([a.ravel() for a in at[:3]]), rcond=None)[0]
        fourth = (np.vander(squares[3:], 3) @ fit).reshape(at[3].shape)
        assert relative(fourth, at[3]) < 1e-11  # extrapolation multiplies round-off by 38
        K = at[0]
        assert np.abs(K - K.T).max() < 1e-12 * np.abs(K).max()
    assert plate.polynomial() is plate.polynomial()
    ties = [scipy.sparse.eye_array(plate.structure.n, format="csr") for _ in range(2)]
    assert plate.polynomial(ties[0]) is plate.polynomial(ties[1])
    assert plate.polynomial(ties[0]) is not plate.polynomial(2 * ties[0])


@pytest.mark.parametrize("mirror", [False, True])
def test_turned_and_mirrored_solids_have_the_same_frequencies(mirror):
    """A mirror image turns the other way round: the axis is a pseudovector. With Coriolis the sense matters, and agrees."""
    mesh = box(10, SIZE, (1, 1, 1), 0.001)
    turn = Axis((0.3, -1.0, 0.4)).rotation(1.1)
    turn = turn @ np.diag([1.0, -1.0, 1.0]) if mirror else turn
    cells = mesh.cells
    if mirror:  # the first two corners change places, so that cells are not inside out
        cells = cells[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    shift = np.array([0.2, -0.1, 0.3])
    moved = SolidMesh(mesh.points @ turn.T + shift, cells, mesh.node_sets)
    sign = -1.0 if mirror else 1.0
    axis = Axis(tuple(sign * turn @ SKEW.unit), tuple(turn @ SKEW.origin + shift))
    speed = 5000.0
    first, second = (
        rotating_solid(m, STEEL, a).at_speed(speed, coriolis=True) for m, a in ((mesh, SKEW), (moved, axis))
    )
    np.testing.assert_allclose(natural_frequencies(second, 6), natural_frequencies(first, 6), rtol=1e-9)
    everywhere = scipy.sparse.block_diag([scipy.sparse.csr_array(turn)] * (first.n // 3), format="csr")
    for name in ("mass", "damping", "stiffness"):
        a, b = getattr(first, name), getattr(second, name)
        assert relative(dense(everywhere.T @ b @ everywhere), dense(a)) < 1e-11


def test_supports_of_single_components():
    """Components that are held: rows and columns of the free solid's matrices go, at rest and at speed, and nothing else."""
    mesh = box(10, SIZE, (1, 1, 1), 0.001)
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[mesh.node_sets["tip"], 2] = True
    held[3, 0] = True
    free = rotating_solid(mesh, STEEL, SKEW)
    some = rotating_solid(mesh, STEEL, SKEW, held=held)
    keep = np.flatnonzero(np.isin(free.moving, some.moving))
    assert 0 < len(free.moving) - len(keep) == held[free.free].sum()
    # the same static state, so that the same prestress is compared
    tie = scipy.sparse.eye_array(free.structure.n, format="csr")[:, keep]
    for tangent in ("consistent", "nonlinear"):
        both = (
            free.at_speed(5e3, tie=tie, tangent=tangent, coriolis=True),
            some.at_speed(5e3, tangent=tangent, coriolis=True),
        )
        for name in ("mass", "damping", "stiffness"):
            whole, part = (getattr(structure, name) for structure in both)
            assert relative(dense(part), dense(whole[keep][:, keep])) < 1e-11
    np.testing.assert_array_equal(some.centrifugal, free.centrifugal[keep])
    tips = some.structure.dofs.take(some.structure.dof_set("tip"))
    assert set(tips.component) == {"x", "y"}
    u = some.displacement(5e3)
    assert not some.at_nodes(u)[held].any()
    np.testing.assert_array_equal(some.at_nodes(u).ravel()[some.moving], u)
    with pytest.raises(InputError, match=r"held: has shape \(2, 3\) for"):
        assemble_solid(mesh, STEEL, held=held[:2])


# ---- beams --------------------------------------------------------------------------------------------------------------

# B11: rotating cantilever, Euler-Bernoulli, η = Ω sqrt(ρAL⁴/EI), hub radius over length -> flap 1, flap 2, lag 1
B11 = {
    (0, 0.0): (3.516015, 22.034491, 3.516015),
    (2, 0.0): (4.137319, 22.614922, 3.621796),
    (5, 0.0): (6.449545, 25.446080, 4.073896),
    (10, 0.0): (11.202328, 33.640366, 5.048974),
    (2, 1.0): (4.833689, 23.366042, 4.400516),
    (5, 1.0): (8.940358, 29.352835, 7.411477),
}


@pytest.mark.parametrize("tangent", ["consistent", "textbook"])
def test_rotating_cantilever_in_the_slender_limit(tangent):
    """Square section, depth 1 % of the length, axis z: flap moves along z, lag along y.

    The bound of 0.1 % has room for shear and rotary inertia, 3.4e-4 of the frequency in mode 2, static strain,
    η² (d/L)²/24 = 4e-4 at η = 10, and the mesh, 2e-4 (sixteen elements: 4e-3).
    """
    length, depth = 1.0, 0.01
    scale = math.sqrt(BAR.density * depth**2 * length**4 / (BAR.young_modulus * depth**4 / 12))
    for (eta, hub), (flap, flap2, lag) in B11.items():
        mesh = box(20, (length, depth, depth), (32, 1, 1))
        points = mesh.points + np.array([hub * length, -depth / 2, -depth / 2])
        solid = rotating_solid(SolidMesh(points, mesh.cells, mesh.node_sets), BAR)
        turning = solid.at_speed(eta / scale, tangent=tangent)
        omega = 2 * math.pi * natural_frequencies(turning, 4) * scale
        lag2 = math.sqrt(flap2**2 - eta**2)
        np.testing.assert_allclose(omega, [lag, flap, lag2, flap2], rtol=1e-3)


def test_stubby_cantilever_against_timoshenko():
    """Length ten times the depth: the frequencies of Timoshenko's beam, 0.7 and 4 % below those of Euler and Bernoulli.

    Shear coefficient 5/6 (ν = 0; Cowper 1966). Four cells over the depth follow the parabola of the shear stress;
    doubling them both ways moves the second frequency by 3e-4.
    """
    length, depth = 1.0, 0.1
    solid = assemble_solid(box(20, (length, 0.7 * depth, depth), (16, 1, 4)), BAR)
    found = natural_frequencies(solid, 6) * 2 * math.pi
    exact = [timoshenko_cantilever(n, length, depth, BAR, 5 / 6) for n in (1, 2)]
    found = [found[np.argmin(np.abs(found - omega))] for omega in exact]
    np.testing.assert_allclose(found, exact, rtol=6e-4)
    speed = math.sqrt(BAR.young_modulus / BAR.density * depth**2 / 12)
    euler = [beam_root(n) ** 2 * speed / length**2 for n in (1, 2)]
    assert np.all(np.array(euler) > np.array([1.006, 1.04]) * exact)


def timoshenko_cantilever(n, length, depth, material, shear_coefficient):
    """The n-th natural frequency in rad/s by shooting: y = (w, φ, M, Q), two integrations, a determinant."""
    E, G, rho = material.young_modulus, material.lame[1], material.density
    A, inertia = depth**2, depth**4 / 12

    def determinant(omega):
        system = np.array(
            [
                [0, 1, 0, 1 / (shear_coefficient * G * A)],
                [0, 0, 1 / (E * inertia), 0],
                [0, -rho * inertia * omega**2, 0, -1],
                [-rho * A * omega**2, 0, 0, 0],
            ]
        )
        at_end = scipy.linalg.expm(system * length)
        return np.linalg.det(at_end[2:, 2:])

    guess = beam_root(n) ** 2 * math.sqrt(E * inertia / (rho * A)) / length**2
    return scipy.optimize.brentq(determinant, 0.8 * guess, 1.01 * guess)


def test_shaft_seen_from_its_rotating_axes():
    """A square cantilever along the axis bends alike in all directions: its frequency f splits into f ± Ω/2π.

    What is left of the difference is the stress stiffness of the cross-section's own stretch and rotary inertia, (d/L)².
    """
    length, depth = 1.0, 0.02
    mesh = box(20, (length, depth, depth), (8, 1, 1))
    points = mesh.points - [0, depth / 2, depth / 2]
    solid = rotating_solid(SolidMesh(points, mesh.cells, mesh.node_sets), BAR, Axis((1.0, 0.0, 0.0)))
    still = natural_frequencies(solid.structure, 2)
    speed = 0.3 * 2 * math.pi * still[0]
    turning = solid.at_speed(speed, coriolis=True)
    found = gyroscopic_modes(turning, 2).frequencies_hz
    np.testing.assert_allclose(found, still[0] * np.array([0.7, 1.3]), rtol=1e-3)


# ---- refusals -----------------------------------------------------------------------------------------------------------


def test_wrong_requests_are_named(plate):
    with pytest.raises(InputError, match=r"speed: must be a number in rad/s, got nan"):
        plate.at_speed(math.nan)
    with pytest.raises(InputError, match=r"speed: must be a number in rad/s, got inf"):
        plate.displacement(math.inf)
    with pytest.raises(InputError, match=r"no tangent 'consistant'\. Did you mean 'consistent'"):
        plate.at_speed(1.0, tangent="consistant")
    with pytest.raises(InputError, match="tangent 'nonlinear' is no polynomial"):
        plate.polynomial(tangent="nonlinear")
    loose = rotating_solid(without_sets(box(8, SIZE, (1, 1, 1))), STEEL)
    with pytest.raises(SingularError, match=r"is not determined .* Clamp nodes"):
        loose.displacement(100.0)
    with pytest.raises(InputError, match=rf"tie: has 3 rows for {plate.structure.n} dofs"):
        plate.at_speed(100.0, tie=scipy.sparse.eye_array(3, format="csr"))


def test_speeds_without_equilibrium_are_named(plate):
    """A billion rad/s: the first step is a billion times the plate's size, and Newton's method gives up, in words."""
    with pytest.raises(StickslipError, match=r"no equilibrium at 1e\+09 rad/s"):
        plate.displacement(1e9, nonlinear=True)
