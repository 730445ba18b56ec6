"""A periodic response of a mass and a load circuit: its means, and the start of another one."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger
from harvester.cosimulation.poincare_sections import CoupledState
from harvester.linear.transfer import first_harmonic
from harvester.mechanics.largest_swing import Swing
from harvester.mechanics.period_map import ResponseStart, check_numbers
from harvester.mechanics.periodic import Secants

Known = tuple[float, float, float]
"""Mean power of Rload (W), mean square of the terminals' voltage (V^2), and the seconds that they cover."""

NODE = re.compile(r"[!-'*-~]{1,200}")  # a name in a netlist: no blank and no bracket


@dataclass(frozen=True)
class Neighbour(ResponseStart):
    """All of a periodic response that the way to one of an excitation a little different begins with.

    It comes back after ``turns`` periods of the excitation, and is at ``section`` at the part
    ``phase`` of a period; ``secants`` are the differences on the way there, for the ways to
    neighbouring responses, ``farads`` the load's Csmooth, and ``quiet`` how far the section is from
    turns of the motion, as a part of a period.
    """

    section: CoupledState
    phase: float
    turns: int
    secants: Secants | None
    farads: float
    quiet: float

    def to_json(self) -> dict[str, Any]:
        """The numbers for a file."""
        ways = (
            None
            if self.secants is None
            else {name: values.tolist() for name, values in vars(self.secants).items()}
        )
        numbers = {name: getattr(self, name) for name in ("phase", "turns", "farads", "quiet")}
        section = asdict(self.section)
        if not self.section.higher_modes:
            del section["higher_modes"]
        return {"section": section, **numbers, "secants": ways}

    @classmethod
    def from_json(cls, state: Mapping[str, Any]) -> Self:
        """As of `ResponseStart`; names of nodes enter a netlist, and must be no more than names."""
        section = state["section"]
        x, v = (float(section[name]) for name in ("x", "v"))
        nodes = {str(name): float(volts) for name, volts in section["nodes"].items()}
        phase, farads, quiet = (float(state[name]) for name in ("phase", "farads", "quiet"))
        higher = tuple(map(float, section.get("higher_modes", ())))
        turns = int(state["turns"])
        check_numbers(turns, [x, v, *higher, phase, farads, quiet, *nodes.values()])
        if len(higher) % 2 or not all(map(NODE.fullmatch, nodes)):
            raise ValueError("no state of mass and circuit")
        ways = state["secants"]
        secants = None
        if ways:
            secants = Secants(
                **{name: np.array(values, dtype=float) for name, values in ways.items()}
            )
        section = CoupledState(x, v, nodes, higher_modes=higher)
        return cls(section, phase, turns, secants, farads, quiet)


@dataclass(frozen=True)
class PeriodicResponse(Neighbour, Swing):
    """A response that comes back, and its means.

    ``power`` (W) of Rload, ``square`` (V^2) of the terminals and ``ledger`` are means over whole
    periods; ``left`` is the part of power and square that settling further may change; ``periods``
    and ``steps`` are those of all ngspice runs on the way.  ``wave``, shape (steps, 2), has x and V
    (nondimensional) at each kick from the section on, until it comes back.  ``probed`` is as of
    `harvester.cosimulation.runs.TrajectoryMeans`, None if the device has no probes.
    """

    power: float
    square: float
    ledger: EnergyLedger
    left: Floats
    periods: float
    steps: int
    wave: Floats
    probed: Floats | None = None

    @property
    def motion(self) -> Floats:
        """As of `Swing`."""
        return self.wave

    @property
    def harmonics(self) -> tuple[complex, complex]:
        """The complex amplitudes of x and V at the excitation's frequency (`harvester.linear.transfer`)."""
        turn = len(self.wave) // self.turns  # kicks in a period; the first is one after the section
        angles = 2.0 * math.pi * (self.phase + np.arange(1, len(self.wave) + 1) / turn)
        return first_harmonic(self.wave[:, 0], angles), first_harmonic(self.wave[:, 1], angles)


def later_half(runs: Sequence[Known]) -> Known | None:
    """The means over the last runs that make half of the time of all; None if nothing was covered.

    The first half is the way from rest.  A response that settles is near its end in the second; one
    that never does, such as a chip's that switches on and off, has both in it.
    """
    half = sum(seconds for *_, seconds in runs) / 2.0
    covered = 0.0
    sums = [0.0, 0.0]
    for power, square, seconds in reversed(runs):
        if covered >= half:
            break
        sums = [sums[0] + power * seconds, sums[1] + square * seconds]
        covered += seconds
    return (sums[0] / covered, sums[1] / covered, covered) if covered > 0.0 else None
