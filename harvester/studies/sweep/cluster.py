"""The tasks of a sweep on the workers of a Dask scheduler, on this machine or many."""

import itertools
import logging
import os
import socket
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from harvester.errors import HarvesterError, InputError, MissingProgramError, SimulationError, invalid
from harvester.machine.cores import THREADS_VARIABLE
from harvester.studies.sweep.runners import Done
from harvester.studies.sweep.tasks import Answer, Task, compute

AHEAD = 4  # tasks with the scheduler for each thread of its workers, at least `FEWEST`
FEWEST = 64
LOGGERS = ("distributed", "tornado", "asyncio")
PATIENCE = 20.0  # seconds for the scheduler to answer and to have a worker
LOOK = 1.0  # seconds without an answer after which the workers are counted


def dask(tasks: Iterator[Task], address: str) -> Done:
    """Compute the tasks by the workers of a Dask scheduler, each of whose threads has one core.

    Dask gives a task whose worker died to another worker; a task that ended several is an error.

    Raises MissingProgramError where Dask is not installed; InputError where no scheduler answers, or has no workers;
    SimulationError where it or all its workers go while they are needed.
    """
    with _without_tracebacks():
        client = _client(address)
        try:
            yield from _computed(client, tasks, address)
        except HarvesterError:
            raise
        except Exception:
            if client.status == "running":
                raise
            raise _gone(address) from None
        finally:
            client.close(timeout=5)


def _gone(address: str) -> SimulationError:
    return SimulationError(f"the Dask scheduler at {address} has gone: start another, and `resume`")


def _computed(client: Any, tasks: Iterator[Task], address: str) -> Done:
    """The tasks with their answers; an error is one of `dask`'s, or Dask's own where the scheduler goes."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    pending: dict[str, Task] = {}

    def submitted(some: Iterable[Task]) -> list[Any]:
        futures = []  # none of them pure: a point may be listed twice
        for task in some:
            futures.append(client.submit(compute_on_one_core, task, pure=False))
            pending[futures[-1].key] = task
        return futures

    ahead = max(AHEAD * sum(client.nthreads().values()), FEWEST)
    done = as_completed(submitted(itertools.islice(tasks, ahead)), with_results=True, raise_errors=False)
    for future, found in _while_there_are_workers(done, client, address):
        task = pending.pop(future.key)
        done.update(submitted(itertools.islice(tasks, 1)))
        if isinstance(found, list):  # the answers, also where their worker went after it had given them
            yield task, found
        elif future.status != "error":
            raise _gone(address)
        elif isinstance(found[1], HarvesterError):
            raise found[1]
        elif not isinstance(found[1], KilledWorker):
            why = f"{type(found[1]).__name__}: {found[1]}"
            raise SimulationError(f"a Dask worker must run this version of harvester, but fails with {why}")
        elif further := task.split():
            done.update(submitted(further))
        else:
            yield task, task.lost()


def _while_there_are_workers(done: Any, client: Any, address: str) -> Iterator[tuple[Any, Any]]:
    """What is done, as it is done; SimulationError where the scheduler has no worker for `PATIENCE`."""
    seen = time.monotonic()
    while done.count():
        alone = time.monotonic() - seen
        if done.has_ready():
            yield next(done)
            seen = time.monotonic()
        elif alone < LOOK:
            time.sleep(0.02)
        elif client.nthreads():
            seen = time.monotonic()
        elif alone > PATIENCE:
            raise SimulationError(f"the Dask scheduler at {address} has lost all its workers: start some, and `resume`")
        else:
            time.sleep(LOOK)


@contextmanager
def _without_tracebacks() -> Iterator[None]:
    """Keep Dask from logging: of what goes wrong here, one line is raised."""
    with suppress(ImportError):
        import distributed  # noqa: F401  # its loggers
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in LOGGERS]
    loggers = [one for name in names if not (one := logging.getLogger(name)).disabled]
    for one in loggers:
        one.disabled = True
    try:
        yield
    finally:
        for one in loggers:
            one.disabled = False


def compute_on_one_core(task: Task) -> list[Answer]:
    """Compute a task on one core, as each thread of a Dask worker should."""
    os.environ.setdefault(THREADS_VARIABLE, "1")
    return compute(task)


def _client(address: str) -> Any:
    """The client of a scheduler that answers and has workers; raises as `dask`."""
    try:
        from distributed import Client
        from distributed.comm.addressing import get_address_host_port
    except ImportError:
        raise MissingProgramError(
            "`scheduler` must have Dask installed, but it is not: pip install 'piezo-harvester[dask]'"
        ) from None
    must = (
        "be the address of a Dask scheduler that answers, such as tcp://host:8786 (tls: with Dask's certificates set)"
    )
    try:  # Dask itself would take a minute to give up, and not in one line
        socket.create_connection(get_address_host_port(address, strict=True), PATIENCE).close()
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError, TypeError):  # the last without certificates
        raise invalid("`scheduler`", must, address) from None
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        client.close(timeout=5)
        raise InputError(f"`scheduler` must have workers, but {address} has none: dask worker {address}") from None
    return client
