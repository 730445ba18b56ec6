"""Where the ngspice library is."""

import ctypes.util
import os
from pathlib import Path

from harvester.errors import MissingProgramError


def find_library() -> str:
    """Path or name of the ngspice library: NGSPICE_LIBRARY_PATH, else the system's.

    Raises
    ------
    MissingProgramError
        when there is none, with how to get it.
    """
    given = os.environ.get("NGSPICE_LIBRARY_PATH")
    found = given or ctypes.util.find_library("ngspice")
    if found is None or (given and not Path(given).is_file()):
        where = f" at NGSPICE_LIBRARY_PATH = {given!r}" if given else ""
        raise MissingProgramError(
            f"engine 'spice' must have ngspice installed, but its library is missing{where}: "
            "run 'make setup' or 'apt-get install libngspice0 ngspice'"
        )
    return found
