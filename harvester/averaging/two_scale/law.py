"""Impact-aware two-scale averaging: the published theory with the true voltage.

Fast scale: on each cycle the periodic voltage is computed for the true orbit
(`harvester.averaging.two_scale.cycles`); with a stop it has zero mean and only even harmonics.
Slow scale: the cycle's mean displacement wanders with the amplitude, and the load high-passes it.
Energy E is the slow variable,

    dE = b dt + sigma dW
    b = -<f x'^2> - beta mu <V^2> - 2 (1 - r^2)/(1 + r^2) (x'^2/2 at the stop)/T + N1 + N2 <x^2> + 2 N12 <x>
    sigma^2 = 2 N1 <x'^2> + 2 N2 <x^2 x'^2> + 4 N12 <x x'^2>
    p(E) ~ sigma^-2 exp(int 2 b/sigma^2 dE),   L = b d/dE + sigma^2/2 d^2/dE^2

    E[V_slow^2] = Var(xbar) - mu <xt (mu - L)^-1 xt>,   xt = xbar - <xbar>

An impact reduces E to r^2 E; between impacts noise adds energy at a steady rate, so that the time
average is midway, hence (1 - r^2)/(1 + r^2) instead of the published 1 - r.  The slow voltage
pushes the mass: its mean at each amplitude enters the orbits' potential.  Both scales have lines of
finite width: a harmonic n w of x that dies out at the rate n c/2 gives n^2 w^2/(n^2 w^2 + mu^2 + n
c mu), and nothing slow is faster than the cycle, which multiplies the slow part by 1/(1 +
(mu/2w)^2).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import (
    KEPT,
    SEARCH,
    noisy_stacks,
    or_zero,
    stacked,
    where_the_mass_is,
)
from harvester.averaging.two_scale.cycles import Cycles, Orbits
from harvester.averaging.two_scale.energy_law import (
    log_mass,
    normalised,
    paid,
    rising,
    slow_voltage,
    with_tail,
)
from harvester.averaging.two_scale.gap_law import Spread, solve_distant
from harvester.averaging.two_scale.second_order import amplified, correction, stated_error
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError, UnboundedResponseError

_AMPLITUDES = 96
_ROUNDS = 6  # of the voltage and the potential that it bends
_WIDEST = (-math.log(1e8), math.log(1e8))  # of ln A
_HARMONICS = np.arange(1.0, 30.0)[:, None]
_TOGETHER = 32  # scenes in one go: their arrays stay in the processor's cache
_NO_NOISE = (
    "the averaged law needs external noise (D11 or acceleration_psd): without it the stationary amplitude is "
    "zero or not unique; use engine 'ensemble'"
)


@dataclass(frozen=True)
class TwoScale:
    """The answer of two-scale averaging for a scene; nondimensional.

    ``mean_square_voltage`` is fast + slow, with a stop at rest times the factor of second order; ``bias`` is a rough
    size of its relative model error (see `solve`). ``exchange`` is the energy that noise brings in a cycle over the
    mean energy, the small parameter of averaging; ``impact_loss`` the fraction of the energy that
    impacts dissipate in a cycle, ``stored`` the fraction that the piezo holds.
    ``A`` are the amplitudes, ``mass`` the probability of each (their ln A is evenly spaced), ``period``
    the time of a cycle, ``nu`` its dPhi/dt at the Gauss points of a quarter, shape (n, N).
    With a stop at a distance or preloaded, A are right turning points, not evenly spaced, and ``nu`` is
    at the points of half a cycle; ``spread`` is there only then.
    """

    mean_square_voltage: float
    fast: float
    slow: float
    x2: float
    v2: float
    bias: float
    exchange: float
    impact_loss: float
    stored: float
    A: Floats
    mass: Floats
    period: Floats
    nu: Floats
    spread: Spread | None = None


def solve(eqs: Equations) -> TwoScale:
    """Stationary law and E[V^2] by two-scale averaging.

    With a stop at rest, correction and bias are those of
    `harvester.averaging.two_scale.second_order`; without a stop, in which linear scenes are exact,
    the bias is a hundredth of exchange and store. For a stop at a distance or preloaded see
    `harvester.averaging.two_scale.gap_law`.

    Raises SimulationError without external noise, if no stationary law exists. Also if the
    voltage and the orbits that it bends do not settle (strong coupling near grazing), or if a
    preloaded mass hardly leaves the stop; UnboundedResponseError if the law does not fall off at
    large amplitudes.
    """
    answer = solve_many([eqs])[0]
    if isinstance(answer, SimulationError):
        raise answer
    return answer


def solve_many(scenes: Sequence[Equations]) -> list[TwoScale | SimulationError]:
    """Solve many scenes at once; the error of a scene without an answer is in its place."""
    at_rest = [replace(eqs, gap=None) if eqs.gap == 0.0 else eqs for eqs in scenes]
    return noisy_stacks(at_rest, _TOGETHER, _solve, _NO_NOISE)


def _in_units_of(length: float, eqs: Equations) -> Equations:
    """The same scene with x measured in ``length``: no answer depends on it, and no scale is out of reach."""
    powers = {"alpha": 2, "c2": 2, "c3": 4, "n1": -2, "n12": -1, "gap": -1}
    scaled = {name: getattr(eqs, name) for name in powers}
    return replace(
        eqs, **{name: v if v is None else v * length ** powers[name] for name, v in scaled.items()}
    )


def _solve(scenes: list[Equations]) -> list[TwoScale | SimulationError]:
    """Solve a stack of scenes with the same effects: arrays are (scenes, amplitudes)."""
    lengths = [math.sqrt(or_zero(eqs.n1)) for eqs in scenes]
    eqs = stacked(
        [_in_units_of(length, scene) for length, scene in zip(lengths, scenes, strict=True)]
    )
    spread = None
    if eqs.gap is None:
        parts, orbits, unbounded = _at_rest(eqs, len(lengths))
    else:
        parts, orbits, spread, unbounded = solve_distant(eqs, len(lengths))
    answers: list[TwoScale | SimulationError] = []
    for k, length in enumerate(lengths):
        scales = {name: float(values[k]) for name, values in parts.items()}
        for name in ("mean_square_voltage", "fast", "slow", "x2", "v2"):
            scales[name] *= length**2
        arrays = {
            name: values[k] * (length if name == "A" else 1.0) for name, values in orbits.items()
        }
        if unbounded[k]:
            answers.append(
                UnboundedResponseError(
                    "the averaged amplitude grows without bound: add damping that bounds it"
                )
            )
        elif not all(map(math.isfinite, scales.values())):
            answers.append(
                SimulationError("the averaged law finds no finite mean here: use engine 'ensemble'")
            )
        else:
            mine = None if spread is None else spread.of(k, length)
            answers.append(TwoScale(**scales, **arrays, spread=mine))  # type: ignore[arg-type]
    return answers


def _at_rest(eqs: Equations, scenes: int) -> tuple[dict[str, Floats], dict[str, Floats], Any]:
    """Moments and small parameters, orbits, and which scenes are unbounded.

    For no stop, or one at rest.
    """
    u, unbounded = _where_the_mass_is(eqs, scenes)
    A = np.exp(u)
    orbits = Orbits(A, eqs)
    offset, slow = np.zeros_like(A), np.zeros_like(A)
    for _ in range(_ROUNDS if eqs.beta is not None and eqs.restitution is not None else 3):
        orbits.refine(offset)
        cycle = orbits.averages()
        slope = rising(u, cycle.energy)
        mass = normalised(log_mass(u, cycle, slope, slow, eqs))
        memory, square = slow_voltage(u, cycle, slope, mass, eqs)
        if eqs.beta is not None:
            # Beyond this the offset's push would keep the mass of that amplitude from reaching the
            # stop.
            offset = np.maximum(memory, -0.3 * A / eqs.beta)
            slow = paid(square, cycle, eqs)
    arrays = {"A": A, "mass": mass, "period": cycle.period, "nu": orbits.nu}
    return _summary(eqs, cycle, mass, memory), arrays, unbounded


def _summary(eqs: Equations, cycle: Cycles, mass: Floats, memory: Floats) -> dict[str, Floats]:
    """Put the scales together, with the widths of their lines; arrays of shape (scenes,)."""
    weights = with_tail(mass, cycle.A)

    def mean(values: Floats) -> Floats:
        return np.asarray((weights * values).sum(axis=-1))

    def scalar(value: Any) -> Any:
        return 0.0 if value is None else value[:, 0]

    mu, beta = scalar(eqs.mu), scalar(eqs.beta)
    x2, v2 = mean(cycle.x2), mean(cycle.v2)
    xbar, period = ((mass * values).sum(axis=-1) for values in (cycle.x, cycle.period))
    fast, energy = mean(cycle.V2), mean(cycle.energy)
    slow = mean((cycle.x - xbar[:, None]) * memory)
    power_in = scalar(eqs.n1) + scalar(eqs.n2) * x2 + 2.0 * scalar(eqs.n12) * xbar
    w = (2.0 if eqs.restitution is None else 1.0) * math.pi / period
    # rate of the losses other than the load
    c = np.maximum(power_in - beta * mu * (fast + slow), 0.0) / v2
    if eqs.restitution is None:
        fast *= (w * w + mu * mu) / (w * w + mu * mu + c * mu)
    else:
        n = 2.0 * _HARMONICS
        share = n**2 / (n**2 - 1.0) ** 2  # of <x'^2> in the harmonics of |cos|
        whole = n**2 * w**2 + mu**2 + n * c * mu
        narrow = n**2 * w**2 + mu**2
        fast *= (share / whole).sum(axis=0) / (share / narrow).sum(axis=0)
        slow /= 1.0 + (0.5 * mu / w) ** 2
    exchange = power_in * period / energy
    stored = 0.5 * beta * (fast + slow) / energy
    impact_loss, factor = np.zeros_like(energy), np.ones_like(energy)
    if eqs.restitution is None:
        bias = 0.002 + 0.01 * np.minimum(exchange, 1.0) + 0.01 * stored
    else:
        r2 = scalar(eqs.restitution) ** 2
        impact_loss = (
            2.0 * (1.0 - r2) / (1.0 + r2) * mean(cycle.wall / cycle.period) * period / energy
        )
        friction_loss = exchange - impact_loss - beta * mu * (fast + slow) * period / energy
        factor = correction(impact_loss, stored, mu / w)
        bias = stated_error(impact_loss, stored, np.maximum(friction_loss, 0.0)) * amplified(
            friction_loss, exchange
        )
    return {
        "mean_square_voltage": factor * (fast + slow),
        "fast": fast,
        "slow": slow,
        "x2": x2,
        "v2": v2,
        "bias": bias,
        "exchange": exchange,
        "impact_loss": impact_loss,
        "stored": stored,
    }


def _where_the_mass_is(eqs: Equations, scenes: int) -> tuple[Floats, Any]:
    """A grid of ln A over the amplitudes that matter, shape (scenes, n), and which scenes have no end to it."""

    def law(u: Floats) -> Floats:
        cycle = Orbits(np.exp(u), eqs, 8, 1).averages()
        return log_mass(u, cycle, rising(u, cycle.energy), np.zeros_like(u), eqs)

    ends = np.full(scenes, _WIDEST[0]), np.full(scenes, _WIDEST[1])
    low, high, unbounded = where_the_mass_is(ends, SEARCH, law, KEPT)
    return np.linspace(low, high, _AMPLITUDES, axis=-1), unbounded
