"""Where jobs run: in this process, or in worker processes of this machine; with the same numbers, to the last bit."""

import logging
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from stickslip.study.keep.progress import LOG
from stickslip.study.keep.threads import one_blas_thread

T = TypeVar("T")

LONGEST = 3500  # bytes of a line and its job: a pipe takes 4096 (PIPE_BUF) at one go


class InProcess(Executor):
    """An executor without processes: `submit` returns when the work is done, and raises what the work raises."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Do the work on copies of its arguments, as a worker process would."""
        future: Future[T] = Future()
        copies = pickle.loads(pickle.dumps(args))
        future.set_result(fn(*copies, **kwargs))
        return future


@contextmanager
def executor(workers: int) -> Iterator[Executor]:
    """Give what runs jobs; worker processes end with the block, and with this process however it ends.

    Parameters
    ----------
    workers
        Number of processes; 1: this one.
    """
    if workers == 1:
        yield InProcess()
        return
    one_blas_thread()  # the workers inherit it
    context = get_context("spawn")
    ended, held = context.Pipe(duplex=False)
    said, to_say = context.Pipe(duplex=False)
    listener = threading.Thread(target=_forward, args=(said,), daemon=True)
    listener.start()
    pool = ProcessPoolExecutor(workers, context, _prepare, (ended, to_say))
    try:
        yield pool
    except BaseException:
        held.close()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        to_say.send_bytes(b"")
        listener.join()
        for end in (held, ended, said, to_say):
            end.close()


def _forward(said: Connection) -> None:
    """Hand what workers say to the handlers of this process, until an empty message."""
    while message := said.recv_bytes():
        with suppress(
            OSError
        ):  # a closed terminal, of which this process's own lines tell; pipes that nobody empties block
            LOG.handle(logging.makeLogRecord(pickle.loads(message)))


class _ToParent(logging.Handler):
    """Hands what a worker says to its parent.

    All workers write to one pipe, each record at one go and without a lock: a queue's lock would stay with a worker that is ended
    while it holds it, and everyone else would wait for ever.
    """

    def __init__(self, to_say: Connection) -> None:
        super().__init__()
        self.to_say = to_say

    def emit(self, record: logging.LogRecord) -> None:
        given = {"name": record.name, "levelno": record.levelno, "levelname": record.levelname}
        progress = {key: vars(record)[key] for key in ("fraction", "job") if key in vars(record)}
        room = LONGEST - len(pickle.dumps(progress))
        text = record.getMessage().encode()[: max(room, 0)].decode(errors="ignore")
        with suppress(OSError):  # the parent is gone, and so is this process soon
            self.to_say.send_bytes(pickle.dumps({**given, "msg": text, **progress}))


def _prepare(ended: Connection, to_say: Connection) -> None:
    """Prepare a worker process: what it says goes to its parent, which stops it when a run is stopped."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(ended,), daemon=True).start()
    LOG.addHandler(_ToParent(to_say))
    LOG.setLevel(logging.INFO)
    LOG.propagate = False


def _end_with(ended: Connection) -> None:
    """End this process when the other end of the pipe is closed: journals hold whole records at any time."""
    try:
        ended.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)
