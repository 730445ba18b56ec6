"""A recorded trajectory: displacement, velocity, voltage and impacts on a noise path."""

from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import invalid
from harvester.mechanics.kernels.compiled import inlined

# Columns of a record: at a kick x and V, half a step later x, x' and V.
COLUMNS = ("x_kick", "V_kick", "x", "v", "V")


@dataclass(frozen=True)
class Path:
    """A recorded trajectory, nondimensional, sampled after every ``stride``-th kick.

    Kick k happens at the time k h; its sample holds x and V at the kick and x, v, V half a
    step later, at ``t`` (shape (n,)).  ``impacts`` has one row an impact: its time and the
    speed just before, negative at the opposite stop, shape (m, 2); with several in a drift, only
    the first. ``shaking`` has the accelerations at the times 0, h, ... of the excitation other than
    white noise; ``U``, shape (n, 2), a load circuit's capacitor voltage at the kick and half a step
    later.

    With several modes x and v are those of the oscillator, impacts have the speeds of the contact
    coordinate, and ``coordinates`` are y and y' of all modes in mid-drift, shape (n, 2, modes).
    ``lost`` is the energy that impacts cost in all, and ``last`` the state after the last kick,
    y, y' and V of all modes, shape (2 modes + 1,).
    """

    h: float
    stride: int
    samples: Floats
    impacts: Floats
    shaking: Floats | None
    U: Floats | None = None
    coordinates: Floats | None = None
    lost: float = 0.0
    last: Floats = field(default_factory=lambda: np.empty(0))

    @property
    def t(self) -> Floats:
        """Times of the samples x, v and V in mid-drift; those at the kicks are h/2 earlier."""
        return np.asarray(
            (np.arange(1, len(self.samples) + 1) * self.stride + 0.5) * self.h, dtype=np.float64
        )

    @property
    def x(self) -> Floats:
        """Displacement in mid-drift."""
        return self.samples[:, 2]

    @property
    def v(self) -> Floats:
        """Velocity in mid-drift."""
        return self.samples[:, 3]

    @property
    def V(self) -> Floats:  # noqa: N802 - the paper's symbol
        """Voltage in mid-drift."""
        return self.samples[:, 4]


@inlined
def between_kicks(shaking, k):
    """The excitation's acceleration: its mean over the drift before kick k, and at that kick.

    None if there is none.
    """
    if shaking is None:
        return None, None
    return 0.5 * (shaking[max(k - 1, 0)] + shaking[k]), shaking[k]


def check_start(stops: tuple[float, float], least: float, most: float) -> None:
    """Raise InputError unless all starts, x from ``least`` to ``most``, are between the rigid ``stops``."""
    low, high = stops
    if least < low:
        raise invalid("start", f"have x of at least {low:g}, the place of the stop", least)
    if most > high:
        raise invalid("start", f"have x of at most {high:g}, the place of the opposite stop", most)


def room_for_impacts(eqs: Equations, steps: int) -> Floats:
    """An empty table of impacts, large enough for two a step."""
    stop = eqs.restitution is not None or eqs.stop_stiffness is not None
    return np.empty((2 * steps + 2 if stop else 0, 2))
