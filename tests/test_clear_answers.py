"""Wrong arguments of the solvers, and what has no answer, are refused by name and not by a traceback."""

import math
import pickle
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
from small_v2 import write_four_masses, write_shrouded_sector
from test_assembly_copies import bar
from test_cli import done, refused
from test_cli_files import file_study, write_deck

import stickslip as ss
from stickslip.contact.interface import Interface
from stickslip.errors import InputError, did_you_mean, missing_package, nearest_and_known
from stickslip.harmonic.selection.guarded_alert import GuardedAlert
from stickslip.model.facts import unlike_units
from stickslip.model.fe.solid import Material
from stickslip.model.matrices import chain
from stickslip.model.part import solid_part
from stickslip.model.structure import Dofs, Structure
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.response.system import System
from stickslip.solve.krylov import Krylov
from stickslip.solve.newton_method import Newton
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

LOAD = ss.HarmonicLoad(np.zeros(2), {1: np.array([0.0, 1.0])})
LAW = ss.Jenkins(k_t=1e3, limit=1.0)


def system(structure=None, touched=(1,), **more):
    gaps = np.zeros((3, 2))
    gaps[0, list(touched)] = -1.0
    interface = Interface(("c",), (LAW,), scipy.sparse.csr_array(gaps))
    own = {"outputs": np.array([1])} | more
    return System(structure or chain(2, 1.0, 1e4, 1e-4), interface, **own)


def sweep(**more):
    return Sweep(**({"omega_range": (50.0, 60.0), "points": 3, "high": 3} | more))


def negative():
    mass = np.diag([1.0, -1.0])
    return Structure(mass, np.eye(2), 1e4 * np.eye(2), chain(2, 1.0, 1.0).dofs)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ss.HarmonicLoad(np.zeros(2), {1.0: np.ones(2)}), r"integer from 1 on, got 1\.0"),
        (lambda: system(outputs=np.array([2])), r"System.outputs: names dof 2"),
        (lambda: system(outputs=np.array([-1])), r"System.outputs: names dof -1"),
        (lambda: system(outputs=np.array([1.0])), r"System.outputs: holds .*no index"),
        (lambda: system(alert_dofs=np.array([9])), r"System.alert_dofs: names dof 9"),
        (lambda: Newton(tolerance=0), r"Newton.tolerance: must be above zero"),
        (lambda: Newton(tolerance=math.nan), r"Newton.tolerance"),
        (lambda: Newton(max_iterations=0), r"Newton.max_iterations"),
        (lambda: sweep(omega_range=(50.0, 50.0)), r"got 50 to 50 rad/s. Widen the range"),
        (lambda: forced_problem(system(touched=()), LOAD, sweep()), r"touches no dof that can move"),
        (lambda: forced_problem(system(negative()), LOAD, sweep()), r"has the mass -1 at node1.x"),
        (lambda: forced_problem(system(), ss.HarmonicLoad(np.zeros(2)), sweep()), r"HarmonicLoad: is zero"),
    ],
)
def test_wrong_arguments_are_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize("linear", [None, Krylov()])
def test_what_a_worker_needs_survives_a_pickle(linear):
    newton = Newton(tolerance=1e-9, globalisation="dogleg")
    own = sweep(newton=newton, selection=GuardedAlert(0.02), at=(51.0, 55.0))
    kept = pickle.loads(pickle.dumps(own))
    for key in ("omega_range", "low", "high", "selection", "at", "evaluator"):
        assert repr(getattr(kept, key)) == repr(getattr(own, key)), key
    # the whole of Newton holds counters, which other tests of this process have moved
    assert (kept.newton.tolerance, kept.newton.globalisation) == (1e-9, "dogleg")
    if linear is not None:
        assert pickle.loads(pickle.dumps(Newton(linear=linear))).linear.method == linear.method
    problem = forced_problem(system(), LOAD, own)
    before = list(forced_response(system(), LOAD, own))
    again = pickle.loads(pickle.dumps(problem))
    for point in before:
        assert again.amplitude(point) == problem.amplitude(point)
    other = forced_problem(again.system, LOAD, again.sweep)
    assert other.amplitude(before[0]) == problem.amplitude(before[0])


def free_dofs(n: int) -> Dofs:
    return Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3)))


@pytest.mark.parametrize(
    ("mass", "stiffness", "message"),
    [
        (np.diag([1.0, -1.0]), np.eye(2), r"mass: is negative, -1, at node1.x"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2), r"mass: is not positive definite"),
        (1e-308 * np.eye(2), np.eye(2), r"mass: has entries up to 1e-308"),
        (np.diag([1e-300, 1.0]), np.eye(2), r"mass: is 1e-300 at node0.x, which no model has"),
        (np.eye(2), np.diag([1e308, -1e308]), r"stiffness: has entries up to 1e\+308"),
    ],
)
def test_matrices_of_no_model_have_no_modes(mass, stiffness, message):
    structure = Structure(mass, np.zeros((2, 2)), stiffness, free_dofs(2))
    with pytest.raises(InputError, match=message):
        ss.model.normal_modes(structure, 1)


def test_inspect_says_of_such_matrices_what_it_can(tmp_path: Path) -> None:
    K, name = np.eye(3), str(tmp_path / "own.npz")
    np.savez(name, mass=np.diag([1.0, 1.0, -1.0]), stiffness=K)
    assert "No frequencies: normal_modes: mass: is negative, -1, at dof3" in done("inspect", name)
    np.savez(name, mass=K, stiffness=1e308 * K)
    assert "the stiffness has entries up to 1e+308" in refused("inspect", name)


def test_a_range_without_width_is_told_as_such(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path, {"forced_response.frequency_hz": "[20.0, 20.0]"})
    assert "forced_response.frequency_hz: begins and ends at 20" in refused("check", str(path))


@pytest.mark.parametrize(
    ("package", "lacking", "said"),
    [
        ("pyyeti", "pyyeti", r"pyyeti is not installed. Use pip install 'stickslip\[readers\]'"),
        ("pyyeti", "matplotlib.pyplot", r"pyyeti: is installed, but it imports matplotlib, which"),
        ("scikit-fem", "skfem", r"scikit-fem is not installed"),
    ],
)
def test_a_package_that_lacks_another_is_not_called_missing(package, lacking, said):
    error = ModuleNotFoundError(f"No module named {lacking!r}", name=lacking)
    assert re.match(said, str(missing_package(package, error, "readers")))


def test_a_deck_says_what_of_it_is_not_taken(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp")
    more = (
        "*BOUNDARY\nFOOT, 1, 3\n*STEP, NLGEOM\n*STATIC\n*DLOAD\nE, CENTRIF, 10000., 0., 0., 0., 0., 0., 1.\n*END STEP\n"
    )
    deck.write_text(deck.read_text() + more)
    assert "rotation.speed_rpm: is missing, and the file of part.stub turns at 954.93 rpm" in refused(
        "check", str(file_study(tmp_path))
    )
    path = file_study(tmp_path, "[rotation]\nspeed_rpm = 954.93")
    assert "rpm" not in done("check", str(path))
    path = file_study(tmp_path, "[rotation]\nspeed_rpm = 0.0")
    for command in ("check", "run"):
        said = done(command, str(path))
        assert "NLGEOM of *STEP (deck.inp: line 29): statics is linear here" in said
        assert "its file turns at 954.93 rpm, the model at 0 rpm" in said
    assert "NLGEOM" in done("inspect", str(deck))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"harmonic": 0, "phase": 0.5}, r"Load.phase: is 0.5 rad of a static load"),
        ({"harmonic": 1.0}, r"Load.harmonic: must be an integer from 0 on, got 1.0"),
        ({"harmonic": -1}, r"Load.harmonic"),
        ({"engine_order": -2}, r"Load.engine_order"),
        ({"newton": math.nan}, r"Load: has nan N"),
    ],
)
def test_loads_that_mean_nothing_are_named(given, message):
    with pytest.raises(InputError, match=message):
        ss.Load(**({"on": "a.b", "newton": 1.0} | given))


def test_engine_orders_that_sectors_cannot_tell_apart_are_told(tmp_path: Path) -> None:
    path = write_shrouded_sector(tmp_path, {"load.gas.engine_order": "10"})
    (said,) = [w for w in read_study(path).model().warnings if "engine_order" in w]
    assert said.startswith("load.gas.engine_order is 10, and 8 sectors see it as 2")
    text = path.read_text().replace("engine_order = 10", "engine_order = 0")
    path.write_text(text.replace("frequency_hz = [200.0, 260.0]", 'over = "speed"\nspeed_rpm = [100.0, 200.0]'))
    assert "load.gas.engine_order: is 0, and with over" in refused("check", str(path))


def test_parts_of_unlike_units_are_told() -> None:
    mesh = bar((1, 1, 1), length=0.1)
    steel, soft = Material(), Material(young_modulus=2.1e8)
    small = replace(mesh, points=1e-3 * mesh.points)
    parts = {"a": solid_part(mesh, steel), "b": solid_part(small, steel), "c": solid_part(mesh, soft)}
    found = unlike_units(parts)
    assert len(found) == 4
    assert found[0].startswith("part.a has a size of 0.111 m, part.b 0.000111 m")
    assert "part.a has a Young's modulus of 2.1e+11 Pa, part.c 2.1e+08 Pa" in found[1]
    assert not unlike_units({"a": parts["a"], "b": parts["a"]})


@pytest.mark.parametrize(("length", "told"), [(19.9, False), (20.1, True), (100.0, True)])
def test_a_part_whose_mm_are_read_as_m_is_told(length: float, told: bool) -> None:
    mesh = bar((1, 1, 1), length=0.1)
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    large = replace(mesh, points=length / size * mesh.points)
    found = unlike_units({"blade": solid_part(large, Material())})
    assert found == [f"part.blade measures {length:.3g} m from corner to corner: are its coordinates in mm?"] * told


@pytest.mark.parametrize("share", [5e-7, 1e-9])
def test_a_faint_excitation_is_measured_as_a_whole(share):
    # 16 dofs share the force: each has a quarter of its norm; the damper sticks, so that the response is linear
    n = 16
    structure = chain(n, 1.0, 1e4, 1e-4)
    gaps = np.zeros((3, n))
    gaps[0, -1] = -1.0
    law = ss.Jenkins(k_t=1e3, limit=1e6)
    held = System(structure, Interface(("c",), (law,), scipy.sparse.csr_array(gaps)), outputs=np.array([0]))
    static = np.zeros(n)
    static[0] = 1.0

    def amplitude(size):
        load = ss.HarmonicLoad(static, {1: np.full(n, size / math.sqrt(n))})
        points = list(forced_response(held, load, sweep(peak_points=0)))
        assert all(point.converged for point in points)
        problem = forced_problem(held, load, sweep())
        return np.array([problem.amplitude(point) for point in points])

    if share < 1e-7:
        with pytest.raises(InputError, match=r"is 1e-09 of the static load"):
            amplitude(share)
        return
    assert amplitude(share) / share == pytest.approx(amplitude(1.0), rel=1e-3)


def test_a_faint_excitation_is_refused_by_its_key(tmp_path):
    changes = {
        "load.pull.on": '"chain.m4"',
        "load.pull.force_n": "1.0",
        "load.pull.harmonic": "0",
        "load.shaker.force_n": "1e-9",
        "vary.load.shaker.force_n": "[1e-9]",
    }
    said = refused("check", str(write_four_masses(tmp_path, changes)))
    assert "load.shaker.force_n (" in said
    assert "is 1e-09 of the static load" in said


@pytest.mark.parametrize(
    ("word", "known", "told"),
    [
        ("right.tipp", ["right.ROOT", "right.TIP"], "Did you mean 'right.TIP'?"),
        ("left.under_rigth", ["left.ROOT", "left.UNDER_RIGHT"], "Did you mean 'left.UNDER_RIGHT'?"),
        ("xy", ["x", "y", "z"], "Known: x, y, z."),
    ],
)
def test_the_nearest_name_is_found_whatever_its_capitals(word, known, told):
    assert did_you_mean(word, known) == told


def test_a_set_that_there_is_not_is_told_with_those_that_there_are():
    known = [f"blade.n{i:02}" for i in range(14)]
    told = nearest_and_known("blade.airfoil", ["blade.root", "blade.tip"])
    assert told.endswith("Known: blade.root, blade.tip.")
    assert nearest_and_known("zz", known).endswith(", blade.n11 and 2 more.")
    assert nearest_and_known("zz", []) == "There is none."


def test_a_file_or_a_link_in_place_of_the_results_is_called_so(tmp_path):
    path = write_four_masses(tmp_path / "study")
    (path.parent / "results").touch()
    said = refused("run", str(path))
    assert f"{path.parent / 'results'}: is a file, and a run makes a folder of that name" in said
    assert "permissions" not in said
    (path.parent / "results").unlink()
    (path.parent / "results").symlink_to(tmp_path)
    said = refused("run", str(path))
    assert "which is a link to" in said
    assert "Remove the link" in said
