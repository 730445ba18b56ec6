"""Runs of ngspice on the very same motion: with a tenth of its tolerance, and that of a compiled circuit."""

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.probe_series import means_of_probes
from harvester.cosimulation.runs import (
    CoupledDevice,
    Start,
    in_ngspice,
    new_drive,
    run_in_this_process,
    start_of_mass,
)
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.noise import child, three_point_grid

# of the error against reltol, as SSHI shows it from 1e-4 to 1e-6; a second-order integrator alone:
# 2/3
ORDER = 0.4


def tolerance_in_workers(
    device: CoupledDevice,
    seeds: Sequence[np.random.SeedSequence],
    n_steps: int,
    burn_in: float,
    deadline: float,
    starts: Sequence[Start],
) -> Iterator[tuple[dict[str, float], Floats]]:
    """The relative errors of E[V^2] and of the load's power that ngspice's tolerance makes, for each seed.

    With them are those of the device's probes (`means_of_probes`), relative to the RMS or its
    square.

    A run is repeated with a tenth of the tolerance on the very same motion (`Drive.kicked`), so
    that the two differ in nothing else and stay together after impacts; the difference is 1 -
    10^-`ORDER` of the error.  A ``shunt`` is doubled meanwhile, which changes the answer by as much
    as it has done itself.  Arguments and errors as of `measure_in_workers`.
    """
    jobs = [
        (device, seed, n_steps, burn_in, deadline, start)
        for seed, start in zip(seeds, starts, strict=True)
    ]
    yield from map_in_workers(_tolerance, jobs)


def _tolerance(
    device: CoupledDevice,
    seed: np.random.SeedSequence,
    n_steps: int,
    burn_in: float,
    deadline: float,
    start: Start,
) -> tuple[dict[str, float], Floats]:
    """`tolerance_in_workers` of one seed, in this process."""
    noise = three_point_grid(seed, n_steps)
    shaking = forcing(device.eqs, device.h, n_steps, np.random.default_rng(child(seed, 1)))
    begin = start_of_mass(device, start)
    first, second = (new_drive(device, noise, burn_in, shaking, begin) for _ in range(2))
    run_in_this_process(device, first, deadline)
    second.kicked[:] = first.kicked
    second.state["follows"] = 1
    finer = dataclasses.replace(device, reltol=0.1 * device.reltol, shunt=2.0 * device.shunt)
    run_in_this_process(finer, second, deadline)
    since = math.ceil(burn_in / (device.h * device.stride) - 1e-6)
    means = [
        (float((drive.samples[since:, 4] ** 2).mean()), float(drive.state[0].load))
        for drive in (first, second)
    ]
    pairs = zip(("V2", "load"), *means, strict=True)
    moments = {
        name: (rough - fine) / fine / (1.0 - 0.1**ORDER) if fine else 0.0
        for name, rough, fine in pairs
    }
    rough, fine = (means_of_probes(device.probes, drive) for drive in (first, second))
    return moments, (rough - fine) / sizes_of_probes(fine) / (1.0 - 0.1**ORDER)


def same_motion_means(
    device: CoupledDevice,
    seed: np.random.SeedSequence,
    n_steps: int,
    burn_in: float,
    deadline: float,
    start: Start,
) -> dict[str, tuple[float, float]]:
    """E[V^2] ("V2") and the load's energy in J ("load") of ngspice and of the device's compiled circuit.

    The force on ngspice's mass is that of the compiled circuit's voltages, so that both move alike
    and stay together after impacts.  Arguments as of
    `harvester.cosimulation.runs.measure_in_workers`; raises as
    `harvester.cosimulation.runs.run_in_this_process`.
    """
    circuit = device.compiled
    noise = three_point_grid(seed, n_steps)
    assert circuit is not None, "the circuit is compiled"
    shaking = forcing(device.eqs, device.h, n_steps, np.random.default_rng(child(seed, 1)))
    (motion, state) = circuit.begun(device.eqs, start)
    reference = circuit.trace(
        device.eqs, noise, h=device.h, stride=1, start=motion, state=state, shaking=shaking
    )
    drive = new_drive(device, noise, 0.0, shaking, start_of_mass(device, start))
    drive.kicked[:, 2] = reference.samples[:, 1]
    drive.state["follows"] = 1
    run_in_this_process(device, drive, deadline, in_ngspice(circuit.voltages(state)))
    first = math.ceil(burn_in / device.h)
    taken = drive.kicked[-1, 4] - drive.kicked[first, 4]
    given = (reference.square[-1] - reference.square[first]) / circuit.resistance
    squares = (float((path.V[first:] ** 2).mean()) for path in (drive.path(), reference))
    return {"V2": (next(squares), next(squares)), "load": (float(taken), float(given))}


def sizes_of_probes(means: Floats) -> Floats:
    """The scale of the error of each of the means of probes, of the same shape (probes, 4).

    Never 0.
    """
    square = means[:, 1:2]
    size = np.hstack([np.sqrt(square), square, np.sqrt(square), np.sqrt(square)])
    return np.where(size > 0.0, size, 1.0)
