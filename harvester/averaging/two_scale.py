"""Impact-aware two-scale averaging: what the published theory becomes with the true voltage.

Fast scale: on each cycle the periodic voltage is computed for the true orbit (`harvester.averaging.cycles`);
with a stop it has zero mean and only even harmonics.  Slow scale: the cycle's mean displacement
wanders with the amplitude, and the load high-passes it.  Energy E is the slow variable,

    dE = b dt + sigma dW
    b = -<f x'^2> - beta mu <V^2> - 2 (1 - r^2)/(1 + r^2) (x'^2/2 at the stop)/T + N1 + N2 <x^2> + 2 N12 <x>
    sigma^2 = 2 N1 <x'^2> + 2 N2 <x^2 x'^2> + 4 N12 <x x'^2>
    p(E) ~ sigma^-2 exp(int 2 b/sigma^2 dE),   L = b d/dE + sigma^2/2 d^2/dE^2

    E[V_slow^2] = Var(xbar) - mu <xt (mu - L)^-1 xt>,   xt = xbar - <xbar>

An impact takes E to r^2 E; between impacts noise adds energy at a steady rate, so that the time
average stands midway, hence (1 - r^2)/(1 + r^2) instead of the published 1 - r.  The slow voltage
pushes the mass: its mean at each amplitude enters the orbits' potential.  Both scales have lines of
finite width: a harmonic n w of x that dies out at the rate n c/2 gives n^2 w^2/(n^2 w^2 + mu^2 + n c mu),
and nothing slow is faster than the cycle, which takes 1/(1 + (mu/2w)^2) off the slow part.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import LinAlgError, solveh_banded

from harvester.arrays import Floats
from harvester.averaging.cycles import Cycles, Orbits
from harvester.errors import SimulationError, UnboundedResponseError
from harvester.scaling import Equations

_AMPLITUDES, _POINTS, _ROUNDS = 140, 64, 6
_KEPT = 20.0  # amplitudes less likely than e^-20 of the likeliest are left out
_HARMONICS = np.arange(1.0, 30.0)


@dataclass(frozen=True)
class TwoScale:
    """What the averaged theory says of a scene; nondimensional.

    ``mean_square_voltage`` = fast + slow; ``bias`` is a rough size of its relative model error (see
    `solve`); ``exchange`` the energy that noise brings in a cycle over the mean energy, the
    small parameter of averaging; ``stored`` the share of the energy that the piezo holds.
    ``orbits``, ``cycles`` and ``mass`` have their amplitudes in units
    of ``length``.
    """

    mean_square_voltage: float
    fast: float
    slow: float
    x2: float
    v2: float
    bias: float
    exchange: float
    stored: float
    orbits: Orbits
    cycles: Cycles
    length: float
    mass: Floats  # probability of each amplitude, shape (n,)


def density(of: str, edges: Floats, law: TwoScale) -> Floats:
    """Density of the amplitude ("a"), displacement ("d") or velocity ("v"), averaged over bins.

    edges: shape (m + 1,) -> shape (m,).  Each amplitude spreads its probability over its orbit
    by the time spent there.
    """
    edges = edges / law.length
    A = np.geomspace(law.cycles.A[0], law.cycles.A[-1], 4000)
    u = np.log(law.cycles.A)
    mass = np.exp(np.interp(np.log(A), u, np.log(law.mass)))
    x, v, weight = law.orbits.at(A)
    weight = weight * (mass / mass.sum())[:, None]
    values = {"a": np.broadcast_to(A[:, None], x.shape), "d": x, "v": v}[of]
    return np.asarray(np.histogram(values, edges, weights=weight)[0] / (np.diff(edges) * law.length))


def solve(eqs: Equations) -> TwoScale:
    """Stationary law and E[V^2] by two-scale averaging.

    With a stop the bias is .15 exchange^2 (how little one cycle changes the energy) plus the share of the
    energy that the piezo stores (how little the voltage bends the orbit); without, where linear
    scenes come out exact, a hundredth of both.  Measured against the coupled equations for r from .5
    to .99, beta up to 2 and mu from .001 to 1000 on the paper's scene (a test repeats some of it).

    Raises
    ------
    SimulationError
        without external noise, where no stationary law exists.
    UnboundedResponseError
        where the law does not fall off at large amplitudes.
    """
    if eqs.n1 is None:
        raise SimulationError(
            "the averaged law needs external noise (D11 or acceleration_psd): without it the stationary amplitude is "
            "zero or not unique; use engine 'ensemble'"
        )
    length = math.sqrt(eqs.n1)
    with np.errstate(all="ignore"):  # amplitudes of no weight may overflow
        law = _solve(_in_units_of(length, eqs), length)
    if not math.isfinite(law.mean_square_voltage) or not math.isfinite(law.bias):
        raise SimulationError("the averaged law has no finite mean here: use engine 'ensemble'")
    return law


def _in_units_of(length: float, eqs: Equations) -> Equations:
    """The same scene with x measured in ``length``: no answer depends on it, and no scale is out of reach."""
    powers = {"alpha": 2, "c2": 2, "c3": 4, "n1": -2, "n12": -1}
    scaled = {name: getattr(eqs, name) for name in powers}
    return replace(eqs, **{name: v if v is None else v * length ** powers[name] for name, v in scaled.items()})


def _solve(eqs: Equations, length: float) -> TwoScale:
    u = _where_the_mass_is(eqs)
    A = np.exp(u)
    orbits = Orbits(A, eqs, _POINTS)
    offset = np.zeros_like(A)
    rounds = _ROUNDS if eqs.beta and eqs.restitution is not None else 3
    for _ in range(rounds):
        orbits.refine(offset)
        cycle = orbits.averages()
        slope = _rising(u, cycle.energy)
        mass = _normalised(_log_mass(u, cycle, slope, offset, eqs))
        memory = _slow_voltage(u, cycle, slope, mass, eqs)
        if eqs.beta:
            # Beyond this the offset's push would keep the mass of that amplitude from reaching the stop.
            offset = np.maximum(memory, -0.3 * A / eqs.beta)
    return _summary(eqs, orbits, cycle, mass, memory, length)


def _summary(eqs: Equations, orbits: Orbits, cycle: Cycles, mass: Floats, memory: Floats, length: float) -> TwoScale:
    """Put the scales together, with the widths of their lines."""
    mu, beta = eqs.mu or 0.0, eqs.beta or 0.0
    x2, v2, xbar = (float(mass @ values) for values in (cycle.x2, cycle.v2, cycle.x))
    fast, energy = float(mass @ cycle.V2), float(mass @ cycle.energy)
    slow = float(mass @ ((cycle.x - xbar) * memory))
    power_in = (eqs.n1 or 0.0) + (eqs.n2 or 0.0) * x2 + 2.0 * (eqs.n12 or 0.0) * xbar
    period = float(mass @ cycle.period)
    w = (1.0 if eqs.restitution is not None else 2.0) * math.pi / period
    c = max(power_in - beta * mu * (fast + slow), 0.0) / v2  # rate of the losses other than the load
    if eqs.restitution is None:
        fast *= (w * w + mu * mu) / (w * w + mu * mu + c * mu)
    else:
        n = 2.0 * _HARMONICS
        share = n**2 / (n**2 - 1.0) ** 2  # of <x'^2> in the harmonics of |cos|
        whole, narrow = n**2 * w**2 + mu**2 + n * c * mu, n**2 * w**2 + mu**2
        fast *= float((share / whole).sum() / (share / narrow).sum())
        slow /= 1.0 + (0.5 * mu / w) ** 2
    exchange = power_in * period / energy
    stored = 0.5 * beta * (fast + slow) / energy
    if eqs.restitution is None:
        bias = 0.002 + 0.01 * min(exchange, 1.0) + 0.01 * stored
    else:
        bias = 0.002 + 0.15 * min(exchange, 1.5) ** 2 + stored
    area = length**2
    return TwoScale(
        mean_square_voltage=(fast + slow) * area,
        fast=fast * area,
        slow=slow * area,
        x2=x2 * area,
        v2=v2 * area,
        bias=bias,
        exchange=exchange,
        stored=stored,
        orbits=orbits,
        cycles=cycle,
        length=length,
        mass=mass,
    )


def _where_the_mass_is(eqs: Equations) -> Floats:
    """A grid of ln A over the amplitudes that matter."""
    low, high, widest = math.log(1e-8), math.log(1e8), math.log(1e8)
    for points in (161, 81, 81, 81):
        u = np.linspace(low, high, points)
        cycle = Orbits(np.exp(u), eqs, 16).averages()
        log_mass = _log_mass(u, cycle, _rising(u, cycle.energy), np.zeros_like(u), eqs)
        kept = np.flatnonzero(log_mass >= log_mass.max() - _KEPT)
        if kept[-1] == points - 1 and high >= widest:
            raise UnboundedResponseError("the averaged amplitude grows without bound: add damping that bounds it")
        low, high = float(u[max(kept[0] - 1, 0)]), float(u[min(kept[-1] + 1, points - 1)])
    return np.linspace(low, high, _AMPLITUDES)


def drift(cycle: Cycles, offset: Floats, eqs: Equations) -> Floats:
    """b(E) at each amplitude; ``offset`` is the slow voltage there."""
    b = -cycle.damped - (eqs.beta or 0.0) * (eqs.mu or 0.0) * (cycle.V2 + offset**2)
    b = b + (eqs.n1 or 0.0) + (eqs.n2 or 0.0) * cycle.x2 + 2.0 * (eqs.n12 or 0.0) * cycle.x
    if eqs.restitution is not None:
        r2 = eqs.restitution**2
        b = b - 2.0 * (1.0 - r2) / (1.0 + r2) * cycle.wall / cycle.period
    return b


def diffusion(cycle: Cycles, eqs: Equations) -> Floats:
    """sigma^2(E) at each amplitude."""
    n1, n2, n12 = eqs.n1 or 0.0, eqs.n2 or 0.0, eqs.n12 or 0.0
    return 2.0 * n1 * cycle.v2 + 2.0 * n2 * cycle.x2v2 + 4.0 * n12 * cycle.xv2


def _log_mass(u: Floats, cycle: Cycles, slope: Floats, offset: Floats, eqs: Equations) -> Floats:
    """ln(p(E) dE/du) up to a constant; the integral by the trapezoidal rule with its end correction."""
    s = diffusion(cycle, eqs)
    rate = 2.0 * drift(cycle, offset, eqs) / s * slope
    du, bend = u[1] - u[0], np.gradient(rate, u)
    inner = 0.5 * du * (rate[1:] + rate[:-1]) - du**2 / 12.0 * (bend[1:] - bend[:-1])
    return np.asarray(np.log(slope / s) + np.concatenate([[0.0], np.cumsum(inner)]))


def _rising(u: Floats, energy: Floats) -> Floats:
    """dE/du, kept positive where the slow voltage would turn it around."""
    return np.asarray(energy * np.maximum(CubicSpline(u, np.log(energy))(u, 1), 0.1))


def _normalised(log_mass: Floats) -> Floats:
    mass = np.exp(log_mass - log_mass.max())
    return np.asarray(mass / mass.sum())


def _slow_voltage(u: Floats, cycle: Cycles, slope: Floats, mass: Floats, eqs: Equations) -> Floats:
    """Mean slow voltage at each amplitude: xt - mu (mu - L)^-1 xt.

    L is symmetric in the stationary law; between neighbouring amplitudes it carries the current
    p sigma^2/2 per dE, so that (mu - L) times the law is one positive tridiagonal matrix.
    """
    xt = cycle.x - float(mass @ cycle.x)
    mu = eqs.mu or 0.0
    if eqs.restitution is None or mu == 0.0:
        return xt
    flow = diffusion(cycle, eqs) * mass / slope**2 / (u[1] - u[0]) ** 2
    flow = 0.5 * np.sqrt(flow[1:] * flow[:-1])
    bands = np.zeros((2, len(u)))
    bands[0, 1:] = -flow
    bands[1] = mu * mass
    bands[1, :-1] += flow
    bands[1, 1:] += flow
    try:
        return np.asarray(xt - mu * solveh_banded(bands, mass * xt))
    except LinAlgError:
        raise SimulationError("the averaged law has no usable slow scale here: use engine 'ensemble'") from None
