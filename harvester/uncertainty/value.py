"""Numbers with their errors of sampling, of the step and of the model."""

import math
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import SimulationError, names_arguments
from harvester.quantities.units import SYMBOLS

NORMAL_QUANTILE = 1.96  # half-width of a 95 % interval in standard errors, of many degrees of freedom
ROUNDED = 6  # digits of a value whose only error is rounding


@names_arguments
@dataclass(frozen=True, repr=False)
class Value:
    """A number with its errors of sampling, of the step and of the model.

    ``stderr`` is the standard error of sampling (None: the engine samples nothing), from ``dof`` degrees of
    freedom (None: so many that they do not matter); ``bias`` the estimated error of the finite step, ``model`` that of
    the model itself (None: no such error, or not known; the estimate's ``reason`` says which).  A ``model`` of 0 is a
    closed form, of which the ``bias`` is rounding.  ``unknown`` names parts of the error that are not known, where
    others are.

    >>> import harvester as hv
    >>> print(hv.Value(8.4e-6, stderr=1e-8, bias=2e-8).format("W"))
    8.4 +- 0.02 (95 %, sampling) +- 0.02 (step) uW
    >>> print(hv.Value(8.4e-6, stderr=1e-8, unknown="the step").format("W"))
    8.4 uW (95 % of sampling within 0.02; the error of the step is not known)
    >>> hv.Value(0.25, stderr=1e-3)  # a value knows no unit: it shows itself in that of its answer
    0.25 +- 0.002 (95 %, sampling)
    """

    value: float
    stderr: float | None = None
    bias: float | None = None
    model: float | None = None
    dof: float | None = None
    unknown: str = ""

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (self.value, self.stderr or 0.0, self.bias or 0.0, self.model or 0.0)):
            raise SimulationError(
                "the result is not finite: the response grows without bound, or numbers left their range"
            )

    def scaled(self, factor: float) -> "Value":
        """The value and its errors multiplied by a factor, as for other units."""
        stderr, bias, model = (_times(error, factor) for error in (self.stderr, self.bias, self.model))
        return Value(self.value * factor, stderr, bias, model, self.dof, self.unknown)

    def with_unknown(self, unknown: str) -> "Value":
        """The value with one more part of its error that is not known; as it is where ``unknown`` is empty."""
        return replace(self, unknown=" and ".join(part for part in (self.unknown, unknown) if part))

    @property
    def quantile(self) -> float:
        """The half-width of the 95 % sampling interval in standard errors: Student's for few degrees of freedom."""
        if self.dof is None:
            return NORMAL_QUANTILE
        from scipy.special import stdtrit

        return float(stdtrit(self.dof, 0.975))

    @property
    def sampling95(self) -> float:
        """The half-width of the 95 % sampling interval, in the value's units."""
        return self.quantile * (self.stderr or 0.0)

    @property
    def normal_stderr(self) -> float:
        """The standard error of many samples that would have the same 95 % interval of sampling."""
        return self.sampling95 / NORMAL_QUANTILE

    @property
    def known_error95(self) -> float:
        """The half-width of the 95 % sampling interval plus the errors of step and model, as far as they are known."""
        return self.sampling95 + (self.bias or 0.0) + (self.model or 0.0)

    @property
    def error95(self) -> float | None:
        """`known_error95` where every part of the error is known; None where a part is not, or none is stated."""
        stated = any(error is not None for error in (self.stderr, self.bias, self.model))
        return self.known_error95 if stated and not self.unknown else None

    def format(self, unit: str = "") -> str:
        """The value, its errors and the unit in words: ``3.104 +- 0.012 (95 %, sampling) +- 0.004 (step) uW``."""
        prefixed = unit and "^" not in unit and not unit[0].isdigit()
        scale, prefix = _engineering(self.value) if prefixed else (1.0, "")
        digits = 4
        if self.known_error95 > 0.0 and self.value != 0.0:
            digits = max(2, 2 + math.ceil(math.log10(abs(self.value) / self.known_error95)))
        most = ROUNDED if self.stderr is None and self.model == 0.0 else 9  # no device is known to more digits
        text = f"{self.value / scale:.{min(digits, most)}g}"
        if self.unknown:
            return f"{text} {prefix}{unit}".rstrip() + f" ({self._known_parts(scale)})"
        if self.stderr is not None:
            text += f" +- {_two_digits(self.sampling95 / scale)} (95 %, sampling)"
        if self.bias is not None:
            text += f" +- {_two_digits(self.bias / scale)} ({'rounding' if self.model == 0.0 else 'step'})"
        if self.model:
            text += f" +- {_two_digits(self.model / scale)} (model, estimated)"
        return f"{text} {prefix}{unit}".rstrip()

    def __repr__(self) -> str:
        return self.format()

    def text(self, unit: str) -> str:
        """The name of `format` before version 0.2."""
        warnings.warn("Value.text is Value.format now", DeprecationWarning, stacklevel=2)
        return self.format(unit)

    @property
    def whole_error95(self) -> float | None:
        """The name of `error95` before version 0.2."""
        warnings.warn("Value.whole_error95 is Value.error95 now", DeprecationWarning, stacklevel=2)
        return self.error95

    def _known_parts(self, scale: float) -> str:
        """The errors that are known, in units of ``scale``, and what is not."""
        parts = [
            f"{what} within {_two_digits(error / scale)}"
            for what, error in (
                ("95 % of sampling", None if self.stderr is None else self.sampling95),
                ("step", self.bias),
                ("model", self.model),
            )
            if error is not None
        ]
        return "; ".join([", ".join(parts)] * bool(parts) + [f"the error of {self.unknown} is not known"])


def amount(number: float, unit: str) -> str:
    """A number without an error with its unit: four digits, and a prefix where the unit takes one; "1" is no unit."""
    if unit == "kg":
        number, unit = 1e3 * number, "g"
    return Value(number).format("" if unit == "1" else unit)


def percent(error: float, value: float) -> str:
    """An error in percent of a value other than 0."""
    share = abs(100.0 * error / value)
    if 0.0 < share < 1e-3:
        return "< 0.001 %"
    return f"{share:.2g} %" if share < 99.5 else f"{share:.0f} %"


def number(value: Value) -> dict[str, float | None]:
    """A value as ``--json`` prints it."""
    errors = {"step_bias": value.bias, "model_bias": value.model, "error95": value.error95}
    return {"value": value.value, "stderr": value.stderr, **errors}


def mean_and_error(values: Floats) -> tuple[float, float]:
    """Mean of independent entries, shape (n,), and its standard error (infinite for one entry)."""
    n = len(values)
    return float(values.mean()), float(values.std(ddof=1) / math.sqrt(n)) if n > 1 else math.inf


def half95(stderr: Any) -> Any:
    """The half-width of the 95 % interval of normal errors with a standard error, of any shape."""
    return NORMAL_QUANTILE * stderr


def stderr_of95(half: Any) -> Any:
    """The standard error of normal errors with a half-width of their 95 % interval, of any shape."""
    return half / NORMAL_QUANTILE


def bound95(change: float, stderr: float) -> float:
    """The size that a change, measured with a standard error, may have at 95 %: ``|change| + 1.96 stderr``."""
    return abs(change) + NORMAL_QUANTILE * stderr


def z_score(a: Value, b: Value) -> float | None:
    """The difference of two values over its standard error; None where neither value has one."""
    error = math.hypot(a.stderr or 0.0, b.stderr or 0.0)
    return float(np.float64(a.value - b.value) / error) if error > 0.0 else None


def _two_digits(error: float) -> str:
    """An error as it stands behind its value: two digits, and no exponent below a million."""
    text = f"{error:.2g}"
    return f"{float(text):.0f}" if 100.0 <= error < 1e6 else text


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else abs(value * factor)


def _engineering(value: float) -> tuple[float, str]:
    """A power of 1000 and its prefix that bring a value between 1 and 1000."""
    if value == 0.0:
        return 1.0, ""
    exponent = 3 * math.floor(math.log10(abs(value)) / 3)
    exponent = min(max(exponent, -15), 6)
    return 10.0**exponent, SYMBOLS[exponent]
