"""Work in several threads that ends soon after ^C, which Python reports to the main thread alone.

`in_threads` computes in threads.  If the caller gives up, by ^C or any error, the work that they
are at ends with `GivenUp` when it next calls `end_if_given_up`; the interpreter cannot end before
its threads do.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from typing import TypeVar

from harvester.machine.cores import cores

T = TypeVar("T")
Result = TypeVar("Result")

# set if the caller of this thread waits no more, or a caller of that one
_GIVEN_UP: ContextVar[tuple[threading.Event, ...]] = ContextVar("given_up", default=())


class GivenUp(BaseException):
    """The caller of this thread waits no more; not an Exception, which work may expect."""


def end_if_given_up() -> None:
    """Raise `GivenUp` in a thread of `in_threads` whose caller waits no more."""
    if any(event.is_set() for event in _GIVEN_UP.get()):
        raise GivenUp


@contextmanager
def in_threads(function: Callable[[T], Result], items: Sequence[T]) -> Iterator[Iterator[Result]]:
    """The results of a function for all items, in their order, by a thread per core.

    Each item has a copy of the caller's context.

    >>> with in_threads(abs, [-1, 2, -3]) as results:
    ...     list(results)
    [1, 2, 3]
    """
    given_up = threading.Event()
    token = _GIVEN_UP.set((*_GIVEN_UP.get(), given_up))
    contexts = [copy_context() for _ in items]
    _GIVEN_UP.reset(token)
    with ThreadPoolExecutor(cores()) as pool:
        try:
            yield pool.map(lambda context, item: context.run(function, item), contexts, items)
        except BaseException:
            given_up.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
