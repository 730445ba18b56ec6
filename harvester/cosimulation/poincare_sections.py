"""Sections of a motion and its circuit, once a period: the end of one run of ngspice and the start of the next one."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.mechanics.trace import mechanics_of

# of the speeds: what the middle of a kick is exact to, and the steps there at most
EXACT = 1e-15
STEPS = 60


@dataclass(frozen=True)
class CoupledState:
    """Where mass and circuit are in the middle of a kick: x, x', node voltages (V) and inductors' currents (A) by name.

    If these are not known, there are none, and ``across`` has the voltages of the terminals and
    of Csmooth (V).  With several modes x and x' are y_1 and y_1', and ``higher_modes`` has y_2, ...
    and then y_2', ...; without any of these they are at rest.
    """

    x: float = 0.0
    v: float = 0.0
    nodes: dict[str, float] = field(default_factory=dict)
    across: tuple[float, float] = (0.0, 0.0)
    higher_modes: tuple[float, ...] = ()

    @classmethod
    def of_motion(
        cls,
        motion: Floats,
        nodes: dict[str, float] | None = None,
        across: tuple[float, float] = (0.0, 0.0),
    ) -> "CoupledState":
        """The state of coordinates and then speeds, shape (2 n,)."""
        y, speeds = (values.tolist() for values in np.split(motion, 2))
        return cls(y[0], speeds[0], nodes or {}, across, higher_modes=(*y[1:], *speeds[1:]))

    def start(self, volts: float) -> tuple[Any, ...]:
        """The start of a run, as of `SeveralModes.started`, in units of ``volts``."""
        across = (self.nodes["p"], 0.0) if self.nodes else self.across
        start = (self.x, self.v, *(voltage / volts for voltage in across))
        return (*start, np.array(self.higher_modes)) if self.higher_modes else start

    def moved(self, since: "CoupledState", now: "CoupledState") -> "CoupledState":
        """Go the way of another one of the same nodes, from ``since`` to ``now``."""
        nodes = {
            name: voltage + now.nodes[name] - since.nodes[name]
            for name, voltage in self.nodes.items()
        }
        higher = (
            here + there - before
            for here, there, before in zip(
                self.higher_modes, now.higher_modes, since.higher_modes, strict=True
            )
        )
        return CoupledState(
            self.x + now.x - since.x, self.v + now.v - since.v, nodes, higher_modes=tuple(higher)
        )


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


def unkicked(eqs: Equations, after: Floats, h: float, a: float | None) -> Floats:
    """The state in the middle of a kick of length h that led to ``after``, under the excitation a.

    Both are coordinates, speeds and V, nondimensional, shape (2 n + 1,).  The half of a kick that
    led there changes speeds little: the state is a fixed point of y <- y + after - half kick (y).
    """
    mechanics = mechanics_of(eqs)
    state = after
    for _ in range(STEPS):
        change = after - mechanics.kicked(state, 0.5 * h, a)
        state = state + change
        if np.abs(change).max() <= EXACT * np.abs(after).max():
            break
    return state


def flat(section: CoupledState, volts: float) -> Floats:
    """The section as one array of shape (2 n + nodes,), of n modes.

    It has x and x', those of further modes, and the node voltages in units of ``volts``.
    """
    voltages = (voltage / volts for voltage in section.nodes.values())
    return np.array([section.x, section.v, *section.higher_modes, *voltages])


def section_of(y: Floats, names: list[str], volts: float) -> CoupledState:
    """The section of the numbers of `flat`, whose nodes have these names."""
    motion, across = np.split(y, [len(y) - len(names)])
    voltages = {name: float(voltage) * volts for name, voltage in zip(names, across, strict=True)}
    x, v, *higher = motion.tolist()
    return CoupledState(x, v, voltages, higher_modes=tuple(higher))
