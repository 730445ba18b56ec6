"""What a sweep or a response has done so far: an SQLite database beside its files, until these are whole.

Each finished task is one transaction, so that whatever ends the program costs the points in flight only.  The database
does not wait for the disk: a failure of the machine's power may damage it, and then costs what came after sweep.csv was
last written (of a response: all).

Each row has a checksum of all that it says, of the sweep, and of the versions that made it.  It finds accidents and
edits by hand; it has no secret, so that it keeps no forger out.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from errno import ENOSPC
from pathlib import Path
from typing import Any

from harvester.errors import InputError, shown
from harvester.studies.sweep.rows import COLUMNS, Row

VERSIONS = ("harvester", "numpy", "scipy", "numba", "PySpice", "ngspice")  # of which last digits may depend

JournalRow = tuple[int, int, Row]  # point, place of the engine in the sweep, row without the varied keys

_CACHE = 200  # KiB: a long sweep does not grow


@dataclass(frozen=True)
class JournalKind:
    """What a study keeps: its ``name``, the columns of its rows, and what of its provenance makes it the same study.

    Of the columns "engine" is the first, and "warnings" one; ``remedy`` is what removing a damaged journal leads to.
    """

    name: str
    columns: tuple[str, ...]
    same: tuple[str, ...]
    remedy: str = "to begin anew"

    @property
    def file(self) -> str:
        """The name of its journal."""
        return f"{self.name}.journal"


SWEEP = JournalKind(
    "sweep", COLUMNS, ("scene_digest", "netlist", "points", "vary", "engines"), "to go on from sweep.csv"
)


def identity(about: Mapping[str, Any], kind: JournalKind = SWEEP) -> dict[str, str]:
    """A hash of each thing in a study's provenance that makes it the same study, and the versions that compute it."""
    about = {"points": "grid", **about}  # which the files of earlier versions do not say
    found = about.get("versions")
    versions = (
        ", ".join(f"{name} {found[name]}" for name in VERSIONS if name in found) if isinstance(found, dict) else ""
    )
    return {what: _hash(json.dumps(about.get(what), default=str)) for what in kind.same} | {"versions": versions}


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()[:16]


def noted(row: Row, before: str, now: str) -> Row:
    """A row that the versions ``before`` made, with a warning that says so where ``now`` they are others."""
    made, others = before.split(", "), now.split(", ")
    if not before or set(made) == set(others):
        return row
    old, new = (", ".join(one for one in some if one not in rest) for some, rest in ((made, others), (others, made)))
    warning = f"kept from {old or 'fewer packages'}, now {new or 'fewer packages'}: last digits may differ"
    return row | {"warnings": "; ".join(filter(None, (warning, row["warnings"])))}


def check_same(out: Path, before: object, now: Mapping[str, str], kind: JournalKind = SWEEP) -> None:
    """Raise InputError, with what differs, where the identity of the earlier study in a folder is not that of now."""
    for what in kind.same:
        if not isinstance(before, dict) or before.get(what) != now[what]:
            raise InputError(
                f"`resume` must continue the same {kind.name}, but {what} in {str(out)!r} is another: use another `out`"
            )


def _checksum(sweep: Mapping[str, str], point: int, place: int, cells: Sequence[object]) -> str:
    return _hash(repr((sorted(sweep.items()), point, place, list(cells))))


class Journal:
    """The finished rows of the study that writes into a folder, on disk; one program at a time may hold it.

    Raises InputError where another program is at work in the folder.
    """

    def __init__(self, out: Path, kind: JournalKind = SWEEP) -> None:
        self.kind, self.path = kind, out / kind.file
        self._files = self.path, out / f"{kind.file}-journal"  # SQLite's own, of a transaction
        self._cells = ", ".join(kind.columns)
        self._identity: dict[str, str] = {}
        self._database: sqlite3.Connection | None = None
        self._folder, self._locks = os.open(out, os.O_RDONLY), True
        try:
            fcntl.flock(self._folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._folder)
            busy = f"another {kind.name} is writing"
            raise InputError(f"`out` must be no folder that {busy}, but {str(out)!r} is") from None
        except OSError:  # a file system without locks
            self._locks = False

    def earlier(self, now: Mapping[str, str]) -> list[JournalRow] | None:
        """The rows of an earlier run of the same sweep, `noted`; None where there is no journal, or it is damaged.

        Raises InputError where the journal is that of another sweep, and for a row that was changed since or added.
        """
        if not self.path.exists():
            return None
        try:
            if self._execute("PRAGMA quick_check").fetchone() != ("ok",):
                return None
            before = dict(self._execute("SELECT what, hash FROM identity"))
            asked = f"SELECT point, place, {self._cells}, checksum FROM rows ORDER BY point, place"
            found = self._execute(asked).fetchall()
        except sqlite3.DatabaseError:
            return None
        check_same(self.path.parent, before, now, self.kind)
        rows: list[JournalRow] = []
        for point, place, *cells, checksum in found:
            if checksum != _checksum(before, point, place, cells):
                raise InputError(
                    f"`resume` must find {self.path.name} as it was written, but its row of point {point} and engine "
                    f"{shown(cells[0])} was changed or added since: remove {str(self.path)!r} {self.kind.remedy}"
                )
            rows.append((point, place, noted(self._row(cells), before["versions"], now["versions"])))
        return rows

    def begin(self, now: Mapping[str, str], kept: Sequence[JournalRow]) -> None:
        """Start the journal of a study with the rows of an earlier run that are kept; raises InputError as `add`."""
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
            texts = ", ".join(f"{name} TEXT NOT NULL" for name in (*self.kind.columns, "checksum"))
            for table, columns in (
                ("identity", "(what TEXT PRIMARY KEY, hash TEXT NOT NULL)"),
                ("rows", f"(point INTEGER, place INTEGER, {texts}, PRIMARY KEY (point, place)) WITHOUT ROWID"),
            ):
                self._execute(f"DROP TABLE IF EXISTS {table}")
                self._execute(f"CREATE TABLE {table} {columns}")
            self._connected().executemany("INSERT INTO identity VALUES (?, ?)", now.items())
            self._insert(kept)

    def has(self, point: int, place: int) -> bool:
        """Whether there is a row of an engine at a point."""
        found = self._execute("SELECT 1 FROM rows WHERE point = ? AND place = ?", (point, place))
        return found.fetchone() is not None

    def add(self, rows: Sequence[JournalRow]) -> None:
        """Write rows, all at once; InputError where the disk does not take them, and then none of them."""
        with self._transaction():
            self._insert(rows)

    def rows(self) -> Iterator[JournalRow]:
        """All rows in the order of the points, from the disk; raises InputError as `add`."""
        with self._told():
            found = self._execute(f"SELECT point, place, {self._cells} FROM rows ORDER BY point, place")
            for point, place, *cells in found:
                yield point, place, self._row(cells)

    def count(self) -> int:
        """How many rows there are."""
        return int(self._execute("SELECT count(*) FROM rows").fetchone()[0])

    def close(self) -> None:
        """Let go of the folder; the file stays."""
        self._disconnect()
        if self._folder >= 0:
            os.close(self._folder)
        self._folder = -1

    def remove(self) -> None:
        """Delete the file of a study whose own files are whole."""
        self._disconnect()
        self.path.unlink(missing_ok=True)

    def _row(self, cells: Sequence[str]) -> Row:
        return dict(zip(self.kind.columns, cells, strict=True))

    def _connected(self) -> sqlite3.Connection:
        if self._database is None:
            for path in self._files:
                if path.exists() and not path.is_file():  # SQLite would wait for a pipe's writer
                    raise InputError(
                        f"`out` must take {self.path.name}, but there is a {path.name} that is no file: remove it"
                    )
            address = f"{self.path.absolute().as_uri()}?nolock={int(not self._locks)}"
            self._database = sqlite3.connect(address, uri=True, isolation_level=None)
            self._database.executescript(f"PRAGMA synchronous = OFF; PRAGMA cache_size = -{_CACHE}")
        return self._database

    def _disconnect(self) -> None:
        if self._database is not None:
            self._database.close()
        self._database = None

    def _execute(self, statement: str, values: Sequence[int] = ()) -> sqlite3.Cursor:
        return self._connected().execute(statement, values)

    def _insert(self, rows: Sequence[JournalRow]) -> None:
        marks = ", ".join("?" * (3 + len(self.kind.columns)))
        whole = ((point, place, [row[name] for name in self.kind.columns]) for point, place, row in rows)
        summed = (
            (point, place, *cells, _checksum(self._identity, point, place, cells)) for point, place, cells in whole
        )
        self._connected().executemany(f"INSERT OR REPLACE INTO rows VALUES ({marks})", summed)

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Tell a disk that takes no more; reading needs room too, where a transaction that failed must be undone."""
        try:
            yield
        except sqlite3.OperationalError as error:
            why = os.strerror(ENOSPC) if error.sqlite_errorcode == sqlite3.SQLITE_FULL else error
            raise InputError(
                f"`out` must take {self.path.name}, but writing failed: {why}; the points that are done are kept for "
                "`resume`"
            ) from None

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._told(), self._connected() as database:
            database.execute("BEGIN IMMEDIATE")
            yield
