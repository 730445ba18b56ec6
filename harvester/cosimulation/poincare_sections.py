"""Sections of a motion and its circuit, once a period: the end of one run of ngspice and the start of the next one."""

from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import interpreted
from harvester.mechanics.kernels.equation_of_motion import kick


@dataclass(frozen=True)
class CoupledState:
    """Where mass and circuit are in the middle of a kick: x, x', node voltages (V) and inductors' currents (A) by name.

    If these are not known, there are none, and ``across`` has the voltages of the terminals and
    of Csmooth (V).
    """

    x: float = 0.0
    v: float = 0.0
    nodes: dict[str, float] = field(default_factory=dict)
    across: tuple[float, float] = (0.0, 0.0)

    def moved(self, since: "CoupledState", now: "CoupledState") -> "CoupledState":
        """Go the way of another one of the same nodes, from ``since`` to ``now``."""
        nodes = {
            name: voltage + now.nodes[name] - since.nodes[name]
            for name, voltage in self.nodes.items()
        }
        return CoupledState(self.x + now.x - since.x, self.v + now.v - since.v, nodes)


@dataclass(frozen=True)
class Origin:
    """The start of the way to a response: at the part ``phase`` of a period of the drive.

    It is looked for as one that comes back after so many ``turns`` of the drive, before others.
    """

    section: CoupledState
    phase: float = 0.0
    turns: int = 1


def quiet_kick(velocity: Floats) -> tuple[int, int]:
    """The kick of a period, from 1, that is farthest from all changes of the velocity's sign: turns and impacts.

    With it is how many kicks the last one is from the nearest of these.
    """
    size = len(velocity)
    changes = np.flatnonzero((velocity > 0.0) != (np.roll(velocity, 1) > 0.0))
    if len(changes) == 0:
        return size, size
    gaps = np.diff(np.append(changes, changes[0] + size))
    longest = int(np.argmax(gaps))
    away = min(int(changes[0]) + 1, size - int(changes[-1]))
    return int(changes[longest] + gaps[longest] // 2) % size or size, away


def unkicked(s: State, h: float, c: Coefficients, a: float) -> float:
    """The velocity in the middle of a kick of length h that led to s; a kick is linear in it."""
    at_rest, at_speed = (
        interpreted(kick)(State(s.x, speed, s.V), 0.0, 0.5 * h, c, a) for speed in (0.0, 1.0)
    )
    return float((s.v - at_rest) / (at_speed - at_rest))


def flat(section: CoupledState, volts: float) -> Floats:
    """The section as one array of shape (2 + nodes,): x, x' and the node voltages in units of ``volts``."""
    return np.array(
        [section.x, section.v, *(voltage / volts for voltage in section.nodes.values())]
    )


def section_of(y: Floats, names: list[str], volts: float) -> CoupledState:
    """The section of the numbers of `flat`, whose nodes have these names."""
    voltages = {name: float(voltage) * volts for name, voltage in zip(names, y[2:], strict=True)}
    return CoupledState(float(y[0]), float(y[1]), voltages)
