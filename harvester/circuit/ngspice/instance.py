"""ngspice in this process, through PySpice: the one file that imports it.

There is one ngspice a process, with global state; `harvester.circuit.runs` keeps it out of the
user's process.  Time and the source come from the lock-step, compiled or in Python; PySpice's own
callbacks, which find their object through the one user pointer that ngspice keeps for all,
are replaced by methods that do not use it.
"""

import logging
import math
import os
import threading
from functools import cache
from typing import Any

import numpy as np

from harvester.circuit.lockstep.drive import STATE, VECTORS, Drive
from harvester.circuit.ngspice.compiled_callbacks import (
    native_accepted,
    native_data,
    native_source,
    native_sync,
)
from harvester.circuit.ngspice.deck import Deck, integration, smoothing_nodes
from harvester.circuit.ngspice.diagnostics import failure, refusal, stalled
from harvester.circuit.ngspice.library import find_library
from harvester.circuit.ngspice.python_callbacks import Reference
from harvester.errors import CircuitError, MissingProgramError
from harvester.netlists.load_circuit import LoadCircuit

os.environ.setdefault("OMP_NUM_THREADS", "1")  # Debian's ngspice has OpenMP on: slower for small circuits
logging.getLogger("PySpice").setLevel(logging.CRITICAL)  # "Unsupported Ngspice version" is harmless

from PySpice.Spice.Netlist import Circuit  # noqa: E402
from PySpice.Spice.NgSpice.Shared import NgSpiceShared, ffi, ffi_string_utf8  # noqa: E402

KICKS = 1.0  # a second: the least of a run that gets anywhere


class Ngspice(NgSpiceShared):  # type: ignore[misc]
    """PySpice's handle on the library, with callbacks that need no user pointer."""

    def __init__(self) -> None:
        self.messages: list[str] = []
        self.loaded = False  # whether the present netlist was taken
        self.lost = False  # whether ngspice failed in a way that it does not recover from
        self.vectors: tuple[str, ...] = ()  # of the present run, in the order of VECTORS
        self.smoothing = 0.0  # its capacitance Csmooth, F
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
        self.lost = True  # a fatal error
        return status

    def _background_thread_running(self, running: bool, ident: int, user: Any) -> int:
        return 0

    def _send_data(self, *arguments: Any) -> int:
        return 0

    def _send_init_data(self, data: Any, ident: int, user: Any) -> int:
        """The vectors of the coming run: where those that the lock-step reads stand."""
        names = [ffi_string_utf8(data.vecs[i].vecname).lower() for i in range(data.veccount)]
        for what, name in zip(VECTORS, self.vectors, strict=True):
            self.state[f"{what}_index"] = names.index(name) if name in names else -1
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

    def run_driven(self, deck: Deck, drive: Drive, patience: float = math.inf) -> None:
        """Load the circuit, run its ``.tran`` with the drive's mass in lock-step, and forget both.

        ngspice runs in a thread of its own, so that a run without `KICKS` a second over ``patience`` seconds can be
        given up; it cannot be stopped.  After that, and after a fatal error, no other circuit runs in this process.

        Raises
        ------
        CircuitError
            with the node and the time in trouble when ngspice refuses the netlist, stops before the end
            or comes no further.
        Exception
            of a Python callback (``native=False``), after the run.
        """
        if self.lost:
            raise CircuitError("ngspice failed earlier in this process and cannot run another circuit")
        self.state[:] = drive.record
        reference = None if drive.native else Reference(drive, self.state)
        if reference is None:
            self.state["accepted_at"] = native_accepted(
                tuple(one is not None for one in drive.given), drive.shaking is not None
            ).address
        self.vectors, self.loaded, self.smoothing = deck.vectors, False, 0.0
        self.messages.clear()
        self._stdout.clear()  # PySpice's own list, which grows for ever
        run = threading.Thread(target=self._run, args=(deck,), daemon=True)
        run.start()
        before, now = {"kicks": -math.inf}, self._progress()
        while run.is_alive() and now["kicks"] - before["kicks"] >= KICKS * min(patience, 1e9):
            before = now
            run.join(min(patience, threading.TIMEOUT_MAX))
            now = self._progress()
        end, stuck = now["t"], run.is_alive()
        self.lost = self.lost or stuck
        if reference is not None and reference.error is not None:
            raise reference.error
        if stuck:
            step = (end - before["t"]) / max(now["steps"] - before["steps"], 1)
            raise CircuitError(stalled(end, drive.duration, step, patience))
        drive.record[:] = self.state
        drive.smoothing = self.smoothing
        if not self.loaded:
            raise CircuitError(refusal(self.messages))
        if end < drive.duration * (1 - 1e-6):
            raise CircuitError(failure(self.messages, end, drive.duration))

    def _progress(self) -> dict[str, float]:
        return {name: float(self.state[name][0]) for name in ("t", "kicks", "steps")}

    def _run(self, deck: Deck) -> None:
        """What ngspice does for a run, from its first line to its last."""
        api = self._ngspice_shared
        lines = [ffi.new("char[]", line.encode()) for line in [*deck.text.splitlines(), ""]]
        self.loaded = not api.ngSpice_Circ(ffi.new("char *[]", [*lines, ffi.NULL]))
        if self.loaded and not self.lost:
            api.ngSpice_Command(b"run")
        if self.loaded and not self.lost and deck.smoothing:
            found = api.ngGet_Vec_Info(b"@c.xload.csmooth[capacitance]")
            self.smoothing = float(found.v_realdata[0]) if found and found.v_length else 0.0
        for command in (b"destroy all", b"remcirc"):
            if self.loaded and not self.lost:
                api.ngSpice_Command(command)


def deck(
    load: LoadCircuit,
    capacitance: float,
    step: float,
    duration: float,
    start: float = 0.0,
    norton: bool = False,
    volts: float = 1.0,
    reltol: float = 1e-4,
) -> Deck:
    """The whole circuit: the piezo, driven by the voltage theta x/Cp, and the load on it.

    capacitance in farad, step and duration in second; ``start`` is theta x/Cp at the beginning, in volt, where
    the terminals have none, ``volts`` the signal's size, and ``reltol`` for `integration`. The piezo is that
    voltage in series with Cp (Thevenin) or, with ``norton``, the current theta x' in parallel with Cp: that of a
    copy of Cp on the source, so that each step of ngspice carries exactly the charge theta (x1 - x0), whatever its
    integration rule; a current given as theta x' at the step's end would not. Both are the same equations; Thevenin
    has fewer of them.

    The load resistor runs with fixed steps between landings and with the one-step rule that is exact for
    its time constant (see `trapezoid_share`); any other load leaves the steps between landings to ngspice.
    """
    step, duration, start, volts = map(float, (step, duration, start, volts))  # a NumPy scalar prints its type
    circuit = Circuit("harvester")
    circuit.V("drive", "drive", circuit.gnd, "external")
    current = "vdrive"
    if norton:
        circuit.C("copy", "drive", circuit.gnd, capacitance, initial_condition=start)
        circuit.F("piezo", circuit.gnd, "m", "Vdrive", -1)
        circuit.C("p", "m", circuit.gnd, capacitance, initial_condition=0.0)
        circuit.V("meter", "p", "m", 0)  # its current is that of Vdrive above: out of the load
        current = "vmeter"
    else:
        circuit.C("p", "drive", "p", capacitance, initial_condition=start)
    circuit.X("load", load.name, "p", circuit.gnd, **load.parameters)
    time_constant = load.parameters["R"] * capacitance if load.linear else None
    rule = integration(step, time_constant, volts, capacitance, reltol)
    smooth = smoothing_nodes(load.text)
    vectors = ("time", "p", "@r.xload.rload[p]", f"{current}#branch", *smooth)
    saved = ["v(p)", "@r.xload.rload[p]", f"i({current})", *(f"v({node})" for node in smooth if "." in node)]
    cards = [load.text, rule, f".save {' '.join(saved)}", f".tran {step!r} {duration!r} 0 {step!r} uic", ".end"]
    return Deck("\n".join([str(circuit).rstrip(), *cards]) + "\n", vectors)


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
