"""How libraries are loaded: without the settings that some read from files of the current folder, and undisturbed."""

import gc
import importlib
import os
import sys

from harvester.machine.system import this_system


def search_garbage_rarely() -> None:
    """Let Python look through older objects for garbage less often than it does by itself, in this whole process.

    Libraries and compiled kernels make hundreds of thousands of objects that stay: looking through them again and
    again takes a tenth of the time that a process needs to load numba and ngspice.  For processes of our own only.
    """
    gc.set_threshold(700, 50, 50)


def load_elsewhere(name: str) -> bool:
    """Import a library while the root is the current folder.

    False, and nothing is done, if it is loaded already.

    That folder may be a stranger's.
    """
    if name in sys.modules:
        return False
    with this_system.back_to_this_folder():
        os.chdir("/")
        importlib.import_module(name)
    return True
