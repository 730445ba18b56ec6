"""The load resistor by ngspice's integration rule, in place of the exact update: the very steps of the lock-step.

    V1 - V0 + mu t (w V0 + (1 - w) V1) = x' t

for a step of length t at constant velocity.  The weight w makes that exact for a whole drift, not for the parts before
and after an impact, nor for the halves of a drift in which ngspice lands on a reading.  The difference is one part in a
million, but it moves a grazing impact now and then to the other side of a kick, and the paths part.  By the same rule
they agree to rounding, and ngspice's mean needs few runs beside a long ensemble
(`harvester.uncertainty.control_variate`).
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import inlined, kernel
from harvester.mechanics.kernels.equation_of_motion import friction, kick
from harvester.mechanics.kernels.lanes import LANES
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.kernels.path import COLUMNS, Path, coefficients, room_for_impacts


@inlined
def rule_weight(z):
    """The weight w of a step's beginning, ngspice's xmu: 1/z - 1/(exp(z) - 1) for a drift of z = mu h.

    It is 1/2, the trapezoidal rule, for a short step and goes to 0, backward Euler, for a long one, where the
    trapezoidal rule would ring.
    """
    if z < 1e-3:
        return 0.5 - z / 12.0
    return 1.0 / z - (1.0 / math.expm1(z) if z < 700.0 else 0.0)


@inlined
def stepped_voltage(V, v, t, mu, w):
    """The voltage V after a step of length t at constant velocity v."""
    return ((1.0 - w * mu * t) * V + v * t) / (1.0 + (1.0 - w) * mu * t)


@inlined
def drift_by_ngspice_rule(x, v, V, t, mu, r, w):
    """Drift by t: (x, v, V, speed of the impact or 0), without a branch, so that loops vectorise.

    ngspice lands on the impact: one step to it and one beyond, of length 0 where there is none.
    """
    x1 = x + t * v
    if r is None:
        return x1, v, stepped_voltage(V, v, t, mu, w), 0.0
    hit = x1 < 0.0
    after = x1 / v if hit else 0.0
    V1 = stepped_voltage(stepped_voltage(V, v, t - after, mu, w), -r * v, after, mu, w)
    return (-r * x1 if hit else x1), (-r * v if hit else v), V1, (-v if hit else 0.0)


@kernel
def advance_by_ngspice_rule(
    x, v, V, s0, s1, sums, readings, stride, coarse, landed, h, mu, r, alpha, beta, c1, c2, c3, n1, n2, n12
):  # fmt: skip
    """Advance a block as `harvester.mechanics.kernels.lanes.advance` does, for a stop at rest or none.

    The state is that of a reading in mid-drift, where ngspice has landed, and goes on from there; ``landed`` is False
    before the first one.
    """
    w = rule_weight(mu * h)
    noise, steps = np.zeros((2, LANES)), 1 if coarse else 2
    for _ in range(readings):
        for k in range(stride):
            if k % steps == 0:
                draw_noise(noise, s0, s1, coarse)
            xi = noise[k % steps]
            t = 0.5 * h if landed and k == 0 else h
            for i in range(LANES):
                xn, vn, Vn, speed = drift_by_ngspice_rule(x[i], v[i], V[i], t, mu, r, w)
                if r is not None:
                    sums[10, i] += 1.0 if speed > 0.0 else 0.0
                    sums[11, i] += speed * speed
                x[i], V[i] = xn, Vn
                v[i] = kick(xn, vn, Vn, xi[i], h, alpha, beta, c1, c2, c3, n1, n2, n12)
        landed = True
        for i in range(LANES):
            xk, Vk = x[i], V[i]
            xm, vm, Vm, speed = drift_by_ngspice_rule(xk, v[i], Vk, 0.5 * h, mu, r, w)
            sums[0, i] += 0.5 * (Vk + Vm)
            sums[1, i] += Vk * Vk
            sums[2, i] += Vm * Vm
            sums[3, i] += 0.5 * (xk + xm)
            sums[4, i] += xk * xk
            sums[5, i] += xm * xm
            sums[6, i] += vm * vm
            sums[7, i] += 0.5 * (xk * Vk + xm * Vm)
            sums[8, i] += vm * Vm
            if c1 is not None or c2 is not None or c3 is not None:
                sums[9, i] += friction(xm, c1, c2, c3) * vm * vm
            if r is not None:
                sums[10, i] += 1.0 if speed > 0.0 else 0.0
                sums[11, i] += speed * speed
            x[i], v[i], V[i] = xm, vm, Vm


@kernel
def _trace(noise, h, stride, readings, impacts, mu, r, alpha, beta, c1, c2, c3, n1, n2, n12):
    x = v = V = done = 0.0
    w, count = rule_weight(mu * h), 0
    for k in range(1, len(readings) * stride + 1):
        before = x, v
        x, v, V, hit = drift_by_ngspice_rule(x, v, V, h - done, mu, r, w)
        if hit > 0.0:
            impacts[count, 0], impacts[count, 1] = (k - 1) * h + done - before[0] / before[1], hit
            count += 1
        v, done = kick(x, v, V, noise[k - 1], h, alpha, beta, c1, c2, c3, n1, n2, n12), 0.0
        if k % stride == 0:
            row, before, done = readings[k // stride - 1], (x, v), 0.5 * h
            row[0], row[1] = x, V
            x, v, V, hit = drift_by_ngspice_rule(x, v, V, done, mu, r, w)
            row[2], row[3], row[4] = x, v, V
            if hit > 0.0:
                impacts[count, 0], impacts[count, 1] = k * h - before[0] / before[1], hit
                count += 1
    return count


def trace_by_ngspice_rule(eqs: Equations, noise: Floats, h: float, stride: int = 1) -> Path:
    """The path from rest as ngspice makes it with a load resistor; arguments as of `kernels.path.trace`."""
    readings = np.empty((len(noise) // stride, len(COLUMNS)))
    impacts = room_for_impacts(eqs, len(noise))
    count = _trace(noise, h, stride, readings, impacts, *coefficients(eqs)[:10])
    return Path(h, stride, readings, impacts[:count].copy(), None)
