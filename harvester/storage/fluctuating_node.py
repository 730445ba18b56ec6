"""A node under noise: many courses with a rectifier's current that fluctuates as it was measured.

    i(V) = I(V) + sqrt(S(V)/L) xi      in each window of a length L, with xi normal and new in each

S is the current's spectral density at frequency zero.  The course of the current within a window is
not known: the change of a number by windows of twice the length, with the same charge, is its
error. The memory of the mass fades in less than a window, and a window is short compared with the
time that the storage capacitor needs to the wake voltage.  Courses are as long as so many windows;
the days beyond that follow the mean current (two levels): the number of long ones is

    E[noisy, short] + (mean current, long) - (mean current, short).

Long because courses, their means and the spread of these are of one design.
"""

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.storage.measured_current import MEASURED
from harvester.storage.node_course import NodeCourse
from harvester.storage.node_run import NodeRun
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.supply import input_without_load
from harvester.uncertainty.value import mean_and_error

WINDOWS, MOST_WINDOWS = 4096, 16_384  # of a course
# windows in the time to the wake voltage; packets' intervals in a course, at least
OF_CHARGE, INTERVALS = 256.0, 8.0
GROUPS = 8  # of courses, whose means are independent
FEWEST, MOST = 2, 16  # courses of a group
CLOSE = 4e-3  # of the packets: a standard error of the courses that is small enough
POINTS = 200  # of the table of a window
# of S: what is seen in the time that is measured, as energy fades in half an amplitude's
FINITE = 1.0 - 0.5 / MEASURED

Read = Callable[[NodeCourse], float]


@dataclass(frozen=True)
class Fluctuations:
    """Normal variates, shape (courses, windows), for windows of a ``length`` (s)."""

    length: float
    variates: Floats

    @property
    def seconds(self) -> float:
        """How long a course is."""
        return self.length * int(self.variates.shape[1])

    def coarser(self) -> "Fluctuations":
        """The same in windows of twice the length, with the same charge in each."""
        count = self.variates.shape[1] // 2
        pairs = self.variates.reshape(-1, count, 2)
        return Fluctuations(2.0 * self.length, pairs.sum(axis=2) / math.sqrt(2.0))

    def few(self) -> "Fluctuations":
        """One course of each group."""
        return Fluctuations(self.length, self.variates[:GROUPS])


def fluctuations(
    run: NodeRun, unit: float, seconds: float, seed: int, each: int = FEWEST
) -> Fluctuations:
    """Those of a run for ``seconds`` at most, with ``each`` course of a group.

    The ``unit`` is the mass's (s).
    """
    current = run.charging[0]
    wake = min(run.node.wake_voltage, run.top)
    came = max(float(current[run.volts <= wake].mean()), 1e-30)
    length = max(unit, run.farads * wake / came / OF_CHARGE)
    count = min(max(math.ceil(INTERVALS * run.node.interval / length), WINDOWS), MOST_WINDOWS)
    length = min(max(length, INTERVALS * run.node.interval / count), seconds)
    count = 2 * math.ceil(0.5 * min(count, seconds / length))
    rng = np.random.default_rng(np.random.SeedSequence([seed, 18]))
    return Fluctuations(length, rng.standard_normal((GROUPS * each, count)))


def noisy_course(run: NodeRun, noise: Fluctuations, k: int, seconds: float) -> NodeCourse:
    """One of the courses of a run whose table has `POINTS`."""
    other = copy.copy(run)
    other.charging = run.charging + noise.variates[k][:, None] * spread_of(run, noise.length)
    other.length = noise.length
    return other.course(seconds)


def spread_of(run: NodeRun, length: float) -> Floats:
    """The standard deviation (A) of the current into storage at the run's voltages, over windows of a length (s).

    That of a chip which holds its input is the same part of its output as at its input.
    """
    table, chip = run.current, run.chip
    assert isinstance(table, RectifiedCurrent), "steady excitation"
    if chip is None or chip.ratio is None:
        return np.sqrt(table.column_at("density", run.volts) / (FINITE * length))
    opened = min(float(input_without_load(chip, table.voltages, table.current[None])[0]), chip.most)
    held = np.array(chip.ratio * opened)
    part = math.sqrt(float(table.column_at("density", held)) / (FINITE * length)) / max(
        float(table.at(held)), 1e-30
    )
    return np.asarray(part * np.maximum(run.charging[0], 0.0))


@dataclass(frozen=True)
class Lived:
    """A node's activity: by the ``mean`` current; and if it fluctuates in ``groups`` of courses, each their mean.

    ``short`` is the course of the mean current that is as long as those.
    """

    mean: NodeCourse
    short: NodeCourse | None = None
    groups: tuple[NodeCourse, ...] = ()

    def number(self, read: Read) -> float:
        """A number of the course, with the change by the fluctuations."""
        if self.short is None:
            return float(read(self.mean))
        both = 0.0 if self.short is self.mean else read(self.mean) - read(self.short)
        return float(np.mean([read(course) for course in self.groups]) + both)

    def quantile(self, share: float) -> float:
        """`NodeCourse.interval` of all courses."""
        return float(np.mean([course.interval(share) for course in self.groups or (self.mean,)]))

    def error(self, read: Read) -> float:
        """The standard error of a number by so few courses; 0 if nothing fluctuates."""
        return (
            mean_and_error(np.array([read(course) for course in self.groups]))[1]
            if self.groups
            else 0.0
        )

    @property
    def whole(self) -> NodeCourse:
        """The mean of all courses."""
        return mean_course(self.groups) if self.groups else self.mean

    @property
    def every(self) -> tuple[NodeCourse, ...]:
        """Those that numbers are read of."""
        return (self.mean, *self.groups)


def mean_course(courses: "tuple[NodeCourse, ...] | list[NodeCourse]") -> NodeCourse:
    """The mean of courses of one length: with all their intervals, and the time of the first packet if all have one."""
    names = (
        *("ran", "packets", "lost", "brown_outs", "given", "clamped", "used", "leaked", "end"),
        *("hours", "lasts", "survived", "outage_packets"),
    )
    means = {name: np.mean([getattr(course, name) for course in courses], axis=0) for name in names}
    firsts = [course.first for course in courses]
    intervals = np.hstack([course.intervals for course in courses])
    mean = NodeCourse(**means, t=courses[0].t, volts=courses[0].volts)
    mean.intervals = intervals[:, np.argsort(intervals[0], kind="stable")]
    lasts = [course.last for course in courses if course.last is not None]
    mean.last = max(lasts, default=None)
    mean.first = (
        None if None in firsts else float(np.mean([first for first in firsts if first is not None]))
    )
    return mean


def lived(run: NodeRun, rough: NodeRun, seconds: float, noise: Fluctuations) -> Lived:
    """The activity of a run in so many seconds under noise.

    ``rough`` is the same with a table of `POINTS`.
    """
    end = min(noise.seconds, seconds)
    short = rough.course(end)
    courses = [noisy_course(rough, noise, k, end) for k in range(len(noise.variates))]
    mean = short if end == seconds else run.course(seconds)
    if short is not mean:  # in a short course a packet more or less counts for many
        short, *courses = (with_a_part(course, run.node.interval) for course in (short, *courses))
    return Lived(mean, short, tuple(mean_course(courses[k::GROUPS]) for k in range(GROUPS)))


def with_a_part(course: NodeCourse, interval: float) -> NodeCourse:
    """A course whose packets grow evenly over their interval.

    The last has half of one before it, on average.
    """
    if course.last is None:
        return course
    return replace(
        course, packets=course.packets - 0.5 + min((course.end - course.last) / interval, 1.0)
    )
