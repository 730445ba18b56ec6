"""A store that a rectifier charges and a sensor node empties: states that end by time or by a voltage.

    C dV/dt = I(V, t) - V/R_leak - i_s(V),     i_s = I_s, or I_s V_supply/(efficiency V) behind a regulator

In each state s this is one equation of V alone, which Runge and Kutta's method of fourth order follows; where V passes
a threshold the state ends.  The node sees V - ESR i_s.  What would charge the store above the clamp is lost.  I(V, t)
is one function of V, or one in each window of a record that repeats itself (`harvester.storage.recorded_current`), or
what a chip makes of either (`harvester.storage.supply`).
"""

import math
from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.mechanics.kernels.compiled import forced, kernel
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.bought_parts import Chip
from harvester.storage.recorded_current import RecordedCurrent
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.supply import charging_current, output_efficiency

GRID, ROUGH = 4000, 400  # voltages of a state's table; of one in each window
PART = 0.02  # of the highest voltage: what a step may change it by
LONGEST = 60.0  # s of a step, while it waits
SAME = 1e-10  # of the highest voltage: packets that begin at voltages so near repeat themselves
DONE = 1.0 - 1e-12  # of the time
SEEN = 20_000  # points of the course in time that are kept, at most
DAY = 86400.0
RAN, PACKETS, BROWN_OUTS, GIVEN, CLAMPED, END, FIRST, POINTS = range(8)  # of the counts


@dataclass
class NodeCourse:
    """What happened: seconds that it ran, packets sent and lost, the time of the first, and V over time.

    ``given`` and ``clamped`` are the energies (J) that came from the rectifier and that the clamp took.  Points of the
    course are up to where it repeats itself.  ``days`` has the packets of each day, where it does not.
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
    days: Floats = field(default_factory=lambda: np.empty(0))


class NodeRun:
    """A node on a store, whose charging current is a table; with a ``chip`` that is what the chip makes of it."""

    def __init__(
        self, current: RectifiedCurrent | RecordedCurrent, storage: Storage, node: SensorNode, chip: Chip | None = None
    ) -> None:
        clamp = storage.clamp_voltage
        highest = float(current.voltages[-1]) if chip is None or chip.ratio is None else chip.full
        highest = max(highest, node.wake_voltage, storage.initial_voltage or 0.0)
        self.top = highest if clamp is None else min(highest, clamp)
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
        days = np.zeros(max(math.ceil(seconds / DAY), 1))
        v = min(self.storage.initial_voltage or 0.0, self.top)
        levels = np.array([self.node.wake_voltage, self.top, self.storage.farads, self.length])
        durations = np.array([one for _, one in self.states])
        follow_node(
            self.charging, self.drawn, durations, stops, self.waiting, levels, v, seconds, counts, t, volts, days
        )
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
            days=days,
        )

    def _stop(self, drawn: Floats) -> float:
        """The store's voltage at which a state stops."""
        seen = self.volts - (self.storage.esr or 0.0) * drawn
        above = np.flatnonzero(seen >= self.node.stop_voltage)
        return float(self.volts[above[0]]) if len(above) else math.inf


@forced
def _rate(u, scale, finest, row, drawn):
    """The current (A) into the store at a voltage, and how it grows from one point of the table to the next."""
    place = min(max(u * scale, 0.0), float(finest))
    k = min(int(place), finest - 1)
    low, high = row[k] - drawn[k], row[k + 1] - drawn[k + 1]
    return low + (place - k) * (high - low), high - low


@kernel
def follow_state(charging, drawn, levels, v, duration, threshold, side, counts, t, volts, apart):
    """Go on in a state for a duration, or until V passes a threshold upwards (``side`` 1) or downwards: V there."""
    top, farads, length = levels[1], levels[2], levels[3]
    finest = charging.shape[1] - 1
    scale, left = finest / top, duration
    if side * (v - threshold) >= 0.0:
        return v
    while left > 0.0:
        row, room = charging[0], left
        if length > 0.0:
            window = math.floor(counts[END] / length * (1.0 + 1e-14) + 1e-9)
            room = max((window + 1.0) * length - counts[END], 1e-9 * length)
            row = charging[int(window) % charging.shape[0]]
        a, slope = _rate(v, scale, finest, row, drawn)
        a /= farads
        steepest = abs(slope) * scale / farads
        step = min(left, room, LONGEST, PART * top / max(abs(a), 1e-300), 1.0 / max(steepest, 1e-300))
        if left - step < 1e-12 * duration:
            step = left
        b = _rate(v + 0.5 * step * a, scale, finest, row, drawn)[0] / farads
        c = _rate(v + 0.5 * step * b, scale, finest, row, drawn)[0] / farads
        d = _rate(v + step * c, scale, finest, row, drawn)[0] / farads
        new = v + step / 6.0 * (a + 2.0 * (b + c) + d)
        there = side * (new - threshold) >= 0.0 and new != v
        if there:
            step *= (threshold - v) / (new - v)
            new = threshold
        middle = 0.5 * (v + min(new, top))
        counts[GIVEN] += row[min(int(middle * scale), finest)] * middle * step
        if new > top:
            counts[CLAMPED] += farads * (new - top) * top
            new = top
        counts[END] += step
        left -= step
        v = max(new, 0.0)
        points = int(counts[POINTS])
        if points < len(t) and (points == 0 or counts[END] - t[points - 1] >= apart):
            t[points], volts[points] = counts[END], v
            counts[POINTS] += 1.0
        if there or step == 0.0:
            return v
    return v


@kernel
def follow_node(charging, drawn, durations, stops, waiting, levels, v, seconds, counts, t, volts, days):
    """Fill the counts, the course and the packets of each ``days`` of a node for a time from the voltage v on.

    ``charging``, shape (windows, points), and ``drawn``, shape (states, points), are currents (A) at even voltages up to
    the top; ``levels`` are the wake voltage, the top, the capacitance and the length of a window, 0 for one that lasts.
    The last of the states, which last ``durations`` and end at the voltages ``stops``, is sleep.
    """
    wake, repeats, apart = levels[0], levels[3] == 0.0, seconds / SEEN
    ever, last = stops.max() < wake, len(durations) - 1
    woken, begun = np.full(6, math.nan), np.empty(6)
    while counts[END] < seconds * DONE:
        rose = v < wake
        v = follow_state(charging, waiting, levels, v, seconds - counts[END], wake, 1.0, counts, t, volts, apart)
        if v < wake:
            continue
        if rose and repeats:  # what follows is the same each time
            if not math.isnan(woken[0]):
                _repeat(counts, woken, seconds)
            woken[:] = counts[:6]
        before, on = math.nan, True
        begun[:] = counts[:6]
        while on and counts[END] < seconds * DONE:
            if repeats and abs(v - before) < SAME * levels[1]:
                _repeat(counts, begun, seconds)
            before = v
            begun[:] = counts[:6]
            for k in range(last + 1):
                left = min(durations[k], seconds - counts[END])
                v = follow_state(charging, drawn[k], levels, v, left, stops[k], -1.0, counts, t, volts, apart)
                if v <= stops[k]:
                    counts[BROWN_OUTS] += 1.0
                    on = False
                    break
                if k == last - 1:
                    counts[PACKETS] += 1.0
                    days[min(int(counts[END] / DAY), len(days) - 1)] += 1.0
                    if counts[FIRST] == 0.0:
                        counts[FIRST] = counts[END]
            counts[RAN] += counts[END] - begun[END]
        if not on and not ever:  # it would stop as soon as it begins: wait with the node off
            v = follow_state(
                charging, waiting, levels, v, seconds - counts[END], math.inf, 1.0, counts, t, volts, apart
            )


@forced
def _repeat(counts, before, seconds):
    """Go on with whole cycles, as that since the counts ``before``, up to a time in all."""
    cycle = counts[END] - before[END]
    times = math.floor((seconds - counts[END]) / cycle) if cycle > 0.0 else 0.0
    for k in range(6):
        counts[k] += times * (counts[k] - before[k])
