"""What a sweep has done so far: a file that only grows, a line of JSON a row, until the table is whole.

A line is written at once and stays what it is, so that whatever ends the program costs the points in flight only.
The first line says which sweep it is.  The journal is beside sweep.csv for as long as the sweep is not finished.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import time
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from harvester.errors import InputError
from harvester.machine import files
from harvester.studies.sweep.table import COLUMNS, Row

NAME = "sweep.journal"
SYNC = 1.0  # seconds between two waits for the disk: what a failure of the machine's power may cost beyond the above
SAME = ("scene_digest", "netlist", "points", "vary", "engines")  # of the provenance: what makes a sweep the same

Kept = tuple[int, int, Row]  # point, place of the engine, row without the varied keys


def identity(whence: Mapping[str, Any]) -> dict[str, str]:
    """A hash of everything that makes a sweep the same."""
    whence = {"points": "grid", **whence}  # which the files of earlier versions do not say
    return {what: hashlib.sha256(json.dumps(whence.get(what), default=str).encode()).hexdigest()[:16] for what in SAME}


def check_same(out: Path, before: object, now: Mapping[str, str]) -> None:
    """InputError, with what differs, where an earlier sweep's identity is another."""
    for what in SAME:
        if not isinstance(before, dict) or before.get(what) != now[what]:
            raise InputError(
                f"`resume` must continue the same sweep, but {what} in {str(out)!r} is another: use another `out`"
            )


def read(out: Path, now: Mapping[str, str]) -> Iterator[Kept] | None:
    """The rows of the journal of the same sweep, damaged lines left out; None where there is none that can be read.

    Raises
    ------
    InputError
        where the journal is that of another sweep.
    """
    try:
        with (out / NAME).open("rb") as file:
            before = json.loads(file.readline())["sweep"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    check_same(out, before, now)
    return _rows(out / NAME)


def _rows(path: Path) -> Iterator[Kept]:
    with path.open("rb") as file:
        next(file)
        for line in file:
            with contextlib.suppress(ValueError, TypeError, KeyError):
                yield _row(line)


def _row(line: bytes) -> Kept:
    if not line.endswith(b"\n"):
        raise ValueError("cut off")
    point, place, *cells = json.loads(line)
    if not (isinstance(point, int) and isinstance(place, int) and all(isinstance(cell, str) for cell in cells)):
        raise TypeError("not a row")
    return point, place, dict(zip(COLUMNS, cells, strict=True))


class Journal:
    """The rows that are done, on disk; in memory only where each stands.

    Raises
    ------
    InputError
        where the disk does not take it, or another program is at work in the folder.
    """

    def __init__(self, out: Path, now: Mapping[str, str], points: int, engines: int, kept: Iterable[Kept]) -> None:
        self.path, self.engines = out / NAME, engines
        self._begins = array("q", [-1]) * (points * engines)
        self.size, self._synced = 0, time.monotonic()
        self._folder = os.open(out, os.O_RDONLY)
        self._file = -1
        try:
            fcntl.flock(self._folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._folder)
            raise InputError(f"`out` must be no folder that another sweep is writing, but {str(out)!r} is") from None
        except OSError:  # a file system without locks
            pass
        files.write(self.path, self._lines(now, kept, points))
        self._file = os.open(self.path, os.O_RDWR | os.O_APPEND)

    def _lines(self, now: Mapping[str, str], kept: Iterable[Kept], points: int) -> Iterator[bytes]:
        first = json.dumps({"sweep": now}).encode() + b"\n"
        self.size = len(first)
        yield first
        for point, place, row in kept:
            if 0 <= point < points and 0 <= place < self.engines:
                line = self._line(point, place, row)
                self.size += len(line)
                yield line

    def _line(self, point: int, place: int, row: Row) -> bytes:
        self._begins[point * self.engines + place] = self.size
        return (json.dumps([point, place, *(row[name] for name in COLUMNS)]) + "\n").encode()

    def has(self, point: int, place: int) -> bool:
        """Whether there is a row of an engine at a point."""
        return self._begins[point * self.engines + place] >= 0

    def add(self, rows: Sequence[Kept]) -> None:
        """Write rows, all at once; InputError where the disk does not take them, and then none of them."""
        whole = self.size
        try:
            for point, place, row in rows:
                line = self._line(point, place, row)
                self.size += len(line)
                while line:
                    line = line[os.write(self._file, line) :]
            if time.monotonic() - self._synced > SYNC:
                os.fsync(self._file)
                self._synced = time.monotonic()
        except OSError as error:
            for point, place, _ in rows:
                self._begins[point * self.engines + place] = -1
            self.size = whole
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, whole)
            raise InputError(
                f"`out` must take {NAME}, but writing failed: {error.strerror}; the points that are done are kept for "
                "`resume`"
            ) from None

    def rows(self) -> Iterator[Kept]:
        """All rows in the order of the points, from the disk."""
        with self.path.open("rb") as file:
            for begin in self._begins:
                if begin >= 0:
                    file.seek(begin)
                    yield _row(file.readline())

    def count(self) -> int:
        """How many rows there are."""
        return sum(begin >= 0 for begin in self._begins)

    def close(self) -> None:
        """Let go of the folder; the file stays."""
        for one in (self._file, self._folder):
            if one >= 0:
                os.close(one)
        self._file = self._folder = -1

    def remove(self) -> None:
        """The table is whole: the journal is not needed any more."""
        self.path.unlink(missing_ok=True)
