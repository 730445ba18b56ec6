"""Numbers as a page shows them: 8.361 ± 0.046 µW, 50.2 nF, 6.8 %."""

import re

from harvester.estimate import Value

_SIGNS = {" +- ": " ± ", "^2": "²", "^3": "³", "^4": "⁴", "^5": "⁵", "ohm": "Ω"}
NONE = "not known"


def amount(number: float, unit: str) -> str:
    """A number with its unit: four digits, and a prefix where the unit takes one."""
    if unit == "kg":
        number, unit = 1e3 * number, "g"
    return signs(Value(number).text("" if unit == "1" else unit))


def with_errors(value: Value, unit: str) -> str:
    """A value with each of its errors named."""
    return signs(value.text(unit))


def percent(error: float | None, by: float) -> str:
    """An error relative to a value."""
    if error is None:
        return NONE
    return f"{abs(error / by):.2g} %".replace("e-0", "e-") if by else NONE


def share(error: float | None, value: float) -> str:
    """An error in percent of a value."""
    return percent(None if error is None else 100.0 * error, value)


def signs(text: str) -> str:
    """Print's signs instead of a terminal's."""
    for plain, sign in _SIGNS.items():
        text = text.replace(plain, sign)
    return re.sub(r"(?<=[\d)] )u(?=[A-ZΩgms])", "µ", text)
