"""Jobs on other machines, played by processes of this one: the same bits, whoever is lost, and nothing that listens to others.

`make test-cluster` runs it; without the extra ``cluster`` it is skipped.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from toy_analysis import ToyStudy

from stickslip.errors import InputError
from stickslip.study.analyses import ANALYSES
from stickslip.study.analyses.verdict import of_tree
from stickslip.study.keep.workers import LOOPBACK, executor
from stickslip.study.run import run_study

if "STICKSLIP_CLUSTER" not in os.environ and not all(map(find_spec, ("distributed", "executorlib"))):  # fmt: skip
    pytest.skip("the extra cluster is not installed", allow_module_level=True)

# executorlib asks pydantic for a name that is deprecated: shown, and no error of ours
pytestmark = pytest.mark.filterwarnings(
    "default::DeprecationWarning:pydantic", "default::DeprecationWarning:executorlib"
)
HERE = Path(__file__).parent
PORT = 18786
FACTORS = (1.5, 2.5, 3.5, 4.5)
POISON = 1  # the case that kills its process, at its fourth record
EVERY = 10.0  # seconds between two kills of a worker
RUN = """
import sys
from pathlib import Path
from stickslip.study.analyses import ANALYSES
from stickslip.study.run import run_study
from stickslip.study.shard import Shard
from toy_analysis import ToyStudy
if __name__ == "__main__":
    ANALYSES["toy"] = "slow_toy:TOY"
    study = ToyStudy(Path(sys.argv[1]), {factors}, stop_at=3, how="kill", stop_in={poison})
    run_study(study, shard=Shard.read(sys.argv[2]))
"""


@pytest.fixture(autouse=True)
def slow_toy_is_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(ANALYSES, "toy", "slow_toy:TOY")
    paths = [str(HERE), str(HERE.parent / "src"), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))


def study(folder: Path) -> ToyStudy:
    folder.mkdir(exist_ok=True)
    return ToyStudy(folder / "study.toml", FACTORS, stop_at=3, how="kill", stop_in=POISON)


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
        patch.setitem(ANALYSES, "toy", "toy_analysis:TOY")
        made = ToyStudy(folder / "study.toml", FACTORS)
        run_study(made)
    tree = xr.load_datatree(made.folder / "result.nc", engine="h5netcdf")
    return np.delete(tree["toy"].value.values, POISON, axis=0)


def listening(processes: list[int]) -> set[str]:
    """Return the addresses at which processes, and those that they started, listen."""
    import psutil

    every = [c for p in processes for c in [psutil.Process(p), *psutil.Process(p).children(True)]]
    found = set()
    for one in every:
        try:
            found |= {c.laddr.ip for c in one.net_connections("tcp") if c.status == "LISTEN"}
        except psutil.Error:
            continue  # it has ended
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
                processes.append(
                    subprocess.Popen([*worker, *own, f"{LOOPBACK}:0", *place], stderr=log)
                )
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


def kill_workers(nannies: list[int], killed: list[int], over: threading.Event) -> None:
    """Kill a worker every ten seconds, one after the other."""
    import psutil

    while not over.wait(EVERY):
        nanny = nannies[len(killed) % len(nannies)]
        workers = [p for p in psutil.Process(nanny).children() if "spawn_main" in str(p.cmdline())]
        killed += [p.pid for p in workers]
        for worker in workers:
            worker.send_signal(signal.SIGKILL)


def test_dask_cluster_whose_workers_are_killed(tmp_path: Path, expected: np.ndarray) -> None:
    killed: list[int] = []
    over = threading.Event()
    with dask_cluster(tmp_path) as (address, processes):
        with executor(f"dask={address}", 1):
            assert listening([*processes, os.getpid()]) == {LOOPBACK}
        killer = threading.Thread(target=kill_workers, args=(processes[1:], killed, over))
        killer.start()
        try:
            run_study(study(tmp_path / "dask"), kind=f"dask={address}")
        finally:
            over.set()
            killer.join()
    np.testing.assert_array_equal(found(tmp_path / "dask"), expected)
    assert len(killed) > 1


def test_executorlib_on_one_node(tmp_path: Path, expected: np.ndarray) -> None:
    heard: set[str] = set()
    over = threading.Event()

    def listen() -> None:
        while not over.wait(1.0):
            heard.update(listening([os.getpid()]))

    listener = threading.Thread(target=listen)
    listener.start()
    try:
        run_study(study(tmp_path / "one"), kind="executorlib", workers=2)
    finally:
        over.set()
        listener.join()
    np.testing.assert_array_equal(found(tmp_path / "one"), expected)
    assert heard == {LOOPBACK}


def test_shards_that_run_at_once(tmp_path: Path, expected: np.ndarray) -> None:
    script, path = tmp_path / "run.py", tmp_path / "study.toml"
    script.write_text(RUN.format(factors=FACTORS, poison=POISON))
    shares = ["1/3", "2/3", "2/3", "3/3"]  # one of them is started twice
    commands = [[sys.executable, str(script), str(path), share] for share in shares]
    started = [subprocess.Popen(c, stderr=subprocess.PIPE, text=True) for c in commands]
    for one in started:
        _, said = one.communicate(timeout=300)
        assert one.returncode == 0, said
    np.testing.assert_array_equal(found(tmp_path), expected)
    assert {p.suffix for p in (tmp_path / "results/jobs").iterdir()} == {".job"}


def test_scheduler_that_does_not_answer_is_told(tmp_path: Path) -> None:
    began = time.monotonic()
    with pytest.raises(InputError, match="no scheduler answers there"):
        run_study(study(tmp_path), kind=f"dask=tcp://{LOOPBACK}:1")
    assert time.monotonic() - began < 60.0
    with pytest.raises(InputError, match="no scheduler answers there"):
        run_study(study(tmp_path), kind="dask=nonsense")


def test_slurm_outside_of_it_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SLURM_JOB_ID", raising=False)
    monkeypatch.setattr("stickslip.study.keep.workers.shutil.which", lambda _name: None)
    with pytest.raises(InputError, match=r"--executor slurm: finds no srun here"):
        run_study(study(tmp_path), kind="slurm")
    monkeypatch.setattr("stickslip.study.keep.workers.shutil.which", str)
    with pytest.raises(InputError, match=r"is not inside an allocation\. Begin with it: salloc"):
        run_study(study(tmp_path), kind="slurm")
    monkeypatch.setenv("SLURM_JOB_ID", "1")
    monkeypatch.setenv("SLURM_JOB_NODELIST", "node[1-4]")
    with pytest.raises(InputError, match=r"Name the address of this machine .*slurm=10\.0\.0\.5"):
        run_study(study(tmp_path), kind="slurm")
