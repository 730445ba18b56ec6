"""One recorded trajectory of several modes, as `harvester.mechanics.kernels.path` of one."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import kernel
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.intervals import EXACT, drifts
from harvester.mechanics.kernels.path import (
    COLUMNS,
    Path,
    between_kicks,
    check_start,
    room_for_impacts,
)
from harvester.mechanics.kernels.trajectory_batch import BATCH
from harvester.mechanics.modes.modal_circuit import drift_with_ideal
from harvester.mechanics.modes.modal_step import dot, drift_modes, kick_modes, modal_coefficients


@dataclass(frozen=True)
class ModalPath(Path):
    """A path whose x and v are those of the oscillator; impacts have the speeds of the contact coordinate.

    ``coordinates`` are y and y' of all modes in mid-drift, shape (n, 2, modes), ``lost`` is what
    impacts took in all.
    """

    coordinates: Floats | None = None
    lost: float = 0.0


class Loaded(NamedTuple):
    """An ideal circuit on a path: its U and m now, shape (2, BATCH), and U at the samples, shape (n, 2)."""

    circuit: IdealCircuit
    store: Floats
    charge: Floats


@kernel
def _trace(z, mid, noise, shaking, h, stride, samples, coordinates, impacts, c, loaded):
    """Fill samples, coordinates and impacts from the states z of a batch of which lane 0 is used: (impacts, energy)."""
    whole, half = drifts(h, c.oscillator.mu, EXACT)
    n = len(c.k)
    count = 0
    lost = 0.0
    _, a0 = between_kicks(shaking, 0)
    # from a start other than rest: the force of the first half step
    kick_modes(0, z, 0.0, 0.5 * h, c, a0)
    for k in range(1, len(samples) * stride + 1):
        mean, a = between_kicks(shaking, k)
        if loaded is None:
            did = drift_modes(0, z, whole, c, mean)
        else:
            did = drift_with_ideal(0, z, loaded.store, whole, c, mean, loaded.circuit)
        lost += did.energy
        if did.speed != 0.0:
            impacts[count, 0] = (k - 1) * h + did.time
            impacts[count, 1] = did.speed
            count += 1
        kick_modes(0, z, noise[k - 1], h, c, a)
        if k % stride == 0:
            row = k // stride - 1
            samples[row, 0] = dot(c.e, z, 0, 0)
            samples[row, 1] = z[2 * n * BATCH]
            for j in range((2 * n + 1) * BATCH):
                mid[j] = z[j]
            if loaded is None:
                drift_modes(0, mid, half, c, a)
            else:
                held = loaded.store.copy()
                drift_with_ideal(0, mid, held, half, c, a, loaded.circuit)
                loaded.charge[row, 0] = loaded.store[0, 0]
                loaded.charge[row, 1] = held[0, 0]
            samples[row, 2] = dot(c.e, mid, 0, 0)
            samples[row, 3] = dot(c.e, mid, n, 0)
            samples[row, 4] = mid[2 * n * BATCH]
            for j in range(n):
                coordinates[row, 0, j], coordinates[row, 1, j] = (
                    mid[j * BATCH],
                    mid[(n + j) * BATCH],
                )
    return count, lost


def started(eqs: Equations, start: tuple[Any, ...]) -> Floats:
    """The states y, y' and V of a start x, x', V and further on, as its fifth, those of y_2, ...; shape (2 n + 1,)."""
    assert eqs.modes is not None
    state = np.zeros(2 * eqs.modes.count + 1)
    n = eqs.modes.count
    state[:n] = eqs.modes.at_rest(start[0])
    state[n] = start[1]
    state[-1] = start[2]
    if len(start) > 4:
        state[1:n], state[n + 1 : 2 * n] = np.reshape(start[4], (2, -1))
    return state


def trace_modes(
    eqs: Equations,
    noise: Floats,
    h: float,
    stride: int = 1,
    start: Floats | None = None,
    shaking: Floats | None = None,
    circuit: IdealCircuit | None = None,
    smoothed: float = 0.0,
) -> ModalPath:
    """The trajectory of equations with several modes on a noise path, with the arguments of `trace`.

    ``start`` has y, y' of all modes and V, shape (2 n + 1,); None: at rest, x in the first of
    `resting_places`. ``smoothed`` is the voltage of an ideal circuit's capacitor there.

    Raises InputError for a start behind a stop, and coloured noise without ``shaking``.
    """
    modes = eqs.modes
    assert modes is not None
    z = aligned(((2 * modes.count + 1), BATCH))
    z[: modes.count, 0] = modes.at_rest(eqs.resting_places[0])
    if start is not None:
        z[:, 0] = start
        x = float(np.dot(modes.contact, z[: modes.count, 0]))
        check_start(eqs.rigid_stops, x, x)
    samples = np.empty((len(noise) // stride, len(COLUMNS)))
    coordinates = np.empty((len(samples), 2, modes.count))
    impacts = room_for_impacts(eqs, len(noise))
    shaking = forcing(eqs, h, len(noise)) if shaking is None else shaking
    loaded = None
    if circuit is not None:
        loaded = Loaded(circuit, np.zeros((2, BATCH)), np.empty((len(samples), 2)))
        loaded.store[:, 0] = smoothed, np.dot(modes.coupling, z[: modes.count, 0])
    records = samples, coordinates, impacts, modal_coefficients(eqs), loaded
    count, lost = _trace(z.reshape(-1), np.empty(z.size), noise, shaking, h, stride, *records)
    lost /= modes.mobility
    return ModalPath(
        h,
        stride,
        samples,
        impacts[:count].copy(),
        shaking,
        loaded and loaded.charge,
        coordinates,
        lost,
    )
