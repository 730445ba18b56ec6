"""The course of a sensor node on a storage capacitor: packets, energies and the final state."""

import math
from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats

LASTS = 10.0  # outages that a node is followed for, at most


@dataclass(frozen=True)
class NodeState:
    """The end of a course: the voltages (V) of storage capacitor and branches, and whether the node is on."""

    volts: float
    on: bool
    pores: Floats


@dataclass
class NodeCourse:
    """The events: seconds that it ran, packets that arrived and that were lost, the time of the first, V over time.

    ``given``, ``clamped``, ``used`` and ``leaked`` are the energies (J) that came from the
    rectifier, that the clamp dissipated, that the node consumed, and that leaked.
    ``lasts`` is how long (s) it continues without excitation after ``end``, at most `LASTS` times
    the outage that is asked for, ``survived`` whether that is at least the outage, and
    ``outage_packets`` are those that it sends in it; 0 each if none is asked for.

    Points of the course end when it repeats itself.  ``hours`` has the packets of each hour,
    evenly from there on. ``intervals`` are the mean times (s) between packets in bins, and how many
    there were, shape (2, n), ascending; ``last`` is the time of the last packet.  In the mean of
    several courses numbers are not whole ones.
    """

    ran: float = 0.0
    packets: float = 0
    lost: float = 0
    brown_outs: float = 0
    first: float | None = None
    last: float | None = None
    given: float = 0.0
    clamped: float = 0.0
    used: float = 0.0
    leaked: float = 0.0
    end: float = 0.0
    lasts: float = 0.0
    survived: float = 0.0
    outage_packets: float = 0.0
    left: NodeState | None = None
    t: Floats = field(default_factory=lambda: np.empty(0))
    volts: Floats = field(default_factory=lambda: np.empty(0))
    hours: Floats = field(default_factory=lambda: np.empty(0))
    intervals: Floats = field(default_factory=lambda: np.empty((2, 0)))

    def share_running(self, packet: float) -> float:
        """The fraction of the time from its first packet on, which lasts so many seconds."""
        if self.first is None:
            return 0.0
        return min(self.ran / (self.end - self.first + packet), 1.0)

    def interval(self, share: float) -> float:
        """The time (s) between packets that a ``share`` of all is not above; inf without one."""
        times, numbers = self.intervals
        if not len(times):
            return math.inf
        return float(times[np.searchsorted(np.cumsum(numbers), share * numbers.sum() - 1e-9)])
