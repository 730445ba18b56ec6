"""The preferred values that resistors and capacitors are made in: the E series of IEC 60063, decade after decade."""

import math

from harvester.errors import invalid

_E24 = (
    10,
    11,
    12,
    13,
    15,
    16,
    18,
    20,
    22,
    24,
    27,
    30,
    33,
    36,
    39,
    43,
    47,
    51,
    56,
    62,
    68,
    75,
    82,
    91,
)
SERIES = ("E3", "E6", "E12", "E24", "E48", "E96", "E192")


def mantissas(series: str) -> tuple[float, ...]:
    """The values of a series from 1 to below 10, such as (1.0, 2.2, 4.7) of E3; without unit.

    E3 to E24 are every eighth, fourth, second or each of the 24 rounded values of the standard; E48
    to E192 are 10^(k/n) with three digits, but for 9.20 of E192, which the standard writes if
    the rounding gives 9.19.

    Raises InputError for a series that is not one of `SERIES`.
    """
    if series not in SERIES:
        raise invalid("an E series", f"be one of {', '.join(SERIES)}", series)
    count = int(series[1:])
    if count <= 24:
        return tuple(value / 10.0 for value in _E24[:: 24 // count])
    rounded = [round(10.0 ** (k / count), 2) for k in range(count)]
    return tuple(9.2 if value == 9.19 else value for value in rounded)


def nearest(series: str, value: float) -> float:
    """The value of a series that is nearest by ratio to a value above 0, in the unit of that value.

    Raises InputError for a series that is not one of `SERIES`, and for a value that is not above 0.
    """
    return min(
        between(series, value / 10.0, value * 10.0),
        key=lambda preferred: abs(math.log(preferred / value)),
    )


def between(series: str, low: float, high: float) -> tuple[float, ...]:
    """All values of a series from ``low`` to ``high``, both above 0 and in the same unit, the smallest first.

    Raises InputError for a series that is not one of `SERIES`, and for ends that are not above 0.
    """
    if not low > 0.0:
        raise invalid("a value of an E series", "be above 0", low)
    decades = range(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
    every = (float(f"{value:.3g}e{decade}") for decade in decades for value in mantissas(series))
    slack = 1e-9  # so that an end that is itself a value of the series is among them
    return tuple(
        preferred for preferred in every if low * (1.0 - slack) <= preferred <= high * (1.0 + slack)
    )
