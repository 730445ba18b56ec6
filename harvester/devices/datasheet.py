"""The fields of a datasheet: what may be known of a device, and the question that asks for it.

The options and questions of `harvester new` and the errors share this list.  Loads nothing that computes.
"""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Field:
    """One value of a datasheet.

    ``name`` is its argument, ``key`` the scene key of its kind (empty: there is none), ``group`` and ``help`` what
    a command's help shows, ``question`` what is asked for on a terminal.
    """

    name: str
    key: str
    group: str
    help: str
    question: str


MASS, PIEZO, STOP = "Mass and spring (two of the first three)", "Piezo", "Stop (left out: none)"
SHAKING, LOAD = "Shaking of the base", "Load"

FIELDS = {
    field.name: field
    for field in (
        Field("mass", "oscillator.mass", MASS, "Effective mass, such as '40 g'.", "Effective mass, such as 40 g"),
        Field(
            "stiffness",
            "oscillator.stiffness",
            MASS,
            "In short circuit, such as '16 N/m'.",
            "Stiffness, such as 16 N/m",
        ),
        Field(
            "frequency",
            "excitation.frequency",
            MASS,
            "Resonance in short circuit, such as '3.2 Hz'.",
            "Resonance frequency in short circuit, such as 3.2 Hz",
        ),
        Field(
            "damping_ratio",
            "oscillator.damping_ratio",
            MASS,
            "Mechanical, in short circuit, such as 0.004; or --q.",
            "Mechanical damping ratio, such as 0.004",
        ),
        Field("q", "", MASS, "Quality factor in short circuit: 1/(2 damping ratio).", "Quality factor Q, such as 125"),
        Field(
            "capacitance",
            "piezo.capacitance",
            PIEZO,
            "Clamped: measured with the mass held, or far above resonance; such as '50.2 nF'.",
            "Clamped capacitance (mass held, or far above resonance), such as 50.2 nF",
        ),
        Field(
            "coupling",
            "piezo.coupling",
            PIEZO,
            "Force a volt, such as '1e-3 N/V'; or --open-circuit-frequency.",
            "Coupling, force a volt, such as 1e-3 N/V",
        ),
        Field(
            "open_circuit_frequency",
            "excitation.frequency",
            PIEZO,
            "Resonance in open circuit: gives the coupling, theta^2/(K Cp) = (f_oc/f_sc)^2 - 1, Cp clamped.",
            "Resonance frequency in open circuit, such as 4.8 Hz",
        ),
        Field(
            "restitution",
            "stop.restitution",
            STOP,
            "Speed after over speed before an impact, 0 to 1.",
            "Stop: restitution coefficient, such as 0.96",
        ),
        Field(
            "gap", "stop.gap", STOP, "Distance from rest, such as '0.5 mm'.  Default: 0.", "Stop: gap, such as 0.5 mm"
        ),
        Field(
            "acceleration_psd",
            "excitation.acceleration_psd",
            SHAKING,
            "White noise, one-sided, such as '1e-5 g^2/Hz'.",
            "White noise of the base, such as 1e-5 g^2/Hz",
        ),
        Field(
            "acceleration_amplitude",
            "excitation.acceleration_amplitude",
            SHAKING,
            "Harmonic, peak, such as '0.1 g'; with --drive-frequency.",
            "Harmonic acceleration of the base, peak, such as 0.1 g",
        ),
        Field("drive_frequency", "excitation.frequency", SHAKING, "Of the harmonic.", "Its frequency, such as 4 Hz"),
        Field(
            "resistance", "load.resistance", LOAD, "Such as '1 Mohm'; or --netlist.", "Load resistance, such as 1 Mohm"
        ),
    )
}


def arguments(names: Iterable[str], joined: str = ", ") -> str:
    """Name several fields in a text of the library: "`mass`, `stiffness`"."""
    return joined.join(f"`{name}`" for name in names)
