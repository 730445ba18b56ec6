"""The slow circuit until it is settled, and the checks of its mean, for a chip's power.

A check is another current for the same slow circuit: the change by it is one part of the error.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np

from harvester.arrays import Floats
from harvester.presentation.sheet import ERROR_OF
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import STORE
from harvester.storage.slow_circuit import SlowCircuit, SlowPath
from harvester.uncertainty.value import Value

FINER = 256.0  # slow steps to a time constant of the mass
# time constants of the mass, and times to charge the storage capacitor, of the first slow run
FIRST, CHARGES = 500.0, 8.0
# relative change of the mean power from a part of the run to the next; slow steps
SETTLED, MOST = 3e-3, 4e6
# of the mean power: a difference from the direct run above which the scales are not apart
LARGEST_SEPARATION = 0.05
ROUGHER = 4.0  # times the tolerance of runs that are compared with each other, at longer steps
OTHERS = 5  # slow runs for errors in addition to the first one, at twice its step
COARSEST = 8.0  # most times the step in a short budget
# periods of the circuit's slowest clock that a run has, four of them settled; part of a run, in
# which its rate is read
CYCLES, READ = 16.0 / 3.0, 1.0 / 32.0
WHOLE = 0.98  # least fraction, as a rate has an error
PILOT = 0.02  # part of a run by which its duration is predicted
# names of numbers of the load and of the storage voltage
ON, ON_AFTER = "load_on", "load_on_after"
LOWEST, HIGHEST = "store_lowest", "store_highest"


@dataclass(frozen=True)
class SlowPower:
    """Mean ``power`` (W) and the piezo's mean ``square`` voltage (V^2), with their errors.

    ``changed`` is the relative change of the mean power from one part of the run to the next,
    ``separation`` the difference of the direct run over ``direct`` seconds from the slow one, which
    is added to the mean already, unless ``scales_apart`` is False.  ``load`` is that of `of_load`.
    ``pace`` is the cost of mass and circuit together, s per simulated second of a trajectory (0:
    not measured).  ``clock`` is the longest period (s) among clocks in the circuit; the run may
    lack `CYCLES` such periods (``has_whole_cycles`` False).
    """

    power: Value
    square: Value
    changed: float
    separation: float
    scales_apart: bool
    direct: float
    duration: float
    slow_step: float
    steps: int
    current: RectifiedCurrent
    load: dict[str, float]
    pace: float = 0.0
    clock: float = 0.0
    has_whole_cycles: bool = True


@dataclass(frozen=True)
class SlowPace:
    """The cost of the slow circuit, ``whole`` and, in proportion to the steps, ``stepped``: s per simulated second.

    The ``deadline`` is one of `time.perf_counter`.
    """

    deadline: float
    whole: float
    stepped: float

    @classmethod
    def of(
        cls,
        circuit: SlowCircuit,
        table: RectifiedCurrent,
        duration: float,
        h: float,
        deadline: float,
    ) -> "SlowPace":
        """By a part of a run at steps of h, and at `COARSEST` of them."""
        took = []
        for factor in (1.0, COARSEST):
            begin = time.perf_counter()
            circuit.run(table, PILOT * duration, factor * h)
            took.append((time.perf_counter() - begin) / (PILOT * duration))
        stepped = max((took[0] - took[1]) / (1.0 - 1.0 / COARSEST), 0.0)
        return cls(deadline, max(took[0] - stepped, 0.0), stepped)

    def coarser(self, duration: float) -> float:
        """How many times longer steps let the first run and the `OTHERS` end in time: 1 at least, or inf."""
        room = self.left - (1.0 + OTHERS) * self.whole * duration
        needed = (1.0 + 0.5 * OTHERS) * self.stepped * duration
        return max(needed / room, 1.0) if room > 0.0 else math.inf

    @property
    def left(self) -> float:
        """The seconds that are left."""
        return self.deadline - time.perf_counter()


class Check(NamedTuple):
    """A changed current, and which ``part`` of the error its effect on a mean is."""

    current: RectifiedCurrent
    part: Literal["bias", "model", "stderr"]


class Correction(NamedTuple):
    """The ``shift`` of a mean by an effect outside the slow circuit, with its errors."""

    shift: float
    model: float
    stderr: float = 0.0


class CheckedMean:
    """Means over a settled path, and how each of some checks changes them.

    The checks run at a coarser step and tolerance, also with the trajectory's own ``table``, so
    that only their differences count.
    """

    def __init__(
        self,
        path: SlowPath,
        duration: float,
        rougher: SlowCircuit,
        table: RectifiedCurrent,
        checks: dict[str, Check],
        *,
        step: float,
        stride: int = 1,
    ) -> None:
        self.path = path
        self.checks = checks
        self._whole = settled_part(duration)
        self.base = rougher.run(table, duration, step, stride)
        self._others = {
            name: rougher.run(check.current, duration, step, stride)
            for name, check in checks.items()
        }

    @property
    def steps(self) -> int:
        """The circuit's steps in all runs."""
        return sum(run.steps for run in (self.path, self.base, *self._others.values()))

    def mean(self, integral: str) -> float:
        """The mean rate of an integral of the trajectory."""
        return mean_rate(self.path, integral, self._whole)

    def change(self, integral: str, check: str) -> float:
        """By how much a check changes that mean."""
        changed, base = (
            mean_rate(run, integral, self._whole) for run in (self._others[check], self.base)
        )
        return changed - base

    def load(
        self, separation: float, known: Sequence[str] = (ON, ON_AFTER, LOWEST, HIGHEST)
    ) -> dict[str, float]:
        """`of_load` of the trajectory, with the total error of the ``known`` numbers.

        That is the change by the step and by each check, the time or voltage between two samples,
        and the relative ``separation``, which only the mean power is corrected for.
        """
        numbers = of_load(self.path)
        at_step, *others = (of_load(run) for run in (self.base, *self._others.values()))
        between = _between_samples(self.path)
        for name in set(known) & set(numbers):
            value = numbers[name]
            same = at_step.get(name, math.inf)
            by_checks = sum(abs(other.get(name, math.inf) - same) for other in others)
            off = abs(same - value) + between.get(name, 0.0) + separation * value
            numbers[f"{ERROR_OF}{name}"] = by_checks + off
        return numbers

    def value(self, integral: str, judge: float, unknown: str, correction: Correction) -> Value:
        """The corrected mean with its errors; ngspice may differ by the share ``judge``."""
        mean = self.mean(integral)
        errors = {
            part: [
                abs(self.change(integral, name))
                for name, check in self.checks.items()
                if check.part == part
            ]
            for part in ("bias", "model", "stderr")
        }
        by_step = abs(mean_rate(self.base, integral, self._whole) - mean)
        stderr = math.hypot(correction.stderr, *errors["stderr"])
        return Value(
            mean + correction.shift,
            stderr if errors["stderr"] else None,
            bias=sum(errors["bias"]) + by_step,
            model=sum(errors["model"]) + judge * mean + correction.model,
            unknown=unknown,
        )


class SettledPath(NamedTuple):
    """A settled slow run with its ``duration`` (s) and the ``change`` (V^2) between its halves.

    ``clock`` is the longest period (s) among clocks in the circuit, 0 without one.
    """

    path: SlowPath
    duration: float
    change: float
    clock: float

    @property
    def has_whole_cycles(self) -> bool:
        """Whether it lasts `CYCLES` periods of its clock, whose phase then matters little."""
        return self.duration >= WHOLE * CYCLES * self.clock


def settled_path(
    circuit: SlowCircuit,
    table: RectifiedCurrent,
    h: float,
    unit: float,
    pace: SlowPace | None = None,
) -> SettledPath:
    """The slow circuit until its mean power changes no more, over `CYCLES` periods of a clock.

    Steps are of ``h``, and the ``unit`` is the mass's time constant (s).  With a ``pace`` it ends
    if a longer run would be too much.
    """
    longest = MOST * unit / FINER
    duration = min(first_duration(circuit, table, unit), longest)
    while True:
        path = circuit.run(table, duration, h, stride=4)
        first, last = (mean_rate(path, "square", part) for part in halves(duration))
        settled = abs(first - last) <= SETTLED * last or 2.0 * duration > longest
        clock = circuit.slowest_clock(table, path.end, READ * duration, h)
        run = SettledPath(path, duration, abs(first - last), clock)
        longer = duration if settled else 2.0 * duration
        if not run.has_whole_cycles:
            longer = min(max(longer, CYCLES * clock), longest)
        if longer == duration or (pace is not None and pace.coarser(longer) * unit / FINER > h):
            return run
        duration = longer


def of_load(path: SlowPath) -> dict[str, float]:
    """The load's duty cycle, the time (s) at which it is first on, and the range of the storage voltage.

    On is above half of the load's largest voltage.  The first quarter of the run is left out.  An
    infinite error of each states that it is not known.
    """
    on = path.load > 0.5 * path.load.max()
    late = path.t > 0.25 * path.t[-1]
    numbers = {ON: 0.0, HIGHEST: float(path.store.max())}
    if path.load.max() > 0.0:
        numbers = {
            ON: float(on[late].mean()),
            ON_AFTER: float(path.t[on.argmax()]),
            LOWEST: float(path.store[late].min()),
            HIGHEST: float(path.store[late].max()),
        }
    return numbers | {f"{ERROR_OF}{name}": math.inf for name in numbers}


def _between_samples(path: SlowPath) -> dict[str, float]:
    """The time (s) between samples of a run, and how far (V) an extreme voltage may be beyond them.

    At a kink that is at most the change to the sample before, or to the one behind, whichever is
    less.
    """
    late = path.store[path.t > 0.25 * path.t[-1]]
    changes = np.abs(np.diff(late))
    beyond = np.minimum(np.append(changes[:1], changes), np.append(changes, changes[-1:]))
    return {
        ON_AFTER: float(np.diff(path.t).max()),
        LOWEST: float(beyond[late.argmin()]),
        HIGHEST: float(beyond[late.argmax()]),
    }


def first_duration(circuit: SlowCircuit, table: RectifiedCurrent, unit: float) -> float:
    """How long (s) the first slow run is, with a ``unit`` of the mass's time constant: some charges of the storage."""
    farads = sum(
        1.0 / volts for name, _, _, volts in circuit.circuit.system.charges if name == STORE
    )
    return max(
        FIRST * unit,
        CHARGES * farads * float(table.voltages[-1]) / max(float(table.current[0]), 1e-30),
    )


class IntegralsOverTime(Protocol):
    """The times of a run (s), and the integrals of two squared voltages up to them (V^2 s)."""

    @property
    def t(self) -> Floats:
        """The times."""

    @property
    def square(self) -> Floats:
        """The integral of the load's squared voltage."""

    @property
    def piezo(self) -> Floats:
        """The integral of the piezo's squared voltage."""


class Span(NamedTuple):
    """A part of a run, from ``begin`` to ``end`` (s)."""

    begin: float
    end: float


def settled_part(duration: float) -> Span:
    """A run without its first quarter."""
    return Span(duration / 4.0, duration)


def halves(duration: float) -> tuple[Span, Span]:
    """Both halves of the `settled_part`, which are compared."""
    return Span(duration / 4.0, 0.625 * duration), Span(0.625 * duration, duration)


def mean_rate(run: IntegralsOverTime, name: str, span: Span) -> float:
    """The mean rate of an integral of a run, weighted by Hann's window: whole cycles need not fit.

    The integral is "square" or "piezo", as of `SlowPath`.
    """
    middle = 0.5 * (run.t[1:] + run.t[:-1])
    rates = np.diff(getattr(run, name)) / np.diff(run.t)
    phase = np.pi * (middle - span.begin) / (span.end - span.begin)
    inside = (middle > span.begin) & (middle < span.end)
    weights = np.where(inside, np.sin(phase) ** 2, 0.0)
    return float((weights * rates).sum() / weights.sum())
