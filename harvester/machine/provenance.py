"""Where a result comes from: the command, the versions, the machine."""

import os
import platform
import re
import sys
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from harvester import __version__

PACKAGES = ("numpy", "scipy", "numba", "PySpice", "matplotlib")


def versions() -> dict[str, str]:
    """Versions of Python, this package and the packages that compute; '' where one is not installed."""
    found = {"python": platform.python_version(), "harvester": __version__}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = ""
    return found


def machine() -> dict[str, Any]:
    """Processor, cores and system of this machine."""
    processor = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
        processor = names[0] if names else processor
    except OSError:
        pass
    return {"processor": processor, "cores": os.cpu_count(), "system": platform.platform()}


def origin() -> dict[str, Any]:
    """The origin of a result: the command, without the password of an address, the time, versions and machine."""
    return {
        "command": [re.sub(r"://[^/@\s]+@", "://...@", one) for one in sys.argv[1:]],
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": versions(),
        "machine": machine(),
    }
