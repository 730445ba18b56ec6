"""A store that a rectifier charges and a sensor node empties: states that end by time or by a voltage.

    C dV/dt = I(V) - V/R_leak - i_s(V),     i_s = I_s, or I_s V_supply/(efficiency V) behind a regulator

In each state s this is one equation of V alone, which Runge and Kutta's method of fourth order follows; where V passes
a threshold the state ends.  The node sees V - ESR i_s.  What would charge the store above the clamp is lost.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.rectified_current import RectifiedCurrent

GRID = 4000  # voltages of a state's table
PART = 0.02  # of the highest voltage: what a step may change it by
LONGEST = 60.0  # s of a step, while it waits
SAME = 1e-10  # of the highest voltage: packets that begin at voltages so near repeat themselves
DONE = 1.0 - 1e-12  # of the time
SEEN = 20_000  # points of the course in time that are kept, at most


@dataclass
class NodeCourse:
    """What happened: seconds that it ran, packets sent and lost, the time of the first, and V over time.

    ``given`` and ``clamped`` are the energies (J) that came from the rectifier and that the clamp took.  Points of the
    course are ``apart`` (s) at least, up to where it repeats itself.
    """

    ran: float = 0.0
    packets: int = 0
    brown_outs: int = 0
    first: float | None = None
    given: float = 0.0
    clamped: float = 0.0
    end: float = 0.0
    apart: float = 0.0
    t: list[float] = field(default_factory=list)
    volts: list[float] = field(default_factory=list)

    @property
    def counts(self) -> Floats:
        """What grows with time."""
        return np.array([self.ran, self.packets, self.brown_outs, self.given, self.clamped, self.end])

    def repeat(self, before: Floats, seconds: float) -> None:
        """Go on with whole cycles, as that since the counts ``before``, up to a time in all."""
        cycle = self.counts - before
        times = math.floor((seconds - self.end) / cycle[-1]) if cycle[-1] > 0.0 else 0
        self.ran, packets, brown_outs, self.given, self.clamped, self.end = (self.counts + times * cycle).tolist()
        self.packets, self.brown_outs = round(packets), round(brown_outs)


class _State(NamedTuple):
    """A state of the node: dV/dt (V/s) and the charging current (A) at each voltage, and V at which it stops."""

    rates: list[float]
    charging: list[float]
    stop: float


class NodeRun:
    """A node on a store, whose charging current is a table."""

    def __init__(self, current: RectifiedCurrent, storage: Storage, node: SensorNode) -> None:
        clamp = storage.clamp_voltage
        highest = max(float(current.voltages[-1]), node.wake_voltage, storage.initial_voltage or 0.0)
        self.top = highest if clamp is None else min(highest, clamp)
        self.storage, self.node = storage, node
        self.volts = np.linspace(0.0, self.top, GRID + 1)
        leak = 0.0 if storage.leakage_resistance is None else self.volts / storage.leakage_resistance
        self.charging = current.at(self.volts) - leak
        self._scale = GRID / self.top
        sleep = node.sleep_current or 0.0
        self.packet = [(self._drawn(amperes), seconds) for amperes, seconds in node.states]
        self.sleep = self._drawn(sleep), node.interval - sum(seconds for _, seconds in node.states)
        self.waiting = np.full(GRID + 1, node.stopped_current or 0.0)

    def _drawn(self, amperes: float) -> Floats:
        """The current out of the store, at each voltage."""
        node = self.node
        if node.supply_voltage is None:
            return np.full(GRID + 1, amperes)
        power = amperes * node.supply_voltage / (node.efficiency or 1.0)
        return power / np.maximum(self.volts, 1e-3 * self.top)

    @property
    def needed(self) -> float:
        """The mean power (W) that the node takes from the store while it runs, at the wake voltage."""
        k = round(min(self.node.wake_voltage, self.top) * self._scale)
        charge = sum(float(drawn[k]) * seconds for drawn, seconds in (*self.packet, self.sleep))
        return charge / self.node.interval * self.node.wake_voltage

    def course(self, seconds: float) -> NodeCourse:
        """What happens in a time from the beginning."""
        found, v = NodeCourse(apart=seconds / SEEN), min(self.storage.initial_voltage or 0.0, self.top)
        woken: Floats | None = None
        wake, waiting = self.node.wake_voltage, self._state(self.waiting)
        states = [(self._state(drawn), duration) for drawn, duration in (*self.packet, self.sleep)]
        ever = max(state.stop for state, _ in states) < wake  # else it stops as soon as it begins
        while found.end < seconds * DONE:
            rose = v < wake
            v = self._follow(found, v, waiting, seconds - found.end, wake, 1.0)
            if v >= wake and rose:  # what follows is the same each time
                if woken is not None:
                    found.repeat(woken, seconds)
                woken = found.counts
            if v >= wake:
                v = self._awake(found, v, states, seconds)
            if v >= wake and not ever:
                self._follow(found, v, waiting, seconds - found.end, math.inf, 1.0)
        return found

    def _awake(self, found: NodeCourse, v: float, states: list[tuple[_State, float]], seconds: float) -> float:
        """Packets, the last of whose states is sleep, until the node stops or the time is over: the voltage there."""
        before, counts = math.nan, found.counts
        while found.end < seconds * DONE:
            if abs(v - before) < SAME * self.top:
                found.repeat(counts, seconds)
            before, counts, begun = v, found.counts, found.end
            for k, (state, duration) in enumerate(states):
                v = self._follow(found, v, state, min(duration, seconds - found.end), state.stop, -1.0)
                if v <= state.stop:
                    found.brown_outs += 1
                    found.ran += found.end - begun
                    return v
                if k == len(states) - 2:
                    found.packets += 1
                    found.first = found.end if found.first is None else found.first
            found.ran += found.end - begun
        return v

    def _state(self, drawn: Floats) -> _State:
        """The state in which the node draws a current, at each voltage."""
        seen = self.volts - (self.storage.esr or 0.0) * drawn
        above = np.flatnonzero(seen >= self.node.stop_voltage)
        stop = float(self.volts[above[0]]) if len(above) else math.inf
        return _State(((self.charging - drawn) / self.storage.farads).tolist(), self.charging.tolist(), stop)

    def _follow(
        self, found: NodeCourse, v: float, state: _State, duration: float, threshold: float, side: float
    ) -> float:
        """Go on in a state for a duration, or until V passes a threshold upwards (``side`` 1) or downwards: V there."""
        rates, charging, _ = state
        scale, top = self._scale, self.top

        def rate(u: float) -> float:
            place = min(max(u, 0.0), top) * scale
            k = min(int(place), GRID - 1)
            return rates[k] + (place - k) * (rates[k + 1] - rates[k])

        left = duration
        if side * (v - threshold) >= 0.0:
            return v
        while left > 0.0:
            a, k = rate(v), min(int(v * scale), GRID - 1)
            slope = abs(rates[k + 1] - rates[k]) * scale
            step = min(left, LONGEST, PART * top / max(abs(a), 1e-300), 1.0 / max(slope, 1e-300))
            step = left if left - step < 1e-12 * duration else step
            b = rate(v + 0.5 * step * a)
            c = rate(v + 0.5 * step * b)
            d = rate(v + step * c)
            new = v + step / 6.0 * (a + 2.0 * (b + c) + d)
            if side * (new - threshold) >= 0.0 and new != v:
                step *= (threshold - v) / (new - v)
                new = threshold
            gain = charging[min(int(0.5 * (v + min(new, top)) * scale), GRID)] * 0.5 * (v + min(new, top)) * step
            found.given += gain
            if new > top:
                found.clamped += self.storage.farads * (new - top) * top
                new = top
            found.end += step
            left -= step
            v = max(new, 0.0)
            if not found.t or found.end - found.t[-1] >= found.apart:
                found.t.append(found.end)
                found.volts.append(v)
            if new == threshold:
                return v
            if step == 0.0:
                break
        return v
