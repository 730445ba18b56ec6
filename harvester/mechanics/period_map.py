"""The map of a period: a mass with its load under a steady excitation.

Its fixed points are periodic responses.
Each kind of load has a class: `harvester.circuits.circuit_period` that of a compiled circuit, and
`harvester.cosimulation.coupled_period` that of a circuit in ngspice.  A state y has x and x', or
y and y' of all modes, and then the circuit's numbers; `harvester.mechanics.periodic` finds the one
that the map leaves as it is.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.equations.scales import Scales
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.periodic import (
    LONGEST_WAY,
    MULTIPLES,
    STALE,
    WANDERS,
    Secants,
    Settling,
    periods_that_hold,
    periods_to_settle,
)


class ResponseStart(ABC):
    """The start of the way to a response near a known one.

    The latter repeats after ``turns`` periods of the excitation.
    """

    turns: int

    @abstractmethod
    def to_json(self) -> dict[str, Any]:
        """The numbers for a file, from which `from_json` makes the same start."""

    @classmethod
    @abstractmethod
    def from_json(cls, state: Mapping[str, Any]) -> Self:
        """The start of a file's numbers.

        Raises ValueError, TypeError or KeyError for another content.
        """


def check_numbers(turns: int, numbers: Iterable[float]) -> None:
    """Raise ValueError unless numbers of a file are finite, and so many ``turns`` are sought."""
    if not (all(map(math.isfinite, numbers)) and 1 <= turns <= MULTIPLES):
        raise ValueError("no state of mass and circuit")


class PeriodMap(ABC):
    """A mass and its load that continue from where their last periods ended.

    Parameters
    ----------
    eqs : Equations
        those of the mass, under a steady excitation.
    scales : Scales
        those of the device.
    h : float
        the step, nondimensional.
    farads : float
        the storage capacitor (F), 0 without one or if it is not known yet.

    A period has ``size`` steps.  The means of a response are those of so many ``repeats`` of it.
    """

    repeats: ClassVar[int]

    def __init__(self, eqs: Equations, scales: Scales, h: float, farads: float) -> None:
        period = eqs.shaking_period
        assert period is not None, "the excitation is steady"
        self.eqs = eqs
        self.scales = scales
        self.h = h
        self.farads = farads
        self.size = round(period / h)
        accelerations = forcing(eqs, h, self.size)
        assert accelerations is not None, "the excitation is steady"
        self._accelerations = accelerations[: self.size]

    @property
    @abstractmethod
    def y(self) -> Floats:
        """The present state."""

    @property
    @abstractmethod
    def coordinates_and_speeds(self) -> int:
        """How many numbers of a state are coordinates and speeds, its first ones."""

    @property
    @abstractmethod
    def slow(self) -> Floats:
        """The memory of mass and circuit, shape (n, size of y): a matrix as of `Settling`.

        Coordinates and speeds come first, the voltage of the storage capacitor last.
        """

    @abstractmethod
    def turn(self, y: Floats, turns: int) -> tuple[Floats, Floats]:
        """The map: a state after so many periods, and the means over them.

        The latter are those of power (W), squared voltage (V^2) and x^2 + x'^2.  Raises
        CircuitError if the circuit has no way on from y.
        """

    @abstractmethod
    def wander(self, periods: int) -> int:
        """Continue for so many periods; after how many the motion at their end comes back, or 0."""

    def shaking(self, begin: int, n_steps: int) -> Floats:
        """The accelerations at the step ``begin`` of a period and after it, shape (n_steps + 1,)."""
        return np.asarray(self._accelerations[np.arange(begin, begin + n_steps + 1) % self.size])

    def periods(self, oscillations: float, least: int = 1) -> int:
        """Periods that hold so many oscillations of the mass; one of a record may hold many."""
        return periods_that_hold(oscillations, self.size * self.h, least)

    @property
    def longest(self) -> int:
        """Periods of a mass that is not linear, until it may be near a response."""
        return self.periods(LONGEST_WAY, 2 * MULTIPLES)

    def come_near(self) -> int:
        """Continue until the motion comes back; after how many periods it does, or 0.

        A leap from farther away would lead to any response.
        """
        for _ in range(WANDERS):
            if turns := self.wander(self.longest):
                return turns
        return 0

    def settling(self, turns: int, known: Secants | None = None, stale: float = STALE) -> Settling:
        """The way from the present state to the fixed point of the map of so many periods.

        ``known`` and ``stale`` are as of `Settling`.
        """
        slow = self.slow
        moving = self.coordinates_and_speeds
        circuit = len(slow) - moving
        s = self.scales
        return Settling(
            partial(self.turn, turns=turns),
            slow,
            groups=np.array(moving * [0] + circuit * [1]),
            state=self.y,
            known=known,
            stored=self.farads * s.volts**2 * s.frequency / (turns * self.size * self.h),
            stale=stale,
            swing=np.array(moving * [[0.0, 0.0, 1.0]] + circuit * [[0.0, s.volts**-2, 0.0]]),
            slowest=periods_to_settle(self.eqs, turns),
        )
