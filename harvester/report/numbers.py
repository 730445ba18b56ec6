"""Numbers as a page shows them, such as 8.361 ± 0.046 µW, 50.2 nF and 6.8 %."""

import re

from harvester.uncertainty import value

_SIGNS = {" +- ": " ± ", "^2": "²", "^3": "³", "^4": "⁴", "^5": "⁵", "ohm": "Ω"}
NONE = "-"  # no such error, or not known: the reason stands beside the table
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def amount(number: float, unit: str) -> str:
    """A number with its unit: four digits, and a prefix if the unit takes one."""
    return signs(value.amount(number, unit))


def with_errors(number: value.Value, unit: str) -> str:
    """A value with each of its errors named."""
    return signs(number.format(unit))


def share(error: float | None, of: float) -> str:
    """An error in percent of a value."""
    return NONE if error is None or of == 0.0 else value.percent(error, of)


def signs(text: str) -> str:
    """A text with the signs of print (±, ², Ω, µ) instead of those of a terminal (+-, ^2, ohm, u)."""
    for plain, sign in _SIGNS.items():
        text = text.replace(plain, sign)
    text = re.sub(
        r"(?<=\d)e([-+]\d+)", lambda power: "·10" + str(int(power[1])).translate(_SUPERSCRIPT), text
    )
    text = re.sub(r"(?<=\d) degree\b", "°", text)
    return re.sub(r"(?<=[\d)⁰¹²³⁴⁵⁶⁷⁸⁹] )u(?=[A-ZΩgms])", "µ", text)
