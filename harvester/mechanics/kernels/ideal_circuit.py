"""Load circuits of diodes, switches and inductors on a piezo, solved in closed form between the kicks of the mass.

The piezo gives V' = x' - i at constant x' (`harvester.mechanics.kernels.equation_of_motion`); the
smoothing capacitor of kappa Cp, with the load across it, has kappa U' = i - mu U - loss.  Voltages
are in units of theta l/Cp, currents of theta l w0.

    bridge       i on the side s of V through two diodes:  V = s (U + w)
    doubler      i through one diode:  V = U + w;  another one holds V > -w
    open         the piezo is open between switchings

The diodes are Shockley's (`harvester.mechanics.kernels.diode`); the load is treated as if i were
uniform over a drift, which is exact to second order, and for every mu and h in the limits of a slow
and of a fast U.

Switches act at once, after x has come back from an extremum by 1.5 ``hysteresis`` as in the
netlists: m follows x with a play of +-``hysteresis``, and the side that x comes back from is
discharged while it is above the switch's threshold:

    parallel SSHI   V - Vs -> -q (V - Vs) through the inductor
    series SSHI     V - U - 3 Vs -> -q (V - U - 3 Vs) through inductor and bridge; the charge enters the capacitor
    SECE            V -> rest; the inductor's energy then flows into the capacitor, less losses of wire, core, diode

with Vs the drop of a diode at half of the inductor's peak current.
"""

import math
from typing import NamedTuple

from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import forced, inlined
from harvester.mechanics.kernels.diode import lowered, share
from harvester.mechanics.kernels.offset_stops import move, wall_of


class SwitchedCoil(NamedTuple):
    """An inductor that inverts the voltage.

    ``kept`` is the fraction q of the voltage left, ``peak`` the peak current over the voltage.
    """

    kept: float
    peak: float


class Flyback(NamedTuple):
    """An inductor that draws the piezo's energy and gives it to the load.

    ``damping`` ratio of the inductor with Cp, ``peak`` as in `SwitchedCoil`, ``rest`` the voltage
    left, ``wire`` the wire's resistance times Cp w0, ``core`` the core's conductance over Cp w0.
    """

    damping: float
    peak: float
    rest: float
    wire: float
    core: float


class IdealCircuit(NamedTuple):
    """A load circuit in nondimensional numbers, None for a part that it lacks.

    mu = 1/(R Cp w0), kappa = C/Cp; n = N k T/e of one diode over theta l/Cp, leak its saturation
    current and loss that all reverse currents draw from U, over theta l w0; hysteresis over theta
    l/Cp.  ``bridge`` or ``doubler``: the diodes between piezo and capacitor; one of ``parallel``,
    ``series`` and ``sece`` with ``hysteresis``: the switched inductor.
    """

    mu: float
    kappa: float
    n: float
    leak: float
    loss: float
    bridge: bool | None = None
    doubler: bool | None = None
    hysteresis: float | None = None
    parallel: SwitchedCoil | None = None
    series: SwitchedCoil | None = None
    sece: Flyback | None = None

    @property
    def has_own_kernel(self) -> bool:
        """Whether the circuit brings kernels of its own: an ideal one does not."""
        return False

    @property
    def memory(self) -> float:
        """Time constant of the smoothing capacitor with the load."""
        return self.kappa / self.mu


class Store(NamedTuple):
    """The state of a circuit: the voltage U of its capacitor, and the place m that its switch follows x to."""

    U: float
    m: float


class Leg(NamedTuple):
    """The last part of a drift, without an event: its velocity and its time."""

    v: float
    t: float


@forced
def conducted(V, U, v, t, circuit):
    """The voltages (V, U) after a time t at constant velocity v, without switching.

    A charge q that arrives uniformly leaves U higher by g q, g = (1 - exp(-z))/(mu t) with z = mu
    t/kappa.
    """
    n, leak = circuit.n, circuit.leak
    g = share(circuit.mu * t / circuit.kappa) / circuit.kappa
    V1 = V + v * t
    U1 = max(U - (circuit.mu * U + circuit.loss) * t * g, 0.0)
    if circuit.bridge is not None:
        s = 1.0 if V + V1 > 0.0 else -1.0
        q = lowered(s * V - U, s * V1 - U1, t, 2.0 * n, (1.0 + g) * leak) / (1.0 + g)
        return V1 - s * q, U1 + g * q
    if circuit.doubler is not None:
        q = lowered(V - U, V1 - U1, t, n, (1.0 + g) * leak) / (1.0 + g)
        return V1 - q + lowered(-V, -V1, t, n, leak), U1 + g * q
    return V1, U1


@inlined
def drop(i, n, leak):
    """Voltage of a diode at the current i."""
    return n * math.log1p(i / leak)


@inlined
def flown_back(w, U, coil, kappa, n, leak):
    """The voltage of the piezo, and U, after the inductor has drawn the piezo's energy and handed it on.

    The piezo's voltage less two drops swings from a to b, in the phase arccos(b/a) of a damped
    oscillation.  The inductor's energy E = L i^2/2 then meets the voltage u = U + drop, so that the
    share 2 (y - ln(1 + y))/y^2 passes the wire, y = wire i/u, and u^2 core a time 2 E/(i u) is lost
    in the core; the rest charges the capacitor against U + drop.
    """
    two = 2.0 * drop(0.5 * w * coil.peak, n, leak)
    a = w - two
    b = coil.rest - two
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
def switched(V, U, s, circuit):
    """The voltages (V, U) after the switch has acted on the side s of the piezo.

    As before, if that is too low.
    """
    w = s * V
    kappa = circuit.kappa
    n = circuit.n
    leak = circuit.leak
    if circuit.parallel is not None:
        w -= drop(0.5 * max(w, 0.0) * circuit.parallel.peak, n, leak)
        return V - s * (1.0 + circuit.parallel.kept) * max(w, 0.0), U
    if circuit.series is not None:
        w -= U
        w -= 3.0 * drop(0.5 * max(w, 0.0) * circuit.series.peak, n, leak)
        q = (1.0 + circuit.series.kept) * max(w, 0.0) * kappa / (1.0 + kappa)
        return V - s * q, U + q / kappa
    if circuit.sece is not None and w > circuit.sece.rest:
        w, U = flown_back(w, U, circuit.sece, kappa, n, leak)
        return s * w, U
    return V, U


@inlined
def until_switched(x, v, V, store, t, circuit):
    """Advance a motion at constant v for a time t to its switching, if there is one: (V, store, time left).

    On the way back from an extremum x passes m at half of the hysteresis.
    """
    s = 1.0 if v > 0.0 else -1.0
    before = s * (x - store.m)
    after = before + s * v * t
    U = store.U
    left = t
    if before <= 0.5 * circuit.hysteresis < after:
        left = t - (0.5 * circuit.hysteresis - before) / (s * v)
        V, U = conducted(V, U, v, t - left, circuit)
        V, U = switched(V, U, -s, circuit)
    return V, Store(U, store.m + s * max(after - circuit.hysteresis, 0.0)), left


@forced
def until_last_event(s, store, d, c, circuit, a):
    """Drift, with the circuit advanced to the last impact or switching only: (state, store, leg, impacts).

    The mass flies as in `harvester.mechanics.kernels.offset_stops.move`, between kicks and impacts
    at a constant speed.  In the state x and v are those at the end; V and the storage capacitor
    continue along the ``leg`` (`conducted`).
    """
    s1, impacts = move(s, d, c, a)
    wall = s.x
    first = 0.0
    w = s.v
    if c.r is not None or c.gap is not None:
        if impacts.number > 0.0:
            wall = wall_of(impacts.speed, c)
            first = impacts.time
        w = (s1.x - wall) / (d.t - first) if d.t > first else 0.0
    V, store, leg = followed(s.x, wall, first, w, t=d.t, V=s.V, store=store, circuit=circuit)
    return State(s1.x, s1.v, V), store, leg, impacts


@forced
def followed(x, wall, first, w, t, V, store, circuit):
    """The circuit up to the last event of a drift of a length t: (V, store, leg).

    The charge flows from x to the ``wall`` in the time ``first``, 0 without an impact, and on at
    the speed w.
    """
    if first > 0.0:
        speed = (wall - x) / first
        rest = first
        if circuit.hysteresis is not None:
            V, store, rest = until_switched(x, speed, V, store, first, circuit)
        V, U = conducted(V, store.U, speed, rest, circuit)
        store = Store(U, store.m)
    left = t - first
    if circuit.hysteresis is not None:
        V, store, left = until_switched(wall, w, V, store, left, circuit)
    return V, store, Leg(w, left)


@forced
def fly(s, store, d, c, circuit, a):
    """Drift with a circuit: (state, store, impacts)."""
    s1, store, leg, impacts = until_last_event(s, store, d, c, circuit, a)
    V, U = conducted(s1.V, store.U, leg.v, leg.t, circuit)
    return State(s1.x, s1.v, V), Store(U, store.m), impacts
