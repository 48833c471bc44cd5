"""Criteria of multiaxial fatigue: tests of the literature, closed forms, judges that share no code, invariance, refusals."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from stickslip.errors import InputError
from stickslip.model import strength as sg
from tests.test_strength import harmonics, random_harmonics, random_rotation, turned

MPA = 1e6
# Nishihara and Kawamoto (1945), hard steel
HARD = sg.StrengthCard(fatigue_limit_pa=313.9 * MPA, torsion_limit_pa=196.2 * MPA)
# limits without torsion
REPEATED = sg.StrengthCard(fatigue_limit_pa=300 * MPA, fatigue_limit_r0_pa=230 * MPA)
WITH_TORSION = (sg.crossland, sg.dang_van, sg.critical_plane)
ALL = (*WITH_TORSION, sg.sines)
# random stresses of 100 MPa in each component are far above yield
ANY = sg.StrengthCard(fatigue_limit_pa=300 * MPA, fatigue_limit_r0_pa=230 * MPA, torsion_limit_pa=190 * MPA)


def bending_and_torsion(tension, shear, phase_deg=0.0, static=0.0):
    return harmonics(
        [static * MPA, 0, 0, 0, 0, 0], [tension * MPA, 0, 0, shear * MPA * np.exp(-1j * np.radians(phase_deg)), 0, 0]
    )


@pytest.mark.parametrize(
    ("tension", "shear", "phase", "error"),
    [(138.1, 167.1, 0, -2.3), (245.3, 122.6, 0, 1.4), (150.2, 181.7, 90, -3.7), (258.0, 129.0, 90, -17.8)],
)
def test_crossland_on_the_limits_of_nishihara_and_kawamoto(tension, shear, phase, error):
    """Each test is a measured limit: the error is that of the criterion; -2.3 and -3.7 % are the literature's for these two."""
    found = sg.crossland(bending_and_torsion(tension, shear, phase), HARD)[0]
    assert round(100 * (found - 1), 1) == error
    root = np.hypot(tension / np.sqrt(3), shear) if phase == 0 else max(tension / np.sqrt(3), shear)
    by_hand = (root + (3 * 196.2 / 313.9 - np.sqrt(3)) * tension / 3) / 196.2
    assert found == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize("criterion", WITH_TORSION)
def test_the_limits_of_the_card_are_limits(criterion):
    np.testing.assert_allclose(criterion(bending_and_torsion(313.9, 0), HARD), 1, rtol=2e-6)
    np.testing.assert_allclose(criterion(bending_and_torsion(0, 196.2), HARD), 1, rtol=2e-6)
    np.testing.assert_allclose(criterion(bending_and_torsion(300, 0), REPEATED), 1, rtol=2e-6)
    np.testing.assert_allclose(criterion(bending_and_torsion(230, 0, static=230), REPEATED), 1, rtol=2e-6)


def test_sines_has_both_limits_in_tension_and_no_mean_in_torsion():
    np.testing.assert_allclose(sg.sines(bending_and_torsion(300, 0), REPEATED), 1)
    np.testing.assert_allclose(sg.sines(bending_and_torsion(230, 0, static=230), REPEATED), 1)
    twisted = bending_and_torsion(0, 100)
    np.testing.assert_allclose(sg.sines(twisted, REPEATED), 100 * np.sqrt(3) / 300)
    twisted[0, 0, 3] = 150 * MPA
    np.testing.assert_allclose(sg.sines(twisted, REPEATED), 100 * np.sqrt(3) / 300)


@pytest.mark.parametrize("mean", [0.0, 50.0, 250.0])
def test_findley_in_tension_is_its_closed_form(mean):
    k = 2 * 196.2 / 313.9 - 1
    k /= np.sqrt(1 - k**2)
    limit, top = 196.2 * np.sqrt(1 + k**2), 120 + mean
    found = sg.critical_plane(bending_and_torsion(120, 0, static=mean), HARD)
    np.testing.assert_allclose(found, (np.hypot(120, k * top) + k * top) / 2 / limit, rtol=2e-6)


def findley_of_one_harmonic(given, factor, limit):
    """Return Findley's utilisation of one place by singular values on 12 000 planes, then Nelder and Mead."""
    places = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
    static, dynamic = given[0, 0].real[places], given[1, 0][places]

    def damage(angles):
        theta, azimuth = np.moveaxis(np.asarray(angles), -1, 0)
        n = np.stack([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)], axis=-1)
        on = n @ dynamic
        normal = (on * n).sum(axis=-1)
        shear = on - normal[..., None] * n
        radius = np.linalg.svd(np.stack([shear.real, shear.imag], axis=-1), compute_uv=False)[..., 0]
        return (radius + factor * np.maximum((n @ static * n).sum(axis=-1) + np.abs(normal), 0)) / limit

    grid = np.stack(np.meshgrid(np.linspace(0, np.pi / 2, 80), np.linspace(0, 2 * np.pi, 150)), axis=-1).reshape(-1, 2)
    values = damage(grid)
    starts = grid[np.argsort(-values)[:3]]
    return max(
        -minimize(lambda x: -damage(x), start, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-10}).fun
        for start in starts
    )


@pytest.mark.parametrize("seed", range(4))
def test_findley_of_turning_axes_is_found_by_another_search(seed):
    own = random_harmonics(seed, highest=1, places=1)
    sine = 2 * 190 / 300 - 1
    k = sine / np.sqrt(1 - sine**2)
    expected = findley_of_one_harmonic(own, k, 190 * MPA * np.sqrt(1 + k**2))
    np.testing.assert_allclose(sg.critical_plane(own, ANY), expected, rtol=2e-6)


@pytest.mark.parametrize(("dimensions", "highest"), [(2, 1), (2, 4), (5, 2), (5, 6)])
def test_the_smallest_ball_is_that_of_a_convex_optimisation(dimensions, highest):
    rng = np.random.default_rng(dimensions + highest)
    path = rng.normal(size=(highest + 1, 6, dimensions)) + 1j * rng.normal(size=(highest + 1, 6, dimensions))
    found = sg.enclosing_ball(path)
    phase = 2 * np.pi * np.outer(np.arange(720), np.arange(1, highest + 1)) / 720
    points = np.einsum("nh,hmd->mnd", np.exp(1j * phase), path[1:]).real
    for own, centre, radius in zip(points, found.centre, found.radius, strict=True):
        reach = np.linalg.norm(own - centre, axis=1)
        assert reach.max() <= radius * (1 + 1e-12)
        # minimise r² - |c|² over |x|² - 2 x c <= r² - |c|², a convex problem with linear bounds
        twin = minimize(
            lambda z: z[0] + z[1:] @ z[1:],
            np.r_[np.max((own**2).sum(axis=1)), np.zeros(dimensions)],
            jac=lambda z: np.r_[1, 2 * z[1:]],
            constraints={
                "type": "ineq",
                "fun": lambda z, x=own: z[0] - (x**2).sum(axis=1) + 2 * x @ z[1:],
                "jac": lambda z, x=own: np.c_[np.ones(len(x)), 2 * x],
            },
            options={"ftol": 1e-14, "maxiter": 500},
            method="SLSQP",
        )
        # the twin knows 720 samples: between them the path goes out by a share of (π H / 720)² / 2
        assert radius == pytest.approx(np.sqrt(twin.fun), rel=(np.pi * highest / 720) ** 2)


def test_balls_of_a_point_a_line_and_a_circle():
    path = np.zeros((2, 3, 5), dtype=complex)
    path[0] = 7.0
    path[1, 1, 2] = 2 + 1j
    path[1, 2, :2] = 3, 3j
    found = sg.enclosing_ball(path)
    np.testing.assert_allclose(found.radius, [0, np.sqrt(5), 3], rtol=1e-12)
    np.testing.assert_allclose(found.centre, 0, atol=1e-8)


@settings(max_examples=3, deadline=None)
@given(st.integers(0, 10**6), st.floats(0, 6.28), st.floats(0.1, 10))
def test_criteria_know_neither_axes_nor_the_start_of_time_and_scale(seed, shift, scale):
    own = random_harmonics(seed, highest=2, places=1)
    moved = turned(own, random_rotation(seed)) * np.exp(1j * np.arange(len(own)) * shift)[:, None, None]
    for criterion, tolerance in ((sg.crossland, 2e-6), (sg.dang_van, 2e-5)):
        np.testing.assert_allclose(criterion(scale * moved, ANY), scale * criterion(own, ANY), rtol=tolerance)


def test_the_critical_plane_knows_neither_axes_nor_the_start_of_time_and_scale():
    own = random_harmonics(8, highest=2, places=1)
    moved = turned(own, random_rotation(8)) * np.exp(1j * np.arange(len(own)) * 0.7)[:, None, None]
    # the search of planes ends at 1e-3 rad, which at a kink of the maximum is a share of 1e-3
    np.testing.assert_allclose(sg.critical_plane(3 * moved, ANY), 3 * sg.critical_plane(own, ANY), rtol=1e-3)


def test_crossland_and_sines_are_those_of_a_dense_history():
    own = random_harmonics(5, highest=3, places=6)
    stress = sg.history(own, 2000)
    pressure = stress[..., :3].mean(axis=-1)
    root = sg.von_mises(stress - own[0].real) / np.sqrt(3)
    kappa = 3 * 190 / 300 - np.sqrt(3)
    found = sg.crossland(own, ANY) * 190 * MPA - kappa * np.maximum(pressure.max(axis=0), 0)
    # what is left is a radius: at most the largest √J2, at least half of the largest distance of two samples
    assert np.all(found <= root.max(axis=0) * (1 + 1e-4))
    apart = max(sg.von_mises(stress - np.roll(stress, n, axis=0)).max(axis=0).tolist() for n in range(0, 2000, 40))
    assert np.all(found >= np.array(apart) / np.sqrt(3) / 2 * (1 - 1e-4))


@pytest.mark.parametrize("criterion", ALL)
def test_compression_has_no_credit_in_criteria_unless_asked_for(criterion):
    pressed = bending_and_torsion(100, 40, static=-400)
    # without any hydrostatic or normal stress that counts
    none = criterion(pressed, ANY)
    credited = criterion(pressed, ANY, credit_in_compression=True)
    assert credited < none
    still = bending_and_torsion(100, 40, static=-800)
    np.testing.assert_allclose(criterion(still, ANY), none, rtol=0.05 if criterion is sg.critical_plane else 1e-9)


@pytest.mark.parametrize("criterion", ALL)
def test_static_stress_above_yield_has_no_utilisation(criterion):
    card = sg.StrengthCard(
        fatigue_limit_pa=300 * MPA, fatigue_limit_r0_pa=230 * MPA, torsion_limit_pa=190 * MPA, yield_pa=500 * MPA
    )
    own = np.concatenate([bending_and_torsion(50, 50, static=s) for s in (499, 501)], axis=1)
    np.testing.assert_array_equal(np.isnan(criterion(own, card)), [False, True])


def test_criteria_take_the_limits_at_the_temperature_of_each_place():
    card = sg.StrengthCard(
        fatigue_limit_pa=(300 * MPA, 150 * MPA), torsion_limit_pa=(190 * MPA, 95 * MPA), temperatures=(20.0, 600.0)
    )
    own = np.repeat(bending_and_torsion(100, 60, 40), 3, axis=1)
    for criterion in WITH_TORSION:
        found = criterion(own, card.at(np.array([20.0, 600.0, 600.0])))
        np.testing.assert_allclose(found[1:], 2 * found[0], rtol=1e-6)


# signed von Mises --------------------------------------------------------------------------------------------------


def test_signed_von_mises_of_tension_that_reverses():
    amplitude, mean, turn = sg.signed_von_mises(bending_and_torsion(80, 0, static=-30))
    np.testing.assert_allclose([amplitude[0], mean[0], turn[0]], [80 * MPA, -30 * MPA, 0], rtol=1e-9)


def test_signed_von_mises_of_torsion_that_reverses_has_both_signs():
    amplitude, mean, turn = sg.signed_von_mises(bending_and_torsion(0, 50))
    np.testing.assert_allclose([amplitude[0], mean[0], turn[0]], [50 * np.sqrt(3) * MPA, 0, 0], rtol=1e-9, atol=1e-3)
    amplitude, mean, _ = sg.signed_von_mises(bending_and_torsion(80, 50))
    np.testing.assert_allclose([amplitude[0], mean[0]], [np.hypot(80, 50 * np.sqrt(3)) * MPA, 0], rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize(("shear", "known"), [(2.0, True), (8.0, True), (9.0, False)])
def test_signed_von_mises_is_given_where_axes_turn_less_than_ten_degrees(shear, known):
    own = harmonics([100 * MPA, 0, 0, 0, 0, 0], [0, 0, 0, shear * MPA, 0, 0])
    amplitude, mean, turn = sg.signed_von_mises(own)
    # axes swing by atan(2τ/σ)/2 to both sides
    assert turn == pytest.approx(np.degrees(np.arctan(2 * shear / 100)), rel=1e-9)
    assert np.isfinite(amplitude[0]) == np.isfinite(mean[0]) == known
    if known:
        np.testing.assert_allclose(mean + amplitude, np.sqrt(100**2 + 3 * shear**2) * MPA, rtol=1e-9)
        np.testing.assert_allclose(mean - amplitude, 100 * MPA, rtol=1e-9)


def test_signed_von_mises_is_not_given_where_phases_differ():
    own = np.concatenate([bending_and_torsion(100, 60, 0), bending_and_torsion(100, 60, 90)], axis=1)
    amplitude, _, turn = sg.signed_von_mises(own)
    np.testing.assert_allclose(amplitude, [np.sqrt(100**2 + 3 * 60**2) * MPA, np.nan], rtol=1e-9)
    np.testing.assert_allclose(turn, [0, 90], atol=1)


# refusals and doubts -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("criterion", "name"), [(sg.crossland, "Crossland"), (sg.critical_plane, "Findley"), (sg.dang_van, "Dang Van")])  # fmt: skip
def test_a_criterion_without_its_second_limit_is_refused_by_name(criterion, name):
    said = (
        f"StrengthCard.torsion_limit_pa: is missing, and {name} needs it or fatigue_limit_r0_pa. "
        "Give one of them, or use alternating_and_mean with a mean stress rule."
    )
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        criterion(bending_and_torsion(1, 1), sg.StrengthCard(fatigue_limit_pa=3e8))


def test_sines_needs_the_limit_from_zero():
    said = (
        "StrengthCard.fatigue_limit_r0_pa: is missing, and Sines needs it. "
        "Give the amplitude endured at R = 0, half of the range, or choose another rule."
    )
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        sg.sines(bending_and_torsion(1, 1), HARD)


@pytest.mark.parametrize(
    ("criterion", "name", "fields", "ratio", "low"),
    [
        (sg.crossland, "Crossland", {"torsion_limit_pa": 170 * MPA}, "torsion_limit_pa over fatigue_limit_pa = 0.5667", 0.5774),
        (sg.critical_plane, "Findley", {"torsion_limit_pa": 140 * MPA}, "torsion_limit_pa over fatigue_limit_pa = 0.4667", 0.5),
        (sg.dang_van, "Dang Van", {"torsion_limit_pa": 300 * MPA}, "torsion_limit_pa over fatigue_limit_pa = 1", 0.5),
        (sg.crossland, "Crossland", {"fatigue_limit_r0_pa": 140 * MPA}, "fatigue_limit_r0_pa over fatigue_limit_pa = 0.4667", 0.5),
    ],
)  # fmt: skip
def test_limits_that_do_not_fit_a_criterion_are_refused(criterion, name, fields, ratio, low):
    place, _, value = ratio.partition(" ")
    said = (
        f"StrengthCard.{place}: {value}, outside of {low:g} to 1: {name} would credit tension or have no limit. "
        "Check both limits, or use another criterion."
    ).replace(f"{place}: over", f"{place}: over")
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        criterion(bending_and_torsion(1, 1), sg.StrengthCard(fatigue_limit_pa=300 * MPA, **fields))


def test_limits_of_von_mises_are_taken_by_crossland():
    card = sg.StrengthCard(fatigue_limit_pa=300 * MPA, torsion_limit_pa=300 * MPA / np.sqrt(3))
    np.testing.assert_allclose(sg.crossland(bending_and_torsion(300, 0, static=100), card), 1)


@pytest.mark.parametrize(
    ("criterion", "fields", "said"),
    [
        ("crossland", {"torsion_limit_pa": 190 * MPA}, ""),
        ("crossland", {"torsion_limit_pa": 250 * MPA}, "torsion_limit_pa is 0.833 of fatigue_limit_pa, as of brittle materials: crossland is doubtful above 0.8"),
        ("crossland", {"torsion_limit_pa": 175 * MPA, "fatigue_limit_r0_pa": 230 * MPA}, "crossland gives 297 MPa for fatigue_limit_r0_pa, and the card has 230 MPa"),
        ("sines", {"torsion_limit_pa": 150 * MPA, "fatigue_limit_r0_pa": 230 * MPA}, "sines gives 173.2 MPa for torsion_limit_pa, and the card has 150 MPa"),
        ("findley", {"torsion_limit_pa": 190 * MPA, "fatigue_limit_r0_pa": 180 * MPA}, "findley gives 232.4 MPa for fatigue_limit_r0_pa, and the card has 180 MPa"),
        ("dang_van", {"fatigue_limit_r0_pa": 230 * MPA}, ""),
    ],
)  # fmt: skip
def test_doubts_of_criteria_are_said(criterion, fields, said):
    assert sg.criterion_doubt(criterion, sg.StrengthCard(fatigue_limit_pa=300 * MPA, **fields)) == said


def test_an_unknown_criterion_is_refused():
    with pytest.raises(
        InputError, match=r"^criterion: is 'mises'\. Give one of crossland, sines, findley, dang_van\.$"
    ):
        sg.criterion_doubt("mises", HARD)
