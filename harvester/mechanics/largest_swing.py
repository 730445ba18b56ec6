"""The size of a periodic response: its RMS, and its largest displacement and voltage."""

import numpy as np

from harvester.arrays import Floats


def peak(series: Floats) -> tuple[float, float]:
    """The largest size of a periodic series, shape (n,), and by how much it may be larger between two samples.

    That is the change to a sample next to it: so steep may a corner be, such as a voltage has at an
    impact.
    """
    sizes = np.abs(series)
    k = int(sizes.argmax())
    return float(sizes[k]), float(sizes[k] - min(sizes[k - 1], sizes[(k + 1) % len(sizes)]))


class Swing:
    """The size of a periodic response, from its `motion`, shape (n, 2 or more), with x and V at each kick."""

    @property
    def motion(self) -> Floats:
        """The columns x and V, nondimensional, a row a kick."""
        raise NotImplementedError

    @property
    def displacement(self) -> float:
        """The RMS of x about its mean, nondimensional."""
        return float(np.std(self.motion[:, 0]))

    @property
    def peaks(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The largest |x| and |V|, nondimensional, and by how much each may be larger between two kicks."""
        return peak(self.motion[:, 0]), peak(self.motion[:, 1])

    @property
    def peak_displacement(self) -> float:
        """The largest |x| at a kick, nondimensional."""
        return self.peaks[0][0]

    @property
    def peak_voltage(self) -> float:
        """The largest |V| at a kick, nondimensional."""
        return self.peaks[1][0]
