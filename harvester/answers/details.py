"""An answer's details, such as its step and burn-in, as rows that people read: a name, and a value with unit and error.

``--json`` has the same numbers without units: times in the scene's time unit, powers in its power unit, the rest as
plain numbers (`Estimate.details`).
"""

from collections.abc import Mapping

from harvester.presentation.answer_units import AnswerUnits
from harvester.uncertainty.value import Value

LEDGER, RESIDUAL = "ledger_", "ledger_residual"
ERROR_OF = "error_of_"  # before the name of a detail: its whole error at 95 %, which stands in its line
DISPLACEMENT, PHASES = "displacement_rms", ("displacement_phase", "voltage_phase")  # of a steady response
_TIMES = ("step", "burn_in", "duration")
_POWERS = ("step_error", "tolerance_error", "settling_error")  # parts of the error of the mean power
_CLOCK = "_seconds"  # of the computation
_BALANCE = "power_balance"
_ERRORS = {f"{name}_{error}" for name in (_BALANCE, DISPLACEMENT) for error in ("stderr", "bias")}
_SHARES = {RESIDUAL: "of its largest entry", _BALANCE: "of the power that came in", "slow_share": "of E[V^2]"}


def rows(details: Mapping[str, float], units: AnswerUnits) -> list[tuple[str, str]]:
    """The name and the value in words of each detail, in the order in which the answer has them."""
    found = []
    for name, value in details.items():
        if name in _ERRORS or name.startswith(ERROR_OF):
            continue  # in the line of the quantity itself
        found.append((name.removesuffix(_CLOCK).replace("_", " "), _written(name, value, details, units)))
    return found


def _written(name: str, value: float, details: Mapping[str, float], units: AnswerUnits) -> str:
    """A detail with its unit, and with its error where it has one."""
    if name in _SHARES:
        errors = (details.get(f"{name}{end}") for end in ("_stderr", "_bias"))
        stderr, bias = (None if error is None else 100.0 * error for error in errors)
        return f"{_percent(Value(100.0 * value, stderr, bias))} {_SHARES[name]}"
    if name == DISPLACEMENT:
        return Value(value, bias=details.get(f"{name}_bias")).format(units.length)
    if name in PHASES:
        return f"{value:.4g} degrees to the {'base acceleration' if units.time else 'drive'}"
    if name in _TIMES:
        return Value(value).format(units.time) if units.time else f"{value:.4g} (1/w0)"
    if name.endswith(_CLOCK):
        return f"{value:.2g} s of computing"
    if name.startswith(LEDGER) or name in _POWERS:
        return Value(value, bias=details.get(f"{ERROR_OF}{name}")).format(units.power).replace("(step)", "(95 %)")
    return f"{value:.0f}" if value == int(value) and abs(value) < 1e6 else f"{value:.4g}"


def _percent(value: Value) -> str:
    """A share with its errors: all of them in percent."""
    parts = [f"{value.value:.2g}"]
    if value.stderr is not None:
        parts.append(f"{value.sampling95:.2g} (95 %, sampling)")
    if value.bias is not None:
        parts.append(f"{value.bias:.2g} (step)")
    return f"{' +- '.join(parts)} %"
