"""The difference of a rectifier's mean current from ngspice's while the storage is held, if a netlist is a user's own.

At two voltages on the way to the working voltage the compiled rectifier and ngspice's continue from
one state of mass and circuit, with the same excitation.  Their storage capacitors, which are so
large that they are held, gain charges that differ by a part.  Each has its own motion; if noise
throws the mass at a stop, trajectories part at impacts, and both move as the compiled rectifier
lets the mass move (as `harvester.cosimulation.same_motion`).

The rectifiers of this package are compared in tests, and `JUDGE_OF_RECTIFIERS` is their finding.
"""

import dataclasses
import math
import time
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, ConvergenceError, MissingProgramError, OutOfTimeError
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.noise import child, three_point_grid
from harvester.mechanics.kernels.step_size import step_from_rest, whole_steps
from harvester.mechanics.trace import at_rest
from harvester.netlists.for_ngspice import RELTOL_OF_JUDGE, SHUNTS
from harvester.netlists.load_circuit import LoadCircuit, with_parts
from harvester.presentation.messages.unknown_parts import COMPILED_CIRCUIT
from harvester.storage.measured_current import FADED, JUDGE, JUDGE_OF_RECTIFIERS, time_constant
from harvester.storage.rectifier_cut import STORE, held_rectifier
from harvester.uncertainty.paired_difference import difference95, half_if_enough, share95

if TYPE_CHECKING:
    from harvester.cosimulation.runs import CoupledDevice

PARTS = 0.5, 0.9  # of the working voltage
RUNS = 8  # under noise, at each voltage; half of them where these show a difference below `JUDGE`
# time constants of the mass, after those in which the compiled rectifier settles: under a harmonic
# excitation, and under noise, where both begin nearly settled
SETTLING = (3.0, 1.0)
AVERAGED = 4.0
# of the storage capacitor, over the piezo's capacitance: more would be lost in the digits of
# ngspice's voltage
HELD = 1e5
PATIENCE = 60.0  # s, for all runs
JUDGING = 0.3  # of what is left of a budget, for them
FAINT = 0.05  # of the largest current: a difference is told as a part of no less


class Piece(NamedTuple):
    """A piece of a record: its ``samples`` at steps of ``h``, the mass settles in the first so many ``steps``."""

    samples: Floats
    steps: int
    h: float


def error_of_circuit(
    problem: Problem,
    volts: float,
    seed: int = 0,
    piece: Piece | None = None,
    deadline: float | None = None,
) -> tuple[float, str]:
    """Relative difference of a mean current from ngspice's at 95 %, and its unknown part ("": all is known).

    ``volts`` is the working voltage of the storage capacitor.  For this package's netlists it is
    `JUDGE_OF_RECTIFIERS`, and no less of a user's own, whose difference is measured; that is not
    known, and `JUDGE` in its place, if ngspice is missing, gives no answer, or needs longer than
    `PATIENCE` or until a ``deadline`` of `time.perf_counter`. For a record a ``piece`` is run.
    """
    if _is_packaged(problem):
        return JUDGE_OF_RECTIFIERS, ""
    measured = current_difference(problem, volts, seed, piece, deadline)
    if measured is None:
        return JUDGE, COMPILED_CIRCUIT
    return max(measured, JUDGE_OF_RECTIFIERS), ""


def current_difference(
    problem: Problem,
    volts: float,
    seed: int = 0,
    piece: Piece | None = None,
    deadline: float | None = None,
) -> float | None:
    """The largest relative difference from ngspice at the two voltages, at 95 %.

    None if it is not known.
    """
    from harvester.cosimulation.runs import CoupledDevice
    from harvester.cosimulation.worker_pool import map_in_workers

    eqs, scales = problem.equations, problem.scales
    left = PATIENCE if deadline is None else min(deadline - time.perf_counter(), PATIENCE)
    if left <= 0.0:
        return None
    if eqs.record is not None and piece is None:
        return None
    load = held_load(problem.load_circuit, HELD * scales.capacitance)
    h = whole_steps(step_from_rest(eqs), eqs.shaking_period) if piece is None else piece.h
    device = CoupledDevice(
        eqs, scales, load, h, 1, reltol=RELTOL_OF_JUDGE, ideal=compiled_circuit(load, scales)
    )
    seeds = np.random.SeedSequence([seed, 19]).spawn(RUNS if eqs.is_random else 1)
    latest = time.monotonic() + left

    def in_workers(some: Sequence[np.random.SeedSequence]) -> Floats:
        """The gains of ngspice and the compiled circuit, shape (seeds, voltages, 2)."""
        jobs = [(device, seed, part * volts, latest, piece) for seed in some for part in PARTS]
        return np.reshape(list(map_in_workers(_gains, jobs)), (len(some), len(PARTS), 2))

    try:
        judge = partial(_largest_share, random=eqs.is_random)
        largest = half_if_enough(seeds, in_workers, judge, lambda share: share < JUDGE)
    except (CircuitError, MissingProgramError, OutOfTimeError):
        return None
    return None if math.isinf(largest) else largest


def seconds_of_judging(problem: Problem, deadline: float) -> float:
    """The seconds before a ``deadline`` that `error_of_circuit` may need.

    0 for this package's netlists.
    """
    if _is_packaged(problem):
        return 0.0
    return min(JUDGING * max(deadline - time.perf_counter(), 0.0), PATIENCE)


def _is_packaged(problem: Problem) -> bool:
    """Whether the netlist is one of this package, which tests compare."""
    return problem.load_circuit.topology is not None


def _largest_share(gains: list[Floats], random: bool) -> float:
    """The largest relative difference at the voltages, at 95 %; inf if nothing is gained."""
    high, low = np.moveaxis(np.array(gains), 2, 0)
    sizes = low.mean(axis=0)
    if not sizes.max() > 0.0:
        return math.inf
    least = FAINT * float(sizes.max())
    return max(
        share95(difference95(high[:, k], low[:, k], random=random), max(float(size), least))
        for k, size in enumerate(sizes)
    )


def _gains(
    device: "CoupledDevice",
    seed: np.random.SeedSequence,
    volts: float,
    deadline: float,
    piece: Piece | None,
) -> tuple[float, float]:
    """The voltages (V) that a held storage capacitor gains in ngspice and in the compiled circuit, in this process."""
    from harvester.cosimulation.poincare_sections import CoupledState
    from harvester.cosimulation.runs import in_ngspice, new_drive, run_in_this_process

    eqs = device.eqs
    h = device.h
    circuit = device.compiled
    assert circuit is not None, "the circuit is compiled"
    if piece is None:
        unit = time_constant(eqs)
        repeat = eqs.shaking_period
        times = FADED, SETTLING[eqs.is_random], AVERAGED
        first, settling, averaged = (_whole(time * unit, h, repeat) for time in times)
        shaking = forcing(
            eqs, h, first + settling + averaged, np.random.default_rng(child(seed, 1))
        )
    else:
        shaking = piece.samples
        first = piece.steps
        settling = 1
        averaged = len(shaking) - 1 - first - settling
    n_steps = first + settling + averaged
    noise = (
        three_point_grid(seed, n_steps + n_steps % 2)[:n_steps]
        if eqs.is_random
        else np.zeros(n_steps)
    )
    early, late = (None, None) if shaking is None else (shaking[: first + 1], shaking[first:])
    state = circuit.rest
    at = circuit.charge_at(STORE)
    state[at] = held = HELD * device.scales.capacitance * volts
    before = circuit.trace(
        eqs, noise[:first], h=h, stride=1, start=at_rest(eqs)[:-1], state=state, shaking=early
    )
    state = before.state
    state[at] = held
    motion = before.last[:-1]
    path = circuit.trace(eqs, noise[first:], h=h, stride=1, start=motion, state=state, shaking=late)
    scale = device.scales.volts
    section = CoupledState.of_motion(motion, across=(scale * float(before.last[-1]), volts))
    start = section.start(scale)
    for shunt in SHUNTS:
        drive = new_drive(device, noise[first:], 0.0, late, start)
        if eqs.is_random and eqs.has_stop:
            drive.kicked[:, 2] = path.samples[:, 1]
            drive.state["follows"] = 1
        try:
            shunted = dataclasses.replace(device, shunt=shunt)
            run_in_this_process(shunted, drive, deadline, in_ngspice(circuit.voltages(state)))
            break
        except ConvergenceError:
            if shunt == SHUNTS[-1]:
                raise
    high, low = (
        float(store[-1] - store[settling - 1]) for store in (drive.charge, path.voltages[:, 1])
    )
    return high, low


def _whole(duration: float, h: float, repeat: float | None) -> int:
    """Steps of h in a nondimensional duration, of whole periods if shaking has one."""
    each = 1 if repeat is None else round(repeat / h)
    return max(math.ceil(duration / (each * h)), 1) * each


def held_load(load: LoadCircuit, farads: float) -> LoadCircuit:
    """The netlist with a storage capacitor of so many farads and no load.

    For a chip the rectifier alone.
    """
    return with_parts(load, tuple(held_rectifier(load, farads)))
