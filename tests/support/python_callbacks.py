"""The lock-step's callbacks in plain Python: the same functions, interpreted, to test the compiled ones against.

They cost 5 to 40 times as much.
"""

import ctypes
import math
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation import runs
from harvester.cosimulation.lockstep.drive import Drive
from harvester.cosimulation.lockstep.state import Point
from harvester.cosimulation.lockstep.transitions import accept_point, proposed_step, source_voltage
from harvester.errors import UnboundedResponseError
from harvester.mechanics.kernels.compiled import interpreted
from harvester.mechanics.kernels.path import Path


class PythonCallbacks:
    """The three callbacks of one run, in Python; ``state`` is ngspice's copy of the drive's, one element.

    ngspice cannot pass on an exception, and would read a source without a value: the first
    exception is kept in ``error``, to be raised after the run, and from then on the source holds
    its last finite value.
    """

    def __init__(self, drive: Drive, state: Any) -> None:
        self.drive = drive
        self.state = state.view(np.recarray)[0]
        self.error: Exception | None = None
        self.last = 0.0
        self._source_voltage, self._proposed_step = (
            interpreted(source_voltage),
            interpreted(proposed_step),
        )
        self._accept_point = interpreted(accept_point)
        number = ctypes.CFUNCTYPE(
            ctypes.c_double, ctypes.c_void_p, ctypes.c_double, ctypes.c_double
        )
        point = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, *5 * [ctypes.c_double])
        self._pointers = {
            "source_at": number(self.source),
            "step_at": number(self.step),
            "accepted_at": point(self.data),
        }
        for name, pointer in self._pointers.items():
            drive.state[name] = ctypes.cast(pointer, ctypes.c_void_p).value

    def source(self, _: int, t: float, __: float) -> float:
        """Voltage of the source at a candidate time."""
        if self.error is None:
            try:
                value = float(self._source_voltage(self.state, t))
                if not math.isfinite(value):
                    raise UnboundedResponseError(f"the source's voltage is not finite at {t:.6g} s")
                self.last = value
            except Exception as error:
                self.error = error
        return self.last

    def step(self, _: int, t: float, delta: float) -> float:
        """Length of the step that ngspice is about to try."""
        if self.error is None:
            try:
                return float(self._proposed_step(self.state, t, delta))
            except Exception as error:
                self.error = error
        return delta

    def data(self, _: int, t: float, v: float, power: float, current: float, smooth: float) -> int:
        """Take an accepted point."""
        if self.error is None:
            drive = self.drive
            try:
                self._accept_point(
                    self.state,
                    Point(t, v, power, current, smooth),
                    drive.recording,
                    drive.coefficients,
                )
            except Exception as error:
                self.error = error
        return 0


def path_in_python(
    device: runs.CoupledDevice, noise: Floats, shaking: Floats | None = None
) -> Path:
    """As `harvester.cosimulation.runs.path_in_this_process`, with these callbacks."""
    return run_in_python(device, runs.new_drive(device, noise, shaking=shaking)).path()


def run_in_python(
    device: runs.CoupledDevice, drive: Drive, kind: type[PythonCallbacks] = PythonCallbacks
) -> Drive:
    """As `harvester.cosimulation.runs.run_in_this_process`, with these callbacks; raises their first exception."""
    from harvester.cosimulation.ngspice.instance import ngspice

    callbacks = kind(drive, ngspice().state)
    try:
        return runs.run_in_this_process(device, drive)
    finally:
        if callbacks.error is not None:
            raise callbacks.error
