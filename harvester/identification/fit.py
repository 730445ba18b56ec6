"""Least squares of all measurements at once, in the logarithms of positive quantities.

Outliers are left out.

A channel is one file's sizes, its phases, or its ring-down.  Each has noise of its own, which its
residuals determine: the fit is repeated with them as weights, first with a loss that outliers
hardly pull (soft L1), then without the outliers (`harvester.identification.misfit`), by plain least
squares (SciPy).
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError
from harvester.identification import bounce
from harvester.identification.measurement import (
    BaseResponse,
    Decay,
    Impedance,
    Measurement,
    StatedNumber,
)
from harvester.identification.misfit import without_outliers
from harvester.identification.models import Device, base_response, decay, impedance

# how far, in its logarithm, a parameter that nothing determines may wander: a ridge holds it there
WEAK = 30.0
# parameters that may be 0 or below; all others are in logs
LINEAR = ("loss", "restitution", "gap", "x0", "v0", "zero")
RANGES = {"restitution": (0.0, 1.0)}
Limits: TypeAlias = Mapping[str, tuple[float, float]]
DEVICE = tuple(field.name for field in dataclasses.fields(Device))


@dataclass(frozen=True)
class Channel:
    """Residuals of one quantity: ``values`` of the measurement, and of the model from the parameters by name.

    ``given_noise`` is the standard deviation of a single number, whose residual does not determine
    it.
    """

    source: Measurement | StatedNumber
    name: str
    x: Floats
    values: Floats
    model: Callable[[dict[str, float], Floats], Floats]
    turns: bool = False  # an angle, whose residual is within half a turn
    signless: bool = False  # an angle of a sensor with unknown sign
    given_noise: float | None = None

    def residuals(self, values: dict[str, float], kept: Floats) -> Floats:
        """Measurement minus model at all points, shape (n,).

        ``kept`` is 0 if a point is left out.
        """
        off = self.values - self.model(values, kept)
        if self.signless and abs(np.mean(np.exp(1j * off)[kept > 0.0]).real) > 0.0:
            off = off - (math.pi if np.mean(np.cos(off[kept > 0.0])) < 0.0 else 0.0)
        return np.asarray((off + math.pi) % (2.0 * math.pi) - math.pi if self.turns else off)


@dataclass(frozen=True)
class DeviceFit:
    """The best parameters: ``p`` of ``names``, shape (m,), with the weighted residuals' Jacobian, shape (n, m).

    ``kept`` has a 0 for each point of a channel that is an outlier; ``noise`` is each channel's.
    """

    names: tuple[str, ...]
    p: Floats
    fixed: dict[str, float]
    channels: tuple[Channel, ...]
    kept: tuple[Floats, ...]
    noise: tuple[float, ...]
    jacobian: Floats
    residual: Floats

    def values(self, p: Floats | None = None) -> dict[str, float]:
        """The parameters by name."""
        return by_name(self.names, self.p if p is None else p, self.fixed)

    def weighted(self, p: Floats) -> Floats:
        """Weighted residuals of all points that are kept, shape (n,)."""
        return _weighted(by_name(self.names, p, self.fixed), self.channels, self.kept, self.noise)

    @property
    def left_out(self) -> int:
        """How many points are outliers."""
        return int(sum((k == 0.0).sum() for k in self.kept))

    @property
    def dof(self) -> float:
        """Points whose noise is estimated minus parameters; infinite if there are none."""
        pairs = zip(self.channels, self.kept, strict=True)
        estimated = sum(int((k > 0.0).sum()) for c, k in pairs if c.given_noise is None)
        return max(estimated - len(self.p), 1) if estimated else math.inf


def by_name(names: Sequence[str], p: Floats, fixed: dict[str, float]) -> dict[str, float]:
    """The parameters by name, out of their logarithms."""
    values = dict(fixed)
    for name, value in zip(names, p, strict=True):
        values[name] = (
            float(value) if name in LINEAR else math.exp(min(max(float(value), -300.0), 300.0))
        )
    return values


def logs(names: Sequence[str], values: dict[str, float]) -> Floats:
    """The numbers that are fitted, from the parameters by name."""
    return np.array([values[name] if name in LINEAR else math.log(values[name]) for name in names])


def bounds(names: Sequence[str], limits: Limits) -> tuple[Floats, Floats]:
    """The lower and the upper ends of the numbers that are fitted, from the ``limits`` of parameters by name."""
    free = -np.inf, np.inf
    ends = {
        name: (low, high) if name in LINEAR else (math.log(low), math.log(high))
        for name, (low, high) in limits.items()
    }
    lower, upper = np.array([ends.get(name, free) for name in names]).T
    return lower, upper


def device(values: dict[str, float]) -> Device:
    """The device of parameters by name; a known mass gives psi = theta/C."""
    bare = Device(**{name: values[name] for name in DEVICE if name in values})
    if "mass" in values and "psi" not in values:
        psi = math.sqrt(values["mass"] * bare.beta * bare.w0**2 / bare.capacitance)
        bare = dataclasses.replace(bare, psi=psi)
    return bare


def channels(measurements: Sequence[Measurement], bouncing: bool) -> tuple[Channel, ...]:
    """The channels of measurements; ``bouncing``: the ring-down of a displacement meets a stop."""
    result: list[Channel] = []
    for data in measurements:
        if isinstance(data, Decay):
            met = bouncing and data.of == "displacement"
            result.append(
                Channel(data, "ring-down", data.t, data.y, partial(_path if met else _decay, data))
            )
            continue
        of_sensor = isinstance(data, BaseResponse)  # whose sign is not known
        size, phase = (
            (data.size, data.phase)
            if isinstance(data, BaseResponse)
            else (np.abs(data.z), np.angle(data.z) if data.phase_known else None)
        )
        result.append(Channel(data, "size", data.f, np.log(size), partial(_log_size, data)))
        if phase is not None:
            result.append(
                Channel(
                    source=data,
                    name="phase",
                    x=data.f,
                    values=phase,
                    model=partial(_phase, data),
                    turns=True,
                    signless=of_sensor,
                )
            )
    return tuple(result)


def _curve(data: Impedance | BaseResponse, values: dict[str, float]) -> Complexes:
    """The model's impedance or response at the frequencies of a measurement."""
    if isinstance(data, Impedance):
        return impedance(device(values), data.f, data.clamped)
    return base_response(device(values), data.f, data.load, data.of)


def _log_size(data: Impedance | BaseResponse, values: dict[str, float], _: Floats) -> Floats:
    return np.log(np.abs(_curve(data, values)))


def _phase(data: Impedance | BaseResponse, values: dict[str, float], _: Floats) -> Floats:
    return np.angle(_curve(data, values))


def _path(data: Decay, values: dict[str, float], _: Floats) -> Floats:
    names = (field.name for field in dataclasses.fields(bounce.Bounce))
    return bounce.path(bounce.Bounce(**{name: values[name] for name in names}), data.t)


def _decay(data: Decay, values: dict[str, float], kept: Floats) -> Floats:
    return decay(device(values), data.t, data.y, data.load, kept)


def _weighted(
    values: dict[str, float],
    several: Sequence[Channel],
    kept: Sequence[Floats],
    noise: Sequence[float],
) -> Floats:
    parts = [
        (c.residuals(values, k) / s)[k > 0.0] for c, k, s in zip(several, kept, noise, strict=True)
    ]
    return np.nan_to_num(np.concatenate(parts), nan=1e9, posinf=1e9, neginf=-1e9)


def fit(
    names: tuple[str, ...],
    starts: Sequence[dict[str, float]],
    fixed: dict[str, float],
    several: tuple[Channel, ...],
    few: tuple[Channel, ...],
    limits: Limits = MappingProxyType({}),
) -> DeviceFit:
    """The best fit from several starts; each channel's noise and outliers come out of it.

    ``few`` are the channels of thinned measurements, by which the starts are judged; parameters
    with ``limits`` stay between them.

    Raises InputError if there are fewer points than the parameters need.
    """
    from scipy.optimize import least_squares

    points = sum(len(c.x) for c in several if c.given_noise is None)
    if points < 2 * len(names) and points:
        raise InputError(
            f"FILE must have at least {2 * len(names)} points for {len(names)} parameters, but has {points}"
        )
    kept: list[Floats] = [np.ones(len(c.x)) for c in several]
    noise = [_first_noise(c) for c in several]
    best = _best_start(names, starts, fixed, few, noise, bounds(names, limits))
    origin = best.copy()

    def residuals(p: Floats) -> Floats:
        ridge = (p - origin) / (
            WEAK * np.where([n in LINEAR for n in names], 1e3 * (1.0 + np.abs(origin)), 1.0)
        )
        return np.append(_weighted(by_name(names, p, fixed), several, kept, noise), ridge)

    lower, upper = bounds(names, {**RANGES, **limits})
    best = np.clip(best, lower + 1e-9, upper - 1e-9)
    for loss in ("soft_l1", "soft_l1", "soft_l1", "linear", "linear"):
        close = 1e-6 if loss == "soft_l1" else 1e-12
        solution = least_squares(
            residuals,
            best,
            loss=loss,
            x_scale="jac",
            bounds=(lower, upper),
            xtol=close,
            ftol=close,
            max_nfev=100,
        )
        best = solution.x
        values = by_name(names, best, fixed)
        share = math.sqrt(points / max(points - len(names), 1))
        for n, channel in enumerate(several):
            if channel.given_noise is not None:
                continue
            off = channel.residuals(values, kept[n])
            off = np.nan_to_num(off, nan=1e9)
            inner = off[kept[n] > 0.0]
            floor = 1e-9 * (np.ptp(channel.values) + 1e-12)
            if loss == "soft_l1":
                noise[n] = max(_spread(inner), floor)
                kept[n] = without_outliers(off, noise[n], channel.x)
                if kept[n].sum() < 0.7 * len(off):  # the model does not fit: these are no outliers
                    kept[n] = np.ones(len(off))
            else:
                noise[n] = max(float(np.sqrt(np.mean(inner**2))) * share, floor)
    jacobian = solution.jac[: -len(names)]
    return DeviceFit(
        names=names,
        p=best,
        fixed=fixed,
        channels=several,
        kept=tuple(kept),
        noise=tuple(noise),
        jacobian=jacobian,
        residual=solution.fun[: -len(names)],
    )


def _first_noise(channel: Channel) -> float:
    """The noise of a channel to begin with."""
    if channel.given_noise is not None:
        return channel.given_noise
    if channel.name == "ring-down":
        return max(0.1 * float(np.std(channel.values)), 1e-30)
    return 0.1


def _best_start(
    names: tuple[str, ...],
    starts: Sequence[dict[str, float]],
    fixed: dict[str, float],
    several: tuple[Channel, ...],
    noise: Sequence[float],
    ends: tuple[Floats, Floats],
) -> Floats:
    """The end of the best of a few short fits from the best starts, between ``ends``."""
    from scipy.optimize import least_squares

    kept = [np.ones(len(c.x)) for c in several]

    def cost(values: dict[str, float]) -> float:
        return float(np.sum(np.log1p(_weighted({**values, **fixed}, several, kept, noise) ** 2)))

    lower, upper = ends
    minima = []
    for begin in sorted(starts, key=cost)[:4]:
        p = np.clip(logs(names, begin), lower + 1e-9, upper - 1e-9)
        try:
            end = least_squares(
                lambda p: _weighted(by_name(names, p, fixed), several, kept, noise), p, loss="soft_l1", max_nfev=25,
                x_scale="jac", bounds=ends,
            )  # fmt: skip
        except ValueError:
            continue
        minima.append((float(end.cost), end.x))
    if not minima:
        raise InputError(
            "FILE must hold a resonance or a ring-down, but no fit of its numbers could begin"
        )
    return np.asarray(min(minima, key=lambda e: e[0])[1])


def _spread(values: Floats) -> float:
    """The standard deviation of all but the outliers, from the median of the sizes."""
    return float(1.4826 * np.median(np.abs(values)))
