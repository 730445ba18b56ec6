"""Single points of a datasheet: a voltage without load, or a power at a load, at an acceleration of the base.

    theta/Cp a / |w_oc^2 - w^2 + i c w| = V      at its largest, near w_oc, with c = w_sc/Q
    |V|^2/(2 R) = P                              at the frequency of the most power

Each point replaces one quantity that a datasheet leaves out: the coupling theta first, then the
damping, then the mass.  Both are of the linear device at its own best frequency, as makers measure
them; voltages and accelerations are peaks unless they are written with "rms" or "pp".
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import ACCELERATION, RESISTANCE, VOLTAGE, Kind, with_prefix

POWER = Kind("a power (W)", "W", "'1 mW'", above=0.0)
OPEN, LOADED = "open_circuit_voltage", "power_at_load"
POINTS = (OPEN, LOADED)
UNITS = {"coupling": "N/V", "q": "1", "mass": "kg"}  # of what they replace
_FORMS = {
    OPEN: ("VOLTAGE at ACCELERATION, such as '21 V at 0.25 g'", re.compile(r"(.+?)\s+at\s+(.+)")),
    LOADED: (
        "POWER at RESISTANCE and ACCELERATION, such as '1.2 mW at 15 kohm and 0.25 g'",
        re.compile(r"(.+?)\s+at\s+(.+?)(?:\s+and\s+|\s*,\s*|\s+at\s+)(.+)"),
    ),
}
_PEAK = {"rms": math.sqrt(2.0), "pp": 0.5, "p-p": 0.5, "peak": 1.0, "pk": 1.0}
_WRITTEN = re.compile(r"(.*?)[\s_]*(rms|p-p|pp|peak|pk)?", re.IGNORECASE)
# the ranges in which what is left out is sought
QS = 2.0, 1e5
MASSES = 1e-9, 1e4
COUPLED = 1e-8, 10.0  # theta^2/(K Cp)
_SOUGHT = {"coupling": (COUPLED, "theta^2/(K Cp)"), "q": (QS, "Q"), "mass": (MASSES, "in kg")}
SOUGHT, FEW = 400, 60
# of the base, at each of so many zooms on the largest; the lowest over that of the resonance
FREQUENCIES, ZOOMS = 241, 5
LOWEST = 0.05


@dataclass(frozen=True)
class LinearDevice:
    """A linear device in SI units; its frequency is the short-circuit resonance in rad/s."""

    mass: float
    frequency: float
    q: float
    capacitance: float
    coupling: float

    @property
    def beta(self) -> float:
        """The coupling theta^2/(K Cp)."""
        return self.coupling**2 / (self.mass * self.frequency**2 * self.capacitance)

    def open_voltage(self, acceleration: float) -> float:
        """The largest voltage (V, peak) without load for a base acceleration (m/s^2, peak)."""
        c = 1.0 / self.q
        # of 1/|1 + beta - w^2 + i c w|, whose largest is at w^2 = 1 + beta - c^2/2
        highest = 1.0 / (c * math.sqrt(max(1.0 + self.beta - 0.25 * c * c, 1e-9)))
        return self.coupling / self.capacitance * acceleration * highest / self.frequency**2

    def power(self, resistance: float, acceleration: float) -> float:
        """The most mean power (W) into a resistance (ohm), over the frequency of the base."""
        beta = self.beta
        c = 1.0 / self.q
        mu = 1.0 / (resistance * self.capacitance * self.frequency)

        low = 1.0 - 3.0 * c
        high = math.sqrt(1.0 + beta) + 3.0 * c
        for _ in range(ZOOMS):
            w = np.linspace(max(low, LOWEST), high, FREQUENCIES)
            s = 1j * w
            sizes = np.abs(s / ((s + mu) * (1.0 - w * w + c * s) + beta * s)) ** 2
            at = w[int(np.argmax(sizes))]
            step = w[1] - w[0]
            low = at - 3.0 * step
            high = at + 3.0 * step
        volts = self.coupling / self.capacitance * acceleration / self.frequency**2
        return float(volts**2 * sizes.max() / (2.0 * resistance))


@dataclass(frozen=True)
class DataSheetPoint:
    """A point as it was ``written``, in SI units; accelerations are peaks."""

    name: str
    written: str
    value: float
    acceleration: float
    resistance: float = math.inf

    def of(self, device: LinearDevice) -> float:
        """The value of a device at this point."""
        if self.name == OPEN:
            return device.open_voltage(self.acceleration)
        return device.power(self.resistance, self.acceleration)


def read_point(name: str, text: str) -> DataSheetPoint:
    """A point from its text; InputError for another form."""
    form, pattern = _FORMS[name]
    match = pattern.fullmatch(text.strip()) if isinstance(text, str) else None
    if match is None:
        raise invalid(f"`{name}`", f"be {form}", text)
    if name == OPEN:
        volts, base = (
            _peak(name, part, kind)
            for part, kind in zip(match.groups(), (VOLTAGE, ACCELERATION), strict=True)
        )
        point = DataSheetPoint(name, text.strip(), volts, base)
    else:
        watts, ohms = (
            _quantity(name, part, kind)
            for part, kind in zip(match.groups()[:2], (POWER, RESISTANCE), strict=True)
        )
        point = DataSheetPoint(name, text.strip(), watts, _peak(name, match[3], ACCELERATION), ohms)
    if not (point.value > 0.0 and point.acceleration > 0.0):
        raise invalid(f"`{name}`", f"be {form}, both above 0", text)
    return point


def _peak(name: str, text: str, kind: Kind) -> float:
    """A peak value, of a text that may state an RMS value or one from peak to peak."""
    match = _WRITTEN.fullmatch(text.strip())
    assert match is not None, "any text has this form"
    return _quantity(name, match[1], kind) * _PEAK[(match[2] or "peak").lower()]


def _quantity(name: str, text: str, kind: Kind) -> float:
    try:
        return with_prefix(text.strip(), kind)
    except ValueError as error:
        raise InputError(f"`{name}` {error}, but is {text[:80]!r}") from None


@dataclass(frozen=True)
class PointValues:
    """Values by the fields of a datasheet, and whether others give the same point."""

    values: dict[str, float]
    ambiguous: bool


def left_out(known: Mapping[str, float]) -> list[str]:
    """The quantities that points are to replace, given the known fields of `solve`."""
    given = {*known, "coupling"} if "beta" in known else known
    return [name for name in ("coupling", "q", "mass") if name not in given]


def solve(known: Mapping[str, float], points: Mapping[str, str]) -> PointValues:
    """The fields that the points replace: ``coupling``, then ``q``, then ``mass``.

    Parameters
    ----------
    known
        Fields in SI units: frequency (Hz) in short circuit, capacitance, and of mass, q and
        coupling those that are known; ``beta``, theta^2/(K Cp), replaces a coupling.
    points
        The texts of `POINTS` by their names.

    Raises
    ------
    InputError
        A text has another form, the points are too few or too many, the frequency or the
        capacitance is missing, or no device has such a point.
    """
    read = [read_point(name, points[name]) for name in POINTS if name in points]
    for name in ("frequency", "capacitance"):
        if name not in known:
            raise InputError(f"`{name}` must be given with `{read[0].name}`, but is left out")
    sought = left_out(known)
    if len(sought) != len(read):
        raise InputError(_count(read, sought))

    def device(values: Mapping[str, float]) -> LinearDevice:
        every = {**known, **values}
        w0 = 2.0 * math.pi * every["frequency"]
        capacitance = every["capacitance"]
        if "beta" in every:
            every["coupling"] = math.sqrt(every["beta"] * every["mass"] * w0**2 * capacitance)
        return LinearDevice(every["mass"], w0, every["q"], capacitance, every["coupling"])

    if len(read) == 1:
        (point,), (name,) = read, sought
        roots = _roots(lambda x: point.of(device({name: x})) / point.value, _range(name, known))
        if not roots:
            raise InputError(_impossible(point, name))
        return PointValues({name: roots[0]}, len(roots) > 1)
    first, second = read
    inner, other = sought

    def given(value: float) -> tuple[float, dict[str, float]]:
        """The second point over its value, for a value of the other unknown."""
        some = {**known, other: value}
        fits = _roots(
            lambda x: first.of(device({other: value, inner: x})) / first.value, _range(inner, some)
        )
        if not fits:
            return math.nan, {}
        values = {other: value, inner: fits[0]}
        return second.of(device(values)) / second.value, values

    roots = _roots(lambda x: given(x)[0], _range(other, known), FEW)
    if not roots:
        raise InputError(_impossible(second, other))
    return PointValues(given(roots[0])[1], len(roots) > 1)


def _range(name: str, known: Mapping[str, float]) -> tuple[float, float]:
    """The range in which an unknown is sought."""
    if name != "coupling":
        return QS if name == "q" else MASSES
    stiffness = known["mass"] * (2.0 * math.pi * known["frequency"]) ** 2
    low, high = (math.sqrt(beta * stiffness * known["capacitance"]) for beta in COUPLED)
    return low, high


def _roots(
    ratio: Callable[[float], float], ends: tuple[float, float], count: int = SOUGHT
) -> list[float]:
    """The arguments between positive ends at which a ratio is 1, the smallest first."""
    from scipy.optimize import brentq

    def off(log: float) -> float:
        value = ratio(math.exp(log))
        return math.log(value) if value > 0.0 else math.nan

    logs = np.linspace(math.log(ends[0]), math.log(ends[1]), count)
    offs = np.array([off(float(log)) for log in logs])
    crossed = np.flatnonzero(offs[:-1] * offs[1:] <= 0.0)
    return [math.exp(float(brentq(off, logs[k], logs[k + 1], xtol=1e-12))) for k in crossed]


def _count(read: "list[DataSheetPoint]", sought: "list[str]") -> str:
    """The line on points that are too few or too many."""
    given = " and ".join(f"`{point.name}`" for point in read)
    names = " and ".join(f"`{name}`" for name in sought) or "none"
    remedy = "give one more, or another point" if len(sought) > len(read) else "leave one out"
    return (
        f"{given} must replace as many values as there are points, {len(read)}, but left out are "
        f"{names}: {remedy} (coupling, q and mass can be replaced)"
    )


def _impossible(point: DataSheetPoint, name: str) -> str:
    """The line on a point that no device has."""
    sought, quantity = _SOUGHT[name]
    low, high = sought
    return (
        f"`{point.name}` must be possible for a device with these values, but no `{name}` "
        f"({quantity} from {low:g} to {high:g}) gives {point.written!r}: "
        "check peak or RMS, the acceleration and the capacitance"
    )
