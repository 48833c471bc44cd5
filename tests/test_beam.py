"""Beams against closed forms: supports, shear, rates of convergence, rotation."""

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

import stickslip as ss

UNIT = ss.Material(young_modulus=1.0, poisson_ratio=0.0, density=1.0)
SLENDER = ss.model.Beam(length=1.0, area=1.0, second_moment=1.0, material=UNIT)
# rows of benchmark B11 (Hodges and Rutkowski 1981; Wright et al. 1982): hub radius, speed, flap 1 and 2, lag 1
ROTATING = [
    (0, 0, 3.516015, 22.034491, 3.516015),
    (0, 1, 3.681647, 22.181011, 3.543236),
    (0, 2, 4.137319, 22.614922, 3.621796),
    (0, 3, 4.797278, 23.320264, 3.743511),
    (0, 4, 5.585002, 24.273350, 3.897723),
    (0, 5, 6.449545, 25.446080, 4.073896),
    (0, 10, 11.202328, 33.640366, 5.048974),
    (1, 1, 3.888823, 22.375014, 3.758050),
    (1, 2, 4.833689, 23.366042, 4.400516),
    (1, 3, 6.081750, 24.927745, 5.290338),
    (1, 4, 7.475048, 26.957262, 6.314771),
    (1, 5, 8.940358, 29.352835, 7.411477),
    (1, 10, 16.606363, 44.368224, 13.257876),
]
THIRD = {0: 61.697215, 1: 61.841763, 2: 62.273185, 3: 62.984968, 4: 63.966761, 5: 65.205041, 10: 74.649295}
FAR_HUB = {1: 4.085336, 2: 5.439948, 3: 7.133713, 4: 8.966379, 5: 10.861596, 10: 20.611190}


def omega(structure, n):
    return 2 * np.pi * ss.model.natural_frequencies(structure, n)


@pytest.mark.parametrize(("hub", "speed", "flap_1", "flap_2", "lag_1"), ROTATING)
def test_rotating_cantilever_to_the_printed_digits(hub, speed, flap_1, flap_2, lag_1):
    # one unit of the last digit, made with 120 elements as well; two for lag, which in the table is off lag² = flap² - speed² by that
    flap, lag = (ss.model.rotating_beam(SLENDER, 120, speed, hub_radius=hub, bending=d) for d in "zy")
    np.testing.assert_allclose(omega(flap, 2), (flap_1, flap_2), rtol=0, atol=1e-6)
    assert omega(lag, 1)[0] == pytest.approx(lag_1, abs=2e-6)


def test_third_flap_and_the_farthest_hub():
    for speed, third in THIRD.items():
        assert omega(ss.model.rotating_beam(SLENDER, 120, speed), 3)[2] == pytest.approx(third, abs=1e-6)
    for speed, first in FAR_HUB.items():
        found = omega(ss.model.rotating_beam(SLENDER, 120, speed, hub_radius=2.0), 1)[0]
        assert found == pytest.approx(first, abs=1e-6)


def test_published_friction_beam_without_its_contact():
    # benchmark B10: fourteen elements, to the printed digits
    steel = ss.Material(young_modulus=0.6725 * 210e9, density=7850.0)
    beam = ss.model.Beam(0.71, 0.05 * 0.06, 0.06 * 0.05**3 / 12, steel)
    found = ss.model.natural_frequencies(ss.model.beam(beam, 14), 3)
    np.testing.assert_allclose(found, (67.960197, 425.902892, 1192.610574), atol=1e-6)


@pytest.mark.parametrize(
    ("ends", "equation", "guess"),
    [
        (("clamped", "free"), lambda x: np.cos(x) * np.cosh(x) + 1, 1.875),
        (("free", "clamped"), lambda x: np.cos(x) * np.cosh(x) + 1, 1.875),
        (("clamped", "clamped"), lambda x: np.cos(x) * np.cosh(x) - 1, 4.73),
        (("clamped", "pinned"), lambda x: np.tan(x) - np.tanh(x), 3.927),
        (("pinned", "pinned"), np.sin, 3.14),
        (("clamped", "sliding"), lambda x: np.tan(x) + np.tanh(x), 2.365),
        (("sliding", "pinned"), np.cos, 1.57),
    ],
)
def test_supports(ends, equation, guess):
    root = scipy.optimize.brentq(equation, guess - 0.05, guess + 0.05)
    shape = ss.model.Beam(1.0, 1.0, 1.0, UNIT, ends=ends)
    # the square of the frequency is (root / 20)⁴ / 720 too high
    expected = root**2 * (1 + (root / 20) ** 4 / 1440)
    assert omega(ss.model.beam(shape, 20), 1)[0] == pytest.approx(expected, rel=1e-7)


def test_free_beam_moves_rigidly():
    shape = ss.model.Beam(1.0, 1.0, 1.0, UNIT, ends=("free", "free"))
    bending, both = (omega(ss.model.beam(shape, 20, axial=axial), 4) for axial in (False, True))
    np.testing.assert_array_equal(bending[:2], 0.0)
    assert bending[2] == pytest.approx(4.730040745**2, rel=1e-5)
    np.testing.assert_array_equal(both[:3], 0.0)
    assert both[3] == pytest.approx(np.pi * (1 + (np.pi / 20) ** 2 / 24), rel=1e-5)


def rate(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def test_slender_elements_converge_with_the_fourth_power():
    exact = 4.694091132974174**2  # second root of cos x cosh x = -1
    errors = [omega(ss.model.beam(SLENDER, n), 2)[1] / exact - 1 for n in (4, 8, 16, 32)]
    assert np.all(np.array(errors) > 0)
    np.testing.assert_allclose(rate(errors), 4.0, atol=0.15)


THICK = {"length": 1.0, "area": 0.2, "second_moment": 0.2**3 / 12, "shear_coefficient": 5 / 6}
RUBBER = ss.Material(young_modulus=1.0, poisson_ratio=0.25, density=1.0)


def on_two_pins(n_modes):
    """Closed form of the lower branch: ``(ρ²IA/S) ω⁴ - (ρA + ρA EI k²/S + ρI k²) ω² + EI k⁴ = 0``, S = κGA."""
    k = np.pi * np.arange(1, n_modes + 1)
    A, I = 0.2, 0.2**3 / 12  # noqa: E741
    S = 5 / 6 * A / 2.5
    a, b, c = A * I / S, A + A * I * k**2 / S + I * k**2, I * k**4
    return np.sqrt((b - np.sqrt(b**2 - 4 * a * c)) / (2 * a))


def test_thick_elements_converge_with_the_second_power():
    shape = ss.model.Beam(**THICK, material=RUBBER, ends=("pinned", "pinned"))
    exact = on_two_pins(3)
    errors = np.array([omega(ss.model.beam(shape, n), 3) / exact - 1 for n in (16, 32, 64)])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.03)
    assert np.max(np.abs(errors[-1])) < 4e-4


def test_thick_cantilever_against_the_differential_equation():
    # frequencies at which the transfer matrix of (w, θ, M, V) over the length lets moment and shear force vanish at the tip
    A, I = THICK["area"], THICK["second_moment"]  # noqa: E741
    S = 5 / 6 * A / 2.5

    def at_tip(w):
        rates = np.array([[0, 1, 0, 1 / S], [0, 0, 1 / I, 0], [0, -I * w**2, 0, -1], [-A * w**2, 0, 0, 0]])
        return np.linalg.det(scipy.linalg.expm(rates)[2:, 2:])

    found = omega(ss.model.beam(ss.model.Beam(**THICK, material=RUBBER), 60), 3)
    exact = [scipy.optimize.brentq(at_tip, 0.97 * w, 1.03 * w) for w in found]
    np.testing.assert_allclose(found, exact, rtol=6e-4)
    coarse = omega(ss.model.beam(ss.model.Beam(**THICK, material=RUBBER), 30), 3)
    np.testing.assert_allclose(rate([coarse - exact, found - exact]), 2.0, atol=0.05)


@pytest.mark.parametrize("thickness", [1e-4, 0.01, 0.5])
@pytest.mark.parametrize("elements", [1, 3])
def test_static_deflection_is_exact_however_thin(thickness, elements):
    # a force at the tip: F L³ / 3 EI + F L / κGA, at any number of elements
    shape = ss.model.Beam(1.0, thickness, thickness**3 / 12, RUBBER, shear_coefficient=5 / 6)
    structure = ss.model.beam(shape, elements, bending="y")
    force = np.zeros(structure.n)
    force[structure.sets["tip"]] = 1.0
    moved = np.linalg.solve(structure.stiffness, force)
    exact = 1 / (3 * shape.second_moment) + 1 / (5 / 6 * 0.4 * thickness)
    assert moved[structure.sets["tip"][0]] == pytest.approx(exact, rel=1e-9)


def test_thin_beam_with_shear_is_the_slender_one():
    shape = {"length": 1.0, "area": 1e-3, "second_moment": 1e-9 / 12, "material": UNIT}
    thin, slender = ss.model.Beam(**shape, shear_coefficient=5 / 6), ss.model.Beam(**shape)
    np.testing.assert_allclose(omega(ss.model.beam(thin, 20), 3), omega(ss.model.beam(slender, 20), 3), rtol=1e-4)


def test_mass_and_names():
    structure = ss.model.beam(ss.model.Beam(2.0, 0.3, 0.1, ss.Material(), ends=("free", "free")), 5, axial=True)
    for name in ("deflection", "axial"):
        unit = np.zeros(structure.n)
        unit[structure.sets[name]] = 1.0
        assert unit @ structure.mass @ unit == pytest.approx(7850 * 0.3 * 2.0)
    assert structure.dofs.component[:3] == ("z", "ry", "x")
    np.testing.assert_allclose(structure.dofs.position[structure.sets["tip"][0]], [2.0, 0, 0])
    # turning about the middle, right-handed: z = -θ (x - 1), ry = θ costs no energy
    turn = np.zeros(structure.n)
    turn[structure.sets["deflection"]] = -(structure.dofs.position[structure.sets["deflection"], 0] - 1)
    turn[structure.sets["rotation"]] = 1.0
    assert abs(turn @ structure.stiffness @ turn) < 1e-6 * structure.stiffness.max()
    lag = ss.model.beam(ss.model.Beam(2.0, 0.3, 0.1, ss.Material(), ends=("free", "free")), 5, bending="y")
    turn = np.zeros(lag.n)
    turn[lag.sets["deflection"]] = lag.dofs.position[lag.sets["deflection"], 0] - 1
    turn[lag.sets["rotation"]] = 1.0
    assert abs(turn @ lag.stiffness @ turn) < 1e-6 * lag.stiffness.max()


# ---- rotation -----------------------------------------------------------------------------------------------------------


def test_lag_is_flap_less_the_square_of_the_speed():
    flap, lag = (ss.model.rotating_beam(SLENDER, 10, 4.0, hub_radius=0.5, bending=d) for d in "zy")
    np.testing.assert_allclose(omega(lag, 4) ** 2, omega(flap, 4) ** 2 - 16.0, rtol=1e-7)


def test_turning_bar_stretches_at_lower_frequencies():
    # axial motion alone: ω² = ω₀² - Ω², whatever the hub
    stiff = ss.model.Beam(1.0, 1.0, 1e6, UNIT)  # bending far above
    at_rest, turning = (ss.model.rotating_beam(stiff, 40, s, axial=True, hub_radius=0.3) for s in (0.0, 1.0))
    assert omega(turning, 1)[0] ** 2 == pytest.approx(omega(at_rest, 1)[0] ** 2 - 1, rel=1e-6)


def polynomial_frequencies(shape, speed, hub, terms=9):
    """Lag, stretching and Coriolis forces by the Ritz method with powers of x, in a general companion matrix."""
    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = 0.5 * (x + 1), 0.5 * weight
    k = np.arange(terms)[:, None]
    u, du = x ** (k + 1), (k + 1) * x**k
    v, dv = x ** (k + 2), (k + 2) * x ** (k + 1)
    ddv = (k + 2) * (k + 1) * x**k
    E, rho = shape.material.young_modulus, shape.material.density
    A, I = shape.area, shape.second_moment  # noqa: E741
    tension = rho * A * speed**2 * (hub * (1 - x) + 0.5 * (1 - x**2))

    def integral(a, b, factor):
        return (a * weight * factor) @ b.T

    M = scipy.linalg.block_diag(integral(u, u, rho * A), integral(v, v, rho * A))
    K = (
        scipy.linalg.block_diag(integral(du, du, E * A), integral(ddv, ddv, E * I) + integral(dv, dv, tension))
        - speed**2 * M
    )
    G = np.zeros_like(M)
    G[:terms, terms:] = -2 * speed * integral(u, v, rho * A)
    G -= G.T
    n = len(M)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, G)]])
    rates = np.linalg.eigvals(state)
    return np.sort(rates.imag[rates.imag > 0])


def test_coriolis_forces_couple_lag_and_stretching():
    # thick enough that the bar's frequencies lie among those of bending
    shape = ss.model.Beam(1.0, 1.0, 0.02, UNIT)
    exact = polynomial_frequencies(shape, 0.9, 0.2)[:4]
    structure = ss.model.rotating_beam(shape, 60, 0.9, hub_radius=0.2, bending="y", axial=True, coriolis=True)
    found = 2 * np.pi * ss.model.gyroscopic_modes(structure, 4).frequencies_hz
    # linear bar elements: (π/2 5/60)²/24 of the third bar mode
    np.testing.assert_allclose(found, exact, rtol=1e-3)
    without = omega(structure, 4)
    assert np.max(np.abs(without / exact - 1)) > 0.05  # it matters
    back = ss.model.rotating_beam(shape, 60, -0.9, hub_radius=0.2, bending="y", axial=True, coriolis=True)
    np.testing.assert_allclose(back.damping, -structure.damping)


def test_campbell_diagram_of_a_blade():
    def at(speed):
        return ss.model.rotating_beam(SLENDER, 20, speed, hub_radius=1.0, bending="z")

    found = ss.response.campbell(at, np.linspace(0.0, 10.0, 6), 2, (2, 5), tolerance=1e-8)
    for crossing in found.crossings:
        exact = omega(at(crossing.speed), 2)[crossing.mode]
        assert exact == pytest.approx(crossing.engine_order * crossing.speed, rel=1e-6)
    assert [(c.engine_order, c.mode) for c in found.crossings] == [(2, 0), (5, 0), (5, 1)]


@pytest.mark.parametrize(
    ("make", "place"),
    [
        (lambda: ss.model.Beam(-1.0, 1.0, 1.0, UNIT), "length"),
        (lambda: ss.model.Beam(1.0, 1.0, 1.0, UNIT, shear_coefficient=0.0), "shear_coefficient"),
        (lambda: ss.model.Beam(1.0, 1.0, 1.0, UNIT, ends=("clamped", "glued")), "ends"),
        (lambda: ss.model.beam(SLENDER, 0), "elements"),
        (lambda: ss.model.beam(SLENDER, 3, bending="x"), "bending"),
        (lambda: ss.model.rotating_beam(SLENDER, 3, 1.0, hub_radius=-1.0), "hub radius"),
        (lambda: ss.model.rotating_beam(SLENDER, 3, np.nan), "speed"),
        (lambda: ss.model.rotating_beam(SLENDER, 3, 1.0, coriolis=True), "coriolis"),
        (
            lambda: ss.model.rotating_beam(ss.model.Beam(1.0, 1.0, 1.0, UNIT, ends=("pinned", "free")), 3, 1.0),
            "tension depends",
        ),
    ],
)
def test_wrong_input_is_named(make, place):
    with pytest.raises(ss.InputError, match=place):
        make()
