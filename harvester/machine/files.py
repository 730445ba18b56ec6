"""Files that are written whole or not at all: first under another name, then renamed."""

import contextlib
import os
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

from harvester.errors import InputError, invalid

VECTOR = ("svg", "pdf")  # forms of a figure beside its .png


def folder(path: str | Path, argument: str = "out") -> Path:
    """Make sure that a folder exists and can be written, and return it; errors name the ``argument``.

    Raises InputError where it cannot be made or written.
    """
    if not str(path):  # Path("") is the present folder: an unset variable of a shell
        raise invalid(f"`{argument}`", "be a folder", "")
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise InputError(
            f"`{argument}` must be a folder that can be written, but {str(path)!r} is not: {error.strerror}"
        ) from None
    return path


def check_vector(forms: Sequence[str]) -> None:
    """Raise an InputError for a vector form that is none of `VECTOR`, before anything is computed."""
    for form in forms:
        if form not in VECTOR:
            raise invalid("`vector`", "be svg or pdf", form)


def write(path: Path, content: str | bytes | Iterable[bytes], argument: str = "out") -> None:
    """Write a file, which gets its name only when it is complete; errors name the ``argument``.

    ``content`` is one piece or several.

    Raises InputError where the disk or the folder does not take it; an older file of that name stays as it was.
    """
    if isinstance(content, str):
        content = content.encode()
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with beside.open("wb") as file:
            file.writelines([content] if isinstance(content, bytes) else content)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError as error:
        raise InputError(f"`{argument}` must take {path.name}, but writing failed: {error.strerror}") from None
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
