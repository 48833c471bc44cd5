"""What a model can and cannot do, told from its modes: damping, bounds by friction, bodies on contacts, what a damper can do."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.assembly.assembling import assemble
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.dahl import Dahl
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.model.damping import Damping
from stickslip.response.damping_of_modes import (
    ModesInRange,
    Range,
    RangeMode,
    complex_stiffness,
    damped_modes,
    friction_of,
    range_modes,
    springs_of,
)
from stickslip.response.self_excited.modes import natural_frequencies
from stickslip.study.store.progress import LOG
from stickslip.units import HZ

STIFFNESS = 1e4 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
EXAMPLES = Path(__file__).parents[1] / "examples"
EVERY = np.ones(1, dtype=bool)


def three_masses(limit=1e7, newton=1.0, damping=None, loss=None):
    body = ss.model.lumped(np.eye(3), STIFFNESS, damping, names=("a", "b", "c"))
    own = {} if loss is None else {"damping": Damping(loss_factor=loss)}
    return ss.Model(
        parts={"ch": ss.Part(structure=body, **own)},
        contacts={
            "brake": ss.Contact(between=("ch.b", "ground"), law=ss.Jenkins(k_t=5e3, limit=limit), acts="tangential")
        },
        loads={"f": ss.Load(on="ch.a", newton=newton)},
        outputs=(ss.Output(name="a", on="ch.a"),),
    )


def modes_of(model, *, sliding=False, hz=(5.0, 16.0)):
    found = assemble(model, 1)
    friction = friction_of(found.system.springs, found.static_gap, found.static_force)
    springs = springs_of(found.system, EVERY, friction.slips if sliding else None)
    within = Range(hz[0] * HZ, hz[1] * HZ)
    return range_modes(found.system, found.load, within, springs), friction


def test_every_law_has_the_friction_that_it_dissipates_by():
    laws = (
        ss.Jenkins(k_t=5e3, limit=1e7),
        ElasticCoulomb(k_t=1e6, k_w=1e6, k_n=1e6, mu=0.3, preload=100.0),
        ElasticCoulomb(k_t=1e6, k_w=1e6, k_n=1e6, mu=0.3, preload=-100.0),
        CubicSpring(k_t=1e3, cubic_t=1e9),
        Dahl(k_t=1e5, limit=5.0),
        Iwan(k_t=1e5, limit=7.0),
    )
    interface = Interface(tuple("abcdef"), laws, np.eye(18))
    force = np.zeros((6, 3))
    force[1, 2] = -100.0
    found = friction_of(interface, np.zeros((6, 3)), force)
    # samples of the cycle: a part in 256
    np.testing.assert_allclose(found.limits[:, 0], [1e7, 30.0, 0.0, 0.0, 5.0, 7.0], rtol=1 / 256)
    assert found.variable.tolist() == [False, True, False, False, False, False]


def test_stuck_frequencies_and_damping_are_those_of_the_matrices():
    bound = STIFFNESS + np.diag([0.0, 5e3, 0.0])
    squares, shapes = np.linalg.eigh(bound)
    (mode,), _ = modes_of(three_masses())
    assert mode.omega == pytest.approx(np.sqrt(squares[0]), rel=1e-10)
    assert mode.undamped
    assert abs(mode.ratio) < 1e-12
    assert mode.force == pytest.approx(abs(shapes[0, 0]), rel=1e-10)
    # dashpot at one mass: half of φᵀCφ / ω
    dashpot = np.diag([0.0, 0.0, 0.1])
    (mode,), _ = modes_of(three_masses(damping=dashpot))
    assert mode.ratio == pytest.approx(0.1 * shapes[2, 0] ** 2 / 2 / mode.omega, rel=1e-3)
    assert not mode.undamped


def test_structural_damping_counts():
    (mode,), _ = modes_of(three_masses(loss=1e-3))
    assert 1e-4 < mode.ratio <= 5e-4  # the contact's share of the energy has none


def test_a_part_without_damping_beside_a_damped_one_is_found():
    """Two oscillators that nothing couples: each mode has its own damping, however near their frequencies are."""
    body = ss.model.lumped(np.eye(2), 1e4 * np.eye(2), np.diag([1.0, 0.0]), names=("a", "b"))
    model = ss.Model(
        parts={"two": ss.Part(structure=body)},
        contacts={"c": ss.Contact(between=("two.b", "ground"), law=ss.Jenkins(k_t=1.0, limit=1e3), acts="tangential")},
        loads={"f": ss.Load(on="two.b", newton=1.0), "g": ss.Load(on="two.a", newton=1.0)},
        outputs=(ss.Output(name="b", on="two.b"),),
    )
    modes, _ = modes_of(model, hz=(10.0, 20.0))
    assert sorted(m.undamped for m in modes) == [False, True]


@pytest.mark.parametrize(("newton", "above"), [(0.99, False), (1.01, True)])
def test_the_bound_of_friction_is_four_over_pi_of_its_limit(newton, above):
    """Of one mass: Den Hartog's condition."""
    body = ss.model.lumped(np.eye(1), 1e4 * np.eye(1), names=("m",))
    model = ss.Model(
        parts={"one": ss.Part(structure=body)},
        contacts={"c": ss.Contact(between=("one.m", "ground"), law=ss.Jenkins(k_t=1e6, limit=10.0), acts="tangential")},
        loads={"f": ss.Load(on="one.m", newton=newton * 4 / np.pi * 10.0)},
        outputs=(ss.Output(name="m", on="one.m"),),
    )
    (mode,), friction = modes_of(model, sliding=True, hz=(10.0, 20.0))
    assert (mode.excess(friction) > 1.0) == above  # friction's 256 samples: half a per cent
    assert mode.excess(friction) == pytest.approx(newton, rel=1 / 256)


def test_a_slider_is_softer_and_damps_most_at_twice_the_amplitude_where_slip_begins():
    assert complex_stiffness(1.0) == 1.0
    # closed form of the first harmonic of an elastic, perfectly plastic loop at x = 2
    assert complex_stiffness(2.0) == pytest.approx(0.5 + 1j / np.pi, rel=1e-12)
    ratios = np.linspace(1.0, 6.0, 501)
    assert ratios[np.argmax([complex_stiffness(x).imag for x in ratios])] == pytest.approx(2.0, abs=0.01)


def test_what_friction_can_do_to_one_mass_is_its_describing_function():
    body = ss.model.lumped(np.eye(1), 1e4 * np.eye(1), np.eye(1) * 0.02, names=("m",))
    model = ss.Model(
        parts={"one": ss.Part(structure=body)},
        contacts={"c": ss.Contact(between=("one.m", "ground"), law=ss.Jenkins(k_t=2e3, limit=1.0), acts="tangential")},
        loads={"f": ss.Load(on="one.m", newton=1.0)},
        outputs=(ss.Output(name="m", on="one.m"),),
    )
    found = assemble(model, 1)
    friction = friction_of(found.system.springs, found.static_gap, found.static_force)
    springs = springs_of(found.system, EVERY)
    (best,) = damped_modes(found.system, friction, springs, 1, Range(10 * HZ, 20 * HZ))
    assert best.stuck == pytest.approx(np.sqrt(1.2e4), rel=1e-9)
    assert best.ends == pytest.approx(100.0, rel=1e-3)
    roots = np.sqrt([1e4 + 2e3 * complex_stiffness(x) for x in np.linspace(1.0, 50.0, 5000)])
    assert best.ratio == pytest.approx(np.max(roots.imag / np.abs(roots)), rel=0.05)  # 20 ratios
    # a mode ends where friction leaves it, whatever other modes do; without friction at its own frequency
    (mode,) = range_modes(found.system, found.load, Range(10 * HZ, 20 * HZ), springs)
    other = replace(best, stuck=2.0 * best.stuck, ends=7.0)
    physics = ModesInRange((mode,), (), friction, (other, best), True, np.zeros((1, 3)))
    assert physics.ends(mode) == best.ends
    assert physics.ends(replace(mode, omega=3.0)) == 3.0


def test_what_friction_can_do_to_a_whirling_mass_is_its_describing_function_with_coriolis_forces():
    """In the rotating frame an isotropic rotor whirls at √k ± Ω, also with the complex stiffness of sliders: (Ω ∓ ω)² = k."""
    speed, k = 30.0, 1e4
    turning = 2.0 * speed * np.array([[0.0, -1.0], [1.0, 0.0]])
    body = ss.model.lumped(np.eye(2), (k - speed**2) * np.eye(2), names=("x", "y")).with_damping(turning)
    brakes = {
        n: ss.Contact(between=(f"rotor.{n}", "ground"), law=ss.Jenkins(k_t=2e3, limit=1.0), acts="tangential")
        for n in "xy"
    }
    model = ss.Model(
        parts={"rotor": ss.Part(structure=body)},
        contacts=brakes,
        loads={"f": ss.Load(on="rotor.x", newton=1.0)},
        outputs=(ss.Output(name="x", on="rotor.x"),),
    )
    found = assemble(model, 1)
    friction = friction_of(found.system.springs, found.static_gap, found.static_force)
    springs = springs_of(found.system, np.ones(2, dtype=bool))
    both = damped_modes(found.system, friction, springs, 1, Range(5 * HZ, 30 * HZ))
    every = np.sqrt([k + 2e3 * complex_stiffness(x) for x in np.geomspace(1.0, 1e4, 20)])
    for own, turn in zip(sorted(both, key=lambda m: m.stuck), (-speed, speed), strict=True):
        roots = every + turn
        assert own.stuck == pytest.approx(roots[0].real, rel=1e-9)
        assert own.ends == pytest.approx(np.sqrt(k) + turn, rel=1e-4)
        assert own.ratio == pytest.approx(np.max(roots.imag / np.abs(roots)), rel=1e-9)
    for each, stiffness in ((springs, 1.2e4), (0.0 * springs, k)):
        hertz = natural_frequencies(found.system, 2, each)
        np.testing.assert_allclose(hertz * HZ, np.sqrt(stiffness) + np.array([-speed, speed]), rtol=1e-9)


def test_a_peak_that_nothing_damps_is_wrong():
    result = three_masses().forced_response(hz=(9.0, 10.0), points=12)
    assert "nothing damps" in "\n".join(map(str, result.verdicts)).lower()
    assert result.peaks["verdict"].tolist() == ["wrong"]
    damped = three_masses(damping=0.5 * np.eye(3)).forced_response(hz=(9.0, 10.0), points=12)
    assert damped.peaks["verdict"].tolist() == ["trusted"]
    assert "nothing damps" not in "\n".join(map(str, damped.verdicts)).lower()


def test_stiffness_alone_bounds_an_undamped_hardening_oscillator():
    """Far up its backbone x'' + x + x³ = 0.1 cos(ωt) has one size at a frequency, with damping or without: neutral, not without a finite value."""
    size = {}
    for damping in (0.0, 2e-5):
        body = ss.model.lumped(np.eye(1), np.eye(1), damping * np.eye(1), names=("x",))
        spring = ss.Contact(between=("p.x", "ground"), law=ss.CubicSpring(cubic_t=1.0), acts="tangential")
        model = ss.Model(
            parts={"p": ss.Part(structure=body)},
            contacts={"s": spring},
            loads={"f": ss.Load(on="p.x", newton=0.1)},
            outputs=(ss.Output(name="o", on="p.x"),),
        )
        rad = 2 * np.pi
        result = model.forced_response(hz=(0.8 / rad, 1.6 / rad), points=20, high=7, stability="peak")
        told = "\n".join(map(str, result.verdicts))
        assert "nothing damps" not in told.lower()
        assert "WRONG" not in told
        size[damping] = float(result["forced_response"].peak_amplitude[0])
        if not damping:
            assert "neutral" in told
    assert size[0.0] == pytest.approx(size[2e-5], rel=1e-3)


def test_check_says_which_stuck_frequency_counts(tmp_path, caplog):
    """Four masses: an open contact stuck as well would give 16.09 Hz; two modes in the range: the larger resonance first."""
    caplog.set_level("INFO", logger=LOG.name)
    text = (EXAMPLES / "four_masses" / "study.toml").read_text()
    for name, own in (("one", text), ("two", re.sub(r"(frequency_hz = \[[^,]*, )[^\]]*", r"\g<1>50.0", text))):
        (tmp_path / f"{name}.toml").write_text(own)
        caplog.clear()
        ss.Study.from_file(tmp_path / f"{name}.toml").check()
        (line,) = [m for m in caplog.messages if "the load drives" in m]
        assert "the load drives the mode at 14.09 Hz most (pressed contacts stuck)" in line
        assert ("it drives the mode at" in line) == (name == "two")


def test_the_driven_mode_is_that_of_the_largest_resonance():
    """Modal amplitude F/(2 ζ ω²): a mode twice as high needs four times the force, one with a tenth of the damping a tenth."""
    gaps = np.zeros((1, 3), dtype=complex)
    one = RangeMode(1, 1, 100.0, 1e-3, 1.0, gaps, 0.0, "a", 0.5)
    high = replace(one, number=2, omega=200.0, force=3.9)
    assert one.resonance == pytest.approx(1.0 / (2 * 1e-3 * 1e4))
    assert high.resonance < one.resonance < replace(high, force=4.1).resonance
    assert replace(one, ratio=0.0).resonance == pytest.approx(1e2 * one.resonance)
    assert replace(one, harmonic=2).resonance == pytest.approx(0.25 * one.resonance)


def test_check_says_before_any_response_that_nothing_damps_a_mode(tmp_path):
    text = (EXAMPLES / "four_masses" / "study.toml").read_text()
    told = {}
    for name, own in (("damped", text), ("undamped", re.sub(r"^dashpots.*\n", "", text, flags=re.MULTILINE))):
        (tmp_path / f"{name}.toml").write_text(own)
        told[name] = "\n".join(ss.Study.from_file(tmp_path / f"{name}.toml").check())
    assert "nothing damps the mode at 14.09 Hz" in told["undamped"]
    assert "nothing damps" not in told["damped"]
