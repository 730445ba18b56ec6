"""The finished steps of a response: each frequency, with the state from which the next one begins.

They are in response.journal at once, a row each (`harvester.studies.sweep.journal`), until the
files of the response are whole; `--resume` reads them from there, and continues from the last state
as an undisturbed run would.
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
Callback = Callable[[], None]


@dataclass(frozen=True)
class Step:
    """A frequency that is done: its point, its warnings, and its state for the next (None: the next is from rest)."""

    point: ResponsePoint
    warnings: tuple[Diagnostic, ...] = ()
    state: State | None = None


_STEPS = TypeAdapter(Step)


@dataclass
class Steps:
    """The steps of one curve by one engine: those of an earlier run, and the place of further ones.

    ``on_computed`` is called after each that is computed, ``on_reused`` after each that was there.
    """

    done: dict[int, Step] = field(default_factory=dict)
    keep: Callable[[int, Step], None] = lambda number, step: None
    on_computed: Callback = lambda: None
    on_reused: Callback = lambda: None

    def earlier(self, number: int) -> Step | None:
        """The step of this number, if an earlier run did it."""
        step = self.done.get(number)
        if step is not None:
            self.on_reused()
        return step

    def add(self, number: int, step: Step | None) -> None:
        """Keep a step that was computed; None: it failed, and the next run tries it again."""
        if step is not None:
            self.keep(number, step)
        self.on_computed()


class ResponseJournal:
    """The steps of all curves of a response into a folder."""

    def __init__(self, journal: Journal, rows: Sequence[JournalRow]) -> None:
        self.journal = journal
        self._rows = {(row.point, row.engine_index): row for row in rows}

    def steps(
        self, curve: int, engine_index: int, engine: str, on_computed: Callback, on_reused: Callback
    ) -> Steps:
        """Those of one curve, by the engine of this index among the engines.

        Raises InputError for a row of another version.
        """

        def keep(number: int, step: Step) -> None:
            content = _STEPS.dump_json(step).decode()
            self.journal.add([JournalRow(curve * MOST + number, engine_index, engine, content)])

        done = {
            point % MOST: self._step(row)
            for (point, index), row in self._rows.items()
            if index == engine_index and point // MOST == curve
        }
        return Steps(done, keep, on_computed, on_reused)

    def _step(self, row: JournalRow) -> Step:
        with as_written():
            step = _STEPS.validate_json(row.content)
        return dataclasses.replace(step, warnings=(*step.warnings, *row.warnings))


@contextmanager
def as_written() -> Iterator[None]:
    """Raise InputError if the journal was written by another version."""
    try:
        yield
    except (
        ValueError,
        TypeError,
        KeyError,
        AttributeError,
        OverflowError,
    ):  # pydantic's and NumPy's too
        raise InputError(
            f"`resume` must find {RESPONSE.file} as it was written, but a step in it is of another version: remove it"
        ) from None


@contextmanager
def response_journal(
    out: Path, about: Mapping[str, Any], resume: bool, total: int
) -> Iterator[ResponseJournal]:
    """The journal of the response with the provenance ``about`` and ``total`` steps.

    It is removed when all are done.

    Raises InputError if ``resume`` finds another response, or another program is at work in the
    folder; KeyboardInterrupt at ^C, with a text that states how to continue.
    """
    now = identity(about, RESPONSE)
    with closing(Journal(out, RESPONSE)) as journal:
        rows = journal.earlier(now) if resume else None
        journal.begin(now, rows or [])
        try:
            yield ResponseJournal(journal, rows or [])
        except BaseException as error:
            if not journal.count():
                journal.remove()
            elif isinstance(error, KeyboardInterrupt):
                raise journal.interrupted(f"{total} points") from None
            raise
        journal.remove()
