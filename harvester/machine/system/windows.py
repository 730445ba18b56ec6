"""The ways of Windows: type-checked, and tested against replacements of its calls.

Untested on Windows itself.
"""

import sys

assert sys.platform == "win32"  # checkers of types read on for Windows only

import ctypes
import ctypes.util
import msvcrt
import os
import subprocess
import winreg
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

_LOCKED_BYTE = 1 << 30  # behind all content: a locked byte cannot be read
# of its function WaitForSingleObject
_SYNCHRONIZE = 0x00100000
_FOREVER = 0xFFFFFFFF
_STILL_RUNS = 0x102
_PROCESSOR = r"HARDWARE\DESCRIPTION\System\CentralProcessor\0"


class Windows:
    """The Windows versions; `harvester.machine.system.posix` describes the requirements on each system."""

    def address_space(self) -> int | None:
        """Know of no limit: Windows has none that a shell sets."""
        return None

    def processor(self) -> str:
        """Read it from the registry."""
        with suppress(OSError), winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, _PROCESSOR) as key:
            return str(winreg.QueryValueEx(key, "ProcessorNameString")[0]).strip()
        return ""

    def library(self, name: str) -> str | None:
        """Look along PATH, as Windows does."""
        return ctypes.util.find_library(name) or ctypes.util.find_library(f"lib{name}-0")

    def library_file(self, library: str) -> Path:
        """The library's own path."""
        return Path(library)

    def open_to_read(self, path: str | Path) -> int:
        """Open as bytes; Windows keeps pipes elsewhere than files."""
        return os.open(path, os.O_RDONLY | os.O_BINARY)

    def open_new(self, path: Path) -> int:
        """Open a new file for writing, as bytes; Windows has no such links in general."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_BINARY | os.O_NOINHERIT
        return os.open(path, flags, 0o666)

    def flush_folder(self, path: Path) -> None:
        """Do nothing: Windows opens no folder as a file, and keeps a journal of names."""

    def open_to_lock(self, path: Path) -> int:
        """Open for reading and writing, and for this process only."""
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_BINARY | os.O_NOINHERIT, 0o600)

    def open_folder_to_lock(self, path: Path) -> int:
        """Open a file in it, as a folder cannot be opened; it disappears when it is closed."""
        return os.open(
            path / ".locked", os.O_RDWR | os.O_CREAT | os.O_NOINHERIT | os.O_TEMPORARY, 0o600
        )

    def lock(self, file: int) -> bool:
        """Lock one byte behind the content."""
        os.lseek(file, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        finally:
            os.lseek(file, 0, os.SEEK_SET)
        return True

    def others_may_write(self, state: os.stat_result) -> bool:
        """Leave it to the user's own folder, into which Windows lets no other user write."""
        return False

    @contextmanager
    def back_to_this_folder(self) -> Iterator[None]:
        """Keep its path: Windows removes no folder that is the current one of a process."""
        here = Path.cwd()
        try:
            yield
        finally:
            os.chdir(here)

    def own_group(self) -> dict[str, Any]:
        """For processes, which ^C of the console does not reach."""
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}

    def group_lives(self, group: int) -> bool:
        """Ask for its first process: the others end by themselves soon after it."""
        handle = _handle(group)
        lives = bool(handle) and _kernel().WaitForSingleObject(handle, 0) == _STILL_RUNS
        _kernel().CloseHandle(handle)
        return lives

    def kill_group(self, group: int) -> None:
        """End the first process and all that it started, by the system's own program."""
        program = Path(os.environ["SYSTEMROOT"], "System32", "taskkill.exe")
        subprocess.run([program, "/T", "/F", "/PID", str(group)], capture_output=True, check=False)

    @contextmanager
    def without_interrupts(self) -> Iterator[None]:
        """Let this process ignore ^C, which the processes inherit."""
        _kernel().SetConsoleCtrlHandler(None, True)
        try:
            yield
        finally:
            _kernel().SetConsoleCtrlHandler(None, False)

    def wait_for_end_of(self, parent: int) -> None:
        """Wait for the process itself; one that has ended has no handle."""
        handle = _handle(parent)
        if handle:
            _kernel().WaitForSingleObject(handle, _FOREVER)
            _kernel().CloseHandle(handle)

    def give_way(self, priority: int) -> None:
        """Continue as before: the priorities of Windows are others."""

    def after_fork(self, function: Callable[[], None]) -> None:
        """Do nothing: Windows does not fork."""


def _kernel() -> "ctypes.WinDLL":
    """The system's library, with the types of its pointers."""
    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    kernel.OpenProcess.restype = ctypes.c_void_p
    kernel.WaitForSingleObject.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
    kernel.WaitForSingleObject.restype = ctypes.c_uint32
    kernel.CloseHandle.argtypes = [ctypes.c_void_p]
    return kernel


def _handle(process: int) -> int | None:
    """The handle by which Windows waits for a process; None if there is not such a process."""
    handle: int | None = _kernel().OpenProcess(_SYNCHRONIZE, False, process)
    return handle
