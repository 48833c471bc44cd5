"""Strength cards, alternating and mean stress, and the Haigh diagram: closed forms, end points, refusals."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.errors import InputError, StickslipError
from stickslip.model import strength as sg

STEEL = sg.StrengthCard(
    fatigue_limit_pa=300e6,
    fatigue_limit_r0_pa=230e6,
    torsion_limit_pa=190e6,
    ultimate_pa=800e6,
    yield_pa=600e6,
    fracture_pa=1100e6,
    walker_exponent=0.6,
    sn_slope=5.0,
    sn_slope_beyond=9.0,
    knee_cycles=2e6,
    survival_probability=0.5,
)


def harmonics(static, *orders):
    """Return the harmonics (H+1, 1, 6) of one place."""
    return np.array([static, *orders], dtype=complex)[:, None, :]


def turned(stress, rotation):
    """Return stresses (..., 6) in axes turned by a (3, 3) rotation, by the definition of a tensor."""
    places = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
    tensor = rotation @ stress[..., places] @ rotation.T
    return np.stack([tensor[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], axis=-1)


def random_harmonics(seed, highest=3, places=4):
    rng = np.random.default_rng(seed)
    parts = rng.normal(size=(2, highest + 1, places, 6)) * 1e8
    given = parts[0] + 1j * parts[1]
    given[0].imag = 0
    return given


def random_rotation(seed):
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


# the cycle ---------------------------------------------------------------------------------------------------------


def test_history_is_the_sum_of_the_harmonics():
    found = sg.history(harmonics([1, 0, 0, 0, 0, 0], [2j, 0, 0, 3, 0, 0], [0, 0, 0, 0, 0, 4]), 16)
    t = 2 * np.pi * np.arange(16) / 16
    assert found.shape == (16, 1, 6)
    np.testing.assert_allclose(found[:, 0, 0], 1 - 2 * np.sin(t), atol=1e-14)
    np.testing.assert_allclose(found[:, 0, 3], 3 * np.cos(t), atol=1e-14)
    np.testing.assert_allclose(found[:, 0, 5], 4 * np.cos(2 * t), atol=1e-14)


def test_von_mises_of_tension_shear_and_pressure():
    found = sg.von_mises(np.array([[2, 0, 0, 0, 0, 0], [0, 0, 0, 0, 3, 0], [5, 5, 5, 0, 0, 0], [4, 0, 0, 0, 0, 3]]))
    np.testing.assert_allclose(found, [2, 3 * np.sqrt(3), 0, np.sqrt(16 + 27)], atol=1e-15)


def test_alternating_stress_of_tension_and_torsion_in_and_out_of_phase():
    tension, shear = 70e6, 60e6
    for phase, expected in ((1, np.hypot(tension, np.sqrt(3) * shear)), (1j, np.sqrt(3) * shear)):
        amplitude, mean = sg.alternating_and_mean(harmonics([0] * 6, [tension, 0, 0, shear * phase, 0, 0]))
        assert amplitude == pytest.approx(expected, rel=1e-13)
        assert mean == 0


def test_the_mean_has_the_sign_of_the_largest_principal_stress():
    cases = [
        [-80, 0, 0, 0, 0, 0],
        [50, -40, 0, 0, 0, 0],
        [40, -50, 0, 0, 0, 0],
        [0, 0, 0, 30, 0, 0],
        [0, 0, 0, -30, 0, 0],
    ]
    static = np.array([cases], dtype=complex) * 1e6
    mean = sg.alternating_and_mean(static)[1]
    np.testing.assert_array_equal(np.sign(mean), [-1, 1, -1, 1, 1])
    np.testing.assert_allclose(np.abs(mean), sg.von_mises(static[0].real))
    assert np.all(sg.alternating_and_mean(static)[0] == 0)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(0, 6.28), st.floats(0.01, 100))
def test_alternating_and_mean_know_neither_axes_nor_the_start_of_time_and_scale(seed, shift, scale):
    own = random_harmonics(seed)
    amplitude, mean = sg.alternating_and_mean(own)
    moved = turned(own, random_rotation(seed)) * np.exp(1j * np.arange(len(own)) * shift)[:, None, None]
    again, same = sg.alternating_and_mean(scale * moved)
    np.testing.assert_allclose(again, scale * amplitude, rtol=1e-10)
    np.testing.assert_allclose(same, scale * mean, rtol=1e-10)
    dense = sg.von_mises(sg.history(own, 4096) - own[0].real)  # of 4096 samples, short by (π/4096)² H² / 2 at most
    np.testing.assert_allclose(amplitude, dense.max(axis=0), rtol=1e-5)
    assert np.all(amplitude >= dense.max(axis=0) * (1 - 1e-12))


def test_a_place_that_did_not_converge_stays_nan_alone():
    own = random_harmonics(3)
    own[1, 2, 0] = np.nan
    amplitude, mean = sg.alternating_and_mean(own)
    np.testing.assert_array_equal(np.isnan(amplitude), [False, False, True, False])
    assert np.all(np.isfinite(mean))


def test_harmonics_of_another_shape_are_refused():
    said = "harmonics: must have the shape (H+1, k, 6), got (3, 6). Give harmonic, place, and xx, yy, zz, xy, yz, xz."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        sg.alternating_and_mean(np.zeros((3, 6)))


# the card ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        (
            {"fatigue_limit_pa": 500},
            "StrengthCard.fatigue_limit_pa: must lie in [1e+05, 1e+11], got 500. Give the amplitude endured at R = -1 in Pa (500 MPa are 500e6).",
        ),
        (
            {"fatigue_limit_pa": 3e8, "ultimate_pa": 8e14},
            "StrengthCard.ultimate_pa: must lie in [1e+05, 1e+11], got 8e+14. Give the tensile strength in Pa (500 MPa are 500e6).",
        ),
        (
            {"fatigue_limit_pa": 3e8, "threshold_pa_sqrt_m": 5.0},
            (
                "StrengthCard.threshold_pa_sqrt_m: must lie in [1e+05, 1e+09], got 5. "
                "Give the threshold of the range of the stress intensity factor in Pa √m (5 MPa √m are 5e6)."
            ),
        ),
        (
            {"fatigue_limit_pa": 3e8, "ultimate_pa": 7e8, "yield_pa": 8e8},
            "StrengthCard.yield_pa: must be at most ultimate_pa, got 8e+08 and 7e+08 Pa. Check which is which: yielding comes before rupture.",
        ),
        (
            {"fatigue_limit_pa": 8e8, "ultimate_pa": 7e8},
            (
                "StrengthCard.fatigue_limit_pa: must be below ultimate_pa, got 8e+08 and 7e+08 Pa. "
                "Give the amplitude at R = -1, no range and no static limit."
            ),
        ),
        (
            {"fatigue_limit_pa": 3e8, "fatigue_limit_r0_pa": 4.6e8},
            (
                "StrengthCard.fatigue_limit_r0_pa: must be below fatigue_limit_pa, got 4.6e+08 and 3e+08 Pa. "
                "Give the amplitude at R = 0, half of the maximum: a tensile mean lowers what is endured."
            ),
        ),
        (
            {"fatigue_limit_pa": 3e8, "ultimate_pa": 9e8, "fracture_pa": 8e8},
            "StrengthCard.ultimate_pa: must be at most fracture_pa, got 9e+08 and 8e+08 Pa. Give the true stress, force over the necked area.",
        ),
        (
            {"fatigue_limit_pa": 3e8, "survival_probability": 1.0},
            "StrengthCard.survival_probability: must lie in (0, 1), got 1. Give the survival probability of the limits.",
        ),
        (
            {"fatigue_limit_pa": "300 MPa"},
            "StrengthCard.fatigue_limit_pa: must lie in [1e+05, 1e+11], got '300 MPa'. Give the amplitude endured at R = -1 in Pa (500 MPa are 500e6).",
        ),
        (
            {"fatigue_limit_pa": (3e8, 2e8), "temperatures": (20.0,)},
            "StrengthCard.fatigue_limit_pa: has 2 values for 1 temperatures. Give one value for each temperature, or one number for all.",
        ),
        (
            {"fatigue_limit_pa": (3e8, 2e8), "temperatures": (20.0, 20.0)},
            "StrengthCard.temperatures: must rise, got [20.0, 20.0]. Give the lowest first.",
        ),
        (
            {"fatigue_limit_pa": 3e8, "yield_pa": (6e8, 5e8), "ultimate_pa": (7e8, 4e8), "temperatures": (20.0, 600.0)},
            (
                "StrengthCard.yield_pa: must be at most ultimate_pa at 600 degrees, got 5e+08 and 4e+08 Pa. "
                "Check which is which: yielding comes before rupture."
            ),
        ),
    ],
)
def test_a_card_in_another_unit_or_against_itself_is_refused(fields, said):
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        sg.StrengthCard(**fields)


def test_a_card_over_temperature_is_linear_between_its_rows_and_ends_at_the_highest():
    card = sg.StrengthCard(fatigue_limit_pa=(400e6, 200e6), ultimate_pa=900e6, temperatures=(20.0, 620.0))
    hot = card.at(np.array([-50.0, 20.0, 170.0, 620.0]))
    np.testing.assert_allclose(hot.fatigue_limit_pa, [400e6, 400e6, 350e6, 200e6])
    assert hot.ultimate_pa == 900e6
    assert hot.temperatures == ()
    assert STEEL.at(np.array([500.0])) is STEEL
    found = sg.allowable_amplitude("goodman", hot, np.array([0.0, 450e6, 450e6, 0.0]))
    np.testing.assert_allclose(found, [400e6, 200e6, 175e6, 200e6])
    said = (
        "StrengthCard.temperatures: end at 620, and the material has up to 700. Add rows up to the highest temperature."
    )
    with pytest.raises(InputError, match=re.escape(said)):
        card.at(np.array([100.0, 700.0]))
    said = "StrengthCard.temperatures: are 2, and Goodman's line needs the card at one for each place. Use card.at(temperature)."
    with pytest.raises(InputError, match=re.escape(said)):
        sg.allowable_amplitude("goodman", card, np.array([0.0]))


# the Haigh diagram -------------------------------------------------------------------------------------------------

ENDS = {"goodman": 800e6, "gerber": 800e6, "soderberg": 600e6, "morrow": 1100e6}


@pytest.mark.parametrize("rule", ENDS)
def test_rules_begin_at_the_fatigue_limit_and_end_at_their_strength(rule):
    end = ENDS[rule]
    found = sg.allowable_amplitude(rule, STEEL, np.array([0.0, end / 2, end, 1.5 * end]))
    np.testing.assert_allclose(found, 300e6 * np.array([1, 0.75 if rule == "gerber" else 0.5, 0, 0]), atol=1e-6)


def test_walker_keeps_its_equivalent_stress_and_is_smith_watson_topper_at_one_half():
    mean = np.array([0.0, 100e6, 400e6, 5e9])
    found = sg.allowable_amplitude("walker", STEEL, mean)
    np.testing.assert_allclose((found + mean) ** 0.4 * found**0.6, 300e6, rtol=1e-13)
    half = sg.StrengthCard(fatigue_limit_pa=300e6, walker_exponent=0.5)
    closed = -mean / 2 + np.hypot(mean / 2, 300e6)  # a (a + m) = f²
    np.testing.assert_allclose(sg.allowable_amplitude("walker", half, mean), closed, rtol=1e-12)


@pytest.mark.parametrize("rule", [*ENDS, "walker"])
def test_compression_has_no_credit_unless_it_is_asked_for(rule):
    assert sg.allowable_amplitude(rule, STEEL, np.array(-200e6)) == pytest.approx(300e6)
    if rule in {"gerber", "walker"}:
        said = f"credit_in_compression: is true, and the rule {rule} has no branch in compression. Leave it out, or choose goodman or a table."
        with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
            sg.allowable_amplitude(rule, STEEL, np.array(-200e6), credit_in_compression=True)
    else:
        found = sg.allowable_amplitude(rule, STEEL, np.array(-200e6), credit_in_compression=True)
        assert found == pytest.approx(300e6 * (1 + 200e6 / ENDS[rule]))


def test_a_table_is_linear_between_its_points_and_refused_beyond():
    table = sg.HaighTable(np.array([-100e6, 0.0, 300e6]), np.array([340e6, 300e6, 200e6]))
    mean = np.array([-500e6, -50e6, 150e6])
    np.testing.assert_allclose(
        sg.allowable_amplitude(table, STEEL, mean, credit_in_compression=True), [340e6, 320e6, 250e6]
    )
    np.testing.assert_allclose(sg.allowable_amplitude(table, STEEL, mean), [300e6, 300e6, 250e6])
    said = (
        "HaighTable.means: end at 3e+08, and 1 places have up to 3.1e+08. "
        "Go on with the table to the largest mean stress, or down to amplitude 0."
    )
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        sg.allowable_amplitude(table, STEEL, np.array([310e6, 0.0]))
    ended = sg.HaighTable(np.array([0.0, 300e6]), np.array([300e6, 0.0]))
    assert sg.allowable_amplitude(ended, STEEL, np.array(310e6)) == 0


@pytest.mark.parametrize(
    ("means", "amplitudes", "said"),
    [
        ([0.0], [1.0], "HaighTable: has means of shape (1,) and amplitudes of shape (1,). Give as many amplitudes as means, at least two."),
        ([0.0, 0.0], [1.0, 1.0], "HaighTable.means: must rise, got [0.0, 0.0]. Give the lowest first."),
        ([0.0, 1.0], [1.0, -1.0], "HaighTable.amplitudes: must not be negative, got [1.0, -1.0]. End the table where 0 is reached."),
    ],
)  # fmt: skip
def test_tables_that_are_none_are_refused(means, amplitudes, said):
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        sg.HaighTable(np.array(means), np.array(amplitudes))


@pytest.mark.parametrize(
    ("rule", "field", "said"),
    [
        ("goodman", "ultimate_pa", "missing, and Goodman's line needs it. Give the tensile strength, or choose another rule."),
        ("gerber", "ultimate_pa", "missing, and Gerber's parabola needs it. Give the tensile strength, or choose another rule."),
        ("soderberg", "yield_pa", "missing, and Soderberg's line needs it. Give the 0.2 % proof stress, or choose another rule."),
        ("morrow", "fracture_pa", "missing, and Morrow's line needs it. Give the true fracture strength, or choose another rule."),
        ("walker", "walker_exponent", "missing, and Walker's rule needs it. Give the Walker's exponent γ, or choose another rule."),
    ],
)  # fmt: skip
def test_a_rule_names_what_the_card_lacks(rule, field, said):
    with pytest.raises(InputError, match=f"^{re.escape(f'StrengthCard.{field}: is {said}')}$"):
        sg.allowable_amplitude(rule, sg.StrengthCard(fatigue_limit_pa=3e8), np.array(1e8))


def test_an_unknown_rule_is_refused_with_the_known_ones():
    with pytest.raises(
        InputError, match=r"^rule: is 'fkm'\. Give one of goodman, gerber, soderberg, morrow, walker\.$"
    ):
        sg.allowable_amplitude("fkm", STEEL, np.array(1e8))


def test_utilisation_and_factor_at_a_fixed_mean():
    found = sg.margin("goodman", STEEL, np.array([75e6, 150e6, 0.0, 50e6]), np.array([400e6, 400e6, 400e6, -300e6]))
    np.testing.assert_allclose(found.utilisation, [0.5, 1, 0, 1 / 6])
    np.testing.assert_allclose(found.factor, [2, 1, np.inf, 6])
    np.testing.assert_allclose(found.allowed, [150e6, 150e6, 150e6, 300e6])
    assert not found.void.any()
    assert found.doubt == ""


def test_static_stress_above_yield_voids_the_place():
    amplitude, mean = np.array([50e6, 50e6, 50e6, np.nan]), np.array([610e6, -610e6, 590e6, 0.0])
    found = sg.margin("goodman", STEEL, amplitude, mean)
    np.testing.assert_array_equal(found.void, [True, True, False, False])
    for values in (found.utilisation, found.factor):
        np.testing.assert_array_equal(np.isnan(values), [True, True, False, True])


def test_shakedown_leaves_yield_minus_amplitude_as_mean():
    found = sg.margin(
        "goodman", STEEL, np.array([50e6, 50e6, 700e6]), np.array([900e6, -900e6, 0.0]), above_yield="shakedown"
    )
    np.testing.assert_allclose(found.mean, [550e6, -550e6, np.nan])
    np.testing.assert_allclose(found.utilisation, [50 / (300 * (1 - 550 / 800)), 50 / 300, np.nan])
    np.testing.assert_array_equal(found.void, [False, False, True])


def test_neuber_keeps_the_product_of_stress_and_strain():
    hardening = sg.Hardening(young_modulus=2.1e11, exponent=0.15)
    found = sg.margin(
        "goodman", STEEL, np.full(3, 20e6), np.array([900e6, 500e6, -900e6]), above_yield="neuber", hardening=hardening
    )
    local = found.mean[0]
    strain = local / 2.1e11 + 0.002 * (local / 600e6) ** (1 / 0.15)
    assert local * strain == pytest.approx(900e6**2 / 2.1e11, rel=1e-12)
    np.testing.assert_allclose(found.mean[1:], [500e6, -local])
    said = "hardening: is missing with above_yield = 'neuber'. Give hardening=Hardening(young_modulus=…, exponent=…) with 'neuber', and with nothing else."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        sg.margin("goodman", STEEL, np.zeros(1), np.zeros(1), above_yield="neuber")
    with pytest.raises(InputError, match="hardening: is given with above_yield = 'void'"):
        sg.margin("goodman", STEEL, np.zeros(1), np.zeros(1), hardening=hardening)


def test_hardening_in_another_unit_is_refused():
    with pytest.raises(
        InputError, match=r"^Hardening\.young_modulus: must be at least 1e8 Pa, got 210000\. Steel: 2\.1e11\.$"
    ):
        sg.Hardening(young_modulus=2.1e5, exponent=0.1)
    with pytest.raises(
        InputError, match=r"^Hardening\.exponent: must lie in \(0, 1\), got 5\. Steels: 0\.1 to 0\.2\.$"
    ):
        sg.Hardening(young_modulus=2.1e11, exponent=5)


def test_without_yield_stress_the_margin_says_what_it_does_not_know():
    card = sg.StrengthCard(fatigue_limit_pa=3e8, ultimate_pa=8e8)
    found = sg.margin("goodman", card, np.array([1e8]), np.array([7e8]))
    assert found.doubt == "the card has no yield_pa: whether the static stress is above yield is not known"
    with pytest.raises(
        InputError, match=r"^StrengthCard\.yield_pa: is missing, and above_yield = 'shakedown' needs it"
    ):
        sg.margin("goodman", card, np.array([1e8]), np.array([7e8]), above_yield="shakedown")


def test_cycles_follow_the_two_slopes_through_the_knee():
    found = sg.cycles(np.array([600e6, 300e6, 150e6, 0.0]), STEEL)
    np.testing.assert_allclose(found, [2e6 / 2**5, 2e6, 2e6 * 2**9, np.inf])
    endless = sg.StrengthCard(fatigue_limit_pa=300e6, sn_slope=5.0, knee_cycles=2e6)
    np.testing.assert_allclose(sg.cycles(np.array([600e6, 300e6, 299e6]), endless), [2e6 / 2**5, 2e6, np.inf])
    with pytest.raises(InputError, match=r"^StrengthCard\.sn_slope: is missing, and an S-N line needs it"):
        sg.cycles(np.array([1e8]), sg.StrengthCard(fatigue_limit_pa=300e6))


def test_diagrams_of_the_guideline_need_pylife_and_are_its_slopes():
    try:
        import pylife  # noqa: F401
    except ImportError:
        said = "pylife is not installed. Use pip install 'stickslip[life]'"
        with pytest.raises(StickslipError, match=f"^{re.escape(said)}$"):
            sg.fkm_goodman_table(0.3, 0.1)
        return
    table = sg.fkm_goodman_table(0.3, 0.1)
    mean = np.array([-1e9, -100e6, 0.0, 100e6])
    found = sg.allowable_amplitude(table, STEEL, mean, credit_in_compression=True)
    np.testing.assert_allclose(found, [300e6 / 0.7, 330e6, 300e6, 270e6], rtol=1e-6)
    knee = 300e6 / 1.3  # at R = 0 mean and amplitude are one
    beyond = sg.allowable_amplitude(table, STEEL, np.array([knee, knee + 100e6]))
    np.testing.assert_allclose(beyond, [knee, knee - 0.1 * 100e6], rtol=1e-6)
    five = sg.five_segment_table((0.3, 0.1, 0.1, 0.1, 0.0), (0.2, 0.8))
    np.testing.assert_allclose(sg.allowable_amplitude(five, STEEL, mean), sg.allowable_amplitude(table, STEEL, mean))
    with pytest.raises(
        InputError, match=r"^knees: must rise between 0 and 1, got \[0\.8, 0\.2\]\. Give R12, then R23\.$"
    ):
        sg.five_segment_table((0.3, 0.1, 0.1, 0.1, 0.0), (0.8, 0.2))
