"""One point of a frequency response, and its columns in response.csv."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from harvester.presentation.answer_units import AnswerUnits
from harvester.quantities.units import USUAL_UNITS
from harvester.studies.output_folder import named
from harvester.uncertainty.value import Value, number

GRAVITY = USUAL_UNITS["gravity", "m/s^2"]


@dataclass(frozen=True)
class ResponsePoint:
    """The response at one frequency (Hz; nondimensional: rad): mean square voltage and mean power in the scene's units.

    ``spread`` is that of the trajectories' mean power, relative to the largest; None where there is noise, or one path.
    ``displacement_rms`` is that of the mass about its mean place; ``displacement_phase`` and ``voltage_phase`` are
    those of the first harmonics to the base's acceleration (`harvester.linear.harmonics`), in degrees.  Each is None
    where it is not known: a phase where there is noise, or where trajectories differ.
    """

    direction: str
    frequency: float
    mean_square_voltage: Value
    mean_power: Value
    spread: float | None
    displacement_rms: Value | None = None
    displacement_phase: float | None = None
    voltage_phase: float | None = None

    @property
    def voltage_rms(self) -> Value:
        """The square root of E[v^2], with errors to first order."""
        return root(self.mean_square_voltage)

    def as_json(self, level: float | None) -> dict[str, object]:
        """The point as ``--json`` prints it, under a base of an amplitude of ``level`` g (None: nondimensional)."""
        found: dict[str, object] = {
            "frequency": self.frequency,
            "voltage_rms": number(self.voltage_rms),
            "mean_power": number(self.mean_power),
            "displacement_rms": None if self.displacement_rms is None else number(self.displacement_rms),
            "displacement_phase": self.displacement_phase,
            "voltage_phase": self.voltage_phase,
            "spread_of_trajectories": self.spread,
        }
        if level is not None:
            found["voltage_rms_per_g"] = self.voltage_rms.value / level
            found["mean_power_per_g2"] = self.mean_power.value / level**2
        return found


def root(square: Value) -> Value:
    """The square root of a mean square, with its errors to first order."""
    size = math.sqrt(square.value)
    stderr, bias, model = (
        None if e is None else e / (2.0 * size) if size > 0.0 else 0.0
        for e in (square.stderr, square.bias, square.model)
    )
    return Value(size, stderr, bias, model, square.dof, square.unknown)


def heads(of: AnswerUnits) -> list[str]:
    """The names of the columns of `cells`, with their units."""
    names = {"voltage_rms": of.voltage, "mean_power": of.power, "displacement_rms": of.length}
    errors = [f"{name}_{error}" for name in names for error in ("stderr", "step_bias")]
    own = ["direction", named("frequency", of.frequency), *(named(name, unit) for name, unit in names.items())]
    per_g = ["voltage_rms_per_g (V/g)", "mean_power_per_g2 (W/g^2)"] if of.voltage else []
    phases = ["displacement_phase (degree)", "voltage_phase (degree)"]
    return [*own, *errors, *phases, *per_g, "spread_of_trajectories", "mean_power_error95", "error"]


def cells(point: ResponsePoint, level: float | None) -> Sequence[object]:
    """A row of response.csv; empty where a number is not known.  ``level`` as of `ResponsePoint.as_json`."""
    values = (point.voltage_rms, point.mean_power, point.displacement_rms)
    errors = [e for v in values for e in ((None, None) if v is None else (v.stderr, v.bias))]
    phases = ["" if p is None else f"{p:.6g}" for p in (point.displacement_phase, point.voltage_phase)]
    per_g = [] if level is None else [point.voltage_rms.value / level, point.mean_power.value / level**2]
    spread = "" if point.spread is None else f"{point.spread:.3g}"
    known = [None if v is None else v.value for v in values]
    whole = point.mean_power.error95
    return [point.direction, point.frequency, *known, *errors, *phases, *per_g, spread, whole, ""]


def failed_cells(frequency: float, why: str, of: AnswerUnits) -> Sequence[object]:
    """The row of a frequency without a point: the reason in its last column, and nothing else."""
    return [None, frequency, *[None] * (len(heads(of)) - 3), why]
