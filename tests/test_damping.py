"""Damping by mode, structural damping and Coriolis terms: what they do to a response, and that reductions keep them."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from compliance_form import ComplianceForm
from hypothesis import given, settings
from hypothesis import strategies as st

import stickslip as ss
from evidence.models.lumped_disks import blisk_with_ring


def random_structure(seed, n=8):
    rng = np.random.default_rng(seed)
    a, b = rng.standard_normal((2, n, n))
    return ss.model.lumped(a @ a.T / n + np.eye(n), 50 * (b @ b.T / n + np.eye(n)))


def ratios_of(structure):
    """Damping ratios from the eigenvalues of the state matrix, by frequency."""
    M, C, K = structure.mass, structure.damping, structure.stiffness
    n = len(M)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    rates = np.linalg.eigvals(state)
    rates = rates[rates.imag > 0]
    rates = rates[np.argsort(np.abs(rates))]
    return -rates.real / np.abs(rates)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.lists(st.floats(0.0, 0.3), min_size=1, max_size=8))
def test_modes_have_the_ratios_asked_for(seed, ratios):
    damped = ss.model.modal_damping(random_structure(seed), ratios)
    expected = np.pad(ratios, (0, 8 - len(ratios)))
    np.testing.assert_allclose(ratios_of(damped), expected, atol=1e-9)


def test_one_number_damps_all_modes_and_rigid_ones_not():
    K = np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]]) - np.diag([1.0, 0, 1.0])
    free = ss.model.lumped(np.ones(3), K)
    damped = ss.model.modal_damping(free, 0.01)
    np.testing.assert_allclose(damped.damping @ np.ones(3), 0.0, atol=1e-12)
    np.testing.assert_allclose(damped.damping, damped.damping.T)
    values, shapes = scipy.linalg.eigh(damped.stiffness, damped.mass)
    modal = shapes.T @ damped.damping @ shapes
    np.testing.assert_allclose(modal, np.diag(0.02 * np.sqrt(np.maximum(values, 0))), atol=1e-9)


def test_modes_of_a_wave_are_damped_alike():
    wave = ss.model.modal_damping(ss.reduction.travelling_wave(blisk_with_ring(ring=None), 5), 1e-3)
    values, shapes = scipy.linalg.eigh(wave.stiffness, wave.mass)
    modal = shapes.conj().T @ wave.damping @ shapes
    np.testing.assert_allclose(modal, np.diag(2e-3 * np.sqrt(values)), atol=1e-9)


def test_friction_ring_free_and_stuck_has_the_published_peaks():
    # benchmark B9, engine order 2 on the tips: ring free (slip limit 0) and stuck (limit 20 and above); the blisk's modes are damped
    # with their ring away
    alone = ss.model.modal_damping(ss.reduction.travelling_wave(blisk_with_ring(ring=None), 2), 1e-3)
    both = ss.reduction.travelling_wave(blisk_with_ring(), 2)
    C = np.zeros((4, 4), dtype=complex)
    C[:3, :3] = alone.damping
    stuck = np.array(both.stiffness)
    stuck[np.ix_([0, 3], [0, 3])] += 2e7 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    force = np.array([0.0, 0.0, 1.0, 0.0])
    for K, hertz, peak in ((both.stiffness, 626.2052, 5.0632e-5), (stuck, 623.38244, 5.589923e-5)):
        amplitudes = [
            abs(np.linalg.solve(K + 1j * w * C - w**2 * both.mass, force)[2])
            for w in 2 * np.pi * (hertz + np.array([-0.01, 0.0, 0.01]))
        ]
        # five printed digits
        assert amplitudes[1] == pytest.approx(peak, rel=1e-5)
        assert amplitudes[1] > max(amplitudes[0], amplitudes[2])


def test_coriolis_terms_outlive_a_new_damping():
    skew = np.array([[0.0, -1.0], [1.0, 0.0]])
    turning = ss.model.lumped(np.ones(2), np.diag([4.0, 9.0])).with_damping(3.0 * skew)
    for damped in (ss.model.rayleigh_damping(turning, 0.01, (0.1, 1.0)), ss.model.modal_damping(turning, 0.01)):
        np.testing.assert_allclose((damped.damping - damped.damping.T) / 2, 3.0 * skew)
        assert np.all(np.diagonal(damped.damping) > 0)
    again = ss.model.modal_damping(ss.model.modal_damping(turning, 0.5), 0.01)
    np.testing.assert_allclose(again.damping, ss.model.modal_damping(turning, 0.01).damping)


def test_sparse_structures_stay_sparse():
    structure = random_structure(0)
    sparse = replace(
        structure, **{n: scipy.sparse.csr_array(getattr(structure, n)) for n in ("mass", "damping", "stiffness")}
    )
    for damp in (lambda s: ss.model.modal_damping(s, 0.02), lambda s: ss.model.rayleigh_damping(s, 0.02, (0.5, 2.0))):
        found = damp(sparse).damping
        assert scipy.sparse.issparse(found)
        np.testing.assert_allclose(found.toarray(), damp(structure).damping, atol=1e-9)
    assert scipy.sparse.issparse(ss.model.structural_damping(sparse, 0.1).loss)


@pytest.mark.parametrize(
    ("damp", "place"),
    [
        (lambda s: ss.model.modal_damping(s, [-0.1]), "ratios"),
        (lambda s: ss.model.modal_damping(s, np.zeros(9)), "ratios"),
        (lambda s: ss.model.modal_damping(s, []), "ratios"),
        (lambda s: ss.model.modal_damping(replace(s, stiffness=-s.stiffness), 0.1), "diverge"),
        (lambda s: ss.model.structural_damping(s, -0.1), "loss_factor"),
        (lambda s: ss.model.structural_damping(s, 0.1, elastic=np.eye(2)), "elastic"),
    ],
)
def test_wrong_input_is_named(damp, place):
    with pytest.raises(ss.InputError, match=place):
        damp(random_structure(0))


# ---- structural damping -------------------------------------------------------------------------------------------------


def test_loss_bounds_a_resonance_whatever_its_frequency():
    # hysteretic damping: at resonance amplitude = force / (η k), for light and heavy masses alike
    for mass in (1.0, 1e-4, 1e4):
        one = ss.model.structural_damping(ss.model.lumped([mass], [[5.0]]), 0.02)
        load = ss.HarmonicLoad(np.array([3.0]), {1: np.array([1.0 + 0j])})
        got = ss.harmonic.condense(one, np.array([0]), load).condensed(np.sqrt(5.0 / mass), 1)
        motion = got.load / got.stiffness[:, :, 0]
        assert abs(motion[1, 0]) == pytest.approx(1 / (0.02 * 5.0))
        assert motion[0, 0] == pytest.approx(3.0 / 5.0)  # statics feel none of it


def test_elastic_stiffness_alone_dissipates():
    at_rest = random_structure(1)
    at_speed = replace(at_rest, stiffness=at_rest.stiffness + 7 * np.eye(8))
    damped = ss.model.structural_damping(at_speed, 0.01, elastic=at_rest.stiffness)
    np.testing.assert_allclose(damped.loss, 0.01 * at_rest.stiffness)


def test_joined_parts_keep_their_losses():
    lossy, other = ss.model.structural_damping(random_structure(0, 2), 0.1), random_structure(1, 3)
    both = ss.model.join(a=lossy, b=other)
    np.testing.assert_allclose(both.loss, scipy.linalg.block_diag(lossy.loss, np.zeros((3, 3))))
    assert ss.model.join(a=other).loss is None
    sparse = replace(other, mass=scipy.sparse.csr_array(other.mass), stiffness=scipy.sparse.csr_array(other.stiffness))
    np.testing.assert_allclose(np.asarray(ss.model.join(a=lossy, b=sparse).loss), both.loss)


def full_response(structure, force, omega):
    D = structure.stiffness + 1j * omega * structure.damping - omega**2 * structure.mass
    return np.linalg.solve(D if structure.loss is None else D + 1j * structure.loss, force)


def turning_and_lossy(seed=2, n=8):
    structure = random_structure(seed, n)
    skew = np.random.default_rng(seed).standard_normal((n, n))
    damping = 0.01 * structure.stiffness + 0.8 * (skew - skew.T)
    return replace(structure, damping=damping, loss=0.05 * structure.stiffness)


REDUCTIONS = {
    "craig_bampton": lambda s: ss.craig_bampton(s, np.array([0, 3]), s.n - 2),
    "rubin": lambda s: ss.reduction.rubin(s, np.array([0, 3]), s.n - 2),
    "relative": lambda s: ss.reduction.in_relative_coordinates(s, np.eye(3, s.n) - np.eye(3, s.n, k=3))[0],
}


@pytest.mark.parametrize("reduce", REDUCTIONS.values(), ids=REDUCTIONS)
def test_reductions_without_loss_of_modes_keep_every_kind_of_damping(reduce):
    structure = turning_and_lossy()
    reduced = reduce(structure)
    force = np.random.default_rng(0).standard_normal(8)
    exact = full_response(structure, force, 6.0)
    found = reduced.expand(full_response(reduced, reduced.expand(np.eye(reduced.n)).T @ force, 6.0))
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10 * np.abs(exact).max())


def test_loss_of_waves_is_the_loss_of_the_wheel():
    sector = blisk_with_ring(6)
    sector = replace(sector, structure=ss.model.structural_damping(sector.structure, 0.02))
    wheel = ss.reduction.wheel(sector)
    np.testing.assert_allclose(wheel.loss.toarray(), 0.02 * wheel.stiffness.toarray(), atol=1e-6)
    wave = ss.reduction.travelling_wave(sector, 2)
    np.testing.assert_allclose(wave.loss, 0.02 * wave.stiffness, atol=1e-6)


def test_files_keep_the_loss(tmp_path):
    for structure in (turning_and_lossy(), random_structure(0)):
        ss.model.save_structure(structure, tmp_path / "s.npz")
        found = ss.model.load_structure(tmp_path / "s.npz")
        assert (found.loss is None) == (structure.loss is None)
        if structure.loss is not None:
            assert np.array_equal(found.loss, structure.loss)


# ---- contacts on rotating and lossy structures --------------------------------------------------------------------------


def with_contact(structure):
    rows = np.zeros((3, structure.n))
    rows[0, 1], rows[2, 2] = 1.0, 1.0
    law = ss.ElasticCoulomb(k_t=40.0, k_w=40.0, k_n=60.0, mu=0.4, preload=0.6)
    return ss.System(structure, ss.Interface(("c",), (law,), rows), outputs=np.array([0]))


def balance_of(structure, jacobian="dense", order=3):
    system = with_contact(structure)
    force = np.zeros(structure.n, dtype=complex)
    force[0] = 3.0 + 1.0j
    load = ss.HarmonicLoad(np.zeros(structure.n), {1: force})
    linear = ss.harmonic.condense(structure, system.retained, load)
    return replace(ss.harmonic.harmonic_balance(linear, system.interface, order=order, samples=64), jacobian=jacobian)


def test_jacobian_and_frequency_derivative_of_the_periodic_problem():
    balance = balance_of(turning_and_lossy())
    x = 0.02 * np.random.default_rng(1).standard_normal(balance.size)
    at = balance.linearise(x, 5.0)
    step = 1e-6
    columns = [
        (balance.linearise(x + step * e, 5.0).residual - balance.linearise(x - step * e, 5.0).residual) / (2 * step)
        for e in np.eye(balance.size)
    ]
    np.testing.assert_allclose(at.dense_jac(), np.array(columns).T, atol=1e-6 * np.abs(at.dense_jac()).max())
    difference = (balance.linearise(x, 5.0 + step).residual - balance.linearise(x, 5.0 - step).residual) / (2 * step)
    np.testing.assert_allclose(at.jac_p, difference, atol=1e-6 * np.abs(difference).max())
    structured = replace(balance, jacobian="structured").linearise(x, 5.0)
    np.testing.assert_allclose(structured.jac.dense(), at.dense_jac(), atol=1e-12 * np.abs(at.dense_jac()).max())
    v = np.random.default_rng(2).standard_normal(balance.size)
    np.testing.assert_allclose(structured.jac.matvec(v), at.dense_jac() @ v, atol=1e-10)
    np.testing.assert_allclose(structured.jac.rmatvec(v), at.dense_jac().T @ v, atol=1e-10)


def test_forms_of_the_problem_agree_on_a_turning_structure():
    # forces, displacements, Krylov: one solution
    found = {}
    for name in ("dense", "structured"):
        balance = balance_of(turning_and_lossy(), name)
        result = ss.solve.newton(lambda x, b=balance: b.linearise(x, 5.0), np.zeros(balance.size), ss.solve.Newton())
        assert result.status == ss.solve.Status.CONVERGED
        found[name] = result.x
    form = ComplianceForm(balance_of(turning_and_lossy()))
    result = ss.solve.newton(lambda x: form.linearise(x, 5.0), np.zeros(form.size), ss.solve.Newton())
    found["compliance"] = result.x
    for name, x in found.items():
        np.testing.assert_allclose(x, found["dense"], atol=1e-7 * np.abs(found["dense"]).max(), err_msg=name)


def test_time_integration_is_right_with_coriolis_terms_and_refuses_loss():
    structure = replace(turning_and_lossy(), loss=None)
    system = with_contact(structure)
    force = np.zeros(structure.n, dtype=complex)
    force[0] = 3.0 + 1.0j
    load = ss.HarmonicLoad(np.zeros(structure.n), {1: force})
    laws = system.interface
    balance = balance_of(structure, order=15)
    solution = ss.solve.newton(lambda x: balance.linearise(x, 5.0), np.zeros(balance.size), ss.solve.Newton())
    coefficients = balance.linear.recover(5.0, balance.coefficients(solution.x))
    timed = ss.response.integrate(structure, laws.gap_operator, laws.laws, load, 5.0, np.arange(structure.n))
    assert timed.settled
    harmonics = timed.harmonics
    # 64 samples a period leave 4e-5
    np.testing.assert_allclose(harmonics[1], coefficients[1], atol=1e-4 * np.abs(coefficients[1]).max())
    with pytest.raises(ss.InputError, match="structural damping"):
        ss.response.integrate(turning_and_lossy(), laws.gap_operator, laws.laws, load, 5.0, np.arange(structure.n))


def test_forced_response_of_a_turning_lossy_structure_in_bonded_contact():
    structure = turning_and_lossy()
    rows = np.zeros((3, structure.n))
    rows[0, 1], rows[2, 2] = 1.0, 1.0
    system = ss.System(
        structure, ss.Interface(("c",), (ss.Bonded(k_t=40.0, k_w=40.0, k_n=60.0),), rows), outputs=np.array([0, 5])
    )
    force = np.zeros(structure.n, dtype=complex)
    force[0] = 3.0 + 1.0j
    load = ss.HarmonicLoad(np.zeros(structure.n), {1: force})
    sweep = ss.Sweep(omega_range=(5.0, 9.0))
    problem = ss.response.forced_problem(system, load, sweep)
    stuck = replace(structure, stiffness=structure.stiffness + rows.T @ np.diag([40.0, 40.0, 60.0]) @ rows)
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    assert len(points) > 5
    for point in points:
        exact = full_response(stuck, force, point.omega)[[0, 5]]
        np.testing.assert_allclose(
            ss.response.fields(problem, point).outputs[1], exact, atol=1e-6 * np.abs(exact).max()
        )
