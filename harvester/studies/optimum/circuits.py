"""The best of several load circuits, each with the keys that suit it best."""

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError, SimulationError, names_arguments
from harvester.netlists.load_circuit import load_circuit
from harvester.presentation.columns import columns
from harvester.scene.load import Load, is_path
from harvester.scene.scene import Scene
from harvester.studies.optimum.answer import Optimum
from harvester.studies.optimum.evaluations import Tick
from harvester.studies.optimum.optimise import prepared
from harvester.studies.optimum.race import ENDED, Race
from harvester.studies.optimum.ranges import Range
from harvester.studies.optimum.sampled_search import SPENT
from harvester.studies.output_folder import OutputFolder, csv_text

KEY = "load.netlist"


@names_arguments
@dataclass(frozen=True)
class CircuitChoice:
    """The optimum of each circuit by its name, or the error where it has none; ``best`` is the one of most power.

    ``best`` is None where that cannot be said: the budget of a circuit of less power ended before its first scan did.

    ``alike`` are circuits whose power cannot be told from that of the best: the intervals of both overlap.

    >>> import harvester as hv
    >>> scene = hv.load("examples/plate_bridge.toml")
    >>> over = {"load.parameters.R": ("100 kohm", "10 Mohm")}
    >>> hv.optimise_circuits(scene, ["bridge"], over, "ideal")
    Traceback (most recent call last):
    harvester.errors.InputError: `circuits` must be two or more different ones, but is ['bridge']
    """

    optima: dict[str, Optimum | HarvesterError]
    seconds: float

    @property
    def found(self) -> dict[str, Optimum]:
        """The circuits that have an optimum, the one of most power first."""
        some = [(name, one) for name, one in self.optima.items() if isinstance(one, Optimum)]
        return dict(sorted(some, key=lambda pair: -pair[1].mean_power.value))

    @property
    def best(self) -> str | None:
        """The circuit of most power; None where a circuit of less power may have more: its range was not scanned."""
        first, *others = self.found
        return None if any(name in self.unscanned for name in others) else first

    @property
    def alike(self) -> tuple[str, ...]:
        """The circuits whose power cannot be told from that of the best."""
        (_, top), *others = self.found.items()
        low = top.mean_power.value - top.mean_power.known_error95
        return tuple(n for n, one in others if one.mean_power.value + one.mean_power.known_error95 >= low)

    @property
    def unfinished(self) -> tuple[str, ...]:
        """The circuits that may have more power than was found: the budget ended before their search did."""
        return tuple(n for n, one in self.found.items() if any(word.startswith(SPENT) for word in one.warnings))

    @property
    def unscanned(self) -> tuple[str, ...]:
        """The circuits of which the budget ended before the whole range was looked at."""
        return tuple(name for name, one in self.found.items() if not one.scanned)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        circuits = {n: one.as_json() if isinstance(one, Optimum) else str(one) for n, one in self.optima.items()}
        return {
            "best": self.best,
            "alike": list(self.alike),
            "unfinished": list(self.unfinished),
            "unscanned": list(self.unscanned),
            "circuits": circuits,
            "seconds": self.seconds,
        }

    def __str__(self) -> str:
        unit = next(iter(self.found.values())).estimate.unit_names.power
        unknown = dict.fromkeys(one.mean_power.unknown for one in self.found.values() if one.mean_power.unknown)
        notes = [f"  note: the error of {part} is not known" for part in unknown]
        rows = [[KEY, "largest mean power", "keys there"]]
        for name, one in self.found.items():
            power = dataclasses.replace(one.mean_power, unknown="")  # which a note says once
            rows.append([name, power.format(unit), "; ".join(f"{k.range.key} = {k}" for k in one.keys)])
        failed = [f"  no optimum of {name}: {e}" for name, e in self.optima.items() if isinstance(e, HarvesterError)]
        warned = [f"  warning: {name}: {word}" for name, one in self.found.items() for word in one.warnings]
        if self.best is None:
            early = " and ".join(self.unscanned)
            said = f"no best circuit: the budget ended before the first scan of {early} did"
        else:
            same = f", which cannot be told from {' and '.join(self.alike)}" if self.alike else ""
            said = f"the best circuit is {self.best}{same}"
        cut = f"; the search of {' and '.join(self.unfinished)} was cut short" if self.unfinished else ""
        lines = [f"{self.seconds:.2g} s; {said}{cut}"]
        return "\n".join([*lines, *(f"  {row}" for row in columns(rows, "  ")), *notes, *failed, *warned])

    def text(self) -> str:
        """The CSV file: a row a circuit, in the order that they were given."""
        keys = [key.range.key for key in next(iter(self.found.values())).keys]
        powers = ["mean_power", "mean_power_stderr", "mean_power_bias", "mean_power_error95"]
        heads = [KEY, *keys, *powers, "search", "error"]
        rows: list[list[object]] = []
        for name, one in self.optima.items():
            if isinstance(one, Optimum):
                power = one.mean_power
                search = "cut short" if name in self.unfinished else "complete"
                search = "first scan only" if any(word.startswith(ENDED) for word in one.warnings) else search
                search = search if one.scanned else "scan cut short"
                errors = power.stderr, power.bias, power.error95
                rows.append([name, *(key.value for key in one.keys), power.value, *errors, search, ""])
            else:
                rows.append([name, *([None] * (len(keys) + len(powers))), "failed", str(one)])
        return csv_text(heads, rows)


@names_arguments
def optimise_circuits(
    scene: AnyScene,
    circuits: Sequence[str],
    over: Sequence[Range] | Mapping[str, tuple[float | str, float | str]],
    engine: Named | None = None,
    within: float | str = 0.01,
    budget: float | str = 60.0,
    out: str | Path | None = None,
    tick: Tick | None = None,
    vector: Sequence[str] = (),
) -> CircuitChoice:
    """Optimise each of several circuits over the keys by itself, and say which has the largest mean power.

    ``circuits`` are names of netlists or paths; the scene's parameters are taken over by those that have them.  The
    other arguments are those of `harvester.optimise`; all circuits together have the ``budget`` for each, and each a
    folder in ``out``, beside circuits.csv.  First all are scanned alike (`harvester.studies.optimum.race`).

    >>> import harvester as hv
    >>> hv.optimise_circuits(hv.load("examples/plate_bridge.toml"), ["bridge", "sec"], {})
    Traceback (most recent call last):
    harvester.errors.InputError: unknown netlist 'sec': did you mean 'sece'?

    Raises
    ------
    InputError
        for fewer than two circuits, one that there is not, and as `harvester.optimise`.
    HarvesterError
        where no circuit has an optimum, the last error.
    """
    whole = Problem.of(scene).scene
    if isinstance(circuits, str) or len(set(circuits)) < max(2, len(circuits)):
        raise InputError(f"`circuits` must be two or more different ones, but is {circuits!r}")
    scenes = {name: _with(whole, name) for name in circuits}
    folder = None if out is None else OutputFolder(out, vector)
    begin, found = time.perf_counter(), dict[str, Optimum | HarvesterError]()
    asked = {name: prepared(one, over, engine, within, budget) for name, one in scenes.items()}
    race = Race(asked, tick)
    for name in race.order():
        inside = None if folder is None else OutputFolder(folder.path / Path(name).stem, vector)
        try:
            found[name] = race.optimum(name, inside)
        except SimulationError as error:  # what the user asked is in order: this circuit has no answer
            found[name] = error
    found = {name: found[name] for name in scenes}
    if not any(isinstance(one, Optimum) for one in found.values()):
        raise next(one for one in found.values() if isinstance(one, HarvesterError))
    answer = CircuitChoice(found, time.perf_counter() - begin)
    if folder is not None:
        folder.table("circuits", answer.text())
    return answer


def _with(scene: Scene, name: str) -> Scene:
    """The scene with a circuit, and those of its parameters that the circuit has."""
    given = scene.load.parameters if scene.load is not None else {}
    capacitance = None if scene.piezo is None else scene.piezo.capacitance
    if not is_path(name):
        known = {one.lower() for one in load_circuit(Load(netlist=name), capacitance).values}
        given = {key: value for key, value in given.items() if key.lower() in known}
    changed = dataclasses.replace(scene, load=Load(netlist=name, parameters=given))
    Problem(changed).circuit  # noqa: B018 refuses a circuit that cannot be used
    return changed
