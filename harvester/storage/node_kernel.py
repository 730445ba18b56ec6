"""The kernels of a node on a store: one state followed by Runge and Kutta's method of fourth order, and all in turn."""

import math

import numpy as np

from harvester.mechanics.kernels.compiled import forced, kernel

PART = 0.02  # of the highest voltage: what a step may change it by
LONGEST = 60.0  # s of a step, while it waits
SAME = 1e-10  # of the highest voltage: packets that begin at voltages so near repeat themselves
DONE = 1.0 - 1e-12  # of the time
SEEN = 20_000  # points of the course in time that are kept, at most
HOUR = 3600.0
RAN, PACKETS, BROWN_OUTS, GIVEN, CLAMPED, END, FIRST, POINTS = range(8)  # of the counts


@forced
def _rate(u, scale, finest, row, drawn):
    """The current (A) into the store at a voltage, and how it grows from one point of the table to the next."""
    place = min(max(u * scale, 0.0), float(finest))
    k = min(int(place), finest - 1)
    low, high = row[k] - drawn[k], row[k + 1] - drawn[k + 1]
    return low + (place - k) * (high - low), high - low


@kernel
def follow_state(charging, drawn, levels, v, duration, threshold, side, counts, t, volts, apart):
    """Go on in a state for a duration, or until V passes a threshold upwards (``side`` 1) or downwards: V there."""
    top, farads, length = levels[1], levels[2], levels[3]
    finest = charging.shape[1] - 1
    scale, left = finest / top, duration
    if side * (v - threshold) >= 0.0:
        return v
    while left > 0.0:
        row, room = charging[0], left
        if length > 0.0:
            window = math.floor(counts[END] / length * (1.0 + 1e-14) + 1e-9)
            room = max((window + 1.0) * length - counts[END], 1e-9 * length)
            row = charging[int(window) % charging.shape[0]]
        a, slope = _rate(v, scale, finest, row, drawn)
        a /= farads
        steepest = abs(slope) * scale / farads
        step = min(left, room, LONGEST, PART * top / max(abs(a), 1e-300), 1.0 / max(steepest, 1e-300))
        if left - step < 1e-12 * duration:
            step = left
        b = _rate(v + 0.5 * step * a, scale, finest, row, drawn)[0] / farads
        c = _rate(v + 0.5 * step * b, scale, finest, row, drawn)[0] / farads
        d = _rate(v + step * c, scale, finest, row, drawn)[0] / farads
        new = v + step / 6.0 * (a + 2.0 * (b + c) + d)
        there = side * (new - threshold) >= 0.0 and new != v
        if there:
            step *= (threshold - v) / (new - v)
            new = threshold
        middle = 0.5 * (v + min(new, top))
        counts[GIVEN] += row[min(int(middle * scale), finest)] * middle * step
        if new > top:
            counts[CLAMPED] += farads * (new - top) * top
            new = top
        counts[END] += step
        left -= step
        v = max(new, 0.0)
        points = int(counts[POINTS])
        if points < len(t) and (points == 0 or counts[END] - t[points - 1] >= apart):
            t[points], volts[points] = counts[END], v
            counts[POINTS] += 1.0
        if there or step == 0.0:
            return v
    return v


@kernel
def follow_node(charging, drawn, waiting, durations, stops, levels, v, seconds, counts, t, volts, hours):
    """Fill the counts, the course and the packets of each of the ``hours`` of a node from the voltage v on.

    ``charging``, shape (windows, points), and ``drawn``, shape (states, points), are currents (A) at even voltages up
    to the top; ``levels`` are the wake voltage, the top, the capacitance and the length of a window, 0 for one that
    lasts.  The last of the states, which last ``durations`` and end at the voltages ``stops``, is sleep.
    """
    wake, repeats, apart = levels[0], levels[3] == 0.0, seconds / SEEN
    ever, last = stops.max() < wake, len(durations) - 1
    woken, begun = np.full(6, math.nan), np.empty(6)
    same = SAME * levels[1] if repeats else -1.0
    while counts[END] < seconds * DONE:
        rose = v < wake
        v = follow_state(charging, waiting, levels, v, seconds - counts[END], wake, 1.0, counts, t, volts, apart)
        if v >= wake and rose and repeats:  # what follows is the same each time
            _repeat(counts, woken, seconds)
            woken[:] = counts[:6]
        before, on = math.nan, v >= wake
        begun[:] = counts[:6]
        while on and counts[END] < seconds * DONE:
            if abs(v - before) < same:
                _repeat(counts, begun, seconds)
            before = v
            begun[:] = counts[:6]
            for k in range(last + 1):
                left = min(durations[k], seconds - counts[END])
                v = follow_state(charging, drawn[k], levels, v, left, stops[k], -1.0, counts, t, volts, apart)
                if v <= stops[k]:
                    counts[BROWN_OUTS] += 1.0
                    on = False
                    break
                if k == last - 1:
                    _send(counts, hours)
            counts[RAN] += counts[END] - begun[END]
        if not on and not ever and v >= wake:  # it would stop as soon as it begins: wait with the node off
            left = seconds - counts[END]
            v = follow_state(charging, waiting, levels, v, left, math.inf, 1.0, counts, t, volts, apart)


@forced
def _send(counts, hours):
    """Count a packet that is sent now."""
    counts[PACKETS] += 1.0
    hours[min(int(counts[END] / HOUR), len(hours) - 1)] += 1.0
    if counts[FIRST] == 0.0:
        counts[FIRST] = counts[END]


@forced
def _repeat(counts, before, seconds):
    """Go on with whole cycles, as that since the counts ``before``, up to a time in all."""
    cycle = counts[END] - before[END]
    if cycle > 0.0:  # and there is one before
        times = math.floor((seconds - counts[END]) / cycle)
        for k in range(6):
            counts[k] += times * (counts[k] - before[k])
