"""The mean current that a rectifier gives into storage at a voltage that is held, and how it follows that voltage.

I(V)    mean current, with the sampling and time-step errors
S(V)    Var(charge)/time over a long time, the spectral density at frequency zero: the diffusion
        of V is S/(2 C^2)
q0      the charge that is not given while the mass rings up from rest: integral of I(0) - i(t)
tau(V)  how far the current lags behind V: q = integral of i(t) - I(V) after a step of V, over
        the step of I

A storage capacitor with a load across it, which this current charges, reaches a voltage by

    (C + tau I'(V)) dV/dt = I(V) - V/R,      after the time q0/I(0) of the ring-up

because the current lags behind the rising voltage by tau (first order in the ratio of the time
scales).  Under noise the charge also diffuses: dV = drift dt + sqrt(S(V)) dW/C, from V = 0, where
it is reflected.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import PchipInterpolator

from harvester.arrays import Floats

FINE, STEPS = 4001, 2000  # voltages of a quadrature; steps of a random course to its mean time
TINY = 1e-9  # a decay within a step that counts as 0
LONGER = 3.0  # duration of random paths over the mean time


@dataclass(frozen=True)
class MeanCurrent:
    """A mean ``current`` (A), shape (..., n), at ascending ``voltages`` (V) from 0 on, shape (n,).

    ``stderr`` is that of sampling; None if nothing is random.
    """

    voltages: Floats
    current: Floats
    stderr: Floats | None

    @cached_property
    def curve(self) -> PchipInterpolator:
        """I(V), monotone between the points."""
        return PchipInterpolator(self.voltages, self.current, axis=-1)

    def at(self, volts: Floats) -> Floats:
        """The mean current; beyond the last voltage that of the last."""
        return np.asarray(self.curve(np.clip(volts, 0.0, self.voltages[-1])))

    def halved(self) -> Self:
        """The table without every other voltage but the ends: its change then is the interpolation error."""
        keep = np.unique(np.append(np.arange(0, len(self.voltages), 2), len(self.voltages) - 1))
        columns = {
            name: column[..., keep]
            for name, column in vars(self).items()
            if isinstance(column, np.ndarray)
        }
        return replace(self, **columns)

    def extrapolated(self, coarse: Self) -> Self:
        """The table as of a step of 0, from this one and another at twice the step, whose error is of second order."""
        return self.scaled(1.0, (self.current - coarse.current) / 3.0)

    def scaled(self, factor: float, more: Floats | float = 0.0) -> Self:
        """The table with a ``factor`` of all currents, and ``more`` (A) of each."""
        return replace(self, current=factor * self.current + more)

    def shifted(self) -> Self:
        """The table with all currents one standard error lower, as independent ones of the points would seldom be."""
        return self if self.stderr is None else self.scaled(1.0, -self.stderr)


@dataclass(frozen=True)
class RectifiedCurrent(MeanCurrent):
    """The table of excitation that always is alike, of columns in SI units, shape (n,) each.

    ``square`` is the mean square of the piezo's voltage, with the standard error ``square_error``;
    ``lag`` is in s.
    """

    density: Floats
    square: Floats
    lag: Floats
    ring_up: float
    square_error: Floats | None = None
    length: ClassVar[float] = math.inf

    def slope(self, volts: Floats) -> Floats:
        """The slope dI/dV, 0 beyond the last voltage."""
        slopes = np.asarray(self.curve(np.minimum(volts, self.voltages[-1]), 1))
        return np.where(volts <= self.voltages[-1], slopes, 0.0)

    def column_at(self, name: str, volts: Floats) -> Floats:
        """Another column between its points, on straight lines."""
        return np.asarray(np.interp(volts, self.voltages, getattr(self, name)))

    @property
    def start(self) -> float:
        """How long (s) after rest empty storage gets nothing, so that the ring-up's charge is not given."""
        return self.ring_up / float(self.current[0]) if self.current[0] > 0.0 else math.inf

    @property
    def delay(self) -> float:
        """The same of a current that follows the voltage with its lag; 0 without one."""
        return max(self.start - float(self.lag[0]), 0.0) if self.current[0] > 0.0 else 0.0

    def lagging(self, seconds: float) -> "RectifiedCurrent":
        """The table of a current that follows all voltages after so much."""
        return replace(self, lag=np.full(len(self.voltages), seconds))

    def later(self, seconds: float) -> "RectifiedCurrent":
        """The table of a mass that rings up by so much more."""
        return replace(self, ring_up=self.ring_up + seconds * float(self.current[0]))


def reached(
    table: RectifiedCurrent, end: float, farads: float, ohm: float = math.inf
) -> tuple[Floats, Floats]:
    """The voltages up to ``end`` that a storage capacitor reaches, ascending, and when (s)."""
    volts = np.linspace(0.0, end, FINE)
    times = times_to(volts, table, farads, ohm)
    return volts[np.isfinite(times)], times[np.isfinite(times)]


def times_to(levels: Floats, table: RectifiedCurrent, farads: float, ohm: float) -> Floats:
    """When the storage reaches ascending levels (V), without diffusion.

    Infinite for those that it does not reach.
    """
    volts = np.linspace(0.0, float(levels[-1]), FINE)
    net = table.at(volts) - volts / ohm
    # 0: it is there at once
    held = np.maximum(farads + table.column_at("lag", volts) * table.slope(volts), 0.0)
    with np.errstate(divide="ignore"):
        rate = np.where(net > 0.0, net, np.nan) / held
    times = cumulative_trapezoid(1.0 / rate, volts, initial=0.0)
    return np.nan_to_num(
        np.interp(levels, volts, table.start + np.maximum.accumulate(times)), nan=math.inf
    )


def error_of_times(levels: Floats, table: RectifiedCurrent, farads: float, ohm: float) -> Floats:
    """The standard error that sampling of the currents, which are independent, gives to the times to ``levels``.

    It is infinite for a level that a current of one standard error less does not reach.
    """
    if table.stderr is None:
        return np.zeros(len(levels))
    base = times_to(levels, table, farads, ohm)
    total = np.zeros(len(levels))
    there = np.isfinite(base)
    for k, error in enumerate(table.stderr):
        changes = np.zeros((2, len(levels)))
        for row, shift in zip(changes, (error, -error), strict=True):
            current = table.current.copy()
            current[k] += shift
            changed = times_to(levels, replace(table, current=current), farads, ohm)
            row[there] = np.abs(changed[there] - base[there])
        total += changes.max(axis=0) ** 2
    return np.sqrt(total)


def random_paths(
    table: RectifiedCurrent,
    farads: float,
    ohm: float,
    top: float,
    end: float,
    count: int,
    seed: int,
    coarse: bool,
) -> tuple[Floats, Floats]:
    """Times (s) up to ``end``, shape (n,), and voltages (count, n) of storage, at one or (coarse) two steps at once."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 12]))
    steps = STEPS
    dt = end / STEPS
    volts = np.linspace(0.0, max(top, float(table.voltages[-1])), FINE)
    effective = farads + table.column_at("lag", volts) * table.slope(volts)
    drift = (table.at(volts) - volts / ohm) / effective
    # A clamp across the storage capacitor answers within less than a step: the drift is linear over
    # each step.
    answer = np.maximum(-np.gradient(drift, volts), 0.0)
    spread = np.sqrt(table.column_at("density", volts)) / farads
    v = np.zeros(count)
    paths = [np.zeros(count)]
    for k in range(0, steps, 2 if coarse else 1):
        kick = rng.standard_normal(count)
        length = dt
        if coarse:
            kick = kick + rng.standard_normal(count)
            length = 2.0 * dt
        begun = min(max((k * dt + length - table.start) / length, 0.0), 1.0)
        rate = np.interp(v, volts, answer) * length
        v = np.abs(
            v
            + begun * np.interp(v, volts, drift) * length * _mean_decay(rate)
            + begun * np.interp(v, volts, spread) * kick * np.sqrt(dt * _mean_decay(2.0 * rate))
        )
        paths.append(v)
    return np.linspace(0.0, end, len(paths)), np.array(paths).T


def _mean_decay(rate: Floats) -> Floats:
    """The mean of exp(-rate t) over t from 0 to 1."""
    safe = np.maximum(rate, TINY)
    return np.where(rate < TINY, 1.0, -np.expm1(-safe) / safe)
