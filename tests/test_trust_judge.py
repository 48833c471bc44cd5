"""The judge of trusted points against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from evidence.trust.ask import asked, model_of
from evidence.trust.draw import Contact, Machine, draw
from evidence.trust.march import Judge

ONE = np.ones(1)


def one_mass(contact: Contact, force: float, damping: float = 0.2) -> Machine:
    """Return a mass of 1 kg on a spring of 1 N/m with one contact to the ground."""
    return Machine(
        0,
        "line",
        np.eye(1),
        damping * np.eye(1),
        np.eye(1),
        (1,),
        ("x",),
        (contact,),
        np.array([force + 0j]),
        np.zeros(1),
        1,
        (0.1, 0.2),
    )


@pytest.mark.validation
def test_a_slider_that_sticks_is_a_spring() -> None:
    """Motion and multiplier are those of the mass on both springs."""
    machine = one_mass(Contact("slider", ONE, 0 * ONE, stiffness=3.0, limit=1e6), 1.0)
    omega = 1.7
    found = Judge(machine, omega).orbit(np.array([[0j], [0.3 + 0j]]))
    assert found is not None
    assert found.motion[1, 0] == pytest.approx(1 / (4.0 - omega**2 + 0.2j * omega), rel=1e-9)
    assert found.multiplier == pytest.approx(np.exp(-0.1 * 2 * np.pi / omega), rel=1e-6)


@pytest.mark.validation
def test_a_slider_at_the_edge_of_the_places_at_which_it_sticks_is_a_spring() -> None:
    """It slips once as the load's mean begins to act, and then rests: slip to one side only is no property of the motion."""
    omega, spring = 1.7, 3.0
    size = abs(1 / (1.0 + spring - omega**2 + 0.2j * omega))
    contact = Contact("slider", ONE, 0 * ONE, stiffness=spring, limit=1.2 * spring * size)
    machine = replace(one_mass(contact, 1.0), static=np.array([2.0]))
    found = Judge(machine, omega).orbit(np.array([[0.8 * size + 0j], [size + 0j]]))
    assert found is not None
    assert abs(found.motion[1, 0]) == pytest.approx(size, rel=1e-9)
    assert found.multiplier == pytest.approx(np.exp(-0.1 * 2 * np.pi / omega), rel=1e-6)


@pytest.mark.validation
def test_the_multiplier_of_a_mass_between_stop_and_slider_has_the_error_that_is_told() -> None:
    """The times at which a contact begins and ceases to act decide it: found with an eighth of the step, the same."""
    stop = Contact("stop", 0 * ONE, ONE, stiffness=400.0, clearance=0.3)
    slider = Contact("slider", ONE, 0 * ONE, stiffness=5.0, limit=0.2)
    machine = replace(one_mass(stop, 1.0, damping=0.02), contacts=(stop, slider))
    found = Judge(machine, 1.3).orbit(np.array([[0j], [0.3 - 0.3j]]))
    assert found is not None
    fine = Judge(machine, 1.3)
    fine.steps *= 8
    exact = fine.orbit(found.motion)
    assert exact is not None
    assert found.multiplier_error < 2e-4
    assert abs(found.multiplier - exact.multiplier) <= 3.0 * found.multiplier_error + 1e-6


@pytest.mark.validation
def test_friction_takes_the_area_of_its_loop() -> None:
    """The load's work in a cycle is that of the dashpot and of 4 x limit x slip."""
    machine = one_mass(Contact("slider", ONE, 0 * ONE, stiffness=5.0, limit=0.3), 1.0)
    omega = 1.1
    found = Judge(machine, omega).orbit(np.array([[0j], [1.0 - 1.0j]]))
    assert found is not None
    h = np.arange(len(found.motion))
    tau = np.linspace(0.0, 2 * np.pi, 4096, endpoint=False)
    x = (found.motion[:, 0] * np.exp(1j * h * tau[:, None])).real.sum(axis=1)
    work = -np.pi * found.motion[1, 0].imag
    dashpot = np.pi * omega * 0.2 * float(np.sum(h**2 * np.abs(found.motion[:, 0]) ** 2))
    slip = np.ptp(x) - 2 * 0.3 / 5.0
    assert work == pytest.approx(dashpot + 2 * 0.3 * slip, rel=2e-3)  # harmonics up to 5 alone


@pytest.mark.validation
def test_the_middle_branch_of_a_hardening_oscillator_is_unstable() -> None:
    """Three motions at one frequency: the middle one has a real multiplier above 1, the others do not."""
    machine = one_mass(Contact("cubic", ONE, 0 * ONE, stiffness=1.0), 0.3, damping=0.05)
    omega = 1.6
    judge = Judge(machine, omega)
    roots = np.roots([(3 / 4) ** 2, 2 * (3 / 4) * (1 - omega**2), (1 - omega**2) ** 2 + (0.05 * omega) ** 2, -(0.3**2)])
    sizes = np.sqrt(np.sort(roots[np.abs(roots.imag) < 1e-9].real))
    assert sizes.size == 3
    largest = []
    for a in sizes:
        phase = np.angle(1 / (1 - omega**2 + 0.75 * a**2 + 0.05j * omega))
        found = judge.orbit(np.array([[0j], [a * np.exp(1j * phase)]]))
        assert found is not None
        largest.append(found.multiplier)
    assert largest[1] > 1.01
    assert max(largest[0], largest[2]) < 0.99


@pytest.mark.validation
def test_the_turn_of_a_branch_is_found_beside_its_frequency() -> None:
    """Just beyond a turn no motion of the branch has the told frequency: the nearest is the turn's own, and farther off none of it counts."""
    machine = one_mass(Contact("cubic", ONE, 0 * ONE, stiffness=1.0), 0.3, damping=0.1)
    omega, step = 1.7796, 2e-5
    motion = np.array([[0j], [-0.08 - 1.67j]])
    while step > 2e-7:
        found = Judge(machine, omega + step).orbit(motion)
        if found is not None and found.shift == 0.0:
            omega, motion = omega + step, found.motion
        else:
            step /= 10
    beyond = Judge(machine, omega * (1 + 4e-6)).orbit(motion)
    assert beyond is not None
    assert 1e-6 < beyond.shift < 1e-5
    assert beyond.motion[1, 0] == pytest.approx(motion[1, 0], rel=0.01)
    assert abs(beyond.multiplier - 1.0) <= beyond.multiplier_error
    far = Judge(machine, omega * (1 + 1e-3)).orbit(motion)
    assert far is None or abs(far.motion[1, 0] / motion[1, 0] - 1.0) > 0.5


def lifting_pad(omega: float) -> tuple[Machine, np.ndarray]:
    """Return two coupled dofs on a pad that opens once in a cycle, and the motion that they settle on."""
    stiffness = np.array([[1.0, 0.3], [0.3, 2.0]])
    pad = Contact(
        "pad",
        np.array([1.0, 0.0]),
        np.array([0.0, 1.0]),
        stiffness=5.0,
        normal_stiffness=20.0,
        friction=0.4,
        preload=0.1,
    )
    machine = Machine(
        0,
        "pad",
        np.eye(2),
        0.08 * np.eye(2),
        stiffness,
        (1, 1),
        ("x", "z"),
        (pad,),
        np.array([0.2 + 0j, 0.3 + 0.1j]),
        np.array([0.0, 0.1]),
        1,
        (0.9 * omega / (2 * np.pi), 1.1 * omega / (2 * np.pi)),
    )
    judge, state = Judge(machine, omega), np.zeros(5)
    for _ in range(200):
        state, motion, *_ = judge.flow(state, omega, judge.steps)
    return machine, motion


@pytest.mark.validation
def test_a_landing_that_moves_in_time_counts_in_the_multipliers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A slider holds where its pad touches: the map of a period knows this from disturbances within a step as from those over many."""
    machine, motion = lifting_pad(1.7)
    narrow = Judge(machine, 1.7).orbit(motion)
    monkeypatch.setattr("evidence.trust.march.NUDGE", 1e-3)
    wide = Judge(machine, 1.7).orbit(motion)
    assert narrow is not None
    assert wide is not None
    assert narrow.multiplier == pytest.approx(wide.multiplier, abs=5e-3)  # 0.13 apart without


@pytest.mark.validation
def test_the_package_tells_the_multiplier_of_a_pad_that_lifts() -> None:
    """Two programs, one by balance and transitions, one by marching."""
    machine, motion = lifting_pad(1.7)
    found = Judge(machine, 1.7).orbit(motion)
    assert found is not None
    hz = 1.7 / (2 * np.pi)
    data = model_of(machine).forced_response(hz=[hz, 1.01 * hz, 1.02 * hz])["forced_response"]
    own = int(np.argmin(np.abs(data.stability_frequency_hz.values - hz)))
    assert data.stability_frequency_hz.values[own] == hz
    error = float(data.stability_multiplier_error[own]) + 3 * found.multiplier_error
    assert error < 0.03  # a landing that does not move in time takes 0.036 off
    assert abs(float(data.stability_multiplier[own]) - found.multiplier) <= error


@pytest.mark.validation
@pytest.mark.parametrize(("number", "hz"), [(7, 385.9525), (18, 73.3909)])
def test_a_stable_point_beside_a_fold_is_the_motion_that_is_stable(number: int, hz: float) -> None:
    """Seed 115006: few harmonics lay nearer to the unstable motion (multipliers 1.010 and 1.292), and more led to the stable one."""
    machine = draw(115006, number)
    told = asked(machine)
    at = int(np.argmin(np.abs(told.hz - hz)))
    assert told.hz[at] == pytest.approx(hz, rel=1e-6)
    assert told.stability[at] == "stable"
    found = Judge(machine, 2 * np.pi * told.hz[at]).orbit(told.motion[at])
    assert found is not None
    assert found.multiplier < 1.0 - 3 * found.multiplier_error
    np.testing.assert_allclose(found.motion[1], told.motion[at][1], atol=0.01 * np.abs(found.motion[1]).max())


@pytest.mark.validation
def test_an_unstable_stretch_between_stable_points_with_too_few_harmonics_is_found() -> None:
    """Seed 117001, machine 11: both ends needed more harmonics, and between them the multiplier is 1.042; nothing is carried from such ends."""
    machine = draw(117001, 11)
    told = asked(machine)
    at = int(np.argmin(np.abs(told.hz - 85.2808)))
    found = Judge(machine, 2 * np.pi * told.hz[at]).orbit(told.motion[at])
    assert found is not None
    assert found.multiplier > 1.0 + 3 * found.multiplier_error
    assert told.stability[at] == "unstable"


def test_machines_are_the_same_whenever_they_are_drawn() -> None:
    """A seed and a number are enough; all families are drawn, and all structures are held."""
    families = set()
    for number in range(30):
        one, other = draw(3, number), draw(3, number)
        assert np.array_equal(one.stiffness, other.stiffness)
        assert one.hz == other.hz
        assert np.linalg.eigvalsh(one.stiffness)[0] > 0
        families.add(one.family)
    assert families == {"chain", "stop", "pad", "cubic"}


@pytest.mark.validation
def test_a_harmonic_that_meets_a_mode_beyond_the_judged_ones_is_kept() -> None:
    """Seed 118002, machine 15: five harmonics were kept, all up to the 15th judged, and the 16th takes 8.3 % off the first."""
    machine = draw(118002, 15)
    told = asked(machine)
    at = int(np.argmin(np.abs(told.hz - 44.894)))
    assert told.level[at] == 0  # trusted
    found = Judge(machine, 2 * np.pi * told.hz[at]).orbit(told.motion[at])
    assert found is not None
    np.testing.assert_allclose(told.motion[at][1], found.motion[1], atol=0.01 * np.abs(found.motion[1]).max())
