"""The interface of a user's model in lock-step with ngspice: its four functions, and their checks."""

import inspect
import math
import numbers
from collections.abc import Callable
from typing import Any, Protocol

from harvester.cosimulation.model_errors import is_interrupt, of_model
from harvester.errors import InputError, invalid, shown

NEEDED = ("drift", "kick", "source")
EVENTS = ("event", "jump")


class Mechanics(Protocol):
    """Mechanics as four functions of a state, which is a NamedTuple of numbers.

    A model that is a NamedTuple of numbers itself, its coefficients, is compiled; any other object with these methods
    runs in plain Python.  A method that is compiled calls plain functions, and no method of the model.

    drift(state, h)
        The state after a time h (s) in which positions move at given speeds: x + h v.
    kick(state, h, reaction, noise)
        The state after forces have acted for a time h at fixed positions, the reaction of the port
        against them: v + h (F - reaction)/m.  For a piezo the reaction is theta V in newton, of a
        coil k i.  ``noise`` is a standard normal number of this kick alone: white noise of the
        two-sided density S adds sqrt(S h) noise.
    source(state)
        The source of the port: for a piezo the displacement (m), which times theta is the charge;
        for a coil the velocity (m/s), which times k is the e.m.f.
    event(state, h), jump(state)
        Only if there are events: the time of the first one within the coming drift of length h,
        or None; and the state after it.

    An explicit time is a number of the state that a drift moves on: ``t + h``.
    """

    def drift(self, state: Any, h: float, /) -> Any:
        """The state after a time h at given speeds."""

    def kick(self, state: Any, h: float, reaction: float, noise: float, /) -> Any:
        """The state after the forces of a time h."""

    def source(self, state: Any, /) -> float:
        """The source of the port."""
        ...


Model = Mechanics  # as users know it


def is_named_tuple(value: object) -> bool:
    """Whether an object is a NamedTuple of numbers."""
    fields = getattr(value, "_fields", ())
    return isinstance(value, tuple) and len(fields) == len(value) > 0 and all(map(is_number, value))


def is_number(value: object) -> bool:
    """Whether an object is a real number, and no truth value."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def can_be_compiled(model: Any) -> bool:
    """Whether a model is a NamedTuple of numbers and of None."""
    fields = getattr(model, "_fields", None)
    return (
        isinstance(model, tuple)
        and fields is not None
        and all(part is None or is_number(part) for part in model)
    )


def check_model(model: Any, start: Any, h: float) -> None:
    """Call each of a model's functions once, for a step of h seconds from the ``start``.

    Raises InputError for a function that is missing or has other arguments, a start that is not a
    NamedTuple of finite numbers, and a function that gives anything else than it must.
    """
    if isinstance(model, type):
        raise invalid(
            "`model`", "be an object, such as Oscillator(m=0.01), rather than its class", model
        )
    for name in (*NEEDED, *(EVENTS if any(hasattr(model, event) for event in EVENTS) else ())):
        if not callable(getattr(model, name, None)):
            have = ", ".join(EVENTS) if name in EVENTS else ", ".join(NEEDED)
            raise InputError(
                f"`model` must have the functions {have}, but {shown(type(model).__name__)} has no {name}"
            )
    if not is_named_tuple(start) or not all(map(math.isfinite, start)):
        raise invalid(
            "`start`", "be a NamedTuple of finite numbers, such as State(x=0.0, v=0.0)", start
        )
    _check_state("drift", _called(model, "drift", "state, h", start, h), start)
    _check_state(
        "kick", _called(model, "kick", "state, h, reaction, noise", start, h, 0.0, 0.0), start
    )
    source = _called(model, "source", "state", start)
    if not is_number(source) or not math.isfinite(source):
        raise invalid("`model.source`", "give a finite number", source)
    if hasattr(model, "event"):
        check_event(_called(model, "event", "state, h", start, h), h)


def check_event(when: Any, h: float, at: str = "") -> None:
    """Refuse a time of an invalid event, or outside the coming drift of length h."""
    if when is not None and not (
        is_number(when) and (-1e-9 * h <= when <= (1.0 + 1e-9) * h or when == math.inf)
    ):
        raise invalid(
            f"`model.event`{at}",
            f"give a time within the drift, from 0 to {h:.6g} s, or None",
            when,
        )


def _called(model: Any, name: str, signature: str, *arguments: Any) -> Any:
    """Call a model's function; raises the errors inside it as `model_errors.of_model` does."""
    function: Callable[..., Any] = getattr(model, name)
    try:
        inspect.signature(function).bind(*arguments)
    except TypeError:
        raise invalid(
            f"`model.{name}`", f"take ({signature})", str(inspect.signature(function))
        ) from None
    try:
        return function(*arguments)
    except BaseException as error:
        if is_interrupt(error):
            raise
        raise of_model(error) from None


def _check_state(name: str, state: Any, start: Any) -> None:
    """Refuse a state that is of another kind than the start, or not finite."""
    kind = type(start).__name__
    if type(state) is not type(start) or not all(map(is_number, state)):
        raise invalid(f"`model.{name}`", f"give a {kind} of numbers, as `start` is", state)
    if not all(map(math.isfinite, state)):
        raise invalid(f"`model.{name}`", f"give a {kind} of finite numbers", state)
