"""ngspice in worker processes: one ngspice each, so a crash there is an error of that run only."""

import math
import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TypeVar

import loky
import numpy as np
from loky.process_executor import TerminatedWorkerError

from harvester.arrays import Floats
from harvester.circuit.library import find_library
from harvester.circuit.netlist import LoadCircuit
from harvester.errors import CircuitError, UnboundedResponseError
from harvester.mechanics.moments import Moments, from_path
from harvester.mechanics.noise import gaussian_grid
from harvester.mechanics.path import Path
from harvester.scaling import Equations, Scales

T = TypeVar("T")


@dataclass(frozen=True)
class Device:
    """What ngspice and the mass share: nondimensional equations, SI scales, the load circuit, the grid.

    ``h`` is the nondimensional step, ``stride`` the kicks between readings.
    """

    eqs: Equations
    scales: Scales
    load: LoadCircuit
    h: float
    stride: int


@dataclass(frozen=True)
class Measured:
    """One trajectory's means, batch by batch; ``load_power`` (W) is of Rload, over all of it."""

    moments: Moments
    load_power: float
    steps: int


def record(device: Device, noise: Floats) -> Path:
    """One path on a given noise grid, in this process; see `harvester.circuit.lockstep.Drive`."""
    return _run(device, noise, math.inf)[0]


def _run(device: Device, noise: Floats, discard: float) -> tuple[Path, float, int]:
    from harvester.circuit.lockstep import Drive
    from harvester.circuit.ngspice import netlist, ngspice

    scales = device.scales
    free = not device.load.linear
    drive = Drive(device.eqs, scales.volts, scales.frequency, noise, device.h, device.stride, free=free)
    drive.record["energy_from"] = discard / scales.frequency
    step = device.h / scales.frequency
    start = scales.volts * float(drive.record["x"][0])
    ngspice().run_driven(netlist(device.load, scales.capacitance, step, drive.duration, start), drive)
    path = drive.path()
    if not np.isfinite(path.readings).all():
        raise UnboundedResponseError("the response grows without bound: it left the finite numbers; add damping")
    s = drive.record[0]
    measured = float(s.t) - discard / scales.frequency
    power = float(s.energy) / measured if measured > 0.0 else 0.0
    return path, power, int(s.steps)


def _measure(device: Device, seed: np.random.SeedSequence, kicks: int, discard: float, batches: int) -> Measured:
    path, power, steps = _run(device, gaussian_grid(seed, kicks), discard)
    return Measured(from_path(device.eqs, path, discard, batches), power, steps)


def workers() -> int:
    """How many ngspice run at a time: one a core."""
    return os.cpu_count() or 1


def warm_up(device: Device) -> float:
    """Start the workers and compile what this device needs; returns the seconds that took.

    Raises
    ------
    MissingProgramError
        when ngspice is not installed.
    """
    begin = time.perf_counter()
    find_library()
    quiet = np.zeros(4 * device.stride)
    list(_results([_pool().submit(record, device, quiet) for _ in range(workers())]))
    return time.perf_counter() - begin


def record_apart(device: Device, noise: Floats) -> Path:
    """`record`, in a worker process."""
    find_library()
    job: Future[Path] = _pool().submit(record, device, noise)
    return next(_results([job]))


def measure_apart(
    device: Device, seeds: Sequence[np.random.SeedSequence], kicks: int, discard: float, batches: int
) -> Iterator[Measured]:
    """One trajectory of ``kicks`` steps for each seed, in the workers; yields them as they finish.

    Time averages begin at the nondimensional time ``discard``, in ``batches`` parts.

    Raises
    ------
    CircuitError
        when ngspice refuses the circuit, does not converge, or dies.
    """
    jobs = [_pool().submit(_measure, device, seed, kicks, discard, batches) for seed in seeds]
    yield from _results(jobs)


def _pool() -> loky.ProcessPoolExecutor:
    return loky.get_reusable_executor(max_workers=workers(), timeout=60)


def _results(jobs: list[Future[T]]) -> Iterator[T]:
    try:
        for job in jobs:  # in the order asked for, so that sums do not depend on who is first
            yield job.result()
    except TerminatedWorkerError:
        raise CircuitError(
            "ngspice ended abruptly (crash or out of memory) in its worker process: "
            "try a shorter --duration or fewer --trajectories, and check the netlist"
        ) from None
    finally:
        for job in jobs:
            job.cancel()


def ngspice_version() -> str:
    """Version of the ngspice library, as a worker process finds it."""
    job: Future[str] = _pool().submit(_version)
    return next(_results([job]))


def _version() -> str:
    from harvester.circuit.ngspice import ngspice

    return str(ngspice().ngspice_version)
