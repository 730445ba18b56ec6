"""A user's model of `cosimulate` as a functional mock-up unit.

The model's functions are compiled by numba, as `cosimulate` compiles them, and advanced by the
state machine of the lock-step (`harvester.cosimulation.part.model_part`).
"""

import dis
import re
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
from harvester.devices.fmu.unit import Exported, Unit, all_code, unit_file, written
from harvester.errors import InputError, SimulationError, invalid, unknown

RESERVED = ("voltage", "store_voltage")  # names of other numbers of the first state
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
        title=(type(model).__doc__ or type(model).__name__).strip().splitlines()[0],
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
    h = time_above_0("step", options["step"])
    check_port(port)
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
    needed = set(re.findall(r"\b(?:NRT|Py|numba)_?\w+", str(error)))
    for name in FUNCTIONS:
        function = getattr(made.functions, name)
        code = getattr(getattr(type(model), name, None), "__code__", None)
        if code and any(
            word in text for text in function.inspect_llvm().values() for word in needed
        ):
            return InputError(
                f"`model.{name}` must use numbers alone in an FMU, without arrays, lists, texts or "
                f"output, but does not ({Path(code.co_filename).name}, line {code.co_firstlineno})"
            )
    return error
