"""What the program may answer, whatever it is asked: numbers with their errors, or one line and status 2 or 3."""

import contextlib
import io
import json
import math
import re
import sys
from unittest import mock

from harvester import cli

LONGEST = 1500  # letters of an error


def asked(*arguments):
    """Exit status, stdout and stderr of the command line, run in this process."""
    out, err = io.StringIO(), io.StringIO()
    words = [*map(str, arguments)]
    # which the provenance of a result quotes
    argv = mock.patch.object(sys, "argv", ["harvester", *words])
    with argv, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = cli.exit_status(words)
    return status, out.getvalue(), err.getvalue()


def complaints(err):
    """What a program stated on stderr but for how long its work will last, which depends on the machine."""
    return "".join(
        line
        for line in err.splitlines(keepends=True)
        if not re.match(r"\w+: about .* shorten", line)
    )


def fault(status, out, err):
    """What is wrong with an answer of a command with --json; "" where nothing is."""
    if status != 0:
        return refusal(status, out, err)
    if complaints(err):
        return f"done, but stderr has {err!r}"
    try:
        answer = json.loads(out, parse_constant=lambda name: 1 / 0)
    except (ValueError, ZeroDivisionError):
        return "stdout is no JSON, or has nan"
    for where, number in numbers(answer):
        if not math.isfinite(number):
            return f"{where} is {number}"
    return unexplained(answer) if "mean_square_voltage" in answer else ""


def refusal(status, out, err):
    """What is wrong with an error: it is one printable line, named, and nothing is on stdout."""
    lines = err.splitlines()
    if status not in (2, 3):
        return f"status {status}"
    if out or len(lines) != 1 or not re.match(r"harvester: \S", err):
        return f"status {status}, stdout {out[:80]!r}, {len(lines)} lines on stderr"
    if not lines[0].isprintable() or len(lines[0]) > LONGEST:
        return "an error of unprintable characters, or of too many"
    if re.search(r"internal error|Traceback|object at 0x|\bnumpy\.|np\.float", err):
        return err.strip()
    return ""


def unexplained(answer):
    """A mean that has neither an error nor a reason why there is none."""
    for name in ("mean_square_voltage", "mean_power"):
        value = answer[name]
        if name == "mean_square_voltage" and value["value"] < 0.0:
            return f"{name} is {value['value']}"
        errors = [value[key] for key in ("stderr", "step_bias", "model_bias")]
        if not (
            any(error is not None for error in errors) or answer.get("reason") or answer["warnings"]
        ):
            return f"{name} has neither an error nor a reason"
        if any(error is not None and error < 0.0 for error in errors):
            return f"an error of {name} is negative"
    return ""


def numbers(found, where=""):
    """All numbers of nested lists and dictionaries, with their places."""
    if isinstance(found, dict):
        for key, value in found.items():
            yield from numbers(value, f"{where}.{key}")
    elif isinstance(found, list):
        for k, value in enumerate(found):
            yield from numbers(value, f"{where}[{k}]")
    elif isinstance(found, int | float) and not isinstance(found, bool):
        yield where, found
