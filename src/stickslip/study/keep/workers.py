"""Where jobs run: in this process, or in worker processes of this machine; with the same numbers, to the last bit."""

import logging
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from logging.handlers import QueueHandler, QueueListener
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from stickslip.study.keep.progress import LOG
from stickslip.study.keep.threads import one_blas_thread

T = TypeVar("T")


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
    records = context.Queue()
    listener = QueueListener(records, _Forward())
    listener.start()
    pool = ProcessPoolExecutor(workers, context, _prepare, (ended, records))
    try:
        yield pool
    except BaseException:
        held.close()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        listener.stop()
        for end in (held, ended, records):
            end.close()


class _Forward(logging.Handler):
    """Hands what workers say to the handlers of this process."""

    def emit(self, record: logging.LogRecord) -> None:
        LOG.handle(record)


def _prepare(ended: Connection, records: Any) -> None:
    """Prepare a worker process: what it says goes to its parent, which stops it when a run is stopped."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(ended,), daemon=True).start()
    LOG.addHandler(QueueHandler(records))
    LOG.setLevel(logging.INFO)
    LOG.propagate = False


def _end_with(ended: Connection) -> None:
    """End this process when the other end of the pipe is closed: journals hold whole records at any time."""
    try:
        ended.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)
