"""The C function of a device that an importer advances, compiled for the effects of its scene.

    int64 harvester_part(int64 task, double *numbers, double *w, uint64 *words, int64 *at,
                         double *out, double until)

``at`` are addresses, of a netlist inside alone (`harvester.circuits.circuit_part`); ``numbers``
are those of the templates of `Plan`, one after the other; ``w`` is the whole state (`W`), ``words``
that of the random generator, ``out`` the report of `READ` (`OUT`), all nondimensional.  The answer
is one of `DONE`, `EVENT` (with `STOPPING`: the time is that of an impact, whose jump waits),
`FAILED` (a number is infinite or not a number) and `UNSOLVED` (the steps of a netlist fail).
"""

from typing import Any, NamedTuple

from numba import cfunc, types

from harvester.mechanics.kernels.coefficients import Coefficients
from harvester.mechanics.kernels.compiled import COMPILER, FLAGS, inlined, version_of
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit, Store
from harvester.mechanics.kernels.one_mode import IdealLoad
from harvester.mechanics.kernels.shaking import Filter
from harvester.mechanics.part.gridded import Gridded, gridded_part
from harvester.mechanics.part.located import Located, Wall, located_part
from harvester.mechanics.part.numbers import count, read_numbers
from harvester.mechanics.part.outside_forces import Outside
from harvester.mechanics.part.part_state import with_pulls

DOUBLES = types.CPointer(types.float64)
WORDS = types.CPointer(types.uint64)
ADDRESSES = types.CPointer(types.int64)
ARGUMENTS = (types.int64, DOUBLES, DOUBLES, WORDS, ADDRESSES, DOUBLES, types.float64)
SIGNATURE = types.int64(*ARGUMENTS)


class Plan(NamedTuple):
    """A device as templates of the numbers of its parts, None for an absent part.

    ``located`` chooses located impacts (`harvester.mechanics.part.located`) in place of the grid.
    ``h`` is the step, and ``circuit`` an `IdealCircuit`, or the numbers of a netlist.
    """

    located: bool
    h: float
    c: Coefficients
    quiet: Coefficients
    low: Wall | None
    high: Wall | None
    outside: Outside
    circuit: Any = None
    filter: Filter | None = None


TEMPLATES = ("c", "quiet", "low", "high", "outside", "circuit", "filter")


def sections(plan: Plan) -> dict[str, Any]:
    """The templates that a plan has, by name, in the order of their numbers."""
    every = {name: getattr(plan, name) for name in TEMPLATES}
    return {name: template for name, template in every.items() if template is not None}


@inlined
def read(template, numbers, first):
    """A template's numbers; None without."""
    if template is None:
        return None
    return read_numbers(template, numbers, first)


def stored(circuit, w, at):
    """The load of a circuit, whose storage capacitor the state has; None without."""


@version_of(stored, circuit=None)
def _not_stored(circuit, w, at):
    return None


@version_of(stored, circuit=IdealCircuit)
def _stored(circuit, w, at):
    return IdealLoad(circuit, Store(0.0, 0.0), None)


def entry(plan: Plan) -> Any:
    """The compiled function of a plan, with its LLVM code (`inspect_llvm`)."""
    firsts = {}
    first = 0
    for name in TEMPLATES:
        firsts[name] = first
        template = getattr(plan, name)
        first += 0 if template is None else count(template)
    of_c = firsts["c"]
    of_quiet = firsts["quiet"]
    of_low = firsts["low"]
    of_high = firsts["high"]
    of_outside = firsts["outside"]
    of_circuit = firsts["circuit"]
    of_filter = firsts["filter"]
    h = plan.h
    c = plan.c
    quiet = plan.quiet
    low = plan.low
    high = plan.high
    outside = plan.outside
    circuit = plan.circuit
    noise = plan.filter

    def located(task, numbers, w, words, at, out, until):
        device = Located(
            h=h,
            quiet=read_numbers(quiet, numbers, of_quiet),
            c=read_numbers(c, numbers, of_c),
            low=read(low, numbers, of_low),
            high=read(high, numbers, of_high),
            outside=read_numbers(outside, numbers, of_outside),
        )
        return located_part(task, w, out, until, device)

    def gridded(task, numbers, w, words, at, out, until):
        grid = Gridded(
            h=h,
            quiet=read_numbers(quiet, numbers, of_quiet),
            c=with_pulls(read_numbers(c, numbers, of_c)),
            outside=read_numbers(outside, numbers, of_outside),
            filter=read(noise, numbers, of_filter),
        )
        load = stored(read(circuit, numbers, of_circuit), w, at)
        return gridded_part(task, w, words, out, until, load=load, grid=grid)

    return cfunc(SIGNATURE, **COMPILER, **FLAGS)(located if plan.located else gridded)
