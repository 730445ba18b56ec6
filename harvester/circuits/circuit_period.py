"""The periodic response of modes and a compiled circuit to a steady excitation.

The map of a period maps y, y', the charges and the voltages that functions read just after a kick
to those a period later; `harvester.mechanics.periodic` finds its fixed point.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_path import CircuitPath
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.equations.bounds import linear_growth
from harvester.equations.coefficients import Equations
from harvester.errors import CircuitError
from harvester.linear.transfer import first_harmonic
from harvester.mechanics.largest_swing import Swing
from harvester.mechanics.period_map import PeriodMap, ResponseStart, check_numbers
from harvester.mechanics.periodic import COMES_BACK, FIRST, comes_back_after
from harvester.mechanics.trace import at_rest


@dataclass(frozen=True)
class CircuitStart(ResponseStart):
    """The start of a response, or of the way to a neighbouring one, as of `ResponseStart`.

    ``coordinates``, y and y' of all modes, and the circuit's ``state`` are those just after the
    kick at which the drive begins.
    """

    coordinates: Floats
    state: Floats
    turns: int

    def to_json(self) -> dict[str, Any]:
        """The numbers for a file."""
        x, v = np.split(self.coordinates, 2)
        motion = {"x": x.tolist(), "v": v.tolist()}
        return {**motion, "circuit": self.state.tolist(), "turns": self.turns}

    @classmethod
    def from_json(cls, state: Mapping[str, Any]) -> Self:
        """As of `ResponseStart`."""
        coordinates = np.array([state["x"], state["v"]], dtype=float).ravel()
        circuit = np.array(state["circuit"], dtype=float)
        turns = int(state["turns"])
        check_numbers(turns, [*coordinates, *circuit])
        return cls(coordinates, circuit, turns)


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


class CircuitMap(PeriodMap):
    """The map of modes with a compiled circuit."""

    repeats = 4  # switches may act a little sooner or later

    def __init__(
        self, circuit: CompiledCircuit, eqs: Equations, h: float, near: CircuitStart | None
    ) -> None:
        super().__init__(eqs, circuit.scales, h, circuit.load.smoothing or 0.0)
        self.circuit = circuit
        self.steps = 0
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
        path = self.circuit.trace(
            self.eqs,
            np.zeros(n_steps),
            self.h,
            stride=stride or self.size,
            start=self.coordinates,
            state=self.state,
            shaking=self.shaking(0, n_steps),
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

    @property
    def coordinates_and_speeds(self) -> int:
        """Those of all modes."""
        return len(self.coordinates)

    def turn(self, y: Floats, turns: int) -> tuple[Floats, Floats]:
        """As of `PeriodMap`."""
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
        s = self.scales
        seconds = len(path.samples) * path.stride * path.h / s.frequency
        square = float((path.samples[:, 1] ** 2).mean()) * s.volts**2
        moved = float((path.samples[:, 2:4] ** 2).sum(axis=1).mean())
        return np.array([path.square[-1] / self.circuit.resistance / seconds, square, moved])

    @property
    def slow(self) -> Floats:
        """Every coordinate, speed, capacitor and inductor."""
        order = list(range(self.charges))
        if self.farads:
            order.append(order.pop(self.circuit.charge_at("csmooth")))
        n = len(self.coordinates)
        slow = np.eye(n + self.charges, n + self.kept)
        for row, k in enumerate(order, n):
            slow[row] = 0.0
            slow[row, n + k] = self.circuit.system.charges[k][3] / self.scales.volts
        return slow

    def wander(self, periods: int) -> int:
        """As of `PeriodMap`."""
        motion = self.run(periods).samples[:, 2:4]
        size = math.sqrt(float((motion**2).sum(axis=1).mean()))
        return comes_back_after(motion, max(size, 1e-12))


def periodic_response(
    circuit: CompiledCircuit,
    eqs: Equations,
    h: float,
    enough: float,
    near: CircuitStart | None = None,
) -> CircuitPeriod | None:
    """The response from rest, or near another one, at steps of h.

    None if none comes back, or steps do not converge.

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
    way = CircuitMap(circuit, eqs, h, near)
    turns = 1 if near is None else near.turns
    if linear_growth(eqs) is None:
        turns = way.come_near() if near is None else near.turns
        if not turns:
            return None
    elif near is None:
        way.run(way.periods(FIRST))
    settled = way.settling(turns)
    if not settled.reach(enough):
        return None
    way.turn(settled.state, turns)
    ends = [way.y]
    means = list[Floats]()
    for _ in range(way.repeats):
        path = way.run(turns, 1)
        if path.failed:
            return None
        ends.append(way.y)
        means.append(way.means(path))
    residual = settled.slow @ (ends[-1] - ends[0]) / way.repeats
    rest = settled.remainder(residual)
    if rest.size > COMES_BACK:
        return None
    mean = np.mean(means, axis=0)
    scatter = np.std(means, axis=0, ddof=1) / math.sqrt(way.repeats)
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
