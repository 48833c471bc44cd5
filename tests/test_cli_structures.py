"""Bladed disks through the command line: from a study to tables, results and a page, and what bad input is told."""

import json
from dataclasses import fields, make_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_wheel import wheel_text, write_small_wheel
from typer.testing import CliRunner, Result

from evidence.validation.case_calculix_materials import our_solid, write_decks
from stickslip.cli import app
from stickslip.model.mesh.sector_mesh import mesh_sector
from stickslip.model.modes import normal_modes
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.readers.units import Units
from stickslip.model.structure_file import save_structure
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.full_wheel import wheel
from stickslip.study.example import example_text
from stickslip.study.static_state import strain_and_rotation
from stickslip.study.structure_model import disk_model
from stickslip.study.structure_results import WaveModes
from stickslip.study.structure_study import read_structure_study
from stickslip.study.waves import solve_wave

ROOT = Path(__file__).parents[1]


def invoke(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


def done(*words: str) -> str:
    """Return what a command prints that must end well."""
    result = invoke(*words)
    assert result.exit_code == 0, result.output
    return result.output


def refused(*words: str) -> str:
    """Return what a command says that must end with exit code 2 and without a traceback."""
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    return result.stderr.strip()


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study whose three commands have been run."""
    path = write_small_wheel(tmp_path_factory.mktemp("wheel"))
    for command in ("modes", "campbell", "safe"):
        done(command, str(path))
    return path


def result(study: Path, command: str) -> xr.Dataset:
    return xr.load_dataset(study.parent / "results" / f"{command}.nc", engine="h5netcdf")


def test_example_in_the_repository_is_the_one_that_new_writes(tmp_path: Path) -> None:
    said = done("new", str(tmp_path / "made"), "--kind", "sector")
    assert f"stickslip modes {tmp_path / 'made' / 'study.toml'}" in said
    written = (tmp_path / "made" / "study.toml").read_text(encoding="utf-8")
    shipped = (ROOT / "examples/shrouded_sector/study.toml").read_text(encoding="utf-8")
    assert written == shipped == example_text("sector")
    read_structure_study(tmp_path / "made" / "study.toml")


def test_frequencies_are_those_of_the_assembled_wheel(study: Path) -> None:
    # the wheel of all sectors at speed shares the sector's matrices, but neither waves nor phases
    model = disk_model(read_structure_study(study), lambda _: None)
    speed = 6000 * 2 * np.pi / 60
    sector = model.sector
    assert sector is not None
    assert model.rotating is not None
    turning = model.rotating.at_speed(speed, tie=sector.tie)
    whole = wheel(type(sector)(turning, sector.sectors, sector.low, sector.high, sector.axis))
    hertz = normal_modes(whole, 8).frequencies_hz
    data = result(study, "safe")  # all nodal diameters, two modes of each
    both = np.where(data.wave_kind == "standing", 1, 2)
    union = np.sort(np.repeat(data.frequency_hz.values, both, axis=0).ravel())
    # the third modes of the diameters lie above the first eight of the wheel
    np.testing.assert_allclose(union[:8], hertz, rtol=1e-8)
    modes = result(study, "modes")
    np.testing.assert_allclose(
        modes.frequency_hz, data.frequency_hz.sel(wave=modes.wave_number.values), rtol=1e-9
    )


def test_crossings_lie_on_engine_order_and_mode(study: Path) -> None:
    data = result(study, "campbell")
    assert data.sizes["crossing"] > 0
    assert float(data.basis_error.max()) < 1e-5
    np.testing.assert_allclose(
        data.crossing_frequency_hz, data.crossing_engine_order * data.crossing_speed_rpm / 60
    )
    # full modes at the speed of a crossing: no basis, no following
    model = disk_model(read_structure_study(study), lambda _: None)
    first = data.isel(crossing=0)
    wave = int(data.wave_number[int(first.crossing_wave)])
    at = model.at(float(first.crossing_speed_rpm) * 2 * np.pi / 60, wave)
    nearest = np.abs(normal_modes(at, 3).frequencies_hz / float(first.crossing_frequency_hz) - 1)
    assert nearest.min() < 1e-5
    # on 8 sectors engine orders 2 and 6 both excite two nodal diameters
    assert set(data.nodal_diameter.values) == {2}


def test_basis_that_is_too_small_is_told(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # two modes and none to spare, over a range in which the shapes change
    monkeypatch.setattr("stickslip.reduction.speed_basis.SPARE", 0)
    monkeypatch.setattr("stickslip.study.structure_doubts.BASIS_ERROR", 1e-9)
    path = write_small_wheel(tmp_path, engine_orders="[2]")
    assert "wave number 2: frequencies between the speeds of the basis are off" in done(
        "campbell", str(path), "--no-report"
    )
    rough, fine = (float(result(p, "campbell").basis_error.max()) for p in (path, study))
    assert rough > 10 * fine


def test_coriolis_forces_part_the_directions(tmp_path: Path) -> None:
    changes = {"coriolis": "true", "speed_rpm": "16000.0", "# nodal_diameters": "[2]"}
    path = write_small_wheel(tmp_path, **changes, engine_orders="[6]")
    assert "ND 2 forward" in done("campbell", str(path), "--no-report")
    assert "backward" in done("modes", str(path), "--no-report")
    modes, branches = result(path, "modes"), result(path, "campbell")
    assert list(modes.wave_number.values) == [2, 6]
    assert list(branches.wave_number.values) == [6]
    backward, forward = modes.frequency_hz.values
    assert np.all(backward > 1.005 * forward)
    # the basis of the branches holds the modes of the last speed, which modes finds without it
    np.testing.assert_allclose(np.sort(branches.frequency_hz.values[0, -1]), forward, rtol=1e-7)


def test_engine_orders_above_the_computed_modes_are_not_called_clear(tmp_path: Path) -> None:
    # on 8 sectors engine order 14 excites two nodal diameters, at 1400 Hz: far above two modes
    path = write_small_wheel(tmp_path, engine_orders="[2, 14]")
    said = done("safe", str(path))
    assert "engine orders 14 are not judged: they excite nodal diameters 2 at 1400 Hz" in said
    assert "raise safe.modes, now 2, to" in said
    data = result(path, "safe")
    order = data.pair_engine_order.values
    np.testing.assert_array_equal(data.pair_judged.values, order != 14)
    assert "not judged" in json.loads(data.attrs["warnings"])[0]
    rows = [line for line in said.splitlines() if line.startswith("│") and " 14 │" in line]
    assert len(rows) == 2
    assert all("not judged" in row or "NEAR" in row for row in rows)
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    assert page.count("<td>order not judged</td>") == 2
    # what the remedy asks for is enough
    enough = int(said.split("now 2, to ")[1].split()[0])
    model = disk_model(read_structure_study(path), lambda _: None)
    more = normal_modes(model.at(6000 * 2 * np.pi / 60, 2), enough).frequencies_hz
    assert more[1] < 1400 < 1400 * 1.05 < more[-1]


def test_resonances_are_the_crossings_of_the_campbell_diagram(study: Path, tmp_path: Path) -> None:
    crossed = result(study, "campbell")
    i = int(np.argmax(crossed.crossing_speed_rpm.values))
    order, rpm = int(crossed.crossing_engine_order[i]), float(crossed.crossing_speed_rpm[i])
    path = write_small_wheel(
        tmp_path, engine_orders=f"[{order}]", speed_rpm=f"{1.04 * rpm!r}", margin_percent="5.0"
    )
    assert f"Hz at {1.04 * rpm:g} rpm" in done("safe", str(path), "--no-report")
    found = result(path, "safe").isel(pair=0)
    # a tangent over four per cent, against a frequency that is frozen at the speed
    frozen = float(found.pair_frequency_hz) * 60 / order
    assert abs(float(found.pair_resonance_rpm) / rpm - 1) < 0.1 * abs(frozen / rpm - 1)
    assert float(found.pair_margin) == pytest.approx(1 / 1.04 - 1, abs=2e-4)
    assert int(found.pair_near) == 1


def test_growth_is_the_slope_of_the_squares_with_coriolis_forces(tmp_path: Path) -> None:
    path = write_small_wheel(tmp_path, coriolis="true")
    model = disk_model(read_structure_study(path), lambda _: None)
    speed, step = 1500.0, 1e-3
    waves = {
        s: solve_wave(model, speed * s, 6, 2, shapes=False) for s in (1.0, 1.0 - step, 1.0 + step)
    }
    squares = {s: (2 * np.pi * w.frequencies_hz) ** 2 for s, w in waves.items()}
    by_difference = (squares[1 + step] - squares[1 - step]) / (4 * step * speed**2)
    np.testing.assert_allclose(waves[1.0].growth, by_difference, rtol=1e-5, atol=1e-5)


def test_engine_orders_above_the_followed_modes_or_left_out_are_named(tmp_path: Path) -> None:
    path = write_small_wheel(tmp_path, engine_orders="[2, 3, 10]", points="9")
    path.write_text(path.read_text().replace("[campbell]", "[campbell]\nnodal_diameters = [2]"))
    said = done("campbell", str(path))
    assert "engine orders are not judged: " in said
    assert "raise campbell.modes, now 2" in said
    assert "engine orders 3 have no crossings here, because campbell.nodal_diameters leaves" in said
    data = result(path, "campbell")
    at = dict(
        zip(data.unfollowed_engine_order.values, data.unfollowed_from_rpm.values, strict=True)
    )
    assert 10 in at
    assert 2 not in at
    # full modes there: the second one lies on the engine order
    model = disk_model(read_structure_study(path), lambda _: None)
    hertz = normal_modes(model.at(at[10] * 2 * np.pi / 60, 2), 2).frequencies_hz
    assert hertz[1] == pytest.approx(10 * at[10] / 60, rel=2e-3)
    assert f"EO 10 from {at[10]:.4g} rpm" in (path.parent / "results" / "report.html").read_text()


def test_static_displacement_is_told_and_doubted_where_it_is_large(
    study: Path, tmp_path: Path
) -> None:
    data = result(study, "modes")
    assert "too large" not in data.attrs["warnings"]
    assert data.attrs["static_rpm"] == 6000.0
    small = data.attrs["static_displacement_m"]
    # of the order of a freely rotating ring: rho Omega^2 r^3 / E at the tip
    tip = 0.29
    scale = 7850 * (6000 * 2 * np.pi / 60) ** 2 * tip**3 / 2.1e11
    assert 0.3 * scale < small < 3 * scale
    assert f"{1e3 * small:.4g}" in done("modes", str(study), "--no-report")
    path = write_small_wheel(tmp_path, speed_rpm="60000.0")
    said = done("modes", str(path))
    assert "the static displacement at 60000 rpm is too large for linear statics" in said
    large = result(path, "modes").attrs
    assert large["static_displacement_m"] == pytest.approx(100 * small, rel=1e-9)
    assert "too large for linear statics" in large["warnings"]
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    assert "largest static displacement" in page
    assert "Natural frequencies in Hz at 60000 rpm" in said


def test_strain_and_rotation_of_a_linear_field() -> None:
    mesh = mesh_sector(
        read_structure_study(
            ROOT / "examples/shrouded_sector/study.toml"
        ).tables.model.sector.library()
    )
    strain = 1e-3 * np.array([[2.0, 1.0, 0.0], [1.0, -5.0, 0.5], [0.0, 0.5, 1.0]])
    turn = 1e-3 * np.cross(np.eye(3), [1.0, 2.0, -2.0])  # of length three
    found = strain_and_rotation(mesh, mesh.points @ (strain + turn).T)
    expected = np.abs(np.linalg.eigvalsh(strain)).max(), 3e-3
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_mass_is_density_times_volume_and_shapes_meet_at_the_cut(study: Path) -> None:
    data = result(study, "modes")
    tables = read_structure_study(study).tables
    mesh = mesh_sector(tables.model.sector.library())
    corners = mesh.points[mesh.cells[:, :4]]
    edges = corners[:, 1:] - corners[:, :1]
    straight = np.abs(np.linalg.det(edges)).sum() / 6 * 7850.0
    # curved faces differ from their chords by a little
    assert data.attrs["mass_kg"] == pytest.approx(straight, rel=0.03)
    shape = data["shape"].values[..., 0] + 1j * data["shape"].values[..., 1]
    assert np.linalg.norm(shape, axis=-1).max() == pytest.approx(1.0, rel=1e-6)
    # u_high = exp(i theta) R u_low at partners of the cut faces, found by position
    angle = 2 * np.pi / 8
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    points = data.skin_point.values
    cut = np.unique(data.skin_triangle.values[data.skin_cut.values == 1])
    turned = points[cut] @ turn.T
    distance = np.linalg.norm(turned[:, None] - points[cut], axis=-1)
    low, high = np.nonzero(distance < 1e-6)
    assert len(low) > 5
    wave = int(data.wave_number[1])
    left = shape[1][:, cut[high]]
    right = np.exp(1j * wave * angle) * shape[1][:, cut[low]] @ turn.T
    np.testing.assert_allclose(left, right, atol=2e-6)


def test_page_holds_all_three(study: Path) -> None:
    page = (study.parent / "results" / "report.html").read_text(encoding="utf-8")
    for key in ("diameters", "shapes", "campbell", "safe"):
        assert f'<figure id="fig-{key}" class="all-cases">' in page
    assert len(page) < 10e6
    assert str(study.parent / "results" / "report.html") in done(
        "report", str(study.parent / "results")
    )


def test_finished_waves_are_not_computed_again(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = result(study, "modes")

    def never(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr("stickslip.study.structure_run.solve_wave", never)
    assert "2 of 2 waves are already there" in done("modes", str(study), "--no-report")
    xr.testing.assert_equal(before, result(study, "modes"))


def test_waves_kept_with_other_fields_are_refused(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    older = make_dataclass("WaveModes", [f.name for f in fields(WaveModes) if f.name != "growth"])
    monkeypatch.setattr("stickslip.study.structure_run.WaveModes", older)
    assert "another version of stickslip" in refused("modes", str(study))


def test_interrupted_command_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import stickslip.study.structure_run as module

    path, solve, asked = write_small_wheel(tmp_path), module.solve_wave, []

    def once(model: object, speed: float, wave: int, *rest: object, **more: object) -> object:
        if asked:
            raise KeyboardInterrupt
        asked.append(wave)
        return solve(model, speed, wave, *rest, **more)

    monkeypatch.setattr(module, "solve_wave", once)
    stopped = invoke("modes", str(path))
    assert stopped.exit_code == 130
    assert "The same command goes on" in stopped.stderr
    assert result(path, "modes").attrs["complete"] == 0
    monkeypatch.setattr(module, "solve_wave", solve)
    assert "1 of 2 waves are already there" in done("modes", str(path), "--no-report")
    assert result(path, "modes").attrs["complete"] == 1


def test_reference_frequencies_are_compared(study: Path, tmp_path: Path) -> None:
    hertz = result(study, "modes").frequency_hz.values
    rows = [
        f"at rest,0,1,{float(hertz[0, 0])!r}",
        f"at rest,2,2,{float(hertz[1, 1]) * 1.01!r}",
        "other,2,2,7.0",
    ]
    (tmp_path / "ref.csv").write_text("\n".join(["case,nodal_diameter,mode,frequency_hz", *rows]))
    path = write_small_wheel(tmp_path, **{"# reference": '"ref.csv"\nreference_case = "at rest"'})
    assert "the largest is -9.90e-03 (ND 2, mode 2)" in " ".join(
        done("modes", str(path), "--no-report").split()
    )
    off = result(path, "modes").difference.values
    np.testing.assert_allclose(off, [[0, np.nan], [np.nan, 1 / 1.01 - 1]], atol=1e-9)


def changed(folder: Path, old: str, new: str) -> Path:
    """Write the study with one text replaced."""
    text = wheel_text()
    assert text.count(old) == 1
    folder.mkdir(exist_ok=True)
    path = folder / "study.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


WRONG = {
    "unknown key": ("tangent =", "tangents =", "rotation.tangents: unknown key 'tangents'. Did you mean 'tangent'?"),
    "unknown word": ('"consistent"', '"consistant"', "rotation.tangent: is not known, got 'consistant'. Did you mean 'consistent'?"),
    "a geometry that cannot be": ("rim_height_m = 0.014", "rim_height_m = 0.1", "model.sector.disk: bore_radius 0.06 m, hub_radius 0.095 m and the rim's inner radius 0.07 m do not grow in this order."),
    "speeds that fall": ("[0.0, 16000.0]", "[9000.0, 0.0]", "campbell.speeds_rpm: must be the lower before the higher"),
    "a diameter that is not there": ("nodal_diameters = [0, 2]", "nodal_diameters = [0, 5]", "modes.nodal_diameters: 5 is above half of 8 sectors. The nodal diameters go from 0 to 4."),
    "joined with a gap": ("gap_m = 0.0 ", "gap_m = 0.001 ", "model.sector.shroud.joined: needs shrouds that touch, got gap_m = 0.001."),
    "absurd units": ("young_modulus_pa = 2.1e11", "young_modulus_pa = -2.1e5", "material.young_modulus_pa: must be greater than 0"),
    "no reference": ("# reference =", "reference =", "modes.reference: there is no file"),
    "a folder outside": ('folder = "results"', 'folder = "../out"', "output.folder: must be a folder inside the study's folder"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_bad_studies_are_told_what_is_wrong(tmp_path: Path, name: str) -> None:
    old, new, said = WRONG[name]
    path = changed(tmp_path, old, new)
    told = refused("modes", str(path))
    assert told.startswith(f"{path}: ")
    assert said in told
    assert not (tmp_path / "results").exists()


def test_studies_of_the_other_kind_name_their_command(tmp_path: Path) -> None:
    done("new", str(tmp_path / "blades"))
    blades = tmp_path / "blades" / "study.toml"
    assert f"Use 'stickslip run {blades}'" in refused("modes", str(blades))
    wheel_study = write_small_wheel(tmp_path / "wheel")
    assert f"Use 'stickslip modes {wheel_study}'" in refused("run", str(wheel_study))


def test_commands_whose_table_is_missing_and_missing_studies(tmp_path: Path) -> None:
    text = wheel_text()
    begin, end = text.index("[campbell]"), text.index("[safe]")
    path = tmp_path / "study.toml"
    path.write_text(text[:begin] + text[end:])
    assert refused("campbell", str(path)).startswith(f"{path}: campbell: is missing. Add the table")
    assert "there is no such file" in refused("safe", str(tmp_path / "none.toml"))
    assert "there is no result of a bladed disk" not in refused("report", str(tmp_path))


def test_safe_needs_a_speed(tmp_path: Path) -> None:
    path = write_small_wheel(tmp_path, speed_rpm="0.0")
    assert f"{path}: safe.speed_rpm: must be above zero, got 0." in refused("safe", str(path))


def test_fresh_gives_nothing_up_for_a_model_that_cannot_be_built(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    path = file_study(tmp_path)
    kept = tmp_path / "results" / "modes.nc"
    kept.parent.mkdir()
    kept.write_text("of an earlier run")
    path.write_text(path.read_text().replace('"SI"', '"mm-t-s"'))
    refused("modes", str(path), "--fresh")
    assert kept.read_text() == "of an earlier run"
    assert [p.name for p in kept.parent.iterdir()] == ["modes.nc"]


def test_check_builds_the_model_and_writes_nothing(tmp_path: Path) -> None:
    path = write_small_wheel(tmp_path)
    said = done("check", str(path))
    assert "pairs of dofs on the cyclic faces" in said
    assert "good to run" in said
    assert [p.name for p in tmp_path.iterdir()] == ["study.toml"]


CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)


def write_deck(path: Path, length: float = 1.0) -> Path:
    """Write a cantilever of two cubes of a tenth of a metre (SI) or of other units as a deck."""
    points = 0.1 * np.vstack([CUBE, CUBE[[1, 3, 5, 7]] + [1, 0, 0]]) / length
    lines = [
        "*NODE, NSET=ALL",
        *(f"{i + 1}, {', '.join(map(repr, map(float, p)))}" for i, p in enumerate(points)),
    ]
    lines += [
        "*ELEMENT, TYPE=C3D8, ELSET=E",
        "1, 1, 2, 4, 3, 5, 6, 8, 7",
        "2, 2, 9, 10, 4, 6, 11, 12, 8",
    ]
    lines += ["*NSET, NSET=FOOT", "1, 3, 5, 7", "*NSET, NSET=TIP", "9, 10, 11, 12"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850."]
    lines += ["*SOLID SECTION, ELSET=E, MATERIAL=STEEL"]
    path.write_text("\n".join(lines) + "\n")
    return path


def file_study(folder: Path, more: str = "", model: str = "deck.inp") -> Path:
    path = folder / "study.toml"
    path.write_text(
        f'schema_version = 1\n[model.file]\npath = "{model}"\nunits = "SI"\n{more}\n[modes]\nnumber = 3\n'
    )
    return path


def test_whole_structure_from_a_deck(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    path = file_study(tmp_path, 'clamped = ["foot"]')
    done("modes", str(path))
    data = result(path, "modes")
    # Euler-Bernoulli of a cube-sized stub is no reference; its own mass and symmetry are: two equal bending modes
    assert data.attrs["mass_kg"] == pytest.approx(2 * 7850 * 1e-3, rel=1e-12)
    np.testing.assert_allclose(data.attrs["centre_m"], [0.1, 0.05, 0.05], rtol=1e-12)
    assert float(data.frequency_hz[0, 0]) == pytest.approx(float(data.frequency_hz[0, 1]), rel=1e-9)
    assert data["shape"].dims == ("wave", "mode", "skin_point", "xyz", "part")
    assert "a whole structure" in refused("safe", str(with_safe(path)))


def with_safe(path: Path) -> Path:
    path.write_text(path.read_text() + "[safe]\nspeed_rpm = 100.0\nengine_orders = [1]\n")
    return path


def test_matrices_have_modes_and_no_speed(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    model = disk_model(
        read_structure_study(file_study(tmp_path, 'clamped = ["FOOT"]')), lambda _: None
    )
    save_structure(model.structure, tmp_path / "beam.npz")
    path = file_study(tmp_path, model="beam.npz")
    done("modes", str(path))
    expected = normal_modes(model.structure, 3).frequencies_hz
    np.testing.assert_allclose(result(path, "modes").frequency_hz[0], expected, rtol=1e-12)
    page = (tmp_path / "results" / "report.html").read_text()
    assert "this result holds no mode shapes" in page
    turning = path.read_text() + "[rotation]\nspeed_rpm = 10.0\n"
    path.write_text(turning)
    assert "the model is matrices, which no speed changes" in refused("modes", str(path), "--fresh")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('clamped = ["FOOD"]', "model.file.clamped[0]: the file has no set 'FOOD' of free nodes. Did you mean 'FOOT'?"),
        ("sectors = 6", "model.file.low_face: is missing with 6 sectors, and the file has no cyclic tie. Name one of its sets: "),
        ('sectors = 6\nlow_face = "FOOT"', "model.file.high_face: is missing, the other face is given."),
        ('sectors = 6\nlow_face = "FOOT"\nhigh_face = "TIP"', "turned by"),
        ('low_face = "FOOT"\nhigh_face = "TIP"', "model.file.sectors: must be above 1 with cyclic faces."),
        ('mesh = "none.inp"', "model.file.mesh: there is no file"),
    ],
)  # fmt: skip
def test_files_and_study_that_disagree(tmp_path: Path, more: str, said: str) -> None:
    write_deck(tmp_path / "deck.inp")
    assert said in refused("modes", str(file_study(tmp_path, more)))


def test_units_that_give_absurd_numbers_are_doubted(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    path = file_study(tmp_path)
    path.write_text(path.read_text().replace('"SI"', '"mm-t-s"'))
    said = refused("modes", str(path))
    assert "that looks like SI" in said
    assert "Give model.file.units, or model.file.plausible = false" in said


def test_inspect_says_what_is_in_a_file(tmp_path: Path) -> None:
    said = done("inspect", str(write_deck(tmp_path / "deck.inp")), "--frequencies", "8")
    rows = {line[:26].strip(): line[26:].strip() for line in said.splitlines()}
    assert rows["nodes"] == "12"
    assert rows["dofs"] == "36"
    assert rows["set FOOT"] == "4 nodes"
    assert rows["rigid modes"] == "6"
    assert len(rows["frequencies (Hz)"].split(",")) == 8
    # beside the six rigid ones
    assert float(rows["frequencies (Hz)"].split(",")[6]) > 100.0
    assert "none.inp" in refused("inspect", str(tmp_path / "none.inp"))
    (tmp_path / "notes.txt").write_text("x")
    assert "no reader for files '.txt'" in refused("inspect", str(tmp_path / "notes.txt"))
    assert "unknown unit system 'furlong'" in refused(
        "inspect", str(tmp_path / "deck.inp"), "--units", "furlong"
    )


def test_decks_of_several_materials_and_single_supports_rotate(tmp_path: Path) -> None:
    """Titanium blades, a bore that is free along the axis: the study's frequencies are those of the library."""
    decks = write_decks(tmp_path)
    path = tmp_path / "study.toml"
    path.write_text(
        'schema_version = 1\ntitle = "two materials"\n'
        '[model.file]\npath = "speed.inp"\nunits = "SI"\nsectors = 24\nquadrature = "calculix"\n'
        "[rotation]\nspeed_rpm = 8000.0\n[modes]\nnumber = 3\nnodal_diameters = [2]\n",
        encoding="utf-8",
    )
    done("modes", str(path))
    deck = read_deck(decks["at 8000 rpm"])
    solid = our_solid(deck)
    sector = cyclic_sector(solid.structure, 24)
    turning = solid.at_speed(8000 * 2 * np.pi / 60, tie=sector.tie)
    hertz = normal_modes(travelling_wave(replace(sector, structure=turning), 2), 3).frequencies_hz
    data = result(path, "modes")
    np.testing.assert_allclose(data.frequency_hz.values.ravel(), hertz, rtol=1e-10)
    steel, titanium = (deck.materials[name].density for name in ("STEEL", "TITANIUM"))
    assert titanium < steel
    free = float(solid.structure.mass.sum()) / 3  # without what is clamped
    assert free < data.attrs["mass_kg"] < free * steel / titanium


def test_a_missing_key_of_an_optional_table_is_described(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    (tmp_path / "a.inp").write_text("*NODE\n")
    path.write_text('schema_version = 1\n[model.file]\npath = "a.inp"\n', encoding="utf-8")
    said = refused("modes", str(path))
    assert "model.file.units: is missing. Add it: the file's unit system: SI, mm-t-s" in said


# Decks of sectors, materials and keys as a user meets them first


def sector_study(folder: Path, sectors: str, more: str = "number = 2") -> Path:
    """Write a study of a deck with a cyclic tie of 24 sectors."""
    write_decks(folder)
    path = folder / "study.toml"
    path.write_text(
        f'schema_version = 1\n[model.file]\npath = "speed.inp"\nunits = "SI"\n{sectors}\n[modes]\n{more}\n',
        encoding="utf-8",
    )
    return path


def test_number_of_sectors_is_the_decks(tmp_path: Path) -> None:
    path = sector_study(tmp_path, "", "nodal_diameters = [12]\nnumber = 2")
    done("modes", str(path))
    left_out = result(path, "modes")
    assert left_out.attrs["sectors"] == 24
    path = sector_study(tmp_path, "sectors = 24", "nodal_diameters = [12]\nnumber = 2")
    done("modes", str(path), "--fresh")
    np.testing.assert_array_equal(left_out.frequency_hz, result(path, "modes").frequency_hz)


@pytest.mark.parametrize(
    ("sectors", "diameter", "said"),
    [
        ("", 13, "modes.nodal_diameters: 13 is above half of 24 sectors. The nodal diameters go from 0 to 12."),
        ("sectors = 23", 12, "model.file.sectors: is 23, but the deck's cyclic symmetry has 24. Give sectors = 24, or leave it out."),
        ("sectors = 1", 12, "model.file.sectors: is 1, but the deck's cyclic symmetry has 24."),
    ],
)  # fmt: skip
def test_nodal_diameters_are_judged_by_the_true_number_of_sectors(
    tmp_path: Path, sectors: str, diameter: int, said: str
) -> None:
    path = sector_study(tmp_path, sectors, f"nodal_diameters = [{diameter}]")
    assert refused("modes", str(path)).startswith(f"{path}: {said}")


def test_a_cyclic_tie_without_number_is_refused(tmp_path: Path) -> None:
    path = sector_study(tmp_path, "")
    lines = (tmp_path / "speed.inp").read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("*CYCLIC SYMMETRY MODEL"))
    (tmp_path / "speed.inp").write_text("\n".join(lines[:at] + lines[at + 2 :]) + "\n")
    said = refused("check", str(path))
    assert "*TIE: is cyclic, but nothing says how many sectors there are. Add *CYCLIC" in said


def test_a_misspelt_key_of_a_nested_table_lists_that_tables_keys(tmp_path: Path) -> None:
    path = write_small_wheel(tmp_path)
    path.write_text(path.read_text().replace("hub_chord_m", "hub_cord_m"))
    said = refused("check", str(path))
    assert (
        "model.sector.airfoil.hub_cord_m: unknown key 'hub_cord_m'. Did you mean 'hub_chord_m'?"
        in said
    )
    path.write_text(path.read_text().replace("hub_cord_m", "zzz"))
    said = refused("check", str(path))
    assert "unknown key 'zzz'. Known: airfoil_length_m, " in said


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("young_modulus_pa", "114.0", ("material.young_modulus_pa: no solid has 114 Pa, which is 1.14e+11 Pa if it is in GPa. "
         "Give a value from 1e+07 to 2e+12 Pa, or material.plausible = false where the number is right.")),
        ("young_modulus_pa", "2.1e14", "material.young_modulus_pa: no solid has 2.1e+14 Pa. Give a value"),
        ("density_kg_per_m3", "7.85", "material.density_kg_per_m3: no solid has 7.85 kg/m³, which is 7850 kg/m³ if it is in g/cm³."),
        ("density_kg_per_m3", "7.85e-9", "which is 7850 kg/m³ if it is in t/mm³."),
    ],
)  # fmt: skip
def test_a_material_that_no_solid_has_is_refused(
    tmp_path: Path, key: str, value: str, said: str
) -> None:
    path = write_small_wheel(tmp_path, **{key: value})
    assert said in refused("modes", str(path))
    path.write_text(path.read_text().replace("[material]", "[material]\nplausible = false"))
    material = read_structure_study(path).tables.material
    assert material is not None
    assert float(value) in (material.library().young_modulus, material.library().density)


def test_fresh_removes_the_files_of_its_command_only(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    path = file_study(tmp_path, 'clamped = ["FOOT"]')
    done("modes", str(path), "--no-report")
    kept = tmp_path / "results" / "safe.nc"
    kept.write_text("of another command")
    path.write_text(path.read_text().replace("number = 3", "number = 2"))
    said = refused("modes", str(path), "--no-report")
    assert "what this command left here is of another or a changed study" in said
    assert "--fresh, which removes this command's files of the folder and no others" in said
    done("modes", str(path), "--fresh", "--no-report")
    assert result(path, "modes").sizes["mode"] == 2
    assert kept.read_text() == "of another command"


def test_inspect_gives_the_whole_mass_and_names_what_sets_hold(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp")
    deck.write_text(deck.read_text() + "*BOUNDARY\nFOOT, 1, 3\n")
    rows = inspected("inspect", str(deck), "--frequencies", "0")
    whole = 2 * 7850 * 1e-3
    assert float(rows["mass (kg)"]) == pytest.approx(whole, rel=1e-5)
    assert float(rows["free mass x, y, z (kg)"].split(",")[0]) < 0.9 * whole
    assert rows["centre of mass (m)"] == "0.1, 0.05, 0.05"
    assert rows["set TIP"] == "4 nodes"
    model = disk_model(read_structure_study(file_study(tmp_path)), lambda _: None)
    assert model.facts.mass == pytest.approx(whole, rel=1e-12)  # as the commands say
    save_structure(model.structure, tmp_path / "beam.npz")
    assert inspected("inspect", str(tmp_path / "beam.npz"))["set TIP"] == "12 dofs"


def inspected(*words: str) -> dict[str, str]:
    return {line[:26].strip(): line[26:].strip() for line in done(*words).splitlines()}


def test_a_picture_is_no_deck(tmp_path: Path) -> None:
    picture = tmp_path / "picture.inp"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    assert f"{picture}: is no text: byte 9 is zero" in refused("inspect", str(picture))
    assert "is no text" in refused("check", str(file_study(tmp_path, model="picture.inp")))


def test_a_misspelt_keyword_of_a_material_is_named(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp")
    text = deck.read_text()
    deck.write_text(text.replace("*ELASTIC", "*ELASTICX"))
    said = refused("inspect", str(deck))
    assert "material 'STEEL' has no *ELASTIC. Add it to *MATERIAL, NAME=STEEL. " in said
    assert "Not known is its *ELASTICX (deck.inp: line " in said
    deck.write_text(text.replace("MATERIAL=STEEL", "MATERIAL=STEAL"))
    assert "Did you mean 'STEEL'?" in refused("inspect", str(deck))


def test_remedies_are_options_and_keys_not_arguments(tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp")
    deck.write_text(deck.read_text() + "*EQUATION\n2\n1, 1, 1., 2, 1, -1.\n")
    said = refused("check", str(file_study(tmp_path)))
    assert (
        "*EQUATION changes the model and is not read. Let the solver write its matrices and read those."
        in said
    )
    assert "ignore" not in said + refused("inspect", str(deck))
    (tmp_path / "job.sti").write_text("1 1 1.0\n")
    (tmp_path / "job.dof").write_text("1.1\n")
    assert "Give --mesh (a deck .inp" in refused("inspect", str(tmp_path / "job.sti"))
    said = refused("check", str(file_study(tmp_path, model="job.sti")))
    assert "Give model.file.mesh (a deck .inp" in said


@pytest.mark.parametrize("plausible", [True, False])
def test_matrices_with_the_mesh_of_another_job(tmp_path: Path, *, plausible: bool) -> None:
    data = ROOT / "tests" / "data" / "calculix"
    for end in (".sti.gz", ".mas.gz", ".dof"):
        (tmp_path / f"brick_matrix{end}").write_bytes((data / f"brick_matrix{end}").read_bytes())
    deck = read_deck(data / "brick_matrix.inp", units=Units.mm_t_s())
    points = 1e3 * np.random.default_rng(0).permutation(deck.mesh.points)
    rows = [f"{n},{x},{y},{z}" for n, (x, y, z) in zip(deck.mesh.numbers, points, strict=True)]
    (tmp_path / "other.csv").write_text("\n".join(["node,x,y,z", *rows]) + "\n")
    words = ("--mesh", str(tmp_path / "other.csv"), "--units", "mm-t-s", "--frequencies", "0")
    said = done("inspect", str(tmp_path / "brick_matrix.sti.gz"), *words)
    assert "they are probably those of another mesh" in said
    more = f'mesh = "other.csv"\nplausible = {str(plausible).lower()}'
    study = file_study(tmp_path, more, "brick_matrix.sti.gz")
    study.write_text(study.read_text().replace('"SI"', '"mm-t-s"'))
    if plausible:
        said = refused("check", str(study))
        assert "other.csv: its nodes do not fit the stiffness of brick_matrix" in said
        assert "or model.file.plausible = false where they are right" in said
    else:
        done("check", str(study))


def test_example_for_files_takes_the_deck_of_a_sector(tmp_path: Path) -> None:
    folder = tmp_path / "made"
    said = done("new", str(folder), "--kind", "file")
    path = folder / "study.toml"
    assert f"Next: name your model's file in it, stickslip check {path}" in said
    assert "model.file.path: there is no file" in refused("check", str(path))
    (folder / "sector.inp").write_text(write_decks(tmp_path)["at 8000 rpm"].read_text())
    assert "Give model.file.units" in refused("check", str(path))  # that deck is in SI
    path.write_text(path.read_text().replace('"mm-t-s"', '"SI"'))
    assert "pairs of dofs on the cyclic faces" in done("check", str(path))
    # what is commented out is right as well, but for names of sets
    lines = [
        line.removeprefix("# ") for line in path.read_text().splitlines()
        if not line.startswith("# ") or "=" in line.partition("#")[2].partition("#")[0] or line.startswith("# [")
    ]  # fmt: skip
    (folder / "frequencies.csv").write_text("nodal_diameter,mode,frequency_hz\n0,1,100.0\n")
    path.write_text("\n".join(lines) + "\n")
    tables = read_structure_study(path).tables
    assert tables.model.file is not None
    assert (tables.model.file.low_face, tables.model.file.clamped) == ("CYC_LO", ["BORE"])
    assert tables.material is not None


@pytest.mark.parametrize(
    ("faces", "sectors", "said"),
    [
        (("CYC_LO", "CYC_HI"), 23, "'CYC_LO' and 'CYC_HI': are 15° apart, 23 sectors need 15.652°. Give sectors = 24, or check the axis"),
        (("CYC_HI", "CYC_LO"), 24, "'CYC_HI' and 'CYC_LO': are swapped: 'CYC_LO' lies 15° behind 'CYC_HI' about the axis (0.0, 0.0, 1.0). Swap low_face and high_face, or"),
    ],
)  # fmt: skip
def test_faces_that_do_not_match_have_the_names_of_the_study(
    tmp_path: Path, faces: tuple[str, str], sectors: int, said: str
) -> None:
    low, high = faces
    path = sector_study(tmp_path, f'sectors = {sectors}\nlow_face = "{low}"\nhigh_face = "{high}"')
    deck = tmp_path / "speed.inp"
    lines, kept = iter(deck.read_text().splitlines()), []
    for line in lines:
        if line.startswith(("*TIE", "*CYCLIC SYMMETRY MODEL")):
            next(lines)  # a deck without a tie, so that the study names the faces
        else:
            kept.append(line)
    deck.write_text("\n".join(kept) + "\n")
    assert f"{path}: model.file: {said}" in refused("check", str(path))


def test_fresh_gives_nothing_up_for_a_model_that_the_command_cannot_take(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    path = with_safe(file_study(tmp_path, 'clamped = ["FOOT"]'))
    kept = tmp_path / "results" / "safe.nc"
    kept.parent.mkdir()
    kept.write_text("of an earlier run")
    assert "a whole structure" in refused("safe", str(path), "--fresh")
    assert kept.read_text() == "of an earlier run"
