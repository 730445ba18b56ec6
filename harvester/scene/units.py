"""Numbers with units: "50.2 nF" for a capacitance, "0.01 g^2/Hz" for an acceleration density.

pint knows the units; it loads (.3 s) only when a string carries one that is not among the usual.
"""

import math
import re
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*)", re.DOTALL)
# Letters, products, quotients and one-digit powers of them; a tower of powers would take pint for ever.
_UNIT = re.compile(r"(?:[A-Za-z_µμΩ·*/()\s]|\^-?[0-9](?!\s*\^))+")
_POWERS = {"**": "^", "²": "^2", "³": "^3"}
_LONGEST = 40  # letters of a unit
SMALLEST, LARGEST = 1e-50, 1e50  # size of a number other than zero: no product of a few of them over- or underflows
_PREFIX = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3}
_PREFIX |= {"k": 1e3, "M": 1e6, "Meg": 1e6, "G": 1e9, "T": 1e12}
# Usual units in the SI unit that a kind is in: what nearly every scene file has.
_PREFIXES = {"": 1.0} | {name: power for name, power in _PREFIX.items() if name != "Meg"}
_USUAL = {
    (prefix + unit, unit): power
    for unit in ("ohm", "F", "Hz", "m", "s", "N/m", "N/V")
    for prefix, power in _PREFIXES.items()
}
_USUAL |= {("kg", "kg"): 1.0, ("g", "kg"): 1e-3, ("mg", "kg"): 1e-6, ("N s/m", "N s/m"): 1.0, ("m/s^2", "m/s^2"): 1.0}
_USUAL |= {("gravity", "m/s^2"): 9.80665, ("gravity^2/Hz", "(m/s^2)^2/Hz"): 9.80665**2}


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


@lru_cache(1000)
def _factor(text: str, unit: str | None) -> float | None:
    """How many ``unit`` (None: SI base units) one ``text`` is, or None where it is no such unit."""
    usual = _USUAL.get((text, unit or ""))
    if usual is not None:
        return usual
    return _by_pint(text, unit)


def _by_pint(text: str, unit: str | None) -> float | None:
    for written, power in _POWERS.items():
        text = text.replace(written, power)
    if len(text) > _LONGEST or not _UNIT.fullmatch(text):
        return None
    registry = _registry()
    try:
        one = registry.Quantity(1.0, registry.parse_units(text))
        return float((one.to_base_units() if unit is None else one.to(unit)).magnitude)
    except Exception:  # of pint, tokenize, eval, ...: text that is no unit has no common error
        return None


@dataclass(frozen=True)
class Kind:
    """A physical quantity: its name, the SI unit that a bare number is in, an example, its range."""

    name: str
    unit: str
    example: str
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    gravity: bool = False  # in an acceleration "g" is standard gravity, not gram

    @property
    def must(self) -> str:
        """What a value must be, as an error says it."""
        text = f"be {self.name}, such as {self.example}"
        if self.least > -math.inf and self.most < math.inf:
            return f"{text}, between {self.least:g} and {self.most:g}"
        if self.least > -math.inf:
            return f"{text}, at least {self.least:g}"
        return text if self.above == -math.inf else f"{text}, above {self.above:g}"

    def read(self, value: object) -> float:
        """The value in SI units, from a number or from a string with a unit.

        Raises
        ------
        ValueError
            with the text ``must ...`` when it is no number, has another dimension, is not
            finite or lies outside the range, or is of a size that no device has.
        """
        number = self._number(value)
        if number is None or not math.isfinite(number):
            raise ValueError(f"must {self.must}")
        if not (number > self.above and self.least <= number <= self.most):
            raise ValueError(f"must {self.must}")
        if number and not SMALLEST <= abs(number) <= LARGEST:
            raise ValueError(f"must {self.must}, between {SMALLEST:g} and {LARGEST:g} in size")
        return number

    def _number(self, value: object) -> float | None:
        if isinstance(value, bool):
            return None
        if isinstance(value, int | float):
            try:
                return float(value)
            except OverflowError:
                return None
        match = _NUMBER.fullmatch(value.strip()) if isinstance(value, str) else None
        if match is None:
            return None
        number, unit = float(match[1]), match[2]
        if self.unit == "":
            return number if unit == "" else None
        if unit == "":
            return None  # a string carries its unit
        if self.gravity:
            unit = re.sub(r"\bg(?=\b|[²³])", "gravity", unit)
        factor = _factor(unit, self.unit)
        return None if factor is None else number * factor


def with_prefix(text: str, kind: Kind) -> float:
    """A number as the command line writes it: "1k", "10M", "1 Mohm", "3e4".

    Raises ValueError as `Kind.read` does.
    """
    match = _NUMBER.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"must {kind.must}")
    if match[2] == "":
        return kind.read(float(match[1]))
    if match[2] in _PREFIX and match[2] != kind.unit:  # a gap of 1m is a metre
        return kind.read(float(match[1]) * _PREFIX[match[2]])
    return kind.read(text)


def any_quantity(value: object) -> float:
    """A number of any dimension in SI base units (a netlist's parameter): 1e6, "1 Mohm", "10 uF".

    Raises ValueError as `Kind.read` does.
    """
    plain = Kind("a number or a quantity with a unit", "", "'10 uF'")
    match = _NUMBER.fullmatch(value.strip()) if isinstance(value, str) else None
    if match is None or match[2] == "":
        return plain.read(value)
    factor = _PREFIX.get(match[2]) or _factor(match[2], None)
    if factor is None:
        raise ValueError(f"must {plain.must}")
    return plain.read(float(match[1]) * factor)


def ends(low: float | str, high: float | str) -> tuple[float, float, str | None]:
    """Two ends in the unit of the first, and that unit; None where both are numbers.

    Raises
    ------
    ValueError
        with the text ``must ...`` where they are no quantities of one kind.
    """
    if not isinstance(low, str) and not isinstance(high, str):
        return float(low), float(high), None
    must = "must be two numbers or two quantities of one kind, such as '1 kohm' and '10 Mohm'"
    first, last = (_NUMBER.fullmatch(end.strip()) if isinstance(end, str) else None for end in (low, high))
    if first is None or last is None:
        raise ValueError(must)
    a, b, unit, other = float(first[1]), float(last[1]), first[2], last[2]
    if unit != other:
        scales = [1.0 if one == "" else _PREFIX.get(one) for one in (unit, other)]
        if scales[0] is not None and scales[1] is not None:
            return a * scales[0], b * scales[1], ""
        factor = _factor(other, unit) if unit and other else None
        if factor is None:
            raise ValueError(must)
        b *= factor
    return a, b, unit


def fraction(value: str) -> float:
    """A fraction: "1%" or ".01".

    Raises
    ------
    ValueError
        with the text ``must ...`` for anything else, and outside of 0 to 1.
    """
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)(e-?\d{1,2})?\s*(%?)\s*", value)
    found = float(match[1] + (match[2] or "")) * (0.01 if match[3] else 1.0) if match else 0.0
    if not 0.0 < found < 1.0:
        raise ValueError("must be a percentage between 0% and 100%, such as 1%")
    return found


def seconds(value: str) -> float:
    """A time: "30s", "2min", "1h" or a number of seconds.

    Raises
    ------
    ValueError
        with the text ``must ...`` for anything else.
    """
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(s|min|h)?\s*", value)
    if match is None or float(match[1]) == 0.0:
        raise ValueError("must be a time above 0, such as 30s or 2min")
    return float(match[1]) * {"s": 1.0, "min": 60.0, "h": 3600.0}[match[2] or "s"]
