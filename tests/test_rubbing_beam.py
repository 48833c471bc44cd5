"""J7: a beam that rubs with its end on a plate, against time integration by a few lines of the test's own."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from small_v2 import EXAMPLES, changed
from test_cli import done, refused

from stickslip.api.result import Result
from stickslip.assembly.assembling import assemble
from stickslip.assembly.forces import force_of
from stickslip.errors import InputError
from stickslip.model.damping import rayleigh_damping
from stickslip.model.fe.beam import Beam, beam, rotating_beam
from stickslip.model.fe.solid import Material
from stickslip.study.models.study import read_study

HERTZ, FORCE = 74.0, 2.0
SMALL = {
    "part.beam.elements": "3",
    "damping.ratio": "0.02",
    "vary.load.side.force_n": f"[{FORCE}]",
    "vary.load.up.force_n": f"[{FORCE}]",
    "forced_response.frequencies_hz": f"[73.0, {HERTZ}]",
    "forced_response.peak_points": "0",
    "forced_response.stability": '"off"',
    "harmonics.high": "5",
    "harmonics.samples": "256",
    "harmonics.selection": '"always_high"',
}
SHAPE = Beam(length=0.4, area=1.2e-4, second_moment=1.0e-9, second_moment_y=1.44e-9, material=Material())


def write(folder: Path, changes: dict[str, str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(EXAMPLES / "rubbing_beam" / "study.toml", folder)
    path = folder / "study.toml"
    text = path.read_text().replace("frequency_hz = [45.0, 130.0]\npoints = 25\n", "")
    path.write_text(changed(text, changes))
    return path


def rubbing(structure, limit: float, stiffness: float, steps: int, periods: int = 50):
    """Return the first harmonics of the tip's y and z by the average acceleration and a return to the disc of friction."""
    names = [f"node3.{c}" for c in "yz"]
    tip = [structure.dofs.labels.index(name) for name in names]
    M, C, K = (np.asarray(m) for m in (structure.mass, structure.damping, structure.stiffness))
    omega = 2 * math.pi * HERTZ
    dt = 2 * math.pi / omega / steps
    solve = np.linalg.inv(4 / dt**2 * M + 2 / dt * C + K)
    soft = solve[np.ix_(tip, tip)]
    state = np.zeros(3 * structure.n)  # u, v, a
    moved = solve @ np.hstack([4 / dt**2 * M + 2 / dt * C, 4 / dt * M + C, M])
    one, none = np.eye(structure.n), np.zeros((structure.n, structure.n))
    old = np.block([[none, none, none], [-2 / dt * one, -one, none], [-4 / dt**2 * one, -4 / dt * one, -one]])
    new = np.vstack([one, 2 / dt * one, 4 / dt**2 * one])
    phases = np.array([0.0, math.pi / 2])
    pushed = FORCE * np.cos(omega * dt * np.arange(steps)[:, None] + phases) @ solve[:, tip].T
    slider, force = np.zeros(2), np.zeros(2)
    kept = np.zeros((steps, 2))
    for step in range(1, periods * steps + 1):
        free = moved @ state + pushed[step % steps]
        g = free[tip] - soft @ force
        for _ in range(30):
            trial = stiffness * (g - slider)
            size = np.hypot(*trial)
            force, slope = trial, stiffness * np.eye(2)
            if size > limit:
                d = trial / size
                force, slope = limit * d, stiffness * limit / size * (np.eye(2) - np.outer(d, d))
            move = np.linalg.solve(np.eye(2) + soft @ slope, free[tip] - soft @ force - g)
            g = g + move
            if np.abs(move).max() < 1e-11:
                break
        slider = g - force / stiffness
        state = new @ (free - solve[:, tip] @ force) + old @ state
        kept[step % steps] = state[tip]
    return np.abs(np.fft.rfft(kept, axis=0)[1]) * 2 / steps


@pytest.mark.validation
def test_the_orbit_of_the_tip_is_that_of_time_integration(tmp_path: Path) -> None:
    path = write(tmp_path, SMALL)
    done("run", str(path), "--no-report")
    data = Result.from_file(tmp_path / "results").data["forced_response"].dataset
    at = int(np.flatnonzero(data["frequency_hz"] == HERTZ)[-1])
    found = data["amplitude"].sel(output=["tip.y", "tip.z"]).values[at]
    model = read_study(path).model()
    whole = assemble(model, 1)
    pressed = -float(whole.static_force[0, 2])
    # what the spring of the plate leaves of 10 N when the beam gives way
    axial = SHAPE.material.young_modulus * SHAPE.area / SHAPE.length
    assert pressed == pytest.approx(10.0 * axial / (axial + 1e6), rel=1e-12)
    alone = rayleigh_damping(beam(SHAPE, 3, bending="both"), 0.02, (40.0, 400.0))
    # the return to the disc is of first order in the steps
    coarse, fine = (rubbing(alone, 0.3 * pressed, 2e4, steps) for steps in (200, 400))
    assert found == pytest.approx(2 * fine - coarse, rel=1e-3)
    assert found.max() > 1.5 * 0.3 * pressed / 2e4  # far beyond where the spring sticks


def test_a_beam_that_bends_both_ways_is_two_beams() -> None:
    both = beam(SHAPE, 4, bending="both", axial=True)
    flap = beam(SHAPE, 4, bending="z")
    other = Beam(length=0.4, area=1.2e-4, second_moment=1.44e-9, material=Material())
    lag = beam(other, 4, bending="y", axial=True)
    found = np.linalg.eigvals(np.linalg.solve(both.mass, both.stiffness))
    parts = [np.linalg.eigvals(np.linalg.solve(s.mass, s.stiffness)) for s in (flap, lag)]
    assert np.sort(found.real) == pytest.approx(np.sort(np.concatenate(parts).real), rel=1e-9)
    assert both.dofs.labels[:5] == ("node1.x", "node1.y", "node1.z", "node1.ry", "node1.rz")
    assert [both.dofs.labels[i] for i in both.sets["tip"]] == ["node4.x", "node4.y", "node4.z"]


def test_coriolis_forces_couple_lag_and_stretching_beside_the_flap() -> None:
    turning = rotating_beam(SHAPE, 3, 300.0, bending="both", axial=True, coriolis=True)
    y, x, z = (turning.dofs.labels.index(f"node3.{c}") for c in "yxz")
    assert turning.damping[y, x] == -turning.damping[x, y] != 0.0
    assert not np.any(turning.damping[z])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"contact.plate.normal": "[0.0, 0.0, 0.0]"}, "contact.plate.normal: has no length"),
        ({"part.beam.bending": '"x"'}, "part.beam.bending"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(tmp_path: Path, changes, message) -> None:
    assert message in refused("check", str(write(tmp_path, SMALL | changes)))


def test_a_node_without_a_normal_is_told_how_to_get_one(tmp_path: Path) -> None:
    path = write(tmp_path, SMALL)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("normal =")]
    path.write_text("\n".join(lines))
    assert "give the normal of the contact" in refused("check", str(path))


def test_a_force_across_a_beam_that_bends_one_way_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, SMALL | {"part.beam.bending": '"z"', "contact.plate.acts": '"tangential"'})
    lines = [line for line in path.read_text().splitlines() if not line.startswith("normal =")]
    path.write_text("\n".join(lines))
    said = refused("check", str(path))
    assert "load.side.direction: is given, but 'beam.tip' is a single dof" in said
    assert "of direction z" in said


def test_a_contact_without_motion_along_its_normal_is_warned_of(tmp_path: Path) -> None:
    model = read_study(write(tmp_path / "a", SMALL | {"part.beam.axial": "false"})).model()
    assert "no point of it can move along the normal" in model.warnings[0]
    assert read_study(write(tmp_path / "b", SMALL)).model().warnings == ()


def test_a_force_along_an_axis_in_which_no_point_moves_is_refused(tmp_path: Path) -> None:
    changes = {"part.beam.axial": "false", "load.side.direction": "[1.0, 1.0, 0.0]"}
    model = read_study(write(tmp_path, SMALL | changes)).model()
    with pytest.raises(InputError, match=r"load.side.on: 'beam.tip' cannot move along x"):
        force_of(model.places, "side", model.loads["side"])


def test_a_place_far_from_every_node_is_warned_of(tmp_path: Path) -> None:
    """A beam of 0.4 m: 50 m away is a place in millimetres."""

    def warned(name: str, x: float) -> tuple[str, ...]:
        points = f'{{ tip = {{ on = "beam", near_m = [{x}, 0.0, 0.0] }} }}'
        return read_study(write(tmp_path / name, SMALL | {"output.points": points})).model().warnings

    assert "output.points.tip.near_m: the nearest node of beam is 49.6 m away" in warned("a", 50.0)[0]
    assert warned("b", 0.41) == ()


def test_an_output_that_sticks_throughout_is_said_not_to_move(tmp_path: Path) -> None:
    changes = {
        "contact.plate.law": '"rigid_coulomb"',
        "contact.plate.friction_coefficient": "0.3",
        "contact.plate.interference_m": "1e-5",
    }
    path = write(tmp_path, SMALL | changes)
    drop = ("normal_stiffness", "tangential_stiffness", "preload", "axial_stiffness")
    lines = [line for line in path.read_text().splitlines() if not line.startswith(drop)]
    path.write_text("\n".join(lines))
    said = done("run", str(path), "--no-report")
    assert "does not move: a rigid contact holds it at all frequencies" in said
    assert "Widen" not in said
