"""Where the ngspice library is installed."""

import ctypes.util
import os
from pathlib import Path

from harvester.errors import MissingProgramError


def find_library() -> str:
    """Find the ngspice library: the path in NGSPICE_LIBRARY_PATH, else the system's.

    Raises MissingProgramError when there is none, with how to get it.
    """
    named = os.environ.get("NGSPICE_LIBRARY_PATH")
    found = named or ctypes.util.find_library("ngspice")
    if found is None or (named and not Path(named).is_file()):
        where = f" at NGSPICE_LIBRARY_PATH = {named!r}" if named else ""
        raise MissingProgramError(
            f"engine 'spice' must have ngspice installed, but its library is missing{where}: "
            "run 'make setup' or 'apt-get install libngspice0 ngspice'"
        )
    return found
