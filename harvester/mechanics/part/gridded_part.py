"""The C function of a device on a grid of steps (`harvester.mechanics.part.gridded`)."""

import math

from numba import carray, types  # type: ignore[attr-defined]

from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.ideal_circuit import Store
from harvester.mechanics.kernels.noise import shuffle, two_variates
from harvester.mechanics.kernels.shaking import Filter, shake
from harvester.mechanics.part.forces import Motion, acceleration
from harvester.mechanics.part.gridded import at_time, flight, struck
from harvester.mechanics.part.state import (
    ADVANCE,
    DONE,
    EVENT,
    FAILED,
    READ,
    SLACK,
    STOPPING,
    kept,
    loaded,
    report,
)

DIGITS = 1.0 / 2.0**53


@inlined
def uniform(words):
    """A number between 0 and 1, from 53 random bits."""
    bits, words[0], words[1] = shuffle(words[0], words[1])
    return ((bits >> types.uint64(11)) + 0.5) * DIGITS


@inlined
def white(words, c):
    """The two variates of a kick; 0 and None without white noise."""
    if c.n1 is None and c.n2 is None:
        return 0.0, None
    bits, words[0], words[1] = shuffle(words[0], words[1])
    return two_variates(bits)


@inlined
def shaker_of(f, w, words):
    """The filter of coloured noise on the state's own numbers; None without."""
    if f is None:
        return None
    state, random = carray(w, (24,)), carray(words, (2,))
    p, q, s0, s1 = state[18:19], state[19:20], random[0:1], random[1:2]
    return Filter(f.a11, f.a12, f.a21, f.a22, f.l11, f.l21, f.l22, f.gain, None, p, q, s0, s1, None)


@inlined
def begin_noise(w, words, f, spread):
    """Begin filtered noise with its stationary law."""
    if f is not None:
        length = spread * math.sqrt(-2.0 * math.log(uniform(words)))
        angle = 2.0 * math.pi * uniform(words)
        w[18], w[19] = length * math.cos(angle), length * math.sin(angle)


@inlined
def filtered(w, f):
    """The filtered noise's present acceleration, 0 without."""
    if f is None:
        return 0.0
    if f.gain is not None:
        return f.gain * w[18]
    return w[18]


@inlined
def step_noise(w, shaker):
    """Advance filtered noise by a step: its acceleration afterwards."""
    if shaker is None:
        return 0.0
    shake(carray(w, (24, 1))[20:22], False, shaker)
    return w[21]


@inlined
def to_time(w, words, until, stopping, h, c, circuit, outside, record, f, spread):
    """Go to the time ``until``, or ``stopping`` to the next impact."""
    m, store = loaded(w), Store(w[7], w[8])
    if w[16] == 0.0:
        w[16] = 1.0
        begin_noise(w, words, f, spread)
        m = struck(
            m,
            0.5 * h,
            c,
            acceleration(m.t, outside, record) + filtered(w, f),
            0.0,
            None,
            outside.current,
        )
    shaker = shaker_of(f, w, words)
    while True:
        a = acceleration(m.t, outside, record) + filtered(w, f)
        end = (w[15] + 1.0) * h
        whole = end <= until + SLACK * h
        if stopping or whole:
            fine = flight(m, store, h, h, c, circuit, a)
            if stopping and fine.number > 0.0:
                when = m.t + max(fine.time, 0.0)
                if w[17] + SLACK * h < when <= until:
                    w[17] = when
                    return EVENT if kept(w, m) else FAILED
        if not whole:
            break
        after = acceleration(end, outside, record)
        before_noise = filtered(w, f)
        a1 = after + step_noise(w, shaker)
        mean = 0.5 * (acceleration(m.t, outside, record) + before_noise + a1)
        fine = flight(m, store, h, h, c, circuit, mean)
        w[9] += fine.energy
        w[10] += fine.impulse
        w[11] += fine.number
        if fine.number > 0.0:
            w[12], w[13] = m.t + fine.time, fine.speed
        xi, other = white(words, c)
        store = fine.store
        m = struck(fine.m, h, c, a1, xi, other, outside.current)
        m = Motion(m.x, m.v, m.V, end, m.work, m.load, m.damping)
        w[15] += 1.0
        w[7], w[8] = store
    w[17] = until
    return DONE if kept(w, m) else FAILED


@inlined
def gridded_part(what, w, words, out, until, h, quiet, c, circuit, outside, record, f, spread):
    """Advance, or report."""
    if what == ADVANCE or what == STOPPING:  # noqa: PLR1714, SIM109 - as numba takes it
        return to_time(w, words, until, what == STOPPING, h, c, circuit, outside, record, f, spread)
    if what == READ:
        m, store = loaded(w), Store(w[7], w[8])
        a = acceleration(m.t, outside, record) + filtered(w, f)
        t = max(w[17] - m.t, 0.0)
        if w[16] == 0.0:
            report(out, m, store.U, quiet, c, circuit, outside, record)
            out[5], out[6], out[7], out[9], out[13] = 0.0, 0.0, 0.0, 0.0, 0.0
            return DONE
        now = at_time(m, store, h, t, quiet, c, circuit, a, a)
        report(out, now.m, now.store.U, quiet, c, circuit, outside, record)
        hit = now.number > 0.0
        out[5] = w[11] + now.number
        out[6], out[7] = (m.t + now.time if hit else w[12]), (now.speed if hit else w[13])
        out[9], out[13] = w[10] + now.impulse, w[9] + now.energy
    return DONE
