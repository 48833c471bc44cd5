"""All sectors of a tuned wheel in time, against the balance of one sector, and shooting over a share of the period."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
from test_reduced_wheel import TILTED, shrouded

import stickslip as ss
from evidence.models.lumped_disks import RING_HOLD, TIP, friction_ring
from evidence.validation.case_b9_friction_ring import RETENTION, damped_wheel
from stickslip.analyses.forced_response.stability.in_time import integrated
from stickslip.contact.neighbours import neighbour_gaps
from stickslip.errors import InputError
from stickslip.response.time.sectors import SectorsInTime, all_sectors
from stickslip.response.time.shooting import ShootingResult, shoot
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.transient import TimeStepping


def ring(order: int) -> tuple[ss.System, ss.HarmonicLoad]:
    """The blisk with a friction ring of literature benchmark B9: 24 sectors under engine order 2, of which 12 do different things."""
    wheel, operator = friction_ring(order)
    contacts = ss.Interface(("ring",), (ss.Jenkins(k_t=2e7, limit=4.0),), operator)
    force = np.zeros(6)
    force[TIP] = 1.0
    load = ss.HarmonicLoad(np.zeros(wheel.n), {1: wheel.project(force, 1)})
    return ss.System(wheel, contacts, outputs=np.arange(wheel.n)), load


def balanced(system: ss.System, load: ss.HarmonicLoad, omega: float, order: int) -> np.ndarray:
    """Amplitudes (order + 1, n) of one sector."""
    sweep = ss.Sweep(
        omega_range=(omega, 1.0001 * omega), low=order, high=order, selection="always_low", frequencies=2, peak_points=0
    )
    problem = ss.response.forced_problem(system, load, sweep)
    point = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))[0]
    assert point.converged
    return problem.low.linear.recover(point.omega, point.coefficients)


def shot(whole: SectorsInTime, motion: np.ndarray, omega: float, steps: int, **more) -> ShootingResult:
    gaps, laws = whole.contacts.gap_operator, whole.contacts.laws
    start = start_from_harmonics(whole.spread(motion), omega, gaps, laws)
    stepping = TimeStepping(steps, tolerance=1e-9, max_periods=200)
    found = shoot(whole.structure, gaps, laws, whole.load, omega, np.arange(whole.structure.n), start, stepping, **more)
    assert found.converged
    return found


def test_all_sectors_move_as_the_balance_of_one_and_one_share_of_the_period_tells_all() -> None:
    (system, load), omega = ring(13), 2 * math.pi * 624.0
    motion, whole = balanced(system, load, omega, 13), all_sectors(system, load)
    assert whole.motion.sectors == 12
    size = np.abs(motion[1]).max()
    every = shot(whole, motion, omega, 1200)
    one = shot(whole, motion, omega, 1200, symmetry=whole.motion)
    # 13 harmonics and 1200 steps
    assert np.abs(every.harmonics[:2] - whole.spread(motion)[:2]).max() < 2e-4 * size
    # but for the mean of the ring, which 0.1 N/m holds: a multiplier within 1e-6 of 1
    assert np.abs(one.harmonics[1:] - every.harmonics[1:]).max() < 1e-8 * size
    # the same multipliers; those that slip has deleted are roots of rounding
    ours, theirs = (f.floquet.multipliers[np.abs(f.floquet.multipliers) > 1e-3] for f in (one, every))
    assert ours.size == theirs.size > 12
    for value in theirs:
        assert np.abs(ours - value).min() < 1e-6


@pytest.mark.parametrize("relative", [None, False])
def test_contacts_between_sectors_in_either_coordinates(relative: bool | None) -> None:
    """Gaps as coordinates, and nodes whose neighbours' motion is a copy: the copies follow without mass."""
    sector, (low, high) = shrouded(3)
    free, order, omega = sector.structure, 9, 0.9
    stiffness = (free.stiffness + 0.8 * scipy.sparse.eye_array(free.n)).tocsr()
    damping = (0.06 * stiffness + 0.02 * free.mass).tocsr()
    sector = replace(sector, structure=replace(free, stiffness=stiffness, damping=damping))
    law = ss.ElasticCoulomb(k_t=2.0, k_w=1.5, k_n=3.0, mu=0.4, preload=0.5)
    static, force = np.zeros((2, free.n))
    static[low], force[high] = (0.2, -0.1, 0.15), (1.5, 1.0, -0.5)
    place = {"low": "left", "high": "right", "axis": TILTED, "normal": np.array([0.6, 0.0, 0.8])}
    between, following = neighbour_gaps(sector.structure, 3, **place)
    ground = scipy.sparse.csr_array((np.ones(3), (np.arange(3), low)), shape=between.shape)
    gaps = (scipy.sparse.vstack([between, ground]).tocsr(), scipy.sparse.vstack([following, 0.0 * ground]).tocsr())
    wheel, operator = ss.reduction.tuned_wheel(sector, 1, order, gaps, relative=relative)
    assert (wheel.multipliers.size > 0) == (relative is False)
    spring = ss.Jenkins(k_t=0.5, k_w=0.4, k_n=0.3, limit=0.1)
    contacts = ss.Interface(("shroud", "ground"), (law, spring), operator)
    system = ss.System(wheel, contacts, np.arange(1))
    load = ss.HarmonicLoad(wheel.project(static, 0).real, {1: wheel.project(force, 1)})
    motion, whole = balanced(system, load, omega, order), all_sectors(system, load)
    own = whole.structure.n // 3
    found = shot(whole, motion, omega, 768, symmetry=whole.motion)
    assert np.any(found.contact_force[:, 0, 2] == 0.0)  # it lifts off
    expected, size = motion[:4, :own], np.abs(motion[1, :own]).max()
    assert np.abs(found.harmonics[:4, :own] - expected).max() < 2e-3 * size
    second = shot(whole, motion, omega, 768)
    assert np.abs(second.harmonics - found.harmonics).max() < 1e-7 * size


def test_the_check_inside_a_run_integrates_all_sectors() -> None:
    (system, load), omega = ring(13), 2 * math.pi * 624.0
    sweep = ss.Sweep(
        omega_range=(omega, 1.0001 * omega), low=13, high=13, selection="always_low", frequencies=2, peak_points=0
    )
    problem = ss.response.forced_problem(system, load, sweep)
    point = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))[0]
    found = integrated(problem, point, load, periods=8)
    balance = ss.response.fields(problem, point).outputs[1]
    # near the balance's motion, whose transient of 13 harmonics dies in hundreds of periods
    assert np.abs(found.harmonics[1] - balance).max() < 1e-4 * np.abs(balance).max()
    assert found.contact_force.shape == (1024, 12, 3)


def test_what_cannot_be_integrated_is_refused() -> None:
    system, load = ring(3)
    with pytest.raises(InputError, match=r"has no wave 8: it was made for harmonics up to 3. Give tuned_wheel 6"):
        all_sectors(system, load)
    one = ss.model.lumped(np.ones(1), np.ones((1, 1)))
    alone = replace(
        system, structure=one, interface=replace(system.interface, gap_operator=np.eye(3)[:, :1]), outputs=np.arange(1)
    )
    with pytest.raises(InputError, match="got no tuned wheel"):
        all_sectors(alone, load)
    system, load = ring(13)
    whole = all_sectors(system, load)
    with pytest.raises(InputError, match=r"is 1000, which 12 sectors cannot share. Give a multiple, such as 1008"):
        shot(whole, np.zeros((2, system.structure.n)), 3900.0, 1000, symmetry=whole.motion)


def test_one_share_of_one_wave_moves_as_all_24_sectors_that_know_of_no_waves() -> None:
    (system, load), omega, steps = ring(13), 2 * math.pi * 624.0, 600
    whole = all_sectors(system, load)
    one = shot(whole, balanced(system, load, omega, 13), omega, steps, symmetry=whole.motion)
    # 96 masses with a slider between ring and disk in every sector, from rest
    wheel = damped_wheel()
    stiffness = wheel.stiffness.copy()
    stiffness[wheel.sets["ring"], wheel.sets["ring"]] += RING_HOLD - RETENTION
    wheel = replace(wheel, stiffness=stiffness)
    gaps, along = np.zeros((72, wheel.n)), 3 * np.arange(24)
    gaps[along, wheel.sets["disk"]], gaps[along, wheel.sets["ring"]] = 1.0, -1.0
    force = np.zeros(wheel.n, dtype=complex)
    force[wheel.sets["tip"]] = np.exp(2j * np.pi * 2 * np.arange(24) / 24)
    laws = (ss.Jenkins(k_t=2e7, limit=4.0),) * 24
    every = shoot(
        wheel,
        gaps,
        laws,
        ss.HarmonicLoad(np.zeros(wheel.n), {1: force}),
        omega,
        wheel.sets["tip"],
        stepping=TimeStepping(steps, tolerance=1e-9, max_periods=400),
    )
    assert every.converged
    tips = [i for i, name in enumerate(whole.structure.dofs.labels) if name.endswith("node2.x")]
    tips_of_one = np.tile(one.harmonics[:, tips], 2)
    size = np.abs(tips_of_one[1]).max()
    assert np.abs(every.harmonics[1:] - tips_of_one[1:]).max() < 1e-7 * size
    # literature benchmark B9 with 13 harmonics
    assert size == pytest.approx(1.67785425e-5, rel=5e-5)
    # the wheel has the multipliers of the share, and those of the other waves
    found = one.floquet.multipliers
    for value in found[np.abs(found) > 1e-3]:
        assert np.abs(every.floquet.multipliers - value).min() < 1e-6
