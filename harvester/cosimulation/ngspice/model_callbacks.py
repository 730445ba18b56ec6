"""The callbacks of a run with a model of the user's own: as C functions compiled from the model, or in plain Python."""

import ctypes
import math
import types as python_types
from collections.abc import Callable, Hashable
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import carray, types  # type: ignore[attr-defined]
from numba.extending import intrinsic

from harvester.arrays import Floats
from harvester.cosimulation.lockstep import any_mechanics
from harvester.cosimulation.lockstep.any_mechanics import Functions, ModelRecord
from harvester.cosimulation.lockstep.model_drive import ModelDrive
from harvester.cosimulation.lockstep.state import STATE, Point
from harvester.cosimulation.model_errors import of_model
from harvester.cosimulation.ngspice.compiled_callbacks import (
    _F8,
    _I4,
    _STATE_POINTER,
    _coefficients,
    _pointer,
)
from harvester.cosimulation.ngspice.model_globals import values_named
from harvester.mechanics.kernels.compiled import COMPILER, PART, STRICT, interpreted, strict


def never(m: Any, at: Any, h: float) -> float:
    """The event of a model without events."""
    return math.inf


def unchanged(m: Any, at: Any) -> Any:
    """The jump of a model without events."""
    return at


def _as_function(method: Any) -> Callable[..., Any]:
    """A bound method as a function that is given the model as well."""
    return lambda _, *arguments: method(*arguments)


def _functions(
    of: Any, made: Callable[[Any], Any], plain: Callable[[Any], Any], floats: Any
) -> Functions:
    """The functions of a model, or of its class, each ``made`` into one that can be called in lock-step.

    ``plain`` makes it of one that is not a method.
    """
    functions = {name: made(getattr(of, name)) for name in ("drift", "kick", "source")}
    absent = {"event": never, "jump": unchanged}
    functions |= {
        name: made(getattr(of, name)) if hasattr(of, name) else plain(absent[name])
        for name in absent
    }
    return Functions(**functions, floats=floats)


def _number_as_written(function: Any) -> Any:
    """A user's function, and the plain functions that it calls, compiled as `strict` compiles our own."""
    if not isinstance(function, python_types.FunctionType):
        return function
    names = function.__globals__
    known = {name: names[name] for name in function.__code__.co_names if name in names}
    called = {
        name: inner for name, inner in known.items() if isinstance(inner, python_types.FunctionType)
    }
    if called:
        names = {**names, **{name: _number_as_written(inner) for name, inner in called.items()}}
        function = python_types.FunctionType(
            function.__code__, names, function.__name__, function.__defaults__, function.__closure__
        )
    return numba.njit(**STRICT, **PART)(function)


class CompiledModel(NamedTuple):
    """A model's compiled functions, and patterns of its coefficients and its state."""

    functions: Functions
    coefficients: Any
    state: Any


def compiled_model(kind: Any, state_kind: Any, absent: tuple[bool, ...]) -> CompiledModel:
    """The functions of a model, compiled again if a global that they name has another value.

    ``absent`` states which of its coefficients are None.
    """
    return _compiled_model(kind, state_kind, absent, values_named(kind))


@cache
def _compiled_model(
    kind: Any, state_kind: Any, absent: tuple[bool, ...], _: tuple[Hashable, ...]
) -> CompiledModel:
    """The same, for the present values outside the model."""
    m0 = kind(*(None if is_absent else 0.0 for is_absent in absent))
    at0 = state_kind(*(0.0 for _ in state_kind._fields))

    @intrinsic
    def _as_floats(typingctx, values):
        """A state of floats from one that may have whole numbers."""
        made = numba.typeof(at0)

        def codegen(context, builder, signature, args):
            parts = [
                context.cast(
                    builder, builder.extract_value(args[0], k), kind_of_item, types.float64
                )
                for k, kind_of_item in enumerate(signature.args[0].types)
            ]
            return context.make_tuple(builder, made, parts)

        return made(values), codegen

    @numba.njit(**PART)
    def floats(values):
        return _as_floats(values)

    f = _functions(kind, _number_as_written, _number_as_written, floats)
    f.event.compile((numba.typeof(m0), numba.typeof(at0), types.float64))
    if isinstance(
        f.event.nopython_signatures[0].return_type, types.NoneType
    ):  # of these coefficients there is none
        f = f._replace(event=_number_as_written(never))
    return CompiledModel(f, m0, at0)


def compiled(kind: Any, state_kind: Any, absent: tuple[bool, ...]) -> tuple[Any, Any]:
    """A model's source and step as C functions, for the arguments of `compiled_model`."""
    return _compiled(kind, state_kind, absent, values_named(kind))


@cache
def _compiled(
    kind: Any, state_kind: Any, absent: tuple[bool, ...], _: tuple[Hashable, ...]
) -> tuple[Any, Any]:
    """The same, for the present values outside the model."""
    f, m0, at0 = compiled_model(kind, state_kind, absent)
    voltage, accept = strict(any_mechanics.port_voltage), strict(any_mechanics.accept_model)

    @numba.cfunc(_F8(_STATE_POINTER, _F8, _F8), **COMPILER)
    def source(user, t, delta):
        s = carray(user, 1)[0]
        return voltage(
            s, t, f, _coefficients(s.coefficients_at, m0), _coefficients(s.model_at, at0)
        )

    width = len(at0) + 3
    size = len(at0)

    @numba.cfunc(_I4(_STATE_POINTER, _F8, _F8, _F8, _F8, _F8), **COMPILER)
    def step(user, t, v, power, current, smooth):
        s = carray(user, 1)[0]
        record = ModelRecord(
            carray(_pointer(s.noise_at), (s.noise_size, 2), np.float64),
            carray(_pointer(s.samples_at), (s.noise_size // s.stride + 1, width), np.float64),
            carray(_pointer(s.impacts_at), s.impacts_size, np.float64),
        )
        m, at = _coefficients(s.coefficients_at, m0), _coefficients(s.model_at, at0)
        after = accept(s, Point(t, v, power, current, smooth), record, f, m, at)
        kept = carray(_pointer(s.model_at), size, np.float64)
        for k in range(size):
            kept[k] = after[k]
        return 0

    return source, step


class PlainCallbacks:
    """The same in plain Python; ``drive`` is the run, and ``shared`` ngspice's copy of its record.

    Python works on a record of its own, ``s``, as one of NumPy is slow, and gives ngspice the
    values.  ngspice cannot pass on an exception, and would read a source without a value: the first
    exception is kept in ``error``, to be raised after the run, and from then on the source holds
    its last finite value.
    """

    REPORTED = "t", "leg_t", "target_time", "turned", "free", "n_steps", "accepted"

    def __init__(self, model: Any, start: Any, drive: ModelDrive, shared: Any) -> None:
        self.at = start
        self.model = model
        self.drive = drive
        self.s = python_types.SimpleNamespace(
            **{name: drive.state[name][0].item() for name in STATE.names or ()}
        )
        self.f = _functions(model, _as_function, lambda function: function, lambda at: at)
        self.error: BaseException | None = None
        self.last = 0.0
        self._reported = [(name, shared[name]) for name in self.REPORTED]
        self._voltage, self._accept = (
            interpreted(any_mechanics.port_voltage),
            interpreted(any_mechanics.accept_model),
        )
        number = ctypes.CFUNCTYPE(
            ctypes.c_double, ctypes.c_void_p, ctypes.c_double, ctypes.c_double
        )
        point = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, *5 * [ctypes.c_double])
        self._kept = number(self._source), point(self._step)

    @property
    def addresses(self) -> tuple[int, int]:
        """The two C functions' addresses."""
        source, step = (ctypes.cast(callback, ctypes.c_void_p).value for callback in self._kept)
        return source or 0, step or 0

    def finish(self) -> None:
        """Keep the record for the finished run; raises the error of a function of the model."""
        if self.error is not None:
            raise of_model(self.error) from None
        for name, value in vars(self.s).items():
            self.drive.state[name] = value

    def _fail(self, error: BaseException) -> None:
        """Keep an error; the next target is beyond the end."""
        self.error = error
        self.s.free = 1
        self.s.target_time = 2.0 * self.drive.duration

    def _source(self, _: int, t: float, __: float) -> float:
        """Voltage of the source at a candidate time."""
        if self.error is None:
            try:
                self.last = float(self._voltage(self.s, t, self.f, self.model, self.at))
            except BaseException as error:  # SystemExit too: ngspice cannot pass it on
                self._fail(error)
        return self.last

    def _step(self, _: int, t: float, v: float, power: float, current: float, smooth: float) -> int:
        """Take an accepted point."""
        if self.error is None:
            point = Point(t, v, power, current, smooth)
            try:
                self.at = self._accept(
                    self.s, point, self.drive.record, self.f, self.model, self.at
                )
            except BaseException as error:  # SystemExit too: ngspice cannot pass it on
                self._fail(error)
        for name, entry in self._reported:
            entry[0] = getattr(self.s, name)
        return 0


def coefficients_of(model: Any) -> Floats:
    """A model's coefficients as an array, nan for one that is None."""
    return np.array(
        [math.nan if number is None else float(number) for number in model], dtype=np.float64
    )
