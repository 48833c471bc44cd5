"""Mistuned wheels from a study: B12 of the literature, measured blades, what is refused, the example, its page."""

import logging
import shutil
from pathlib import Path

import numpy as np
import pytest

from evidence.validation.case_b12_mistuning import DEVIATIONS, MISTUNED, TUNED
from stickslip.analyses.forced_response.records.blades import localisation, whitehead
from stickslip.api.study import Study
from stickslip.assembly.assembling import assemble
from stickslip.errors import InputError
from stickslip.model.structure import Structure, numbered_dofs
from stickslip.reduction.mistuned import mistuned_wheel
from stickslip.study.analysis import named

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

ROOT = Path(__file__).parents[1]
TURN = 2 * np.pi
RING = f"""
schema_version = 2

[part.blade]
shape = "lumped"
sectors = 12
names = ["m"]
masses_kg = [1.0]
springs_n_per_m = [["m", "ground", 1.0]]
dashpots_n_s_per_m = [["m", "ground", 0.004]]

[contact.ring]
between = ["blade.m", "next.blade.m"]
law = "bonded"
tangential_stiffness_n_per_m = 0.02
axial_stiffness_n_per_m = 0.0
normal_stiffness_n_per_m = 0.0

[mistuning.scatter]
of = "blade"
quantity = "stiffness"
deviations = {list(DEVIATIONS)}
modes = "all"

[load.gas]
on = "blade.m"
force_n = 1.0
engine_order = 3

[modes]
number = 1
contacts = "stuck"

[forced_response]
frequencies_hz = [0.1605, 0.1615, {1.01979998 / TURN!r}, {1.02076476 / TURN!r}, 0.1635, 0.1645]
peak_points = 0
stability = "off"

[harmonics]
high = 1

[output]
points = {{ tip = "blade.m" }}
"""


def study_of(folder: Path, text: str) -> Study:
    path = folder / "study.toml"
    path.write_text(text)
    return Study.from_file(path)


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory):
    return study_of(tmp_path_factory.mktemp("b12"), RING).run()


def test_b12_has_its_frequencies_its_largest_blade_and_its_amplification(ring) -> None:
    """Waves, modes of the mistuned ring, peaks and their ratio to the digits of the benchmark."""
    modes, forced = ring["modes"], ring["forced_response"]
    half = digits(TUNED)
    np.testing.assert_allclose(2 * np.pi * modes["frequency_hz"].values[0, :, 0], half, atol=6e-9)
    found = 2 * np.pi * modes["mistuned_hz"].values[0]
    np.testing.assert_allclose(found, digits(MISTUNED), atol=6e-9)
    assert int(forced["largest_blade"][0]) == 2
    assert str(forced.attrs["report_output"]) == "tip[2].x"
    assert float(forced["peak_amplitude"][0]) == pytest.approx(326.0181278, rel=1e-8)
    assert 2 * np.pi * float(forced["peak_frequency_hz"][0]) == pytest.approx(1.02076476, rel=1e-9)
    assert float(forced["tuned_peak_amplitude"][0]) == pytest.approx(245.14564, rel=3e-8)
    # each blade peaks where the largest one does, or beside it; the tuned wheel within its sweep
    assert np.all(np.abs(forced["blade_peak_hz"].values[0] / float(forced["peak_frequency_hz"][0]) - 1.0) < 0.1)
    assert forced["blade_peak_hz"].values[0, 2] == float(forced["peak_frequency_hz"][0])
    assert float(forced["tuned_peak_hz"][0]) in forced["tuned_frequency_hz"].values
    assert float(forced["amplification"][0]) == pytest.approx(1.32989568, rel=1e-8)
    assert float(forced["whitehead"][0]) == pytest.approx(2.232051, abs=1e-6)
    np.testing.assert_array_equal(forced["deviation"].values[0, :, 0], DEVIATIONS)


def digits(texts) -> np.ndarray:
    return np.array([float(text) for text in texts])


def test_shares_of_blades_and_waves_are_shares(ring) -> None:
    modes = ring["modes"]
    for name in ("sector_share", "wave_share"):
        share = modes[name].values[0]
        np.testing.assert_allclose(share.sum(axis=1), 1.0, rtol=1e-12)
        assert share.min() > -1e-12
    forced = ring["forced_response"]
    motion = forced["blade_motion"].values[0] @ np.array([1.0, 1.0j])
    waves = forced["wave_amplitude"].values[0]
    assert 12 * np.sum(waves**2) == pytest.approx(np.sum(np.abs(motion) ** 2), rel=1e-12)
    assert int(np.argmax(waves)) == 3  # what engine order 3 excites


def test_page_and_terminal_speak_of_the_blades(ring, tmp_path: Path) -> None:
    assert {"blades", "blade_peaks", "wheel", "wheel_motion", "wheel_modes"} <= set(ring.plots)
    every = ring.plot("blades")
    assert {"each blade", "largest blade", "all sectors alike"} == {t.name for t in every.data}
    page = ring.report(tmp_path / "page.html").read_text()
    for text in ("Amplification 1.33 over the wheel", "one family of modes", "localisation factor"):
        assert text in page
    printed = "\n".join(
        " ".join((t.title, *(c for row in t.rows for c in row), *t.lines))
        for name in ring
        for t in named(name).summary(ring[name])
    )
    assert "1.3299" in printed
    assert "Modes of the wheel" in printed


def test_measures_of_amplitudes() -> None:
    assert [whitehead(n) for n in (4, 36)] == [1.5, 3.5]
    assert localisation(np.ones(5)) == 0.0
    assert localisation(np.array([0.0, 2.0, 0.0])) == 1.0


def largest(damping: np.ndarray, deviations: np.ndarray) -> float:
    """Return the largest amplitude of any blade of the ring of B12 with a damping of each wave, from a fine sweep."""
    k = np.arange(12)
    stiffness = 1 + 0.04 * (1 - np.cos(2 * np.pi * k / 12))
    dofs = numbered_dofs(1)
    waves = [
        Structure(np.eye(1), np.full((1, 1), c), np.full((1, 1), s), dofs)
        for c, s in zip(damping, stiffness, strict=True)
    ]
    shares = [np.ones((1, 1))] * 12
    wheel = mistuned_wheel(waves, shares, deviations[:, None], numbered_dofs(12))
    of = wheel.structure
    omega = np.linspace(0.99, 1.05, 1201)[:, None, None]
    stiffness = of.stiffness + 1j * omega * of.damping - omega**2 * of.mass
    force = np.exp(2j * np.pi * 3 * k / 12)
    return float(np.abs(np.linalg.solve(stiffness, force[:, None])).max())


def test_a_wheel_exceeds_whiteheads_factor_where_its_excited_wave_is_damped_eight_times_as_much() -> None:
    """The bound supposes one damping of all waves: with it B12 stays far below; a blade that moves alone has that of the other waves."""
    even = np.full(12, 0.004)
    none, some = np.zeros(12), np.array(DEVIATIONS)
    assert largest(even, some) / largest(even, none) == pytest.approx(1.33, abs=0.01)
    damped = np.where(np.isin(np.arange(12), (3, 9)), 8 * 0.004, 0.004)
    assert largest(damped, some) / largest(damped, none) > 1.05 * whitehead(12)


def test_measured_blades_are_taken_from_a_file(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Deviations from the mean of each mode, or from the model's own blade; both means are told."""
    caplog.set_level(logging.INFO, "stickslip")
    hertz = (1.0 + np.linspace(-0.02, 0.02, 12)) * 0.16
    rows = [f"{n},1,{f:.8f}" for n, f in enumerate(hertz)]
    (tmp_path / "blades.csv").write_text("\n".join(["blade,mode,frequency_hz", *rows]))
    given = f'deviations = {list(DEVIATIONS)}\nmodes = "all"'
    text = RING.replace(given, 'file = "blades.csv"').replace('quantity = "stiffness"\n', "")
    model = study_of(tmp_path, text).model()
    found = model.mistuning.blades["scatter"].deviations
    np.testing.assert_allclose(found[:, 0], hertz / hertz.mean() - 1, atol=1e-7)
    told = "measured blades have a mean of 0.16 Hz, the model's blade 0.159155 Hz. Relative to the"
    assert f'{told} mean, so the mean is left out; relative_to = "model" takes it' in caplog.text
    own = text.replace('file = "blades.csv"', 'file = "blades.csv"\nrelative_to = "model"')
    model = study_of(tmp_path, own).model()
    found = model.mistuning.blades["scatter"].deviations
    np.testing.assert_allclose(found[:, 0], 2 * np.pi * hertz - 1, atol=1e-7)
    assert f"{told} model, so the difference of the mean counts" in caplog.text


SOLID = """
schema_version = 2
[material]
young_modulus_pa = 2.1e11
poisson_ratio = 0.3
density_kg_per_m3 = 7850.0
[part.wheel]
shape = "bladed_sector"
sectors = 6
disk_size_m = 0.05
platform_size_m = 0.03
airfoil_size_m = 0.04
[mistuning.b]
of = "wheel"
beyond_radius_m = {beyond}
{how}
[modes]
number = 1
[output]
points = {{ tip = "wheel.tip" }}
"""


@pytest.mark.parametrize("how", ["deviations = [0.01, -0.01]", 'file = "one.csv"\nrelative_to = "model"'])
def test_a_blade_begins_at_the_radius_that_a_study_gives(tmp_path: Path, how: str) -> None:
    """In the model as in what a file is compared with: the shorter the blade, the higher its frequency."""
    rows = [f"{n},1,{460 + n}" for n in range(6)]
    (tmp_path / "one.csv").write_text("\n".join(["blade,mode,frequency_hz", *rows]))
    first = []
    for beyond in (0.19, 0.21):
        blade = study_of(tmp_path, SOLID.format(beyond=beyond, how=how)).model().mistuning.blades["b"]
        assert blade.beyond_radius == beyond
        first.append(blade.deviations.flat[0])
    assert (first[1] < first[0]) == ("file" in how)


SIX = """
schema_version = 2
[part.wheel]
shape = "lumped"
sectors = 6
names = ["disk", "tip"]
masses_kg = [1.0, 0.3]
springs_n_per_m = [["disk", "ground", 2e5], ["disk", "next.disk", 4e5], ["disk", "tip", 1e5]]
[contact.c]
between = ["wheel.tip", "next.wheel.tip"]
law = "elastic_coulomb"
tangential_stiffness_n_per_m = 5e4
axial_stiffness_n_per_m = 5e4
normal_stiffness_n_per_m = 1e5
friction_coefficient = 0.4
preload_n = 2.0
[modes]
number = 1
[output]
points = { tip = "wheel.tip" }
"""
OF = '[mistuning.b]\nof = "wheel.tip"\n'
LIST = OF + "deviations = [0.01, -0.01]\n"
FILE = OF + 'file = "one.csv"\n'
AT = '[mistuning.c]\ncontact = "c"\n'
STIFF = AT + 'quantity = "stiffness"\n'
RANDOM = 'distribution = "normal"\n'
SPREAD, SPREAD_M = "standard_deviation = 0.1\n", "standard_deviation_m = 1e-6\n"
REPAIRED = SIX[SIX.index("[part") : SIX.index("[contact")].replace("wheel", "repaired")
OWN = '[mistuning.o]\npart = "wheel"\nsector = 2\nby = "repaired"\n'
ONE = "blade,mode,frequency_hz\n" + "".join(f"{n},1,{90 + n}\n" for n in range(6))
FILES = {
    "one.csv": ONE,
    "two.csv": ONE + "".join(f"{n},2,{190 + n}\n" for n in range(6)),
    "far.csv": ONE + "0,1000000000000,90",
    "later.csv": "blade,mode,frequency_hz\n" + "".join(f"{n + 1},1,{90 + n}\n" for n in range(6)),
    "late.csv": ONE.replace("0,1,90\n", ""),
    "zeroth.csv": ONE + "0,0,90",
    "half.csv": ONE + "0,1.5,90",
    "twice.csv": ONE + "3,1,90",
    "still.csv": ONE.replace("2,1,92", "2,1,0"),
    "five.csv": ONE.replace("5,1,95", ""),
}
TWO = FILE.replace("one", "two")


@pytest.mark.parametrize("more", [FILE, FILE + 'relative_to = "model"\n', REPAIRED + OWN])
def test_six_blades_that_differ_are_no_mistake(tmp_path: Path, more: str) -> None:
    (tmp_path / "one.csv").write_text(ONE)
    assert study_of(tmp_path, SIX + more).model().mistuning is not None


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (LIST.replace("wheel", "weel"), "mistuning.b.of: there is no part 'weel'"),
        (LIST + 'quantity = "preload"', "mistuning.b.quantity: is preload"),
        (LIST + 'contact = "c"', "needs one of of, contact and part"),
        (LIST.replace("1]", "1, 0.0, 0.0]"), "b.deviations: has 4 values.* no multiple of that"),
        (OF + RANDOM, "mistuning.b.standard_deviation: is missing"),
        (FILE.replace("one", "none"), "mistuning.b.file: there is no file"),
        # files of other blades
        (TWO, "mistuning.b.file: has 2 modes, and the model's blade has 1"),
        (TWO + 'relative_to = "model"', "mistuning.b.file: has 2 modes, .* blade has 1"),
        (FILE.replace("one", "far"), "far.csv: line 8: mode: is above 200.* '1000000000000'"),
        (FILE.replace("one", "zeroth"), "line 8: mode: is no number of a mode.* '0'.*lowest .* 1"),
        (FILE.replace("one", "half"), "line 8: mode: is no number of a mode.* '1.5'"),
        (FILE.replace("one", "twice"), "line 8: mode: stands there twice for blade 3"),
        (FILE.replace("one", "still"), "line 4: frequency_hz: is no frequency"),
        (FILE.replace("one", "five"), "five.csv: has no frequency of blade 5, mode 1"),
        (FILE.replace("one", "later"), "line 7: blade: .* got '6'. Blades count from 0, not from 1"),
        (FILE.replace("one", "late"), "of blade 0, mode 1, 1 missing.* number them 0 to 5"),
        # a spread in the wrong unit
        (STIFF + RANDOM + SPREAD + SPREAD_M, "c.standard_deviation_m: is 1e-06 beside .*stiffness"),
        (STIFF + RANDOM + SPREAD_M, "c.standard_deviation_m: .* Give standard_deviation instead"),
        (OF + RANDOM + SPREAD_M, "b.standard_deviation_m: is 1e-06 beside .*frequency"),
        (AT + 'quantity = "gap"\n' + RANDOM + SPREAD, "c.standard_deviation: is 0.1 beside .*gap"),
        # keys that nothing would come of
        (LIST + "sector = 3", "mistuning.b.sector: is 3 without part"),
        (LIST + 'by = "wheel"', "mistuning.b.by: is 'wheel' without part"),
        (LIST + SPREAD, "mistuning.b.standard_deviation: is 0.1 without distribution"),
        (LIST + "seed = 1", "mistuning.b.seed: is 1 without distribution"),
        (LIST + 'relative_to = "model"', "mistuning.b.relative_to: is 'model' without file"),
        (FILE + "seed = 3", "mistuning.b.seed: is 3 without distribution"),
        (FILE + 'modes = "all"', "mistuning.b.modes: is 'all' beside file"),
        (FILE + 'quantity = "frequency"', "mistuning.b.quantity: is 'frequency' beside file"),
        (STIFF + "deviations = [0.1]\nmodes = 6", "mistuning.c.modes: is 6 without of"),
        (STIFF + "deviations = [0.1]\nbeyond_radius_m = 3.0", "c.beyond_radius_m: .*without of"),
        (REPAIRED + OWN + "seed = 3", "mistuning.o.seed: is 3 without distribution"),
        # parts of their own
        (OWN.replace("repaired", "wheel"), "mistuning.o.by: is 'wheel', the wheel's own part"),
        (REPAIRED + OWN + OWN.replace(".o]", ".p]"), "mistuning.p.sector: is 2, .* mistuning.o"),
        (REPAIRED.replace("= 6", "= 7") + OWN, "mistuning.o.by: is 'repaired' of 7 sectors.* has 6"),
        (
            REPAIRED.replace('"disk", "tip"]', '"tip", "disk"]', 1) + OWN,
            "mistuning.o.by: is 'repaired' with the masses tip, disk, and 'wheel'",
        ),
        (REPAIRED + OWN + LIST.replace("wheel", "repaired"), "b.of: .*in a single sector alone"),
        (
            REPAIRED + OWN + '[load.l]\non = "repaired.tip"\nforce_n = 1.0\nengine_order = 2',
            "load.l.on: .*in a single sector alone. Name it of 'wheel'",
        ),
    ],
)
def test_what_is_no_mistuning_is_refused_by_its_key(tmp_path: Path, more: str, says: str) -> None:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=says):
        assemble(study_of(tmp_path, SIX + more).model(), 0)


def test_a_wheel_is_needed_for_mistuning(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"mistuning.scatter: is given, and the model is no sector"):
        study_of(tmp_path, RING.replace("sectors = 12\n", ""))


def test_a_repeated_pattern_and_a_seed_are_in_the_model(tmp_path: Path) -> None:
    text = RING.replace(f"{list(DEVIATIONS)}", "[0.01, -0.01]")
    found = study_of(tmp_path, text).model().mistuning.blades["scatter"].deviations
    np.testing.assert_array_equal(found, np.tile([0.01, -0.01], 6))


@pytest.mark.validation
def test_the_example_runs_small_and_a_worn_wheel_agrees_with_time_integration(tmp_path: Path) -> None:
    """Eight blades, one frequency near the peak, dampers slipping: `--verify` integrates all of them."""
    text = (ROOT / "examples" / "mistuned_wheel" / "study.toml").read_text()
    head, _, _ = text.partition("[vary]")
    small = head.replace("sectors = 24", "sectors = 8").replace("engine_order = 6", "engine_order = 2")
    small = small.replace("frequency_hz = [195.0, 207.0]\npoints = 30", "frequencies_hz = [199.5]")
    path = tmp_path / "study.toml"
    path.write_text(small)
    result = Study.from_file(path).run(only=("forced_response",), verify=True)
    data = result["forced_response"]
    assert data["dissipated_energy"].values.max() > 0
    assert abs(float(data["verify_difference_percent"][0])) < 0.5
    assert float(data["amplification"][0]) > 1.0
    shutil.rmtree(tmp_path / "results", ignore_errors=True)
