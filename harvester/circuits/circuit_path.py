"""One recorded trajectory with a compiled circuit as its load (`harvester.mechanics.trace`)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypedDict

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.pointers import advance
from harvester.circuits.substeps import DID, FINEST, N_VOLTAGES, ROOMS, KernelCircuit
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.coefficients import BATCH, Coefficients, State
from harvester.mechanics.kernels.compiled import inlined, version_of
from harvester.mechanics.kernels.driver import aside, drifted, noted
from harvester.mechanics.kernels.offset_stops import move, wall_of
from harvester.mechanics.kernels.path import Path
from harvester.mechanics.modes.modal_circuit import drift_with_course
from harvester.mechanics.modes.modal_step import ModalCoefficients
from harvester.mechanics.trace import follow


@dataclass(frozen=True)
class CircuitPath(Path):
    """A `Path` with a compiled circuit.

    ``voltages`` has those (V) of the piezo, the storage capacitor and the load at its samples,
    shape (n, 3); ``square`` the integral of the load's squared voltage (V^2 s) up to each;
    ``steps`` how many the circuit made, and ``failed`` how many of them did not converge; ``state``
    its last state; ``states`` those of the circuit at the samples, shape (n, length of a state),
    and ``own_steps`` the rows of `harvester.circuits.substeps.logged`, where they are asked for.
    """

    voltages: Floats = field(default_factory=lambda: np.empty((0, N_VOLTAGES)))
    square: Floats = field(default_factory=lambda: np.empty(0))
    steps: int = 0
    failed: int = 0
    state: Floats = field(default_factory=lambda: np.empty(0))
    states: Floats | None = None
    own_steps: Floats | None = None


class NetlistLoad(NamedTuple):
    """A compiled ``circuit`` on a trajectory, at its ``state``; ``other`` is that of a drift aside.

    ``room`` is its workspace. ``counts`` are the integral of the load's squared voltage (V^2 s) so
    far, the circuit's steps, and those that did not converge. At the samples ``voltages``, shape
    (n, 3), and ``square`` are as of `CircuitPath`, and so are ``states``, None unless asked for.
    """

    circuit: KernelCircuit
    state: Floats
    other: Floats
    room: Floats
    counts: Floats
    voltages: Floats
    square: Floats
    states: Floats | None


def load_of(circuit: KernelCircuit, state: Floats, samples: int, keep: bool = False) -> NetlistLoad:
    """The load of a path of so many samples, at a ``state``; ``keep`` asks for the states."""
    return NetlistLoad(
        circuit=circuit,
        state=state,
        other=state.copy(),
        room=np.empty((ROOMS, circuit.length)),
        counts=np.zeros(3),
        voltages=np.empty((samples, N_VOLTAGES)),
        square=np.empty(samples),
        states=np.empty((samples, len(state))) if keep else None,
    )


class ChargeCourse(NamedTuple):
    """A charge's course over a drift, by way of a ``wall`` at the time ``first``."""

    begin: float
    end: float
    wall: float
    first: float


@inlined
def advance_load(load, course, t, count):
    """Advance the circuit along a course of length t, by so many of its shortest steps."""
    circuit = load.circuit
    advance(
        circuit.address,
        circuit.record,
        load.state,
        load.room,
        x=course.begin,
        x1=course.end,
        wall=course.wall,
        first=course.first,
        h=t,
        count=count,
    )
    return load.state[circuit.voltages_at]


@inlined
def _flown(begin, end, wall, first, d, load):
    """Advance the circuit along the charge's course over the interval d: the piezo's voltage."""
    circuit, state = load.circuit, load.state
    # a part of a step ends at its last shortest step; what is added is far above rounding
    count = int(d.t / d.h * FINEST + 1e-4)
    course = ChargeCourse(begin=begin, end=end, wall=wall, first=first)
    voltage = advance_load(load, course, d.t, count)
    if count == FINEST:
        last = len(state) - DID
        for k in range(3):
            load.counts[k] += state[last + k]
    return voltage / circuit.volts


@version_of(drifted, c=Coefficients, load=NetlistLoad)
def _with_mass(s, z, d, c, a, load):
    s1, did = move(s, d, c, a)
    wall, first = (wall_of(did.speed, c), did.time) if did.number > 0.0 else (s1.x, d.t)
    voltage = _flown(s.x, s1.x, wall, first, d, load)
    return State(s1.x, s1.v, voltage), load, did


@version_of(drifted, c=ModalCoefficients, load=NetlistLoad)
def _with_modes(s, z, d, c, a, load):
    did, course = drift_with_course(s, z, d, c, a)
    wall, first = (course.wall, course.first) if did.number > 0.0 else (course.end, d.t)
    voltage = _flown(course.begin, course.end, wall, first, d, load)
    z[2 * len(c.k) * BATCH + s] = voltage
    return s, load, did


@version_of(aside, load=NetlistLoad)
def _aside(load):
    for k in range(len(load.state)):
        load.other[k] = load.state[k]
    return NetlistLoad(
        load.circuit,
        load.other,
        load.state,
        load.room,
        counts=load.counts,
        voltages=load.voltages,
        square=load.square,
        states=load.states,
    )


@version_of(noted, load=NetlistLoad)
def _noted(load, mid, row):
    for k in range(N_VOLTAGES):
        load.voltages[row, k] = load.state[load.circuit.voltages_at + k]
    load.square[row] = load.counts[0]
    if load.states is not None:  # an assignment of rows would compile the text of its errors
        for k in range(len(mid.state)):
            load.states[row, k] = mid.state[k]


class TraceArguments(TypedDict):
    """The arguments of `CompiledCircuit.trace` and `trace_circuit`, apart from the circuit."""

    eqs: Equations
    noise: Floats
    h: float
    stride: int
    start: Floats
    state: Floats
    shaking: Floats | None
    kicked: bool


def trace_circuit(
    eqs: Equations,
    circuit: KernelCircuit,
    state: Floats,
    noise: Floats,
    h: float,
    stride: int = 1,
    start: Sequence[float] | Floats = (0.0, 0.0),
    shaking: Floats | None = None,
    kicked: bool = False,
    keep: bool = False,
) -> CircuitPath:
    """The trajectory from ``start`` with a compiled circuit from its ``state``.

    ``start`` has x and x', of several modes y and y' of all, shape (2 n,). ``circuit`` is that at
    steps of h; ``noise``, ``h``, ``stride`` and ``shaking`` as of
    `harvester.mechanics.trace.trace`. ``kicked`` states that the start is the end of another
    trajectory, after a kick; ``keep`` asks for the circuit's states.

    Raises InputError for a start behind a stop, and random excitation without ``shaking``.
    """
    load = load_of(circuit, state.copy(), len(noise) // stride, keep)
    begin = np.array([*start, state[circuit.voltages_at] / circuit.volts])
    path = follow(eqs, noise, h, stride, start=begin, shaking=shaking, load=load, goes_on=kicked)
    _, steps, failed = load.counts
    return CircuitPath(
        **vars(path),
        voltages=load.voltages,
        square=load.square,
        steps=int(steps),
        failed=int(failed),
        state=load.state,
        states=load.states,
    )
