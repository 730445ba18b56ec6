"""The journal: whatever is cut off or damaged, what is whole is kept; another sweep's is refused."""

import errno
import json
import os
import re

import pytest

from harvester.errors import InputError
from harvester.studies.sweep import journal
from harvester.studies.sweep.table import COLUMNS

NOW = journal.identity({"scene_digest": "a", "netlist": None, "vary": {"x": [1.0]}, "engines": {}})


def row(text):
    return dict.fromkeys(COLUMNS, "") | {"engine": "ensemble", "mean_power": text, "warnings": 'a "µ",\nb'}


@pytest.fixture
def held(tmp_path):
    made = journal.Journal(tmp_path, NOW, 3, 2, ())
    yield made
    made.close()


def test_rows_come_back_in_order(tmp_path, held):
    for point, place in ((2, 1), (0, 1), (2, 0)):
        held.add([(point, place, row(f"{point}{place}"))])
    assert [(p, e, r["mean_power"]) for p, e, r in held.rows()] == [(0, 1, "01"), (2, 0, "20"), (2, 1, "21")]
    assert [held.has(p, e) for p, e in ((0, 0), (0, 1), (2, 0))] == [False, True, True]
    assert held.count() == 3
    assert sorted(journal.read(tmp_path, NOW), key=lambda k: k[:2]) == list(held.rows())
    held.close()
    again = journal.Journal(tmp_path, NOW, 3, 2, list(journal.read(tmp_path, NOW)))
    assert next(iter(again.rows())) == (0, 1, row("01"))
    again.close()


def test_any_cut_costs_the_last_row_only(tmp_path, held):
    held.add([(0, 0, row("1")), (1, 0, row("2"))])
    whole = held.path.read_bytes()
    last = whole[: whole.rstrip(b"\n").rfind(b"\n") + 1]
    for cut in range(len(last), len(whole)):
        held.path.write_bytes(whole[:cut])
        assert [p for p, _, _ in journal.read(tmp_path, NOW)] == [0]
    held.path.write_bytes(whole)
    assert [p for p, _, _ in journal.read(tmp_path, NOW)] == [0, 1]


@pytest.mark.parametrize("damage", [b"\n", b"[0]\n", b'[0, 0, "a"]\n', b"\xff\x00\n", b'["0", 0]\n', b"{}\n", b"7\n"])
def test_a_damaged_line_is_left_out(tmp_path, held, damage):
    held.path.write_bytes(held.path.read_bytes() + damage)
    held.add([(1, 0, row("2"))])
    assert [p for p, _, _ in journal.read(tmp_path, NOW)] == [1]


@pytest.mark.parametrize("text", ["", "x", "{}\n", "[]\n", "7\n", '{"sweep"'])
def test_what_is_no_journal(tmp_path, text):
    assert journal.read(tmp_path, NOW) is None
    (tmp_path / journal.NAME).write_text(text)
    assert journal.read(tmp_path, NOW) is None


@pytest.mark.parametrize("what", journal.SAME)
def test_another_sweep_is_refused(tmp_path, held, what):
    line = f"`resume` must continue the same sweep, but {what} in '{tmp_path}' is another: use another `out`"
    with pytest.raises(InputError, match=f"^{re.escape(line)}$"):
        journal.read(tmp_path, NOW | {what: "b"})


def test_identity_knows_each_part():
    parts = {"scene_digest": "a", "netlist": "b", "points": "list", "vary": {"x": [1.0], "y": [2.0]}, "engines": {}}
    other = {"scene_digest": "b", "netlist": None, "points": "grid", "engines": {"spice": {}}}
    other["vary"] = {"y": [2.0], "x": [1.0]}  # another order of the points
    for what, value in other.items():
        one, two = journal.identity(parts), journal.identity(parts | {what: value})
        assert [k for k in journal.SAME if one[k] != two[k]] == [what]
    assert journal.identity(json.loads(json.dumps(parts))) == journal.identity(parts)


def test_one_sweep_a_folder(tmp_path, held):
    with pytest.raises(InputError, match=r"^`out` must be no folder that another sweep is writing, but '.*' is$"):
        journal.Journal(tmp_path, NOW, 3, 2, ())
    held.close()
    journal.Journal(tmp_path, NOW, 3, 2, ()).close()


def test_a_full_disk_leaves_whole_rows(tmp_path, held, monkeypatch):
    held.add([(0, 0, row("1"))])
    before, write = held.path.read_bytes(), os.write

    def half(file, data):
        if len(data) < 50:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(file, data[: len(data) // 2])

    monkeypatch.setattr(os, "write", half)
    with pytest.raises(InputError, match=r"^`out` must take sweep.journal, but writing failed: No space left on dev"):
        held.add([(1, 0, row("2")), (2, 0, row("3"))])
    assert held.path.read_bytes() == before
    assert list(held.rows()) == [(0, 0, row("1"))]
    monkeypatch.undo()
    held.add([(1, 0, row("2"))])
    assert list(held.rows()) == [(0, 0, row("1")), (1, 0, row("2"))]
