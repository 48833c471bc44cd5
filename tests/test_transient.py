"""Time integration against closed forms, exact event-driven results and conservation laws."""

from dataclasses import replace

import numpy as np
import pytest
from transient_models import GRIFFIN_EXACT, bounce, griffin, load_of, structure_of, stuck_motion, wedge

from evidence.integrator import transient as judge
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.response.time.settling import LONGEST_MEMORY, remaining_change
from stickslip.response.time.start import TransientStart, rest, start_from_harmonics
from stickslip.response.time.stepping.marcher import prepared
from stickslip.response.time.transient import TimeStepping, integrate


def test_linear_response_with_coupled_damping_and_a_stiff_mode_is_exact_at_a_coarse_step() -> None:
    # 50 cycles of the stiff mode fit into one step; its damping settles it within the run.
    mass, damping = (np.diag([1.0, 2.0, 0.5]), np.array([[0.3, -0.1, 0], [-0.1, 0.4, 0], [0, 0, 60.0]]))
    stiffness = np.array([[3.0, -1.0, 0], [-1.0, 2.0, -0.5], [0, -0.5, 1e8 / 2]])
    structure, omega = structure_of(mass, damping, stiffness), 1.3
    load = load_of(3, {1: [1.0, 0.5j, 0.2], 3: [0.1, 0, -0.3j]}, [0.7, 0, 0.1])
    stepping = TimeStepping(steps_per_period=16, tolerance=1e-11, harmonics=3)
    result = integrate(structure, np.zeros((0, 3)), [], load, omega, np.arange(3), stepping=stepping)
    assert result.settled
    assert result.drifting == ()
    for h in range(4):
        force = load.coefficients(3)[h]
        dynamic = stiffness - (h * omega) ** 2 * mass + 1j * h * omega * damping
        # The stiff coordinate answers 1e-8 of the others: hence the absolute tolerance, rounding of the largest one.
        np.testing.assert_allclose(result.harmonics[h], np.linalg.solve(dynamic, force), rtol=1e-9, atol=1e-12)


def test_free_rigid_body_follows_newton() -> None:
    mass, omega = 0.3, 700.0
    structure = structure_of(mass * np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)))
    exact = np.array([[0.02], [-2.0 / (mass * omega**2) * (1 + 1j)]])
    start = start_from_harmonics(exact, omega, np.zeros((0, 1)), [])
    load = load_of(1, {1: [2.0 + 2.0j]})
    stepping = TimeStepping(steps_per_period=32, max_periods=50)
    result = integrate(structure, np.zeros((0, 1)), [], load, omega, np.array([0]), start, stepping)
    np.testing.assert_allclose(result.harmonics[:2], exact, rtol=1e-9)
    np.testing.assert_allclose(result.harmonics[2:], 0, atol=1e-12)
    np.testing.assert_allclose(result.final.velocity, start.velocity, rtol=1e-9)


@pytest.mark.parametrize("omega", GRIFFIN_EXACT)
def test_friction_damped_oscillator_against_exact_event_driven_values(omega: float) -> None:
    result = griffin(integrate, omega, TimeStepping(steps_per_period=2048, tolerance=1e-8))
    assert result.settled
    assert result.contact_failures == 0
    # 2048 steps: error of the step up to 2.3e-6 in the order test below; the reference has eight digits.
    assert abs(result.harmonics[1, 0]) == pytest.approx(GRIFFIN_EXACT[omega], rel=5e-6)


@pytest.mark.validation
def test_error_of_the_contact_force_is_of_second_order_in_the_step() -> None:
    # Where the switches fall within a step changes the error at random: average over neighbouring step sizes.
    def mean_error(steps: range) -> float:
        stepping = [TimeStepping(steps_per_period=n, tolerance=1e-7) for n in steps]
        errors = [
            abs(griffin(integrate, w, s).harmonics[1, 0]) / exact - 1
            for s in stepping
            for w, exact in GRIFFIN_EXACT.items()
        ]
        return float(np.sqrt(np.mean(np.square(errors))))

    coarse, fine = mean_error(range(64, 72)), mean_error(range(512, 576, 8))
    order = np.log(coarse / fine) / np.log(8.0)
    assert coarse < 2e-3
    assert order == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize(("frequency", "exact"), [(150.0, 2.791850e-5), (170.0, 7.115741e-5)])
def test_wedge_damper_where_it_sticks(frequency: float, exact: float) -> None:
    # Seven digits of a multi-harmonic balance by another program, which is exact here: the contacts are springs. (Its
    # time-domain companion gives 2.79188e-5 at 150 Hz, 1e-5 more: the damper has no dashpot, and from rest its
    # transient has not died out after thousands of periods.)
    structure, gap, laws, load = wedge()
    omega = 2 * np.pi * frequency
    stuck, start = stuck_motion(structure, gap, laws, load, omega)
    result = integrate(structure, gap, laws, load, omega, np.array([3]), start, TimeStepping(steps_per_period=64))
    assert result.settled
    assert abs(result.harmonics[1, 0]) == pytest.approx(exact, rel=3e-7)
    # Stuck contacts are part of the exact propagator: only rounding is left, even at 64 steps a period.
    assert abs(result.harmonics[1, 0] / stuck[1, 3] - 1) < 1e-9


@pytest.mark.parametrize(
    ("frequency", "exact", "tolerance"),
    [
        # At 160 Hz the second contact never slips, so that its mean traction, and with it the response, depends on the
        # start: from rest 4e-5 below the reference, from the static equilibrium nearer. At 163 Hz both slip.
        (160.0, 1.99957e-4, 1.5e-4),
        (163.0, 2.273072e-4, 5e-5),
    ],
)
def test_wedge_damper_with_slip_and_lift_off(frequency: float, exact: float, tolerance: float) -> None:
    structure, gap, laws, load = wedge()
    stepping = TimeStepping(steps_per_period=512, tolerance=1e-6)
    result = integrate(structure, gap, laws, load, 2 * np.pi * frequency, np.array([3]), stepping=stepping)
    assert result.settled
    assert result.contact_failures == 0
    assert np.any(result.contact_force[:, 0, 2] == 0.0)  # it lifts off
    assert abs(result.harmonics[1, 0]) == pytest.approx(exact, rel=tolerance)


def test_work_of_the_load_is_what_dashpots_and_friction_dissipate() -> None:
    structure, gap, laws, load = wedge()
    omega = 2 * np.pi * 163.0
    stepping = TimeStepping(steps_per_period=512, tolerance=1e-6, harmonics=250)
    result = integrate(structure, gap, laws, load, omega, np.arange(6), stepping=stepping)
    x = result.harmonics
    work = np.pi * np.sum((load.harmonics[1] * x[1].conj()).imag)
    orders = np.arange(len(x))
    dashpots = np.pi * omega * np.sum(orders**2 * np.einsum("hi,ij,hj->h", x.conj(), structure.damping, x).real)
    closed_gap = np.vstack([result.gap[-1:], result.gap])
    closed_force = np.vstack([result.contact_force[-1:], result.contact_force])
    contact = np.sum((closed_force[1:] + closed_force[:-1]) / 2 * np.diff(closed_gap, axis=0), axis=(0, 2))
    assert np.all(contact > 0.0)
    assert np.sum(contact) > 0.05 * work  # otherwise this would test the dashpots
    # 512 samples: the trapezoidal sums over the corners of the loops are good to about 1e-4.
    assert dashpots + np.sum(contact) == pytest.approx(work, rel=3e-4)


def test_bouncing_mass_follows_parabola_and_half_sine() -> None:
    # Closed form over two landings; an error in a landing would shift all that comes after it.
    errors = np.array([bounce(integrate, n, TransientStart, TimeStepping) for n in (250, 1000, 4000)])
    assert errors[0] < 2e-2
    assert np.all(errors[1:] < errors[:-1] / 8)  # second order would be 16, at unlucky phases less


def test_slider_takes_hold_where_the_gap_closes() -> None:
    # Masses too heavy to feel the contact: normal gap a cos ωt, tangential motion v t. While closed, the traction is
    # k (x - x at closing) up to the limit, although the closing falls between two samples.
    omega, a, v, k_t, k_n, mu = 2.0, 1e-3, 3e-4, 1e4, 2e5, 0.6
    heavy = 1e12
    structure = structure_of(heavy * np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)))
    law = ElasticCoulomb(k_t=k_t, k_w=0.0, k_n=k_n, mu=mu)
    start = TransientStart(np.array([0.0, a]), np.array([v, 0.0]), np.zeros((1, 2)))
    load = load_of(2, {1: [0.0, -heavy * omega**2 * a]})
    gap = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    steps = 202  # a quarter of the period is half way between two samples
    result = integrate(structure, gap, [law], load, omega, np.arange(2), start, TimeStepping(steps, max_periods=2))
    phase = 2 * np.pi * np.arange(1, steps + 1) / steps
    normal = np.maximum(0.0, -k_n * a * np.cos(phase))
    traction = np.minimum(k_t * v / omega * (phase - np.pi / 2), mu * normal) * (normal > 0.0)
    stuck = (traction > 0.0) & (traction < mu * normal)
    assert np.count_nonzero(stuck) > 30
    # The gap is not straight within the step of landing: error k v h (ωh)²/..., far below the k v h/2 of a slider
    # that takes hold at a sample.
    step_travel = k_t * v * 2 * np.pi / omega / steps
    np.testing.assert_allclose(result.contact_force[:, 0, 0], traction, rtol=0, atol=5e-3 * step_travel)
    np.testing.assert_allclose(-result.contact_force[:, 0, 2], normal, rtol=0, atol=1e-6 * k_n * a)


def test_steady_slide_is_reported_as_drift_with_the_name_of_the_coordinate() -> None:
    # A mass pulled harder than friction holds slides at (F - mu N)/c on average, whatever the vibration on top.
    mass, c, pull, limit, omega = 1.0, 5.0, 3.0, 1.0, 10.0
    structure = structure_of(mass * np.eye(1), c * np.eye(1), np.zeros((1, 1)))
    law = ElasticCoulomb(k_t=1e4, k_w=0.0, k_n=0.0, mu=0.5, preload=2 * limit)
    gap, load = np.array([[1.0], [0.0], [0.0]]), load_of(1, {1: [0.5]}, [pull])
    result = integrate(structure, gap, [law], load, omega, np.array([0]), stepping=TimeStepping(steps_per_period=256))
    assert result.drift[0] == pytest.approx((pull - limit) / c * 2 * np.pi / omega, rel=1e-4)
    assert result.drifting == ("node0.x",)


def test_a_run_goes_on_where_another_ended() -> None:
    structure, gap, laws, load = wedge()
    arguments = (structure, gap, laws, load, 2 * np.pi * 161.0, np.array([1, 3]))
    once = integrate(*arguments, stepping=TimeStepping(128, max_periods=30))
    first = integrate(*arguments, stepping=TimeStepping(128, max_periods=18))
    second = integrate(*arguments, first.final, TimeStepping(128, max_periods=12))
    # Differences are roundings, which friction does not amplify.
    np.testing.assert_allclose(second.outputs, once.outputs, rtol=0, atol=1e-10 * np.max(np.abs(once.outputs)))
    np.testing.assert_allclose(second.final.states, once.final.states, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_random_systems_move_as_the_judge_with_its_own_law_has_them(seed: int) -> None:
    # The same scheme and another law: stick, slip, lift-off and landing agree to what friction makes of rounding.
    random = np.random.default_rng(seed)
    n, contacts = 9, 2 + seed % 2
    stiffness = random.normal(size=(n, n))
    structure = structure_of(
        np.diag(random.uniform(0.5, 2.0, n)), 0.2 * np.eye(n), stiffness @ stiffness.T + 4.0 * np.eye(n)
    )
    gap = random.normal(size=(3 * contacts, n))
    laws = [
        ElasticCoulomb(
            k_t=random.uniform(1, 5),
            k_w=random.uniform(0, 5),
            k_n=random.uniform(1, 8),
            mu=random.uniform(0.1, 0.6),
            preload=random.uniform(-0.2, 0.6),
        )
        for _ in range(contacts)
    ]
    load = load_of(n, {1: list(2 * random.normal(size=n)), 3: list(1j * random.normal(size=n))})
    common = (structure, gap, laws, load, 1.7, np.arange(n))
    ours = integrate(*common, stepping=TimeStepping(512, max_periods=6))
    theirs = judge.integrate(*common, stepping=judge.TimeStepping(512, max_periods=6))
    assert ours.contact_failures == theirs.contact_failures == 0
    force = ours.contact_force
    assert np.any(force[:, :, 2] == 0.0)
    assert np.any(force[:, :, 2] < 0.0)
    np.testing.assert_allclose(force, theirs.contact_force, rtol=0, atol=1e-8 * np.abs(force).max())
    np.testing.assert_allclose(ours.outputs, theirs.outputs, rtol=0, atol=1e-9 * np.abs(ours.outputs).max())


def test_residual_traction_is_the_start_of_the_springs() -> None:
    laws = [ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.5, preload=4.0, residual_traction=m) for m in (None, -0.25)]
    start = rest(3, laws)
    assert start.displacement.shape == start.velocity.shape == (3,)
    gap = np.vstack([np.eye(3), np.eye(3)])
    structure, load = structure_of(np.eye(3), np.eye(3), np.eye(3)), load_of(3, {})
    state = prepared(structure, gap, laws, load, 1.0, 16).begun(start)
    traction = state.seen[2].reshape(2, 3)[:, :2]
    np.testing.assert_allclose(traction, [[0.0, 0.0], [-0.5, -0.5]], atol=1e-15)


def test_periods_that_run_out_are_said_to_be_unsettled() -> None:
    result = griffin(integrate, 1.15, TimeStepping(steps_per_period=64, max_periods=12))
    assert result.status == "unsettled"
    assert not result.settled
    assert result.periods == 12
    assert result.remaining > 1e-5


def test_average_sees_through_a_mode_that_never_stops_ringing() -> None:
    # Two uncoupled oscillators make one output; the undamped one rings at a frequency that fits no period.
    structure = structure_of(np.eye(2), np.diag([0.5, 0.0]), np.diag([4.0, 30.0]))
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    mixed = structure_of(*(turn @ m @ turn.T for m in (structure.mass, structure.damping, structure.stiffness)))
    force, omega = np.array([1.0, 0.0]), 1.5
    start = TransientStart(turn @ np.array([0.0, 0.3]), np.zeros(2), ())
    load = HarmonicLoad(np.zeros(2), {1: (turn @ force).astype(complex)})
    stepping = TimeStepping(steps_per_period=32, max_periods=300, tolerance=1e-4)
    result = integrate(mixed, np.zeros((0, 2)), [], load, omega, np.array([0]), start, stepping)
    exact = turn[0, 0] / (4.0 - omega**2 + 0.5j * omega)
    assert result.status == "unsettled"
    assert result.scatter > 0.02
    # A hundred periods of a ringing of a few per cent, which adds up to no more than a few of its amplitudes.
    assert abs(result.average[0] / exact - 1) < 2e-3
    assert result.drifting == ()


def test_slow_decay_is_not_taken_for_a_settled_motion() -> None:
    # Changes of 1e-6 a period that decay by a thousandth a period leave 1e-3 to come.
    slow = [1e-6 * 0.999**i for i in range(60)]
    assert remaining_change(slow) == pytest.approx(1e-3, rel=0.1)
    fast = [0.5**i for i in range(40)]
    # The sum from the largest change of the last third on, exactly geometric.
    assert remaining_change(fast) == pytest.approx(fast[27], rel=1e-12)
    assert remaining_change([1e-3] * 40) == pytest.approx(1e-3 * LONGEST_MEMORY)
    assert remaining_change([1e-3] * 7) == np.inf
    assert remaining_change([1.0] * 4 + [0.0] * 4) == 0.0
    beating = [1e-4 * 0.999**i * abs(np.cos(0.1 * i)) for i in range(120)]
    assert remaining_change(beating) > 1e-3


def test_a_motion_that_overflows_is_reported_and_gives_no_number() -> None:
    structure = structure_of(np.eye(1), -2.0 * np.eye(1), np.eye(1))
    with np.errstate(all="raise"):
        result = integrate(
            structure,
            np.zeros((0, 1)),
            [],
            load_of(1, {1: [1.0]}),
            1.0,
            np.array([0]),
            stepping=TimeStepping(16, max_periods=200),
        )
    assert result.status == "diverged"
    assert result.periods < 200
    assert result.harmonics.shape == (8, 1)
    for array in (result.harmonics, result.average, result.drift, result.final.displacement):
        assert np.all(np.isnan(array))
    assert np.isnan(result.change)
    assert not result.settled


@pytest.mark.parametrize("growth", [0.3, 1.0, 30.0])
def test_a_motion_that_grows_slowly_is_stopped_before_its_sums_overflow(growth: float) -> None:
    # Its numbers pass through a period in which each is finite and their sums are not; the tests raise every warning.
    structure = structure_of(np.eye(2), -growth * np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]]))
    law = ElasticCoulomb(k_t=0.5, k_w=0.0, k_n=0.3, mu=0.5, preload=0.2)
    gap = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    load, stepping = load_of(2, {1: [1.0, 0.5]}), TimeStepping(steps_per_period=32)
    with np.errstate(over="raise", invalid="raise"):
        result = integrate(structure, gap, [law], load, 1.3, np.arange(2), None, stepping)
    assert result.status == "diverged"
    assert result.periods < stepping.max_periods
    for array in (result.harmonics, result.average, result.outputs, result.gap, result.swing):
        assert np.all(np.isnan(array))
    for array in (result.final.displacement, result.final.velocity, *result.final.states):
        assert np.all(np.isnan(array))
    assert np.all(np.isnan(result.contact_force))
    assert result.drifting == ()


def test_contact_equations_without_a_solution_are_counted_as_failed() -> None:
    structure = structure_of(np.eye(1), np.zeros((1, 1)), np.eye(1))
    gap = np.array([[0.0], [0.0], [1.0]])
    law = ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=1.0, mu=0.0)
    marcher = prepared(structure, gap, [law], load_of(1, {}, [1.0]), 1.0, 16)
    ops = marcher.operators
    # g = free + response r(g) with r = -k g while open: at a response of -2/k neither state answers free > 0.
    response = np.zeros((3, 6))
    response[2, 2] = -2.0
    drive, none = np.abs(ops.drive), np.zeros_like(ops.transfer)
    changed = ops._replace(response=response, drive=drive, transfer=none)
    impossible = replace(marcher, operators=changed)
    start = rest(1, [law])
    assert marcher.march(marcher.begun(start), marcher.record()) == 0
    assert impossible.march(impossible.begun(start), impossible.record()) != 0


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("max_periods", -3, r"TimeStepping\.max_periods: must be at least 2, got -3"),
        ("steps_per_period", 4, r"TimeStepping\.steps_per_period: must lie in \[16, 1e\+07\], got 4"),
        ("tolerance", 0.0, r"TimeStepping\.tolerance: must lie in \(0, 1\), got 0\.0"),
        ("harmonics", 600, r"TimeStepping\.harmonics: 600 are too many for 1024 steps a period"),
    ],
)
def test_unusable_stepping_is_refused(field: str, value: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        TimeStepping(**{field: value})


def test_unusable_arguments_are_refused_by_name() -> None:
    structure, gap, laws, load = wedge()
    outputs = np.array([3])
    with pytest.raises(InputError, match=r"gap_operator: has shape \(3, 6\)\. It must be \(6, 6\)"):
        integrate(structure, gap[:3], laws, load, 1.0, outputs)
    with pytest.raises(InputError, match=r"HarmonicLoad: contains NaN or infinite forces"):
        integrate(structure, gap, laws, HarmonicLoad(np.full(6, np.nan)), 1.0, outputs)
    with pytest.raises(InputError, match=r"omega: must be positive, got -1\.0"):
        integrate(structure, gap, laws, load, -1.0, outputs)
    with pytest.raises(InputError, match=r"outputs: got \[6\] for 6 dofs"):
        integrate(structure, gap, laws, load, 1.0, np.array([6]))
    with pytest.raises(InputError, match=r"start\.states: hold \[2\] numbers"):
        integrate(structure, gap, laws, load, 1.0, outputs, rest(6, laws[:1]))
    massless = structure_of(np.diag([1, 1, 1, 1, 0.0, 0.1]), structure.damping, structure.stiffness)
    with pytest.raises(InputError, match=r"Structure\.mass: is not positive definite .* 0 at node4\.x"):
        integrate(massless, gap, laws, load, 1.0, outputs)


def test_a_start_of_another_kind_and_too_many_steps_are_refused():
    structure = lumped(np.eye(1), np.eye(1))
    arguments = (structure, np.zeros((0, 1)), [], HarmonicLoad(np.zeros(1), {1: np.ones(1)}), 0.5, np.array([0]))
    with pytest.raises(InputError, match=r"integrate: start: is a str\. Give a TransientStart"):
        integrate(*arguments, "rest")
    with pytest.raises(InputError, match=r"steps_per_period: must lie in \[16, 1e\+07\]"):
        TimeStepping(steps_per_period=10**13)
