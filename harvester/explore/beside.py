"""Further facts of a design: how far one trajectory reached, and the supply of a chip or a node."""

import json
import math
from typing import Any

from harvester.equations.problem import Problem
from harvester.presentation.glossary import GLOSSARY, Term
from harvester.presentation.sheet import ERROR_OF, WholeError, with_error
from harvester.scene.scene import Scene
from harvester.storage.bought_parts import coil_quality
from harvester.uncertainty.value import amount

PACKETS = "packets per hour"  # this fact of a design is known once its node was followed


def of_path(scene: Scene, path: dict[str, Any]) -> dict[str, str]:
    """The largest displacement, voltage and, if the scene has it, strain of a path of `in_worker.path`."""
    length, volt = ("m", "V") if path["physical"] else ("", "")
    far, high = (max(map(abs, path[name])) for name in ("x", "V"))
    known = {"largest displacement": amount(far, length), "largest voltage": amount(high, volt)}
    strain = scene.piezo.strain_per_displacement if scene.piezo else None
    return known | (
        {} if strain is None else {"largest strain": f"{1e6 * strain * far:.4g} microstrain"}
    )


# A chip's parameters: the storage voltage at which its output begins and ends, and the output's.
_THRESHOLDS = {"Vrise": "output begins at", "Von": "output begins at", "Vfall": "output ends at"}
_THRESHOLDS |= {"Voff": "output ends at", "Vreg": "output voltage"}
# what is known of a chip's load, with others; see `harvester.storage.checked_mean.of_load`
CHIP = "load_on"


def of_chip(details: dict[str, float], values: dict[str, float]) -> list[tuple[str, str]]:
    """The rows of a chip: the results of engine `slow` for its load and store, and its thresholds in ``values``."""
    known = [
        (GLOSSARY[name], WholeError(details[name], _error_of(details, name)))
        for name in details
        if name.startswith(("load_on", "store_"))
    ]
    rows = [(term.label, _amount(term, value) + with_error(value, term)) for term, value in known]
    return rows + [
        (name, amount(values[key], "V")) for key, name in _THRESHOLDS.items() if key in values
    ]


def _error_of(details: dict[str, float], name: str) -> float:
    """The total error of a number; infinite if it is not known, which JSON has as null."""
    error = details.get(f"{ERROR_OF}{name}")
    return math.inf if error is None else error


def _amount(about: Term, number: WholeError) -> str:
    """The number with its unit, without its error."""
    if about.kind == "share":
        return f"{100.0 * number.value:.3g} %"
    return amount(number.value, about.kind)


def of_coil(problem: Problem) -> dict[str, str]:
    """How well the inductor of a scene's circuit rings with its piezo, if it has one: the basis of SSHI and SECE."""
    circuit = problem.circuit
    piezo = problem.scene.piezo
    quality = (
        coil_quality(circuit.values, problem.scene.modal.capacitance) if circuit and piezo else None
    )
    return {} if quality is None else {"quality of the inductor": f"{quality:.2g}"}


def sentence(path: dict[str, Any], sizes: dict[str, str]) -> str:
    """A path and its sizes in words."""
    hits = "" if path["impacts"] is None else f", {path['impacts']} impacts since rest"
    words = ", ".join(f"{name} {size}" for name, size in sizes.items())
    text = f"the last 12 periods of one trajectory by {path['engine']}{hits}: {words}; it is not a mean"
    return "; ".join((text, *path["not_drawn"]))


class Beside:
    """The known part of the designs that a page shows: the present one, and the pinned one."""

    def __init__(self) -> None:
        self._known: dict[str, dict[str, str]] = {}

    def of(self, tables: dict[str, Any]) -> dict[str, str]:
        """The known part of a design, by its name."""
        return self._known.get(_design(tables), {})

    def add(
        self, tables: dict[str, Any], facts: dict[str, str], pinned: dict[str, Any] | None
    ) -> None:
        """Keep facts of a design, and of others only those of the pinned one."""
        design = _design(tables)
        kept = None if pinned is None else _design(pinned)
        self._known = {name: known for name, known in self._known.items() if name in (design, kept)}
        self._known[design] = self._known.get(design, {}) | facts


def _design(tables: dict[str, Any]) -> str:
    """The identity of a design, but for its title."""
    return json.dumps(
        {name: entries for name, entries in tables.items() if name != "title"}, sort_keys=True
    )
