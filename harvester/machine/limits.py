"""What this process is allowed that the libraries below cannot work with: they would hang, or end it without a word."""

import os
import resource
import sys

from harvester.errors import InputError, SimulationError

LEAST = 1_000_000_000  # bytes of address space
THREADS = "NUMBA_NUM_THREADS"


def check_limits() -> None:
    """Check the limits of this process and its environment.

    Raises SimulationError for an address space (ulimit -v) below `LEAST`, in which OpenBLAS and LLVM hang or abort;
    InputError for a number of threads that numba does not start with.
    """
    room = resource.getrlimit(resource.RLIMIT_AS)[0]
    if room != resource.RLIM_INFINITY and room < LEAST:
        raise SimulationError(
            f"the address space of a process must be at least {LEAST // 1_000_000} MB, but is {room // 1_000_000} MB: "
            "raise it with ulimit -v"
        )
    threads = os.environ.get(THREADS, "")
    if threads.lstrip("+-").isdecimal() and int(threads) < 1:
        raise InputError(f"{THREADS} must be a whole number above 0, but is {threads!r}: unset it")


def check_streams() -> None:
    """Put nothing in the place of closed streams, where files that are opened later would get what is printed.

    Raises InputError where stdout is closed: the answer would be lost.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(number, True)
    os.close(number)
    sys.stdin = sys.stdin or os.fdopen(0)
    sys.stderr = sys.stderr or os.fdopen(2, "w")
    if sys.stdout is None:
        raise InputError("stdout must be open, but is closed: send it to /dev/null where nobody reads it")
