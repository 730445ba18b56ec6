"""The lock-step of the mass and ngspice: who moves when.

The mass is kicked at grid times (spring, damping, noise, and the voltage's force -beta V) and
moves at constant velocity in between (`harvester.mechanics.kernels.equation_of_motion`).  ngspice advances the circuit
under that motion and lands exactly on every kick, every impact and every reading; at a kick the
accepted voltage is known, so that the force has no lag.  The piezo is a voltage source
theta x/Cp in series with Cp, whose slope is the integrator's velocity: x is continuous where
the velocity jumps, at kicks and at impacts.

    ngspice asks                 answer
    SYNC, before a step          step to the next landing        `proposed`
    source voltage at time t     theta x(t)/Cp of this leg       `source`
    accepted v(t)                at a landing: act, aim anew     `accepted`

`source` is a pure function of the accepted state and t, so a rejected step changes nothing.
The three functions reach ngspice as C pointers (`harvester.circuit.ngspice.compiled_callbacks`) or, slowly, as Python
functions (`harvester.circuit.ngspice.python_callbacks`).
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.circuit.lockstep.compliant_stop import aim_in_contact, contact_energy, landed_in_contact
from harvester.circuit.lockstep.energy_ledger import DURING, flow, mark, work
from harvester.circuit.lockstep.rigid_stop import (
    IMPACT,
    KICK,
    PLAN,
    READING,
    TINY,
    chord,
    freed,
    impact,
    landed,
    plan,
)
from harvester.equations.scaling import Equations
from harvester.errors import SimulationError
from harvester.mechanics.kernels.bounds import resting_places
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import kick
from harvester.mechanics.kernels.interpreted import interpreted
from harvester.mechanics.kernels.path import COLUMNS, Path, between_kicks, room_for_impacts
from harvester.mechanics.kernels.shaking import forcing

NARROW = (
    "the stops must be so far apart that the mass meets them at most twice a step in lock-step with ngspice, but it "
    "meets them more often: use engine 'ensemble'"
)

# The kernels' coefficients: the stops (r, or k and c, at x = -gap, r_high at x = high), and those of `kick` in order.
COEFFICIENTS = (
    *("r", "gap", "high", "r_high", "k", "c"),
    *("alpha", "beta", "c1", "c2", "c3", "n1", "n2", "n12", "linear", "alpha2"),
)
STOPS = 6  # of them describe the stops

# All that the mass and the coupling know.  t, leg_t, landing, since, begin, end in second; volts = theta l/Cp;
# voltage, current, power, load, delivered, smooth_* in SI; the rest nondimensional.  *_at are addresses of the
# arrays that the compiled path uses, *_index the places of ngspice's vectors, -1 for one that is not there.
_REALS = ("x", "v", "phase", "next_phase", "h", "w0", "volts", *COEFFICIENTS, *PLAN, "t", "leg_t", "landing")
_LEDGER = ("since", "voltage", "current", "power", "load", "delivered", "begin", "end")
_WORKS = ("noise_work", "spring_work", "voltage_work", "damping_work", "impact_work")
_STORED = tuple(f"{what}_{when}" for what in ("energy", "voltage", "smooth") for when in ("begin", "end"))
_COUNTS = ("goal", "kicks", "stride", "steps", "impacts", "free", "measuring", "has_beta", "flown")
_ADDRESSES = (
    "source_at",
    "step_at",
    "accepted_at",
    "noise_at",
    "shaking_at",
    "noise_size",
    "readings_at",
    "impacts_at",
    "impacts_size",
    "charge_at",
)
VECTORS = ("time", "voltage", "power", "current", "smooth", "smooth_minus")
STATE = np.dtype(
    [(name, np.float64) for name in (*_REALS, *_LEDGER, *_WORKS, *_STORED)]
    + [(name, np.int64) for name in (*_COUNTS, *_ADDRESSES, *(f"{one}_index" for one in VECTORS))],
    align=True,
)


@inlined
def source(s, t):
    """Open-circuit voltage theta x(t)/Cp at a time within the present leg, in volt."""
    return s.volts * (s.x + s.v * s.w0 * (t - s.leg_t))


@inlined
def proposed(s, t, delta):
    """Step that ngspice is to try at t: to the next landing, or its own where it is free to refine.

    Of what is left it takes at most half, or all: a sliver before a landing would leave C dv/dt to rounding.
    """
    left = s.landing - t
    if not s.free or delta >= left:
        return left
    return min(delta, 0.5 * left)


@inlined
def wall(v, gap, high):
    """Where the stop ahead of a mass of velocity v is; infinite where there is none."""
    if v < 0.0:
        return 0.0 if gap is None else -gap
    return math.inf if high is None else high


@inlined
def bounce(s, time, impacts, r, r_high):
    """Impact law x'+ = -r x'-, with the impact on record while there is room for it."""
    if s.impacts < len(impacts):
        impacts[s.impacts, 0] = time
        impacts[s.impacts, 1] = -s.v
    s.impacts += 1
    ratio = r
    if r_high is not None:
        ratio = r if s.v < 0.0 else r_high
    if s.measuring == DURING:
        s.impact_work += 0.5 * (1.0 - ratio * ratio) * s.v * s.v
    s.v = -ratio * s.v


@inlined
def aim(s, impacts, r, gap, high, r_high, k, c, n1):
    """Choose the next landing: the kick at the end of the drift, a reading in mid-drift, or an impact."""
    target, goal = s.h, KICK
    if s.phase < 0.5 * s.h and s.kicks > 0 and s.kicks % s.stride == 0:
        target, goal = 0.5 * s.h, READING
    if k is not None:
        target, goal = aim_in_contact(s, target, goal, impacts, gap, k, c)
    elif r is not None and n1 is None:
        if s.flown == 0 and s.meet < target - TINY * s.h:
            if s.meet < s.phase + TINY * s.h:  # at the stop already
                impact(s, impacts, gap, high)
            else:
                target, goal = s.meet, IMPACT
        s.v = chord(s, target, gap, high)
    elif r is not None and (s.v < 0.0 or (high is not None and s.v > 0.0)):
        hit = s.phase + (wall(s.v, gap, high) - s.x) / s.v
        if hit < s.phase + TINY * s.h:  # at the stop already
            bounce(s, s.kicks * s.h + s.phase, impacts, r, r_high)
        elif hit < target - TINY * s.h:
            target, goal = hit, IMPACT
    s.next_phase = target
    s.goal = goal
    s.leg_t = s.t
    s.landing = (s.kicks * s.h + target) / s.w0


@inlined
def accepted(
    s, t, v, power, current, smooth, noise, shaking, readings, impacts, charge,
    r, gap, high, r_high, k, c, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2,
):  # fmt: skip
    """Take an accepted point at time t: terminal voltage, load power, terminal current and voltage of Csmooth.

    At a landing, act and aim anew.
    """
    flow(s, t, v, power, current)
    s.t = t
    s.steps += 1
    if t < s.landing - TINY * s.h / s.w0:
        return
    V = v / s.volts
    elapsed = s.next_phase - s.phase
    x1 = s.x + s.v * elapsed
    s.phase = s.next_phase
    if k is not None:
        x1 = landed_in_contact(s, elapsed, gap, k, c)
    elif r is not None and n1 is None:
        x1 = landed(s, x1, impacts, gap, high)
    elif r is not None:
        ahead = wall(s.v, gap, high)
        if s.goal == IMPACT or (x1 - ahead) * s.v > 0.0:
            bounce(s, s.kicks * s.h + s.phase, impacts, r, r_high)
            x1 = ahead
    s.x = x1
    if s.goal == READING:
        row = s.kicks // s.stride - 1
        readings[row, 2], readings[row, 3], readings[row, 4] = s.x, s.v, V
        charge[row] = smooth
    elif s.goal == KICK:
        if s.kicks < s.noise_size:
            before = s.v
            xi, (_, a) = noise[s.kicks], between_kicks(shaking, s.kicks + 1)
            v1 = kick(s.x, before, V, xi, s.h, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, a)
            s.v = freed(s.x, before, v1, r, n1, gap, high)
            if s.measuring == DURING:
                work(s, before, s.v, s.x, V, xi, s.h, alpha, beta, n1, n2, n12, linear, alpha2, a)
        s.kicks += 1
        s.phase = 0.0
        mark(s, t, v, smooth, 0.0 if k is None else contact_energy(s.x, gap, k), alpha, linear, alpha2)
        if s.kicks % s.stride == 0 and s.kicks <= s.noise_size:
            row = s.kicks // s.stride - 1
            readings[row, 0], readings[row, 1] = s.x, V
        if r is not None and n1 is None:
            mean, _ = between_kicks(shaking, min(s.kicks + 1, s.noise_size))
            plan(s, V, mean, r, gap, high, r_high, alpha, beta, linear, alpha2)
    aim(s, impacts, r, gap, high, r_high, k, c, n1)


class Drive:
    """The mass of one run: its state, its noise and its record.

    Parameters
    ----------
    eqs
        nondimensional equations; mu plays no part here, the circuit is ngspice's.
    volts, w0
        theta l/Cp in volt, and the short-circuit natural frequency in rad/s.
    noise
        one standard normal variate a kick, shape (n,).
    h, stride
        nondimensional step, and kicks between readings.
    start
        (x, x', V) at the beginning; None: at rest in the first of `resting_places`.
    free
        whether ngspice may take smaller steps of its own between landings.
    since
        nondimensional time at which the ledger begins.
    shaking
        as of `harvester.mechanics.kernels.path.trace`.
    native
        False: ngspice calls plain Python functions, the readable reference, at some twenty times the cost.
    """

    def __init__(
        self,
        eqs: Equations,
        volts: float,
        w0: float,
        noise: Floats,
        h: float,
        stride: int = 1,
        start: tuple[float, float, float] | None = None,
        free: bool = False,
        since: float = math.inf,
        native: bool = True,
        shaking: Floats | None = None,
    ) -> None:
        self.native = native
        self.smoothing = 0.0  # capacitance of the load's Csmooth (F), once it has run
        readings = len(noise) // stride
        self.noise = np.ascontiguousarray(noise[: readings * stride])
        self.shaking = forcing(eqs, h, len(noise)) if shaking is None else np.ascontiguousarray(shaking)
        self.readings = np.zeros((readings, len(COLUMNS)))
        self.charge = np.zeros(readings)  # voltage of the load's Csmooth, V, with each reading
        self.impacts = room_for_impacts(eqs, len(self.noise))
        self.record = np.zeros(1, STATE).view(np.recarray)
        start = (resting_places(eqs)[0], 0.0, 0.0) if start is None else start
        given = {**vars(eqs), "r": eqs.restitution, "high": eqs.opposite_gap, "r_high": eqs.opposite_restitution}
        given |= {"k": eqs.stop_stiffness, "c": None if eqs.stop_stiffness is None else eqs.stop_damping or 0.0}
        self.given = tuple(given[name] for name in COEFFICIENTS)
        for name, value in (*((n, given[n]) for n in COEFFICIENTS), ("h", h), ("w0", w0), ("volts", volts)):
            self.record[name] = 0.0 if value is None else value
        a = None if self.shaking is None else float(self.shaking[0])
        # Half a kick comes first, as in `trace`; interpreted, for it is not worth a compilation.
        self.record["x"], self.record["v"] = start[0], interpreted(kick)(*start, 0.0, 0.5 * h, *self.given[STOPS:], a)
        self.record["since"] = since / w0
        self.record["stride"], self.record["free"], self.record["has_beta"] = stride, free, eqs.beta is not None
        self.record["noise_at"], self.record["noise_size"] = self.noise.ctypes.data, len(self.noise)
        self.record["shaking_at"] = 0 if self.shaking is None else self.shaking.ctypes.data
        self.record["readings_at"] = self.readings.ctypes.data
        self.record["impacts_at"], self.record["impacts_size"] = self.impacts.ctypes.data, len(self.impacts)
        self.record["charge_at"] = self.charge.ctypes.data
        stops = self.given[:STOPS]
        if eqs.restitution is not None and eqs.n1 is None:
            mean, _ = interpreted(between_kicks)(self.shaking, 1)
            interpreted(plan)(self.record[0], start[2], mean, *stops[:4], eqs.alpha, eqs.beta, eqs.linear, eqs.alpha2)
        interpreted(aim)(self.record[0], self.impacts, *stops, eqs.n1)

    @property
    def duration(self) -> float:
        """Time that ngspice has to run, in second: to the last reading and a little beyond."""
        s = self.record[0]
        return float((s.noise_size + 0.75) * s.h / s.w0)

    def path(self) -> Path:
        """The finished run as a `Path`, to be compared with `harvester.mechanics.kernels.path.trace`.

        Raises
        ------
        SimulationError
            for more than two impacts a step: the stops are too near each other.
        """
        s = self.record[0]
        if s.impacts > len(self.impacts):
            raise SimulationError(NARROW)
        return Path(float(s.h), int(s.stride), self.readings, self.impacts[: s.impacts].copy(), self.shaking)
