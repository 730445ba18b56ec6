"""Runs of engines for devices on the workers of a study: each answer as soon as it is there."""

import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from enum import Enum
from typing import Any

from harvester.answers.estimate import Estimate
from harvester.engines.protocol import Engine
from harvester.errors import HarvesterError, SimulationError, named
from harvester.machine import processes
from harvester.machine.cores import cores, limited_environment
from harvester.machine.execution import Execution
from harvester.scene.scene import Scene


@dataclass(frozen=True)
class DeviceRun:
    """A run of an ``engine`` for ``scenes``; the first is the ``index``-th of its ``kind``."""

    kind: Enum
    index: int
    engine: Engine
    scenes: tuple[Scene, ...]


@dataclass(frozen=True)
class DeviceAnswer:
    """The ``answers`` of a run, each an Estimate or its error, and its ``seconds``."""

    run: DeviceRun
    answers: tuple[Estimate | HarvesterError, ...]
    seconds: float


def compute(run: DeviceRun) -> DeviceAnswer:
    """The answer of a run, in whatever process this is."""
    begin = time.monotonic()
    answers: list[Estimate | HarvesterError]
    try:
        answers = run.engine.run_many(run.scenes)
    except Exception as error:  # a defect at one device must not end the study
        answers = [named(error)] * len(run.scenes)
    return DeviceAnswer(run, tuple(answers), time.monotonic() - begin)


class DeviceWorkers:
    """Workers until `close`: processes of this machine, or those of an executor."""

    def __init__(self, execution: Execution) -> None:
        client: Any = execution.executor
        self._executor = client
        self.count = execution.workers or cores()
        if hasattr(client, "get_executor"):  # of a Dask scheduler
            self.count = max(sum(client.nthreads().values()), 1)
            self._executor = client.get_executor(pure=False)
        self._idle = processes.idle_processes()

    def answers(self, runs: Iterator[DeviceRun]) -> Iterator[DeviceAnswer]:
        """The answers as they are ready; a run is drawn from ``runs`` when a worker is free."""
        if self._executor is not None:
            return self._by_executor(runs)
        return map(compute, runs) if self.count == 1 else self._in_processes(runs)

    def _in_processes(self, runs: Iterator[DeviceRun]) -> Iterator[DeviceAnswer]:
        env = limited_environment(max(1, cores() // self.count))

        def start() -> Any:
            run = next(runs, None)
            if run is None:
                return None
            return run, *processes.submit_to_one(
                self._idle, lambda: processes.create(env=env), compute, (run,)
            )

        for run, job, process in processes.completed(start, self.count):
            if (error := job.exception()) is None:
                self._idle.append(process)
                yield job.result()
            else:
                processes.kill(process)
                lost = SimulationError(f"its worker process ended: {error}")
                yield DeviceAnswer(run, (lost,) * len(run.scenes), 0.0)

    def _by_executor(self, runs: Iterator[DeviceRun]) -> Iterator[DeviceAnswer]:
        pending: deque[Future[DeviceAnswer]] = deque()
        try:
            while True:
                while len(pending) < self.count and (run := next(runs, None)) is not None:
                    pending.append(self._executor.submit(compute, run))
                if not pending:
                    return
                for job in wait(pending, return_when=FIRST_COMPLETED).done:
                    pending.remove(job)
                    yield job.result()
        finally:
            for job in pending:
                job.cancel()

    def close(self) -> None:
        """End the processes."""
        while self._idle:
            processes.kill(self._idle.pop())
