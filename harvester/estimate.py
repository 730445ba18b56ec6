"""An answer: values with their errors, what it took, and what to beware of.  It prints itself."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import SimulationError

if TYPE_CHECKING:
    from harvester.figures import Plot


@dataclass(frozen=True)
class Value:
    """A number with its errors.

    ``stderr`` is the standard error of sampling (None: the engine samples nothing), from ``freedom`` degrees of
    freedom (None: so many that they do not matter); ``bias`` the estimated error of the finite step, ``model`` that of
    the model itself (None: no such error, or not known; the estimate's ``reason`` says which).

    >>> import harvester as hv
    >>> print(hv.Value(8.4e-6, stderr=1e-8, bias=2e-8).text("W"))
    8.4 +- 0.02 (95 %, sampling) +- 0.02 (step) uW
    """

    value: float
    stderr: float | None = None
    bias: float | None = None
    model: float | None = None
    freedom: float | None = None

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (self.value, self.stderr or 0.0, self.bias or 0.0, self.model or 0.0)):
            raise SimulationError(
                "the result is not finite: the response grows without bound, or numbers left their range"
            )

    def scaled(self, factor: float) -> "Value":
        """The value in other units."""
        stderr, bias, model = (_times(error, factor) for error in (self.stderr, self.bias, self.model))
        return Value(self.value * factor, stderr, bias, model, self.freedom)

    @property
    def quantile(self) -> float:
        """Half-width of the 95 % sampling interval in standard errors: Student's, with few degrees of freedom."""
        if self.freedom is None:
            return 1.96
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, 0.975))

    @property
    def sampling95(self) -> float:
        """Half-width of the 95 % sampling interval."""
        return self.quantile * (self.stderr or 0.0)

    @property
    def error95(self) -> float:
        """Half-width of the 95 % sampling interval plus the errors of step and model."""
        return self.sampling95 + (self.bias or 0.0) + (self.model or 0.0)

    def text(self, unit: str) -> str:
        """Such as ``3.104 +- 0.012 (95 %) +- 0.004 (step) uW``."""
        scale, prefix = _engineering(self.value) if unit and "^" not in unit else (1.0, "")
        digits = 4
        if self.error95 > 0.0 and self.value != 0.0:
            digits = max(2, 2 + math.ceil(math.log10(abs(self.value) / self.error95)))
        text = f"{self.value / scale:.{min(digits, 9)}g}"
        if self.stderr is not None:
            text += f" +- {self.sampling95 / scale:.2g} (95 %, sampling)"
        if self.bias is not None:
            text += f" +- {self.bias / scale:.2g} (step)"
        if self.model is not None:
            text += f" +- {self.model / scale:.2g} (model, estimated)"
        return f"{text} {prefix}{unit}".rstrip()


@dataclass(frozen=True)
class Estimate:
    """What an engine says of a scene.

    mean_square_voltage and mean_power are in V^2 and W for a physical scene, nondimensional for
    a nondimensional one; ``nondimensional`` holds both and beta and mu without units.  ``steps``
    are trajectory-steps (ensemble) or accepted ngspice steps (spice); ``seconds`` is the
    computation without compilation.  ``reason`` says why there is no sampling error, or what
    is known of the model's own.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> answer.engine, answer.effects
    ('averaged', ('linear_damping', 'external_noise', 'back_coupling', 'resistive_load'))
    """

    engine: str
    physical: bool
    mean_square_voltage: Value
    mean_power: Value
    nondimensional: dict[str, float | None]
    effects: tuple[str, ...]
    seconds: float
    steps: int
    reason: str = ""
    warnings: tuple[str, ...] = ()
    details: dict[str, float] = field(default_factory=dict)
    samples: Floats | None = None  # of nondimensional V^2, one a trajectory or batch
    # Of the mean power, one a trajectory; None where it is no plain mean of them.  No part of what the answer says.
    power_samples: Floats | None = field(default=None, compare=False)

    def plot(self, title: str | None = "") -> "Plot":
        """The parts of the error, and the ledger where there is one, as a matplotlib figure."""
        from harvester import figures

        return figures.estimate(self, title)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        return {
            "engine": self.engine,
            "mean_square_voltage": number(self.mean_square_voltage),
            "mean_power": number(self.mean_power),
            "nondimensional": self.nondimensional,
            "effects": list(self.effects),
            "seconds": self.seconds,
            "steps": self.steps,
            "reason": self.reason,
            "warnings": list(self.warnings),
            "details": self.details,
        }

    def __str__(self) -> str:
        power_unit, voltage_unit = ("W", "V^2") if self.physical else ("", "")
        took = f"{self.seconds:.2g} s" + (f", {self.steps:.3g} steps" if self.steps else "")
        lines = [
            f"{self.engine}: {took}",
            f"  mean power           {self.mean_power.text(power_unit)}",
            f"  mean square voltage  {self.mean_square_voltage.text(voltage_unit)}",
            f"  effects              {', '.join(self.effects)}",
        ]
        lines += [f"  {key:<20} {value:.4g}" for key, value in self.details.items()]
        lines += [f"  note: {self.reason}"] if self.reason else []
        return "\n".join(lines + [f"  warning: {w}" for w in self.warnings])

    def _repr_html_(self) -> str:
        from harvester import notebook

        power_unit, voltage_unit = ("W", "V^2") if self.physical else ("", "")
        rows = [
            ("mean power", self.mean_power.text(power_unit)),
            ("mean square voltage", self.mean_square_voltage.text(voltage_unit)),
            ("effects", ", ".join(self.effects)),
            ("seconds", f"{self.seconds:.2g}"),
        ]
        notes = ([f"note: {self.reason}"] if self.reason else []) + notebook.warnings(self.warnings)
        return notebook.table(self.engine, (), rows, notes)


def number(value: Value) -> dict[str, float | None]:
    """A value as ``--json`` prints it."""
    known = any(error is not None for error in (value.stderr, value.bias, value.model))
    errors = {"step_bias": value.bias, "model_bias": value.model, "error95": value.error95 if known else None}
    return {"value": value.value, "stderr": value.stderr, **errors}


def z_score(a: Value, b: Value) -> float | None:
    """Difference over its standard error; None where neither value has one."""
    error = math.hypot(a.stderr or 0.0, b.stderr or 0.0)
    return float(np.float64(a.value - b.value) / error) if error > 0.0 else None


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else abs(value * factor)


def _engineering(value: float) -> tuple[float, str]:
    """A power of 1000 and its prefix that bring a value between 1 and 1000."""
    prefixes = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M"}
    if value == 0.0:
        return 1.0, ""
    exponent = 3 * math.floor(math.log10(abs(value)) / 3)
    exponent = min(max(exponent, -15), 6)
    return 10.0**exponent, prefixes[exponent]
