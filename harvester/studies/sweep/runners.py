"""The ways to compute the tasks of a sweep: in this process, in a pool, or by an executor, with the same answers.

Each yields tasks with their answers, in the order in which they are done, and leaves nothing
running when it ends: by an error, because nobody asks for more, or because the program died.
"""

import itertools
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeAlias

from harvester.errors import HarvesterError, SimulationError
from harvester.machine.cores import cores, limited_environment, use_one_core
from harvester.machine.progress import Progress, row_lasts
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.tasks import Answer, Task, compute, compute_alone

AHEAD = 4  # tasks with an executor for each thread of its workers, at least `FEWEST`
FEWEST = 64
PATIENCE = 20.0  # seconds that an executor may be without workers
LEAVING = 2.0  # s that a worker which goes may still be counted as there
LOOK = 1.0  # seconds without an answer after which the workers are counted

Process = Any  # loky's, which is loaded if it is needed
GONE = (CancelledError, BrokenExecutor, RuntimeError)  # what an executor states that is no more
Job: TypeAlias = Future[list[Answer]]
Done: TypeAlias = Generator[tuple[Task, list[Answer]], None, None]


def in_this_process(tasks: Iterator[Task]) -> Done:
    """Compute the tasks one after the other in this process, which may use all cores."""
    for task in tasks:
        yield task, compute(task)


def pool(
    tasks: Iterator[Task], workers: int, meanwhile: Callable[[], object] | None = None
) -> Done:
    """Compute the tasks in a number of worker processes, which share the cores.

    ``meanwhile`` is called once.

    A process that dies is replaced; its task is tried once more, a batch then point by point, and
    is an error if that dies as well.
    """
    from harvester.machine import processes

    env = limited_environment(max(1, cores() // workers))
    idle: deque[Process] = deque()
    again: deque[Task] = deque()

    def start() -> tuple[Task, Future[tuple[list[Answer], bool]], Process] | None:
        """Start the next task in an idle process, else in a new one; a repeated task comes first."""
        task = again.popleft() if again else next(tasks, None)
        if task is None:
            return None
        return task, *processes.submit_to_one(
            idle, lambda: processes.create(env=env), compute_alone, (task,)
        )

    try:
        for task, job, process in processes.completed(start, workers, meanwhile):
            if isinstance(job.exception(), BrokenProcessPool):
                processes.kill(process)
                repeats = task.again()
                again.extend(repeats)
                if not repeats:
                    yield task, task.lost()
            else:
                answers, sound = job.result()
                idle.append(process) if sound else processes.kill(process)
                yield task, answers
    finally:
        for process in idle:
            processes.kill(process)


def by_executor(tasks: Iterator[Task], executor: Any) -> Done:
    """Compute the tasks by an executor of `concurrent.futures`, or the client of a Dask scheduler, on a core each.

    Dask gives a task whose worker died to another worker; one that ended several is computed point
    by point, and a point that did is an error.

    Raises SimulationError if the executor disappears while it is needed, or has no worker for
    `PATIENCE`.
    """
    name = (
        f"the Dask scheduler at {executor.scheduler.address}"
        if hasattr(executor, "scheduler")
        else "the executor"
    )
    try:
        yield from _by_executor(tasks, executor, name)
    except HarvesterError:
        raise
    except Exception as error:
        is_there = (
            executor.status == "running"
            if hasattr(executor, "status")
            else not isinstance(error, GONE)
        )
        if is_there:
            raise
        raise SimulationError(f"{name} has disappeared: start another, and `resume`") from None


def _by_executor(tasks: Iterator[Task], executor: Any, name: str) -> Done:
    submit = (
        executor.get_executor(pure=False).submit
        if hasattr(executor, "get_executor")
        else executor.submit
    )
    ahead = (
        max(AHEAD * sum(executor.nthreads().values()), FEWEST)
        if hasattr(executor, "nthreads")
        else FEWEST
    )
    pending = {submit(compute_on_one_core, task): task for task in itertools.islice(tasks, ahead)}
    try:
        for job in _as_completed(pending, executor, name):
            task = pending.pop(job)
            repeats: list[Task] = []
            try:
                answers = job.result()
            except (HarvesterError, *GONE):
                raise
            except Exception as error:
                if type(error).__name__ == "KilledWorker":
                    repeats, answers = task.split(), task.lost()
                elif _has_lost_its_workers(executor):
                    repeats = [task]
                else:
                    why = f"{type(error).__name__}: {error}"
                    raise SimulationError(
                        f"a worker must run this version of harvester, but fails: {why}"
                    ) from None
            if not repeats:
                yield task, answers
            for new in itertools.chain(repeats, itertools.islice(tasks, 1)):
                pending[submit(compute_on_one_core, new)] = new
    finally:
        for job in pending:
            job.cancel()


def _has_lost_its_workers(executor: Any) -> bool:
    """Whether the last worker of a Dask scheduler disappears: an error of a task then is not the task's error."""
    if not hasattr(executor, "nthreads"):
        return False
    end = time.monotonic() + LEAVING
    while time.monotonic() < end:
        if not executor.nthreads():
            return True
        time.sleep(LOOK / 10.0)
    return False


def _as_completed(pending: Mapping[Job, Task], executor: Any, name: str) -> Iterator[Job]:
    """The jobs that are done, as they are done; SimulationError without a worker for `PATIENCE`."""
    seen = time.monotonic()
    while pending:
        done, _ = wait(pending, LOOK, FIRST_COMPLETED)
        yield from done
        if done or not hasattr(executor, "nthreads") or executor.nthreads():
            seen = time.monotonic()
        elif time.monotonic() - seen > PATIENCE:
            raise SimulationError(f"{name} has lost all its workers: start some, and `resume`")


def compute_on_one_core(task: Task) -> list[Answer]:
    """Compute a task on one core, as each worker of an executor should."""
    use_one_core()
    return compute(task)


class Paces:
    """How long a row of each engine lasts, reported to a ``progress`` from the first task on.

    It is the mean of the seconds that the rows state over the number of tasks at a time: a clock
    would include the start of processes.
    """

    def __init__(self, progress: Progress, at_once: int) -> None:
        self._progress = progress
        self._at_once = at_once
        self._sums: dict[str, tuple[float, int]] = {}

    def add(self, name: str, answers: Sequence[Answer]) -> None:
        """Count the answers of a task; those without seconds do not count."""
        new = [row.seconds for row in answers if isinstance(row, SweepRow) and row.seconds]
        before, count = self._sums.get(name, (0.0, 0))
        self._sums[name] = before + sum(new), count + len(new)
        total, count = self._sums[name]
        if count:
            row_lasts(self._progress, name, total / count / self._at_once)


def tasks_at_once(executor: Any, workers: int) -> int:
    """How many tasks an executor, or else so many workers, compute at a time."""
    if executor is None:
        return workers
    if hasattr(executor, "nthreads"):  # a client of Dask, whose workers may all be about to start
        return max(int(sum(executor.nthreads().values())), 1)
    return int(getattr(executor, "_max_workers", 1))
