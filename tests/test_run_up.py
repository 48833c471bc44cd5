"""Run-up: amplitude along engine-order lines, each speed with its own stiffness and preload."""

from dataclasses import replace

import numpy as np
import pytest
from test_assembly_wheel import H, sector_model, shrouded_sector

from stickslip.assembly.over_speed import over_speed, with_engine_order
from stickslip.errors import InputError
from stickslip.reduction.choice import Reduction
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.response.recovery import fields

ORDER = 42  # wave 2 of five, at 2000 to 2300 Hz where the shrouds are pressed


def turning_model(modes=8, **changes):
    model = with_engine_order(replace(sector_model(shrouded_sector()), **changes), ORDER)
    blade = replace(model.parts["blade"], reduction=None if modes is None else Reduction(modes))
    gas = {"gas": model.loads["gas"]}
    return replace(model, parts={"blade": blade}, loads=gas)


def along(speeds, **others):
    lowest, highest = (ORDER * speed for speed in speeds)
    return Sweep(omega_range=(lowest, highest), low=H, high=H, selection="always_low", **others)


@pytest.mark.parametrize(("modes", "coriolis"), [(8, True), (None, False)])
def test_each_point_is_that_of_a_study_at_its_speed(modes, coriolis):
    """With slip; the speed is none of those that the polynomials go through. A reduction has modes of its own at each speed."""
    model = turning_model(modes, coriolis=coriolis)
    found = over_speed(model, (200.0, 500.0), H)
    assert found.error < 1e-9
    sweep = along((300.0, 340.0), frequencies=3, peak_points=0)
    problem = forced_problem(found.assembled.system, found.assembled.load, sweep)
    point = list(forced_response(problem.system, found.assembled.load, sweep))[1]
    mine = fields(problem, point)
    assert mine.energy.max() > 1e-5

    alone = replace(model, speed=point.omega / ORDER).assembled(H)
    one = along((319.0, 321.0), at=(point.omega,), peak_points=0)
    problem = forced_problem(alone.system, alone.load, one)
    (expected,) = forced_response(problem.system, alone.load, one)
    theirs = fields(problem, expected)
    for name in ("outputs", "forces", "gaps"):
        own, other = getattr(mine, name), getattr(theirs, name)
        assert np.abs(own - other).max() < 1e-8 * np.abs(other).max()
    # the preload is that of the speed: at others it is another
    assert np.ptp(np.abs(found.static_force).sum(axis=(1, 2))) > 1.0


def test_the_slope_of_the_line_contains_that_of_the_matrices():
    found = over_speed(turning_model(), (200.0, 500.0), H)
    load = found.assembled.load
    linear = found.assembled.system.condensed(load, H)
    omega, step = ORDER * 320.0, ORDER * 320.0 * 1e-5
    here, less, more = (linear.condensed(w, H) for w in (omega, omega - step, omega + step))
    for slope, name in ((here.derivative, "stiffness"), (here.load_derivative, "load")):
        expected = (getattr(more, name) - getattr(less, name)) / (2 * step)
        assert np.abs(slope - expected).max() < 1e-4 * np.abs(expected).max()
    harmonics = tuple(range(H + 1))
    products = linear.products(omega, harmonics)
    rows = np.random.default_rng(0).standard_normal((2 * H + 1, linear.n))
    _, slope = products.product_and_slope(rows)
    both = [linear.products(w, harmonics).product(rows) for w in (omega - step, omega + step)]
    expected = (both[1] - both[0]) / (2 * step)
    assert np.abs(slope - expected).max() < 1e-4 * np.abs(expected).max()
    half = linear.with_load(replace(load, harmonics={1: 0.5 * load.harmonics[1]}))
    np.testing.assert_allclose(half.condensed(omega, 1).load[1], 0.5 * here.load[1], rtol=1e-12)
    with pytest.raises(InputError, match="no multiple"):
        linear.with_load(replace(load, harmonics={1: load.harmonics[1] + 1.0}))


def test_what_a_line_of_speeds_cannot_be_is_named():
    model = turning_model()
    with pytest.raises(InputError, match="growing speeds"):
        over_speed(model, (500.0, 200.0), H)
    still = {"gas": replace(model.loads["gas"], engine_order=0)}
    with pytest.raises(InputError, match="engine order"):
        over_speed(replace(model, loads=still), (200.0, 500.0), H)
