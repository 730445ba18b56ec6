"""One step of the mechanics, written like its equations, compiled for the effects present.

The equations (paper, Eq. 2; nondimensional) are

    x'' + f(x) x' + x + alpha x^3 + beta V = noise,   f(x) = c3 x^4 - c2 x^2 - c1  (+ cv |x'|)
    x'+ = -r x'-   at x = 0 (other stops: `harvester.mechanics.kernels.offset_stops`)
    V' + mu V = x'

split into two parts that are each solved in closed form and applied in turn:

    drift   x' = v, V' = v - mu V, with the impact         (exact for every mu and every h)
    kick    v' = -f(x) v - x - alpha x^3 - beta V + a + noise  (x and V held)

(a: other excitation, `harvester.mechanics.kernels.shaking`)

Beyond the paper the spring may have terms alpha2 x^2 and -softening x |x|; with ``inertia`` the
mass is m = 1 + inertia x^2, so that m x'' + inertia x x'^2 = F, which conserves m x'^2/2 for F = 0;
with ``gamma`` the coupling is g = 1 + gamma x^2: V' + mu V = g x', and the force is -beta g V.

One drift of length h between two kicks makes a step; read half-way through a drift, the
composition is symmetric and of second order.  During a drift the mass moves at constant
speed, so it meets the stop at most once and never leaves x >= 0, whatever h and r.  If no
noise keeps it from resting on the stop, it may stick there (`drift_at_stop`).

``s`` is the state, ``c`` the coefficients (`harvester.mechanics.kernels.coefficients`), ``d`` the
drift (`harvester.mechanics.kernels.intervals`).  An effect that is None is one that the scene does
not have: numba compiles a version without it.  Called without numba (``.py_func``) the same lines
are the readable reference.

Long because a step's parts belong together.
"""

import math

import numpy as np

from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.ngspice_rule import drift_by_ngspice_rule


@inlined
def decayed(z):
    """The function 1 - exp(-z) for z >= 0 to 1e-10, without a library call, so that loops over lanes vectorise.

    Taylor series of q = 1 - exp(-z/16) in pairs of terms that do not wait for each other, then
    q <- q (2 - q) four times, which keeps the relative precision of a small z; beyond z = 32 the
    value stays the same.
    """
    u = min(z, 32.0) * (1.0 / 16.0)
    u2 = u * u
    first = (1.0 - u * (1.0 / 2)) + u2 * (1.0 / 6 - u * (1.0 / 24))
    second = (1.0 / 120 - u * (1.0 / 720)) + u2 * (1.0 / 5040 - u * (1.0 / 40320))
    q = u * (first + u2 * u2 * second)
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    q *= 2.0 - q
    return q


@inlined
def drift(s, d, mu, r, gamma=None):
    """Move for the time of d at constant velocity, reflect at the stop, and carry the voltage along.

    With e = exp(-mu h) and g = (1 - e)/mu (`harvester.mechanics.kernels.intervals`) the voltage is

        V(h) = e V + g v                                   no impact
        V(h) = e V + v [g - (1 + r) (1 - exp(-mu a))/mu]   impact with a time a left

    and without a load (mu None) V - x is conserved.  A ``line`` is (1 - exp(-mu a))/mu without a
    division. Returns the state, and the speed of the impact or 0.  With ``gamma`` there is no stop.
    """
    if d.weight is not None:
        return drift_by_ngspice_rule(s, d.t, mu, r, d.weight)
    if gamma is not None:
        return _drift_with_growing_coupling(s, d, mu, gamma)
    x = s.x
    v = s.v
    V = s.V
    x1 = x + d.t * v
    if r is None:
        if mu is None:
            return State(x1, v, V + d.t * v), 0.0
        return State(x1, v, d.e * V + d.g * v), 0.0
    hit = x1 < 0.0
    x2 = -r * x1 if hit else x1
    if mu is None:
        V1 = V + (x2 - x)
    elif d.line is not None:
        V1 = d.e * V + d.g * v - (1.0 + r) * (d.line[0] * v + d.line[1] * x1 if hit else 0.0)
    else:
        after = x1 / v if hit else 0.0
        V1 = d.e * V + v * (d.g - (1.0 + r) * decayed(mu * after) / mu)
    speed = -v if hit else 0.0
    return State(x2, (-r * v if hit else v), V1), speed


@inlined
def _drift_with_growing_coupling(s, d, mu, gamma):
    """A drift without a stop whose V sees the coupling's mean over its way.

    That is 1 + gamma (x0^2 + x0 x1 + x1^2)/3, symmetric in its ends, so that the step stays
    symmetric and of second order; without a load it is exact.
    """
    x1 = s.x + d.t * s.v
    mean = 1.0 + gamma * (1.0 / 3.0) * (s.x * s.x + s.x * x1 + x1 * x1)
    if mu is None:
        return State(x1, s.v, s.V + d.t * mean * s.v), 0.0
    return State(x1, s.v, d.e * s.V + d.g * mean * s.v), 0.0


@inlined
def carried(V, way, t, mu):
    """The voltage V after a motion by ``way`` at constant speed in a time t: V' = way/t - mu V."""
    if mu is None:
        return V + way
    z = mu * t
    return V - decayed(z) * V + (way * decayed(z) / z if z > 0.0 else way)


@inlined
def push(x, V, c, pull=None, a=None):
    """Acceleration pull + a - beta (V - x) that a mass will have when it meets the stop, a distance x away.

    ``pull`` is the spring's there, None at rest, ``a`` the excitation's.  0 with white noise,
    compared with which it is small.
    """
    total = 0.0
    if c.n1 is None:
        if c.beta is not None:
            total -= c.beta * (V - x)
        if pull is not None:
            total += pull
        if a is not None:
            total += a
    return total


@inlined
def meeting(x, v, h, a):
    """When and how fast x + u s + a s^2/2 meets the stop, u = v - a h/2: (time from the kick, speed).

    A kick represents the force of half a step to either side of it: a mass under a constant a is on
    this parabola, and at the ends of the drift also on the straight line of `drift`.
    """
    u = v - 0.5 * a * h
    speed = math.sqrt(max(u * u - 2.0 * a * x, 0.0))
    return (2.0 * x / (speed - u) if u < 0.0 else (u + speed) / -a), speed


@inlined
def drift_at_stop(s, d, c, r, pull=None, shaking=None):
    """Drift a mass that may come to rest on a stop at x = 0, of restitution r: the state, and the impact's speed or 0.

    A voltage V > 0 presses the mass on the stop with the acceleration beta V: it is back ever
    sooner, infinitely often in a finite time (chatter), and then sticks.  If no external noise
    keeps it moving, an impact therefore has the speed of the accelerated motion (`meeting`), for
    between kicks and straight lines small bounces would live for ever; and after an impact whose
    next flight is shorter than a step the mass sticks: x = x' = 0 (for r = 1, which loses nothing,
    it continues to bounce). `harvester.mechanics.kernels.offset_stops.kick_at_stops` frees it.

    Without a stop, with external noise, without a force at the stop, or by ngspice's rule, this is
    `drift`.
    """
    if r is None or c.n1 is not None or d.weight is not None:
        return drift(s, d, c.mu, r, c.gamma)
    if c.beta is None and pull is None and shaking is None:
        return drift(s, d, c.mu, r)
    return _drift_and_stick(s, d, c, r, push(s.x, s.V, c, pull, shaking))


@inlined
def _drift_and_stick(s, d, c, r, a):
    x, v = s.x, s.v
    stuck = x == 0.0 and v == 0.0
    if stuck or x + d.t * (v - 0.5 * a * (d.h - d.t)) >= 0.0:
        free, _ = drift(s, d, c.mu, None)
        return State(max(free.x, 0.0), free.v, free.V), 0.0
    before, speed = meeting(x, v, d.h, a)
    up = r * speed
    left = d.t - before
    if 2.0 * up <= -a * d.h:  # back within a step
        if r < 1.0 or up == 0.0:
            up = left = a = 0.0
        else:
            bounce = 2.0 * up / -a
            left -= bounce * np.floor(left / bounce)
    x1 = max(left * (up + 0.5 * a * left), 0.0)
    V1 = carried(carried(s.V, -x, before, c.mu), x1, d.t - before, c.mu)
    return State(x1, up + a * (left - d.t + 0.5 * d.h), V1), speed


@inlined
def is_damped(c):
    """Whether the friction has a term."""
    return not (c.c1 is None and c.c2 is None and c.c3 is None and c.cv is None)


@inlined
def friction(x, v, c):
    """Friction c3 x^4 - c2 x^2 - c1 of Eq. 2, and cv |v|, of the terms present."""
    f = 0.0
    if c.c1 is not None:
        f -= c.c1
    if c.c2 is not None:
        f -= c.c2 * x * x
    if c.c3 is not None:
        f += c.c3 * x * x * x * x
    if c.cv is not None:
        f += c.cv * abs(v)
    return f


@inlined
def intensity(x, c):
    """Noise intensity N(x) = N1 + 2 N12 x + N2 x^2: the acceleration noise at x is sqrt(2 N) times white noise."""
    n = 0.0
    if c.n1 is not None:
        n += c.n1
    if c.n12 is not None:
        n += 2.0 * c.n12 * x
    if c.n2 is not None:
        n += c.n2 * x * x
    return n


@inlined
def spring(x, c):
    """Spring force -(linear x + alpha2 x^2 + alpha x^3 - softening x |x|), of the terms present.

    A linear of None is 1.
    """
    force = -x
    if c.linear is not None:
        force *= c.linear
    if c.alpha2 is not None:
        force -= c.alpha2 * x * x
    if c.alpha is not None:
        force -= c.alpha * x * x * x
    if c.softening is not None:
        force += c.softening * x * abs(x)
    return force


@inlined
def withheld(x, c):
    """The part of white noise's power N(x) that a mass 1 + inertia x^2 does not absorb."""
    if c.inertia is None or (c.n1 is None and c.n2 is None):
        return 0.0
    return intensity(x, c) * (1.0 - 1.0 / (1.0 + c.inertia * x * x))


@inlined
def impulse(x, xi, h, c, other=None):
    """The velocity sqrt(2 h N(x)) xi that white noise gives in a kick; xi is a variate of mean 0 and variance 1.

    With an ``other`` variate, independent of xi, both noises have one of their own, and no step
    takes a root:

        sqrt(2 h) [(sqrt(N1) + x N12/sqrt(N1)) xi + x sqrt(N2 - N12^2/N1) other]

    which has the same mean and variance at every x.
    """
    if other is not None and c.n1 is not None and c.n2 is not None:
        dv = math.sqrt(2.0 * h * c.n1) * xi
        alone = c.n2
        if c.n12 is not None:
            dv += c.n12 / c.n1 * x * dv
            alone -= c.n12 * c.n12 / c.n1
        return dv + math.sqrt(2.0 * h * max(alone, 0.0)) * x * other
    return xi * math.sqrt(2.0 * h * intensity(x, c))


@inlined
def _damped(v, dv, y):
    """The velocity after a kick that would give dv without friction, of y = f h."""
    return (v + (1.0 + 0.5 * y) * dv) / (1.0 + y + 0.5 * y * y)


@inlined
def kick(s, xi, h, c, a=None, other=None):
    """The velocity after a kick of length h at fixed x, V and excitation a; xi and other are as of `impulse`.

    v' = -f v + F has the solution v exp(-y) + h F (1 - exp(-y))/y with y = f h.  exp(-y) is
    replaced by 1/(1 + y + y^2/2): correct to the order of the splitting, positive for every
    y, and tending to 0 with stiff damping, so that no step makes it unstable.  Quadratic damping
    uses the mean of the speeds before and after, the latter found with the one before: second order
    again.
    """
    force = spring(s.x, c)
    if c.beta is not None:
        if c.gamma is None:  # a factor of 1 would change the order of the sum, and its last bits
            force -= c.beta * s.V
        else:
            force -= c.beta * s.V * (1.0 + c.gamma * s.x * s.x)
    if a is not None:
        force += a
    dv = h * force
    if c.n1 is not None or c.n2 is not None:
        dv += impulse(s.x, xi, h, c, other)
    if c.inertia is not None:
        return _kicked_with_inertia(s, dv, h, c)
    if not is_damped(c):
        return s.v + dv
    v = s.v
    if c.cv is not None:
        v = 0.5 * (s.v + _damped(s.v, dv, h * friction(s.x, s.v, c)))
    return _damped(s.v, dv, h * friction(s.x, v, c))


@inlined
def _kicked_with_inertia(s, dv, h, c):
    """The velocity after a kick of the mass 1 + inertia x^2.

    The term inertia x x' is one more friction, of any sign.
    """
    m = 1.0 + c.inertia * s.x * s.x
    part = h / m
    slowed = part * (friction(s.x, s.v, c) + c.inertia * s.x * s.v)
    v = 0.5 * (s.v + _damped(s.v, dv / m, slowed))
    return _damped(s.v, dv / m, part * (friction(s.x, v, c) + c.inertia * s.x * v))
