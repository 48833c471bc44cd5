"""A worker process, terminated when a job exceeds its time or memory."""

import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from math import inf
from multiprocessing.spawn import get_preparation_data, prepare
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import IO, Any

from stickslip.errors import StickslipError, input_error
from stickslip.model.blas_threads import BLAS_THREADS
from stickslip.study.store.progress import LOG, OF_RECORDS

EVERY = 0.1  # seconds between two checks of a process
STATM = "/proc/{}/statm"  # Linux' file with the memory of a process
SERVE = "import sys; sys.path[:] = {!r}; from stickslip.study.store.worker_process import serve; serve()"


class Ended(StickslipError):  # noqa: N818  it tells what has happened
    """Error: the process ended before its job."""


class OutOfTime(Ended):
    """Error: the process was terminated because the job took too long."""


class Stopped(Ended):
    """Error: the process was terminated because the run was stopped."""


@dataclass(frozen=True)
class Limits:
    """Limits of a job.

    Parameters
    ----------
    seconds
        Wall-clock time from each start of the job, s.
    memory_gb
        Memory of the computing process, GB.
    """

    seconds: float = inf
    memory_gb: float = inf

    def __bool__(self) -> bool:
        return min(self.seconds, self.memory_gb) < inf


def check_memory_limit(limits: Limits) -> None:
    """Refuse a memory limit on systems that do not report the memory of a process."""
    if limits.memory_gb < inf and not (Path(STATM.format("self")).exists() or find_spec("psutil")):
        raise input_error(
            "limits.job_memory_gb",
            "needs psutil on this system, which is not installed",
            "Use: pip install psutil. Or leave it out.",
        )


class Cell:
    """A worker process that executes one piece of work after another. It starts on demand, and again after an abnormal end.

    Parameters
    ----------
    threads
        Environment variables for the number of BLAS threads; variables not listed are unset.
    modules
        Modules imported at its start.
    """

    def __init__(self, threads: dict[str, str], modules: tuple[str, ...] = ()) -> None:
        self._threads, self._modules = threads, modules
        self._process: subprocess.Popen[bytes] | None = None
        self._said: SimpleQueue[tuple[str, Any]] = SimpleQueue()

    def answer(
        self,
        work: Callable[[Any], Any],
        given: Any,
        limits: Limits,
        stopped: Callable[[], bool],
        hear: Callable[[logging.LogRecord], object] = LOG.handle,
    ) -> Any:
        """Evaluate ``work(given)`` in the process; return the result or raise the exception. Its log lines are repeated here.

        Raises
        ------
        Ended
            If the process ends before the work is done, by itself or because of the limits.
        """
        process = self.started()
        _send(process.stdin, pickle.dumps((work, given)))
        began = looked = monotonic()
        while True:
            with suppress(Empty):
                kind, content = self._said.get(timeout=EVERY)
                if kind == "line":
                    with suppress(OSError):  # a closed terminal, which this process's own log lines report
                        hear(logging.makeLogRecord(content))
                elif kind == "done":
                    return content
                elif kind == "raised":
                    raise content
                else:
                    how = _how(process.wait())
                    self.close()
                    raise Ended(how)
            if monotonic() - looked >= EVERY:
                looked = monotonic()
                self._look(process.pid, looked - began, limits, stopped)

    def close(self) -> None:
        """End the process at once; journals contain only complete records, so nothing is lost."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            assert process.stdin is not None
            with suppress(OSError):
                process.stdin.close()

    def _look(self, number: int, seconds: float, limits: Limits, stopped: Callable[[], bool]) -> None:
        """Terminate the process if a limit is exceeded or the run was stopped."""
        if stopped():
            self.close()
            raise Stopped("the run was stopped")
        if seconds > limits.seconds:
            self.close()
            raise OutOfTime(f"it took more than {limits.seconds:g} s, the limit of a job")
        taken = memory_gb(number) if limits.memory_gb < inf else 0.0
        if taken > limits.memory_gb:
            self.close()
            raise Ended(f"took {taken:.2f} GB of memory, the limit of a job is {limits.memory_gb:g} GB")

    def started(self) -> subprocess.Popen[bytes]:
        """Return the process, started if necessary; work may be sent before it is ready."""
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.close()
        others = {k: v for k, v in os.environ.items() if k not in BLAS_THREADS}
        self._said = SimpleQueue()
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVE.format(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=others | self._threads,
        )
        heard = (self._process.stdout, self._said)
        threading.Thread(target=_listen, args=heard, daemon=True).start()
        # preparation as in multiprocessing: the process imports the user's script and so knows its classes
        told = get_preparation_data("stickslip")
        told.pop("authkey", None)
        _send(self._process.stdin, pickle.dumps((told, self._modules)))
        return self._process


def memory_gb(process: int) -> float:
    """Return the present memory of a process in GB; 0 if it has ended."""
    try:
        pages = int(Path(STATM.format(process)).read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e9
    except (OSError, IndexError):
        pass
    if find_spec("psutil") is None:
        return 0.0
    import psutil

    try:
        return float(psutil.Process(process).memory_info().rss) / 1e9
    except psutil.Error:
        return 0.0


def blas_threads() -> dict[str, str]:
    """Return the environment variables that set the number of BLAS threads of this process."""
    return {name: os.environ[name] for name in BLAS_THREADS if name in os.environ}


def _how(code: int) -> str:
    """Return a sentence fragment about the end of a process."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = str(-code)
    why = ", as a rule for lack of memory" if name == "SIGKILL" else ""
    return f"was ended by signal {name}{why}"


def _send(stream: IO[bytes] | None, message: bytes) -> None:
    """Send a message; a closed connection is noticed by the listener."""
    assert stream is not None
    with suppress(OSError):
        pickle.dump(message, stream)
        stream.flush()


def _listen(stream: IO[bytes], said: "SimpleQueue[tuple[str, Any]]") -> None:
    """Put the messages of a process into a queue, and finally a message about its end."""
    with stream, suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            said.put(_understood(pickle.load(stream)))
    said.put(("ended", None))


def _understood(message: bytes) -> tuple[str, Any]:
    try:
        kind, content = pickle.loads(message)
    except Exception as error:  # noqa: BLE001  a user's exception that cannot be unpickled
        return "raised", StickslipError(f"a job ended with what cannot be sent ({error})")
    return str(kind), content


def serve() -> None:
    """Execute pieces of work until the connection closes: the main loop of the process of a `Cell`."""
    with suppress(ValueError):  # only the main thread may set signal handlers
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    heard: SimpleQueue[bytes] = SimpleQueue()
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of libraries must not mix with messages
    threading.Thread(target=_hear, args=(os.fdopen(os.dup(0), "rb"), heard), daemon=True).start()
    say = _speaker(out)
    LOG.addHandler(_Lines(say))
    LOG.setLevel(logging.INFO)
    LOG.propagate = False
    trouble = _prepared(*pickle.loads(heard.get()))
    while True:
        message = heard.get()
        if trouble is not None:
            say("raised", trouble)
            continue
        try:
            work, given = pickle.loads(message)
            answer = ("done", work(given))
        except BaseException as error:  # noqa: BLE001  the parent raises it
            error.add_note("".join(traceback.format_exception(error)))
            answer = ("raised", error)
        say(*answer)


def _prepared(told: dict[str, Any], modules: tuple[str, ...]) -> StickslipError | None:
    """Prepare this process as multiprocessing does, with search path, folder and the user's script; import modules."""
    try:
        prepare(told)
        for name in modules:
            import_module(name)
    except BaseException as error:  # noqa: BLE001  the script may do anything
        return StickslipError(
            f"a worker process cannot import {told.get('init_main_from_path', 'the script')} ({error}). Put its code below the line if __name__ == '__main__':"
        )
    return None


def _hear(stream: IO[bytes], heard: "SimpleQueue[bytes]") -> None:
    """Put messages into a queue; end this process when the connection closes."""
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            heard.put(pickle.load(stream))
    os._exit(1)


def _speaker(out: IO[bytes]) -> Callable[[str, Any], None]:
    """Return a thread-safe function that sends whole messages."""
    lock = threading.Lock()

    def say(kind: str, content: Any) -> None:
        try:
            message = pickle.dumps((kind, content))
        except Exception as error:  # noqa: BLE001  the user's classes may raise any exception
            own = StickslipError(f"a job ended with what cannot be sent: {content!r} ({error})")
            message = pickle.dumps(("raised", own))
        with lock:
            _send(out, message)

    return say


class _Lines(logging.Handler):
    """Handler that sends log lines and progress of this process to the parent."""

    def __init__(self, say: Callable[[str, Any], None]) -> None:
        super().__init__()
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        own = {"name": record.name, "levelno": record.levelno, "levelname": record.levelname}
        found = {key: vars(record)[key] for key in OF_RECORDS if key in vars(record)}
        self._say("line", {**own, "msg": record.getMessage(), **found})
