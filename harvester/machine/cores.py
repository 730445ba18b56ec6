"""How many cores this process may use: all, or fewer if several processes share the work."""

import functools
import os
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
# of the environment, so that the processes that a process starts have it too
THREADS_VARIABLE = "HARVESTER_THREADS"

# Of NumPy's libraries, which read it when NumPy loads.  Our matrices are small: a least squares of
# 512 by 18 takes 0.2 ms of one thread; two take 8, most of it waiting for each other, where other
# programs run too.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def cores() -> int:
    """How many cores to use: all of the machine, or fewer if `THREADS_VARIABLE` reports it.

    At least 1.

    Answers do not depend on it: each block of trajectories has its own random generators.
    """
    most = os.cpu_count() or 1
    limit = os.environ.get(THREADS_VARIABLE, "")
    return min(int(limit), most) if limit.isdecimal() and int(limit) > 0 else most


def limited_environment(threads: int) -> dict[str, str]:
    """Environment variables for a process that may use so many threads; NumPy's libraries use one."""
    return {THREADS_VARIABLE: str(threads), **ONE_THREAD}


def use_one_core() -> None:
    """Let this process use one core, as each worker of an executor should, unless it has a number."""
    os.environ.setdefault(THREADS_VARIABLE, "1")


def one_blas_thread(function: Callable[P, T]) -> Callable[P, T]:
    """The same function, in which the linear algebra of NumPy and SciPy keeps to one thread.

    The program sets `ONE_THREAD` before they load; in a user's own program they have loaded with as
    many as they like.
    """

    @functools.wraps(function)
    def alone(*arguments: P.args, **options: P.kwargs) -> T:
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            return function(*arguments, **options)

    return alone
