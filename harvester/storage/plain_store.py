"""A store with a load across it, charged by the rectifier's mean current: when it reaches voltages.

    (C + tau I'(V)) dV/dt = I(V) - V/R,      after the time q0/I(0) of the ring-up

because the current lags behind the rising voltage by tau (first order in the ratio of the time scales).  Under noise
the charge also diffuses: dV = drift dt + sqrt(S(V)) dW/C, from V = 0, where it is reflected.
"""

import math
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from harvester.arrays import Floats
from harvester.storage.rectified_current import RectifiedCurrent

FINE, STEPS = 4001, 2000  # voltages of a quadrature; steps of a random path up to its mean time
LONGER = 3.0  # times the mean time, that random paths are followed


def times_to(levels: Floats, table: RectifiedCurrent, farads: float, ohm: float) -> Floats:
    """When the store reaches ascending levels (V), without diffusion; infinite for those that it does not reach."""
    volts = np.linspace(0.0, float(levels[-1]), FINE)
    net = table.at(volts) - volts / ohm
    held = np.maximum(farads + table.sampled("lag", volts) * table.slope(volts), 0.0)  # 0: it is there at once
    with np.errstate(divide="ignore"):
        rate = np.where(net > 0.0, net, np.nan) / held
    times = cumulative_trapezoid(1.0 / rate, volts, initial=0.0)
    start = table.ring_up / float(table.current[0]) if table.current[0] > 0.0 else math.inf
    return np.nan_to_num(np.interp(levels, volts, start + np.maximum.accumulate(times)), nan=math.inf)


def error_of_times(levels: Floats, table: RectifiedCurrent, farads: float, ohm: float) -> Floats:
    """The standard error that sampling of the currents, which are independent, gives to the times to ``levels``."""
    if table.stderr is None:
        return np.zeros(len(levels))
    base, total = times_to(levels, table, farads, ohm), np.zeros(len(levels))
    for k, error in enumerate(table.stderr):
        current = table.current.copy()
        current[k] += error
        total += np.nan_to_num(times_to(levels, replace(table, current=current), farads, ohm) - base, posinf=0.0) ** 2
    return np.sqrt(total)


def random_paths(
    table: RectifiedCurrent, farads: float, ohm: float, top: float, end: float, count: int, seed: int, coarse: bool
) -> tuple[Floats, Floats]:
    """Times (s) up to ``end``, shape (n,), and voltages (count, n) of stores, at one or (coarse) two steps at once."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 12]))
    steps, dt = STEPS, end / STEPS
    volts = np.linspace(0.0, max(top, float(table.voltages[-1])), FINE)
    effective = farads + table.sampled("lag", volts) * table.slope(volts)
    drift = (table.at(volts) - volts / ohm) / effective
    spread = np.sqrt(table.sampled("density", volts)) / farads
    v, found = np.zeros(count), [np.zeros(count)]
    start = table.ring_up / max(float(table.current[0]), 1e-300)
    for k in range(0, steps, 2 if coarse else 1):
        kick = rng.standard_normal(count)
        length = dt
        if coarse:
            kick, length = kick + rng.standard_normal(count), 2.0 * dt
        begun = min(max((k * dt + length - start) / length, 0.0), 1.0)
        v = np.abs(
            v + begun * np.interp(v, volts, drift) * length + begun * np.interp(v, volts, spread) * kick * dt**0.5
        )
        found.append(v)
    t = np.linspace(0.0, end, len(found))
    return t, np.array(found).T
