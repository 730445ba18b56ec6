"""The preparation of engine `spice` for its first ngspice run: circuit, step, burn-in, and the cheap model."""

import math
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.sampling import run_burn_in, step_and_effort
from harvester.engines.spice.cheap_model import (
    LONGEST_CHARGING,
    cheap_circuit,
    cheap_model,
    pilot_of,
    settled_starts,
)
from harvester.engines.spice.difference import difference_from_ngspice
from harvester.equations.effects import RULE, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import UnboundedResponseError, invalid
from harvester.netlists.for_ngspice import RELTOL
from harvester.netlists.probes import Probe
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.messages.unknown_parts import WELLS

if TYPE_CHECKING:
    from harvester.cosimulation.runs import CoupledDevice, Start
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories

# of a target, and of one where none is given: what a compiled circuit may differ by
NEAR, LOOSE = 0.3, 0.02
HALF = 0.5  # of that, below which half of the runs that tell it do
READING = 0.4  # nondimensional time between readings: V^2 varies on the scale of 1


@dataclass(frozen=True)
class SpiceSetup:
    """The simulation, and the facts that are known before it runs.

    ``burn_in`` is nondimensional; ``pair`` is the cheap model of the same device, settled, which
    makes the same steps (None if no circuit of ideal elements is possible); ``seconds`` is the time
    of all this, without compilation; ``starts`` are states of that model, from which runs begin
    near their stationary law (None: at rest, which takes a ``burn_in_from_rest``); ``unknown`` is a
    part of every mean's error that nothing measures; if runs are short, ``difference`` has the
    relative differences of moments on the same motion (`difference_from_ngspice`).
    """

    device: "CoupledDevice"
    burn_in: float
    diagnostics: list[Diagnostic]
    pair: "RichardsonPair | None"
    seconds: float
    starts: "list[Start] | None" = None
    burn_in_from_rest: float = 0.0
    unknown: str = ""
    difference: dict[str, float] = field(default_factory=dict)

    def from_rest(self) -> "SpiceSetup":
        """The same, with runs that begin at rest and burn in for longer."""
        return replace(self, burn_in=self.burn_in_from_rest, starts=None, difference={})

    def with_shunt(self, shunt: float) -> "SpiceSetup":
        """The same, with a capacitance from each node to ground, of the piezo's (0: none), which is reported."""
        if not shunt:
            return replace(self, diagnostics=[*self.diagnostics])  # which its runs add to
        diagnostic = warning(
            "shunted", share=shunt, capacitance=shunt * self.device.scales.capacitance
        )
        return replace(
            self,
            device=replace(self.device, shunt=shunt),
            diagnostics=[*self.diagnostics, diagnostic],
        )

    def with_tolerance(self, reltol: float, spent: float) -> "SpiceSetup":
        """The same, with another relative tolerance of ngspice, after ``spent`` further seconds."""
        said = note("tolerance_chosen", reltol=reltol)
        kept = [before for before in self.diagnostics if before.code != said.code]
        return replace(
            self,
            device=replace(self.device, reltol=reltol),
            diagnostics=[*kept, said],
            seconds=self.seconds + spent,
        )

    @property
    def short(self) -> bool:
        """Whether runs take a compiled circuit on from its states: near a stop its path and ngspice's soon part."""
        return bool(self.difference)

    @property
    def stays_together(self) -> bool:
        """Whether ngspice and the cheap model agree from settled states: ideal diodes alone, and no stop."""
        from harvester.mechanics.kernels.ideal_circuit import IdealCircuit

        circuit = self.device.ideal
        is_smooth = isinstance(circuit, IdealCircuit) and circuit.hysteresis is None
        return is_smooth and self.starts is not None and not self.device.eqs.has_stop

    @property
    def settling(self) -> float:
        """The burn-in of a run, nondimensional."""
        return 0.0 if self.short else self.burn_in

    @property
    def resistive(self) -> bool:
        """Whether the load is a resistance of the equations, and no netlist."""
        return self.device.eqs.mu is not None

    @property
    def has_controls(self) -> bool:
        """Whether the noise makes sums of mean zero from step to step."""
        return self.device.eqs.has_new_noise and self.device.eqs.modes is None

    @property
    def quantity(self) -> str:
        """The moment that the power is made of."""
        return "V2" if self.resistive else "load"

    def relative_bias(self, name: str) -> float | None:
        """The step bias, as the cheap model shows it; None if absent."""
        return None if self.pair is None else abs(self.pair.relative_bias(name)[0])

    def biases(self, tolerance_measured: bool, followed: int) -> Diagnostic | None:
        """The known part of the step bias, if it is not that of the very same equations.

        ``followed`` are the runs of ngspice with which others made twice the step.
        """
        if self.resistive:
            return None
        known = {"cheap_model": self.pair is not None, "tolerance_measured": tolerance_measured}
        return note("biases", followed=followed, **known, **({"short": True} if self.short else {}))

    def n_steps(self, duration: float) -> int:
        """Steps of a trajectory of that nondimensional duration after its burn-in.

        They make whole readings and periods of the excitation, and are an even number.

        Raises InputError for more than one trajectory may make.
        """
        from harvester.mechanics.ensemble.trajectories import MOST_STEPS

        if duration > MOST_STEPS * self.device.h:
            length = f"{duration / self.device.h:.3g} steps"
            raise invalid("`duration`", f"be at most {MOST_STEPS:.0e} steps", length)
        device = self.device
        repeat = self.device.eqs.shaking_period
        whole = math.lcm(device.stride, 2) if repeat is None else round(repeat / device.h)
        return math.ceil((self.settling + duration) / device.h / whole - 1e-6) * whole

    def chosen(self, within: float, unit: float, physical: bool) -> Diagnostic:
        """The step that was chosen for a target, and why."""
        if self.pair is None:
            return note("step_chosen", within=within, step=self.device.h / unit, physical=physical)
        return step_and_effort(self.pair, self.quantity, within, unit, physical)


def set_up(
    problem: Problem,
    options: MonteCarloOptions,
    reltol: float = RELTOL,
    gaussian: bool = False,
    settled: bool = False,
    probes: tuple[Probe, ...] = (),
) -> SpiceSetup:
    """Step, burn-in and bias come from an ensemble: with a load resistor, or ideal elements, it makes the same steps.

    If runs may begin ``settled``, they begin in states of the cheap model's circuit
    (`settled_starts`).

    MissingProgramError when ngspice is not installed.
    """
    from harvester.circuits.compiled_circuit import TYPICAL
    from harvester.cosimulation.ngspice.locate_libngspice import find_library
    from harvester.cosimulation.runs import CoupledDevice, compiled_beforehand
    from harvester.mechanics.ensemble.loads import CHARGING_TIMES

    find_library()
    eqs = problem.equations
    scales = problem.scales
    unit = problem.units.frequency
    circuit = problem.load_circuit
    repeat = eqs.shaking_period
    charging = CHARGING_TIMES * (circuit.storage or 0.0) * scales.frequency
    ideal, twin, short = cheap_circuit(problem, options, charging, settled and not probes)
    ngspice_rule = unknown_to(RULE).isdisjoint(problem.effects) and eqs.mu is not None
    begin = time.perf_counter()
    device = CoupledDevice(
        eqs, scales, circuit, TYPICAL, 2, ideal=ideal, ngspice_rule=ngspice_rule, probes=probes
    )
    with compiled_beforehand(device):
        pilot, compilation_seconds = pilot_of(problem, options, twin, ngspice_rule)
        begin += compilation_seconds  # which are not counted
        diagnostics = _burn_in(pilot, problem, number(options.budget))
    from_rest = _whole_periods(max(_settled_after(pilot), min(charging, LONGEST_CHARGING)), repeat)
    if charging > LONGEST_CHARGING:
        diagnostics.append(
            warning("charging_cut_short", time=from_rest / unit, storage=circuit.storage)
        )
    pair = None
    time_constant = charging / CHARGING_TIMES
    if eqs.mu is not None or ideal is not None:
        pair, begin = cheap_model(pilot, ideal, from_rest, time_constant, options, begin)
    pilot = pilot if pair is None else pair.trajectories
    short &= pilot.loaded.is_dear
    if not pilot.loaded.is_dear:  # the compiled circuit would settle for too long, if there is one
        ideal = twin
    burn_in = from_rest
    starts = None
    if settled and ideal is not None and pair is not None and eqs.is_shaken_by_white_noise:
        burn_in, starts = settled_starts(pair, time_constant, from_rest, options.seed)
    device = replace(
        device, h=pilot.h, stride=_stride(pilot), reltol=reltol, gaussian=gaussian, ideal=ideal
    )
    unknown = "" if pilot.hopping is None else WELLS
    seconds = time.perf_counter() - begin
    return SpiceSetup(
        device=device,
        burn_in=burn_in,
        diagnostics=diagnostics,
        pair=pair,
        seconds=seconds,
        starts=starts,
        burn_in_from_rest=from_rest,
        unknown=unknown,
        difference=_difference(problem, pilot.h, starts, burn_in, options) if short else {},
    )


def _stride(pilot: "Trajectories") -> int:
    """Kicks between readings: whole readings in a period of the excitation, if it has one."""
    return max(1, round(READING / pilot.h)) if pilot.eqs.shaking_period is None else pilot.stride


def _burn_in(pilot: "Trajectories", problem: Problem, budget: float | None) -> list[Diagnostic]:
    """`run_burn_in`, whose error states the part of a netlist that may feed the motion."""
    try:
        return run_burn_in(pilot, problem, budget)
    except UnboundedResponseError as error:
        if pilot.circuit is None:
            raise
        feeds = "in the netlist, look for a negative capacitor or resistor, or a controlled source, that feeds it"
        raise UnboundedResponseError(f"{error}; {feeds}") from None


def _difference(
    problem: Problem,
    h: float,
    starts: "list[Start] | None",
    settling: float,
    options: MonteCarloOptions,
) -> dict[str, float]:
    """The difference of the compiled circuit from ngspice on the same motion, if runs may be short.

    Else none.
    """
    if starts is None:
        return {}
    enough = NEAR * (number(options.within) or LOOSE)
    difference = difference_from_ngspice(problem, h, starts, settling, options, HALF * enough)
    return difference if difference.get("load", 1.0) < enough else {}


def _settled_after(pilot: "Trajectories") -> float:
    """The time in which a motion from rest settles: that of the pilot, of whose starts others may need longer."""
    from harvester.mechanics.ensemble.burn_in import (
        CORRELATION_TIMES,
        TRANSIENTS,
        slowest_transient,
    )

    slowest = slowest_transient(pilot.eqs) if pilot.eqs.is_steady else 0.0
    return min(pilot.time, TRANSIENTS * CORRELATION_TIMES * slowest) if slowest else pilot.time


def _whole_periods(time: float, period: float | None) -> float:
    """A time rounded up to whole periods of the excitation, if it has one."""
    return time if period is None else period * math.ceil(time / period - 1e-6)


def stand_in(problem: Problem) -> Diagnostic | None:
    """Which device represents a nondimensional scene; None for a physical one."""
    s = problem.scales
    numbers = {
        "mass": s.mass,
        "frequency": s.frequency,
        "capacitance": s.capacitance,
        "coupling": s.coupling,
    }
    return None if problem.physical else note("stand_in", **numbers)
