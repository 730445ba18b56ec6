"""The lock-step of the mass and ngspice: who moves when.

The mass is kicked at grid times (spring, damping, noise, and the voltage's force -beta V) and
moves at constant velocity in between (`harvester.mechanics.step`).  ngspice advances the circuit
under that motion and lands exactly on every kick, every impact and every reading; at a kick the
accepted voltage is known, so that the force has no lag.  The piezo is a voltage source
theta x/Cp in series with Cp, whose slope is the integrator's velocity: x is continuous where
the velocity jumps, at kicks and at impacts.

    ngspice asks                 answer
    SYNC, before a step          step to the next landing        `proposed`
    source voltage at time t     theta x(t)/Cp of this leg       `source`
    accepted v(t)                at a landing: act, aim anew     `accepted`

`source` is a pure function of the accepted state and t, so a rejected step changes nothing.
The three functions are compiled and called by ngspice through C pointers.
"""

from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, from_dtype, types  # type: ignore[attr-defined]
from numba.core import cgutils
from numba.extending import intrinsic

from harvester.arrays import Floats
from harvester.mechanics.compiled import c_function, inlined
from harvester.mechanics.path import COLUMNS, START, Path, room_for_impacts
from harvester.mechanics.step import kick
from harvester.scaling import Equations

KICK, IMPACT, READING = 0, 1, 2
TINY = 1e-9  # parts of a step: landings nearer than this are one

# The kernels' coefficients, in the order of `kick` and with the restitution coefficient r.
COEFFICIENTS = ("r", "alpha", "beta", "c1", "c2", "c3", "n1", "n2", "n12")

# All that the mass and the coupling know.  t, leg_t, landing in second; volts = theta l/Cp;
# the rest nondimensional.  *_at are addresses of the arrays that the compiled path uses.
STATE = np.dtype(
    [(name, np.float64) for name in ("x", "v", "phase", "next_phase", "h", "w0", "volts", *COEFFICIENTS)]
    + [(name, np.float64) for name in ("t", "leg_t", "landing", "impact_v2", "power", "energy", "energy_from")]
    + [(name, np.int64) for name in ("goal", "kicks", "stride", "steps", "impacts", "free")]
    + [
        (name, np.int64)
        for name in ("accepted_at", "noise_at", "noise_size", "readings_at", "impacts_at", "impacts_size")
    ]
    + [(name, np.int64) for name in ("time_index", "voltage_index", "power_index")],
    align=True,
)


@inlined
def source(s, t):
    """Open-circuit voltage theta x(t)/Cp at a time within the present leg, in volt."""
    return s.volts * (s.x + s.v * s.w0 * (t - s.leg_t))


@inlined
def proposed(s, t, delta):
    """Step that ngspice is to try at t: to the next landing, or its own where it is free to refine."""
    left = s.landing - t
    return delta if s.free and delta < left else left


@inlined
def bounce(s, time, impacts, r):
    """Impact law x'+ = -r x'-, with the impact on record."""
    impacts[s.impacts, 0] = time
    impacts[s.impacts, 1] = -s.v
    s.impacts += 1
    s.impact_v2 += s.v * s.v
    s.v = -r * s.v


@inlined
def aim(s, impacts, r):
    """Choose the next landing: the kick at the end of the drift, a reading in mid-drift, or an impact."""
    target, goal = s.h, KICK
    if s.phase < 0.5 * s.h and s.kicks > 0 and s.kicks % s.stride == 0:
        target, goal = 0.5 * s.h, READING
    if r is not None and s.v < 0.0:
        hit = s.phase - s.x / s.v
        if hit < s.phase + TINY * s.h:  # at the stop already
            bounce(s, s.kicks * s.h + s.phase, impacts, r)
        elif hit < target - TINY * s.h:
            target, goal = hit, IMPACT
    s.next_phase = target
    s.goal = goal
    s.leg_t = s.t
    s.landing = (s.kicks * s.h + target) / s.w0


@inlined
def accepted(s, t, v, power, noise, readings, impacts, r, alpha, beta, c1, c2, c3, n1, n2, n12):
    """Take an accepted point: voltage v and load power at time t; at a landing, act and aim anew."""
    if t > s.energy_from:
        s.energy += 0.5 * (t - max(s.t, s.energy_from)) * (s.power + power)
    s.power = power
    s.t = t
    s.steps += 1
    if t < s.landing - TINY * s.h / s.w0:
        return
    V = v / s.volts
    x1 = s.x + s.v * (s.next_phase - s.phase)
    s.phase = s.next_phase
    if r is not None and (s.goal == IMPACT or x1 < 0.0):
        bounce(s, s.kicks * s.h + s.phase, impacts, r)
        x1 = 0.0
    s.x = x1
    if s.goal == READING:
        row = s.kicks // s.stride - 1
        readings[row, 2], readings[row, 3], readings[row, 4] = s.x, s.v, V
    elif s.goal == KICK:
        if s.kicks < s.noise_size:
            s.v = kick(s.x, s.v, V, noise[s.kicks], s.h, alpha, beta, c1, c2, c3, n1, n2, n12)
        s.kicks += 1
        s.phase = 0.0
        if s.kicks % s.stride == 0 and s.kicks <= s.noise_size:
            row = s.kicks // s.stride - 1
            readings[row, 0], readings[row, 1] = s.x, V
    aim(s, impacts, r)


class Drive:
    """The mass of one run: its state, its noise, its record, and the C functions that ngspice calls.

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
        (x, x', V) at the beginning.
    free
        whether ngspice may take smaller steps of its own between landings.
    """

    def __init__(
        self,
        eqs: Equations,
        volts: float,
        w0: float,
        noise: Floats,
        h: float,
        stride: int = 1,
        start: tuple[float, float, float] = START,
        free: bool = False,
    ) -> None:
        readings = len(noise) // stride
        self.noise = np.ascontiguousarray(noise[: readings * stride])
        self.readings = np.zeros((readings, len(COLUMNS)))
        self.impacts = room_for_impacts(eqs, len(self.noise))
        self.record = np.zeros(1, STATE).view(np.recarray)
        given = {**vars(eqs), "r": eqs.restitution}
        self.present = tuple(given[name] is not None for name in COEFFICIENTS)
        for name, value in (*((n, given[n]) for n in COEFFICIENTS), ("h", h), ("w0", w0), ("volts", volts)):
            self.record[name] = 0.0 if value is None else value
        self.record["x"], self.record["v"] = start[:2]
        self.record["accepted_at"] = native_accepted(self.present).address
        self.record["stride"], self.record["free"] = stride, free
        self.record["noise_at"], self.record["noise_size"] = self.noise.ctypes.data, len(self.noise)
        self.record["readings_at"] = self.readings.ctypes.data
        self.record["impacts_at"], self.record["impacts_size"] = self.impacts.ctypes.data, len(self.impacts)
        aim(self.record[0], self.impacts, eqs.restitution)

    @property
    def duration(self) -> float:
        """Time that ngspice has to run, in second: to the last reading and a little beyond."""
        s = self.record[0]
        return float((s.noise_size + 0.75) * s.h / s.w0)

    def path(self) -> Path:
        """The finished run as a `Path`, to be compared with `harvester.mechanics.path.trace`."""
        s = self.record[0]
        return Path(float(s.h), int(s.stride), self.readings, self.impacts[: s.impacts].copy())


@intrinsic
def _pointer(typingctx, address):
    """An address as a pointer, for `carray`."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.uintp), codegen


@intrinsic
def _call(typingctx, address, state, t, v, power):
    """Call the C function ``void (*)(state, t, v, power)`` at an address."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.IntType(32), [arg.type for arg in args[1:]])
        return builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])

    return types.int32(types.int64, _STATE_POINTER, types.float64, types.float64, types.float64), codegen


_STATE_POINTER = types.CPointer(from_dtype(STATE))
_F8, _I4 = types.float64, types.int32


@c_function(_I4(types.CPointer(_F8), _F8, types.voidptr, _I4, _STATE_POINTER))
def native_source(value, t, node, ident, user):
    """GetVSRCData: the source's voltage at a candidate time."""
    carray(value, 1)[0] = source(carray(user, 1)[0], t)
    return 0


@c_function(_I4(_F8, types.CPointer(_F8), _F8, _I4, _I4, _I4, _STATE_POINTER))
def native_sync(t, delta, old_delta, redo, ident, location, user):
    """GetSyncData: before a step (location 0) set its length; after it (1) accept what converged."""
    if location == 0:
        step = carray(delta, 1)
        step[0] = proposed(carray(user, 1)[0], t, step[0])
    return redo


@c_function(_I4(types.uintp, _I4, _I4, _STATE_POINTER))
def native_data(vectors, count, ident, user):
    """SendData: {int, int, pointer to pointers to {name, real, imaginary, ...}} of the accepted point."""
    s = carray(user, 1)[0]
    table = carray(_pointer(vectors), 2, np.uintp)[1]
    values = carray(_pointer(table), count, np.uintp)
    t = carray(_pointer(values[s.time_index]), 2, np.float64)[1]
    v = carray(_pointer(values[s.voltage_index]), 2, np.float64)[1]
    power = 0.0
    if s.power_index >= 0:
        power = carray(_pointer(values[s.power_index]), 2, np.float64)[1]
    return _call(s.accepted_at, user, t, v, power)


@cache
def native_accepted(present: tuple[bool, ...]) -> Any:
    """`accepted` as a C function, compiled for the coefficients present (see `COEFFICIENTS`)."""
    has_r, has_alpha, has_beta, has_c1, has_c2, has_c3, has_n1, has_n2, has_n12 = present

    @c_function(_I4(_STATE_POINTER, _F8, _F8, _F8))
    def act(state, t, v, power):
        s = carray(state, 1)[0]
        accepted(
            s,
            t,
            v,
            power,
            carray(_pointer(s.noise_at), s.noise_size, np.float64),
            carray(_pointer(s.readings_at), (s.noise_size // s.stride, 5), np.float64),
            carray(_pointer(s.impacts_at), (s.impacts_size, 2), np.float64),
            s.r if has_r else None,
            s.alpha if has_alpha else None,
            s.beta if has_beta else None,
            s.c1 if has_c1 else None,
            s.c2 if has_c2 else None,
            s.c3 if has_c3 else None,
            s.n1 if has_n1 else None,
            s.n2 if has_n2 else None,
            s.n12 if has_n12 else None,
        )
        return 0

    return act
