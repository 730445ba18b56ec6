"""Blocks of trajectories side by side, each in a thread."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from harvester.machine.cores import cores

SOON = 8192  # steps of blocks of trajectories that no thread is started for: a few milliseconds


def each(block: Callable[[int], None], blocks: int, steps: int, given_up: threading.Event) -> None:
    """Call ``block`` with the number of each of the blocks of so many ``steps``.

    Each thread works on one block after the other: a task for each would cost as much as a hundred
    steps of it. ``given_up``, set by ^C, ends them after their piece.
    """
    waiting = iter(range(blocks))  # which gives each number once, whatever thread asks

    def work() -> None:
        for k in waiting:
            if given_up.is_set():
                return
            block(k)

    if steps * blocks <= SOON:
        work()
        return
    threads = min(cores(), blocks)
    with ThreadPoolExecutor(threads) as pool:
        try:
            for task in [pool.submit(work) for _ in range(threads)]:
                task.result()
        except BaseException:
            given_up.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
