"""The kernels of a node on storage: one state followed by Runge and Kutta's method of fourth order, and all in turn."""

import math

import numpy as np

from harvester.mechanics.kernels.compiled import forced, kernel

PART = 0.02  # of the highest voltage: what a step may change it by
LONGEST = 60.0  # s of a step, while it waits
SAME = 1e-10  # of the highest voltage: packets that begin at voltages so near repeat themselves
DONE = 1.0 - 1e-9  # of the time
SEEN = 20_000  # points of the course in time that are kept, at most
HOUR = 3600.0
# of intervals between packets; s of the first's end; log of a width
BINS = 250
SHORTEST = 1e-3
WIDER = math.log(1.1)
# of the counts
RAN, PACKETS, LOST, BROWN_OUTS, GIVEN, CLAMPED, USED, LEAKED, END, LAST, INTERVALS = range(11)
# counts that grow by the same in each cycle: last, intervals of each bin and their sum
REPEATED = INTERVALS + 2 * BINS
FIRST, POINTS, VOLTS, ON, COUNTS = range(REPEATED, REPEATED + 5)
# of the levels; LEAK is the conductance across the storage capacitor
WAKE, TOP, FARADS, LENGTH, HELD, LOW, HIGH, SPARED, LEAK = range(9)


@forced
def _rate(u, scale, finest, row, drawn):
    """The current (A) into the storage at a voltage, and how it grows from one point of the table to the next."""
    position = min(max(u * scale, 0.0), float(finest))
    k = min(int(position), finest - 1)
    low = row[k] - drawn[k]
    high = row[k + 1] - drawn[k + 1]
    return low + (position - k) * (high - low), high - low


@forced
def _spread(v, branches, factor, before, rates):
    """The current (A) into the branches of a storage capacitor at v, whose rates of voltage are filled in."""
    total = 0.0
    for j in range(branches.shape[1]):
        current = branches[0, j] * (v - branches[2, j] - factor * before[j])
        rates[j] = current / branches[1, j]
        total += current
    return total


@forced
def _quickest(branches):
    """The largest rate (1/s) of the branches, and all their conductances together."""
    fastest, conductance = 0.0, 0.0
    for j in range(branches.shape[1]):
        fastest = max(fastest, branches[0, j] / branches[1, j])
        conductance += branches[0, j]
    return fastest, conductance


@forced
def _current_now(charging, length, now):
    """The charging currents of the window that it is, and how long (s) that lasts."""
    if length == 0.0:
        return charging[0], math.inf
    window = math.floor(now / length * (1.0 + 1e-14) + 1e-9)
    return charging[int(window) % charging.shape[0]], max(
        (window + 1.0) * length - now, 1e-9 * length
    )


@forced
def _end_of_step(v, new, threshold, side, top):
    """The voltage at the end of a step, and its share of the step: a threshold, or the top if the clamp begins."""
    end = new
    if side * (new - threshold) >= 0.0 and new != v:
        end = threshold
    elif v < top < new:
        end = top
    return end, 1.0 if end == new else (end - v) / (new - v)


@kernel
def follow_state(store, drawn, v, duration, threshold, side, course):
    """Go on in a state for a duration, or until V passes a threshold upwards (``side`` 1) or downwards: V there."""
    (charging, levels, branches), (counts, t, volts, spacing) = store, course
    top = levels[TOP]
    farads = levels[FARADS]
    held = levels[HELD]
    finest = charging.shape[1] - 1
    many = branches.shape[1]
    scale = finest / top
    left = duration
    rates = np.zeros((5, many))
    if side * (v - threshold) >= 0.0:
        return v
    fastest, conductance = _quickest(branches)
    while left > 0.0:
        row, room = _current_now(charging, levels[LENGTH], counts[END])
        a, slope = _rate(v, scale, finest, row, drawn)
        a = (a - _spread(v, branches, 0.0, rates[0], rates[1])) / farads
        steepest = max((abs(slope) * scale + conductance) / farads, fastest)
        step = min(
            left, room, LONGEST, PART * top / max(abs(a), 1e-300), 1.0 / max(steepest, 1e-300)
        )
        if left - step < 1e-12 * duration:
            step = left
        u = v + 0.5 * step * a
        b = (
            _rate(u, scale, finest, row, drawn)[0]
            - _spread(u, branches, 0.5 * step, rates[1], rates[2])
        ) / farads
        u = v + 0.5 * step * b
        c = (
            _rate(u, scale, finest, row, drawn)[0]
            - _spread(u, branches, 0.5 * step, rates[2], rates[3])
        ) / farads
        u = v + step * c
        d = (
            _rate(u, scale, finest, row, drawn)[0] - _spread(u, branches, step, rates[3], rates[4])
        ) / farads
        new = v + step / 6.0 * (a + 2.0 * (b + c) + d)
        new, share = _end_of_step(v, new, threshold, side, top)
        step *= share
        charge = farads * (new - v)  # of storage capacitor and branches, without the drawn one
        for j in range(many):
            rise = step / 6.0 * (rates[1, j] + 2.0 * (rates[2, j] + rates[3, j]) + rates[4, j])
            branches[2, j] += rise
            charge += branches[1, j] * rise
        # with this mean the products of charge and voltage are the change of the storage
        # capacitor's energy
        middle = 0.5 * (v + min(new, top))
        k = min(int(middle * scale), finest - 1)
        at_store = middle if held == 0.0 else held
        leaked = levels[LEAK] * at_store * at_store * step
        used = (drawn[k] + (middle * scale - k) * (drawn[k + 1] - drawn[k])) * at_store * step
        counts[GIVEN] += charge * at_store + used + leaked
        counts[LEAKED] += leaked
        if side < 0.0:  # the node is on
            counts[USED] += used
        if new > top:
            counts[CLAMPED] += farads * (new - top) * top
            new = top
        counts[END] += step
        left -= step
        v = max(new, 0.0)
        points = int(counts[POINTS])
        if points < len(t) and (points == 0 or counts[END] - t[points - 1] >= spacing):
            t[points] = counts[END]
            volts[points] = v
            counts[POINTS] += 1.0
        if new == threshold or step == 0.0:
            return v
    return v


@forced
def _flag(v, low, levels):
    """Whether the flag of low energy is there, which it was or was not."""
    return v < levels[LOW] or (low and v < levels[HIGH])


@kernel
def _follow_packet(store, drawn, durations, stops, number, v, low, seconds, hours, course):
    """Send a packet, ``number`` times (negative: in vain), and sleep: V, whether the node is on, and the flag."""
    levels = store[1]
    counts = course[0]
    last = len(durations) - 1
    on = True
    spent = 0.0
    for k in range(abs(number) * last):
        left = min(durations[k % last], seconds - counts[END])
        v = follow_state(
            store, drawn[k % last], v, left, threshold=stops[k % last], side=-1.0, course=course
        )
        on = v > stops[k % last]
        spent = spent + (left if k >= last else 0.0)
        if not on:
            return v, on, low
    send_packet(counts, hours, number > 0)
    low = _flag(v, low, levels)
    left = min((levels[SPARED] if low else durations[last]) - spent, seconds - counts[END])
    v = follow_state(store, drawn[last], v, left, threshold=stops[last], side=-1.0, course=course)
    return v, v > stops[last], low


@kernel
def follow_node(currents, durations, stops, levels, branches, tries, v, seconds, counts, course):
    """Fill the counts and the ``course`` of a node from the voltage v on: times, voltages, and packets of each hour.

    ``currents`` are charging, shape (windows, points), drawn, shape (states, points), and that of
    the waiting node, in A at even voltages up to the top; ``levels`` are the wake voltage, the top,
    the capacitance, the length of a window, 0 for one that lasts, the voltage of a battery, 0
    without one, the voltages at which the flag of low energy appears and disappears, how long sleep
    is with it, and the conductance across the storage capacitor.  ``branches`` are conductances,
    capacitances and voltages of the parts in parallel with the storage capacitor, shape (3, n).
    The last of the states, which last ``durations`` and end at the voltages ``stops``, is sleep.  A
    packet needs as many ``tries`` as these list in turn, and is lost if one is negative.
    """
    (charging, drawn, waiting), (t, volts, hours) = currents, course
    store = (charging, levels, branches)
    followed = (counts, t, volts, seconds / SEEN)
    wake = levels[WAKE]
    repeats = levels[LENGTH] == 0.0 and len(tries) == 1
    ever = stops.max() < wake
    taken = 0
    low = False
    woken = np.full(REPEATED, math.nan)
    begun = np.empty(REPEATED)
    same = SAME * levels[TOP] if repeats else -1.0
    at_wake = np.full(branches.shape[1] + 2, math.nan)
    before = np.empty(branches.shape[1] + 2)
    while counts[END] < seconds * DONE:
        rose = v < wake
        v = follow_state(
            store, waiting, v, seconds - counts[END], threshold=wake, side=1.0, course=followed
        )
        low = _flag(v, low, levels)
        if v >= wake and rose:
            if _alike(v, low, branches[2], at_wake, same):  # what follows is the same each time
                _repeat(counts, woken, seconds, hours)
            # `woken[:] = ...` takes numba seconds, for the words of an error
            woken = counts[:REPEATED].copy()
        before[:] = math.nan
        on = v >= wake
        while on and counts[END] < seconds * DONE:
            if _alike(v, low, branches[2], before, same):
                _repeat(counts, begun, seconds, hours)
            begun = counts[:REPEATED].copy()
            number = tries[taken % len(tries)]
            taken += 1
            v, on, low = _follow_packet(
                store,
                drawn,
                durations,
                stops,
                number=number,
                v=v,
                low=low,
                seconds=seconds,
                hours=hours,
                course=followed,
            )
            counts[BROWN_OUTS] += 0.0 if on else 1.0
            counts[RAN] += counts[END] - begun[END]
        if (
            not on and not ever and v >= wake
        ):  # it would stop as soon as it begins: wait with the node off
            v = follow_state(
                store,
                waiting,
                v,
                seconds - counts[END],
                threshold=math.inf,
                side=1.0,
                course=followed,
            )
        counts[ON] = 1.0 if on else 0.0
    counts[VOLTS] = v


@forced
def _alike(v, low, inner, others, same):
    """Whether voltages and flag are as others were, which they then replace."""
    alike = abs(v - others[0]) < same and others[1] == (1.0 if low else 0.0)
    for j in range(len(inner)):
        alike = alike and abs(inner[j] - others[j + 2]) < same
        others[j + 2] = inner[j]
    others[0] = v
    others[1] = 1.0 if low else 0.0
    return alike


@forced
def send_packet(counts, hours, arrives):
    """Count a packet that is sent now, and the time since the last that arrived."""
    if not arrives:
        counts[LOST] += 1.0
        return
    counts[PACKETS] += 1.0
    hours[min(int(counts[END] / HOUR), len(hours) - 1)] += 1.0
    if counts[FIRST] == 0.0:
        counts[FIRST] = counts[END]
    else:
        gap = counts[END] - counts[LAST]
        k = min(max(int(math.log(gap / SHORTEST) / WIDER), 0), BINS - 1)
        counts[INTERVALS + k] += 1.0
        counts[INTERVALS + BINS + k] += gap
    counts[LAST] = counts[END]


@forced
def _repeat(counts, before, seconds, hours):
    """Go on with whole cycles, as that since the counts ``before``, up to a time in all.

    Evenly over the hours.
    """
    cycle = counts[END] - before[END]
    if cycle > 0.0 and (
        before[LAST] > 0.0 or counts[PACKETS] == 0.0
    ):  # there is one before, like it in intervals, too
        # the last is gone through
        times = max(math.ceil((seconds - counts[END]) / cycle - 1e-9) - 1, 0)
        now = counts[END]
        each = (counts[PACKETS] - before[PACKETS]) / cycle
        for k in range(int(now / HOUR), len(hours)):
            hours[k] += each * max(
                min((k + 1) * HOUR, now + times * cycle) - max(k * HOUR, now), 0.0
            )
        for k in range(REPEATED):
            counts[k] += times * (counts[k] - before[k])
