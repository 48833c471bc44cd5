"""Matrices at several speeds: the same part as the solid that wrote them, and refusals of other content."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
from solid_models import box

import stickslip as ss
from evidence.models.annulus import annular_sector
from stickslip.assembly.assembling import assemble
from stickslip.assembly.part_reduction import Spin, at_speed
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.damping import Damping
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material
from stickslip.model.matrices_at_speeds import AtSpeed, speed_matrices, warnings_of
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import solid_part, structure_part
from stickslip.model.readers.frd import read_displacement
from stickslip.model.readers.units import Units
from stickslip.model.structure import Dofs, Structure
from stickslip.model.structure_file import save_structure
from stickslip.reduction.choice import Reduction
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.units import RPM

STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
AXIS = Axis((0.0, 1.0, 0.0), (-0.3, 0.0, 0.0))
SPEEDS = tuple(RPM * n for n in (0.0, 4000.0, 8000.0, 12000.0))


@pytest.fixture(scope="module")
def blade():
    """A short blade, clamped at its lower end, 0.3 m from the axis."""
    mesh = box(10, (0.06, 0.02, 0.01), (4, 1, 1))
    return rotating_solid(mesh, STEEL, AXIS, clamped=("root",))


def states(solid, speeds=SPEEDS, *, coriolis=True, tangent="consistent"):
    return [
        AtSpeed(
            s,
            solid.at_speed(s, tangent=tangent, coriolis=coriolis) if s else solid.structure,
            solid.displacement(s) if s else None,
        )
        for s in speeds
    ]


def apart(found, exact):
    return scipy.sparse.linalg.norm(scipy.sparse.csr_array(found - exact)) / scipy.sparse.linalg.norm(exact)


@pytest.mark.parametrize("speeds", [SPEEDS, SPEEDS[:3]])
def test_between_the_speeds_the_matrices_are_those_of_the_solid(blade, speeds):
    own = speed_matrices(states(blade, speeds), AXIS)
    for rpm in (0.0, 1500.0, 4000.0, 7000.0):
        speed = RPM * rpm
        there = blade.at_speed(speed, coriolis=True)
        assert apart(own.at_speed(speed, coriolis=True).stiffness, there.stiffness) < 1e-13
        if speed:
            assert apart(own.at_speed(speed, coriolis=True).damping, there.damping) < 1e-12
        load = there.stiffness @ blade.displacement(speed)
        assert np.linalg.norm(own.static_load(speed) - load) <= 1e-10 * np.linalg.norm(load)
        exact = blade.polynomial(tangent="consistent").by_square(speed)
        change = own.at_speed(speeds[-1]).stiffness - own.rest.stiffness
        assert scipy.sparse.linalg.norm(own.by_square(speed) - exact) * speeds[
            -1
        ] ** 2 < 1e-6 * scipy.sparse.linalg.norm(change)


def test_the_error_at_a_speed_left_out_is_told(blade):
    four, three = (speed_matrices(states(blade, s), AXIS) for s in (SPEEDS, SPEEDS[:3]))
    assert four.error < 1e-6
    assert not warnings_of(four, "part.blade", AXIS)
    # a straight line through two speeds misses Ω⁴ K_2: at the middle x of [0, X] by K_2 x (X - x)
    exact = blade.polynomial(tangent="consistent")
    x, top = SPEEDS[1] ** 2, SPEEDS[2] ** 2
    whole = scipy.sparse.linalg.norm(three.at_speed(SPEEDS[2]).stiffness - three.rest.stiffness)
    assert three.error == pytest.approx(scipy.sparse.linalg.norm(exact.fourth) * x * (top - x) / whole, rel=1e-4)


def test_pieces_pass_through_the_speeds_and_their_slope_is_the_derivative(blade):
    own = speed_matrices(states(blade), AXIS, between="pchip")
    for state in own.states[1:]:
        values = own._values(state.speed**2)
        assert apart(own._matrix(values), state.structure.stiffness) < 1e-14
    speed, step = RPM * 6000.0, 1.0
    ahead, behind = (own.at_speed(np.sqrt(speed**2 + s)).stiffness for s in (step, -step))
    slope = own.by_square(speed)
    assert scipy.sparse.linalg.norm((ahead - behind) / (2 * step) - slope) < 1e-3 * scipy.sparse.linalg.norm(slope)


def test_other_content_is_refused(blade):
    good = states(blade)
    with pytest.raises(InputError, match="needs matrices at rest and at two or more further speeds, got 0, 4000 rpm"):
        speed_matrices(good[:2], AXIS)
    with pytest.raises(InputError, match="lacks the spin softening of the mass"):
        speed_matrices(
            [good[0], *(_with(s, s.structure.stiffness + s.speed**2 * blade.spin_softening) for s in good[1:])], AXIS
        )
    with pytest.raises(InputError, match=r"holds 91.19 of the spin softening that mass and speed have"):
        speed_matrices([good[0], *(replace(s, speed=s.speed * RPM) for s in good[1:])], AXIS)
    with pytest.raises(InputError, match="of the spin softening"):
        speed_matrices(good, Axis((1.0, 0.0, 0.0), AXIS.origin))
    with pytest.raises(InputError, match=r"the damping matrix holds -1 of the Coriolis forces"):
        speed_matrices([replace(s, structure=replace(s.structure, damping=-s.structure.damping)) for s in good], AXIS)
    with pytest.raises(InputError, match="another mass than the matrices at rest"):
        speed_matrices(
            [*good[:3], replace(good[3], structure=replace(good[3].structure, mass=1.01 * good[3].structure.mass))],
            AXIS,
        )
    order = np.roll(np.arange(blade.structure.n), 1)
    with pytest.raises(InputError, match="has other dofs than the matrices at rest"):
        speed_matrices(
            [
                *good[:3],
                replace(good[3], structure=replace(good[3].structure, dofs=good[3].structure.dofs.take(order))),
            ],
            AXIS,
        )
    small = craig_bampton(blade.structure, np.arange(9), 3)
    with pytest.raises(InputError, match="modes of different speeds cannot be interpolated"):
        speed_matrices([AtSpeed(s, small) for s in SPEEDS], AXIS)
    own = speed_matrices(states(blade, coriolis=False), AXIS)
    with pytest.raises(InputError, match="have no Coriolis matrix"):
        own.at_speed(SPEEDS[1], coriolis=True)
    with pytest.raises(InputError, match="goes up to 12000 rpm, and 13000 rpm is asked for"):
        own.at_speed(RPM * 13000.0)


def _with(state, stiffness):
    return replace(state, structure=replace(state.structure, stiffness=scipy.sparse.csr_array(stiffness)))


def model(part):
    """The blade with friction at its tip, which the centrifugal force presses against the ground."""
    law = ss.ElasticCoulomb(k_n=2e7, k_t=2e7, k_w=2e7, mu=0.3)
    return ss.Model(
        parts={"blade": part},
        contacts={"tip": ss.Contact(between=("blade.tip", "ground"), law=law, tangent=(0.0, 0.0, 1.0))},
        loads={"air": ss.Load(on="blade.tip", direction=(0.0, 0.0, 1.0), newton=20.0)},
        outputs=(ss.Output(name="tip", on="blade.tip"),),
        speed=RPM * 7000.0,
        coriolis=True,
    )


def test_a_model_of_matrices_is_the_model_of_the_mesh_that_wrote_them(blade):
    mesh, axis = blade.mesh, {"axis": AXIS, "reduction": Reduction(6)}
    turning = speed_matrices(states(blade), AXIS)
    one = model(solid_part(mesh, STEEL, **axis))
    other = model(structure_part(blade.structure, mesh=mesh, turning=turning, **axis))
    assert other.rotates
    a, b = (assemble(own, 1) for own in (one, other))
    size = float(np.abs(a.system.structure.stiffness).max())
    np.testing.assert_allclose(b.system.structure.stiffness, a.system.structure.stiffness, atol=1e-9 * size)
    np.testing.assert_allclose(b.system.structure.damping, a.system.structure.damping, atol=1e-9)
    pressed = float(np.abs(a.load.static).max())
    assert pressed > 100.0
    np.testing.assert_allclose(b.load.static, a.load.static, atol=1e-8 * pressed)
    for rpm in (3000.0, 11000.0):
        exact, found = (natural_frequencies(own.at(RPM * rpm), 4) for own in (one, other))
        np.testing.assert_allclose(found, exact, rtol=1e-9)


STUDY = """\
schema_version = 2
title = "A blade of matrices"

[part.blade]
file = "rest.npz"
axis_direction = [0.0, 1.0, 0.0]
axis_origin_m = [-0.3, 0.0, 0.0]
units = "SI"
reduction.fixed_interface_modes = 6

[[part.blade.at_speed]]
speed_rpm = 6000.0
file = "n6.npz"
displacement = "u6.csv"

[[part.blade.at_speed]]
speed_rpm = 12000.0
file = "n12.npz"
displacement = "u12.csv"

[damping]
modal_ratio = 1e-3

[load.air]
on = "blade.tip"
direction = "z"
force_n = 1.0

[output]
points = { tip = "blade.tip" }

[campbell]
speeds_rpm = [0.0, 10000.0]
engine_orders = [4]
points = 3
modes = 3
"""


@pytest.fixture
def study(blade, tmp_path):
    """A study with a blade of matrices at 0, 6000 and 12,000 rpm."""
    for name, rpm in (("rest", 0.0), ("n6", 6000.0), ("n12", 12000.0)):
        speed = RPM * rpm
        save_structure(blade.at_speed(speed, coriolis=True) if rpm else blade.structure, tmp_path / f"{name}.npz")
        if rpm:
            moved = np.zeros((len(blade.mesh.points), 3))
            moved.ravel()[blade.moving] = blade.displacement(speed)
            lines = [f"{i},{x:.17g},{y:.17g},{z:.17g}" for i, (x, y, z) in enumerate(moved)]
            (tmp_path / f"u{name[1:]}.csv").write_text("\n".join(["node,x,y,z", *lines]))
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path / "study.toml"


def test_a_study_draws_the_campbell_diagram_of_matrices(blade, study):
    data = ss.Study.from_file(study).run()["campbell"]
    assert data.rotation.values.item() == "at each speed, matrices of another program, without Coriolis forces"
    for k, rpm in enumerate((0.0, 5000.0, 10000.0)):
        exact = natural_frequencies(blade.at_speed(RPM * rpm) if rpm else blade.structure, 3)
        np.testing.assert_allclose(np.ravel(data.frequency_hz.values[..., k, :]), exact, rtol=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[0.0, 10000.0]", "[0.0, 13000.0]", "part.blade: at_speed: goes up to 12000 rpm, and 13000 rpm is asked for."),
        (
            "speed_rpm = 12000.0",
            "speed_rpm = 6000.0",
            "needs matrices at rest and at two or more further speeds, got 0, 6000, 6000 rpm",
        ),
        (
            "speed_rpm = 6000.0",
            "speed_rpm = 7000.0",
            "part.blade: at_speed at 7000 rpm: has a Coriolis matrix that is not proportional to the speed: 14 % apart",
        ),
        ('"n6.npz"', '"u6.csv"', "no reader for files '.csv'"),
        ('"u6.csv"', '"n6.npz"', "n6.npz"),
        ('"rest.npz"', '"rest.inp"', "part.blade.file"),
    ],
)
def test_wrong_matrices_at_speed_are_told_by_file_key_and_value(study, old, new, told):
    study.write_text(STUDY.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        ss.Study.from_file(study).run()
    assert told in str(error.value)


def test_missing_displacements_are_a_doubt(blade):
    bare = [replace(s, displacement=None) for s in states(blade)]
    own = speed_matrices(bare, AXIS)
    assert not own.static_load(SPEEDS[2]).any()
    (said,) = warnings_of(own, "part.blade", AXIS)
    assert "static displacements of the speeds are not given" in said


def test_a_sector_of_matrices_is_the_sector_that_wrote_them():
    sectors = 9
    mesh = annular_sector(0.1, 0.2, 0.02, sectors=sectors, divisions=(3, 3, 1))
    one = ss.Model(parts={"disk": solid_part(mesh, STEEL, sectors=sectors)})
    part, steady = one.parts["disk"], one.steady["disk"]
    known = [
        AtSpeed(s, at_speed("disk", part, Spin(s, coriolis=True), steady), steady.displacement(part, s) if s else None)
        for s in SPEEDS
    ]
    made = structure_part(part.structure, turning=speed_matrices(known, part.axis), sectors=sectors, axis=part.axis)
    other = ss.Model(parts={"disk": made})
    for wave in (0, 2):
        exact, found = (natural_frequencies(own.at(RPM * 7000.0, wave), 4) for own in (one, other))
        np.testing.assert_allclose(found, exact, rtol=1e-8)


@pytest.mark.validation
def test_a_run_up_of_matrices_is_that_of_the_mesh():
    sectors = 9
    mesh = annular_sector(0.1, 0.2, 0.02, sectors=sectors, divisions=(3, 3, 1))
    at = mesh.points
    rim = np.flatnonzero((np.hypot(at[:, 0], at[:, 1]) > 0.1999) & (abs(at[:, 1]) < 1e-6) & (at[:, 2] > 0.009))
    mesh = replace(mesh, node_sets=mesh.node_sets | {"point": rim})
    meshed = solid_part(mesh, STEEL, sectors=sectors, clamped=("root",))
    alone = ss.Model(parts={"disk": meshed})
    steady = alone.steady["disk"]
    known = [
        AtSpeed(
            s, at_speed("disk", meshed, Spin(s, coriolis=True), steady), steady.displacement(meshed, s) if s else None
        )
        for s in SPEEDS
    ]
    turning = speed_matrices(known, meshed.axis)
    stored = structure_part(meshed.structure, turning=turning, sectors=sectors, axis=meshed.axis)

    def peak(part):
        law = ss.ElasticCoulomb(k_t=2e6, k_w=2e6, k_n=2e6, mu=0.3)
        model = ss.Model(
            parts={"disk": replace(part, damping=Damping(alpha=10.0, beta=1e-7), reduction=Reduction(8))},
            contacts={
                "pad": ss.Contact(
                    between=("disk.point", "ground"), law=law, tangent=(0, 0, 1), normal=(1, 0, 0), preload=60.0
                )
            },
            loads={"gas": ss.Load(on="disk.point", newton=3.0, direction=(0, 0, 1), engine_order=12)},
            outputs=(ss.Output(name="rim", on="disk.point"),),
        )
        data = model.run_up(speeds_rpm=(10800.0, 11900.0), engine_orders=[12], points=8)["run_up"]
        return float(data["peak_amplitude"].values.item()), float(data["peak_speed_rpm"].values.item())

    own, other = peak(meshed), peak(stored)
    assert 10900.0 < own[1] < 11800.0  # a resonance, no end of the range
    np.testing.assert_allclose(other, own, rtol=1e-7)


def lattice(supports):
    """Nodes on a regular grid with springs along its edges and diagonals, which the tension of a speed stiffens; held dofs removed."""
    points = np.array([[x, y, z] for x in range(4) for y in range(3) for z in range(3)], dtype=float) * 0.05
    n = len(points)
    rest, tension = np.zeros((3 * n, 3 * n)), np.zeros((3 * n, 3 * n))
    for i in range(n):
        for j in range(i):
            along = points[i] - points[j]
            length = np.linalg.norm(along)
            if length < 0.09:
                pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
                block = np.outer(along, along) / length**2
                where = np.ix_(*[[3 * i, 3 * i + 1, 3 * i + 2, 3 * j, 3 * j + 1, 3 * j + 2]] * 2)
                rest[where] += np.kron(pair, 1e6 * block)
                tension[where] += np.kron(pair, (0.5 + points[i, 0]) * (np.eye(3) - block))
    mass = np.eye(3 * n) * 0.2
    kept = np.flatnonzero(~supports(points).ravel())
    dofs = Dofs(
        np.repeat(np.arange(n), 3)[kept], tuple(np.tile(["x", "y", "z"], n)[kept]), np.repeat(points, 3, axis=0)[kept]
    )
    return rest[np.ix_(kept, kept)], tension[np.ix_(kept, kept)], mass[np.ix_(kept, kept)], dofs


@pytest.mark.parametrize("held", [(), (2,), (1, 2)])
def test_supports_in_single_directions_are_no_other_content(held):
    """Beside a plane of symmetry forces of a translation cancel at rest and not at speed."""

    def supports(points):
        own = np.repeat(points[:, :1] == 0.0, 3, axis=1)
        for axis in held:
            own[:, axis] |= points[:, axis] == 0.0
        return own

    rest, tension, mass, dofs = lattice(supports)
    axis = Axis((0.0, 1.0, 1.0), (-0.3, 0.0, 0.0))
    plane = np.eye(3) - np.outer(axis.unit, axis.unit)
    spread = np.zeros((len(dofs), len(dofs)))
    for i in range(len(dofs)):
        for j in range(len(dofs)):
            if dofs.node[i] == dofs.node[j]:
                spread[i, j] = plane["xyz".index(dofs.component[i]), "xyz".index(dofs.component[j])]
    none = np.zeros_like(rest)
    made = [AtSpeed(s, Structure(mass, none, rest + s**2 * (tension - mass @ spread), dofs)) for s in SPEEDS]
    assert speed_matrices(made, axis).error < 1e-9
    with pytest.raises(InputError, match="of the spin softening that mass and speed have"):
        speed_matrices(made, Axis())


def test_consistent_masses_of_beams_hold_their_spin_softening_in_rotations_too():
    """A beam along x about y: it softens by the mass of its motion along x and z, rotations included."""
    size = 1.0
    coupled = np.array([[54, -13 * size], [13 * size, -3 * size**2]]) / 420
    stiff = np.array([[12, 6 * size], [6 * size, 4 * size**2]]), np.array([[12, -6 * size], [-6 * size, 4 * size**2]])
    off = np.array([[-12, 6 * size], [-6 * size, 2 * size**2]])
    n = 6
    mass, rest = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    for i in range(n - 1):
        a, b = slice(2 * i, 2 * i + 2), slice(2 * i + 2, 2 * i + 4)
        rest[a, a] += 1e5 * stiff[0]
        rest[b, b] += 1e5 * stiff[1]
        rest[a, b] += 1e5 * off
        rest[b, a] += 1e5 * off.T
        mass[a, a] += np.array([[156, 22 * size], [22 * size, 4 * size**2]]) / 420
        mass[b, b] += np.array([[156, -22 * size], [-22 * size, 4 * size**2]]) / 420
        mass[a, b] += coupled
        mass[b, a] += coupled.T
    # free in bending along z with rotation; x and y of each node are springs to their neighbours with lumped mass
    chain = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    chain[0, 0] = chain[-1, -1] = 1.0
    whole_m = np.zeros((4 * n, 4 * n))
    whole_k = np.zeros((4 * n, 4 * n))
    z = np.array([[4 * i + 2, 4 * i + 3] for i in range(n)]).ravel()
    whole_m[np.ix_(z, z)], whole_k[np.ix_(z, z)] = mass, rest
    for k in (0, 1):
        own = 4 * np.arange(n) + k
        whole_m[own, own] = 1.0
        whole_k[np.ix_(own, own)] = 1e6 * chain
    dofs = Dofs(
        np.repeat(np.arange(n), 4), ("x", "y", "z", "ry") * n, np.repeat(np.arange(n) * [[size], [0], [0]], 4, axis=1).T
    )
    own = np.isin(np.array(dofs.component), ("x", "z", "ry"))
    soft = whole_m * np.outer(own, own)
    none = np.zeros_like(whole_m)
    made = [AtSpeed(s, Structure(whole_m, none, whole_k - s**2 * soft, dofs)) for s in SPEEDS]
    assert speed_matrices(made, Axis((0.0, 1.0, 0.0))).error < 1e-9


@pytest.mark.parametrize(("factor", "ratio"), [(4.0, "4"), (-1.0, "-1"), (1000.0, "1e+03")])
def test_a_displacement_of_another_speed_or_unit_is_a_doubt(blade, factor, ratio):
    known = states(blade)
    wrong = [*known[:2], replace(known[2], displacement=factor * known[2].displacement), known[3]]
    (said,) = warnings_of(speed_matrices(wrong, AXIS), "part.blade", AXIS)
    assert (
        f"at_speed at 8000 rpm: the displacement is {ratio} times what the centrifugal load of this speed causes"
        in said
    )
    with pytest.raises(InputError, match="at 8000 rpm: lacks the static displacement that other speeds have"):
        speed_matrices([*known[:2], replace(known[2], displacement=None), known[3]], AXIS)
    damped = replace(known[1].structure, damping=known[1].structure.damping + 1e-3 * blade.structure.mass)
    own = speed_matrices([known[0], replace(known[1], structure=damped), *known[2:]], AXIS)
    (said,) = warnings_of(own, "part.blade", AXIS)
    assert "at 4000 rpm: the damping matrix dissipates otherwise than at rest" in said


def test_rotations_of_a_displacement_are_read_or_missed(tmp_path):
    dofs = Dofs(np.array([7, 7, 3]), ("x", "rz", "y"), np.zeros((3, 3)))
    file = tmp_path / "u.csv"
    file.write_text("node,x,y,z,rz\n7,1,2,3,0.5\n3,4,5,6,0.25\n")
    np.testing.assert_allclose(read_displacement(file, dofs, Units.named("mm-t-s")), [1e-3, 0.5, 5e-3])
    file.write_text("node,x,y,z\n7,1,2,3\n3,4,5,6\n")
    with pytest.raises(InputError, match="has no rz, which the matrices have"):
        read_displacement(file, dofs, Units.named("SI"))
    with pytest.raises(InputError, match="lacks 1 nodes"):
        read_displacement(file, replace(dofs, node=np.array([7, 7, 8]), component=("x", "y", "y")), Units.named("SI"))
