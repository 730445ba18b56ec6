"""Where a result comes from: the command, the versions, the machine."""

import os
import platform
import re
import sys
from datetime import UTC, datetime
from importlib import metadata
from typing import Any

from harvester import __version__
from harvester.machine.system import this_system

PACKAGES = ("numpy", "scipy", "numba", "PySpice", "matplotlib")


def versions() -> dict[str, str]:
    """Versions of Python, this package and the packages that compute; '' if one is not installed."""
    return {"python": platform.python_version(), "harvester": __version__} | {
        name: version(name) for name in PACKAGES
    }


def version(package: str) -> str:
    """The version of an installed package; '' if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def machine() -> dict[str, Any]:
    """Processor, cores and system of this machine."""
    processor = this_system.processor() or platform.processor() or platform.machine()
    return {"processor": processor, "cores": os.cpu_count(), "system": platform.platform()}


def without_password(address: str) -> str:
    """An address without what stands before its last @: the name and the password of a user."""
    return re.sub(r"://\S*@", "://...@", address)


def unicode(text: str) -> str:
    """A text of the system, such as an argument in a locale without UTF-8, for a file."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def origin() -> dict[str, Any]:
    """The origin of a result: the command, without the password of an address, the time, versions and machine."""
    return {
        "command": [unicode(without_password(argument)) for argument in sys.argv[1:]],
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": versions(),
        "machine": machine(),
    }
