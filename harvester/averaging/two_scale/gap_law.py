"""Two-scale averaging for a stop at a distance from rest, or preloaded.

Orbits below the stop's energy do not meet it, those above lose (1 - r^2) times their kinetic energy
there:

    b = -<f x'^2> - beta mu <V^2> - 2 (1 - r^2)/(1 + r^2) (x'^2/2 at the stop)/T + N1 + N2 <x^2> + 2
    N12 <x>

with averages over the orbits of `harvester.averaging.two_scale.gap_cycles`, and one law of the
energy across grazing. The cycle's mean displacement, 0 on free orbits, makes the slow voltage; that
shifts the rest position c of the free orbits.  The harmonic j of a cycle has the frequency n w, w =
Phi_e/tau and n = j pi/Phi_e, and the share n^2/(n^2 - 1)^2 of <x'^2>: the even numbers of |cos|
with a stop at rest, 1 alone on a free orbit.

The correction of second order is that of a stop at rest, to the power of the squared probability of
an orbit that meets the stop.  The stated errors are next to it
(`harvester.averaging.two_scale.second_order`).  A law that does not settle (beta above 2 or so near
grazing) is an error.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import or_zero
from harvester.averaging.two_scale.cycles import Cycles
from harvester.averaging.two_scale.energy_law import paid
from harvester.averaging.two_scale.gap_cycles import DistantOrbits, potential
from harvester.averaging.two_scale.gap_grid import Grid, half_widths_that_matter
from harvester.averaging.two_scale.second_order import (
    amplified,
    correction,
    stated_error_distant,
    stated_error_preloaded,
)
from harvester.equations.coefficients import Equations

_ROUNDS = 6  # of the voltage, the potential that it bends, and the rest position
_UNSETTLED = 0.1  # change of E[V^2] in the last round beyond which there is no answer
# density at an end of the grid, to its peak, beyond which the law is not on the grid
_AT_AN_END = 0.05
_ROUNDING = 1e-11  # <V^2>/a^2 of a mass that hardly leaves a preloaded stop, lost in differences
_HARMONICS = np.arange(1.0, 60.0)[:, None, None]


@dataclass(frozen=True)
class Spread:
    """How the law spreads over the plane: orbits in the order of their energies.

    Arrays (n,), ``nu`` (n, N).

    ``left`` is the left end of the half cycle and -B that of the orbit without a stop, as in
    `harvester.averaging.two_scale.gap_cycles`; ``level`` is p(E)/T, the density in the plane: the area between two
    orbits of the same potential is T dE.  ``energy`` is that above the least one.
    """

    A: Floats
    B: Floats
    left: Floats
    nu: Floats
    energy: Floats
    mass: Floats
    level: Floats
    gap: Floats  # ()

    def of(self, scene: int, length: float) -> "Spread":
        """The spread of one scene of a stack, with x in units of the equations: ``length`` is the stack's own unit."""
        powers = {"A": 1, "B": 1, "left": 1, "nu": 0, "energy": 2, "mass": 0, "level": -2, "gap": 1}
        return Spread(
            **{name: getattr(self, name)[scene] * length**power for name, power in powers.items()}
        )


def solve_distant(
    eqs: Equations, scenes: int
) -> tuple[dict[str, Floats], dict[str, Floats], Spread, Any]:
    """Solve a stack of scenes: moments and small parameters, shape (scenes,), orbits, and which are unbounded."""
    low, high, unbounded = half_widths_that_matter(eqs, scenes)
    rest = np.zeros((scenes, 1))
    orbits = DistantOrbits(Grid(low, high, rest, eqs).B, eqs)
    offset, slow = np.zeros_like(orbits.B), np.zeros_like(orbits.B)
    size = np.zeros(scenes)
    for _ in range(_ROUNDS if eqs.beta is not None else 2):
        grid = Grid(low, high, rest, eqs)
        orbits.refine(grid.B, rest, offset)
        cycle = orbits.averages()
        slope = grid.rising(cycle.energy)
        mass = grid.mass(cycle, slope, slow)
        memory, square = grid.slow_voltage(cycle, slope, mass)
        # a free orbit's mean gives way by beta V
        offset = offset + (memory - offset) / (1.0 + or_zero(eqs.beta))
        slow = paid(square, cycle, eqs)
        rest = _rest(offset[:, :1], eqs)
        before = size
        size = (mass * (cycle.V2 + slow)).sum(axis=-1)
    parts = _summary(eqs, orbits, cycle, mass, memory)
    density = mass / grid.weights
    unsettled = np.abs(size / before - 1.0)
    outside = np.maximum(density[:, 0], density[:, -1]) > _AT_AN_END * density.max(axis=-1)
    lost = (
        outside | (unsettled > _UNSETTLED) | (size < _ROUNDING * (mass * orbits.a**2).sum(axis=-1))
    )
    parts["bias"] = np.where(lost, math.nan, parts["bias"] + unsettled)
    arrays = {"A": orbits.A, "mass": mass, "period": cycle.period, "nu": orbits.nu}
    level = density / (slope * cycle.period)
    above = cycle.energy - _least(eqs)
    spread = Spread(
        A=orbits.A,
        B=orbits.B,
        left=orbits.left,
        nu=orbits.nu,
        energy=above,
        mass=mass,
        level=level,
        gap=or_zero(eqs.gap)[:, 0],
    )
    return parts, arrays, spread, unbounded


def _least(eqs: Equations) -> Floats:
    """The least energy: that of the spring at the stop with a preload, else 0."""
    return potential(np.minimum(or_zero(eqs.gap), 0.0), eqs.alpha)


def _rest(offset: Floats, eqs: Equations) -> Floats:
    """The root of c + alpha c^3 = -beta V, for free orbits under the slow voltage V, by Newton.

    0 with a preload.
    """
    alpha = or_zero(eqs.alpha)
    force = -or_zero(eqs.beta) * offset
    c = force
    for _ in range(8):
        c = (force + 2.0 * alpha * c**3) / (1.0 + 3.0 * alpha * c**2)
    # Not more than half of the way to the stop; with a preload there are no free orbits, or too few
    # to be told.
    return np.where(or_zero(eqs.gap) > 0.0, np.maximum(c, -0.5 * or_zero(eqs.gap)), 0.0)


def _summary(
    eqs: Equations, orbits: DistantOrbits, cycle: Cycles, mass: Floats, memory: Floats
) -> dict[str, Floats]:
    """Put the scales together, with the widths of their lines; arrays of shape (scenes,)."""

    def mean(values: Floats) -> Floats:
        return np.asarray((mass * values).sum(axis=-1))

    def scalar(value: Any) -> Any:
        return 0.0 if value is None else value[:, 0]

    mu = scalar(eqs.mu)
    beta = scalar(eqs.beta)
    r2 = scalar(eqs.restitution) ** 2
    x2, v2, xbar, period = (mean(values) for values in (cycle.x2, cycle.v2, cycle.x, cycle.period))
    slow = mean((cycle.x - xbar[:, None]) * memory)
    power_in = scalar(eqs.n1) + scalar(eqs.n2) * x2 + 2.0 * scalar(eqs.n12) * xbar
    # losses other than the load
    c = (np.maximum(power_in - beta * mu * (mean(cycle.V2) + slow), 0.0) / v2)[:, None]
    # A free orbit has one harmonic, whose share is all: the formula reports it just short of pi.
    end = np.minimum(orbits.end, math.pi - 1e-6)
    w = end / orbits.tau
    n = _HARMONICS * math.pi / end
    share = (n / (n**2 - 1.0)) ** 2
    narrow = (n * w) ** 2 + or_zero(eqs.mu) ** 2
    # With a preload, where the frequency falls with the amplitude, the lines are narrower: a factor
    # from ensembles.
    dying = _HARMONICS * np.minimum(math.pi / end, 4.0 * end / math.pi)
    lines = (share / (narrow + dying * c * or_zero(eqs.mu))).sum(axis=0) / (share / narrow).sum(
        axis=0
    )
    fast = mean(cycle.V2 * lines)
    slow = slow / (1.0 + (0.5 * mu / mean(w)) ** 2)
    total = mean(cycle.energy)
    least = _least(eqs)[:, 0]
    energy = total - least
    exchange = power_in * period / energy
    stored = 0.5 * beta * (fast + slow) / energy
    impact_loss = 2.0 * (1.0 - r2) / (1.0 + r2) * mean(cycle.wall / cycle.period) * period / energy
    load = beta * mu * (fast + slow) * period / energy
    friction = exchange - impact_loss - load
    friction_loss = np.maximum(friction, 0.0)
    touching = mean(np.where(cycle.wall > 0.0, 1.0, 0.0))
    factor = correction(impact_loss, stored, mu / mean(w)) ** touching**2
    return {
        "mean_square_voltage": factor * (fast + slow),
        "fast": fast,
        "slow": slow,
        "x2": x2,
        "v2": v2,
        "bias": np.where(
            scalar(eqs.gap) < 0.0,
            stated_error_preloaded(
                impact_loss, stored, friction_loss, load, mu * period / math.pi, least / total
            ),
            stated_error_distant(impact_loss, stored, friction_loss, load, exchange, touching),
        )
        * amplified(friction, exchange),
        "exchange": exchange,
        "impact_loss": impact_loss,
        "stored": stored,
    }
