"""One recorded trajectory: displacement, velocity, voltage and impacts on a noise path."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import invalid
from harvester.mechanics.kernels.compiled import inlined, kernel
from harvester.mechanics.kernels.equation_of_motion import relaxation
from harvester.mechanics.kernels.offset_stops import kick_at_stops, move, stops_of
from harvester.mechanics.kernels.shaking import forcing

# Columns of a record: at a kick x and V, half a step later x, x' and V.
COLUMNS = ("x_kick", "V_kick", "x", "v", "V")


@dataclass(frozen=True)
class Path:
    """A recorded trajectory, nondimensional, read after every ``stride``-th kick.

    Kick k happens at the time k h; its reading holds x and V at the kick and x, v, V half a
    step later, at ``t`` (shape (n,)).  ``impacts`` has one row an impact: its time and the
    speed just before, negative at the opposite stop, shape (m, 2); of several within one drift only the first.
    ``shaking`` has the accelerations at the times 0, h, ... of what else than white noise shook the mass.
    """

    h: float
    stride: int
    readings: Floats
    impacts: Floats
    shaking: Floats | None

    @property
    def t(self) -> Floats:
        """Times of the mid-drift readings x, v and V; those at the kicks are h/2 earlier."""
        return np.asarray((np.arange(1, len(self.readings) + 1) * self.stride + 0.5) * self.h, dtype=np.float64)

    @property
    def x(self) -> Floats:
        """Displacement in mid-drift."""
        return self.readings[:, 2]

    @property
    def v(self) -> Floats:
        """Velocity in mid-drift."""
        return self.readings[:, 3]

    @property
    def V(self) -> Floats:  # noqa: N802 - the paper's symbol
        """Voltage in mid-drift."""
        return self.readings[:, 4]


@inlined
def between_kicks(shaking, k):
    """The shaking's acceleration: its mean over the drift before kick k, and at that kick; None where there is none."""
    if shaking is None:
        return None, None
    return 0.5 * (shaking[max(k - 1, 0)] + shaking[k]), shaking[k]


@kernel
def _trace(
    noise, shaking, x, v, V, h, stride, readings, impacts,
    mu, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops,
):  # fmt: skip
    e, g = relaxation(h, mu)
    e_half, g_half = relaxation(0.5 * h, mu)
    count = 0
    # From a start other than rest half a kick comes first: the force of the first half step.
    _, a = between_kicks(shaking, 0)
    v = kick_at_stops(x, v, V, 0.0, 0.5 * h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, a)
    for k in range(1, len(readings) * stride + 1):
        mean, a = between_kicks(shaking, k)
        (x, v, V), (first, speed, _, _) = move(x, v, V, h, h, e, g, mu, r, beta, n1, stops, mean)
        if speed != 0.0:
            impacts[count, 0], impacts[count, 1] = (k - 1) * h + first, speed
            count += 1
        xi = 0.0
        if n1 is not None or n2 is not None:
            xi = noise[k - 1]
        v = kick_at_stops(x, v, V, xi, h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, a)
        if k % stride == 0:
            row = readings[k // stride - 1]
            row[0], row[1] = x, V
            (row[2], row[3], row[4]), _ = move(x, v, V, h, 0.5 * h, e_half, g_half, mu, r, beta, n1, stops, a)
    return count


def trace(
    eqs: Equations,
    noise: Floats,
    h: float,
    stride: int = 1,
    start: tuple[float, float, float] | None = None,
    shaking: Floats | None = None,
) -> Path:
    """The trajectory of Eq. 2 from ``start`` = (x, x', V) on a noise path, with the exact RC update.

    ``noise`` has one standard normal variate a kick (`harvester.mechanics.kernels.noise.gaussian_grid`); its length,
    rounded down to the stride, is the number of steps of length ``h``.  All nondimensional. ``start`` None is at rest
    in the first of `resting_places`.  ``shaking``, shape (len(noise) + 1,), has the accelerations at the times 0, h,
    ... of what else shakes the mass; None: `harvester.mechanics.kernels.shaking.forcing`.

    Without noise the path is of second order in h (against a compliant stop only where h resolves the contact: else
    of first).  With noise, variate k belongs to the time from
    (k - 1) h to k h while its kick comes at k h, half a step late: paths of different steps on one
    refined noise are compared at equal k h, and a start other than rest is half a step early.

    Raises InputError for a start behind a stop, and coloured noise without ``shaking``.
    """
    start = (eqs.resting_places[0], 0.0, 0.0) if start is None else start
    check_start(eqs.rigid_stops, start[0], start[0])
    readings = np.empty((len(noise) // stride, len(COLUMNS)))
    impacts = room_for_impacts(eqs, len(noise))
    shaking = forcing(eqs, h, len(noise)) if shaking is None else shaking
    count = _trace(noise, shaking, *start, h, stride, readings, impacts, *coefficients(eqs))
    return Path(h, stride, readings, impacts[:count].copy(), shaking)


def check_start(stops: tuple[float, float], least: float, most: float) -> None:
    """Raise InputError unless all starts, x from ``least`` to ``most``, are between the rigid ``stops``."""
    low, high = stops
    if least < low:
        raise invalid("start", f"have x of at least {low:g}, where the stop is", least)
    if most > high:
        raise invalid("start", f"have x of at most {high:g}, where the opposite stop is", most)


def room_for_impacts(eqs: Equations, steps: int) -> Floats:
    """An empty table of impacts, large enough for two a step."""
    stop = eqs.restitution is not None or eqs.stop_stiffness is not None
    return np.empty((2 * steps + 2 if stop else 0, 2))


def coefficients(eqs: Equations) -> tuple[Any, ...]:
    """The coefficients in the order of the kernels' arguments."""
    spring = eqs.linear, eqs.alpha2
    friction_and_noise = eqs.c1, eqs.c2, eqs.c3, eqs.n1, eqs.n2, eqs.n12
    return (eqs.mu, eqs.restitution, eqs.alpha, eqs.beta, *friction_and_noise, *spring, stops_of(eqs))
