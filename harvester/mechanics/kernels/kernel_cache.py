"""Files of machine code that several processes read and write at once, one file for each set of argument types.

A file begins with the checksum of its name and of the rest: one that was cut off, altered or
exchanged, as by a crash or a worn disk, counts as absent, for its contents are run.  Among several
processes that lack the same machine code, one locks its turn and compiles, and the others wait for
its entries.  If nothing can be kept, as on a full disk, kernels are compiled in each process.
"""

import contextlib
import hashlib
import pickle
from pathlib import Path
from typing import IO, Any

from numba.core import caching as numba_caching

from harvester.errors import InputError
from harvester.machine import files
from harvester.machine.locks import locked, unlock
from harvester.mechanics.kernels.vector_width import width

MOST = 1_000_000_000  # bytes of a file
CHECKSUM = hashlib.sha256().digest_size  # bytes at its beginning


class KeptFiles(numba_caching.IndexDataCacheFile):
    """The files of a cached function, in the place of numba's own, which have an index and no checksum."""

    def __init__(self, cache_path: str, filename_base: str, source_stamp: Any) -> None:
        super().__init__(cache_path, filename_base, source_stamp)
        # one that is not saved, as after ^C, stays ours
        self._turns: dict[Any, IO[bytes] | None] = {}

    def load(self, key: Any) -> Any:
        """The machine code of a key.

        None if this process must compile it, and no other does so meanwhile.
        """
        path = self._file(key)
        code = _read(path)
        if code is None and path not in self._turns:
            self._turns[path] = locked(
                path.with_name(f"{path.name.rsplit('.', 2)[0]}.turn-{_digest(key)[:2]}")
            )
            code = _read(path)
            if code is not None:
                unlock(self._turns.pop(path))
        return code

    def save(self, key: Any, data: Any) -> None:
        """Keep the machine code of a key if the disk accepts it, and give its turn away."""
        path, content = self._file(key), self._dump(data)
        with contextlib.suppress(InputError):
            files.write(path, [_checksum(path, content), content])
        unlock(self._turns.pop(path, None))

    def _file(self, key: Any) -> Path:
        """The file of a key, which has the function's source and also numba's version in its name."""
        name = _digest((self._version, self._source_stamp, key))
        return Path(self._index_path).with_suffix(f".{name}.nbc")


def _digest(key: Any) -> str:
    return hashlib.sha256(str(key).encode()).hexdigest()[:16]


def _checksum(path: Path, content: bytes) -> bytes:
    """The checksum of a file's content and of its path below the cache."""
    return hashlib.sha256("/".join(path.parts[-3:]).encode() + b"\n" + content).digest()


def _read(path: Path) -> Any:
    """The contents of a file; None if it is missing or damaged."""
    with contextlib.suppress(InputError):
        data = files.read(path, "cache", MOST)
        if _checksum(path, data[CHECKSUM:]) == data[:CHECKSUM]:
            return pickle.loads(data[CHECKSUM:])
    return None


class FilesOfThisPackage(KeptFiles):
    """The same, of a function whose source the folder's name is a hash of: its path and its time do not matter."""

    def __init__(self, cache_path: str, filename_base: str, source_stamp: Any) -> None:
        room = Path(cache_path)
        # numba appends a hash of the source's path
        room = room.with_name(room.name.rsplit("_", 1)[0])
        with contextlib.suppress(OSError):
            room.mkdir(parents=True, exist_ok=True)
        super().__init__(str(room), filename_base, None)

    def load(self, key: Any) -> Any:
        """The machine code of a key with vectors of the present width, as of `KeptFiles.load`."""
        return super().load((key, width()))

    def save(self, key: Any, data: Any) -> None:
        """Keep it."""
        super().save((key, width()), data)
