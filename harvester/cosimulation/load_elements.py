"""Properties of a load circuit by its elements: its memory, whether it feeds, the part that ngspice need not see."""

import re
from collections.abc import Callable
from dataclasses import replace

from harvester.netlists.load_circuit import LoadCircuit, with_parts
from harvester.netlists.part import CircuitPart

COIL = re.compile(r"l\..*#branch")  # the vector of an inductor's current
# of the piezo's capacitance: a capacitor that is a part of a diode rather than a storage capacitor
KEEPS_NOTHING = 1e-2
NEEDLESS = 1e-7  # of the piezo's reactance: a diode's series resistance that nobody sees in a power
_PASSIVE = "rcld"


def is_coil(name: str) -> bool:
    """Whether a vector of ngspice is the current of an inductor."""
    return COIL.fullmatch(name) is not None


def without_initial_conditions(load: LoadCircuit) -> LoadCircuit:
    """The same circuit without initial conditions of its elements, which no periodic response knows."""

    def plain(part: CircuitPart) -> CircuitPart:
        return replace(
            part, options={key: value for key, value in part.options.items() if key != "ic"}
        )

    return _changed(load, plain)


def without_needless_resistances(load: LoadCircuit, reactance: float) -> LoadCircuit:
    """The same circuit, with diodes of no series resistance if theirs is below `NEEDLESS` of a ``reactance`` (ohm).

    That of 1 uohm joins two nodes, whose voltages round to some 1e-16 V: the current between them,
    known to 1e-10 A, never satisfies ngspice, whose tolerance for a diode that blocks is less than
    1e-12 A.
    """

    def bare(part: CircuitPart) -> CircuitPart:
        model = part.model
        if model is None or part.kind != "d" or not 0.0 < model.value("rs") < NEEDLESS * reactance:
            return part
        return replace(part, model=replace(model, values={**model.values, "rs": 0.0}))

    return _changed(load, bare)


def _changed(load: LoadCircuit, change: Callable[[CircuitPart], CircuitPart]) -> LoadCircuit:
    """The circuit of changed elements; itself if none is."""
    parts = tuple(map(change, load.parts))
    return load if parts == load.parts else with_parts(load, parts)


def stores(load: LoadCircuit, capacitance: float) -> list[tuple[str, ...]]:
    """The nodes of each capacitor that remembers anything when connected to a piezo of that capacitance (F)."""
    return [
        part.nodes
        for part in load.parts
        if part.kind == "c"
        and not (part.effective_value or capacitance) < KEEPS_NOTHING * capacitance
    ]


def feeds_nothing(load: LoadCircuit) -> bool:
    """Whether a circuit has no energy of its own, which may feed a motion that grows.

    That is one of the package's, or of resistors, capacitors, inductors and diodes alone, of
    positive values.
    """
    if load.topology is not None or load.linear:
        return True
    positive = (part.kind == "d" or (part.effective_value or 0.0) > 0.0 for part in load.parts)
    return all(part.kind in _PASSIVE for part in load.parts) and all(positive)
