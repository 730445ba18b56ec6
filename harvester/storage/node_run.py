"""A storage capacitor that a rectifier charges and a sensor node empties: states that end by time or by a voltage.

    C dV/dt = I(V, t) - V/R_leak - i_s(V),     i_s = I_s, or I_s V_supply/(efficiency V) behind a regulator

In each state s this is one equation of V alone, which Runge and Kutta's method of fourth order
follows; if V passes a threshold the state ends.  The node sees V - ESR i_s.  Charge that moves into
the pores of a supercapacitor is that of a line of resistance and capacitance, closed at its end,
next to C (`branches_of`).  A battery keeps its voltage; the changing quantity is the share of its
charge, here that fraction of the voltage.  Charge beyond the clamp is lost.  I(V, t) is
one function of V, or one in each window of a record that repeats itself
(`harvester.storage.recorded_current`), or a chip's output from either (`harvester.storage.supply`).
"""

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from harvester.arrays import Floats
from harvester.quantities.preferred_numbers import between
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.bought_parts import Chip
from harvester.storage.node_course import LASTS, NodeCourse, NodeState
from harvester.storage.node_kernel import (
    BINS,
    COUNTS,
    END,
    FIRST,
    HOUR,
    INTERVALS,
    LAST,
    ON,
    PACKETS,
    POINTS,
    RAN,
    SEEN,
    VOLTS,
    follow_node,
)
from harvester.storage.recorded_current import AnyCurrent, RecordedCurrent
from harvester.storage.rectified_current import times_to
from harvester.storage.supply import charging_current, output_efficiency

# voltages of a state's table; of one in each window, and of one in many
GRID = 4000
ROUGH = 400
FEWEST = 100
MOST_POINTS = 2**21  # of all windows
BRANCHES = 6  # of a line, the last of which has the rest of its capacitance
AGAIN = 0.01  # of an empty battery's charge: where it feeds the node again
LARGER = 1e5  # times the capacitance: larger ones are not offered
FINE = 1.02  # between intervals that are offered
DRAWN = 65_536  # packets of which the tries are drawn, and repeated


def branches_of(storage: Storage) -> Floats:
    """Conductances, capacitances and first voltages of the branches in parallel with a storage capacitor, shape (3, n).

    A line of resistance R and capacitance C that is closed at its end is sqrt(sC/R)
    tanh(sqrt(sRC)), the sum over k of branches with R/2 and 2C/(pi (k - 1/2))^2 in series.
    """
    if storage.diffusion_capacitance is None or storage.diffusion_resistance is None:
        return np.empty((3, 0))
    farads = 2.0 * storage.diffusion_capacitance / (math.pi * (np.arange(BRANCHES) + 0.5)) ** 2
    farads[-1] += storage.diffusion_capacitance - farads.sum()
    ones = np.ones(BRANCHES)
    return np.array(
        [2.0 / storage.diffusion_resistance * ones, farads, (storage.initial_voltage or 0.0) * ones]
    )


def _top_of(current: AnyCurrent, storage: Storage, chip: Chip | None) -> float:
    """The voltage that a storage capacitor does not exceed."""
    if storage.battery_voltage is not None:
        return storage.battery_voltage
    highest = float(current.voltages[-1])
    if chip is not None:
        highest = min(highest, chip.most) if chip.ratio is None else chip.full
    highest = max(highest, storage.initial_voltage or 0.0)
    return min(highest, storage.clamp_voltage or math.inf)


def _late(current: AnyCurrent, storage: Storage, node: SensorNode, chip: Chip | None) -> float:
    """How much later (s) storage wakes the node than by I(V) alone: the mass rings up from rest, the current lags.

    For a chip that holds its input this is the ring-up into an empty storage capacitor, and half of
    its first look: the input's capacitor returns the charge that it gains in a look, so that the
    whole is the most. A record rings its mass up itself.
    """
    first = storage.initial_voltage or 0.0
    wake = node.wake_voltage
    if isinstance(current, RecordedCurrent) or storage.battery_voltage is not None or first >= wake:
        return 0.0
    if chip is not None and chip.ratio is not None:
        return max(current.start, 0.0) + 0.5 * chip.look
    whole = current.scaled(1.0, -(0.0 if chip is None else chip.low_quiescent or chip.quiescent))
    at_once = replace(whole, lag=np.zeros_like(whole.lag), ring_up=0.0)
    levels = np.array([first, wake])
    times, sooner = (times_to(levels, each, storage.farads, math.inf) for each in (whole, at_once))
    return (
        max(current.start + float(np.diff(times - sooner)[0]), 0.0)
        if np.isfinite(times).all()
        else 0.0
    )


class NodeRun:
    """A node on a storage capacitor, whose charging current is a table.

    With a ``chip`` that is the chip's output.
    """

    def __init__(
        self,
        current: AnyCurrent,
        storage: Storage,
        node: SensorNode,
        chip: Chip | None = None,
        outage: float | None = None,
        points: int = GRID,
    ) -> None:
        self.current = current
        self.outage = outage
        self.top = _top_of(current, storage, chip)
        if chip is not None:  # the node begins where the chip's output does
            wake, stop = max(node.wake_voltage, chip.rise), max(node.stop_voltage, chip.fall)
            node = replace(node, wake_voltage=wake, stop_voltage=stop)
        self.storage = storage
        self.node = node
        self.chip = chip
        self.late = _late(current, storage, node, chip)
        self.length = current.length if isinstance(current, RecordedCurrent) else 0.0
        if isinstance(current, RecordedCurrent):
            points = max(min(ROUGH, MOST_POINTS // len(current.current)), FEWEST)
        self.volts = np.linspace(0.0, self.top, points + 1)
        if storage.battery_voltage is not None:
            self.volts[:] = storage.battery_voltage
        leak = (
            0.0 if storage.leakage_resistance is None else self.volts / storage.leakage_resistance
        )
        came = (
            current.at(self.volts) if chip is None else charging_current(chip, current, self.volts)
        )
        self.charging = np.atleast_2d(came - leak)
        self.dark = np.atleast_2d(-leak - (0.0 if chip is None else chip.quiescent))
        sleep = node.sleep_current or 0.0
        packet = sum(seconds for _, seconds in node.states)
        self.states = [*node.states, (sleep, node.interval - packet)]
        self.spared = (node.low_interval or node.interval) - packet
        self.drawn = np.array([self._drawn(amperes) for amperes, _ in self.states])
        less = (
            chip.quiescent - chip.low_quiescent if chip is not None and chip.low_quiescent else 0.0
        )
        self.waiting = np.full(len(self.volts), (node.stopped_current or 0.0) - less)

    def at(self, table: Floats, volts: float) -> float:
        """A current of the tables at a voltage."""
        position = min(max(volts / self.top, 0.0), 1.0) * (len(self.volts) - 1)
        k = min(int(position), len(self.volts) - 2)
        return float(table[k] + (position - k) * (table[k + 1] - table[k]))

    def _drawn(self, amperes: float) -> Floats:
        """The current out of the storage capacitor, at each voltage."""
        node = self.node
        if node.supply_voltage is None:
            return np.full(len(self.volts), amperes)
        share = node.efficiency or (
            1.0 if self.chip is None else output_efficiency(self.chip, amperes)
        )
        return amperes * node.supply_voltage / share / np.maximum(self.volts, 1e-3 * self.top)

    @property
    def farads(self) -> float:
        """The capacitance (F) of the storage, or a battery's charge over its voltage."""
        store = self.storage
        return (
            store.farads
            if store.battery_voltage is None
            else (store.battery_charge or 0.0) / self.top
        )

    @property
    def needed(self) -> float:
        """The mean power (W) that the node draws from the storage capacitor at the wake voltage, without retries."""
        k = round(min(self.node.wake_voltage, self.top) / self.top * (len(self.volts) - 1))
        charge = sum(
            float(drawn[k]) * seconds
            for drawn, (_, seconds) in zip(self.drawn, self.states, strict=True)
        )
        return charge / self.node.interval * float(self.volts[k])

    def course(self, seconds: float) -> NodeCourse:
        """The events in a time from the beginning."""
        node, storage = self.node, self.storage
        stops = np.array([self.stop_of(drawn) for drawn in self.drawn])
        counts = np.zeros(COUNTS)
        t = np.empty(SEEN + 2)
        volts = np.empty(SEEN + 2)
        counts[END] = min(self.late, seconds)
        hours = np.zeros(max(math.ceil(seconds / HOUR), 1))
        v = min(storage.initial_voltage or 0.0, self.top)
        wake = node.wake_voltage
        if storage.battery_voltage is not None:
            v = self.top
            wake = AGAIN * self.top
        levels = self._levels(wake, self.length)
        durations = np.array([duration for _, duration in self.states])
        currents = self.charging, self.drawn, self.waiting
        branches = branches_of(storage)
        course = (t, volts, hours)
        follow_node(
            currents,
            durations,
            stops,
            levels,
            branches=branches,
            tries=self._tries(),
            v=v,
            seconds=seconds,
            counts=counts,
            course=course,
        )
        ran, packets, lost, brown_outs, given, clamped, used, leaked, end = counts[:9].tolist()
        kept = slice(round(counts[POINTS]))
        numbers, sums = counts[INTERVALS:FIRST].reshape(2, BINS)
        some = numbers > 0.0
        followed = NodeCourse(
            ran=ran,
            packets=round(packets),
            lost=round(lost),
            brown_outs=round(brown_outs),
            first=float(counts[FIRST]) or None,
            last=float(counts[LAST]) or None,
            given=given,
            clamped=clamped,
            used=used,
            leaked=leaked,
            end=end,
            left=NodeState(float(counts[VOLTS]), bool(counts[ON] > 0.0), branches[2]),
            t=t[kept],
            volts=volts[kept],
            hours=hours,
            intervals=np.array([sums[some] / numbers[some], numbers[some]]),
        )
        self.follow_outage(followed)
        return followed

    def _levels(self, wake: float, length: float) -> Floats:
        """The kernel's voltages and storage capacitor, for windows of a ``length`` (s)."""
        storage = self.storage
        low = self.node.low_voltages or (-math.inf, -math.inf)
        held = storage.battery_voltage or 0.0
        leak = 1.0 / (storage.leakage_resistance or math.inf)
        return np.array([wake, self.top, self.farads, length, held, *low, self.spared, leak])

    def follow_outage(self, course: NodeCourse) -> None:
        """Fill in the numbers of a course in the outage, if there is one and the node is on.

        It begins with a packet.  The charge that leaks back through the rectifier is not counted.
        """
        if self.outage is None or course.left is None or not course.left.on:
            return
        course.lasts = float(self._dark(course.left, LASTS * self.outage)[RAN])
        course.survived = float(course.lasts >= self.outage)
        course.outage_packets = float(self._dark(course.left, self.outage)[PACKETS])

    def survives(self, left: NodeState) -> bool:
        """Whether the node outlasts the outage from a state in which it is on."""
        assert self.outage is not None, "the caller checks"
        return bool(self._dark(left, LASTS * self.outage)[RAN] >= self.outage)

    def _dark(self, left: NodeState, seconds: float) -> Floats:
        """The kernel's counts of so many seconds without excitation, of a node that is on."""
        branches = branches_of(self.storage)
        branches[2] = left.pores
        counts = np.zeros(COUNTS)
        follow_node(
            currents=(self.dark, self.drawn, self.waiting),
            durations=np.array([duration for _, duration in self.states]),
            stops=np.array([self.stop_of(drawn) for drawn in self.drawn]),
            levels=self._levels(left.volts, 0.0),
            branches=branches,
            tries=self._tries(),
            v=left.volts,
            seconds=seconds,
            counts=counts,
            course=(np.empty(1), np.empty(1), np.zeros(math.ceil(seconds / HOUR))),
        )
        return counts

    def _tries(self) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
        """How often each packet is sent, negative if it is lost.

        Drawn anew for none, so that nodes compare.
        """
        node = self.node
        if not node.lost_share:
            return np.ones(1, np.int64)
        tries = np.random.default_rng(13).geometric(1.0 - node.lost_share, DRAWN)
        most = round(node.retries or 0) + 1
        return np.where(tries > most, -most, tries)

    def stop_of(self, drawn: Floats) -> float:
        """The storage voltage at which a state stops."""
        seen = self.volts - (self.storage.esr or 0.0) * drawn
        above = np.flatnonzero(seen >= self.node.stop_voltage)
        if not len(above):
            return math.inf
        k = int(above[0])
        part = (self.node.stop_voltage - seen[k - 1]) / (seen[k] - seen[k - 1]) if k else 1.0
        return (k - 1.0 + float(part)) / (len(seen) - 1) * self.top if k else 0.0

    def capacitance_to_last(self, left: NodeState) -> float | None:
        """The least capacitance (F) of series E6 that outlasts the outage; None if none does."""
        now = self.storage.capacitance
        if now is None:
            return None

        def lasts(farads: float) -> bool:
            storage = replace(self.storage, capacitance=farads)
            run = NodeRun(self.current, storage, self.node, self.chip, self.outage)
            return run.survives(left)

        return _first_that(lasts, between("E6", now, LARGER * now))

    def interval_to_last(self, left: NodeState) -> float | None:
        """The shortest interval (s) that outlasts the outage, to 2 %; None if none does."""
        now = self.node.interval
        most = self.outage or now
        if self.node.low_interval is not None or most <= now:
            return None

        def lasts(seconds: float) -> bool:
            node = replace(self.node, interval=seconds)
            run = NodeRun(self.current, self.storage, node, self.chip, self.outage)
            return run.survives(left)

        count = math.ceil(math.log(most / now) / math.log(FINE))
        return _first_that(lasts, tuple(float(f"{now * FINE**k:.3g}") for k in range(1, count + 1)))


def _first_that(lasts: Callable[[float], bool], choices: tuple[float, ...]) -> float | None:
    """The first of ascending choices that lasts; None if the last does not."""
    if not choices or not lasts(choices[-1]):
        return None
    high = bisect_left(range(len(choices) - 1), True, key=lambda k: lasts(choices[k]))
    return choices[high]
