"""A node without mean currents: mass and rectifier with their own capacitor, in slices of a vibration.

The capacitor is the storage capacitor, or the one at the input of a chip that holds it.  After each
slice the chip moves its charge by its law (`harvester.storage.bought_parts.Chip`), and the node
draws its current.  A slow computation is compared with this, and replaced by it if a storage
capacitor is not slow compared with the vibration.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.bought_parts import Chip
from harvester.storage.held_stores import StoreOnPath
from harvester.storage.measured_current import Rectifier
from harvester.storage.node_course import NodeCourse, NodeState
from harvester.storage.node_run import NodeRun
from harvester.storage.supply import INPUT, LOW, charging_efficiency

BACK = 0.3  # V below that of the hand-over, at which the cold start begins again, as there
SLICES = 16  # of a vibration
STARTED = 10.0  # vibrations over which a cold start's power is a mean


def can_run(run: NodeRun) -> bool:
    """Whether a node is one that the direct run knows: on a capacitor without pores, with all packets alike.

    A chip that holds its input must look at it at times, as its voltage comes from there.
    """
    store = run.storage
    node = run.node
    chip = run.chip
    parts = (store.battery_voltage, store.diffusion_capacitance, node.lost_share, node.low_interval)
    return (chip is None or chip.ratio is None or chip.look > 0.0) and all(
        part is None for part in parts
    )


@dataclass
class _Tracker:
    """A chip that holds its input, and the charge that it draws from there."""

    chip: Chip
    begun: float | None = None  # s, of its first look
    held: float = 0.0
    power: float = 0.0

    def move(self, charge: float, volts: float, now: float, slice_: float) -> tuple[float, float]:
        """Advance the chip by one time slice.

        Returns
        -------
        input_charge, storage_charge : float
            Charge left on the input capacitor, and charge delivered to the storage (C; negative:
            net consumption).
        """
        chip = self.chip
        seen = charge / INPUT
        if volts < chip.hand_over - (0.0 if self.begun is None else BACK):
            self.begun = None
            taken = max(charge - INPUT * chip.cold_voltage, 0.0)
            energy = taken * chip.cold_voltage
            self.power += (energy / slice_ - self.power) / (STARTED * SLICES)
            given = chip.cold_efficiency * energy if self.power >= chip.cold_power else 0.0
            return charge - taken, given / max(volts, LOW)
        self.begun = now if self.begun is None else self.begun
        given = -chip.quiescent * slice_
        if (now - self.begun) % chip.period < chip.look:
            self.held = (chip.ratio or 1.0) * min(seen, chip.most)
            return min(charge, INPUT * chip.most), given
        taken = max(charge - INPUT * self.held, 0.0) if self.held >= chip.least else 0.0
        share = charging_efficiency(chip, np.array([self.held]), np.array([taken / slice_]))
        return charge - taken, given + float(share[0]) * self.held * taken / max(volts, LOW)


@dataclass
class _Consumer:
    """The node of a run: which of its states it is in, the last being sleep, and its results."""

    run: NodeRun
    course: NodeCourse = field(default_factory=NodeCourse)
    state: int | None = None
    left: float = 0.0
    sent: list[float] = field(default_factory=list)

    def take(self, volts: float, now: float, slice_: float) -> float:
        """The storage voltage after a slice in which it only gives."""
        run = self.run
        course = self.course
        rest = slice_
        stops = [run.stop_of(drawn) for drawn in run.drawn]
        while rest > 0.0:
            if self.state is None and volts >= run.node.wake_voltage:
                self.state = 0
                self.left = run.states[0][1]
            step = rest if self.state is None else min(rest, self.left)
            drawn = run.waiting if self.state is None else run.drawn[self.state]
            leak = volts / (run.storage.leakage_resistance or math.inf)
            amperes = run.at(drawn, volts)
            less = step * (amperes + leak) / run.storage.farads
            stop = self._stop(stops)
            if volts > stop > volts - less:  # it stops there
                step = step * (volts - stop) / less
                less = volts - stop
            course.leaked += leak * volts * step
            course.used += amperes * volts * step * (self.state is not None)
            volts -= less
            rest = rest - step
            now = now + step
            if volts > run.top:
                course.clamped += run.storage.farads * (volts - run.top) * run.top
            volts = min(max(volts, 0.0), run.top)
            if self.state is not None:
                self.left -= step
                course.ran += step
                self._go_on(volts, now, stops)
        return volts

    def _stop(self, stops: list[float]) -> float:
        """The voltage at which the node stops now; below all if it is off."""
        return -math.inf if self.state is None else stops[self.state]

    def _go_on(self, volts: float, now: float, stops: list[float]) -> None:
        """Stop the node, or begin its next state."""
        assert self.state is not None, "the caller checks"
        if volts <= stops[self.state]:
            self.state = None
            self.course.brown_outs += 1
        elif self.left <= 0.0:
            if self.state == len(self.run.states) - 2:
                self.sent.append(now)
            self.state = (self.state + 1) % len(self.run.states)
            self.left = self.run.states[self.state][1]


def direct_course(problem: Problem, run: NodeRun, seconds: float, seed: int = 0) -> NodeCourse:
    """The events in a time from rest on, under a harmonic excitation or white noise, with the netlist's own rectifier.

    Raises as `CompiledCircuit`.
    """
    chip, eqs = run.chip, problem.equations
    tracker = None if chip is None or chip.ratio is None else _Tracker(chip)
    farads = run.storage.farads if tracker is None else INPUT
    period = eqs.shaking_period or 2.0 * math.pi
    rng = np.random.default_rng([seed, 14]) if eqs.is_random else None
    n_steps = math.ceil(period / step_from_rest(eqs) / SLICES)
    h = period / (n_steps * SLICES)
    part = n_steps * h
    circuit = Rectifier(problem).compiled(farads)
    store = StoreOnPath(problem, circuit, farads, h, part=part, rng=rng)
    slice_ = part / problem.scales.frequency
    consumer = _Consumer(run)
    own_current = 0.0 if tracker is not None or chip is None else chip.quiescent
    volts = run.storage.initial_voltage or 0.0
    charge = 0.0 if tracker is not None else farads * volts  # C, in the capacitor of the rectifier
    count = math.ceil(seconds / slice_)
    points: Floats = np.empty((2, count))
    for k in range(count):
        store.stored[:] = charge
        store.advance(None, part)
        charge = float(store.stored[0])
        before = volts
        if tracker is None:
            volts = charge / farads - own_current * slice_ / farads
        else:
            charge, given = tracker.move(charge, volts, (k + 1) * slice_, slice_)
            full = max(volts, tracker.chip.full)
            volts = max(min(volts + given / run.storage.farads, full), 0.0)
        consumer.course.given += run.storage.farads * (volts - before) * 0.5 * (volts + before)
        volts = consumer.take(volts, k * slice_, slice_)
        if tracker is None:
            charge = farads * volts
        points[:, k] = (k + 1) * slice_, volts
    course = consumer.course
    gaps = np.sort(np.diff(consumer.sent))
    course.packets = len(consumer.sent)
    course.first = next(iter(consumer.sent), None)
    course.intervals = np.array([gaps, np.ones(len(gaps))])
    course.end = count * slice_
    course.left = NodeState(volts, consumer.state is not None, np.empty(0))
    run.follow_outage(course)
    (course.t, course.volts) = points
    return course
