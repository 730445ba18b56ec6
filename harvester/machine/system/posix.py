"""The ways of Linux and macOS: POSIX, and what each has besides."""

import sys

assert sys.platform != "win32"  # checkers of types read on for other systems only

import ctypes.util
import fcntl
import os
import re
import resource
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from harvester.machine.system.operating_system import OperatingSystem

LOOK = 0.3  # seconds between two checks whether the program that started a worker still lives
_BY_OTHERS = 0o022  # permissions to write
_LIBRARY_FOLDERS = ("/opt/homebrew/lib", "/usr/local/lib", "/opt/local/lib")  # Homebrew's on both processors, MacPorts'


class Posix(OperatingSystem):
    """What Linux and macOS do alike."""

    def open_to_read(self, path: str | Path) -> int:
        """Open without waiting: O_NONBLOCK."""
        return os.open(path, os.O_RDONLY | os.O_NONBLOCK)

    def open_to_lock(self, path: Path) -> int:
        """Open for reading and writing: a pipe opened so waits for nobody."""
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)

    def open_folder_to_lock(self, path: Path) -> int:
        """Open the folder itself."""
        return os.open(path, os.O_RDONLY)

    def lock(self, file: int) -> bool:
        """Lock by flock, which ends with the process."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def others_may_write(self, state: os.stat_result) -> bool:
        """Ask for owner and permissions."""
        return state.st_uid != os.geteuid() or bool(state.st_mode & _BY_OTHERS)

    @contextmanager
    def back_to_this_folder(self) -> Iterator[None]:
        """Keep the folder open; O_PATH, where there is one, opens a folder that cannot be read."""
        here = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
        try:
            yield
        finally:
            os.fchdir(here)
            os.close(here)

    def own_group(self) -> dict[str, Any]:
        """A session, whose number is that of its first process."""
        return {"start_new_session": True}

    def group_lives(self, group: int) -> bool:
        """Ask with signal 0, which does nothing."""
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        return True

    def kill_group(self, group: int) -> None:
        """End them by SIGKILL."""
        with suppress(ProcessLookupError):
            os.killpg(group, signal.SIGKILL)

    @contextmanager
    def without_interrupts(self) -> Iterator[None]:
        """Block the signal, which the processes inherit."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def wait_for_end_of(self, parent: int) -> None:
        """Ask for the parent now and then: a process without one gets another."""
        while os.getppid() == parent:
            time.sleep(LOOK)

    def after_fork(self, function: Callable[[], None]) -> None:
        """Have Python call it."""
        os.register_at_fork(after_in_child=function)


class Linux(Posix):
    """What Linux has besides: limits of the address space, /proc, and a list of installed libraries."""

    def address_space(self) -> int | None:
        """Read the limit of `ulimit -v`."""
        room = resource.getrlimit(resource.RLIMIT_AS)[0]
        return None if room == resource.RLIM_INFINITY else room

    def processor(self) -> str:
        """Read it from /proc."""
        with suppress(OSError):
            text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
            if found := re.search(r"^model name\s*:\s*(.*\S)", text, re.MULTILINE):
                return found[1]
        return ""

    def library(self, name: str) -> str | None:
        """Ask the linker's list, which has names without their folder."""
        return ctypes.util.find_library(name)

    def library_file(self, library: str) -> Path:
        """Look up the folder in the linker's list."""
        with suppress(OSError):
            listed = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=False).stdout
            if found := re.search(rf"\b{re.escape(library)} .*=> (.+)", listed):
                return Path(found[1])
        return Path(library)


class MacOS(Posix):
    """What macOS has besides: no limit of the address space that holds, sysctl, and folders of libraries."""

    def address_space(self) -> int | None:
        """Know of no limit: the system takes one and does not keep to it."""
        return None

    def processor(self) -> str:
        """Ask sysctl."""
        with suppress(OSError):
            command = ["/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string"]
            return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
        return ""

    def library(self, name: str) -> str | None:
        """Look where the system's own search does not, too: Homebrew on Apple's processors."""
        paths = [Path(folder) / f"lib{name}.dylib" for folder in _LIBRARY_FOLDERS]
        return ctypes.util.find_library(name) or next((str(path) for path in paths if path.is_file()), None)
