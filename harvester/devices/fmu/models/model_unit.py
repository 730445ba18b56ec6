"""A user's model of `cosimulate` as a functional mock-up unit.

The model's functions are compiled by numba, as `cosimulate` compiles them, and advanced by the
state machine of the lock-step (`harvester.cosimulation.part.model_part`).
"""

import dis
import types
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from harvester.cosimulation.coupled_models import check_port, circuit_of_port, time_above_0
from harvester.cosimulation.model_errors import FUNCTIONS, not_compiled
from harvester.cosimulation.model_protocol import can_be_compiled, check_model
from harvester.cosimulation.ngspice.model_callbacks import CompiledModel, compiled_model
from harvester.cosimulation.part.model_part import model_entry
from harvester.devices.fmu.models.model_numbers import CoupledModel, ModelPart, part_of_model
from harvester.devices.fmu.models.model_options import ModelOptions
from harvester.devices.fmu.models.model_variables import model_variables
from harvester.devices.fmu.objects import OutsideCodeError
from harvester.devices.fmu.unit import Exported, Unit, all_code, unit_file, written
from harvester.devices.fmu.variables import LARGEST
from harvester.errors import InputError, SimulationError, invalid, unknown

RESERVED = ("voltage", "store_voltage")  # names of other numbers of the first state
RAISED = "picklebuf"  # numba's record of an error, in the code of a function that can raise it
FINEST, LONGEST = 1e-12, 1e6  # s, of a step
REMEDY = "an FMU has no Python inside"


def export_model(
    model: Any,
    out: str | Path,
    options: ModelOptions,
    fmi: int = 2,
    platforms: str | Sequence[str] | None = None,
) -> Exported:
    """Write a model of `cosimulate` as the FMU ``out``; see `harvester.devices.part_file.export`.

    Raises InputError for a model that `cosimulate` refuses, one that is not a NamedTuple of
    numbers, one that numba does not compile, and functions that raise errors; CannotServeError for
    a netlist with a coil, or with elements that engine "compiled" lacks; and as
    `harvester.devices.fmu.unit.export_fmu`.
    """
    from harvester.devices.fmu.contents import build

    coupled = _checked(model, options)
    inputs = _checked_inputs(model, options.get("inputs") or ())
    target = unit_file(out, fmi, platforms)
    build.check_compiler()
    _check_no_errors(model)
    compiled = _compiled(coupled)
    part = part_of_model(coupled)
    unit = Unit(
        part=part,
        variables=model_variables(coupled, part, inputs),
        code=all_code(_entry(coupled, compiled, part), part.board),
        frequency=1.0,
        title=((type(model).__doc__ or "").strip() or type(model).__name__).splitlines()[0],
    )
    try:
        return written(unit, target)
    except SimulationError as error:
        raise _outside_needs(error, model, compiled) from None


def _checked(model: Any, options: ModelOptions) -> CoupledModel:
    """The model with its port, its start, its step and its load."""
    for name in ("port", "start", "step"):
        if options.get(name) is None:
            raise InputError(f"`{name}` must be given with a model of cosimulate, but is absent")
    port = options["port"]
    start = options["start"]
    h = _checked_step(options["step"])
    check_port(port)
    _check_numbers("`model`", model)
    _check_numbers("`start`", start)
    check_model(model, start, h)
    for name in start._fields:
        if name in RESERVED:
            raise invalid("`start`", f"have no number of the name {' or '.join(RESERVED)}", name)
    if not can_be_compiled(model):
        raise invalid(
            "`model`", "be a NamedTuple of numbers for an FMU, which numba compiles", model
        )
    load = options.get("load")
    behind = None if load is None else circuit_of_port(load, port)
    return CoupledModel(model=model, start=start, port=port, load=behind, h=h)


def _checked_step(step: float | str) -> float:
    """The step (s); InputError for one that no simulator has."""
    h = time_above_0("step", step)
    if not FINEST <= h <= LONGEST:
        raise invalid("`step`", f"be from {FINEST:g} to {LONGEST:g} s for an FMU", step)
    return h


def _check_numbers(argument: str, values: Any) -> None:
    """Raise InputError for a name or a number that no variable of an FMU can have."""
    if not isinstance(values, tuple):
        return  # which is refused for that
    for name, number in zip(getattr(values, "_fields", ()), values, strict=False):
        if not name.isascii():
            raise invalid(argument, "have names of ASCII letters for an FMU", name)
        if isinstance(number, int | float) and not abs(number) <= LARGEST:
            raise invalid(
                argument,
                f"have numbers between {-LARGEST:g} and {LARGEST:g} for an FMU",
                f"{name}={number}",
            )


def _checked_inputs(model: Any, inputs: Sequence[str]) -> tuple[str, ...]:
    """The coefficients that are inputs; InputError for another name."""
    given = (inputs,) if isinstance(inputs, str) else tuple(inputs)
    for name in given:
        if name not in model._fields:
            raise unknown("number of the model", name, list(model._fields))
        if getattr(model, name) is None:
            raise invalid("`inputs`", "name numbers of the model, none of them None", name)
    return given


def _compiled(coupled: CoupledModel) -> CompiledModel:
    """The model's functions; InputError for one that numba does not compile."""
    model_kind: Any = type(coupled.model)
    state_kind: Any = type(coupled.start)
    absent = tuple(component is None for component in coupled.model)
    try:
        return compiled_model(model_kind, state_kind, absent)
    except Exception as error:  # of numba's, or of what numba asks of a class of the user's own
        raise not_compiled(error, model_kind.__name__, REMEDY) from None


def _entry(coupled: CoupledModel, compiled: CompiledModel, part: ModelPart) -> str:
    """The LLVM code of the part; InputError for functions that numba does not compile."""
    template = part.tables.numbers if part.tables else None
    try:
        entry = model_entry(compiled, part.port, template, part.step, part.layout)
        return str(entry.inspect_llvm())
    except Exception as error:
        raise not_compiled(error, type(coupled.model).__name__, REMEDY) from None


def _check_no_errors(model: Any) -> None:
    """Raise InputError for a model whose functions raise errors, with the line."""
    for name, line in _raising(model):
        raise InputError(
            f"`model.{name}` must not raise errors in an FMU, which has no Python to handle them, "
            f"but does ({line}): return a number that is not finite, and the step has a status"
        )


def _raising(model: Any) -> Iterator[tuple[str, str]]:
    """The functions of a model that raise errors, also in functions that they call, and lines."""
    for name in FUNCTIONS:
        seen = set[types.FunctionType]()
        functions = [getattr(type(model), name, None)]
        while functions:
            function = functions.pop()
            function = getattr(function, "py_func", function)  # of numba.njit
            if not isinstance(function, types.FunctionType) or function in seen:
                continue
            seen.add(function)
            line = function.__code__.co_firstlineno
            for instruction in dis.get_instructions(function):
                line = instruction.starts_line or line
                if instruction.opname == "RAISE_VARARGS":
                    yield name, f"{Path(function.__code__.co_filename).name}, line {line}"
            functions += [function.__globals__.get(called) for called in function.__code__.co_names]


def _outside_needs(error: SimulationError, model: Any, made: CompiledModel) -> Exception:
    """The error of code that needs memory or Python, with the function that does; else as it is."""
    if not isinstance(error, OutsideCodeError):
        return error
    needed = error.names
    if line := _using(needed, model, made):
        return InputError(
            f"`model.{line[0]}` must use numbers alone in an FMU, without arrays, lists, texts, "
            f"output, random draws, or functions such as gamma, but does not ({line[1]}): noise is "
            "the argument of `kick`"
        )
    if line := _using([RAISED], model, made):
        return InputError(
            f"`model.{line[0]}` must not raise errors in an FMU, which has no Python to handle them, "
            f"but an index or a function in it can ({line[1]}): use conditions in place of an index"
        )
    return InputError(
        "`model` must use numbers and functions of the C library alone in an FMU, but needs "
        f"{', '.join(needed)}"
    )


def _using(words: list[str], model: Any, made: CompiledModel) -> tuple[str, str] | None:
    """The first function of a model whose code has one of the words, and its line."""
    for name in FUNCTIONS:
        code = getattr(getattr(type(model), name, None), "__code__", None)
        texts = getattr(made.functions, name).inspect_llvm().values()
        if code and any(word in text for text in texts for word in words):
            return name, f"{Path(code.co_filename).name}, line {code.co_firstlineno}"
    return None
