"""A store that a rectifier charges and a sensor node empties: states that end by time or by a voltage.

    C dV/dt = I(V, t) - V/R_leak - i_s(V),     i_s = I_s, or I_s V_supply/(efficiency V) behind a regulator

In each state s this is one equation of V alone, which Runge and Kutta's method of fourth order follows; where V passes
a threshold the state ends.  The node sees V - ESR i_s.  What would charge the store above the clamp is lost.  I(V, t)
is one function of V, or one in each window of a record that repeats itself (`harvester.storage.recorded_current`), or
what a chip makes of either (`harvester.storage.supply`).
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from harvester.arrays import Floats
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.bought_parts import Chip
from harvester.storage.node_kernel import HOUR, SEEN, follow_node
from harvester.storage.recorded_current import RecordedCurrent
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.supply import charging_current, output_efficiency

GRID, ROUGH = 4000, 400  # voltages of a state's table; of one in each window


@dataclass
class NodeCourse:
    """What happened: seconds that it ran, packets sent and lost, the time of the first, and V over time.

    ``given`` and ``clamped`` are the energies (J) that came from the rectifier and that the clamp took.  Points of the
    course are up to where it repeats itself.  ``hours`` has the packets of each hour, where it does not.
    """

    ran: float = 0.0
    packets: int = 0
    brown_outs: int = 0
    first: float | None = None
    given: float = 0.0
    clamped: float = 0.0
    end: float = 0.0
    t: Floats = field(default_factory=lambda: np.empty(0))
    volts: Floats = field(default_factory=lambda: np.empty(0))
    hours: Floats = field(default_factory=lambda: np.empty(0))


class NodeRun:
    """A node on a store, whose charging current is a table; with a ``chip`` that is what the chip makes of it."""

    def __init__(
        self, current: RectifiedCurrent | RecordedCurrent, storage: Storage, node: SensorNode, chip: Chip | None = None
    ) -> None:
        clamp = storage.clamp_voltage
        highest = float(current.voltages[-1])
        if chip is not None:
            highest = min(highest, chip.most) if chip.ratio is None else chip.full
        highest = max(highest, node.wake_voltage, storage.initial_voltage or 0.0)
        self.top = highest if clamp is None else min(highest, clamp)
        if chip is not None:  # the node begins where the chip's output does
            wake, stop = max(node.wake_voltage, chip.rise), max(node.stop_voltage, chip.fall)
            node = replace(node, wake_voltage=wake, stop_voltage=stop)
        self.storage, self.node, self.chip = storage, node, chip
        windows = current.length if isinstance(current, RecordedCurrent) else 0.0
        self.length = windows
        self.volts = np.linspace(0.0, self.top, (ROUGH if windows else GRID) + 1)
        leak = 0.0 if storage.leakage_resistance is None else self.volts / storage.leakage_resistance
        came = current.at(self.volts) if chip is None else charging_current(chip, current, self.volts)
        self.charging = np.atleast_2d(came - leak)
        sleep = node.sleep_current or 0.0
        asleep = node.interval - sum(seconds for _, seconds in node.states)
        self.states = [*node.states, (sleep, asleep)]
        self.drawn = np.array([self._drawn(amperes) for amperes, _ in self.states])
        self.waiting = np.full(len(self.volts), node.stopped_current or 0.0)

    def _drawn(self, amperes: float) -> Floats:
        """The current out of the store, at each voltage."""
        node = self.node
        if node.supply_voltage is None:
            return np.full(len(self.volts), amperes)
        share = node.efficiency or (1.0 if self.chip is None else output_efficiency(self.chip, amperes))
        return amperes * node.supply_voltage / share / np.maximum(self.volts, 1e-3 * self.top)

    @property
    def needed(self) -> float:
        """The mean power (W) that the node takes from the store while it runs, at the wake voltage."""
        k = round(min(self.node.wake_voltage, self.top) / self.top * (len(self.volts) - 1))
        charge = sum(float(drawn[k]) * seconds for drawn, (_, seconds) in zip(self.drawn, self.states, strict=True))
        return charge / self.node.interval * self.node.wake_voltage

    def course(self, seconds: float) -> NodeCourse:
        """What happens in a time from the beginning."""
        stops = np.array([self._stop(drawn) for drawn in self.drawn])
        counts, t, volts = np.zeros(8), np.empty(SEEN + 2), np.empty(SEEN + 2)
        hours = np.zeros(max(math.ceil(seconds / HOUR), 1))
        v = min(self.storage.initial_voltage or 0.0, self.top)
        levels = np.array([self.node.wake_voltage, self.top, self.storage.farads, self.length])
        durations = np.array([one for _, one in self.states])
        currents = self.charging, self.drawn, self.waiting
        follow_node(*currents, durations, stops, levels, v, seconds, counts, t, volts, hours)
        ran, packets, brown_outs, given, clamped, end, first, points = counts.tolist()
        kept = slice(round(points))
        return NodeCourse(
            ran=ran,
            packets=round(packets),
            brown_outs=round(brown_outs),
            first=first or None,
            given=given,
            clamped=clamped,
            end=end,
            t=t[kept],
            volts=volts[kept],
            hours=hours,
        )

    def _stop(self, drawn: Floats) -> float:
        """The store's voltage at which a state stops."""
        seen = self.volts - (self.storage.esr or 0.0) * drawn
        above = np.flatnonzero(seen >= self.node.stop_voltage)
        return float(self.volts[above[0]]) if len(above) else math.inf
