"""The plan of a scene's compiled part, and its numbers: kernels, step and outside actions."""

import dataclasses
import math
from typing import NamedTuple, Protocol

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_part import (
    CircuitTables,
    NetlistNumbers,
    circuit_tables,
    netlist_numbers,
)
from harvester.circuits.compiled_circuit import CompiledCircuit, compiled_circuit
from harvester.devices.fmu import fixed_scales
from harvester.devices.fmu.fixed_scales import Units
from harvester.equations.coefficients import Equations
from harvester.equations.effects import UNIT, unknown_to
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.errors import CannotServeError, InputError, invalid
from harvester.mechanics.kernels.coefficients import coefficients
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.shaking import drawn_record, filter_of
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.mechanics.part import gridded, located
from harvester.mechanics.part.entry import Plan, sections
from harvester.mechanics.part.located import Wall
from harvester.mechanics.part.numbers import names, values
from harvester.mechanics.part.outside_forces import Outside
from harvester.mechanics.part.part_state import OUT

INSIDE = "inside"
OUTSIDE = "outside"
NETLIST = "netlist"  # inside, and the netlist itself in place of its ideal circuit
CIRCUITS = (INSIDE, OUTSIDE, NETLIST)
OPEN_LOAD = 1e12  # ohm, of an electrical port without a load
LONGEST_RECORD = 125_000  # accelerations inside the part: numba keeps 1 MB in its code
IN_REPORT = "IMPACTS", "IMPACT_TIME", "SIZE"  # of the report, which the C program knows
NO_STOPS = dict.fromkeys(
    ("r", "gap", "pull", "high", "r_high", "pull_high", "k", "c", "n1", "n2", "n12")
)


class CompiledPart(NamedTuple):
    """A plan, the names of its numbers followed by those of its `Units`, and their values.

    A netlist inside is a ``board`` with its ``tables``.
    """

    plan: Plan
    names: list[str]
    values: list[float]
    board: CompiledCircuit | None = None
    tables: CircuitTables | None = None

    @property
    def step(self) -> float:
        """The inner step, nondimensional."""
        return self.plan.h

    @property
    def located(self) -> bool:
        """Whether impacts are located, rather than on a grid."""
        return self.plan.located

    @property
    def fastest(self) -> float:
        """The greatest frequency of resonance and drive that the inner step resolves."""
        resolved = located.RESOLVED if self.plan.located else gridded.RESOLVED
        return max(resolved / self.plan.h, self.plan.outside.drive_frequency or 0.0)

    @property
    def report_places(self) -> dict[str, int]:
        """The places of `IN_REPORT` in the report."""
        return {name: int(OUT[name]) for name in IN_REPORT}

    @property
    def model(self) -> dict[str, int]:
        """The numbers of a user's model, which a scene's device lacks."""
        return {"MODEL": 0, "MODEL_AT": 0, "MODEL_STATES": 0, "MODEL_SIZE": 0}


class AnyPart(Protocol):
    """The facts of a compiled part that its C program needs, as of `CompiledPart`."""

    @property
    def names(self) -> list[str]:
        """The names of its numbers."""

    @property
    def values(self) -> list[float]:
        """The numbers."""

    @property
    def tables(self) -> CircuitTables | None:
        """Those of a netlist inside."""

    @property
    def step(self) -> float:
        """The inner step."""

    @property
    def located(self) -> bool:
        """Whether impacts are located."""

    @property
    def fastest(self) -> float:
        """The greatest frequency."""

    @property
    def report_places(self) -> dict[str, int]:
        """The places of `IN_REPORT` in the report."""

    @property
    def model(self) -> dict[str, int]:
        """The numbers of a user's model."""


def check(problem: Problem) -> None:
    """Raise InputError for a nondimensional scene, CannotServeError for an absent effect."""
    if not problem.physical:
        raise InputError(
            "the scene must be a device, with [oscillator] and [piezo], but is nondimensional"
        )
    left_out = unknown_to(UNIT)
    absent = [name.replace("_", " ") for name in problem.effects if name in left_out]
    if absent:
        raise CannotServeError(
            f"{UNIT} has one mode, and cannot model {' and '.join(absent)}: leave it out"
        )


def part_of(problem: Problem, scales: Scales, circuit: str = INSIDE, seed: int = 0) -> CompiledPart:
    """The compiled part of a problem in fixed ``scales``, with a ``circuit`` as of `export_fmu`.

    ``seed`` draws the noise record for a tabulated PSD.
    """
    eqs = fixed_scales.equations(problem, scales)
    units = fixed_scales.units(problem, scales)
    load: IdealCircuit | NetlistNumbers | None = None
    board = tables = None
    if circuit == OUTSIDE:
        eqs = dataclasses.replace(eqs, mu=_port_mu(problem, problem, scales))
    elif problem.netlist:
        load = None if circuit == NETLIST else fixed_scales.circuit(problem, scales)
        if load is None:
            board = _board(problem)
            tables = circuit_tables(board, step_of(eqs, board))
            load = tables.numbers
    elif circuit == NETLIST:
        raise invalid("`circuit`", "be inside or outside for a load without a netlist", circuit)
    plan = _plan(eqs, load, circuit == OUTSIDE, step_of(eqs, load), seed)
    return CompiledPart(
        plan=plan,
        names=[*_names(plan), *Units._fields],
        values=[*numbers(plan), *units],
        board=board,
        tables=tables,
    )


def _board(problem: Problem) -> CompiledCircuit:
    """The load's netlist, compiled; CannotServeError for an element of another kind."""
    load = problem.circuit
    assert load, "a netlist is a circuit"
    try:
        return compiled_circuit(load, problem.scales)
    except CannotServeError as error:
        raise CannotServeError(
            f"an FMU must have a netlist of elements that engine 'compiled' has, but {error}: "
            "leave the load to the importer with circuit outside"
        ) from None


def numbers(plan: Plan) -> list[float]:
    """The numbers of a plan in the order of the compiled function."""
    return [number for template in sections(plan).values() for number in values(template)]


def _names(plan: Plan) -> list[str]:
    """Their names, such as ``c.mu``."""
    return [
        f"{label}.{name}" for label, template in sections(plan).items() for name in names(template)
    ]


def step_of(eqs: Equations, circuit: object = None) -> float:
    """The inner step, nondimensional."""
    return step_from_rest(eqs, located.STEP if is_located(eqs, circuit) else gridded.STEP)


def is_located(eqs: Equations, circuit: object) -> bool:
    """Whether impacts are located between steps of high order; else a grid of steps is used."""
    return not eqs.has_new_noise and not circuit and eqs.stop_stiffness is None


def _plan(eqs: Equations, circuit: object, outside: bool, h: float, seed: int) -> Plan:
    """The templates of the effects that the equations have."""
    c = coefficients(eqs)
    record, spacing = _record(eqs, h, seed)
    actions = Outside(
        a=0.0,
        slope=0.0,
        since=0.0,
        drive=eqs.drive,
        drive_frequency=eqs.drive_frequency,
        current=0.0 if outside else None,
        spacing=spacing,
        record=record,
    )
    low, high = eqs.rigid_stops
    return Plan(
        located=is_located(eqs, circuit),
        h=h,
        c=c,
        quiet=c._replace(**NO_STOPS),
        low=_wall(low, eqs.restitution, 1.0),
        high=_wall(high, eqs.opposite_restitution, -1.0),
        outside=actions,
        circuit=circuit,
        filter=None if eqs.coloured is None else filter_of(eqs, h)._replace(tone=None),
    )


def _wall(x: float, restitution: float | None, side: float) -> Wall | None:
    """A rigid stop; None for one that is absent, at infinity."""
    return None if restitution is None or not math.isfinite(x) else Wall(x, restitution, side)


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
            f"an FMU has a record of at most {LONGEST_RECORD} steps inside, but this one needs "
            f"{count}: shorten it, or give the acceleration through the input"
        )
    return np.ascontiguousarray(record.at_even_times(count)), record.period / count


def numbers_at(changed: Problem, first: Problem, part: CompiledPart) -> list[float] | None:
    """The numbers of a changed scene at the first one's scales; None if effects differ."""
    scales = first.scales
    plan = part.plan
    eqs = fixed_scales.equations(changed, scales)
    units = fixed_scales.units(changed, scales)
    circuit: IdealCircuit | NetlistNumbers | None = None
    outside = plan.outside.current is not None
    if outside:
        eqs = dataclasses.replace(eqs, mu=_port_mu(first, changed, scales))
    elif part.board is not None:
        if changed.circuit != first.circuit or changed.scales.capacitance != scales.capacitance:
            return None  # the tables are of these values
        circuit = netlist_numbers(part.board, units.volts)
    elif changed.netlist:
        circuit = fixed_scales.circuit(changed, scales)
    again = _plan(eqs, circuit, outside, plan.h, 0)
    if _names(again) != _names(plan):
        return None
    return [*numbers(again), *units]


def _port_mu(first: Problem, changed: Problem, scales: Scales) -> float:
    """The rate 1/(R Cp w0) of a port: the first scene's load, the changed one's capacitance."""
    load = first.scene.load
    resistance = OPEN_LOAD if load is None else load.resistance or OPEN_LOAD
    return 1.0 / (resistance * changed.scene.modal.capacitance * scales.frequency)
