"""Where the ngspice library is installed."""

import contextlib
import ctypes.util
import hashlib
import os
import re
import subprocess
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


def library_digest() -> str:
    """Say which ngspice library there is without loading it: its name, and a hash of its file where that is found.

    Raises MissingProgramError as `find_library`.
    """
    path = Path(find_library())
    with contextlib.suppress(OSError):
        listed = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=False).stdout
        if found := re.search(rf"\b{re.escape(str(path))} .*=> (.+)", listed):
            path = Path(found[1])
        return f"{path.name}:{hashlib.sha256(path.read_bytes()).hexdigest()[:8]}"
    return path.name
