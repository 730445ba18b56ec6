"""A compiled circuit inside an FMU: the package's own solver and steps, on tables in C.

The answers to the questions of `harvester.mechanics.part` for a load of the type `NetlistLoad`. The
circuit's state follows that of the device, and the C program gives the addresses of its record
(`harvester.circuits.substeps.CIRCUIT`), of `follow`, of the workspace and of a second state.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from numba import carray, cfunc  # type: ignore[attr-defined]

from harvester.arrays import Floats
from harvester.circuits.circuit_path import NetlistLoad
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.newton import compiled_source
from harvester.circuits.newton_parts import SIGNATURE
from harvester.circuits.pointers import pointer
from harvester.circuits.substeps import DID, FOLLOW, MOST, ROOMS, KernelCircuit, follow
from harvester.circuits.system import Row
from harvester.mechanics.kernels.compiled import COMPILER, FLAGS, version_of
from harvester.mechanics.part.entry import stored
from harvester.mechanics.part.gridded import (
    Spent,
    is_solved,
    keep_store,
    load_energy,
    out_of_piezo,
    spent,
    with_store,
)
from harvester.mechanics.part.part_state import DrawnLoad, W, load_of

FEW = 1e4 * MOST  # steps that may fail before their share counts
RECORD, FOLLOW_AT, ROOM, OTHER, ADDRESSES = range(5)  # places of the addresses
FIRST = int(W.SIZE)
COUNTS = int(W.COUNTS)


class NetlistNumbers(NamedTuple):
    """A compiled circuit as the template of its numbers; the whole numbers are fixed.

    ``charge`` is theta l (C) and ``volts`` theta l/Cp; ``mu`` 1/(R Cp w0) of Rload; ``delivered``
    the nondimensional energy in Rload over beta and its integral of V^2 (V^2 s). ``length`` and
    ``width`` are those of a state and of a row of the workspace, ``voltages_at`` the place of the
    voltages.
    """

    charge: float
    volts: float
    mu: float
    delivered: float
    length: int
    width: int
    voltages_at: int


@dataclass(frozen=True)
class CircuitTables:
    """All that a C program needs of a compiled circuit at one step.

    ``record`` and ``arrays`` are the numbers of `CIRCUIT` without addresses, and the arrays that
    these point to, by name; ``rest`` is the first state. ``volts`` are the volts of 1 of the
    charges of piezo and storage capacitor, by their places; ``load`` is 1 or -1 for that of them
    across which Rload lies, else 0; ``elements`` name the functions.
    """

    numbers: NetlistNumbers
    record: dict[str, float]
    arrays: dict[str, Floats]
    rest: Floats
    volts: dict[str, tuple[int, float]]
    load: dict[str, float]
    elements: list[str]


def circuit_tables(circuit: CompiledCircuit, h: float) -> CircuitTables:
    """The tables of a circuit at steps of h."""
    values, arrays = circuit.tables(h)
    charges = {name: k for k, (name, *_) in enumerate(circuit.system.charges)}
    signs = [_sign(column, circuit.load_row) for _, column, *_ in circuit.system.charges]
    functions = len(circuit.system.diodes) + len(circuit.system.functions)
    rest = circuit.rest
    for k, sign in enumerate(signs):
        if sign:
            rest[circuit.voltages_at + 2] = sign * rest[k] * circuit.system.charges[k][3]
    capacitors = [name for name in ("piezo", "csmooth") if name in charges]
    return CircuitTables(
        numbers=netlist_numbers(circuit, circuit.scales.volts),
        record=values,
        arrays=arrays,
        rest=rest,
        volts={
            name: (charges[name], circuit.system.charges[charges[name]][3]) for name in capacitors
        },
        load={name: signs[charges[name]] for name in capacitors},
        elements=[circuit.system.element_of(k) for k in range(functions)],
    )


def _sign(across: Row, other: Row) -> float:
    """1 if two voltages are the same, -1 if they are opposite, else 0."""
    if across == other:
        return 1.0
    return -1.0 if across == {k: -value for k, value in other.items()} else 0.0


def netlist_numbers(circuit: CompiledCircuit, volts: float) -> NetlistNumbers:
    """The numbers of a circuit on a device of a voltage scale theta l/Cp."""
    return NetlistNumbers(
        charge=circuit.scales.capacitance * volts,
        volts=volts,
        mu=circuit.mu,
        delivered=circuit.mu * circuit.scales.frequency / volts**2,
        length=len(circuit.rest),
        width=circuit.room,
        voltages_at=circuit.voltages_at,
    )


class CircuitFunction(NamedTuple):
    """A C function of a circuit before its compilation, with the ``text`` on which it depends."""

    signature: Any
    function: Callable[..., Any]
    text: str

    def code(self) -> bytes:
        """Its LLVM code."""
        made = cfunc(self.signature, **COMPILER, **FLAGS)(self.function)
        return str(made.inspect_llvm()).encode()


def circuit_functions(circuit: CompiledCircuit) -> dict[str, CircuitFunction]:
    """The functions `follow` and a circuit's solver, by the names that they have in C."""
    text = circuit.solver.text
    solver = compiled_source(text).__wrapped__
    return {
        "harvester_follow": CircuitFunction(FOLLOW, follow.function, ""),
        "harvester_solve": CircuitFunction(SIGNATURE, solver, text),
    }


@version_of(stored, circuit=NetlistNumbers)
def _stored(circuit, w, at):
    state = carray(w, (FIRST + circuit.length,))
    room = carray(pointer(at[ROOM]), (ROOMS, circuit.width))
    counts = state[COUNTS:FIRST]
    return NetlistLoad(
        circuit=KernelCircuit(
            record=carray(pointer(at[RECORD]), (1,)),
            address=at[FOLLOW_AT],
            length=circuit.width,
            voltages_at=circuit.voltages_at,
            volts=circuit.volts,
            unit=(circuit.mu, circuit.delivered),
        ),
        state=state[FIRST:],
        other=carray(pointer(at[OTHER]), (circuit.length,)),
        room=room,
        counts=counts,
        voltages=room,  # records of samples, which a part does not take
        square=counts,
        states=None,
    )


@version_of(with_store, load=NetlistLoad)
def _with_store(load, w):
    return load


@version_of(keep_store, load=NetlistLoad)
def _keep_store(load, w):
    return 0


@version_of(is_solved, load=NetlistLoad)
def _is_solved(load):
    return not load.counts[2] > max(FEW, MOST * load.counts[1])


@version_of(load_energy, before=NetlistLoad)
def _load_energy(m, before, end, t, c):
    return out_of_piezo(m, end, t, c)


@version_of(spent, before=NetlistLoad)
def _spent(m, before, end, t, c):
    return Spent(0.0, 0.0)  # its own state has the energy in its load


@version_of(load_of, load=NetlistLoad)
def _load_of(m, c, load):
    at = load.circuit.voltages_at
    mu, delivered = load.circuit.unit
    square = load.counts[0] + load.state[len(load.state) - DID]  # the last is of a part of a step
    volts = load.circuit.volts
    return DrawnLoad(
        U=load.state[at + 2] / volts,
        mu=mu,
        store=load.state[at + 1] / volts,
        delivered=delivered * square,
    )
