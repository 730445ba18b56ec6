"""One recorded trajectory on a noise path: displacement, velocity, voltage and impacts.

One kernel is for each mechanics with each load (`harvester.mechanics.kernels.driver`).
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.coefficients import BATCH, State, coefficients
from harvester.mechanics.kernels.compiled import inlined, interpreted, kernel
from harvester.mechanics.kernels.driver import (
    aside,
    beside,
    drifted,
    kicked,
    noted,
    oscillator,
    read,
    unnamed,
)
from harvester.mechanics.kernels.equation_of_motion import kick
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit, Store
from harvester.mechanics.kernels.intervals import EXACT, Update, drifts, update_of
from harvester.mechanics.kernels.one_mode import IdealLoad
from harvester.mechanics.kernels.path import (
    COLUMNS,
    Path,
    between_kicks,
    check_start,
    room_for_impacts,
)
from harvester.mechanics.modes.modal_driver import ModalMotion
from harvester.mechanics.modes.modal_step import kick_modes

SLACK = 1e-9  # of the place on a stop, or of 1: several modes may be so far behind it, by rounding


class PathRecord(NamedTuple):
    """Room for the samples and impacts of a `Path`; for coordinates None of one mode."""

    samples: Floats
    impacts: Floats
    coordinates: Floats | None


@kernel
def _trace(s, z, room, noise, shaking, h, stride, record, update, c, load, goes_on):
    """Fill a `PathRecord` from the state s, z on: number of impacts, their energy, and the last s.

    A trajectory that ``goes_on`` begins after a kick; any other with half a kick, the force of the
    first half step.
    """
    whole, half = drifts(h, oscillator(c).mu, update)
    count = 0
    lost = 0.0
    landed = 0.0
    if update.weight is None and not goes_on:
        _, a = between_kicks(shaking, 0)
        s = kicked(s, z, 0.0, 0.5 * h, c, a)
    for k in range(1, len(record.samples) * stride + 1):
        mean, a = between_kicks(shaking, k)
        s, load, did = drifted(s, z, half if landed > 0.0 else whole, c, mean, load)
        count = _note(record.impacts, count, (k - 1) * h + landed, did)
        lost += did.energy
        landed = 0.0
        s = kicked(s, z, noise[k - 1], h, c, a)
        if k % stride == 0:
            row = k // stride - 1
            mid = beside(s, z, room, c)
            mid, mid_load, did = drifted(mid, room, half, c, a, aside(load))
            noted(load, mid_load, row)
            x, _, voltage = read(s, z, c)
            sample = record.samples[row]
            sample[0] = x
            sample[1] = voltage
            sample[2], sample[3], sample[4] = read(mid, room, c)
            if record.coordinates is not None:
                n = record.coordinates.shape[2]
                for j in range(n):
                    record.coordinates[row, 0, j] = room[j * BATCH]
                    record.coordinates[row, 1, j] = room[(n + j) * BATCH]
            if update.weight is not None:  # ngspice lands there, and goes on
                s = mid
                landed = half.t
                count = _note(record.impacts, count, k * h, did)
                lost += did.energy
    return count, lost, unnamed(s, c)


@inlined
def _note(impacts, count, begin, did):
    """Note the first impact of a drift from ``begin``, if there is one: how many have been noted."""
    if did.speed == 0.0:
        return count
    impacts[count, 0] = begin + did.time
    impacts[count, 1] = did.speed
    return count + 1


class OneMode:
    """One mode as a path's kernel receives it; a ``start`` has x, x' and V."""

    slack = 0.0
    unit = 1.0  # of the energy of impacts

    def __init__(self, eqs: Equations) -> None:
        self.coefficients: Any = coefficients(eqs)

    def started(self, start: tuple[Any, ...]) -> Floats:
        """The state of a start x, x', V and more."""
        return np.array(start[:3])

    def order(self, first: int) -> list[int]:
        """The rows of x, x' and V in the states of many trajectories."""
        return [0, 1, 2]

    def contact(self, start: Floats) -> float:
        """The coordinate that meets the stops."""
        return float(start[0])

    def begin(self, start: Floats) -> tuple[Any, Any, Any]:
        """The state s, z for the kernel, and room for another z."""
        return State(*map(float, start)), None, None

    def end(self, s: Any, z: Any) -> Floats:
        """A state of the kernel as an array."""
        return np.array(s)

    def kicked(self, state: Floats, h: float, a: float | None) -> Floats:
        """A state after a kick of length h without noise; interpreted: not worth a compilation."""
        x, v, voltage = state.tolist()
        after = interpreted(kick)(State(x, v, voltage), 0.0, h, self.coefficients, a)
        return np.array([x, after, voltage])

    def charge(self, start: Floats) -> float:
        """The charge that the circuit sees, over theta l."""
        return float(start[0])


class SeveralModes:
    """Several modes likewise; a ``start`` has y, y' and V, shape (2 n + 1,)."""

    slack = SLACK

    def __init__(self, eqs: Equations) -> None:
        self._motion = ModalMotion(eqs)
        self.modes = self._motion.modes
        self.coefficients: Any = self._motion.coefficients
        self.unit = 1.0 / self.modes.mobility

    def started(self, start: tuple[Any, ...]) -> Floats:
        """The state of a start x, x', V, any fourth, and y_2, ... and y_2', ... as its fifth."""
        n = self.modes.count
        state = np.zeros(2 * n + 1)
        state[:n] = self.modes.at_rest(start[0])
        state[n] = start[1]
        state[-1] = start[2]
        if len(start) > 4:
            state[1:n], state[n + 1 : 2 * n] = np.reshape(start[4], (2, -1))
        return state

    def order(self, first: int) -> list[int]:
        """The rows of y, y' and V in the states of many trajectories, y_2 being the ``first``."""
        return self._motion.order(first)

    def contact(self, start: Floats) -> float:
        """The coordinate that meets the stops."""
        return float(np.dot(self.modes.contact, start[: self.modes.count]))

    def begin(self, start: Floats) -> tuple[Any, Any, Any]:
        """The state s, z for the kernel, trajectory 0 of a batch, and room for another z."""
        z = aligned((len(start), BATCH))
        z[:, 0] = start
        return 0, z.reshape(-1), np.empty(z.size)

    def end(self, s: Any, z: Any) -> Floats:
        """A state of the kernel as an array."""
        return np.array(z[s::BATCH])

    def kicked(self, state: Floats, h: float, a: float | None) -> Floats:
        """A state after a kick of length h without noise; interpreted: not worth a compilation."""
        _, z, _ = self.begin(state)
        interpreted(kick_modes)(0, z, 0.0, h, self.coefficients, a)
        return np.asarray(z[::BATCH])

    def charge(self, start: Floats) -> float:
        """The charge that the circuit sees, over theta l."""
        return float(np.dot(self.modes.coupling, start[: self.modes.count]))


def ideal_load(circuit: IdealCircuit, held: float, switch: float, samples: int) -> IdealLoad:
    """An ideal circuit whose capacitor has the voltage ``held``, its switch at a charge."""
    return IdealLoad(circuit, Store(held, switch), np.empty((samples, 2)))


def mechanics_of(eqs: Equations) -> OneMode | SeveralModes:
    """The mechanics of equations."""
    return OneMode(eqs) if eqs.modes is None else SeveralModes(eqs)


def follow(
    eqs: Equations,
    noise: Floats,
    h: float,
    stride: int,
    start: Floats,
    shaking: Floats | None,
    load: Any,
    *,
    update: Update = EXACT,
    goes_on: bool = False,
) -> Path:
    """The trajectory from a state ``start`` with a load as kernels receive it; see `trace`.

    Raises InputError for a start behind a stop, and random excitation without ``shaking``.
    """
    mechanics = mechanics_of(eqs)
    if len(start) != at_rest(eqs).size:  # the kernel would read and write beyond it
        raise ValueError(f"a start has {at_rest(eqs).size} numbers, not {len(start)}")
    meets = mechanics.contact(start)
    slack = mechanics.slack * max(1.0, abs(meets))
    check_start(eqs.rigid_stops, meets + slack, meets - slack)
    rows = len(noise) // stride
    s, z, room = mechanics.begin(start)
    record = PathRecord(
        samples=np.empty((rows, len(COLUMNS))),
        impacts=room_for_impacts(eqs, len(noise)),
        coordinates=None if room is None else np.empty((rows, 2, len(start) // 2)),
    )
    shaking = forcing(eqs, h, len(noise)) if shaking is None else shaking
    c = mechanics.coefficients
    count, lost, last = _trace(
        s,
        z,
        room,
        noise,
        shaking,
        h=h,
        stride=stride,
        record=record,
        update=update,
        c=c,
        load=load,
        goes_on=goes_on,
    )
    return Path(
        h=h,
        stride=stride,
        samples=record.samples,
        impacts=record.impacts[:count].copy(),
        shaking=shaking,
        coordinates=record.coordinates,
        lost=lost * mechanics.unit,
        last=mechanics.end(last, z),
    )


def trace(
    eqs: Equations,
    noise: Floats,
    h: float,
    stride: int = 1,
    start: Any = None,
    shaking: Floats | None = None,
    circuit: IdealCircuit | None = None,
    ngspice_rule: bool = False,
) -> Path:
    """The trajectory of the equations from ``start`` on a noise path, with the exact RC update.

    ``noise`` has one standard normal variate a kick
    (`harvester.mechanics.kernels.noise.gaussian_grid`); its length, rounded down to the stride, is
    the number of steps of length ``h``. All nondimensional. ``start`` has x, x' and V, of several
    modes y and y' of all modes and V, and then, with a ``circuit``, the voltage of its capacitor if
    that differs from 0; None is at rest in the first of `resting_places`. ``shaking``, shape
    (len(noise) + 1,), has the accelerations at the times 0, h, ... without white noise; None:
    `harvester.mechanics.kernels.forcing.forcing`. With ``ngspice_rule`` the resistor follows
    ngspice's integration rule, from rest (`harvester.mechanics.kernels.ngspice_rule`).

    Without noise the trajectory is of second order in h (against a compliant stop only if h
    resolves the contact: else of first). With noise, variate k belongs to the time from (k - 1) h
    to k h while its kick comes at k h, half a step late: trajectories of different steps on one
    refined noise are compared at equal k h, and a start other than rest is half a step early.

    Raises InputError for a start behind a stop, and coloured noise without ``shaking``.
    """
    begin = at_rest(eqs)
    held = 0.0
    if start is not None:
        held = float(start[begin.size]) if len(start) > begin.size else 0.0
        begin = np.array(start[: begin.size], dtype=np.float64)
    load: Any = None
    if circuit is not None:
        mechanics = mechanics_of(eqs)
        load = ideal_load(circuit, held, mechanics.charge(begin), len(noise) // stride)
    update = update_of(eqs, h, ngspice_rule) if ngspice_rule else EXACT
    path = follow(eqs, noise, h, stride, start=begin, shaking=shaking, load=load, update=update)
    return path if load is None else replace(path, U=load.charge)


def at_rest(eqs: Equations) -> Floats:
    """The state at rest in the first of `resting_places`: y, y' and V, shape (2 n + 1,)."""
    return mechanics_of(eqs).started((eqs.resting_places[0], 0.0, 0.0))
