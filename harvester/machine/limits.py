"""The limits of this process that the libraries below cannot work with: they would hang, or end it silently."""

import os
import sys
from pathlib import Path

from harvester.errors import InputError, SimulationError, shown
from harvester.machine.system import this_system

LEAST = 1_000_000_000  # bytes of address space
THREADS, UNCOMPILED = "NUMBA_NUM_THREADS", "NUMBA_DISABLE_JIT"


def check_limits() -> None:
    """Check the limits of this process and its environment.

    Raises SimulationError for an address space (ulimit -v) below `LEAST`, in which OpenBLAS and
    LLVM hang or abort; InputError for settings of numba that no kernel runs with, and for a current
    folder that has been removed.
    """
    room = this_system.address_space()
    if room is not None and room < LEAST:
        raise SimulationError(
            f"the address space of a process must be at least {LEAST // 1_000_000} MB, but is {room // 1_000_000} MB: "
            "raise it with ulimit -v"
        )
    threads = os.environ.get(THREADS, "1").strip()
    if not (threads.isdecimal() and int(threads) > 0):
        raise InputError(
            f"{THREADS} must be a whole number above 0, but is {shown(threads)}: unset it"
        )
    if os.environ.get(UNCOMPILED, "0").strip() not in ("0", ""):
        was = shown(os.environ[UNCOMPILED])
        raise InputError(
            f"{UNCOMPILED} must be 0, as kernels run compiled only, but is {was}: unset it"
        )
    try:
        Path.cwd()
    except FileNotFoundError:
        raise InputError(
            "the current folder must exist, but it has been removed: change to another one"
        ) from None


def check_streams() -> None:
    """Put nothing in the place of closed streams, as files that are opened later would receive the output.

    Raises InputError if stdout is closed: the answer would be lost.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(number, True)
    os.close(number)
    sys.stdin = sys.stdin or os.fdopen(0)
    sys.stderr = sys.stderr or os.fdopen(2, "w")
    if sys.stdout is None:
        raise InputError(
            "stdout must be open, but is closed: send it to /dev/null if nobody reads it"
        )
