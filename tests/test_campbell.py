"""Campbell diagrams against closed forms: crossings, modes followed through crossings and veerings, Coriolis forces."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse

import stickslip as ss
from stickslip.response.rotating.campbell import cyclic_campbell

SPIN = np.array([[0.0, -1.0], [1.0, 0.0]])
TWO_PI = 2 * np.pi


def of_squares(*squares):
    """Single masses of one kilogram on springs."""
    return ss.model.lumped(np.ones(len(squares)), np.diag(squares))


def rotor(speed, omega=10.0):
    """A mass on isotropic springs at rest, seen from the rotating frame: frequencies |ω ± Ω|."""
    at_rest = of_squares(omega**2 - speed**2, omega**2 - speed**2)
    return at_rest.with_damping(2 * speed * SPIN)


def stiffened(speed):
    """Two modes that rise with speed and a constant one in their way: ω² = 1 + 2Ω², 4, 9 + Ω²/2."""
    return of_squares(1 + 2 * speed**2, 4.0, 9 + 0.5 * speed**2)


def test_modes_that_cross_keep_their_columns():
    speeds = np.linspace(0.0, 3.0, 4)
    found = ss.response.campbell(stiffened, speeds, 3).frequencies_hz * TWO_PI
    exact = np.sqrt(np.column_stack([1 + 2 * speeds**2, 4 + 0 * speeds, 9 + 0.5 * speeds**2]))
    np.testing.assert_allclose(found, exact, rtol=1e-12)


@pytest.mark.parametrize("steps", [3, 9, 40])
def test_modes_that_veer_do_not_change_places(steps):
    # seen from the ends of a step alone the shapes seem to cross: they turn within 0.03 of the speed
    def coupled(speed):
        return ss.model.lumped(np.ones(2), np.array([[1 + speed**2, 0.05], [0.05, 4.0]]))

    found = ss.response.campbell(coupled, np.linspace(0.0, 3.0, steps), 2)
    assert np.all(np.diff(found.frequencies_hz, axis=1) > 0)
    if steps > 3:
        assert np.min(found.agreement) > 0.7


def test_crossings_to_the_tolerance():
    # (mΩ)² = 1 + 2Ω² and = 4: closed forms
    found = ss.response.campbell(stiffened, np.linspace(0.0, 3.0, 4), 2, (1, 2, 3), tolerance=1e-9)
    exact = {(2, 0): np.sqrt(1 / 2), (3, 0): np.sqrt(1 / 7), (1, 1): 2.0, (2, 1): 1.0, (3, 1): 2 / 3}
    speeds = {(c.engine_order, c.mode): c.speed for c in found.crossings}
    assert speeds.keys() == exact.keys()  # order 1 never meets the first: 1 + 2Ω² > Ω²
    for which, speed in exact.items():
        assert speeds[which] == pytest.approx(speed, rel=1e-8), which
    for crossing in found.crossings:
        assert crossing.frequency_hz * TWO_PI == pytest.approx(crossing.engine_order * crossing.speed)
    assert [c.engine_order for c in found.crossings] == sorted(c.engine_order for c in found.crossings)


def test_a_crossing_on_a_speed_counts_once():
    # the constant mode, 2 rad/s, meets order 1 at the first, a middle and the last speed
    for speeds in ([2.0, 3.0], [1.0, 2.0, 3.0], [1.0, 2.0]):
        met = ss.response.campbell(lambda _: of_squares(4.0), speeds, 1, (1,)).crossings
        assert [c.speed for c in met] == [pytest.approx(2.0, rel=1e-6)]
    free = ss.response.campbell(lambda _: of_squares(0.0, 1.0), [0.0, 0.5], 2, (1,))
    assert not free.crossings  # a rigid mode meets every order at rest: that is no resonance


@pytest.mark.parametrize("order", [2, 30, 3000])
def test_tolerance_is_relative_to_the_crossing(order):
    """Which may lie far below the first speeds: 1 + Ω²/2 = m²Ω²."""
    met = ss.response.campbell(lambda w: of_squares(1 + w**2 / 2), [0.0, 100.0], 1, (order,), tolerance=1e-3)
    exact = 1 / np.sqrt(order**2 - 0.5)
    assert [c.speed for c in met.crossings] == [pytest.approx(exact, rel=1e-3)]


def test_a_looser_tolerance_costs_fewer_structures():
    def counted(tolerance):
        asked = []

        def at(speed):
            asked.append(speed)
            return stiffened(speed)

        ss.response.campbell(at, [0.0, 1.4], 1, (2,), tolerance=tolerance)
        return len(asked)

    assert counted(1e-2) < counted(1e-10)


def test_isotropic_rotor_in_the_rotating_frame():
    speeds = np.linspace(0.0, 8.0, 5)
    found = ss.response.campbell(rotor, speeds, 2, (1, 3), coriolis=True)
    together = np.sort(found.frequencies_hz * TWO_PI, axis=1)
    np.testing.assert_allclose(together, np.column_stack([10 - speeds, 10 + speeds]), atol=1e-12)
    # 10 ± Ω = mΩ
    crossed = sorted((c.engine_order, round(c.speed, 5)) for c in found.crossings)
    assert crossed == [(1, 5.0), (3, 2.5), (3, 5.0)]
    without = ss.response.campbell(rotor, speeds, 2)
    np.testing.assert_allclose(without.frequencies_hz[-1] * TWO_PI, 6.0)


def test_rotor_beyond_its_critical_speed_is_stable_by_coriolis_forces_alone():
    modes = ss.model.gyroscopic_modes(rotor(25.0), 2)
    np.testing.assert_allclose(modes.frequencies_hz * TWO_PI, [15.0, 35.0], rtol=1e-9)
    np.testing.assert_allclose(modes.growth, 0.0, atol=1e-6)
    assert np.all(ss.response.campbell(rotor, [25.0], 2).frequencies_hz < 0)  # diverges without them


@pytest.mark.parametrize("seed", range(4))
def test_what_diverges_grows(seed):
    """Each creeping motion has a rate that grows and one that decays: the second alone would look stable."""
    spin = np.random.default_rng(seed).standard_normal((3, 3))
    for coriolis in (np.zeros((3, 3)), 0.3 * (spin - spin.T)):
        structure = of_squares(-1.0, 2.0, -3.0).with_damping(coriolis)
        M, C, K = structure.mass, structure.damping, structure.stiffness
        state = np.block([[np.zeros((3, 3)), np.eye(3)], [-K, -np.linalg.solve(M, C)]])
        growing = np.sort(np.linalg.eigvals(state).real)[:3:-1]  # two of six
        found = ss.model.gyroscopic_modes(structure, 3)
        np.testing.assert_allclose(found.growth, [*growing, 0.0], atol=1e-12)
        assert found.frequencies_hz[2] > 0.1


def gyroscopic_chain(n, speed=1.0):
    """Sparse chain of n planar masses with Coriolis forces between their two directions."""
    K = scipy.sparse.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    K = scipy.sparse.kron(K, np.diag([1.0, 1.7])) * 1e4
    # as if the masses lay farther and farther from the axis of rotation: not the same for all, so that modes mix
    G = scipy.sparse.kron(scipy.sparse.diags_array(np.linspace(0.0, 1.0, n)), SPIN) * 2 * speed
    dofs = ss.model.Dofs(np.arange(2 * n), ("x", "y") * n, np.zeros((2 * n, 3)))
    parts = (scipy.sparse.csr_array(a) for a in (scipy.sparse.eye_array(2 * n), G, K))
    return ss.Structure(*parts, dofs)


def quadratic(structure):
    """All frequencies of the quadratic problem, from the general companion matrix."""
    M, C, K = (a.toarray() for a in (structure.mass, structure.damping, structure.stiffness))
    state = np.block([[np.zeros_like(K), np.eye(len(K))], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    rates = scipy.linalg.eigvals(state)
    return np.sort(rates.imag[rates.imag > 0]) / TWO_PI


def test_small_structures_are_solved_whole():
    structure = gyroscopic_chain(20, speed=3.0)
    modes = ss.model.gyroscopic_modes(structure, 40)
    np.testing.assert_allclose(modes.frequencies_hz, quadratic(structure), rtol=1e-9)
    omega = TWO_PI * modes.frequencies_hz
    K, G, M = (a.toarray() for a in (structure.stiffness, structure.damping, structure.mass))
    left = K @ modes.shapes + 1j * G @ modes.shapes * omega - M @ modes.shapes * omega**2
    assert np.max(np.abs(left)) < 1e-7 * np.max(np.abs(K))
    np.testing.assert_allclose(np.sum(np.abs(modes.shapes) ** 2, axis=0), 1.0)


def test_static_answers_make_a_modal_basis_converge():
    structure = gyroscopic_chain(201, speed=3.0)
    exact = quadratic(structure)[:6]
    enriched = ss.model.gyroscopic_modes(structure, 6, n_basis=12).frequencies_hz
    # the same twelve modes without the answers
    K, G, M = (a.toarray() for a in (structure.stiffness, structure.damping, structure.mass))
    _, basis = scipy.linalg.eigh(K, M, subset_by_index=(0, 11))
    small = [scipy.sparse.csr_array(basis.T @ a @ basis) for a in (M, G, K)]
    dofs = ss.model.Dofs(np.arange(12), ("mode",) * 12, np.zeros((12, 3)))
    modal = quadratic(ss.Structure(*small, dofs))[:6]
    shift = np.max(np.abs(exact - ss.model.natural_frequencies(structure, 6)))
    assert np.max(np.abs(enriched - exact)) < 1e-3 * shift
    assert np.max(np.abs(enriched - exact)) <= np.max(np.abs(modal - exact))


def test_large_structures_at_rest_have_no_answers_to_add():
    structure = gyroscopic_chain(201, speed=0.0)
    found = ss.model.gyroscopic_modes(structure, 5).frequencies_hz
    np.testing.assert_allclose(found, ss.model.natural_frequencies(structure, 5), rtol=1e-10)


def test_free_bodies_with_coriolis_forces_keep_real_frequencies():
    structure = gyroscopic_chain(201, speed=3.0)
    K = structure.stiffness.toarray()
    K[:2, :2] /= 2.0  # the first masses lose their grounding springs, the last ones too
    K[-2:, -2:] /= 2.0
    free = replace(structure, stiffness=scipy.sparse.csr_array(K))
    modes = ss.model.gyroscopic_modes(free, 8)
    np.testing.assert_array_equal(modes.growth, 0.0)
    np.testing.assert_allclose(modes.frequencies_hz[2:], quadratic(free)[-400:][:6], rtol=1e-6)


def turning_ring(speed, sectors=7, blades=1.0):
    """Planar masses on a circle, springs to ground and neighbours, Coriolis forces: radial and tangential motion."""
    own, tie = blades * np.diag([4.0, 2.5]) - speed**2 * np.eye(2), np.diag([0.6, 0.3])
    K = np.block([[own + tie, -tie], [-tie, tie]])
    C, M = np.zeros((4, 4)), np.zeros((4, 4))
    C[:2, :2], M[:2, :2] = 2 * speed * SPIN, np.eye(2)
    dofs = ss.model.Dofs(np.array([0, 0, 1, 1]), ("radial", "tangential") * 2, np.zeros((4, 3)))
    return ss.reduction.CyclicSector(
        ss.Structure(M, C, K, dofs), sectors, np.array([0, 1]), np.array([2, 3]), axis=None
    )


def test_waves_of_both_senses_are_the_whole_wheel():
    sector = turning_ring(0.8)
    table = ss.response.nodal_diameter_map(sector, 2, coriolis=True)
    assert np.all(table.forward_hz[0] == table.frequencies_hz[0])
    both = [table.frequencies_hz, table.forward_hz[1:]]
    whole = ss.model.gyroscopic_modes(ss.reduction.wheel(sector), 14).frequencies_hz
    np.testing.assert_allclose(np.sort(np.concatenate([b.ravel() for b in both])), whole, rtol=1e-10)


def test_engine_orders_meet_the_wave_they_excite():
    # orders 2 and 5 excite waves 2 and 5: backward and forward with two nodal diameters on seven sectors
    diagrams = cyclic_campbell(turning_ring, np.linspace(0.0, 1.2, 5), 2, (2, 5, 9), coriolis=True)
    assert [d.wave_number for d in diagrams] == [2, 5]
    assert [d.nodal_diameter for d in diagrams] == [2, 2]
    assert {c.engine_order for c in diagrams[0].crossings} == {2, 9}
    assert {c.engine_order for c in diagrams[1].crossings} == {5}
    merged = cyclic_campbell(turning_ring, np.linspace(0.0, 1.2, 5), 2, (2, 5, 9))
    assert [d.wave_number for d in merged] == [2]
    assert {c.engine_order for c in merged[0].crossings} == {2, 5, 9}


def test_waves_may_be_named_and_watched():
    seen = []
    diagrams = cyclic_campbell(
        turning_ring,
        [0.0, 0.5, 1.0],
        1,
        (2,),
        wave_numbers=(0, 6),
        coriolis=True,
        progress=lambda wave, speed: seen.append((wave, speed)),
    )
    assert [d.wave_number for d in diagrams] == [0, 6]
    assert not diagrams[0].crossings + diagrams[1].crossings  # order 2 excites neither
    assert seen == [(0, 0.5), (0, 1.0), (6, 0.5), (6, 1.0)]
    with pytest.raises(ss.InputError, match=r"wave_numbers: must be from 0 to 6, got 7"):
        cyclic_campbell(turning_ring, [0.0], 1, (), wave_numbers=(7,))


def test_hub_on_springs_whirls_at_one_frequency_for_who_stands_still():
    # a hub shared by all sectors: k = 1 and k = n_s - 1 are its backward and forward whirl
    def hub(speed, sectors=5):
        structure = rotor(speed)
        dofs = ss.model.Dofs(np.zeros(2, dtype=int), ("x", "y"), np.zeros((2, 3)))
        return ss.reduction.CyclicSector(replace(structure, dofs=dofs), sectors, np.arange(2), np.arange(2))

    # each sector has its share of the hub, here all of its mass and stiffness: frequencies do not change
    speeds = np.linspace(0.0, 8.0, 5)
    backward, forward = cyclic_campbell(hub, speeds, 1, (1, 4), coriolis=True)
    np.testing.assert_allclose(backward.frequencies_hz[:, 0] * TWO_PI, 10 + speeds, rtol=1e-9)
    np.testing.assert_allclose(forward.frequencies_hz[:, 0] * TWO_PI, 10 - speeds, rtol=1e-9)
    for diagram in (backward, forward):
        np.testing.assert_allclose(diagram.stationary_hz * TWO_PI, 10.0, rtol=1e-9)
    table = ss.response.nodal_diameter_map(hub(3.0), 1, [1], coriolis=True)
    assert table.frequencies_hz[0, 0] * TWO_PI == pytest.approx(13.0)
    assert table.forward_hz[0, 0] * TWO_PI == pytest.approx(7.0)
    np.testing.assert_allclose(np.array(table.stationary_hz(3.0)) * TWO_PI, 10.0, rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"speeds": [2.0, 1.0]}, "speeds"),
        ({"speeds": [-1.0, 1.0]}, "speeds"),
        ({"n_modes": 0}, "n_modes"),
        ({"n_modes": 4}, "n_modes"),
        ({"engine_orders": (0,)}, "engine_orders"),
        ({"engine_orders": (1.5,)}, "engine_orders"),
    ],
)
def test_wrong_input_is_named(change, place):
    arguments = {"speeds": [0.0, 1.0], "n_modes": 2, "engine_orders": (1,)} | change
    with pytest.raises(ss.InputError, match=place):
        ss.response.campbell(stiffened, **arguments)


def test_reduced_structures_are_compared_in_the_full_model():
    # each speed has its own reduction: coordinates differ, the blade does not
    def reduced(speed):
        K = 3.0 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1)
        full = ss.model.lumped(np.ones(8), K + np.diag(np.arange(8.0)) * 0.2 * speed**2)
        return ss.craig_bampton(full, np.array([0]), 7)

    def full(speed):
        K = 3.0 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1)
        return ss.model.lumped(np.ones(8), K + np.diag(np.arange(8.0)) * 0.2 * speed**2)

    speeds = np.linspace(0.0, 3.0, 4)
    one, other = (ss.response.campbell(f, speeds, 3) for f in (reduced, full))
    np.testing.assert_allclose(one.frequencies_hz, other.frequencies_hz, rtol=1e-10)
