"""Locks between processes: a file that one holds at a time, until it is done or ends."""

import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from harvester.machine.system import this_system

LONGEST_TURN = 60.0  # seconds that others wait for a process, which may have been stopped meanwhile


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Hold the lock of a file."""
    held = locked(path)
    try:
        yield
    finally:
        unlock(held)


def locked(path: Path) -> IO[bytes] | None:
    """A file, locked as soon as no other process has it locked, which ends with that process.

    None if files cannot be locked, if a pipe stands in the file's place, or if the other
    process has not done with it in `LONGEST_TURN`.
    """
    end = time.monotonic() + LONGEST_TURN
    try:
        file = os.fdopen(this_system.open_to_lock(path), "r+b", buffering=0)
    except OSError:
        return None
    while stat.S_ISREG(os.fstat(file.fileno()).st_mode) and time.monotonic() < end:
        try:
            if this_system.lock(file.fileno()):
                return file
            time.sleep(0.02)
        except OSError:
            break
    file.close()
    return None


def unlock(file: IO[bytes] | None) -> None:
    """Let the next process have a file."""
    if file is not None:
        file.close()
