"""Runs of engines for devices on the workers of a study: each answer as soon as it is there."""

import time
from collections import deque
from collections.abc import Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass
from enum import Enum
from typing import Any

from harvester.answers.estimate import Estimate
from harvester.engines.protocol import Engine
from harvester.errors import HarvesterError, SimulationError, named
from harvester.machine import processes
from harvester.machine.cores import cores, limited_environment, use_one_core
from harvester.machine.execution import Execution
from harvester.scene.scene import Scene

PATIENCE = 20.0  # seconds that a scheduler may be without workers
LOOK = 1.0  # seconds without an answer after which the workers are counted
GONE = (CancelledError, BrokenExecutor, RuntimeError)  # what an executor states that is no more

DISAPPEARED = "the executor has disappeared: start another"


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


def compute_on_one_core(run: DeviceRun) -> DeviceAnswer:
    """The answer of a run on one core, as each worker of an executor should."""
    use_one_core()
    return compute(run)


def _lost(run: DeviceRun, error: BaseException) -> DeviceAnswer:
    """The answer of a run that a worker did not end."""
    lost = SimulationError(f"its worker process ended: {type(error).__name__}: {error}")
    return DeviceAnswer(run, (lost,) * len(run.scenes), 0.0)


def _answer_of(run: DeviceRun, job: "Future[DeviceAnswer]") -> DeviceAnswer:
    """The answer of a run by an executor; SimulationError if this has disappeared."""
    try:
        return job.result()
    except GONE:  # no error of the run, which is in its answer
        raise SimulationError(DISAPPEARED) from None
    except Exception as error:  # Dask's, of a run that ended several workers
        return _lost(run, error)


class DeviceWorkers:
    """Workers until `close`: processes of this machine, or those of an executor."""

    def __init__(self, execution: Execution) -> None:
        client: Any = execution.executor
        self._client = client
        self._executor = client
        # each worker of an executor computes on one core
        self.count = execution.workers or getattr(client, "_max_workers", None) or cores()
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
        """The answers of processes; a run whose process ended is tried once more."""
        env = limited_environment(max(1, cores() // self.count))
        again: deque[DeviceRun] = deque()
        repeated: list[DeviceRun] = []

        def start() -> Any:
            run = again.popleft() if again else next(runs, None)
            if run is None:
                return None
            return run, *processes.submit_to_one(
                self._idle, lambda: processes.create(env=env), compute, (run,)
            )

        for run, job, process in processes.completed(start, self.count):
            if (error := job.exception()) is None:
                self._idle.append(process)
                yield job.result()
                continue
            processes.kill(process)
            if any(run is before for before in repeated):
                yield _lost(run, error)
            else:
                repeated.append(run)
                again.append(run)

    def _by_executor(self, runs: Iterator[DeviceRun]) -> Iterator[DeviceAnswer]:
        """The answers of an executor, which itself repeats runs of lost workers, if it does.

        Raises SimulationError if it disappears, or has no worker for `PATIENCE`.
        """
        pending: dict[Future[DeviceAnswer], DeviceRun] = {}
        try:
            while True:
                while len(pending) < self.count and (run := next(runs, None)) is not None:
                    pending[self._submit(run)] = run
                if not pending:
                    return
                for job in self._first_done(pending):
                    run = pending.pop(job)
                    yield _answer_of(run, job)
        finally:
            for job in pending:
                job.cancel()

    def _submit(self, run: DeviceRun) -> "Future[DeviceAnswer]":
        try:
            job: Future[DeviceAnswer] = self._executor.submit(compute_on_one_core, run)
        except GONE:
            raise SimulationError(DISAPPEARED) from None
        return job

    def _first_done(self, pending: Collection[Future[DeviceAnswer]]) -> set[Future[DeviceAnswer]]:
        """The jobs that are done, one or more."""
        seen = time.monotonic()
        while True:
            if done := wait(pending, LOOK, return_when=FIRST_COMPLETED).done:
                return done
            if not hasattr(self._client, "nthreads") or self._client.nthreads():
                seen = time.monotonic()
            elif time.monotonic() - seen > PATIENCE:
                raise SimulationError("the Dask scheduler has lost all its workers: start some")

    def close(self) -> None:
        """End the processes."""
        while self._idle:
            processes.kill(self._idle.pop())
