"""What a response has done so far: each frequency on its way, with the state that the next one goes on from.

They are in response.journal at once, a row each (`harvester.studies.sweep.journal`), until the files of the response
are whole; `--resume` takes them from there, and goes on from the last state as an undisturbed run would.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from harvester.errors import InputError
from harvester.presentation.diagnostic import Diagnostic
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.sweep.journal import Journal, JournalRow
from harvester.studies.sweep.same_study import JournalKind, identity

RESPONSE = JournalKind("response", ("scene_digest", "netlist", "sweep", "vary", "engines"))
MOST = 100_000  # steps of one curve by one engine

State = Mapping[str, Any]  # of what JSON knows, for each engine its own
Tick = Callable[[], None]


@dataclass(frozen=True)
class Step:
    """A frequency that is done: its point, its warnings, and the state to go on from (None: the next is from rest)."""

    point: ResponsePoint
    warnings: tuple[Diagnostic, ...] = ()
    state: State | None = None


_STEPS = TypeAdapter(Step)


def _nothing() -> None:
    """Tell nobody."""


@dataclass
class Steps:
    """The steps of one curve by one engine: those that an earlier run did, and where further ones go.

    ``tick`` is called after each that is computed, ``skip`` after each that was there.
    """

    done: dict[int, Step] = field(default_factory=dict)
    keep: Callable[[int, Step], None] = lambda number, step: None
    tick: Tick = _nothing
    skip: Tick = _nothing

    def earlier(self, number: int) -> Step | None:
        """The step of this number, if an earlier run did it."""
        step = self.done.get(number)
        if step is not None:
            self.skip()
        return step

    def add(self, number: int, step: Step | None) -> None:
        """Keep a step that was computed; None: it failed, and the next run tries it again."""
        if step is not None:
            self.keep(number, step)
        self.tick()


class Diary:
    """The steps of all curves of a response into a folder."""

    def __init__(self, journal: Journal, found: Sequence[JournalRow]) -> None:
        self.journal, self._found = journal, {(row.point, row.place): row for row in found}

    def steps(self, curve: int, place: int, engine: str, tick: Tick, skip: Tick) -> Steps:
        """Those of one curve, by the engine of this place among the engines.

        Raises InputError for a row that is not what this version writes.
        """

        def keep(number: int, step: Step) -> None:
            content = _STEPS.dump_json(step).decode()
            self.journal.add([JournalRow(curve * MOST + number, place, engine, content)])

        done = {
            point % MOST: self._step(row)
            for (point, where), row in self._found.items()
            if where == place and point // MOST == curve
        }
        return Steps(done, keep, tick, skip)

    def _step(self, row: JournalRow) -> Step:
        with as_written():
            step = _STEPS.validate_json(row.content)
        return dataclasses.replace(step, warnings=(*step.warnings, *row.warnings))


@contextmanager
def as_written() -> Iterator[None]:
    """Raise InputError where what is read from the journal is not what this version writes there."""
    try:
        yield
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError):  # pydantic's and NumPy's too
        raise InputError(
            f"`resume` must find {RESPONSE.file} as it was written, but a step in it is none of this version: remove it"
        ) from None


@contextmanager
def diary(out: Path, about: Mapping[str, Any], resume: bool, total: int) -> Iterator[Diary]:
    """The diary of the response that a provenance is ``about``, with ``total`` steps to keep; removed when all is done.

    Raises InputError where ``resume`` finds another response, or another program is at work in the folder;
    KeyboardInterrupt at ^C, with a text that says how to go on.
    """
    now = identity(about, RESPONSE)
    with closing(Journal(out, RESPONSE)) as journal:
        found = journal.earlier(now) if resume else None
        journal.begin(now, found or [])
        try:
            yield Diary(journal, found or [])
        except BaseException as error:
            done = journal.count()
            if not done:
                journal.remove()
            elif isinstance(error, KeyboardInterrupt):
                raise KeyboardInterrupt(
                    f"interrupted: {done} of {total} points are in {str(out)!r}; the same command with `resume` goes "
                    "on from there"
                ) from None
            raise
        journal.remove()
