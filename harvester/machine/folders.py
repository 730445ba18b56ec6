"""Folders that nobody but the user writes: the cache, whose machine code is run as it is found, and bare ones in it."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import platformdirs

from harvester.errors import InputError, shown
from harvester.machine.system import this_system

VARIABLE = "NUMBA_CACHE_DIR"  # of the environment: another place for the cache


def cache_folder() -> Path | None:
    """The folder of the cache, made if it is missing; None if none can be written.

    Raises InputError for one that another user owns or may write.
    """
    return private(
        Path(os.environ.get(VARIABLE) or platformdirs.user_cache_dir("harvester")).absolute()
    )


def private(path: Path) -> Path | None:
    """A folder of the user, made if it is missing; None if it cannot be written.

    Raises as `cache_folder`.
    """
    try:
        path.mkdir(0o700, parents=True, exist_ok=True)
        state = path.stat()
    except OSError:
        return None
    if this_system.others_may_write(state):
        raise InputError(
            f"the cache must be a folder of your own that nobody else may write, but {shown(str(path))} is not: "
            f"'chmod go-w' if it is yours, or name another in {VARIABLE}"
        )
    return path if os.access(path, os.W_OK) else None


def bare(name: str, file: str) -> str:
    """The path of a folder, in the cache or else a temporary one, that holds an empty ``file`` and nothing else.

    Raises InputError if something else is there, and as `cache_folder`.
    """
    folder = (cache_folder() or Path(_temporary().name)) / name
    try:
        folder.mkdir(0o700, exist_ok=True)
        (folder / file).touch()
        folder.chmod(0o500)
        content = [(entry.name, entry.lstat().st_size) for entry in folder.iterdir()]
    except OSError as error:
        raise InputError(
            f"{shown(str(folder))} must be a folder of your own, but is not: {error.strerror}"
        ) from None
    if content != [(file, 0)]:
        raise InputError(
            f"{shown(str(folder))} must hold nothing but an empty {file}, but does not: remove it"
        )
    return str(folder)


@contextmanager
def at_home(folder: str) -> Iterator[None]:
    """Make a folder the current one, and the home, for the files that a library reads as it loads; then return."""
    home = os.environ.get("HOME")
    with this_system.back_to_this_folder():
        try:
            os.chdir(folder)
            os.environ["HOME"] = folder
            yield
        finally:
            os.environ.pop("HOME", None)
            if home is not None:
                os.environ["HOME"] = home


@cache
def _temporary() -> "tempfile.TemporaryDirectory[str]":
    """A temporary folder of this process, removed when it ends."""
    return tempfile.TemporaryDirectory(prefix="harvester-")
