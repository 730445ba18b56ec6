"""The scales that turn nondimensional numbers into SI, of a scene or of the device that is in for one."""

import math
from dataclasses import dataclass

from harvester.equations.repeated_shaking import recorded_shaking
from harvester.errors import InputError
from harvester.quantities.units import LARGEST, SMALLEST
from harvester.scene.physical import Excitation
from harvester.scene.scene import Scene


@dataclass(frozen=True)
class Scales:
    """The device that turns nondimensional numbers into SI: M (kg), w0 (rad/s), l (m), theta (N/V), Cp (F).

    InputError for a device so far from any real one that its scales could over- or underflow.
    """

    mass: float
    frequency: float
    length: float
    coupling: float
    capacitance: float

    def __post_init__(self) -> None:
        # In this order: a power is taken only of what is already known to be of a sane size.
        _within("w0 = sqrt(stiffness/mass)", self.frequency)
        _within(
            "length scale, from acceleration_psd, mass, stiffness and cubic_stiffness,", self.length
        )
        _within("voltage scale coupling l/capacitance", self.volts)
        _within("power scale mass w0^3 l^2", self.watts)

    @property
    def volts(self) -> float:
        """The voltage scale v/V = theta l/Cp, in volt."""
        return self.coupling * self.length / self.capacitance

    @property
    def watts(self) -> float:
        """(v^2/R) / (beta mu V^2) = M w0^3 l^2, in watt."""
        return self.mass * self.frequency**3 * self.length**2

    def resistance(self, mu: float) -> float:
        """Load resistance of a time-constant ratio, R = 1/(mu Cp w0), in ohm."""
        return 1.0 / (mu * self.capacitance * self.frequency)


# The device that carries a nondimensional scene into ngspice: the mass, frequency and capacitance
# of the plate of Shock and Vibration 2019, 9093605, Table 2, with its coupling set by beta.
DEFAULT_MASS = 0.04
DEFAULT_FREQUENCY = 20.0
DEFAULT_LENGTH = 1e-3
DEFAULT_COUPLING, DEFAULT_CAPACITANCE = 1e-3, 50.2e-9


def scales(scene: Scene, length: float | None = None) -> Scales:
    """The scales of a scene; for a nondimensional one, those of the default device."""
    if scene.nondimensional is not None:
        beta = scene.nondimensional.beta
        stiffness = DEFAULT_MASS * DEFAULT_FREQUENCY**2
        coupling = math.sqrt(beta * stiffness * DEFAULT_CAPACITANCE) if beta else DEFAULT_COUPLING
        return Scales(
            DEFAULT_MASS, DEFAULT_FREQUENCY, DEFAULT_LENGTH, coupling, DEFAULT_CAPACITANCE
        )
    modal = scene.modal
    metres = natural_length(scene) if length is None else length
    return Scales(modal.mass, modal.frequency, metres, modal.coupling, modal.capacitance)


def natural_length(scene: Scene) -> float:
    """A length that makes the numbers of a physical scene of order one, in metre.

    With noise, l = sqrt(G/(4 w0^3)), so that N1 = 1; under a harmonic excitation alone, l = A/w0^2,
    so that F = 1, and under a record with its RMS for A; without any, the length at which the cubic
    force equals the linear one, or 1 mm.
    """
    mass = scene.modal.mass
    stiffness = abs(scene.modal.stiffness)
    excitation = scene.excitation or Excitation()
    if excitation.acceleration_psd:
        return 0.5 * math.sqrt(excitation.acceleration_psd) * math.pow(mass / stiffness, 0.75)
    if excitation.acceleration_amplitude and excitation.profile is None:
        return excitation.acceleration_amplitude * mass / stiffness
    for recorded in recorded_shaking(scene):
        if recorded is not None:
            return recorded.rms * mass / stiffness
    if cubic := scene.oscillator.cubic_stiffness if scene.oscillator else None:
        return math.sqrt(stiffness / abs(cubic))
    return 1e-3


def _within(what: str, value: float) -> None:
    if not SMALLEST <= value <= LARGEST:
        raise InputError(
            f"the {what} must be between {SMALLEST:g} and {LARGEST:g} in SI units, but is {value:g}"
        )
