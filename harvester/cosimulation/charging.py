"""Runs of ngspice from rest and empty capacitors: the charging of the circuit, and the probes meanwhile."""

import dataclasses
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.probe_series import probes_at, values_of
from harvester.cosimulation.runs import CoupledDevice, Start, new_drive, run_in_this_process
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.mechanics.kernels.forcing import coarse_forcing, forcing
from harvester.mechanics.kernels.noise import child, coarsened, gaussian_grid
from harvester.mechanics.kernels.path import Path

COARSER = 10.0  # tolerance of ngspice beside twice the step


@dataclass(frozen=True)
class ChargeRun:
    """The readings of one run from empty: all times in second, voltages in volt (or the probe's unit).

    ``passages``, shape (levels,), are when each level is first reached, infinite if it never is;
    ``curve`` the voltage at the times asked for; ``steps`` those of ngspice; ``smoothing`` the
    capacitance of Csmooth (F).
    """

    passages: Floats
    curve: Floats
    steps: int
    smoothing: float


def first_passages(t: Floats, u: Floats, levels: Floats) -> Floats:
    """When a trajectory u(t), shape (n,), first reaches each of ``levels`` from below.

    Infinite if it never does.

    Between its points the trajectory is a straight line.
    """
    above = np.searchsorted(np.maximum.accumulate(u), levels, side="left")
    passages = np.full(len(levels), math.inf)
    passages[above == 0] = t[0]
    inside = (above > 0) & (above < len(u))
    k = above[inside]
    share = (levels[inside] - u[k - 1]) / (u[k] - u[k - 1])
    passages[inside] = t[k - 1] + share * (t[k] - t[k - 1])
    return passages


def charges_in_workers(
    device: CoupledDevice,
    seeds: Sequence[np.random.SeedSequence],
    n_steps: int,
    levels: Floats,
    times: Floats,
    anywhere: bool,
    deadline: float,
) -> Iterator[tuple[ChargeRun, ChargeRun]]:
    """One run from rest for each seed, and the same one at twice the step and ten times ngspice's tolerance.

    Both are on the same noise; runs begin in each of the resting places in turn.  ``n_steps``, an
    even number, are the steps of a run; ``levels`` and ``times`` as of `ChargeRun`.  The quantity
    is the device's one probe, or without one the voltage of Csmooth.  A record, or a harmonic
    excitation, begins at its beginning, or with ``anywhere`` at a random place.

    Raises as `harvester.cosimulation.runs.measure_in_workers`.
    """
    starts = itertools.cycle((x, 0.0, 0.0, 0.0) for x in device.eqs.resting_places)
    same = n_steps, levels, times, anywhere, deadline
    jobs = [
        (device, seed, *same, start, coarse)
        for seed, start in zip(seeds, starts, strict=False)
        for coarse in (False, True)
    ]
    done = map_in_workers(_charge, jobs)
    for run in done:
        yield run, next(done)


def _charge(
    device: CoupledDevice,
    seed: np.random.SeedSequence,
    n_steps: int,
    levels: Floats,
    times: Floats,
    anywhere: bool,
    deadline: float,
    start: Start,
    coarse: bool,
) -> ChargeRun:
    """One run of `charges_in_workers`, in this process."""
    eqs = device.eqs
    drawn = anywhere or eqs.coloured is not None or eqs.density is not None
    rng = np.random.default_rng(child(seed, 1)) if drawn else None
    noise = gaussian_grid(seed, n_steps)
    if coarse:
        noise = coarsened(noise)
        device = dataclasses.replace(device, h=2.0 * device.h, reltol=COARSER * device.reltol)
    shaking = (coarse_forcing if coarse else forcing)(eqs, device.h, len(noise), rng)
    drive = run_in_this_process(
        device, new_drive(device, noise, shaking=shaking, start=start), deadline
    )
    if device.probes:
        t = drive.series["time"]
        u = values_of(device.probes[0], drive)
    else:
        reading_times = drive.path().t / device.scales.frequency
        t = np.append(0.0, reading_times)
        u = np.append(0.0, drive.charge)
    passages = first_passages(t, u, levels)
    return ChargeRun(
        passages, np.interp(times, t, u), int(drive.state[0].accepted), drive.smoothing
    )


def probed_path_in_worker(
    device: CoupledDevice, noise: Floats, shaking: Floats | None
) -> tuple[Path, Floats]:
    """The trajectory of one run from rest, in a worker process, and its probes then: shape (probes, n)."""
    return next(map_in_workers(_probed_path, [(device, noise, shaking)]))


def _probed_path(
    device: CoupledDevice, noise: Floats, shaking: Floats | None
) -> tuple[Path, Floats]:
    """`probed_path_in_worker` in this process."""
    drive = run_in_this_process(device, new_drive(device, noise, shaking=shaking))
    path = drive.path()
    return path, probes_at(device.probes, drive, path.t / device.scales.frequency)
