"""Values of a scene key at even spaces, with their unit: ``logspace("1 kohm", "10 Mohm", 25)``."""

from harvester.errors import InputError, invalid, names_arguments
from harvester.quantities.units import prefix_factor, split_unit, unit_factor


@names_arguments
def logspace(low: float | str, high: float | str, count: int) -> tuple[float | str, ...]:
    """Make ``count`` values from ``low`` to ``high``, each the same multiple of the one before.

    Parameters
    ----------
    low, high : float or str
        the ends: two numbers, or two texts of one kind of quantity.
    count : int
        how many values, both ends among them.

    Returns
    -------
    tuple
        numbers for numbers, else texts in the unit of ``low``, which the key reads.

    Raises
    ------
    InputError
        for ends that are not quantities of one kind, or not both above 0, and a count below 2.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.logspace(1.0, 100.0, 3)
    (1.0, 10.0, 100.0)
    >>> hv.logspace("1 kohm", "1 Mohm", 4)
    ('1.0 kohm', '10.0 kohm', '100.0 kohm', '1000.0 kohm')
    """
    a, b, unit = _ends(low, high, count)
    if not min(a, b) > 0.0:
        raise invalid("the ends of logspace", "be above 0", (low, high))
    values = [
        a,
        *(float(f"{a * (b / a) ** (k / (count - 1)):.15g}") for k in range(1, count - 1)),
        b,
    ]
    return tuple(values if unit is None else (f"{value!r} {unit}".rstrip() for value in values))


@names_arguments
def linspace(low: float | str, high: float | str, count: int) -> tuple[float | str, ...]:
    """Make ``count`` values from ``low`` to ``high``, each the same amount above the one before.

    Parameters
    ----------
    low, high : float or str
        the ends: two numbers, or two texts of one kind of quantity.
    count : int
        how many values, both ends among them.

    Returns
    -------
    tuple
        numbers for numbers, else texts in the unit of ``low``, which the key reads.

    Raises
    ------
    InputError
        for ends that are not quantities of one kind, and a count below 2.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.linspace("0 mm", "0.5 mm", 3)
    ('0.0 mm', '0.25 mm', '0.5 mm')
    """
    a, b, unit = _ends(low, high, count)
    values = [a, *(float(f"{a + (b - a) * k / (count - 1):.15g}") for k in range(1, count - 1)), b]
    return tuple(values if unit is None else (f"{value!r} {unit}".rstrip() for value in values))


def _ends(low: float | str, high: float | str, count: int) -> tuple[float, float, str | None]:
    """Two ends in the unit of the first, and that unit; None if both are numbers."""
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= 100_000:
        raise invalid("the count of values", "be a whole number between 2 and 100000", count)
    if not isinstance(low, str) and not isinstance(high, str):
        return float(low), float(high), None
    ends = _in_one_unit(split_unit(low), split_unit(high))
    if ends is None:
        must = "must be two numbers or two quantities of one kind, such as '1 kohm' and '10 Mohm'"
        raise InputError(f"the ends of the values {must}, but are {low!r} and {high!r}")
    return ends


def _in_one_unit(
    first: tuple[float, str] | None, last: tuple[float, str] | None
) -> tuple[float, float, str | None] | None:
    """Two quantities in the unit of the first, or plain numbers of prefixes alone.

    None if they are of two kinds.
    """
    if first is None or last is None:
        return None
    (a, unit), (b, other) = first, last
    if unit == other:
        return a, b, unit
    scales = [1.0 if prefix == "" else prefix_factor(prefix) for prefix in (unit, other)]
    if scales[0] is not None and scales[1] is not None:
        return a * scales[0], b * scales[1], ""
    factor = unit_factor(other, unit) if unit and other else None
    return None if factor is None else (a, b * factor, unit)
