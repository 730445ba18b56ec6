"""Worker processes of one job at a time: what dies there takes nothing along, and nothing outlives the program.

Each is a loky executor of one process, because an executor of several gives up all its jobs when one process dies.
"""

import multiprocessing.process
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar

import loky

T = TypeVar("T")

_STARTING = threading.RLock()  # what is changed while a process starts, the threads of a Dask worker have in common
LOOK = 0.3  # seconds between two looks whether the program that started a worker still lives


def new(idle: float | None = None, env: dict[str, str] | None = None) -> loky.ProcessPoolExecutor:
    """A process to be (it starts with its first job), that ends after ``idle`` seconds without a job."""
    with _STARTING:
        _start_the_tracker()
    return loky.ProcessPoolExecutor(1, timeout=idle, env=env, initializer=_watch, initargs=(os.getpid(),))


def submitted(
    process: loky.ProcessPoolExecutor, function: Callable[..., T], given: tuple[Any, ...]
) -> Future[T] | None:
    """The job in a process; None where the process has died while idle."""
    with _out_of_reach_of_the_keyboard():
        try:
            job: Future[T] = process.submit(function, *given)
            return job
        except BrokenProcessPool:
            return None


def killed(process: loky.ProcessPoolExecutor) -> None:
    """End a process at once (loky's own way waits for it, and needs a program that may be missing)."""
    for one in list((process._processes or {}).values()):
        if one.is_alive():
            one.terminate()
    process.shutdown(wait=False)


@cache
def _start_the_tracker() -> None:
    """Loky's process that unlinks the semaphores of processes that were killed, told not to warn of each."""
    from loky.backend import resource_tracker

    before = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = ",".join(filter(None, (before, "ignore:resource_tracker")))
    try:
        with _out_of_reach_of_the_keyboard():
            resource_tracker.ensure_running()
    finally:
        del os.environ["PYTHONWARNINGS"]
        if before is not None:
            os.environ["PYTHONWARNINGS"] = before


@contextmanager
def _out_of_reach_of_the_keyboard() -> Iterator[None]:
    """A process started meanwhile never gets ^C, which a terminal sends to all: the program ends its workers itself.

    A worker may start workers of its own (ngspice's), also where the one that it is in was made a daemon (by Dask).
    """
    with _STARTING:
        held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        settings: dict[str, Any] = multiprocessing.process.current_process()._config  # type: ignore[attr-defined]
        daemon = settings.pop("daemon", None)
        try:
            yield
        finally:
            if daemon is not None:
                settings["daemon"] = daemon
            signal.pthread_sigmask(signal.SIG_SETMASK, held)


def _watch(parent: int) -> None:
    """End this process soon after its parent has, whatever it computes: it would be left alone for ever."""

    def look() -> None:
        while os.getppid() == parent:
            threading.Event().wait(LOOK)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()
