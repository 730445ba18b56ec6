"""Numbers as a page shows them, such as 8.361 ± 0.046 µW, 50.2 nF and 6.8 %."""

import re

from harvester.uncertainty.value import Value

_SIGNS = {" +- ": " ± ", "^2": "²", "^3": "³", "^4": "⁴", "^5": "⁵", "ohm": "Ω"}
NONE = "-"  # no such error, or not known: the reason stands beside the table
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def amount(number: float, unit: str) -> str:
    """A number with its unit: four digits, and a prefix where the unit takes one."""
    if unit == "kg":
        number, unit = 1e3 * number, "g"
    return signs(Value(number).text("" if unit == "1" else unit))


def with_errors(value: Value, unit: str) -> str:
    """A value with each of its errors named."""
    return signs(value.text(unit))


def share(error: float | None, value: float) -> str:
    """An error in percent of a value."""
    if error is None or value == 0.0:
        return NONE
    percent = abs(100.0 * error / value)
    if 0.0 < percent < 1e-3:
        return "< 0.001 %"
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.0f} %"


def signs(text: str) -> str:
    """A text with the signs of print (±, ², Ω, µ) instead of those of a terminal (+-, ^2, ohm, u)."""
    for plain, sign in _SIGNS.items():
        text = text.replace(plain, sign)
    text = re.sub(r"(?<=\d)e([-+]\d+)", lambda power: "·10" + str(int(power[1])).translate(_SUPERSCRIPT), text)
    return re.sub(r"(?<=[\d)⁰¹²³⁴⁵⁶⁷⁸⁹] )u(?=[A-ZΩgms])", "µ", text)
