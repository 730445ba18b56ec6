"""The difference of a compiled circuit from ngspice, on the same motion."""

import dataclasses
import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harvester.engines.options import MonteCarloOptions, number
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, MissingProgramError, OutOfTimeError
from harvester.netlists.for_ngspice import RELTOL, RELTOL_OF_JUDGE, SHUNTS
from harvester.uncertainty.paired_difference import difference95, share95

if TYPE_CHECKING:
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.cosimulation.runs import CoupledDevice, Start

# runs, the fewest that give a difference, and the nondimensional time that each averages over, for
# targets up to `LOOSE`: the statistics of a larger one need less, but no less than `SHORTEST`
RUNS = 8
FEWEST = 3
AVERAGED = 64.0
LOOSE = 0.01
SHORTEST = 16.0
# nondimensional: what they leave out at most, and time constants of the storage capacitor, if these
# are shorter
LONGEST = 300.0
MEMORIES = 2.0
FEWEST_MEMORIES = 0.5
SHARE = 0.25  # of a budget, that these runs may take
# What is tried in turn if ngspice does not converge: its tolerance, and a capacitance from each
# node to ground, of the piezo's.
TRIED = (*((RELTOL_OF_JUDGE, shunt) for shunt in SHUNTS), (RELTOL, 0.0))


def difference_from_ngspice(
    problem: Problem,
    h: float,
    starts: "Sequence[Start]",
    settling: float,
    options: MonteCarloOptions,
    enough: float = 0.0,
    seconds: float | None = None,
) -> dict[str, float]:
    """The relative differences of E[V^2] ("V2") and of the load's power ("load"), the largest at 95 %.

    Runs begin in states of the circuit's own trajectories of the step ``h``, and ``settling`` is
    left out of each. Both move as the compiled circuit lets the mass move, so that they stay
    together near a stop; how the mass answers to the difference is left out, which is of the size
    of the coupling times it.  If a storage capacitor charges for longer than the runs last, only
    the part 1 - exp(-t/(R C)) of its difference has developed, and the difference is divided by it.

    A target above `LOOSE` has shorter runs (`lengths`), and half of the runs are enough if they
    show that the load's power differs by less than ``enough``.
    Runs that have not ended in ``seconds``, or by default in `SHARE` of the budget, are left out.
    Empty if ngspice is missing or gives no answer, or if fewer than `FEWEST` are left.
    """
    circuit, device = _beside(problem, h)
    budget = number(options.budget)
    if seconds is None:
        seconds = math.inf if budget is None else SHARE * budget
    left_out, averaged = lengths(number(options.within), circuit.memory)
    settling = min(settling, left_out)
    n_steps = math.ceil((settling + averaged) / h)
    seeds = np.random.SeedSequence([options.seed, 5]).spawn(RUNS)
    deadline = time.monotonic() + seconds
    jobs = [
        (seed, n_steps, settling, deadline, start)
        for seed, start in zip(seeds, starts, strict=False)
    ]
    come = difference_come(settling, circuit, averaged)
    done = list[dict[str, tuple[float, float]]]()
    differences = dict[str, float]()
    for half in (jobs[: RUNS // 2], jobs[RUNS // 2 :]):
        try:
            more = _means(device, half)
        except (CircuitError, MissingProgramError):
            return {}
        done += more
        if len(done) < FEWEST:
            return {}
        differences = {name: _largest(done, name) / come for name in done[0]}
        if differences["load"] < enough or len(more) < len(half):
            break
    return {name: share for name, share in differences.items() if math.isfinite(share)}


def lengths(within: float | None, memory: float) -> tuple[float, float]:
    """The nondimensional times that a run for a target leaves out at most, and averages over.

    Both are shorter for a target above `LOOSE`: the first is down to `FEWEST_MEMORIES` of the
    storage capacitor's ``memory`` R C, as the part that has not developed is counted.
    """
    if within is None or within <= LOOSE:
        return LONGEST, AVERAGED
    share = LOOSE / within
    return max(share * MEMORIES, FEWEST_MEMORIES) * memory, max(share * AVERAGED, SHORTEST)


def _beside(problem: Problem, h: float) -> "tuple[CompiledCircuit, CoupledDevice]":
    """The compiled circuit of a netlist, and the device in ngspice that follows it."""
    from harvester.circuits.compiled_circuit import compiled_circuit
    from harvester.cosimulation.runs import CoupledDevice

    circuit = compiled_circuit(problem.load_circuit, problem.scales)
    device = CoupledDevice(
        problem.equations,
        problem.scales,
        problem.load_circuit,
        h,
        1,
        reltol=RELTOL_OF_JUDGE,
        ideal=circuit,
    )
    return circuit, device


def difference_come(
    settling: float, circuit: "CompiledCircuit", averaged: float = AVERAGED
) -> float:
    """The part of its difference that a storage capacitor has come to amid the averages after ``settling``."""
    return -math.expm1(-(settling + 0.5 * averaged) / circuit.memory)


def _largest(done: Sequence[dict[str, tuple[float, float]]], name: str) -> float:
    """The relative difference of a moment, the largest at 95 %; infinite of one that is zero."""
    high, low = np.array([means[name] for means in done]).T
    size = float(low.mean())
    return share95(difference95(high, low), size) if size > 0.0 else math.inf


def _means(
    device: "CoupledDevice", jobs: Sequence[tuple[object, ...]]
) -> list[dict[str, tuple[float, float]]]:
    """The means of each run that ends in time, by the first of `TRIED` that ngspice converges with.

    Raises CircuitError if it converges with none.
    """
    from harvester.cosimulation.same_motion import same_motion_means
    from harvester.cosimulation.worker_pool import map_in_workers

    done = list[dict[str, tuple[float, float]]]()
    for reltol, shunt in TRIED:
        tried = dataclasses.replace(device, reltol=reltol, shunt=shunt)
        left = [(tried, *job) for job in jobs[len(done) :]]
        try:
            done.extend(map_in_workers(same_motion_means, left))
        except OutOfTimeError:
            break
        except CircuitError:
            if (reltol, shunt) == TRIED[-1]:
                raise
        else:
            break
    return done
