"""The named errors.  Each prints as one line; the command line maps them to its exit status."""

import difflib
import errno
import functools
import inspect
import re
import reprlib
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from numbers import Integral
from pathlib import Path
from typing import Any, TypeVar, get_args

T = TypeVar("T", bound=Callable[..., Any])
Of = TypeVar("Of")
Answer = TypeVar("Answer")


class HarvesterError(Exception):
    """Base of all errors that this package raises on purpose.

    Examples
    --------
    >>> import harvester as hv
    >>> issubclass(hv.InputError, hv.HarvesterError), hv.HarvesterError.exit_status
    (True, 3)
    """

    exit_status = 3


class InputError(HarvesterError, ValueError):
    """The user's input cannot be used: one line with the argument, the requirement, and the given value.

    It is a ValueError as well, so that code which knows nothing of this package catches it.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Piezo(coupling="1e-3 N/V", capacitance="50 kg")
    Traceback (most recent call last):
    harvester.errors.InputError: piezo.capacitance must be a clamped capacitance (F), such as ...
    """

    exit_status = 2


class UnknownArgumentError(InputError, TypeError):
    """A function was called with a keyword that it does not accept.

    It is a TypeError, as Python's own answer would be.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.sweep("scene.toml", vari={"load.resistance": [1e3]})
    Traceback (most recent call last):
    harvester.errors.UnknownArgumentError: unknown argument of sweep 'vari': did you mean 'vary'?
    """


class MissingProgramError(InputError):
    """Something that the request needs is not installed (ngspice).

    Examples
    --------
    >>> import harvester as hv
    >>> hv.MissingProgramError.exit_status
    2
    """


class CannotServeError(InputError):
    """The engine cannot compute this scene; the message names one that can.

    Its argument is the refusal: a code with numbers (``error.args[0].code``), whose sentence the
    message is.

    Examples
    --------
    >>> import harvester as hv
    >>> table = hv.Nondimensional(c1=-0.1, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0)
    >>> hv.Averaged().run(hv.Scene(nondimensional=table))
    Traceback (most recent call last):
    harvester.errors.CannotServeError: engine 'averaged' cannot model harmonic drive: use engine 'ensemble', ...
    """


class SimulationError(HarvesterError):
    """The computation was well posed as a request, but did not end in an answer.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Averaged().run(hv.Scene(nondimensional=hv.Nondimensional(c1=0.1, beta=0.05, mu=1.0, D11=0.01)))
    Traceback (most recent call last):
    harvester.errors.UnboundedResponseError: ...
    """


class UnboundedResponseError(SimulationError):
    """The response grows without bound, so that it has no stationary mean."""


class InfiniteMeanError(UnboundedResponseError):
    """The response settles, but large motions are so likely that its mean square and mean power do not exist.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=0.5, D11=0.01, D22=0.1))
    >>> hv.Averaged().run(scene)
    Traceback (most recent call last):
    harvester.errors.InfiniteMeanError: the means of V^2 and of the power do not exist: ...
    """


class CircuitError(SimulationError):
    """The circuit was refused by ngspice, or did not converge.

    ``so_far`` has the results until then: the mean power of Rload (W), the mean square of the
    terminals' voltage (V^2), and the seconds that these means cover; None if they had not begun.
    """

    so_far: tuple[float, float, float] | None = None


class ConvergenceError(CircuitError):
    """A run of ngspice that came to a time from which no step, however small, led on."""


class OutOfTimeError(CircuitError):
    """A run of ngspice that had not ended when its time was over."""


NO_THREAD = ("can't start new thread",)  # of Python's RuntimeError
NO_LOCK = re.compile(r"can't allocate (\w+ )?lock")
# file of its text; other texts, as of compiled circuits, have names of their own
DATA_CLASS = "<string>"


def named(error: Exception) -> HarvesterError:
    """The named error for an unforeseen one: a lack of memory, a fault of the system, or a defect of this package."""
    if isinstance(error, HarvesterError):
        return error
    if isinstance(error, MemoryError) or _is_lost_memory_error(error):
        return SimulationError(
            "there is not enough memory: try fewer `trajectories`, `workers` or a longer `dt`"
        )
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG and error.filename:
        name = str(error.filename)
        return InputError(
            f"the name of a file must be shorter, but {shown(name)} has {len(name)} characters, "
            "more than the system allows"
        )
    if isinstance(error, BlockingIOError) or error.args == NO_THREAD:
        return SimulationError(
            f"the system refused: {error}; ulimit -u sets how many threads and processes may start"
        )
    if isinstance(error, OSError) and error.errno == errno.ENOSPC:  # a full disk behind stdout
        return SimulationError(
            f"the system refused: {error}: free some, or send the output elsewhere"
        )
    if isinstance(error, OSError | ImportError):  # as of a library that is not loaded
        return SimulationError(f"the system refused: {error}")
    what = f"{type(error).__name__}: {error}"
    return SimulationError(
        f"internal error, please report it: {what} (HARVESTER_TRACEBACK=1 shows the place)"
    )


def _is_lost_memory_error(error: Exception) -> bool:
    """Whether memory ended, and the MemoryError was lost on its way through Python or a library.

    Python has a SystemError then ("returned NULL without setting an exception"), its parser a
    SyntaxError in a module of this package or in the text of a data class; a library may raise
    another error while it handles the MemoryError, or because of it.
    """
    if isinstance(error, SyntaxError):
        name = error.filename or DATA_CLASS
        return name == DATA_CLASS or Path(name).is_relative_to(Path(__file__).parent)
    if isinstance(error, SystemError):
        return "without" in str(error)
    if NO_LOCK.fullmatch(str(error)):
        return True
    cause = error.__cause__ or error.__context__
    while cause is not None and not isinstance(cause, MemoryError):
        cause = cause.__cause__ or cause.__context__
    return cause is not None


def answer_or_error(function: Callable[[Of], Answer], of: Of) -> "Answer | HarvesterError":
    """The result of a function for one of many scenes, or its named error; a missing program is raised."""
    try:
        return function(of)
    except MissingProgramError:
        raise
    except HarvesterError as error:
        return error


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 120


def escaped(text: str) -> str:
    """A stranger's text as it is shown: control characters, which move a cursor or turn a line, as a code."""
    hidden = {c for c in text if unicodedata.category(c) in ("Cc", "Cf")} - {"\n", "\t"}
    return "".join(repr(c)[1:-1] if c in hidden else c for c in text) if hidden else text


def shown(value: object) -> str:
    """A value as an error shows it: its repr, cut if it would fill the screen."""
    try:
        return _SHORT.repr(value)
    except ValueError:
        return "a number of thousands of digits"  # more than Python prints


def invalid(argument: str, must: str, was: object) -> InputError:
    """The one template for bad input: ``argument`` must ``must``, but is ``was``."""
    return InputError(f"{argument} must {must}, but is {shown(was)}")


def refused(argument: str, error: ValueError, was: object) -> InputError:
    """The `InputError` of a reader's ValueError ("must ..."), with the part that was not understood."""
    if isinstance(error, InputError):  # it says all of that already
        return error
    why = getattr(error, "why", "")
    return InputError(f"{argument} {error}, but is {shown(was)}" + (f": {why}" if why else ""))


def reading(argument: str, reader: Callable[[Of], Answer], value: Of) -> Answer:
    """The value as a reader returns it.

    Its ValueError ("must ...") becomes an `InputError` that names the argument.
    """
    try:
        return reader(value)
    except ValueError as error:
        raise refused(argument, error, value) from None


def unknown(
    kind: str, name: str, known: Iterable[str], error: type[InputError] = InputError
) -> InputError:
    """An unknown name, with its nearest match or, failing that, every name there is."""
    names = {each.lower(): each for each in known}
    near = difflib.get_close_matches(name[:120].lower(), names, n=1)
    hint = (
        f"did you mean {names[near[0]]!r}?"
        if near
        else f"it must be one of {', '.join(names.values())}"
    )
    return error(f"unknown {kind} {shown(name)}: {hint}")


def named_once(names: Sequence[str], argument: str) -> None:
    """Raise InputError if an argument names something twice."""
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{argument} must name each only once, but names {name!r} twice")


def names_arguments(target: T) -> T:
    """Make a public function or class answer an unknown keyword with an `InputError` and the nearest match.

    A ``seed`` that is not a whole number of at least 0 is also one.
    """
    function: Any = target.__init__ if isinstance(target, type) else target  # type: ignore[misc]
    known = []
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is parameter.VAR_KEYWORD:  # of the keys of a TypedDict
            known += [
                key for kind in get_args(parameter.annotation) for key in kind.__annotations__
            ]
        elif name != "self":
            known.append(name)

    @functools.wraps(function)
    def checked(*arguments: Any, **options: Any) -> Any:
        for name in options:
            if name not in known:
                raise unknown(f"argument of {target.__name__}", name, known, UnknownArgumentError)
        seed = options.get("seed", 0)
        if seed is not None and (not isinstance(seed, Integral) or seed < 0):
            raise invalid("`seed`", "be a whole number of at least 0", seed)
        return function(*arguments, **options)

    if isinstance(target, type):
        target.__init__ = checked  # type: ignore[misc]
        return target
    return checked  # type: ignore[return-value]
