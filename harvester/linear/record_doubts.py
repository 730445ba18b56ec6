"""The unknowns of a recording: the excitation beyond half its sampling rate, and between its end and its beginning.

For a record that was drawn from a tabulated PSD it is the excitation between its lines.  All
are weighed by the response of the linear equations, E[V^2] = sum of |H|^2 p over the lines p of the
record.
"""

import math
from dataclasses import replace

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.linear.shaking import lines
from harvester.linear.transfer import gains
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.records.records import BRIDGE, Record, bridge
from harvester.records.standstill import standstill

BEYOND, JOIN = 1e-3, 5e-3  # of E[V^2], from which on it is reported
LEAST_LOSS = 1e-6  # of the linear response, so that it has a size
FINER = 16  # times as many lines show what the lines of a density leave out
CUTS = 8  # other ends of a record, within a period of its strongest response
TOP = 0.1  # of the frequencies: whose mean density stands for what is beyond them


def record_doubts(eqs: Equations) -> list[Diagnostic]:
    """Warnings of a record that is sampled too coarsely for the response, or whose join at the end matters.

    Stretches of a constant value are reported as well.
    """
    record = eqs.record
    if record is None or record.exact:
        return []
    warnings = list[Diagnostic]()
    w, p = _lines(record)
    whole = p @ _gain(eqs, w)
    top = p[-math.ceil(TOP * len(p)) :].mean() / w[0]
    higher = np.geomspace(w[-1], 100.0 * w[-1], 20_000)
    beyond = top * np.trapezoid(_gain(eqs, higher), higher) / whole
    if beyond > BEYOND:
        warnings.append(warning("coarse_record", samples=float(2.0 * w[-1]), change=float(beyond)))
    if (join := join_change(eqs)) > JOIN:
        warnings.append(warning("record_join", change=join))
    if (stood := standstill(record.values)) is not None:
        first, last = stood.longest
        rows = {"first": first + 1, "last": last}
        warnings.append(warning("record_stands_still", share=stood.share, **rows))
    return warnings


def join_change(eqs: Equations) -> float:
    """The possible relative change of E[V^2] due to the end of a record and the way it is joined.

    0 if it has no bridge.

    It ends by chance: the largest change by `CUTS` ends up to a period of the strongest response
    before is used, and that without the bridge.
    """
    record = eqs.record
    if record is None or not record.bridged:
        return 0.0
    w, p = _lines(record)
    powers = p * _gain(eqs, w)
    values = record.values[: 1 - BRIDGE]
    turn = min(2.0 * math.pi / (w[powers.argmax()] * record.spacing), 0.5 * len(values))
    ends = [len(values) - math.ceil(k * turn / CUTS) for k in range(1, CUTS + 1)]
    others = [values, *(np.append(values[:end], bridge(values[:end])) for end in ends)]
    mean_squares = [
        q @ _gain(eqs, v) for v, q in (_lines(Record(record.spacing, values)) for values in others)
    ]
    return float(max(abs(other / powers.sum() - 1.0) for other in mean_squares))


def join_beyond(eqs: Equations, within: float | None) -> Diagnostic | None:
    """A warning if a record's join alone changes E[V^2] by ``within`` or more."""
    if within is None or (join := join_change(eqs)) < within:
        return None
    return warning("within_record_join", within=within, change=join)


def density_doubts(eqs: Equations, drawn: Record) -> list[Diagnostic]:
    """A warning if the lines of the record that was drawn from a PSD are too far apart for the response."""
    if eqs.density is None:
        return []
    w, p = _lines(drawn)
    edges = np.linspace(0.5, len(w) + 0.5, FINER * len(w) + 1) * w[0]
    between = np.diff(eqs.density.below(edges / (2.0 * math.pi))) @ _gain(
        eqs, 0.5 * (edges[1:] + edges[:-1])
    )
    off = abs(p @ _gain(eqs, w) / between - 1.0)
    return [warning("narrow_density", period=drawn.period, change=float(off))] if off > JOIN else []


def _lines(record: Record) -> tuple[Floats, Floats]:
    """The lines of a record above 0."""
    w, p = lines(record)
    return w[1:], p[1:]


def _gain(eqs: Equations, w: Floats) -> Floats:
    """The squared size of V over the acceleration, of the linear equations with a damping that bounds it."""
    return np.asarray(gains(replace(eqs, c1=min(eqs.c1 or 0.0, -LEAST_LOSS)), w)[1])
