"""Nodal-diameter map, lumped disks and SAFE diagram against the literature and closed forms."""

import numpy as np
import pytest

import stickslip as ss
from evidence.models.lumped_disks import blade_ring, blisk_with_ring, mistuned_blade_ring
from evidence.validation import case_b9_friction_ring

# benchmark B9: Laxalde et al. 2007, frequencies in Hz by nodal diameter, without the ring
LAXALDE = {
    0: (88.263744, 249.311652, 619.343305),
    1: (169.344130, 335.565379, 619.820217),
    2: (189.301853, 555.310179, 626.202586),
    3: (193.049623, 615.150178, 810.006797),
    4: (194.333101, 616.585022, 1044.518774),
    6: (195.230656, 617.126968, 1464.728714),
    12: (195.676051, 617.325797, 2062.975678),
}
# benchmark B12: ring of twelve blades
DEVIATIONS = (0.012, -0.018, 0.005, 0.021, -0.009, -0.014, 0.017, 0.002, -0.023, 0.008, 0.011, -0.012)
MISTUNED = (
    0.99780035,
    0.99981406,
    1.00071541,
    1.00627219,
    1.01313001,
    1.01915664,
    1.02112393,
    1.02631985,
    1.03313452,
    1.03827659,
    1.03918227,
    1.04131025,
)


@pytest.fixture(scope="module")
def blisk():
    return ss.response.nodal_diameter_map(blisk_with_ring(ring=None), 3)


def test_blisk_by_nodal_diameter(blisk):
    assert blisk.nodal_diameters.tolist() == list(range(13))
    for diameter, hertz in LAXALDE.items():
        # six printed decimals
        np.testing.assert_allclose(blisk.frequencies_hz[diameter], hertz, atol=6e-7)
        np.testing.assert_array_equal(blisk.of_wave(24 - diameter), blisk.of_wave(diameter))


def test_blisk_with_its_ring_free_and_stuck():
    sector = blisk_with_ring()
    free = ss.response.nodal_diameter_map(sector, 4, [2]).frequencies_hz[0]
    np.testing.assert_allclose(free, (189.30185, 466.03802, 555.31018, 626.20259), atol=6e-6)
    wave = ss.reduction.travelling_wave(sector, 2)
    spring = np.zeros((1, 4))
    spring[0, [wave.sets["disk"][0], wave.sets["ring"][0]]] = 1.0, -1.0
    stiff = wave.stiffness + 2e7 * spring.T @ spring
    hertz = np.sqrt(np.linalg.eigvals(np.linalg.solve(wave.mass, stiff)).real) / (2 * np.pi)
    np.testing.assert_allclose(np.sort(hertz), (190.06223, 542.00193, 623.38065, 1638.17819), atol=6e-6)


def test_whole_blisk_has_the_frequencies_of_its_waves(blisk):
    whole = ss.model.natural_frequencies(ss.reduction.wheel(blisk_with_ring(ring=None)), 72)
    twice = [blisk.frequencies_hz, blisk.frequencies_hz[1:12]]
    np.testing.assert_allclose(np.sort(np.concatenate([t.ravel() for t in twice])), whole, rtol=1e-9)


def test_friction_ring_on_the_whole_wheel_is_the_published_sector():
    # temporal harmonic 3 must have found wave number 6 by itself: with wave number 2 for all the amplitude is 3 % less
    wheel = case_b9_friction_ring.damped_wheel()
    tips = case_b9_friction_ring.tips(wheel, 4.0, 624.0, 3)
    np.testing.assert_allclose(tips, 1.65892122e-5, rtol=1e-6)


def test_ring_of_blades_tuned_and_mistuned():
    tuned = ss.response.nodal_diameter_map(blade_ring(12), 1).frequencies_hz[:, 0] * 2 * np.pi
    k = np.arange(7)
    np.testing.assert_allclose(tuned, np.sqrt(1 + 0.04 * (1 - np.cos(2 * np.pi * k / 12))), rtol=1e-12)
    ring = mistuned_blade_ring(DEVIATIONS, damping=0.004)
    np.testing.assert_allclose(ss.model.natural_frequencies(ring, 12) * 2 * np.pi, MISTUNED, atol=6e-9)


def amplitude(ring, omega):
    """Largest amplitude under engine order 3, and its blade."""
    force = np.exp(2j * np.pi * 3 * np.arange(12) / 12)
    Z = ring.stiffness + 1j * omega * ring.damping - omega**2 * ring.mass
    response = np.abs(np.linalg.solve(Z, force))
    return response.max(), int(response.argmax())


def test_peaks_of_the_ring_under_an_engine_order():
    tuned, _ = amplitude(mistuned_blade_ring(np.zeros(12), damping=0.004), 1.01979998)
    assert tuned == pytest.approx(245.14564, abs=1e-5)
    peak, blade = amplitude(mistuned_blade_ring(DEVIATIONS, damping=0.004), 1.02076476)
    assert blade == 2
    assert peak == pytest.approx(326.0181278, abs=2e-7)
    assert peak / tuned == pytest.approx(1.32989568, abs=1e-8)
    # no mistuning of the stiffness may beat (Whitehead)
    assert peak / tuned < (1 + np.sqrt(12)) / 2


def test_engine_orders_fold_at_half_the_sectors(blisk):
    # 26 = 24 + 2 and 22 = 24 - 2 excite two nodal diameters, 36 twelve, 24 none
    found = ss.response.safe(blisk, 300.0, (2, 22, 24, 26, 36))
    assert {p.engine_order: p.nodal_diameter for p in found.points} == {2: 2, 22: 2, 24: 0, 26: 2, 36: 12}
    assert {p.engine_order: p.wave_number for p in found.points} == {2: 2, 22: 22, 24: 0, 26: 2, 36: 12}
    for point in found.points:
        hertz = blisk.frequencies_hz[point.nodal_diameter, point.mode]
        assert point.frequency_hz == hertz
        assert point.engine_order * point.speed / (2 * np.pi) == pytest.approx(hertz)
    assert len(found.points) == 15


def test_margins_of_a_speed_range(blisk):
    critical = 2 * np.pi * blisk.frequencies_hz[2, 0] / 2
    low, high = 1.04 * critical, 1.2 * critical
    found = ss.response.safe(blisk, (low, high), (2,), margin=0.05)
    first = found.resonances[0]
    assert (first.mode, first.nodal_diameter) == (0, 2)
    assert first.margin == pytest.approx(1 / 1.04 - 1)
    assert len(found.resonances) == 1
    assert not ss.response.safe(blisk, (low, high), (2,), margin=0.03).resonances
    inside = ss.response.safe(blisk, (0.9 * critical, high), (2,), margin=0.0).resonances
    assert [r.margin for r in inside] == [0.0]
    above = ss.response.safe(blisk, (0.5 * critical, critical / 1.1), (2,)).points
    assert above[0].margin == pytest.approx(0.1)


def test_line_of_a_speed_turns_at_half_the_sectors():
    table = ss.response.nodal_diameter_map(blade_ring(5), 1)
    diameters, hertz = ss.response.safe(table, 2 * np.pi, (1, 7)).speed_line(2 * np.pi)
    # turns at 2.5, between two whole numbers, and at 0
    assert dict(zip(hertz, diameters, strict=True)) == {0: 0, 1: 1, 2: 2, 2.5: 2.5, 3: 2, 4: 1, 5: 0, 6: 1, 7: 2}


def test_points_of_the_diagram_lie_on_its_lines(blisk):
    found = ss.response.safe(blisk, 300.0, range(1, 40))
    for point in found.points[:20]:
        diameters, hertz = found.speed_line(point.speed)
        at = np.flatnonzero(np.isclose(hertz, point.frequency_hz))
        assert diameters[at[0]] == point.nodal_diameter


def test_wrong_input_is_named(blisk):
    with pytest.raises(ss.InputError, match="speed"):
        ss.response.safe(blisk, (3.0, 2.0), (1,))
    with pytest.raises(ss.InputError, match="engine_orders"):
        ss.response.safe(blisk, 3.0, ())
    with pytest.raises(ss.InputError, match="margin"):
        ss.response.safe(blisk, 3.0, (1,), margin=-0.1)
    with pytest.raises(ss.InputError, match="ascend"):
        ss.response.nodal_diameter_map(blade_ring(5), 1, [3])
    some = ss.response.nodal_diameter_map(blade_ring(12), 1, [0, 2])
    with pytest.raises(ss.InputError, match="nodal diameter 3 was not computed"):
        ss.response.safe(some, 3.0, (3,))


def test_orders_above_the_highest_mode_are_not_judged():
    # six blades of one mode: what the second would be, the map cannot know
    table = ss.response.nodal_diameter_map(blade_ring(6), 1)
    highest = {k: table.of_wave(k)[0] for k in range(6)}
    speed = 2 * np.pi * highest[2] / 2.5  # order 2 lies a fifth below its mode, order 4 far above it
    assert ss.response.safe(table, speed, (2, 4), margin=0.1).not_judged == (4,)
    assert ss.response.safe(table, speed, (2, 4), margin=0.3).not_judged == (2, 4)
    assert ss.response.safe(table, speed / 4, (2, 4), margin=0.1).not_judged == ()


def test_resonances_follow_frequencies_that_grow_with_the_speed():
    # blades that stiffen by Southwell's law f^2 = f0^2 + B (Omega / 2 pi)^2, which one tangent describes at all speeds
    rest, growth, speed = 1.7, np.array([2.5]), 3.0
    hertz = np.full((4, 1), np.hypot(rest, np.sqrt(growth[0]) * speed / (2 * np.pi)))
    table = ss.response.NodalDiameterMap(6, np.arange(4), hertz, hertz)
    found = ss.response.safe(table, speed, (1, 2, 3), growth=lambda _: growth)
    by_order = {p.engine_order: p for p in found.points}
    for order in (2, 3):
        expected = 2 * np.pi * rest / np.sqrt(order**2 - growth[0])
        assert by_order[order].speed == pytest.approx(expected, rel=1e-12)
        assert by_order[order].margin == pytest.approx(expected / speed - 1, rel=1e-12)
    # the first order stays below the mode at every speed
    assert by_order[1].speed == np.inf
    assert found.points[-1].engine_order == 1
    with pytest.raises(ss.InputError, match="belongs to one speed"):
        ss.response.safe(table, (2.0, 3.0), (1,), growth=lambda _: growth)
