"""Circuits behind the port of a model in an FMU, led to the targets of the lock-step.

    resistance     the closed form of the package's own loads, also for a coil with an inductance
    netlist        the solver and the steps of engine `compiled` (piezo)
    none           a current from outside, held over a step

All numbers are in SI units.
"""

from typing import Any, NamedTuple

from harvester.circuits.circuit_path import ChargeCourse, NetlistLoad, advance_load
from harvester.circuits.substeps import DID, FINEST
from harvester.cosimulation.lockstep import any_mechanics
from harvester.cosimulation.lockstep.state import Point
from harvester.mechanics.kernels.compiled import inlined, strict, version_of
from harvester.mechanics.kernels.equation_of_motion import carried
from harvester.mechanics.part.outside_forces import dissipated

PARTS = 16  # of a leg, in which the current of a coil with an inductance goes in straight lines
port_voltage, accept = strict(any_mechanics.port_voltage), strict(any_mechanics.accept_model)


class PortNumbers(NamedTuple):
    """A port and its load in SI units, None for an absent part.

    ``capacitance`` is that of a piezo, ``series`` and ``inductance`` those of a coil; ``load`` a
    resistance, and ``current`` one that is drawn from outside.
    """

    coupling: float
    capacitance: float | None
    series: float | None
    inductance: float | None
    load: float | None
    current: float | None


class Lockstep(NamedTuple):
    """A model in lock-step: functions, coefficients, state, and the arrays of a run."""

    f: Any
    m: Any
    at: Any
    record: Any


class Linked(NamedTuple):
    """The port's electrical state between two steps, and the energies (J) so far.

    ``port`` is the voltage of a piezo or the current of a coil, ``fed`` the source's voltage that
    the circuit has followed.
    """

    port: float
    fed: float
    reaction: float
    grown: float
    mean_before: float
    part_before: float
    voltage: float
    current: float
    work: float
    load: float
    delivered: float


LINKED = Linked(*(0.0 for _ in Linked._fields))


@inlined
def source_voltage(s, t, lockstep):
    """The source's voltage at the time t of the present leg."""
    return port_voltage(s, t, lockstep.f, lockstep.m, lockstep.at)


@inlined
def volts_of(p):
    """The voltage of the source over the model's own source."""
    if p.capacitance is not None:
        return p.coupling / p.capacitance
    return p.coupling


def store_of(load):
    """The voltage across the storage capacitor of a netlist; 0 without."""


@version_of(store_of, load=None)
def _no_store(load):
    return 0.0


@version_of(store_of, load=NetlistLoad)
def _netlist_store(load):
    return load.state[load.circuit.voltages_at + 1]


def across_load(load, given):
    """The voltage across the load resistance at first, behind a piezo of a ``given`` voltage."""


@version_of(across_load, load=None)
def _across_resistance(load, given):
    return given


@version_of(across_load, load=NetlistLoad)
def _across_in_netlist(load, given):
    return load.state[load.circuit.voltages_at + 2]


@inlined
def stored_of(p, linked):
    """The energy in a piezo's capacitance, or in a coil's inductance."""
    if p.capacitance is not None:
        return 0.5 * p.capacitance * linked.port * linked.port
    if p.inductance is not None:
        return 0.5 * p.inductance * linked.port * linked.port
    return 0.0


@inlined
def power_of(p, linked):
    """The power in the load resistance; 0 without."""
    if p.current is not None:
        return 0.0
    return p.load * linked.current * linked.current


@inlined
def _first_current(p, e):
    """The current of a coil at first, of an e.m.f. e."""
    if p.current is not None:
        return p.current
    if p.inductance is not None:
        return 0.0
    if p.series is not None:
        return e / (p.load + p.series)
    return e / p.load


@inlined
def first_of(p, load, source, given):
    """The first `Linked` of a model with this source; ``given`` is a piezo's voltage."""
    fed = volts_of(p) * source
    if p.capacitance is not None:
        port = voltage_then = given
        current = 0.0
        if p.current is not None:
            current += p.current
        if p.load is not None:
            current += across_load(load, given) / p.load
        mean = 0.0
    else:
        port = current = mean = _first_current(p, fed)
        voltage_then = fed
        if p.series is not None:
            voltage_then -= p.series * current
        if p.load is not None:
            voltage_then = p.load * current
    return Linked(
        port=port,
        fed=fed,
        reaction=p.coupling * port,
        grown=source,
        mean_before=mean,
        part_before=0.0,
        voltage=voltage_then,
        current=current,
        work=0.0,
        load=0.0,
        delivered=0.0,
    )


@inlined
def _after(linked, port, fed, load, delivered):
    """The same with another electrical state, and further energies."""
    return Linked(
        port=port,
        fed=fed,
        reaction=linked.reaction,
        grown=linked.grown,
        mean_before=linked.mean_before,
        part_before=linked.part_before,
        voltage=linked.voltage,
        current=linked.current,
        work=linked.work,
        load=linked.load + load,
        delivered=linked.delivered + delivered,
    )


# Each circuit leads the port to the target of the lock-step: the `Linked` there, and the `Point`.


@inlined
def piezo_on_resistance(s, p, load, linked, lockstep, h):
    """A piezo with a load resistance, a current from outside, or both."""
    t = s.target_time
    u = source_voltage(s, t, lockstep)
    long = t - s.t
    before = linked.port
    way = u - linked.fed
    mu = None if p.load is None else 1.0 / (p.load * p.capacitance)
    drawn = 0.0 if p.current is None else p.current
    after = carried(before, way - long * drawn / p.capacitance, long, mu)
    energy = 0.5 * long * drawn * (before + after)
    power = 0.0
    if p.load is not None:
        if long > 0.0:
            mean = way / long - drawn / p.capacitance
            energy += p.capacitance * dissipated(before, after, mean, long, mu)
        power = after * after / p.load
        drawn += after / p.load
    return _after(linked, after, u, energy, 0.0), Point(t, after, power, drawn, 0.0)


@inlined
def piezo_on_netlist(s, p, load, linked, lockstep, h):
    """A piezo with a compiled circuit, by whole numbers of its shortest steps.

    The charge of a leg that is shorter comes with the next.
    """
    t = s.target_time
    circuit, state = load.circuit, load.state
    parts = int(t / h * FINEST + 0.5) - int(s.t / h * FINEST + 0.5)
    after = before = linked.port
    u = fed = linked.fed
    energy = 0.0
    delivered = 0.0
    if parts > 0:
        u = source_voltage(s, t, lockstep)
        long = float(parts)
        course = ChargeCourse(begin=fed, end=u, wall=u, first=long)
        after = advance_load(load, course, long, parts)
        last = len(state) - DID
        if s.h == h:  # the counts are of whole steps
            for k in range(3):
                load.counts[k] += state[last + k]
        delivered = state[last] / p.load
        energy = 0.5 * p.capacitance * (before + after) * (u - fed - (after - before))
    across = state[circuit.voltages_at + 2]
    power = across * across / p.load
    return _after(linked, after, u, energy, delivered), Point(t, after, power, across / p.load, 0.0)


@inlined
def coil_on_resistance(s, p, load, linked, lockstep, h):
    """A coil with its resistance and inductance in series with a load resistance."""
    begin = s.t
    t = s.target_time
    total = p.load
    if p.series is not None:
        total += p.series
    i = linked.port
    e = source_voltage(s, begin, lockstep)
    long = (t - begin) / PARTS
    energy = 0.0
    for k in range(PARTS):
        now = t if k + 1 == PARTS else begin + (k + 1.0) * long
        e1 = source_voltage(s, now, lockstep)
        if p.inductance is None:
            i1 = e1 / total
        else:
            i1 = carried(i, 0.5 * (e + e1) * long / p.inductance, long, total / p.inductance)
        energy += 0.5 * long * p.load * (i * i + i1 * i1)
        i = i1
        e = e1
        if k + 1 < PARTS:
            point = Point(now, p.load * i, p.load * i * i, i, 0.0)
            accept(s, point, lockstep.record, lockstep.f, lockstep.m, lockstep.at)
    return (_after(linked, i, e, energy, 0.0), Point(t, p.load * i, p.load * i * i, i, 0.0))


@inlined
def coil_on_current(s, p, load, linked, lockstep, h):
    """A coil whose current comes from outside."""
    t = s.target_time
    before = source_voltage(s, t, lockstep)
    if p.series is not None:
        before -= p.series * p.current
    energy = 0.5 * (t - s.t) * (linked.voltage + before) * p.current
    return _after(linked, p.current, before, energy, 0.0), Point(t, before, 0.0, p.current, 0.0)


def circuit_of(port: PortNumbers, template: Any) -> Any:
    """The function of a port's circuit, one of the four above."""
    if port.capacitance is not None:
        return piezo_on_resistance if template is None else piezo_on_netlist
    return coil_on_current if port.current is not None else coil_on_resistance
