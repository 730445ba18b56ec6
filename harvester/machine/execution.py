"""How a study is carried out, apart from its computation: by whom, into which folder, and with which reports."""

import dataclasses
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harvester.errors import InputError, invalid, names_arguments
from harvester.machine import files
from harvester.machine.automatic import AUTOMATIC, called
from harvester.machine.progress import NO_PROGRESS, Progress, working

MOST_WORKERS = 1000


@names_arguments
@dataclass(frozen=True)
class Execution:
    """How a study is carried out; none of it changes the answers.

    Parameters
    ----------
    workers : int, optional
        processes of this machine; None: one a core if there is work for them; 1: this one alone.
    executor : Executor
        one that computes in their place: from `concurrent.futures`, or the ``Client`` of a Dask
        scheduler.
    resume : bool, default False
        keep the rows of an earlier run of the same study in the folder ``out``.
    out : path, optional
        the folder for the files of the study; without it nothing is written.
    formats : sequence of str
        forms of its figures in addition to .png: "svg", "pdf".
    progress : Progress or bool, optional
        is reported how far the study is: an object with the methods ``start()``, ``step(fraction,
        what)`` and ``close()``.  By default (also None and True) a bar on a terminal or in a
        notebook, if the study lasts longer than a second; False: none.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Execution(out="sweep", resume=True).workers is None
    True

    Raises
    ------
    InputError
        for a number of workers that no machine has, workers next to an executor, another form of
        figures, a progress without those methods, and options without an effect without ``out``.
    """

    workers: int | None = None
    executor: Executor | Any = None
    resume: bool = False
    out: str | Path | None = None
    formats: Sequence[str] = ()
    progress: Progress | Any = AUTOMATIC

    def __post_init__(self) -> None:
        if self.workers is not None and not 1 <= self.workers <= MOST_WORKERS:
            raise invalid("`workers`", f"be between 1 and {MOST_WORKERS}", self.workers)
        if self.workers is not None and self.executor is not None:
            raise InputError(
                "`workers` must be left out if an `executor` is given, but both are given"
            )
        object.__setattr__(self, "progress", _listener(self.progress))
        files.check_vector(self.formats, "formats")
        for name in ("resume", "formats"):
            if getattr(self, name) and self.out is None:
                raise InputError(
                    f"`{name}` must be used with `out`, the folder of the study, but there is none"
                )

    def only(self, study: str, *names: str) -> None:
        """Raise InputError for anything given that would have no effect on a study with these options."""
        for field in dataclasses.fields(self):
            if field.name not in names and getattr(self, field.name) not in (
                field.default,
                NO_PROGRESS,
            ):
                takes = ", ".join(f"`{name}`" for name in names)
                raise InputError(
                    f"the execution of {study} must have only {takes}, but has `{field.name}`"
                )


def _listener(progress: Any) -> Progress:
    """The listener that a caller names; InputError for anything else."""
    if progress is None or isinstance(progress, bool):
        return NO_PROGRESS if progress is False else AUTOMATIC
    if not all(callable(getattr(progress, name, None)) for name in ("start", "step", "close")):
        must = "be True, False or an object with the methods start, step and close"
        raise invalid("`progress` of an execution", must, progress)
    return progress  # type: ignore[no-any-return]


DEFAULT = Execution()


@contextmanager
def working_on(study: str, execution: Execution) -> Iterator[Progress]:
    """The progress of a study, begun and in the end closed; a bar has the name of the study."""
    with called(study), working(execution.progress) as progress:
        yield progress
