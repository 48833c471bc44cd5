"""Executors of jobs: this process, worker processes, or other machines, all with bit-identical results.

Each executor is a context manager that yields `Hands`: an executor with its capacity.
"""

import os
import pickle
import shutil
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from queue import SimpleQueue
from typing import Any, TypeVar

from stickslip.errors import StickslipError, did_you_mean, input_error, missing_package
from stickslip.model.blas_threads import one_blas_thread
from stickslip.study.store.worker_process import Cell, blas_threads

T = TypeVar("T")

LOOPBACK = "127.0.0.1"
WARM = ("stickslip.study.jobs",)  # modules that a worker process imports while models are built
ALL = 1_000_000  # jobs submitted at a time if the executor has its own queue
PATIENCE = 15  # seconds to wait for a scheduler's answer, and for its first worker


class InProcess(Executor):
    """An executor without processes: `submit` returns when the work is done, and raises its exceptions."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Execute the function on copies of its arguments, as a worker process would."""
        future: Future[T] = Future()
        copies = pickle.loads(pickle.dumps(args))
        future.set_result(fn(*copies, **kwargs))
        return future


@dataclass(frozen=True, eq=False)
class Hands:
    """An executor of jobs and its capacity.

    Parameters
    ----------
    pool
        An executor like those of `concurrent.futures`.
    room
        Number of jobs submitted at a time.
    cell
        Context manager that lends a process for a job; None: the executor itself runs the job.
    far
        Whether jobs may run on other machines; their log lines then arrive when they end.
    over
        Event that is set at the end of the run.
    trouble
        Function that returns a reason for lack of progress; empty if no reason is known.
    """

    pool: Executor
    room: int
    cell: Callable[[], AbstractContextManager[Cell]] | None = None
    far: bool = False
    over: threading.Event = field(default_factory=threading.Event)
    trouble: Callable[[], str] = str


@contextmanager
def here() -> Iterator[Hands]:
    """Yield this process as the executor."""
    yield Hands(InProcess(), 1)


@contextmanager
def cells(workers: int) -> Iterator[Hands]:
    """Yield worker processes on this machine, started at once; they end with the block or with this process."""
    one_blas_thread()  # the processes inherit the setting
    made = [Cell(blas_threads(), WARM) for _ in range(workers)]
    free: SimpleQueue[Cell] = SimpleQueue()
    for one in made:
        one.started()
        free.put(one)

    @contextmanager
    def cell() -> Iterator[Cell]:
        own = free.get()
        try:
            yield own
        finally:
            free.put(own)

    over = threading.Event()
    pool = ThreadPoolExecutor(workers)
    try:
        yield Hands(pool, workers, cell, over=over)
    finally:
        over.set()
        pool.shutdown(cancel_futures=True)
        for one in made:
            one.close()


@contextmanager
def dask(address: str) -> Iterator[Hands]:
    """Yield the workers of a running Dask cluster."""
    client_of = _imported("distributed", "distributed").Client
    try:
        client = client_of(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise input_error(
            f"--executor dask={address}",
            f"no scheduler answers there ({str(error) or type(error).__name__})",
            "Start one, 'dask scheduler --host 127.0.0.1', and give the address that it prints.",
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise input_error(
                f"--executor dask={address}",
                "the scheduler has no workers",
                f"Start some on each machine: dask worker {address}",
            ) from None

        def trouble() -> str:
            try:
                return "" if client.nthreads() else "the scheduler has no workers any more"
            except (OSError, RuntimeError, TimeoutError) as error:
                return f"the scheduler does not answer ({error})"

        with _far(client.get_executor(pure=False), ALL, trouble) as hands:
            yield hands


@contextmanager
def single_node(workers: int) -> Iterator[Hands]:
    """Yield processes on this machine that executorlib starts."""
    made = _imported("executorlib", "executorlib").SingleNodeExecutor
    with _bound(LOOPBACK):
        pool = made(max_workers=workers, hostname_localhost=True, disable_dependencies=True)
        with _far(pool, workers) as hands:
            yield hands


@contextmanager
def allocated(kind: str, address: str, workers: int) -> Iterator[Hands]:
    """Yield the SLURM or Flux allocation of this command: one step of it for each job."""
    library = _imported("executorlib", "executorlib")
    if kind == "slurm":
        workers = _in_allocation(address, workers)
        own = {"exclusive": True, "slurm_cmd_args": ["--mem=0"]}
        made, more = library.SlurmJobExecutor, {"resource_dict": own}
    else:
        _imported("flux", "flux")
        made, more = library.FluxJobExecutor, {}
    near = not address
    with _bound(address or LOOPBACK):
        pool = made(max_workers=workers, hostname_localhost=near, disable_dependencies=True, **more)
        with _far(pool, workers) as hands:
            yield hands


def _in_allocation(address: str, workers: int) -> int:
    """Return the number of jobs that a SLURM allocation runs at a time; refuse an allocation in which jobs would hang."""
    if shutil.which("srun") is None:
        raise input_error("--executor slurm", "finds no srun here", "Run it where SLURM is.")
    if "SLURM_JOB_ID" not in os.environ:
        raise input_error(
            "--executor slurm",
            "is not inside an allocation",
            "Begin with it: salloc --ntasks=8 stickslip run ..., or the same line in a script for sbatch.",
        )
    node = os.environ.get("SLURM_JOB_NODELIST", "")
    if not address and node.partition(".")[0] != socket.gethostname().partition(".")[0]:
        raise input_error(
            "--executor slurm",
            f"the allocation, {node}, is not this machine alone, and this command listens on {LOOPBACK}",
            "Name the address of this machine that the others reach: --executor slurm=10.0.0.5. What listens there has no "
            "password.",
        )
    tasks = os.environ.get("SLURM_NTASKS", "1")
    return workers if workers > 1 else int(tasks)


@contextmanager
def _far(pool: Executor, room: int, trouble: Callable[[], str] = str) -> Iterator[Hands]:
    """Yield an executor whose jobs end when the run is over."""
    one_blas_thread()  # jobs use the number of threads set in this process
    try:
        yield Hands(pool, room, far=True, trouble=trouble)
    finally:
        pool.shutdown(wait=False)


@contextmanager
def _bound(address: str) -> Iterator[None]:
    """Make executorlib listen on one address only: by default it listens on all and unpickles everything it receives."""
    from executorlib.standalone.interactive.communication import SocketInterface

    before = SocketInterface.bind_to_random_port

    def bind(self: Any) -> int:
        return int(self._socket.bind_to_random_port(f"tcp://{address}"))

    SocketInterface.bind_to_random_port = bind
    try:
        yield
    finally:
        SocketInterface.bind_to_random_port = before


def _imported(module: str, package: str) -> Any:
    """Return a module of the extra ``cluster``."""
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError as error:
        if module == "flux":
            raise StickslipError(
                "--executor flux: needs the Python bindings of Flux, which come with it (python3-flux, flux-python)."
            ) from None
        raise missing_package(package, error, "cluster") from None


KINDS = ("dask", "slurm", "flux", "executorlib")


@contextmanager
def executor(kind: "str | Executor", workers: int, *, apart: bool = False) -> Iterator[Hands]:
    """Yield the executor of a run.

    Parameters
    ----------
    kind
        Empty: this machine. ``dask=ADDRESS``, ``slurm``, ``flux`` (the last two also with ``=ADDRESS`` to listen on), ``executorlib``, or
        any executor like those of `concurrent.futures`.
    workers
        Number of processes; 1: this process.
    apart
        Whether a single worker has its own process.
    """
    if not isinstance(kind, str):
        one_blas_thread()
        yield Hands(kind, ALL, far=True)  # the user's executor, which stays open
        return
    word, _, address = kind.partition("=")
    if not kind:
        chosen = here() if workers == 1 and not apart else cells(workers)
    elif word == "dask":
        chosen = dask(address)
    elif kind == "executorlib":
        chosen = single_node(workers)
    else:
        chosen = allocated(word, address, workers)
    with chosen as hands:
        yield hands


def check_kind(kind: str) -> None:
    """Refuse an unknown executor, or one whose package is missing, before any computation."""
    word = kind.partition("=")[0]
    if kind and word not in KINDS:
        raise input_error(f"--executor {kind}", "is not known", did_you_mean(word, list(KINDS)))
    if kind in ("dask", "dask="):
        raise input_error(
            f"--executor {kind}",
            "does not say where the scheduler is",
            "Give its address: --executor dask=tcp://127.0.0.1:8786.",
        )
    if word in ("dask", "slurm", "flux", "executorlib"):
        package = "distributed" if word == "dask" else "executorlib"
        if find_spec(package) is None:
            raise missing_package(package, ModuleNotFoundError(name=package), "cluster")
