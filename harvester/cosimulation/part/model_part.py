"""A user's model of `cosimulate` in an FMU: the lock-step without ngspice.

    int64 harvester_part(int64 task, double *numbers, double *w, uint64 *words, int64 *at,
                         double *out, double until)

as `harvester.mechanics.part.entry` has it.  The model's functions, and the state machine that calls
them, are those of the lock-step (`harvester.cosimulation.lockstep.any_mechanics`); at each of its
targets the circuit behind the port has come to the same time
(`harvester.cosimulation.part.port_circuits`).

The state is that at the end of a whole step.  A time within a step is a step of that length aside,
so that the trajectory does not depend on the communication steps.  All numbers are in SI units.
"""

import math
from typing import Any, NamedTuple

from numba import carray, cfunc, from_dtype, types  # type: ignore[attr-defined]
from numba.extending import intrinsic

from harvester.circuits.pointers import pointer
from harvester.cosimulation.lockstep import any_mechanics
from harvester.cosimulation.lockstep.any_mechanics import MOST, ModelRecord
from harvester.cosimulation.lockstep.state import DURING, STATE
from harvester.cosimulation.lockstep.transitions import set_target
from harvester.cosimulation.ngspice.model_callbacks import CompiledModel
from harvester.cosimulation.part.port_circuits import (
    LINKED,
    Linked,
    Lockstep,
    PortNumbers,
    accept,
    circuit_of,
    first_of,
    power_of,
    store_of,
    stored_of,
    volts_of,
)
from harvester.mechanics.kernels.compiled import COMPILER, FLAGS, inlined, strict
from harvester.mechanics.kernels.driver import aside
from harvester.mechanics.part.entry import SIGNATURE, read, stored
from harvester.mechanics.part.gridded import is_solved
from harvester.mechanics.part.numbers import count, read_numbers
from harvester.mechanics.part.part_noise import uniform
from harvester.mechanics.part.part_state import (
    ADVANCE,
    DONE,
    FAILED,
    READ,
    SLACK,
    STOPPING,
    UNSOLVED,
    W,
)

# StateLayout of the report behind a model's state
VOLTAGE_OUT, CURRENT_OUT, POWER_OUT, EVENTS_OUT, EVENT_TIME_OUT = range(5)
WORK_OUT, LOAD_OUT, DELIVERED_OUT, STORED_OUT, STORE_OUT, OUT_SIZE = range(5, 11)
ROWS = 2
begin_part = strict(any_mechanics.begin_part)
set_next = strict(set_target)
RECORD_SIZE = STATE.itemsize // 8
FIRST = int(W.SIZE)
USED = (W.VOLTAGE, W.TIME, W.HITS, W.HIT_TIME, W.STEPS, W.BEGUN, W.NOW)
VOLTAGE, TIME, HITS, HIT_TIME, STEPS, BEGUN, NOW = map(int, USED)


class StateLayout(NamedTuple):
    """The first places of the parts of a model's own state, behind that of a netlist."""

    state: int
    linked: int
    noise: int
    record: int
    variates: int
    samples: int
    events: int
    size: int


def layout(netlist: int, numbers: int) -> StateLayout:
    """The places for a netlist's state of so many numbers, and a model's state of so many."""
    sizes = {
        "state": numbers,
        "linked": len(Linked._fields),
        "noise": 2,
        "record": RECORD_SIZE,
        "variates": 2,
        "samples": ROWS * (numbers + 3),
        "events": MOST + 2,
    }
    at = FIRST + netlist
    begins = {}
    for name, size in sizes.items():
        begins[name] = at
        at += size
    return StateLayout(**begins, size=at)


@intrinsic
def _record_at(typingctx, address):
    """The pointer to the record of the lock-step at an address."""
    kind = types.CPointer(from_dtype(STATE))

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], context.get_value_type(kind))

    return kind(types.int64), codegen


class Stepped(NamedTuple):
    """A step's end: state, `Linked`, events and the last one's time, and the fault, or 0."""

    at: Any
    linked: Linked
    events: float
    when: float
    fault: int


@inlined
def normal(words):
    """Two standard normal numbers (Box and Muller)."""
    length = math.sqrt(-2.0 * math.log(uniform(words)))
    angle = 2.0 * math.pi * uniform(words)
    return length * math.cos(angle), length * math.sin(angle)


@inlined
def kept(w, first, values):
    """Keep numbers in the state."""
    k = first
    for value in values:
        w[k] = value
        k += 1


def _step(model: CompiledModel, port: PortNumbers, follow: Any, h: float, at: StateLayout) -> Any:
    """The function of one step of a ``length``, with a ``share`` of the variates of a whole one."""
    f, _, at0 = model
    is_coil = port.capacitance is None
    width = len(at0) + 3
    linked0 = LINKED

    @inlined
    def step(w, m, p, load, length, share):
        numbers = carray(w, (at.size,))
        for k in range(at.record, at.size):
            numbers[k] = 0.0
        base = numbers.ctypes.data
        s = carray(_record_at(base + 8 * at.record), 1)[0]
        noise = carray(pointer(base + 8 * at.variates), (1, 2))
        noise[0, 0] = share * numbers[at.noise]
        noise[0, 1] = share * numbers[at.noise + 1]
        samples = carray(pointer(base + 8 * at.samples), (ROWS, width))
        record = ModelRecord(noise, samples, numbers[at.events : at.size])
        now = read_numbers(at0, w, at.state)
        linked = read_numbers(linked0, w, at.linked)
        s.h = length
        s.w0 = 1.0
        s.coupling = p.coupling
        s.volts = volts_of(p)
        s.coil = 1 if is_coil else 0
        s.stride = 1
        s.noise_size = 1
        s.measuring = DURING
        s.mean_before = linked.mean_before
        s.part_before = linked.part_before
        s.voltage = linked.voltage
        s.current = linked.current
        s.reaction = linked.reaction
        s.grown = linked.grown
        now, target, goal = begin_part(s, now, linked.reaction, record, f, m)
        set_next(s, target, goal)
        s.driven = f.source(m, now)
        when = 0.0
        while s.n_steps == 0 and s.fault == 0:
            before = s.impacts
            linked, point = follow(s, p, load, linked, Lockstep(f, m, now, record), h)
            now = accept(s, point, record, f, m, now)
            linked = Linked(
                port=linked.port,
                fed=linked.fed,
                reaction=s.reaction,
                grown=s.grown,
                mean_before=s.mean_before,
                part_before=s.part_before,
                voltage=point.v,
                current=point.current,
                work=linked.work,
                load=linked.load,
                delivered=linked.delivered,
            )
            if s.impacts > before:
                when = point.t
        ended = Linked(
            port=linked.port,
            fed=linked.fed,
            reaction=linked.reaction,
            grown=linked.grown,
            mean_before=linked.mean_before,
            part_before=linked.part_before,
            voltage=linked.voltage,
            current=linked.current,
            work=linked.work + s.voltage_work,
            load=linked.load,
            delivered=linked.delivered,
        )
        return Stepped(now, ended, s.impacts + 0.0, when, s.fault)

    return step


def _first(model: CompiledModel) -> Any:
    """The function of the first `Linked`."""
    f, _, at0 = model

    @inlined
    def first(w, m, p, load, begin):
        source = f.source(m, read_numbers(at0, w, begin))
        return first_of(p, load, source, w[VOLTAGE])

    return first


def model_entry(
    model: CompiledModel, port: PortNumbers, circuit: Any, h: float, at: StateLayout
) -> Any:
    """The compiled function of a model with a port and a ``circuit``, at steps of h seconds.

    ``circuit`` is the template of a netlist's numbers, or None.
    """
    m0 = model.coefficients
    at0 = model.state
    of_port = count(m0)
    of_circuit = of_port + count(port)
    n = len(at0)
    linked0 = LINKED
    step = _step(model, port, circuit_of(port, circuit), h, at)
    first = _first(model)
    has_netlist = bool(circuit)

    def part(task, numbers, w, words, addresses, out, until):
        m = read_numbers(m0, numbers, 0)
        p = read_numbers(port, numbers, of_port)
        load = stored(read(circuit, numbers, of_circuit), w, addresses)
        if w[BEGUN] == 0.0:
            kept(w, at.linked, first(w, m, p, load, at.state))
        if task == ADVANCE or task == STOPPING:  # noqa: PLR1714, SIM109 - as numba needs it
            if w[BEGUN] == 0.0:
                w[BEGUN] = 1.0
                kept(w, at.noise, normal(words))
            while (w[STEPS] + 1.0) * h <= until + SLACK * h:
                end = step(w, m, p, load, h, 1.0)
                if end.fault != 0 or not math.isfinite(end.linked.port):
                    return FAILED
                kept(w, at.state, end.at)
                kept(w, at.linked, end.linked)
                kept(w, at.noise, normal(words))
                if end.events > 0.0:
                    w[HITS] += end.events
                    w[HIT_TIME] = w[STEPS] * h + end.when
                w[STEPS] += 1.0
                w[TIME] = w[STEPS] * h
            w[NOW] = until
            if has_netlist:
                return DONE if is_solved(load) else UNSOLVED
            return DONE
        if task == READ:
            now = read_numbers(at0, w, at.state)
            linked = read_numbers(linked0, w, at.linked)
            store = store_of(load)
            hits = w[HITS]
            hit_time = w[HIT_TIME]
            left = w[NOW] - w[TIME]
            if w[BEGUN] != 0.0 and left > SLACK * h:
                other = aside(load)
                end = step(w, m, p, other, left, math.sqrt(left / h))
                store = store_of(other)
                now = end.at
                linked = end.linked
                if end.events > 0.0:
                    hits += end.events
                    hit_time = w[TIME] + end.when
            kept(out, 0, now)
            kept(
                out,
                n,
                (
                    linked.voltage,
                    linked.current,
                    power_of(p, linked),
                    hits,
                    hit_time,
                    linked.work,
                    linked.load,
                    linked.delivered,
                    stored_of(p, linked),
                    store,
                ),
            )
        return DONE

    return cfunc(SIGNATURE, **COMPILER, **FLAGS)(part)
