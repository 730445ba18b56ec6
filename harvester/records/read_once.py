"""Files that are read once, for as long as they do not change."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

_T = TypeVar("_T")


def read_once(read: Callable[[str], _T], path: str) -> _T:
    """What a file holds; one that did not change is read once."""
    try:
        state = Path(path).stat()
    except (OSError, ValueError):  # the reader says why
        return read(path)
    content: _T = _kept(read, path, (state.st_mtime_ns, state.st_size))
    return content


@lru_cache(8)
def _kept(read: Callable[[str], Any], path: str, _state: tuple[int, int]) -> Any:
    return read(path)
