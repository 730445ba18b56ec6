"""Names for the array types of the package's signatures."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Complexes: TypeAlias = NDArray[np.complex128]
Bools: TypeAlias = NDArray[np.bool_]
Words: TypeAlias = NDArray[np.uint64]
# one for all, or an array that broadcasts with the amplitudes
Coefficient: TypeAlias = float | Floats


def aligned(shape: tuple[int, ...], kind: Any = np.float64) -> NDArray[Any]:
    """Zeros that begin on the boundary of a cache line (64 bytes), so that vector loads never straddle two."""
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    raw = np.zeros(size + 64, dtype=np.uint8)
    whole: NDArray[Any] = raw[-raw.ctypes.data % 64 :][:size].view(kind).reshape(shape)
    return whole
