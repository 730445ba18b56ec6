"""Worker processes that run one job at a time: a crash ends that job only, and no process outlives the program.

Each is a loky executor of one process, because an executor of several gives up all its jobs when
one process dies.
"""

import io
import multiprocessing.process
import os
import sys
import threading
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import loky

from harvester.machine.imports import search_garbage_rarely
from harvester.machine.system import this_system
from harvester.machine.tracker import main

T = TypeVar("T")
Job = TypeVar("Job")

# starting a process changes what all threads (of a Dask worker) share
_STARTING = threading.RLock()
# Python looks for no module in the current folder, with -m and -c too
SAFE = {"PYTHONSAFEPATH": "1"}
# of the program that this one was forked from: never touched
_OF_PARENT: list[Any] = []
# functions that end processes that nobody waits for, at the end of the program
_AT_END: list[Callable[[], object]] = []
# bytes by which a worker may grow: each combination of effects that it compiles takes some
GROWTH = "2e9"


def _after_fork() -> None:
    """Give a forked program a lock of its own, as no thread is left that would release the old one, and no children.

    Python itself forgets them if it forks, but not in `os.fork`, after which it would wait for
    them in vain.
    """
    global _STARTING  # noqa: PLW0603  # a lock cannot be renewed in place
    _STARTING = threading.RLock()
    multiprocessing.process._children.clear()  # type: ignore[attr-defined]


this_system.after_fork(_after_fork)


def idle_processes() -> deque[loky.ProcessPoolExecutor]:
    """An empty list of idle processes, which is empty again in a forked program: they answer to their parent alone."""
    idle: deque[loky.ProcessPoolExecutor] = deque()

    def end() -> None:
        while idle:
            kill(idle.pop())

    forget_after_fork(idle)
    at_end(end)
    return idle


def forget_after_fork(children: deque[Any]) -> None:
    """Empty a list of processes in a forked program, whose children they are not."""

    def forget() -> None:
        _OF_PARENT.extend(children)
        children.clear()

    this_system.after_fork(forget)


def at_end(function: Callable[[], object]) -> None:
    """Call a function at the end of the program, before loky waits for its processes.

    One that still loads its modules would end only after that.
    """
    _AT_END.append(function)


@cache
def _call_at_end() -> None:
    """Have the functions of `at_end` called: the last to be registered is the first, and loky is before this."""

    def call() -> None:
        for function in _AT_END:
            function()

    threading._register_atexit(call)  # type: ignore[attr-defined]


def create(
    idle: float | None = None, env: dict[str, str] | None = None, folder: str | None = None
) -> loky.ProcessPoolExecutor:
    """Create a worker process, which starts with its first job and ends after ``idle`` seconds without one.

    ``env`` is added to its environment; ``folder`` is its current folder, and its home.  The
    modules that start it are not looked for in the current folder; later ones are searched for
    where the program that starts it looks for its own.
    """
    with _STARTING:
        _start_the_trackers()
    env = {**SAFE, **(env or {})}
    start = (os.getpid(), folder)
    env = {"LOKY_MAX_MEMORY_LEAK_SIZE": GROWTH, **(env or {})}
    process = loky.ProcessPoolExecutor(1, timeout=idle, env=env, initializer=_begin, initargs=start)
    # otherwise a thread of loky starts it, and prints a traceback if the system refuses it
    process._call_queue._start_thread()
    return process


def submit_to_one(
    idle: deque[loky.ProcessPoolExecutor],
    new: Callable[[], loky.ProcessPoolExecutor],
    function: Callable[..., T],
    arguments: tuple[Any, ...],
) -> tuple[Future[T], loky.ProcessPoolExecutor]:
    """Start ``function(*arguments)`` in an idle process that has not died meanwhile, else in a new one."""
    while True:
        process = idle.pop() if idle else new()
        with _without_keyboard_interrupts(), _streams_to_flush():
            try:
                future = process.submit(function, *arguments)
                _call_at_end()
                # Where this has started a new process, the thread that notices its end does not
                # know it yet.
                process._executor_manager_thread_wakeup.wakeup()
                return future, process
            except BrokenProcessPool:
                kill(process)
            except (
                UnboundLocalError
            ) as error:  # loky's own, where the system refuses it a descriptor
                raise error.__context__ or error from None


def completed(
    start: Callable[[], tuple[Job, Future[T], Any] | None],
    most: int,
    meanwhile: Callable[[], object] | None = None,
) -> Iterator[tuple[Job, Future[T], Any]]:
    """Keep ``most`` jobs running and yield each one, with its process, as soon as it ends.

    ``start`` starts the next job, or returns None if there is none at present; ``meanwhile`` is
    called once, when
    the first ones run.  The processes of jobs that still run when the iteration ends, by an error or because its reader
    stops, are killed.
    """
    running: dict[Future[T], tuple[Job, Future[T], Any]] = {}
    try:
        while True:
            while len(running) < most and (started := start()) is not None:
                running[started[1]] = started
            if not running:
                return
            if meanwhile is not None:
                meanwhile()
                meanwhile = None
            for job in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(job)
    finally:
        for _, _, process in running.values():
            kill(process)


def kill(process: loky.ProcessPoolExecutor) -> None:
    """End a process at once (loky's own way waits for it, and needs a program that may be missing)."""
    for worker in list((process._processes or {}).values()):
        if worker.is_alive():
            worker.terminate()
    process.shutdown(wait=False)


@cache
def _start_the_trackers() -> None:
    """Start the processes of loky and of Python that unlink the semaphores of killed processes, without a warning.

    Loky's runs `harvester.machine.tracker`, also if it was killed and is started anew.
    """
    from multiprocessing import resource_tracker as of_python

    from loky.backend import resource_tracker as of_loky

    tracker: Any = of_loky._resource_tracker
    launch = tracker._launch

    def launch_in_silence() -> None:
        with _silence():
            launch()

    of_loky.main = main  # the function whose module and name loky gives to the new process
    tracker._launch = launch_in_silence
    with _silence(), _without_keyboard_interrupts():
        of_loky.ensure_running()
        of_python.ensure_running()


@contextmanager
def _silence() -> Iterator[None]:
    """Start processes that find this package and ignore warnings of trackers."""
    filters = os.environ.get("PYTHONWARNINGS")
    path = os.environ.get("PYTHONPATH")
    settings = {
        "PYTHONWARNINGS": ",".join(filter(None, (filters, "ignore:resource_tracker"))),
        "PYTHONPATH": os.pathsep.join(filter(None, (str(Path(__file__).parents[2]), path))),
        **SAFE,
    }
    before = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    try:
        yield
    finally:
        for name, value in before.items():
            del os.environ[name]
            if value is not None:
                os.environ[name] = value


@contextmanager
def _without_keyboard_interrupts() -> Iterator[None]:
    """Start processes that never get ^C, which a terminal sends to all: the program ends its workers itself.

    A worker may start workers of its own (ngspice's), also in a process that is a daemon (Dask's).
    """
    with _STARTING, this_system.without_interrupts():
        settings: dict[str, Any] = multiprocessing.process.current_process()._config  # type: ignore[attr-defined]
        daemon = settings.pop("daemon", None)
        try:
            yield
        finally:
            if daemon is not None:
                settings["daemon"] = daemon


@contextmanager
def _streams_to_flush() -> Iterator[None]:
    """Start processes also if stdout or stderr is missing, closed or cannot be flushed, as loky does."""
    replaced: dict[str, tuple[Any, Any]] = {}
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        try:
            stream.flush()
        except (AttributeError, ValueError, OSError):
            replaced[name] = stream, io.StringIO()
            setattr(sys, name, replaced[name][1])
    try:
        yield
    finally:
        for name, (stream, ours) in replaced.items():
            if getattr(sys, name) is ours:  # else another thread has set its own meanwhile
                setattr(sys, name, stream)


def _begin(parent: int, folder: str | None) -> None:
    """Go to the folder of this process, and end it soon after its parent, whatever it computes: nobody else would."""
    # a tracker that was killed is started anew without a word
    warnings.filterwarnings("ignore", "resource_tracker", UserWarning)
    search_garbage_rarely()
    if folder is not None:
        os.chdir(folder)
        # later than Python's start, which finds the user's packages by it
        os.environ["HOME"] = folder

    def look() -> None:
        """Wait for the parent's end, then end this process."""
        this_system.wait_for_end_of(parent)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()
