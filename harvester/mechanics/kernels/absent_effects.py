"""Effects that are absent cost nothing, nor do questions whether one is there: a pass of the compiler.

numba leaves out a branch such as ``if alpha is not None`` if the argument alpha is None.  For a
field of an argument, as in ``if c.alpha is not None``, it does not know that before it has found
the types, and fails in the branch that adds a number to None; and the code in the other branch,
of an effect that is there, it compiles for nothing.  This pass, which runs before branches are left
out, writes None in the place of each field whose type reports it, and the answer in the place of
each question whether an argument, or a field of one, is None.
"""

import operator
from typing import Any

from numba.core import compiler_machinery, consts, ir, ir_utils, types, untyped_passes

QUESTIONS = {operator.is_: True, operator.is_not: False}  # what each says of None


@compiler_machinery.register_pass(mutates_CFG=False, analysis_only=False)
class AbsentEffects(compiler_machinery.FunctionPass):
    """Replace ``c.name`` by None, and ``c.name is None`` by True or False, by the type of the argument c."""

    _name = "absent_effects"

    def __init__(self) -> None:  # which numba wants
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Whether the function has changed."""
        function = state.func_ir
        changed = False
        for block in function.blocks.values():
            for assignment in block.find_insts(ir.Assign):
                value = assignment.value
                if isinstance(value, ir.Expr) and (answer := _answer(state, value)):
                    definitions = function._definitions[assignment.target.name]
                    constant = ir.Const(answer[0], assignment.loc)
                    assignment.value = definitions[definitions.index(value)] = constant
                    changed = True
        if changed:
            function._consts = consts.ConstantInference(function)
        return changed


def _answer(state: Any, value: Any) -> tuple[bool | None] | None:
    """The certain value of an expression, in a tuple; None if it is not known."""
    if value.op == "getattr" and isinstance(_kind(state, value), types.NoneType):
        return (None,)
    if value.op == "binop" and value.fn in QUESTIONS:
        what, beside = (
            ir_utils.guard(ir_utils.get_definition, state.func_ir, side)
            for side in (value.lhs, value.rhs)
        )
        if isinstance(beside, ir.Const) and beside.value is None:
            kind = _kind(state, what)
            if isinstance(kind, types.Number | types.Array | types.BaseTuple):
                return (not QUESTIONS[value.fn],)
    return None


def _kind(state: Any, value: Any) -> Any:
    """Numba's type of an argument, or of a field of one; None if it is neither."""
    if isinstance(value, ir.Arg):
        return state.args[value.index]
    if isinstance(value, ir.Expr) and value.op == "getattr":
        whole = _kind(state, ir_utils.guard(ir_utils.get_definition, state.func_ir, value.value))
        if isinstance(whole, types.NamedTuple | types.NamedUniTuple) and value.attr in whole.fields:
            return whole[whole.fields.index(value.attr)]
    return None


def add_to(managers: list[Any]) -> list[Any]:
    """Pipelines of numba's compiler with this pass before the one that leaves branches out."""
    for manager in managers:
        manager.add_pass_after(AbsentEffects, untyped_passes.RewriteSemanticConstants)
        manager.finalize()
    return managers
