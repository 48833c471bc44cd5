"""J4: a rigid damper between neighbouring sectors: one sector against all of them, and through the command line."""

import math
from pathlib import Path

import numpy as np
import pytest
from newton_bounds import allowed
from small_v2 import EXAMPLES, changed, write_two_blades
from test_assembly_wheel import LAW, SECTORS, SPEED, STEEL, answered, shrouded_sector, whole_wheel
from test_cli import done, refused

from stickslip.api.result import Result
from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact
from stickslip.assembly.forces import Load, Output
from stickslip.assembly.model import Model
from stickslip.assembly.part_copies import place_of, placed_body
from stickslip.assembly.sides import wheel
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.damping import Damping
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import BodyPoints, Part, rigid_part, solid_part
from stickslip.model.rigid.body import body_of_tensor
from stickslip.study.models.study import read_study
from stickslip.units import RPM

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

ORDER, H, PITCH = 2, 3, 2 * math.pi / SECTORS
AXIS = Axis()
OWN = {"damping": Damping(ratio=0.003, between_hz=(500.0, 3000.0))}
FEW = {
    "part.blade.disk_size_m": "0.04",
    "part.blade.platform_size_m": "0.016",
    "part.blade.airfoil_size_m": "0.03",
    "part.damper.sections_m": "[-0.01, 0.01]",
    "part.damper.left_distances_m": "[0.008]",
    "part.damper.right_distances_m": "[0.008]",
    "reduction.fixed_interface_modes": "6",
    "harmonics.high": "1",
    "vary.load.gas.force_n": "[0.1]",
}


def plate() -> Part:
    """A plate in the plane of the shrouds' faces whose principal axes are those of nothing else; it stands at half a pitch."""
    radius, z = np.meshgrid([0.184, 0.195], [-0.012, 0.013])
    points = np.column_stack([radius.ravel(), 0 * z.ravel(), z.ravel()])
    surfaces = {}
    for name, sign in (("left", -1.0), ("right", 1.0)):
        frame = np.column_stack([[1, 0, 0], np.cross([0, sign, 0], [1, 0, 0]), [0, sign, 0]])
        names = tuple(f"{name}.{i}" for i in range(4))
        surfaces[name] = BodyPoints(names, points, np.tile(frame.astype(float), (4, 1, 1)))
    tensor = np.array([[3.0, 0.5, 0.4], [0.5, 2.5, -0.3], [0.4, -0.3, 4.0]]) * 1e-6
    return placed_body(
        rigid_part(body_of_tensor(0.02, tensor, np.array([0.189, 0.0, 0.001])), surfaces), place_of(turn=PITCH / 2)
    )


def contacts(number: str, behind: str, ahead: str) -> dict[str, Contact]:
    both = ((f"damper{number}.left", behind), (f"damper{number}.right", ahead))
    return {
        f"{name}{number}": Contact(between=between, law=LAW, pairing="node_to_segment")
        for name, between in zip(("behind", "ahead"), both, strict=True)
    }


def one_sector() -> Model:
    return Model(
        parts={"blade": solid_part(shrouded_sector(), STEEL, sectors=SECTORS, **OWN), "damper": plate()},
        contacts=contacts("", "blade.shroud_high", "next.blade.shroud_low"),
        loads={"gas": Load(on="blade.tip", newton=4000.0, direction=(0.2, 1, 0.3), engine_order=ORDER)},
        outputs=(Output(name="tip", on="blade.tip"), Output(name="damper", on="damper")),
        speed=SPEED,
        retention=1e5,
    )


def all_sectors() -> Model:
    """No symmetry: one mesh of the wheel, a body, two contacts and a load for each sector."""
    mesh = shrouded_sector()
    whole, nodes = whole_wheel(mesh)
    for s in range(SECTORS):
        for name in ("shroud_high", "shroud_low", "tip"):
            whole.node_sets[f"{name}{s}"] = nodes[s, mesh.node_sets[name]]
    parts, met, loads = {"wheel": solid_part(whole, STEEL, **OWN)}, {}, {}
    for s in range(SECTORS):
        parts[f"damper{s}"] = placed_body(plate(), place_of(turn=s * PITCH))
        met |= contacts(str(s), f"wheel.shroud_high{s}", f"wheel.shroud_low{(s + 1) % SECTORS}")
        x, y, z = AXIS.rotation(s * PITCH) @ [0.2, 1, 0.3]
        loads[f"gas{s}"] = Load(on=f"wheel.tip{s}", newton=4000.0, direction=(x, y, z), phase=ORDER * s * PITCH)
    outputs = (Output(name="tip", on="wheel.tip0"), Output(name="damper", on="damper0"))
    return Model(parts=parts, contacts=met, loads=loads, outputs=outputs, speed=SPEED, retention=1e5)


@pytest.mark.kernel
def test_a_damper_between_sectors_answers_on_one_sector_as_on_all() -> None:
    """Natural frequencies of all waves, static contact forces, and a response in slip; the body has a full inertia tensor."""
    one, every = one_sector(), all_sectors()
    waves = [natural_frequencies(one.at(SPEED, k, "stuck"), 5) for k in range(SECTORS)]
    whole = natural_frequencies(every.at(SPEED, 0, "stuck"), 12)
    np.testing.assert_allclose(np.sort(np.concatenate(waves))[:12], whole, rtol=1e-9)
    found, all_of_it = assemble(one, H), assemble(every, H)
    assert found.system.retained.size == 8 * 3 + 6  # the motion of points, not of nodes
    np.testing.assert_allclose(
        np.tile(found.static_force, (SECTORS, 1)), all_of_it.static_force, atol=1e-9 * np.abs(found.static_force).max()
    )
    hertz = (2000.0, 2050.0)
    mine, theirs = (answered(a.system, a.load, hertz) for a in (found, all_of_it))
    for a, b in zip(mine, theirs, strict=True):
        assert a.energy.max() > 1e-4  # it slips
        assert np.abs(a.outputs - b.outputs).max() <= allowed("outputs", a, b)


@pytest.mark.kernel
def test_the_motion_of_points_stands_for_that_of_the_nodes_around_them(monkeypatch: pytest.MonkeyPatch) -> None:
    few = assemble(one_sector(), H)

    def refuse(*_: object) -> None:
        raise InputError("gaps", "depend on each other", "")

    monkeypatch.setattr(wheel, "in_relative_coordinates", refuse)
    nodal = assemble(one_sector(), H)
    assert nodal.system.retained.size > few.system.retained.size
    mine, theirs = (answered(a.system, a.load, (2000.0, 2050.0)) for a in (few, nodal))
    for a, b in zip(mine, theirs, strict=True):
        assert np.abs(a.outputs - b.outputs).max() <= allowed("outputs", a, b)


def test_single_dofs_of_the_next_sector_count_along_the_axes_of_this_one() -> None:
    one = one_sector()
    law = Jenkins(k_t=1e5, limit=10.0)
    link = Contact(between=("damper.x", "next.damper.x"), law=law, acts="tangential")
    pairs = Model(parts=one.parts, contacts={"link": link}).pairs
    own = one.places.own("damper")
    moved = np.zeros(one.places.n)
    moved[own[:3]] = AXIS.rotation(-PITCH) @ [1.0, 0.0, 0.0]  # in the axes of the next sector, along x of this one
    np.testing.assert_allclose((pairs.following @ moved)[0], 1.0)
    moved[own[:3]] = AXIS.rotation(-PITCH) @ [0.0, 1.0, 0.0]
    np.testing.assert_allclose(pairs.following @ moved, 0.0, atol=1e-15)


def write(folder: Path, changes: dict[str, str]) -> Path:
    text = (EXAMPLES / "platform_damper" / "study.toml").read_text()
    path = folder / "study.toml"
    path.write_text(changed(text, FEW | changes))
    return path


@pytest.mark.validation
def test_the_example_sticks_at_its_stuck_frequency_and_thrown_out_it_presses(tmp_path: Path) -> None:
    keys = {"points": "6", "peak_points": "4", "stability": '"off"'}
    path = write(tmp_path, {f"forced_response.{key}": value for key, value in keys.items()})
    done("run", str(path), "--no-report", "--only", "forced_response")
    data = Result.from_file(tmp_path / "results").data
    response = data["forced_response"]
    stuck = natural_frequencies(read_study(path).model().at(6000 * RPM, 6, "stuck"), 1)[0]
    assert float(response["peak_frequency_hz"][0]) == pytest.approx(stuck, rel=2e-3)
    force, frame = response["static_force"].values, response["contact_frame"].values
    force = force[0] if force.ndim == 3 else force
    total = np.einsum("pij,pj->i", frame, force)
    speed = 6000 * RPM
    depth = 0.002 * math.tan(37.5 * math.pi / 180) + 0.006 / 2  # about the middle of the section
    pull = 7850 * 0.03 * 0.006 * (0.004 + 0.006 / math.tan(37.5 * math.pi / 180)) * speed**2 * (0.18483 - depth)
    np.testing.assert_allclose(total, -pull * AXIS.rotation(math.pi / 24) @ [1, 0, 0], atol=0.05 * pull)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"part.damper.length_m": "0.0"}, "part.damper.length_m: must be greater than 0"),
        ({"part.damper.mass_kg": "0.02"}, "part.damper.mass_kg: and the density are both given"),
        ({"part.damper.placed": '{ axes = ["y", "z"] }'}, "part.damper.placed"),
        ({"part.damper.placed": '{ axes = ["y", "x", "z"] }'}, "makes a right hand a left one"),
        ({"part.damper.placed": '{ axes = ["y", "y", "z"] }'}, "must name x, y and z once each"),
        ({"part.damper.left_distances_m": "[0.05]"}, "part.damper.left_distances_m: must grow and lie on the side"),
        ({"part.damper.placed": '[{ axes = ["y", "z", "-x"] }]'}, "makes a right hand a left one"),
        ({"part.damper.placed": '[{ axes = ["y", "-z", "-x"], move_m = [0.18, 0, 0] }]'}, "do not face each other"),
        ({"part.damper.placed": '[{ axes = ["y", "z", "x"], move_m = [0.5, 0, 0] }, { turn_deg = 7.5 }]'}, "none near"),
    ],
)
def test_a_wedge_that_cannot_be_there_is_refused(tmp_path: Path, changes: dict[str, str], told: str) -> None:
    assert told in refused("check", str(write(tmp_path, changes)))


def test_copies_of_copies_are_copies_of_the_first_and_circles_are_refused(tmp_path: Path) -> None:
    bodies = """
[part.first]
shape = "cylinder"
radius_m = 0.004
length_m = 0.03
left_angle_deg = 40.0
mass_kg = 0.01
placed = { move_m = [0.1, 0.0, 0.0] }
[part.second]
of = "first"
placed = { turn_deg = 90.0 }
[part.third]
of = "second"
placed = { turn_deg = 90.0 }
"""
    path = write(tmp_path, {})
    text = path.read_text()
    path.write_text(text + bodies)
    parts = read_study(path).model().parts
    first, third = (np.array(parts[name].body.centre) for name in ("first", "third"))
    np.testing.assert_allclose(third, first * [-1, -1, 1], atol=1e-15)
    np.testing.assert_allclose(
        parts["second"].body.tensor, np.diag(np.diag(parts["first"].body.tensor)[[1, 0, 2]]), atol=1e-18
    )
    path.write_text(
        text
        + bodies.replace('shape = "cylinder"', 'of = "third"').replace(
            "\nradius_m = 0.004\nlength_m = 0.03\nleft_angle_deg = 40.0\nmass_kg = 0.01", ""
        )
    )
    assert "part.first.of: first is a copy of third is a copy of second is a copy of first" in refused(
        "check", str(path)
    )


def test_the_undersides_of_prismatic_blades_take_a_body_without_nodes_of_their_own(tmp_path: Path) -> None:
    apart = {
        "part.blades.nodes_at": "[]",
        "part.damper.apex_m": "[0.028, 0.1065]",
        "part.damper.flat_angle_deg": "45.0",
        "part.damper.curved_angle_deg": "45.0",
        "contact.flat.pairing": '"node_to_segment"',
        "contact.curved.pairing": '"node_to_segment"',
    }
    found = []
    for name, changes in (("nodes", {}), ("facets", apart)):
        model = read_study(write_two_blades(tmp_path / name, changes)).model()
        found.append(natural_frequencies(model.at(0.0, 0, "stuck"), 3))
    np.testing.assert_allclose(found[1], found[0], rtol=0.02)  # two coarse meshes
