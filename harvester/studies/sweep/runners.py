"""The ways to compute the tasks of a sweep: in this process, or in a pool of processes, with the same answers.

Each yields tasks with their answers, in the order in which they are done, and leaves nothing running when it ends: by
an error, because nobody asks for more, or because the program died.  Dask's workers are in `cluster`.
"""

from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from harvester.machine.cores import cores, limited_environment
from harvester.studies.sweep.tasks import Answer, Task, compute

Process = Any  # loky's, which is loaded where it is needed
Done = Generator[tuple[Task, list[Answer]], None, None]


def here(tasks: Iterator[Task]) -> Done:
    """Compute the tasks one after the other in this process, which may use all cores."""
    for task in tasks:
        yield task, compute(task)


def pool(tasks: Iterator[Task], workers: int) -> Done:
    """Compute the tasks in a number of worker processes, which share the cores.

    A process that dies is replaced; its task is tried once more, a batch then point by point, and is an error if
    that dies, too.
    """
    from harvester.machine import processes

    env = limited_environment(max(1, cores() // workers))
    crew: set[Process] = set()
    idle: deque[Process] = deque()
    running: dict[Future[list[Answer]], tuple[Task, Process]] = {}
    again: deque[Task] = deque()

    def start(task: Task) -> None:
        while True:
            process = idle.popleft() if idle else processes.create(env=env)
            crew.add(process)
            job = processes.submit(process, compute, (task,))
            if job is not None:
                running[job] = task, process
                return
            end(process)

    def end(process: Process) -> None:
        crew.discard(process)
        processes.kill(process)

    try:
        while True:
            while len(running) < workers:
                task = again.popleft() if again else next(tasks, None)
                if task is None:
                    break
                start(task)
            if not running:
                return
            for job in wait(running, return_when=FIRST_COMPLETED).done:
                task, process = running.pop(job)
                try:
                    answers = job.result()
                except BrokenProcessPool:
                    end(process)
                    further = task.again()
                    again.extend(further)
                    if not further:
                        yield task, task.lost()
                else:
                    idle.append(process)
                    yield task, answers
    finally:
        for process in crew:
            processes.kill(process)
