"""The operation of a sensor node on a device: the fraction of the time that it runs, packets per hour, and its limit.

The rectifier's current at a held voltage is measured once, of a record in each of its windows
(`harvester.storage`); then days of storage capacitor, chip and node are one equation of the storage
voltage (`harvester.storage.node_run`), under noise with a current that fluctuates as it was
measured (`harvester.storage.fluctuating_node`).

Long because the result explains its fields to users.
"""

import contextlib
import dataclasses
import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import AnyScene
from harvester.equations.power_bound import PowerBound, power_bound
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, names_arguments
from harvester.errors import reading as checked
from harvester.machine.automatic import reporting
from harvester.machine.progress import ProgressCallback, listening, stage
from harvester.mechanics.kernels.compiled import compilation
from harvester.netlists.probes import STORE, Probe
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.quantities.kinds import TIME, with_prefix
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.bought_parts import Chip
from harvester.storage.fluctuating_node import (
    CLOSE,
    FEWEST,
    MOST,
    POINTS,
    Fluctuations,
    Lived,
    fluctuations,
    lived,
)
from harvester.storage.measured_current import time_constant
from harvester.storage.node_course import LASTS, NodeCourse
from harvester.storage.node_run import AGAIN, GRID, NodeRun
from harvester.storage.recorded_current import AnyCurrent, RecordedCurrent
from harvester.storage.supply import chip_of
from harvester.storage.time_limit import (
    TimeLimit,
    TooLittleTimeError,
    deadline_of_limit,
    limited,
    working_seconds,
)
from harvester.studies.charging.by_slow import refusal_of_slow
from harvester.studies.node_current import Effort, Known, measure_current
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURING = 0.75  # fraction of an attempt's time: until the current is known
CHANGE, LITTLE = 0.1, 1e-3  # of a key, to see which helps; gains below are none
_OF_STORE = ("capacitance", "leakage_resistance", "esr", "clamp_voltage", "diffusion_capacitance")
STORE_KEYS = {key: key for key in _OF_STORE}
_VOLTAGES, _CURRENTS = ("wake_voltage", "stop_voltage"), ("sleep_current", "stopped_current")
NODE_KEYS = {
    key: key
    for key in ("interval", *_VOLTAGES, *_CURRENTS, "efficiency", "lost_share", "low_interval")
}
CHIP_KEYS = {
    "ratio": "input_ratio",
    "own": "own_current",
    "rise": "start_voltage",
    "fall": "stop_voltage",
}
LARGEST_SEPARATION = 0.05  # of the current: a difference above which a direct run is made
DIRECT = 200.0  # time constants of that run
# of a number; packets over those of the interval, below which energy is spared
ROUNDING, SPARED = 1e-9, 0.9
# of the packets, and of those of the interval: an error that is small enough
USEFUL, OF_MOST = 0.05, 0.01
# s, that runs go on for a smaller error; times as many each time
BUDGET = 20.0
TIMES_AS_MANY = 4.0
# within a budget: so many of the usual runs at first, and so much of the time left for the next
FIRST_PART = 1.0 / 16.0
SAFE = 0.7
FEWEST_TIMES = 1.5  # times as many runs as before, at least
VARIANTS = 8.0  # sets of courses after the first, about
SAMPLING_SHARE = 0.3  # of the error, that sampling must be at least for more runs
MUCH = 0.02  # of the current: errors that are checked by more runs
DAY = 86400.0
HOUR = 3600.0
MOST_DAYS = 366.0
MOST_OUTAGE = 36.0  # days: a node is followed for ten times as long
ALMOST = 1.0 - 1e-9  # of that time
_SENT = {"interval": "all", "battery": "until the battery is empty"}  # by what limits it


class Parts(NamedTuple):
    """The parts behind the rectifier, and the outage (s) of the excitation after the days."""

    storage: Storage
    node: SensorNode
    chip: Chip | None
    outage: float | None = None

    def run(self, current: AnyCurrent, points: int = GRID) -> NodeRun:
        """The node with a rectifier's current, at so many ``points`` of the voltage."""
        return NodeRun(current, self.storage, self.node, self.chip, self.outage, points)


class NodeResult(TableResult):
    """The activity of a node in ``days`` from the beginning on.

    Attributes
    ----------
    days : float
        how long the node is followed.
    packets_per_hour : Value
        a `Value`: the packets per hour that arrive, of all the time.
    packets_lost : float or None
        how many an hour do not, in spite of all retries; None if none is lost.
    interval_median, interval_95, interval_longest : Value or None
        `Value` each: the time (s) from one packet to the next, which half of all, 95 % and all of
        them do not exceed; None with fewer than two packets.
    share_running : Value
        a `Value`: the fraction of the time from its first packet's beginning.
    first_packet : Value or None
        a `Value`: when the first was sent (s); None if none is.
    brown_outs : float
        how often the node stopped, an hour.
    answer : Diagnostic
        whether the node keeps its interval, and how many packets it sends per day: a note, whose
        ``str`` is the sentence.
    harvested : Value
        a `Value`: the mean power (W) into the storage capacitor, less those of the clamp and the
        leakage.
    used, clamped, leaked : Value or None
        `Value` each: the mean power (W) that the node consumes, that the clamp
        dissipates and that leaves through the storage capacitor's leakage; None if absent.
    needed : float
        the power (W) that the node draws from the storage capacitor while it runs.
    limit : str
        the limit: "interval", "energy", "store", "wake_voltage", "cold_start",
        "battery" or "time".
    helps : dict
        how many more packets, as a part of those that it sends, a tenth more or less of each key
        and of the rectifier's current would give, whichever gives more; empty if it sends none.
    fewest, most : int or None
        the packets of the whole hours with the fewest and the most of them, from the first packet
        on, on a record; None for excitation that always is alike.
    bound : PowerBound or None
        the most that any device of this mass could absorb (W), and why; None if no bound applies.
    outage : float or None
        how long (s) the excitation stops after the days; None if it does not.
    lasts : Value or None
        a `Value`: how long (s) the node then continues, followed for ten times the outage.
    outage_packets : Value or None
        a `Value`: the packets that it sends in the outage.
    share_survived : Value or None
        a `Value` under noise: the fraction of outages that the storage capacitor outlasts.
    capacitance_to_last, interval_to_last : float or None
        the smallest capacitance (F) of series E6, and the shortest interval (s), with which the
        node would outlast it; None if it does so anyway, or if none would.
    days_packets : ndarray
        the packets of each whole day, shape (days,).
    thresholds : tuple
        the voltages (V) at which the node begins and stops.
    t, voltage : ndarray
        the course in time (s), shape (n,), and the storage voltage (V) then, shape (n,).
    seconds : float
        the cost of the computation.
    steps : int
        of mass and circuit.
    physical : bool
        whether its numbers are in SI units: they are.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> hv.NodeResult.SHORT
    ('limit', 'packets_per_hour')
    """

    DERIVED = ("day_fewest", "day_median", "day_most", "share_of_possible", "table")
    NOT_SHOWN = frozenset({"bound", "limit", "helps", "table"})
    NOT_IN_JSON = frozenset({"table", "answer"})
    OPTIONAL = frozenset(
        {
            *(
                "bound",
                "share_of_possible",
                "fewest",
                "most",
                "packets_lost",
                "day_fewest",
                "day_median",
                "day_most",
            ),
            *("used", "clamped", "leaked", "outage", "lasts", "outage_packets"),
            *("share_survived", "capacitance_to_last", "interval_to_last"),
            *("interval_median", "interval_95", "interval_longest"),
        }
    )
    INTERNAL = frozenset({"t", "voltage", "thresholds", "days_packets"})
    SHORT = ("limit", "packets_per_hour")
    engine: ClassVar[str] = "slow"

    answer: Diagnostic
    days: float
    packets_per_hour: Value
    share_running: Value
    first_packet: Value | None
    brown_outs: float
    harvested: Value
    needed: float
    used: Value
    clamped: Value | None
    leaked: Value | None
    limit: str
    helps: dict[str, float]
    bound: PowerBound | None
    thresholds: tuple[float, float]
    t: Floats
    voltage: Floats
    seconds: float
    steps: int
    days_packets: Floats = field(default_factory=lambda: np.empty(0))
    fewest: int | None = None
    most: int | None = None
    interval_median: Value | None = None
    interval_95: Value | None = None
    interval_longest: Value | None = None
    packets_lost: float | None = None
    outage: float | None = None
    lasts: Value | None = None
    outage_packets: Value | None = None
    share_survived: Value | None = None
    capacitance_to_last: float | None = None
    interval_to_last: float | None = None
    physical: bool = True
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def share_of_possible(self) -> float | None:
        """The rectifier's power over the upper bound for any device of this mass.

        None without a bound.
        """
        return None if self.bound is None else self.harvested.value / self.bound.value

    @property
    def share_of_possible_value(self) -> Value | None:
        """The same, with the errors of the numerator; the bound has none."""
        return None if self.bound is None else self.harvested.scaled(1.0 / self.bound.value)

    @property
    def day_fewest(self) -> int | None:
        """The packets of the whole day with the fewest."""
        return round(float(self.days_packets.min())) if len(self.days_packets) > 1 else None

    @property
    def day_median(self) -> float | None:
        """The packets that half of the whole days have at most."""
        return float(np.median(self.days_packets)) if len(self.days_packets) > 1 else None

    @property
    def day_most(self) -> int | None:
        """The packets of the whole day with the most."""
        return round(float(self.days_packets.max())) if len(self.days_packets) > 1 else None

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The storage voltage over time, with the voltages at which the node begins and stops."""
        return drawing.draw(self, title, ax)

    @property
    def table(self) -> Table:
        """The storage voltage over time."""
        return Table(
            (Column("time", self.t, "s", "time"), Column("voltage", self.voltage, "V")),
            index=("time",),
        )


@names_arguments
def node(
    scene: AnyScene,
    *,
    days: float = 1.0,
    stop: float | str | None = None,
    budget: float | str | None = None,
    seed: int = 0,
    progress: ProgressCallback | bool | None = None,
) -> NodeResult:
    """Simulate a sensor node powered by the harvester.

    The rectifier of the load netlist charges [storage], optionally through [chip]; [node] draws
    packets from it. A recording is repeated until ``days`` are over. Under noise the current
    fluctuates as measured, and the answer is the mean of many such nodes.

    Parameters
    ----------
    scene : Scene or path
        Scene with the tables [storage] and [node], and optionally [chip], or the path of its file.
    days : float, default 1.0
        Simulated time in days.
    stop : float or str, optional
        Outage of the excitation after the days (s, or such as "2h"): how long the node continues,
        and which capacitance or interval would outlast it.
    budget : float or str, optional
        Time limit (s, or such as "30s"), without compilation: under noise as many runs as make the
        error small enough, or fit into it. The node's courses, of about 2 s, are not limited.
        Default: those that fit into 20 s after the first.
    seed : int, default 0
        Random seed. With the same effort, the same seed gives the same answer; a budget's effort
        depends on the machine's speed.
    progress : callable or bool, optional
        Called with the fraction that is done.  By default a bar on a terminal or in a notebook, if
        the study lasts longer than a second; False: none.

    Returns
    -------
    NodeResult
        Duty cycle, packets per hour, time of the first packet (s), and the limiting factor.

    Raises
    ------
    InputError
        The scene has no [node], ``days`` or ``stop`` is out of range, or a chip is unknown or
        incomplete.
    CannotServeError
        The current of the rectifier cannot be measured, or noise is combined with a harmonic
        excitation or a recording.
    SimulationError
        The ``budget`` is too short for the rectifier's current.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.node("examples/bimorph_packets.toml", days=0.05).limit
    'interval'
    """
    problem = Problem.of(scene)
    storage, consumer = problem.scene.storage, problem.scene.node
    if storage is None or consumer is None:
        tables = "[storage]" if consumer else "[node]" if storage else "both"
        raise InputError(
            f"scene must have the tables [storage] and [node], but lacks {tables}; see 'harvester keys'"
        )
    if not 0.0 < days <= MOST_DAYS:
        raise invalid("`days`", f"be above 0 and at most {MOST_DAYS:g}", days)
    outage = None if stop is None else _read_outage(stop)
    reason = refusal_of_slow(problem, Probe(STORE, "V"), records=True)
    if reason is not None:
        raise CannotServeError(reason)
    begin = time.perf_counter()
    table = problem.scene.chip
    chip = None if table is None else chip_of(table, consumer.supply_voltage)
    limit = TimeLimit.of(budget)
    with reporting(progress, "node") as report, listening(report):
        outcome = _outcome(problem, Parts(storage, consumer, chip, outage), days, seed, limit)
    every = (
        *problem.value_warnings,
        *consumer.trace_notes,
        *outcome.result.diagnostics,
        *_remarks(problem, outcome, chip, BUDGET if limit is None else limit.budget),
    )
    diagnostics = tuple(diagnostic for diagnostic in every if diagnostic.code != "node_left_out")
    return dataclasses.replace(
        outcome.result, seconds=time.perf_counter() - begin, diagnostics=diagnostics
    )


@dataclass(frozen=True)
class _Outcome:
    """A result with its inputs, whether its error is small, and why it is as large as it is under noise if not."""

    result: NodeResult
    known: Known
    direct: NodeCourse | None
    is_good: bool
    why: str = ""


def _outcome(
    problem: Problem, parts: Parts, days: float, seed: int, limit: TimeLimit | None
) -> _Outcome:
    """The result; under noise by more runs while these make an error smaller that is not small enough.

    They last `BUDGET`, without the first ones, or all together until the ``limit``, within which the
    first ones are few.
    """
    part = FIRST_PART if limit is not None and problem.equations.is_random else 1.0
    effort = Effort(seed, part, part)
    end = limit
    best = None
    while True:
        begin = working_seconds()
        try:
            with limited(limit), compilation():
                outcome = _attempt(problem, parts, days, effort)
        except TooLittleTimeError:
            if best is None:
                raise
            return dataclasses.replace(best, why="budget")
        if outcome.is_good:
            return outcome
        best = outcome
        took = working_seconds() - begin
        known = outcome.known
        packets = outcome.result.packets_per_hour
        checked = effort.checks < 1.0 or known.elements + known.separation > MUCH
        if not checked and packets.sampling95 < SAMPLING_SHARE * packets.known_error95:
            return dataclasses.replace(outcome, why="model")
        times = TIMES_AS_MANY
        if limit is not None:
            times = min(times, SAFE * limit.left / took)
        elif end is None:
            end = TimeLimit(BUDGET)
        elif TIMES_AS_MANY * took > end.left:
            return dataclasses.replace(outcome, why="time")
        if times < FEWEST_TIMES:
            return dataclasses.replace(outcome, why="budget")
        effort = Effort(
            seed, times * effort.runs, effort.checks * (times if checked else 1.0), known.judge
        )


def _attempt(problem: Problem, parts: Parts, days: float, effort: Effort) -> _Outcome:
    """The result with one effort."""
    storage, consumer, chip, _ = parts
    wake = max(consumer.wake_voltage, chip.rise if chip else 0.0)
    unit = time_constant(problem.equations) / problem.scales.frequency
    with stage(0.0, MEASURING):
        known = measure_current(problem, storage, chip, wake, effort)
    parts = parts._replace(chip=known.chip or chip)
    direct = _directly(problem, known, parts, days * DAY)
    noise = (
        enough_courses(known, parts, unit, days * DAY, effort.seed)
        if problem.equations.is_random
        else None
    )
    result = _live(known, parts, days, power_bound(problem), direct, noise)
    packets = result.packets_per_hour
    is_good = noise is None or packets.known_error95 <= max(
        USEFUL * packets.value, OF_MOST * HOUR / consumer.interval
    )
    return _Outcome(result, known, direct, is_good)


def _remarks(
    problem: Problem, outcome: _Outcome, chip: Chip | None, budget: float
) -> list[Diagnostic]:
    """The notes on how the numbers were found, in a ``budget`` (s)."""
    diagnostics = list[Diagnostic]()
    table = problem.scene.chip
    known = outcome.known
    direct = outcome.direct
    if problem.equations.is_random:
        diagnostics.append(note("node_of_fluctuating_current"))
    if outcome.why:
        packets = outcome.result.packets_per_hour
        diagnostics.append(
            note(f"node_error_by_{outcome.why}", error=packets.known_error95, seconds=budget)
        )
    if direct is not None:
        diagnostics.append(note("run_directly", direct=direct.end, separation=known.separation))
    elif known.separation > LARGEST_SEPARATION:
        diagnostics.append(warning("scales_not_apart", separation=known.separation))
    if known.unknown:
        diagnostics.append(warning("error_unknown", part=known.unknown))
    if chip is not None and table is not None and table.name is not None:
        diagnostics.append(
            note("chip_by_its_sheet", table.name, source=chip.source, assumed=chip.assumed)
        )
    return diagnostics


def _directly(problem: Problem, known: Known, parts: Parts, seconds: float) -> NodeCourse | None:
    """The direct run if the storage capacitor is not slow compared with the vibration.

    None if it is, and if absent.

    None also if a budget ends before it.
    """
    from harvester.storage.direct_node import can_run, direct_course

    run = parts.run(known.table)
    if (
        known.separation <= LARGEST_SEPARATION
        or problem.equations.drive is None
        or not can_run(run)
    ):
        return None
    unit = time_constant(problem.equations) / problem.scales.frequency
    try:
        return direct_course(problem, run, min(seconds, DIRECT * unit))
    except TooLittleTimeError:
        return None


def enough_courses(
    known: Known, parts: Parts, unit: float, seconds: float, seed: int
) -> Fluctuations:
    """How the current fluctuates, in so many courses as give the packets well enough.

    A budget has fewer if twice as many would leave no time for those of the variants.
    """
    run = parts.run(known.table, POINTS)
    each = FEWEST
    while True:
        begin = working_seconds()
        noise = fluctuations(run, unit, seconds, seed, each)
        some = lived(run, run, noise.seconds, noise)
        packets = some.number(lambda course: course.packets)
        if each >= MOST or some.error(lambda course: course.packets) <= CLOSE * packets:
            return noise
        end = deadline_of_limit()
        if (
            end is not None
            and 2.0 * VARIANTS * (working_seconds() - begin) > end - time.perf_counter()
        ):
            return noise
        each *= 2


@dataclass(frozen=True)
class NodeReading:
    """The reading of numbers from courses: from the ``base``, with the change by each of the ``variants``.

    The first of these is that of another step, the last that of sampling; if a variant has several
    courses, their largest change counts.  ``both`` are a direct course and that of the mean current
    that is as long.
    """

    base: Lived
    variants: list[tuple[Lived, ...]]
    both: tuple[NodeCourse, NodeCourse] | None
    unknown: str

    @property
    def courses(self) -> list[NodeCourse]:
        """All of them."""
        lives = (self.base, *itertools.chain(*self.variants))
        return [course for life in lives for course in life.every] + list(self.both or ())

    def known_value(
        self,
        read: Callable[[Lived], float],
        off: float = 0.0,
        late: float = 0.0,
        error: float = 0.0,
    ) -> Value:
        """A number with the change by each variant, and the standard error of its courses."""
        number = read(self.base)
        changes = (
            *(max(abs(read(life) - number) for life in lives) for lives in self.variants),
            error,
        )
        step, *model, sampling, error = (
            change if change > ROUNDING * abs(number) else 0.0 for change in changes
        )
        total = late + abs(off) + sum(model)
        stderr = math.hypot(sampling, error)
        # Under noise the step's error is in that of the elements; where nothing changes a number
        # all are 0.
        bias = step if step or not (total or stderr) else None
        return Value(number + off, stderr or None, bias, total, unknown=self.unknown)

    def value(
        self, read: Callable[[NodeCourse], float], late: float = 0.0, most: float = math.inf
    ) -> Value:
        """The same for a value read from a course, which is no more than the ``most``."""
        off = 0.0 if self.both is None else float(read(self.both[0]) - read(self.both[1]))
        return self.known_value(
            lambda life: min(life.number(read), most), off, late, self.base.error(read)
        )

    def between(self, share: float) -> Value:
        """The times between packets that a share of all is not above."""

        def read(course: NodeCourse) -> float:
            return course.interval(share)

        off = 0.0 if self.both is None else read(self.both[0]) - read(self.both[1])
        return self.known_value(lambda life: life.quantile(share), off, 0.0, self.base.error(read))

    def first(self, late: float) -> Value | None:
        """The time of the first packet, which may be later or sooner; None if a course has none."""
        if any(course.first is None for course in self.courses):
            return None
        return self.value(lambda course: course.first or 0.0, late)


def _live(
    known: Known,
    parts: Parts,
    days: float,
    bound: PowerBound | None,
    direct: NodeCourse | None,
    noise: Fluctuations | None = None,
) -> NodeResult:
    """The result, with the errors that the current's own bring, and the chip's efficiency.

    The difference of a ``direct`` run from the slow one of its time is added, and is an error as
    well: all that the slow one leaves out.  Under ``noise`` all are of currents that fluctuate
    alike.
    """
    seconds = days * DAY
    storage, node = parts.storage, parts.node
    run = parts.run(known.table)
    reading = _read(known, parts, seconds, direct, noise)
    base = reading.base
    first = reading.first(known.late if direct is None else 0.0)
    packets = reading.value(_rate, most=HOUR / node.interval)
    packet = sum(duration for _, duration in node.states)
    limit, limit_note = (_limit if storage.battery_voltage is None else _limit_with_battery)(
        run, base
    )
    helps = _helps(known.table, parts, seconds, noise)
    outage, larger = _of_outage(run, reading, noise)
    drawn = base.mean if base.whole.end < seconds else base.whole
    scaled = noise is not None and drawn is base.mean
    fewest = most = None
    if isinstance(known.table, RecordedCurrent):
        fewest, most = _of_hours(base.mean, seconds)
    lost = base.number(lambda course: course.lost / course.end * HOUR)
    answer = _answer(
        run, packets, limit, first=first, days=days, outage=outage, courses=reading.courses
    )
    return NodeResult(
        answer=answer,
        days=days,
        packets_per_hour=packets,
        share_running=reading.value(lambda course: course.share_running(packet), most=1.0),
        first_packet=first,
        brown_outs=max(base.number(lambda course: course.brown_outs / course.end * HOUR), 0.0),
        harvested=reading.value(
            lambda course: (course.given - course.clamped - course.leaked) / course.end
        ),
        needed=run.needed,
        used=reading.value(lambda course: course.used / course.end),
        clamped=_power_of(reading, "clamped", storage.clamp_voltage),
        leaked=_power_of(reading, "leaked", storage.leakage_resistance),
        limit=limit,
        helps=helps,
        bound=bound,
        thresholds=(run.node.wake_voltage, run.node.stop_voltage),
        t=drawn.t,
        voltage=drawn.volts,
        seconds=0.0,
        steps=known.steps,
        days_packets=_of_days(drawn, days, packets if scaled else None),
        fewest=fewest,
        most=most,
        packets_lost=lost if node.lost_share else None,
        **_intervals(reading),
        **outage,
        diagnostics=(limit_note, *_change_that_helps(helps, base), *larger),
    )


def _read(
    known: Known,
    parts: Parts,
    seconds: float,
    direct: NodeCourse | None,
    noise: Fluctuations | None,
) -> NodeReading:
    """The courses of a node by the current, by its variants, and by a direct run."""
    base = _course(known.table, parts, seconds, noise)
    less = known.elements + (known.separation if direct is None else 0.0)
    variants = changed_courses(
        known, parts, base, less, lambda current, other: _course(current, other, seconds, noise)
    )
    if noise is not None:
        variants.insert(1, (_course(known.table, parts, seconds, noise.coarser()),))
    both = None if direct is None else (direct, parts.run(known.table).course(direct.end))
    return NodeReading(base, variants, both, known.unknown)


def _of_days(course: NodeCourse, days: float, packets: Value | None) -> Floats:
    """The packets of each whole day; with the rate of ``packets`` if they are given."""
    each = packets.value / _rate(course) if packets is not None and course.packets else 1.0
    hours = course.hours[: math.floor(days + ROUNDING) * 24]
    return np.asarray(each * hours.reshape(-1, 24).sum(axis=1).round(6))


def _change_that_helps(helps: dict[str, float], base: Lived) -> list[Diagnostic]:
    """A note on the change that gives most more packets, if any gives some."""
    most = max(helps, key=lambda key: helps[key], default="")
    if not most or helps[most] <= LITTLE:
        return []
    return [note("node_change_helps", most, gain=helps[most], packets=base.number(_rate))]


def _power_of(reading: NodeReading, energy: str, key: float | None) -> Value | None:
    """The mean power (W) of one of a course's energies; None if its key is left out."""
    if key is None:
        return None
    return reading.value(lambda course: float(getattr(course, energy)) / course.end)


def _read_outage(stop: float | str) -> float:
    """The outage (s) from a text or a number; InputError for another."""
    seconds = checked("`stop`", partial(with_prefix, kind=TIME), str(stop))
    if seconds > MOST_OUTAGE * DAY:
        raise invalid("`stop`", f"be above 0 and at most {MOST_OUTAGE:g} days", stop)
    return seconds


def _of_outage(
    run: NodeRun, reading: NodeReading, noise: Fluctuations | None
) -> tuple[dict[str, Any], list[Diagnostic]]:
    """The fields of a result on the outage, and notes; empty if none is asked for."""
    if run.outage is None:
        return {}, []
    base = reading.base
    survived = reading.value(lambda course: course.survived, most=1.0)
    lasts = reading.value(lambda course: course.lasts)
    if _outlasts_the_search(lasts, run.outage):
        lasts = lasts.with_unknown("times above ten outages")
    fields: dict[str, Any] = {
        "outage": run.outage,
        "lasts": lasts,
        "outage_packets": reading.value(lambda course: course.outage_packets),
        "share_survived": None if noise is None else survived,
    }
    left = base.mean.left
    if survived.value >= 1.0 or left is None or not left.on:
        return fields, []
    farads = run.capacitance_to_last(left)
    fields |= {"capacitance_to_last": farads, "interval_to_last": run.interval_to_last(left)}
    if farads is None:
        return fields, []
    storage = dataclasses.replace(run.storage, capacitance=farads)
    larger = NodeRun(run.current, storage, run.node, run.chip).course(base.mean.end)
    return fields, [note("node_larger_store", farads=farads, first=larger.first, end=base.mean.end)]


def _answer(
    run: NodeRun,
    packets: Value,
    limit: str,
    *,
    first: Value | None,
    days: float,
    outage: dict[str, Any],
    courses: list[NodeCourse],
) -> Diagnostic:
    """The note that states in one line whether the node keeps its interval, and its packets per day.

    It keeps it if it stops in none of the ``courses``; ``outage`` has the fields of one.
    """
    lasts: Value | None = outage.get("lasts")
    survived: Value | None = outage.get("share_survived")
    stops = any(course.brown_outs for course in courses)
    sent = "in part" if stops else _SENT.get(limit, "in part")
    begins = first.value if first is not None else 0.0 if packets.value else None
    return note(
        "node_answer",
        sent="in part" if sent == "all" and run.node.lost_share else sent,
        per_day=24.0 * packets.value,
        error=24.0 * packets.known_error95,
        interval=run.node.interval,
        begins=begins,
        days=days,
        outage=run.outage,
        lasts=None if lasts is None else lasts.value,
        lasts_error=None if lasts is None else lasts.known_error95,
        survived=None if survived is None else survived.value,
        longest=lasts is not None and _outlasts_the_search(lasts, run.outage or 0.0),
    )


def _outlasts_the_search(lasts: Value, outage: float) -> bool:
    """Whether a node runs without excitation for as long as it is followed."""
    return lasts.value >= LASTS * outage * ALMOST


def _rate(course: NodeCourse) -> float:
    """Packets an hour."""
    return course.packets / course.end * HOUR


def _course(current: AnyCurrent, parts: Parts, seconds: float, noise: Fluctuations | None) -> Lived:
    """The activity of a node with a current; also if that fluctuates."""
    run = parts.run(current)
    if noise is None:
        return Lived(run.course(seconds))
    return lived(run, parts.run(current, POINTS), seconds, noise)


def changed_courses(
    known: Known, parts: Parts, base: Lived, part: float, live: Callable[[AnyCurrent, Parts], Lived]
) -> list[tuple[Lived, ...]]:
    """The courses whose differences from the ``base`` are its errors: that of the step first, that of sampling last.

    ``part`` is how much lower or higher the current may be, relatively: a node that is never off
    is changed by one of both only.  ``live`` gives a node's activity.
    """
    table = known.table
    chip = parts.chip
    lives = [
        tuple(base if current is table else live(current, parts) for current in currents)
        for currents in (
            [known.by_step],
            [table.halved()],
            [table.scaled(1.0 - part), table.scaled(1.0 + part)],
            [table.shifted()],
        )
    ]
    for other in (
        ()
        if chip is None
        else (chip.narrower(), *([chip.charging_by(1.0 - chip.spread)] if chip.spread else ()))
    ):
        lives.insert(1, (live(table, parts._replace(chip=other)),))
    return lives


def _intervals(reading: NodeReading) -> dict[str, Any]:
    """The times between packets; empty if any of the courses has none."""
    if any(len(course.intervals[0]) < 1 for course in reading.courses):
        return {}
    return {
        "interval_median": reading.between(0.5),
        "interval_95": reading.between(0.95),
        "interval_longest": reading.between(1.0),
    }


def _of_hours(course: NodeCourse, seconds: float) -> tuple[int | None, int | None]:
    """The fewest and the most packets of the whole hours from the first packet on.

    None each without an hour.
    """
    if course.first is None:
        return None, None
    whole = course.hours[math.ceil(course.first / HOUR) : math.floor(seconds / HOUR)]
    return (int(whole.min()), int(whole.max())) if len(whole) else (None, None)


def _helps(
    table: AnyCurrent, parts: Parts, seconds: float, noise: Fluctuations | None
) -> dict[str, float]:
    """The relative gain in packets of a change of each key that can be changed.

    Empty if absent to gain.

    All are of the same excitation, so that the effect of sampling on them is alike.
    """
    gain_of = dict[str, float]()
    parts = parts._replace(outage=None)
    few = None if noise is None else noise.few()

    def packets_of(current: AnyCurrent, others: Parts) -> float:
        return _course(current, others, seconds, few).number(
            lambda course: course.packets / course.end
        )

    packets = packets_of(table, parts)
    if not packets > 0.0:
        return gain_of

    def gain(current: AnyCurrent, others: Parts) -> float:
        return packets_of(current, others) / packets - 1.0

    for name, keys in (("storage", STORE_KEYS), ("node", NODE_KEYS), ("chip", CHIP_KEYS)):
        part: Any = getattr(parts, name)
        for key, said in keys.items():
            if not (now := getattr(part, key, None)):
                continue
            gains = [0.0]
            for factor in (1.0 - CHANGE, 1.0 + CHANGE):
                # An efficiency above 1 is refused, and a chip's thresholds in another order.
                with contextlib.suppress(InputError):
                    other = dataclasses.replace(part, **{key: now * factor})
                    gains.append(gain(table, parts._replace(**{name: other})))
            gain_of[f"{name}.{said}"] = max(gains)
    gain_of["current"] = max(gain(table.scaled(1.0 + CHANGE), parts), 0.0)
    return gain_of


def _limit(run: NodeRun, base: Lived) -> tuple[str, Diagnostic]:
    """The limit of the node: a name, and the note that states it."""
    course = base.whole
    seconds = course.end
    charging = run.charging.mean(axis=0)
    k = (
        int(np.argmax(charging <= run.waiting))
        if (charging <= run.waiting).any()
        else len(run.volts) - 1
    )
    highest = float(run.volts[k])
    node = run.node
    chip = run.chip
    about = {"wake": node.wake_voltage, "stop": node.stop_voltage}
    if course.first is None and chip is not None and highest < chip.hand_over:
        least = {"volts": chip.cold_voltage, "watts": chip.cold_power}
        return "cold_start", note("chip_never_starts", highest=highest, **least)
    if course.first is None and highest < node.wake_voltage:
        return "wake_voltage", note("node_never_wakes", highest=highest, **about)
    if course.first is None and course.brown_outs:
        return "store", note("node_browns_out", brown_outs=course.brown_outs, **about)
    if course.first is None:
        return "time", note("node_not_yet_awake", seconds=seconds, **about)
    if course.brown_outs and course.packets < course.brown_outs:
        return "store", note("node_browns_out", brown_outs=course.brown_outs, **about)
    if course.brown_outs or _spares(node, course):
        return "energy", note("node_lacks_energy", given=course.given / seconds, needed=run.needed)
    if course.clamped > 0.0:
        return "interval", note("node_has_more", lost=course.clamped / seconds)
    return "interval", note("node_keeps_its_interval", interval=node.interval)


def _spares(node: SensorNode, course: NodeCourse) -> bool:
    """Whether its flag of low energy costs packets."""
    return node.low_interval is not None and course.packets * node.interval < SPARED * course.ran


def _limit_with_battery(run: NodeRun, base: Lived) -> tuple[str, Diagnostic]:
    """The same with a battery: whether it is charged as fast as it is emptied, and else how long it lasts."""
    course = base.mean
    seconds = base.whole.end
    numbers = {"given": (course.given - course.leaked) / seconds, "needed": run.needed}
    if course.brown_outs and course.volts[-1] > 0.5 * run.top:
        return "store", note("battery_resistance", stop=run.node.stop_voltage)
    if course.brown_outs:
        empty = float(course.t[np.argmax(course.volts <= max(AGAIN * run.top, course.volts.min()))])
        return "battery", note("battery_ran_empty", seconds=empty, **numbers)
    if numbers["given"] >= numbers["needed"]:
        return "interval", note("node_keeps_its_interval", interval=run.node.interval)
    lasts = run.storage.battery_charge or 0.0
    lasts *= run.top / (numbers["needed"] - numbers["given"])
    return "battery", note("battery_lasts", seconds=lasts, **numbers)
