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

# times the quality of the worst inductor of several circuits, from which on they are not alike
UNLIKE = 1.5


class CircuitChoice(Optimum, kw_only=True):
    """The optimum of the circuit of most power, and those of the other circuits.

    ``best`` is the name of that circuit.  It is None if that is not known: the budget of a
    circuit of less power ended before its first scan did.  ``alike`` are circuits whose power
    cannot be distinguished from that of the best: the intervals of both overlap.  ``unsound`` are
    those that cannot be compared, as their power has not settled, was cut off or has no known
    error, while that of another has.  ``table`` has a row for each circuit.

    Attributes
    ----------
    engine, keys, estimate, peaks, points, seconds, diagnostics, scanned : see Optimum
        those of the best circuit, as of `Optimum`.
    optima : dict
        the `Optimum` of each circuit by its name, or the error if it has none.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.load("examples/plate_bridge.toml")
    >>> hv.optimise(scene, vary={"load.netlist": ["bridge"], "load.parameters.R": ("100 kohm", "10 Mohm")})
    Traceback (most recent call last):
    harvester.errors.InputError: `vary` must be load.netlist=A,B,... with two circuits or more, but is ['bridge']
    """

    DERIVED = ("best", "alike", "unfinished", "unscanned", "unsound", "circuits")
    NOT_SHOWN = frozenset({"peaks", "scanned", "optima", *DERIVED[:-1]})
    NOT_IN_JSON = frozenset({"peaks", "scanned", "circuits"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"optima": "circuits"}
    SHORT = ("best", *Optimum.SHORT)

    optima: dict[str, Optimum | HarvesterError] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        optima: dict[str, Optimum | HarvesterError],
        seconds: float,
        remarks: tuple[Diagnostic, ...] = (),
    ) -> "CircuitChoice":
        """The choice between circuits, with ``remarks`` on all.

        Raises the first error if none has an optimum.
        """
        ranked = _ranked(optima)
        if not ranked:
            raise next(answer for answer in optima.values() if isinstance(answer, HarvesterError))
        top = next(iter(ranked.values()))
        fields = {f.name: getattr(top, f.name) for f in dataclasses.fields(Optimum)}
        choice = cls(**fields | {"seconds": seconds, "diagnostics": ()}, optima=optima)
        return dataclasses.replace(choice, diagnostics=(*choice._remarks(), *remarks))

    @property
    def ranked(self) -> dict[str, Optimum]:
        """The circuits that have an optimum, the one of most power first.

        Those that are not sound last.
        """
        return _ranked(self.optima)

    @property
    def best(self) -> str | None:
        """The circuit of most power.

        None if a circuit of less power may have more: its range was not scanned.
        """
        first, *others = self.ranked
        return None if any(name in self.unscanned for name in others) else first

    @property
    def alike(self) -> tuple[str, ...]:
        """The circuits whose power cannot be distinguished from that of the best."""
        (_, top), *others = self.ranked.items()
        low = top.mean_power.value - top.mean_power.known_error95
        near = [
            name
            for name, optimum in others
            if optimum.mean_power.value + optimum.mean_power.known_error95 >= low
        ]
        return tuple(name for name in near if name not in self.unsound)

    @property
    def unfinished(self) -> tuple[str, ...]:
        """The circuits that may have more power than was found: the budget ended before their search did."""
        return tuple(
            name
            for name, optimum in self.ranked.items()
            if has(optimum.diagnostics, "budget_spent")
        )

    @property
    def unscanned(self) -> tuple[str, ...]:
        """The circuits of which the budget ended before the whole range was looked at."""
        return tuple(name for name, optimum in self.ranked.items() if not optimum.scanned)

    @property
    def unsound(self) -> tuple[str, ...]:
        """The circuits that cannot be compared with others that can."""
        (_, top), *others = self.ranked.items()
        return (
            tuple(name for name, optimum in others if not optimum.estimate.is_sound)
            if top.estimate.is_sound
            else ()
        )

    @property
    def circuits(self) -> Table:
        """A row a circuit, the one of most power first; as they were given if that is not known."""
        if self.best is None:
            return self._rows([*self.optima.items()])
        return self._rows(
            [
                *self.ranked.items(),
                *(pair for pair in self.optima.items() if pair[0] not in self.ranked),
            ]
        )

    @property
    def table(self) -> Table:
        """A row a circuit, in the order that they were given."""
        return self._rows([*self.optima.items()])

    def _rows(self, rows: Sequence[tuple[str, Optimum | HarvesterError]]) -> Table:
        optima = [_optimum(answer) for _, answer in rows]
        columns = [Column(NETLIST, [name for name, _ in rows])]
        for k, key in enumerate(self.keys):
            columns.append(
                Column(key.key, [None if o is None else o.keys[k].value for o in optima], key.unit)
            )
        powers = [None if o is None else o.mean_power for o in optima]
        columns.append(Column("mean_power", powers, self.unit_names.power))
        columns.append(Column("search", [self._state(name, a) for name, a in rows]))
        columns.append(
            Column("error", [str(a) if isinstance(a, HarvesterError) else "" for _, a in rows])
        )
        return Table(tuple(columns), "largest mean power of each circuit")

    def _state(self, name: str, answer: Optimum | HarvesterError) -> str:
        """How far the search of a circuit came."""
        if isinstance(answer, HarvesterError):
            return "failed"
        if not answer.scanned:
            return "scan cut short"
        if has(answer.diagnostics, "ended_with_scan"):
            return "first scan only"
        return "cut short" if name in self.unfinished else "complete"

    def _remarks(self) -> list[Diagnostic]:
        """The remarks on the choice, and of each circuit."""
        remarks = [note("best_circuit", best=self.best, alike=" and ".join(self.alike))]
        if self.best is None:
            remarks = [note("no_best_circuit", early=" and ".join(self.unscanned))]
        if self.unfinished:
            remarks.append(note("circuits_cut_short", names=" and ".join(self.unfinished)))
        unknown = dict.fromkeys(
            o.mean_power.unknown for o in self.ranked.values() if o.mean_power.unknown
        )
        remarks += [note("error_unknown", part=part) for part in unknown]
        failed = (
            (name, answer)
            for name, answer in self.optima.items()
            if isinstance(answer, HarvesterError)
        )
        remarks += [note("no_optimum", name, why=str(error)) for name, error in failed]
        remarks += [warning("circuit_unsound", name) for name in self.unsound]
        return remarks + [
            word.of(name) for name, optimum in self.ranked.items() for word in optimum.warnings
        ]


def _ranked(optima: Mapping[str, Optimum | HarvesterError]) -> dict[str, Optimum]:
    pairs = [(name, answer) for name, answer in optima.items() if isinstance(answer, Optimum)]
    return dict(
        sorted(pairs, key=lambda pair: (not pair[1].estimate.is_sound, -pair[1].mean_power.value))
    )


def _optimum(answer: Optimum | HarvesterError) -> Optimum | None:
    return answer if isinstance(answer, Optimum) else None


def best_circuit(
    scene: AnyScene,
    circuits: Sequence[str],
    vary: Vary,
    engine: Named | None,
    within: float | str,
    budget: float | str,
    execution: Execution,
) -> CircuitChoice:
    """Optimise each of several circuits over the keys by itself, and name the one that has the largest mean power.

    ``circuits`` are names of netlists or paths; the scene's parameters are passed to those that
    have them.  All circuits together have the ``budget`` for each, and each a folder in that of the
    ``execution``, next to circuits.csv. First all are scanned alike
    (`harvester.studies.optimum.race`).

    Raises InputError for a circuit that there is not, and HarvesterError if none has an optimum,
    the first's error.
    """
    base = Problem.of(scene).scene
    begin = time.perf_counter()
    scenes = {name: _with(base, name) for name in circuits}
    folder = OutputFolder.of(execution)
    requests = {
        name: SearchRequest.of(scene, vary, engine, within, budget)
        for name, scene in scenes.items()
    }
    race = Race(requests, execution.progress)
    answers = dict[str, Optimum | HarvesterError]()
    for name in race.order():
        inside = (
            None
            if folder is None
            else OutputFolder(folder.path / Path(name).stem, execution.formats)
        )
        try:
            answers[name] = race.optimum(name, inside)
        except (
            SimulationError
        ) as error:  # what the user asked is in order: this circuit has no answer
            answers[name] = error
    optima = {name: answers[name] for name in scenes}
    answer = CircuitChoice.of(optima, time.perf_counter() - begin, compare_coils(scenes, vary))
    if folder is not None:
        folder.table("circuits", answer.table.csv())
    return answer


def compare_coils(scenes: Mapping[str, Scene], vary: Vary) -> tuple[Diagnostic, ...]:
    """Warning if the inductors of some circuits ring `UNLIKE` times as well as those of others, and none is varied."""
    if any(r.key.rpartition(".")[2] in ("L", "Rcoil", "Rcore") for r in varied(vary)[1]):
        return ()
    known: dict[str, float] = {}
    for name, scene in scenes.items():
        circuit = Problem(scene).circuit
        quality = (
            coil_quality(circuit.values, scene.modal.capacitance)
            if circuit and scene.piezo
            else None
        )
        known |= {} if quality is None else {name: quality}
    if not known or max(known.values()) < UNLIKE * min(known.values()):
        return ()
    return (
        warning(
            "coils_differ",
            coils=", ".join(f"{name} {quality:.2g}" for name, quality in known.items()),
        ),
    )


def _with(scene: Scene, name: str) -> Scene:
    """The scene with a circuit, and those of its parameters that the circuit has."""
    given = scene.load.parameters if scene.load is not None else {}
    capacitance = None if scene.piezo is None else scene.piezo.capacitance
    if not is_path(name):
        known = {key.lower() for key in load_circuit(Load(netlist=name), capacitance).values}
        given = {key: value for key, value in given.items() if key.lower() in known}
    changed = dataclasses.replace(scene, load=Load(netlist=name, parameters=given))
    Problem(changed).circuit  # noqa: B018 refuses a circuit that cannot be used
    return changed
