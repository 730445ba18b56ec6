"""One point of a frequency response."""

from typing import ClassVar

from harvester.presentation.result import Result
from harvester.quantities.units import USUAL_UNITS
from harvester.uncertainty.value import Value

GRAVITY = USUAL_UNITS["gravity", "m/s^2"]


class ResponsePoint(Result):
    """The response at one frequency (Hz; nondimensional: rad): mean square voltage and mean power in the scene's units.

    ``spread`` is that of the trajectories' mean power, relative to the largest; None if there is
    noise, or one trajectory. ``displacement_rms`` is that of the mass about its mean place;
    ``displacement_phase`` and ``voltage_phase`` are those of the first harmonics to the base's
    acceleration (`harvester.linear.transfer`), in degrees.  Each is None if it is not known: a
    phase if there is noise, or if trajectories differ.
    """

    DERIVED = ("voltage_rms",)
    NOT_IN_JSON = frozenset({"direction", "mean_square_voltage"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"spread": "spread_of_trajectories"}
    SHORT = ("direction", "frequency", "mean_power")

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
        return self.mean_square_voltage.root()
