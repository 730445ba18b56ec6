"""The kernel of a compiled circuit that a mean current feeds, in place of a piezo that vibrates.

The current i into the node ``p`` follows a table of the voltage u there with a lag: tau i' = I(u) -
i + sqrt(S(u)) xi, where xi is white noise with unit density, or absent.
"""

import math

from harvester.circuits.pointers import advance
from harvester.circuits.substeps import DID, FINEST
from harvester.mechanics.kernels.compiled import kernel


@kernel
def feed(circuit, state, room, table, top, h, delay, charge, stride, variates, out):
    """Fill ``out``, shape (n, 5), every ``stride`` steps of h (s): V of ``p``, store and load, and two integrals.

    ``table``, shape (4, points), has I (A), tau (s), the piezo's mean square voltage and S (A^2 s) at even voltages up
    to ``top``; ``variates`` of xi are normal, one a step, or none.  The current begins after ``delay`` (s); ``charge``
    (C) is the unit of charges.  The integrals hold the squared voltages at load and piezo.  Returns the circuit's
    steps, and those that failed.
    """
    current = 0.0
    last = len(state) - DID
    steps = 0.0
    failed = 0.0
    square = 0.0
    piezo = 0.0
    before = 0.0
    finest = table.shape[1] - 1
    at = circuit.voltages_at
    for k in range(out.shape[0] * stride):
        u = state[at]
        ahead = min(max(1.5 * u - 0.5 * before, 0.0), top)  # in the middle of the step
        before = u
        position = ahead / top * finest
        i = min(int(position), finest - 1)
        part = position - i
        mean = table[0, i] + part * (table[0, i + 1] - table[0, i])
        lag = table[1, i] + part * (table[1, i + 1] - table[1, i])
        old = current
        if k * h >= delay:
            kept = math.exp(-h / max(lag, 1e-9 * h))
            current = mean + (current - mean) * kept
            if len(variates):
                density = table[3, i] + part * (table[3, i + 1] - table[3, i])
                current += (
                    math.sqrt(max(density, 0.0) * (1.0 - kept * kept) / (2.0 * lag)) * variates[k]
                )
        given = 0.5 * (old + current) * h
        advance(
            circuit.address,
            circuit.record,
            state,
            room,
            x=0.0,
            x1=given / charge,
            wall=given / charge,
            first=1.0,
            h=1.0,
            count=FINEST,
        )
        square += state[last]
        steps += state[last + 1]
        failed += state[last + 2]
        piezo += h * (table[2, i] + part * (table[2, i + 1] - table[2, i]))
        if (k + 1) % stride == 0:
            row = out[(k + 1) // stride - 1]
            row[0] = state[at]
            row[1] = state[at + 1]
            row[2] = state[at + 2]
            row[3], row[4] = square, piezo
    return steps, failed
