"""Progress: a sensible time left on a terminal, quiet in a pipe."""

import io
import re
import sys
import time

import pytest

from harvester.machine.bars import Bar, RowsBar, duration
from tests.support.judge import complaints
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
        # 0.15 more at the rate of 0.75 in 96 s: what is overdue is not done
        assert "00:19 left" in str(bar)
        bar.tell(0.05)  # all begins anew, at a smaller step
        clock[0] += 10.0
        bar.tell(0.1)
        assert bar.seconds == pytest.approx(180.0)


def test_the_first_report_gives_the_time_left(clock):
    """At the rate since the begin; two processes that report at once give none."""
    with Bar("run", Screen()) as bar:
        clock[0] = 8.0
        bar.tell(0.125)
        assert bar.seconds == pytest.approx(56.0)
        clock[0] += 0.01
        bar.tell(0.25)
        assert bar.seconds == pytest.approx(24.0, rel=0.01)
        clock[0] += 8.0
        bar.tell(0.375)
        assert bar.seconds == pytest.approx(20.0, rel=0.01)


def test_there_is_time_left_before_the_end(clock):
    """Quick first reports and a slow rest, as of formulas and then ngspice: never "00:00 left" at 12 %."""
    with Bar("compare", Screen()) as bar:
        for fraction in (0.0, 0.06, 0.12):
            clock[0] += 0.1
            bar.tell(fraction)
        for _ in range(50):
            clock[0] += 1.0
            left = LEFT.search(str(bar))[2]
            assert left != "00:00"
        assert left > "03:00"  # 12 to 18 % in 50 s
    with RowsBar("sweep", {"averaged": 5, "spice": 5}, Screen()) as bar:
        for engine in ("averaged", "spice"):
            clock[0] += 1.0
            bar.step(1, engine)
        clock[0] += 100.0
        assert LEFT.search(str(bar))[2] > "01:00"


def test_a_row_says_which_of_how_many(clock):
    with RowsBar("sweep", {"averaged": 9}, Screen()) as bar:
        bar.start(4, "spice")
        bar.skip("spice")
        clock[0] += 1.0
        bar.row("spice")
        assert str(bar).endswith("spice 2 of 4")


@pytest.mark.parametrize(
    ("each", "told"), [(20.0, "sweep: about 3.3 min in all; fewer runs shortens it\n"), (2.0, "")]
)
@pytest.mark.parametrize("screen", [Screen, io.StringIO], ids=["terminal", "pipe"])
def test_long_work_says_so_first(clock, monkeypatch, each, told, screen):
    """After a row of each engine, once, on a terminal and in a pipe; work of half a minute states nothing."""
    where = screen()
    monkeypatch.setattr("sys.stderr", where)
    with RowsBar("sweep", {"spice": 10}, shorter="fewer runs") as bar:
        for _ in range(4):
            clock[0] += each
            bar.step(1, "spice")
    said = [line for line in re.split(r"[\r\n]+", where.getvalue()) if " in all; " in line]
    assert "".join(f"{line.strip()}\n" for line in said) == told
    if screen is io.StringIO:
        assert where.getvalue() == told


@pytest.mark.parametrize(
    ("enough", "told"),
    [(0.02, "tolerance: about 8.3 min in all; fewer runs shortens it\n"), (0.15, "")],
)
def test_parts_that_are_alike_say_it_early(clock, monkeypatch, enough, told):
    """Ten of 500 runs, which are all alike, report how long the whole lasts."""
    monkeypatch.setattr("sys.stderr", where := io.StringIO())
    with Bar("tolerance", shorter="fewer runs", enough=enough) as bar:
        for run in range(1, 12):
            clock[0] += 1.0
            bar.tell(run / 500)
    assert where.getvalue() == told


def test_time_left_of_a_budget(clock):
    """A share of the budget is spent: the rest of it is left, whatever the rate of the first reports."""
    with Bar(
        "optimise", screen := Screen(), at_most=True, shorter="a shorter --budget", budget=60.0
    ) as bar:
        assert "at most 01:00 left" in str(bar)  # before any report
        for fraction in (0.001, 0.1, 0.099):  # what is left of a budget may grow by a little
            clock[0] += 4.0
            bar.tell(fraction)
        assert "at most 00:54 left" in str(bar)
    assert "optimise: at most 60 s in all; a shorter --budget shortens it" in screen.getvalue()


def test_notices_stand_above_the_bar(clock, monkeypatch):
    """A line that the program prints meanwhile, such as that it compiles, is a line of its own."""
    screen = Screen()
    monkeypatch.setattr("sys.stderr", screen)
    with Bar("run") as bar:
        bar.tell(0.1)
        print("compiling", file=sys.stderr)
    assert sys.stderr is screen
    assert "compiling" in [line.strip() for line in re.split(r"[\r\n]+", screen.getvalue())]


def test_a_pilot_says_how_long(clock):
    with Bar("motion", Screen(), known=False) as bar:
        assert "left" not in str(bar)
        clock[0] += 3.0
        bar.expect(20.0)
        clock[0] += 5.0
        assert "00:15 left" in str(bar)
        clock[0] += 35.0
        assert "00:04 left" in str(bar)  # late: a tenth of what has passed


@pytest.mark.parametrize(
    ("seconds", "text"), [(44.6, "45 s"), (95.0, "1.6 min"), (1200.0, "20 min"), (7200.0, "2 h")]
)
def test_duration(seconds, text):
    assert duration(seconds) == text


def test_time_left_of_rows(clock):
    """Each engine by its own rows: not known before each has one; rows of an earlier run cost nothing."""
    with RowsBar("sweep", {"averaged": 100}, Screen()) as bar:
        bar.start(10, "spice", done=4)
        for _ in range(100):
            clock[0] += 0.01
            bar.step(1, "averaged")
        assert bar.seconds is None
        assert "? left" in str(bar)
        clock[0] += 5.0
        bar.step(1, "spice")
        assert bar.seconds == pytest.approx(25.0)
        clock[0] += 7.0
        bar.step(1, "spice")
        assert bar.seconds == pytest.approx(4 * 6.0)


COMMANDS = [
    ("run", PLATE, "--engine", "ensemble", "--within", "0.2%"),
    (
        "sweep",
        PLATE,
        "--vary",
        "load.resistance=100k,1M",
        "--engine",
        "ensemble",
        "--workers",
        "1",
        "--out",
        "out",
    ),
    ("compare", PLATE, "--trajectories", "8", "--duration", "2", "--out", "out"),
    ("stability", FIGURE, "--trajectories", "512"),
]


@pytest.mark.thorough("test_quiet_in_a_pipe")
@pytest.mark.slow
@pytest.mark.parametrize("args", COMMANDS, ids=lambda args: args[0])
def test_on_a_terminal(args, tmp_path):
    """A bar that names what it measures, rises to the end or nearly, and is erased at the end; then the answer."""
    status, screen = on_terminal(*args, cwd=tmp_path)
    assert status == 0, screen
    reports = LEFT.findall(screen)
    fractions = [int(done) for done, _ in reports]
    assert fractions, screen
    if args[0] not in (
        "run",
        "compare",
    ):  # where another step is chosen, or more runs, all begins anew
        assert fractions == sorted(fractions)
    last = screen.rsplit("left", 1)[1]
    assert last.strip("\r\n \x1b[A")  # the answer stands after the bar
    assert "left" not in last


@pytest.mark.slow
def test_a_terminal_that_does_not_know_its_size_has_a_bar(tmp_path):
    """Its size is 0 lines of 0 columns, for which no bar was drawn."""
    status, screen = on_terminal(*COMMANDS[3], cwd=tmp_path, size=(0, 0))
    assert status == 0 and LEFT.search(screen)


@pytest.mark.slow
@pytest.mark.parametrize(
    "args", [COMMANDS[0], ("motion", PLATE, "--out", "out")], ids=lambda args: args[0]
)
def test_quiet_in_a_pipe(args, tmp_path, monkeypatch, harvester):
    monkeypatch.chdir(tmp_path)
    status, out, err = harvester(*args)
    assert (status, complaints(err)) == (0, "")
    assert "%|" not in out


@pytest.mark.thorough("test_quiet_in_a_pipe")
@pytest.mark.slow
def test_of_a_path_there_is_the_time_only(tmp_path):
    status, screen = on_terminal("motion", PLATE, "--out", "out", cwd=tmp_path)
    assert status == 0
    assert "motion: 00:0" in screen


def test_bars_are_what_studies_tell(clock):
    """The one protocol: a fraction with what is at work, or rows of several engines, some of them done before."""
    with Bar("compare", Screen()) as bar:
        bar.start()
        for fraction in (0.0, 0.25):
            clock[0] += 1.0
            bar.step(fraction, "spice")
        assert bar.seconds == pytest.approx(3.0)
        assert str(bar).endswith("spice")
    with RowsBar("sweep", file=Screen()) as rows:
        rows.start(10, "spice", done=4)
        rows.start(2, "exact")
        assert str(rows).endswith("spice 4 of 10")
        for engine in ("exact", "exact", "spice"):
            clock[0] += 2.0
            rows.step(1, engine)
        assert rows.seconds == pytest.approx(10.0)


def left_of(bar):
    """The seconds left that a bar shows."""
    parts = LEFT.search(str(bar))[2].split(":")
    return sum(int(part) * 60**k for k, part in enumerate(reversed(parts)))


@pytest.mark.parametrize("is_known", [True, False])
def test_rows_that_come_in_batches_have_one_time_left(clock, is_known):
    """64 rows per second for 156 s: the bar showed 47:57 and 00:47 left in turn."""
    with RowsBar("sweep", {"ensemble": 10_000}, Screen(), warms_up=True) as bar:
        clock[0] += 3.0
        for batch in range(1, 21):
            bar.step(64, "ensemble")
            if is_known:
                bar.row_lasts("ensemble", 1.0 / 64.0)
            for part in range(10):
                whole = (10_000 - 64 * batch) / 64.0 - 0.1 * part
                if batch > 1 or is_known:
                    assert left_of(bar) == pytest.approx(whole, abs=2.0)
                clock[0] += 0.1


def test_the_first_rows_say_how_long_a_row_lasts(clock, monkeypatch):
    """The clock would include the start of processes; it is a least time if an engine has no row."""
    monkeypatch.setattr("sys.stderr", where := io.StringIO())
    with RowsBar("sweep", {"ensemble": 10_000}, shorter="fewer runs", warms_up=True) as bar:
        clock[0] += 1.5
        bar.step(64, "ensemble")
        bar.row_lasts("ensemble", 5e-3)
        assert bar.seconds == pytest.approx(9_936 * 5e-3)
    assert where.getvalue() == "sweep: about 51 s in all; fewer runs shortens it\n"
    where.truncate(0)
    where.seek(0)
    rows = {"ensemble": 10_000, "spice": 1}
    with RowsBar("sweep", rows, shorter="fewer runs", warms_up=True) as bar:
        clock[0] += 1.5
        bar.step(64, "ensemble")
        bar.row_lasts("ensemble", 5e-3)
        assert bar.seconds is None
    assert where.getvalue() == "sweep: at least 51 s in all; fewer runs shortens it\n"


def test_the_rows_to_come_last_at_least_as_long_as_those_that_are_known(clock):
    """The bar showed "?" in 16 of the 17 s of a sweep, until each engine had a row."""
    with RowsBar("sweep", {"ensemble": 100, "density": 1}, Screen()) as bar:
        assert ", ? left" in str(bar)
        clock[0] += 2.0
        bar.step(2, "ensemble")
        bar.row_lasts("ensemble", 0.5)
        assert ", at least 00:49 left" in str(bar)
        clock[0] += 9.0
        assert ", at least 00:40 left" in str(bar)
        bar.step(1, "density")
        assert "at least" not in str(bar)
