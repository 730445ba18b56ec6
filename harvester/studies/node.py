"""How a sensor node lives of a device: the share of the time that it runs, packets per hour, and what limits it.

The rectifier's current at a held voltage is measured once, of a record in each of its windows (`harvester.storage`);
then days of store, chip and node are one equation of the store's voltage (`harvester.storage.node_run`).

Long because the result explains its fields to users.
"""

import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.engines.protocol import AnyScene
from harvester.equations.power_bound import PowerBound, power_bound
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, names_arguments
from harvester.mechanics.kernels.compiled import compilation
from harvester.netlists.probes import STORE, Probe
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.messages.unknown_parts import TIME_SCALES
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.plausibility import unusual_values
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.bought_parts import Chip
from harvester.storage.measured_current import JUDGE, Rectifier, measured, time_constant
from harvester.storage.node_run import AGAIN, NodeCourse, NodeRun
from harvester.storage.recorded_current import AnyCurrent, RecordedCurrent, recorded
from harvester.storage.rectified_current import reached
from harvester.storage.supply import INPUT, chip_of
from harvester.studies.charging.by_slow import refusal_of_slow
from harvester.uncertainty.value import Value, bound95

CHANGE, LITTLE = 0.1, 1e-3  # of a key, to see which helps; gains below are none
_OF_STORE = ("capacitance", "leakage_resistance", "esr", "clamp_voltage", "diffusion_capacitance")
STORE_KEYS = {key: key for key in _OF_STORE}
_VOLTAGES, _CURRENTS = ("wake_voltage", "stop_voltage"), ("sleep_current", "stopped_current")
NODE_KEYS = {key: key for key in ("interval", *_VOLTAGES, *_CURRENTS, "efficiency", "lost_share", "low_interval")}
CHIP_KEYS = {"ratio": "input_ratio", "own": "own_current", "rise": "start_voltage", "fall": "stop_voltage"}
LARGEST_SEPARATION = 0.05  # of the current: a difference above which a direct run is made
DIRECT = 200.0  # time constants of that run
ROUNDING, SPARED = 1e-9, 0.9  # of a number; packets over those of the interval, below which energy is spared
DAY, HOUR, MOST_DAYS = 86400.0, 3600.0, 366.0
MOST_VOLTS = 1e3  # of a clamp: one above leaves a rectifier's voltage as it is
Parts = tuple[Storage, SensorNode, Chip | None]  # what stands behind the rectifier


class NodeResult(TableResult):
    """What a node does in ``days`` from the beginning on.

    Attributes
    ----------
    days
        how long the node is followed.
    packets_per_hour
        a `Value`: the packets per hour that arrive, of all the time.
    packets_lost
        how many an hour do not, in spite of all retries; None if none is lost.
    interval_median, interval_95, interval_longest
        `Value` each: the time (s) from one packet to the next, which half of all, 95 % and all of them do not exceed;
        None with fewer than two packets.
    share_running
        a `Value`: the share of the time from its first packet's beginning.
    first_packet
        a `Value`: when the first was sent (s); None if none is.
    brown_outs
        how often the node stopped, an hour.
    harvested
        a `Value`: the mean power (W) that comes into the store beyond what the clamp takes.
    needed
        the power (W) that the node takes from the store while it runs.
    limit
        what limits it: "interval", "energy", "store", "wake_voltage", "cold_start", "battery" or "time".
    helps
        how many more packets, as a part of those that it sends, a tenth more or less of each key and of the rectifier's
        current would give, whichever gives more; empty if it sends none.
    fewest, most
        the packets of the whole hours with the fewest and the most of them, from the first packet on, on a record; None
        for shaking that always is alike.
    bound
        the most that any device of this mass could take (W), and why; None if no bound applies.
    days_packets
        the packets of each whole day, shape (days,).
    thresholds
        the voltages (V) at which the node begins and stops.
    t, voltage
        the course in time (s), shape (n,), and the store's voltage (V) then, shape (n,).
    seconds
        what the computation took.
    steps
        of mass and circuit.
    physical
        whether its numbers are in SI units: they are.
    diagnostics
        warnings and notes, each with a code, numbers and a sentence (``str``).

    >>> import harvester as hv
    >>> hv.NodeResult.SHORT
    ('limit', 'packets_per_hour')
    """

    DERIVED = ("day_fewest", "day_median", "day_most", "share_of_possible", "table")
    NOT_SHOWN = frozenset({"bound", "limit", "helps", "table"})
    NOT_IN_JSON = frozenset({"table"})
    OPTIONAL = frozenset(
        {
            *("bound", "share_of_possible", "fewest", "most", "packets_lost", "day_fewest", "day_median", "day_most"),
            *("interval_median", "interval_95", "interval_longest"),
        }
    )
    INTERNAL = frozenset({"t", "voltage", "thresholds", "days_packets"})
    SHORT = ("limit", "packets_per_hour")
    engine: ClassVar[str] = "slow"

    days: float
    packets_per_hour: Value
    share_running: Value
    first_packet: Value | None
    brown_outs: float
    harvested: Value
    needed: float
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
    physical: bool = True
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def share_of_possible(self) -> float | None:
        """What the rectifier gives over the most that any device of this mass could take; None without a bound."""
        return None if self.bound is None else self.harvested.value / self.bound.value

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

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The store's voltage over time, with the voltages at which the node begins and stops."""
        return figures.node(self, title)

    @property
    def table(self) -> Table:
        """The store's voltage over time."""
        return Table((Column("time", self.t, "s"), Column("voltage", self.voltage, "V")), index=("time",))


@names_arguments
def node(scene: AnyScene, *, days: float = 1.0, seed: int = 0) -> NodeResult:
    """Share of the time that a scene's [node] runs on its [storage], packets an hour, the first one, and the limit.

    The load's netlist says how the piezo's voltage is rectified; [storage] represents its store, [node] for what comes
    behind, [chip] for what is between.  The shaking goes on as it is for all ``days``, and a record is repeated; under
    noise the mean current counts, not how it fluctuates.

    Parameters
    ----------
    scene
        a `Scene` with the tables [storage] and [node], and [chip] if there is one, or the path of its file.
    days
        how long the node is followed, from its beginning.
    seed
        the same seed, the same noise.

    Returns
    -------
    NodeResult
        packets per hour, the share of the time that it runs, and what limits it.

    Raises
    ------
    InputError
        for a scene without [node], days out of range, and a chip that is not known or lacks what it needs.
    CannotServeError
        for a netlist whose rectifier's current cannot be measured, and a drive or a record beside noise.

    >>> import harvester as hv
    >>> hv.node("examples/bimorph_packets.toml", days=0.05).limit
    'interval'
    """
    problem = Problem.of(scene)
    storage, consumer = problem.scene.storage, problem.scene.node
    if storage is None or consumer is None:
        tables = "[storage]" if consumer else "[node]" if storage else "both"
        raise InputError(f"scene must have the tables [storage] and [node], but lacks {tables}; see 'harvester keys'")
    if not 0.0 < days <= MOST_DAYS:
        raise invalid("`days`", f"be above 0 and at most {MOST_DAYS:g}", days)
    reason = refusal_of_slow(problem, Probe(STORE, "V"), records=True)
    if reason is not None:
        raise CannotServeError(reason)
    begin, table = time.perf_counter(), problem.scene.chip
    chip = None if table is None else chip_of(table, consumer.supply_voltage)
    known = _measure(problem, storage, chip, max(consumer.wake_voltage, chip.rise if chip else 0.0), seed)
    parts = storage, consumer, known.chip or chip
    direct = _directly(problem, known, parts, days * DAY)
    result = _live(known, parts, days, power_bound(problem), direct)
    every = *unusual_values(problem.scene), *result.diagnostics, *_remarks(problem, known, direct, chip)
    diagnostics = tuple(diagnostic for diagnostic in every if diagnostic.code != "node_left_out")
    return dataclasses.replace(result, seconds=time.perf_counter() - begin, diagnostics=diagnostics)


def _remarks(problem: Problem, known: "_Known", direct: NodeCourse | None, chip: Chip | None) -> list[Diagnostic]:
    """What is to be said of how the numbers were found."""
    diagnostics, table = list[Diagnostic](), problem.scene.chip
    if problem.equations.is_random:
        diagnostics.append(note("node_of_mean_current"))
    if direct is not None:
        diagnostics.append(note("run_directly", direct=direct.end, separation=known.separation))
    elif known.separation > LARGEST_SEPARATION:
        diagnostics.append(warning("scales_not_apart", separation=known.separation))
    if known.unknown:
        diagnostics.append(warning("error_unknown", part=known.unknown))
    if chip is not None and table is not None and table.name is not None:
        diagnostics.append(note("chip_by_its_sheet", table.name, source=chip.source, assumed=chip.assumed))
    return diagnostics


@dataclass(frozen=True)
class _Known:
    """The rectifier's current, its variants whose changes are its errors, and its relative errors.

    They are that of taking the time scales apart and that of the ``elements``; ``late`` is by how much the first packet
    may be later or sooner (s).  ``chip`` is one that holds its input, by what its law
    gives on the same noise; None for any other.
    """

    table: AnyCurrent
    by_step: AnyCurrent
    steps: int
    separation: float = 0.0
    elements: float = JUDGE
    late: float = 0.0
    unknown: str = ""
    chip: Chip | None = None


def _measure(problem: Problem, storage: Storage, chip: Chip | None, wake: float, seed: int) -> _Known:
    """The rectifier's current of the scene, up to the clamp or the open circuit."""
    tracking = chip if chip is not None and chip.ratio is not None else None
    top = None if tracking else storage.battery_voltage or storage.clamp_voltage
    top = top if (top or math.inf) < MOST_VOLTS else None
    farads = INPUT if tracking else storage.farads
    with compilation():
        if problem.equations.record is None:
            return _of_alike_shaking(problem, tracking, farads, top, wake, seed)
        currents = recorded(problem, None if tracking else farads or None, top)
    known = _Known(currents.best, currents.rough, currents.steps, currents.separation, currents.elements)
    return dataclasses.replace(known, unknown=TIME_SCALES if tracking else "")


def _of_alike_shaking(
    problem: Problem, tracking: Chip | None, farads: float, top: float | None, wake: float, seed: int
) -> _Known:
    """The same of shaking that always is alike: of a store of ``farads``, 0 for a battery, or a ``tracking`` chip's.

    A battery holds its voltage as the measurement does; under noise a chip's law is run beside the mean currents.
    """
    from harvester.storage.slow_circuit import direct_check, noise_check
    from harvester.storage.tracked_input import tracked_input

    table, rough, steps, _ = measured(problem, top, seed=seed)
    last, noise = float(table.voltages[-1]), table.stderr is not None
    if tracking is not None and noise:
        law = tracked_input(problem, table, tracking, seed)
        if law is None:
            return _Known(table, rough, steps, unknown=TIME_SCALES)
        known = _Known(table, rough, steps + law.steps, law.error, JUDGE + law.elements)
        return dataclasses.replace(known, chip=law.correct(tracking))
    if not farads:
        path, free = (np.full(2, last), np.array([0.0, DAY])), None
    else:
        path, free = reached(table, last if tracking else min(wake, last), farads), farads
    if noise:
        elements, separation, more = noise_check(problem, table, path, free, seed)
        return _Known(table, rough, steps + more, separation, JUDGE + elements)
    if free is None:
        return _Known(table, rough, steps)
    check = direct_check(problem, Rectifier(problem).compiled(farads), *path, DAY)
    separation, late = (abs(check.late) + check.error) / check.seconds, check.error
    if tracking is not None:
        late += abs(check.late) + 0.5 * tracking.look
    else:
        table, rough = table.later(check.late), rough.later(check.late)
    return _Known(table, rough, steps + check.steps, separation, late=late)


def _directly(problem: Problem, known: _Known, parts: Parts, seconds: float) -> NodeCourse | None:
    """The direct run where the store is not slow beside the vibration; None if it is, and if there is none."""
    from harvester.storage.direct_node import can_run, direct_course

    run = NodeRun(known.table, *parts)
    if known.separation <= LARGEST_SEPARATION or problem.equations.drive is None or not can_run(run):
        return None
    with compilation():
        unit = time_constant(problem.equations) / problem.scales.frequency
        return direct_course(problem, run, min(seconds, DIRECT * unit))


def _live(known: _Known, parts: Parts, days: float, bound: PowerBound | None, direct: NodeCourse | None) -> NodeResult:
    """The result, with the errors that the current's own bring, and the chip's efficiency.

    What a ``direct`` run differs by from the slow one of its time is added, and is an error, too: all that the slow one
    leaves out.
    """
    seconds, table, (storage, node, _) = days * DAY, known.table, parts
    run = NodeRun(table, *parts)
    base = run.course(seconds)
    both = None if direct is None else (direct, run.course(direct.end))
    courses = _variants(known, parts, base, seconds, known.elements + (known.separation if direct is None else 0.0))

    def value(read: Callable[[NodeCourse], float], late: float = 0.0) -> Value:
        """A number with what each variant changes."""
        number = float(read(base))
        changes = (abs(read(course) - number) for course in courses)
        off = 0.0 if both is None else float(read(both[0]) - read(both[1]))
        step, *model, sampling = (change if change > ROUNDING * abs(number) else 0.0 for change in changes)
        total = late + abs(off) + sum(model) + bound95(0.0, sampling)
        # Under noise the step's error is in that of the elements; where nothing changes a number all are 0.
        return Value(number + off, bias=step if step or not total else None, model=total, unknown=known.unknown)

    def running(course: NodeCourse) -> float:
        packet = sum(seconds for _, seconds in node.states)
        return 0.0 if course.first is None else min(course.ran / (course.end - course.first + packet), 1.0)

    first = None
    if all(course.first is not None for course in (base, *courses, *(both or ()))):
        first = value(lambda course: course.first or 0.0, known.late if both is None else 0.0)
    limits = _limit if storage.battery_voltage is None else _limit_with_battery
    limit, limit_note = limits(run, base, seconds)
    helps = _helps(table, parts, seconds, base.packets)
    fewest, most_packets = _of_hours(base, seconds) if isinstance(table, RecordedCurrent) else (None, None)
    most = max(helps, key=lambda key: helps[key], default="")
    change = [note("node_change_helps", most, gain=helps[most])] if most and helps[most] > LITTLE else []
    return NodeResult(
        days=days,
        packets_per_hour=value(lambda course: course.packets / course.end * HOUR),
        share_running=value(running),
        first_packet=first,
        brown_outs=base.brown_outs / seconds * HOUR,
        harvested=value(lambda course: (course.given - course.clamped) / course.end),
        needed=run.needed,
        limit=limit,
        bound=bound,
        thresholds=(run.node.wake_voltage, run.node.stop_voltage),
        t=base.t,
        voltage=base.volts,
        seconds=0.0,
        steps=known.steps,
        helps=helps,
        days_packets=base.hours[: math.floor(days + ROUNDING) * 24].reshape(-1, 24).sum(axis=1).round(6),
        fewest=fewest,
        most=most_packets,
        packets_lost=base.lost / seconds * HOUR if node.lost_share else None,
        **_intervals((base, *courses, *(both or ())), value),
        diagnostics=(limit_note, *change),
    )


def _variants(known: _Known, parts: Parts, base: NodeCourse, seconds: float, less: float) -> list[NodeCourse]:
    """The courses whose differences from the ``base`` are its errors: that of the step first, that of sampling last.

    ``less`` is by what part the current may be lower.
    """
    table, (storage, node, chip) = known.table, parts
    courses = [
        base if current is table else NodeRun(current, *parts).course(seconds)
        for current in (known.by_step, table.halved(), table.scaled(1.0 - less), table.shifted())
    ]
    for other in (
        () if chip is None else (chip.narrower(), *([chip.charging_by(1.0 - chip.spread)] if chip.spread else ()))
    ):
        courses.insert(1, NodeRun(table, storage, node, other).course(seconds))
    return courses


def _intervals(
    courses: tuple[NodeCourse, ...], value: Callable[[Callable[[NodeCourse], float]], Value]
) -> dict[str, Any]:
    """The times between packets; empty if any of the courses has none."""
    if any(course.packets < 2 for course in courses):
        return {}
    return {
        "interval_median": value(lambda course: course.interval(0.5)),
        "interval_95": value(lambda course: course.interval(0.95)),
        "interval_longest": value(lambda course: course.interval(1.0)),
    }


def _of_hours(course: NodeCourse, seconds: float) -> tuple[int | None, int | None]:
    """The fewest and the most packets of the whole hours from the first packet on; None each if there is no hour."""
    if course.first is None:
        return None, None
    whole = course.hours[math.ceil(course.first / HOUR) : math.floor(seconds / HOUR)]
    return (int(whole.min()), int(whole.max())) if len(whole) else (None, None)


def _helps(table: AnyCurrent, parts: Parts, seconds: float, packets: int) -> dict[str, float]:
    """The relative gain in packets of a change of each key that can be changed; empty if there are none to gain.

    All are of the same shaking, so that what sampling does to them is alike.
    """
    gain_of: dict[str, float] = {}
    if not packets:
        return gain_of

    def gain(current: AnyCurrent, *others: Any) -> float:
        return NodeRun(current, *others).course(seconds).packets / packets - 1.0

    for k, (name, keys) in enumerate((("storage", STORE_KEYS), ("node", NODE_KEYS), ("chip", CHIP_KEYS))):
        for key, said in keys.items():
            if not (now := getattr(parts[k], key, None)):
                continue
            gains = [0.0]
            for factor in (1.0 - CHANGE, 1.0 + CHANGE):
                try:
                    other: Any = dataclasses.replace(parts[k], **{key: now * factor})  # type: ignore[type-var]
                    gains.append(gain(table, *(*parts[:k], other, *parts[k + 1 :])))
                except InputError:  # such as an efficiency above 1, or a chip's thresholds in another order
                    continue
            gain_of[f"{name}.{said}"] = max(gains)
    gain_of["current"] = max(gain(table.scaled(1.0 + CHANGE), *parts), 0.0)
    return gain_of


def _limit(run: NodeRun, course: NodeCourse, seconds: float) -> tuple[str, Diagnostic]:
    """What limits the node: a name, and the note that says it."""
    charging = run.charging.mean(axis=0)
    k = int(np.argmax(charging <= run.waiting)) if (charging <= run.waiting).any() else len(run.volts) - 1
    highest, node, chip = float(run.volts[k]), run.node, run.chip
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
    """Whether its flag of low energy takes packets."""
    return node.low_interval is not None and course.packets * node.interval < SPARED * course.ran


def _limit_with_battery(run: NodeRun, course: NodeCourse, seconds: float) -> tuple[str, Diagnostic]:
    """The same with a battery: whether it is charged as fast as it is emptied, and else how long it lasts."""
    numbers = {"given": course.given / seconds, "needed": run.needed}
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
