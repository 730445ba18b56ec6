"""Files of machine code that several processes read and write at once.

numba's own files are whole whenever they are read, but two processes that compile for different arguments at a time
give their machine code the same number: the one can then load that of the other.  And all processes that lack the same
machine code compile it.  Here a process that begins to compile locks the machine code's turn, for which the others
wait; and one at a time writes.
"""

import hashlib
import pickle
from pathlib import Path
from typing import IO, Any

from numba.core import caching as numba_caching

from harvester.machine.locks import alone, locked, unlock
from harvester.mechanics.kernels.vector_width import width


class KeptFiles(numba_caching.IndexDataCacheFile):
    """The files of a cached function, where one that is cut off, as by a crash of the machine, counts as absent."""

    def __init__(self, cache_path: str, filename_base: str, source_stamp: Any) -> None:
        super().__init__(cache_path, filename_base, source_stamp)
        self._turns: dict[Any, IO[bytes] | None] = {}  # one that is not saved, as after ^C, stays ours

    def load(self, key: Any) -> Any:
        """The machine code of a key; None where this process must compile it, and no other does so meanwhile."""
        found = super().load(key)
        if found is None and key not in self._turns:
            self._turns[key] = locked(self._place(f"turn-{hashlib.sha256(str(key).encode()).hexdigest()[:2]}"))
            found = super().load(key)
            if found is not None:
                unlock(self._turns.pop(key))
        return found

    def save(self, key: Any, data: Any) -> None:
        """Keep the machine code of a key, and give its turn away."""
        with alone(self._place("written")):
            super().save(key, data)
        unlock(self._turns.pop(key, None))

    def _place(self, name: str) -> Path:
        """A file beside those of the function to lock."""
        return Path(f"{self._index_path}.{name}")

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except (pickle.UnpicklingError, EOFError):
            return {}

    def _load_data(self, name: str) -> Any:
        try:
            return super()._load_data(name)
        except (pickle.UnpicklingError, EOFError):
            raise FileNotFoundError(name) from None  # which numba expects


class FilesOfThisPackage(KeptFiles):
    """The same, of a function whose source the folder's name is a hash of: its path and its time do not matter."""

    def __init__(self, cache_path: str, filename_base: str, source_stamp: Any) -> None:
        room = Path(cache_path)
        room = room.with_name(room.name.rsplit("_", 1)[0])  # numba appends a hash of the source's path
        room.mkdir(parents=True, exist_ok=True)
        super().__init__(str(room), filename_base, None)

    def load(self, key: Any) -> Any:
        """The machine code of a key with vectors of the present width, as of `KeptFiles.load`."""
        return super().load((key, width()))

    def save(self, key: Any, data: Any) -> None:
        """Keep it."""
        super().save((key, width()), data)
