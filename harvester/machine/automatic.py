"""The progress of functions called from Python: a bar on a terminal or in a notebook.

A bar is shown if the work lasts for `DELAY`.  Nothing is shown on a pipe or in a file, in threads
and worker processes, or inside of other bars of tqdm.
"""

import multiprocessing
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from harvester.errors import invalid
from harvester.machine.progress import ProgressCallback, working

DELAY = 1.0  # s after which a bar is shown


def is_in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


def is_on_terminal() -> bool:
    """Whether stderr is a terminal: False also if it is missing, closed or not a file."""
    try:
        return sys.stderr.isatty()
    except (AttributeError, ValueError):
        return False


def shows_bars() -> bool:
    """Whether this is the main thread of a process on a terminal or in a notebook."""
    if threading.current_thread() is not threading.main_thread():
        return False
    if multiprocessing.current_process().name != "MainProcess":
        return False
    return is_in_notebook() or is_on_terminal()


class AutomaticProgress:
    """The progress of a study whose caller names no other.

    Studies that another study starts add nothing to its bar.
    """

    def __init__(self) -> None:
        self._begun: list[bool] = []  # of each study at work: whether it counts rows
        self._bar: Any = None
        self.what = ""

    @property
    def _is_shown(self) -> bool:
        """Whether there is a bar and the study at work is the outermost one."""
        return self._bar is not None and len(self._begun) == 1

    def start(self, total: int | None = None, what: str = "", done: int = 0) -> None:
        """Begin a study, or one more kind of rows of it.

        ``what`` without ``total`` is a line above the bar.
        """
        is_rows = total is not None
        if what and not is_rows:
            if self._is_shown:
                self._bar.notice(what)
            return
        if is_rows and self._begun and self._begun[-1]:
            if self._is_shown:
                self._bar.start(total, what, done)
            return
        self._begun.append(is_rows)
        if len(self._begun) == 1 and shows_bars():
            self._open(total, what, done)

    def _open(self, total: int | None, what: str, done: int) -> None:
        """Show the bar of the outermost study, unless there are other bars."""
        from tqdm import tqdm  # loaded if a bar is shown

        from harvester.machine.bars import Bar, RowsBar

        if len(tqdm._instances):
            return
        disable = False if is_in_notebook() else None
        name = self.what or "harvester"
        if total is None:
            self._bar = Bar(name, delay=DELAY, disable=disable)
        else:
            self._bar = RowsBar(name, warms_up=True, delay=DELAY, disable=disable)
            self._bar.start(total, what, done)

    def step(self, done: float = 1, what: str = "") -> None:
        """Show the fraction or the row that is done, of the outermost study."""
        if self._is_shown:
            self._bar.step(done, what)

    def row_lasts(self, name: str, seconds: float) -> None:
        """Report how long a row lasts, of the outermost study."""
        if self._is_shown and self._begun[0]:
            self._bar.row_lasts(name, seconds)

    def remark(self, text: object) -> None:
        """Print a remark above the bar."""
        if self._is_shown:
            self._bar.remark(text)

    def close(self) -> None:
        """End a study, and the bar with the outermost."""
        if self._begun:
            self._begun.pop()
        if not self._begun and self._bar is not None:
            self._bar.close()
            self._bar = None


AUTOMATIC = AutomaticProgress()


@contextmanager
def called(study: str) -> Iterator[None]:
    """Give the bar the name of a study; a study inside another one leaves it the outer name."""
    outer = AUTOMATIC.what
    AUTOMATIC.what = outer or study
    try:
        yield
    finally:
        AUTOMATIC.what = outer


@contextmanager
def reporting(
    progress: ProgressCallback | bool | None, what: str
) -> Iterator[ProgressCallback | None]:
    """The callback to which work reports its fraction; None for nobody.

    That is ``progress`` if it is one, nobody if it is False, and else a bar if `shows_bars`;
    InputError for anything else.
    """
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        must = "be True, False or a function of the fraction that is done"
        raise invalid("`progress`", must, progress)
    if callable(progress):
        yield progress
    elif progress is False or not shows_bars():
        yield None
    else:
        with called(what), working(AUTOMATIC):
            yield AUTOMATIC.step
