"""Numbers with units: "50.2 nF" is 5.02e-8 F, "0.01 g^2/Hz" an acceleration density; and the SI prefixes.

pint knows the units; it loads (0.3 s) only when a text carries one that is not among the usual
ones.
"""

import math
import re
from functools import cache, lru_cache
from typing import Any

# The SI prefixes of the whole package, with their powers of ten.
PREFIXES = {"f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9, "T": 12}
SYMBOLS = {power: prefix for prefix, power in PREFIXES.items()}
# size of a number other than zero: no product of a few of them over- or underflows
SMALLEST, LARGEST = 1e-50, 1e50

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*)", re.DOTALL)
# Letters, products, quotients and one-digit powers of them; a tower of powers would take pint for
# ever.
_UNIT = re.compile(r"(?:[A-Za-z_µμΩ·*/()\s]|\^-?[0-9](?!\s*\^))+")
_POWERS = {
    "**": "^",
    "²": "^2",
    "³": "^3",
    "µ": "u",
    "μ": "u",
    "Ω": "ohm",
    "\u2126": "ohm",
    "√": "rt",
}
# 4k7: the prefix represents the decimal point
_INFIX = re.compile(r"(\d+)([pnukKMGR])(\d+)\s*(.*)", re.DOTALL)
# Units that are often written with other capitals: "50 nf", "3.2hz", "kOhm".  Not s, m, g, N: S is
# siemens, G giga.
_WORDS = {
    "ohm": "ohm",
    "ohms": "ohm",
    "hz": "Hz",
    "hertz": "Hz",
    "f": "F",
    "farad": "F",
    "v": "V",
    "volt": "V",
}
_WORD = re.compile(
    r"([Mm]eg|MEG|[fpnumkKMGT]?)\s?(" + "|".join(sorted(_WORDS, key=len)[::-1]) + ")", re.IGNORECASE
)
_BARE_POWER = re.compile(r"(?<=[A-Za-z)])(-?[2-4])(?![0-9A-Za-z])")  # g2/Hz, m/s2
_ROOT = re.compile(
    r"(.+)/\s*(?:rt\(?Hz\)?|rHz|sqrt\(?Hz\)?|Hz\^0?\.5|Hz\^\(?1/2\)?)", re.IGNORECASE
)
_LONGEST = 40  # letters of a unit
# Radians in the units of frequencies and densities: a turn of 2 pi of them is one cycle, which Hz
# counts.
_ANGULAR = {"Hz": 1.0, "(m/s^2)^2/Hz": -1.0}
# Usual units in the SI unit that a kind is in: what nearly every scene file has.
USUAL_UNITS: dict[tuple[str, str | None], float] = {
    (prefix + unit, unit): 10.0**power
    for unit in ("ohm", "F", "Hz", "m", "s", "N/m", "N/V")
    for prefix, power in PREFIXES.items()
}
USUAL_UNITS |= {  # in SI base units: what the parameters of nearly every netlist have
    (prefix + unit, None): 10.0**power
    for unit in ("ohm", "F", "H", "V", "A", "Hz")
    for prefix, power in PREFIXES.items()
}
USUAL_UNITS |= {("kg", "kg"): 1.0, ("g", "kg"): 1e-3, ("mg", "kg"): 1e-6, ("N s/m", "N s/m"): 1.0}
USUAL_UNITS |= {
    ("m/s^2", "m/s^2"): 1.0,
    ("gravity", "m/s^2"): 9.80665,
    ("gravity^2/Hz", "(m/s^2)^2/Hz"): 9.80665**2,
}


def split_unit(text: object) -> tuple[float, str] | None:
    """The number and the unit ("" for none) of a text.

    None for anything else than a text that begins with a number.

    "4k7" is 4.7 and "k", "4R7" is 4.7 and "ohm", as resistors are marked.
    """
    short = isinstance(text, str) and len(text) <= 2 * _LONGEST
    infix = _INFIX.fullmatch(str(text).strip().replace("µ", "u")) if short else None
    if infix is not None:
        whole, prefix, part, unit = infix.groups()
        return float(f"{whole}.{part}"), "ohm" if (prefix, unit) == ("R", "") else prefix.replace(
            "R", ""
        ) + unit
    match = _NUMBER.fullmatch(text.strip()) if isinstance(text, str) else None
    return None if match is None else (float(match[1]), match[2])


def prefix_factor(prefix: str) -> float | None:
    """The factor of an SI prefix without a unit, as in "10k" and in ngspice's "10Meg".

    None for any other text.
    """
    written = {"meg": "M", "Meg": "M", "MEG": "M", "K": "k", "µ": "u", "μ": "u"}
    power = PREFIXES.get(written.get(prefix, prefix)) if prefix else None
    return None if power is None else 10.0**power


@lru_cache(1000)
def unit_factor(text: str, unit: str | None) -> float | None:
    """How many ``unit`` (None: SI base units) one ``text`` is, or None if it is not such a unit."""
    factor = USUAL_UNITS.get((text, unit))
    if factor is None and len(text) <= _LONGEST:
        text = respelled(text)
        factor = USUAL_UNITS.get((text, unit))
    return factor_by_pint(text, unit) if factor is None else factor


def respelled(unit: str) -> str:
    """A unit as pint and this package write it: "kOhm" is kohm, "50 nf" nF, "1Meg" M, "g2/Hz" g^2/Hz, "m/s2" m/s^2."""
    for written, power in _POWERS.items():
        unit = unit.replace(written, power)
    unit = unit.strip()
    word = _WORD.fullmatch(unit)
    if word is not None:
        prefix = "M" if word[1].lower() == "meg" else word[1].replace("K", "k")
        return prefix + _WORDS[word[2].lower()]
    return _BARE_POWER.sub(r"^\1", unit)


def squared(unit: str) -> str | None:
    """The unit of a density for one of its root, "mg/rtHz" -> "(mg)^2/Hz"; None for any other."""
    for written, power in _POWERS.items():
        unit = unit.replace(written, power)
    root = _ROOT.fullmatch(unit.strip()) if len(unit) <= _LONGEST else None
    return None if root is None else f"({root[1].strip().removeprefix('(').removesuffix(')')})^2/Hz"


def is_unit(text: str) -> bool:
    """Whether a text is a unit of anything."""
    return unit_factor(text, None) is not None


class Seconds(float):
    """A time that was given with its unit, so that it cannot be a multiple of 1/w0."""


def time(value: str) -> float:
    """A time above 0, "1ms", "2 s", or a bare number in the scene's unit.

    ValueError (``must ...``) for another.
    """
    must = "must be a time above 0, such as 1ms or 0.001"
    parts = split_unit(value)
    if parts is None:
        raise ValueError(must)
    number, unit = parts
    factor = 1.0 if unit == "" else unit_factor(unit, "s")
    if factor is None:
        raise Unread(must, f"the unit {unit[:_LONGEST]!r} is not a unit of time" if unit else "")
    if not (math.isfinite(number * factor) and number > 0.0):
        raise ValueError(must)
    return number if unit == "" else Seconds(number * factor)


class Unread(ValueError):  # noqa: N818, as it says what could not be read
    """A value that could not be read: ``must ...`` is its text, and ``why`` the part that was not understood."""

    def __init__(self, must: str, why: str = "") -> None:
        super().__init__(must)
        self.why = why


def factor_by_pint(text: str, unit: str | None) -> float | None:
    """The factor of `unit_factor` from pint's tables, which also know the usual units; rad/s and rpm become cycles."""
    for written, power in _POWERS.items():
        text = text.replace(written, power)
    if len(text) > _LONGEST or not _UNIT.fullmatch(text):
        return None
    registry = _registry()
    try:
        quantity = registry.Quantity(1.0, registry.parse_units(text))
        if unit is None:
            return float(quantity.to_base_units().magnitude)
        turns = _radians(quantity) - _radians(registry.Quantity(1.0, unit))
        if turns not in (0.0, _ANGULAR.get(unit)):
            return None
        return float(quantity.to(unit).magnitude / (2.0 * math.pi) ** turns)
    except Exception:  # of pint, tokenize, eval, ...: text that is not a unit has no common error
        return None


def _radians(quantity: Any) -> float:
    """The power of radians in the unit of a quantity, which pint treats as pure numbers."""
    return float(dict(quantity.to_base_units().unit_items()).get("radian", 0.0))


@cache
def _registry() -> Any:
    import pint

    try:
        return pint.UnitRegistry()
    except TypeError as error:  # pint's error if memory ends while it reads its units
        raise MemoryError from error


def fraction(value: str) -> float:
    """A fraction from a text such as "1%" or "0.01".

    ValueError (``must ...``) for anything outside 0 to 1.
    """
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)(e-?\d{1,2})?\s*(%?)\s*", value)
    number = float(match[1] + (match[2] or "")) * (0.01 if match[3] else 1.0) if match else 0.0
    if not 0.0 < number < 1.0:
        raise ValueError("must be a percentage between 0 % and 100 %, such as 1%")
    return number


def seconds(value: str) -> float:
    """A time in seconds from a text such as "30s", "2min", "1h" or "30".

    ValueError (``must ...``) for another.
    """
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(s|min|h)?\s*", value)
    if match is None or float(match[1]) == 0.0:
        raise ValueError("must be a time above 0, such as 30s or 2min")
    return float(match[1]) * {"s": 1.0, "min": 60.0, "h": 3600.0}[match[2] or "s"]
