"""Jobs on other machines, played by processes of this one: the same bits, whoever is lost, and nothing that listens to others.

`make test-cluster` runs it. `make test` leaves it out: workers that are killed and begin again take a minute and a half.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest
import xarray as xr
from toy_analysis import ToyStudy

from stickslip.errors import InputError
from stickslip.study.questions import ANALYSES, Home
from stickslip.study.run import run_study
from stickslip.study.store import workers
from stickslip.study.store.journal import reached
from stickslip.study.store.workers import LOOPBACK
from stickslip.study.verdict import of_tree

if "STICKSLIP_CLUSTER" not in os.environ:
    pytest.skip("make test-cluster runs it", allow_module_level=True)
psutil = import_module("psutil")  # comes with the extra

# executorlib asks pydantic for a name that is deprecated: shown, and no error of ours
pytestmark = pytest.mark.filterwarnings(
    "default::DeprecationWarning:pydantic", "default::DeprecationWarning:executorlib"
)
HERE = Path(__file__).parent
PORT = 18786
FACTORS = (1.5, 2.5, 3.5, 4.5)
POISON = 1  # the case that kills its process, at its fourth record
EVERY = 10.0  # seconds between two kills of a worker
MOST = 6  # of them
LIMIT = 300.0  # seconds of a run, after which it is ended and the test has failed
RUN = """
import sys
from pathlib import Path
from stickslip.study.questions import ANALYSES, Home
from stickslip.study.run import run_study
from stickslip.study.run import Shard
from toy_analysis import ToyStudy
if __name__ == "__main__":
    ANALYSES["toy"] = Home("slow_toy:TOY")
    path, kind, processes, shard = sys.argv[1:]
    study = ToyStudy(Path(path), {factors}, stop_at=3, how="kill", stop_in={poison})
    run_study(study, kind=kind, workers=int(processes), shard=Shard.read(shard) if shard else None)
"""


@pytest.fixture(autouse=True)
def modules_of_tests_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    paths = [str(HERE), str(HERE.parent / "src"), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))


def start(folder: Path, *, kind: str = "", processes: int = 1, shard: str = "") -> subprocess.Popen[str]:
    """Start a run of the study, in which one case kills its process."""
    script = folder / "run.py"
    if not script.exists():  # another run may be reading it
        script.write_text(RUN.format(factors=FACTORS, poison=POISON))
    own = [str(folder / "study.toml"), kind, str(processes), shard]
    return subprocess.Popen([sys.executable, str(script), *own], stderr=subprocess.PIPE, text=True)


def end(run: subprocess.Popen[str], folder: Path) -> None:
    """Wait for a run; end one that goes on for too long."""
    try:
        _, said = run.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        run.kill()  # processes of its jobs end with it
        logs = [*folder.glob("results/*.log"), *folder.glob("dask.log")]
        told = "\n".join(log.read_text()[-3000:] for log in logs)
        pytest.fail(f"not done in {LIMIT:g} s, jobs as far as {recorded(folder)}:\n{told}")
    assert run.returncode == 0, said


def found(folder: Path) -> np.ndarray:
    """Return the numbers of a finished run, in which the poison case alone was set aside, with what it had found."""
    tree = xr.load_datatree(folder / "results/result.nc", engine="h5netcdf")
    assert tree.attrs["complete"] == 1
    (verdict,) = (v for v in of_tree(tree) if v.level == "wrong")
    assert verdict.case == "factor = 2.5"
    assert "its process was ended by signal SIGKILL" in verdict.why
    assert "twice at the same place" in verdict.why
    return np.asarray(tree["toy"].value.values)


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """The powers themselves, computed here."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(ANALYSES, "toy", Home("toy_analysis:TOY"))
        made = ToyStudy(folder / "study.toml", FACTORS)
        run_study(made)
    tree = xr.load_datatree(made.folder / "result.nc", engine="h5netcdf")
    return np.delete(tree["toy"].value.values, POISON, axis=0)


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ToyStudy:
    monkeypatch.setitem(ANALYSES, "toy", Home("toy_analysis:TOY"))
    return ToyStudy(tmp_path / "study.toml", FACTORS)


def listening(processes: list[int]) -> set[str]:
    """Return the addresses at which processes, and those that they started, listen."""
    found = set()
    for number in processes:
        with suppress(psutil.Error):  # one has ended
            first = psutil.Process(number)
            for one in [first, *first.children(True)]:
                with suppress(psutil.Error):
                    found |= {c.laddr.ip for c in one.net_connections("tcp") if c.status == "LISTEN"}
    return found


@contextmanager
def dask_cluster(folder: Path) -> Iterator[tuple[str, list[int]]]:
    """Give the address of a scheduler, and the numbers of the processes that keep one worker each alive."""
    address = f"tcp://{LOOPBACK}:{PORT}"
    own = ["--host", LOOPBACK, "--dashboard-address"]
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", str(PORT)]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1"]
    processes: list[subprocess.Popen[bytes]] = []
    with (folder / "dask.log").open("wb") as log:
        try:
            processes.append(subprocess.Popen([*command, *own, f"{LOOPBACK}:0"], stderr=log))
            for n in range(2):
                place = ["--local-directory", str(folder / f"worker{n}")]
                processes.append(subprocess.Popen([*worker, *own, f"{LOOPBACK}:0", *place], stderr=log))
            yield address, [p.pid for p in processes]
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                try:
                    process.wait(30)
                except subprocess.TimeoutExpired:
                    process.kill()  # its worker ends with it
                    process.wait()


def recorded(folder: Path) -> dict[str, tuple[int, ...]]:
    """Return how far each job has come."""
    files = sorted((folder / "results/jobs").glob("*"), key=reached)
    return {path.name.partition(".")[0]: reached(path) for path in files}


def kill_workers(nannies: list[int], folder: Path, killed: list[int], over: Event) -> None:
    """Kill a worker every ten seconds, one after the other, but none before a job has come further since the last kill.

    An overloaded machine may need more than ten seconds to start a worker, and with a bare clock no job would ever end there. A
    quiet one is done before the most of them.
    """
    before: dict[str, tuple[int, ...]] = {}
    while len(killed) < MOST and not over.wait(EVERY):
        while (now := recorded(folder)) == before:
            if over.wait(0.2):
                return
        before = now
        nanny = nannies[len(killed) % len(nannies)]
        victims = [p for p in psutil.Process(nanny).children() if "spawn_main" in str(p.cmdline())]
        killed += [p.pid for p in victims]
        for victim in victims:
            victim.send_signal(signal.SIGKILL)


@contextmanager
def meanwhile(work: Callable[..., object], *given: object) -> Iterator[None]:
    """Let a thread work while the block runs; its last argument tells it that the block has ended."""
    over = Event()
    thread = Thread(target=work, args=(*given, over))
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def test_dask_cluster_whose_workers_are_killed(
    tmp_path: Path, expected: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers, "PATIENCE", 60)
    monkeypatch.setenv("SLOW_TOY_SECONDS", "3")  # two workers need longer than two kills take
    killed: list[int] = []
    with dask_cluster(tmp_path) as (address, processes):
        with workers.executor(f"dask={address}", 1):
            assert listening([*processes, os.getpid()]) == {LOOPBACK}
        with meanwhile(kill_workers, processes[1:], tmp_path, killed):
            end(start(tmp_path, kind=f"dask={address}"), tmp_path)
    np.testing.assert_array_equal(found(tmp_path), expected)
    assert len(killed) > 1


def test_executorlib_on_one_node(tmp_path: Path, expected: np.ndarray) -> None:
    heard: set[str] = set()

    def listen(over: Event) -> None:
        while not over.wait(1.0):
            heard.update(listening([run.pid]))

    run = start(tmp_path, kind="executorlib", processes=2)
    with meanwhile(listen):
        end(run, tmp_path)
    np.testing.assert_array_equal(found(tmp_path), expected)
    assert heard == {LOOPBACK}


def test_shards_that_run_at_once(tmp_path: Path, expected: np.ndarray) -> None:
    shares = ["1/3", "2/3", "2/3", "3/3"]  # one of them is started twice
    runs = [start(tmp_path, shard=share) for share in shares]
    try:
        for run in runs:
            end(run, tmp_path)
    finally:
        for run in runs:  # where one has failed, the others are at work still
            run.kill()
            run.communicate()
    np.testing.assert_array_equal(found(tmp_path), expected)
    assert {p.suffix for p in (tmp_path / "results/jobs").iterdir()} == {".job"}


def test_scheduler_that_does_not_answer_is_told(study: ToyStudy, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "PATIENCE", 2)
    began = time.monotonic()
    with pytest.raises(InputError, match="no scheduler answers there"):
        run_study(study, kind=f"dask=tcp://{LOOPBACK}:1")
    assert time.monotonic() - began < 60.0
    with pytest.raises(InputError, match="no scheduler answers there"):
        run_study(study, kind="dask=nonsense")


def test_slurm_outside_of_it_is_told(study: ToyStudy, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SLURM_JOB_ID", raising=False)
    monkeypatch.setattr("stickslip.study.store.workers.shutil.which", lambda _name: None)
    with pytest.raises(InputError, match=r"--executor slurm: finds no srun here"):
        run_study(study, kind="slurm")
    monkeypatch.setattr("stickslip.study.store.workers.shutil.which", str)
    with pytest.raises(InputError, match=r"is not inside an allocation\. Begin with it: salloc"):
        run_study(study, kind="slurm")
    monkeypatch.setenv("SLURM_JOB_ID", "1")
    monkeypatch.setenv("SLURM_JOB_NODELIST", "node[1-4]")
    with pytest.raises(InputError, match=r"Name the address of this machine .*slurm=10\.0\.0\.5"):
        run_study(study, kind="slurm")
