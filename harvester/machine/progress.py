"""How far a study has come: the one protocol by which studies report to a bar, a log or another listener.

A study calls `Progress.start` when its work begins, `Progress.step` as it continues, and
`Progress.close` at its end, also if that is an error.  Work is measured in one of two ways: by the
fraction that is done, if nobody can count it, or in rows of one or several kinds, such as the
points of each engine of a sweep.

Work deep below a study reports by `report_share` to whom `listening` names, and a function whose
parts last unequally long encloses each in a `stage`; neither is an argument of functions between.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias

# the simplest progress, of one engine: called with the fraction
ProgressCallback: TypeAlias = Callable[[float], None]


class Progress(Protocol):
    """The listener to a study."""

    def start(self, total: int | None = None, what: str = "", done: int = 0) -> None:
        """Begin work that is measured by its fraction (``total`` None), or ``total`` rows of a kind ``what``.

        Work in several kinds of rows begins each of them.  So many are ``done`` already, by an earlier run.  ``what``
        without a ``total`` is a sentence on the extent that the work can afford.
        """
        ...

    def step(self, done: float = 1, what: str = "") -> None:
        """Say that the fraction ``done`` of all the work is done, or that so many more rows of ``what`` are.

        Where work is measured by its fraction, ``what`` names that which is at work.
        """
        ...

    def close(self) -> None:
        """End the work."""
        ...


class NoProgress:
    """A progress without a listener."""

    def start(self, total: int | None = None, what: str = "", done: int = 0) -> None:
        """Do nothing."""

    def step(self, done: float = 1, what: str = "") -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


NO_PROGRESS = NoProgress()


def remark(progress: Progress, text: object) -> None:
    """Report an intermediate result or a limit to a progress with a method ``remark``."""
    if (report := getattr(progress, "remark", None)) is not None:
        report(text)


def row_lasts(progress: Progress, name: str, seconds: float) -> None:
    """Report the time from a row of this name to the next to a progress with a method ``row_lasts``.

    The time was measured in the computing process, without its start and compilation.
    """
    if (report := getattr(progress, "row_lasts", None)) is not None:
        report(name, seconds)


@contextmanager
def working(progress: Progress) -> Iterator[Progress]:
    """A progress that is begun, and ended whatever happens."""
    progress.start()
    try:
        yield progress
    finally:
        progress.close()


class CallingBack(NoProgress):
    """A progress that calls a function with each step's number and its name."""

    def __init__(self, function: Callable[[float, str], object]) -> None:
        self.function = function

    def step(self, done: float = 1, what: str = "") -> None:
        """Call the function."""
        self.function(done, what)


@dataclass
class PartOfProgress:
    """The progress of a part of some work, which itself is measured by its fraction: from ``begin`` on, a ``share``.

    Whatever the part is measured in becomes the fraction of the ``whole``, which is reported
    ``what`` is at work.

    >>> told = []
    >>> part = PartOfProgress(CallingBack(lambda done, what: told.append((done, what))), 0.5, 0.25, "spice")
    >>> part.start(4); part.step(2); part.step()
    >>> told
    [(0.625, 'spice'), (0.6875, 'spice')]
    """

    whole: Progress
    begin: float
    share: float
    what: str = ""
    _total: int = field(default=0, init=False)
    _done: float = field(default=0.0, init=False)

    def start(self, total: int | None = None, what: str = "", done: int = 0) -> None:
        """Begin the part, or one more kind of its rows."""
        self._total += total or 0
        self._done += done

    def step(self, done: float = 1, what: str = "") -> None:
        """Tell the whole."""
        if self._total:
            self._done += done
            done = self._done / self._total
        self.whole.step(self.begin + self.share * min(done, 1.0), self.what or what)

    def close(self) -> None:
        """Leave the whole open: it is for whoever began it to close."""


_LISTENER: ContextVar[ProgressCallback | None] = ContextVar("listener", default=None)


@contextmanager
def listening(report: ProgressCallback | None) -> Iterator[None]:
    """Let ``report`` hear the shares of all work within.

    None: the listener to the work around it.
    """
    token = _LISTENER.set(report or _LISTENER.get())
    try:
        yield
    finally:
        _LISTENER.reset(token)


def listener() -> ProgressCallback | None:
    """Who hears the shares of this work, for threads of it; None if nobody does."""
    return _LISTENER.get()


def report_share(share: float) -> None:
    """Report to the listener, if there is one, that this share of the work is done."""
    report = _LISTENER.get()
    if report is not None:
        report(share)


@contextmanager
def stage(begin: float, end: float) -> Iterator[None]:
    """Work that is from the share ``begin`` to the share ``end`` of that around it, by its time.

    >>> told = []
    >>> with listening(told.append), stage(0.0, 0.5):
    ...     with stage(0.5, 1.0):
    ...         report_share(0.5)
    >>> told
    [0.0, 0.25, 0.375, 0.5, 0.5]
    """
    report = _LISTENER.get()
    if report is None:
        yield
        return
    report(begin)
    with listening(lambda share: report(begin + share * (end - begin))):
        yield
    report(end)
