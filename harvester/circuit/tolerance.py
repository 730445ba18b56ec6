"""What ngspice's tolerance does to the moments: runs repeated with a tenth of it, on the very same motion."""

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from harvester.circuit.runs import CoupledDevice, Start, new_drive, run_in_this_process
from harvester.circuit.worker_pool import map_in_workers
from harvester.mechanics.kernels.noise import child, three_point_grid
from harvester.mechanics.kernels.shaking import forcing

ORDER = 2.0 / 3.0  # of the error against reltol: a step of (reltol)^(1/3), and an integrator of second order


def tolerance_in_workers(
    device: CoupledDevice,
    seeds: Sequence[np.random.SeedSequence],
    kicks: int,
    burn_in: float,
    deadline: float,
    starts: Sequence[Start],
) -> Iterator[dict[str, float]]:
    """The relative errors of E[V^2] and of the load's power that ngspice's tolerance makes, for each seed.

    A run is repeated with a tenth of the tolerance on the very same motion (`Drive.kicked`), so that the two differ in
    nothing else and stay together after impacts; the difference is 1 - 10^-`ORDER` of the error.  Arguments and errors
    as of `measure_in_workers`.
    """
    jobs = [(device, seed, kicks, burn_in, deadline, start) for seed, start in zip(seeds, starts, strict=True)]
    yield from map_in_workers(_tolerance, jobs)


def _tolerance(
    device: CoupledDevice, seed: np.random.SeedSequence, kicks: int, burn_in: float, deadline: float, start: Start
) -> dict[str, float]:
    """`tolerance_in_workers` of one seed, in this process."""
    noise = three_point_grid(seed, kicks)
    shaking = forcing(device.eqs, device.h, kicks, np.random.default_rng(child(seed, 1)))
    first, second = (new_drive(device, noise, burn_in, shaking, start) for _ in range(2))
    run_in_this_process(device, first, deadline)
    second.kicked[:] = first.kicked
    second.state["follows"] = 1
    run_in_this_process(dataclasses.replace(device, reltol=0.1 * device.reltol), second, deadline)
    since = math.ceil(burn_in / (device.h * device.stride) - 1e-6)
    means = [(float((one.readings[since:, 4] ** 2).mean()), float(one.state[0].load)) for one in (first, second)]
    found = zip(("V2", "load"), *means, strict=True)
    return {name: (rough - fine) / fine / (1.0 - 0.1**ORDER) if fine else 0.0 for name, rough, fine in found}
