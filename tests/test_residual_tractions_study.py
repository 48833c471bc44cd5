"""[residual_tractions] of a study: four masses with a stop that the last one touches, its page, resuming, Python."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_v2 import EXAMPLES, changed

import stickslip as ss
from stickslip.analyses.page import plots
from stickslip.analyses.residual_tractions.analysis import RESIDUAL_TRACTIONS
from stickslip.analyses.residual_tractions.records import TractionRecord
from stickslip.assembly.model import Model
from stickslip.errors import InputError
from stickslip.study.analysis import Case
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study
from stickslip.study.store.journal import JobJournal
from stickslip.study.store.netcdf import one_case

pytestmark = pytest.mark.usefixtures("peak_alone")

KEYS = {
    "vary.load.shaker.force_n": "[2.0, 3.0, 5.0]",
    "forced_response.frequency_hz": "[11.0, 15.0]",
    "forced_response.points": "5",
    "forced_response.peak_points": "1",
    "forced_response.stability": '"off"',
    "harmonics.high": "3",
}
TABLE = """
[residual_tractions]
frequency_hz = [11.0, 15.0]
points = 4
harmonics = 3
starts = 0
"""


def written(folder: Path, table: str = TABLE) -> Path:
    text = (EXAMPLES / "four_masses" / "study.toml").read_text(encoding="utf-8")
    text = (
        text.replace("gap_m = 1e-3", "gap_m = 1e-4")
        .replace("[output]", table + "\n[output]")
        .replace("[forced_response]", "[harmonics]\n[forced_response]")
    )
    path = folder / "study.toml"
    path.write_text(changed(text, KEYS), encoding="utf-8")
    return path


def test_bounds_of_all_cases_and_the_bands_on_the_page(tmp_path: Path) -> None:
    outcome = run_study(read_study(written(tmp_path)))
    data = outcome.tree["residual_tractions"].to_dataset()
    least, own, most = (data[f"{n}_amplitude"].values for n in ("least", "reference", "most"))
    solved = np.isfinite(own)
    assert np.all((least <= own)[solved] & (own <= most)[solved])
    assert np.all(np.nanmax(most / least, axis=1) > 1.003)  # the band is open somewhere in each case
    # 3 N: the resonance itself; its ends are motions in time, too
    case = one_case(data, 1)
    low, high = case["resonance_amplitude"].values[1:]
    assert 1.001 < high / low < 1.02
    assert np.all(case["confirmed"].values == 1)
    assert case["time_amplitude"].values == pytest.approx([low, high], rel=0.02)
    told = [v for v in outcome.verdicts if "residual tractions" in v.why]
    assert len(told) == 3
    assert "from the model's own start may be off by" in told[1].why
    assert not told[1].warns
    figures = plots(outcome.tree)
    names = [trace.name for trace in figures["response"].data]
    assert names.count("residual tractions") == 3
    filled = next(t for t in figures["response"].data if t.fill)
    assert len(filled.x) > 4  # the resonances are part of the curves
    assert filled.y == pytest.approx(1e6 * most[0][np.isfinite(most[0])] / 2.0, rel=1e-9)  # µm/N
    bands = [t for t in figures["optimisation"].data if t.fill]
    assert bands[0].x == pytest.approx([2.0, 3.0, 5.0])
    assert "residual_tractions" in figures
    assert [t.title for t in outcome.summaries["residual_tractions"]] == ["Resonance over all residual tractions"]


def _sizes(record: TractionRecord) -> list[float]:
    return [bound.amplitude for bound in record.each]


def test_an_interrupted_search_goes_on_and_python_gives_the_same(tmp_path: Path) -> None:
    table = TABLE.replace("points = 4", "points = 3")
    case = read_study(written(tmp_path, table)).cases()[1]
    model = case.build()
    front = ss.Model(**{f: getattr(model, f) for f in ("parts", "contacts", "loads", "outputs", "peak_output")})
    result = front.residual_tractions(frequency_hz=(11.0, 15.0), points=3, harmonics=3, starts=0, in_time=False)
    own = one_case(result.data["residual_tractions"].to_dataset(), 0)
    at = np.searchsorted(own["frequency_hz"].values, np.linspace(11.0, 15.0, 3) - 1e-9)
    question = RESIDUAL_TRACTIONS.inputs(case, model)
    with JobJournal(tmp_path / "a.part", RESIDUAL_TRACTIONS.record) as journal:
        records = list(RESIDUAL_TRACTIONS.solve(question, (), journal))
        assert [r.stage for r in records] == ["point"] * 3 + ["least", "most"]
        later = list(RESIDUAL_TRACTIONS.solve(question, records[:2], journal))
        assert [_sizes(r) for r in later] == [pytest.approx(_sizes(r), rel=1e-6) for r in records[2:]]
        assert list(RESIDUAL_TRACTIONS.solve(question, records, journal)) == []
    found = np.array([r.bounds.most.amplitude for r in records[:3]])
    assert found == pytest.approx(own["most_amplitude"].values[at], rel=1e-9)


BENT = """
schema_version = 2
title = "A mass that stiffens, and a brake"
[part.mass]
shape = "lumped"
masses_kg = [1.0]
springs_n_per_m = [["ground", 1, 1e4]]
dashpots_n_s_per_m = [["ground", 1, 2.0]]
[contact]
stop = { between = ["mass.m1", "ground"], law = "cubic_spring", cubic_tangential_n_per_m3 = 1e8 }
brake = { between = ["mass.m1", "ground"], law = "jenkins", tangential_stiffness_n_per_m = 1e2, slip_limit_n = 1e-6 }
[load.shaker]
on = "mass.m1"
force_n = 2.0
[residual_tractions]
frequency_hz = [17.0, 21.0]
points = 5
harmonics = 1
starts = 0
in_time = false
[output]
points = { tip = "mass.m1" }
peak = "tip.x"
"""


def test_several_motions_from_one_start_are_doubtful(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(BENT, encoding="utf-8")
    outcome = run_study(read_study(path))
    data = outcome.tree["residual_tractions"].to_dataset()
    several = data["branches"].values[0] == 3
    assert several.any()
    assert not several.all()
    wide = data["most_amplitude"].values[0] > 1.5 * data["least_amplitude"].values[0]
    assert np.array_equal(wide, several)
    (told,) = [v for v in outcome.verdicts if "has several motions, up to 3" in v.why]
    assert told.level == "doubtful"
    assert "[all_motions]" in told.remedy


def test_what_would_take_too_long_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, TABLE + "[limits]\nwork_s = 0.1\n")
    case = read_study(path).cases()[0]
    with pytest.raises(InputError, match=r"a case of residual_tractions \(4 frequencies"):
        RESIDUAL_TRACTIONS.inputs(case, case.build())
    told = RESIDUAL_TRACTIONS.check(*_fine(tmp_path / "fine"))
    assert told[0].startswith("residual_tractions: 2 tangential springs")


def test_a_load_of_zero_is_refused_by_its_field(tmp_path: Path) -> None:
    case, model = _fine(tmp_path / "fine")
    still = replace(model, loads={n: replace(load, newton=0.0) for n, load in model.loads.items()})
    with pytest.raises(InputError, match=r"load\.\w+\.force_n"):
        RESIDUAL_TRACTIONS.check(case, still)


def _fine(folder: Path) -> tuple[Case, Model]:
    folder.mkdir()
    case = read_study(written(folder)).cases()[0]
    return case, case.build()


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("harmonics = 3", "harmonics = 0", r"residual_tractions\.harmonics"),
        ("[11.0, 15.0]", "[15.0, 11.0]", "lower before the higher"),
        ("starts = 0", "start = 0", "start"),
    ],
)
def test_bad_keys_are_refused(tmp_path: Path, old: str, new: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        read_study(written(tmp_path, TABLE.replace(old, new)))
