"""Further quantities of the circuit: probes that a user names, and the power of each element."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harvester.answers.estimate import Estimate, ProbeMeans
from harvester.equations.impact_order import step_order
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.netlists.probes import Probe, element_powers, read_probes
from harvester.presentation.diagnostic import warning
from harvester.presentation.glossary import LEDGER
from harvester.presentation.messages.unknown_parts import STEP, STEP_AND_TOLERANCE, TOLERANCE
from harvester.presentation.sheet import ERROR_OF
from harvester.uncertainty.paired_difference import difference95
from harvester.uncertainty.value import Value, mean_and_error

if TYPE_CHECKING:
    from harvester.cosimulation.periodic_responses import PeriodicResponse
    from harvester.engines.spice.runs import Runs
    from harvester.engines.spice.steady import Steady

PART = f"{LEDGER}circuit_"
MEAN, SQUARE, LEAST, LARGEST = range(4)  # columns of what the runs hand back


@dataclass(frozen=True)
class Watch:
    """The watched quantities: the ``probes`` that were asked for, and for the energy balance the ``parts`` by name."""

    probes: tuple[Probe, ...] = ()
    parts: tuple[tuple[str, tuple[Probe, ...]], ...] = ()

    @property
    def all(self) -> tuple[Probe, ...]:
        """Every probe, in the order in which the runs hand back their means."""
        return (*self.probes, *(probe for _, some in self.parts for probe in some))


def watch_of(problem: Problem, probe: str | Sequence[str], ledger: bool) -> Watch:
    """The watched quantities in the circuit of a problem; InputError for one that is not there."""
    if ledger and problem.netlist is None:
        raise InputError(
            "`ledger` must be used with a netlist, whose elements it lists, but the load is a resistance"
        )
    parts = element_powers(problem.load_circuit) if ledger else {}
    of_elements = tuple((name, tuple(some)) for name, some in parts.items())
    names = [probe] if isinstance(probe, str) else probe
    return Watch(read_probes(names, problem.load_circuit), of_elements)


def with_probes(
    answer: Estimate, problem: Problem, watch: Watch, columns: list[list[Value]], window: float
) -> Estimate:
    """An answer with the probes' results.

    ``columns`` has mean, mean square, least and largest of each, in SI units.

    ``window`` is the time that they cover, in the scene's unit.
    """
    probes = {}
    details = dict(answer.details)
    of_probes = iter(columns)
    for probe in watch.probes:
        scale = 1.0 / problem.in_circuit(probe.unit)
        means_of = next(of_probes)
        unit = probe.unit if problem.physical else ""
        mean, least, largest = (means_of[column].scaled(scale) for column in (MEAN, LEAST, LARGEST))
        probes[probe.name] = ProbeMeans(
            unit, window, mean, means_of[SQUARE].root().scaled(scale), least, largest
        )
    watts = problem.in_circuit("W")
    taken = 0.0
    for name, some in watch.parts:
        means = [next(of_probes)[MEAN] for _ in some]
        value = sum(mean.value for mean in means) / watts
        details[f"{PART}{name}"] = value
        if all(mean.error95 is not None for mean in means):  # errors of several may be of one sign
            details[f"{ERROR_OF}{PART}{name}"] = sum(mean.known_error95 for mean in means) / watts
        taken += value
    if watch.parts and "ledger_circuit" in details:
        details["ledger_circuit_rest"] = details["ledger_circuit"] - taken
    unknown = dict.fromkeys(probe.mean.unknown for probe in probes.values() if probe.mean.unknown)
    warnings = [warning("error_unknown", ", ".join(probes), part=part) for part in unknown]
    return dataclasses.replace(
        answer, details=details, probes=probes, diagnostics=(*answer.diagnostics, *warnings)
    )


def with_sampled_probes(answer: Estimate, problem: Problem, watch: Watch, runs: "Runs") -> Estimate:
    """An answer with the means over independent runs, and their errors.

    The time-step error is the most that runs of ngspice and those of twice the step on the same
    noise leave at 95 %: for a mean a third of their difference, for an extreme, which is of no
    order, the whole.  That of ngspice's tolerance is measured as that of the power.
    """
    from harvester.cosimulation.same_motion import sizes_of_probes

    rows = np.array([run.probed for run in runs.done])
    mean = rows.mean(axis=0)
    bias = np.zeros((len(watch.all), 4))
    unknown = " and ".join(
        [STEP] * (not runs.followed) + [TOLERANCE] * (runs.probed_tolerance is None)
    )
    if not unknown:
        assert runs.probed_tolerance is not None, "it is known"
        coarse = np.array([run.probed for run in runs.coarse])
        low = 1.0 / (2.0 ** step_order(problem.equations) - 1.0)
        changes = [
            [difference95(coarse[:, k, j], rows[:, k, j]).largest95 for j in range(4)]
            for k in range(len(watch.all))
        ]
        bias = np.array(changes) * np.array([low, low, 1.0, 1.0])
        bias += runs.probed_tolerance * sizes_of_probes(mean)

    def value(probe: int, column: int) -> Value:
        average, stderr = mean_and_error(rows[:, probe, column])
        step = None if unknown else float(bias[probe, column])
        return Value(average, stderr, bias=step, dof=len(rows) - 1.0, unknown=unknown)

    columns = [[value(k, j) for j in range(4)] for k in range(len(watch.all))]
    return with_probes(answer, problem, watch, columns, answer.details["duration"])


def with_steady_probes(
    answer: Estimate, problem: Problem, watch: Watch, steady: "Steady"
) -> Estimate:
    """An answer with the means of a periodic response, and errors (step, tolerance) and settling if known."""
    from harvester.cosimulation.coupled_period import NgspiceMap

    columns = [[_steady_value(steady, k, j) for j in range(4)] for k in range(len(watch.all))]
    period = (problem.equations.shaking_period or 0.0) / problem.units.frequency
    return with_probes(
        answer, problem, watch, columns, NgspiceMap.repeats * steady.last.turns * period
    )


def _steady_value(steady: "Steady", probe: int, column: int) -> Value:
    """One number of a periodic response, with errors as of `harvester.engines.refinement`.

    An extreme is of no order: the whole change by the tolerance counts.
    """

    def mean(response: "PeriodicResponse") -> float:
        assert response.probed is not None, "the device has probes"
        return float(response.probed[probe, column])

    if steady.unknown:
        return Value(mean(steady.last), unknown=STEP_AND_TOLERANCE)
    value, error = steady.errors_of(mean, max, remains=1.0)
    return Value(value, bias=error.total)
