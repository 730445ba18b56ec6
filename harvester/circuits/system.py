"""The equations of a circuit, element by element (modified nodal analysis).

    P z' + G y + A i(w) + A q(w)' = s + b u        z = Z y,  w = W y

y are the voltages of the nodes, and the currents of the elements that need one (voltage sources,
inductors); z the charges of capacitors and the fluxes of inductors; i the currents of diodes,
switches and B sources and q the charges of junctions, which depend on the voltages and currents w;
s the values that sources of constant value give.  u = theta x' is the current of the piezo, which
is next to its capacitance Cp between the node ``p`` and ground.

Source: Ho, Ruehli, Brennan, IEEE Trans. Circuits Syst. 22, 504, 1975.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.netlists.expression_tree import Node, input_of, operation
from harvester.netlists.part import CircuitPart

GMIN = 1e-12  # S, which ngspice puts beside every junction
COUNTING = ("floor", "ceil", "int", "nint")
PIEZO = "piezo"  # the name of its charge
Row = dict[int, float]  # coefficients by the number of the unknown, or of the equation


@dataclass(frozen=True)
class Junction:
    """How an input's voltage is limited in Newton's iterations: at a diode's growing current, and its breakdown.

    The current is ``saturation`` exp(v/thermal), and beyond ``breakdown`` (V, infinite without)
    that with ``reverse``.
    """

    thermal: float
    saturation: float
    breakdown: float = np.inf
    reverse: float = 1.0

    def limits(self, impedance: float) -> tuple[float, ...]:
        """The arguments of `newton_parts.limited` in surroundings of an impedance (ohm)."""
        knees = [self._knee(n, impedance) for n in (self.thermal, self.reverse)]
        return self.thermal, knees[0], min(self.breakdown, 1e30), self.reverse, knees[1]

    def _knee(self, thermal: float, impedance: float) -> float:
        """The voltage at which its resistance is the impedance."""
        if self.saturation <= 0.0:
            return 0.0
        return max(thermal * math.log(thermal / (impedance * self.saturation)), 0.0)


@dataclass(frozen=True)
class Function:
    """A current, or the voltage of a source, that depends on the inputs by a ``tree``, and its place."""

    tree: Node
    rows: Row


@dataclass(frozen=True)
class Diode:
    """A diode's junction: its ``input`` and the ``arguments`` of `junctions.diode`, and its place in the equations."""

    input: int
    arguments: tuple[float, ...]
    rows: Row


@dataclass(frozen=True)
class Switch:
    """A switch: closed once its control is above ``on``, open once it is below ``off``."""

    control: Row
    on: float
    off: float
    closed: bool
    name: str  # the element's


@dataclass
class System:
    """The equations as they grow, element by element.

    The unknowns are numbered in the order of their first mention.
    """

    capacitance: float  # of the piezo, F
    unknowns: dict[str, int] = field(default_factory=dict)
    # products of a column and a row in G
    conductances: list[tuple[Row, Row, float]] = field(default_factory=list)
    # those of its columns that are only beside junctions
    leaks: list[Row] = field(default_factory=list)
    # those of its columns that are of resistances within devices
    series: list[Row] = field(default_factory=list)
    sources: Row = field(default_factory=dict)
    # name, column of P, row of Z, volts of 1
    charges: list[tuple[str, Row, Row, float]] = field(default_factory=list)
    starts: list[float] = field(default_factory=list)  # of the charges
    inputs: list[tuple[Row, Junction | None]] = field(default_factory=list)
    functions: list[Function] = field(default_factory=list)
    diodes: list[Diode] = field(default_factory=list)  # which also have a charge each
    switches: list[Switch] = field(default_factory=list)
    # of the unknowns that are currents: their elements
    owners: dict[int, str] = field(default_factory=dict)
    # how many diodes and functions there are then
    elements: dict[str, tuple[int, int]] = field(default_factory=dict)

    def node(self, name: str) -> int | None:
        """The number of a node's voltage; None for ground."""
        return None if name == "0" else self.unknowns.setdefault(name, len(self.unknowns))

    def branch(self, name: str) -> int:
        """The number of the current of an element."""
        index = self.unknowns.setdefault(f"i({name})", len(self.unknowns))
        self.owners[index] = name
        return index

    def across(self, a: str, b: str) -> Row:
        """The row of a voltage from a to b, which as a column is that of a current from a to b."""
        row: Row = {}
        for name, sign in ((a, 1.0), (b, -1.0)):
            if (index := self.node(name)) is not None:
                row[index] = row.get(index, 0.0) + sign
        return {k: v for k, v in row.items() if v != 0.0}

    def across_part(self, part: CircuitPart) -> Row:
        """The row of the voltage from a part's first node to its second."""
        first, second = part.nodes[:2]
        return self.across(first, second)

    def add(self, rows: Row, columns: Row, value: float = 1.0) -> None:
        """Add a product of a column of equations and a row of unknowns to G."""
        self.conductances.append((rows, columns, value))

    def add_leak(self, row: Row, value: float = GMIN) -> None:
        """Add a conductance (S) across a junction, which connects no nodes that the junction leaves apart."""
        self.conductances.append((row, row, value))
        self.leaks.append(row)

    def add_source(self, rows: Row, value: float) -> None:
        """Add constants to the right side."""
        for i, a in rows.items():
            self.sources[i] = self.sources.get(i, 0.0) + a * value

    def add_charge(
        self, name: str, column: Row, row: Row, volts: float, start: float = 0.0
    ) -> None:
        """Add a charge, or a flux, of which 1 is ``volts`` if its error is judged."""
        self.charges.append((name, column, row, volts))
        self.starts.append(start)

    def input(self, row: Row, junction: Junction | None = None) -> Node:
        """The leaf of an input, which is the same for the same row."""
        if (row, junction) not in self.inputs:
            self.inputs.append((row, junction))
        return input_of(self.inputs.index((row, junction)))

    def element_of(self, k: int) -> str:
        """The element of a function by its number: those of diodes come first."""
        of_diodes = k < len(self.diodes)
        count = k if of_diodes else k - len(self.diodes)
        return next(
            name for name, many in self.elements.items() if many[0 if of_diodes else 1] > count
        )

    @property
    def counts(self) -> tuple[Node, ...]:
        """The arguments of functions that count whole periods."""
        counts = dict[Node, None]()
        for function in self.functions:
            for node in sorted(function.tree.nodes, key=lambda node: node.key):
                if node.operation in COUNTING and not node.arguments[0].is_constant:
                    counts[node.arguments[0]] = None
                elif node.operation == "%":
                    counts[operation("/", *node.arguments)] = None
        return tuple(counts)

    @property
    def elastances(self) -> Floats:
        """1/C (1/F) of the charges of capacitors, shape (charges,).

        0 for the piezo, for inductors, and for capacitors whose voltage is counted: that of a clock
        grows for ever.
        """
        leaves = {
            node.index for count in self.counts for node in count.nodes if node.operation == "input"
        }
        counted = [self.inputs[index][0] for index in leaves]
        return np.array(
            [
                0.0
                if name == PIEZO or column in counted or self.owners.keys() & column.keys()
                else volts
                for name, column, _, volts in self.charges
            ]
        )

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return len(self.unknowns)

    def vectors(self, rows: Sequence[Row]) -> Floats:
        """Rows over all unknowns, shape (len(rows), size)."""
        matrix = np.zeros((len(rows), self.size))
        for k, row in enumerate(rows):
            for i, value in row.items():
                matrix[k, i] = value
        return matrix
