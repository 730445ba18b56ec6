"""The inside of a circuit by engine `compiled`: probes, and the power of each element, along a few trajectories."""

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.spice.probed_answer import PART, watch_of, with_probes
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import note
from harvester.presentation.messages.unknown_parts import COMPILED_CIRCUIT, STEP
from harvester.uncertainty.control_variate import controlled
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.circuits.circuit_path import CircuitPath, TraceArguments
    from harvester.circuits.circuit_period import CircuitPeriod
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.mechanics.ensemble.richardson import RichardsonPair

PATHS, FEWEST = 64, 8  # how many, and how many weigh a control variate
OF_ELEMENTS = 16  # trajectories that determine the powers of elements
AVERAGED = 128.0  # nondimensional time of each
UNKNOWN = f"{STEP} and {COMPILED_CIRCUIT}"


def sampled_paths(
    problem: Problem, pair: "RichardsonPair", circuit: "CompiledCircuit", seed: int, ledger: bool
) -> "list[CircuitPath]":
    """Trajectories on noise of their own, from settled states; a ``ledger`` asks for own steps."""
    from harvester.engines.spice.cheap_model import settled_starts
    from harvester.mechanics.kernels.forcing import forcing
    from harvester.mechanics.kernels.noise import child, three_point_grid

    eqs = problem.equations
    h = pair.trajectories.h
    paths: list[CircuitPath] = []
    n_steps = math.ceil(AVERAGED / h)
    (_, starts) = settled_starts(pair, circuit.memory, AVERAGED, seed)
    for root, start in zip(np.random.SeedSequence([seed, 6]).spawn(PATHS), starts, strict=False):
        shaking = forcing(eqs, h, n_steps, np.random.default_rng(child(root, 1)))
        motion, state = circuit.begun(eqs, start)
        given: TraceArguments = {
            "eqs": eqs,
            "noise": three_point_grid(root, n_steps),
            "h": h,
            "stride": 1,
            "start": motion,
            "state": state,
            "shaking": shaking,
            "kicked": False,
        }
        paths.append(_traced(circuit, given, ledger and len(paths) < OF_ELEMENTS))
    return paths


def _traced(circuit: "CompiledCircuit", given: "TraceArguments", log: bool) -> "CircuitPath":
    """The trajectory of the arguments ``given`` that keeps its states, and its own steps if a ``log`` is asked for."""
    path = circuit.trace(**given, keep=True)
    return (
        dataclasses.replace(circuit.with_own_steps(path, given), states=path.states)
        if log
        else path
    )


def period_paths(
    problem: Problem, response: "CircuitPeriod", circuit: "CompiledCircuit", ledger: bool
) -> "list[CircuitPath]":
    """The trajectory of a periodic response, once around; a ``ledger`` asks for own steps."""
    path = response.path
    assert path.shaking is not None, "the drive is steady"
    given: TraceArguments = {
        "eqs": problem.equations,
        "noise": np.zeros(len(path.shaking) - 1),
        "h": path.h,
        "stride": 1,
        "start": response.coordinates,
        "state": response.state,
        "shaking": path.shaking,
        "kicked": True,
    }
    return [_traced(circuit, given, ledger)]


def with_watched(
    answer: Estimate,
    problem: Problem,
    circuit: "CompiledCircuit",
    paths: "Sequence[CircuitPath]",
    probe: Sequence[str],
    ledger: bool,
) -> Estimate:
    """An answer with the probes and the elements that are asked for.

    Only the sampling part of their errors is known.

    The load's power on the trajectories, whose mean the answer knows, is their control variate.

    Raises InputError for anything that is not there, and for quantities that compiled circuits do
    not know.
    """
    from harvester.circuits.probed_path import mean_powers, probed

    watch = watch_of(problem, probe, ledger)
    unit = problem.in_circuit("W")
    rows = []
    taken = dict[str, Floats]()
    for path in paths:
        values = probed(circuit, path, watch.probes)
        rows.append(
            [values.mean(axis=1), (values**2).mean(axis=1), values.min(axis=1), values.max(axis=1)]
        )
    means = np.array(rows)
    window = len(paths[0].samples) * paths[0].h / problem.units.frequency
    seconds = len(paths[0].samples) * paths[0].h / problem.scales.frequency
    load = np.array([path.square[-1] for path in paths]) / (circuit.resistance * seconds * unit)

    def value(of_paths: Floats) -> Value:
        if len(of_paths) < FEWEST:
            return Value(float(of_paths.mean()), unknown=UNKNOWN)
        known = Value(answer.mean_power.value, answer.mean_power.stderr)
        return dataclasses.replace(
            controlled(of_paths, load[: len(of_paths)], known).value, bias=None, unknown=UNKNOWN
        )

    columns = [[value(means[:, j, k]) for j in range(4)] for k in range(len(watch.probes))]
    answer = with_probes(answer, problem, dataclasses.replace(watch, parts=()), columns, window)
    if not ledger:
        return answer
    powers = [mean_powers(circuit, path) for path in paths if path.own_steps is not None]
    for name in powers[0]:
        if name not in ("rload", "csmooth"):
            whole = name.partition(".")[0]
            taken[whole] = (
                taken.get(whole, 0.0) + np.array([power[name] for power in powers]) / unit
            )
    details = dict(answer.details)
    for name, entries in taken.items():
        mean = value(entries)
        details[f"{PART}{name}"] = mean.value
        if mean.stderr is not None:
            details[f"{PART}{name}_stderr"] = mean.normal_stderr
    said = note("elements_along_paths", paths=len(powers), time=window * problem.units.frequency)
    return dataclasses.replace(answer, details=details, diagnostics=(*answer.diagnostics, said))


def check_watched(
    problem: Problem, circuit: "CompiledCircuit", probe: Sequence[str], ledger: bool
) -> None:
    """Raise InputError for a quantity that is absent or unknown to compiled circuits, before anything is computed."""
    from harvester.circuits.probed_path import probed
    from harvester.mechanics.kernels.compiled import compilation
    from harvester.mechanics.kernels.forcing import forcing
    from harvester.mechanics.trace import at_rest

    eqs = problem.equations
    h = 1e-3
    shaking = forcing(eqs, h, 1, np.random.default_rng(0))
    with compilation():
        start = at_rest(eqs)[:-1]
        path = circuit.trace(eqs, np.zeros(1), h, start=start, shaking=shaking, keep=True)
    probed(circuit, path, watch_of(problem, probe, ledger).probes)
