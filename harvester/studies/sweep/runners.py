"""The ways to compute the tasks of a sweep: in this process, or in a pool of processes, with the same answers.

Each yields tasks with their answers, in the order in which they are done, and leaves nothing running when it ends: by
an error, because nobody asks for more, or because the program died.  Dask's workers are in `cluster`.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from harvester.machine.cores import cores, limited_environment
from harvester.studies.sweep.tasks import Answer, Task, compute, compute_alone

Process = Any  # loky's, which is loaded where it is needed
Done = Generator[tuple[Task, list[Answer]], None, None]


def here(tasks: Iterator[Task]) -> Done:
    """Compute the tasks one after the other in this process, which may use all cores."""
    for task in tasks:
        yield task, compute(task)


def pool(tasks: Iterator[Task], workers: int, meanwhile: Callable[[], object] | None = None) -> Done:
    """Compute the tasks in a number of worker processes, which share the cores; ``meanwhile`` is called once beside it.

    A process that dies is replaced; its task is tried once more, a batch then point by point, and is an error if
    that dies, too.
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
        return task, *processes.submit_to_one(idle, lambda: processes.create(env=env), compute_alone, (task,))

    try:
        for task, job, process in processes.completed(start, workers, meanwhile):
            if isinstance(job.exception(), BrokenProcessPool):
                processes.kill(process)
                further = task.again()
                again.extend(further)
                if not further:
                    yield task, task.lost()
            else:
                answers, sound = job.result()
                idle.append(process) if sound else processes.kill(process)
                yield task, answers
    finally:
        for process in idle:
            processes.kill(process)
