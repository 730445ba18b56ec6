"""The periodic response of modes and a compiled circuit to a steady excitation: from period to period.

The map of a period maps y, y', the charges and the voltages that functions read just after a kick
to those a period later; `harvester.mechanics.periodic` finds its fixed point.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_path import CircuitPath
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.equations.bounds import linear_growth
from harvester.equations.coefficients import Equations
from harvester.errors import CircuitError
from harvester.linear.transfer import first_harmonic
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.largest_swing import Swing
from harvester.mechanics.periodic import (
    COMES_BACK,
    FIRST,
    LONGEST_WAY,
    MULTIPLES,
    WANDERS,
    Settling,
    comes_back_after,
    periods_that_hold,
    periods_to_settle,
)
from harvester.mechanics.trace import at_rest

MEASURED = 4  # times that the response is gone through: switches may act a little sooner or later


@dataclass(frozen=True)
class CircuitStart:
    """The start of a response that repeats after ``turns`` periods of the excitation, or the way to a neighbour.

    ``coordinates``, y and y' of all modes, and the circuit's ``state`` are those just after the
    kick at which the drive begins.
    """

    coordinates: Floats
    state: Floats
    turns: int


@dataclass(frozen=True)
class CircuitPeriod(CircuitStart, Swing):
    """A response that comes back.

    ``power`` (W) of Rload and ``square`` (V^2) of the terminals are means over its periods;
    ``left`` is the part of these that settling further may change; ``path`` has the last periods, a
    sample a kick, ``steps`` counts all.
    """

    power: float
    square: float
    left: tuple[float, float]
    path: CircuitPath
    steps: int

    @property
    def motion(self) -> Floats:
        """As of `Swing`."""
        return self.path.samples

    @property
    def harmonics(self) -> tuple[complex, complex]:
        """The complex amplitudes of x and V at the excitation's frequency (`harvester.linear.transfer`)."""
        samples = self.path.samples
        angles = 2.0 * math.pi * self.turns * np.arange(1, len(samples) + 1) / len(samples)
        return first_harmonic(samples[:, 0], angles), first_harmonic(samples[:, 1], angles)


class _Way:
    """Trajectories of one circuit through periods of the excitation, each on from where the last one ended."""

    def __init__(
        self, circuit: CompiledCircuit, eqs: Equations, h: float, near: CircuitStart | None
    ) -> None:
        period = eqs.shaking_period
        assert period is not None, "the drive is steady"
        self.circuit = circuit
        self.eqs = eqs
        self.h = h
        self.size = round(period / h)
        self.steps = 0
        shaking = forcing(eqs, h, self.size)
        assert shaking is not None, "the drive is steady"
        self.shaking = shaking[:-1]
        self.coordinates = at_rest(eqs)[:-1]
        self.state = circuit.rest
        if near is not None:
            self.coordinates = near.coordinates
            self.state = near.state
        sizes = circuit.sizes
        self.kept = sizes[0] + sizes[1]
        self.charges = sizes[3]

    def run(self, periods: int, stride: int = 0) -> CircuitPath:
        """Continue for so many periods, with a sample each, or every ``stride`` kicks."""
        n_steps = periods * self.size
        shaking = self.shaking[np.arange(n_steps + 1) % self.size]
        path = self.circuit.trace(
            self.eqs,
            np.zeros(n_steps),
            self.h,
            stride=stride or self.size,
            start=self.coordinates,
            state=self.state,
            shaking=shaking,
            kicked=True,
        )
        self.coordinates = path.last[:-1]
        self.state = path.state
        self.steps += n_steps
        return path

    @property
    def y(self) -> Floats:
        """The state as one array."""
        return np.concatenate([self.coordinates, self.state[: self.kept]])

    def turn(self, y: Floats, turns: int) -> tuple[Floats, Floats]:
        """The map: a state after so many periods, and the means of power, V^2 and x^2 + x'^2 over them.

        Raises CircuitError if the circuit has no way on from a state.
        """
        before = self.state
        self.coordinates, kept = np.split(y, [len(self.coordinates)])
        self.state = before.copy()
        self.state[: self.kept] = kept
        path = self.run(turns, 1)
        if path.failed:
            self.state = before
            raise CircuitError("steps of the compiled circuit do not converge")
        return self.y, self.means(path)

    def means(self, path: CircuitPath) -> Floats:
        """Power (W), mean square voltage (V^2), and the mean of x^2 + x'^2 of a trajectory."""
        s = self.circuit.scales
        seconds = len(path.samples) * path.stride * path.h / self.circuit.scales.frequency
        square = float((path.samples[:, 1] ** 2).mean()) * s.volts**2
        moved = float((path.samples[:, 2:4] ** 2).sum(axis=1).mean())
        return np.array([path.square[-1] / self.circuit.resistance / seconds, square, moved])

    def settling(self, turns: int) -> Settling:
        """The way to the fixed point of the map of so many periods.

        Every capacitor and inductor counts, Csmooth last.
        """
        s = self.circuit.scales
        order = list(range(self.charges))
        farads = self.circuit.load.smoothing or 0.0
        if farads:
            order.append(order.pop(self.circuit.charge_at("csmooth")))
        n = len(self.coordinates)
        slow = np.eye(n + self.charges, n + self.kept)
        for row, k in enumerate(order, n):
            slow[row] = 0.0
            slow[row, n + k] = self.circuit.system.charges[k][3] / s.volts
        groups = np.array(n * [0] + self.charges * [1])
        swing = np.array([[0.0, 0.0, 1.0]] * n + [[0.0, s.volts**-2, 0.0]] * self.charges)
        stored = farads * s.volts**2 * s.frequency / (turns * self.size * self.h)
        slowest = periods_to_settle(self.eqs, turns)
        turn = partial(self.turn, turns=turns)
        return Settling(turn, slow, groups, self.y, stored=stored, swing=swing, slowest=slowest)

    def come_near(self) -> int:
        """Go on until a mass that is not linear comes back: after how many periods, 0 if it does not."""
        periods = periods_that_hold(LONGEST_WAY, self.size * self.h, 2 * MULTIPLES)
        for _ in range(WANDERS):
            path = self.run(periods)
            motion = path.samples[:, 2:4]
            size = math.sqrt(float((motion**2).sum(axis=1).mean()))
            if turns := comes_back_after(motion, max(size, 1e-12)):
                return turns
        return 0


def periodic_response(
    circuit: CompiledCircuit,
    eqs: Equations,
    h: float,
    enough: float,
    near: CircuitStart | None = None,
) -> CircuitPeriod | None:
    """The response from rest, or near another one, at steps of h; None if none comes back, or steps do not converge.

    The remainder of the way there is below ``enough`` of the state's size.
    """
    try:
        return _response(circuit, eqs, h, enough, near)
    except CircuitError:
        return None


def _response(
    circuit: CompiledCircuit, eqs: Equations, h: float, enough: float, near: CircuitStart | None
) -> CircuitPeriod | None:
    """As `periodic_response`; raises CircuitError if circuit steps do not converge."""
    way = _Way(circuit, eqs, h, near)
    turns = 1 if near is None else near.turns
    if linear_growth(eqs) is None:
        turns = way.come_near() if near is None else near.turns
        if not turns:
            return None
    elif near is None:
        way.run(periods_that_hold(FIRST, way.size * way.h))
    settled = way.settling(turns)
    if not settled.reach(enough):
        return None
    way.turn(settled.state, turns)
    ends = [way.y]
    means = list[Floats]()
    for _ in range(MEASURED):
        path = way.run(turns, 1)
        if path.failed:
            return None
        ends.append(way.y)
        means.append(way.means(path))
    residual = settled.slow @ (ends[-1] - ends[0]) / MEASURED
    rest = settled.remainder(residual)
    if rest.size > COMES_BACK:
        return None
    mean = np.mean(means, axis=0)
    scatter = np.std(means, axis=0, ddof=1) / math.sqrt(MEASURED)
    parts = rest.shares(mean, scatter)
    return CircuitPeriod(
        way.coordinates,
        way.state,
        turns,
        power=float(mean[0]),
        square=float(mean[1]),
        left=(float(parts[0]), float(parts[1])),
        path=path,
        steps=way.steps,
    )
