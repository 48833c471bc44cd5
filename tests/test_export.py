"""Results for other programs: fields against the unreduced model, files read back by meshio, pyuff and our reader of ``.frd``."""

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
import pyuff
import xarray as xr
from scipy.spatial import KDTree
from solid_models import box
from test_assembly_wheel import ORDER, SECTORS, sector_model, shrouded_sector
from typer.testing import CliRunner

import stickslip as ss
from stickslip.api.model import Model
from stickslip.arrays import ComplexArray
from stickslip.assembly import part_reduction
from stickslip.assembly.assembling import assemble
from stickslip.assembly.forces import force_of
from stickslip.assembly.full_field import nodes_of
from stickslip.assembly.scene import scene_of
from stickslip.assembly.sides.mistuning import BladeMistuning, Mistuning
from stickslip.cli import app
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.model.deck import write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import solid_part
from stickslip.model.readers.frd import read_frd
from stickslip.model.readers.units import Units
from stickslip.reduction.choice import Reduction
from stickslip.study.exchange.chosen import chosen, point_of
from stickslip.study.exchange.motion import expanded, motion_of
from stickslip.study.exchange.vtu import contacts_of

pytestmark = pytest.mark.usefixtures("peak_alone")

CCX = Path(__file__).parent / "data" / "calculix" / "brick_static.frd"  # written by ccx 2.20
BEAMS = """
schema_version = 2
[part.one]
file = "beam.inp"
units = "SI"
[part.two]
of = "one"
placed = [{ mirror = "x" }, { move_m = [0.2, 0, 0] }]
[reduction]
fixed_interface_modes = 400
[damping]
ratio = 0.01
between_hz = [500, 3000]
[contact.tips]
between = ["one.tip", "two.tip"]
law = "elastic_coulomb"
normal_stiffness_n_per_m = 2e7
tangential_stiffness_n_per_m = 1e7
axial_stiffness_n_per_m = 1e7
friction_coefficient = 0.5
preload_n = 1e6
[load.weight]
on = "one.middle"
force_n = 20.0
direction = "y"
harmonic = 0
[load.shaker]
on = "one.middle"
force_n = 3.0
direction = "z"
[forced_response]
frequency_hz = [800, 1200]
points = 6
peak_points = 0
stability = "off"
[harmonics]
high = 1
selection = "always_low"
[output]
points = { middle = "two.middle" }
peak = "middle.z"
"""


@pytest.fixture(scope="module")
def beams(tmp_path_factory):
    """Two cantilevers whose tips stick to each other, from a deck, one the mirror image of the other."""
    folder = tmp_path_factory.mktemp("beams")
    mesh = box(8, (0.1, 0.02, 0.02), (5, 1, 1))
    sets = {**mesh.node_sets, "middle": np.flatnonzero(np.isclose(mesh.points[:, 0], 0.06))}
    write_deck(SolidMesh(mesh.points, mesh.cells, sets), Material(), folder / "beam.inp")
    (folder / "study.toml").write_text(BEAMS)
    study = ss.Study.from_file(folder / "study.toml")
    return folder, study.run(), study.model()


@pytest.fixture(scope="module")
def wheel():
    """One of five sectors with shrouds that stick."""
    law = ElasticCoulomb(k_t=6e6, k_w=6e6, k_n=8e6, mu=0.5, preload=1e6)
    own = sector_model(shrouded_sector())
    model = Model(
        parts={
            "blade": solid_part(
                own.parts["blade"].mesh,
                Material(),
                sectors=SECTORS,
                reduction=Reduction(200),
                damping=own.parts["blade"].damping,
            )
        },
        contacts={name: replace(c, law=law) for name, c in own.contacts.items()},
        loads={name: own.loads[name] for name in ("gas", "lean")},
        outputs=own.outputs,
        speed=own.speed,
    )
    hertz = (400.0, 500.0, 600.0)
    found = model.forced_response(hertz, low=1, high=1, selection="always_low", stability="off", peak_points=0)
    return found, model


def solved(model, hz, wave=0):
    """The motion of all dofs by a direct solution of the unreduced model with its contacts stuck."""
    full = model.at(model.speed, wave, "stuck", with_damping=True)
    omega = 2 * math.pi * hz
    forces = [force_of(model.places, n, load) for n, load in model.loads.items() if load.harmonic]
    own = full.stiffness + 1j * omega * full.damping - omega**2 * full.mass
    dense = own.toarray() if hasattr(own, "toarray") else own
    return full.expand(np.linalg.solve(dense, full.project(sum(forces))))


def test_every_node_of_copies_moves_as_the_unreduced_model_says(beams):
    _, result, model = beams
    data = result["forced_response"]
    motion = motion_of(chosen(result.data), model, wheel=False)
    wanted = solved(model, motion.hz)
    full = model.at(model.speed, 0, "stuck")
    # the mean: contacts open, under the weight and the mean forces of the contacts
    full = model.at(model.speed, 0, "open")
    force = data["contact_force"].values[point_of(data, 0, None), 0, :, :, 0].ravel()
    static = force_of(model.places, "weight", model.loads["weight"]) - model.pairs.own.T @ force
    dense = full.stiffness.toarray() if hasattr(full.stiffness, "toarray") else full.stiffness
    still = full.expand(np.linalg.solve(dense, full.project(static)))
    assert [body.nodes.part for body in motion.bodies] == ["one", "two"]
    for body in motion.bodies:
        assert np.abs(body.amplitudes[1] - body.nodes.of(wanted)).max() < 1e-8 * np.abs(wanted).max()
        assert np.abs(body.mean - body.nodes.of(still)).max() < 1e-8 * np.abs(still).max()
    z = data["output"].values.tolist().index("middle.z")
    reported = data["output_displacement"].values[point_of(data, 0, None), 1, z]
    place = nodes_of(model)[1].numbers.tolist().index(motion.outputs["middle.z"][2])
    own = motion.bodies[1].amplitudes[1, place, 2]
    assert abs(own - complex(*reported)) < 1e-10 * abs(own)


def test_every_sector_moves_as_the_wave_of_the_unreduced_wheel_and_faces_stay_together(wheel):
    result, model = wheel
    data = result["forced_response"]
    motion = motion_of(chosen(result.data, hz=500.0), model, wheel=True)
    wanted = solved(model, 500.0, ORDER)
    first = motion.bodies[0]
    assert np.abs(first.amplitudes[1] - first.nodes.of(wanted)).max() < 1e-8 * np.abs(wanted).max()
    assert len(motion.bodies) == SECTORS
    sets = model.parts["blade"].mesh.node_sets
    for ahead, body in zip(motion.bodies[1:] + motion.bodies[:1], motion.bodies, strict=True):
        low, high = sets["cyclic_low"], sets["cyclic_high"]
        assert np.allclose(ahead.nodes.points[low], body.nodes.points[high], atol=1e-12)
        for angle in (0.3, 2.0):
            own = body.at(angle)[high]
            assert np.abs(ahead.at(angle)[low] - own).max() < 1e-9 * np.abs(own).max()
    # the contact points of a sector do what those of sector 0 did, turned by a pitch, a share of the period before
    zero, one = contacts_of(data, motion, 0, point_of(data, 0, None))[:2]
    turn = model.axis.rotation(2 * math.pi / SECTORS)
    before = zero.at(0.25 + ORDER / SECTORS)["force_n"] @ turn.T
    assert np.abs(one.at(0.25)["force_n"] - before).max() < 1e-9 * np.abs(before).max()


def test_paraview_files_hold_one_period_read_by_meshio(beams):
    folder, result, model = beams
    told = CliRunner().invoke(app, ["export", str(folder / "results"), "--steps", "5"])
    assert told.exit_code == 0, told.output
    words = " ".join(told.output.split())
    assert words.startswith("[forced_response] its peak at ")
    assert " of middle.z reading beam.inp reducing the model again" in words
    place = folder / "results" / "vtu_0"
    motion = motion_of(chosen(result.data), model, wheel=False)
    count = 2 * len(model.parts["one"].mesh.points)
    assert f"writing {count} nodes to " in words
    series = ET.parse(place / "motion.pvd").getroot().findall(".//DataSet")
    assert [one.get("file") for one in series] == [f"motion_{k:03d}.vtu" for k in range(5)]
    assert float(series[1].get("timestep")) == pytest.approx(0.2 / motion.hz)
    mesh = meshio.read(place / "motion_002.vtu")
    angle = 0.8 * math.pi
    vibration = np.vstack([body.at(angle) for body in motion.bodies])
    assert np.abs(mesh.point_data["vibration_m"] - vibration).max() < 1e-12 * np.abs(vibration).max()
    mean = np.vstack([body.mean for body in motion.bodies])
    assert np.allclose(mesh.point_data["displacement_m"], mean + vibration, rtol=1e-12, atol=0)
    count = len(model.parts["one"].mesh.points)
    cells = [part.mesh.cells + k * count for k, part in enumerate(model.parts.values())]
    assert np.array_equal(mesh.cells[0].data, np.vstack(cells))
    harmonics = meshio.read(place / "harmonics.vtu").point_data
    own = harmonics["harmonic_1_real_m"] + 1j * harmonics["harmonic_1_imag_m"]
    assert np.allclose((own * np.exp(1j * angle)).real, vibration, rtol=1e-9, atol=1e-18)
    contact = meshio.read(place / "contacts_000.vtu")
    assert set(contact.point_data) >= {"gap_m", "force_n", "pressure_pa", "state", "slip_distance_m", "energy_j"}
    assert np.all(contact.point_data["state"] == 0)  # they stick
    assert np.all(contact.point_data["slip_distance_m"] == 0)
    assert np.allclose(contact.points[:, 0], 0.1)


VALUES = r"([ -]\d\.\d{5}E[+-]\d\d){3}"
COLUMNS = {  # of lines as ccx 2.20 writes them, by their beginning
    "    2C": r".{6} {18}[ \d]{11}\d {37}1",
    "    3C": r".{6} {18}[ \d]{11}\d {37}1",
    "    1PSTEP": r".{10}[ \d]{25}\d[ \d]{11}\d[ \d]{11}\d",
    "  100C": r".{6}L[ \d]{5} (?=[\d.]{11})\d+\.\d+[ \d]{11}\d.{20} \d[ \d]{4}\d.{10} 1",
    " -1": rf" -1[ \d]{{9}}\d{VALUES}",
    " -2": r" -2([ \d]{9}\d){8,10}",
    " -3": r" -3",
    " -4": r" -4  DISP        4    1",
    " -5": r" -5  D1          1    2    1    0",
    " 9999": r" 9999",
}


def test_frd_files_have_the_columns_of_ccx_and_are_read_back(beams, tmp_path):
    _, result, model = beams
    (file,) = result.export("frd", tmp_path, units="mm-t-s")
    found = read_frd(file, units=Units.mm_t_s())
    motion = motion_of(chosen(result.data), model, wheel=False)
    own = np.vstack([body.amplitudes[1] for body in motion.bodies])
    read = found.field("DISP", 2).values + 1j * found.field("DISPI", 2).values
    assert np.abs(read - own).max() < 1e-5 * np.abs(own).max()  # six digits
    assert found.field("DISP", 2).frequency_hz == pytest.approx(motion.hz, rel=1e-6)
    mean = np.vstack([body.mean for body in motion.bodies])
    assert np.abs(found.field("DISP", 1).values - mean).max() < 1e-5 * np.abs(mean).max()
    points = np.vstack([body.nodes.points for body in motion.bodies])
    assert np.abs(found.mesh.points - points).max() < 1e-6
    count = len(model.parts["one"].mesh.points)
    cells = [p.mesh.cells + k * count for k, p in enumerate(model.parts.values())]
    assert np.array_equal(found.mesh.cells, np.vstack(cells))
    for start, columns in COLUMNS.items():
        for text in (file.read_text(), CCX.read_text()):
            line = next(line for line in text.splitlines() if line.startswith(start)).rstrip()
            assert re.fullmatch(columns, line), line


def test_universal_files_are_read_back_by_pyuff(beams, tmp_path):
    _, result, model = beams
    (file,) = result.export("uff", tmp_path)
    uff = pyuff.UFF(str(file))
    sets = {kind: [s for s in uff.read_sets() if s["type"] == kind] for kind in (164, 2411, 55, 58)}
    data = result["forced_response"]
    motion = motion_of(chosen(result.data), model, wheel=False)
    (nodes,), (shape,) = sets[2411], sets[55]
    points = np.vstack([body.nodes.points for body in motion.bodies])
    assert np.allclose(np.column_stack([nodes[c] for c in "xyz"]), points, rtol=1e-14)
    own = np.vstack([body.amplitudes[1] for body in motion.bodies])
    read = np.column_stack([shape[f"r{k}"] for k in (1, 2, 3)])
    assert np.abs(read - own).max() < 1e-5 * np.abs(own).max()
    assert np.array_equal(shape["node_nums"], nodes["node_nums"])
    assert shape["freq"] == pytest.approx(motion.hz, rel=1e-5)
    function = next(s for s in sets[58] if s["id1"].startswith("middle.z, harmonic 1"))
    order = np.argsort(data["frequency_hz"].values)
    place = data["output"].values.tolist().index("middle.z")
    z = data["output_displacement"].values[order, 1, place]
    assert function["rsp_dir"] == 3
    assert np.allclose(function["x"], data["frequency_hz"].values[order], rtol=5e-6)  # six digits
    assert np.allclose(function["data"], (z[:, 0] + 1j * z[:, 1]) / 3.0, rtol=1e-10, atol=0)
    where = np.flatnonzero(nodes["node_nums"] == function["rsp_node"])[0]
    assert points[where, 0] == pytest.approx(0.14)  # the middle of the mirrored beam
    peak = np.argmin(np.abs(function["x"] - motion.hz))
    assert function["data"][peak] * 3.0 == pytest.approx(read[where, 2], rel=1e-4)


def test_what_cannot_be_written_is_said(beams, wheel, tmp_path):
    folder, result, _model = beams
    with pytest.raises(InputError, match=r"goes from .* to .* Hz"):
        result.export(hz=5.0)
    with pytest.raises(
        InputError, match=r"export: 'modes' cannot be written: .*\[limit_cycle\]; this result has \[forced_response\]"
    ):
        result.export(analysis="modes")
    with pytest.raises(InputError, match="points of a forced response are picked by"):
        result.export(amplitude_mm=1.0)
    with pytest.raises(InputError, match="the result has 1"):
        result.export(case=3)
    with pytest.raises(InputError, match="single structure"):
        result.export(wheel=True, folder=tmp_path)
    with pytest.raises(InputError, match="made in Python"):
        wheel[0].export(folder=tmp_path)
    other = ss.Study.from_file(folder / "study.toml").replace({"material.young_modulus_pa": 1.9e11})
    with pytest.raises(InputError, match="the outputs of the model differ from the outputs of the result"):
        result.export(of=other.model(), folder=tmp_path)
    moved = ss.Result(result.data, tmp_path / "result.nc")
    with pytest.raises(InputError, match="--of FOLDER"):
        moved.export("frd")
    assert moved.export("frd", of=folder)[0].is_file()


def test_all_sectors_go_to_a_folder_beside_that_of_one(wheel, tmp_path):
    result = ss.Result(wheel[0].data, tmp_path / "result.nc")
    one, whole = (result.export("frd", of=wheel[1], wheel=all_of_it)[0] for all_of_it in (False, True))
    assert one == tmp_path / "frd_0" / "motion.frd"
    assert whole == tmp_path / "frd_0_wheel" / "motion.frd"
    assert one.stat().st_size < whole.stat().st_size


@pytest.mark.validation
def test_every_sector_of_a_mistuned_wheel_moves_as_the_unreduced_wheel_says(wheel):
    model = replace(wheel[1], speed=0.0)
    more = np.array([0.04, -0.03, 0.0, 0.02, -0.05])
    blades = BladeMistuning(of="blade", deviations=more, quantity="stiffness")
    mistuned = replace(model, mistuning=Mistuning(blades={"more": blades}))
    result = mistuned.forced_response((500.0,), low=1, high=1, selection="always_low", stability="off", peak_points=0)
    motion = motion_of(chosen(result.data, hz=500.0), mistuned, wheel=False)
    assert [body.sector for body in motion.bodies] == list(range(SECTORS))
    waves = [model.at(0.0, k, "stuck", with_damping=True) for k in range(SECTORS)]
    ways = [full.expand(np.eye(full.n)) for full in waves]
    stiffness = model.parts["blade"].structure.stiffness
    omega, first = 2 * math.pi * 500.0, np.cumsum([0, *(full.n for full in waves)])
    whole = np.zeros((first[-1], first[-1]), dtype=complex)
    share = np.fft.fft(more) / SECTORS  # of the deviations, by the difference of two waves
    for j, k in np.ndindex(SECTORS, SECTORS):
        own = share[(j - k) % SECTORS] * (ways[j].conj().T @ (stiffness @ ways[k]))
        if j == k:
            full = waves[k]
            own += full.stiffness + 1j * omega * full.damping - omega**2 * full.mass
        whole[first[j] : first[j + 1], first[k] : first[k + 1]] = own
    force = np.zeros(first[-1], dtype=complex)
    gas = force_of(model.places, "gas", model.loads["gas"])
    force[first[ORDER] : first[ORDER + 1]] = waves[ORDER].project(gas)
    q = np.split(np.linalg.solve(whole, force), first[1:-1])
    fields = SECTORS * np.fft.ifft([way @ own for way, own in zip(ways, q, strict=True)], axis=0)
    for n, body in enumerate(motion.bodies):
        wanted = body.nodes.of(fields[n]) @ model.axis.rotation(n * 2 * math.pi / SECTORS).T
        assert np.abs(body.amplitudes[1] - wanted).max() < 1e-8 * np.abs(fields).max()
    data = result["forced_response"]
    assert len(contacts_of(data, motion, 0, point_of(data, 0, 500.0))) == 1  # those of all sectors


CHAIN = """
schema_version = 2
[part.chain]
shape = "lumped"
masses_kg = [1.0, 0.4, 0.3]
springs_n_per_m = [["ground", 1, 1.0], [1, 2, 2.0], [2, 3, 3.0]]
dashpots_n_s_per_m = [["ground", 1, -0.1]]
[contact.damper]
between = ["chain.m1", "ground"]
law = "jenkins"
tangential_stiffness_n_per_m = 0.5
slip_limit_n = 0.1
[output]
points = { root = "chain.m1" }
[limit_cycle]
harmonics = 3
most_harmonics = 3
points = 8
amplitude_mm = [150.0, 3000.0]
"""


@pytest.mark.parametrize("asked", ["limit_cycle", "periodic", "decaying"])
def test_free_motions_hold_the_balance_of_a_mass_that_is_not_solved_for(asked, tmp_path):
    (tmp_path / "study.toml").write_text(CHAIN)
    study = ss.Study.from_file(tmp_path / "study.toml")
    model = study.model()
    if asked == "limit_cycle":
        picked = chosen(study.run().data)
        s = 1j * picked.omega
        own = s**2
    else:
        keys = {"modes": [1], "amplitude_mm": (150.0, 900.0), "points": 5, "harmonics": 3}
        result = model.nonlinear_mode(concept=asked, most_harmonics=3, **keys)
        picked = chosen(result.data, amplitude_mm=600.0)
        told = result["nonlinear_mode"].isel(case=0, branch=0)
        near = int(np.nanargmin(np.abs(told["amplitude"].values - 0.6)))
        ratio, omega = float(told["damping_ratio"][near]), 2 * math.pi * float(told["frequency_hz"][near])
        assert abs(ratio) > 1e-3
        s = 1j * omega if asked == "periodic" else omega * (1j * math.sqrt(1 - ratio**2) - ratio)
        own = s**2 - 2 * ratio * omega * s if asked == "periodic" else s**2
    _, fields = expanded(picked, model.undriven)
    assert "chain.m3" not in " ".join(picked.labels)
    x = fields[0, 1]
    assert abs((3.0 + 0.3 * own) * x[2] - 3.0 * x[1]) < 1e-9 * abs(x[1])
    assert abs(x[0]) == pytest.approx(abs(picked.reported[1, 0]), rel=1e-12)
    (body,) = motion_of(picked, model, wheel=False).bodies
    assert np.array_equal(body.amplitudes[1, :, 0], x)


def test_a_page_is_no_result_and_the_refusal_names_what_can_be_written(tmp_path):
    page = tmp_path / "both.html"
    page.write_text("<!doctype html>")
    told = CliRunner().invoke(app, ["export", str(page)])
    assert told.exit_code == 2
    assert told.output.strip().endswith(
        "both.html: is a page, and no result. Give the folder of a run, or the result.nc in it."
    )
    assert told.output.count("\n") == 1


def drawn(data: xr.Dataset, of: str) -> ComplexArray:
    """Return the motion of drawn points or contact points at the peak in the first harmonic."""
    parts = data[of].values[0, 0]
    return np.asarray(parts[..., 0] + 1j * parts[..., 1])


def test_what_pages_draw_of_copies_moves_as_the_unreduced_model_says(beams):
    _, result, model = beams
    data = result["forced_response"]
    wanted = solved(model, float(data["frequency_hz"].values[int(data["peak_point"].values[0])]))
    found, kinds = drawn(data, "peak_drawn_motion"), set(data["drawn_kind"].values[0].tolist())
    assert kinds == {"mesh"}
    for nodes in nodes_of(model):
        mine = data["drawn_part"].values[0] == nodes.part
        off, at = KDTree(nodes.points).query(data["drawn_point"].values[0, mine])
        assert off.max() < 1e-12
        assert np.abs(found[mine] - nodes.of(wanted)[at]).max() < 1e-5 * np.abs(wanted).max()  # single precision
    (one, _) = nodes_of(model)
    at = KDTree(one.points).query(data["contact_position"].values)[1]
    assert np.abs(drawn(data, "peak_contact_motion") - one.of(wanted)[at]).max() < 1e-5 * np.abs(wanted).max()
    # both loads act on the node set in the middle: one is static
    assert data["drawn_load"].values.tolist() == ["weight", "shaker"]
    assert data["drawn_load_harmonic"].values.tolist() == [0, 1]
    assert np.allclose(data["drawn_load_direction"].values, [[0, 1, 0], [0, 0, 1]])
    assert np.allclose(data["drawn_load_point"].values[:, 0], 0.06)
    held = data["drawn_support"].values
    assert len(held)
    assert set(np.round(held[:, 0], 9)) == {0.0, 0.2}


def test_what_pages_draw_of_a_sector_moves_as_the_wave_of_the_unreduced_wheel(wheel):
    result, model = wheel
    data = result["forced_response"]
    peak = float(data["frequency_hz"].values[int(data["peak_point"].values[0])])
    wanted = solved(model, peak, ORDER)
    (nodes,) = nodes_of(model)
    at = KDTree(nodes.points).query(data["drawn_point"].values[0])[1]
    found = drawn(data, "peak_drawn_motion")
    assert np.abs(found - nodes.of(wanted)[at]).max() < 1e-5 * np.abs(wanted).max()


def test_pictures_of_a_model_use_its_reduction_again(beams, monkeypatch):
    folder, _, _ = beams
    model, counted = ss.Study.from_file(folder / "study.toml").model(), []
    reduce = part_reduction._reduce

    def counting(name, *others):
        counted.append(name)
        return reduce(name, *others)

    monkeypatch.setattr(part_reduction, "_reduce", counting)
    assemble(model, 1)
    assert counted == ["one"]  # its copy shares it
    scene = scene_of(model, 1)
    assert scene.moving is not None
    assert counted == ["one"]
