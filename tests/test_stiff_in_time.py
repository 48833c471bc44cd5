"""Contacts far stiffer than the structure in time: closed form of rigid friction, the balance, and what the step says of itself."""

import numpy as np
import pytest
from transient_models import load_of, structure_of

import stickslip as ss
from stickslip.contact.law import ContactLaw
from stickslip.errors import InputError
from stickslip.response.time.shooting import ShootingResult, shoot
from stickslip.response.time.start import TransientStart
from stickslip.response.time.transient import TimeStepping, integrate

LIMIT, DAMPING, OMEGA = 0.5, 0.05, 1.1
GAP = np.array([[1.0], [0.0], [0.0]])


def laws(k: float) -> dict[str, ContactLaw]:
    return {
        "elastic": ss.ElasticCoulomb(k_t=k, k_w=0.0, k_n=0.0, mu=0.5, preload=1.0),
        "planar": ss.CoupledCoulomb(k_t=k, k_n=0.0, mu=0.5, preload=1.0),
        "dahl": ss.Dahl(k_t=k, limit=LIMIT),
        "bouc_wen": ss.BoucWen(k_t=k, beta=0.5 * k / LIMIT, gamma=0.5 * k / LIMIT),
    }


def arguments(law: ContactLaw, damping: float = DAMPING) -> tuple:
    structure = structure_of(np.eye(1), damping * np.eye(1), np.eye(1))
    return structure, GAP, [law], load_of(1, {1: [1.0]}), OMEGA, np.array([0])


def rigid_friction() -> float:
    """First harmonic of a mass with rigid friction that never stops (Den Hartog 1931), m = k = 1, load 1.

    Between the turns at t = 0 and half a period later the friction force is constant: the motion is the forced vibration of phase φ,
    a shift and a free vibration, with x(T/2) = -x(0) and no velocity at both turns. The force has the first harmonic -4i F/π.
    """
    receptance = 1.0 / (1.0 - OMEGA**2 + 1j * OMEGA * DAMPING)
    root = complex(np.roots([1.0, DAMPING, 1.0])[0])
    end = np.exp(root * np.pi / OMEGA)

    def part(z: complex) -> list[float]:
        return [z.real, -z.imag]

    equations = np.array(
        [
            [0.0, 0.0, *part(1 + end)],
            [*part(1j * OMEGA * receptance), *part(root)],
            [*part(-1j * OMEGA * receptance), *part(root * end)],
        ]
    )
    one = np.linalg.lstsq(equations, np.array([-2.0 * LIMIT, 0.0, 0.0]), rcond=None)[0]
    other = np.linalg.svd(equations)[2][-1]
    square = [other[:2] @ other[:2], 2 * other[:2] @ one[:2], one[:2] @ one[:2] - 1.0]
    found = []
    for share in np.roots(square):
        p, q, a, b = one + share.real * other
        phase = p + 1j * q
        t = np.linspace(0.0, np.pi / OMEGA, 200)[1:-1]
        moves = 1j * OMEGA * receptance * phase * np.exp(1j * OMEGA * t)
        velocity = (moves + root * (a + 1j * b) * np.exp(root * t)).real
        if np.all(velocity < 0.0):
            found.append(abs((phase - 4j * LIMIT / np.pi) * receptance))
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("name", laws(1.0))
@pytest.mark.parametrize("k", [1e6, 1e7, 1e9])
def test_a_contact_as_good_as_rigid_moves_as_with_rigid_friction(name: str, k: float) -> None:
    # a turn falls anywhere within a step: an error of first order, of the size of the force that turns
    errors = []
    for steps in (256, 1024):
        stepping = TimeStepping(steps, tolerance=1e-6, max_periods=60)
        found = integrate(*arguments(laws(k)[name]), stepping=stepping)
        assert found.contact_failures == 0
        errors.append(abs(abs(found.average[0]) / rigid_friction() - 1.0))
    assert errors[0] < 1.5e-2
    assert errors[1] < 4e-3


def balanced(law: ContactLaw, order: int = 61) -> float:
    structure, gap, _, load, omega, outputs = arguments(law)
    contacts = ss.Interface(("c",), (law,), gap)
    system = ss.System(structure, contacts, outputs=outputs)
    sweep = ss.Sweep(
        omega_range=(omega, 1.0001 * omega),
        low=order,
        high=order,
        selection="always_low",
        frequencies=2,
        peak_points=0,
        samples=2048,
    )
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    assert points[0].converged
    return float(abs(points[0].coefficients[1, 0]))


@pytest.mark.parametrize("k", [1e2, 1e3, 1e4])
def test_stiff_contacts_have_the_amplitude_of_the_balance_at_the_default_step(k: float) -> None:
    law = laws(k)["elastic"]
    found = shoot(*arguments(law), stepping=TimeStepping(tolerance=1e-8, max_periods=100))
    error = abs(found.harmonics[1, 0]) / balanced(law) - 1.0
    assert found.converged
    assert abs(error) < 2e-3
    assert found.step_error < 5e-3


@pytest.mark.parametrize("k", [1e3, 1e6, 1e9])
def test_a_stiff_contact_that_sticks_is_a_constraint(k: float) -> None:
    # two masses, the second held by a contact that never slips: static response, whatever the step makes of its vibration
    structure = structure_of(np.diag([1.0, 0.01]), np.diag([0.05, 0.001]), np.array([[2.0, -1.0], [-1.0, 1.0]]))
    law = ss.Jenkins(k_t=k, limit=1e3)
    gap = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    load = load_of(2, {1: [1.0, 0.0]})
    stepping = TimeStepping(tolerance=1e-7)
    found = shoot(structure, gap, [law], load, OMEGA, np.arange(2), stepping=stepping)
    stiff = structure.stiffness + k * gap.T @ gap
    dynamic = stiff - OMEGA**2 * structure.mass + 1j * OMEGA * structure.damping
    exact = np.linalg.solve(dynamic, load.harmonics[1])
    assert found.converged
    np.testing.assert_allclose(found.harmonics[1, 0], exact[0], rtol=1e-6)
    np.testing.assert_allclose(found.harmonics[1, 1], exact[1], rtol=1e-3)


def stop(k: float, steps: int) -> ShootingResult:
    structure = structure_of(np.eye(1), 0.05 * np.eye(1), np.eye(1))
    law = ss.UnilateralSpring(k_n=k, preload=0.5)
    gap = np.array([[0.0], [0.0], [1.0]])
    load = load_of(1, {1: [1.0]})
    stepping = TimeStepping(steps, tolerance=1e-8, max_periods=200)
    return shoot(structure, gap, [law], load, 0.7, np.array([0]), stepping=stepping)


@pytest.mark.validation
@pytest.mark.parametrize("k", [1e2, 1e3])
def test_the_error_of_the_step_is_known(k: float) -> None:
    # a mass that hits a stop, whose stiffness the steps follow well, hardly or not at all; with 64 steps it depends on rounding, and
    # so on the versions of NumPy, whether the motion of the stiffest becomes periodic
    exact = stop(k, 8192).harmonics[1:]
    statuses = []
    for steps in (80, 256, 1024):
        found = stop(k, steps)
        error = np.max(np.abs(found.harmonics[1:] - exact)) / np.max(np.abs(exact))
        statuses.append(found.status)
        assert found.converged == (found.step_error <= 0.01)
        if steps > 80:
            assert found.step_error == pytest.approx(error, rel=0.6)
    assert statuses[:2] == ["coarse", "coarse"]
    assert statuses[2] == ("converged" if k == 1e2 else "coarse")


def test_a_stop_that_no_step_follows_is_never_said_to_be_solved() -> None:
    assert not stop(1e4, 256).converged
    assert not stop(1e4, 1024).converged


def test_planar_friction_that_overflows_is_said_to_diverge() -> None:
    structure = structure_of(np.eye(1), -3.0 * np.eye(1), np.eye(1))
    law = ss.CoupledCoulomb(k_t=1e6, k_n=0.0, mu=0.5, preload=1.0)
    load = load_of(1, {1: [1.0]})
    stepping = TimeStepping(64, max_periods=400)
    found = integrate(structure, GAP, [law], load, OMEGA, np.array([0]), stepping=stepping)
    assert found.status == "diverged"


def test_a_state_that_is_no_number_is_refused() -> None:
    law = ss.Dahl(k_t=1.0, limit=LIMIT)
    for value in (np.nan, np.inf):
        start = TransientStart(np.zeros(1), np.zeros(1), (np.array([0.0, value, 0.0, 0.0]),))
        for solve in (integrate, shoot):
            with pytest.raises(InputError, match=r"start.states\[0\]"):
                solve(*arguments(law), start)
    free = ss.ElasticCoulomb(k_t=1.0, k_w=0.0, k_n=0.0, mu=0.5, preload=1.0, residual_traction=0.1)
    start = TransientStart(np.zeros(1), np.zeros(1), (np.full(2, np.nan),))
    assert integrate(*arguments(free), start, TimeStepping(64)).settled


@pytest.mark.parametrize("name", ["dahl", "bouc_wen"])
def test_directions_without_a_spring_have_no_multiplier_that_counts(name: str) -> None:
    found = shoot(*arguments(laws(2.0)[name]), stepping=TimeStepping(128, tolerance=1e-9))
    assert found.converged
    assert found.floquet.neutral == 0
    # displacement, velocity and the force of the hysteresis
    assert np.count_nonzero(np.abs(found.floquet.multipliers) > 1e-9) <= 3


def test_a_verdict_within_the_error_of_the_step_is_undecided() -> None:
    # negative damping that friction just holds: 0.9969 with fine steps, above 1 with coarse ones
    law = ss.ElasticCoulomb(k_t=1.0, k_w=0.0, k_n=0.0, mu=0.5, preload=1.0)
    verdicts = []
    for steps in (256, 512, 1024, 4096):
        stepping = TimeStepping(steps, tolerance=1e-9, max_periods=200)
        found = shoot(*arguments(law, -0.05), stepping=stepping)
        assert found.converged
        verdicts.append((found.floquet.growth, found.growth_error, found.stable, found.undecided))
    growth, error, stable, undecided = np.array(verdicts).T
    assert np.any(growth > 1.0)
    assert np.all(undecided[growth > 1.0])
    assert stable[-1]
    assert np.all(np.abs(growth - growth[-1]) <= 2 * error + 1e-5)


@pytest.mark.parametrize("steps", [1024, 4096])
def test_impacts_whose_growth_the_step_does_not_know_have_no_verdict(steps: int) -> None:
    # 2.758 by an integration with located events (DOP853, Newton on its period map): 1024 steps say 0.976, 2048 2.61
    structure = structure_of(np.eye(1), 0.004287661752308485 * np.eye(1), np.eye(1))
    law = ss.UnilateralSpring(k_n=142.12168829157827, preload=0.3)
    load = load_of(1, {1: [0.5962442782050664 - 0.5983731712727243j]})
    found = shoot(
        structure,
        np.array([[0.0], [0.0], [1.0]]),
        [law],
        load,
        0.5472870405353577,
        np.array([0]),
        stepping=TimeStepping(steps, tolerance=1e-8, max_periods=60),
    )
    assert found.converged
    assert not found.stable
    assert abs(found.floquet.growth - 2.758) <= found.growth_error
    assert found.undecided == (steps == 1024)
