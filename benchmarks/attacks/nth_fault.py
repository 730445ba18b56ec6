"""A command whose n-th write to a file, or whose n-th allocation, fails once: what it says, and what it leaves.

The program is loaded once; each n runs in a child of its own, in a folder of its own, after `arm`
of `attacks.shim` has been called there.  Allocations are those of the C library of at least 1 kB
(arrays, files, text), and objects of Python, whose allocator fails by `_testcapi` where the
interpreter has it.

    LD_PRELOAD=shim.so python -m attacks.nth_fault FOLDER KIND NUMBERS [--warm] COMMAND ...

NUMBERS are like 1-200,500,1000.  With --warm the command has run once before the children, so
that the first faults strike the command itself, not the imports.  A line of JSON per n has "n",
"status", "out", "err", and in "left" the fault of the files.
"""

import contextlib
import ctypes
import json
import os
import signal
import sys
import traceback
from pathlib import Path

KINDS = ("write", "allocation", "object")
PATIENCE = 120  # seconds of a child


def armed(kind, n):
    """Let the n-th operation of this kind fail from now on."""
    if kind == "object":
        import _testcapi

        _testcapi.set_nomemory(n, n + 1)
    else:
        ctypes.CDLL(None).arm(n if kind == "write" else 0, n if kind == "allocation" else 0)


def disarmed(kind):
    """Let everything succeed again."""
    if kind == "object":
        import _testcapi

        _testcapi.remove_mem_hooks()
    else:
        ctypes.CDLL(None).arm(0, 0)


def redirected(folder):
    """Work in a folder from now on, with the output in two files there."""
    os.chdir(folder)
    for stream, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), stream)


def warmed(folder, words):
    """Run the command once in this process, in a folder of its own."""
    from harvester.cli import exit_status

    place = prepared(folder, "warm")
    streams = [os.dup(stream) for stream in (1, 2)]
    redirected(place)
    status = exit_status(list(words))
    sys.stdout.flush()
    for stream, old in zip((1, 2), streams, strict=True):
        os.dup2(old, stream)
    if status:
        raise SystemExit((place / "stderr").read_text())


def prepared(folder, name):
    """A new folder for one run, with the temporary folder of the process in it."""
    place = Path(folder) / name
    for inner in ("tmp", "out"):
        (place / inner).mkdir(parents=True)
    os.environ["TMPDIR"] = str(place / "tmp")
    return place


def child(folder, kind, n, words):
    """Run the command in this process, which ends with its status."""
    from harvester.__main__ import main

    redirected(folder)
    sys.argv = ["harvester", *words]
    signal.alarm(PATIENCE)
    status = 0
    try:
        armed(kind, n)
        main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        disarmed(kind)
        traceback.print_exc()
        status = 70
    disarmed(kind)
    with contextlib.suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(status)


def run(folder, kind, n, words):
    """The status, the output and the state of the files after the n-th operation failed."""
    from attacks.wholeness import unwhole

    place = prepared(folder, f"{kind}{n}")
    pid = os.fork()
    if pid == 0:
        child(place, kind, n, words)
    ended = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    said = {name: (place / name).read_text(errors="replace") for name in ("stdout", "stderr")}
    return {
        "n": n,
        "status": ended,
        "out": said["stdout"],
        "err": said["stderr"],
        "left": unwhole(place, ended),
    }


def main():
    folder, kind, numbers, *words = sys.argv[1:]
    import numpy  # noqa: F401

    import harvester.commands  # noqa: F401  before the children, which share it

    if words[0] == "--warm":
        words.remove("--warm")
        warmed(folder, words)
    for part in numbers.split(","):
        first, _, last = part.partition("-")
        for n in range(int(first), int(last or first) + 1):
            print(json.dumps(run(folder, kind, n, words)), flush=True)


if __name__ == "__main__":
    main()
