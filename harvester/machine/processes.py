"""Worker processes that run one job at a time: a crash ends that job only, and no process outlives the program.

Each is a loky executor of one process, because an executor of several gives up all its jobs when one process dies.
"""

import multiprocessing.process
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar

import loky

T = TypeVar("T")
Job = TypeVar("Job")

_STARTING = threading.RLock()  # starting a process changes what all threads (of a Dask worker) share
LOOK = 0.3  # seconds between two checks whether the program that started a worker still lives


def create(idle: float | None = None, env: dict[str, str] | None = None) -> loky.ProcessPoolExecutor:
    """Create a worker process, which starts with its first job and ends after ``idle`` seconds without one.

    ``env`` is added to its environment.
    """
    with _STARTING:
        _start_the_tracker()
    return loky.ProcessPoolExecutor(1, timeout=idle, env=env, initializer=_watch, initargs=(os.getpid(),))


def submit_to_one(
    idle: deque[loky.ProcessPoolExecutor],
    new: Callable[[], loky.ProcessPoolExecutor],
    function: Callable[..., T],
    arguments: tuple[Any, ...],
) -> tuple[Future[T], loky.ProcessPoolExecutor]:
    """Start ``function(*arguments)`` in an idle process that has not died meanwhile, else in a new one."""
    while True:
        process = idle.pop() if idle else new()
        with _without_keyboard_interrupts():
            try:
                return process.submit(function, *arguments), process
            except BrokenProcessPool:
                kill(process)


def completed(
    start: Callable[[], tuple[Job, Future[T], Any] | None], most: int
) -> Iterator[tuple[Job, Future[T], Any]]:
    """Keep ``most`` jobs running and yield each one, with its process, as soon as it ends.

    ``start`` starts the next job, or says with None that there is none at present.  The processes of jobs that still
    run when the iteration ends, by an error or because its reader stops, are killed.
    """
    running: dict[Future[T], tuple[Job, Future[T], Any]] = {}
    try:
        while True:
            while len(running) < most and (started := start()) is not None:
                running[started[1]] = started
            if not running:
                return
            for job in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(job)
    finally:
        for _, _, process in running.values():
            kill(process)


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
