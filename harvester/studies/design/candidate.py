"""A circuit with its parts, and its power at the requested voltage: measured at a held storage capacitor."""

import dataclasses
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from harvester.equations.problem import Problem
from harvester.errors import CannotServeError
from harvester.mechanics.kernels.compiled import compilation
from harvester.netlists.probes import STORE, Probe
from harvester.presentation.diagnostic import Diagnostic, note, refusal
from harvester.presentation.messages.unknown_parts import (
    COMPILED_CIRCUIT,
    IDEAL_ELEMENTS,
    TIME_SCALES,
)
from harvester.quantities.preferred_numbers import between
from harvester.scene.load import Load
from harvester.scene.scene import Scene
from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.bought_parts import CHIPS, COILS, BoughtCoil
from harvester.storage.measured_current import JUDGE, Rectifier, measured
from harvester.storage.recorded_current import AnyCurrent, recorded
from harvester.storage.supply import Supply
from harvester.storage.time_limit import check_time, working_seconds
from harvester.studies.charging.by_slow import refusal_of_slow
from harvester.studies.design.design_need import DesignNeed
from harvester.uncertainty.value import Value, amount

if TYPE_CHECKING:
    from harvester.storage.node_run import NodeRun

# of capacitors (F)
SERIES = "E6"
SMALLEST = 1e-6
LARGEST = 1.0
WIDE = 1.2  # for capacitors that have less than they say
RIPPLE = 0.01  # of the voltage, at twice the frequency of the excitation
LOW = 0.9  # of the voltage needed, to which the storage voltage falls in a record's quiet parts
# s: of a packet that only tells when a storage capacitor is full; to wait for that
INSTANT = 1e-6
LONGEST = 30.0 * 86400.0
SOON = 3600.0  # s: the first course towards a wake
LONGER = 4.0  # times as long is the next course
SAME = 1e-9  # fraction of the highest voltage: a smaller rise ends the search
FEW, MANY = 4, 12  # voltages at which the current is measured, of a device of many


@dataclass(frozen=True)
class Candidate:
    """A circuit by its name, with an inductor or a chip's settings among its ``parameters``."""

    circuit: str
    coil: str | None
    parameters: dict[str, float]
    supply: Supply

    def scene(self, scene: Scene, needed: DesignNeed, farads: float | None = None) -> Scene:
        """The scene with this circuit, the load that draws the power needed, and a storage capacitor."""
        values = self.parameters | {"R": needed.load} | ({} if farads is None else {"C": farads})
        load = Load(netlist=self.circuit, parameters=values)
        return dataclasses.replace(scene, load=load, storage=None, node=None, chip=None)


@dataclass(frozen=True)
class Given:
    """The answer of a candidate for a scene: the power there (W), and the rest.

    ``wake`` (s) is infinite if the voltage is never reached; ``displacement`` (m) is None under
    noise and on a record, for whose quiet parts the storage capacitor keeps the energy ``kept``
    (J).
    """

    power: Value
    wake: float
    displacement: float | None
    steps: int
    kept: float = 0.0

    def unmet(self, needed: DesignNeed) -> list[str]:
        """The unmet requirements, each as it was written, with the value found."""
        unmet_needs = []
        if self.power.value < needed.power:
            unmet_needs.append(f"{needed.needs}, but {amount(self.power.value, 'W')}")
        if needed.wake is not None and not self.wake <= needed.wake:
            what = "never" if math.isinf(self.wake) else f"after {amount(self.wake, 's')}"
            unmet_needs.append(f"awake in {needed.wake_written}, but {what}")
        values = {"mean_power": self.power.value, "peak_displacement": self.displacement}
        for limit in needed.limits:
            value = values[limit.quantity]
            if value is not None and not bool(limit.met(np.array(value))):
                unit = "W" if limit.quantity == "mean_power" else "m"
                unmet_needs.append(f"{limit.written}, but {amount(value, unit)}")
        return unmet_needs


def candidates(scene: Scene, circuit: str, needed: DesignNeed) -> list[Candidate]:
    """The candidates of a circuit: with each inductor that it may have, or with a chip's settings.

    Raises InputError for a circuit that cannot be read, CannotServeError for one that cannot be
    measured at a held storage capacitor, and for a chip without that output.
    """
    chip = CHIPS.get(circuit)
    if chip is not None:
        levels = chip.thresholds(needed.voltage)
        if levels is None:
            raise CannotServeError(
                refusal("chip_without_output", chip=circuit, voltage=needed.voltage)
            )
        rise, fall = levels
        values = (needed.voltage, rise, fall, chip.full)
        settings = dict(zip(chip.names, values, strict=False))
        return [Candidate(circuit, None, settings, Supply(needed.voltage, chip, rise, fall))]
    bare = Candidate(circuit, None, {}, Supply(needed.voltage))
    problem = Problem(bare.scene(scene, needed))
    reason = refusal_of_slow(problem, Probe(STORE, "V"), records=True)
    if reason is not None:
        raise CannotServeError(reason)
    if "L" not in problem.load_circuit.values:
        return [bare]
    return [
        dataclasses.replace(bare, coil=name, parameters=_with(coil)) for name, coil in COILS.items()
    ]


def _with(coil: BoughtCoil) -> dict[str, float]:
    return {
        "L": coil.inductance,
        "Rcoil": coil.resistance,
        "Rcore": float(f"{coil.core_resistance:.3g}"),
    }


def saturates(candidate: Candidate, scene: Scene) -> bool:
    """Whether the current of an inversion, V sqrt(Cp/L), is more than the inductor's limit."""
    if candidate.coil is None:
        return False
    coil = COILS[candidate.coil]
    return (
        candidate.supply.voltage * math.sqrt(scene.modal.capacitance / coil.inductance)
        > coil.current
    )


def evaluate(
    candidate: Candidate, scene: Scene, needed: DesignNeed, farads: float, seed: int, count: int
) -> Given:
    """The answer of a candidate, with a storage capacitor of so many ``farads``.

    Raises HarvesterError if the current cannot be measured.
    """
    problem = Problem(candidate.scene(scene, needed))
    supply = candidate.supply
    if problem.equations.record is not None:
        return _on_record(candidate, scene, needed)
    with compilation():
        currents = measured(problem, supply.top, seed=seed, count=count)
    table, circuit = currents.best, problem.circuit
    power = supply.power(table, needed.power)
    known = Value(
        power,
        stderr=None
        if table.stderr is None
        else abs(supply.power(table.shifted(), needed.power) - power),
        bias=abs(supply.power(currents.rough, needed.power) - power),
        model=_of_chip(supply, table, needed.power, power) + JUDGE * power,
        unknown=IDEAL_ELEMENTS if table.stderr is not None and Rectifier(problem).ideal else "",
    ).with_unknown("" if circuit is None or circuit.topology is not None else COMPILED_CIRCUIT)
    return Given(known, supply.wake(table, farads), currents.displacement, currents.steps)


def _of_chip(supply: Supply, table: AnyCurrent, needed: float, power: float) -> float:
    """The error (W) of a power by the voltages that were measured, and by a chip's efficiencies.

    0 without a chip.
    """
    if supply.chip is None:
        return 0.0
    worse = replace(supply, chip=supply.chip.worse())
    return abs(supply.power(table.halved(), needed) - power) + abs(
        worse.power(table, needed) - power
    )


def _on_record(candidate: Candidate, scene: Scene, needed: DesignNeed) -> Given:
    """The answer of a candidate on a record, behind ideal diodes if there are any; a chip's rectifier is the bridge.

    The time scales are compared on a storage capacitor that hardly moves, as the load keeps the
    voltage.
    """
    from harvester.storage.node_run import NodeRun

    supply = candidate.supply
    whole = candidate.scene(scene, needed)
    if supply.chip is not None:
        diodes = dict(zip(("Is", "N"), supply.chip.diodes, strict=True))
        whole = dataclasses.replace(whole, load=Load(netlist="bridge", parameters=diodes))
    wakes = supply.voltage if supply.chip is None else supply.rise
    node = SensorNode(
        wake_voltage=wakes,
        stop_voltage=0.9 * wakes,
        interval=1.0,
        currents=(0.0,),
        durations=(INSTANT,),
    )
    chip = supply.chip and replace(supply.chip, rise=supply.rise, fall=supply.fall)
    with compilation():
        currents = recorded(Problem(whole), top=supply.top)
    powers = supply.powers(currents.best, needed.power)
    power = max(float(powers.mean()), 0.0)
    known = Value(
        power,
        bias=abs(supply.power(currents.rough, needed.power) - power),
        model=(currents.separation + currents.elements) * power
        + _of_chip(supply, currents.best, needed.power, power),
        unknown=TIME_SCALES if supply.chip and supply.chip.ratio else "",
    )
    ahead = np.cumsum(np.tile(powers - needed.power, 2)) * currents.best.length
    kept = float((np.maximum.accumulate(ahead) - ahead).max()) if power > needed.power else 0.0
    store = Storage(capacitance=capacitance(needed, scene, kept))
    with compilation():
        first = first_wake(NodeRun(currents.best, store, node, chip))
    return Given(known, math.inf if first is None else first, None, currents.steps, kept)


def first_wake(run: "NodeRun") -> float | None:
    """The time (s) of a node's first packet on a record; None if there is none in `LONGEST`.

    The course is followed for more and more repetitions of the record.  It begins with an empty
    storage capacitor, so the voltage at their ends never falls: once it no longer rises, the node
    never wakes.

    Raises TooLittleTimeError at the end of a budget.
    """
    begin = working_seconds()
    record = run.length * len(run.charging)
    seconds = record * math.ceil(SOON / record)
    before = -math.inf
    while True:
        course = run.course(min(seconds, LONGEST))
        assert course.left is not None, "a course without a packet has an end"
        if course.first is not None or seconds >= LONGEST:
            return course.first
        if course.left.volts <= before + SAME * run.top:
            return None
        before = course.left.volts
        check_time(begin, seconds / LONGEST)
        seconds *= LONGER


def capacitance(needed: DesignNeed, scene: Scene, kept: float = 0.0) -> float:
    """The smallest capacitor that keeps the voltage, `WIDE` times the energy of a node's packet, and ``kept``.

    With that energy (J) it falls to the node's stop voltage, or if absent to `LOW` of
    the voltage needed.
    """
    frequency = scene.modal.frequency / (2.0 * math.pi)
    if scene.excitation is not None and scene.excitation.frequency is not None:
        frequency = scene.excitation.frequency
    least = needed.power / (2.0 * frequency * RIPPLE * needed.voltage**2)
    if needed.packet:
        least = max(least, 2.0 * WIDE * needed.packet / (needed.voltage**2 - needed.stop**2))
    least = max(
        least, 2.0 * WIDE * kept / (needed.voltage**2 - (needed.stop or LOW * needed.voltage) ** 2)
    )
    series = between(SERIES, SMALLEST, LARGEST)
    return next((farads for farads in series if farads >= least), series[-1])


def capacitor(smallest: float, scene: Scene) -> float:
    """The capacitance (F) of the scene's [storage] if that is enough, else the ``smallest`` that is."""
    has = 0.0 if scene.storage is None else scene.storage.farads
    return max(has, smallest)


def nominal(
    scene: Scene, circuit: str, needed: DesignNeed, farads: float, seed: int
) -> tuple[Candidate, Given]:
    """The best candidate of a circuit: among several inductors the one of most power, none of which is saturated.

    Raises CannotServeError if every inductor is saturated, and as `candidates` and `evaluate`.
    """
    usable = [
        candidate
        for candidate in candidates(scene, circuit, needed)
        if not saturates(candidate, scene)
    ]
    if not usable:
        raise CannotServeError(refusal("coils_saturate", voltage=needed.voltage))
    if scene.excitation is not None and scene.excitation.acceleration_file is not None:
        every = [evaluate(candidate, scene, needed, farads, seed, MANY) for candidate in usable]
        most = int(np.argmax([given.power.value for given in every]))
        return usable[most], every[most]
    several = len(usable) > 1
    rough = [
        evaluate(part, scene, needed, farads, seed, 2).power.value if several else 0.0
        for part in usable
    ]
    best = usable[int(np.argmax(rough))]
    return best, evaluate(best, scene, needed, farads, seed, MANY)


def of_capacitor(device: Scene, smallest: float) -> list[Diagnostic]:
    """How the capacitor of the scene's [storage] compares with the ``smallest`` (F) that is enough."""
    store = device.storage
    if store is None or store.capacitance is None:
        return []
    code = "capacitor_kept" if store.farads >= smallest else "capacitor_too_small"
    return [note(code, "storage.capacitance", has=store.farads, smallest=smallest)]
