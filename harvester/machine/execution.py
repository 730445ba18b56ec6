"""How a study is carried out, apart from what it computes: by whom, into which folder, and who is reported of it."""

import dataclasses
import functools
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from harvester.errors import InputError, invalid, names_arguments
from harvester.machine import files
from harvester.machine.progress import NO_PROGRESS, CallingBack, Progress

MOST_WORKERS = 1000
Study = TypeVar("Study", bound=Callable[..., Any])


@names_arguments
@dataclass(frozen=True)
class Execution:
    """How a study is carried out; none of it changes the answers.

    Parameters
    ----------
    workers
        processes of this machine; None: one a core if there is work for them; 1: this one alone.
    executor
        one that computes in their place: of `concurrent.futures`, or the ``Client`` of a Dask
        scheduler.
    resume
        keep what an earlier run of the same study left in the folder ``out``.
    out
        the folder for the files of the study; without it nothing is written.
    formats
        forms of its figures in addition to .png: "svg", "pdf".
    progress
        is reported how far the study is: an object with the methods ``start()``, ``step(fraction,
        what)`` and ``close()``.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Execution(out="sweep", resume=True).workers is None
    True

    Raises
    ------
    InputError
        for a number of workers that no machine has, workers next to an executor, another form of
        figures, and what would do nothing without ``out``.
    """

    workers: int | None = None
    executor: Executor | Any = None
    resume: bool = False
    out: str | Path | None = None
    formats: Sequence[str] = ()
    progress: Progress = NO_PROGRESS

    def __post_init__(self) -> None:
        if self.workers is not None and not 1 <= self.workers <= MOST_WORKERS:
            raise invalid("`workers`", f"be between 1 and {MOST_WORKERS}", self.workers)
        if self.workers is not None and self.executor is not None:
            raise InputError(
                "`workers` must be left out where an `executor` is given, but both are given"
            )
        files.check_vector(self.formats, "formats")
        for name in ("resume", "formats"):
            if getattr(self, name) and self.out is None:
                raise InputError(
                    f"`{name}` must go with `out`, the folder of the study, but there is none"
                )

    def only(self, study: str, *names: str) -> None:
        """Raise InputError for what is given, but would do nothing for a study that takes no more than these."""
        for field in dataclasses.fields(self):
            if field.name not in names and getattr(self, field.name) != field.default:
                takes = ", ".join(f"`{name}`" for name in names)
                raise InputError(
                    f"the execution of {study} must have {takes} only, but has `{field.name}`"
                )


DEFAULT = Execution()
# Keywords of studies in version 0.1, and what they are now.
_FIELDS = {"workers": "workers", "resume": "resume", "out": "out", "vector": "formats"}


def calls_with_name(report: Callable[[str], object]) -> Progress:
    """The progress of a function ``report``, a ``tick`` of version 0.1 that was called with a name."""
    return CallingBack(lambda _, what: report(what))


def calls_with_fraction(report: Callable[[float], object]) -> Progress:
    """The progress of a function ``report``, a ``tick`` of version 0.1 that was called with the fraction done."""
    return CallingBack(lambda done, _: report(done))


def as_in_version_0_1(
    *positional: str,
    adapter: Callable[[Any], Progress] = CallingBack,
    executes: bool = True,
    **renamed: str,
) -> Callable[[Study], Study]:
    """Let a study be called as in version 0.1, with a DeprecationWarning.

    ``positional`` are the names of the arguments behind the first that could be given without a keyword, ``renamed``
    the names of today of keywords that had another.  With
    ``executes`` the fields of `Execution` may be keywords of the study's own; ``adapter`` makes the `Progress` of the
    function that was the keyword ``tick`` or ``progress``.
    """

    def decorated(study: Study) -> Study:
        name = study.__name__

        @functools.wraps(study)
        def called(first: Any, *others: Any, **options: Any) -> Any:
            if len(others) > len(positional):
                raise InputError(
                    f"{name} must have at most {1 + len(positional)} arguments without a name"
                )
            if others:
                given = dict(zip(positional, others, strict=False))
                _warn(f"{name} takes {', '.join(f'`{key}`' for key in given)} by keyword only", 3)
                options = given | options
            for old in options.keys() & renamed.keys():
                _warn(f"{name} takes `{old}` as `{renamed[old]}`", 3)
                options[renamed[old]] = options.pop(old)
            if executes:
                options = _with_execution(name, options, adapter)
            return study(first, **options)

        return called  # type: ignore[return-value]

    return decorated


def _with_execution(
    name: str, options: dict[str, Any], adapter: Callable[[Any], Progress]
) -> dict[str, Any]:
    """The options with those in an `Execution` that were keywords of their own."""
    fields = {_FIELDS[key]: options.pop(key) for key in _FIELDS if key in options}
    for key in ("tick", "progress"):
        if key in options and (report := options.pop(key)) is not None:
            fields["progress"] = report if hasattr(report, "step") else adapter(report)
    if not fields:
        return options
    _warn(
        f"{name} takes {', '.join(f'`{key}`' for key in fields)} in execution=hv.Execution(...)", 4
    )
    if "execution" in options:
        raise InputError(
            f"{name} must have `{next(iter(fields))}` in its `execution`, but has it beside that"
        )
    return options | {"execution": Execution(**fields)}


def _warn(text: str, stacklevel: int) -> None:
    warnings.warn(f"{text} from version 0.3 on", DeprecationWarning, stacklevel=stacklevel)
