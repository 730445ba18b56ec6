"""Numbers with their sampling errors, of the step and of the model.

Long because a value, which users hold in their hands, explains each of its parts.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, SimulationError, names_arguments
from harvester.quantities.units import SYMBOLS

# half-width of a 95 % interval in standard errors, of many degrees of freedom
NORMAL_QUANTILE = 1.96
ROUNDED = 6  # digits of a value whose only error is rounding
YEAR = 365.25 * 86400.0  # s
HOUR = 3600.0  # s


@names_arguments
@dataclass(frozen=True, repr=False)
class Value:
    """A number with its sampling errors, time step and model.

    Parameters
    ----------
    value : float
        The number.
    stderr : float, optional
        Standard sampling error. None: the value was not sampled.
    bias : float, optional
        Estimated time-discretisation error (rounding error for a closed form). 0 for a quantity
        that no such error can change, for example a count.
    model : float, optional
        Estimated model error; 0 for a closed form. None: not applicable or unknown; the reason of
        the answer states which.
    dof : float, optional
        Degrees of freedom of ``stderr``. None: treated as infinite.
    unknown : str
        Error contributions that could not be estimated; ``error95`` is then None.
    unit : str
        Unit of the number and of its errors; "" for a number without one.

    ``float(value)`` is the number alone, and ``f"{value:.3g}"`` formats it; ``f"{value}"`` has
    errors and unit.  ``<`` and ``>`` compare the numbers, also with a plain one, without regard to
    their errors; ``==`` compares all parts.

    Raises
    ------
    SimulationError
        The number or an error is not finite.
    InputError
        Values of different units are ordered.

    Examples
    --------
    >>> import harvester as hv
    >>> power = hv.Value(8.4e-6, stderr=1e-8, bias=2e-8, unit="W")
    >>> print(power)
    8.4 +- 0.02 (95 %, sampling) +- 0.02 (step) uW
    >>> float(power), f"{power:.2e}", power > 8e-6
    (8.4e-06, '8.40e-06', True)
    >>> hv.Value(8.4e-6, stderr=1e-8, unknown="the step", unit="W")
    8.4 uW (95 % of sampling within 0.02; the error of the step is not known)
    """

    value: float
    stderr: float | None = None
    bias: float | None = None
    model: float | None = None
    dof: float | None = None
    unknown: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        if not all(
            math.isfinite(v)
            for v in (self.value, self.stderr or 0.0, self.bias or 0.0, self.model or 0.0)
        ):
            raise SimulationError(
                "the result is not finite: the response grows without bound, or numbers left their range"
            )

    def __float__(self) -> float:
        return float(self.value)

    def __format__(self, spec: str) -> str:
        return format(self.value, spec) if spec else self.format()

    def __lt__(self, other: "Value | float") -> bool:
        return self.value < self._number(other)

    def __le__(self, other: "Value | float") -> bool:
        return self.value <= self._number(other)

    def __gt__(self, other: "Value | float") -> bool:
        return self.value > self._number(other)

    def __ge__(self, other: "Value | float") -> bool:
        return self.value >= self._number(other)

    def _number(self, other: "Value | float") -> float:
        """The number of the other value in a comparison."""
        if isinstance(other, Value) and other.unit != self.unit:
            raise InputError(
                f"values must have one unit to be ordered, but have {self.unit or 'none'} and {other.unit or 'none'}"
            )
        return other.value if isinstance(other, Value) else other

    def scaled(self, factor: float, unit: str = "") -> "Value":
        """The value and its errors multiplied by a factor, as for another ``unit``."""
        stderr, bias, model = (
            _times(error, factor) for error in (self.stderr, self.bias, self.model)
        )
        return Value(
            value=self.value * factor,
            stderr=stderr,
            bias=bias,
            model=model,
            dof=self.dof,
            unknown=self.unknown,
            unit=unit,
        )

    def root(self) -> "Value":
        """The square root of a mean square, with its errors to first order."""
        size = math.sqrt(max(self.value, 0.0))
        parts = (self.stderr, self.bias, self.model)
        stderr, bias, model = (
            None if e is None else e / (2.0 * size) if size > 0.0 else 0.0 for e in parts
        )
        return Value(size, stderr, bias, model, self.dof, self.unknown)

    def with_unknown(self, unknown: str) -> "Value":
        """The value with one more part of its error that is not known.

        As it is where ``unknown`` is empty.
        """
        return replace(self, unknown=" and ".join(part for part in (self.unknown, unknown) if part))

    def with_model(self, share: float) -> "Value":
        """The value with one more model error, a fraction of it, which includes the rounding of a closed form."""
        if not share:
            return self
        closed = self.stderr is None and self.model == 0.0
        more = share * abs(self.value) + (self.model or 0.0) + (self.bias or 0.0 if closed else 0.0)
        return replace(self, model=more, bias=None if closed else self.bias)

    @property
    def quantile(self) -> float:
        """The half-width of the 95 % sampling interval in standard errors: Student's for few degrees of freedom."""
        return NORMAL_QUANTILE if self.dof is None else student95(self.dof)

    @property
    def sampling95(self) -> float:
        """The half-width of the 95 % sampling interval, in the value's units."""
        return self.quantile * (self.stderr or 0.0)

    @property
    def normal_stderr(self) -> float:
        """The standard error of many samples that would have the same 95 % sampling interval."""
        return self.sampling95 / NORMAL_QUANTILE

    @property
    def systematic(self) -> float | None:
        """The step and model errors together; None if neither is known."""
        known = [error for error in (self.bias, self.model) if error is not None]
        return sum(known) if known else None

    @property
    def known_error95(self) -> float:
        """The half-width of the 95 % sampling interval plus the step and model errors, as far as they are known."""
        return self.sampling95 + (self.bias or 0.0) + (self.model or 0.0)

    @property
    def largest95(self) -> float:
        """The largest size that the value may have at 95 %, as far as its errors are known."""
        return abs(self.value) + self.known_error95

    @property
    def error95(self) -> float | None:
        """`known_error95` if every part of the error is known.

        None if a part is not, or none is stated.
        """
        stated = any(error is not None for error in (self.stderr, self.bias, self.model))
        return self.known_error95 if stated and not self.unknown else None

    def format(self, unit: str = "") -> str:
        """The value, its errors and the unit in words: ``3.104 +- 0.012 (95 %, sampling) +- 0.004 (step) uW``.

        ``unit`` is one for a value that has none of its own.
        """
        unit = unit or self.unit
        if unit == "s" and self._is_long_and_exact():
            return f"{clock(self.value)} (error below 1 min)"
        written, behind = self._writer(unit)
        digits = 4
        if self.known_error95 > 0.0 and self.value != 0.0:
            # to the second digit of the total error
            digits = max(2, 2 + _decade(self.value) - _decade(self.known_error95))
        # no device is known to more digits
        most = ROUNDED if self.stderr is None and self.model == 0.0 else 9
        text = written(self.value, min(digits, most))
        if self.unknown:
            return f"{text}{behind} ({self._known_parts(written)})"
        if self.stderr is not None:
            text += f" +- {written(self.sampling95)} (95 %, sampling)"
        if self.stderr is None and self.model == 0.0:
            return (
                f"{text}{behind} ({'unaffected by errors' if self.bias == 0.0 else 'closed form'})"
            )
        if self.bias is not None:
            text += f" +- {written(self.bias)} (step)"
        if self.model:
            text += f" +- {written(self.model)} (model, estimated)"
        return f"{text}{behind}"

    def _is_long_and_exact(self) -> bool:
        """Whether it is a time of hours with an error below the last unit of `clock`."""
        return self.value >= HOUR and 0.0 < (self.error95 or 0.0) < 0.5

    def _writer(self, unit: str) -> tuple[Callable[..., str], str]:
        """How numbers are written in a unit and so many digits (2), and the text after them."""
        if unit == "s" and self.value >= 59.5 and not 0.0 < self.known_error95 < 0.5:
            return lambda number, digits=2: clock(float(f"{number:.{digits}g}")), ""
        plain = unit == "%" or (unit == "s" and self.value >= 1e3)  # nobody counts in ks
        prefixed = unit and "^" not in unit and not unit[0].isdigit() and not plain
        scale, prefix = _engineering(self.value) if prefixed else (1.0, "")
        return lambda number, digits=2: two_digits(
            number / scale, digits
        ), f" {prefix}{unit}".rstrip()

    def __repr__(self) -> str:
        return self.format()

    def _known_parts(self, written: Callable[[float], str]) -> str:
        """The errors that are known, as they are ``written``, and the unknown part."""
        parts = [
            f"{what} within {written(error)}"
            for what, error in (
                ("95 % of sampling", None if self.stderr is None else self.sampling95),
                ("step", self.bias),
                ("model", self.model),
            )
            if error
        ]
        return "; ".join(
            [", ".join(parts)] * bool(parts) + [f"the error of {self.unknown} is not known"]
        )


def amount(number: float, unit: str) -> str:
    """A number without an error with its unit: four digits, and a prefix if the unit allows one; "1" is not a unit."""
    if unit == "kg":
        number = 1e3 * number
        unit = "g"
    return Value(number).format("" if unit == "1" else unit)


def duration(seconds: float) -> str:
    """A time in three digits with its unit: 20 ms, 53.1 s, 4 min 3 s."""
    return amount(float(f"{seconds:.3g}"), "s")


def percent(error: float, value: float) -> str:
    """An error in percent of a value other than 0."""
    share = abs(100.0 * error / value)
    if 0.0 < share < 1e-3:
        return "< 0.001 %"
    return f"{share:.2g} %" if share < 99.5 else f"{share:.0f} %"


def in_percent(part: float, form: str = ".3g") -> str:
    """A fraction in per cent, such as 0.5 %, in three digits or as ``form`` states."""
    return f"{100.0 * part:{form}} %"


def number(value: Value) -> dict[str, float | None]:
    """A value as ``--json`` prints it."""
    errors = {"step_bias": value.bias, "model_bias": value.model, "error95": value.error95}
    return {"value": value.value, "stderr": value.stderr, **errors}


def mean_and_error(values: Floats) -> tuple[float, float]:
    """Mean of independent entries, shape (n,), and its standard error (infinite for one entry)."""
    n = len(values)
    return float(values.mean()), float(values.std(ddof=1) / math.sqrt(n)) if n > 1 else math.inf


def student95(dof: float) -> float:
    """Student's half-width of a 95 % interval in standard errors."""
    from scipy.special import stdtrit

    return float(stdtrit(dof, 0.975))


def one_more95(values: Floats) -> float:
    """The half-width of the 95 % interval of one more value like ``values``, shape (n,), about their mean."""
    n = len(values)
    return student95(n - 1) * float(values.std(ddof=1)) * math.sqrt(1.0 + 1.0 / n)


def half95(stderr: Any) -> Any:
    """The half-width of the 95 % interval of normal errors with a standard error, of any shape."""
    return NORMAL_QUANTILE * stderr


def stderr_of95(half: Any) -> Any:
    """The standard error of normal errors with a half-width of their 95 % interval, of any shape."""
    return half / NORMAL_QUANTILE


def z_score(a: Value, b: Value) -> float | None:
    """The difference of two values over their half-widths of 95 % by 1.96.

    None if an error is not known.

    The step and model errors are in the half-widths: a deviation that they cover is not a
    difference.
    """
    if a.error95 is None or b.error95 is None:
        return None
    error = stderr_of95(math.hypot(a.error95, b.error95))
    return float(np.float64(a.value - b.value) / error) if error > 0.0 else None


def two_digits(number: float, digits: int = 2) -> str:
    """A number in two digits, as for an error, or in more; without an exponent below a million."""
    text = f"{number:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(number) < 1e6 else text


def clock(seconds: float) -> str:
    """A time as people state it: 0.31 s, 12 s, 4 min 3 s, 2 h 5 min, 3.5 days, 20 years."""
    if seconds < 59.5:
        return f"{seconds:.2g} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours >= 48:
        years = seconds / YEAR
        return f"{seconds / 86400.0:.3g} days" if years < 2.0 else f"{two_digits(years, 3)} years"
    units = (("h", hours), ("min", minutes)) if hours else (("min", minutes), ("s", rest))
    return " ".join(f"{count} {unit}" for unit, count in units if count)


def _decade(number: float) -> int:
    """The exponent of the first digit."""
    return math.floor(math.log10(abs(number)))


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else abs(value * factor)


def _engineering(value: float) -> tuple[float, str]:
    """A power of 1000 and its prefix that bring a value between 1 and 1000."""
    if value == 0.0:
        return 1.0, ""
    exponent = 3 * math.floor(math.log10(abs(value)) / 3)
    exponent = min(max(exponent, -15), 6)
    return 10.0**exponent, SYMBOLS[exponent]
