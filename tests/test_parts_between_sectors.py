"""Everything that may lie between sectors at once: one sector against all of them, without symmetry, in slip and lift-off.

Shrouds of neighbours, a ring of finite elements with cyclic faces of its own, a piece of a split ring without, held by nothing but
contacts; Coriolis forces, centrifugal load, a static gas load, contacts that overlap at rest, two engine orders.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from newton_bounds import allowed, answer_at
from test_assembly_wheel import SECTORS, SPEED, STEEL, shrouded_sector, whole_wheel

from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.forces import Load, Output
from stickslip.assembly.model import Model
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.damping import Damping
from stickslip.model.deck import write_deck
from stickslip.model.fe.free_solid import inertia_relief, rigid_motions
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import solid_part
from stickslip.response.forced.response import Sweep, accepted_points, forced_problem, forced_response
from stickslip.response.recovery import signals
from stickslip.study.models.study import read_study

pytestmark = pytest.mark.usefixtures("parts_once")

PITCH, AXIS = 2 * math.pi / SECTORS, Axis()
HALF = PITCH / 2
ORDERS = {2: 3000.0, 3: 1500.0}  # engine order -> N
H = 3
OWN = {"damping": Damping(ratio=0.004, between_hz=(500, 3000))}
LAW = ElasticCoulomb(k_t=6e6, k_w=6e6, k_n=8e6, mu=0.2)
GAS = (0.2, 1.0, 0.3)
# contact -> between, interference in m; "next." is of the next sector
CONTACTS = {
    "shroud": ("blade.shroud_high", "next.blade.shroud_low", 2e-5),
    "groove": ("ring.inside", "blade.outside", 2e-5),
    "behind": ("segment.left", "blade.under_high", 0.0),
    "ahead": ("segment.right", "next.blade.under_low", 0.0),
}


def brick(radii: tuple[float, ...], angles: tuple[float, ...], heights: tuple[float, ...]) -> SolidMesh:
    """Return a piece of a ring; its faces are sets by where they lie."""
    shape = len(radii), len(angles), len(heights)
    number = np.arange(math.prod(shape)).reshape(shape)
    points = np.array([[r * math.cos(a), r * math.sin(a), z] for r in radii for a in angles for z in heights])
    cells = [
        [number[i + a, j + b, k + c] for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        for i in range(shape[0] - 1)
        for j in range(shape[1] - 1)
        for k in range(shape[2] - 1)
    ]
    sets = {"inside": number[0], "outside": number[-1], "cyclic_low": number[:, 0], "cyclic_high": number[:, -1]}
    return SolidMesh(points, np.array(cells), {name: own.ravel() for name, own in sets.items()})


def blade() -> SolidMesh:
    mesh = shrouded_sector()
    number = np.arange(48).reshape(4, 4, 3)
    more = {"outside": number[3], "under_low": number[2, :2], "under_high": number[2, 2:]}
    return replace(mesh, node_sets=mesh.node_sets | {k: v.ravel() for k, v in more.items()})


def ring() -> SolidMesh:
    """A ring outside of the shrouds, meshed as they are along the circumference and differently along the axis."""
    return brick((0.20, 0.206), (-HALF, -0.3 * HALF, 0.35 * HALF, HALF), (-0.018, 0.0, 0.018))


def segment() -> SolidMesh:
    """A piece of a split ring below the shrouds of two neighbours; the rotation presses it against both."""
    angles = tuple(HALF + share * HALF for share in (-0.55, -0.1, 0.15, 0.6))
    mesh = brick((0.174, 0.18), angles, (-0.012, 0.0, 0.01))
    outside = mesh.node_sets["outside"].reshape(4, 3)
    return replace(mesh, node_sets={"left": outside[:2].ravel(), "right": outside[2:].ravel()})


def around(mesh: SolidMesh, names: tuple[str, ...]) -> SolidMesh:
    """Return all sectors of a ring, their faces merged, with the sets of each sector."""
    n, (low, high) = len(mesh.points), (mesh.node_sets[f"cyclic_{side}"] for side in ("low", "high"))
    place = np.arange(SECTORS * n).reshape(SECTORS, n)
    for s in range(SECTORS):
        place[s, high] = place[(s + 1) % SECTORS, low]
    used, cells = np.unique(place[:, mesh.cells].reshape(-1, 8), return_inverse=True)
    nodes = np.searchsorted(used, place)
    points = np.vstack([AXIS.turned(mesh.points, PITCH * s) for s in range(SECTORS)])
    sets = {f"{name}{s}": nodes[s, mesh.node_sets[name]] for s in range(SECTORS) for name in names}
    return SolidMesh(points[used], cells.reshape(-1, 8), sets)


def contact(between: tuple[str, str], overlap: float, turn: float = 0.0) -> Contact:
    x, y, z = AXIS.rotation(turn) @ [0.3, 0.2, 1.0]
    return Contact(between=between, law=LAW, pairing="node_to_segment", gap=-overlap, tangent=(x, y, z))


def one_sector() -> Model:
    meshes = {"blade": blade(), "ring": ring(), "segment": segment()}
    gas = {f"order{m}": Load(on="blade.tip", newton=f, direction=GAS, engine_order=m) for m, f in ORDERS.items()}
    steady = Load(on="blade.tip", newton=300.0, direction=(0, 1, 1), harmonic=0, engine_order=0)
    return Model(
        parts={
            name: solid_part(mesh, STEEL, sectors=SECTORS, clamped=("root",) if name == "blade" else (), **OWN)
            for name, mesh in meshes.items()
        },
        contacts={name: contact((a, b), overlap) for name, (a, b, overlap) in CONTACTS.items()},
        loads=gas | {"steady": steady},
        outputs=(Output(name="tip", on="blade.tip"), Output(name="ring", on="ring", near=(0.206, 0.0, 0.018))),
        speed=SPEED,
        coriolis=True,
    )


def all_sectors() -> Model:
    """No symmetry: one mesh of all blades, one ring, pieces in their places, contacts and loads of each sector."""
    mesh = blade()
    whole, nodes = whole_wheel(mesh)
    for s in range(SECTORS):
        for name in ("shroud_low", "shroud_high", "outside", "under_low", "under_high", "tip"):
            whole.node_sets[f"{name}{s}"] = nodes[s, mesh.node_sets[name]]
    parts = {
        "blade": solid_part(whole, STEEL, **OWN),
        "ring": solid_part(around(ring(), ("inside",)), STEEL, clamped=(), **OWN),
    }
    met, loads = {}, {}
    for s in range(SECTORS):
        piece = segment()
        turned = replace(piece, points=AXIS.turned(piece.points, PITCH * s))
        parts[f"segment{s}"] = solid_part(turned, STEEL, clamped=(), **OWN)
        for name, (a, b, overlap) in CONTACTS.items():
            ends = []
            for end in (a, b):
                part, _, where = end.removeprefix("next.").partition(".")
                n = (s + end.startswith("next.")) % SECTORS
                ends.append(f"segment{n}.{where}" if part == "segment" else f"{part}.{where}{n}")
            met[f"{name}{s}"] = contact((ends[0], ends[1]), overlap, PITCH * s)
        for m, force in ORDERS.items():
            x, y, z = AXIS.rotation(PITCH * s) @ GAS
            loads[f"order{m}.{s}"] = Load(
                on=f"blade.tip{s}", newton=force, direction=(x, y, z), harmonic=m, phase=m * s * PITCH
            )
        x, y, z = AXIS.rotation(PITCH * s) @ [0, 1, 1]
        loads[f"steady.{s}"] = Load(on=f"blade.tip{s}", newton=300.0, direction=(x, y, z), harmonic=0)
    outputs = (Output(name="tip", on="blade.tip0"), Output(name="ring", on="ring", near=(0.206, 0.0, 0.018)))
    return Model(parts=parts, contacts=met, loads=loads, outputs=outputs, speed=SPEED, coriolis=True)


def answered(model: Model, hertz: float):
    found = assemble(model, H)
    omega = 2 * math.pi * hertz
    sweep = Sweep(
        omega_range=(0.999 * omega, omega),
        at=(omega,),
        low=H,
        high=H,
        selection="always_low",
        peak_points=0,
        samples=128,
    )
    problem = forced_problem(found.system, found.load, sweep)
    (point,) = accepted_points(list(forced_response(found.system, found.load, sweep)))
    assert point.converged
    return found, answer_at(problem, point), signals(problem, point)


def test_modes_and_static_state_are_those_of_all_sectors() -> None:
    """What contacts alone hold has a static state at speed: in balance with its inertia, the rest carried by the contacts."""
    one, every = one_sector(), all_sectors()
    waves = [natural_frequencies(one.at(SPEED, k, "stuck"), 5) for k in range(SECTORS)]
    whole = natural_frequencies(every.at(SPEED, 0, "stuck"), 12)
    np.testing.assert_allclose(np.sort(np.concatenate(waves))[:12], whole, rtol=1e-8)
    found, all_of_it = assemble(one, H), assemble(every, H)
    force = found.static_force
    assert np.abs(np.tile(force, (SECTORS, 1)) - all_of_it.static_force).max() < 1e-9 * np.abs(force).max()
    # all of the piece's own weight at this speed presses on the two shrouds; friction carries a part of it
    piece = one.parts["segment"]
    weight = SPEED**2 * np.linalg.norm(piece.solid.centrifugal.reshape(-1, 3).sum(axis=0))
    table, held = found.contacts, np.zeros(3)
    for i, group in enumerate(table.groups):
        if group in ("behind", "ahead"):
            held += table.frame[i] @ force[i]
    assert np.linalg.norm(held) == pytest.approx(weight, rel=0.02)  # its own displacement adds the rest


def test_a_free_solid_at_speed_is_in_balance_with_its_inertia() -> None:
    """Six rigid motions of a ring, two of its sector in wave 0; what deforms it is the same, and joins of others change nothing."""
    whole = solid_part(around(ring(), ("inside",)), STEEL, clamped=()).solid
    part = solid_part(ring(), STEEL, clamped=(), sectors=SECTORS)
    model = Model(parts={"ring": part})
    tie = model.neighbours.ties["ring"]
    assert rigid_motions(whole).shape[1] == 6
    assert rigid_motions(part.solid, tie).shape[1] == 2  # along the axis and about it
    moved, carried, _ = inertia_relief(whole)
    of_sector, nothing, _ = inertia_relief(part.solid, tie)
    load = whole.centrifugal
    assert np.abs(whole.structure.stiffness @ moved - load + carried).max() < 1e-9 * np.abs(load).max()
    assert max(np.abs(carried).max(), np.abs(nothing).max()) < 1e-9 * np.abs(load).max()
    grown = np.linalg.norm(moved.reshape(-1, 3)[:, :2], axis=1)
    assert np.ptp(grown) < 0.2 * grown.max()
    np.testing.assert_allclose(
        np.sort(np.linalg.norm(of_sector.reshape(-1, 3), axis=1))[[0, -1]],
        np.sort(np.linalg.norm(moved.reshape(-1, 3), axis=1))[[0, -1]],
        rtol=1e-9,
    )
    held = solid_part(blade(), STEEL, sectors=SECTORS)
    assert inertia_relief(held.solid) is None
    joined = Model(
        parts={"blade": held, "tip": solid_part(ring(), STEEL, clamped=(), sectors=SECTORS), "ring": part},
        joins={"welded": Join(between=("tip.inside", "blade.outside"))},
    )
    np.testing.assert_allclose(joined.steady["ring"].unit, of_sector, rtol=1e-12)


@pytest.mark.validation
def test_one_sector_answers_as_all_in_slip_and_lift_off() -> None:
    one, mine, motion = answered(one_sector(), 800.0)
    _, theirs, _ = answered(all_sectors(), 800.0)
    open_ = motion.state == 2
    assert (open_.any(axis=(1, 2)) & ~open_.all(axis=(1, 2))).sum() > 10  # lift off and come back
    assert (motion.state == 1).any(axis=(1, 2)).sum() > 20  # slip
    assert np.abs(mine.outputs - theirs.outputs).max() <= allowed("outputs", mine, theirs)
    points = len(one.contacts.names)
    assert np.abs(mine.gaps - theirs.gaps[:, :points]).max() <= allowed("gaps", mine, theirs)


def test_a_deck_without_cyclic_faces_says_so_in_the_study(tmp_path: Path) -> None:
    mesh = blade()
    write_deck(mesh, STEEL, tmp_path / "blade.inp", sectors=SECTORS)
    write_deck(segment(), STEEL, tmp_path / "piece.inp", clamped=())
    between = (("segment.left", "blade.under_high"), ("segment.right", "next.blade.under_low"))
    met = "\n".join(
        f'[contact.c{i}]\nbetween = ["{a}", "{b}"]\npairing = "node_to_segment"\nlaw = "elastic_coulomb"\nper = "point"\n'
        "normal_stiffness_n_per_m = 8e6\ntangential_stiffness_n_per_m = 6e6\naxial_stiffness_n_per_m = 6e6\nfriction_coefficient = 0.2"
        for i, (a, b) in enumerate(between)
    )
    text = (
        "schema_version = 2\n[part.blade]\nfile = 'blade.inp'\nunits = 'SI'\n"
        f"[part.segment]\nfile = 'piece.inp'\nunits = 'SI'\nsectors = {SECTORS}\ncyclic = 'none'\n{met}\n"
        "[load.gas]\non = 'blade.tip'\nforce_n = 1.0\ndirection = 'y'\nengine_order = 2\n"
        f"[rotation]\nspeed_rpm = {SPEED * 30 / math.pi}\n[forced_response]\nfrequency_hz = [800.0, 810.0]\n"
        "[output]\npoints = { tip = 'blade.tip' }\n"
    )
    (tmp_path / "study.toml").write_text(text)
    model = read_study(tmp_path / "study.toml").model()
    force = assemble(model, 1).static_force
    assert np.all(force[:, 2].reshape(2, -1).sum(axis=1) < -100.0)  # pressed on both sides
    (tmp_path / "study.toml").write_text(text.replace("cyclic = 'none'\n", ""))
    with pytest.raises(InputError, match='Of a part that only contacts connect say cyclic = "none"'):
        read_study(tmp_path / "study.toml").model()
