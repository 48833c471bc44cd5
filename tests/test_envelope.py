"""Fast run-up: slowly varying amplitudes against the swept resonance by quadrature, and against all sectors in time."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from test_run_up import LUMPED

import stickslip as ss
from stickslip.assembly.sides.engine_order_sweep import over_speed, with_engine_order
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure
from stickslip.response.rotating.envelope import SweepInTime, envelope, neglected
from stickslip.response.system import System
from stickslip.study.analysis import named
from stickslip.units import RPM


def oscillator(natural, ratio, share=0.1, limit=1e9):
    """Return a mass that a contact holds with a share of the stiffness while it sticks, under a unit force."""
    stiffness = natural**2
    table = Dofs(np.array([0]), ("x",), np.zeros((1, 3)))
    own = Structure(np.eye(1), 2 * ratio * natural * np.eye(1), (1 - share) * stiffness * np.eye(1), table)
    gap = np.array([[1.0], [0.0], [0.0]])
    law = Jenkins(k_t=share * stiffness, limit=limit)
    system = System(own, Interface(("c",), (law,), gap), np.array([0]))
    return system, HarmonicLoad(np.zeros(1), {1: np.ones(1, dtype=complex)})


def swept_by_quadrature(natural, ratio, ends, seconds, steps=400_000):
    """Return times and complex motion of ``x'' + 2ζω₀x' + ω₀²x = exp(iφ)``, φ'' constant, from the steady motion at the first frequency.

    Duhamel's integral (Lewis 1932) by the trapezoidal rule.
    """
    first, last = ends
    time = np.linspace(0.0, seconds, steps + 1)
    force = np.exp(1j * (first * time + (last - first) / seconds * time**2 / 2))
    damped = natural * np.sqrt(1 - ratio**2)
    root = complex(-ratio * natural, damped)

    def convolved(rate):
        decay = np.exp(rate * time[1])
        drive = time[1] / 2 * (decay * force[:-1] + force[1:])
        return np.concatenate([[0.0], scipy.signal.lfilter([1.0], [1.0, -decay], drive)])

    forced = (convolved(root) - convolved(np.conj(root))) / (2j * damped)
    place = 1.0 / (natural**2 - first**2 + 2j * ratio * natural * first)
    ahead = (1j * first - np.conj(root)) * place / (2j * damped)
    free = ahead * np.exp(root * time) + (place - ahead) * np.exp(np.conj(root) * time)
    return time, forced + free


def test_the_swept_resonance_is_that_of_the_quadrature_the_better_the_slower():
    natural, ratio, ends = 100.0, 0.01, (70.0, 130.0)
    system, load = oscillator(natural, ratio)
    steady = 1 / (2 * ratio * natural**2 * np.sqrt(1 - ratio**2))
    errors = []
    for seconds in (5.0, 20.0):
        rate = (ends[1] - ends[0]) / seconds
        sweep = SweepInTime(ends=ends, rate=rate, tolerance=3e-5)
        points = list(envelope(system, load, sweep))
        assert points[-1].converged
        assert points[-1].omega == pytest.approx(ends[1])
        size = np.array([abs(p.coefficients[1, 0]) for p in points])
        time, exact = swept_by_quadrature(natural, ratio, ends, seconds)
        top = int(np.argmax(abs(exact)))
        assert abs(exact[top]) < 0.8 * steady  # the peak is reduced, and late
        assert ends[0] + rate * time[top] > natural * 1.02
        errors.append(size.max() / abs(exact[top]) - 1)
        late = points[int(size.argmax())].omega
        assert late == pytest.approx(ends[0] + rate * time[top], rel=2e-3)
    assert abs(errors[0]) < 0.022
    assert abs(errors[1]) < 0.4 * abs(errors[0])


def chirp(order, rpm, seconds):
    """Return frequencies, the motion of one tip and the share of time that its contact slips while all sectors of the lumped wheel run up, by small steps, without any harmonics."""
    sectors = 6
    phase = 2 * np.pi * order * np.arange(sectors) / sectors
    first, last = (order * n * RPM for n in rpm)
    steps = int(seconds * last / (2 * np.pi) * 120)
    dt = seconds / steps
    place, speed = np.zeros((sectors, 2)), np.zeros((sectors, 2))
    friction, gap_before = np.zeros(sectors), np.zeros(sectors)
    found, slipping = np.zeros(steps), 0
    for i in range(steps):
        time = i * dt
        angle = first * time + (last - first) / seconds * time**2 / 2
        disk, tip = place.T
        gap = np.roll(tip, -1) - tip
        friction = np.clip(friction + 2e5 * (gap - gap_before), -12.0, 12.0)
        gap_before = gap
        slipping += abs(friction[0]) == 12.0
        blade = 1e6 * (tip - disk) + (speed[:, 1] - speed[:, 0])
        ring = 5e5 * (np.roll(disk, -1) - disk)
        on_disk = -4e6 * disk - 4.0 * speed[:, 0] + blade + ring - np.roll(ring, 1)
        on_tip = -blade + friction - np.roll(friction, 1) + 10.0 * np.cos(angle + phase)
        speed += dt * np.column_stack([on_disk / 0.5, on_tip / 0.4])
        place += dt * speed
        found[i] = tip[0]
    return np.linspace(first, last, steps), found, slipping / steps


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    path = tmp_path_factory.mktemp("wheel") / "study.toml"
    path.write_text(LUMPED + "[run_up]\nspeeds_rpm = [3500.0, 10000.0]\n")
    return ss.Study.from_file(path).model()


@pytest.mark.validation
def test_a_wheel_with_friction_peaks_as_all_its_sectors_in_time(wheel):
    order, rpm, seconds = 2, (3500.0, 10000.0), 0.3
    lowest, highest = (n * RPM for n in rpm)
    along = over_speed(with_engine_order(wheel, order), order, (lowest, highest), 6)
    rate = order * (highest - lowest) / seconds
    sweep = SweepInTime(ends=(order * lowest, order * highest), rate=rate, harmonics=3)
    points = list(envelope(along.assembled.system, along.assembled.load, sweep))
    angle = np.exp(1j * np.outer(np.linspace(0, 2 * np.pi, 65), np.arange(4)))
    tip = along.assembled.system.outputs[0]
    size = np.array([np.real(angle @ p.coefficients[:, tip]).max() for p in points])
    omega, motion, slip = chirp(order, rpm, seconds)
    top = int(np.argmax(abs(motion)))
    assert size.max() == pytest.approx(abs(motion[top]), rel=6e-3)
    assert points[int(size.argmax())].omega == pytest.approx(omega[top], rel=7e-3)
    assert slip > 0.05  # for a good part of the run-up


EXAMPLE = Path(__file__).parents[1] / "examples" / "run_up" / "study.toml"
SMALL = {
    "disk_size_m = 0.030": "disk_size_m = 0.06",
    "platform_size_m = 0.012": "platform_size_m = 0.03",
    "airfoil_size_m = 0.016": "airfoil_size_m = 0.04",
    "fixed_interface_modes = 15": "fixed_interface_modes = 5",
    "speeds_rpm = [3800.0, 7600.0]": "speeds_rpm = [6150.0, 6700.0]\ntolerance = 1e-4",
    "engine_orders = [5, 6, 8]": "engine_orders = [5]",
    "peak_points = 6": "peak_points = 2",
    "points = 20": "points = 3",
    "modes = 3 ": "modes = 1 ",
    "high = 3": "high = 1",
    "rate_rpm_per_s = [4000.0]": "rate_rpm_per_s = [1000.0, 30000.0]",
}


@pytest.mark.validation
def test_the_example_tells_what_a_fast_run_up_takes_off_the_peak(tmp_path):
    """Small: one engine order, a coarse mesh; rates of which one is slow enough to be steady."""
    text = EXAMPLE.read_text()
    for whole, few in SMALL.items():
        assert whole in text
        text = text.replace(whole, few, 1)
    path = tmp_path / "study.toml"
    path.write_text(text)
    result = ss.Study.from_file(path).run()
    data = result.data["run_up"].to_dataset().isel(case=0)
    assert data["slipping"].values.max() > 0.5
    ratio, shift = data["fast_ratio"].values, data["fast_shift_rpm"].values
    assert ratio[0] == pytest.approx(1.0, abs=2e-3)
    assert ratio[1] < 0.99
    assert -1.0 < shift[0] < shift[1]
    assert np.all(data["fast_finished"].values == 1)
    assert data["fast_neglected"].values[0] < data["fast_neglected"].values[1] < 0.05
    assert not [v for v in result.verdicts if "left out" in v.why]
    assert [table.title for table in named("run_up").summary(result["run_up"])][-1] == "Fast run-up"
    assert "Fast run-up" in result.report(tmp_path / "report.html").read_text()


def test_a_later_phase_of_the_load_is_one_of_every_amplitude():
    """With slip in harmonics 1 to 3; twice the load and twice the limit of friction move twice as much."""
    sweep = SweepInTime(ends=(80.0, 90.0), rate=8.0, harmonics=3)
    found = []
    for size, phase in ((1.0, 0.0), (1.0, 0.7), (2.0, 0.0)):
        system, load = oscillator(100.0, 0.01, 0.3, 8.0 * size)
        turned = 10.0 * size * np.exp(1j * phase) * load.harmonics[1]
        found.append([*envelope(system, HarmonicLoad(load.static, {1: turned}), sweep)])
    first, later, twice = found
    turn = np.exp(0.7j * np.arange(4))
    last, own = first[-1].coefficients[:, 0], later[-1].coefficients[:, 0]
    assert abs(last[3]) > 1e-3 * abs(last[1])
    np.testing.assert_allclose(own, turn * last, atol=2e-4 * abs(last[1]))
    np.testing.assert_allclose(twice[-1].coefficients[:, 0], 2 * last, atol=2e-4 * abs(last[1]))


def test_what_slow_amplitudes_leave_out_is_half_the_beat_over_the_frequency():
    time = np.sort(np.random.default_rng(0).uniform(0, 1, 400))
    share = neglected(time, np.exp(8j * time), np.full(400, 100.0))
    assert share == pytest.approx(8 / 200, rel=0.02)


def test_a_sweep_that_is_none_is_refused():
    system, _ = oscillator(100.0, 0.01)
    with pytest.raises(InputError, match="above zero"):
        SweepInTime(ends=(70.0, 130.0), rate=-1.0)
    with pytest.raises(InputError, match="harmonic"):
        list(envelope(system, HarmonicLoad(np.zeros(1), {2: np.ones(1)}), SweepInTime(ends=(70.0, 130.0), rate=1.0)))
