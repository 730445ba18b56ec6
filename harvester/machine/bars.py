"""Progress on a terminal, with the time that is left.

In a pipe nothing but one line of a study that will take long.

The clock of a bar continues between two reports.  The time left is that of the last report less
the time since then; if the next report is overdue, so is the rest, and the time left grows again:
it is never 0 before the end.
"""

import sys
import threading
import time
from typing import Any, Self

from tqdm import tqdm

REDRAWN = 0.5  # seconds between two looks at the clock
FORMAT = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}, {left} left{postfix}"
UNKNOWN = "{desc}: {elapsed}"  # where nobody knows how much there is to do
LONG = 30.0  # seconds: what will take more reports it
SURE, ENOUGH = 3.0, 0.15  # seconds of reports, and fraction done, before their rate is reported
QUICK = 10.0  # seconds after which what may spend a budget will not end at once
EFFORT = "fewer --trajectories, a shorter --duration or a larger --within"  # of engines that sample
AT_ONCE = 0.1  # fraction of the time to the first report, in which several processes make theirs
MOST = 0.99  # of a bar that goes by the clock


class Bar(tqdm):  # type: ignore[misc]
    """A progress bar that shows the fraction done, the time left and the engine at work: a `Progress` of studies.

    ``known`` is False if nobody knows how much there is to do.  ``budget`` states that the fraction
    is that of so many seconds, which ``at_most`` need not be spent.  ``shorter`` names the option
    that shortens the work, such as "--budget": with it, work that will last more than half a minute
    reports it in a line on stderr, as soon as that was measured: over the fraction ``enough`` of
    it, which is small if all parts of the work are alike.  It is drawn after ``delay`` seconds, and
    unless ``disable`` (None: on a terminal only).
    """

    def __init__(
        self,
        what: str,
        file: Any = None,
        known: bool = True,
        at_most: bool = False,
        shorter: str = "",
        budget: float | None = None,
        enough: float = ENOUGH,
        delay: float = 0.0,
        disable: bool | None = None,
    ) -> None:
        self.what = what
        self.at_most = at_most
        self.shorter = shorter
        self.budget = budget
        self.enough = enough
        self.first: tuple[float, float] | None = None  # time and fraction of the first report
        self.begun = self.since = time.monotonic()
        self.last = (self.begun, 0.0)
        self.stride = 0.0  # the largest growth of the fraction between two reports
        self.seconds = budget  # left at the last report; None: not known
        self.by_clock = False  # the fraction is that of the seconds that were expected
        self.others: Any = None  # what the rest of the program writes its errors on
        shape = FORMAT if known else UNKNOWN
        super().__init__(
            total=1000,
            desc=what,
            disable=disable,
            leave=False,
            bar_format=shape,
            file=file,
            delay=delay,
        )
        self.ended = threading.Event()
        if not self.disable:
            columns = vars(self).get("ncols")
            if columns is not None and columns < 1:  # a terminal that does not know its size says 0
                self.ncols, self.nrows = 79, 23
            threading.Thread(target=self._redraw, daemon=True).start()

    def _redraw(self) -> None:
        """Keep the bar's clock running until it is closed."""
        if self.ended.wait(self.delay):
            return
        while not self.ended.wait(REDRAWN):
            if self.by_clock and self.seconds:
                passed = time.monotonic() - self.last[0]
                self.n = int(1000 * min(passed / max(self.seconds, passed), MOST))
            self.refresh()
            # tqdm wipes a bar at its end only if it knows of a drawing after the delay
            self.last_print_t = self._time()

    @property
    def format_dict(self) -> dict[str, Any]:
        """The names in the bar's format: tqdm's own and ``left``, the time left."""
        left = "?"
        seconds = self.seconds
        if seconds is not None:
            now = time.monotonic()
            rest = max(seconds - (now - self.last[0]), self._overdue(now), 1.0)
            left = ("at most " if self.at_most else "") + self.format_interval(round(rest))
        return {**super().format_dict, "left": left}

    def start(self, total: int | None = None, what: str = "", done: int = 0) -> None:
        """Begin work that is measured by its fraction.

        ``what`` describes its limit, printed for long work.
        """
        if what and total is None and (self.budget or 0.0) > LONG:
            self.notice(what)

    def step(self, done: float = 1, what: str = "") -> None:
        """Show the fraction done."""
        self.tell(done, what)

    def tell(self, fraction: float, what: str = "") -> None:
        """Show the fraction done and ``what`` is at work; the rest is assumed to be as fast."""
        now = time.monotonic()
        if self.first is None or fraction < self.last[1]:  # all began anew, at another step
            self.since = self.begun if self.first is None else now
            self.first = (now, fraction)
            self.seconds = self._since_begin(now, fraction)
            self.stride = 0.0
        elif fraction > self.first[1]:
            if now - self.first[0] < AT_ONCE * (self.first[0] - self.since):
                self.seconds = self._since_begin(now, fraction)
            else:
                self.seconds = (1.0 - fraction) * (now - self.first[0]) / (fraction - self.first[1])
            self.stride = max(self.stride, fraction - self.last[1])
        if self.budget is not None:
            self.seconds = (1.0 - fraction) * self.budget
        self._show(fraction, what)

    def _since_begin(self, now: float, fraction: float) -> float | None:
        """The time left at the rate since the work began; None if none of it is done."""
        return (1.0 - fraction) * (now - self.since) / fraction if fraction > 0.0 else None

    def expect(self, seconds: float) -> None:
        """Measure by the clock from now on: a pilot states that the work needs about so many seconds."""
        self.seconds = seconds
        self.by_clock = True
        self.bar_format = FORMAT
        self._show(0.0, "")

    def announce(self, seconds: float, limit: str = "about") -> None:
        """Print one line on stderr, once, with the whole duration in seconds, if it is long, and the remedy."""
        if self.shorter and seconds > LONG:
            limit = "at most" if self.at_most else limit
            shorten = "shorten it" if " or " in self.shorter else "shortens it"
            text = f"{self.what}: {limit} {duration(seconds)} in all; {self.shorter} {shorten}"
            self.write(text, file=sys.stderr if self.disable else self.fp)
            self.shorter = ""

    def notice(self, text: str) -> None:
        """Print a line on stderr that the user needs before the work ends."""
        self.write(f"{self.what}: {text}", file=sys.stderr if self.disable else self.fp)

    def remark(self, text: object) -> None:
        """Print an intermediate result or a limit of the time, in place of `announce`."""
        self.shorter = ""
        self.notice(str(text))

    def _overdue(self, now: float) -> float:
        """The time left at the rate up to now, if the next report were about to come."""
        if self.by_clock:
            return 0.1 * (now - self.last[0])
        if self.budget is not None:
            return 0.0
        fraction = self.last[1] + min(self.stride, 0.5 * (1.0 - self.last[1]))
        if self.first is None or fraction <= self.first[1]:
            return 0.0
        return (1.0 - fraction) * (now - self.first[0]) / (fraction - self.first[1])

    def _show(self, fraction: float, what: str) -> None:
        """Draw the bar anew."""
        self.last = (time.monotonic(), fraction)
        if what:
            self.set_postfix_str(what, refresh=False)
        self.update(int(1000 * min(fraction, 1.0)) - self.n)
        if self.seconds is not None and self._is_sure():
            self.announce(self.budget or self.last[0] - self.begun + self.seconds)

    def _is_sure(self) -> bool:
        """Whether enough was measured for the time of the whole."""
        if self.by_clock:
            return True
        if self.budget is not None:
            return self.last[0] - self.begun >= QUICK
        enough = 0.1 * self.enough if self.at_most else self.enough  # a limit may be a rough one
        return (
            self.first is not None
            and self.last[0] - self.first[0] >= SURE
            and self.last[1] >= enough
        )

    def close(self) -> None:
        """Take the bar off the screen."""
        if hasattr(self, "ended"):
            self.ended.set()
        if self.others is not None:
            sys.stderr = self.others
            self.others = None
        super().close()

    def __enter__(self) -> Self:
        if (
            not self.disable and self.fp == sys.stderr
        ):  # notices stand above the bar, not in its line
            from tqdm.contrib import DummyTqdmFile  # which loads asyncio

            self.others = sys.stderr
            sys.stderr = DummyTqdmFile(sys.stderr)
        return self


class RowsBar(Bar):
    """A progress bar for rows of several engines, which differ by orders of magnitude in the time per row.

    The time left is that of each engine's rows to come at the time that each lasts (`row_lasts`),
    else at the mean of its rows so far; a least time as long as an engine has no row.
    After it are the engine of the last row, and how many of its rows are done.  ``warms_up``: the
    first report of an engine includes compilation, and does not represent the others.
    """

    def __init__(
        self,
        what: str,
        rows: dict[str, int] | None = None,
        file: Any = None,
        shorter: str = "",
        warms_up: bool = False,
        delay: float = 0.0,
        disable: bool | None = None,
    ) -> None:
        self.rows_of: dict[str, int] = {}
        self.left_of: dict[str, int] = {}
        self.seconds_of: dict[str, float] = {}
        self.done_of: dict[str, int] = {}
        self.lasts_of: dict[str, float] = {}
        self.warm: set[str] = set()
        self.warms_up = warms_up
        self.longest = 0.0  # s between two reports
        self.most = 1  # rows in one report
        super().__init__(what, file, shorter=shorter, delay=delay, disable=disable)
        for engine, total in (rows or {}).items():
            self.start(total, engine)

    def start(self, total: int | None = None, what: str = "", done: int = 0) -> None:
        """Begin so many rows of an engine, of which some are done by an earlier run."""
        self.rows_of[what] = total or 0
        self.left_of[what] = (total or 0) - done
        self.seconds_of[what] = 0.0
        self.done_of[what] = 0
        if done:
            self._count(what)

    def step(self, done: float = 1, what: str = "") -> None:
        """Count rows that were computed since the last one."""
        interval = time.monotonic() - self.last[0]
        if what in self.warm or not self.warms_up:
            self.done_of[what] += int(done)
            self.seconds_of[what] += interval
            self.longest = max(self.longest, interval)
        self.warm.add(what)
        self.most = max(self.most, int(done))
        self.left_of[what] -= int(done)
        self._look()
        self._count(what)

    def skip(self, engine: str) -> None:
        """Count a row that was there already."""
        self.left_of[engine] -= 1
        self._count(engine)

    def row(self, engine: str) -> None:
        """Count a row that was computed since the last one."""
        self.step(1, engine)

    def row_lasts(self, name: str, seconds: float) -> None:
        """Expect so many seconds from a row of an engine to the next one."""
        self.lasts_of[name] = seconds
        self._look()
        if self._means() is not None:
            self._count(name)
            return
        self.announce(self.last[0] - self.begun + self._least(), "at least")

    @property
    def format_dict(self) -> dict[str, Any]:
        """As `Bar`; the least time left if an engine has no row yet."""
        names = super().format_dict
        if self.seconds is None and self.lasts_of:
            least = self.last[0] + self._least() - time.monotonic()
            names["left"] = "at least " + self.format_interval(round(max(least, 1.0)))
        return names

    def _least(self) -> float:
        """The time left of engines whose time for a row is known."""
        return sum(self.left_of[engine] * each for engine, each in self.lasts_of.items())

    def _look(self) -> None:
        """Measure the time left."""
        means = self._means()
        if means is not None:
            self.seconds = sum(self.left_of[name] * mean for name, mean in means.items())

    def _count(self, engine: str) -> None:
        """Show how many rows there are of all, and of this engine."""
        done = self.rows_of[engine] - self.left_of[engine]
        of = self.rows_of[engine]
        rows = max(sum(self.rows_of.values()), 1)
        self._show(1.0 - sum(self.left_of.values()) / rows, f"{engine} {done} of {of}".strip())

    def _means(self) -> dict[str, float] | None:
        """The mean seconds of a row of each engine that has rows to come.

        None if one has no row yet.
        """
        to_come = [name for name, left in self.left_of.items() if left]
        if not all(name in self.lasts_of or self.done_of[name] for name in to_come):
            return None
        return {
            name: self.lasts_of[name]
            if name in self.lasts_of
            else self.seconds_of[name] / self.done_of[name]
            for name in to_come
        }

    def _is_sure(self) -> bool:
        """Whether enough was measured: a row of each engine that has rows to come."""
        means = self._means()
        if means is None:
            return False
        return means.keys() <= self.lasts_of.keys() or self.last[0] - self.begun >= SURE

    def _overdue(self, now: float) -> float:
        """The time left after the next report, longer by as much as that is overdue."""
        means = self._means()
        if not means or self.seconds is None:
            return 0.0
        due = min(max(self.longest, self.most * max(means.values())), 0.5 * self.seconds)
        return (self.seconds - due) * max(1.0, (now - self.last[0]) / due) if due > 0.0 else 0.0


def duration(seconds: float) -> str:
    """A time in words with the digits that an estimate has: 45 s, 4 min, 3 h."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            count = seconds / size
            return f"{count:.0f} {unit}" if count >= 9.5 else f"{count:.2g} {unit}"
    return f"{seconds:.0f} s"
