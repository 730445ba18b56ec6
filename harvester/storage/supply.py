"""The supply by a rectifier's current at a voltage, straight from its storage or through a chip, and how soon.

From the storage             P = V I(V)
chip, storage at its input   P = eta max V (I(V) - I_own)    from the voltage at which its output
                                                             ends to that at which it begins: the
                                                             heaviest load that it always
                                                             carries, at the voltage at which the
                                                             storage capacitor settles

A heavier load is on in cycles and draws less.  The heaviest has eta (V_rise^2 - V_fall^2)/2 / int
dV/(I(V) - I_low), the energy of a cycle over the time in which the storage capacitor charges.

chip that tracks    P = eta eta_charging(V, I) V ((1 - idle) I(V) + C (V_look - V)/period) - V_store I_own
                                                            at V = ratio V_look, where C is at the
                                                            input and V_look is the voltage that a
                                                            look finds

The chip's numbers are those of `harvester.storage.bought_parts.Chip`.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, unknown
from harvester.records.efficiency_table import read_efficiencies
from harvester.scene.sensor_node import HarvestingChip, check_store_at_input
from harvester.storage.bought_parts import CHIPS, Chip
from harvester.storage.recorded_current import AnyCurrent
from harvester.storage.rectified_current import RectifiedCurrent, times_to

FINE, SOME = 400, 1024  # voltages of a search, and windows at once
INPUT = 1e-6  # F at a chip's input, as in the netlist bq25570
LOW = 0.3  # V: below it an empty storage capacitor is charged as there


@dataclass(frozen=True)
class Supply:
    """A rectifier with the voltage (V) that is asked for.

    ``rise`` and ``fall`` are those of a chip's output.
    """

    voltage: float
    chip: Chip | None = None
    rise: float = 0.0
    fall: float = 0.0

    @property
    def top(self) -> float | None:
        """The voltage up to which the rectifier's current matters.

        None for that of the open circuit.
        """
        if self.chip is None:
            return self.voltage
        return self.rise if self.chip.ratio is None else None

    def efficiency(self, power: float) -> float:
        """That of a chip's output at a power."""
        assert self.chip is not None, "asked of a chip"
        return output_efficiency(self.chip, power / self.voltage)

    def power(self, table: AnyCurrent, needed: float) -> float:
        """The mean power (W) that is there at the voltage; a chip's efficiency is that at the power ``needed``."""
        return max(float(self.powers(table, needed).mean()), 0.0)

    def powers(self, table: AnyCurrent, needed: float) -> Floats:
        """The same in each window of a record, shape (windows,); for steady excitation in one."""
        if self.chip is None:
            return np.asarray(
                self.voltage * np.atleast_2d(table.at(np.array([self.voltage])))[:, 0]
            )
        if self.chip.ratio is None:
            volts = np.linspace(self.fall, self.rise, FINE)
            current = np.atleast_2d(table.at(volts)) - self.chip.quiescent
            mean = current.mean(axis=0)
            k = int(np.argmax(volts * mean))
            return np.asarray(
                self.efficiency(needed) * volts[k] * current[:, k] * float(mean[-1] > 0.0)
            )
        return self.efficiency(needed) * (
            tracked_power(self.chip, table) - self.chip.full * self.chip.quiescent
        )

    def wake(self, table: RectifiedCurrent, farads: float) -> float:
        """How long (s) empty storage of so many farads needs until the voltage is there.

        Infinite if it never is.
        """
        if self.chip is None:
            return _time(table, self.voltage, farads)
        if self.chip.ratio is None:
            return _time(
                table.scaled(1.0, -(self.chip.low_quiescent or self.chip.quiescent)),
                self.rise,
                farads,
            )
        cold = self.chip.cold_voltage
        warm = float(tracked_power(self.chip, table)[0]) - self.rise * self.chip.quiescent
        came = cold * float(table.at(np.array(cold)))
        start = self.chip.cold_efficiency * came
        if min(start, warm) <= 0.0 or came < self.chip.cold_power:
            return math.inf
        first = self.chip.hand_over**2
        second = self.rise**2 - self.chip.hand_over**2
        return 0.5 * farads * (first / start + second / warm)


def chip_of(table: HarvestingChip, supply: float | None) -> Chip:
    """The chip that a scene's table means, whose output has the ``supply`` voltage (V), with the table's own numbers.

    Raises InputError for a name that is not known, an output that the chip does not have,
    thresholds that are not range then, and a table of efficiencies that cannot be read.
    """
    if table.name is None:
        chip = Chip({}, ((1e-6, 1.0),), 0.0, math.inf, table.input_ratio)
    elif table.name not in CHIPS:
        raise unknown("chip.name", table.name, CHIPS)
    else:
        chip = CHIPS[table.name]
    if chip.ratio is None and table.input_ratio is None:
        check_store_at_input(table)
    full = table.full_voltage or chip.full
    rise, fall = _levels(table, chip, supply)
    if not rise > fall:
        raise invalid("chip.start_voltage", f"be above the stop voltage, {fall:g} V", rise)
    if chip.ratio is not None and rise > full:
        raise invalid("chip.start_voltage", f"be at most the full voltage, {full:g} V", rise)
    return replace(chip, **_given(table), rise=rise, fall=fall)


def _given(table: HarvestingChip) -> dict[str, Any]:
    """The entries of a table itself for its chip."""
    given: dict[str, Any] = {
        "quiescent": table.own_current,
        "ratio": table.input_ratio,
        "full": table.full_voltage,
    }
    if table.own_current is not None:
        given["low_quiescent"] = 0.0
    if table.efficiency is not None:
        given |= {"charging": ((1.0, 1e-5, table.efficiency),), "spread": 0.0}
    if table.efficiency_table is not None:
        given |= {"charging": read_efficiencies(table.efficiency_table), "spread": 0.0}
    if table.output_efficiency is not None:
        given["efficiencies"] = ((1e-6, table.output_efficiency),)
    return {key: value for key, value in given.items() if value is not None}


def _levels(table: HarvestingChip, chip: Chip, supply: float | None) -> tuple[float, float]:
    """The storage capacitor's voltages at which the output begins and ends."""
    rise, fall = table.start_voltage, table.stop_voltage
    if rise is not None and fall is not None:
        return rise, fall
    levels = None if supply is None else chip.thresholds(supply)
    if levels is None:
        has = (
            ", ".join(f"{volts:g} V" for volts in chip.outputs if volts)
            or "up to its storage's limit"
        )
        was = "is left out" if supply is None else f"is {supply:g} V"
        raise InputError(
            f"node.supply_voltage must be one of chip {table.name!r} ({has}), but {was}"
        )
    return rise or levels[0], fall or levels[1]


def output_efficiency(chip: Chip, amperes: float) -> float:
    """That of a chip's output, straight over the logarithm of its current."""
    currents, shares = np.array(chip.efficiencies).T
    return float(np.interp(math.log(max(amperes, 1e-12)), np.log(currents), shares))


def charging_efficiency(chip: Chip, volts: Floats, amperes: Floats) -> Floats:
    """That of a chip's converter at voltages and currents of its input, held beyond the ends of its table."""
    rows = np.array(chip.charging)
    grid = np.unique(rows[:, 0])
    logs = np.log(np.maximum(amperes, 1e-12))
    lines = []
    for grid_voltage in grid:
        _, currents, shares = rows[rows[:, 0] == grid_voltage].T
        lines.append(np.interp(logs, np.log(currents), shares))
    if len(grid) == 1:
        return np.asarray(lines[0])
    k = np.clip(np.searchsorted(grid, volts) - 1, 0, len(grid) - 2)
    part = np.clip((volts - grid[k]) / (grid[k + 1] - grid[k]), 0.0, 1.0)
    both = np.array(lines)
    every = np.arange(len(volts))
    return np.asarray(both[k, every] + part * (both[k + 1, every] - both[k, every]))


def tracked_power(chip: Chip, table: AnyCurrent) -> Floats:
    """The power (W) into the storage in the windows of a record, or in one of excitation that always is alike.

    The input is held at the voltage that the last look found.
    """
    assert chip.ratio is not None, "asked of a chip that tracks"
    voltages = table.voltages
    current = np.atleast_2d(table.current)
    length = table.length
    looks = (
        np.arange(len(current))
        if length >= chip.period
        else np.arange(len(current)) * length // chip.period
    )
    # the window of each look, and what it finds
    first = np.searchsorted(looks, looks)
    opened = np.zeros(len(current))
    for some in np.array_split(every := np.unique(first), math.ceil(len(every) / SOME)):
        opened[some] = input_without_load(chip, voltages, current[some])
    opened = np.minimum(opened[first], chip.most)
    held = chip.ratio * opened
    amperes = np.array(
        [np.interp(v, voltages, window) for v, window in zip(held, current, strict=True)]
    )
    amperes = np.where(held >= chip.least, np.maximum(amperes, 0.0), 0.0)
    # after a look
    back = np.where(amperes > 0.0, INPUT * (opened - held), 0.0) * (chip.idle > 0.0) / chip.period
    return np.asarray(
        charging_efficiency(chip, held, amperes) * held * ((1.0 - chip.idle) * amperes + back)
    )


def input_without_load(chip: Chip, voltages: Floats, current: Floats) -> Floats:
    """The voltages that looks find: those without load, or those of the input's capacitor after a look.

    From ratio times V it comes to V there, with the time C int dV/I(V).  Without a time of its own
    a look finds all.
    """
    fine = np.linspace(0.0, float(voltages[-1]), FINE)
    ratio = chip.ratio or 1.0
    came = current @ np.array([np.interp(fine, voltages, unit) for unit in np.eye(len(voltages))])
    least = np.maximum(1e-3 * current[:, :1], 1e-30)
    times = cumulative_trapezoid(INPUT / np.maximum(came, least), fine, axis=1, initial=0.0)
    part, k = np.modf(ratio * np.arange(FINE))
    k = k.astype(int)
    after = np.minimum(k + 1, FINE - 1)
    takes = times - times[:, k] - part * (times[:, after] - times[:, k])
    reached = (came <= least) | (takes > (chip.look or math.inf)) | (fine == fine[-1])
    return np.asarray(fine[reached.argmax(axis=1)])


def charging_current(chip: Chip, table: AnyCurrent, volts: Floats) -> Floats:
    """The current (A) into storage at its ``volts``, shape (n,), of a record with its windows, less the chip's own."""
    if chip.ratio is None:
        return np.asarray(table.at(volts)) - chip.quiescent
    current = np.atleast_2d(table.current)
    cold = (
        np.array([np.interp(chip.cold_voltage, table.voltages, window) for window in current])
        * chip.cold_voltage
    )
    started = np.where(
        cold >= max(chip.cold_power, 0.0), chip.cold_efficiency * np.maximum(cold, 0.0), 0.0
    )
    power = np.where(volts < chip.hand_over, started[:, None], tracked_power(chip, table)[:, None])
    return np.asarray(
        power / np.maximum(volts, LOW) - np.where(volts < chip.hand_over, 0.0, chip.quiescent)
    )


def _time(table: RectifiedCurrent, volts: float, farads: float) -> float:
    return float(times_to(np.array([volts]), table, farads, math.inf)[0])
