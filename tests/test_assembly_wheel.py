"""A model that is a sector of a wheel against all sectors without symmetry, assembled from one mesh of the whole."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
from newton_bounds import allowed, answer_at

from stickslip.assembly.assembling import assemble
from stickslip.assembly.build import holding_points, linear_side
from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.forces import Load, Output
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.part_reduction import in_memory
from stickslip.assembly.sides.waves import _one_of
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.pairing import node_to_segment
from stickslip.contact.surface import nodal_surface
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.axis import Axis
from stickslip.model.damping import Damping, rayleigh_damping
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh, facets_of
from stickslip.model.modes import natural_frequencies, with_springs
from stickslip.model.part import BodyPoints, rigid_part, solid_part
from stickslip.model.rigid.body import RigidBody
from stickslip.model.structure import join
from stickslip.reduction.choice import Reduction
from stickslip.reduction.cyclic import travelling_wave
from stickslip.reduction.truncation import ModesBelow
from stickslip.response.equilibrium import preload
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.response.system import System

SECTORS, ORDER, H = 5, 2, 3
SPEED = 300.0
RADII = (0.10, 0.13, 0.18, 0.20)
STEEL = Material()
LAW = ElasticCoulomb(k_t=6e6, k_w=6e6, k_n=8e6, mu=0.15, preload=200.0)


def shrouded_sector():
    """One of five sectors: a piece of a ring, a blade of one brick, a shroud whose two contact faces are meshed differently."""
    half = math.pi / SECTORS
    angle, depth = np.array([-half, -0.3 * half, 0.35 * half, half]), (-0.02, 0.004, 0.02)
    number = np.arange(4 * 4 * 3).reshape(4, 4, 3)
    points = np.array([[r * math.cos(a), r * math.sin(a), z] for r in RADII for a in angle for z in depth])
    for i in (2, 3):  # the middle nodes of the high face lie elsewhere
        points[number[i, 3, 1], 2] = -0.006
    cells = []
    for i, columns in ((0, range(3)), (1, (1,)), (2, range(3))):
        for j in columns:
            for k in range(2):
                a, b, c, d = (number[i, j, k], number[i + 1, j, k], number[i + 1, j + 1, k], number[i, j + 1, k])
                top = [
                    number[i, j, k + 1],
                    number[i + 1, j, k + 1],
                    number[i + 1, j + 1, k + 1],
                    number[i, j + 1, k + 1],
                ]
                cells.append([a, b, c, d, *top])
    sets = {
        "root": number[0].ravel(),
        "cyclic_low": number[1, 0],
        "cyclic_high": number[1, 3],
        "shroud_low": number[2:, 0].ravel(),
        "shroud_high": number[2:, 3].ravel(),
        "tip": number[3, 1:3, 1],
        "flank_low": number[1:3, 1].ravel(),
    }
    return SolidMesh(points, np.array(cells), sets)


def whole_wheel(mesh):
    """Return the mesh of all sectors, the nodes of shared faces merged, and the nodes of each sector in it."""
    n = len(mesh.points)
    low, high = mesh.node_sets["cyclic_low"], mesh.node_sets["cyclic_high"]
    root = mesh.node_sets["root"]
    low = np.concatenate([low, root[:3]])
    high = np.concatenate([high, root[-3:]])
    place = np.arange(SECTORS * n).reshape(SECTORS, n)
    for s in range(SECTORS):
        place[s, high] = place[(s + 1) % SECTORS, low]
    axis = Axis()
    points = np.vstack([axis.turned(mesh.points, 2 * math.pi * s / SECTORS) for s in range(SECTORS)])
    used, cells = np.unique(place[:, mesh.cells].reshape(-1, 8), return_inverse=True)
    nodes = np.searchsorted(used, place)
    sets = {"root": np.unique(nodes[:, root])}
    return SolidMesh(points[used], cells.reshape(-1, 8), sets), nodes


def dofs_of(structure, nodes):
    """Return the (k, 3) dofs of nodes of a structure assembled from a mesh without numbers."""
    place = {(int(n), c): i for i, (n, c) in enumerate(zip(structure.dofs.node, structure.dofs.component, strict=True))}
    return np.array([[place.get((int(n), c), -1) for c in "xyz"] for n in nodes])


def answered(system, load, hertz):
    sweep = Sweep(
        omega_range=(2 * math.pi * hertz[0], 2 * math.pi * hertz[1]),
        low=H,
        high=H,
        selection="always_low",
        frequencies=2,
        peak_points=0,
    )
    problem = forced_problem(system, load, sweep)
    points = list(forced_response(system, load, sweep))
    assert all(point.converged for point in points)
    return [answer_at(problem, point) for point in points]


def sector_model(mesh, **changes):
    own = {"damping": Damping(ratio=0.003, between_hz=(500, 3000))}
    return Model(
        parts={"blade": solid_part(mesh, STEEL, sectors=SECTORS, **own)},
        contacts={
            "shroud": Contact(
                between=("blade.shroud_high", "next.blade.shroud_low"),
                law=LAW,
                pairing="node_to_segment",
                tangent=(1.0, 0.0, 0.0),
            )
        },
        loads={
            "gas": Load(on="blade.tip", newton=2000.0, direction=(0.2, 1, 0.3), engine_order=ORDER),
            "more": Load(on="blade.tip", newton=600.0, direction=(1, 0, 0), harmonic=2, phase=0.4, engine_order=ORDER),
            "lean": Load(on="blade.tip", newton=15.0, direction=(0, 1, 1), harmonic=0),
        },
        outputs=(Output(name="tip", on="blade.tip"),),
        speed=SPEED,
        **changes,
    )


@pytest.mark.parametrize("touched", [False, True])
def test_shrouds_that_do_not_match_answer_on_one_sector_as_on_all(touched):
    """Rotation, static loads, two harmonics of excitation and slip, on the mesh of the whole wheel without symmetry.

    Outputs on nodes that the neighbour touches have the phase of their own sector.
    """
    mesh = shrouded_sector()
    model = sector_model(mesh)
    if touched:
        model = replace(model, outputs=(*model.outputs, Output(name="low", on="blade.shroud_low")))
    found = assemble(model, H)
    assert found.engine_order == ORDER
    if not touched:
        assert found.system.retained.size == 3 * 6  # gaps, not nodes of both sides

    whole, nodes = whole_wheel(mesh)
    solid = rotating_solid(whole, STEEL)
    turning = solid.at_speed(SPEED)
    damped = rayleigh_damping(turning, 0.003, (500.0, 3000.0))
    static = turning.stiffness @ solid.displacement(SPEED)
    force = {h: np.zeros(damped.n, dtype=complex) for h in (1, 2)}
    tip = mesh.node_sets["tip"]
    axis = Axis()
    for s in range(SECTORS):
        turn = axis.rotation(2 * math.pi * s / SECTORS)
        here = dofs_of(damped, nodes[s, tip])
        unit = np.array([0.2, 1, 0.3]) / np.linalg.norm([0.2, 1, 0.3])
        theta = 2 * math.pi * ORDER * s / SECTORS
        force[1][here] += turn @ unit * 2000.0 / 2 * np.exp(1j * theta)
        force[2][here] += turn @ np.array([1.0, 0, 0]) * 600.0 / 2 * np.exp(1j * (0.4 + 2 * theta))
        static[here] += turn @ np.array([0, 1, 1]) / math.sqrt(2) * 15.0 / 2
    _, gaps = whole_with_gaps(model)
    names = tuple(f"{s}.{i}" for s in range(SECTORS) for i in range(6))
    interface = Interface(names, (LAW,) * len(names), gaps)
    shown = np.concatenate([tip[:1], mesh.node_sets["shroud_low"][: int(touched)]])
    seen = dofs_of(damped, nodes[0, shown]).ravel()
    system = System(damped, interface, seen)
    load = HarmonicLoad(static, force)

    at_rest = (interface.gap_operator[:, system.retained] @ preload(system, static)).reshape(-1, 3)
    assert np.abs(at_rest[:6] - found.static_gap).max() < 1e-9 * np.abs(at_rest).max()
    assert np.ptp(found.static_force[:, 2]) > 5.0  # rotation presses the points differently
    hertz = (2140.0, 2200.0)
    mine, theirs = answered(found.system, found.load, hertz), answered(system, load, hertz)
    for one, every in zip(mine, theirs, strict=True):
        assert one.energy.max() > 1e-4  # else nothing slips
        assert np.abs(one.outputs - every.outputs).max() <= allowed("outputs", one, every)
        for h in range(H + 1):
            phase = np.exp(2j * math.pi * h * ORDER * np.repeat(np.arange(SECTORS), 6) / SECTORS)
            own = np.tile(one.gaps[h].reshape(6, 3), (SECTORS, 1))
            there = every.gaps[h].reshape(-1, 3)
            assert np.abs(there - phase[:, None] * own).max() <= allowed("gaps", one, every)


@pytest.mark.kernel
def test_waves_of_unsymmetric_parts_are_not_each_others_mirror():
    """Matrices of an aerodynamic kind tell the two directions apart: wave 4 of five is no conjugate of wave 1."""
    model = sector_model(shrouded_sector())
    blade = model.parts["blade"]
    free = blade.structure
    more = scipy.sparse.random_array((free.n, free.n), density=0.01, rng=np.random.default_rng(3))
    for aside in (0.3 * more, 0.3j * more):
        stiffness = scipy.sparse.csr_array(free.stiffness + abs(free.stiffness).max() * aside)
        part = replace(blade, structure=replace(free, stiffness=stiffness), solid=None, damping=None)
        own = replace(model, parts={"blade": part}, speed=0.0)
        side = linear_side(own, ORDER, H, np.zeros(0, dtype=int), np.zeros(0, dtype=int), in_memory).side
        sector = own.neighbours.sector(part.structure, own.coordinates)
        for h, k in enumerate((0, 2, 4, 1)):
            mine, theirs = (spectrum(s) for s in (side.of_harmonic(h), travelling_wave(sector, k)))
            np.testing.assert_allclose(mine, theirs, rtol=1e-7, atol=1e-9 * abs(theirs).max())


def spectrum(structure):
    dense = [m.toarray() if scipy.sparse.issparse(m) else m for m in (structure.mass, structure.stiffness)]
    return np.sort_complex(np.linalg.eigvals(np.linalg.solve(*dense)))


def test_full_waves_have_the_frequencies_of_the_whole_wheel_with_its_contacts_stuck_open_or_pressed():
    model = sector_model(shrouded_sector())
    damped, gaps = whole_with_gaps(model)
    ways: tuple[ContactsAs, ...] = ("open", "stuck", "static")
    holds = [holding_points(model, way) for way in ways]
    assert [np.count_nonzero(held) for held in holds[:2]] == [0, 6]
    assert 0 < np.count_nonzero(holds[2]) < 6
    springs = np.array([LAW.k_t, LAW.k_w, LAW.k_n])
    for held in holds:
        waves = [model.at(SPEED, k, held) for k in range(SECTORS)]
        found = np.sort(np.concatenate([natural_frequencies(w, 3) for w in waves]))[:10]
        whole = with_springs(damped, gaps, (np.tile(held, SECTORS)[:, None] * springs).ravel())
        np.testing.assert_allclose(found, natural_frequencies(whole, 10), rtol=1e-9)
        assert scipy.sparse.issparse(waves[0].stiffness)
        assert waves[1].basis.shape[0] == model.places.n


def whole_with_gaps(model):
    """Return the turning wheel of all sectors and the gaps between its shrouds."""
    mesh = model.parts["blade"].mesh
    whole, nodes = whole_wheel(mesh)
    turning = rotating_solid(whole, STEEL).at_speed(model.speed)
    rows = []
    for s in range(SECTORS):
        high, low = (
            face_of(turning, whole, nodes[n], mesh, side)
            for n, side in ((s, "shroud_high"), ((s + 1) % SECTORS, "shroud_low"))
        )
        along = tuple(Axis().rotation(2 * math.pi * s / SECTORS)[:, 0])
        rows.append(node_to_segment(high, low, direction=along).gap_operator)
    return turning, scipy.sparse.vstack(rows, format="csr")


def face_of(structure, whole, own, mesh, side):
    """Return a shroud face of one sector, whose nodes in the whole wheel are `own`."""
    members = mesh.node_sets[side]
    local = np.full(len(mesh.points), -1)
    local[members] = np.arange(len(members))
    facets = local[facets_of(mesh, members)]
    here = own[members]
    return nodal_surface(whole.points[here], dofs_of(structure, here), structure.n, facets)


BODY = RigidBody(mass=0.02, inertia=(3e-6, 2e-6, 4e-6), centre=(0.155, 0.0, 0.0))


def test_a_rigid_damper_between_blade_and_next_blade_answers_on_one_sector_as_on_all():
    """A body in each sector, nodes of both neighbours, thrown outward by the rotation; a node of a contact is an output."""
    mesh = shrouded_sector()
    high, low = (mesh.node_sets[f"shroud_{side}"][[0, 2, 3]] for side in ("high", "low"))
    mesh = replace(mesh, node_sets={**mesh.node_sets, "left": high, "right": low})
    axis, pitch = Axis(), 2 * math.pi / SECTORS
    tilt = axis.rotation(pitch / 2)
    frames = {}
    for side, sign in (("left", -1), ("right", 1)):
        normal = tilt @ np.array([math.cos(0.6), sign * math.sin(0.6), 0.0])
        frames[side] = np.column_stack([np.cross(normal, [0, 0, 1]), [0, 0, -1], normal])
        frames[side] = np.column_stack([frames[side][:, 0], np.cross(normal, frames[side][:, 0]), normal])
    places = {"left": mesh.points[high], "right": axis.turned(mesh.points[low], pitch)}
    surfaces = {
        side: BodyPoints(tuple(f"{side}.{i}" for i in range(3)), places[side], np.tile(frames[side], (3, 1, 1)))
        for side in frames
    }
    body = replace(BODY, centre=(0.185, 0.0, 0.0)).moved(tilt, np.zeros(3))
    law = replace(LAW, preload=0.0, mu=0.4)
    model = Model(
        parts={
            "blade": solid_part(
                mesh,
                STEEL,
                sectors=SECTORS,
                damping=Damping(ratio=0.003, between_hz=(3000 / (2 * math.pi), 20000 / (2 * math.pi))),
            ),
            "damper": rigid_part(body, surfaces),
        },
        contacts={
            "left": Contact(between=("damper.left", "blade.left"), law=law),
            "right": Contact(between=("damper.right", "next.blade.right"), law=law),
        },
        loads={"gas": Load(on="blade.tip", newton=1400.0, direction=(0, 1, 0.2), engine_order=ORDER)},
        outputs=(
            Output(name="tip", on="blade.tip"),
            Output(name="damper", on="damper"),
            Output(name="foot", on="blade.left"),
        ),
        alert_over=("damper.x", "left.0.x"),
        speed=SPEED,
        retention=1e5,
    )
    found = assemble(model, H)
    assert found.output_labels[3:9] == tuple(f"damper.{c}" for c in ("x", "y", "z", "rx", "ry", "rz"))
    assert np.all(found.static_force[:, 2] < 0)

    whole, nodes = whole_wheel(mesh)
    solid = rotating_solid(whole, STEEL)
    turning = solid.at_speed(SPEED)
    damped = rayleigh_damping(turning, 0.003, (3000.0 / (2 * math.pi), 20000.0 / (2 * math.pi)))
    bodies = [body.moved(axis.rotation(pitch * s), np.zeros(3)) for s in range(SECTORS)]
    turning_bodies = {f"b{s}": b.at_speed(SPEED, axis) for s, b in enumerate(bodies)}
    softening = -body.mass * SPEED**2 * np.diag([1.0, 1.0, 0.0])
    np.testing.assert_allclose(turning_bodies["b1"].stiffness[:3, :3], softening, atol=1e-9)
    both = join(wheel=damped, **turning_bodies)
    n = both.n
    static, force = np.zeros(n), np.zeros(n, dtype=complex)
    static[: damped.n] = turning.stiffness @ solid.displacement(SPEED)
    unit = np.array([0, 1, 0.2]) / np.linalg.norm([0, 1, 0.2])
    rows = []
    for s, b in enumerate(bodies):
        turn = axis.rotation(pitch * s)
        own = both.sets[f"b{s}"]
        arm = np.array(b.centre) * [1, 1, 0]
        static[own[:3]] = b.mass * SPEED**2 * arm
        here = dofs_of(damped, nodes[s, mesh.node_sets["tip"]])
        force[here] += turn @ unit * 700.0 * np.exp(2j * math.pi * ORDER * s / SECTORS)
        for side, sector in (("left", s), ("right", (s + 1) % SECTORS)):
            there = nodes[sector, mesh.node_sets[side]]
            motion = b.displacement_operator(whole.points[there])
            for i, dofs in enumerate(dofs_of(damped, there)):
                gap = np.zeros((3, n))
                gap[:, dofs] = (turn @ frames[side]).T
                gap[:, own] -= (turn @ frames[side]).T @ motion[i]
                rows.append(gap)
    names = tuple(f"c{i}" for i in range(len(rows)))
    interface = Interface(names, (law,) * len(rows), np.vstack(rows))
    seen = np.concatenate(
        [
            dofs_of(damped, nodes[0, [mesh.node_sets["tip"][0]]])[0],
            both.sets["b0"],
            dofs_of(damped, nodes[0, high[:1]])[0],
        ]
    )
    free = np.concatenate([both.sets[f"b{s}"] for s in range(SECTORS)])
    system = System(both, interface, seen, free=free).with_retention(1e5)
    hertz = (1900.0, 2000.0)
    mine = answered(found.system, found.load, hertz)
    theirs = answered(system, HarmonicLoad(static, {1: force}), hertz)
    for one, every in zip(mine, theirs, strict=True):
        assert one.energy.max() > 1e-4
        assert np.abs(one.outputs - every.outputs).max() <= allowed("outputs", one, every)


def test_shrouds_joined_from_sector_to_sector_are_one_ring():
    mesh = shrouded_sector()
    points = mesh.points.copy()
    high = mesh.node_sets["shroud_high"]
    points[high, 2] = mesh.points[mesh.node_sets["shroud_low"], 2]  # now both sides match
    mesh = replace(mesh, points=points)
    part = solid_part(mesh, STEEL, sectors=SECTORS)
    joined = Model(
        parts={"blade": part},
        joins={"ring": Join(between=("blade.shroud_high", "next.blade.shroud_low"), pairing="node_to_node")},
    )
    sets = dict(mesh.node_sets)
    for side in ("low", "high"):
        sets[f"cyclic_{side}"] = np.unique(np.concatenate([sets[f"cyclic_{side}"], sets[f"shroud_{side}"]]))
    ring = Model(parts={"blade": solid_part(replace(mesh, node_sets=sets), STEEL, sectors=SECTORS)})
    for k in range(3):
        found, expected = (natural_frequencies(m.at(SPEED, k), 6) for m in (joined, ring))
        np.testing.assert_allclose(found, expected, rtol=1e-9)
        for pairing in ("node_to_segment", "segment_to_segment"):
            tied = {"ring": replace(joined.joins["ring"], pairing=pairing)}
            # nodes of the two shroud faces lie elsewhere
            unlike = replace(sector_model(shrouded_sector()), contacts={}, joins=tied)
            found = natural_frequencies(unlike.at(SPEED, k), 6)
            np.testing.assert_allclose(found, expected, rtol=0.05)
            assert np.abs(found / expected - 1).max() > 1e-6


def test_what_is_wrong_with_a_wheel_is_named():
    mesh = shrouded_sector()
    model = sector_model(mesh)
    plain = {name: replace(load, engine_order=None) for name, load in model.loads.items()}
    other = {**model.loads, "more": replace(model.loads["more"], engine_order=0)}
    two = {**model.parts, "second": solid_part(mesh, STEEL, sectors=6)}
    for match, changes in (
        ("load.gas.engine_order: is missing", {"loads": plain}),
        ("engine order 0 beside others .load.gas: 2, load.more: 0", {"loads": other}),
        ("part.second.sectors: is 6, and the part 'blade' is one of 5", {"parts": two}),
        ("part.second.sectors: is 1, and", {"parts": {**model.parts, "second": solid_part(mesh, STEEL)}}),
        (
            "part.blade: .*there is no set 'nowhere'",
            {"parts": {"blade": solid_part(mesh, STEEL, sectors=5, faces=("nowhere", "cyclic_high"))}},
        ),
    ):
        with pytest.raises(InputError, match=match):
            assemble(replace(model, **changes), H)


def test_an_output_on_the_high_face_is_refused_by_name():
    # it moves as the neighbour's low face, in the neighbour's axes: no coordinate of this sector says so
    model = sector_model(shrouded_sector())
    behind = Output(name="behind", on="blade.cyclic_high")
    with pytest.raises(InputError, match=r"output\.points: .* lies on the high cyclic face"):
        assemble(replace(model, outputs=(*model.outputs, behind)), H)


@pytest.mark.parametrize(
    ("ways", "found"),
    [
        ([Reduction(5)], Reduction(5)),
        ([Reduction(5), Reduction(7), Reduction(1)], Reduction(13)),
        ([Reduction(5, "rubin"), Reduction(7, "rubin")], Reduction(12, "rubin")),
        ([Reduction(ModesBelow(900.0)), Reduction(ModesBelow(900.0))], Reduction(ModesBelow(900.0))),
        ([Reduction(5), Reduction(7, "rubin")], "b"),
        ([Reduction(5), Reduction(ModesBelow(900.0))], "b"),
        ([Reduction(ModesBelow(900.0)), Reduction(5)], "b"),
        ([Reduction(ModesBelow(900.0)), Reduction(ModesBelow(900.0)), Reduction(ModesBelow(901.0))], "c"),
        ([Reduction(ModesBelow(900.0)), Reduction(ModesBelow(900.0), "rubin")], "b"),
    ],
)
def test_reductions_of_the_parts_of_a_sector_are_one(ways, found):
    named = dict(zip("abc", ways, strict=False))
    if isinstance(found, Reduction):
        assert _one_of(named) == found
        return
    with pytest.raises(InputError, match=rf"part\.{found}\.reduction: differs from that of part\.a.*same frequency"):
        _one_of(named)
