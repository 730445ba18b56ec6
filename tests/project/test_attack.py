"""The attack of benchmarks/attack.py in little, and that it would see what it looks for."""

import importlib
import os
import shutil
import signal
import sys

import pytest

from tests.support.opened import STRACE
from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
faults, growth, netlists, scenes, shim, tally, wholeness = (
    importlib.import_module(f"attacks.{name}")
    for name in ("faults", "growth", "netlists", "scenes", "shim", "tally", "wholeness")
)

pytestmark = [
    pytest.mark.thorough("nothing: faults of the machine while the program runs"),
    pytest.mark.ngspice,
    pytest.mark.slow,
]


def test_an_attack_goes_on_where_it_stopped():
    """The numbers that are left, the same scenes for them, and counts that add up."""
    first = tally.Tally(5, 60.0)
    first.note("ensemble", "status 0")
    first.note("ensemble", "status 0", "nan", number=1)
    second = tally.Tally(5, 60.0, first.found())
    whole, left = (list(scenes.plan(one.numbers(), 5)) for one in (tally.Tally(5, 60.0), second))
    assert left == whole[2:]
    second.note("ensemble", "status 0")
    found = second.found()
    assert (found["tried"], found["outcomes"], len(found["breaks"])) == (
        3,
        {"ensemble: status 0": 3},
        1,
    )


def test_netlists():
    """Three random ones, of which some reach ngspice."""
    found = tally.Tally(3, 60.0)
    netlists.attack(found, 5)
    assert (found.tried, found.breaks) == (3, [])


@pytest.mark.skipif(
    STRACE is None, reason="strace, which tells the files that a program opens, is not installed"
)
def test_a_file_that_a_netlist_reads_is_seen(tmp_path):
    trace = tmp_path / "trace"
    calls = [
        f'openat(AT_FDCWD, "{tmp_path}/7.cir", O_RDONLY) = 3',
        'openat(AT_FDCWD, "../outside.cir", O_RDONLY) = 3',
    ]
    calls += [
        'openat(AT_FDCWD, "mine.cir", O_RDONLY) = 3',
        'openat(AT_FDCWD, "/usr/x", O_WRONLY) = 3',
    ]
    calls += ['execve("/bin/sh", ["sh"], 0x0) = 0', 'openat(AT_FDCWD, "/etc/passwd", O_RDONLY) = 3']
    trace.write_text("".join(f"1 {call}\n" for call in calls))
    wrong = [f"{number} {what.split()[1]}" for number, what in netlists.touched(trace, tmp_path)]
    assert wrong == [f"7 {tmp_path}/outside.cir:", "7 /usr/x:", "7 /bin/sh:", "7 /etc/passwd:"]


@pytest.mark.skipif(shutil.which("cc") is None, reason="no compiler of C")
@pytest.mark.parametrize(
    ("command", "fault", "ends", "says"),
    [
        ("optimise", {"ROOM": "3000"}, "status 2", "No space left on device"),
        (
            "sweep",
            {"ROOM": "30000"},
            "status 2",
            "No space left on device; the points that are done are kept",
        ),
        ("new", {"LOOKS": "3", "JUMP": "-300000000"}, "status 0", ""),
        ("run ensemble", {"LOOKS": "3", "JUMP": "-300000000"}, "status 0", ""),
        (
            "run ensemble",
            {"THREADS": "1"},
            "status 3",
            "the system refused: can't start new thread",
        ),
        ("sweep", {"THREADS": "2"}, "status 3", "the system refused: [Errno 11]"),
        ("sweep", {"THREADS": "6"}, "status 3", "the system refused: "),
        ("run spice", {"THREADS": "0"}, "status 3", "the system refused: [Errno 11]"),
        ("sweep", {"DELAY": "100"}, "status 0", ""),
    ],
    ids=[
        "full disk",
        "full disk of a sweep",
        "clock",
        "clock of a run",
        "no threads",
        "no processes",
        "no thread of a queue",
        "no search",
        "slow disk",
    ],
)
def test_a_fault(tmp_path, command, fault, ends, says):
    """The disk is full or slow, the clock jumps back by years, or no thread can start (which was an internal error).

    Where no process starts, the search for ngspice stated that it was missing.
    """
    for name in ("tmp", "out"):
        (tmp_path / name).mkdir()
    env = {"LD_PRELOAD": shim.built(tmp_path), **fault}
    outcome, wrong, said = faults.trial(tmp_path, command, {"env": env})
    assert (outcome, wrong) == (ends, "")
    assert says in said["stderr"]


def test_what_is_cut_off_is_seen(tmp_path):
    for name in ("tmp", "out"):
        (tmp_path / name).mkdir()
    assert wholeness.unwhole(tmp_path, 0) == ""
    for name, text in [("a.json", "{"), ("a.csv", "a,b\n1"), ("a.png", "PNG"), ("a.toml", "x = ")]:
        (tmp_path / "out" / name).write_text(text)
        assert wholeness.unwhole(tmp_path, 0) == f"{name} is not whole"
        os.remove(tmp_path / "out" / name)  # noqa: PTH107
    (tmp_path / "out" / ".a.csv.1").touch()
    assert wholeness.unwhole(tmp_path, 2) == "left .a.csv.1"
    assert wholeness.unwhole(tmp_path, -9) == ""


def test_an_interrupt_before_the_program_begins_is_pythons():
    early = 'Traceback (most recent call last):\n  File "site.py", line 1, in <module>\nKeyboardInterrupt\n'
    how = {"signal": signal.SIGINT}
    ours = early.replace("<module>", "main")
    assert wholeness.wrong_words(-signal.SIGINT, "", early, how) == ""
    assert wholeness.wrong_words(-signal.SIGINT, "", ours, how) == "a traceback or internal error"
    assert wholeness.wrong_words(1, "", early, how) == "a traceback or internal error"


def test_growth(monkeypatch):
    """Sixty short runs leave no descriptor, thread or file more than forty do."""
    monkeypatch.setattr(growth, "SCENES", growth.SCENES[:1])
    found = tally.Tally(60, 60.0)
    looks = growth.attack(found, 5)["looks"]
    assert [
        looks[-1][key] - looks[-2][key]
        for key in ("descriptors", "threads", "processes", "temporary files")
    ] == [0] * 4
    assert found.tried == 60
