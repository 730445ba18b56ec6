"""The mass of one run in lock-step with ngspice: its state, its noise, and the record of its path."""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.lockstep.rigid_stop import plan_impact
from harvester.cosimulation.lockstep.state import COEFFICIENTS, STATE, STOPS
from harvester.cosimulation.lockstep.transitions import aim
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from harvester.mechanics.kernels.compiled import interpreted
from harvester.mechanics.kernels.equation_of_motion import kick
from harvester.mechanics.kernels.path import COLUMNS, Path, between_kicks, room_for_impacts
from harvester.mechanics.kernels.shaking import forcing

NARROW = (
    "the stops must be so far apart that the mass meets them at most twice a step in lock-step with ngspice, but it "
    "meets them more often: use engine 'ensemble'"
)


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
        nondimensional step, and kicks between readings.
    start
        (x, x', V, voltage of Csmooth) at the beginning; None: at rest in the first of `resting_places`.
    free
        whether ngspice may take smaller steps of its own between targets.
    since
        nondimensional time at which the ledger begins.
    shaking
        as of `harvester.mechanics.kernels.path.trace`.
    smooth
        whether drifts bend (`source_voltage`), as they may where neither white noise nor a compliant stop acts.

    Attributes
    ----------
    state
        the record of the run, one element of dtype `STATE`.
    coefficients
        those of `COEFFICIENTS`, in that order; None is an effect that is absent.
    readings, charge, impacts
        the path at the readings, shape (n, 5); the voltage (V) of the load's Csmooth there; time and velocity of each
        impact.
    kicked
        ahead of each kick x, x', V and the voltage of Csmooth, and the energy that the load took (J), shape (kicks, 5).
        Where the run ``follows`` another, by that field of the state, this begins as the other's record: the force on
        the mass is that of its voltages, and so the motion is the same.
    smoothing
        capacitance of the load's Csmooth (F) once the run is over, 0 without one.
    nodes
        voltage (V) of each node at the last kick once the run is over, where its deck says to keep them.
    series
        vectors of ngspice by name at all accepted points, and their ``time`` (s), where its deck has probes.
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
        self.smoothing, self.nodes, self.series = 0.0, dict[str, float](), dict[str, Floats]()
        readings = len(noise) // stride
        self.noise = np.ascontiguousarray(noise[: readings * stride])
        self.shaking = forcing(eqs, h, len(noise)) if shaking is None else np.ascontiguousarray(shaking)
        self.readings = np.zeros((readings, len(COLUMNS)))
        self.charge = np.zeros(readings)
        self.kicked = np.zeros((len(self.noise), 5))
        self.impacts = room_for_impacts(eqs, len(self.noise))
        self.state = np.zeros(1, STATE).view(np.recarray)
        start = (eqs.resting_places[0], 0.0, 0.0, 0.0) if start is None else start
        self.eqs, self.start = eqs, start
        k = eqs.stop_stiffness
        values = {**vars(eqs), "r": eqs.restitution, "high": eqs.opposite_gap, "r_high": eqs.opposite_restitution}
        values |= {"k": k, "c": None if k is None else eqs.stop_damping or 0.0}
        self.coefficients = tuple(values[name] for name in COEFFICIENTS)
        state = self.state
        for name, value in zip(COEFFICIENTS, self.coefficients, strict=True):
            state[name] = 0.0 if value is None else value
        state["h"], state["w0"], state["volts"], state["since"] = h, w0, volts, since / w0
        state["stride"], state["free"], state["has_beta"] = stride, free, eqs.beta is not None
        state["noise_at"], state["noise_size"] = self.noise.ctypes.data, len(self.noise)
        state["shaking_at"] = 0 if self.shaking is None else self.shaking.ctypes.data
        state["impacts_at"], state["impacts_size"] = self.impacts.ctypes.data, len(self.impacts)
        state["readings_at"], state["charge_at"] = self.readings.ctypes.data, self.charge.ctypes.data
        state["kicked_at"] = self.kicked.ctypes.data
        stops, others = self.coefficients[:STOPS], self.coefficients[STOPS:]
        a = None if self.shaking is None else float(self.shaking[0])
        # Half a kick comes first, as in `trace`; interpreted, for it is not worth a compilation.
        speed = float(interpreted(kick)(*start[:3], 0.0, 0.5 * h, *others, a))
        state["x"], state["v"], state["meet"] = start[0], speed, math.inf
        if eqs.restitution is not None and eqs.n1 is None:
            mean, _ = interpreted(between_kicks)(self.shaking, 1)
            press = eqs.alpha, eqs.beta, eqs.linear, eqs.alpha2
            interpreted(plan_impact)(state[0], start[2], mean, *stops[:4], *press)
        if smooth:
            straight = state["meet"][0] < math.inf
            state["smooth"], state["bend"] = 1, 0.0 if straight else (speed - start[1]) / (0.5 * h)
        interpreted(aim)(state[0], self.impacts, *stops, eqs.n1)

    @property
    def duration(self) -> float:
        """Time that ngspice has to run, in second: to the last reading and a little beyond."""
        s = self.state[0]
        return float((s.noise_size + 0.75) * s.h / s.w0)

    def path(self) -> Path:
        """The path of the finished run, in the form of `harvester.mechanics.kernels.path.trace`.

        Raises SimulationError for more than two impacts a step: the stops are too near each other.
        """
        s = self.state[0]
        if s.impacts > len(self.impacts):
            raise SimulationError(NARROW)
        return Path(float(s.h), int(s.stride), self.readings, self.impacts[: s.impacts].copy(), self.shaking)
