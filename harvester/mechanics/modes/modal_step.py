"""One step of several modes or masses, the drift and the kick of `harvester.mechanics.kernels.equation_of_motion`.

    drift   y' = v,  V' = s.v - mu V,  with the impacts of w = phi.y    (exact)
    kick    y_j' = v_j,  v_j' = -d_j v_j - k_j y_j - e_j F - beta s_j V + g_j (a + noise)    (y and V held; ball: -pull)

The stops are those of one mode, on the contact coordinate w
(`harvester.mechanics.kernels.offset_stops.move`), which begins without voltage, with m =
phi/(phi.phi), e = exp(-mu h) and g = (1 - e)/mu:

    (w1, w1', U) = move(w, w', 0)
    y += h v + m (w1 - w - h w'),   v += m (w1' - w'),   V <- e V + g s.v + (s.m) (U - g w')

All of a lane i is in one array z, shape (rows x BATCH,): row j is y_j, row n + j is v_j, row 2 n is
V, and from there on are the sums of a kernel.  Places that differ by constants are
known to the compiler not to be the same, so that loops over lanes become vector instructions; in
several arrays a step lasts three to five times as long.

Long because drift, kick and rest on a stop are one step, whose parts share the rows of z.
"""

import math
from typing import NamedTuple

from harvester.equations.coefficients import Equations, friction_names
from harvester.equations.modes import Modes
from harvester.mechanics.kernels.coefficients import BATCH, Coefficients, Impacts, State
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.equation_of_motion import (
    friction,
    impulse,
    is_damped,
    kick,
    spring,
)
from harvester.mechanics.kernels.offset_stops import lower_stop, move

AT_REST = 1e-12  # of the stop's place, or of 1: rounding of sums over modes


class ModalCoefficients(NamedTuple):
    """The coefficients above: ``oscillator`` those of the oscillator, ``contact`` those of w, None without a stop.

    The others as of `harvester.equations.modes.Modes`, but ``e`` None if it is (1, 0, ...),
    ``pull`` None if it is 0, and ``m`` and ``sm``.
    """

    oscillator: Coefficients
    contact: Coefficients | None
    k: tuple[float, ...]
    d: tuple[float, ...]
    s: tuple[float, ...]
    g: tuple[float, ...]
    e: tuple[float, ...] | None
    phi: tuple[float, ...] | None = None
    m: tuple[float, ...] | None = None
    sm: float | None = None
    pull: float | None = None


def modal_coefficients(eqs: Equations, modes: Modes) -> ModalCoefficients:
    """The coefficients of equations with several modes, for their kernels."""
    names = ("mu", "alpha", "beta", *friction_names(), "cv", "n1", "linear", "alpha2", "softening")
    plain = Coefficients(**{name: getattr(eqs, name) for name in names})
    of = ModalCoefficients(
        plain,
        None,
        modes.stiffness,
        modes.damping,
        s=modes.coupling,
        g=modes.base,
        e=modes.oscillator,
    )
    if eqs.restitution is None and eqs.stop_stiffness is None:
        return of
    mobility = modes.mobility
    m = tuple(phi / mobility for phi in modes.contact)
    contact = Coefficients(
        mu=eqs.mu, n1=None if modes.is_carried else eqs.n1, r=eqs.restitution, gap=eqs.gap or 0.0
    )
    contact = contact._replace(high=eqs.opposite_gap, r_high=eqs.opposite_restitution)
    if eqs.stop_stiffness is not None:
        contact = contact._replace(
            k=eqs.stop_stiffness * mobility, c=(eqs.stop_damping or 0.0) * mobility
        )
    sm = math.fsum(s * m_j for s, m_j in zip(modes.coupling, m, strict=True))
    return of._replace(contact=contact, phi=modes.contact, m=m, sm=sm, pull=modes.pull or None)


@forced
def dot(direction, z, first, i):
    """The sum of a direction's components times rows of lane i from the ``first`` on.

    Without one the first row.
    """
    if direction is None:
        return z[first * BATCH + i]
    total = 0.0
    for j in range(len(direction)):
        total += direction[j] * z[(first + j) * BATCH + i]
    return total


@forced
def _pushed(i, z, c, a):
    """The acceleration of w at rest, if no noise keeps it from a stop; None elsewhere."""
    voltage = 2 * len(c.k) * BATCH + i
    if c.contact.n1 is not None:
        return None
    force = spring(dot(c.e, z, 0, i), c.oscillator)
    total = 0.0
    for j in range(len(c.phi)):
        push = -c.k[j] * z[j * BATCH + i]
        if c.oscillator.beta is not None:
            push -= c.oscillator.beta * c.s[j] * z[voltage]
        if a is not None:
            push += c.g[j] * a
        if c.e is not None:
            push += c.e[j] * force
        elif j == 0:
            push += force
        total += c.phi[j] * push
    if c.pull is not None:
        total -= c.phi[-1] * c.pull
    return total


@forced
def _drift_freely(i, z, d, c):
    """Drift lane i without an impact."""
    speeds = len(c.k) * BATCH + i
    voltage = 2 * len(c.k) * BATCH + i
    z[voltage] = d.e * z[voltage] + d.g * dot(c.s, z, len(c.k), i)
    for j in range(len(c.s)):
        z[j * BATCH + i] += d.t * z[speeds + j * BATCH]
    return Impacts(0.0, 0.0, 0.0, 0.0)


@forced
def _drift_on_stop(i, z, d, c):
    """Drift lane i, which rests on a stop, and put it back on there, before roundings of many steps remove it."""
    free = _drift_freely(i, z, d, c)
    off, _ = _nearer_stop(dot(c.phi, z, 0, i), c)
    for j in range(len(c.m)):
        z[j * BATCH + i] -= c.m[j] * off
    return free


@forced
def drift_modes(i, z, d, c, a):
    """Drift lane i by the interval d: the `Impacts`, whose energy is that of w, 1/(phi.phi) of it dissipated."""
    if c.contact is None:
        return _drift_freely(i, z, d, c)
    if _is_stuck(i, z, c):
        return _drift_on_stop(i, z, d, c)
    speeds = len(c.k) * BATCH + i
    voltage = 2 * len(c.k) * BATCH + i
    rate = dot(c.s, z, len(c.k), i)
    w = dot(c.phi, z, 0, i)
    speed = dot(c.phi, z, len(c.k), i)
    after, impacts = move(State(w, speed, 0.0), d, c.contact, _pushed(i, z, c, a))
    way = after.x - w - d.t * speed
    jump = after.v - speed
    for j in range(len(c.s)):
        z[j * BATCH + i] += d.t * z[speeds + j * BATCH] + c.m[j] * way
    for j in range(len(c.s)):
        z[speeds + j * BATCH] += c.m[j] * jump
    z[voltage] = d.e * z[voltage] + d.g * rate + c.sm * (after.V - d.g * speed)
    return impacts


@forced
def kick_modes(i, z, xi, h, c, a):
    """Kick lane i for a time h at fixed y and V: the power that the excitation a puts in, times h.

    0 without.
    """
    speeds = len(c.k) * BATCH + i
    voltage = 2 * len(c.k) * BATCH + i
    x = dot(c.e, z, 0, i)
    hit = 0.0
    stuck = _is_stuck(i, z, c)
    work = 0.0
    if a is not None:
        work = 0.5 * h * a * dot(c.g, z, len(c.k), i)
        hit += h * a
    if c.oscillator.n1 is not None:
        hit += impulse(x, xi, h, c.oscillator)
    if c.e is None:
        z[speeds] = kick(State(x, z[speeds], z[voltage]), xi, h, c.oscillator, a)
        for j in range(1, len(c.k)):
            dv = c.g[j] * hit - h * c.k[j] * z[j * BATCH + i]
            if c.oscillator.beta is not None:
                dv -= h * c.oscillator.beta * c.s[j] * z[voltage]
            loss = h * c.d[j]
            kicked = z[speeds + j * BATCH] + (1.0 + 0.5 * loss) * dv
            z[speeds + j * BATCH] = kicked * (1.0 / (1.0 + loss + 0.5 * loss * loss))
    else:
        _kick_with_common_friction(i, z, x, hit, h, c)
    if c.pull is not None:
        z[(2 * len(c.k) - 1) * BATCH + i] -= h * c.pull
    if stuck:
        _keep_on_stop(i, z, x, h, c)
    if a is not None:
        work += 0.5 * h * a * dot(c.g, z, len(c.k), i)
    return work


@forced
def _kick_with_common_friction(i, z, x, hit, h, c):
    """The kick if the oscillator's friction f damps all coordinates, by the mean of the speeds before and after.

    (1 + Y/2) v1 = (1 - Y/2) v + dv with Y/2 = diag(b) + f h/2 e e^T, whose inverse is that of the diagonal but for one
    direction (Sherman and Morrison); stable at any damping.  Quadratic damping uses the mean speed
    along e, e^T (1 + diag(b)/2)^-1 (v + dv/2) over 1 + f h/2 e^T (1 + diag(b)/2)^-1 e.
    """
    speeds = len(c.k) * BATCH + i
    force = spring(x, c.oscillator)
    moved = 0.0
    size = 0.0
    for j in range(len(c.k)):
        inverse = 1.0 / (1.0 + 0.5 * h * c.d[j])
        moved += c.e[j] * inverse * _twice_and_kicked(i, j, z, force, hit=hit, h=h, c=c)
        size += c.e[j] * c.e[j] * inverse
    f = (
        0.5 * h * friction(x, dot(c.e, z, len(c.k), i), c.oscillator)
        if is_damped(c.oscillator)
        else 0.0
    )
    if c.oscillator.cv is not None:
        f = 0.5 * h * friction(x, 0.5 * moved / (1.0 + f * size), c.oscillator)
    common = f * moved / (1.0 + f * size)
    for j in range(len(c.k)):
        inverse = 1.0 / (1.0 + 0.5 * h * c.d[j])
        kicked = _twice_and_kicked(i, j, z, force, hit=hit, h=h, c=c) - c.e[j] * common
        z[speeds + j * BATCH] = inverse * kicked - z[speeds + j * BATCH]


@forced
def _twice_and_kicked(i, j, z, force, hit, h, c):
    """Twice the speed of the coordinate j, and the increment by a kick: 2 v_j + dv_j."""
    speeds = len(c.k) * BATCH + i
    voltage = 2 * len(c.k) * BATCH + i
    push = c.e[j] * force - c.k[j] * z[j * BATCH + i]
    if c.oscillator.beta is not None:
        push -= c.oscillator.beta * c.s[j] * z[voltage]
    return 2.0 * z[speeds + j * BATCH] + h * push + c.g[j] * hit


@forced
def _is_stuck(i, z, c):
    """Whether the mass rests on a rigid stop; only without noise along w, which keeps it moving."""
    if c.contact is None or c.contact.n1 is not None:
        return False
    if c.contact.r is None:
        return False
    (off, _) = _nearer_stop(dot(c.phi, z, 0, i), c)
    speed = dot(c.phi, z, len(c.k), i)
    return max(abs(off), abs(speed)) <= AT_REST * max(1.0, abs(lower_stop(c.contact)))


@forced
def _nearer_stop(w, c):
    """How far w is from the nearer one of the rigid stops, and the sign of the speeds away from that."""
    low = lower_stop(c.contact)
    if c.contact.high is not None and w > 0.5 * (c.contact.high + low):
        return w - c.contact.high, -1.0
    return w - low, 1.0


@forced
def _keep_on_stop(i, z, x, h, c):
    """Take the speed along phi of a mass that a kick of length h would push into the stop it rests on.

    The stop's impulse acts during the kick and is damped as others are: the mass rests if forces
    are in balance.
    """
    if c.contact is None:
        return
    into = dot(c.phi, z, len(c.k), i)
    (_, away) = _nearer_stop(dot(c.phi, z, 0, i), c)
    size = 0.0
    if away * into < 0.0:
        for j in range(len(c.m)):
            size += c.phi[j] * c.phi[j] * _left_of_impulse(i, j, z, x, h, c)
        for j in range(len(c.m)):
            z[(len(c.k) + j) * BATCH + i] -= (
                into / size * c.phi[j] * _left_of_impulse(i, j, z, x, h, c)
            )


@forced
def _left_of_impulse(i, j, z, x, h, c):
    """The remainder of an impulse after the damping of coordinate j in a kick of length h, as of `kick_modes`."""
    if c.e is not None:
        return 1.0
    loss = h * c.d[j]
    if j == 0 and is_damped(c.oscillator):
        loss = h * friction(x, z[len(c.k) * BATCH + i], c.oscillator)
    return (1.0 + 0.5 * loss) / (1.0 + loss + 0.5 * loss * loss)


@forced
def energy_of_modes(i, z, c):
    """Kinetic energy, and that of the springs but for terms beyond the linear ones."""
    speeds = len(c.k) * BATCH + i
    x = dot(c.e, z, 0, i)
    double = x * x
    if c.oscillator.linear is not None:
        double *= c.oscillator.linear
    for j in range(len(c.k)):
        y = z[j * BATCH + i]
        v = z[speeds + j * BATCH]
        double += v * v + c.k[j] * y * y
    return 0.5 * double
