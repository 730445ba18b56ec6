"""A run of a model of the user's own: its record, its noise, and its readings, which callbacks fill."""

from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.lockstep.any_mechanics import ModelRecord
from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger
from harvester.cosimulation.lockstep.state import AFTER, BEYOND, STATE


class ModelDrive:
    """One run of n steps of h seconds, with a reading every ``stride`` of them.

    ``volts`` makes the source's voltage from the model's output, ``coupling`` the reaction of
    voltage or current; ``coil`` states which.  ``free``: ngspice may use smaller steps of its own.
    ``start`` is the model's state as an array, ``coefficients`` the model's own.
    """

    def __init__(
        self,
        start: Floats,
        coefficients: Floats,
        noise: Floats,
        h: float,
        stride: int,
        volts: float,
        coupling: float,
        coil: bool,
        free: bool,
    ) -> None:
        self.smoothing = 0.0
        self.nodes = dict[str, float]()
        self.series = dict[str, Floats]()
        steps = len(noise)
        self.at, self.coefficients = start, coefficients
        samples = np.zeros((steps // stride + 1, len(start) + 3))
        events = np.zeros(steps + 100)
        self.record = ModelRecord(noise, samples, events)
        self.state = state = np.zeros(1, STATE).view(np.recarray)
        given = {
            "h": h,
            "w0": 1.0,
            "volts": volts,
            "coupling": coupling,
            "coil": coil,
            "free": free,
            "stride": stride,
        }
        given |= {"noise_size": steps, "impacts_size": len(events), "has_beta": True}
        arrays = {
            "noise": noise,
            "samples": samples,
            "impacts": events,
            "coefficients": coefficients,
            "model": start,
        }
        for name, value in (
            given | {f"{name}_at": array.ctypes.data for name, array in arrays.items()}
        ).items():
            state[name] = value

    @property
    def duration(self) -> float:
        """Time that ngspice has to run, in second: to the last kick and a little beyond."""
        s = self.state[0]
        return float((s.noise_size + BEYOND) * s.h)

    def ledger(self, capacitance: float, linear: bool) -> EnergyLedger:
        """The energy balance of the finished run.

        ``input`` is the work of the model against the port's reaction.

        ``capacitance`` (F) is that of a piezo, 0 of a coil; ``linear``: the circuit is no more than
        a load resistor.
        """
        s: Any = self.state[0]
        time = float(s.end)
        if s.measuring != AFTER or time <= 0.0:
            return EnergyLedger()
        smooth = 0.5 * self.smoothing * float(s.smooth_end) ** 2
        piezo = 0.5 * capacitance * float(s.voltage_end) ** 2
        return EnergyLedger(
            input=float(s.voltage_work) / time,
            circuit=0.0 if linear else (float(s.delivered - s.load) - smooth) / time,
            load=float(s["load"]) / time,
            stored=(piezo + smooth) / time,
        )
