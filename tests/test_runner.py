"""The runner: the same numbers however a run goes, one run a folder, and nothing given up for a study that cannot be run."""

import json
import logging
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import slow_toy
import xarray as xr
from toy_analysis import TOY, ToyStudy

from stickslip.errors import InputError
from stickslip.study.analysis import Solved
from stickslip.study.questions import ANALYSES, Home
from stickslip.study.run import Shard, answer, run_study
from stickslip.study.store.folder import locked_folder
from stickslip.study.store.netcdf import read_tree
from stickslip.study.store.progress import DONE, LOG, Interrupted
from stickslip.study.store.worker_process import Limits
from stickslip.study.store.workers import executor
from stickslip.study.verdict import Verdict, conclusion, of_tree

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def toy_is_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(ANALYSES, "toy", Home("toy_analysis:TOY"))


def study(folder: Path, **changes: object) -> ToyStudy:
    folder.mkdir(parents=True, exist_ok=True)
    return ToyStudy(folder / "study.toml", **changes)  # type: ignore[arg-type]


def result(study: ToyStudy) -> xr.DataTree:
    return read_tree(study.folder / "result.nc")


def sealed(study: ToyStudy) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted((study.folder / "jobs").iterdir())}


def same(a: xr.DataTree, b: xr.DataTree) -> None:
    for name in ("value", "factor", "case_label", "vary_value"):
        np.testing.assert_array_equal(a["toy"][name].values, b["toy"][name].values)


def test_another_study_file_does_not_replace_a_result(tmp_path: Path) -> None:
    first = study(tmp_path)
    first.path.touch()
    run_study(first)
    other = ToyStudy(tmp_path / "resp.toml", factors=(1.25,))
    other.path.touch()
    before = (first.folder / "result.nc").read_bytes(), (first.folder / "run.log").read_bytes()
    with pytest.raises(InputError, match=r"resp\.toml: .* of study\.toml .*--results results_resp") as caught:
        run_study(other)
    assert len(str(caught.value).splitlines()) == 1
    assert other.built == []
    assert before == ((first.folder / "result.nc").read_bytes(), (first.folder / "run.log").read_bytes())
    run_study(other, fresh=True)
    assert result(other).attrs["study_file"] == "resp.toml"
    other.path.rename(tmp_path / "renamed.toml")  # the study file goes on under another name
    assert run_study(ToyStudy(tmp_path / "renamed.toml", factors=(1.25,))).failed == 0


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> ToyStudy:
    made = study(tmp_path_factory.mktemp("whole"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(ANALYSES, "toy", Home("toy_analysis:TOY"))
        run_study(made)
    return made


def test_result_is_a_tree_with_its_origin(whole: ToyStudy) -> None:
    tree = result(whole)
    assert tree.attrs["title"] == "toy"
    assert tree.attrs["study_toml"] == "[toy]"
    assert tree.attrs["complete"] == 1
    (verdict,) = of_tree(tree)
    assert str(verdict) == "DOUBTFUL: factor = 2.5: large."
    assert json.loads(tree.attrs["versions"])["numpy"] == np.__version__
    node = tree["toy"]
    assert list(node.case_label.values) == ["factor = 1.5", "factor = 2.5"]
    assert list(node.vary.values) == ["factor"]
    np.testing.assert_array_equal(node.vary_value, [[1.5], [2.5]])
    assert node.value.dims == ("case", "term", "entry")
    log = (whole.folder / "run.log").read_text()
    assert "DOUBTFUL: factor = 2.5: large." in log
    assert "term 3" not in log  # progress is no line


def test_workers_give_the_same_bits_and_their_lines_come_back(
    tmp_path: Path, whole: ToyStudy, caplog: pytest.LogCaptureFixture
) -> None:
    other = study(tmp_path / "two")
    with caplog.at_level(logging.INFO, "stickslip"):
        run_study(other, workers=2, checks=("twice",))
    same(result(whole), result(other))
    processes = result(other)["toy"].process.values
    assert len(set(processes.ravel())) >= 1
    assert set(processes.ravel()).isdisjoint(result(whole)["toy"].process.values.ravel())
    told = [r for r in caplog.records if r.getMessage() == "term 4"]
    assert sorted(r.job for r in told) == ["toy: factor = 1.5", "toy: factor = 2.5"]
    assert all(r.fraction == 1.0 for r in told)
    assert (other.folder / "run.log").read_text().count("checked twice") == 2


def test_a_job_of_all_cases_is_named_without_a_case_and_answers_are_those_asked_for(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    for factors, label in (((1.5, 1.5), "toy"), ((1.5, 2.5, 1.5), "toy: a, c"), ((1.5,), "toy: a")):
        names = iter("abc")
        alike = study(tmp_path / str(len(factors)), factors=factors)
        cases = [replace(case, label=next(names)) for case in alike.cases()]
        monkeypatch.setattr(ToyStudy, "cases", lambda _, cases=cases: cases)
        with caplog.at_level(logging.INFO, "stickslip"):
            run_study(alike)
        told = [r.job for r in caplog.records if r.getMessage() == DONE]
        assert label in told
        assert f"answers: {len(factors)}" in caplog.text
        monkeypatch.undo()
        monkeypatch.setitem(ANALYSES, "toy", Home("toy_analysis:TOY"))
        caplog.clear()


def test_model_of_python_gets_the_same_answer(tmp_path: Path, whole: ToyStudy) -> None:
    made = answer(TOY, study(tmp_path).cases())
    same(made.tree, result(whole))
    assert made.verdicts == (Verdict("doubtful", "factor = 2.5", None, "large"),)
    assert list(tmp_path.iterdir()) == []


def test_slow_toy_of_the_cluster_gets_the_same_answer(
    tmp_path: Path, whole: ToyStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slow_toy, "SECONDS", 1e-3)
    same(answer(slow_toy.TOY, study(tmp_path).cases()).tree, result(whole))


def test_interrupted_run_goes_on_to_the_same_numbers(tmp_path: Path, whole: ToyStudy) -> None:
    stopped = study(tmp_path, stop_at=3, how="interrupt", stop_in=1)
    with pytest.raises(Interrupted, match="The same command goes on from there"):
        run_study(stopped)
    assert result(stopped).attrs["complete"] == 0
    assert list(result(stopped)["toy"].case_label.values) == ["factor = 1.5"]
    again = study(tmp_path)
    run_study(again)
    assert again.built == [2.5]  # nothing is built for what is sealed
    same(result(again), result(whole))
    assert "goes on after 3 records" in (tmp_path / "results/run.log").read_text()


KILLED = """
import sys
sys.path.insert(0, {here!r})
from collections.abc import Sequence
from pathlib import Path
from stickslip.study.questions import ANALYSES, Home
from stickslip.study.analysis import Solved
from stickslip.study.run import run_study
from toy_analysis import ToyStudy
if __name__ == "__main__":
    ANALYSES["toy"] = Home("toy_analysis:TOY")
    run_study(ToyStudy(Path({path!r}), stop_at=2, how="kill", stop_in=0))
"""


def test_killed_run_goes_on_to_the_same_numbers(tmp_path: Path, whole: ToyStudy) -> None:
    script = tmp_path / "run.py"
    script.write_text(KILLED.format(here=str(HERE), path=str(tmp_path / "study.toml")))
    ended = subprocess.run([sys.executable, str(script)], check=False, capture_output=True, text=True, timeout=120)
    assert ended.returncode == -9
    again = study(tmp_path)
    run_study(again)
    same(result(again), result(whole))


def test_job_that_kills_its_process_is_set_aside_and_taken_up_by_the_next_run(tmp_path: Path, whole: ToyStudy) -> None:
    poisoned = study(tmp_path, stop_at=2, how="kill", stop_in=0)
    outcome = run_study(poisoned, shard=Shard(1, 1))
    assert outcome.failed == 1
    (verdict,) = (v for v in of_tree(result(poisoned)) if v.level == "wrong")
    assert verdict.sentence == (
        "factor = 1.5: the toy job was set aside: its process was ended by signal SIGKILL, as a rule for lack of memory, twice at the same "
        "place. The same command goes on with it: give it more time or memory, or leave the case out."
    )
    assert conclusion(result(poisoned)).startswith("Not to be trusted as it stands: 1 of the jobs")
    assert list(result(poisoned)["toy"].case_label.values) == ["factor = 2.5"]
    again = study(tmp_path)
    run_study(again)
    assert again.built == [1.5]
    same(result(again), result(whole))


def talk(times: int) -> None:
    while times:
        LOG.info("é" * 5000)
        times -= 1


def interrupted_while_they_talk(heard: threading.Event) -> None:
    with executor("", 2) as hands:
        assert hands.cell is not None
        cell, here = hands.cell, (Limits(), hands.over.is_set)

        def speak() -> None:
            with cell() as own:
                own.answer(talk, -1, *here)

        for _ in range(2):
            hands.pool.submit(speak)
        assert heard.wait(60)
        raise KeyboardInterrupt


def test_run_ends_though_its_workers_were_speaking(caplog: pytest.LogCaptureFixture) -> None:
    # a lock that a worker holds when it is ended would never be given back
    heard = threading.Event()
    ear = logging.Handler()
    ear.emit = lambda _record: heard.set()  # type: ignore[method-assign]
    LOG.addHandler(ear)
    with caplog.at_level(logging.INFO, "stickslip"), pytest.raises(KeyboardInterrupt):
        interrupted_while_they_talk(heard)
    LOG.removeHandler(ear)
    assert caplog.records[0].getMessage() == "é" * 5000


def test_finished_run_computes_nothing_again(tmp_path: Path) -> None:
    first = study(tmp_path)
    run_study(first)
    before = sealed(first)
    again = study(tmp_path, stop_at=0, how="kill")
    outcome = run_study(again)
    assert again.built == []
    assert sealed(again) == before
    assert outcome.summaries["toy"][0].title == "Toy"
    assert outcome.files[0] == first.folder / "result.nc"


def test_check_asked_for_later_opens_the_job_again(tmp_path: Path) -> None:
    run_study(study(tmp_path))
    assert "off" not in result(study(tmp_path))["toy"]
    # a record that is computed again would stop the run
    run_study(study(tmp_path, stop_at=0, how="kill"), checks=("twice",))
    np.testing.assert_array_equal(result(study(tmp_path))["toy"].off, [0.0, 0.0])
    last = study(tmp_path)
    run_study(last, checks=("twice",))
    assert last.built == []


def test_changed_study_computes_what_has_changed(tmp_path: Path) -> None:
    run_study(study(tmp_path))
    more = study(tmp_path, factors=(1.5, 2.5, 3.5))
    run_study(more)
    assert more.built == [3.5]
    assert result(more)["toy"].sizes["case"] == 3


def test_equal_cases_share_a_job(tmp_path: Path) -> None:
    twins = study(tmp_path, factors=(1.5, 1.5))
    run_study(twins)
    assert twins.built == [1.5]
    assert result(twins)["toy"].sizes["case"] == 2


@pytest.mark.parametrize("workers", [1, 2])
def test_job_without_a_solution_does_not_take_the_others_with_it(tmp_path: Path, workers: int) -> None:
    outcome = run_study(study(tmp_path, stop_at=2, how="singular", stop_in=0), workers=workers)
    assert outcome.failed == 1
    (verdict,) = (v for v in outcome.verdicts if v.level == "wrong")
    assert verdict.sentence.startswith("factor = 1.5: toy has no solution (no equilibrium). Check")
    value = result(study(tmp_path))["toy"].value.values
    assert np.isfinite(value[1]).all()
    assert np.isfinite(value[0, :2]).all()
    assert np.isnan(value[0, 2:]).all()


ENTERED: list[int] = []  # numbers of cases that were put together or judged


def counted(solved: Sequence[Solved]) -> xr.Dataset:
    ENTERED.append(len(solved))
    return TOY.dataset(solved)


def counted_again(data: xr.Dataset) -> tuple[Verdict, ...]:
    ENTERED.append(data.sizes["case"])
    return TOY.verdicts(data)


@pytest.mark.parametrize("resumed", [False, True])
def test_the_work_of_judging_grows_with_the_number_of_cases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, resumed: bool
) -> None:
    """A case is judged when its job ends, all are put together at the end: three times as many cases are three times the work."""
    entered = ENTERED
    entered.clear()
    monkeypatch.setattr("toy_analysis.COUNTED", replace(TOY, dataset=counted, verdicts=counted_again), raising=False)
    monkeypatch.setitem(ANALYSES, "toy", Home("toy_analysis:COUNTED"))
    # what is not complete is written by the clock: here never
    monkeypatch.setattr("stickslip.study.run._now_and_then", lambda _: lambda _: None)
    work = {}
    for n in (10, 30):
        made = study(tmp_path / str(n), factors=tuple(np.linspace(1.0, 3.0, n)), terms=1)
        run_study(made)
        if resumed:
            entered.clear()
            run_study(made)
        work[n] = sum(entered)
        entered.clear()
    assert work == {10: 40, 30: 120}  # dataset and verdicts, each alone and with all others


def test_a_verdict_of_many_cases_is_told_when_it_is_found_and_where_it_holds_at_the_end(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run_study(study(tmp_path, factors=(1.5, 2.5, 3.5)))
    told = [r.getMessage() for r in caplog.records if getattr(r, "verdict", "") == "DOUBTFUL"]
    assert told == ["factor = 2.5: large.", "factor = 3.5: large."]


def test_second_run_in_the_folder_is_refused_before_it_deletes_anything(tmp_path: Path) -> None:
    made = study(tmp_path)
    run_study(made)
    before = sealed(made)
    with (
        locked_folder(made.folder),
        pytest.raises(InputError, match=r"another run is at work in it\. Wait for it, or stop it"),
    ):
        run_study(made, fresh=True)
    assert sealed(made) == before


def test_fresh_removes_what_runs_write_and_nothing_else(tmp_path: Path) -> None:
    run_study(study(tmp_path))
    own = tmp_path / "results" / "jobs" / "notes.txt"
    own.write_text("mine")
    before = set(sealed(study(tmp_path)))
    again = study(tmp_path, factors=(4.5,))
    run_study(again, fresh=True)
    assert own.read_text() == "mine"
    assert len(sealed(again)) == 2
    assert before & set(sealed(again)) == {"notes.txt"}
    assert len(list((tmp_path / "results/parts").iterdir())) == 1


def test_fresh_gives_nothing_up_for_a_study_that_cannot_be_run(tmp_path: Path) -> None:
    run_study(study(tmp_path))
    before = sealed(study(tmp_path))
    with pytest.raises(InputError) as caught:
        run_study(study(tmp_path, terms=0), fresh=True)
    place = f"{tmp_path}/study.toml (factor = 1.5): toy.terms"
    assert str(caught.value) == f"{place}: must be above zero, got 0. Give more."
    assert sealed(study(tmp_path)) == before
    assert result(study(tmp_path)).attrs["complete"] == 1


def test_refusals_come_before_any_computation(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"must be above zero"):
        run_study(study(tmp_path, terms=0, stop_at=0, how="kill"))
    assert sealed(study(tmp_path)) == {}


@pytest.mark.parametrize("name", ["job", "part"])
def test_damaged_file_is_refused_by_name(tmp_path: Path, name: str) -> None:
    made = study(tmp_path)
    run_study(made)
    path = min((made.folder / "jobs").iterdir())
    if name == "part":
        path = path.rename(path.with_suffix(".part"))
    path.write_bytes(b"no database at all" * 1000)
    with pytest.raises(InputError) as caught:
        run_study(made)
    assert str(caught.value).startswith(f"{path}: the file of a job cannot be used")
    assert "--fresh, which removes what runs wrote into the folder" in str(caught.value)
    run_study(made, fresh=True)


def test_damaged_part_is_made_anew(tmp_path: Path, whole: ToyStudy) -> None:
    run_study(study(tmp_path))
    for folder in ("jobs", "parts"):
        for path in (tmp_path / "results" / folder).iterdir():
            path.write_bytes(b"nonsense") if folder == "parts" else path.unlink()
    run_study(study(tmp_path))
    same(result(study(tmp_path)), result(whole))


def test_what_is_not_asked_for_is_told(tmp_path: Path) -> None:
    made = study(tmp_path)
    with pytest.raises(InputError, match=r"--only toys: is no analysis\. Did you mean 'toy'"):
        run_study(made, only=["toys"])
    with pytest.raises(InputError, match=r"modes: is missing\. Add the table \[modes\]"):
        run_study(made, only=["modes"])
    with pytest.raises(InputError, match=r"asks for nothing\. Add a table of an analysis"):
        run_study(study(tmp_path, asked=()))
    with pytest.raises(InputError, match=r"--workers: must be above zero, got 0"):
        run_study(made, workers=0)
    assert not made.folder.exists()


def test_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("a file")
    with pytest.raises(InputError, match=r"results: is a file, and a run makes a folder"):
        run_study(study(tmp_path))


def test_result_is_read_without_this_package(whole: ToyStudy) -> None:
    reader = (
        "import sys, xarray\n"
        f"tree = xarray.open_datatree({str(whole.folder / 'result.nc')!r}, engine='h5netcdf')\n"
        "assert 'stickslip' not in sys.modules\n"
        "assert tree.attrs['complete'] == 1 and tree['toy'].value.shape == (2, 5, 40)\n"
        "assert all('units' in v.attrs and 'long_name' in v.attrs for v in tree['toy'].data_vars.values())\n"
    )
    ended = subprocess.run([sys.executable, "-c", reader], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
