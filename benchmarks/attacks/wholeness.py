"""What a program may have said when a fault struck it, and whether the files that it leaves are whole."""

import csv
import json
import re
import signal
import tomllib

from tests.support.judge import refusal

ABRUPT = (-signal.SIGKILL, -signal.SIGTERM, -signal.SIGHUP)  # nobody cleans up after these
# by a library without memory: docs/reliability.md
ABORTED = (-signal.SIGABRT, -signal.SIGSEGV, -signal.SIGBUS)
ENDS = {".png": b"IEND\xaeB`\x82", ".html": b"</html>", ".svg": b"</svg>"}


def wrong_words(status, out, err, how):
    """What is wrong with a status and what was printed; ``how`` is the fault."""
    if (
        how.get("signal") == signal.SIGINT == -status
        and "in main" not in err
        and err.endswith("KeyboardInterrupt\n")
    ):
        return ""  # it struck before the first line of the program, while Python itself began
    if re.search(r"internal error|Traceback|Exception ignored", err):
        return "a traceback or internal error"
    if status == 0:
        return (
            "nan or inf is printed"
            if re.search(r"(?<![\w.])(nan|inf|NaN|Infinity)(?!\w)", out)
            else ""
        )
    if (
        status in (130, -signal.SIGINT) and err and how.get("signal") == signal.SIGINT
    ):  # click moves on from the ^C
        return "" if re.fullmatch(r"\n?harvester: .*\n", err) else "130, but not one line"
    if how.get("signal") == -status:  # before Python can catch ^C it ends by it
        return "" if not err.strip() else f"ended by a signal, but said {err!r}"
    if how.get("memory") and status in ABORTED:
        return ""
    return refusal(status, "", err)


def unwhole(folder, status):
    """A file in out/ that is cut off, or one that is left: in tmp/ too; but for those of a program that was killed."""
    for path in sorted((folder / "out").rglob("*")):
        if path.name.startswith("."):
            if status not in ABRUPT:
                return f"left {path.name}"
        elif path.is_file() and cut_off(path):
            return f"{path.name} is not whole"
    left = [path.name for path in (folder / "tmp").iterdir() if path.name != "cache"]
    return (
        f"left in the temporary folder: {left}"
        if left and status not in (*ABRUPT, *ABORTED)
        else ""
    )


def cut_off(path):
    """Whether a file that has its name is not complete."""
    data = path.read_bytes()
    try:
        if path.suffix == ".json":
            json.loads(data)
        elif path.suffix == ".toml":
            tomllib.loads(data.decode())
        elif path.suffix == ".csv":
            return (
                not data.endswith(b"\n")
                or len({len(row) for row in csv.reader(data.decode().splitlines())}) != 1
            )
        elif path.suffix in ENDS:
            return not data.rstrip().endswith(ENDS[path.suffix])
    except ValueError:
        return True
    return False
