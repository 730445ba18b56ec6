"""A load circuit cut in two behind its rectifier, or with its storage capacitor held at a voltage.

The rectifier is made of the parts at the piezo's electrodes: diodes that lead to two nodes, the
rails. The circuit behind them sees the vibration through the rectifier's current alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harvester.circuits.idealised import ideal_bridge
from harvester.circuits.stamps import diode_law
from harvester.equations.scales import Scales
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.netlists.expression_tree import constant
from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.ltspice import inner_nodes
from harvester.netlists.part import CircuitPart

STORE, LOAD = "csmooth", "rload"
NO_LOAD = 1e15  # ohm
ELECTRODES = frozenset({"p", "0"})


@dataclass(frozen=True)
class Cut:
    """A circuit with its ``rectifier`` and the part ``behind`` its rails, the positive one first."""

    rectifier: tuple[CircuitPart, ...]
    behind: tuple[CircuitPart, ...]
    rails: tuple[str, str]

    @property
    def diode(self) -> tuple[float, float] | None:
        """Saturation current (A) and emission coefficient of the rectifier's diodes.

        None if they are not alike.
        """
        laws = {diode_law(part) for part in self.rectifier}
        return laws.pop() if len(laws) == 1 else None

    @property
    def like(self) -> tuple[float, float]:
        """The same of diodes alike that represent them all: the geometric mean of each."""
        saturation, emission = np.exp(
            np.log([diode_law(part) for part in self.rectifier]).mean(axis=0)
        )
        return float(saturation), float(emission)

    @property
    def leak(self) -> float | None:
        """Conductance (S) of resistors in parallel with storage capacitor and load.

        None if anything else is there.
        """
        more = [part for part in self.behind if part.name not in (STORE, LOAD)]
        across = set(self.rails)
        ohms = [part.effective_value for part in more if part.kind == "r"]
        if len(ohms) < len(more) or any(set(part.nodes) != across for part in more):
            return None
        if not all(ohm is not None and ohm > 0.0 for ohm in ohms):
            return None
        return sum(1.0 / ohm for ohm in ohms if ohm)

    def held(self, farads: float) -> list[CircuitPart]:
        """The rectifier with a capacitance between its rails that hardly changes its voltage."""
        return [
            *self.rectifier,
            _element(STORE, self.rails, farads),
            _element(LOAD, self.rails, NO_LOAD),
        ]

    def slow(self) -> list[CircuitPart]:
        """The circuit behind the rails, with the rails in place of the electrodes."""
        names = dict(zip(self.rails, ("p", "0"), strict=True))
        return [part.renamed(names) for part in self.behind]


def cut_behind_rectifier(load: LoadCircuit) -> Cut | None:
    """The circuit cut behind its rectifier.

    None if the parts at the electrodes are not a diode bridge.
    """
    parts = load.parts
    rectifier = tuple(part for part in parts if ELECTRODES & set(part.nodes))
    behind = tuple(part for part in parts if part not in rectifier)
    if [part.kind for part in rectifier] != 4 * ["d"]:
        return None
    # at cathodes, and at anodes
    positive, negative = _far_nodes(rectifier, 1), _far_nodes(rectifier, 0)
    seen = {node for part in behind for node in part.nodes_read}
    if (
        (len(positive), len(negative)) != (1, 1)
        or ELECTRODES & (positive | negative | seen)
        or positive == negative
    ):
        return None
    return Cut(rectifier, behind, (positive.pop(), negative.pop()))


def _far_nodes(diodes: Sequence[CircuitPart], end: int) -> set[str]:
    """The nodes at one end of the diodes whose other end is at an electrode."""
    return {diode.nodes[end] for diode in diodes if diode.nodes[1 - end] in ELECTRODES}


def with_store(
    parts: Sequence[CircuitPart], farads: float, ohm: float = NO_LOAD
) -> list[CircuitPart]:
    """The elements with another storage capacitor, and another load or none."""
    new = {STORE: farads, LOAD: ohm}
    return [
        _element(part.name, part.nodes, new[part.name]) if part.name in new else part
        for part in parts
    ]


def held_rectifier(load: LoadCircuit, farads: float) -> list[CircuitPart]:
    """The rectifier with storage of ``farads``, and no load: the circuit behind a chip's storage is left out."""
    cut = cut_behind_rectifier(load)
    return (
        with_store(load.parts, farads) if cut is None or is_plain_store(load) else cut.held(farads)
    )


def is_plain_store(load: LoadCircuit) -> bool:
    """Whether the load resistor is across the storage capacitor: then the storage voltage alone is slow."""
    nodes = {part.name: set(part.nodes) for part in load.parts if part.name in (STORE, LOAD)}
    return len(nodes) == 2 and nodes[STORE] == nodes[LOAD]


def is_lossy_store(load: LoadCircuit) -> bool:
    """Whether the storage capacitor is across the load but for the parts of its keys Rser and Lser."""
    outer = inner_nodes(load.parts)
    store = {outer.get(node, node) for node in load.smoothing_nodes}
    return bool(outer) and any(
        part.name == LOAD and set(part.nodes) == store for part in load.parts
    )


def plain_bridge(load: LoadCircuit, scales: Scales) -> IdealCircuit | None:
    """The ideal circuit of a bridge of four diodes alike with storage and the load across it.

    None of anything else.

    Raises InputError for elements that no compiled circuit has.
    """
    cut = cut_behind_rectifier(load)
    if cut is None or cut.diode is None or load.smoothing is None or load.storage is None:
        return None
    rails = set(cut.rails)
    if {part.name: set(part.nodes) for part in cut.behind} != {
        STORE: rails,
        LOAD: rails,
    } or load.storage <= 0.0:
        return None
    kappa = load.smoothing / scales.capacitance
    saturation, emission = cut.diode
    return ideal_bridge(saturation, emission, scales)._replace(
        kappa=kappa, mu=kappa / (load.storage * scales.frequency)
    )


def _element(name: str, nodes: Sequence[str], value: float) -> CircuitPart:
    return CircuitPart(name, (nodes[0], nodes[1]), constant(value), kind=name[0])
