"""ngspice's worker processes: what fails or dies there is an error of that job only.

A process whose ngspice has failed is not trusted with another circuit: after a fatal error ngspice stays in
pieces, after a hang it goes on calculating.  It is killed, and the next job gets a new one.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

import loky

from harvester.errors import CircuitError
from harvester.machine.cores import cores
from harvester.machine.processes import killed, new, submitted

T = TypeVar("T")

IDLE = 60.0  # seconds after which a process without a job ends
_idle: deque[loky.ProcessPoolExecutor] = deque()


def workers() -> int:
    """How many ngspice run at a time: one a core."""
    return cores()


def in_order(function: Callable[..., T], arguments: Sequence[tuple[Any, ...]]) -> Iterator[T]:
    """``function(*one)`` for each of the arguments, in `workers` processes; yields in the order asked for.

    An error comes in its turn.  Jobs that still run when the iteration ends, by an error or because nobody asks on,
    are killed.

    Raises
    ------
    CircuitError
        of a job, or when its process dies.
    """
    running: dict[Future[T], tuple[int, loky.ProcessPoolExecutor]] = {}
    waiting = deque(enumerate(arguments))
    done: dict[int, Future[T]] = {}
    following = 0
    try:
        while following < len(arguments):
            while waiting and len(running) < workers():
                number, given = waiting.popleft()
                job, process = _started(function, given)
                running[job] = number, process
            for job in wait(running, return_when=FIRST_COMPLETED).done:
                number, process = running.pop(job)
                done[number] = job
                if not _returned(job, process):
                    waiting.clear()
            while following in done:
                yield _result(done.pop(following))
                following += 1
    finally:
        for _, process in running.values():
            killed(process)


def _started(function: Callable[..., T], given: tuple[Any, ...]) -> tuple[Future[T], loky.ProcessPoolExecutor]:
    """The job in an idle process that is well, else in a new one."""
    while True:
        try:
            process = _idle.pop()
        except IndexError:
            process = new(IDLE)
        job = submitted(process, function, given)
        if job is not None:
            return job, process
        killed(process)


def _returned(job: Future[T], process: loky.ProcessPoolExecutor) -> bool:
    """Whether a job has a result; its process goes on, or is killed after a failure of its ngspice."""
    error = job.exception()
    if isinstance(error, BrokenProcessPool | CircuitError) or len(_idle) >= workers():
        killed(process)
    else:
        _idle.append(process)
    return error is None


def _result(job: Future[T]) -> T:
    try:
        return job.result()
    except BrokenProcessPool:
        raise CircuitError(
            "ngspice ended abruptly (crash or out of memory) in its worker process: "
            "try a shorter `duration` or fewer `trajectories`, and check the netlist"
        ) from None
