"""Work on the newest request only: a request that was overtaken meanwhile is never begun."""

import contextlib
import threading
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Generic, TypeVar

T = TypeVar("T")


class Newest(Generic[T]):
    """Runs ``work(request, overtaken)`` in a pool, one request at a time, always the newest.

    The work reports its own errors: one that it raises is lost, and the next request continues.

    ``overtaken()`` informs the work that a newer request waits, so that it may end early.  `ask`
    never waits.
    """

    def __init__(self, pool: Executor, work: Callable[[T, Callable[[], bool]], None]) -> None:
        self._pool, self._work = pool, work
        self._news = threading.Condition()
        self._waiting: list[T] = []
        self._busy = self._closed = False

    def ask(self, request: T) -> None:
        """Put a request in the place of the one that waits."""
        with self._news:
            self._waiting[:] = [] if self._closed else [request]
            self._news.notify_all()
            if self._busy or self._closed:
                return
            self._busy = True
        self._pool.submit(self._run)

    def close(self) -> None:
        """Begin nothing more."""
        with self._news:
            self._closed = True
            self._waiting.clear()
            self._news.notify_all()

    def rests(self, seconds: float) -> bool:
        """Wait that long, but no longer than until something newer is asked for: whether nothing was."""
        with self._news:
            return not self._news.wait_for(self._overtaken, seconds)

    def _overtaken(self) -> bool:
        return self._closed or bool(self._waiting)

    def _run(self) -> None:
        while True:
            with self._news:
                if not self._waiting:
                    self._busy = False
                    return
                request = self._waiting.pop()
            with contextlib.suppress(Exception):
                self._work(request, self._overtaken)
