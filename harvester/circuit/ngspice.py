"""ngspice in this process, through PySpice: the one file that imports it.

There is one ngspice a process, with global state; `harvester.circuit.worker` keeps it out of the
user's process.  Time and the source come from the lock-step's C functions; PySpice's own
callbacks, which find their object through the one user pointer that ngspice keeps for all,
are replaced by methods that do not use it.
"""

import logging
import math
import os
from functools import cache
from typing import Any

import numpy as np

os.environ.setdefault("OMP_NUM_THREADS", "1")  # Debian's ngspice has OpenMP on: slower for small circuits
logging.getLogger("PySpice").setLevel(logging.CRITICAL)  # "Unsupported Ngspice version" is harmless

from PySpice.Spice.Netlist import Circuit  # noqa: E402
from PySpice.Spice.NgSpice.Shared import NgSpiceShared, ffi, ffi_string_utf8  # noqa: E402

from harvester.circuit.library import find_library  # noqa: E402
from harvester.circuit.lockstep import STATE, Drive, native_data, native_source, native_sync  # noqa: E402
from harvester.circuit.netlist import LoadCircuit  # noqa: E402
from harvester.errors import CircuitError, MissingProgramError  # noqa: E402


class Ngspice(NgSpiceShared):  # type: ignore[misc]
    """PySpice's handle on the library, with callbacks that need no user pointer."""

    def __init__(self) -> None:
        self.messages: list[str] = []
        super().__init__(send_data=True)

    # The six callbacks of PySpice, as methods: cffi takes the bound method.
    def _send_char(self, message: Any, ident: int, user: Any) -> int:
        text = ffi_string_utf8(message).partition(" ")[2]  # after the name of the stream
        self.messages.append(text)
        self._stdout.append(text)
        return 0

    def _send_stat(self, message: Any, ident: int, user: Any) -> int:
        return 0

    def _exit(self, status: int, immediate: bool, quitting: bool, ident: int, user: Any) -> int:
        return status

    def _background_thread_running(self, running: bool, ident: int, user: Any) -> int:
        return 0

    def _send_data(self, *arguments: Any) -> int:
        return 0

    def _send_init_data(self, data: Any, ident: int, user: Any) -> int:
        """The vectors of the coming run: where the voltage and the load's power stand."""
        names = [ffi_string_utf8(data.vecs[i].vecname).lower() for i in range(data.veccount)]
        power = [i for i, name in enumerate(names) if name.endswith("[p]")]
        self.state["time_index"], self.state["voltage_index"] = names.index("time"), names.index("p")
        self.state["power_index"] = power[0] if power else -1
        return 0

    def _init_ngspice(self, send_data: bool) -> None:
        """PySpice's own initialisation, then ours with the lock-step's functions, once a process."""
        super()._init_ngspice(send_data)
        self.state = np.zeros(1, STATE)
        pointer = ffi.cast("void *", self.state.ctypes.data)
        self._ngspice_shared.ngSpice_Init(
            self._send_char_c,
            self._send_stat_c,
            self._exit_c,
            ffi.cast("SendData *", native_data.address),
            self._send_init_data_c,
            self._background_thread_running_c,
            pointer,
        )
        source = ffi.cast("GetVSRCData *", native_source.address)
        sync = ffi.cast("GetSyncData *", native_sync.address)
        self._ngspice_shared.ngSpice_Init_Sync(source, self._get_isrc_data_c, sync, ffi.NULL, pointer)

    def run_driven(self, netlist: str, drive: Drive) -> None:
        """Load the netlist, run its ``.tran`` with the drive's mass in lock-step, and forget both.

        Raises
        ------
        CircuitError
            with ngspice's own words when it refuses the netlist or stops before the end.
        """
        api = self._ngspice_shared
        self.state[:] = drive.record
        self.messages.clear()
        lines = [ffi.new("char[]", line.encode()) for line in [*netlist.splitlines(), ""]]
        if api.ngSpice_Circ(ffi.new("char *[]", [*lines, ffi.NULL])):
            raise CircuitError(f"ngspice refused the circuit: {self._complaint()}")
        try:
            api.ngSpice_Command(b"run")
            drive.record[:] = self.state
            end = float(drive.record["t"][0])
            if end < drive.duration * (1 - 1e-6):
                raise CircuitError(f"ngspice stopped at {end:g} s of {drive.duration:g} s: {self._complaint()}")
        finally:
            api.ngSpice_Command(b"destroy all")
            api.ngSpice_Command(b"remcirc")

    def _complaint(self) -> str:
        """What ngspice said, the lines that look like the reason, as one line."""
        told = [m.strip() for m in self.messages if any(w in m.lower() for w in ("error", "singular", "small", "fail"))]
        return "; ".join(dict.fromkeys(told or [m.strip() for m in self.messages[-3:]])) or "it gave no reason"


def netlist(load: LoadCircuit, capacitance: float, step: float, duration: float, start: float = 0.0) -> str:
    """The whole circuit: the piezo as voltage source theta x/Cp in series with Cp, and the load on it.

    capacitance in farad, step and duration in second; ``start`` is theta x/Cp - v at the
    beginning, in volt.  The load resistor runs with fixed steps between landings and with the
    one-step rule that is exact for its time constant (see `trapezoid_share`); any other load
    leaves the steps between landings to ngspice.
    """
    step, duration, start = float(step), float(duration), float(start)  # a NumPy scalar prints its type
    circuit = Circuit("harvester")
    circuit.V("drive", "drive", circuit.gnd, "external")
    circuit.C("p", "drive", "p", capacitance, initial_condition=start)
    circuit.X("load", load.name, "p", circuit.gnd, **load.parameters)
    if load.linear:
        rule = (
            f".options method=trap xmu={trapezoid_share(step, load.parameters['R'] * capacitance)!r} trtol=1e6 chgtol=1"
        )
    else:
        rule = ".options method=gear maxord=2 reltol=1e-4"
    cards = [load.text, rule, ".save v(p) @r.xload.rload[p]", f".tran {step!r} {duration!r} 0 {step!r} uic", ".end"]
    return "\n".join([str(circuit).rstrip(), *cards]) + "\n"


def trapezoid_share(step: float, time_constant: float) -> float:
    """Ngspice's xmu, the weight of a step's beginning: 1/z - 1/(exp(z) - 1), z = step/time constant.

    v1 - v0 + z [(1 - xmu) v1 + xmu v0] = u1 - u0 then has the exact solution of v' + v/(R Cp) = u'
    for a steady slope u'.  It is 1/2, the trapezoidal rule, for a short step and goes to 0,
    backward Euler, for a long one, where the trapezoidal rule would ring.
    """
    z = step / time_constant
    return 0.5 - z / 12.0 if z < 1e-3 else 1.0 / z - (1.0 / math.expm1(z) if z < 700.0 else 0.0)


@cache
def ngspice() -> Ngspice:
    """The one ngspice of this process."""
    NgSpiceShared.LIBRARY_PATH = find_library()
    try:
        return Ngspice()
    except (OSError, AttributeError) as error:
        raise MissingProgramError(
            f"engine 'spice' must have ngspice installed, but {NgSpiceShared.LIBRARY_PATH} is no such library "
            f"({str(error).splitlines()[0]}): run 'make setup' or 'apt-get install libngspice0 ngspice'"
        ) from None
