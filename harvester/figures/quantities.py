"""Labels and ticks of axes: the quantity, its unit with a prefix or a power of ten, and numbers that people read."""

import math
import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axis import Axis
from matplotlib.ticker import EngFormatter, Formatter

from harvester.quantities.units import SYMBOLS
from harvester.scene.keys import unit_of

NONDIMENSIONAL = "nondimensional"
_PREFIXED = {
    "W",
    "V",
    "A",
    "ohm",
    "F",
    "H",
    "Hz",
    "s",
    "m",
    "m/s",
    "N/m",
    "N/V",
    "W/g^2",
    "V/g",
    "m/g",
}
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_WRITTEN = {"ohm": "Ω", "^2": "²", "^3": "³", "^5": "⁵"}
_NAMES = {
    "nondimensional.mu": "time-constant ratio μ = 1/(R Cp ω0)",
    "nondimensional.beta": "electromechanical coupling β",
    "nondimensional.alpha": "cubic stiffness α",
    "nondimensional.restitution": "restitution coefficient r",
    "stop.restitution": "restitution coefficient r",
    "piezo.coupling": "electromechanical coupling",
    "piezo.capacitance": "clamped capacitance",
    "excitation.acceleration_psd": "PSD of the base acceleration",
    "excitation.acceleration_amplitude": "amplitude of the base acceleration",
    "excitation.frequency": "excitation frequency",
    "nondimensional.drive_frequency": "excitation frequency Ω",
}


@dataclass(frozen=True)
class Scale:
    """The divisor of values before they are drawn, and the label of their axis."""

    factor: float
    label: str


def scale(name: str, unit: str, values: Any) -> Scale:
    """The scale of a linear axis: 3.1e-6 W is 3.1 on an axis "mean power (µW)"; "" is a number without a unit."""
    shown = np.abs(np.asarray(values, dtype=float))
    largest = float(shown[np.isfinite(shown)].max(initial=0.0))
    exponent = math.floor(math.log10(largest)) if largest > 0.0 else 0
    if unit in _PREFIXED:
        power = min(max(3 * (exponent // 3), -15), 9)
        return Scale(10.0**power, f"{name} ({SYMBOLS[power].replace('u', 'µ')}{written(unit)})")
    power = exponent if exponent < -2 or exponent > 4 else 0
    factor = [f"10{str(power).translate(_SUPERSCRIPT)}"] if power else []
    if unit:
        return Scale(10.0**power, f"{name} ({' '.join([*factor, written(unit)])})")
    return Scale(10.0**power, f"{name} ({', '.join([*factor, NONDIMENSIONAL])})")


def written(unit: str) -> str:
    """A unit with the signs of print, such as Ω and m²."""
    for plain, sign in _WRITTEN.items():
        unit = unit.replace(plain, sign)
    return unit


def quantity(key: str) -> tuple[str, str]:
    """The name and unit of a scene key, such as ("load resistance", "ohm"); "" for a number without a unit."""
    if key.startswith("load.parameters."):
        return f"parameter {key.split('.', 2)[2]} of the netlist", unit_of(key) or "SI"
    unit = unit_of(key)
    bare = key.removeprefix("nondimensional.").replace(".", " ").replace("_", " ")
    return _NAMES.get(key, bare), "" if unit == "1" else unit


def mark(axis: Axis, key: str, values: Any, logarithmic: bool) -> float:
    """Label an axis with a scene key's quantity, and return the divisor of the values."""
    name, unit = quantity(key)
    if logarithmic:
        axis.set_label_text(f"{name} ({written(unit) or NONDIMENSIONAL})")
        logarithm(axis, unit in _PREFIXED)
        return 1.0
    of_axis = scale(name, unit, values)
    axis.set_label_text(of_axis.label)
    return of_axis.factor


def logarithm(axis: Axis, prefixes: bool = False) -> None:
    """Make an axis logarithmic: ticks 1 k, 10 k, 1 M (``prefixes``), or 0.001, 0.1, 100, 10⁻⁵.

    Limits of the user's axes at 0 or below, which a logarithm lacks, are chosen anew.
    """
    if min(axis.get_view_interval()) <= 0.0:
        axis.set_inverted(inverted=False)
        axis.axes.autoscale(axis=axis.axis_name)  # type: ignore[attr-defined]
    getattr(axis.axes, f"set_{axis.axis_name}scale")("log")  # type: ignore[attr-defined]
    axis.set_major_formatter(_TickFormat(prefixes))
    axis.set_minor_formatter(_TickFormat(prefixes))


def plain(value: float) -> str:
    """A number as people write it: 0.001, 20, 23710, 10⁻⁵, 2·10⁶."""
    exponent = math.floor(math.log10(abs(value)) + 1e-9) if value else 0
    if -4 < exponent < 5:
        return f"{value:.4g}" if exponent < 4 else f"{value:.0f}"
    power = f"10{str(exponent).translate(_SUPERSCRIPT)}"
    digits = f"{value / 10.0**exponent:.3g}"
    return power if digits == "1" else f"{digits}·{power}"


def amount(value: float, unit: str) -> str:
    """A number with its unit in the one style of legends: 23.7 kΩ, 0.9, 10⁻⁵ (m/s²)²/Hz; "" is not a unit."""
    if unit not in _PREFIXED:
        return f"{plain(value)} {written(unit)}".rstrip()
    of = scale("", unit, [value])
    return f"{value / of.factor:.4g} {of.label[2:-1]}"


def values_in_words(values: Iterable[tuple[str, float]]) -> str:
    """Scene keys with their values as an entry of a legend: "restitution coefficient r 0.9, load resistance 1 MΩ"."""
    known = ((*quantity(key), value) for key, value in values)
    return ", ".join(
        f"{name.split(' = ')[0]} {amount(value, '' if unit == 'SI' else unit)}"
        for name, unit, value in known
    )


def broken(label: str, most: int) -> str:
    """A label of more than ``most`` letters over several lines, its unit on one of them."""
    name, _, unit = label.partition(" (")
    return (
        label
        if len(label) <= most
        else "\n".join([*textwrap.wrap(name, most), f"({unit}"] if unit else [label])
    )


class _TickFormat(Formatter):
    """Ticks of a logarithmic axis: at the decades, and also at 2 and 5 if it has at most two of them."""

    def __init__(self, prefixes: bool) -> None:
        self._engineering = EngFormatter(sep=" ") if prefixes else None

    def __call__(self, x: float, pos: int | None = None) -> str:
        if x <= 0.0 or self.axis is None:
            return ""
        low, high = sorted(self.axis.get_view_interval())
        decades = math.log10(high / low) if low > 0.0 else math.inf
        digit = round(x / 10.0 ** math.floor(math.log10(x) + 1e-9))
        if digit not in ((1,) if decades > 2.0 else (1, 2, 5) if decades > 0.6 else range(1, 10)):
            return ""
        return plain(x) if self._engineering is None else self._engineering(x).strip()
