"""The client of a Dask scheduler as an executor: its address is checked, and an error there is one line."""

import asyncio
import logging
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from typing import Any

from harvester.errors import InputError, MissingProgramError, invalid
from harvester.machine.provenance import without_password

LOGGERS = ("distributed", "tornado", "asyncio")
PATIENCE = 20.0  # seconds for the scheduler to answer and to have a worker


def client_of(address: str | None) -> AbstractContextManager[Any]:
    """`dask_client`, or None without an address."""
    return nullcontext() if address is None else dask_client(address)


@contextmanager
def dask_client(address: str) -> Iterator[Any]:
    """The client of the Dask scheduler at an address such as tcp://host:8786, for `harvester.Execution`.

    Raises MissingProgramError if Dask is not installed; InputError if no scheduler answers, or has
    no workers.
    """
    with _without_tracebacks():
        client = _connected(address)
        try:
            yield client
        finally:
            client.close(timeout=5)


@contextmanager
def _without_tracebacks() -> Iterator[None]:
    """Keep Dask from logging: a failure here is raised as one line."""
    with suppress(ImportError):
        import distributed  # noqa: F401  # its loggers
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in LOGGERS]
    loggers = [logger for name in names if not (logger := logging.getLogger(name)).disabled]
    for logger in loggers:
        logger.disabled = True
    try:
        yield
    finally:
        for logger in loggers:
            logger.disabled = False


def _says_that_it_is_one(address: str) -> bool:
    """Whether a Dask scheduler answers at an address, in the language of this version of Dask.

    Raises OSError if nothing answers in `PATIENCE`, and as Dask's Security without certificates.
    """
    from distributed import Security
    from distributed.comm.core import connect

    async def asked() -> Any:
        """Ask for its identity, and be done with it."""
        arguments = Security().get_connection_args("client")
        stream = await connect(address, timeout=PATIENCE, **arguments)
        try:
            await stream.write({"op": "identity", "reply": True})
            return await stream.read()
        finally:
            stream.abort()

    async def in_time() -> Any:
        """Ask, for at most `PATIENCE`."""
        return await asyncio.wait_for(asked(), PATIENCE)

    try:
        with ThreadPoolExecutor(1) as pool:  # a notebook has a loop of its own in this thread
            answer = pool.submit(asyncio.run, in_time()).result()
    except (OSError, ValueError, TypeError):
        raise
    except Exception:  # whatever Dask makes of another program's bytes, such as MemoryError
        return False
    return isinstance(answer, dict) and answer.get("type") == "Scheduler"


def _connected(address: str) -> Any:
    """The client of a scheduler that answers and has workers; raises as `dask_client`."""
    try:
        from distributed import Client
        from distributed.comm.addressing import get_address_host_port
    except ImportError:
        raise MissingProgramError(
            "`scheduler` must have Dask installed, but it is not: pip install 'piezo-harvester[dask]'"
        ) from None
    must = (
        "be the address of a Dask scheduler that answers, such as tcp://host:8786 "
        "(tls: with Dask's certificates set)"
    )
    # Dask itself would wait a minute for no port, and without end for one that says nothing.
    try:
        socket.create_connection(get_address_host_port(address, strict=True), PATIENCE).close()
        is_scheduler = _says_that_it_is_one(address)
        client = Client(address, timeout=PATIENCE) if is_scheduler else None
    except (OSError, ValueError, TypeError):  # the last without certificates
        raise invalid("`scheduler`", must, without_password(address)) from None
    if client is None:
        raise InputError(
            f"`scheduler` must {must}, but another program answers at {without_password(address)!r}"
        )
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        client.close(timeout=5)
        raise InputError(
            f"`scheduler` must have workers, but {address} has none: dask worker {address}"
        ) from None
    return client
