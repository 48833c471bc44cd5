"""Modes, Campbell and SAFE diagrams of a study: against the assembled wheel, full modes, the library, and each other."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from cyclic_models import unlike_wedge
from small_v2 import changed, write_four_masses, write_shrouded_sector, write_two_blades
from test_report import page_text

from evidence.validation.case_calculix_materials import our_solid, write_decks
from stickslip.analyses.page import report_html
from stickslip.analyses.waves.records import Wheel
from stickslip.analyses.waves.solve import Question, solve_wave
from stickslip.assembly.model import Model
from stickslip.errors import InputError
from stickslip.model.fe.cell_laws import cell_laws
from stickslip.model.fe.prestress import strain_and_rotation
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import gyroscopic_modes, normal_modes, with_springs
from stickslip.model.part import solid_part
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.structure_file import save_structure
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.full_wheel import wheel
from stickslip.study.analysis import named
from stickslip.study.models.study import Study, read_study
from stickslip.study.outcome import Outcome
from stickslip.study.run import answer, run_study
from stickslip.study.store.netcdf import one_case
from stickslip.study.verdict import conclusion, of_tree, stored
from stickslip.units import RPM

pytestmark = pytest.mark.usefixtures("parts_once")
STEEL = """
schema_version = 2
[material]
young_modulus_pa = 2.1e11
poisson_ratio = 0.3
density_kg_per_m3 = 7850.0
"""
JOINED = f"""{STEEL}
[part.blade]
shape = "bladed_sector"
sectors = 8
disk_size_m = 0.05
platform_size_m = 0.03
airfoil_size_m = 0.04
[part.blade.shroud]
depth_m = 0.026
face_angle_deg = 20.0
[join.shroud]
between = ["blade.shroud_high", "next.blade.shroud_low"]
[rotation]
speed_rpm = 6000.0
[modes]
number = 2
nodal_diameters = [0, 2]
[campbell]
speeds_rpm = [0.0, 16000.0]
points = 3
engine_orders = [2, 6]
modes = 2
[safe]
engine_orders = [2, 6]
modes = 2
"""
ANALYSES = ("modes", "campbell", "safe")


def study(folder: Path, changes: dict[str, str] | None = None, text: str = JOINED) -> Study:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(changed(text, changes or {}), encoding="utf-8")
    return read_study(path)


def done(study: Study, name: str) -> Outcome:
    """Answer one question of a study, writing nothing."""
    return answer(named(name), study.cases())


def node(study: Study, name: str) -> xr.Dataset:
    """Return what one question of a study is answered, its first case."""
    return one_case(done(study, name).tree[name].to_dataset(), 0)


@pytest.fixture(scope="module")
def joined(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, dict[str, xr.Dataset]]:
    """A study, and its three answers."""
    made = study(tmp_path_factory.mktemp("wheel"))
    return made, {name: node(made, name) for name in ANALYSES}


Joined = tuple[Study, dict[str, xr.Dataset]]


def test_frequencies_are_those_of_the_assembled_wheel(joined: Joined) -> None:
    # the wheel of all sectors at speed shares the sector's matrices, but neither waves nor phases
    model = joined[0].model()
    here = model.neighbours
    assert here is not None
    at = model.coordinates
    sector = here.sector(at.tied(model.full(model.speed)), at)
    hertz = normal_modes(wheel(sector), 8).frequencies_hz
    data = joined[1]["safe"]  # all nodal diameters, two modes of each
    both = np.where(data.wave_kind == "standing", 1, 2)
    union = np.sort(np.repeat(data.frequency_hz.values, both, axis=0).ravel())
    # the third modes of the diameters lie above the first eight of the wheel
    np.testing.assert_allclose(union[:8], hertz, rtol=1e-8)
    modes = joined[1]["modes"]
    np.testing.assert_allclose(modes.frequency_hz, data.frequency_hz[modes.wave_number.values], rtol=1e-9)


def test_crossings_lie_on_engine_order_and_mode(joined: Joined) -> None:
    data = joined[1]["campbell"]
    assert data.sizes["crossing"] > 0
    assert float(data.basis_error.max()) < 1e-5
    np.testing.assert_allclose(data.crossing_frequency_hz, data.crossing_engine_order * data.crossing_speed_rpm / 60)
    # full modes at the speed of a crossing: no basis, no following
    first = data.isel(crossing=0)
    number = int(data.wave_number[int(first.crossing_wave)])
    at = joined[0].model().at(float(first.crossing_speed_rpm) * RPM, number)
    nearest = np.abs(normal_modes(at, 3).frequencies_hz / float(first.crossing_frequency_hz) - 1)
    assert nearest.min() < 1e-5
    assert nearest.argmin() == int(first.crossing_mode)
    # on 8 sectors engine orders 2 and 6 both excite two nodal diameters
    assert set(data.nodal_diameter.values) == {2}
    assert list(data.attrs["engine_orders"]) == [2, 6]


def test_basis_that_is_too_small_is_told(joined: Joined, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # two modes and none to spare, over a range in which the shapes change
    monkeypatch.setattr("stickslip.reduction.speed_basis.SPARE_MODES", 0)
    monkeypatch.setattr("stickslip.analyses.waves.verdicts.BASIS_ERROR", 1e-9)
    outcome = done(study(tmp_path, {"campbell.engine_orders": "[2]"}), "campbell")
    said = "wave number 2: frequencies between the speeds of the basis are off"
    assert any(v.why.startswith(said) for v in outcome.verdicts)
    rough = float(outcome.tree["campbell"].basis_error.max())
    assert rough > 10 * float(joined[1]["campbell"].basis_error.max())


def test_coriolis_forces_part_the_directions(tmp_path: Path) -> None:
    changes = {"rotation.coriolis": "true", "rotation.speed_rpm": "16000.0", "modes.nodal_diameters": "[2]"}
    made = study(tmp_path, changes | {"campbell.engine_orders": "[6]"})
    modes, branches = done(made, "modes"), done(made, "campbell")
    assert "backward" in {row[1] for row in modes.summaries["modes"][0].rows}
    assert branches.summaries["campbell"][0].rows[0][0] == "ND 2 forward"
    found, followed = modes.tree["modes"], branches.tree["campbell"]
    assert found.wave_number.values.tolist() == [[2, 6]]
    assert followed.wave_number.values.tolist() == [[6]]
    backward, forward = found.frequency_hz.values[0]
    assert np.all(backward > 1.005 * forward)
    # the basis of the branches holds the modes of the last speed, which modes finds without it
    np.testing.assert_allclose(np.sort(followed.frequency_hz.values[0, 0, -1]), forward, rtol=1e-7)


def test_engine_orders_above_the_computed_modes_are_not_called_clear(tmp_path: Path) -> None:
    # on 8 sectors engine order 14 excites two nodal diameters, at 1400 Hz: far above two modes
    made = study(tmp_path, {"safe.engine_orders": "[2, 14]"})
    outcome = done(made, "safe")
    said = outcome.verdicts[0].sentence
    assert "Engine orders 14 are not judged; with the margin they excite nodal diameters 2 at 1400 Hz" in said
    assert "Raise safe.modes, now 2, to" in said
    assert conclusion(outcome.tree).startswith("EO 14 not judged (raise safe.modes, now 2, to ")
    data = outcome.tree["safe"]
    order = data.pair_engine_order.values
    np.testing.assert_array_equal(data.pair_judged.values, order != 14)
    (verdict,) = stored(data.attrs)
    assert verdict.level == "doubtful"
    assert "not judged" in verdict.why
    rows = [row for row in outcome.summaries["safe"][0].rows if row[0] == "14"]
    assert len(rows) == 2
    assert {row[-1] for row in rows} <= {"order not judged", "NEAR"}
    # what the remedy asks for is enough
    enough = int(said.split("now 2, to ")[1].split()[0])
    more = normal_modes(made.model().at(6000 * RPM, 2), enough).frequencies_hz
    assert more[1] < 1400 < 1400 * 1.05 < more[-1]


def test_resonances_are_the_crossings_of_the_campbell_diagram(joined: Joined, tmp_path: Path) -> None:
    crossed = joined[1]["campbell"]
    i = int(np.argmax(crossed.crossing_speed_rpm.values))
    order, rpm = int(crossed.crossing_engine_order[i]), float(crossed.crossing_speed_rpm[i])
    changes = {"safe.engine_orders": f"[{order}]", "safe.speed_rpm": f"{1.04 * rpm!r}"}
    outcome = done(study(tmp_path, changes), "safe")
    assert f"Hz at {1.04 * rpm:g} rpm" in outcome.summaries["safe"][0].head
    data = one_case(outcome.tree["safe"].to_dataset(), 0)
    own = data.frequency_hz.values[data.pair_wave.values, data.pair_mode.values]
    np.testing.assert_array_equal(data.pair_frequency_hz.values, own)
    np.testing.assert_allclose(data.pair_excitation_hz, data.pair_engine_order * 1.04 * rpm / 60)
    found = data.isel(pair=0)
    # a tangent over four per cent, against a frequency that is frozen at the speed
    frozen = float(found.pair_frequency_hz) * 60 / order
    assert abs(float(found.pair_resonance_rpm) / rpm - 1) < 0.1 * abs(frozen / rpm - 1)
    assert float(found.pair_margin) == pytest.approx(1 / 1.04 - 1, abs=2e-4)
    assert int(found.pair_near) == 1
    assert found.attrs["margin_percent"] == 5.0


def test_growth_is_the_slope_of_the_squares_with_coriolis_forces(tmp_path: Path) -> None:
    model = study(tmp_path, {"rotation.coriolis": "true"}).model()
    speed, step = 1500.0, 1e-3
    scales = (1.0, 1.0 - step, 1.0 + step)
    asked = {s: Question(model, "static", Wheel(8, parted=True), (6,), 2, (speed * s,)) for s in scales}
    waves = {s: solve_wave(asked[s], 6) for s in scales}
    squares = {s: (2 * np.pi * w.frequencies_hz) ** 2 for s, w in waves.items()}
    by_difference = (squares[1 + step] - squares[1 - step]) / (4 * step * speed**2)
    np.testing.assert_allclose(waves[1.0].growth, by_difference, rtol=1e-5, atol=1e-5)


def test_engine_orders_above_the_followed_modes_are_named(tmp_path: Path) -> None:
    changes = {"campbell.engine_orders": "[2, 10]", "campbell.points": "9"}
    made = study(tmp_path, changes)
    outcome = done(made, "campbell")
    said = "\n".join(map(str, outcome.verdicts))
    assert "engine orders are not judged: " in said
    assert "Raise campbell.modes, now 2" in said
    assert [v.not_judged[:12] for v in outcome.verdicts if v.not_judged] == ["EO 10 above "]
    # the displacement is too large at that speed, which doubts what was judged
    assert conclusion(outcome.tree) == "Not to be trusted as it stands: campbell: doubtful. See the verdicts."
    data = one_case(outcome.tree["campbell"].to_dataset(), 0)
    orders, speeds = data.unfollowed_engine_order.values, data.unfollowed_from_rpm.values
    at = dict(zip(orders.tolist(), speeds.tolist(), strict=True))
    assert 10 in at
    assert 2 not in at
    # full modes there: the second one lies on the engine order
    hertz = normal_modes(made.model().at(at[10] * RPM, 2), 2).frequencies_hz
    assert hertz[1] == pytest.approx(10 * at[10] / 60, rel=2e-3)


def test_static_displacement_is_told_and_doubted_where_it_is_large(joined: Joined, tmp_path: Path) -> None:
    data = joined[1]["modes"]
    assert not stored(data.attrs)
    assert data.attrs["static_rpm"] == pytest.approx(6000.0, rel=1e-14)
    small = data.attrs["static_displacement_m"]
    # of the order of a freely rotating ring: rho Omega^2 r^3 / E at the tip
    scale = 7850 * (6000 * RPM) ** 2 * 0.29**3 / 2.1e11
    assert 0.3 * scale < small < 3 * scale
    outcome = done(study(tmp_path, {"rotation.speed_rpm": "60000.0"}), "modes")
    assert outcome.verdicts[0].sentence.startswith(
        "Frequencies at 60000 rpm are in doubt, as the static displacement is too large for linear statics"
    )
    first, second = outcome.summaries["modes"]
    assert first.title == "Natural frequencies in Hz at 60000 rpm"
    assert second.title == "Static displacement under the centrifugal load and thermal strain"
    large = float(outcome.tree["modes"].static_displacement_m[0])
    assert large == pytest.approx(100 * small, rel=1e-9)
    assert f"{1e3 * large:.4g}" in second.rows[0]


def test_strain_and_rotation_of_a_linear_field(joined: Joined) -> None:
    mesh = joined[0].model().parts["blade"].mesh
    assert mesh is not None
    strain = 1e-3 * np.array([[2.0, 1.0, 0.0], [1.0, -5.0, 0.5], [0.0, 0.5, 1.0]])
    turn = 1e-3 * np.cross(np.eye(3), [1.0, 2.0, -2.0])  # of length three
    found = strain_and_rotation(cell_laws(mesh, Material()), mesh.points @ (strain + turn).T)
    expected = np.abs(np.linalg.eigvalsh(strain)).max(), 3e-3
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_mass_is_density_times_volume_and_shapes_meet_at_the_cut(joined: Joined) -> None:
    data = joined[1]["modes"]
    mesh = joined[0].model().parts["blade"].mesh
    assert mesh is not None
    corners = mesh.points[mesh.cells[:, :4]]
    edges = corners[:, 1:] - corners[:, :1]
    straight = np.abs(np.linalg.det(edges)).sum() / 6 * 7850.0
    # curved faces differ from their chords by a little
    assert data.attrs["mass_kg"] == pytest.approx(straight, rel=0.03)
    shape = data["shape"].values[..., 0] + 1j * data["shape"].values[..., 1]
    assert np.linalg.norm(shape, axis=-1).max() == pytest.approx(1.0, rel=1e-6)
    # u_high = exp(i theta) R u_low at partners of the cut faces, found by position
    angle = 2 * np.pi / 8
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    points = data.skin_point.values
    cut = np.unique(data.skin_triangle.values[data.skin_cut.values == 1])
    turned = points[cut] @ turn.T
    distance = np.linalg.norm(turned[:, None] - points[cut], axis=-1)
    low, high = np.nonzero(distance < 1e-6)
    assert len(low) > 5
    number = int(data.wave_number[1])
    left = shape[1][:, cut[high]]
    right = np.exp(1j * number * angle) * shape[1][:, cut[low]] @ turn.T
    np.testing.assert_allclose(left, right, atol=2e-6)


def test_reference_frequencies_are_compared(joined: Joined, tmp_path: Path) -> None:
    hertz = joined[1]["modes"].frequency_hz.values
    rows = [
        "case,nodal_diameter,mode,frequency_hz",
        f"at rest,0,1,{float(hertz[0, 0])!r}",
        f"at rest,2,2,{float(hertz[1, 1]) * 1.01!r}",
        "other,2,2,7.0",
    ]
    (tmp_path / "ref.csv").write_text("\n".join(rows))
    named_in = {"modes.reference": '"ref.csv"', "modes.reference_case": '"at rest"'}
    outcome = done(study(tmp_path, named_in), "modes")
    title = outcome.summaries["modes"][1].title
    assert "the largest is -9.90e-03 (ND 2, mode 2)" in title
    known = outcome.tree["modes"].reference_hz.values[0]
    np.testing.assert_allclose(known, [[hertz[0, 0], np.nan], [np.nan, 1.01 * hertz[1, 1]]])
    off = outcome.tree["modes"].difference.values[0]
    np.testing.assert_allclose(off, [[0, np.nan], [np.nan, 1 / 1.01 - 1]], atol=1e-9)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "there is no file"),
        ("mode,frequency_hz\n1,2\n", "has no column nodal_diameter"),
        ("nodal_diameter,mode,frequency_hz\n0,1,-3\n", "line 2: frequency_hz: cannot be read, got '-3'"),
        ("nodal_diameter,mode,frequency_hz\n0,9,3\n", "holds no frequency of the nodal diameters and modes"),
    ],
)
def test_references_that_cannot_be_compared_are_refused(tmp_path: Path, content: str | None, said: str) -> None:
    if content is not None:
        (tmp_path / "ref.csv").write_text(content)
    made = study(tmp_path, {"modes.reference": '"ref.csv"'})
    with pytest.raises(InputError, match=said):
        named("modes").inputs(made.cases()[0], made.model())


CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
WHOLE = 'schema_version = 2\n[part.beam]\nfile = "deck.inp"\nunits = "SI"\nclamped = ["foot"]\n[modes]\nnumber = 3\n'


def write_deck(path: Path) -> Path:
    """Write a cantilever of two cubes of a tenth of a metre as a deck."""
    points = 0.1 * np.vstack([CUBE, CUBE[[1, 3, 5, 7]] + [1, 0, 0]])
    placed = (f"{i + 1}, {', '.join(map(repr, map(float, p)))}" for i, p in enumerate(points))
    lines = ["*NODE, NSET=ALL", *placed]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=E", "1, 1, 2, 4, 3, 5, 6, 8, 7", "2, 2, 9, 10, 4, 6, 11, 12, 8"]
    lines += ["*NSET, NSET=FOOT", "1, 3, 5, 7", "*NSET, NSET=TIP", "9, 10, 11, 12"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850."]
    lines += ["*SOLID SECTION, ELSET=E, MATERIAL=STEEL"]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_whole_structure_from_a_deck(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    made = study(tmp_path, text=WHOLE)
    data = node(made, "modes")
    # Euler-Bernoulli of a cube-sized stub is no reference; its own mass and symmetry are: two equal bending modes
    assert data.attrs["mass_kg"] == pytest.approx(2 * 7850 * 1e-3, rel=1e-12)
    np.testing.assert_allclose(data.attrs["centre_m"], [0.1, 0.05, 0.05], rtol=1e-12)
    box = data.attrs["box_low_m"], data.attrs["box_high_m"]
    np.testing.assert_allclose(box, [[0.0, 0.0, 0.0], [0.2, 0.1, 0.1]], rtol=1e-12)
    assert list(data.attrs["axis_direction"]) == [0.0, 0.0, 1.0]
    assert float(data.frequency_hz[0, 0]) == pytest.approx(float(data.frequency_hz[0, 1]), rel=1e-9)
    assert data["shape"].dims == ("wave", "mode", "skin_point", "xyz", "part")
    assert done(made, "modes").summaries["modes"][0].rows[0][0] == "whole"
    safe = study(tmp_path, {"safe.engine_orders": "[1]", "safe.speed_rpm": "100.0"}, WHOLE)
    with pytest.raises(InputError, match="safe: the model is a whole structure, not a sector"):
        named("safe").inputs(safe.cases()[0], safe.model())


def test_matrices_have_modes_and_no_speed(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    structure = study(tmp_path, text=WHOLE).model().parts["beam"].structure
    save_structure(structure, tmp_path / "beam.npz")
    text = WHOLE.replace("deck.inp", "beam.npz").replace('clamped = ["foot"]\n', "")
    data = node(study(tmp_path, text=text), "modes")
    expected = normal_modes(structure, 3).frequencies_hz
    np.testing.assert_allclose(data.frequency_hz[0], expected, rtol=1e-12)
    assert "shape" not in data
    assert data.attrs["rotation"] == "matrices as read, unchanged by speed"


def test_safe_needs_a_speed(tmp_path: Path) -> None:
    made = study(tmp_path, {"rotation.speed_rpm": "0.0"})
    with pytest.raises(InputError, match=r"safe\.speed_rpm: must be above zero, got 0"):
        named("safe").inputs(made.cases()[0], made.model())


def test_nodal_diameters_are_judged_by_the_number_of_sectors_of_the_deck(tmp_path: Path) -> None:
    write_decks(tmp_path)
    text = 'schema_version = 2\n[rotation]\nspeed_rpm = 8000.0\n[part.blade]\nfile = "speed.inp"\nunits = "SI"\n[modes]\nnodal_diameters = [13]\n'
    made = study(tmp_path, text=text)
    said = r"modes\.nodal_diameters: 13 is above half of 24 sectors\. The nodal diameters go from 0 to 12"
    with pytest.raises(InputError, match=said):
        named("modes").inputs(made.cases()[0], made.model())


def test_decks_of_several_materials_and_single_supports_rotate(tmp_path: Path) -> None:
    """Titanium blades, a bore that is free along the axis: the study's frequencies are those of the library."""
    decks = write_decks(tmp_path)
    text = (
        'schema_version = 2\n[part.blade]\nfile = "speed.inp"\nunits = "SI"\nsectors = 24\nquadrature = "calculix"\n'
        "[rotation]\nspeed_rpm = 8000.0\n[modes]\nnumber = 3\nnodal_diameters = [2]\n"
    )
    data = node(study(tmp_path, text=text), "modes")
    deck = read_deck(decks["at 8000 rpm"])
    solid = our_solid(deck)
    sector = cyclic_sector(solid.structure, 24)
    turning = solid.at_speed(8000 * RPM, tie=sector.tie)
    hertz = normal_modes(travelling_wave(replace(sector, structure=turning), 2), 3).frequencies_hz
    np.testing.assert_allclose(data.frequency_hz.values.ravel(), hertz, rtol=1e-10)
    steel, titanium = (deck.materials[name].density for name in ("STEEL", "TITANIUM"))
    assert titanium < steel
    free = float(solid.structure.mass.sum()) / 3  # without what is clamped
    assert free < data.attrs["mass_kg"] < free * steel / titanium


def test_contacts_are_springs_or_nothing(tmp_path: Path) -> None:
    """Two blades and a damper, as a whole: the damper is held where contacts stick, and left out where they are open."""
    asked = {"modes.number": "4", "modes.shapes": "false"}
    found = {}
    made = read_study(write_two_blades(tmp_path, asked | {"modes.contacts": '"open"'}))
    for how in ("open", "static", "stuck"):
        data = node(made.replace({"modes.contacts": how}), "modes")  # of one mesh
        assert data.attrs["contacts"] == how
        found[how] = data.frequency_hz.values[0]
    model = made.model()
    free = model.at(0.0, 0, "open")
    np.testing.assert_allclose(found["open"], normal_modes(free, 4).frequencies_hz, rtol=1e-9)
    assert "damper" not in free.dofs.part
    full = model.full(0.0)
    gaps = model.pairs.own + model.pairs.following
    springs = np.concatenate([law.stuck_stiffness() for law in model.pairs.laws])
    stuck = normal_modes(with_springs(full, gaps, springs), 4).frequencies_hz
    np.testing.assert_allclose(found["stuck"], stuck, rtol=1e-9)
    # the pull of the damper presses all of its contacts
    np.testing.assert_allclose(found["static"], stuck, rtol=1e-9)
    assert np.all(found["stuck"] > 1.001 * found["open"])


def test_contacts_of_a_wheel_hold_its_neighbours(tmp_path: Path) -> None:
    asked = {"contact.shroud.preload_n": "0.0", "contact.shroud.gap_m": "1e-3"}
    text = write_shrouded_sector(tmp_path / "text", {"modes.nodal_diameters": "[2]"}).read_text()
    both = text + '[vary]\nmodes.contacts = ["open", "static", "stuck"]\n'
    held = _first(done(study(tmp_path / "held", text=both), "modes"))
    loose = _first(done(study(tmp_path / "loose", asked, both), "modes"))
    # with a preload static is stuck, with a clearance it is open
    assert held[1] == held[2] > 1.1 * held[0]
    assert loose[1] == loose[0] == pytest.approx(held[0], rel=1e-12)
    assert loose[2] == pytest.approx(held[2], rel=1e-12)


def test_analyses_that_hold_contacts_differently_say_so(tmp_path: Path) -> None:
    """The state of the contacts stands in every heading; where two analyses differ, in one sentence of verdicts and page."""
    asked = {"modes.nodal_diameters": "[2]", "modes.contacts": '"open"', "safe.modes": "2"}
    path = write_shrouded_sector(tmp_path, asked)
    outcome = run_study(read_study(path), only=["modes", "safe"])
    stuck = "contacts stuck where pressed at rest"
    assert outcome.summaries["modes"][0].title.endswith(", contacts open")
    assert f"rpm, {stuck}: " in outcome.summaries["safe"][0].title
    why = "[modes] has contacts open; [campbell] and [safe] have contacts stuck where pressed at rest: the same mode has another frequency there"
    assert [v.why for v in of_tree(outcome.tree)].count(why) == 1
    text = page_text(report_html(outcome.tree))
    assert "Natural frequencies, contacts open" in text
    assert (
        "[modes] has contacts open; [safe] has contacts stuck where pressed at rest: the same mode has another" in text
    )


def _first(outcome: Outcome) -> Sequence[float]:
    found: list[float] = outcome.tree["modes"].frequency_hz.values[:, 0, 0].tolist()
    return found


def test_cases_of_different_sizes_stand_behind_each_other(tmp_path: Path) -> None:
    write_deck(tmp_path / "deck.inp")
    text = WHOLE + "[vary]\nmodes.number = [3, 5]\n"
    outcome = done(study(tmp_path, text=text), "modes")
    data = outcome.tree["modes"].to_dataset()
    assert data.frequency_hz.shape == (2, 1, 5)
    assert np.isnan(data.frequency_hz[0, 0, 3:]).all()
    few, many = one_case(data, 0), one_case(data, 1)
    assert few["shape"].shape[1] == few.sizes["mode"] == 3
    # asked for two more, the eigenvalue solver rounds differently
    np.testing.assert_allclose(few.frequency_hz, many.frequency_hz[:, :3], rtol=1e-12)
    titles = [table.title for table in outcome.summaries["modes"]]
    assert titles == [f"number {n}: Natural frequencies in Hz at rest" for n in (3, 5)]
    assert [len(table.rows[0]) for table in outcome.summaries["modes"]] == [5, 7]


def test_cases_that_differ_in_harmonic_loads_alone_are_computed_and_shown_once(tmp_path: Path) -> None:
    asked = {"modes.number": "3", "vary.load.shaker.force_n": "[5.0, 8.0]"}
    made = read_study(write_four_masses(tmp_path, asked))
    outcome = run_study(made, only=["modes"])
    assert len(list((made.folder / "jobs").glob("*.job"))) == 1
    assert outcome.tree["modes"].sizes["case"] == 2
    (table,) = outcome.summaries["modes"]
    assert table.title == "Natural frequencies in Hz at rest, contacts stuck where pressed at rest"
    made = made.replace({"vary.part.chain.masses_kg": [[1.0] * 4, [2.0, 1.0, 1.0, 1.0]]})
    titles = [t.title for t in run_study(made, only=["modes"]).summaries["modes"]]
    assert len(list((made.folder / "jobs").glob("*.job"))) == len(titles) == 2


def test_shapes_of_both_directions_are_conjugates() -> None:
    """A ring of six sectors, of two elements each: nodes of the high face move as much as those of the low one and of the middle."""
    half, n = np.pi / 6, 6
    angles = np.array([-half, 0.0, half])
    points = np.array([[r * np.cos(a), r * np.sin(a), z] for r in (0.1, 0.13) for a in angles for z in (0.0, 0.02)])
    at = np.arange(12).reshape(2, 3, 2)
    cells = [
        [*(at[i, j, 0] for i, j in corners), *(at[i, j, 1] for i, j in corners)]
        for corners in (((0, a), (1, a), (1, a + 1), (0, a + 1)) for a in (0, 1))
    ]
    sets = {"root": at[0].ravel(), "cyclic_low": at[1, 0], "cyclic_high": at[1, 2]}
    mesh = SolidMesh(points, np.array(cells), sets)
    material = Material(young_modulus=2.1e11, density=7850.0)
    model = Model(parts={"ring": solid_part(mesh, material, sectors=n, clamped=("root",))})
    asked = Question(model, "open", Wheel(n, parted=True), tuple(range(n)), 4, (0.0,), shapes=True)
    skin = model.skin.points
    own = np.arctan2(skin[:, 1], skin[:, 0]) < half - 1e-6
    for k in (1, 2):
        there, back = (solve_wave(asked, number) for number in (k, n - k))
        np.testing.assert_allclose(there.frequencies_hz, back.frequencies_hz, rtol=1e-9)
        np.testing.assert_allclose(there.shapes, back.shapes.conj(), atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(there.shapes, axis=2).max(axis=1), 1.0)
        for shape in there.shapes:
            mine = shape[own].ravel()
            near = mine[np.abs(mine) > (1 - 1e-4) * np.abs(mine).max()]
            assert near[0] == pytest.approx(abs(near[0]), abs=1e-12)


def growth_by_assembling(asked: Question, number: int) -> np.ndarray:
    """Return the derivatives of the squares by matrices that are assembled at three speeds, as a central difference."""
    x = asked.speeds[0] ** 2
    here, low, high = (asked.at(np.sqrt(f * x), number) for f in (1.0, 0.5, 1.5))
    solve = gyroscopic_modes if asked.turning else normal_modes
    found = solve(here, asked.n_modes)
    phi, omega = found.shapes, 2 * np.pi * found.frequencies_hz

    def form(matrix: Any) -> np.ndarray:
        return np.sum(np.conj(phi) * (matrix @ phi), axis=0)

    # the stiffness has degree two in Ω²: exact but for rounding
    by_x = form((high.stiffness - low.stiffness) / x)
    if not asked.turning:
        return (by_x / form(here.mass)).real
    turning = 1j * (form(here.damping) - form(here.damping.conj().T)) / 2
    by_omega = 2 * omega * form(here.mass) - turning
    return (2 * omega * (by_x + omega * turning / (2 * x)) / by_omega).real


@pytest.mark.parametrize("coriolis", [False, True])
@pytest.mark.parametrize("of", ["unlike faces", "joined shrouds", "damper between two blades"])
def test_growth_is_that_of_matrices_assembled_at_other_speeds(tmp_path: Path, of: str, coriolis: bool) -> None:
    sectors, number = 6, 2
    if of == "unlike faces":
        mesh = unlike_wedge(sectors, (3, 2), (2, 3), clamp=True)
        ring = solid_part(mesh, Material(), clamped=("root",), sectors=sectors, cyclic="segment_to_segment")
        model = Model(parts={"ring": ring}, coriolis=coriolis)
    elif of == "joined shrouds":
        model, sectors = study(tmp_path, {"rotation.coriolis": str(coriolis).lower()}).model(), 8
    else:
        model, sectors, number = read_study(write_two_blades(tmp_path)).model(), 1, 0
        model = replace(model, coriolis=coriolis)
    asked = Question(model, "stuck", Wheel(sectors, parted=coriolis), (number,), 4, (900.0,))
    found = solve_wave(asked, number).growth
    np.testing.assert_allclose(found, growth_by_assembling(asked, number), rtol=1e-9, atol=1e-9)


def test_a_wave_is_assembled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = unlike_wedge(6, (3, 2), (2, 3), clamp=True)
    ring = solid_part(mesh, Material(), clamped=("root",), sectors=6, cyclic="segment_to_segment")
    asked = Question(Model(parts={"ring": ring}), "open", Wheel(6, parted=False), (0, 1, 2), 3, (900.0,))
    assembled = []
    at = Model.at

    def counted(self: Model, *words: Any, **named: Any) -> Any:
        assembled.append(words)
        return at(self, *words, **named)

    monkeypatch.setattr(Model, "at", counted)
    for number in asked.numbers:
        solve_wave(asked, number)
    assert [words[:2] for words in assembled] == [(900.0, 0), (900.0, 1), (900.0, 2)]
