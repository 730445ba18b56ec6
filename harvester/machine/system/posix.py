"""The ways of Linux and macOS: POSIX, and the additions of each."""

import sys

assert sys.platform != "win32"  # checkers of types read on for other systems only

import ctypes.util
import errno
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

LOOK = 0.3  # seconds between two checks whether the program that started a worker still lives
_BY_OTHERS = 0o022  # permissions to write
# Homebrew's on both processors, MacPorts'
_LIBRARY_FOLDERS = ("/opt/homebrew/lib", "/usr/local/lib", "/opt/local/lib")


class Posix:
    """The common part of Linux and macOS."""

    def open_to_read(self, path: str | Path) -> int:
        """Open a file for reading, without waiting for the writer of a pipe: O_NONBLOCK."""
        return os.open(path, os.O_RDONLY | os.O_NONBLOCK)

    def open_new(self, path: Path) -> int:
        """Open a new file for writing: O_EXCL, and O_NOFOLLOW against a link of that name."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        return os.open(path, flags, 0o666)  # less the user's umask

    def flush_folder(self, path: Path) -> None:
        """Flush the names in a folder to the disk, if the folder can be read and has a disk."""
        try:
            folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        except PermissionError:  # a folder that may be written only
            return
        try:
            os.fsync(folder)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP):
                raise
        finally:
            os.close(folder)

    def open_to_lock(self, path: Path) -> int:
        """Open a file for `lock`, made if it is missing, and not for other processes; a pipe waits for nobody so."""
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)

    def open_folder_to_lock(self, path: Path) -> int:
        """Open a folder for `lock`: the folder itself."""
        return os.open(path, os.O_RDONLY)

    def lock(self, file: int) -> bool:
        """Lock an open file until it is closed, by flock, which ends with the process.

        False if another one has it.

        Raises OSError if files cannot be locked.
        """
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def others_may_write(self, state: os.stat_result) -> bool:
        """Whether a folder is another user's, or others may write into it: by owner and permissions."""
        return state.st_uid != os.geteuid() or bool(state.st_mode & _BY_OTHERS)

    @contextmanager
    def back_to_this_folder(self) -> Iterator[None]:
        """Go back to the present current folder at the end, which is kept open meanwhile.

        O_PATH, if there is one, opens a folder that cannot be read.
        """
        here = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
        try:
            yield
        finally:
            os.fchdir(here)
            os.close(here)

    def own_group(self) -> dict[str, Any]:
        """The options of `subprocess.Popen` that put a program into a group of its own, a session."""
        return {"start_new_session": True}

    def group_lives(self, group: int) -> bool:
        """Whether a process of the group lives: by signal 0, which does nothing."""
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        return True

    def kill_group(self, group: int) -> None:
        """End all processes of a group at once, by SIGKILL."""
        with suppress(ProcessLookupError):
            os.killpg(group, signal.SIGKILL)

    @contextmanager
    def without_interrupts(self) -> Iterator[None]:
        """Processes that are started meanwhile never get ^C: they inherit that the signal is blocked."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def wait_for_end_of(self, parent: int) -> None:
        """Wait until the process that started this one has ended: one without a parent gets another."""
        while os.getppid() == parent:
            time.sleep(LOOK)

    def give_way(self, priority: int) -> None:
        """Let this process wait for others, from a priority of 0, theirs, down to 19."""
        os.nice(max(priority - os.nice(0), 0))

    def after_fork(self, function: Callable[[], None]) -> None:
        """Call a function in each program that is forked from this one."""
        os.register_at_fork(after_in_child=function)


class Linux(Posix):
    """The additions of Linux: limits of the address space, /proc, and a list of installed libraries."""

    def address_space(self) -> int | None:
        """The bytes of memory that this process may address, by `ulimit -v`.

        None without a limit.
        """
        room = resource.getrlimit(resource.RLIMIT_AS)[0]
        return None if room == resource.RLIM_INFINITY else room

    def processor(self) -> str:
        """The name of CPU time, from /proc; '' if the system does not state it."""
        with suppress(OSError):
            text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
            if match := re.search(r"^model name\s*:\s*(.*\S)", text, re.MULTILINE):
                return match[1]
        return ""

    def library(self, name: str) -> str | None:
        """The name by which an installed library loads, from the linker's list.

        None if it is not found.

        Raises OSError if the system starts no process, which Python's search treats as a missing
        library.
        """
        library = ctypes.util.find_library(name)
        if library is None:
            self._listed()
        return library

    def library_file(self, library: str) -> Path:
        """The file of a library that `library` named, as far as it can be known: its folder is in the linker's list."""
        with suppress(OSError):
            if match := re.search(rf"\b{re.escape(library)} .*=> (.+)", self._listed()):
                return Path(match[1])
        return Path(library)

    def _listed(self) -> str:
        """The linker's list, empty if absent."""
        with suppress(FileNotFoundError, PermissionError):
            return subprocess.run(
                ["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=False
            ).stdout
        return ""


class MacOS(Posix):
    """The properties of macOS: no limit of the address space that holds, sysctl, and folders of libraries."""

    def address_space(self) -> int | None:
        """Know of no limit: the system accepts one and does not keep to it."""
        return None

    def processor(self) -> str:
        """Ask sysctl."""
        with suppress(OSError):
            command = ["/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string"]
            return subprocess.run(
                command, capture_output=True, text=True, check=False
            ).stdout.strip()
        return ""

    def library(self, name: str) -> str | None:
        """Look in further places than the system's own search: Homebrew on Apple's processors."""
        paths = [Path(folder) / f"lib{name}.dylib" for folder in _LIBRARY_FOLDERS]
        return ctypes.util.find_library(name) or next(
            (str(path) for path in paths if path.is_file()), None
        )

    def library_file(self, library: str) -> Path:
        """The library's own path."""
        return Path(library)
