"""Starts from a time integration: where they lead, where they end early, and where there are none."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.many_contacts import Plates, two_plates
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.response.integrated_start import can_integrate, integrated_starts
from stickslip.response.preload import bonded_start, preload
from stickslip.response.system import System
from stickslip.solve.newton import Newton, newton

OMEGA = 2 * np.pi * 1067.0  # 0.6 of the first resonance of the stuck plates
TOLERANCE = 1e-8


@pytest.fixture(scope="module")
def plates() -> Plates:
    """Plates with few contacts."""
    return two_plates(12)


def static_of(plates: Plates) -> np.ndarray:
    """Return the static equilibrium under the clamping."""
    return preload(plates.system, plates.load(0.0).static)


def balance_of(plates: Plates, share: float) -> HarmonicBalance:
    """Return the problem with nine harmonics, its contacts at exact events."""
    system = plates.system
    linear = condense(system.structure, system.retained, plates.load(share))
    return harmonic_balance(linear, system.interface, 9, 128, "events", "dense")


def test_newton_needs_fewer_steps_from_the_first_periods(plates: Plates) -> None:
    """Where contacts lift off, five integrated periods come nearer than the bonded vibration, on which Newton's method takes 39 steps."""
    balance = balance_of(plates, 0.1)
    options = Newton(tolerance=TOLERANCE, max_iterations=60)
    bonded = newton(
        lambda v: balance.linearise(v, OMEGA), bonded_start(balance, OMEGA, plates.system), options
    )
    start = next(integrated_starts(balance, plates.system, OMEGA, static_of(plates)))
    found = newton(lambda v: balance.linearise(v, OMEGA), start, options)
    assert found.status.converged
    assert 2 * found.iterations < bonded.iterations
    assert np.any(balance.contacts(found.x, OMEGA).state == 2)


def test_settled_motion_is_the_solution_and_ends_the_starts(plates: Plates) -> None:
    """Where all contacts stick both are exact but for the step: the integration settles on the bonded vibration and says so."""
    balance = balance_of(plates, 0.03)
    starts = list(integrated_starts(balance, plates.system, OMEGA, static_of(plates), (30,) * 8))
    exact = newton(lambda v: balance.linearise(v, OMEGA), starts[-1], Newton(tolerance=TOLERANCE))
    assert exact.status.converged
    assert len(starts) < 8
    assert np.max(np.abs(starts[-1] - exact.x)) < 1e-3 * np.max(np.abs(exact.x))


def test_no_starts_where_the_integration_is_not_at_home(plates: Plates) -> None:
    """Other laws, areas and massless coordinates are left to other rescues, without an error."""
    system, balance = plates.system, balance_of(plates, 0.1)
    contacts = system.interface
    other = Interface(
        contacts.names, (Jenkins(k_t=1e6, limit=1.0),) * len(contacts.laws), contacts.gap_operator
    )
    light = system.structure.mass.copy()
    light[0, :] = light[:, 0] = 0.0
    refused: list[System] = [
        replace(system, interface=other),
        replace(system, interface=replace(contacts, weights=np.full(len(contacts.laws), 2.0))),
        replace(system, structure=replace(system.structure, mass=light)),
    ]
    assert can_integrate(system)
    for changed in refused:
        assert not can_integrate(changed)
        assert list(integrated_starts(balance, changed, OMEGA, static_of(plates))) == []
