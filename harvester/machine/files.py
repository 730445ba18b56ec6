"""Files that are read only if they are files, and written whole or not at all: under another name, then renamed."""

import contextlib
import os
import secrets
import stat
import tempfile
from collections.abc import Iterable, Sequence
from errno import EEXIST
from pathlib import Path

from harvester.errors import InputError, invalid, shown
from harvester.machine.system import this_system

VECTOR = ("svg", "pdf")  # forms of a figure beside its .png
SHORTEST, TRIALS = 50, 100  # letters of a file's name in its temporary one; names that are tried
KINDS = (
    (stat.S_ISLNK, "link"),
    (stat.S_ISCHR, "device"),
    (stat.S_ISBLK, "device"),
    (stat.S_ISFIFO, "pipe"),
    (stat.S_ISSOCK, "socket"),
)


def folder(path: str | Path, argument: str = "out") -> Path:
    """Make sure that a folder exists and can be written, and return it.

    Errors name the ``argument``.

    Raises InputError if it cannot be made or written.
    """
    if not str(path):  # Path("") is the present folder: an unset variable of a shell
        raise invalid(f"`{argument}`", "be a folder", "")
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except (OSError, ValueError) as error:
        raise InputError(
            f"`{argument}` must be a folder that can be written, but {shown(str(path))} is not: {_cause(error)}"
        ) from None
    return path


def check_parent(path: Path, argument: str = "out") -> None:
    """Check that the folder of a file is there or can be made by `write`; nothing is made yet.

    Raises InputError, which names the ``argument``, if not.
    """
    there = path.parent
    try:
        while not there.exists():
            there = there.parent
        with tempfile.TemporaryFile(dir=there):
            pass
    except (OSError, ValueError) as error:
        raise InputError(
            f"`{argument}` must be in a folder that can be written, but {shown(str(path.parent))} "
            f"is not: {_cause(error)}"
        ) from None


def read(path: str | Path, argument: str, most: int) -> bytes:
    """Read a file of at most ``most`` bytes; errors begin with ``argument``, such as "`points`".

    Raises InputError if it is not a regular file, is longer, or cannot be read.
    """
    data = read_part(path, argument, 0, most + 1)
    if len(data) > most:
        raise InputError(
            f"{argument} must be a file of at most {most} bytes, but {shown(str(path))} is longer"
        )
    return data


def read_part(path: str | Path, argument: str, begin: int, most: int) -> bytes:
    """Read at most ``most`` bytes of a file from ``begin`` on; errors begin with ``argument``.

    Only a regular file is read: a pipe would wait for its writer, and a device such as /dev/zero
    has no end.

    Raises InputError if it is not one, or cannot be read.
    """
    name = shown(str(path))
    try:
        with os.fdopen(this_system.open_to_read(path), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise OSError(0, "it is a pipe or a device")
            file.seek(begin)
            return file.read(most)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{argument} must be a readable file, but {name} is not: {_cause(error)}"
        ) from None


def _cause(error: OSError | ValueError) -> str:
    """Why the system did not open a file.

    ValueError is Python's of a name that no file can have.
    """
    return error.strerror or "" if isinstance(error, OSError) else "its name has a NUL character"


def check_vector(forms: Sequence[str], argument: str = "vector") -> None:
    """Raise an InputError for a vector form that is not in `VECTOR`; it names the ``argument``."""
    for form in forms:
        if form not in VECTOR:
            raise invalid(f"`{argument}`", "be svg or pdf", form)


def remove(path: Path, argument: str = "out") -> None:
    """Remove a file, if there is one; raises InputError for a folder, a device, and others."""
    check_regular(path, argument)
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(
            f"`{argument}`: cannot write {path.name} over the existing one: {error.strerror}"
        ) from None


def write(path: Path, content: str | bytes | Iterable[bytes], argument: str = "out") -> None:
    """Write a file, which gets its name only when it is complete; errors name the ``argument``.

    Its folder is made if it is missing.  ``content`` is one piece or several.  The file is written
    under a name that nothing has had, and both it and its folder are flushed to the disk.

    Raises InputError if the disk or the folder refuses it, or if the name is that of a link,
    a device, a pipe or a socket; an older file of that name stays as it was.
    """
    if isinstance(content, str):
        content = content.encode()
    if path.name in ("", ".."):
        raise invalid(f"`{argument}`", "be the path of a file", str(path))
    check_regular(path, argument)
    beside: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside, number = _new_beside(path)
        with os.fdopen(number, "wb") as file:
            file.writelines([content] if isinstance(content, bytes) else content)
            file.flush()
            os.fsync(file.fileno())
        check_regular(path, argument)  # made meanwhile
        beside.replace(path)
        beside = None
        this_system.flush_folder(path.parent)
    except OSError as error:
        raise InputError(
            f"`{argument}` must accept {path.name}, but writing failed: {error.strerror}"
        ) from None
    finally:
        if beside is not None:
            with contextlib.suppress(OSError):
                beside.unlink(missing_ok=True)


def _new_beside(path: Path) -> tuple[Path, int]:
    """A new empty file in the folder of a path, and its descriptor; others are left alone."""
    name = path.name[:SHORTEST]  # with the rest it must be no longer than a name may be
    for _ in range(TRIALS):
        beside = path.with_name(f".{name}.{os.getpid()}.{secrets.token_hex(4)}")
        with contextlib.suppress(FileExistsError):
            return beside, this_system.open_new(beside)
    raise FileExistsError(EEXIST, os.strerror(EEXIST))


def check_regular(path: Path, argument: str) -> None:
    """Raise an InputError for a link, a device, a pipe or a socket; the system refuses folders."""
    try:
        mode = path.lstat().st_mode
    except (OSError, ValueError):  # there is none, or writing says why
        return
    for is_kind, kind in KINDS:
        if is_kind(mode):
            raise InputError(
                f"`{argument}` must be the path of a regular file, but {shown(str(path))} "
                f"is a {kind}: choose another name"
            )
