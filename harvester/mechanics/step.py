"""One step of the mechanics, written like its equations, compiled for the effects present.

The equations (paper, Eq. 2; nondimensional) are

    x'' + f(x) x' + x + alpha x^3 + beta V = noise,   f(x) = c3 x^4 - c2 x^2 - c1
    x'+ = -r x'-   at x = 0
    V' + mu V = x'

split into two parts that are each solved in closed form and applied in turn:

    drift   x' = v, V' = v - mu V, with the impact         (exact for every mu and every h)
    kick    v' = -f(x) v - x - alpha x^3 - beta V + noise  (x and V held)

One drift of length h between two kicks makes a step; read half-way through a drift, the
composition is symmetric and of second order.  During a drift the mass moves at constant
speed, so it meets the stop at most once and never leaves x >= 0, whatever h and r.

An argument that is None is an effect that the scene does not have: numba compiles a version
without it.  Called without numba (``.py_func``) the same lines are the readable reference.
"""

import math

from harvester.mechanics.compiled import inlined


@inlined
def decayed(z):
    """1 - exp(-z) for z >= 0 to 1e-9, without a library call, so that loops over lanes vectorise.

    Taylor series of q = 1 - exp(-z/256), then q <- q (2 - q) eight times, which keeps the
    relative precision of a small z; beyond z = 32 the value stays what it is there.
    """
    u = min(z, 32.0) * (1.0 / 256.0)
    q = u * (1.0 - u * (1.0 / 2 - u * (1.0 / 6 - u * (1.0 / 24 - u / 120))))
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    return q


@inlined
def drift(x, v, V, h, e, g, mu, r):
    """Move for a time h at constant velocity, reflect at the stop, and carry the voltage along.

    With ``e = exp(-mu h)`` and ``g = (1 - e)/mu`` (see `relaxation`) the voltage is

        V(h) = e V + g v                                   no impact
        V(h) = e V + v [g - (1 + r) (1 - exp(-mu a))/mu]   impact with a time a still to go

    and without a load (mu None) V - x is conserved.  Returns (x, v, V, speed of the impact or 0).
    """
    x1 = x + h * v
    if r is None:
        if mu is None:
            return x1, v, V + h * v, 0.0
        return x1, v, e * V + g * v, 0.0
    hit = x1 < 0.0
    x2 = -r * x1 if hit else x1
    if mu is None:
        V1 = V + (x2 - x)
    else:
        after = x1 / v if hit else 0.0
        V1 = e * V + v * (g - (1.0 + r) * decayed(mu * after) / mu)
    speed = -v if hit else 0.0
    return x2, (-r * v if hit else v), V1, speed


@inlined
def friction(x, c1, c2, c3):
    """f(x) = c3 x^4 - c2 x^2 - c1 of Eq. 2, of the terms present."""
    f = 0.0
    if c1 is not None:
        f -= c1
    if c2 is not None:
        f -= c2 * x * x
    if c3 is not None:
        f += c3 * x * x * x * x
    return f


@inlined
def intensity(x, n1, n2, n12):
    """N(x) = N1 + 2 N12 x + N2 x^2: the acceleration noise at x is sqrt(2 N) times white noise."""
    n = 0.0
    if n1 is not None:
        n += n1
    if n12 is not None:
        n += 2.0 * n12 * x
    if n2 is not None:
        n += n2 * x * x
    return n


@inlined
def kick(x, v, V, xi, h, alpha, beta, c1, c2, c3, n1, n2, n12):
    """Change of velocity in a time h at fixed x and V; xi is a variate of mean 0 and variance 1.

    v' = -f v + F has the solution v exp(-y) + h F (1 - exp(-y))/y with y = f h.  exp(-y) is
    replaced by 1/(1 + y + y^2/2): correct to the order of the splitting, positive for every
    y, and going to 0 with stiff damping, so that no step makes it unstable.
    """
    force = -x
    if alpha is not None:
        force -= alpha * x * x * x
    if beta is not None:
        force -= beta * V
    dv = h * force
    if n1 is not None or n2 is not None:
        dv += xi * math.sqrt(2.0 * h * intensity(x, n1, n2, n12))
    if c1 is None and c2 is None and c3 is None:
        return v + dv
    y = h * friction(x, c1, c2, c3)
    return (v + (1.0 + 0.5 * y) * dv) / (1.0 + y + 0.5 * y * y)


@inlined
def relaxation(h, mu):
    """(exp(-mu h), (1 - exp(-mu h))/mu): what `drift` needs of the resistive load, once a run."""
    if mu is None:
        return 1.0, h
    return math.exp(-mu * h), -math.expm1(-mu * h) / mu
