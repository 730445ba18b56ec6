"""How many cores this process may use: all, or fewer where it is one of several at work on the same thing."""

import os

VARIABLE = "HARVESTER_THREADS"  # of the environment, so that the processes that a process starts have it too
LIBRARIES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")  # read when NumPy loads


def cores() -> int:
    """The machine's cores, or the limit that `VARIABLE` sets if that is less; at least 1.

    Answers do not depend on it: each block of trajectories has its own random generators.
    """
    most = os.cpu_count() or 1
    limit = os.environ.get(VARIABLE, "")
    return min(int(limit), most) if limit.isdecimal() and int(limit) > 0 else most


def limited(threads: int) -> dict[str, str]:
    """The environment of a process that may use so many cores, NumPy's libraries included."""
    return dict.fromkeys((VARIABLE, *LIBRARIES), str(threads))
