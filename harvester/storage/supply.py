"""What a rectifier's current supplies at a voltage, straight from its store or through a chip, and how soon.

From the store    P = V I(V)
chip, store at its input    P = eta max V (I(V) - I_own)    from the voltage at which its output ends to that at which
                                                            it begins: the store settles where the current suffices
chip that tracks    P = eta (1 - idle) eta_charging V I(V) - V_store I_own    at V = ratio V_open

The chip's numbers are those of `harvester.storage.bought_parts.Chip`.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from harvester.storage.bought_parts import Chip
from harvester.storage.rectified_current import RectifiedCurrent, times_to

FINE = 400  # voltages of a search


@dataclass(frozen=True)
class Supply:
    """A rectifier with the voltage (V) that is asked for; ``rise`` and ``fall`` are those of a chip's output."""

    voltage: float
    chip: Chip | None = None
    rise: float = 0.0
    fall: float = 0.0

    @property
    def top(self) -> float | None:
        """The voltage up to which the rectifier's current matters; None for that of the open circuit."""
        if self.chip is None:
            return self.voltage
        return self.rise if self.chip.ratio is None else None

    def efficiency(self, power: float) -> float:
        """That of a chip's output, straight over the logarithm of its current."""
        assert self.chip is not None, "asked of a chip"
        amperes, shares = np.array(self.chip.efficiencies).T
        return float(np.interp(math.log(max(power / self.voltage, 1e-12)), np.log(amperes), shares))

    def power(self, table: RectifiedCurrent, needed: float) -> float:
        """The mean power (W) that is there at the voltage; a chip's efficiency is that at the power ``needed``."""
        if self.chip is None:
            return max(self.voltage * float(table.at(np.array(self.voltage))), 0.0)
        if self.chip.ratio is None:
            volts = np.linspace(self.fall, self.rise, FINE)
            current = table.at(volts) - self.chip.own
            return self.efficiency(needed) * float((volts * current).max()) if current[-1] > 0.0 else 0.0
        stored = self._charging(table) - self.chip.full * self.chip.own
        return max(self.efficiency(needed) * stored, 0.0)

    def _charging(self, table: RectifiedCurrent) -> float:
        """The power (W) that a chip which tracks puts into its store."""
        chip = self.chip
        assert chip is not None and chip.ratio is not None, "asked of a chip that tracks"
        held = chip.ratio * min(open_circuit(table), chip.most)
        return chip.charging * (1.0 - chip.idle) * held * float(table.at(np.array(held)))

    def wake(self, table: RectifiedCurrent, farads: float) -> float:
        """How long (s) an empty store of so many farads takes until the voltage is there; infinite if it never is."""
        if self.chip is None:
            return _time(table, self.voltage, farads)
        own = replace(table, current=table.current - self.chip.own)
        if self.chip.ratio is None:
            return _time(own, self.rise, farads)
        cold, warm = self.chip.cold_voltage, self._charging(table) - self.rise * self.chip.own
        start = self.chip.cold_efficiency * cold * float(table.at(np.array(cold)))
        if min(start, warm) <= 0.0:
            return math.inf
        first, second = self.chip.hand_over**2, self.rise**2 - self.chip.hand_over**2
        return 0.5 * farads * (first / start + second / warm)


def open_circuit(table: RectifiedCurrent) -> float:
    """The voltage (V) at which the current ends."""
    volts = np.linspace(0.0, float(table.voltages[-1]), FINE)
    gone = np.flatnonzero(table.at(volts) <= 1e-3 * float(table.current[0]))
    return float(volts[gone[0]]) if len(gone) else float(volts[-1])


def _time(table: RectifiedCurrent, volts: float, farads: float) -> float:
    return float(times_to(np.array([volts]), table, farads, math.inf)[0])
