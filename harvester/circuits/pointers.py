"""Calls of compiled functions by their addresses, on the numbers of arrays."""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

POINTER = types.CPointer(types.float64)


@intrinsic
def pointer(typingctx, address):
    """The pointer to floats at an address."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.DoubleType().as_pointer())

    return POINTER(types.int64), codegen


@intrinsic
def data(typingctx, array):
    """The pointer to an array's numbers."""

    def codegen(context, builder, signature, args):
        return context.make_array(signature.args[0])(context, builder, args[0]).data

    return POINTER(array), codegen


@intrinsic
def call_solver(typingctx, address, y, r, Y, p, s, q, work, rate):
    """Call the solver at an address."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.IntType(64), [arg.type for arg in args[1:]])
        return builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])

    return types.int64(types.int64, *7 * [POINTER], types.float64), codegen


@intrinsic
def advance(typingctx, address, circuit, state, room, x, x1, wall, first, h, count):
    """Call `follow` at its address, on the data of arrays."""

    def codegen(context, builder, signature, args):
        pointers = [
            builder.bitcast(
                context.make_array(kind)(context, builder, arg).data,
                ir.IntType(8).as_pointer() if k == 0 else ir.DoubleType().as_pointer(),
            )
            for k, (arg, kind) in enumerate(zip(args[1:4], signature.args[1:4], strict=True))
        ]
        given = [*pointers, *args[4:]]
        kind = ir.FunctionType(ir.IntType(64), [value.type for value in given])
        return builder.call(builder.inttoptr(args[0], kind.as_pointer()), given)

    return types.int64(
        types.int64, circuit, state, room, *5 * [types.float64], types.int64
    ), codegen
