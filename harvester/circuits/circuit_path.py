"""One recorded trajectory of the mass with a compiled circuit, on a noise path."""

from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.mass import drifted
from harvester.circuits.pointers import advance
from harvester.circuits.substeps import DID, N_VOLTAGES, ROOMS, KernelCircuit
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.coefficients import State, coefficients
from harvester.mechanics.kernels.compiled import kernel
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.kernels.path import (
    COLUMNS,
    Path,
    between_kicks,
    check_start,
    room_for_impacts,
)


@dataclass(frozen=True)
class CircuitPath(Path):
    """A `Path` with a compiled circuit.

    ``voltages`` has those (V) of the piezo, the store and the load at its samples, shape (n, 3);
    ``square`` the integral of the load's squared voltage (V^2 s) up to each; ``steps`` how many the
    circuit made, and ``failed`` how many of them did not converge; ``state`` its last state, and
    ``speed`` the velocity after the last kick; ``states`` those of the circuit at the samples,
    shape (n, length of a state), and ``own_steps`` the rows of
    `harvester.circuits.substeps.logged`, if they are asked for.
    """

    voltages: Floats = field(default_factory=lambda: np.empty((0, N_VOLTAGES)))
    square: Floats = field(default_factory=lambda: np.empty(0))
    steps: int = 0
    failed: int = 0
    state: Floats = field(default_factory=lambda: np.empty(0))
    speed: float = 0.0
    states: Floats | None = None
    own_steps: Floats | None = None


@kernel
def _trace(noise, shaking, s, state, circuit, h, stride, outputs, c, kicked, states):
    samples, voltages, square, counts, impacts = outputs
    count = 0
    total = 0.0
    room = np.empty((ROOMS, circuit.length))
    other = state.copy()
    last = len(state) - DID
    at, volts = circuit.voltages_at, circuit.volts
    if (
        not kicked
    ):  # from a start other than rest half a kick comes first: the force of the first half step
        _, a = between_kicks(shaking, 0)
        s = State(s.x, kick_at_stops(s, 0.0, 0.5 * h, c, a), s.V)
    for k in range(1, len(samples) * stride + 1):
        mean, a = between_kicks(shaking, k)
        s1, wall, first, did = drifted(s, h, h, c, mean)
        advance(circuit.address, circuit.record, state, room, s.x, s1.x, wall, first, h, 1)
        s = State(s1.x, s1.v, state[at] / volts)
        total += state[last]
        counts[0] += state[last + 1]
        counts[1] += state[last + 2]
        if did.speed != 0.0:
            impacts[count, 0] = (k - 1) * h + first
            impacts[count, 1] = did.speed
            count += 1
        s = State(s.x, kick_at_stops(s, noise[k - 1], h, c, a), s.V)
        if k % stride == 0:
            row = samples[k // stride - 1]
            for i in range(len(state)):
                other[i] = state[i]
            mid, wall, first, _ = drifted(s, h, 0.5 * h, c, a)
            advance(
                circuit.address, circuit.record, other, room, s.x, mid.x, wall, first, 0.5 * h, 0
            )
            row[0] = s.x
            row[1] = s.V
            row[2] = mid.x
            row[3] = mid.v
            row[4] = other[at] / volts
            for i in range(N_VOLTAGES):
                voltages[k // stride - 1, i] = state[at + i]
            square[k // stride - 1] = total
            if states is not None:
                states[k // stride - 1] = other
    counts[2] = s.v
    return count


def trace_circuit(
    eqs: Equations,
    circuit: KernelCircuit,
    state: Floats,
    noise: Floats,
    h: float,
    stride: int = 1,
    start: tuple[float, float] = (0.0, 0.0),
    shaking: Floats | None = None,
    kicked: bool = False,
    keep: bool = False,
) -> CircuitPath:
    """The trajectory of Eq. 2 from ``start`` = (x, x') with a compiled circuit from its ``state``.

    ``circuit`` is the circuit at steps of h; ``noise``, ``h``, ``stride`` and ``shaking`` as of
    `harvester.mechanics.kernels.path.trace`.  ``kicked`` states that the start is where another
    path ended, after a kick; ``keep`` asks for the circuit's states.

    Raises InputError for a start behind a stop, and random shaking without ``shaking``.
    """
    check_start(eqs.rigid_stops, start[0], start[0])
    rows = len(noise) // stride
    samples = np.empty((rows, len(COLUMNS)))
    voltages = np.empty((rows, N_VOLTAGES))
    square = np.empty(rows)
    impacts = room_for_impacts(eqs, len(noise))
    counts = np.zeros(3)
    state = state.copy()
    shaking = forcing(eqs, h, len(noise)) if shaking is None else shaking
    outputs = samples, voltages, square, counts, impacts
    states = np.empty((rows, len(state))) if keep else None
    begin = State(
        float(start[0]), float(start[1]), float(state[circuit.voltages_at]) / circuit.volts
    )
    count = _trace(
        noise, shaking, begin, state, circuit, h, stride, outputs, coefficients(eqs), kicked, states
    )
    done = int(counts[0]), int(counts[1]), state, float(counts[2]), states
    return CircuitPath(
        h, stride, samples, impacts[:count].copy(), shaking, None, voltages, square, *done
    )
