"""The energy balance: works on the mass kick by kick, energies at the piezo's terminals and in the load.

    input = damping + impacts + circuit + load + stored

    kick        v0 -> v1 by an impulse J at fixed x: work J (v0 + v1)/2, so that all of a kick's works add up to
                the change of v^2/2; noise, spring and voltage have their own J, damping has the
                rest
    impact      (1 - r^2) v^2/2
    terminals   integral of v i, and of the power of Rload, over ngspice's accepted points
    stored      v^2/2 and the spring's energy of the mass, Cp v^2/2, and C v^2/2 of a capacitor called Csmooth

The energy from the terminals, less the load's and Csmooth's share, is the circuit's loss (diodes,
switches, inductors); a plain load resistor has none.  So the sum checks the force -beta V on
the mass against v i in ngspice, and the works of the spring against its energy; both differ by
the second order in the step.
"""

import math
from dataclasses import dataclass, fields
from typing import Any

from harvester.cosimulation.lockstep.state import AFTER, BEFORE, DURING
from harvester.equations.scales import Scales
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import intensity, spring
from harvester.mechanics.kernels.stored_energy import spring_energy


@inlined
def add_terminal_flow(s, p):
    """Add the energies (J) through the terminals and into the load, and V^2 over time (V^2 s)."""
    if s.measuring == DURING:
        half = 0.5 * (p.t - s.t)
        s.load += half * (s.power + p.power)
        s.delivered += half * (s.voltage * s.current + p.v * p.current)
        s.square += half * (s.voltage * s.voltage + p.v * p.v)
    s.power = p.power
    s.voltage = p.v
    s.current = p.current


@inlined
def add_works_of_kick(s, v0, v1, x, volts, xi, h, c, a=None):
    """Add the works of a kick at x and V (``volts``) that changed the velocity from v0 to v1.

    The work of other excitation counts as that of the noise.
    """
    noise = (
        xi * math.sqrt(2.0 * h * intensity(x, c)) if c.n1 is not None or c.n2 is not None else 0.0
    )
    if a is not None:
        noise += h * a
    pull = h * spring(x, c)
    voltage = 0.0 if c.beta is None else -h * c.beta * volts
    mean = 0.5 * (v0 + v1)
    s.noise_work += mean * noise
    s.spring_work += mean * pull
    s.voltage_work += mean * voltage
    s.damping_work += mean * (v1 - v0 - noise - pull - voltage)


@inlined
def stored_in_mass(s, contact, c):
    """The energy of the mass, of its spring, and of a compliant stop, which holds ``contact``."""
    return contact + 0.5 * s.v * s.v + spring_energy(s.x, c)


@inlined
def note_stored_energy(s, p, energy):
    """Note the stored energy at the first kick of the energy balance, after the burn-in, and at the last."""
    begins = s.measuring == BEFORE and p.t >= s.since
    if not begins and not (s.measuring == DURING and s.n_steps == s.noise_size):
        return
    if begins:
        s.measuring = DURING
        s.begin = p.t
        s.energy_begin = energy
        s.voltage_begin = p.v
        s.smooth_begin = p.smooth
    else:
        s.measuring = AFTER
        s.end = p.t
        s.energy_end = energy
        s.voltage_end = p.v
        s.smooth_end = p.smooth


@dataclass(frozen=True)
class EnergyLedger:
    """Mean powers (W) after the burn-in by the destination of the energy.

    Negative if it is a source.

    ``stored`` is the growth of the energy in mass, Cp and Csmooth.  If the voltage has no force on
    the mass (beta None) the circuit's energy comes from nowhere, and counts as input.
    """

    input: float = 0.0
    damping: float = 0.0
    impacts: float = 0.0
    circuit: float = 0.0
    load: float = 0.0
    stored: float = 0.0

    @property
    def residual(self) -> float:
        """The part of the energy that the energy balance does not account for, relative to its largest entry."""
        out = self.damping + self.impacts + self.circuit + self.load + self.stored
        size = max(abs(getattr(self, entry.name)) for entry in fields(self))
        return (self.input - out) / size if size > 0.0 else 0.0


def ledger_of(s: Any, scales: Scales, smoothing: float, linear: bool) -> EnergyLedger:
    """The energy balance of a finished run.

    ``s`` is its state, ``smoothing`` the capacitance of Csmooth (F), 0 without one; ``linear``
    states that the load is a plain resistor, whose circuit loses nothing.
    """
    time = float(s.end - s.begin)
    if s.measuring != AFTER or time <= 0.0:
        return EnergyLedger()
    joules = scales.mass * (scales.frequency * scales.length) ** 2
    piezo = 0.5 * scales.capacitance * float(s.voltage_end**2 - s.voltage_begin**2)
    smooth = 0.5 * smoothing * float(s.smooth_end**2 - s.smooth_begin**2)
    supplied = joules * float(s.noise_work) + (0.0 if s.has_beta else float(s.delivered) + piezo)
    return EnergyLedger(
        input=supplied / time,
        damping=-joules * float(s.damping_work) / time,
        impacts=joules * float(s.impact_work) / time,
        circuit=0.0 if linear else (float(s.delivered - s.load) - smooth) / time,
        load=float(s.load) / time,
        stored=(joules * float(s.energy_end - s.energy_begin) + piezo + smooth) / time,
    )


def mean_ledger(ledgers: list[EnergyLedger]) -> EnergyLedger:
    """The mean energy balance of equally long runs."""
    return EnergyLedger(
        *(
            math.fsum(getattr(ledger, f.name) for ledger in ledgers) / len(ledgers)
            for f in fields(EnergyLedger)
        )
    )
