"""Jobs that run apart: limits, deaths, shards, files that several processes write, and what cannot be asked for."""

import mmap
import os
import pickle
import re
import shutil
import signal
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from cell_work import die, eat, refuse
from test_journal import Point, point
from toy_analysis import ToyStudy

from stickslip.errors import InputError, StickslipError
from stickslip.study import jobs, run
from stickslip.study.questions import ANALYSES, Home
from stickslip.study.run import Shard, run_study
from stickslip.study.store import folder as keep_folder
from stickslip.study.store.folder import locked_folder
from stickslip.study.store.journal import JobJournal, begin, clear, file_at_work, left_behind, read_sealed
from stickslip.study.store.netcdf import read_tree
from stickslip.study.store.watch import solve_far, watched
from stickslip.study.store.worker_process import Cell, Ended, Limits, OutOfTime, Stopped, memory_gb
from stickslip.study.store.workers import check_kind, executor


@pytest.fixture(autouse=True)
def toy_is_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(ANALYSES, "toy", Home("toy_analysis:TOY"))


# ---- a process that is watched


def never() -> bool:
    return False


def test_the_memory_of_a_process_is_what_it_holds_and_not_what_it_might() -> None:
    def held_gb() -> float:
        said = Path("/proc/self/status").read_text(encoding="utf-8")
        return 1024.0 * float(re.search(r"VmRSS:\s+(\d+)", said)[1]) / 1e9  # type: ignore[index]

    before = memory_gb(os.getpid())
    assert before == pytest.approx(held_gb(), rel=0.05)
    untouched = mmap.mmap(-1, 1 << 30)
    assert memory_gb(os.getpid()) < before + 0.2
    untouched.close()
    assert memory_gb(2**22) == 0.0  # no process has this number


def test_process_is_watched_and_started_again() -> None:
    cell = Cell({})
    try:
        assert cell.answer(abs, -3, Limits(), never) == 3
        with pytest.raises(ValueError, match="no such thing"):
            cell.answer(refuse, "no such thing", Limits(), never)
        with pytest.raises(OutOfTime, match=r"took more than 0\.2 s, the limit of a job"):
            cell.answer(time.sleep, 60.0, Limits(seconds=0.2), never)
        with pytest.raises(Ended, match="was ended by signal SIGSEGV"):
            cell.answer(die, signal.SIGSEGV, Limits(), never)
        with pytest.raises(Ended, match=r"GB of memory, the limit of a job is 0\.2 GB"):
            cell.answer(eat, 0.3, Limits(memory_gb=0.2), never)
        with pytest.raises(Stopped):
            cell.answer(time.sleep, 60.0, Limits(), lambda: True)
        assert cell.answer(abs, -4, Limits(), never) == 4
    finally:
        cell.close()


# ---- what becomes of a job


def order(folder: Path, index: int = 0) -> jobs.Order:
    (folder / "results/jobs").mkdir(parents=True, exist_ok=True)
    case = ToyStudy(folder / "study.toml").cases()[index]
    toy = run.named("toy")
    job = jobs.Job(case.label, toy.inputs(case, case.build()))
    return jobs.Order(toy, job, folder / f"results/jobs/{index}.job")


class Dying(Cell):
    """A process that computes so many records in each life, one more life for each."""

    def __init__(self, *lives: int | Exception) -> None:
        super().__init__({})
        self.lives = list(lives)

    def answer(self, work, given, limits, stopped, hear=None):
        life = self.lives.pop(0)
        if isinstance(life, Exception):
            raise life
        _, made = pickle.loads(given.content)
        begin(given.sealed, given.file, made.analysis.record)
        with JobJournal(given.file, made.analysis.record) as journal:
            new = made.analysis.solve(made.job.inputs, journal.records(), journal)
            for _, record in zip(range(life), new, strict=False):
                journal.add(record)
        raise Ended("was ended by signal SIGKILL")


def test_job_is_set_aside_that_dies_twice_at_the_same_place(tmp_path: Path) -> None:
    said: list[str] = []
    cell = Dying(1, 2, 0)  # the second life went on
    made = order(tmp_path)
    watched(made.packed(), cell, never, lambda record: said.append(record.getMessage()))
    records, notes = read_sealed(made.sealed, made.analysis.record)
    assert len(records) == 3
    assert not cell.lives
    assert len(said) == 2
    why = "the toy job was set aside: its process was ended by signal SIGKILL, twice at the same place"
    assert notes["set aside"]["text"] == why
    # the next run takes it up
    jobs.solve(made, made.file)
    records, notes = read_sealed(made.sealed, made.analysis.record)
    assert len(records) == 5
    assert "set aside" not in notes


def test_deaths_are_counted_over_workers_that_are_lost(tmp_path: Path) -> None:
    made = order(tmp_path)
    with pytest.raises(Stopped):  # the first worker is lost after one death
        watched(made.packed("first"), Dying(3, Stopped()), never, print)
    assert len(left_behind(made.sealed)) == 1
    with JobJournal(file_at_work(made.sealed, "elder"), made.analysis.record) as journal:
        done = made.analysis.solve(made.job.inputs, [], journal)
        for _, record in zip(range(3), done, strict=False):
            journal.add(record)  # as far, but nothing has died
    watched(made.packed("second"), Dying(0), never, print)
    notes = read_sealed(made.sealed, made.analysis.record)[1]
    assert "twice at the same place" in notes["set aside"]["text"]


@pytest.mark.parametrize("ends", [True, False])
def test_an_attempt_whose_job_another_process_has_sealed_ends_in_peace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, ends: bool
) -> None:
    made = order(tmp_path)
    seal, others = JobJournal.seal, []

    def overtaken(journal: JobJournal) -> None:
        if not others:  # the other process is faster, and removes what is left of the job
            others.append("at work")
            watched(made.packed("other"), Dying(5, 0) if ends else Dying(3, 0), never, print)
        seal(journal)

    monkeypatch.setattr(JobJournal, "seal", overtaken)
    if ends:
        jobs.solve(made, made.file)
    else:
        watched(made.packed(), Dying(3, 0), never, print)
    records, notes = read_sealed(made.sealed, made.analysis.record)
    assert others
    assert len(records) == 5
    assert "twice at the same place" in notes["set aside"]["text"]
    assert [p.name for p in made.sealed.parent.iterdir()] == [made.sealed.name]
    # what is wrong with the file of a job that nobody has sealed is said
    made.sealed.unlink()
    monkeypatch.setattr(JobJournal, "seal", lambda journal: (made.file.unlink(), seal(journal)))
    with pytest.raises(InputError, match="cannot be written"):
        jobs.solve(made, made.file)


def test_job_that_takes_too_long_is_set_aside_at_once(tmp_path: Path) -> None:
    made = order(tmp_path)
    watched(made.packed(), Dying(OutOfTime("it took more than 5 s")), never, print)
    assert "took more than 5 s" in read_sealed(made.sealed, made.analysis.record)[1]["set aside"]["text"]


def test_losses_are_counted_anew_where_a_job_has_gone_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice at the same place is too often; a worker that was lost further on is the first one there."""
    monkeypatch.setattr(jobs, "reached", lambda left: (left,))
    loss, begun, early = jobs.Loss(), [], []
    for left in ([1], [1, 1], [1, 1, 2], [1, 1, 2], [1, 1, 2, 2]):
        loss.count(left)  # type: ignore[arg-type]
        begun.append(loss.begun)
        early.append(loss.early)
    assert begun == [1, 2, 1, 1, 2]
    assert early == [0, 0, 0, 1, 1]


# ---- files of several processes


def test_every_attempt_goes_on_from_the_furthest_and_damages_no_other(tmp_path: Path) -> None:
    sealed = tmp_path / "a.job"
    for owner, count in (("one", 2), ("two", 3)):
        with JobJournal(file_at_work(sealed, owner), Point) as journal:
            for i in range(count):
                journal.add(point(i))
    file_at_work(sealed, "three").write_bytes(b"no database" * 10_000)  # the largest
    own = file_at_work(sealed, "own")
    with JobJournal(file_at_work(sealed, "two"), Point) as other:
        begin(sealed, own, Point)  # while another is at work
        other.add(point(3))
    with JobJournal(own, Point) as journal:
        assert [p.index for p in journal.records()] == [0, 1, 2]
        journal.seal()
    assert {p.name for p in left_behind(sealed)} == {f"a.{o}.part" for o in ("one", "two", "three")}
    sealed.with_name("a.four.part-journal").touch()  # whose file another process has removed
    clear(sealed)
    assert [p.name for p in tmp_path.iterdir()] == ["a.job"]
    assert len(read_sealed(sealed, Point)[0]) == 3


def test_copy_of_a_file_whose_write_was_cut_off_is_whole(tmp_path: Path) -> None:
    sealed, cut = tmp_path / "a.job", tmp_path / "copied"
    with JobJournal(file_at_work(sealed, "one"), Point) as journal:
        journal.add(point(0))
        journal._db.execute("pragma cache_spill = 1")
        journal._db.execute("pragma cache_size = 1")
        journal._db.execute("begin")
        for i in range(1, 400):
            journal.add(point(i))
        cut.mkdir()
        for path in tmp_path.glob("a.*"):
            shutil.copy(path, cut)
        journal._db.execute("rollback")
    assert len(list(cut.iterdir())) == 2  # the file, half written, and what undoes it
    begin(cut / "a.job", cut / "a.own.part", Point)
    with JobJournal(cut / "a.own.part", Point) as journal:
        assert [p.index for p in journal.records()] == [0]


# ---- shards


def bits(study: ToyStudy) -> np.ndarray:
    tree = read_tree(study.folder / "result.nc")
    assert tree.attrs["complete"] == 1
    return np.asarray(tree["toy"].value.values)


def test_last_shard_puts_the_result_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "executor", lambda kind, workers, apart=False: executor(kind, workers))
    factors = (1.5, 2.5, 3.5, 4.5, 5.5)
    whole = ToyStudy(tmp_path / "whole.toml", factors)
    run_study(whole)
    expected = bits(whole)
    (tmp_path / "shards").mkdir()
    made = partial(ToyStudy, tmp_path / "shards/study.toml", factors)
    told = [run_study(made(), shard=Shard(n, 3)) for n in (3, 1, 1)]
    assert told[0].waits.startswith("shard 3/3: 1 jobs done, 4 of other shards are not.")
    assert told[2].waits.startswith("shard 1/3: 0 jobs done, 2 of other shards are not.")
    assert not (made().folder / "result.nc").exists()
    last = made()
    outcome = run_study(last, shard=Shard(2, 3))
    assert not outcome.waits
    assert len(last.built) == 2
    np.testing.assert_array_equal(bits(last), expected)
    assert outcome.files == (last.folder / "result.nc", last.folder / "run-2-of-3.log")


def test_shards_share_a_folder_that_no_other_run_may_use(tmp_path: Path) -> None:
    made = ToyStudy(tmp_path / "study.toml")
    with (
        locked_folder(made.folder, shared=True),
        locked_folder(made.folder, shared=True),
        pytest.raises(InputError, match="another run is at work in it"),
    ):
        run_study(made)
    with locked_folder(made.folder), pytest.raises(InputError, match="another run is at work"):
        run_study(made, shard=Shard(1, 2))


def test_a_file_that_another_shard_puts_in_place_meanwhile_is_no_stranger(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def listed(folder: Path, pattern: str) -> Iterator[Path]:
        for path in found(folder, pattern):
            if "part" in path.stem:
                path.rename(path.with_name("whole.npz"))
            yield path

    found = keep_folder._found
    made = ToyStudy(tmp_path / "study.toml")
    (made.folder / "parts").mkdir(parents=True)
    (made.folder / "parts/whole.0123456789ab.part.npz").touch()
    monkeypatch.setattr(keep_folder, "_found", listed)
    with locked_folder(made.folder, shared=True):
        assert (made.folder / "parts/whole.npz").is_file()


# ---- what cannot be


@pytest.mark.parametrize("text", ["5/4", "0/3", "1", "a/b", "-1/2", "1/2/3", ""])
def test_share_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"is no share of the jobs\. Give its number"):
        Shard.read(text)


def test_executor_that_is_none_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = ToyStudy(tmp_path / "study.toml")
    with pytest.raises(InputError, match=r"--executor foo: is not known\. Known: dask, executorl"):
        run_study(study, kind="foo")
    with pytest.raises(InputError, match=r"is not known\. Did you mean 'slurm'"):
        run_study(study, kind="slrum")
    with pytest.raises(InputError, match="does not say where the scheduler is"):
        check_kind("dask")
    monkeypatch.setattr("stickslip.study.store.workers.find_spec", lambda _name: None)
    with pytest.raises(StickslipError, match=r"distributed is not installed\. Use pip install 'stickslip\[cluster\]'"):
        run_study(study, kind="dask=tcp://127.0.0.1:1")
    with pytest.raises(StickslipError, match="executorlib is not installed"):
        run_study(study, kind="slurm")
    with pytest.raises(InputError, match="would remove what other shards have found"):
        run_study(study, shard=Shard(1, 2), fresh=True)
    assert not study.folder.exists()


def test_machine_that_would_give_other_numbers_is_refused(tmp_path: Path) -> None:
    made, token = order(tmp_path), tmp_path / "run.on"
    answer = solve_far(made.packed(), token, {}, {})
    assert f"does not see {tmp_path}. Put the study into a folder that all machines share" in str(answer.error)
    token.touch()
    answer = solve_far(made.packed(), token, {"numpy": "0.9"}, {})
    assert f"has other versions, whose numbers may differ: numpy {np.__version__} for 0.9" in str(answer.error)


class Losing:
    """An executor whose workers are lost with every job, after they have begun it or before."""

    def __init__(self, *, begun: bool) -> None:
        self.begun, self.given = begun, 0

    def submit(self, fn, parcel, *others):
        self.given += 1
        future = jobs.Future()
        future.set_exception(OSError("the machine is gone"))
        if self.begun:
            with JobJournal(file_at_work(parcel.sealed, str(self.given))):
                pass
        return future


@pytest.mark.parametrize(("begun", "given"), [(True, 3), (False, 30)])
def test_job_whose_workers_are_lost_stops_no_other(tmp_path: Path, *, begun: bool, given: int) -> None:
    made = order(tmp_path), order(tmp_path, 1)
    losing = Losing(begun=begun)
    with executor(losing, 1) as hands:  # type: ignore[arg-type]
        ended = list(jobs.worked(made, hands, tmp_path))
    assert sorted(ended) == [own.sealed for own in made]
    assert losing.given == 2 * given
    for own in made:
        why = read_sealed(own.sealed, own.analysis.record)[1]["set aside"]["text"]
        assert why == (
            f"the toy job was set aside: {given} workers were lost with it at the same place (OSError: the machine is gone)"
        )


def test_one_process_and_none_of_its_own_by_default() -> None:
    with executor("", 1) as hands:
        assert hands.cell is None
    with executor("", 1, apart=True) as hands:
        assert hands.cell is not None


def test_what_is_not_complete_is_written_in_a_tenth_of_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, written = [0.0], []

    def write() -> None:
        written.append(clock[0])
        clock[0] += 2.0

    monkeypatch.setattr(run, "monotonic", lambda: clock[0])
    show = run._now_and_then(write)
    for left in range(44, 0, -1):
        show(left)
        clock[0] += 1.0
    assert written == [0.0, 20.0, 40.0]
    clock[0] = 1000.0
    show(0)  # the end writes it whole
    assert len(written) == 3
