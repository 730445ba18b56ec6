"""Locks between processes: a file that one holds at a time, until it is done or ends."""

import fcntl
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

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

    None where files cannot be locked, or the other process has not done with it in `LONGEST_TURN`.
    """
    end = time.monotonic() + LONGEST_TURN
    try:
        file = path.open("ab")
        while time.monotonic() < end:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                time.sleep(0.02)
            else:
                return file
        file.close()
    except OSError:
        pass
    return None


def unlock(file: IO[bytes] | None) -> None:
    """Let the next process have a file."""
    if file is not None:
        file.close()
