"""What may be said of a device: flag, what it is, and the question that asks for it.

One list for the options of the command line, the questions and the errors.  Loads nothing: `harvester new --help`
shows it.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Flag:
    """One value: its name (``--name``), the scene key whose reader reads it, its group and help, and the question."""

    name: str
    key: str
    group: str
    help: str
    question: str

    @property
    def option(self) -> str:
        """As a text of the library names it: commands show it as an option."""
        return f"`{self.name}`"


MASS, PIEZO, STOP = "Mass and spring (two of the first three)", "Piezo", "Stop (left out: none)"
SHAKING, LOAD = "Shaking of the base", "Load"

FLAGS = {
    flag.name: flag
    for flag in (
        Flag("mass", "oscillator.mass", MASS, "Effective mass, such as '40 g'.", "Effective mass, such as 40 g"),
        Flag(
            "stiffness",
            "oscillator.stiffness",
            MASS,
            "In short circuit, such as '16 N/m'.",
            "Stiffness, such as 16 N/m",
        ),
        Flag(
            "frequency",
            "excitation.frequency",
            MASS,
            "Resonance in short circuit, such as '3.2 Hz'.",
            "Resonance frequency in short circuit, such as 3.2 Hz",
        ),
        Flag(
            "damping_ratio",
            "oscillator.damping_ratio",
            MASS,
            "Mechanical, in short circuit, such as 0.004; or --q.",
            "Mechanical damping ratio, such as 0.004",
        ),
        Flag("q", "", MASS, "Quality factor in short circuit: 1/(2 damping ratio).", "Quality factor Q, such as 125"),
        Flag(
            "capacitance",
            "piezo.capacitance",
            PIEZO,
            "Clamped: measured with the mass held, or far above resonance; such as '50.2 nF'.",
            "Clamped capacitance (mass held, or far above resonance), such as 50.2 nF",
        ),
        Flag(
            "coupling",
            "piezo.coupling",
            PIEZO,
            "Force a volt, such as '1e-3 N/V'; or --open-circuit-frequency.",
            "Coupling, force a volt, such as 1e-3 N/V",
        ),
        Flag(
            "open_circuit_frequency",
            "excitation.frequency",
            PIEZO,
            "Resonance in open circuit: gives the coupling, theta^2/(K Cp) = (f_oc/f_sc)^2 - 1, Cp clamped.",
            "Resonance frequency in open circuit, such as 4.8 Hz",
        ),
        Flag(
            "restitution",
            "stop.restitution",
            STOP,
            "Speed after over speed before an impact, 0 to 1.",
            "Stop: restitution coefficient, such as 0.96",
        ),
        Flag(
            "gap", "stop.gap", STOP, "Distance from rest, such as '0.5 mm'.  Default: 0.", "Stop: gap, such as 0.5 mm"
        ),
        Flag(
            "acceleration_psd",
            "excitation.acceleration_psd",
            SHAKING,
            "White noise, one-sided, such as '1e-5 g^2/Hz'.",
            "White noise of the base, such as 1e-5 g^2/Hz",
        ),
        Flag(
            "acceleration_amplitude",
            "excitation.acceleration_amplitude",
            SHAKING,
            "Harmonic, peak, such as '0.1 g'; with --drive-frequency.",
            "Harmonic acceleration of the base, peak, such as 0.1 g",
        ),
        Flag("drive_frequency", "excitation.frequency", SHAKING, "Of the harmonic.", "Its frequency, such as 4 Hz"),
        Flag(
            "resistance", "load.resistance", LOAD, "Such as '1 Mohm'; or --netlist.", "Load resistance, such as 1 Mohm"
        ),
    )
}


def options(*names: str) -> str:
    """Flags as a text of the library names them: "`mass`, `stiffness`"."""
    return ", ".join(FLAGS[name].option for name in names)
