"""Motion in time for every law: the derivative of the period map, the order of the step, and the balance with many harmonics."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from transient_models import load_of, structure_of

import stickslip as ss
from stickslip.arrays import FloatArray
from stickslip.contact.law import UNCOUPLED_TANGENTS, law_kernel
from stickslip.contact.laws import LAWS
from stickslip.response.time.shooting import PeriodMap, period_map, shoot
from stickslip.response.time.start import rest, start_from_harmonics
from stickslip.response.time.stepping import step_tangent
from stickslip.response.time.stepping.marcher import Marcher, prepared
from stickslip.response.time.transient import TimeStepping


def _drag(displacement, velocity, state, parameters, force, new_state, jac, status):
    """A spring along every direction, and along t a drag that grows with the square of the rate."""
    k, c = parameters
    for d in range(3):
        force[d] = k * displacement[d]
        jac[d, d] = k
    force[0] += c * velocity[0] * abs(velocity[0])
    jac[0, 3] = 2.0 * c * abs(velocity[0])
    status[:] = 0


@dataclass(frozen=True)
class Drag:
    """A law by a user."""

    k: float
    c: float
    kernel = law_kernel(_drag)
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def parameters(self) -> FloatArray:
        return np.array([self.k, self.c])

    def initial_state(self) -> FloatArray:
        return np.zeros(0)

    def stuck_stiffness(self) -> FloatArray:
        return np.full(3, self.k)


CASES: dict[str, Any] = {
    "bonded": ss.Bonded(k_t=2.0, k_w=1.5, k_n=3.0),
    "unilateral_spring": ss.UnilateralSpring(k_n=3.0, preload=0.3),
    "cubic_spring": ss.CubicSpring(k_t=1.0, cubic_t=0.4, k_w=0.5, cubic_w=0.2, k_n=1.0, cubic_n=-0.05),
    "polynomial_spring": ss.PolynomialSpring(along_t=(1.0, 0.2, 0.3), along_w=(0.5,), along_n=(1.0, 0.1, 0.1)),
    "jenkins": ss.Jenkins(k_t=2.0, k_w=1.5, k_n=1.0, limit=0.4),
    "elastic_coulomb": ss.ElasticCoulomb(k_t=2.0, k_w=1.5, k_n=3.0, mu=0.5, preload=0.3),
    "coupled_coulomb": ss.CoupledCoulomb(k_t=2.0, k_n=3.0, mu=0.5, preload=0.3),
    "regularised_coulomb": ss.RegularisedCoulomb(mu=0.4, transition_velocity=0.5, k_n=3.0, preload=0.3),
    "dahl": ss.Dahl(k_t=2.0, k_w=1.5, k_n=1.0, limit=0.4),
    "bouc_wen": ss.BoucWen(k_t=2.0, k_w=1.5, k_n=1.0, beta=3.0, gamma=2.0, alpha=0.1, exponent=1.5),
    "iwan": ss.Iwan(k_t=2.0, k_w=1.5, k_n=1.0, limit=0.6),
    "user": Drag(k=2.0, c=0.3),
}
LIFTS = {"unilateral_spring", "elastic_coulomb", "coupled_coulomb", "regularised_coulomb"}
OMEGA = 1.3


def test_every_law_is_tried() -> None:
    assert set(CASES) == {*LAWS, "user"}


def model(name: str) -> tuple:
    """A mass in space that a contact of a law holds against the ground."""
    structure = structure_of(
        np.eye(3), np.diag([0.2, 0.25, 0.3]), np.array([[1.0, 0.2, 0.1], [0.2, 1.4, 0.0], [0.1, 0.0, 1.2]])
    )
    load = load_of(3, {1: [1.5, 1.0 + 0.4j, 0.9j], 3: [0.1, 0.2j, 0.1]}, [0.0, 0.05, -0.05])
    return structure, np.eye(3), [CASES[name]], load


def mapping_of(name: str, steps: int) -> tuple[PeriodMap, FloatArray]:
    """The period map, and a state off the kinks of sliders that slip."""
    arguments = model(name)
    marcher: Marcher = prepared(*arguments, OMEGA, steps)
    mapping, state = period_map(marcher, rest(3, arguments[2]))
    for _ in range(4):
        state = mapping.image(state).state
    m = mapping.n_motion
    state[m:] *= 0.99
    return mapping, state


@pytest.mark.parametrize("name", CASES)
def test_monodromy_is_the_derivative_of_the_period_map(name: str) -> None:
    mapping, state = mapping_of(name, 128)
    derivative = mapping.derivative(state)
    np.testing.assert_allclose(derivative.image.state, mapping.image(state).state, atol=1e-13)
    if name in LIFTS:
        force = derivative.image.record.force[:, 0, 2]
        assert np.any(force == 0.0)
        assert np.any(force < 0.0)
    best = np.full(mapping.size, np.inf)
    for step in (1e-4, 1e-5, 1e-6):
        for j, unit in enumerate(np.eye(mapping.size)):
            ends = [mapping.image(state + s * step * unit).state for s in (1, -1)]
            error = np.linalg.norm((ends[0] - ends[1]) / (2 * step) - derivative.monodromy[:, j])
            best[j] = min(best[j], error)
    assert np.max(best) < 1e-6 * np.linalg.norm(derivative.monodromy)


def test_a_log_of_many_rows_is_carried_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    mapping, state = mapping_of("dahl", 64)
    whole = mapping.derivative(state).monodromy
    monkeypatch.setattr(step_tangent, "NUMBERS", 1000)  # a few rows
    found = mapping.derivative(state).monodromy
    np.testing.assert_allclose(found, whole, rtol=0, atol=1e-12 * np.abs(whole).max())  # rounding


def harmonics(name: str, steps: int, start: Any = None) -> tuple[np.ndarray, Any]:
    stepping = TimeStepping(steps, tolerance=1e-10, max_periods=400)
    found = shoot(*model(name), OMEGA, np.arange(3), start, stepping)
    assert found.converged
    assert found.contact_failures == 0
    return found.harmonics[:8], found.final


@pytest.mark.validation
@pytest.mark.parametrize("name", sorted(CASES))
def test_error_of_the_step_is_of_second_order(name: str) -> None:
    # the place of a switch within a step changes the error at random: the mean over neighbouring numbers of steps
    exact, start = harmonics(name, 2048)
    finer, _ = harmonics(name, 1024, start)
    exact = exact + (exact - finer) / 3.0

    def error(counts: tuple[int, ...]) -> float:
        found = [harmonics(name, n, start)[0] - exact for n in counts]
        return float(np.sqrt(np.mean(np.abs(found) ** 2)) / np.max(np.abs(exact)))

    coarse, fine = error((62, 64, 66, 68)), error((496, 512, 528, 544))
    if name == "bonded":
        assert coarse < 1e-11
        return
    assert coarse < 1e-2
    assert np.log(coarse / fine) / np.log(8.0) == pytest.approx(2.0, abs=0.35)


@pytest.mark.parametrize("name", sorted(CASES))
def test_balance_with_many_harmonics_has_the_same_motion(name: str) -> None:
    structure, gaps, laws, load = model(name)
    contacts = ss.Interface(("c",), tuple(laws), gaps)
    system = ss.System(structure, contacts, outputs=np.arange(3))
    order = 31
    sweep = ss.Sweep(
        omega_range=(OMEGA, 1.0001 * OMEGA),
        low=order,
        high=order,
        selection="always_low",
        frequencies=2,
        peak_points=0,
        samples=2048,
    )
    problem = ss.response.forced_problem(system, load, sweep)
    point = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))[0]
    assert point.converged
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    start = start_from_harmonics(motion, OMEGA, gaps, laws)
    size = np.max(np.abs(motion[1]))
    coarse, _ = harmonics(name, 1024, start)
    fine, _ = harmonics(name, 2048, start)
    found = fine + (fine - coarse) / 3.0
    # what 31 harmonics leave out of a force with corners
    assert np.max(np.abs(found - motion[:8])) < 2e-4 * size
