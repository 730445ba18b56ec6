"""The journal: whatever ends the program or damages the file, the complete part is kept; another sweep's is refused."""

import errno
import fcntl
import json
import os
import re
import resource
import signal
import sqlite3
import subprocess
import sys

import pytest

from harvester.errors import InputError
from harvester.presentation.diagnostic import warning
from harvester.studies.sweep.journal import Journal, JournalRow
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.same_study import SWEEP, identity
from harvester.uncertainty.value import Value

PARTS = {"scene_digest": "a", "netlist": None, "vary": {"x": [1.0]}, "engines": {}}
NOW = identity(PARTS)


def row(point, place, text):
    """A row with all that one can have."""
    power = Value(float(text), stderr=1e-7, bias=1e-8, dof=2.0, unknown="the tolerance")
    said = (
        warning("not_followed", error='a "µ",\nb'),
        warning("budget_spent", "spice", steps=3, share=0.5, step=None),
    )
    whole = SweepRow("ensemble", Value(0.1, model=0.01), power, 0.25, warnings=said, responses=3)
    assert SweepRow.read(whole.written) == whole
    return JournalRow(point, place, "ensemble", whole.written)


@pytest.fixture
def journal(tmp_path):
    with_nothing = Journal(tmp_path)
    with_nothing.begin(NOW, [])
    yield with_nothing
    with_nothing.close()


def earlier(folder, now=NOW):
    """What a program that resumes finds."""
    found = Journal(folder)
    try:
        return found.earlier(now)
    finally:
        found.close()


def test_rows_come_back_in_order(tmp_path, journal):
    for point, place in ((2, 1), (0, 1), (2, 0)):
        journal.add([row(point, place, f"{point}{place}")])
    expected = [row(0, 1, "01"), row(2, 0, "20"), row(2, 1, "21")]
    assert list(journal.rows()) == expected
    assert [journal.has(p, e) for p, e in ((0, 0), (0, 1), (2, 0))] == [False, True, True]
    assert journal.count() == 3
    journal.close()
    assert earlier(tmp_path) == expected
    again = Journal(tmp_path)
    again.begin(NOW, expected[1:])  # what is not kept is gone
    assert list(again.rows()) == expected[1:]
    again.close()
    assert earlier(tmp_path) == expected[1:]


WRITER = f"""
import itertools, sys
from pathlib import Path
from harvester.studies.sweep.journal import Journal, JournalRow
from harvester.studies.sweep.same_study import identity
journal = Journal(Path(sys.argv[1]))
journal.begin(identity({PARTS!r}), [])
for point in itertools.count():
    journal.add([JournalRow(point, place, "ensemble", str(point)) for place in (0, 1)])
    print(point, flush=True)
"""


@pytest.mark.thorough("test_resume_computes_what_is_missing_or_failed")
@pytest.mark.slow
@pytest.mark.parametrize("points", [1, 7, 40])
def test_a_kill_costs_the_rows_in_flight_only(tmp_path, points):
    """Every row that `add` returned for is there, in whole transactions; the program was writing when it was killed."""
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    for _ in range(points):
        writer.stdout.readline()
    writer.send_signal(signal.SIGKILL)
    told = points + len(writer.communicate()[0].splitlines())
    rows = earlier(tmp_path)
    assert len(rows) in (2 * told, 2 * told + 2)
    assert rows == [
        JournalRow(p, e, "ensemble", str(p)) for p in range(len(rows) // 2) for e in (0, 1)
    ]


@pytest.mark.parametrize("cut", [0, 1, 50, 99, 100, 1000, 4096, 5000, 9000])
def test_a_file_cut_off_is_no_journal(tmp_path, journal, cut):
    """None, so that sweep.csv is read instead; a new one can be begun in its place."""
    journal.add([row(0, 0, "1"), row(1, 0, "2")])
    journal.close()
    whole = (tmp_path / SWEEP.file).read_bytes()
    assert len(whole) > 9000
    (tmp_path / SWEEP.file).write_bytes(whole[:cut])
    assert earlier(tmp_path) is None
    again = Journal(tmp_path)
    again.begin(NOW, [row(1, 0, "2")])
    assert list(again.rows()) == [row(1, 0, "2")]
    again.close()


OLD = b'{"sweep": {"vary": "a"}}\n[0, 0, "averaged"]\n'  # as versions before the database wrote it


@pytest.mark.parametrize(
    "text", [b"", b"x", b"{}\n", b"SQLite format 3\x00", b"\xff\x00" * 5000, OLD]
)
def test_what_is_no_journal(tmp_path, text):
    assert earlier(tmp_path) is None
    assert list(tmp_path.iterdir()) == []  # only asked
    (tmp_path / SWEEP.file).write_bytes(text)
    assert earlier(tmp_path) is None
    begun = Journal(tmp_path)
    begun.begin(NOW, [])
    begun.add([row(0, 0, "1")])
    begun.close()
    assert earlier(tmp_path) == [row(0, 0, "1")]


def test_a_database_of_something_else(tmp_path):
    with sqlite3.connect(tmp_path / SWEEP.file) as database:
        database.execute("CREATE TABLE rows (a, b)")
    database.close()
    assert earlier(tmp_path) is None
    begun = Journal(tmp_path)
    begun.begin(NOW, [row(0, 0, "1")])
    assert begun.count() == 1
    begun.close()


@pytest.mark.parametrize("what", SWEEP.same)
def test_another_sweep_is_refused(tmp_path, journal, what):
    journal.close()
    line = f"`resume` must continue the same sweep, but {what} in '{tmp_path}' is another: use another `out`"
    with pytest.raises(InputError, match=f"^{re.escape(line)}$"):
        earlier(tmp_path, NOW | {what: "b"})


def test_identity_knows_each_part():
    parts = {
        "scene_digest": "a",
        "netlist": "b",
        "points": "list",
        "vary": {"x": [1.0], "y": [2.0]},
        "engines": {},
    }
    other = {"scene_digest": "b", "netlist": None, "points": "grid", "engines": {"spice": {}}}
    other["vary"] = {"y": [2.0], "x": [1.0]}  # another order of the points
    for what, value in other.items():
        one = identity(parts)
        two = identity(parts | {what: value})
        assert [k for k in SWEEP.same if one[k] != two[k]] == [what]
    assert identity(json.loads(json.dumps(parts))) == identity(parts)


def test_one_sweep_a_folder(tmp_path, journal):
    with pytest.raises(
        InputError, match=r"^`out` must not be a folder that another sweep is writing, but '.*' is$"
    ):
        Journal(tmp_path)
    journal.close()
    Journal(tmp_path).close()


def test_a_file_system_without_locks(tmp_path, monkeypatch):
    """If there are none, the journal works without them: two sweeps in one folder are then the user's to avoid."""

    def no_locks(*_):
        raise OSError(errno.ENOTSUP, "no locks")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    made = Journal(tmp_path)
    made.begin(NOW, [])
    made.add([row(0, 0, "1")])
    made.close()
    assert earlier(tmp_path) == [row(0, 0, "1")]


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo])
@pytest.mark.parametrize("name", [SWEEP.file, f"{SWEEP.file}-journal"])
def test_no_file_in_its_place(tmp_path, name, make):
    """A pipe as well, which would be waited for without end."""
    make(tmp_path / name)
    made = Journal(tmp_path)
    line = f"^`out` must accept sweep.journal, but there is a {name} that is not a file: remove it$"
    with pytest.raises(InputError, match=line):
        made.begin(NOW, [])
    if name == SWEEP.file:
        with pytest.raises(InputError, match=line):
            made.earlier(NOW)
    made.close()


def test_a_full_disk_leaves_whole_rows(tmp_path, monkeypatch):
    """The line names the file and the reason; what was written before stays, and with room again the rest is added."""
    connect = sqlite3.connect

    def small(*arguments, **options):
        database = connect(*arguments, **options)
        # SQLite then states what it states of a full disk
        database.execute("PRAGMA max_page_count = 8")
        return database

    monkeypatch.setattr(sqlite3, "connect", small)
    made = Journal(tmp_path)
    made.begin(NOW, [])
    made.add([row(0, 0, "1")])
    with pytest.raises(
        InputError,
        match=r"^`out` must accept sweep.journal, but writing failed: No space left on dev",
    ):
        made.add([row(point, 0, "2" * 100) for point in range(1, 100)])
    assert list(made.rows()) == [row(0, 0, "1")]
    made.add([row(1, 0, "2")])
    made.close()
    monkeypatch.undo()
    assert earlier(tmp_path) == [row(0, 0, "1"), row(1, 0, "2")]


def test_a_limit_of_the_size_of_a_file(tmp_path):
    """SQLite calls it an error of the disk."""
    made = Journal(tmp_path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, limits[1]))
    try:
        with pytest.raises(
            InputError,
            match=r"must accept sweep.journal, but writing failed: disk I/O error \(ulimit -f\?\);",
        ):
            made.begin(NOW, [])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    made.close()


ROW = "`resume` must find sweep.journal as it was written, but its row of point 1 and engine 'ensemble' was changed or "


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE rows SET content = replace(content, '1.2345', '1.2346') WHERE point = 1",
        "UPDATE rows SET content = x'ff' WHERE point = 1",
        "UPDATE rows SET checksum = '' WHERE point = 1",
        "UPDATE rows SET point = 1 WHERE point = 0",
        "INSERT INTO rows SELECT 1, 1, engine, content, kept, checksum FROM rows WHERE point = 0",
    ],
)
def test_a_changed_or_added_row_is_refused(tmp_path, journal, change):
    journal.add([row(0, 0, "1.2345")])
    if "UPDATE rows SET point" not in change:
        journal.add([row(1, 0, "1.2345")])
    journal.close()
    assert len(earlier(tmp_path)) in (1, 2)
    with sqlite3.connect(tmp_path / SWEEP.file) as database:
        database.execute(change)
    database.close()
    line = f"{ROW}added since: remove '{tmp_path / SWEEP.file}' to continue from sweep.csv"
    with pytest.raises(InputError, match=f"^{re.escape(line)}$"):
        earlier(tmp_path)


def test_versions_changed_in_the_journal_are_refused(tmp_path, journal):
    journal.add([row(1, 0, "1")])
    journal.close()
    with sqlite3.connect(tmp_path / SWEEP.file) as database:
        database.execute("UPDATE identity SET hash = 'numpy 3' WHERE what = 'versions'")
    database.close()
    with pytest.raises(InputError, match="was changed or added since"):
        earlier(tmp_path)


def test_rows_of_other_versions_say_so(tmp_path, journal):
    """Once an upgrade, and for ever: the row of an upgraded program has its own checksum."""
    old, new, third = (
        identity(PARTS | {"versions": {"numpy": n, "numba": "0.61"}}) for n in ("1.0", "2.0", "3.0")
    )
    journal.begin(old, [])
    journal.add([row(0, 0, "1")])
    journal.close()
    assert earlier(tmp_path, old) == [row(0, 0, "1")]
    kept = earlier(tmp_path, new)
    said = "kept from numpy 1.0, now numpy 2.0: last digits may differ"
    assert (kept[0].content, [str(one) for one in kept[0].warnings]) == (
        row(0, 0, "1").content,
        [said],
    )
    again = Journal(tmp_path)
    again.begin(new, kept)
    again.close()
    assert earlier(tmp_path, new) == kept
    again = "kept from numpy 2.0, now numpy 3.0: last digits may differ"
    assert [str(one) for one in earlier(tmp_path, third)[0].warnings] == [again, said]


# and others: of version 0.1
OLD_COLUMNS = "engine, mean_square_voltage, mean_power, seconds, error, warnings"


def test_a_journal_of_version_0_1_is_refused(tmp_path):
    """Its rows lack parts of the errors, and so they are never mistaken for whole ones."""
    with sqlite3.connect(tmp_path / SWEEP.file) as database:
        database.execute("CREATE TABLE identity (what, hash)")
        database.execute(f"CREATE TABLE rows (point, place, {OLD_COLUMNS}, checksum)")
        database.executemany("INSERT INTO identity VALUES (?, ?)", NOW.items())
    database.close()
    line = "`resume` must find sweep.journal as this version writes it, but version 0.1 wrote it: let that version end"
    with pytest.raises(InputError, match=f"^{re.escape(line)} its sweep, or remove"):
        earlier(tmp_path)


def test_without_a_folder_rows_are_in_memory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    journal = Journal(None)
    assert journal.earlier(NOW) is None
    journal.begin(NOW, [row(1, 0, "1")])
    journal.add([row(0, 0, "2")])
    assert [one.point for one in journal.rows()] == [0, 1]
    journal.remove()
    journal.close()
    assert list(tmp_path.iterdir()) == []
