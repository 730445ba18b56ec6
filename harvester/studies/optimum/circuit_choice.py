"""The best of several load circuits, each with the keys that suit it best."""

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import ClassVar

from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, SimulationError
from harvester.machine.execution import Execution
from harvester.netlists.load_circuit import load_circuit
from harvester.presentation.diagnostic import Diagnostic, has, note, warning
from harvester.presentation.table import Column, Table
from harvester.scene.load import Load, is_path
from harvester.scene.scene import Scene
from harvester.storage.bought_parts import coil_quality
from harvester.studies.optimum.optimum_result import Optimum
from harvester.studies.optimum.race import Race
from harvester.studies.optimum.ranges import NETLIST, Vary, varied
from harvester.studies.optimum.search import SearchRequest
from harvester.studies.output_folder import OutputFolder

UNLIKE = 1.5  # times the quality of the worst coil of several circuits, from which on they are not alike


class CircuitChoice(Optimum, kw_only=True):
    """The optimum of the circuit of most power, and those of the other circuits.

    ``best`` is the name of that circuit.  It is None where that cannot be said: the budget of a circuit of less power
    ended before its first scan did.  ``alike`` are circuits whose power cannot be told from that of the best: the
    intervals of both overlap.  ``unsound`` are those that cannot be compared, as their power has not settled, was cut
    off or has no known error, while that of another has.  ``table`` has a row for each circuit.

    Attributes
    ----------
    engine, keys, estimate, peaks, points, seconds, diagnostics, scanned
        those of the best circuit, as of `Optimum`.
    optima
        the `Optimum` of each circuit by its name, or the error where it has none.

    >>> import harvester as hv
    >>> scene = hv.load("examples/plate_bridge.toml")
    >>> hv.optimise(scene, vary={"load.netlist": ["bridge"], "load.parameters.R": ("100 kohm", "10 Mohm")})
    Traceback (most recent call last):
    harvester.errors.InputError: `vary` must be load.netlist=A,B,... with two circuits or more, but is ['bridge']
    """

    DERIVED: ClassVar[tuple[str, ...]] = ("best", "alike", "unfinished", "unscanned", "unsound", "circuits")
    NOT_SHOWN: ClassVar[frozenset[str]] = frozenset({"peaks", "scanned", "optima", *DERIVED[:-1]})
    NOT_IN_JSON: ClassVar[frozenset[str]] = frozenset({"peaks", "scanned", "circuits"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"optima": "circuits"}
    SHORT: ClassVar[tuple[str, ...]] = ("best", *Optimum.SHORT)

    optima: dict[str, Optimum | HarvesterError] = field(default_factory=dict)

    @classmethod
    def of(
        cls, optima: dict[str, Optimum | HarvesterError], seconds: float, said: tuple[Diagnostic, ...] = ()
    ) -> "CircuitChoice":
        """The choice between circuits, and what is ``said`` of all; raises the first error if none has an optimum."""
        found = _ranked(optima)
        if not found:
            raise next(one for one in optima.values() if isinstance(one, HarvesterError))
        top = next(iter(found.values()))
        fields = {one.name: getattr(top, one.name) for one in dataclasses.fields(Optimum)}
        choice = cls(**fields | {"seconds": seconds, "diagnostics": ()}, optima=optima)
        return dataclasses.replace(choice, diagnostics=(*choice._remarks(), *said))

    @property
    def found(self) -> dict[str, Optimum]:
        """The circuits that have an optimum, the one of most power first; those that are not sound last."""
        return _ranked(self.optima)

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
        near = [name for name, one in others if one.mean_power.value + one.mean_power.known_error95 >= low]
        return tuple(name for name in near if name not in self.unsound)

    @property
    def unfinished(self) -> tuple[str, ...]:
        """The circuits that may have more power than was found: the budget ended before their search did."""
        return tuple(name for name, one in self.found.items() if has(one.diagnostics, "budget_spent"))

    @property
    def unscanned(self) -> tuple[str, ...]:
        """The circuits of which the budget ended before the whole range was looked at."""
        return tuple(name for name, one in self.found.items() if not one.scanned)

    @property
    def unsound(self) -> tuple[str, ...]:
        """The circuits that cannot be compared with others that can."""
        (_, top), *others = self.found.items()
        return tuple(name for name, one in others if not one.estimate.is_sound) if top.estimate.is_sound else ()

    @property
    def circuits(self) -> Table:
        """A row a circuit, the one of most power first; as they were given where that cannot be said."""
        if self.best is None:
            return self._rows([*self.optima.items()])
        return self._rows([*self.found.items(), *(pair for pair in self.optima.items() if pair[0] not in self.found)])

    @property
    def table(self) -> Table:
        """A row a circuit, in the order that they were given."""
        rows, powers = [*self.optima.items()], [_optimum(one) for one in self.optima.values()]
        bias = Column("mean_power_bias", [None if one is None else one.mean_power.bias for one in powers])
        found = self._rows(rows)
        return dataclasses.replace(found, columns=(*found.columns[:-2], bias, *found.columns[-2:]))

    def _rows(self, some: Sequence[tuple[str, Optimum | HarvesterError]]) -> Table:
        optima = [_optimum(one) for _, one in some]
        columns = [Column(NETLIST, [name for name, _ in some])]
        for k, key in enumerate(self.keys):
            columns.append(Column(key.key, [None if one is None else one.keys[k].value for one in optima], key.unit))
        powers = [None if one is None else one.mean_power for one in optima]
        columns.append(Column("mean_power", powers, self.unit_names.power))
        columns.append(Column("search", [self._state(name, one) for name, one in some]))
        columns.append(Column("error", [str(one) if isinstance(one, HarvesterError) else "" for _, one in some]))
        return Table(tuple(columns), "largest mean power of each circuit")

    def _state(self, name: str, one: Optimum | HarvesterError) -> str:
        """How far the search of a circuit came."""
        if isinstance(one, HarvesterError):
            return "failed"
        if not one.scanned:
            return "scan cut short"
        if has(one.diagnostics, "ended_with_scan"):
            return "first scan only"
        return "cut short" if name in self.unfinished else "complete"

    def _remarks(self) -> list[Diagnostic]:
        """What is to be said of the choice, and of each circuit."""
        said = [note("best_circuit", best=self.best, alike=" and ".join(self.alike))]
        if self.best is None:
            said = [note("no_best_circuit", early=" and ".join(self.unscanned))]
        if self.unfinished:
            said.append(note("circuits_cut_short", names=" and ".join(self.unfinished)))
        unknown = dict.fromkeys(one.mean_power.unknown for one in self.found.values() if one.mean_power.unknown)
        said += [note("error_unknown", part=part) for part in unknown]
        said += [
            note("no_optimum", name, why=str(e)) for name, e in self.optima.items() if isinstance(e, HarvesterError)
        ]
        said += [warning("circuit_unsound", name) for name in self.unsound]
        return said + [word.of(name) for name, one in self.found.items() for word in one.warnings]


def _ranked(optima: Mapping[str, Optimum | HarvesterError]) -> dict[str, Optimum]:
    some = [(name, one) for name, one in optima.items() if isinstance(one, Optimum)]
    return dict(sorted(some, key=lambda pair: (not pair[1].estimate.is_sound, -pair[1].mean_power.value)))


def _optimum(one: Optimum | HarvesterError) -> Optimum | None:
    return one if isinstance(one, Optimum) else None


def best_circuit(
    scene: AnyScene,
    circuits: Sequence[str],
    vary: Vary,
    engine: Named | None,
    within: float | str,
    budget: float | str,
    execution: Execution,
) -> CircuitChoice:
    """Optimise each of several circuits over the keys by itself, and say which has the largest mean power.

    ``circuits`` are names of netlists or paths; the scene's parameters are taken over by those that have them.  All
    circuits together have the ``budget`` for each, and each a folder in that of the ``execution``, beside circuits.csv.
    First all are scanned alike (`harvester.studies.optimum.race`).

    Raises InputError for a circuit that there is not, and HarvesterError where none has an optimum, the first's error.
    """
    whole, begin = Problem.of(scene).scene, time.perf_counter()
    scenes = {name: _with(whole, name) for name in circuits}
    folder = None if execution.out is None else OutputFolder(execution.out, execution.formats)
    requests = {name: SearchRequest.of(one, vary, engine, within, budget) for name, one in scenes.items()}
    race, found = Race(requests, execution.progress), dict[str, Optimum | HarvesterError]()
    for name in race.order():
        inside = None if folder is None else OutputFolder(folder.path / Path(name).stem, execution.formats)
        try:
            found[name] = race.optimum(name, inside)
        except SimulationError as error:  # what the user asked is in order: this circuit has no answer
            found[name] = error
    optima = {name: found[name] for name in scenes}
    answer = CircuitChoice.of(optima, time.perf_counter() - begin, of_coils(scenes, vary))
    if folder is not None:
        folder.table("circuits", answer.table.csv())
    return answer


def of_coils(scenes: Mapping[str, Scene], vary: Vary) -> tuple[Diagnostic, ...]:
    """A warning where the coils of some circuits ring `UNLIKE` times as well as those of others, and none is varied."""
    if any(one.key.rpartition(".")[2] in ("L", "Rcoil", "Rcore") for one in varied(vary)[1]):
        return ()
    known: dict[str, float] = {}
    for name, scene in scenes.items():
        circuit = Problem(scene).circuit
        quality = coil_quality(circuit.values, scene.modal.capacitance) if circuit and scene.piezo else None
        known |= {} if quality is None else {name: quality}
    if not known or max(known.values()) < UNLIKE * min(known.values()):
        return ()
    return (warning("coils_differ", coils=", ".join(f"{name} {one:.2g}" for name, one in known.items())),)


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
