"""The plan of a scene's compiled part, and its numbers: which kernels, which step, what acts from outside."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.devices.fmu import fixed_scales
from harvester.devices.fmu.fixed_scales import Units
from harvester.equations.coefficients import Equations
from harvester.equations.effects import SEVERAL_MODES
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.errors import CannotServeError, InputError
from harvester.mechanics.kernels.coefficients import coefficients
from harvester.mechanics.kernels.shaking import deviation, drawn_record, filter_of
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.mechanics.part.entry import Plan, sections
from harvester.mechanics.part.forces import Outside
from harvester.mechanics.part.located import Walls
from harvester.mechanics.part.numbers import names, values

LOCATED_STEP = 0.5  # of the package's default step: the sixth order is then exact to 1e-9 or so
GRID_STEP = 0.2  # of the same, on a grid: the energy of an impact between two kicks is off by a part of the step
OPEN_LOAD = 1e12  # ohm, of an electrical port without a load
LONGEST_RECORD = 500_000  # accelerations inside the part
NO_STOPS = dict.fromkeys(
    ("r", "gap", "pull", "high", "r_high", "pull_high", "k", "c", "n1", "n2", "n12")
)


class Part(NamedTuple):
    """A plan, the names of its numbers followed by those of its `Units`, and their values."""

    plan: Plan
    names: list[str]
    values: list[float]


def check(problem: Problem) -> None:
    """Refuse what a part does not know: InputError for no device, CannotServeError for further modes."""
    if not problem.physical:
        raise InputError(
            "the scene must be a device, with [oscillator] and [piezo], but is nondimensional"
        )
    further = [name.replace("_", " ") for name in problem.effects if name in SEVERAL_MODES]
    if further:
        raise CannotServeError(
            f"an FMU has one mode, and does not know {' and '.join(further)}: leave it out"
        )


def part_of(problem: Problem, scales: Scales, outside: bool = False, seed: int = 0) -> Part:
    """The compiled part of a problem in fixed ``scales``; ``outside`` leaves the load to an electrical port.

    ``seed`` draws the record of noise of a tabulated density.
    """
    eqs, circuit = fixed_scales.equations(problem, scales), None
    if outside:
        eqs = dataclasses.replace(eqs, mu=_port_mu(problem, problem, scales))
    elif problem.netlist is not None:
        circuit = fixed_scales.circuit(problem, scales)
        if circuit is None:
            raise CannotServeError(
                "an FMU has a resistor, or one of the package's ideal circuits, inside, but the load is another "
                "netlist: leave the load to the importer with circuit outside"
            )
    plan = _plan(eqs, circuit, outside, step_of(eqs, circuit), seed)
    units = fixed_scales.units(problem, scales)
    return Part(plan, [*_names(plan), *Units._fields], [*numbers(plan), *units])


def numbers(plan: Plan) -> list[float]:
    """The numbers of a plan in the order in which its compiled function reads them."""
    return [number for some in sections(plan) if some is not None for number in values(some)]


def _names(plan: Plan) -> list[str]:
    """Their names, such as ``c.mu``."""
    labels = ("c", "quiet", "walls", "outside", "circuit", "filter")
    return [
        f"{label}.{name}"
        for label, some in zip(labels, sections(plan), strict=True)
        if some is not None
        for name in names(some)
    ]


def step_of(eqs: Equations, circuit: object = None) -> float:
    """The inner step, nondimensional."""
    return step_from_rest(eqs, LOCATED_STEP if is_located(eqs, circuit) else GRID_STEP)


def is_located(eqs: Equations, circuit: object) -> bool:
    """Whether impacts are located between smooth steps of high order; else a grid of steps is used."""
    return not eqs.has_new_noise and circuit is None and eqs.stop_stiffness is None


def _plan(eqs: Equations, circuit: object, outside: bool, h: float, seed: int) -> Plan:
    """The templates of what the equations have."""
    c = coefficients(eqs)
    located = is_located(eqs, circuit)
    record, spacing = _record(eqs, h, seed)
    low, high = eqs.rigid_stops
    walls = Walls(
        low if math.isfinite(low) else None,
        eqs.restitution,
        high if math.isfinite(high) else None,
        eqs.opposite_restitution,
    )
    acts = Outside(0.0, 0.0, 0.0, eqs.drive, eqs.drive_frequency, 0.0 if outside else None, spacing)
    filter_, spread = None, 0.0
    if eqs.coloured is not None:
        filter_ = filter_of(eqs, h)._replace(tone=None)
        spread = deviation(eqs, h)
    return Plan(
        located=located,
        h=h,
        c=c,
        quiet=c._replace(**NO_STOPS),
        walls=walls,
        outside=acts,
        circuit=circuit,  # type: ignore[arg-type]
        filter=filter_,
        spread=spread,
        record=record,
    )


def _record(eqs: Equations, h: float, seed: int) -> tuple[Floats | None, float | None]:
    """The accelerations of a record, or of one drawn from a density, and the time between them."""
    record = eqs.record
    if eqs.density is not None:
        record = drawn_record(eqs, h, np.random.default_rng(seed))
    if record is None:
        return None, None
    count = max(round(record.period / h), 2)
    if count > LONGEST_RECORD:
        raise CannotServeError(
            f"an FMU has a record of at most {LONGEST_RECORD} steps inside, but this one takes {count}: shorten it, "
            "or give the acceleration through the input"
        )
    return np.ascontiguousarray(record.at_even_times(count)), record.period / count


def numbers_at(changed: Problem, first: Problem, part: Part, outside: bool) -> list[float] | None:
    """The numbers of a changed scene at the scales, the step and the effects of the first; None if those differ."""
    scales, plan = first.scales, part.plan
    eqs = fixed_scales.equations(changed, scales)
    circuit = None
    if outside:
        eqs = dataclasses.replace(eqs, mu=_port_mu(first, changed, scales))
    elif changed.netlist is not None:
        circuit = fixed_scales.circuit(changed, scales)
    again = _plan(eqs, circuit, outside, plan.h, 0)
    if _names(again) != _names(plan):
        return None
    return [*numbers(again), *fixed_scales.units(changed, scales)]


def _port_mu(first: Problem, changed: Problem, scales: Scales) -> float:
    """The rate 1/(R Cp w0) of an electrical port, of the first scene's load and the changed one's capacitance."""
    load = first.scene.load
    resistance = OPEN_LOAD if load is None else load.resistance or OPEN_LOAD
    return 1.0 / (resistance * changed.scene.modal.capacitance * scales.frequency)
