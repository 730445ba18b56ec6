"""Progress on a terminal, with the time that is left; nothing in a pipe.

The clock of a bar goes on between two reports; the time left is that of the last report, less what has passed since.
"""

import threading
import time
from typing import Any, Self

from tqdm import tqdm

REDRAWN = 0.5  # seconds between two looks at the clock
FORMAT = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}, {left} left{postfix}"
UNKNOWN = "{desc}: {elapsed}"  # where nobody knows how much there is to do


class Bar(tqdm):  # type: ignore[misc]
    """A progress bar that shows the fraction done, the time left and what is at work.

    ``known`` is False where nobody knows how much there is to do.  ``at_most`` says that the fraction is that of a
    budget, which need not be spent.
    """

    def __init__(self, what: str, file: Any = None, known: bool = True, at_most: bool = False) -> None:
        self.at_most = at_most
        self.first: tuple[float, float] | None = None  # time and fraction of the first report
        self.last = (time.monotonic(), 0.0)
        self.seconds: float | None = None  # left at the last report
        shape = FORMAT if known else UNKNOWN
        super().__init__(total=1000, desc=what, disable=None, leave=False, bar_format=shape, file=file)
        self.ended = threading.Event()
        if not self.disable:
            threading.Thread(target=self._redraw, daemon=True).start()

    def _redraw(self) -> None:
        """Keep the bar's clock going until it is closed."""
        while not self.ended.wait(REDRAWN):
            self.refresh()

    @property
    def format_dict(self) -> dict[str, Any]:
        """What the bar's format may name: tqdm's own and ``left``, the time left."""
        left, seconds = "?", self.seconds
        if seconds is not None:
            passed = time.monotonic() - self.last[0]
            left = ("at most " if self.at_most else "") + self.format_interval(round(max(seconds - passed, 0.0)))
        return {**super().format_dict, "left": left}

    def tell(self, fraction: float, what: str = "") -> None:
        """Show the fraction done and ``what`` is at work; the rest is taken to go on at the same rate."""
        now = time.monotonic()
        if self.first is None or fraction < self.last[1]:  # all began anew, at another step
            self.first, self.seconds = (now, fraction), None
        elif fraction > self.first[1]:
            self.seconds = (1.0 - fraction) * (now - self.first[0]) / (fraction - self.first[1])
        self._show(fraction, what)

    def _show(self, fraction: float, what: str) -> None:
        """Draw the bar anew."""
        self.last = (time.monotonic(), fraction)
        if what:
            self.set_postfix_str(what, refresh=False)
        self.update(int(1000 * min(fraction, 1.0)) - self.n)

    def close(self) -> None:
        """Take the bar off the screen."""
        if hasattr(self, "ended"):
            self.ended.set()
        super().close()

    def __enter__(self) -> Self:
        return self


class RowsBar(Bar):
    """A progress bar for rows of several engines, which differ by orders of magnitude in the time that one takes.

    The time left is that of each engine's rows to come at the mean of its rows so far; not known as long as an engine
    has none.
    """

    def __init__(self, what: str, rows: dict[str, int], file: Any = None) -> None:
        self.left_of, self.seconds_of = dict(rows), dict.fromkeys(rows, 0.0)
        self.done_of = dict.fromkeys(rows, 0)
        self.rows = sum(rows.values())
        super().__init__(what, file)

    def skip(self, engine: str) -> None:
        """Count a row that was there already."""
        self.left_of[engine] -= 1
        self._show(1.0 - sum(self.left_of.values()) / self.rows, engine)

    def row(self, engine: str) -> None:
        """Count a row that was computed since the last one."""
        self.seconds_of[engine] += time.monotonic() - self.last[0]
        self.done_of[engine] += 1
        self.left_of[engine] -= 1
        to_come = [name for name, left in self.left_of.items() if left]
        if all(self.done_of[name] for name in to_come):
            self.seconds = sum(self.left_of[name] * self.seconds_of[name] / self.done_of[name] for name in to_come)
        self._show(1.0 - sum(self.left_of.values()) / self.rows, engine)
