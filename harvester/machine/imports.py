"""Libraries that take settings from files of the current folder, loaded without them: it may be a stranger's."""

import importlib
import os
import sys


def load_elsewhere(name: str) -> bool:
    """Import a library while the root is the current folder; False, and nothing is done, where it is loaded already."""
    if name in sys.modules:
        return False
    here = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))  # O_PATH: it may be a folder that cannot be read
    try:
        os.chdir("/")
        importlib.import_module(name)
    finally:
        os.fchdir(here)
        os.close(here)
    return True
