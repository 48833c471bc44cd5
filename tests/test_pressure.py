"""Pressure fields on facets: force, moment and virtual work against closed forms, and the wheel that they drive."""

import math
import re
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from small_v2 import SECTOR
from test_assembly_wheel import ORDER, SECTORS, H, sector_model, shrouded_sector

import stickslip as ss
from stickslip.analyses.forced_response.advice import pressure_lines
from stickslip.assembly.assembling import assemble
from stickslip.assembly.fluid.pressure import PressureField, put_on
from stickslip.assembly.locations import Places
from stickslip.contact.surface import nodal_surface
from stickslip.model.fe.solid import Material
from stickslip.reduction.waves import wave
from stickslip.study.models.pressure import read_pressure

pytestmark = pytest.mark.usefixtures("parts_once")

WIDE, HIGH = 0.05, 0.03


def plate(cells=(4, 3), triangles=False):
    """A rectangle in the plane z = 0.01, outward along +z, and the operator of its free nodes."""
    x, y = np.meshgrid(np.linspace(0, WIDE, cells[0] + 1), np.linspace(0, HIGH, cells[1] + 1), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.01)])
    number = np.arange(x.size).reshape(x.shape)
    corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    quads = np.column_stack([c.ravel() for c in corners])
    facets = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]) if triangles else quads
    dofs = np.arange(3 * len(points)).reshape(-1, 3)
    return nodal_surface(points, dofs, 3 * len(points), facets)


def points_on(n, away=0.0):
    """Points of a field, cell middles of a finer grid, and their areas."""
    x, y = ((np.arange(k) + 0.5) / k for k in (n, n))
    grid = np.stack(np.meshgrid(WIDE * x, HIGH * y, indexing="ij"), axis=-1).reshape(-1, 2)
    area = np.tile([0.0, 0.0, WIDE * HIGH / n**2], (n * n, 1))
    return np.column_stack([grid, np.full(n * n, 0.01 + away)]), area


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("known_areas", [False, True])
def test_uniform_pressure_on_a_plane_face(triangles: bool, known_areas: bool) -> None:
    points, area = points_on(7)
    area = -area if known_areas else None  # all normals may point into the body
    field = PressureField(points, np.full(len(points), 2000.0 + 500j), area)
    put = put_on(field, plate(triangles=triangles), "plate")
    assert put.inward == known_areas
    assert not put.warnings
    force = -(2000 + 500j) * WIDE * HIGH
    moment = np.cross([WIDE / 2, HIGH / 2, 0.01], [0, 0, force])
    for sums in (put.before, put.after):
        np.testing.assert_allclose(sums[0], [0, 0, force], atol=1e-12)
        np.testing.assert_allclose(sums[1], moment, atol=1e-13)
    assert put.newton == pytest.approx(abs(force))


def test_harmonic_pattern_against_its_integral() -> None:
    """p = e^{iκx}: force and moment in closed form; a mesh of other points and none of its own areas."""
    kappa = 80.0
    points, area = points_on(40)
    surface = plate((20, 6))
    pressure = np.exp(1j * kappa * points[:, 0])
    turn = np.exp(1j * kappa * WIDE)
    force = -HIGH * (turn - 1) / (1j * kappa)
    along = HIGH * (turn * (1 - 1j * kappa * WIDE) - 1) / kappa**2  # ∫ x p dA
    for known, accuracy in ((None, 1e-3), (area, 2e-4)):
        put = put_on(PressureField(points, pressure, known), surface, "plate")
        assert abs(put.after[0, 2] - force) < accuracy * WIDE * HIGH
        assert abs(put.after[1, 1] - along) < accuracy * WIDE**2 * HIGH
        # force and moment of the field are those of the nodes
        np.testing.assert_allclose(put.after, put.before, atol=1e-14)
        # the work on a bending shape, which no resultant tells
        w = surface.points[:, 0] ** 2
        work = put.force.reshape(-1, 3)[:, 2] @ w
        x = (np.arange(4000) + 0.5) / 4000 * WIDE
        exact = -HIGH * WIDE * np.mean(np.exp(1j * kappa * x) * x**2)
        assert abs(work - exact) < 3e-3 * WIDE**3 * HIGH


def test_a_field_that_stands_off_keeps_its_force_and_says_how_far_it_is() -> None:
    points, area = points_on(9, away=4e-4)
    put = put_on(PressureField(points, points[:, 0] * 1e5, area), plate(), "plate")
    assert put.offset == pytest.approx(4e-4)
    np.testing.assert_allclose(put.after[0], put.before[0], atol=1e-12)
    # normal forces: the offset along the normal moves no moment
    np.testing.assert_allclose(put.after[1], put.before[1], atol=1e-12)
    with pytest.raises(ss.InputError, match=r"away from 'plate'.*Check the unit"):
        put_on(PressureField(1e3 * points, points[:, 0]), plate(), "plate")
    # interpolated along the surface: the distance does not thin the pressure
    bare = put_on(PressureField(points, points[:, 0] * 1e5), plate(), "plate")
    np.testing.assert_allclose(bare.after[0], put.after[0], atol=1e-12)
    beam = Places({"beam": ss.model.structure_part(ss.model.chain(2, 1.0, 1.0))})
    with pytest.raises(ss.InputError, match="has no facets"):
        PressureField(points, points[:, 0]).on(beam, "beam.node0.x", "load.gas.on")


THIN = 0.002


def blade():
    """A thin plate of one element through its thickness y, clamped at z = 0: all free nodes are its skin."""
    axes = (np.linspace(0, 0.04, 5), [0.0, THIN], np.linspace(0, HIGH, 7))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    n = np.arange(len(points)).reshape(5, 2, 7)
    low, high = n[:, :, :-1], n[:, :, 1:]
    square = [(slice(0, -1), 0), (slice(1, None), 0), (slice(1, None), 1), (slice(0, -1), 1)]
    cells = np.column_stack([layer[x, y].ravel() for layer in (low, high) for x, y in square])
    root = np.flatnonzero(points[:, 2] == 0)
    sets = {"root": root, "skin": np.setdiff1d(np.arange(len(points)), root)}
    sets["upper"] = sets["skin"][points[sets["skin"], 1] > 0]
    mesh = ss.model.SolidMesh(points, cells, sets)
    part = ss.model.solid_part(mesh, Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0))
    return Places({"w": part})


def both_sides(n=9):
    """A field on both faces: points, pressures, areas outward; and its force, by its own integral."""
    x = (np.arange(n) + 0.5) / n
    x, z = (c.ravel() for c in np.meshgrid(0.04 * x, HIGH * x, indexing="ij"))
    points = np.vstack([np.column_stack([x, 0 * x + y, z]) for y in (THIN, 0.0)])
    pressure = np.concatenate([1000 + 2e4 * x + 500j, 200j - 1000 - 1e4 * z])
    area = np.tile([0.0, 0.04 * HIGH / n**2, 0.0], (2 * n * n, 1))
    area[n * n :] *= -1
    force = -(1400 + 500j + 1000 + 5e3 * HIGH - 200j) * 0.04 * HIGH
    return points, pressure, area, force


@pytest.mark.parametrize("normals", [1.0, -1.0, None])
@pytest.mark.parametrize("shift", [0.0, 0.2])
def test_both_sides_of_a_thin_blade_keep_their_own_pressure(normals: float | None, shift: float) -> None:
    """In place, and off by a fifth of the thickness: the force is that of the field, the clamped row of facets included."""
    points, pressure, area, force = both_sides()
    places, given = blade(), None if normals is None else normals * area
    moved = points + np.array([0, shift * THIN, 0])
    put = PressureField(moved, pressure, given).on(places, "w.skin", "x")
    accuracy = 2e-3 if given is None else 1e-12
    for sums in (put.before, put.after):
        assert abs(sums[0, 1] - force) < accuracy * abs(force)
    assert put.inward == (normals == -1.0)
    assert not put.warnings
    # what the linear shape functions of the first row of height h leave at z = 0; points with areas are 1.5 a row
    h = HIGH / 6
    clamped = -((1400 + 500j + 1000 - 200j) * h / 2 + 1e4 * h**2 / 6) * 0.04
    assert abs(put.clamped[1] - clamped) < (0.01 if given is None else 0.15) * abs(clamped)
    on_free = put.force.reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(on_free + put.clamped, put.after[0], atol=1e-12 * abs(force))


def test_a_field_whose_side_is_in_doubt_is_warned_of_or_refused() -> None:
    points, pressure, area, force = both_sides()
    places = blade()

    def put(points, area, name="w.skin"):
        return PressureField(points, pressure, area, "gas.csv").on(places, name, "load.gas.on")

    off = np.array([0, 0.6 * THIN, 0])
    inside = points - off * np.sign(area[:, 1:2])  # each side beyond the middle
    for moved in (points + off, inside):
        found = put(moved, area)
        np.testing.assert_allclose(found.after[0, 1], force, rtol=1e-12)
        assert "1.2 mm off w.skin (median), too far to tell" in found.warnings[0]
    (mixed,) = put(points + 0.7 * off, None).warnings
    assert "pressures of both its sides are mixed" in mixed
    with pytest.raises(ss.InputError, match=r"gas\.csv: leaves 5\d % of the area of 'w\.skin'"):
        put(points + off, None)  # all of them are nearest to one side
    few = area.copy()
    few[:9] *= -1
    with pytest.raises(ss.InputError, match=r"gas\.csv.* 9 of 162 points, 5\.56 %"):
        put(points, few)
    with pytest.raises(ss.InputError, match=r"81 of 162 points.*name a set that holds both sides"):
        put(points, area, "w.upper")
    with pytest.raises(ss.InputError, match=r"90° off in the median.*axes"):
        put(points, area[:, [1, 2, 0]])


def test_a_model_tells_of_clamped_nodes_normals_and_doubts() -> None:
    points, pressure, area, _ = both_sides()

    def model(points, area):
        gas = ss.Load(on="w.skin", newton=1.0, field=PressureField(points, pressure, area))
        return ss.Model(parts=blade().parts, loads={"gas": gas})

    (line,) = pressure_lines(model(points, -area), {"gas": 0})
    assert re.search(r"up to 0 mm off it, their normals point into the body; .* N act on clamped nodes", line)
    assert not model(points, -area).warnings
    off = np.array([0, 0.6 * THIN, 0])
    assert any(text.startswith("load.gas: the points") for text in model(points + off, area).warnings)


def flank_field(mesh):
    """A field on the flank of the blade: its nodes, the real and the imaginary part of their own pattern."""
    nodes = mesh.node_sets["flank_low"]
    points = mesh.points[nodes]
    pressure = 4e6 * (1 + 8 * (points[:, 0] - 0.15)) * np.exp(40j * points[:, 2])
    return PressureField(points, pressure)


def test_a_pressure_drives_a_wheel_as_its_nodal_forces_do() -> None:
    """Projected on waves, or its nodes kept: the same load on the coordinates, and the same answer of the whole wheel."""
    mesh = shrouded_sector()
    model = sector_model(mesh)
    gas = ss.Load(on="blade.flank_low", newton=1.0, phase=0.3, engine_order=ORDER, field=flank_field(mesh))
    more = ss.Load(on="blade.flank_low", newton=0.5, harmonic=2, engine_order=ORDER, field=flank_field(mesh))
    model = replace(model, loads={"lean": model.loads["lean"], "gas": gas, "more": more})
    assert model.spread == ("gas", "more")
    found = assemble(model, H)
    whole = assemble(replace(model, mistuning=ss.assembly.Mistuning()), H)
    put = gas.field.on(model.places, "blade.flank_low", "x")
    for h, share in ((1, np.exp(0.3j)), (2, 0.5)):
        side = found.system.structure
        k = h * ORDER % SECTORS
        # by the full wave: the work of the force on any static answer of the reduced one
        moving = model.at(model.speed, k, "open")
        full = moving.project(share * put.force)
        reduced = found.load.harmonics[h]
        own = side.of_harmonic(h)
        stiff = moving.stiffness.toarray()
        exact = full.conj() @ np.linalg.solve(stiff, full)
        here = reduced.conj() @ np.linalg.solve(own.stiffness.toarray(), reduced)
        assert abs(here - exact) < 1e-8 * abs(exact)
    n = whole.load.static.size // SECTORS
    angle = wave(ORDER, SECTORS).phase_angle
    for s in range(SECTORS):
        mine = whole.load.harmonics[1][s * n : (s + 1) * n]
        np.testing.assert_allclose(mine, np.exp(1j * s * angle) * whole.load.harmonics[1][:n], rtol=1e-9)


def write_fields(folder: Path, mesh_points, quads, pressure):
    """The same field as VTK surface and as CSV of its nodes, in mm."""
    data = {"real_pa": pressure.real, "imag_pa": pressure.imag}
    meshio.write(folder / "field.vtu", meshio.Mesh(1e3 * mesh_points, [("quad", quads)], point_data=data))
    rows = ["x_mm,y_mm,z_mm,amplitude_kpa,phase_deg"]
    for (x, y, z), p in zip(1e3 * mesh_points, pressure, strict=True):
        rows.append(f"{x:.15g},{y:.15g},{z:.15g},{abs(p) / 1e3:.15g},{math.degrees(np.angle(p)):.15g}")
    (folder / "field.csv").write_text("\n".join(rows))


def test_csv_and_vtk_hold_the_same_field(tmp_path: Path) -> None:
    surface = plate((20, 8))
    pressure = 1e3 * np.exp(60j * surface.points[:, 0])
    write_fields(tmp_path, surface.points, surface.facets, pressure)
    of_vtk = read_pressure(tmp_path / "field.vtu", "mm", static=False)
    of_csv = read_pressure(tmp_path / "field.csv", "m", static=False)
    one, other = (put_on(f, surface, "x") for f in (of_vtk, of_csv))
    np.testing.assert_allclose(of_vtk.area.sum(axis=0), [0, 0, WIDE * HIGH], atol=1e-15)
    # planes through eight points smooth a wave of 42 points a period by 1.6e-3
    np.testing.assert_allclose(one.after, other.after, atol=2e-3 * np.abs(one.after).max())
    np.testing.assert_allclose(one.force, other.force, atol=5e-3 * np.abs(one.force).max())


WHOLE = [("real_pa", "imag_pa"), ("amplitude_pa", "phase_deg")]


@pytest.mark.parametrize("on", ["points", "cells"])
@pytest.mark.parametrize("static", [False, True])
@pytest.mark.parametrize(
    "names",
    [
        ("real_pa", "imag_pa"),
        ("amplitude_pa", "phase_deg"),
        ("pressure_pa",),
        ("real_pa", "phase_deg"),
        ("REAL_PA", "Imag_Pa"),
    ],
)
def test_vtk_holds_a_field_in_each_way(names: tuple[str, ...], static: bool, on: str, tmp_path: Path) -> None:
    """A constant pressure is the same at points and cells, as parts and as amplitude and phase; what is not whole is refused."""
    surface = plate((3, 2))
    value = {
        "real_pa": 300.0,
        "imag_pa": -400.0,
        "amplitude_pa": 500.0,
        "phase_deg": np.degrees(np.arctan2(-4, 3)),
        "pressure_pa": 250.0,
    }
    count = len(surface.points) if on == "points" else len(surface.facets)
    data = {name: np.full(count, value[name.lower()]) for name in names}
    own = {"point_data": data} if on == "points" else {"cell_data": {k: [v] for k, v in data.items()}}
    meshio.write(tmp_path / "field.vtu", meshio.Mesh(surface.points, [("quad", surface.facets)], **own))
    known = tuple(name.lower() for name in names)
    if known not in ([("pressure_pa",)] if static else WHOLE):
        needed = "pressure_pa" if static else "real_pa and imag_pa, or amplitude_pa and phase_deg"
        with pytest.raises(ss.InputError, match=f"has the data {', '.join(known)}.*{needed}"):
            read_pressure(tmp_path / "field.vtu", "m", static=static)
        return
    found = read_pressure(tmp_path / "field.vtu", "m", static=static)
    np.testing.assert_allclose(found.pressure, 250.0 if static else 300.0 - 400.0j, rtol=1e-12)
    np.testing.assert_allclose(found.area.sum(axis=0), [0, 0, WIDE * HIGH], atol=1e-15)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("x_m,y_m,z_m,pressure_pa\n0,0,0,1", "A harmonic load has real_pa and imag_pa"),
        ("x_m,y_m,real_pa,imag_pa\n0,0,0,1", "no column z_m or z_mm"),
        ("x_m,y_m,z_m,real_pa,imag_pa,area_m2\n0,0,0,1,1,1", "area_m2 alone"),
        ("x_m,y_m,z_m,real_pa,imag_pa\n0,0,zero,1,1", "line 2: z_m: is no finite number"),
        ("x_m,y_m,z_m,real_pa,imag_pas\n0,0,0,1,1", "imag_pas.*imag_pa"),
        ("n,x_m,y_m,z_m,real_pa,imag_pa\n1,0,0,0,1,1", "'n', which is not known. The columns are x_m, y_m, z_m, then"),
        ("x_m,y_m,z_m,real_pa,imag_pa,area_m2,normal_x,normal_y,normal_z\n0,0,0,1,1,1,1,1,0", "length 1"),
    ],
)
def test_what_is_wrong_in_a_field_is_told(rows: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "field.csv").write_text(rows)
    with pytest.raises(ss.InputError, match=words):
        read_pressure(tmp_path / "field.csv", "m", static=False)
    (tmp_path / "field.vtu").write_text("no vtk")
    with pytest.raises(ss.InputError, match="cannot be read as VTK"):
        read_pressure(tmp_path / "field.vtu", "m", static=False)


STUDY = (
    "schema_version = 2\n[material]\nyoung_modulus_pa = 2.1e11\npoisson_ratio = 0.3\ndensity_kg_per_m3 = 7850.0\n"
    + SECTOR
    + """
[reduction]
fixed_interface_modes = 6
[contact.shroud]
between = ["blade.shroud_high", "next.blade.shroud_low"]
law = "elastic_coulomb"
normal_stiffness_n_per_m = 6e5
tangential_stiffness_n_per_m = 3e5
axial_stiffness_n_per_m = 3e5
friction_coefficient = 0.3
[load.gas]
on = "blade.tip"
pressure = "gas.csv"
engine_order = 3
modal_forces = 2
[output]
points = { tip = "blade.tip" }
[forced_response]
frequency_hz = [300.0, 310.0]
"""
)


def test_a_study_tells_force_and_modal_forces_of_its_pressure(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    from stickslip.study.check import check_study
    from stickslip.study.models.study import read_study

    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "gas.csv").write_text("x_m,y_m,z_m,real_pa,imag_pa\n0,0,0,1,1\n0,1,0,1,1\n1,0,0,1,1")
    study = read_study(tmp_path / "study.toml")
    places = study.model().places.spot("blade.tip", "x").surface.points
    rows = "\n".join(f"{x},{y},{z},0,1000" for x, y, z in places)
    (tmp_path / "gas.csv").write_text(f"x_m,y_m,z_m,real_pa,imag_pa\n{rows}")
    study = read_study(tmp_path / "study.toml")
    with caplog.at_level("INFO"):
        check_study(study)
    told = re.search(
        r"load\.gas: modal forces .* on (ND \d \w+), .*: ([\d.]+) Hz: ([\d.e-]+) at (-?[\d.]+) deg", caplog.text
    )
    assert told is not None, caplog.text
    assert told[1] == "ND 3 backward"
    assert "pressure on blade.tip: force (" in caplog.text
    model = study.model()
    moving = model.at(model.speed, 3)
    modes = ss.model.normal_modes(moving, 1)
    shape = np.asarray(moving.expand(modes.shapes))[:, 0]
    assert float(told[2]) == pytest.approx(modes.frequencies_hz[0], rel=1e-5)
    force = model.loads["gas"].field.on(model.places, "blade.tip", "x").force
    assert float(told[3]) == pytest.approx(abs(shape.conj() @ force), rel=1e-3)
