"""What a peak is held against beside its harmonics: small motions, the reduction, the contact points, other motions."""

from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from stickslip.assembly.assembling import assemble, with_more_modes
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.damping import Damping
from stickslip.model.fe.solid import Material
from stickslip.model.part import solid_part
from stickslip.model.structure import Structure, numbered_dofs
from stickslip.reduction.choice import Reduction
from stickslip.response.forced import other_motions
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import accepted_points, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.peak_sensitivity import halved
from stickslip.response.system import System
from stickslip.response.time.stepping.marcher import step_work
from tests.solid_models import box

LENGTH, THICKNESS = 0.1, 0.004
RNG_PLACES = np.random.default_rng(7)


def cantilever(newton, modes=3):
    """A steel strip, held at its root, with a slider that never slips at its tip."""
    mesh = box(20, (LENGTH, 0.01, THICKNESS), (8, 1, 1))
    part = solid_part(mesh, Material(), reduction=Reduction(modes), damping=Damping(modal=0.002))
    tip = int(mesh.node_sets["tip"][0])
    return ss.Model(
        parts={"strip": part},
        contacts={
            "hold": ss.Contact(
                between=(f"strip.node{tip}.y", "ground"), law=ss.Jenkins(k_t=1.0, limit=1e9), acts="tangential"
            )
        },
        loads={"f": ss.Load(on=f"strip.node{tip}.z", newton=newton)},
        outputs=(ss.Output(name="tip", on=f"strip.node{tip}.z"),),
    )


def first_hz(model):
    return assemble(model, 1).frequencies.stuck_reduced[0]


def test_motions_beyond_linear_kinematics_are_doubted():
    model = cantilever(3.0)
    hz = first_hz(model)
    gentle = replace(model, loads={"f": replace(model.loads["f"], newton=0.01)})
    small, large = (m.forced_response(hz=(0.99 * hz, 1.01 * hz), points=6, peak_points=3) for m in (gentle, model))
    told = "\n".join(map(str, large.verdicts))
    assert "too large for linear kinematics" in told
    assert "a part turns by" in told
    assert "too large" not in "\n".join(map(str, small.verdicts))
    data = large["forced_response"]
    tip = float(data["peak_amplitude"].values[0])
    assert float(data["peak_rotation_rad"].values[0]) == pytest.approx(tip / LENGTH, rel=1e-3)
    # Euler's beam: the first mode stores 3.0911 EI a²/2L³; solid elements of a strip are within 5 %
    wanted = np.sqrt(3.0911 / 12.0) * THICKNESS * tip / LENGTH**2
    assert float(data["peak_strain_rms"].values[0]) == pytest.approx(wanted, rel=0.05)


def chain(modes):
    n = 12
    stiffness = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    body = ss.model.lumped(np.eye(n), stiffness, 1e-5 * stiffness, names=tuple("abcdefghijkl"))
    return ss.Model(
        parts={"ch": ss.Part(structure=body, reduction=Reduction(modes))},
        contacts={
            "brake": ss.Contact(between=("ch.d", "ground"), law=ss.Jenkins(k_t=1e5, limit=0.3), acts="tangential")
        },
        loads={"f": ss.Load(on="ch.a", newton=1.0)},
        outputs=(ss.Output(name="l", on="ch.l"),),
    )


def test_the_change_with_more_modes_is_that_of_the_richer_model():
    first, second = (chain(m).forced_response(hz=(36.0, 46.0), points=16) for m in (2, 3))
    data = first["forced_response"]
    own, richer = (float(r["forced_response"]["peak_amplitude"].values[0]) for r in (first, second))
    change = float(data["modes_peak_change"].values[0])
    # each peak is resolved to 5e-4 of its frequency: near its top the amplitude is flatter than that
    assert change == pytest.approx(richer / own - 1.0, abs=1e-3)
    assert abs(change) > 1e-3


def test_peaks_are_compared_with_few_harmonics(monkeypatch):
    """A peak with 31 harmonics: the change with more modes is the same with 15 of them, and with all."""
    changes = []
    for most in (15, 31):
        monkeypatch.setattr("stickslip.response.peak_sensitivity.MOST_HARMONICS", most)
        sweep = {"low": 31, "high": 31, "selection": "always_high", "stability": "off", "points": 12}
        data = chain(2).forced_response(hz=(36.0, 46.0), **sweep)["forced_response"]
        changes.append(float(data["modes_peak_change"].values[0]))
    assert abs(changes[1]) > 1e-3
    assert changes[0] != changes[1]
    assert changes[0] == pytest.approx(changes[1], rel=1e-2)


def test_parts_that_keep_all_modes_have_no_richer_model():
    assert with_more_modes(chain(12)) is None
    assert with_more_modes(chain(2)).parts["ch"].reduction.n_modes == 3
    again = chain(2)
    assert with_more_modes(again).parts["ch"] is with_more_modes(again).parts["ch"]


def test_half_the_points_of_a_contact_are_as_stiff_together():
    n = 10
    laws = tuple(ElasticCoulomb(k_t=k, k_w=k, k_n=2 * k, mu=0.3, preload=1.0) for k in RNG_PLACES.uniform(1.0, 2.0, n))
    structure = Structure(np.eye(3 * n), 0 * np.eye(3 * n), np.eye(3 * n), numbered_dofs(3 * n))
    system = System(structure, Interface(tuple(map(str, range(n))), laws, np.eye(3 * n)), np.array([0]))
    place = np.stack([np.arange(n), np.zeros(n), np.zeros(n)], axis=1)
    few, left = halved(system, ["a"] * n, place, np.ones(n))
    assert left == n // 2
    assert few.interface.n_contacts == n - left
    before, after = (s.interface.stuck_stiffness().reshape(-1, 3).sum() for s in (system, few))
    assert after == pytest.approx(before, rel=1e-12)
    # each point lies between the two that it stands for: a body that turns meets the same moment
    turned = np.repeat(place[:, 0], 3)
    forces = [s.interface.stuck_stiffness() * (s.interface.gap_operator @ turned) for s in (system, few)]
    assert forces[1].sum() == pytest.approx(forces[0].sum(), rel=1e-12)
    assert halved(system, ["a"] * n, place, np.full(n, np.nan)) is None


def test_another_motion_beside_the_response_is_named():
    """Duffing's oscillator at listed frequencies: the response stands on its upper branch, contacts that stick lead to the lower one."""
    body = ss.model.lumped(np.eye(1), 1e4 * np.eye(1), 4.0 * np.eye(1), names=("m",))
    model = ss.Model(
        parts={"one": ss.Part(structure=body)},
        contacts={"c": ss.Contact(between=("one.m", "ground"), law=CubicSpring(cubic_t=1e8), acts="tangential")},
        loads={"f": ss.Load(on="one.m", newton=100.0)},
        outputs=(ss.Output(name="m", on="one.m"),),
    )
    hz = np.array([100.0, 110.0, 120.0, 140.0, 180.0, 220.0, 260.0]) / (2 * np.pi)
    result = model.forced_response(hz=hz.tolist(), direction="down")
    data = result["forced_response"]
    told = "\n".join(map(str, result.verdicts))
    assert "Another motion of" in told
    omega = 2 * np.pi * float(data["another_frequency_hz"].values[0])
    size = float(data["another_amplitude"].values[0])
    # first harmonic of the amplitude equation; the third moves it by less than 1 % on the lower branch
    left = np.hypot(1e4 - omega**2 + 0.75e8 * size**2, 4.0 * omega) * size
    assert left == pytest.approx(100.0, rel=0.01)


def stop_at(hz: list[float]) -> dict[float, tuple[int, int]]:
    """Return verdict and stability of a mass that meets a stop, by frequency."""
    body = ss.model.lumped(np.eye(1), 1e4 * np.eye(1), np.eye(1), names=("m",))
    stop = ss.Contact(between=("b.m", "ground"), law=ss.UnilateralSpring(k_n=5e3, initial_gap=1e-3), acts="normal")
    model = ss.Model(
        parts={"b": ss.Part(structure=body)},
        contacts={"stop": stop},
        loads={"f": ss.Load(on="b.m", newton=2.0)},
        outputs=(ss.Output(name="m", on="b.m"),),
    )
    data = model.forced_response(hz=hz, peak_points=0)["forced_response"]
    words = zip(data.verdict.values.tolist(), data.motion_stability.values.tolist(), strict=True)
    return dict(zip(data.frequency_hz.values.tolist(), words, strict=True))


def test_verdict_and_stability_depend_on_no_other_frequencies():
    """Lists of 9 and 129 frequencies up to the jump of a stop say the same at those that they share."""
    few, many = (stop_at(np.linspace(15.0, 17.0, n).tolist()) for n in (9, 129))
    assert len(few) == 9
    assert {hz: many[hz] for hz in few} == few


def duffing_points():
    """A problem of one mass with a cubic spring, and points of its response."""
    structure = Structure(np.eye(1), 4.0 * np.eye(1), 1e4 * np.eye(1), numbered_dofs(1))
    contact = Interface(("c",), (CubicSpring(cubic_t=1e8),), np.array([[1.0], [0.0], [0.0]]))
    system = System(structure, contact, np.array([0]))
    load = HarmonicLoad(np.zeros(1), {1: np.array([100.0 + 0j])})
    sweep = Sweep(omega_range=(50.0, 90.0), points=5, peak_points=0)
    return (forced_problem(system, load, sweep), accepted_points(list(forced_response(system, load, sweep))))


def test_a_search_for_other_motions_marches_within_the_work_of_the_response(monkeypatch):
    """Where the solutions took no work no motion is marched from rest; else at most as many periods as it pays for."""
    problem, points = duffing_points()
    marched = []

    def marching(*given):
        marched.append(given[-1])
        return None, given[-1]

    monkeypatch.setattr(other_motions, "_from_rest", marching)
    assert not list(other_motions.other_motions(problem, points[:2], [], 0))
    assert not marched
    each = replace(points[0], iterations=1)
    few = [each] * 40
    list(other_motions.other_motions(problem, points[:3], few, 0))
    work = (1 + other_motions.JUDGED) * (other_motions.NEWTON_FLOPS + other_motions.FLOPS_AN_UNKNOWN * each.unknowns)
    period = other_motions.STEPS * other_motions.LONGER * step_work(1, 3)
    assert marched
    assert sum(marched) * period <= other_motions.MARCHED * 40 * work
