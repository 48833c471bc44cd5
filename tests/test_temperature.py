"""Temperature in solids: stiffness of the temperature, thermal strain in the static state, and preload by it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cyclic_models import wedge
from solid_models import box
from test_anisotropic import ORTHO, SKEWED
from test_element_kinds import KINDS, SIZE, mesh_of

from stickslip.assembly.contact import Join
from stickslip.assembly.model import Model
from stickslip.assembly.part_copies import copy_of, place_of
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.fe.cell_laws import Temperature
from stickslip.model.fe.material import ByTemperature, ElasticMaterial, Expansion, Material, row_of
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import assemble_solid
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import solid_part

ALPHA = 1.2e-5
ONE_ROW = ByTemperature(((ALPHA,),))
DENSITY = ByTemperature(((7850.0,),))
E_COLD, E_HOT = 210e9, 150e9
ELASTIC = ByTemperature(((E_COLD, 0.3), (E_HOT, 0.3)), (20.0, 720.0))
STEEL = ElasticMaterial(elastic=ELASTIC, density_table=DENSITY, expansion=Expansion(coefficients=ONE_ROW))
SKEWED_ORTHO = ElasticMaterial(
    elastic=ByTemperature((row_of(ORTHO), row_of(0.7 * ORTHO)), (20.0, 720.0)),
    density_table=DENSITY,
    orientation=SKEWED,
    expansion=Expansion(coefficients=ByTemperature(((1e-5, 2e-5, 3e-5),))),
)


def uniform(mesh, value, start=20.0):
    return Temperature(np.full(len(mesh.points), value), np.full(len(mesh.points), start))


def uneven(mesh):
    x, y, z = (mesh.points / np.ptp(mesh.points, axis=0).max()).T
    return Temperature(200 + 300 * x + 100 * y**2 + 50 * x * z, np.full(len(x), 20.0))


@pytest.mark.parametrize("kind", KINDS)
def test_a_free_body_of_one_temperature_grows_without_stress(kind):
    """Stiffness of small vibrations follows E(T); the initial-displacement terms scale it by (1 + αΔT)²."""
    how, second, rule = KINDS[kind]
    mesh = mesh_of(how, second, divisions=(2, 1, 1))
    free = SolidMesh(mesh.points, mesh.cells, {})
    held = np.zeros_like(mesh.points, dtype=bool)
    corner = [np.flatnonzero(np.abs(mesh.points - place).max(axis=1) < 1e-9)[0] for place in np.diag(SIZE)]
    origin = np.flatnonzero(np.abs(mesh.points).max(axis=1) < 1e-9)[0]
    held[origin] = True
    held[corner[0], [1, 2]] = True
    held[corner[1], 2] = True
    solid = rotating_solid(free, STEEL, held=held, quadrature=rule, temperature=uniform(free, 370.0))
    growth = ALPHA * 350.0
    np.testing.assert_allclose(solid.at_nodes(solid.displacement(0.0)), growth * mesh.points, atol=1e-9 * growth)
    cold = Material(young_modulus=(E_COLD + E_HOT) / 2, poisson_ratio=0.3, density=7850.0)
    K = assemble_solid(free, cold, held=held, quadrature=rule).stiffness.toarray()
    np.testing.assert_allclose(solid.structure.stiffness.toarray(), K, atol=1e-10 * K.max())
    plain = solid.at_speed(0.0, tangent="textbook").stiffness.toarray()
    np.testing.assert_allclose(plain, K, atol=1e-10 * K.max())
    if rule.hourglass is None:  # hourglass control does not follow the deformed geometry
        consistent = solid.at_speed(0.0).stiffness.toarray()
        np.testing.assert_allclose(consistent, (1 + growth) ** 2 * K, atol=1e-10 * K.max())


@pytest.mark.parametrize("kind", ["wedges", "incompatible modes", "bricks and pyramids", "one point"])
@pytest.mark.parametrize("material", [STEEL, SKEWED_ORTHO], ids=["steel", "orthotropic"])
def test_the_polynomial_of_speed_is_the_tangent_at_the_whole_displacement(kind, material):
    how, second, rule = KINDS[kind]
    mesh = mesh_of(how, second, divisions=(2, 1, 1))
    solid = rotating_solid(mesh, material, Axis((0, 1, 0)), quadrature=rule, temperature=uneven(mesh))
    speed = 4000.0
    terms = solid._terms(solid.displacement(speed), heated=True)
    direct = solid.structure.stiffness + terms.linear + terms.quadratic + terms.geometric
    direct = (direct - speed**2 * solid.spin_softening).toarray()
    found = solid.at_speed(speed).stiffness.toarray()
    change = np.abs(found - solid.structure.stiffness.toarray()).max()
    np.testing.assert_allclose(found, direct, atol=1e-9 * change)


def test_the_linear_state_is_the_limit_of_the_equilibrium_at_finite_displacement():
    mesh = mesh_of("hex", True, divisions=(2, 1, 1))
    errors = []
    for size in (1.0, 0.5):
        heat = Temperature(20 + size * (uneven(mesh).values - 20), np.full(len(mesh.points), 20.0))
        solid = rotating_solid(mesh, SKEWED_ORTHO, Axis((0, 1, 0)), temperature=heat)
        linear = solid.displacement(1000.0 * math.sqrt(size))
        exact = solid.displacement(1000.0 * math.sqrt(size), nonlinear=True)
        errors.append(np.linalg.norm(exact - linear) / np.linalg.norm(linear))
    assert errors[0] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.1)


def test_a_heated_beam_between_pins_has_the_frequency_of_a_compressed_one():
    """f = f0 √(1 − P/P_cr), P = E A α ΔT, P_cr = π² E I / L²; a slender beam of bricks, pinned on its middle line."""
    length, width, height = 0.4, 0.01, 0.01
    mesh = box(20, (length, width, height), (16, 1, 2))
    free = SolidMesh(mesh.points, mesh.cells, {})
    middle = np.abs(mesh.points[:, 2] - height / 2) < 1e-9
    ends = middle & ((mesh.points[:, 0] < 1e-9) | (mesh.points[:, 0] > length - 1e-9))
    held = np.repeat(ends[:, None], 3, axis=1)
    held[:, 1] = True  # bends in one plane
    critical = math.pi**2 * height**2 / (12 * length**2 * ALPHA)  # K
    bar = ElasticMaterial(
        elastic=ByTemperature(((2.1e11, 0.0),)), density_table=DENSITY, expansion=Expansion(coefficients=ONE_ROW)
    )
    cold = natural_frequencies(assemble_solid(free, bar, held=held), 1)[0]
    lost = []
    for share in (0.3, 0.6):
        heat = uniform(free, 20 + share * critical)
        solid = rotating_solid(free, bar, held=held, temperature=heat)
        hot = natural_frequencies(solid.at_speed(0.0), 1)[0]
        lost.append((1 - (hot / cold) ** 2) / share)
    # f² falls linearly; the pins on a line give way by some of the height, which takes 2 % of the force
    assert lost[1] / lost[0] == pytest.approx(1, rel=3e-3)
    assert 0.97 < lost[0] < 1.0


def test_expansion_is_secant_or_instantaneous():
    """α(T) = a + bT as a derivative has the secant (a + b(T + T0)/2) from T0."""
    a, b, zero = 1e-5, 4e-9, 25.0
    grid = tuple(np.linspace(0.0, 1000.0, 11))
    slope = Expansion(coefficients=ByTemperature(tuple((a + b * t,) for t in grid), grid), kind="instantaneous")
    rows = tuple((a + b * (t + zero) / 2,) for t in grid)
    secant = Expansion(coefficients=ByTemperature(rows, grid), kind="secant", zero=zero)
    start, end = np.array([40.0, 300.0]), np.array([730.0, 15.0])
    expected = a * (end - start) + b * (end**2 - start**2) / 2
    np.testing.assert_allclose(slope.strain(start, end)[:, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(secant.strain(start, end)[:, 2], expected, rtol=1e-12)
    assert not secant.strain(start, end)[:, 3:].any()
    beyond = slope.strain(np.array([1000.0]), np.array([1200.0]))[0, 0]
    assert beyond == pytest.approx(200 * (a + b * 1000))
    with pytest.raises(InputError, match=r"Expansion\.zero: is missing"):
        Expansion(coefficients=secant.coefficients)


def test_a_heated_sector_grows_like_its_ring():
    mesh = wedge(6, cells=(1, 2, 1), clamp=False)
    part = solid_part(mesh, STEEL, sectors=6, temperature=uniform(mesh, 320.0))
    model = Model(parts={"ring": part})
    moved = model.static_displacement(0.0)["ring"]
    shift = moved - ALPHA * 300.0 * mesh.points
    assert np.abs(shift - shift.mean(axis=0)).max() < 1e-10
    state = model.static_state(0.0)
    assert state.strain < 1e-12  # free thermal strain is no strain
    assert state.displacement > 0


def test_joined_parts_are_one_heated_body():
    whole = box(20, (0.2, 0.02, 0.02), (4, 1, 1))
    left = box(20, (0.1, 0.02, 0.02), (2, 1, 1))
    right = SolidMesh(
        left.points + np.array([0.1, 0, 0]), left.cells, {"start": left.node_sets["root"], "tip": left.node_sets["tip"]}
    )
    one = solid_part(whole, STEEL, temperature=uneven(whole))

    def part(mesh):
        nearest = np.argmin(np.abs(whole.points[:, None] - mesh.points).sum(axis=2), axis=0)
        return solid_part(mesh, STEEL, temperature=uneven(whole).take(nearest))

    two = Model(
        parts={"left": part(left), "right": part(right)}, joins={"joint": Join(between=("left.tip", "right.start"))}
    )
    single = Model(parts={"bar": one})
    for speed in (0.0, 800.0):
        expected = single.static_displacement(speed)["bar"]
        found = two.static_displacement(speed)
        nearest = np.argmin(np.abs(whole.points[:, None] - right.points).sum(axis=2), axis=0)
        np.testing.assert_allclose(found["right"], expected[nearest], atol=1e-8 * np.abs(expected).max())
        hz = natural_frequencies(single.at(speed), 4)
        np.testing.assert_allclose(natural_frequencies(two.at(speed), 4), hz, rtol=1e-7)
    cold = natural_frequencies(single.parts["bar"].structure, 4)
    assert np.abs(natural_frequencies(single.at(0.0), 4) / cold - 1).max() > 1e-3


def test_a_copy_takes_its_temperatures_along():
    mesh = box(10, (0.1, 0.02, 0.02), (2, 1, 1))
    part = solid_part(mesh, SKEWED_ORTHO, temperature=uneven(mesh))
    copy = copy_of(part, place_of(turn=1.1, axis=Axis((1, 2, 3)), mirror=(0, 1, 0), move=(0.3, 0, 0)))
    moved = copy.solid.at_nodes(copy.solid.displacement(0.0))
    own = part.solid.at_nodes(part.solid.displacement(0.0))
    np.testing.assert_allclose(moved, own @ copy.place.turn.T, atol=1e-9 * np.abs(own).max())
    hz = natural_frequencies(copy.solid.at_speed(0.0), 3)
    np.testing.assert_allclose(hz, natural_frequencies(part.solid.at_speed(0.0), 3), rtol=1e-8)


def test_density_over_temperature_is_that_of_each_cell():
    mesh = box(8, SIZE, (2, 1, 1))
    lighter = replace(STEEL, density_table=ByTemperature(((8000.0,), (7000.0,)), (0.0, 1000.0)))
    heat = uneven(mesh)
    mass = assemble_solid(mesh, lighter, temperature=heat, clamped=()).mass
    means = heat.values[mesh.cells].mean(axis=1)
    expected = np.mean(8000 - means) * math.prod(SIZE)
    assert mass.sum() / 3 == pytest.approx(expected, rel=1e-12)


def test_a_material_over_temperature_needs_a_temperature():
    with pytest.raises(InputError, match="depends on temperature, and none is given"):
        assemble_solid(box(8, SIZE, (1, 1, 1)), STEEL)


def test_heat_without_the_centrifugal_load_of_a_turning_model_is_refused():
    mesh = box(8, SIZE, (1, 1, 1))
    model = Model(
        parts={"bar": solid_part(mesh, STEEL, temperature=uniform(mesh, 400.0))}, speed=100.0, centrifugal=False
    )
    with pytest.raises(InputError, match=r"rotation\.centrifugal: is false, but parts have thermal strain"):
        _ = model.loads_steadily
