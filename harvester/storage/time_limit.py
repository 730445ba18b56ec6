"""A budget of nested measurements: stores that advance end with it, and compilation is not counted.

`limited` sets the limit for all that is called within it.  `check_time` raises TooLittleTimeError at
its end, and sooner if the pace shows that the work would need far longer.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from numba.core import event

from harvester.errors import SimulationError, reading
from harvester.machine.threads import end_if_given_up
from harvester.presentation.diagnostic import refusal
from harvester.quantities.units import seconds

HOPELESS = 1.5  # times the budget: a prediction beyond it ends the work at once


class TooLittleTimeError(SimulationError):
    """Work that does not end in its budget (s), and the seconds that it needs at least."""

    def __init__(self, budget: float, needed: float) -> None:
        super().__init__(refusal("measurement_needs_time", budget=budget, seconds=needed))


class _Compiling(event.Listener):
    """The seconds in which any thread compiles."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._depth = 0
        self._begin = 0.0
        self._lock = threading.Lock()

    def on_start(self, _: object) -> None:
        """Begin to count, unless another compilation continues."""
        with self._lock:
            if self._depth == 0:
                self._begin = time.perf_counter()
            self._depth += 1

    def on_end(self, _: object) -> None:
        """Count until the last compilation ends."""
        with self._lock:
            self._depth -= 1
            if self._depth == 0:
                self.seconds += time.perf_counter() - self._begin


_COMPILING = _Compiling()
event.register("numba:compile", _COMPILING)


def working_seconds() -> float:
    """A clock (s) that does not count compilation."""
    return time.perf_counter() - _COMPILING.seconds


@dataclass(frozen=True)
class TimeLimit:
    """A ``budget`` (s) since the ``begin`` by `working_seconds`."""

    budget: float
    begin: float = field(default_factory=working_seconds)

    @classmethod
    def of(cls, budget: float | str | None) -> "TimeLimit | None":
        """One that begins now, of a ``budget`` as a user gives it.

        InputError if it is not a time.
        """
        if budget is None:
            return None
        return cls(reading("`budget`", seconds, str(budget)))

    @property
    def left(self) -> float:
        """The seconds that are left, negative after the end."""
        return self.begin + self.budget - working_seconds()

    def check(self, since: float, share: float) -> None:
        """Raise TooLittleTimeError if work begun at ``since``, of which a ``share`` is done, does not end in time."""
        now = working_seconds()
        needed = since - self.begin + (now - since) / share
        if now - self.begin > self.budget or needed > HOPELESS * self.budget:
            raise TooLittleTimeError(self.budget, max(needed, now - self.begin))


_LIMIT: ContextVar[TimeLimit | None] = ContextVar("limit", default=None)


@contextmanager
def limited(limit: TimeLimit | None) -> Iterator[None]:
    """Put a limit on the work within, or none; threads of it need a copy of the context."""
    token = _LIMIT.set(limit)
    try:
        yield
    finally:
        _LIMIT.reset(token)


def check_time(since: float | None = None, share: float = 1.0) -> None:
    """`TimeLimit.check` by the limit of the work that calls this, if it has one.

    ``since`` is now by default.

    In a thread whose caller waits no more it ends the work in any case.
    """
    end_if_given_up()
    limit = _LIMIT.get()
    if limit is not None:
        limit.check(working_seconds() if since is None else since, share)


def deadline_of_limit() -> float | None:
    """The end of the limit by `time.perf_counter` if nothing more is compiled.

    None without a limit.
    """
    limit = _LIMIT.get()
    return None if limit is None else time.perf_counter() + limit.left
