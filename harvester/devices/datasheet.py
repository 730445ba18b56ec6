"""The fields of a datasheet: the possible data of a device, and the question that asks for it.

The options and questions of `harvester new` and the errors share this list.  Loads nothing that
computes.
"""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Field:
    """One value of a datasheet.

    ``name`` is its argument, ``key`` the scene key of its kind (empty: there is none), ``group``
    if a command's help shows it, ``question`` the text on a terminal, and ``more`` the text that
    the help adds to it.
    """

    name: str
    key: str
    group: str
    question: str
    more: str = ""

    @property
    def help(self) -> str:
        """The text of a command's help."""
        return f"{self.question}.  {self.more}".rstrip()


MASS = "Mass and spring (two of the first three)"
PIEZO = "Piezo"
STOP = "Stop (left out: none)"
SHAKING, LOAD = "Excitation of the base", "Load"
_FREQUENCY = "excitation.frequency"
_STRAIN = "Largest strain of the piezo over the displacement (1/m), such as 2.5"
_CLAMPED = "Clamped capacitance (mass held, or far above resonance), such as 50.2 nF"
_COUPLING = "Gives the coupling, theta^2/(K Cp) = (f_oc/f_sc)^2 - 1, Cp clamped."
_PEAK = "Harmonic acceleration of the base, peak, such as 0.1 g"
_TURNS = "With --profile: frequency of its sine, steps or turns (1500 rpm)."
TEXTS = ("profile", "harmonics")  # fields that are no number

FIELDS = {
    field.name: field
    for field in (
        Field("mass", "oscillator.mass", MASS, "Effective mass, such as 40 g"),
        Field(
            "stiffness", "oscillator.stiffness", MASS, "Stiffness in short circuit, such as 16 N/m"
        ),
        Field(
            "frequency", _FREQUENCY, MASS, "Resonance frequency in short circuit, such as 3.2 Hz"
        ),
        Field(
            "damping_ratio",
            "oscillator.damping_ratio",
            MASS,
            "Mechanical damping ratio, such as 0.004",
            "Or --q.",
        ),
        Field("q", "", MASS, "Quality factor in short circuit, 1/(2 damping ratio), such as 125"),
        Field("capacitance", "piezo.capacitance", PIEZO, _CLAMPED),
        Field(
            "coupling",
            "piezo.coupling",
            PIEZO,
            "Force per volt, such as 1e-3 N/V",
            "Or --open-circuit-frequency.",
        ),
        Field(
            "open_circuit_frequency",
            _FREQUENCY,
            PIEZO,
            "Resonance in open circuit, such as 4.8 Hz",
            _COUPLING,
        ),
        Field(
            "strain_per_displacement",
            "piezo.strain_per_displacement",
            PIEZO,
            _STRAIN,
            "For peak_strain.",
        ),
        Field(
            "restitution",
            "stop.restitution",
            STOP,
            "Speed after over speed before an impact, such as 0.96",
        ),
        Field(
            "gap", "stop.gap", STOP, "Distance of the stop from rest, such as 0.5 mm", "Default: 0."
        ),
        Field(
            "acceleration_psd",
            "excitation.acceleration_psd",
            SHAKING,
            "White noise, one-sided, such as 1e-5 g^2/Hz",
        ),
        Field(
            "acceleration_amplitude",
            "excitation.acceleration_amplitude",
            SHAKING,
            _PEAK,
            "With --drive-frequency.",
        ),
        Field(
            "drive_frequency",
            _FREQUENCY,
            SHAKING,
            "Frequency of the harmonic acceleration, such as 4 Hz",
            _TURNS,
        ),
        Field(
            "profile",
            "",
            SHAKING,
            "Instead: an excitation by name, such as walking",
            "harvester keys profile lists them.",
        ),
        Field(
            "level",
            "excitation.level",
            SHAKING,
            "Factor of the profile's accelerations, such as 0.5",
        ),
        Field(
            "pulse_duration",
            "excitation.pulse_duration",
            SHAKING,
            "Duration of a profile's shock, such as 11 ms",
        ),
        Field(
            "event_rate",
            "excitation.event_rate",
            SHAKING,
            "Shocks per second, such as 0.5 Hz",
            "Default: a single one.",
        ),
        Field(
            "harmonics",
            "",
            SHAKING,
            "Peaks of a machine's lines at 1, 2, ... times its speed: '0.1 g, 0.03 g'",
        ),
        Field(
            "resistance",
            "load.resistance",
            LOAD,
            "Load resistance, such as 1 Mohm",
            "Or --netlist.",
        ),
    )
}


def arguments(names: Iterable[str], joined: str = ", ") -> str:
    """Name several fields in a text of the library: "`mass`, `stiffness`"."""
    return joined.join(f"`{name}`" for name in names)
