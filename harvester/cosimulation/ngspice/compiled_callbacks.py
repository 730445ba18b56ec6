"""The lock-step's callbacks as C functions: ngspice calls compiled code, without Python in between.

If a run's state holds the addresses of other C functions, such as those of the tests, these are
asked instead.
"""

from functools import cache
from itertools import count
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, from_dtype, types  # type: ignore[attr-defined]
from numba.core import cgutils
from numba.extending import intrinsic

from harvester.cosimulation.lockstep import modal_drift, transitions
from harvester.cosimulation.lockstep.state import STATE, Point, Recording
from harvester.mechanics.kernels.coefficients import BATCH, Coefficients
from harvester.mechanics.kernels.compiled import c_function, inlined, strict
from harvester.mechanics.modes.modal_step import ModalCoefficients

source_voltage, proposed_step = (
    strict(transitions.source_voltage),
    strict(transitions.proposed_step),
)
accept_point, accept_modal_point = (
    strict(transitions.accept_point),
    strict(modal_drift.accept_modal_point),
)


@intrinsic
def _pointer(typingctx, address):
    """Turn an address into a pointer, for `carray`."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.uintp), codegen


@intrinsic
def _call(typingctx, address, state, t, v, power, current, smooth):
    """Call the C function ``int (*)(state, t, v, power, current, smooth)`` at an address."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.IntType(32), [arg.type for arg in args[1:]])
        return builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])

    return types.int32(types.int64, _STATE_POINTER, *5 * [types.float64]), codegen


@intrinsic
def _ask(typingctx, address, state, t, delta):
    """Call the C function ``double (*)(state, t, delta)`` at an address."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.DoubleType(), [arg.type for arg in args[1:]])
        return builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])

    return types.float64(types.int64, _STATE_POINTER, types.float64, types.float64), codegen


@intrinsic
def _coefficients(typingctx, address, pattern):
    """Read coefficients at an address, None as in the ``pattern``, tuples of them one after the other."""

    def codegen(context, builder, signature, args):
        start = builder.inttoptr(args[0], ir.DoubleType().as_pointer())
        indices = count()

        def read(kind):
            if isinstance(kind, types.BaseTuple):
                return context.make_tuple(
                    builder, kind, [read(kind_of_item) for kind_of_item in kind]
                )
            address_of_item = builder.gep(start, [ir.Constant(ir.IntType(32), next(indices))])
            return (
                context.get_dummy_value()
                if isinstance(kind, types.NoneType)
                else builder.load(address_of_item)
            )

        return read(pattern)

    return pattern(types.int64, pattern), codegen


_STATE_POINTER = types.CPointer(from_dtype(STATE))
_F8, _I4 = types.float64, types.int32


@inlined
def _real(values, index):
    """Value of a vector at the accepted point; 0 for one that is not there."""
    return carray(_pointer(values[index]), 2, np.float64)[1] if index >= 0 else 0.0


@c_function(_I4(types.CPointer(_F8), _F8, types.voidptr, _I4, _STATE_POINTER))
def source_callback(value, t, node, ident, user):
    """Answer ngspice's GetVSRCData: the source's voltage at a candidate time."""
    s = carray(user, 1)[0]
    carray(value, 1)[0] = (
        _ask(s.source_at, user, t, 0.0) if s.source_at != 0 else source_voltage(s, t)
    )
    return 0


@c_function(_I4(_F8, types.CPointer(_F8), _F8, _I4, _I4, _I4, _STATE_POINTER))
def sync_callback(t, delta, old_delta, redo, ident, location, user):
    """Answer ngspice's GetSyncData: before a step (location 0) set its length.

    After it (1) accept the step.
    """
    if location == 0:
        s = carray(user, 1)[0]
        step = carray(delta, 1)
        step[0] = (
            _ask(s.step_at, user, t, step[0]) if s.step_at != 0 else proposed_step(s, t, step[0])
        )
    return redo


@c_function(_I4(types.uintp, _I4, _I4, _STATE_POINTER))
def data_callback(vectors, count, ident, user):
    """Take ngspice's SendData of an accepted point.

    ``vectors`` is the address of {int, int, pointer to pointers to {name, real, imaginary, ...}}.
    """
    s = carray(user, 1)[0]
    table = carray(_pointer(vectors), 2, np.uintp)[1]
    values = carray(_pointer(table), count, np.uintp)
    t = _real(values, s.time_index)
    v = _real(values, s.voltage_index)
    power = _real(values, s.power_index)
    smooth = _real(values, s.smooth_index) - _real(values, s.smooth_minus_index)
    current = -_real(values, s.current_index)  # out of the piezo; ngspice counts it into the source
    return _call(s.accepted_at, user, t, v, power=power, current=current, smooth=smooth)


def pattern_of(coefficients: Any) -> Any:
    """Coefficients with zeros in place of numbers, also in tuples among them."""
    if not isinstance(coefficients, tuple):
        return None if coefficients is None else 0.0
    as_given = getattr(coefficients, "_make", tuple)
    return as_given([pattern_of(coefficient) for coefficient in coefficients])


@cache
def point_function(pattern: Coefficients | ModalCoefficients, shaken: bool) -> Any:
    """`accept_point` as a C function, compiled for the coefficients that are not None in ``pattern``.

    ``shaken`` states whether there is excitation other than white noise.  For several modes it is
    `accept_modal_point`.  The values of its closure name its file in the cache, so that is numbers:
    a compiled function is another in each process.
    """
    modes = 0 if isinstance(pattern, Coefficients) else len(pattern.k)
    rows = 2 * modes + 1

    @c_function(_I4(_STATE_POINTER, _F8, _F8, _F8, _F8, _F8))
    def act(state, t, v, power, current, smooth):
        """Accept a point."""
        s = carray(state, 1)[0]
        recording = Recording(
            carray(_pointer(s.noise_at), s.noise_size, np.float64),
            carray(_pointer(s.shaking_at), s.noise_size + 1, np.float64) if shaken else None,
            carray(_pointer(s.samples_at), (s.noise_size // s.stride, 5), np.float64),
            carray(_pointer(s.impacts_at), (s.impacts_size, 2), np.float64),
            charge=carray(_pointer(s.charge_at), s.noise_size // s.stride, np.float64),
            kicked=carray(_pointer(s.kicked_at), (s.noise_size, 5), np.float64),
            modes=carray(_pointer(s.modes_at), (3, rows * BATCH), np.float64) if modes else None,
            coordinates=(
                carray(_pointer(s.coordinates_at), (s.noise_size // s.stride, 2, modes), np.float64)
                if modes
                else None
            ),
        )
        point = Point(t, v, power, current, smooth)
        if modes:
            accept_modal_point(s, point, recording, _coefficients(s.coefficients_at, pattern))
        else:
            accept_point(s, point, recording, _coefficients(s.coefficients_at, pattern))
        return 0

    return act
