"""Run-up: amplitude along engine-order lines, each speed with its own stiffness and preload."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from newton_bounds import allowed, answer_at
from test_assembly_wheel import H, sector_model, shrouded_sector

import stickslip as ss
from stickslip.analyses.columns import record_of
from stickslip.analyses.run_up.analysis import RUN_UP as RUN_UP_ANALYSIS
from stickslip.analyses.run_up.problem import question_of
from stickslip.analyses.run_up.records import RunUp
from stickslip.analyses.run_up.verdicts import UNKNOWN, case_verdicts
from stickslip.assembly.assembling import assemble
from stickslip.assembly.sides.engine_order_sweep import over_speed, with_engine_order
from stickslip.errors import InputError
from stickslip.reduction.choice import Reduction
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.study.analysis import Case
from stickslip.study.file.study import read_file

pytestmark = pytest.mark.usefixtures("peak_alone")

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
    found = over_speed(model, ORDER, (200.0, 500.0), H)
    assert found.error < 1e-9
    sweep = along((300.0, 340.0), frequencies=3, peak_points=0)
    problem = forced_problem(found.assembled.system, found.assembled.load, sweep)
    point = list(forced_response(problem.system, found.assembled.load, sweep))[1]
    mine = answer_at(problem, point)
    assert mine.energy.max() > 1e-5

    alone = assemble(replace(model, speed=point.omega / ORDER), H)
    one = along((319.0, 321.0), at=(point.omega,), peak_points=0)
    problem = forced_problem(alone.system, alone.load, one)
    (expected,) = forced_response(problem.system, alone.load, one)
    theirs = answer_at(problem, expected)
    for name in ("outputs", "forces", "gaps"):
        own, other = getattr(mine, name), getattr(theirs, name)
        assert np.abs(own - other).max() <= allowed(name, mine, theirs)
    # the preload is that of the speed: at others it is another
    assert np.ptp(np.abs(found.static_force).sum(axis=(1, 2))) > 1.0


def test_the_slope_of_the_line_contains_that_of_the_matrices():
    found = over_speed(turning_model(), ORDER, (200.0, 500.0), H)
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
        over_speed(model, ORDER, (500.0, 200.0), H)
    with pytest.raises(InputError, match="engine orders from 1"):
        over_speed(model, 0, (200.0, 500.0), H)


LUMPED = """schema_version = 2
[part.wheel]
shape = "lumped"
sectors = 6
masses_kg = [0.5, 0.4]
names = ["disk", "tip"]
springs_n_per_m = [["ground", "disk", 4e6], ["disk", "tip", 1e6], ["disk", "next.disk", 5e5]]
dashpots_n_s_per_m = [["ground", "disk", 4.0], ["disk", "tip", 1.0]]
[contact.shroud]
between = ["wheel.tip", "next.wheel.tip"]
law = "jenkins"
acts = "tangential"
tangential_stiffness_n_per_m = 2e5
slip_limit_n = 12.0
[load.gas]
on = "wheel.tip"
force_n = 10.0
engine_order = 2
[output]
points = { tip = "wheel.tip" }
[harmonics]
high = 3
"""
RUN_UP = """[run_up]
speeds_rpm = [8100.0, 9000.0]
engine_orders = [2, 3]
points = 5
peak_points = 1
modes = 2
rate_rpm_per_s = [5000.0]
"""


def small_study(folder, run_up):
    path = folder / "study.toml"
    path.write_text(LUMPED + run_up)
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    path = small_study(tmp_path_factory.mktemp("run_up"), RUN_UP)
    return path, ss.Study.from_file(path).run()


def test_a_study_follows_engine_orders_over_speed(finished):
    path, result = finished
    data = result.data["run_up"].to_dataset().isel(case=0)
    assert data["engine_orders"].values.tolist() == [2, 3]
    assert data["wave_number"].values.tolist() == [2, 3]
    assert np.all(data["converged"].values == 1)
    np.testing.assert_allclose(data["frequency_hz"], data["points_order"] * data["speed_rpm"] / 60, rtol=1e-12)
    top = int(data["peak_point"].values[0])
    assert data["amplitude"].values[top, int(data["report_output"])] == pytest.approx(data["peak_amplitude"].values[0])
    assert data["slipping"].values.max() > 0.5
    assert data["dissipated_w"].values.max() > 0
    assert np.all(data["stuck_hz"].values >= data["open_hz"].values * (1 - 1e-9))
    drawn = data["line_speed_rpm"].values
    assert (drawn[0], drawn[-1]) == pytest.approx((8100.0, 9000.0))
    assert float(data["speed_error"].max()) < 1e-12
    said = " ".join(str(v) for v in result.verdicts).lower()
    assert "engine order 3: the largest amplitude is at an end of the range" in said
    assert "doubtful" not in said
    assert "engine order 2" not in said  # steady or fast, its peak is inside
    # whether more harmonics were examined is told either way
    found = record_of(RunUp, data)
    inside = tuple(replace(line, peak_inside=True) for line in found.lines)
    steady = replace(found, lines=inside, fast=(), limit=0.05)

    def told(error):
        points = tuple(replace(point, error=error) for point in steady.points)
        return [v for v in case_verdicts("", replace(steady, points=points)) if v.why != UNKNOWN.why]

    (calm,) = told(0.0312)
    assert calm.why.endswith("more harmonics are predicted to change their peaks by 3.1 % at most")
    blind = told(np.nan)
    assert [v.level for v in blind] == 2 * ["doubtful"]
    assert "whether more harmonics than H = 1 change the peak was not examined" in blind[0].why
    assert "engine order 3 at 5000 rpm/s: the largest amplitude is at an end of the range" in said
    assert data["fast_amplitude"].values.shape[0] == 2

    hz = float(data["frequency_hz"].values[top])
    alone = ss.Study.from_file(path).model()
    at = alone.forced_response([0.999 * hz, hz, 1.001 * hz], high=3, stability="off")
    single = at.data["forced_response"].to_dataset()
    expected = single["amplitude"].values[np.argmin(abs(single["frequency_hz"].values - hz))]
    np.testing.assert_allclose(data["amplitude"].values[top], expected, rtol=1e-8)


def test_python_and_an_interrupted_run_give_the_same(finished, tmp_path):
    path, result = finished
    model = ss.Study.from_file(path).model()
    keys = {"engine_orders": [3], "points": 5, "peak_points": 1, "modes": 2, "high": 3}
    mine = model.run_up(speeds_rpm=(8100.0, 9000.0), **keys).data["run_up"].to_dataset()
    theirs = result.data["run_up"].to_dataset()
    own = theirs["points_order"].values[0] == 3
    np.testing.assert_array_equal(mine["amplitude"].values[0], theirs["amplitude"].values[0][own])
    page = result.report(tmp_path / "report.html").read_text()
    for words in ("Campbell diagram with the response", "Amplitude over speed", "engine order"):
        assert words in page

    question = question_of(case_of(path), model)
    points = list(RUN_UP_ANALYSIS.solve(question, (), Kept()))
    notes = Kept()
    again = [*points[:6], *RUN_UP_ANALYSIS.solve(question, points[:6], notes)]
    assert [(p.stage, p.engine_order, p.omega) for p in again] == [(p.stage, p.engine_order, p.omega) for p in points]
    for one, other in zip(again, points, strict=True):
        np.testing.assert_array_equal(one.coefficients, other.coefficients)


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ({"rpm": (8300.0, 8800.0)}, "engine order 2: the peak lies "),
        ({"rpm": (8000.0, 8800.0)}, "the run-up leaves out some of the operating speeds, 8000 to 8800 rpm"),
        ({"hz": (275.0, 290.0)}, "operating range, 275 to 290 Hz"),
    ],
)
def test_peaks_are_held_against_the_operating_range(finished, ends, said):
    """The largest amplitude inside is that of the points, or lies on the straight line between two at an end."""
    data = finished[1].data["run_up"].to_dataset().isel(case=0)
    given = {f"operating_{end}_{unit}": r[i] for unit, r in ends.items() for i, end in enumerate(("lowest", "highest"))}
    found = replace(record_of(RunUp, data), limit=0.05, **given)
    told = [v.why for v in case_verdicts("", found)]
    assert any(said in why for why in told), told
    (unit, (low, high)) = next(iter(ends.items()))
    for line in found.lines:
        at = {"rpm": 1.0, "hz": line.engine_order / 60.0}[unit]
        own = found.along(line)
        fine = np.linspace(max(low / at, own[0].speed_rpm), min(high / at, own[-1].speed_rpm), 20001)
        straight = np.interp(fine, [p.speed_rpm for p in own], [p.amplitude[found.report_output] for p in own])
        size, rpm = found.largest_in_operation(line)
        if fine[0] > fine[-1]:
            assert np.isnan(size)
        else:
            assert size == pytest.approx(straight.max(), rel=1e-3)
            assert low / at <= rpm <= high / at


class Kept(dict):
    """Notes of a job, in memory."""

    def put(self, name, values):
        self[name] = values

    def forget(self, name):
        self.pop(name, None)


def case_of(path):
    (tables,) = read_file(path).cases
    return Case(0, "", {}, tables.tables, lambda: None, "", path.parent)


AERO = """[aero]
file = "coefficients.csv"
shapes = "blade_alone"
clamped = "wheel.disk"
mode = 1
reference_hz = 250.0
"""
MISTUNED = '[mistuning.blades]\nof = "wheel.tip"\ndistribution = "normal"\nstandard_deviation = 0.01\nseed = 1\n'
RIGID = LUMPED.replace('"jenkins"', '"rigid_coulomb"').replace(
    'acts = "tangential"\ntangential_stiffness_n_per_m = 2e5\nslip_limit_n = 12.0',
    "friction_coefficient = 0.5\npreload_n = 4.0",
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (LUMPED + AERO + RUN_UP, r"run_up: does not follow the aerodynamic forces of \[aero\]"),
        (LUMPED + MISTUNED + RUN_UP, r"run_up: is of tuned wheels, and \[mistuning.blades\]"),
        (RIGID + RUN_UP, r"run_up.rate_rpm_per_s: .*contact.shroud.law"),
    ],
)
def test_what_does_not_go_with_the_speed_is_refused_before_anything_is_computed(tmp_path, text, said):
    path = tmp_path / "study.toml"
    path.write_text(text)
    flutter = Path(__file__).parents[1] / "examples" / "flutter_ring" / "coefficients.csv"
    shutil.copy(flutter, tmp_path)
    with pytest.raises(InputError, match=f"study.toml: {said}"):
        ss.Study.from_file(path).check()


def test_keys_of_a_run_up_that_do_not_fit_are_named(tmp_path):
    for wrong, said in (
        ("[run_up]\nspeeds_rpm = [8000.0, 5000.0]", "speeds_rpm"),
        ("[run_up]\nspeeds_rpm = [0.0, 5000.0]", "speeds_rpm"),
        ("speeds_rpm = [1200.0, 1700.0]\nengine_orders = [2, 2]", "engine_orders"),
    ):
        with pytest.raises(InputError, match=said):
            ss.Study.from_file(small_study(tmp_path, wrong))
