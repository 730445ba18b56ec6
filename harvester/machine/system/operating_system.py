"""What the package asks of an operating system; each of Linux, macOS and Windows answers in its own way."""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any


class OperatingSystem(ABC):
    """An operating system."""

    @abstractmethod
    def address_space(self) -> int | None:
        """The bytes of memory that this process may address; None where there is no limit."""

    @abstractmethod
    def processor(self) -> str:
        """The name of the processor; '' where the system does not say."""

    @abstractmethod
    def library(self, name: str) -> str | None:
        """The name or path by which an installed library loads, such as "ngspice"; None where it is not found."""

    def library_file(self, library: str) -> Path:
        """The file of a library that `library` named, as far as it can be known."""
        return Path(library)

    @abstractmethod
    def open_to_read(self, path: str | Path) -> int:
        """Open a file for reading, without waiting for the writer of a pipe."""

    @abstractmethod
    def open_to_lock(self, path: Path) -> int:
        """Open a file for `lock`, made where it is missing: without waiting, and not handed to other processes."""

    @abstractmethod
    def open_folder_to_lock(self, path: Path) -> int:
        """Open a folder for `lock`."""

    @abstractmethod
    def lock(self, file: int) -> bool:
        """Lock an open file until it is closed; False where another process has it.

        Raises OSError where files cannot be locked.
        """

    @abstractmethod
    def others_may_write(self, state: os.stat_result) -> bool:
        """Whether a folder is another user's, or others may write into it."""

    @abstractmethod
    def back_to_this_folder(self) -> AbstractContextManager[None]:
        """Go back to the present current folder at the end, though it may be one that cannot be read."""

    @abstractmethod
    def own_group(self) -> dict[str, Any]:
        """The options of `subprocess.Popen` that put a program into a group of its own."""

    @abstractmethod
    def group_lives(self, group: int) -> bool:
        """Whether a process of the group lives."""

    @abstractmethod
    def kill_group(self, group: int) -> None:
        """End all processes of a group at once."""

    @abstractmethod
    def without_interrupts(self) -> AbstractContextManager[None]:
        """Processes that are started meanwhile never get ^C."""

    @abstractmethod
    def wait_for_end_of(self, parent: int) -> None:
        """Wait until the process that started this one has ended."""

    @abstractmethod
    def after_fork(self, function: Callable[[], None]) -> None:
        """Call a function in each program that is forked from this one."""
