"""What a record cannot know: the shaking beyond half its sampling rate, and that between its end and its beginning.

Both are weighed by the response of the linear equations, E[V^2] = sum of |H|^2 p over the lines p of the record.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.scene.records import BRIDGE, Record

BEYOND, JOIN = 1e-3, 5e-3  # of E[V^2], from which on it is told
LEAST_LOSS = 1e-6  # of the linear response
TOP = 0.1  # of the frequencies: whose mean density stands for what is beyond them


def record_doubts(eqs: Equations) -> list[str]:
    """Warnings of a record that is sampled too coarsely for the response, or whose join at the end matters."""
    record = eqs.record
    if record is None:
        return []
    found = []
    w, p = _lines(record)
    whole = p @ _gain(eqs, w)
    top = p[-math.ceil(TOP * len(p)) :].mean() / w[0]
    higher = np.geomspace(w[-1], 100.0 * w[-1], 20_000)
    beyond = top * np.trapezoid(_gain(eqs, higher), higher) / whole
    if beyond > BEYOND:
        found.append(
            f"the record has only {2.0 * w[-1]:.3g} samples to a period of the resonance: what shakes above half its "
            f"rate is not in it, and if that is as strong as just below, E[V^2] is off by {beyond:.1%}"
        )
    w, p = _lines(Record(record.spacing, record.values[: 1 - BRIDGE]))
    join = abs(p @ _gain(eqs, w) / whole - 1.0)
    if join > JOIN:
        found.append(f"the record's end does not meet its beginning: how they are joined changes E[V^2] by {join:.1%}")
    return found


def _lines(record: Record) -> tuple[Floats, Floats]:
    """Frequencies above 0 and powers of a record's lines."""
    size = len(record.values)
    powers = np.abs(np.fft.rfft(record.values))[1:] ** 2 / (0.5 * size * size)
    lines = np.arange(1.0, len(powers) + 1.0)
    return np.asarray(2.0 * math.pi / record.period * lines), np.asarray(powers)


def _gain(eqs: Equations, w: Floats) -> Floats:
    """The squared size of V over the acceleration, at frequencies w, of the linear equations."""
    s, beta = 1j * w, eqs.beta or 0.0
    voltage = s / (s + (eqs.mu or 0.0))
    loss = max(-(eqs.c1 or 0.0), LEAST_LOSS)
    return np.asarray(np.abs(voltage / (1.0 + s * s + loss * s + beta * voltage)) ** 2)
