"""Names for the array types of the package's signatures."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Words: TypeAlias = NDArray[np.uint64]
Coefficient: TypeAlias = float | Floats  # one for all, or an array that broadcasts with the amplitudes
