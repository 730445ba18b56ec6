"""Errors inside a model of the user's own: the function and the line of the model, in one line.

An ordinary exception is its author's and is raised as it is, with that line as a note.  All
others end in an `InputError`: those that end programs (SystemExit, KeyboardInterrupt),
StopIteration, which Python changes on its way, and those that cannot be pickled.
"""

import dis
import re
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import cloudpickle

from harvester.errors import HarvesterError, InputError, escaped

FUNCTIONS = ("drift", "kick", "source", "event", "jump")
IN_PYTHON = "`compiled`=False runs it in plain Python"
LONGEST = 200  # letters of a text that is quoted
HEADING = re.compile("(Failed in|During:)")  # of numba's errors
COLOUR = re.compile(r"\x1b\[[\d;]*m")
LINE_OF_FILE = re.compile(r'File "([^"\n]+)", line (\d+)|at (\S+\.py) \((\d+)\)')
NOT_MODELS = (str(Path(__file__).parents[1]), *map(sysconfig.get_path, ("stdlib", "purelib")))


def line_in(trace: TracebackType | None) -> tuple[str, str]:
    """The function of a model in a traceback, and its line: "mine.py, line 12"; "" if unknown."""
    frames = [
        (frame.f_code, line)
        for frame, line in traceback.walk_tb(trace)
        if not frame.f_code.co_filename.startswith(NOT_MODELS)
    ]
    of_functions = [k for k, (code, _) in enumerate(frames) if code.co_name in FUNCTIONS]
    inside = frames[of_functions[0] :] if of_functions else frames[-1:]
    if not inside:
        return "", ""
    first = inside[0][0]
    line = [line for code, line in inside if code.co_filename == first.co_filename][-1]
    return first.co_name if of_functions else "", f"{Path(first.co_filename).name}, line {line}"


def of_model(error: BaseException) -> BaseException:
    """The error that is raised for one that a function of a model raised."""
    name, line = line_in(error.__traceback__)
    where = f"`model.{name}`" if name else "`model`"
    if isinstance(error, HarvesterError) or _goes_through(error):
        if line:
            error.add_note(f"raised by {where} ({line})")
        return error
    text = quoted(str(error))
    raised = type(error).__name__ + (f": {text}" if text else "")
    at = f" ({line})" if line else ""
    return InputError(f"{where} must give its numbers, but raises {raised}{at}")


def _goes_through(error: BaseException) -> bool:
    """Whether an exception is an ordinary one that another process gets as it is."""
    if not isinstance(error, Exception) or isinstance(error, StopIteration | StopAsyncIteration):
        return False
    try:
        return type(cloudpickle.loads(cloudpickle.dumps(error))) is type(error)
    except Exception:  # any, of a class of the user's own
        return False


def is_interrupt(error: BaseException) -> bool:
    """Whether an exception is the user's ^C, rather than a model's own KeyboardInterrupt."""
    trace = error.__traceback__
    if not isinstance(error, KeyboardInterrupt) or trace is None:
        return False
    while trace.tb_next is not None:
        trace = trace.tb_next
    return dis.opname[trace.tb_frame.f_code.co_code[trace.tb_lasti]] != "RAISE_VARARGS"


def not_compiled(error: Exception, model: str, remedy: str = IN_PYTHON) -> InputError:
    """The error for a model that numba does not compile, with the line that numba names."""
    text = COLOUR.sub("", str(error))
    lines = [line for line in map(str.strip, text.splitlines()) if line]
    why = next((line for line in lines if not HEADING.match(line)), type(error).__name__)
    lines_of_files = [(a or b, c or d) for a, c, b, d in LINE_OF_FILE.findall(text)]
    of_model = [
        pair for pair in lines_of_files if not str(Path(pair[0]).resolve()).startswith(NOT_MODELS)
    ]
    at = f" ({Path(of_model[-1][0]).name}, line {of_model[-1][1]})" if of_model else ""
    return InputError(
        f"`model` must be such that numba compiles it, but {model} is not: {quoted(why)}{at} "
        f"({remedy})"
    )


def quoted(text: str) -> str:
    """A stranger's text in one line of at most `LONGEST` letters, without control characters."""
    return escaped(" ".join(text.split()))[:LONGEST]


@contextmanager
def unraisable(kept: Callable[[BaseException], Any]) -> Iterator[None]:
    """Hand on exceptions of compiled functions, which Python would print and forget."""
    before = sys.unraisablehook

    def hook(about: Any) -> None:
        """Keep the exception; those of others, such as of a destructor, are Python's."""
        if about.exc_value is None:
            before(about)
        else:
            kept(about.exc_value)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before
