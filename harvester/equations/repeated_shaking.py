"""The base's recorded acceleration or tabulated PSD in SI units, from a file or from a profile by its name.

A single shock is one that repeats when the device has come to rest: when `LEFT` of a motion of the
linear device without its stops and its load is left.  With the load the remaining motion changes
the energy of the next by twice that part.
"""

import math
from dataclasses import dataclass

from harvester.equations.bounds import SLOWEST, growth_near
from harvester.equations.coefficients import Equations
from harvester.errors import InputError
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.records.profiles.catalogue import PROFILES
from harvester.records.profiles.lines_and_shocks import SHOCKS, STEP_RATE, machine, shock, walking
from harvester.records.profiles.standard_curves import density
from harvester.records.records import Record, TabulatedDensity
from harvester.scene.modal_parameters import ModalParameters
from harvester.scene.scene import Scene

# of the amplitude, when the next shock comes; of an energy, which is reported
LEFT, SMALLEST = 1e-4, 1e-12


@dataclass(frozen=True)
class Events:
    """Shocks or steps that shake the base, ``rate`` of them per second.

    If a ``single`` one is meant, ``memory`` is the fraction by which its energy depends on the one
    before. ``briefest`` is the time scale of a shock's change in s: its duration, or half a turn of
    its sine; None for steps.
    """

    rate: float
    single: bool = False
    memory: float = 0.0
    briefest: float | None = None

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The warning on the mean power of single events; nothing for others."""
        return (warning("single_shock", period=1.0 / self.rate),) if self.single else ()


def recorded_shaking(scene: Scene) -> tuple[Record | None, TabulatedDensity | None]:
    """The base's acceleration in time, and its density, in SI units.

    None each if the scene has none.

    Raises InputError for a file that cannot be read, and for a profile whose numbers do not fit
    together.
    """
    excitation = scene.excitation
    if excitation is None:
        return None, None
    if excitation.profile is not None:
        return _by_name(scene)
    file, table = excitation.acceleration_file, excitation.acceleration_psd_file
    if file is None and table is None:
        return None, None
    from harvester.records.record_files import read_density, read_record

    return None if file is None else read_record(file), None if table is None else read_density(
        table
    )


def events(scene: Scene) -> Events | None:
    """The shocks or steps of the scene's profile.

    None if the profile is not a sequence of events.
    """
    excitation = scene.excitation
    assert excitation is not None, "the caller checks"
    if excitation.profile not in SHOCKS:
        return (
            Events(excitation.frequency or STEP_RATE) if excitation.profile == "walking" else None
        )
    duration = excitation.pulse_duration
    single = excitation.event_rate is None
    period = _period(scene)
    assert duration is not None, "Excitation checks this"
    half_turn = math.inf if excitation.frequency is None else 0.5 / excitation.frequency
    return Events(
        1.0 / period, single, _memory(scene, period) if single else 0.0, min(half_turn, duration)
    )


def _by_name(scene: Scene) -> tuple[Record | None, TabulatedDensity | None]:
    """The record or density of the scene's profile."""
    excitation = scene.excitation
    assert excitation is not None and excitation.profile is not None, "the caller checks"
    name = excitation.profile
    level = 1.0 if excitation.level is None else excitation.level
    if PROFILES[name].random:
        return None, density(name, level)
    if name == "machine":
        assert excitation.frequency is not None and excitation.harmonics is not None, (
            "Excitation checks this"
        )
        return machine(excitation.frequency, excitation.harmonics, level), None
    if name == "walking":
        return walking(excitation.frequency, level), None
    amplitude, duration = excitation.acceleration_amplitude, excitation.pulse_duration
    assert amplitude is not None and duration is not None, "Excitation checks this"
    resonance = scene.modal.frequency / (2.0 * math.pi)
    record = shock(name, amplitude, duration, excitation.frequency, _period(scene), resonance)
    return record.scaled(1.0, level), None


def _period(scene: Scene) -> float:
    """The time from shock to shock in s.

    For a single one, until the device without its load is at rest.

    It does not depend on the load, so that the best load is that of most energy.

    Raises InputError for a single shock of a device without damping.
    """
    excitation, modal = scene.excitation, scene.modal
    assert excitation is not None, "the caller checks"
    if excitation.event_rate is not None:
        return 1.0 / excitation.event_rate
    decay = 0.5 * _damping(modal)
    if not decay > SLOWEST:
        raise InputError(
            "excitation.event_rate must be given for a device without damping, which does not come to rest after a "
            "shock, but is left out"
        )
    return (excitation.pulse_duration or 0.0) + math.log(1.0 / LEFT) / (decay * modal.frequency)


def _memory(scene: Scene, period: float) -> float:
    """The part of an event's energy that depends on the one before: twice the amplitude that is left after a period."""
    modal = scene.modal
    resistance = scene.load.resistance if scene.load else None
    free = Equations(
        linear=-1.0 if modal.stiffness < 0.0 else None,
        c1=-_damping(modal),
        beta=modal.coupling**2 / (abs(modal.stiffness) * modal.capacitance),
        mu=None if resistance is None else 1.0 / (resistance * modal.capacitance * modal.frequency),
    )
    memory = 2.0 * math.exp(min(growth_near(free), 0.0) * modal.frequency * period)
    return memory if memory > SMALLEST else 0.0


def _damping(modal: ModalParameters) -> float:
    """Nondimensional, -c1."""
    return (modal.damping or 0.0) / (modal.mass * modal.frequency)
