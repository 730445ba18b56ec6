"""What a load circuit of a user's own remembers from period to period, and whether it may feed the motion.

Only the elements of the load's own subcircuit count here: what stands in further ones within it is not looked into.
"""

import re
from dataclasses import replace

from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.read_lines import ngspice_number

COIL = re.compile(r"l\..*#branch")  # the vector of a coil's current
KEEPS_NOTHING = 1e-2  # of the piezo's capacitance: a capacitor that is a part of a diode rather than a store
_INITIAL = re.compile(r"(?im)^(\s*[cl]\S*\s.*?)\s+ic\s*=\s*(?:\{[^}]*\}|'[^']*'|\S+)")
_PASSIVE = "rcld"


def without_initial_conditions(load: LoadCircuit) -> LoadCircuit:
    """The same circuit without initial conditions (IC=) of capacitors and coils, which no periodic response knows."""
    return replace(load, text=_INITIAL.sub(r"\1", load.text))


def stores(load: LoadCircuit, capacitance: float) -> list[tuple[str, str]]:
    """The nodes of each capacitor that remembers anything beside a piezo of that capacitance (F)."""
    return [
        (words[1], words[2])
        for words in _elements(load)
        if words[0][0] == "c" and not (_value(load, words) or capacitance) < KEEPS_NOTHING * capacitance
    ]


def feeds_nothing(load: LoadCircuit) -> bool:
    """Whether no more than resistors, capacitors, coils and diodes are there, and all values known and positive."""
    elements, own = _elements(load), load.text.lower().count(".subckt") == 1
    passive = all(words[0][0] in _PASSIVE for words in elements)
    return own and passive and all(words[0][0] == "d" or (_value(load, words) or 0.0) > 0.0 for words in elements)


def _elements(load: LoadCircuit) -> list[list[str]]:
    """The words of each element of the load's own subcircuit, in lower case."""
    lines = load.text.lower().split(".ends")[0].splitlines()
    return [line.split() for line in lines if line.split() and line.split()[0][0] != "."]


def _value(load: LoadCircuit, words: list[str]) -> float | None:
    """The value of a resistor, capacitor or coil; None where it is no plain number, nor a parameter that is one."""
    text = words[3].removeprefix("r=").removeprefix("c=").removeprefix("l=") if len(words) > 3 else ""
    values = {name.lower(): value for name, value in load.values.items()}
    return values.get(text.strip("{}'"), ngspice_number(text))
