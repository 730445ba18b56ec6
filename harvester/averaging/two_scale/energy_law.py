"""The slow scale: drift and diffusion of the energy, their stationary law, and the voltage that follows it.

Arrays have the shape (scenes, amplitudes), ln A = u evenly spaced in each row.
"""

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import or_zero
from harvester.averaging.two_scale.cycles import Cycles
from harvester.equations.coefficients import Equations


def drift(cycle: Cycles, slow: Floats, eqs: Equations) -> Floats:
    """Drift b(E) of the energy at each amplitude.

    ``slow`` is the square of the slow voltage that it pays for.
    """
    b = -cycle.damped - or_zero(eqs.beta) * or_zero(eqs.mu) * (cycle.V2 + slow)
    b = b + or_zero(eqs.n1) + or_zero(eqs.n2) * cycle.x2 + 2.0 * or_zero(eqs.n12) * cycle.x
    if eqs.restitution is not None:
        r2 = eqs.restitution**2
        b = b - 2.0 * (1.0 - r2) / (1.0 + r2) * cycle.wall / cycle.period
    return b


def diffusion(cycle: Cycles, eqs: Equations) -> Floats:
    """Diffusion sigma^2(E) of the energy at each amplitude."""
    n1 = or_zero(eqs.n1)
    n2 = or_zero(eqs.n2)
    n12 = or_zero(eqs.n12)
    return 2.0 * n1 * cycle.v2 + 2.0 * n2 * cycle.x2v2 + 4.0 * n12 * cycle.xv2


def log_mass(u: Floats, cycle: Cycles, slope: Floats, slow: Floats, eqs: Equations) -> Floats:
    """Logarithm of p(E) dE/du up to a constant.

    Its integral is by the trapezoidal rule with an end correction.
    """
    s = diffusion(cycle, eqs)
    rate = 2.0 * drift(cycle, slow, eqs) / s * slope
    du = u[..., 1:] - u[..., :-1]
    bend = slope_on_grid(u, rate)
    inner = 0.5 * du * (rate[..., 1:] + rate[..., :-1]) - du**2 / 12.0 * (
        bend[..., 1:] - bend[..., :-1]
    )
    return np.asarray(
        np.log(slope / s) + np.concatenate([0.0 * u[..., :1], np.cumsum(inner, axis=-1)], axis=-1)
    )


def slope_on_grid(u: Floats, values: Floats) -> Floats:
    """Slope d/du on an evenly spaced grid: fourth order inside, second at the ends, at which the law vanishes."""
    du = u[..., 1] - u[..., 0]
    slope = np.empty_like(values)
    over_2, over_4 = values[..., 2:] - values[..., :-2], values[..., 4:] - values[..., :-4]
    slope[..., 2:-2] = (8.0 * over_2[..., 1:-1] - over_4) / 12.0
    slope[..., 1] = 0.5 * over_2[..., 0]
    slope[..., -2] = 0.5 * over_2[..., -1]
    slope[..., 0] = -1.5 * values[..., 0] + 2.0 * values[..., 1] - 0.5 * values[..., 2]
    slope[..., -1] = 1.5 * values[..., -1] - 2.0 * values[..., -2] + 0.5 * values[..., -3]
    return np.asarray(slope / du[..., None])


def rising(u: Floats, energy: Floats) -> Floats:
    """Slope dE/du, kept positive if the slow voltage would turn it around."""
    return np.asarray(energy * np.maximum(slope_on_grid(u, np.log(energy)), 0.1))


def normalised(log_p: Floats) -> Floats:
    """The probability of each amplitude, from its logarithm up to a constant."""
    mass = np.exp(log_p - log_p.max(axis=-1, keepdims=True))
    return np.asarray(mass / mass.sum(axis=-1, keepdims=True))


def with_tail(mass: Floats, A: Floats) -> Floats:
    """The probabilities as weights of means of quantities that grow as A^2, with the tail beyond the last amplitude.

    There mass falls as A^-q, and each step further of du weighs exp((2 - q) du) times the one
    before: a factor 1/(1 - exp((2 - q) du)) on the last weight, infinite if no such mean exists.
    """
    weights = mass.copy()
    du = np.log(A[..., -1] / A[..., -2])
    falling = np.log(mass[..., -2] / mass[..., -1]) - 2.0 * du  # (q - 2) du
    weights[..., -1] = np.where(falling > 0.0, mass[..., -1] / -np.expm1(-falling), np.inf)
    return np.asarray(weights)


def slow_voltage(
    u: Floats, cycle: Cycles, slope: Floats, mass: Floats, eqs: Equations
) -> tuple[Floats, Floats]:
    """Mean and mean square of the slow voltage V = xt - y at each amplitude, y' = mu (xt - y).

    (mu - L) E[y|A] = mu xt,    (2 mu - L) E[y^2|A] = 2 mu xt E[y|A]
    """
    xt = cycle.x - (mass * cycle.x).sum(axis=-1, keepdims=True)
    if eqs.restitution is None or eqs.mu is None:
        return xt, xt**2
    flow = diffusion(cycle, eqs) * mass / slope**2 / (u[:, 1:2] - u[:, :1]) ** 2
    flow = 0.5 * np.sqrt(flow[:, 1:] * flow[:, :-1])
    # Slower than rounding lets L be told from nothing, y is its mean, 0, all the same.
    mu = np.maximum(or_zero(eqs.mu), 1e-13 * flow.sum(axis=-1, keepdims=True))
    y = _resolvent(mu, mu * xt, flow, mass)
    y2 = _resolvent(2.0 * mu, 2.0 * mu * xt * y, flow, mass)
    return xt - y, np.maximum(xt**2 - 2.0 * xt * y + y2, (xt - y) ** 2)


def paid(square: Floats, cycle: Cycles, eqs: Equations) -> Floats:
    """The part of the slow voltage's mean square that the mass pays for: nothing slow is faster than the cycle."""
    return np.asarray(square / (1.0 + (or_zero(eqs.mu) * cycle.period / (2.0 * np.pi)) ** 2))


def _resolvent(rate: Floats, right: Floats, flow: Floats, mass: Floats) -> Floats:
    """Solve (rate - L) y = right for y, with L the averaged generator.

    L is symmetric in the stationary law; between neighbouring amplitudes it carries the current
    ``flow``, p sigma^2/2 per dE, so that (rate - L) times the law is one positive tridiagonal
    matrix. Its elimination keeps the excess of a diagonal over its neighbours, so that nothing
    positive is subtracted: however small rate is compared with the flow, no digit is lost.
    (SciPy's solver would need longer to load than the answer needs.)
    """
    margin = rate * mass
    # A scene whose law is not finite must not spoil its neighbours.
    known = (
        np.isfinite(flow).all(axis=1) & np.isfinite(margin).all(axis=1) & (margin > 0.0).all(axis=1)
    )
    lost = np.logical_not(known)[:, None]
    margin, flow = np.where(lost, 1.0, margin), np.where(lost, 0.0, flow)
    sums = np.where(lost, np.nan, mass * right)
    flow = np.concatenate([flow, 0.0 * margin[:, :1]], axis=1)
    return np.array(
        [
            _one_scene(excess, flows, right_side)
            for excess, flows, right_side in zip(
                margin.tolist(), flow.tolist(), sums.tolist(), strict=True
            )
        ]
    )


def _one_scene(margin: list[float], flow: list[float], sums: list[float]) -> list[float]:
    """Solve one scene, one amplitude after another.

    ``margin`` is the excess of the diagonal over the flow.
    """
    excess = margin[0]
    diagonal = [margin[0] + flow[0]]
    for k in range(1, len(margin)):
        share = flow[k - 1] / diagonal[-1]
        excess = margin[k] + share * excess
        diagonal.append(flow[k] + excess)
        sums[k] += share * sums[k - 1]
    y = [*sums[:-1], sums[-1] / excess]
    for k in range(len(margin) - 2, -1, -1):
        y[k] = (sums[k] + flow[k] * y[k + 1]) / diagonal[k]
    return y
