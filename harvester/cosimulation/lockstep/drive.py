"""The mass of one run in lock-step with ngspice: its state, its noise, and the record of its path."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.lockstep.modal_drift import begin_modes, next_target
from harvester.cosimulation.lockstep.rigid_stop import plan_impact
from harvester.cosimulation.lockstep.state import BEYOND, STATE, Recording
from harvester.cosimulation.lockstep.transitions import next_event
from harvester.equations.coefficients import Equations
from harvester.equations.effects import BEYOND_CIRCUITS
from harvester.errors import CannotServeError, SimulationError
from harvester.mechanics.kernels.coefficients import BATCH, State
from harvester.mechanics.kernels.compiled import interpreted
from harvester.mechanics.kernels.equation_of_motion import kick
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.path import COLUMNS, Path, between_kicks, room_for_impacts
from harvester.mechanics.trace import mechanics_of
from harvester.presentation.diagnostic import refusal

NARROW = (
    "the stops must be so far apart that the mass meets them at most twice a step in lock-step with ngspice, but it "
    "meets them more often: use engine 'ensemble'"
)


def _numbers(coefficients: Any) -> list[float]:
    """All numbers of coefficients, 0 for None, in the order in which compiled callbacks read them."""
    if not isinstance(coefficients, tuple):
        return [0.0 if coefficients is None else coefficients]
    return [number for coefficient in coefficients for number in _numbers(coefficient)]


class Drive:
    """The mass of one run, which ngspice drives through its callbacks.

    Parameters
    ----------
    eqs
        nondimensional equations; mu plays no part here, as the circuit is ngspice's.
    volts, w0
        theta l/Cp in volt, and the short-circuit natural frequency in rad/s.
    noise
        one standard normal variate a kick, shape (n,).
    h, stride
        nondimensional step, and kicks between samples.
    start
        (x, x', V, voltage of Csmooth) at the beginning, of several modes as of
        `harvester.mechanics.trace.SeveralModes.started`; None: at rest in the first of
        `resting_places`.
    free
        whether ngspice may use smaller steps of its own between targets.
    since
        nondimensional time at which the energy balance begins.
    shaking
        as of `harvester.mechanics.trace.trace`.
    smooth
        whether drifts bend (`source_voltage`), as they may if neither white noise nor a
        compliant stop acts.

    Attributes
    ----------
    state
        the record of the run, one element of dtype `STATE`.
    coefficients
        of the equations, without mu.
    samples, charge, impacts
        the trajectory at the samples, shape (n, 5); the voltage (V) of the load's Csmooth there;
        time and velocity of each impact.
    kicked
        ahead of each kick x, x', V and the voltage of Csmooth, and the energy into the load
        (J), shape (kicks, 5). If the run ``follows`` another, by that field of the state, this
        begins as the other's record: the force on the mass is that of its voltages, and so the
        motion is the same.
    smoothing
        capacitance of the load's Csmooth (F) once the run is over, 0 without one.
    nodes
        voltage (V) of each node and current (A) of each inductor at the last kick once the run is
        over, if its deck keeps them.
    currents
        of inductors (A) at the beginning, by the names of their vectors.
    earlier, nodes_earlier
        the voltages of ``nodes`` so many kicks before the last one; empty for 0.
    series
        vectors of ngspice by name at all accepted points, and their ``time`` (s), if its deck
        has probes.
    """

    def __init__(
        self,
        eqs: Equations,
        volts: float,
        w0: float,
        noise: Floats,
        h: float,
        stride: int = 1,
        start: tuple[float, float, float, float] | None = None,
        free: bool = False,
        since: float = math.inf,
        shaking: Floats | None = None,
        smooth: bool = False,
    ) -> None:
        if unknown := [name for name in eqs.effects if name in BEYOND_CIRCUITS]:
            raise CannotServeError(refusal("beyond_ngspice", effects=" and ".join(unknown)))
        self.smoothing = 0.0
        self.nodes = dict[str, float]()
        self.series = dict[str, Floats]()
        self.currents = dict[str, float]()
        self.earlier = 0
        self.nodes_earlier = dict[str, float]()
        count = len(noise) // stride
        self.noise = np.ascontiguousarray(noise[: count * stride])
        self.shaking = (
            forcing(eqs, h, len(noise)) if shaking is None else np.ascontiguousarray(shaking)
        )
        self.samples = np.zeros((count, len(COLUMNS)))
        self.charge = np.zeros(count)
        self.kicked = np.zeros((len(self.noise), 5))
        self.impacts = room_for_impacts(eqs, len(self.noise))
        start = (eqs.resting_places[0], 0.0, 0.0, 0.0) if start is None else start
        self.modes = None
        self.coordinates = None
        self.coefficients: Any = mechanics_of(replace(eqs, mu=None)).coefficients
        if eqs.modes is not None:
            self.modes = np.zeros((3, (2 * eqs.modes.count + 1) * BATCH))
            self.coordinates = np.zeros((count, 2, eqs.modes.count))
            self.modes[0, ::BATCH] = y = mechanics_of(eqs).started(start)
            # as the circuit sees it
            start = (float(np.dot(eqs.modes.coupling, y[: eqs.modes.count])), *start[1:4])
        self.eqs = eqs
        self.start = start
        self._numbers = np.array(_numbers(self.coefficients))
        self.state = state = np.zeros(1, STATE).view(np.recarray)
        state["h"] = h
        state["w0"] = w0
        state["volts"] = volts
        state["since"] = since / w0
        state["stride"] = stride
        state["free"] = free
        state["has_beta"] = eqs.beta is not None
        state["noise_size"], state["impacts_size"] = len(self.noise), len(self.impacts)
        for name, array in (*self.recording._asdict().items(), ("coefficients", self._numbers)):
            state[f"{name}_at"] = 0 if array is None else array.ctypes.data
        self._begin(smooth)

    def _begin(self, smooth: bool) -> None:
        """Begin the first drift.  Half a kick comes first, as in `trace`.

        Interpreted: not worth a compilation.
        """
        state = self.state
        start = self.start
        c = self.coefficients
        if self.modes is not None:
            begin_modes(state[0], self.modes, self.shaking, c)
            interpreted(next_target)(state[0], self.impacts)
            return
        a = None if self.shaking is None else float(self.shaking[0])
        speed = float(interpreted(kick)(State(*start[:3]), 0.0, 0.5 * state["h"][0], c, a))
        state["x"] = start[0]
        state["v"] = speed
        state["meet"] = math.inf
        if c.r is not None and c.n1 is None:
            mean, _ = interpreted(between_kicks)(self.shaking, 1)
            interpreted(plan_impact)(state[0], start[2], mean, c)
        if smooth:
            straight = state["meet"][0] < math.inf
            state["smooth"] = 1
            state["bend"] = 0.0 if straight else (speed - start[1]) / (0.5 * state["h"][0])
        interpreted(next_event)(state[0], self.impacts, c)

    @property
    def recording(self) -> Recording:
        """The arrays of the run, as arguments of the callbacks."""
        return Recording(
            noise=self.noise,
            shaking=self.shaking,
            samples=self.samples,
            impacts=self.impacts,
            charge=self.charge,
            kicked=self.kicked,
            modes=self.modes,
            coordinates=self.coordinates,
        )

    @property
    def last(self) -> Floats:
        """The state just after the last kick of the finished run: coordinates, speeds and V.

        One mode has those of its last sample, which is of that kick.
        """
        if self.modes is None:
            return np.asarray(self.samples[-1, [0, 3, 1]])
        return np.asarray(self.modes[0, ::BATCH])

    @property
    def motion(self) -> Floats:
        """The x and x' of each sample, and those of further modes likewise, shape (n, 2 modes)."""
        if self.coordinates is None:
            return np.asarray(self.samples[:, [0, 3]])
        first = self.coordinates[:, :, :1]
        higher = self.coordinates[:, :, 1:]
        return np.column_stack([part.reshape(len(part), -1) for part in (first, higher)])

    @property
    def contact_speeds(self) -> Floats:
        """The speed of each sample of the coordinate that meets the stops."""
        if self.coordinates is None:
            return np.asarray(self.samples[:, 3])
        return np.asarray(self.coordinates[:, 1] @ np.array(self.eqs.modal.contact))

    @property
    def duration(self) -> float:
        """Time that ngspice has to run, in second: to the last sample and a little beyond."""
        s = self.state[0]
        return float((s.noise_size + BEYOND) * s.h / s.w0)

    def path(self) -> Path:
        """The trajectory of the finished run, in the form of `harvester.mechanics.trace.trace`.

        Raises SimulationError for more than two impacts a step: the stops are too near each other.
        """
        s = self.state[0]
        if s.impacts > len(self.impacts):
            raise SimulationError(NARROW)
        return Path(
            float(s.h),
            int(s.stride),
            self.samples,
            self.impacts[: s.impacts].copy(),
            self.shaking,
            coordinates=self.coordinates,
        )
