"""A chip that holds its input, under noise: its law without mean currents, compared with them on the same noise.

Each run looks when the chip does: its input, a capacitor of `INPUT`, is left alone for the time of
a look, from the voltage at which it was held, and is then held at the chip's ratio of the voltage
that it came to.  The charge that the held input gains flows to the storage capacitor, and the
charge that the look brought above that voltage.  The same runs with an input always held, at the
voltage that the mean current determines, are corrected (two levels).

For a long period the first `FADED` time constants of the mass are run, after which the look is
forgotten; for the rest the input gains the mean current at its voltage.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.bought_parts import Chip
from harvester.storage.held_stores import StoresOfMany, enough_runs
from harvester.storage.measured_current import FADED, RUNS, Rectifier, time_constant
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.slow_circuit import DIRECT, JUDGED, change_at_95
from harvester.storage.supply import INPUT, charging_efficiency, input_without_load
from harvester.uncertainty.paired_difference import difference95, share95

SETTLING = 2  # looks before those that count, beside those in which the mass forgets its start
STARTED = 10  # vibrations over which a cold start's power is a mean


class TrackedInput(NamedTuple):
    """Relative excess of the charge by a chip's law over mean currents, and its error (95 %).

    ``error`` is of sampling; ``elements`` is the change by a step of twice the length and the
    netlist's own elements. ``cold`` is the fraction of the charge to a cold input that comes at a
    power at which the cold start continues.
    """

    gain: float
    error: float
    elements: float
    cold: float
    steps: int

    def correct(self, chip: Chip) -> Chip:
        """The chip that by mean currents acts as by its law."""
        other = chip.charging_by(1.0 + self.gain)
        return replace(other, cold_power=0.0, cold_efficiency=self.cold * chip.cold_efficiency)


def tracked_input(
    problem: Problem, table: RectifiedCurrent, chip: Chip, seed: int
) -> TrackedInput | None:
    """The law of a chip and the mean currents of a ``table``; None if these charge nothing."""
    opened = min(float(input_without_load(chip, table.voltages, table.current[None])[0]), chip.most)
    law = _Law(problem, table, chip, opened, seed)
    if law.held < chip.least or not float(table.at(np.array(law.held))) > 0.0:
        return None
    direct = law.energies(law.count)
    mean = law.energies(law.count, follows=False)
    change = difference95(direct, mean).scaled(1.0 / float(mean.mean()))
    judged = enough_runs(problem.equations, JUDGED)
    elements = change_at_95(law.energies(judged, twice=True), direct)
    if law.rectifier.ideal:
        elements += change_at_95(law.energies(judged, compiled=True), direct)
    cold, cold_error = law.cold_share() if chip.cold_power > 0.0 else (1.0, 0.0)
    return TrackedInput(
        gain=change.value,
        error=change.sampling95 + cold_error,
        elements=elements,
        cold=cold,
        steps=law.steps,
    )


class _Law:
    """Runs of a chip by its law, whose mean current would hold the input at ``held`` (V)."""

    def __init__(
        self, problem: Problem, table: RectifiedCurrent, chip: Chip, opened: float, seed: int
    ) -> None:
        self.problem = problem
        self.table = table
        self.chip = chip
        self.opened = opened
        self.rectifier = Rectifier(problem)
        self.held = (chip.ratio or 1.0) * opened
        self.steps = 0
        runs = RUNS if self.rectifier.ideal else 2 * JUDGED
        self.count = enough_runs(problem.equations, runs)
        self.unit = time_constant(problem.equations)
        self.w0 = problem.scales.frequency
        self.root = np.random.SeedSequence([seed, 15])
        self.rest = (chip.period - chip.look) * self.w0  # nondimensional time between looks
        self.part = min(FADED * self.unit, self.rest)  # of it, that is run

    def _runs(self, count: int, compiled: bool, twice: bool) -> tuple[StoresOfMany, StoresOfMany]:
        """The same runs with a held input, and with a free one; a look has whole steps."""
        step = step_from_rest(self.problem.equations)
        look = self.chip.look * self.w0
        h = look / (2 * math.ceil(look / (2.0 * step))) if look else step
        circuit = self.rectifier.compiled if compiled else self.rectifier.fast
        held = circuit(self.rectifier.held)
        alone = circuit(INPUT)
        runs = Trajectories(self.problem.equations, count, self.root, h, circuit=held)
        runs = runs.coarser() if twice else runs
        runs.stride = 1 if twice else 2
        scales = self.problem.scales
        return (
            StoresOfMany(runs, held, self.rectifier.held, scales),
            StoresOfMany(runs, alone, INPUT, scales),
        )

    def energies(
        self, count: int, follows: bool = True, compiled: bool = False, twice: bool = False
    ) -> Floats:
        """The energy (J) that each run puts into its storage by the law, or with an input that is always held."""
        chip = self.chip
        table = self.table
        w0 = self.w0
        held, alone = self._runs(count, compiled, twice)
        before = SETTLING + math.ceil(FADED * self.unit / (chip.period * w0))
        looks = before + math.ceil(DIRECT * self.unit / (chip.look * w0 + self.part))
        # s
        rest = self.rest / w0
        missing = (self.rest - self.part) / w0
        volts, seen = np.full(held.runs.count, self.held), np.full(held.runs.count, self.opened)
        shape = (held.runs.blocks, -1)
        total = np.zeros(held.runs.count)
        for k in range(looks):
            if chip.look:
                gained = alone.advance(volts.reshape(shape), chip.look * w0).charges
            if follows and chip.look:
                seen = np.minimum(volts + gained / INPUT, chip.most)
                volts = (chip.ratio or 1.0) * seen
            charge, _, seconds = held.advance(volts.reshape(shape), self.part)
            charge = charge * (self.part / w0 / seconds) + table.at(volts) * missing
            share = charging_efficiency(chip, volts, charge / rest) * (volts >= chip.least)
            total += (
                (k >= before)
                * share
                * volts
                * (charge + INPUT * (seen - volts) * (chip.look > 0.0))
            )
        self.steps += held.runs.steps
        return np.asarray(total.reshape(-1, held.together).mean(axis=1))

    def cold_share(self) -> tuple[float, float]:
        """The fraction of the charge of an input at a cold start's voltage that comes at enough power, and its error.

        The power is a mean over `STARTED` vibrations.
        """
        chip = self.chip
        (held, _) = self._runs(self.count, False, False)
        count = STARTED + math.ceil(DIRECT * self.unit / (2.0 * math.pi))
        held.advance(chip.cold_voltage, FADED * self.unit)
        power = np.zeros(held.runs.count)
        taken = np.zeros((2, held.runs.count))
        for k in range(count):
            charge, _, seconds = held.advance(chip.cold_voltage, 2.0 * math.pi)
            power += (charge * chip.cold_voltage / seconds - power) / (STARTED if k else 1.0)
            taken += (
                (k >= STARTED) * charge * np.array([power >= chip.cold_power, np.ones(len(power))])
            )
        self.steps += held.runs.steps
        some, every = taken.reshape(2, -1, held.together).mean(axis=2)
        share = float(some.mean() / every.mean())
        return share, share95(difference95(some, share * every), float(every.mean()))
