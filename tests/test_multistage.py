"""Wheels of different numbers of sectors, coupled by spatial harmonics, against all sectors of both tied node by node."""

import logging
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse
from cyclic_models import wedge

import stickslip as ss
from stickslip.analyses.waves.modes import each_diameter, flange_doubts, unreached
from stickslip.analyses.waves.records import WaveModes
from stickslip.model.axis import Axis
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import normal_modes
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.structure import Structure, join
from stickslip.reduction.coupled_stages import Flange, circles, constraints, multistage, multistage_modes
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.full_wheel import wheel
from stickslip.reduction.waves import wave
from stickslip.study.store.netcdf import one_case

pytestmark = pytest.mark.usefixtures("parts_once")

EXAMPLE = Path(__file__).parents[1] / "examples" / "two_stages"
PLANE = 0.1  # m, of the flange
AROUND = 24  # nodes on a circle


def stage(sectors, inner, outer, base, clamp):
    """One sector of a ring with 24 nodes around, two circles of the flange at its top or bottom."""
    mesh = wedge(sectors, cells=(1, AROUND // sectors // 2, 1), inner=inner, outer=outer, clamp=clamp)
    points = mesh.points + np.array([0.0, 0.0, base])
    radius = np.hypot(points[:, 0], points[:, 1])
    on = (np.abs(points[:, 2] - PLANE) < 1e-9) & (radius > 0.74) & (radius < 1.01)
    sets = dict(mesh.node_sets) | {"flange": np.flatnonzero(on)}
    mesh = SolidMesh(points, mesh.cells, sets)
    return cyclic_sector(assemble_solid(mesh, Material(), clamped=("root",) if clamp else ()), sectors)


@pytest.fixture(scope="module")
def stages():
    return {"first": stage(4, 0.5, 1.0, 0.0, True), "second": stage(3, 0.75, 1.25, PLANE, False)}


@pytest.fixture(scope="module")
def tied(stages):
    """Frequencies and strain-free check of the whole: every node of the second flange follows its partner on the first."""
    both = join(**{name: wheel(sector) for name, sector in stages.items()})
    at, part = both.dofs.position, np.array([p.split(".")[0] for p in both.dofs.part])
    radius = np.hypot(at[:, 0], at[:, 1])
    on = (np.abs(at[:, 2] - PLANE) < 1e-9) & (radius > 0.74) & (radius < 1.01)

    def named(name):
        own = np.flatnonzero(on & (part == name))
        return {(both.dofs.component[d], *(np.round(at[d], 6) + 0.0)): d for d in own}

    leads, follows = named("first"), named("second")
    assert set(leads) == set(follows)
    assert len(leads) == 2 * 3 * AROUND
    stays = np.setdiff1d(np.arange(both.n), list(follows.values()))
    column = np.full(both.n, -1)
    column[stays] = np.arange(stays.size)
    for key, dof in follows.items():
        column[dof] = column[leads[key]]
    tie = scipy.sparse.csr_array((np.ones(both.n), (np.arange(both.n), column)))
    whole = [scipy.sparse.csr_array(tie.T @ a @ tie) for a in (both.mass, both.damping, both.stiffness)]
    return normal_modes(Structure(*whole, both.dofs.take(stays)), 8).frequencies_hz


def flange(stages, harmonics):
    return Flange(("first", "second"), tuple(s.structure.dof_set("flange") for s in stages.values()), tuple(harmonics))


def test_a_nodal_diameter_that_is_done_is_told_with_its_lowest_and_highest_frequency(stages, caplog):
    caplog.set_level(logging.INFO, logger="stickslip")
    assembly = multistage(stages, [flange(stages, (0, 1))])
    notes = SimpleNamespace(get=lambda _: "known")
    asked = SimpleNamespace(assembly=assembly, numbers=(0, 1), n_modes=3)
    done = list(each_diameter(asked, [], notes))
    again = list(each_diameter(asked, done[:1], notes))
    assert [one.wave_number for one in done + again] == [0, 1, 1]
    told = [
        f"nodal diameter {w.wave_number}: {w.frequencies_hz[0]:.6g} to {w.frequencies_hz[2]:.6g} Hz in" for w in done
    ]
    records = [(r.fraction, r.getMessage().rpartition(" ")[0].rpartition(" ")[0]) for r in caplog.records]
    assert records == [(0.5, told[0]), (1.0, told[1]), (1.0, told[1])]
    assert done[0].frequencies_hz[0] < 0.9 * done[0].frequencies_hz[2]


@pytest.mark.validation
def test_all_harmonics_are_the_node_by_node_tie_and_fewer_are_softer(stages, tied):
    errors = []
    for most in (4, 9, AROUND // 2):
        assembly = multistage(stages, [flange(stages, range(most + 1))])
        assert assembly.nodal_diameters == (0,)  # 4 and 3 sectors: aliases tie everything
        found = multistage_modes(assembly, 0, 8)
        errors.append(found.frequencies_hz / tied - 1)
        np.testing.assert_allclose(found.shares.sum(axis=0), 1.0)
    assert np.all(errors[0] < 1e-9)
    assert np.all(errors[1] < 1e-9)
    assert np.all(errors[1] >= errors[0] - 1e-9)
    assert 1e-4 < np.abs(errors[1]).max() < np.abs(errors[0]).max() < 0.3
    np.testing.assert_allclose(errors[2], 0.0, atol=1e-9)


def test_few_harmonics_leave_diameters_apart_and_shapes_meet_on_the_flange(stages):
    fine = {"first": stages["first"], "second": stage(6, 0.75, 1.25, PLANE, False)}
    assembly = multistage(fine, [flange(fine, (0, 1))])
    assert assembly.nodal_diameters == (0, 1)
    assert assembly.waves(1) == (("first", 1), ("second", 1))
    assert assembly.unreached == (("first", 2), ("second", 2), ("second", 3))
    (told,) = unreached(assembly)
    assert "first 2, second 2 and 3" in told.why
    assert "harmonics 2, 3" in told.remedy
    every = multistage(fine, [flange(fine, (0, 1, 4, 9))])  # 4 and 9: wave 0, wave 4 (−2); wave 1, wave 3
    assert every.unreached == (("first", 2),)
    assert unreached(multistage(fine, [flange(fine, range(4))])) == []
    found = multistage_modes(assembly, 1, 3)
    waves = assembly.waves(1)
    moved = np.concatenate(
        [np.linalg.lstsq(fine[name].wave_tie(k).toarray(), found.shapes[name, k], rcond=None)[0] for name, k in waves]
    )
    assert np.abs(constraints(assembly, waves) @ moved).max() < 1e-9 * np.abs(moved).max()
    # unit mass of all sectors; the neighbour is a phase ahead
    energy = 0.0
    for (name, k), shape in found.shapes.items():
        mass = fine[name].structure.mass
        energy += fine[name].sectors * np.sum((shape.conj() * (mass @ shape)).real, axis=0)
        ahead = found.on_sector(name, 1)
        np.testing.assert_allclose(ahead, wave(k, fine[name].sectors).phase * shape)
    np.testing.assert_allclose(energy, 1.0)
    # harmonics left out make it no stiffer than with them held
    assert np.all(found.stiffest_hz >= found.frequencies_hz)
    more = multistage(fine, [flange(fine, range(13))])
    lowest = multistage_modes(more, 0, 12)
    assert lowest.nodal_diameter == 0
    assert found.frequencies_hz[0] <= np.min(lowest.frequencies_hz[lowest.frequencies_hz > 1.0]) * (1 + 1e-9)
    # what stands alone lies below: the flange only holds
    alone = [normal_modes(travelling_wave(fine[name], 1), 3).frequencies_hz for name in fine]
    lowest = np.sort(np.concatenate(alone))[:3]
    assert np.all(found.frequencies_hz > lowest)


def test_what_does_not_fit_is_said(stages):
    with pytest.raises(ss.InputError, match=r"13 is above half of the 24 nodes .* 'first'"):
        multistage(stages, [flange(stages, (0, 13))])
    other = flange(stages, (0, 1))
    at = stages["second"].structure.dofs.position[other.dofs[1]]
    short = other.dofs[1][np.hypot(at[:, 0], at[:, 1]) < 0.8]
    with pytest.raises(ss.InputError, match=r"flange of 'first' has nodes at the radius .* 'second' has none there"):
        multistage(stages, [replace(other, dofs=(other.dofs[0], short))])
    tilted = replace(stages["second"], axis=Axis((0.0, 0.1, 1.0)))
    with pytest.raises(ss.InputError, match="turn about different axes"):
        multistage(stages | {"second": tilted}, [other])
    with pytest.raises(ss.InputError, match="no stage 'third'"):
        multistage(stages, [replace(other, stages=("first", "third"))])
    with pytest.raises(ss.InputError, match="5 is no kept harmonic of a flange, these are 0, 1"):
        multistage(stages, [other]).waves(5)


def test_few_harmonics_are_doubted_where_holding_the_others_changes_much():
    def found(stiffest):
        hz = np.array([100.0])
        return WaveModes(wave_number=3, seconds=0.1, frequencies_hz=hz, growth=np.zeros(1), stiffest_hz=stiffest)

    (said,) = flange_doubts([found(np.array([100.5])), found(np.array([104.0]))])
    assert "nodal diameters 3 (up to 4 %)" in said.why
    assert flange_doubts([found(np.array([100.5]))]) == []
    assert flange_doubts([found(None)]) == []


def test_a_study_of_two_stages_has_their_modes_and_shares(tmp_path):
    """Against the library's own assembly; every other question is refused."""
    shutil.copytree(EXAMPLE, tmp_path / "study")
    file = tmp_path / "study" / "study.toml"
    whole = file.read_text()
    file.write_text(whole.replace("number = 4", "nodal_diameters = [2]\nnumber = 4"))
    study = ss.Study.from_file(file)
    model = study.model()
    assert model.stages.nodal_diameters == (0, 1, 2, 3, 4, 5, 6)
    result = study.run()
    data = one_case(result.data["modes"].to_dataset(), 0)
    expected = multistage_modes(model.stages, 2, 4)
    np.testing.assert_allclose(data["frequency_hz"].values[0], expected.frequencies_hz, rtol=1e-9)
    np.testing.assert_allclose(data["stage_share"].values[0].T, expected.shares, atol=1e-6)
    np.testing.assert_allclose(data["stiffest_hz"].values[0], expected.stiffest_hz, rtol=1e-9)
    assert list(data["stage_name"].values) == ["front", "rear"]
    assert data["stage_sectors"].values.tolist() == [24, 18]
    mass, moment = 0.0, 0.0  # of all sectors, about the origin, along the axis
    for name, sectors in (("front", 24), ("rear", 18)):
        deck, unit = read_deck(tmp_path / "study" / f"{name}.inp"), model.axis.unit
        sector = assemble_solid(deck.mesh, *deck.materials.values(), clamped=())
        moved = unit[["xyz".index(c) for c in sector.dofs.component]]
        pushed = sectors * (sector.mass @ moved)
        mass, moment = mass + moved @ pushed, moment + (moved * (sector.dofs.position @ unit)) @ pushed
    assert data.attrs["mass_kg"] == pytest.approx(mass, rel=1e-9)
    np.testing.assert_allclose(data.attrs["centre_m"], moment / mass * model.axis.unit, atol=1e-9)
    assert data["nodal_diameter"].values.tolist() == [2]
    assert result.conclusion == "Every answer is trusted."
    result.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    for words in ("Which stage vibrates", "front of 24 sectors, rear of 18 sectors"):
        assert words in page
    few = whole.replace("[0, 1, 2, 3, 4, 5, 6]", "[0, 1]")
    wrong = {
        "[campbell]\nspeeds_rpm = [0.0, 100.0]\nengine_orders = [1]\n": "campbell: is no question for stages",
        "[forced_response]\nfrequency_hz = [10.0, 20.0]\n": r"(?<!\n)study.toml: forced_response: is no question for stages",
        "[rotation]\nspeed_rpm = 10.0\n": "rotation.speed_rpm: gives stages a prestress",
        '[mistuning.b]\nof = "front"\ndeviations = [0.01]\n': "mistuning: is of one wheel",
    }
    for more, message in wrong.items():
        file.write_text(few + more)
        with pytest.raises(ss.InputError, match=message):
            ss.Study.from_file(file).check()
    file.write_text(few.replace("number = 4", "number = 4\nnodal_diameters = [3]"))
    with pytest.raises(ss.InputError, match="3 is no harmonic that a flange couples, these are 0, 1"):
        ss.Study.from_file(file).check()
    file.write_text(few.replace("harmonics = [0, 1]", ""))
    with pytest.raises(ss.InputError, match="harmonics"):
        ss.Study.from_file(file)
    with pytest.raises(ss.InputError, match="of wheels coupled so only the modes are known"):
        model.at(0.0)
    with pytest.raises(ss.InputError, match="Give whole numbers from 0 on"):
        ss.Join(between=("a.x", "b.x"), harmonics=(1,))


def test_digits_of_a_deck_split_no_circle_wherever_the_flange_lies(stages):
    sector = stages["first"]
    dofs, members = sector.structure.dofs, sector.structure.dof_set("flange")
    noise = 2e-6 * np.random.default_rng(0).uniform(-1.0, 1.0, dofs.position.shape)  # m: six digits
    for shift in np.linspace(0.0, 2e-4, 101):  # twice what nodes of one circle may differ by
        moved = replace(dofs, position=dofs.position + noise + np.array([0.0, 0.0, shift]))
        found = circles(replace(sector, structure=replace(sector.structure, dofs=moved)), members, "first")
        np.testing.assert_allclose(sorted(found.place[:, 0]), [0.75, 1.0], atol=4e-6)
        assert found.owner.size == 2 * AROUND // sector.sectors
