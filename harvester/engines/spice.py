"""Engine `spice`: Monte Carlo with the electrical side in ngspice."""

import dataclasses
import math
import time
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from harvester.engines.common import Progress, estimate, refuse, with_power
from harvester.engines.ensemble import Ensemble
from harvester.engines.sampled import Sampled, balance
from harvester.errors import CannotServeError
from harvester.estimate import Estimate, Value
from harvester.scaling import Scales, effects, equations, scales
from harvester.scene import Scene

CHARGINGS = 6.0  # time constants Rload Csmooth of a smoothing capacitor's charging in the burn-in: e^-6 is left
LONGEST_CHARGING = 2e4  # nondimensional
READING = 0.4  # nondimensional time between readings: V^2 varies on the scale of 1


@dataclass(frozen=True, kw_only=True)
class Spice(Sampled):
    """The fully coupled equations, the electrical side a netlist in ngspice in lock-step with the mass.

    Raises
    ------
    CannotServeError
        without a load or external noise, and for a compliant stop.
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
            if self._reached(power or with_power(v2, eqs), begin, warnings):
                break
        seconds = time.perf_counter() - begin
        details = {"step": device.h / unit, "burn_in": burn_in / unit, "duration": duration / unit}
        details["trajectories"] = len(runs)
        if power is None:  # the balance holds for the load resistor only
            details["power_balance"], details["power_balance_stderr"] = balance(moments, eqs)
        else:
            details |= self._ledger(runs, 1.0 if scene.physical else s.watts)
        steps = sum(one.steps for one in runs)
        names = (*effects(eqs), "netlist") if power is not None else effects(eqs)
        reason = "" if power is None else "the bias of the step is not known for a netlist: compare with half of --dt"
        if not scene.physical:
            reason = (
                f"ngspice ran on a device of {s.mass:g} kg, w0 = {s.frequency:g} rad/s, Cp = {s.capacitance:g} F, "
                f"theta = {s.coupling:.4g} N/V; results are nondimensional"
            )
        answer = estimate(
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
        circuit = load_circuit(load, s.capacitance)
        refuse(eqs, frozenset({"compliant_stop"}), "engine 'spice'", "engine 'ensemble', or a rigid stop")
        if eqs.n1 is None:
            raise CannotServeError("engine 'spice' starts at rest and needs external noise: use engine 'ensemble'")
        seed = np.random.SeedSequence([self.seed, 1])
        pilot = mc.Ensemble(eqs, Ensemble.TRAJECTORIES, seed, None if self.dt is None else self.dt * unit)
        warnings = pilot.settle()
        burn_in = pilot.time
        if circuit.storage is not None:
            charging = CHARGINGS * circuit.storage * s.frequency
            burn_in = max(burn_in, min(charging, LONGEST_CHARGING))
            if charging > LONGEST_CHARGING:
                warnings.append(
                    f"burn-in stopped at {burn_in / unit:g} before the load's capacitor was charged: "
                    f"Rload Csmooth = {circuit.storage:g} s"
                )
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

    @staticmethod
    def _ledger(runs: list[Any], watts: float) -> dict[str, float]:
        """Where the energy went, mean over the trajectories, in units of ``watts``; see `harvester.circuit.ledger`."""
        from harvester.circuit.ledger import mean

        whole = mean([one.ledger for one in runs])
        entries = {f"ledger_{name}": value / watts for name, value in vars(whole).items()}
        return entries | {"ledger_residual": whole.residual}
