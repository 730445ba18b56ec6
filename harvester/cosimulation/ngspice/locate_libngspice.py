"""The place of the ngspice library: the user's choice, the wheel of `piezo-harvester-ngspice`, or the system's."""

import hashlib
import importlib
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from harvester.errors import MissingProgramError, shown
from harvester.machine.system import this_system

REMEDY = "run 'make setup', 'pip install piezo-harvester[ngspice]' or 'apt-get install libngspice0 ngspice'"

OTHER_PATH = (
    "run 'unset NGSPICE_LIBRARY_PATH', or set it to the path of a file such as libngspice.so.0"
)


def find_library() -> str:
    """Find the ngspice library: the path in NGSPICE_LIBRARY_PATH, else that of the wheel, else the system's.

    Raises MissingProgramError when there is none, with how to get it.
    """
    named = os.environ.get("NGSPICE_LIBRARY_PATH")
    library = named or _in_wheel() or this_system.library("ngspice")
    if named and not Path(named).is_file():
        raise MissingProgramError(
            "engine 'spice' must have ngspice installed, but its library is missing at "
            f"NGSPICE_LIBRARY_PATH = {shown(named)}: {OTHER_PATH}"
        )
    if library is None:
        raise MissingProgramError(
            f"engine 'spice' must have ngspice installed, but its library is missing: {REMEDY}"
        )
    return library


def code_models(library: str) -> list[Path]:
    """The files of code models that a library must be given: those of the wheel for the wheel's library.

    Any other library has them listed in its own start file, and gets none.
    """
    return _wheel().code_models() if library == _in_wheel() else []


def library_digest() -> str:
    """Say which ngspice library there is without loading it: its name, and a hash of its file if that is found.

    Raises MissingProgramError as `find_library`.
    """
    library = find_library()
    path = Path(library) if Path(library).is_file() else this_system.library_file(library)
    with suppress(OSError):
        return f"{path.name}:{hashlib.sha256(path.read_bytes()).hexdigest()[:8]}"
    return path.name


def _wheel() -> Any:
    """The package of the wheel, which holds the library and its path.

    None if it is not installed.
    """
    with suppress(ImportError):
        return importlib.import_module("piezo_harvester_ngspice")
    return None


def _in_wheel() -> str | None:
    """The path of the wheel's library."""
    with suppress(FileNotFoundError):
        return str(_wheel().library()) if _wheel() is not None else None
    return None
