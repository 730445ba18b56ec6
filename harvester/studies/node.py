"""How a sensor node lives of a device: the share of the time that it runs, packets an hour, and what limits it.

The rectifier's current at a held voltage is measured once (`harvester.storage`); then days of store and node are one
equation of the store's voltage (`harvester.storage.node_run`).

Long because the result explains its fields to users.
"""

import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.engines.protocol import AnyScene
from harvester.equations.power_bound import PowerBound, power_bound
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, names_arguments
from harvester.netlists.probes import STORE, Probe
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.presentation.messages.unknown_parts import COMPILED_CIRCUIT, IDEAL_ELEMENTS, TIME_SCALES
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.plausibility import unusual_values
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.node_run import NodeCourse, NodeRun
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.studies.charging.by_slow import refusal_of_slow
from harvester.uncertainty.value import Value, bound95

CHANGE, LITTLE = 0.1, 1e-3  # of a key, to see which helps; gains below are none
STORE_KEYS = ("capacitance", "leakage_resistance", "esr", "clamp_voltage")
NODE_KEYS = ("interval", "wake_voltage", "stop_voltage", "sleep_current", "stopped_current", "efficiency")
DAY, HOUR, MOST_DAYS = 86400.0, 3600.0, 366.0


@names_arguments
@dataclass(frozen=True, repr=False, eq=False)
class NodeResult(TableResult):
    """What a node does in ``days`` from the beginning on.

    Attributes
    ----------
    days
        how long the node is followed.
    packets_per_hour
        a `Value`: the packets an hour, of all the time.
    share_running
        a `Value`: the share of the time from its first packet's beginning.
    first_packet
        a `Value`: when the first was sent (s); None where none is.
    brown_outs
        how often the node stopped, an hour.
    harvested
        a `Value`: the mean power (W) that comes into the store beyond what the clamp takes.
    needed
        the power (W) that the node takes from the store while it runs.
    limit
        what limits it: "interval", "energy", "store", "wake_voltage" or "time".
    helps
        how many more packets, as a part of those that it sends, a tenth more or less of each key and of the rectifier's
        current would give, whichever gives more; empty where it sends none.
    bound
        the most that any device of this mass could take (W), and why; None where no bound applies.
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

    DERIVED: ClassVar[tuple[str, ...]] = ("share_of_possible", "table")
    NOT_SHOWN: ClassVar[frozenset[str]] = frozenset({"bound", "limit", "helps", "table"})
    NOT_IN_JSON: ClassVar[frozenset[str]] = frozenset({"table"})
    OPTIONAL: ClassVar[frozenset[str]] = frozenset({"bound", "share_of_possible"})
    INTERNAL: ClassVar[frozenset[str]] = frozenset({"t", "voltage", "thresholds"})
    SHORT: ClassVar[tuple[str, ...]] = ("limit", "packets_per_hour")
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
    physical: bool = True
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def share_of_possible(self) -> float | None:
        """What the rectifier gives over the most that any device of this mass could take; None without a bound."""
        return None if self.bound is None else self.harvested.value / self.bound.value

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

    The load's netlist says how the piezo's voltage is rectified; [storage] stands for its store, [node] for what comes
    behind.  The shaking goes on as it is for all ``days``; under noise the mean current counts, not how it fluctuates.

    Parameters
    ----------
    scene
        a `Scene` with the tables [storage] and [node], or the path of its file.
    days
        how long the node is followed, from its beginning.
    seed
        the same seed, the same noise.

    Returns
    -------
    NodeResult
        packets an hour, the share of the time that it runs, and what limits it.

    Raises
    ------
    InputError
        for a scene without [node], and days out of range.
    CannotServeError
        for a netlist whose rectifier's current cannot be measured, and shaking other than noise or a harmonic drive.

    >>> import harvester as hv
    >>> hv.node("examples/bimorph_packets.toml", days=0.05).limit
    'interval'
    """
    problem = Problem.of(scene)
    storage, consumer = problem.scene.storage, problem.scene.node
    if storage is None or consumer is None:
        raise InputError("scene must have the tables [storage] and [node], but has none: see 'harvester keys node'")
    if not 0.0 < days <= MOST_DAYS:
        raise invalid("`days`", f"be above 0 and at most {MOST_DAYS:g}", days)
    reason = refusal_of_slow(problem, Probe(STORE, "V"))
    if reason is not None:
        raise CannotServeError(reason)
    begin = time.perf_counter()
    known = _measure(problem, storage, seed)
    found = _live(known, storage, consumer, days, power_bound(problem))
    told = [one for one in (*unusual_values(problem.scene), *found.diagnostics) if one.code != "node_left_out"]
    if problem.equations.is_random:
        told.append(note("node_of_mean_current"))
    return dataclasses.replace(found, seconds=time.perf_counter() - begin, diagnostics=tuple(told))


@dataclass(frozen=True)
class _Known:
    """The rectifier's current, its variants whose changes are its errors, and its relative error from time scales."""

    table: RectifiedCurrent
    by_step: RectifiedCurrent
    by_voltages: RectifiedCurrent
    separation: float
    sampling: float
    steps: int
    unknown: str


def _measure(problem: Problem, storage: Storage, seed: int) -> _Known:
    """The rectifier's current of the scene, up to the clamp or the open circuit."""
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.cosimulation.idealised import ideal_circuit
    from harvester.mechanics.kernels.compiled import compilation
    from harvester.storage.measured_current import HELD, measured
    from harvester.storage.rectified_current import FINE, times_to
    from harvester.storage.rectifier_cut import held_rectifier, is_plain_store, with_store
    from harvester.storage.slow_circuit import direct_check

    circuit, scales = problem.circuit, problem.scales
    assert circuit is not None, "the refusal checks this"
    elements = held_rectifier(circuit, HELD * scales.capacitance)
    ideal = ideal_circuit(circuit, scales) if is_plain_store(circuit) else None
    with compilation():
        table, rough, steps, _ = measured(problem, elements, ideal, storage.clamp_voltage, seed=seed)
        if not problem.equations.is_steady:
            unknown = f"{IDEAL_ELEMENTS if ideal else COMPILED_CIRCUIT} and {TIME_SCALES}"
            assert table.stderr is not None, "noise is sampled"
            sampling = float(np.sqrt((table.stderr**2).mean()) / max(table.current.max(), 1e-300))
            return _Known(table, rough, table.halved(), 0.0, sampling, steps, unknown)
        volts = np.linspace(0.0, float(table.voltages[-1]), FINE)
        curve = times_to(volts, table, storage.farads, math.inf)
        reached = np.isfinite(curve)
        both = CompiledCircuit(circuit, scales, with_store(elements, storage.farads))
        check = direct_check(problem, both, volts[reached], curve[reached], DAY)
    separation = (abs(check.late) + check.error) / check.seconds
    return _Known(table, rough, table.halved(), separation, 0.0, steps + check.steps, COMPILED_CIRCUIT)


def _live(known: _Known, storage: Storage, node: SensorNode, days: float, bound: PowerBound | None) -> NodeResult:
    """The result, with the errors that the current's own bring."""
    seconds = days * DAY
    run = NodeRun(known.table, storage, node)
    base = run.course(seconds)
    scaled = dataclasses.replace(known.table, current=known.table.current * (1.0 - known.separation))
    shifted = known.table.shifted()
    variants = [known.by_step, known.by_voltages, scaled, shifted]
    courses = [base if one is known.table else NodeRun(one, storage, node).course(seconds) for one in variants]

    def value(read: Callable[[NodeCourse], float]) -> Value:
        """A number with what each variant changes."""
        step, *model, sampling = (abs(read(one) - read(base)) for one in courses)
        total = sum(model) + (bound95(0.0, sampling) if known.sampling else 0.0)
        return Value(float(read(base)), bias=step, model=total, unknown=known.unknown)

    def running(one: NodeCourse) -> float:
        packet = sum(seconds for _, seconds in node.states)
        return 0.0 if one.first is None else min(one.ran / (one.end - one.first + packet), 1.0)

    first = None
    if all(one.first is not None for one in (base, *courses)):
        first = value(lambda one: one.first or 0.0)
    limit, told = _limit(run, base, seconds)
    helps = _helps(known.table, storage, node, seconds, base.packets)
    most = max(helps, key=lambda key: helps[key], default="")
    change = [note("node_change_helps", most, gain=helps[most])] if most and helps[most] > LITTLE else []
    return NodeResult(
        days=days,
        packets_per_hour=value(lambda one: one.packets / seconds * HOUR),
        share_running=value(running),
        first_packet=first,
        brown_outs=base.brown_outs / seconds * HOUR,
        harvested=value(lambda one: (one.given - one.clamped) / seconds),
        needed=run.needed,
        limit=limit,
        bound=bound,
        thresholds=(node.wake_voltage, node.stop_voltage),
        t=np.array(base.t),
        voltage=np.array(base.volts),
        seconds=0.0,
        steps=known.steps,
        helps=helps,
        diagnostics=(told, *change),
    )


def _helps(
    table: RectifiedCurrent, storage: Storage, node: SensorNode, seconds: float, packets: int
) -> dict[str, float]:
    """The relative gain in packets of a change of each key that can be changed; empty where there are none to gain."""
    found = {}
    for part, keys in ((storage, STORE_KEYS), (node, NODE_KEYS)):
        for key in keys:
            now = getattr(part, key)
            if not now or not packets:
                continue
            gains = []
            for factor in (1.0 - CHANGE, 1.0 + CHANGE):
                try:
                    other = dataclasses.replace(part, **{key: now * factor})
                except InputError:  # such as an efficiency above 1
                    continue
                both = (other, node) if part is storage else (storage, other)
                gains.append(NodeRun(table, *both).course(seconds).packets / packets - 1.0)
            found[f"{part.TABLE}.{key}"] = max([0.0, *gains])
    stronger = dataclasses.replace(table, current=table.current * (1.0 + CHANGE))
    if packets:
        found["current"] = max(NodeRun(stronger, storage, node).course(seconds).packets / packets - 1.0, 0.0)
    return found


def _limit(run: NodeRun, course: NodeCourse, seconds: float) -> tuple[str, Diagnostic]:
    """What limits the node: a name, and the note that says it."""
    k = int(np.argmax(run.charging <= run.waiting)) if (run.charging <= run.waiting).any() else len(run.volts) - 1
    highest, node = float(run.volts[k]), run.node
    about = {"wake": node.wake_voltage, "stop": node.stop_voltage}
    if course.first is None and highest < node.wake_voltage:
        return "wake_voltage", note("node_never_wakes", highest=highest, **about)
    if course.first is None and course.brown_outs:
        return "store", note("node_browns_out", brown_outs=course.brown_outs, **about)
    if course.first is None:
        return "time", note("node_not_yet_awake", seconds=seconds, **about)
    if course.brown_outs and course.packets < course.brown_outs:
        return "store", note("node_browns_out", brown_outs=course.brown_outs, **about)
    if course.brown_outs:
        return "energy", note("node_lacks_energy", given=course.given / seconds, needed=run.needed)
    if course.clamped > 0.0:
        return "interval", note("node_has_more", lost=course.clamped / seconds)
    return "interval", note("node_keeps_its_interval", interval=node.interval)
