"""The engines: scene -> Estimate.  What each computes, what it serves, what error it states."""

import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from harvester.errors import CannotServeError, invalid, unknown
from harvester.estimate import Estimate, Value
from harvester.scaling import Equations, Scales, effects, equations, scales
from harvester.scene import Scene

Progress = Callable[[float], None]  # told the fraction done
DOUBTFUL = 0.05  # estimated model error of `averaged` that brings a warning
READING = 0.4  # nondimensional time between readings: V^2 varies on the scale of 1

STOP_WARNING = (
    "with a stop the published V, harmonic about zero, is wrong: the true V has no mean and only even harmonics, so "
    "E[V^2] and the power come out too high, about four times at the paper's parameters: use 'averaged', 'ensemble' "
    "or 'spice'"
)


class Engine(Protocol):
    """What all engines have in common."""

    NAME: ClassVar[str]

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """The stationary mean square voltage and mean power of a scene."""
        ...


@dataclass(frozen=True)
class Published:
    """The paper's stochastic averaging, misprints corrected, V decoupled harmonically.

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "published"

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """E[V^2] of the paper's Eq. 30 and E[P] = beta mu E[V^2] of Eq. 31, on any scene with noise."""
        from harvester.averaging.stationary import mean_square_voltage

        eqs = _resistive(scene, self.NAME)
        begin = time.perf_counter()
        v2 = Value(mean_square_voltage(eqs))
        seconds = time.perf_counter() - begin
        reason = "no sampling error: a formula; its model error is not known from within"
        warnings = (STOP_WARNING,) if eqs.restitution is not None else ()
        return _estimate(self.NAME, scene, eqs, v2, None, seconds, 0, reason, warnings)


@dataclass(frozen=True)
class Averaged:
    """Impact-aware two-scale averaging (`harvester.averaging.two_scale`), with an estimate of its own error.

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "averaged"

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """E[V^2] of the two-scale theory and E[P] = beta mu E[V^2]."""
        from harvester.averaging.two_scale import solve

        eqs = _resistive(scene, self.NAME)
        begin = time.perf_counter()
        law = solve(eqs)
        seconds = time.perf_counter() - begin
        v2 = Value(law.mean_square_voltage, model=law.bias * law.mean_square_voltage)
        warnings = []
        if law.bias > DOUBTFUL:
            why = (
                "noise and impacts change much of the energy in one cycle"
                if law.exchange > 0.3
                else "coupling is strong"
            )
            warnings.append(
                f"averaging is doubtful here (estimated error {law.bias:.0%}): {why}; check with 'ensemble'"
            )
        if eqs.restitution is not None and eqs.restitution < 0.5:
            warnings.append(f"no averaging is reliable for a restitution coefficient of {eqs.restitution:g}, below .5")
        details = {"exchange_per_cycle": law.exchange, "slow_share": law.slow / law.mean_square_voltage}
        reason = "no sampling error: a theory; the model's error is estimated from its small parameters"
        return _estimate(self.NAME, scene, eqs, v2, None, seconds, 0, reason, tuple(warnings), details)


@dataclass(frozen=True, kw_only=True)
class _Sampled:
    """Options of the engines that sample.

    within
        relative 95 % error to reach in the mean power, such as .01; None: one round.
    budget
        seconds after which no further round begins.
    duration, dt
        of a trajectory after its burn-in, and the step: in second for a physical scene, else
        nondimensional; None: chosen from the scene.
    """

    within: float | None = None
    budget: float | None = None
    seed: int = 0
    duration: float | None = None
    trajectories: int | None = None
    dt: float | None = None

    def __post_init__(self) -> None:
        for name in ("within", "budget", "duration", "dt"):
            value = getattr(self, name)
            if value is not None and not (value > 0.0 and math.isfinite(value)):
                raise invalid(f"--{name}", "be above 0", value)
        if self.within is not None and not 1e-5 <= self.within < 1.0:
            raise invalid("--within", "be between 0.001% and 100%", f"{self.within:.3g}")
        if self.trajectories is not None and not 2 <= self.trajectories <= 1_000_000:
            raise invalid("--trajectories", "be between 2 and 1000000", self.trajectories)
        if self.seed < 0:
            raise invalid("--seed", "be at least 0", self.seed)

    def _reached(self, value: Value, begin: float, warnings: list[str]) -> bool:
        """Whether to stop; a target that the budget does not allow becomes a warning."""
        if self.within is None or value.error95 <= self.within * abs(value.value):
            return True
        if self.budget is not None and time.perf_counter() - begin > self.budget:
            reached = value.error95 / abs(value.value) if value.value else math.inf
            warnings.append(f"--within {self.within:.3g} was not reached in {self.budget:g} s: it is {reached:.2g}")
            return True
        return False


@dataclass(frozen=True, kw_only=True)
class Ensemble(_Sampled):
    """Monte Carlo of the fully coupled equations (Eq. 2) with the exact RC update.

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    UnboundedResponseError
        where no stationary response exists.
    """

    NAME: ClassVar[str] = "ensemble"
    TRAJECTORIES: ClassVar[int] = 4096

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """Burn in until the start is forgotten, then average over time and trajectories."""
        from harvester.mechanics import ensemble as mc

        eqs = _resistive(scene, self.NAME)
        unit = scales(scene).frequency if scene.physical else 1.0
        seed = np.random.SeedSequence(self.seed)
        h = None if self.dt is None else self.dt * unit
        mc.Ensemble(eqs, 1, np.random.SeedSequence(0), 1e-3).run(0.01)  # compile
        begin = time.perf_counter()
        many = mc.Ensemble(eqs, self.trajectories or self.TRAJECTORIES, seed, h)
        warnings = many.settle()
        duration = many.time if self.duration is None else self.duration * unit
        pair = mc.StepPair(many, duration)
        while True:
            v2 = Value(*pair.fine.mean("V2"), pair.bias)
            if self._reached(_with_power(v2, eqs), begin, warnings):
                break
            assert self.within is not None
            if pair.bias > 0.3 * self.within * v2.value and pair.bias > 2.0 * pair.bias_error:
                if h is not None:
                    warnings.append(f"--within {self.within:.3g} needs a step below --dt {self.dt:g}")
                    break
                pair = mc.StepPair(many.with_step(0.5 * pair.many.h), duration)
            else:
                pair.extend()
        many, moments = pair.many, pair.fine
        seconds = time.perf_counter() - begin
        if eqs.mu is None:
            warnings.append("open circuit: V keeps the offset that it started with, and takes no power")
        details = {"step": many.h / unit, "burn_in": pair.burn_in / unit, "duration": pair.duration / unit}
        details["trajectories"] = many.trajectories
        details["power_balance"], details["power_balance_stderr"] = _balance(moments, eqs)
        return _estimate(self.NAME, scene, eqs, v2, None, seconds, pair.steps, "", tuple(warnings), details, moments.V2)


@dataclass(frozen=True, kw_only=True)
class Spice(_Sampled):
    """The fully coupled equations, the electrical side a netlist in ngspice in lock-step with the mass.

    Raises
    ------
    MissingProgramError
        when ngspice is not installed.
    CircuitError
        when ngspice refuses the circuit or does not converge.
    UnboundedResponseError
        where no stationary response exists.
    """

    NAME: ClassVar[str] = "spice"
    TRAJECTORIES: ClassVar[int] = 16
    KICKS: ClassVar[int] = 2_000_000  # of all trajectories in a round, unless a duration is given

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """Independent trajectories, each its own ngspice run from rest; means after the burn-in."""
        from harvester.circuit import worker
        from harvester.mechanics.noise import child

        eqs = equations(scene)
        s = scales(scene)
        unit = s.frequency if scene.physical else 1.0
        device, burn_in, warnings, bias = self.device(scene)
        worker.warm_up(device)
        begin = time.perf_counter()
        count = self.trajectories or self.TRAJECTORIES
        duration = max(self.KICKS / count * device.h, 4.0 * burn_in)
        if self.duration is not None:
            duration = self.duration * unit
        kicks = math.ceil((burn_in + duration) / device.h / device.stride) * device.stride
        batches = int(min(max(duration // burn_in, 1), 8))
        root = np.random.SeedSequence(self.seed)
        runs: list[worker.Measured] = []
        while True:
            seeds = [child(root, len(runs) + k) for k in range(count)]
            for one in worker.measure_apart(device, seeds, kicks, burn_in, batches):
                runs.append(one)
                if progress is not None:
                    progress(((len(runs) - 1) % count + 1) / count)
            moments = runs[0].moments
            for one in runs[1:]:
                moments = moments + one.moments
            v2 = Value(*moments.mean("V2"))
            v2 = dataclasses.replace(v2, bias=None if bias is None else bias * v2.value)
            power = self._load_power(runs, s, v2) if scene.load is not None and scene.load.netlist else None
            if self._reached(power or _with_power(v2, eqs), begin, warnings):
                break
        seconds = time.perf_counter() - begin
        details = {"step": device.h / unit, "burn_in": burn_in / unit, "duration": duration / unit}
        details["trajectories"] = len(runs)
        details["power_balance"], details["power_balance_stderr"] = _balance(moments, eqs)
        if power is not None:  # the balance holds for the load resistor only
            del details["power_balance"], details["power_balance_stderr"]
        steps = sum(one.steps for one in runs)
        names = (*effects(eqs), "netlist") if power is not None else effects(eqs)
        reason = "" if power is None else "the bias of the step is not known for a netlist: compare with half of --dt"
        if not scene.physical:
            reason = (
                f"ngspice ran on a device of {s.mass:g} kg, w0 = {s.frequency:g} rad/s, Cp = {s.capacitance:g} F, "
                f"theta = {s.coupling:.4g} N/V; results are nondimensional"
            )
        answer = _estimate(
            self.NAME, scene, eqs, v2, power, seconds, steps, reason, tuple(warnings), details, moments.V2
        )
        return dataclasses.replace(answer, effects=names)

    def device(self, scene: Scene) -> tuple[Any, float, list[str], float | None]:
        """What runs, its burn-in (nondimensional), warnings, and the step's relative bias in E[V^2].

        Step, burn-in and bias come from an ensemble: with a load resistor it makes the same steps.
        """
        from harvester.circuit import worker
        from harvester.circuit.library import find_library
        from harvester.circuit.netlist import load_circuit
        from harvester.mechanics import ensemble as mc
        from harvester.scene import Load

        find_library()
        eqs, s = equations(scene), scales(scene)
        unit = s.frequency if scene.physical else 1.0
        load = scene.load
        if not scene.physical and eqs.mu is not None:
            load = Load(resistance=s.resistance(eqs.mu))
        if load is None:
            raise CannotServeError("engine 'spice' must have a load, but the circuit is open: use engine 'ensemble'")
        circuit = load_circuit(load)
        if eqs.n1 is None:
            raise CannotServeError("engine 'spice' starts at rest and needs external noise: use engine 'ensemble'")
        seed = np.random.SeedSequence([self.seed, 1])
        pilot = mc.Ensemble(eqs, Ensemble.TRAJECTORIES, seed, None if self.dt is None else self.dt * unit)
        warnings = pilot.settle()
        burn_in = pilot.time
        bias = None
        if circuit.linear:
            pair = mc.StepPair(pilot, burn_in)
            bias = pair.bias / pair.fine.mean("V2")[0]
        stride = max(1, round(READING / pilot.h))
        return worker.Device(eqs, s, circuit, pilot.h, stride), burn_in, warnings, bias

    @staticmethod
    def _load_power(runs: list[Any], s: Scales, v2: Value) -> Value:
        """Mean power of Rload, nondimensional, over the trajectories."""
        from harvester.mechanics.moments import mean_and_error

        mean, error = mean_and_error(np.array([one.load_power for one in runs]) / s.watts)
        return Value(mean, error, None if v2.bias is None else mean * v2.bias / v2.value)


ENGINES: dict[str, type[Published] | type[Averaged] | type[Ensemble] | type[Spice]] = {
    engine.NAME: engine for engine in (Published, Averaged, Ensemble, Spice)
}


def engine(name: str, **options: Any) -> Engine:
    """An engine by its name; ``options`` (see `Ensemble`) are checked for all and used by those that sample.

    Raises InputError for an unknown name, with the nearest match, or an option out of range.
    """
    if name not in ENGINES:
        raise unknown("engine", name, ENGINES)
    Ensemble(**options)  # refuses a wrong option, also where the engine samples nothing and needs none
    kind = ENGINES[name]
    return kind(**options) if dataclasses.fields(kind) else kind()


def _resistive(scene: Scene, engine: str) -> Equations:
    if scene.load is not None and scene.load.netlist is not None:
        raise CannotServeError(
            f"engine {engine!r} must have a load resistance, but the load is netlist {scene.load.netlist!r}: "
            "use engine 'spice'"
        )
    return equations(scene)


def _with_power(v2: Value, eqs: Equations) -> Value:
    """E[P] = beta mu E[V^2] (paper, Eq. 31), nondimensional."""
    return v2.scaled((eqs.beta or 0.0) * (eqs.mu or 0.0))


def _balance(moments: Any, eqs: Equations) -> tuple[float, float]:
    from harvester.mechanics.moments import mean_and_error

    if eqs.n1 is None and eqs.n2 is None:
        return 0.0, 0.0
    return mean_and_error(moments.balance(eqs))


def _estimate(
    engine: str,
    scene: Scene,
    eqs: Equations,
    v2: Value,
    power: Value | None,
    seconds: float,
    steps: int,
    reason: str,
    warnings: tuple[str, ...],
    details: dict[str, float] | None = None,
    samples: Any = None,
) -> Estimate:
    """Put a nondimensional E[V^2] and, where it is not beta mu E[V^2], E[P] into the scene's units."""
    power = _with_power(v2, eqs) if power is None else power
    s = scales(scene)
    physical = scene.physical
    return Estimate(
        engine=engine,
        physical=physical,
        mean_square_voltage=v2.scaled(s.volts**2) if physical else v2,
        mean_power=power.scaled(s.watts) if physical else power,
        nondimensional={
            "mean_square_voltage": v2.value,
            "mean_power": power.value,
            "beta": eqs.beta,
            "mu": eqs.mu,
        },
        effects=effects(eqs),
        seconds=seconds,
        steps=steps,
        reason=reason,
        warnings=warnings,
        details=details or {},
        samples=samples,
    )
