"""Worker processes that run ngspice: a failure or a crash in one is an error of that job only.

A process whose ngspice has failed is not trusted with another circuit: after a fatal error ngspice
stays in pieces, after a hang it continues calculating.  It is killed, and the next job gets a new
one.  So is a process that found no ngspice: it would not look in a place that is named later.
"""

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from itertools import starmap
from typing import Any, TypeVar

import loky

from harvester.errors import CircuitError, MissingProgramError
from harvester.machine import folders, processes
from harvester.machine.cores import cores

T = TypeVar("T")

IDLE = 60.0  # seconds after which a process without a job ends
idle_workers = processes.idle_processes()
workers_ahead: deque[tuple[loky.ProcessPoolExecutor, list[Future[Any]]]] = deque()


@dataclass
class Here:
    """That ngspice runs in this process, as long as none of its runs has failed."""

    trusted: bool = True


_here: ContextVar[Here | None] = ContextVar("_here", default=None)


@contextmanager
def ngspice_here() -> Iterator[Here]:
    """Let `map_in_workers` run its jobs in this process, which is itself a worker that may die with one of them.

    After the first that fails the others run in workers of their own, as elsewhere, and this
    process should end.

    Raises MissingProgramError when ngspice is not installed; InputError as
    `harvester.machine.folders.bare`.
    """
    from harvester.cosimulation.ngspice.instance import ngspice

    with folders.at_home(_home()):  # where it looks for commands as it loads
        ngspice()
    here = Here()
    token = _here.set(here)
    try:
        yield here
    finally:
        _here.reset(token)


def worker_count() -> int:
    """How many ngspice run at a time: one a core."""
    return cores()


def map_in_workers(function: Callable[..., T], arguments: Sequence[tuple[Any, ...]]) -> Iterator[T]:
    """Call ``function(*given)`` for each of the arguments in worker processes, and yield the results in their order.

    `worker_count` of them run at a time.  The error of a job is raised in place of its
    result.  Jobs that still run when the iteration ends, by an error or because its reader stops,
    are killed.

    Raises CircuitError of a job, or when its process dies.
    """
    here = _here.get()
    if here is not None and here.trusted:
        yield from _in_this_process(function, arguments, here)
        return
    _wait_for_those_ahead()
    waiting = deque(enumerate(arguments))
    done: dict[int, Future[T]] = {}
    following = 0

    def start() -> tuple[int, Future[T], loky.ProcessPoolExecutor] | None:
        """Start the next job in an idle process that still lives, else in a new one."""
        if not waiting:
            return None
        number, given = waiting.popleft()
        return number, *processes.submit_to_one(idle_workers, _new, function, given)

    for number, job, process in processes.completed(start, worker_count()):
        done[number] = job
        _free_or_kill(process, job.exception())
        if job.exception() is not None:
            waiting.clear()
        while following in done:
            yield _result(done.pop(following))
            following += 1


@contextmanager
def ahead(*jobs: tuple[Callable[..., Any], tuple[Any, ...]]) -> "Iterator[Future[Any] | None]":
    """Start jobs, one after the other, in a worker process that others will use, while this one compiles; the first.

    Their code is in the cache afterwards, and their result or error is left aside.  None,
    and no job, on one core, without a cache, in a process that runs ngspice itself, and next to
    workers that run already.  An error in the block ends the process, unless another thread has
    it by then.
    """
    alone = worker_count() == 1 or _here.get() is not None or folders.cache_folder() is None
    if alone or idle_workers or workers_ahead:
        yield None
        return
    process = _new()
    futures = [
        processes.submit_to_one(deque([process]), _new, function, arguments)[0]
        for function, arguments in jobs
    ]
    started = process, futures
    workers_ahead.append(started)
    try:
        yield futures[0]
    except BaseException:
        with suppress(ValueError):  # another thread waits for it, or uses it
            workers_ahead.remove(started)
            processes.kill(process)
        raise


def _end_those_ahead() -> None:
    """End the processes of `ahead`, as their jobs are no longer needed."""
    while workers_ahead:
        processes.kill(workers_ahead.popleft()[0])


processes.forget_after_fork(workers_ahead)
processes.at_end(_end_those_ahead)


def _wait_for_those_ahead() -> None:
    """Wait for the jobs that began `ahead`, after which their process is an idle one."""
    while workers_ahead:
        process, futures = workers_ahead.popleft()
        wait(futures)
        _free_or_kill(
            process,
            next((error for future in futures if (error := future.exception()) is not None), None),
        )


def _in_this_process(
    function: Callable[..., T], arguments: Sequence[tuple[Any, ...]], here: Here
) -> Iterator[T]:
    """The results of `map_in_workers`, one after the other."""
    try:
        yield from starmap(function, arguments)
    except CircuitError:
        here.trusted = False
        raise


def _new() -> loky.ProcessPoolExecutor:
    """A new process, if ngspice finds an empty file of commands for its start, and looks for no other."""
    kernels = folders.cache_folder() or os.devnull  # which no folder can be in: no cache
    return processes.create(IDLE, {folders.VARIABLE: str(kernels)}, _home())


def _home() -> str:
    """A folder in which ngspice finds an empty file of commands for its start, and nothing else."""
    return folders.bare("ngspice", ".spiceinit")


def _free_or_kill(process: loky.ProcessPoolExecutor, error: BaseException | None) -> None:
    """Keep the process of a job that ended for the next job.

    Kill it after a failure of its ngspice, or without one.
    """
    failed = isinstance(error, BrokenProcessPool | CircuitError | MissingProgramError)
    if failed or len(idle_workers) >= worker_count():
        processes.kill(process)
    else:
        idle_workers.append(process)


def _result(job: Future[T]) -> T:
    """The result of a job that ended.

    Raises its error, that of a dead process as a `CircuitError`.
    """
    try:
        return job.result()
    except BrokenProcessPool:
        raise CircuitError(
            "ngspice ended abruptly (crash or out of memory) in its worker process: "
            "try a shorter `duration` or fewer `trajectories`, and check the netlist"
        ) from None
