"""The progress of a sweep or a response: an SQLite database next to its files, until these are whole.

Each finished task is one transaction, so that whatever ends the program costs the points in flight
only.  The database does not wait for the disk: a failure of the machine's power may damage it, and
then costs the points after the last writing of sweep.csv (of a response: all).

Each row has a checksum of all that it states, of the sweep, and of the versions that made it.  It
finds accidents and edits by hand; it has no secret, so that it keeps no forger out.
"""

import contextlib
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from errno import ENOSPC
from pathlib import Path
from typing import Any

from harvester.errors import InputError, shown
from harvester.machine.system import this_system
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.studies.sweep.same_study import SWEEP, JournalKind, check_same, short_hash

COLUMNS = ("point", "place", "engine", "content", "kept", "checksum")

_CACHE = 200  # KiB: a long sweep does not grow


@dataclass(frozen=True)
class JournalRow:
    """A finished point: which ``point``, by the engine of which ``engine_index``, and the ``content``, as JSON.

    ``kept`` are the versions that made a row which was kept by others, and these, pair by pair.
    """

    point: int
    engine_index: int
    engine: str
    content: str
    kept: tuple[tuple[str, str], ...] = ()

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """A warning for each time that other versions kept it, the last time first."""
        return tuple(
            warning("kept_from_other_versions", before=old, now=new)
            for old, new in reversed(self.kept)
        )

    def seen_by(self, before: str, now: str) -> "JournalRow":
        """The row that the versions ``before`` made, as the versions ``now`` keep it."""
        made, here = before.split(", "), now.split(", ")
        if not before or set(made) == set(here):
            return self
        old, new = (
            ", ".join(p for p in some if p not in rest)
            for some, rest in ((made, here), (here, made))
        )
        return replace(self, kept=(*self.kept, (old or "fewer packages", new or "fewer packages")))


def _checksum(study: Mapping[str, str], cells: Sequence[object]) -> str:
    return short_hash(repr((sorted(study.items()), list(cells))))


def _row(cells: Sequence[Any]) -> JournalRow:
    point, engine_index, engine, content, kept = cells
    return JournalRow(
        point, engine_index, engine, content, tuple((old, new) for old, new in json.loads(kept))
    )


class Journal:
    """The finished rows of the study that writes into a folder, on disk.

    One program at a time may hold it.

    Without a folder they are in memory.

    Raises InputError if another program is at work in the folder.
    """

    def __init__(self, out: Path | None, kind: JournalKind = SWEEP) -> None:
        self.kind = kind
        self.path = (out or Path()) / kind.file
        # SQLite's own, of a transaction
        self._files = [] if out is None else [self.path, out / f"{kind.file}-journal"]
        self._identity: dict[str, str] = {}
        self._database: sqlite3.Connection | None = None
        self._folder = -1
        self._locks = True
        if out is not None:
            self._lock(out)

    def _lock(self, out: Path) -> None:
        self._folder = this_system.open_folder_to_lock(out)
        try:
            free = this_system.lock(self._folder)
        except OSError:  # a file system without locks
            free, self._locks = True, False
        if not free:
            os.close(self._folder)
            busy = f"another {self.kind.name} is writing"
            raise InputError(f"`out` must not be a folder that {busy}, but {str(out)!r} is")

    def earlier(self, now: Mapping[str, str]) -> list[JournalRow] | None:
        """The rows of an earlier run of the same study; None without a journal, or it is damaged.

        Raises InputError if the journal is that of another study or of version 0.1, and for a row
        that was changed since or added.
        """
        if not self.path.exists():
            return None
        try:
            if self._execute("PRAGMA quick_check").fetchone() != ("ok",):
                return None
            before = dict(self._execute("SELECT what, hash FROM identity"))
            names = [column for _, column, *_ in self._execute("PRAGMA table_info(rows)")]
            if set(names) >= {"point", "place", "engine", "warnings", "checksum"}:
                raise InputError(
                    f"`resume` must find {self.path.name} as this version writes it, but version 0.1 wrote it: "
                    f"let that version end its {self.kind.name}, or remove {str(self.path)!r} to begin anew"
                )
            stored = self._execute(
                f"SELECT {', '.join(COLUMNS)} FROM rows ORDER BY point, place"
            ).fetchall()
        except sqlite3.DatabaseError:
            return None
        check_same(self.path.parent, before, now, self.kind)
        rows: list[JournalRow] = []
        for *cells, checksum in stored:
            if checksum != _checksum(before, cells):
                raise InputError(
                    f"`resume` must find {self.path.name} as it was written, but its row of point {cells[0]} and "
                    f"engine {shown(cells[2])} was changed or added since: remove {str(self.path)!r} {self.kind.remedy}"
                )
            rows.append(_row(cells).seen_by(before["versions"], now["versions"]))
        return rows

    def begin(self, now: Mapping[str, str], kept: Sequence[JournalRow]) -> None:
        """Start the journal of a study with the rows of an earlier run that are kept.

        Raises InputError as `add`.
        """
        try:
            self._begin(now, kept)
        except sqlite3.DatabaseError:  # damaged, or no database: a new file in its place
            self._disconnect()
            for path in self._files:
                path.unlink(missing_ok=True)
            self._begin(now, kept)

    def _begin(self, now: Mapping[str, str], kept: Sequence[JournalRow]) -> None:
        self._identity = dict(now)
        with self._transaction():
            texts = ", ".join(f"{name} TEXT NOT NULL" for name in COLUMNS[2:])
            for table, columns in (
                ("identity", "(what TEXT PRIMARY KEY, hash TEXT NOT NULL)"),
                (
                    "rows",
                    f"(point INTEGER, place INTEGER, {texts}, PRIMARY KEY (point, place)) WITHOUT ROWID",
                ),
            ):
                self._execute(f"DROP TABLE IF EXISTS {table}")
                self._execute(f"CREATE TABLE {table} {columns}")
            self._connected().executemany("INSERT INTO identity VALUES (?, ?)", now.items())
            self._insert(kept)

    def has(self, point: int, engine_index: int) -> bool:
        """Whether there is a row of an engine at a point."""
        cursor = self._execute(
            "SELECT 1 FROM rows WHERE point = ? AND place = ?", (point, engine_index)
        )
        return cursor.fetchone() is not None

    def add(self, rows: Sequence[JournalRow]) -> None:
        """Write rows, all at once; InputError if the disk does not accept them, and then none of them."""
        with self._transaction():
            self._insert(rows)

    def rows(self) -> Iterator[JournalRow]:
        """All rows in the order of the points, from the disk; raises InputError as `add`."""
        with self._disk_errors():
            cursor = self._execute(
                f"SELECT {', '.join(COLUMNS[:-1])} FROM rows ORDER BY point, place"
            )
            yield from map(_row, cursor)

    def count(self) -> int:
        """How many rows there are."""
        return int(self._execute("SELECT count(*) FROM rows").fetchone()[0])

    def interrupted(self, whole: str) -> KeyboardInterrupt:
        """The error of ^C, with how many of the ``whole``, such as "9 points", are done, and how to continue."""
        done = f"{self.count()} of {whole} are in {str(self.path.parent)!r}"
        return KeyboardInterrupt(
            f"interrupted: {done}; the same command with `resume` continues from there"
        )

    def close(self) -> None:
        """Release the folder; the file stays."""
        self._disconnect()
        if self._folder >= 0:
            os.close(self._folder)
        self._folder = -1

    def remove(self) -> None:
        """Delete the file of a study whose own files are whole."""
        self._disconnect()
        for path in self._files:
            path.unlink(missing_ok=True)

    def _connected(self) -> sqlite3.Connection:
        if self._database is None:
            for path in self._files:
                # SQLite would wait for a pipe's writer, and follow a link
                if path.is_symlink() or (path.exists() and not path.is_file()):
                    raise InputError(
                        f"`out` must accept {self.path.name}, but there is a {path.name} that is not a file: remove it"
                    )
            address = (
                f"{self.path.absolute().as_uri()}?nolock={int(not self._locks)}"
                if self._files
                else ":memory:"
            )
            self._database = sqlite3.connect(address, uri=bool(self._files), isolation_level=None)
            self._database.executescript(f"PRAGMA synchronous = OFF; PRAGMA cache_size = -{_CACHE}")
        return self._database

    def _disconnect(self) -> None:
        if self._database is not None:
            self._database.close()
        self._database = None

    def _execute(self, statement: str, values: Sequence[int] = ()) -> sqlite3.Cursor:
        return self._connected().execute(statement, values)

    def _insert(self, rows: Sequence[JournalRow]) -> None:
        contents = (
            (row.point, row.engine_index, row.engine, row.content, json.dumps(row.kept))
            for row in rows
        )
        summed = ((*cells, _checksum(self._identity, cells)) for cells in contents)
        marks = ", ".join("?" * len(COLUMNS))
        self._connected().executemany(f"INSERT OR REPLACE INTO rows VALUES ({marks})", summed)

    @contextlib.contextmanager
    def _disk_errors(self) -> Iterator[None]:
        """Report that a disk is full.

        Reading also needs room, if a transaction that failed must be undone.
        """
        try:
            yield
        except sqlite3.OperationalError as error:
            known = {
                sqlite3.SQLITE_FULL: os.strerror(ENOSPC),
                sqlite3.SQLITE_IOERR_WRITE: f"{error} (ulimit -f?)",
            }
            why = known.get(error.sqlite_errorcode, error)
            raise InputError(
                f"`out` must accept {self.path.name}, but writing failed: {why}; the points that are done are kept for "
                "`resume`"
            ) from None

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._disk_errors(), self._connected() as database:
            database.execute("BEGIN IMMEDIATE")
            yield
