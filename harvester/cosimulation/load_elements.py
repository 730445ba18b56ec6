"""What a load circuit's elements say of how it runs: what it remembers, whether it feeds, what ngspice need not see.

Only the elements of the load's own subcircuit count as its memory: what stands in further ones within it is not looked
into.
"""

import re
from dataclasses import replace

from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.read_lines import ngspice_number

COIL = re.compile(r"l\..*#branch")  # the vector of a coil's current
KEEPS_NOTHING = 1e-2  # of the piezo's capacitance: a capacitor that is a part of a diode rather than a store
NEEDLESS = 1e-7  # of the piezo's reactance: a diode's series resistance that nobody sees in a power
_INITIAL = re.compile(r"(?im)^(\s*[cl]\S*\s.*?)\s+ic\s*=\s*(?:\{[^}]*\}|'[^']*'|\S+)")
_SERIES = re.compile(r"(?im)(?<=[\s(,])rs\s*=\s*([^\s,(){}']+)")
_PASSIVE = "rcld"


def without_initial_conditions(load: LoadCircuit) -> LoadCircuit:
    """The same circuit without initial conditions (IC=) of capacitors and coils, which no periodic response knows."""
    return replace(load, text=_INITIAL.sub(r"\1", load.text))


def without_needless_resistances(load: LoadCircuit, reactance: float) -> LoadCircuit:
    """The same circuit, with diodes of no series resistance where theirs is below `NEEDLESS` of a ``reactance`` (ohm).

    That of 1 uohm joins two nodes, whose voltages round to some 1e-16 V: the current between them, known to 1e-10 A,
    never satisfies ngspice, whose tolerance for a diode that blocks is less than 1e-12 A.
    """

    def shown(match: re.Match[str]) -> str:
        value = ngspice_number(match[1])
        return "rs=0" if value is not None and 0.0 < value < NEEDLESS * reactance else match[0]

    lines = load.text.split("\n")
    models = [_SERIES.sub(shown, line) if re.match(r"(?i)\s*\.model\s+\S+\s+d\b", line) else line for line in lines]
    return replace(load, text="\n".join(models))


def stores(load: LoadCircuit, capacitance: float) -> list[tuple[str, str]]:
    """The nodes of each capacitor that remembers anything beside a piezo of that capacitance (F)."""
    return [
        (words[1], words[2])
        for words in _elements(load)
        if words[0][0] == "c" and not (_value(load, words) or capacitance) < KEEPS_NOTHING * capacitance
    ]


def feeds_nothing(load: LoadCircuit) -> bool:
    """Whether a circuit has no energy of its own, which may feed a motion that grows.

    That is one of the package's, or of resistors, capacitors, coils and diodes alone, of positive values.
    """
    if load.topology is not None or load.linear:
        return True
    elements = _elements(load) if load.text.lower().count(".subckt") == 1 else [["further subcircuits"]]
    positive = (words[0][0] == "d" or (_value(load, words) or 0.0) > 0.0 for words in elements)
    return all(words[0][0] in _PASSIVE for words in elements) and all(positive)


def _elements(load: LoadCircuit) -> list[list[str]]:
    """The words of each element of the load's own subcircuit, in lower case."""
    lines = load.text.lower().split(".ends")[0].splitlines()
    return [line.split() for line in lines if line.split() and line.split()[0][0] != "."]


def _value(load: LoadCircuit, words: list[str]) -> float | None:
    """The value of a resistor, capacitor or coil; None where it is no plain number, nor a parameter that is one."""
    text = words[3].removeprefix("r=").removeprefix("c=").removeprefix("l=") if len(words) > 3 else ""
    values = {name.lower(): value for name, value in load.values.items()}
    return values.get(text.strip("{}'"), ngspice_number(text))
