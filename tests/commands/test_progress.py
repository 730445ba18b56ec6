"""Progress: a sensible time left on a terminal, quiet in a pipe."""

import io
import re
import subprocess
import sys
import time

import pytest

from harvester.commands.progress import Bar, RowsBar
from tests.support.paths import EXAMPLES
from tests.support.terminal import on_terminal

PLATE, FIGURE = (str(EXAMPLES / f"{name}.toml") for name in ("plate", "paper_figure3"))
LEFT = re.compile(r"(\d+)%\|[^|]*\| [\d:]+, (?:at most )?([\d:?]+) left")


class Screen(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Time that passes when it is told to."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


def test_time_left_of_a_fraction(clock):
    """What remains at the rate since the first report: what came before it (compilation) does not count."""
    with Bar("run", Screen()) as bar:
        clock[0] = 10.0
        bar.tell(0.1)
        for fraction in (0.2, 0.4, 0.7):
            clock[0] = 10.0 + 50.0 * (fraction - 0.1)
            bar.tell(fraction)
            assert bar.seconds == pytest.approx(50.0 * (1.0 - fraction))
        clock[0] += 6.0
        assert "00:09 left" in str(bar)  # 15 s, 6 s later
        clock[0] += 60.0
        assert "00:00 left" in str(bar)
        bar.tell(0.05)  # all begins anew, at a smaller step
        clock[0] += 10.0
        bar.tell(0.1)
        assert bar.seconds == pytest.approx(180.0)


def test_time_left_of_rows(clock):
    """Each engine by its own rows: not known before each has one; rows of an earlier run cost nothing."""
    with RowsBar("sweep", {"averaged": 100, "spice": 10}, Screen()) as bar:
        for _ in range(4):
            bar.skip("spice")
        for _ in range(100):
            clock[0] += 0.01
            bar.row("averaged")
        assert bar.seconds is None
        assert "? left" in str(bar)
        clock[0] += 5.0
        bar.row("spice")
        assert bar.seconds == pytest.approx(25.0)
        clock[0] += 7.0
        bar.row("spice")
        assert bar.seconds == pytest.approx(4 * 6.0)


COMMANDS = [
    ("run", PLATE, "--engine", "ensemble", "--within", "0.2%"),
    ("sweep", PLATE, "--vary", "load.resistance=100k,1M", "--engine", "ensemble", "--out", "out"),
    ("compare", PLATE, "--trajectories", "8", "--duration", "2", "--out", "out"),
    ("stability", FIGURE),
]


@pytest.mark.slow
@pytest.mark.parametrize("args", COMMANDS, ids=lambda args: args[0])
def test_on_a_terminal(args, tmp_path):
    """A bar that names what it measures, goes up to the end or nearly, and is gone at the end; then the answer."""
    status, screen = on_terminal(*args, cwd=tmp_path)
    assert status == 0, screen
    reports = LEFT.findall(screen)
    fractions = [int(done) for done, _ in reports]
    assert fractions, screen
    if args[0] not in ("run", "compare"):  # where another step is chosen, or more runs, all begins anew
        assert fractions == sorted(fractions)
    last = screen.rsplit("left", 1)[1]
    assert last.strip("\r\n \x1b[A")  # the answer stands after the bar
    assert "left" not in last


@pytest.mark.slow
@pytest.mark.parametrize("args", [COMMANDS[0], ("motion", PLATE, "--out", "out")], ids=lambda args: args[0])
def test_quiet_in_a_pipe(args, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "harvester", *args], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stderr == ""
    assert "%|" not in done.stdout


@pytest.mark.slow
def test_of_a_path_there_is_the_time_only(tmp_path):
    status, screen = on_terminal("motion", PLATE, "--out", "out", cwd=tmp_path)
    assert status == 0
    assert "motion: 00:0" in screen
