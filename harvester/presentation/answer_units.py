"""The units in which a scene's answers are printed, drawn and written: SI units, or none for a nondimensional scene."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AnswerUnits:
    """The unit of each quantity that answers are made of.

    All are empty if the numbers are nondimensional.
    """

    time: str = ""
    frequency: str = ""
    rate: str = ""
    length: str = ""
    speed: str = ""
    acceleration: str = ""
    voltage: str = ""
    mean_square_voltage: str = ""
    power: str = ""
    energy: str = ""

    @staticmethod
    def of(physical: bool) -> "AnswerUnits":
        """The units of a physical scene, or of a nondimensional one."""
        return SI if physical else NONDIMENSIONAL


SI = AnswerUnits(
    time="s",
    frequency="Hz",
    rate="1/s",
    length="m",
    speed="m/s",
    acceleration="m/s^2",
    voltage="V",
    mean_square_voltage="V^2",
    power="W",
    energy="J",
)
NONDIMENSIONAL = AnswerUnits()
