"""Worker processes that run one job at a time: a crash ends that job only, and no process outlives the program.

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

_STARTING = threading.RLock()  # starting a process changes what all threads (of a Dask worker) share
LOOK = 0.3  # seconds between two checks whether the program that started a worker still lives


def create(idle: float | None = None, env: dict[str, str] | None = None) -> loky.ProcessPoolExecutor:
    """Create a worker process, which starts with its first job and ends after ``idle`` seconds without one.

    ``env`` is added to its environment.
    """
    with _STARTING:
        _start_the_tracker()
    return loky.ProcessPoolExecutor(1, timeout=idle, env=env, initializer=_watch, initargs=(os.getpid(),))


def submit(
    process: loky.ProcessPoolExecutor, function: Callable[..., T], arguments: tuple[Any, ...]
) -> Future[T] | None:
    """Start ``function(*arguments)`` in a process; None where the process has died while idle."""
    with _without_keyboard_interrupts():
        try:
            job: Future[T] = process.submit(function, *arguments)
            return job
        except BrokenProcessPool:
            return None


def kill(process: loky.ProcessPoolExecutor) -> None:
    """End a process at once (loky's own way waits for it, and needs a program that may be missing)."""
    for one in list((process._processes or {}).values()):
        if one.is_alive():
            one.terminate()
    process.shutdown(wait=False)


@cache
def _start_the_tracker() -> None:
    """Start loky's process that unlinks the semaphores of killed processes, with its warning of each turned off."""
    from loky.backend import resource_tracker

    before = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = ",".join(filter(None, (before, "ignore:resource_tracker")))
    try:
        with _without_keyboard_interrupts():
            resource_tracker.ensure_running()
    finally:
        del os.environ["PYTHONWARNINGS"]
        if before is not None:
            os.environ["PYTHONWARNINGS"] = before


@contextmanager
def _without_keyboard_interrupts() -> Iterator[None]:
    """Start processes that never get ^C, which a terminal sends to all: the program ends its workers itself.

    A worker may start workers of its own (ngspice's), also in a process that is a daemon (Dask's).
    """
    with _STARTING:
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        settings: dict[str, Any] = multiprocessing.process.current_process()._config  # type: ignore[attr-defined]
        daemon = settings.pop("daemon", None)
        try:
            yield
        finally:
            if daemon is not None:
                settings["daemon"] = daemon
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _watch(parent: int) -> None:
    """End this process soon after its parent has ended, whatever it computes: nobody else would."""

    def look() -> None:
        """Wait for the parent's end, then end this process."""
        while os.getppid() == parent:
            threading.Event().wait(LOOK)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()
