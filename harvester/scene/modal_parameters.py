"""The linear device of a physical scene, from any of its keys: mass, spring, damper, coupling, capacitance."""

import math
from dataclasses import dataclass

from harvester.errors import invalid
from harvester.scene.physical import Oscillator, Piezo


@dataclass(frozen=True)
class ModalParameters:
    """M X'' + damping X' + stiffness X + theta v = ..., Cp v' = theta X' - i, in SI units.

    No damping is None.

    A resonance frequency f in short circuit represents stiffness = M (2 pi f)^2, a quality factor Q
    for the damping sqrt(|stiffness| M)/Q, a damping ratio zeta for 2 zeta sqrt(|stiffness| M), and
    the frequency f_oc of the open circuit, at which stiffness + theta^2/Cp = M (2 pi f_oc)^2, for
    the coupling theta > 0.
    """

    mass: float
    stiffness: float
    damping: float | None
    coupling: float
    capacitance: float

    @property
    def frequency(self) -> float:
        """The angular frequency w0 = sqrt(|stiffness|/M), in rad/s."""
        return math.sqrt(abs(self.stiffness) / self.mass)

    def by_key(self) -> dict[str, float]:
        """The values of all keys of a scene that describe this device, each in place of its equivalents."""
        values = {"oscillator.stiffness": self.stiffness, "piezo.coupling": self.coupling}
        if self.stiffness > 0.0:
            values["oscillator.frequency"] = self.frequency / (2.0 * math.pi)
        if (whole := self.stiffness + self.coupling**2 / self.capacitance) > 0.0:
            values["piezo.open_circuit_frequency"] = math.sqrt(whole / self.mass) / (2.0 * math.pi)
        if self.damping:
            ratio = 0.5 * self.damping / (self.mass * self.frequency)
            values |= {"oscillator.damping": self.damping, "oscillator.damping_ratio": ratio}
            values["oscillator.q"] = 0.5 / ratio
        return values


def modal_parameters(oscillator: Oscillator, piezo: Piezo) -> ModalParameters:
    """The parameters of the two tables.

    Raises InputError if the open circuit's frequency is not above that of the short circuit.
    """
    mass = oscillator.mass
    stiffness = oscillator.stiffness
    damping = oscillator.damping
    if stiffness is None:
        stiffness = _spring(mass, oscillator.frequency)
    ratio = None if oscillator.q is None else 0.5 / oscillator.q
    if (zeta := oscillator.damping_ratio if ratio is None else ratio) is not None:
        damping = 2.0 * zeta * (mass * math.sqrt(abs(stiffness) / mass))
    coupling = piezo.coupling
    if coupling is None:
        piezo_spring = _spring(mass, piezo.open_circuit_frequency) - stiffness
        if not piezo_spring > 0.0:
            must = f"be above the frequency in short circuit, {math.sqrt(stiffness / mass) / (2.0 * math.pi):.6g} Hz"
            raise invalid("piezo.open_circuit_frequency", must, piezo.open_circuit_frequency)
        coupling = math.sqrt(piezo_spring * piezo.capacitance)
    return ModalParameters(mass, stiffness, damping, coupling, piezo.capacitance)


def _spring(mass: float, frequency: float | None) -> float:
    """The stiffness that gives a mass the resonance frequency, in Hz."""
    assert frequency is not None, "the tables check this"
    return mass * (2.0 * math.pi * frequency) ** 2
