"""Load circuits of diodes, switches and coils on a piezo, solved in closed form between the kicks of the mass.

The piezo gives V' = x' - i at constant x' (`harvester.mechanics.kernels.equation_of_motion`); the smoothing capacitor
of kappa Cp, with the load across it, has kappa U' = i - mu U - loss.  Voltages are in units of theta l/Cp, currents of
theta l w0.

    bridge       i on the side s of V through two diodes:  V = s (U + w)
    doubler      i through one diode:  V = U + w;  another one holds V > -w
    open         the piezo is open between switchings

The diodes are Shockley's (`harvester.mechanics.rectifiers.diode`); of the load it takes that i is uniform over a drift,
which is exact to second order, and for every mu and h in the limits of a slow and of a fast U.

Switches act at once, after x has come back from an extremum by 1.5 ``play`` as in the netlists: m follows x with a
play of +-``play``, and the side that x comes back from is discharged while it is above the switch's threshold:

    parallel SSHI   V - Vs -> -q (V - Vs) through the coil
    series SSHI     V - U - 3 Vs -> -q (V - U - 3 Vs) through coil and bridge; the charge enters the capacitor
    SECE            V -> rest; what the coil then holds goes into the capacitor, less the losses of wire, core and diode

with Vs the drop of a diode at half of the coil's peak current.
"""

import math
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

from harvester.mechanics.kernels.compiled import forced, inlined
from harvester.mechanics.kernels.offset_stops import move, wall_of
from harvester.mechanics.rectifiers.diode import lowered, share


class Coil(NamedTuple):
    """A coil that inverts: ``kept`` is the share q of the voltage left, ``peak`` the peak current over the voltage."""

    kept: float
    peak: float


class Flyback(NamedTuple):
    """A coil that takes the piezo's energy and gives it to the load.

    ``damping`` ratio of the coil with Cp, ``peak`` as in `Coil`, ``rest`` the voltage left on the piezo, ``wire`` the
    wire's resistance times Cp w0, ``core`` the core's conductance over Cp w0.
    """

    damping: float
    peak: float
    rest: float
    wire: float
    core: float


@dataclass(frozen=True, kw_only=True)
class IdealCircuit:
    """A load circuit in nondimensional numbers, None for what it does not have.

    mu = 1/(R Cp w0), kappa = C/Cp; n = N k T/e of one diode over theta l/Cp, leak its saturation current and loss what
    all reverse currents take from U, over theta l w0; play over theta l/Cp.  ``bridge`` or ``doubler``: the diodes
    between piezo and capacitor; one of ``parallel``, ``series`` and ``sece`` with ``play``: the switched coil.
    """

    mu: float
    kappa: float
    n: float
    leak: float
    loss: float
    bridge: bool | None = None
    doubler: bool | None = None
    play: float | None = None
    parallel: Coil | None = None
    series: Coil | None = None
    sece: Flyback | None = None

    @property
    def arguments(self) -> tuple[Any, ...]:
        """The numbers in the order of the kernels' arguments."""
        return tuple(getattr(self, field.name) for field in fields(self))

    @property
    def memory(self) -> float:
        """Time constant of the smoothing capacitor with the load."""
        return self.kappa / self.mu


@forced
def conducted(V, U, v, t, mu, kappa, n, leak, loss, bridge, doubler):
    """The voltages (V, U) after a time t at constant velocity v, without switching.

    A charge q that arrives uniformly leaves U higher by g q, g = (1 - exp(-z))/(mu t) with z = mu t/kappa.
    """
    z = mu * t / kappa
    g = share(z) / kappa
    V1 = V + v * t
    U1 = max(U - (mu * U + loss) * t * g, 0.0)
    if bridge is not None:
        s = 1.0 if V + V1 > 0.0 else -1.0
        q = lowered(s * V - U, s * V1 - U1, t, 2.0 * n, (1.0 + g) * leak) / (1.0 + g)
        return V1 - s * q, U1 + g * q
    if doubler is not None:
        q = lowered(V - U, V1 - U1, t, n, (1.0 + g) * leak) / (1.0 + g)
        return V1 - q + lowered(-V, -V1, t, n, leak), U1 + g * q
    return V1, U1


@inlined
def drop(i, n, leak):
    """Voltage of a diode at the current i."""
    return n * math.log1p(i / leak)


@inlined
def flown_back(w, U, coil, kappa, n, leak):
    """The voltage of the piezo, and U, after the coil has taken the piezo's energy and handed it on.

    The piezo's voltage less two drops swings from a to b, in the phase arccos(b/a) of a damped oscillation.  The coil's
    energy E = L i^2/2 then meets the voltage u = U + drop, so that the share 2 (y - ln(1 + y))/y^2 passes the wire,
    y = wire i/u, and u^2 core a time 2 E/(i u) is lost in the core; the rest charges the capacitor against U + drop.
    """
    two = 2.0 * drop(0.5 * w * coil.peak, n, leak)
    a, b = w - two, coil.rest - two
    if a <= max(b, 0.0):
        return w, U
    if b <= -math.exp(-math.pi * coil.damping) * a:  # the current ends before the switch opens
        return two - math.exp(-math.pi * coil.damping) * a, U
    damped = a * math.exp(-coil.damping * math.acos(b / a))
    energy = 0.5 * (damped * damped - b * b)
    if energy <= 0.0:
        return coil.rest, U
    current = coil.peak * math.sqrt(2.0 * energy)
    forward = drop(0.5 * current, n, leak)
    u = U + forward
    y = coil.wire * current / u
    passed = 2.0 * (y - math.log1p(y)) / (y * y) if y > 1e-4 else 1.0 - 2.0 / 3.0 * y
    handed = energy * max(passed - 2.0 * coil.core * u / current, 0.0)
    return coil.rest, math.sqrt(u * u + 2.0 * handed / kappa) - forward


@inlined
def switched(V, U, s, kappa, n, leak, parallel, series, sece):
    """The voltages (V, U) after the switch has acted on the side s of the piezo; as before, where that is too low."""
    w = s * V
    if parallel is not None:
        w -= drop(0.5 * max(w, 0.0) * parallel.peak, n, leak)
        return V - s * (1.0 + parallel.kept) * max(w, 0.0), U
    if series is not None:
        w -= U
        w -= 3.0 * drop(0.5 * max(w, 0.0) * series.peak, n, leak)
        q = (1.0 + series.kept) * max(w, 0.0) * kappa / (1.0 + kappa)
        return V - s * q, U + q / kappa
    if sece is not None and w > sece.rest:
        w, U = flown_back(w, U, sece, kappa, n, leak)
        return s * w, U
    return V, U


@inlined
def until_switched(x, v, V, U, m, t, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece):
    """Advance a motion at constant v for a time t to its switching, if there is one: (V, U, m, time left).

    On the way back from an extremum x passes m at half of the play.
    """
    s = 1.0 if v > 0.0 else -1.0
    before = s * (x - m)
    after = before + s * v * t
    left = t
    if before <= 0.5 * play < after:
        left = t - (0.5 * play - before) / (s * v)
        V, U = conducted(V, U, v, t - left, mu, kappa, n, leak, loss, bridge, doubler)
        V, U = switched(V, U, -s, kappa, n, leak, parallel, series, sece)
    return V, U, m + s * max(after - play, 0.0), left


@forced
def advance_to_last_event(
    x, v, V, U, m, h, t, r, beta, n1, stops, a,
    mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
):  # fmt: skip
    """Drift by the first t of a step h, with the circuit advanced to the last impact or switching only.

    The mass flies as `harvester.mechanics.kernels.offset_stops.move` says, between kicks and impacts at a constant
    speed.  Returns x and v at the end of the drift; V, U, m, and the speed and the time that V and U still have to go;
    the time and the speed of the first impact, negative at the opposite stop, the number of impacts and what they took.
    """
    (x1, v1, _), (first, speed, impacts, lost) = move(x, v, V, h, t, 1.0, t, None, r, beta, n1, stops, a)
    w, left = v, t
    if r is not None or stops is not None:
        if impacts > 0.0:
            wall = wall_of(speed, stops)
            if first > 0.0:
                w = (wall - x) / first
                rest = first
                if play is not None:
                    V, U, m, rest = until_switched(
                        x, w, V, U, m, first, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece
                    )
                V, U = conducted(V, U, w, rest, mu, kappa, n, leak, loss, bridge, doubler)
            x, left = wall, t - first
        w = (x1 - x) / left if left > 0.0 else 0.0
    if play is not None:
        V, U, m, left = until_switched(
            x, w, V, U, m, left, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece
        )
    return x1, v1, V, U, m, w, left, first, speed, impacts, lost
