"""A device's runs in ngspice, in worker processes: one ngspice each, so a crash there is an error of that run only."""

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.circuit.lockstep.energy_ledger import Ledger, ledger
from harvester.circuit.ngspice.library import find_library
from harvester.circuit.worker_pool import in_order, workers
from harvester.equations.scaling import Equations, Scales
from harvester.errors import UnboundedResponseError, invalid
from harvester.mechanics.kernels.bounds import resting_places
from harvester.mechanics.kernels.moments import Moments, from_path
from harvester.mechanics.kernels.ngspice_rule import trace_ruled
from harvester.mechanics.kernels.noise import child, gaussian_grid, three_point_grid
from harvester.mechanics.kernels.path import Path, trace
from harvester.mechanics.kernels.shaking import forcing
from harvester.netlists.load_circuit import LoadCircuit

if TYPE_CHECKING:
    from harvester.circuit.lockstep.drive import Drive
    from harvester.mechanics.rectifiers.circuit import IdealCircuit


@dataclass(frozen=True)
class Device:
    """What ngspice and the mass share: nondimensional equations, SI scales, the load circuit, the grid.

    ``h`` is the nondimensional step, ``stride`` the kicks between readings; a run that makes less than a kick a second
    over ``patience`` seconds is given up; ``norton`` see `harvester.circuit.ngspice.instance.deck`; ``reltol`` is
    ngspice's tolerance for a netlist; ``gaussian`` draws Gaussian noise, where the ensemble's three-point noise would
    do.  ``ideal`` is the netlist's circuit made of ideal elements, where there is one; ``ruled`` says that the load
    resistor beside ngspice follows its integration rule.
    """

    eqs: Equations
    scales: Scales
    load: LoadCircuit
    h: float
    stride: int
    patience: float = 30.0
    norton: bool = False
    reltol: float = 1e-4
    gaussian: bool = False
    ideal: "IdealCircuit | None" = None
    ruled: bool = False


@dataclass(frozen=True)
class Measured:
    """One trajectory's means; ``load_power`` (W) is of Rload, as in the ledger.

    ``cheap`` are the means of the ensemble's own step, or of the ideal circuit, on the same noise.
    """

    moments: Moments
    load_power: float
    steps: int
    ledger: Ledger
    cheap: Moments | None = None


def record(device: Device, noise: Floats, native: bool = True, shaking: Floats | None = None) -> Path:
    """One path on a given noise grid, in this process; see `harvester.circuit.lockstep.drive.Drive`."""
    return run(device, noise, native=native, shaking=shaking).path()


def run(
    device: Device,
    noise: Floats,
    discard: float = math.inf,
    native: bool = True,
    place: float | None = None,
    shaking: Floats | None = None,
) -> "Drive":
    """A finished run on a noise grid, in this process; its ledger begins at the nondimensional time ``discard``.

    The mass begins at rest at the displacement ``place``; see `harvester.circuit.lockstep.drive.Drive` for None.

    Raises
    ------
    CircuitError
        when ngspice refuses the circuit, does not converge or comes no further.
    UnboundedResponseError
        when the motion left the finite numbers.
    """
    from harvester.circuit.lockstep.drive import Drive
    from harvester.circuit.ngspice.instance import deck, ngspice

    scales, free = device.scales, not device.load.linear
    w0 = scales.frequency
    begin = None if place is None else (place, 0.0, 0.0)
    drive = Drive(device.eqs, scales.volts, w0, noise, device.h, device.stride, begin, free, discard, native, shaking)
    start = scales.volts * float(drive.record["x"][0])
    whole = (device.h / w0, drive.duration, start, device.norton, scales.volts, device.reltol)
    circuit = deck(device.load, scales.capacitance, *whole)
    ngspice().run_driven(circuit, drive, device.patience)
    if not np.isfinite(drive.readings).all():
        raise UnboundedResponseError("the response grows without bound: it left the finite numbers; add damping")
    return drive


def _measure(
    device: Device, seed: np.random.SeedSequence, kicks: int, discard: float, paired: bool, place: float
) -> Measured:
    noise = (gaussian_grid if device.gaussian else three_point_grid)(seed, kicks)
    shaking = forcing(device.eqs, device.h, kicks, np.random.default_rng(child(seed, 1)))
    drive = run(device, noise, discard, place=place, shaking=shaking)
    state = drive.record[0]
    moments = from_path(device.eqs, drive.path(), discard, 1)
    balance = ledger(state, device.scales, drive.smoothing, device.load.linear)
    cheap = _cheap(device, noise, shaking, discard, place) if paired else None
    return Measured(moments, balance.load, int(state.steps), balance, cheap)


def _cheap(device: Device, noise: Floats, shaking: Floats | None, discard: float, place: float) -> Moments:
    """The means without ngspice, on the same noise: of the ideal circuit, or of the load resistor."""
    eqs, h, stride = device.eqs, device.h, device.stride
    if device.ruled:
        return from_path(eqs, trace_ruled(eqs, noise, h, stride), discard, 1)
    if device.ideal is None:
        return from_path(eqs, trace(eqs, noise, h, stride, (place, 0.0, 0.0), shaking), discard, 1)
    from harvester.mechanics.rectifiers.rectifier_path import ideal_moments

    return ideal_moments(device.eqs, device.ideal, noise, device.h, device.stride, discard)


def warm_up(device: Device, paired: bool = False) -> float:
    """Start the workers and compile what this device's runs need; returns the seconds that took.

    Raises
    ------
    MissingProgramError
        when ngspice is not installed.
    """
    begin = time.perf_counter()
    find_library()
    list(measure_apart(device, [np.random.SeedSequence(0)] * workers(), 4 * device.stride, 0.0, paired))
    return time.perf_counter() - begin


def record_apart(device: Device, noise: Floats, shaking: Floats | None = None) -> Path:
    """`record`, in a worker process."""
    find_library()
    return next(in_order(record, [(device, noise, True, shaking)]))


def charging_apart(device: Device, noise: Floats) -> tuple[Floats, Floats]:
    """Times (s) and voltages (V) of the load's capacitor Csmooth on a noise path: how it is charged.

    Raises
    ------
    InputError
        for a load without a capacitor of that name.
    """
    find_library()
    return next(in_order(_charging, [(device, noise)]))


def _charging(device: Device, noise: Floats) -> tuple[Floats, Floats]:
    drive = run(device, noise)
    if drive.smoothing == 0.0:
        raise invalid("load", "have a capacitor Csmooth", device.load.name)
    return drive.path().t / device.scales.frequency, drive.charge


def measure_apart(
    device: Device, seeds: Sequence[np.random.SeedSequence], kicks: int, discard: float, paired: bool = False
) -> Iterator[Measured]:
    """One trajectory of ``kicks`` steps (an even number) for each seed, in the workers; yields them in order.

    Time averages begin at the nondimensional time ``discard``; ``paired`` asks for the same without ngspice too.
    Trajectories begin in each of the scene's resting places in turn.

    Raises
    ------
    CircuitError
        when ngspice refuses the circuit, does not converge, comes no further for ``device.patience`` seconds, or dies.
    """
    places = itertools.cycle(resting_places(device.eqs))
    yield from in_order(_measure, [(device, seed, kicks, discard, paired, next(places)) for seed in seeds])


def ngspice_version() -> str:
    """Version of the ngspice library, as a worker process finds it."""
    return next(in_order(_version, [()]))


def _version() -> str:
    from harvester.circuit.ngspice.instance import ngspice

    return str(ngspice().ngspice_version)
