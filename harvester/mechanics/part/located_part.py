"""The C function of a device with located impacts (`harvester.mechanics.part.located`)."""

import math

from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.part.located import ENDLESS, rebounded, up_to_event
from harvester.mechanics.part.state import (
    ADVANCE,
    DONE,
    EVENT,
    FAILED,
    JUMP,
    READ,
    SLACK,
    STOPPING,
    kept,
    loaded,
    report,
)


@inlined
def jumped(w, m, side, h, c, walls, outside, record):
    """The motion after an impact, which is counted."""
    m1 = rebounded(m, side, h, c, walls, outside, record)
    w[9] += 0.5 * (m.v * m.v - m1.v * m1.v)
    w[10] += m1.v - m.v
    w[11] += 1.0
    w[12], w[13], w[14] = m.t, -m.v, 0.0
    return m1


@inlined
def advance_located(w, until, stopping, h0, quiet, c, walls, outside, record):
    """Go to the time ``until``, or ``stopping`` to the next impact."""
    m = loaded(w)
    if w[14] != 0.0:
        m = jumped(w, m, w[14], h0, c, walls, outside, record)
    steps = max(math.ceil((until - m.t) / h0 - SLACK), 1.0)
    h = (until - m.t) / steps
    begin, events = m.t, 0
    for k in range(int(steps)):
        end = begin + (k + 1.0) * h if k + 1.0 < steps else until
        while m.t < end:
            leg = up_to_event(m, end - m.t, quiet, c, walls, outside, record)
            m = leg.m
            if leg.side != 0.0:
                if stopping:
                    w[14] = leg.side
                    return EVENT if kept(w, m) else FAILED
                m = jumped(w, m, leg.side, h0, c, walls, outside, record)
                events += 1
                if events > ENDLESS:
                    return FAILED
        events = 0
    return DONE if kept(w, m) else FAILED


@inlined
def located_part(what, w, out, until, h, quiet, c, walls, outside, record):
    """Advance, jump, or report."""
    if what == ADVANCE or what == STOPPING:  # noqa: PLR1714, SIM109 - as numba takes it
        return advance_located(w, until, what == STOPPING, h, quiet, c, walls, outside, record)
    if what == JUMP and w[14] != 0.0:
        kept(w, jumped(w, loaded(w), w[14], h, c, walls, outside, record))
    if what == READ:
        report(out, loaded(w), 0.0, quiet, c, None, outside, record)
        out[5], out[6], out[7], out[9], out[13] = w[11], w[12], w[13], w[10], w[9]
    return DONE
