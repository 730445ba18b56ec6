"""Runs of a coupled device in ngspice: in this process, or in workers, so that a crash is an error of that run only.

Long because a run, its means and its control variate share one device.
"""

import dataclasses
import itertools
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.load_elements import is_coil, without_needless_resistances
from harvester.cosimulation.lockstep.drive import Drive
from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger, ledger_of
from harvester.cosimulation.ngspice.locate_libngspice import find_library
from harvester.cosimulation.probe_series import means_of_probes, vectors_of
from harvester.cosimulation.worker_pool import ahead, map_in_workers, worker_count
from harvester.equations.coefficients import Equations
from harvester.equations.scales import Scales
from harvester.errors import UnboundedResponseError
from harvester.mechanics.kernels.circuit_control_variates import path_controls
from harvester.mechanics.kernels.forcing import coarse_forcing, filtered, forcing
from harvester.mechanics.kernels.moments import Moments, from_path
from harvester.mechanics.kernels.noise import child, coarsened, gaussian_grid, three_point_grid
from harvester.mechanics.kernels.path import Path
from harvester.mechanics.trace import mechanics_of, trace
from harvester.netlists import for_ngspice
from harvester.netlists.load_circuit import LoadCircuit, load_circuit
from harvester.netlists.probes import Probe
from harvester.scene.load import Load

# x, x', V and the voltage of Csmooth; then the state of a compiled circuit, where runs begin in
# that
Start = tuple[Any, ...]

if TYPE_CHECKING:
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.mechanics.kernels.ideal_circuit import IdealCircuit


@dataclass(frozen=True)
class CoupledDevice:
    """A mass and a load circuit that the piezo couples, and how their runs are made.

    ``eqs`` are the nondimensional equations, ``scales`` their SI scales, ``load`` the circuit;
    ``h`` is the nondimensional step, ``stride`` the kicks between readings. A run that makes less
    than a kick a second over ``patience`` seconds is given up; ``reltol`` is ngspice's tolerance
    for a netlist; ``gaussian`` draws Gaussian noise, if the ensemble's three-point noise would do.
    ``ideal`` is the load without ngspice, made of ideal elements or compiled; ``ngspice_rule``
    states that the load resistor with ngspice follows its integration rule; ``probes`` are further
    quantities of the circuit; ``trapezoidal`` see
    `harvester.cosimulation.ngspice.deck.integration_options`; ``coarse``: on noise made for h/2;
    ``shunt`` is a capacitance from each node to ground, of the piezo's, without which ngspice may
    not converge.
    """

    eqs: Equations
    scales: Scales
    load: LoadCircuit
    h: float
    stride: int
    patience: float = 30.0
    reltol: float = for_ngspice.RELTOL
    gaussian: bool = False
    ideal: "IdealCircuit | CompiledCircuit | None" = None
    ngspice_rule: bool = False
    probes: tuple[Probe, ...] = ()
    trapezoidal: bool = False
    shunt: float = 0.0
    coarse: bool = False

    @property
    def compiled(self) -> "CompiledCircuit | None":
        """The load without ngspice, if it is compiled."""
        from harvester.circuits.compiled_circuit import CompiledCircuit

        return self.ideal if isinstance(self.ideal, CompiledCircuit) else None

    def coarser(self) -> "CoupledDevice":
        """The same device at twice the step on the same noise: they differ by three times the bias of h."""
        return dataclasses.replace(
            self, h=2.0 * self.h, stride=max(self.stride // 2, 1), coarse=True
        )


@dataclass(frozen=True)
class TrajectoryMeans:
    """Time averages of one trajectory after the burn-in, over each of its blocks.

    ``load_power`` (W), shape (blocks,), is that of Rload; ``steps`` counts those of ngspice;
    ``control`` is the control variate: the same moments without ngspice, on the same noise.
    ``probed``, shape (probes, 4), has the mean, the mean square, the least and the largest of each
    of the device's probes, in units of V, A or W.
    """

    moments: Moments
    load_power: Floats
    steps: int
    ledger: EnergyLedger
    control: Moments | None = None
    probed: Floats | None = None


def path_in_this_process(
    device: CoupledDevice, noise: Floats, shaking: Floats | None = None
) -> Path:
    """The trajectory of one run on a noise grid, computed in this process.

    See `run_in_this_process`.
    """
    return run_in_this_process(device, new_drive(device, noise, shaking=shaking)).path()


def new_drive(
    device: CoupledDevice,
    noise: Floats,
    burn_in: float = math.inf,
    shaking: Floats | None = None,
    start: Start | None = None,
) -> "Drive":
    """The mass of one run on a noise grid, from ``start``.

    None: at rest in the scene's first resting place.

    The energy balance begins at the nondimensional time ``burn_in``; ``shaking`` as of `Drive`.
    """
    return Drive(
        device.eqs,
        volts=device.scales.volts,
        w0=device.scales.frequency,
        noise=noise,
        h=device.h,
        stride=device.stride,
        start=start,
        free=not device.load.linear,
        since=burn_in,
        shaking=shaking,
    )


def run_in_this_process(
    device: CoupledDevice,
    drive: "Drive",
    deadline: float = math.inf,
    nodes: Mapping[str, float] | None = None,
) -> "Drive":
    """Run ngspice with the mass in lock-step, in this process; returns the finished drive.

    ``nodes`` are voltages (V) and inductors' currents (A) at the beginning by name; with them, or
    with none of them, the drive keeps the last ones.

    Raises CircuitError when ngspice refuses the circuit, does not converge or comes no further;
    OutOfTimeError if it has not ended at the ``deadline`` of `time.monotonic`;
    UnboundedResponseError when the motion left the finite numbers.
    """
    from harvester.cosimulation.ngspice.deck import build_deck
    from harvester.cosimulation.ngspice.trial import checked_ngspice

    scales = device.scales
    x, _, voltage, charge = (scales.volts * quantity for quantity in drive.start[:4])
    if nodes is not None:
        drive.currents = {name: current for name, current in nodes.items() if is_coil(name)}
        nodes = {name: voltage for name, voltage in nodes.items() if name not in drive.currents}
    load = without_needless_resistances(device.load, 1.0 / (scales.frequency * scales.capacitance))
    deck = build_deck(
        load,
        scales.capacitance,
        step=device.h / scales.frequency,
        duration=drive.duration,
        start=(x, voltage, charge),
        volts=scales.volts,
        reltol=device.reltol,
        nodes=nodes,
        probes=vectors_of(device.probes),
        trapezoidal=device.trapezoidal,
        keeps=len(drive.start) == 4,
        shunt=device.shunt * scales.capacitance,
    )
    checked_ngspice().run_driven(deck, drive, device.patience, deadline)
    if not np.isfinite(drive.samples).all():
        raise UnboundedResponseError(
            "the response grows without bound: it left the finite numbers; add damping"
        )
    return drive


class _Averages(NamedTuple):
    """How long a trajectory is, and which averages are made of it, as of `measure_in_workers`."""

    n_steps: int
    burn_in: float = 0.0
    blocks: int = 1
    with_control: bool = False
    deadline: float = math.inf


def _measure(
    device: CoupledDevice, seed: np.random.SeedSequence, start: Start, averages: _Averages
) -> TrajectoryMeans:
    """The means of one trajectory, in this process."""
    n_steps, burn_in, blocks, with_control, deadline = averages
    noise = _noise(device, seed, n_steps)
    shaking = _shaking(device, seed, n_steps)
    drive = new_drive(device, noise, burn_in, shaking, start_of_mass(device, start))
    run_in_this_process(device, drive, deadline, _nodes_at(device, start))

    moments = from_path(device.eqs, drive.path(), burn_in, blocks)
    ledger = ledger_of(drive.state[0], device.scales, drive.smoothing, device.load.linear)
    load = np.array([ledger.load])
    if blocks > 1:
        load, controls = _blocks(drive, burn_in, blocks, _new_parts(device, seed, n_steps))
        moments = dataclasses.replace(moments, controls=controls)
    return TrajectoryMeans(
        moments=moments,
        load_power=load,
        steps=int(drive.state[0].accepted),
        ledger=ledger,
        control=_control(device, noise, shaking, burn_in, start, blocks) if with_control else None,
        probed=means_of_probes(device.probes, drive) if device.probes else None,
    )


def _noise(device: CoupledDevice, seed: np.random.SeedSequence, n_steps: int) -> Floats:
    """The variates of all kicks; a coarse device has those of two fine steps together."""
    grid = gaussian_grid if device.gaussian else three_point_grid
    return coarsened(grid(seed, 2 * n_steps)) if device.coarse else grid(seed, n_steps)


def _shaking(device: CoupledDevice, seed: np.random.SeedSequence, n_steps: int) -> Floats | None:
    """The accelerations of excitation other than white noise."""
    made = coarse_forcing if device.coarse else forcing
    return made(device.eqs, device.h, n_steps, np.random.default_rng(child(seed, 1)))


def _new_parts(device: CoupledDevice, seed: np.random.SeedSequence, n_steps: int) -> Floats | None:
    """The states of coloured noise and their new parts, for controls; None of other noise."""
    if device.eqs.coloured is None or device.coarse:
        return None
    return filtered(device.eqs, device.h, n_steps, np.random.default_rng(child(seed, 1)))


def start_of_mass(device: CoupledDevice, start: Start) -> Start:
    """A start for a `Drive`: that of several modes without the state of the compiled circuit."""
    if device.compiled is None or len(start) <= 4:
        return start
    higher = start[4][len(device.compiled.rest) :]
    return (*start[:4], higher) if higher.size else start


def _nodes_at(device: CoupledDevice, start: Start) -> dict[str, float] | None:
    """The voltages of ngspice's nodes (V) at a start that has a state of the compiled circuit."""
    compiled = device.compiled
    return None if compiled is None or len(start) <= 4 else in_ngspice(compiled.voltages(start[4]))


def in_ngspice(voltages: dict[str, float]) -> dict[str, float]:
    """Voltages of a compiled circuit's nodes by the names that ngspice has for them.

    It finds those of junctions.
    """
    return {name: value for name, value in voltages.items() if "#" not in name}


def _blocks(
    drive: "Drive", burn_in: float, blocks: int, new: Floats | None
) -> tuple[Floats, Floats]:
    """The load's power (W), shape (blocks,), and the controls of the blocks of `from_path`.

    ``new``: for `filtered`.
    """
    state = drive.state[0]
    h, stride = float(state.h), int(state.stride)
    first = math.ceil(burn_in / (h * stride) - 1e-6)
    n_steps = (len(drive.samples) - first) // blocks * stride
    edges = first * stride - 1 + n_steps * np.arange(blocks + 1)
    load = np.diff(drive.kicked[edges, 4]) / (n_steps * h / float(state.w0))
    rows = edges[:-1, None] + np.arange(n_steps + 1)
    states = np.moveaxis(drive.kicked[rows, :4], -1, 0)
    begun = None if new is None else new[:, rows[:, 1:]]  # kick k is at the time (k + 1) h
    return load, path_controls(drive.eqs, states, drive.noise[rows[:, :-1]], n_steps * h, begun)


def _control(
    device: CoupledDevice,
    noise: Floats,
    shaking: Floats | None,
    burn_in: float,
    start: Start,
    blocks: int,
) -> Moments:
    """The control variate: the same means without ngspice, of the ideal circuit or of the load resistor."""
    from harvester.circuits.compiled_circuit import CompiledCircuit

    if isinstance(device.ideal, CompiledCircuit):
        return device.ideal.path_moments(
            device.eqs,
            noise,
            h=device.h,
            stride=device.stride,
            discard=burn_in,
            batches=blocks,
            start=start,
            shaking=shaking,
        )
    eqs, rule = device.eqs, device.ngspice_rule
    start = (0.0, 0.0, 0.0, 0.0) if rule else start
    begin = *mechanics_of(eqs).started(start), start[3]
    path = trace(
        eqs,
        noise,
        h=device.h,
        stride=device.stride,
        start=begin,
        shaking=shaking,
        circuit=device.ideal,
        ngspice_rule=rule,
    )
    return from_path(eqs, path, burn_in, blocks, device.ideal)


def warm_up_workers(device: CoupledDevice, with_control: bool = False) -> float:
    """Start the workers and compile the code of this device's runs; returns the seconds.

    The load is a resistor here: a netlist is nothing to compile, and may be slow.

    Raises MissingProgramError when ngspice is not installed.
    """
    begin = time.perf_counter()
    find_library()
    device = _with_resistor(device)
    seeds = [np.random.SeedSequence(0)] * worker_count()
    list(measure_in_workers(device, seeds, 4 * device.stride, 0.0, with_control))
    return time.perf_counter() - begin


def _with_resistor(device: CoupledDevice) -> CoupledDevice:
    """The device with a load resistor, which needs no time."""
    resistance = 1.0 / (device.scales.capacitance * device.scales.frequency)
    return dataclasses.replace(device, load=load_circuit(Load(resistance=resistance)), probes=())


@contextmanager
def compiled_beforehand(device: CoupledDevice) -> Iterator[None]:
    """A worker compiles runs' code for a compiled circuit, while this process compiles the rest."""
    from harvester.circuits.substeps import follow

    if device.compiled is None:
        yield
        return
    start = (device.eqs.resting_places[0], 0.0, 0.0, 0.0)
    averages = _Averages(4 * device.stride, with_control=True)
    given = _with_resistor(device), np.random.SeedSequence(0), start, averages
    with ahead((_compile_follow, ()), (_measure, given)) as first:
        follow.elsewhere = first or follow.elsewhere
        yield


def _compile_follow() -> None:
    """Compile the circuit steps, for the cache."""
    from harvester.circuits.substeps import follow

    assert follow.address


def path_in_worker(device: CoupledDevice, noise: Floats, shaking: Floats | None = None) -> Path:
    """The trajectory of one run on a noise grid, computed in a worker process."""
    find_library()
    return next(map_in_workers(path_in_this_process, [(device, noise, shaking)]))


def measure_in_workers(
    device: CoupledDevice,
    seeds: Sequence[np.random.SeedSequence],
    n_steps: int,
    burn_in: float,
    with_control: bool = False,
    deadline: float = math.inf,
    blocks: int = 1,
    starts: Sequence[Start] | None = None,
) -> Iterator[TrajectoryMeans]:
    """Run one trajectory of ``n_steps`` steps (an even number) for each seed in the workers.

    Yields means in order.

    Time averages begin at the nondimensional time ``burn_in``, over equal ``blocks``, with controls
    if these are more than one; ``with_control`` adds the control variate.  Trajectories begin in
    ``starts``, one for each seed, or at rest in each of the scene's resting places in turn.

    Raises CircuitError when ngspice refuses the circuit, does not converge, comes no further for
    ``device.patience`` seconds, or dies; OutOfTimeError for the first run that has not ended at the
    ``deadline`` of `time.monotonic`.
    """
    resting = itertools.cycle((x, 0.0, 0.0, 0.0) for x in device.eqs.resting_places)
    averages = _Averages(n_steps, burn_in, blocks, with_control, deadline)
    jobs = zip(seeds, resting if starts is None else starts, strict=False)
    yield from map_in_workers(_measure, [(device, seed, start, averages) for seed, start in jobs])


def ngspice_version() -> tuple[str, str]:
    """Version of the ngspice library as a worker process finds it, and its fault by its trial (""; none)."""
    return next(map_in_workers(_version, [()]))


def _version() -> tuple[str, str]:
    from harvester.cosimulation.ngspice.trial import versions

    return versions()
