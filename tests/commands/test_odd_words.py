"""Odd words and terminals: one column, titles of 100,000 letters, odd headers of records."""

import os
import subprocess
import sys

import pytest
import tomli_w

import harvester as hv
from tests.support.judge import refusal
from tests.support.paths import EXAMPLES, ROOT

PLATE = EXAMPLES / "plate.toml"
DEVICE = (
    *("--mass", "40g", "--frequency", "3.2Hz", "--q", "100", "--capacitance", "40nF"),
    *("--coupling", "1mN/V", "--resistance", "1Mohm", "--acceleration-psd", "1e-5 g^2/Hz"),
)


@pytest.mark.slow
@pytest.mark.parametrize("columns", [1, 2, 8, 25])
@pytest.mark.parametrize("line", ["--help", "run --help"])
def test_help_for_a_narrow_terminal(columns, line):
    """It was an internal error below eight columns; it is wrapped at 20 there."""
    env = os.environ | {"COLUMNS": f"{columns}", "PYTHONPATH": str(ROOT)}
    call = [sys.executable, "-m", "harvester", *line.split()]
    done = subprocess.run(call, env=env, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Usage: harvester" in " ".join(done.stdout.split())


def test_a_title_has_an_end(tmp_path, harvester):
    """`new` wrote a scene with it that nothing could read, as scene files have at most 16 kB."""
    out = tmp_path / "mine.toml"
    told = harvester("new", out, *DEVICE, "--title", "A" * 100_000)
    assert told == (2, "", "harvester: title must have at most 1000 letters, but has 100000\n")
    assert not out.exists()
    assert harvester("new", out, *DEVICE, "--title", "A" * 1000)[0] == 0
    assert hv.load(out).title == "A" * 1000


@pytest.mark.parametrize(
    "title",
    ["\u202eleft", "\x1b[31mred", "two\nlines", "\ud7ff\U0010ffff", "%s {0} $x$", "\\\\", " "],
)
def test_odd_titles_break_no_table_and_no_figure(tmp_path, harvester, title):
    scene = tmp_path / "mine.toml"
    scene.write_text(tomli_w.dumps(hv.load(PLATE).replace(title=title).tables()))
    line = ("sweep", scene, "--vary", "load.resistance=1k:10M:3", "--engine", "averaged")
    status, out, err = harvester(*line, "--out", tmp_path / "out", "--report")
    assert (status, err) == (0, "")
    assert "\x1b" not in out
    assert "\u202e" not in out


HEADERS = {
    "long": "t," + "a" * 100_000,
    "wide": ",".join(f"c{k}" for k in range(20_000)),
    "same": "t,t,t",
    "empty": ",,",
    "quoted": '"t","a',
    "NUL": "t\0,a\0",
    "control": "\x1b[31mtime,\x07a",
    "BOMs": "\ufeff\ufefft,a",
    "brackets": "t ((((s,a [m/s^2",
    "unit": "t (parsec),a (furlong/fortnight^2)",
    "spaces": "   ,\t",
    "semicolons": "t;a;;;",
    "formula": "=1+1,@SUM(A1)",
    "number": "1e999,-inf",
    "line": "\r\r\r",
}


@pytest.mark.parametrize("name", HEADERS)
@pytest.mark.parametrize("rows", [0, 1, 300])
def test_headers_of_a_record(tmp_path, harvester, name, rows):
    """Each ends in a record that is described, or in one printable line."""
    path = tmp_path / "mine.csv"
    body = "".join(f"{0.001 * k},{k % 7 - 3}\n" for k in range(rows))
    path.write_text(HEADERS[name] + "\n" + body, newline="", encoding="utf-8")
    status, out, err = harvester("record", path)
    assert "\x1b" not in out + err
    if status:
        assert refusal(status, out, err) == ""
