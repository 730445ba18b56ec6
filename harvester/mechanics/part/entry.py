"""The C function of a device that an importer advances, compiled for the effects that its scene has.

    int64 harvester_part(int64 what, double *numbers, double *w, uint64 *words, double *out, double until)

``numbers`` are those of the templates of `Plan`, one after the other; ``w`` is the whole state (`W`), ``words`` that of
the random generator, ``out`` what `READ` reports (`OUT`), all nondimensional.  The answer is one of `DONE`, `EVENT`
(with `STOPPING`: the time is that of an impact, whose jump waits) and `FAILED` (a number is no longer finite).
"""

from typing import Any, NamedTuple

from numba import cfunc, types

from harvester.arrays import Floats
from harvester.mechanics.kernels.coefficients import Coefficients
from harvester.mechanics.kernels.compiled import COMPILER, FLAGS, inlined
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.shaking import Filter
from harvester.mechanics.part.forces import Outside
from harvester.mechanics.part.gridded_part import gridded_part
from harvester.mechanics.part.located import Walls
from harvester.mechanics.part.located_part import located_part
from harvester.mechanics.part.numbers import count, read_numbers
from harvester.mechanics.part.state import with_pulls

DOUBLES, WORDS = types.CPointer(types.float64), types.CPointer(types.uint64)
SIGNATURE = types.int64(types.int64, DOUBLES, DOUBLES, WORDS, DOUBLES, types.float64)


class Plan(NamedTuple):
    """What a device has: templates of the numbers of each part, None for what is absent; and the record's values.

    ``located`` chooses located impacts (`harvester.mechanics.part.located`) in place of the grid.  ``h`` is the step,
    ``spread`` the standard deviation with which filtered noise begins.
    """

    located: bool
    h: float
    c: Coefficients
    quiet: Coefficients
    walls: Walls
    outside: Outside
    circuit: IdealCircuit | None = None
    filter: Filter | None = None
    spread: float = 0.0
    record: Floats | None = None


def sections(plan: Plan) -> list[Any]:
    """The templates in the order in which their numbers are read."""
    return [plan.c, plan.quiet, plan.walls, plan.outside, plan.circuit, plan.filter]


@inlined
def read(template, numbers, first):
    """A template's numbers; None without."""
    if template is None:
        return None
    return read_numbers(template, numbers, first)


def entry(plan: Plan) -> Any:
    """The compiled function of a plan, with its LLVM code (`inspect_llvm`)."""
    c_, quiet_, walls_, outside_, circuit_, filter_ = sections(plan)
    h, record, spread = plan.h, plan.record, plan.spread
    firsts = [0]
    for template in sections(plan):
        firsts.append(firsts[-1] + (0 if template is None else count(template)))
    of_c, of_quiet, of_walls, of_outside, of_circuit, of_filter, _ = firsts

    def located(what, numbers, w, words, out, until):
        c, quiet = read_numbers(c_, numbers, of_c), read_numbers(quiet_, numbers, of_quiet)
        walls, outside = (
            read_numbers(walls_, numbers, of_walls),
            read_numbers(outside_, numbers, of_outside),
        )
        return located_part(what, w, out, until, h, quiet, c, walls, outside, record)

    def gridded(what, numbers, w, words, out, until):
        c, quiet = (
            with_pulls(read_numbers(c_, numbers, of_c)),
            read_numbers(quiet_, numbers, of_quiet),
        )
        outside, circuit = (
            read_numbers(outside_, numbers, of_outside),
            read(circuit_, numbers, of_circuit),
        )
        f = read(filter_, numbers, of_filter)
        return gridded_part(
            what, w, words, out, until, h, quiet, c, circuit, outside, record, f, spread
        )

    return cfunc(SIGNATURE, **COMPILER, **FLAGS)(located if plan.located else gridded)
