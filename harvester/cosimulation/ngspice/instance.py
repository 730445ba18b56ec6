"""The ngspice library in this process, through PySpice's handle on it: the one file that imports PySpice.

A process has one ngspice, with global state; `harvester.cosimulation.runs` keeps it out of the
user's process. Time and the source come from the lock-step, compiled or in Python.  PySpice's own
callbacks, which find their object through the one user pointer that ngspice keeps for all, are
replaced by methods that do not use it.

Long because the library has one global state, which a run's callbacks, threads and vectors share.
"""

import logging
import math
import os
import threading
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.load_elements import COIL
from harvester.cosimulation.lockstep.drive import Drive
from harvester.cosimulation.lockstep.model_drive import ModelDrive
from harvester.cosimulation.lockstep.state import DURING, STATE, VECTORS
from harvester.cosimulation.ngspice import compiled_callbacks, diagnostics
from harvester.cosimulation.ngspice.deck import Deck
from harvester.cosimulation.ngspice.locate_libngspice import REMEDY, code_models, find_library
from harvester.errors import CircuitError, ConvergenceError, MissingProgramError, OutOfTimeError
from harvester.machine.system import this_system

# Debian's ngspice has OpenMP on: slower for small circuits
os.environ.setdefault("OMP_NUM_THREADS", "1")
logging.getLogger("PySpice").setLevel(logging.CRITICAL)  # "Unsupported Ngspice version" is harmless

with warnings.catch_warnings():
    # from Python 3.12 on, of a backslash in its docstrings
    warnings.simplefilter("ignore", SyntaxWarning)
    from PySpice.Spice.NgSpice.Shared import NgSpiceShared, ffi, ffi_string_utf8

SLOWEST = 1.0  # kicks a second of a run that gets anywhere
# s between looks; of a step: shorter ones all the time between two looks lead nowhere
LOOK, TINY = 5.0, 1e-9


class Ngspice(NgSpiceShared):  # type: ignore[misc]
    """PySpice's handle on the ngspice library, with callbacks that need no user pointer."""

    def __init__(self) -> None:
        self.messages: list[str] = []
        self.loaded = False  # whether the present netlist was taken
        self.lost = False  # whether ngspice failed in a way that it does not recover from
        self.failure = ""  # the last one, in words
        self.vectors: tuple[str, ...] = ()  # of the present run, in the order of VECTORS
        self.smoothing = 0.0  # its capacitance Csmooth, F
        self.names: list[str] = []  # of its nodes and of its inductors' branches
        self.nodes: dict[str, float] = {}  # their voltages at its last kick, V, and currents, A
        # the time (s) and the probes' vectors at its accepted points
        self.series: dict[str, Floats] = {}
        super().__init__(send_data=True)

    # The six callbacks of PySpice, as methods: cffi takes the bound method.
    def _send_char(self, message: Any, ident: int, user: Any) -> int:
        """Keep a line that ngspice prints."""
        text = ffi_string_utf8(message).partition(" ")[2]  # after the name of the stream
        self.messages.append(text)
        self._stdout.append(text)
        return 0

    def _exit(self, status: int, immediate: bool, quitting: bool, ident: int, user: Any) -> int:
        """Note that ngspice wants to end its process, after a fatal error."""
        self.lost = True
        return status

    def _ignore(self, *arguments: Any) -> int:
        """Ignore how far ngspice has come, its own thread, and points, which are for the lock-step's own callback."""
        return 0

    _send_stat = _background_thread_running = _send_data = _ignore

    def _send_init_data(self, data: Any, ident: int, user: Any) -> int:
        """Note the places of the vectors that the lock-step reads among those of the coming run."""
        names = [ffi_string_utf8(data.vecs[i].vecname).lower() for i in range(data.veccount)]
        voltages = [
            name
            for name in names
            if name != "time" and name[:1] != "@" and not name.endswith("#branch")
        ]
        self.names = voltages + [name for name in names if COIL.fullmatch(name)]
        for what, name in zip(VECTORS, self.vectors, strict=True):
            self.state[f"{what}_index"] = names.index(name) if name in names else -1
        return 0

    def _init_ngspice(self, send_data: bool) -> None:
        """Initialise ngspice as PySpice does, then give it the lock-step's functions.

        Once a process.
        """
        super()._init_ngspice(send_data)
        self.state = np.zeros(1, STATE)
        pointer = ffi.cast("void *", self.state.ctypes.data)
        self._ngspice_shared.ngSpice_Init(
            self._send_char_c,
            self._send_stat_c,
            self._exit_c,
            ffi.cast("SendData *", compiled_callbacks.data_callback.address),
            self._send_init_data_c,
            self._background_thread_running_c,
            pointer,
        )
        source = ffi.cast("GetVSRCData *", compiled_callbacks.source_callback.address)
        sync = ffi.cast("GetSyncData *", compiled_callbacks.sync_callback.address)
        self._ngspice_shared.ngSpice_Init_Sync(
            source, self._get_isrc_data_c, sync, ffi.NULL, pointer
        )

    def load(self, code_models: Sequence[Path]) -> None:
        """Load code models from the folder that they are in: the command would misread some letters of a path.

        Raises OSError for one that is missing or does not load.
        """
        for path in code_models:
            self.messages.clear()
            with this_system.back_to_this_folder():
                os.chdir(path.parent)
                self._ngspice_shared.ngSpice_Command(f"codemodel ./{path.name}".encode())
            if self.messages:  # one that loads says nothing
                raise OSError("; ".join(self.messages))

    def run_driven(
        self,
        deck: Deck,
        drive: Drive | ModelDrive,
        patience: float = math.inf,
        deadline: float = math.inf,
    ) -> None:
        """Load the circuit, run its ``.tran`` with the drive's mass in lock-step, and forget both.

        ngspice runs in a thread of its own, so that a run that makes less than `SLOWEST` kicks a
        second over ``patience`` seconds, or has not ended at the ``deadline`` of `time.monotonic`,
        can be given up; it cannot be stopped.  After that, and after a fatal error, no other
        circuit runs in this process.

        Raises CircuitError with the node and the time in trouble when ngspice refuses the netlist,
        stops before the end or comes no further; OutOfTimeError, which states how far it came, at
        the deadline.
        """
        if self.lost:
            raise CircuitError(
                f"ngspice failed earlier in this process and cannot run another circuit: {self.failure}"
            )
        try:
            self._follow(deck, drive, patience, deadline)
        except CircuitError as error:
            self.failure = str(error)
            raise

    def _follow(
        self, deck: Deck, drive: Drive | ModelDrive, patience: float, deadline: float
    ) -> None:
        """Run a circuit as `run_driven` states."""
        self.state[:] = drive.state
        if (
            isinstance(drive, Drive) and not drive.state["accepted_at"][0]
        ):  # others bring callbacks of their own
            self.state["accepted_at"] = compiled_callbacks.point_function(
                compiled_callbacks.pattern_of(drive.coefficients), drive.shaking is not None
            ).address
        self.vectors = deck.vectors
        self.loaded = False
        self.smoothing = 0.0
        self.nodes = {}
        self.nodes_earlier: dict[str, float] = {}
        self.series = {}
        self.messages.clear()
        self._stdout.clear()  # PySpice's own list, which grows for ever
        currents, earlier = (drive.currents, drive.earlier) if isinstance(drive, Drive) else ({}, 0)
        run = threading.Thread(target=self._run, args=(deck, currents, earlier), daemon=True)
        seconds = deadline - time.monotonic()
        run.start()
        error = self._wait(
            run, TINY * float(drive.state["h"][0] / drive.state["w0"][0]), patience, deadline
        )
        end = float(self.state["t"][0])
        stuck = run.is_alive()
        self.lost = self.lost or stuck
        if stuck and error is None:
            late = OutOfTimeError(diagnostics.why_out_of_time(end, drive.duration, seconds))
            late.so_far = self._so_far()
            raise late
        if stuck and error is not None:
            kind, step, waited = error
            raise kind(diagnostics.why_given_up(end, drive.duration, step, waited))
        drive.state[:] = self.state
        drive.smoothing = self.smoothing
        drive.nodes = self.nodes
        drive.series = self.series
        if isinstance(drive, Drive):
            drive.nodes_earlier = self.nodes_earlier
        if not self.loaded:
            raise CircuitError(diagnostics.why_refused(self.messages))
        if end < drive.duration * (1 - 1e-6):
            kind = (
                ConvergenceError
                if diagnostics.no_step_was_small_enough(self.messages)
                else CircuitError
            )
            raise kind(diagnostics.why_stopped(self.messages, end, drive.duration))

    def _wait(
        self, run: threading.Thread, tiny: float, patience: float, deadline: float
    ) -> tuple[type[CircuitError], float, float] | None:
        """Wait for a run until it ends, or the deadline; why it is given up if it gets nowhere.

        That is the error, the step (s) of its last points, and the time (s) waited; steps below
        ``tiny`` lead nowhere.
        """
        since = time.monotonic()
        before = now = self._progress()
        while run.is_alive() and (left := deadline - time.monotonic()) > 0.0:
            run.join(min(patience, LOOK, left))
            looked = now
            now = self._progress()
            step = (now["t"] - looked["t"]) / max(now["accepted"] - looked["accepted"], 1.0)
            if 0.0 < step < tiny:
                return ConvergenceError, step, min(patience, LOOK)
            if time.monotonic() - since >= patience:
                if now["n_steps"] - before["n_steps"] < SLOWEST * patience:
                    return CircuitError, step, patience
                before = now
                since = time.monotonic()
        return None

    def _progress(self) -> dict[str, float]:
        """How far the present run has come: time (s), kicks, and accepted steps."""
        return {name: float(self.state[name][0]) for name in ("t", "n_steps", "accepted")}

    def _so_far(self) -> tuple[float, float, float] | None:
        """The means of the present run as of `CircuitError`, over the time that it has measured."""
        now = self.state[0].copy()
        covered = float(now["t"] - now["begin"])
        if now["measuring"] != DURING or not covered > 0.0:
            return None
        return float(now["load"]) / covered, float(now["square"]) / covered, covered

    def _run(self, deck: Deck, currents: Mapping[str, float], earlier: int) -> None:
        """Give ngspice the circuit, run it, and make ngspice forget it.

        Inductors begin with ``currents`` (A).
        """
        api = self._ngspice_shared
        # a deck's option cshunt would hold for all that follow it
        api.ngSpice_Command(b"unset cshunt_value")
        lines = [ffi.new("char[]", line.encode()) for line in [*deck.text.splitlines(), ""]]
        self.loaded = not api.ngSpice_Circ(ffi.new("char *[]", [*lines, ffi.NULL]))
        begin = [
            f"alter {name.partition('#')[0]} ic = {value!r}".encode()
            for name, value in currents.items()
        ]
        steps: list[Callable[[], object]]
        steps = [
            lambda: [api.ngSpice_Command(command) for command in [*begin, b"run"]],
            lambda: self._keep(deck, earlier),
        ]
        steps += [
            lambda: api.ngSpice_Command(b"destroy all"),
            lambda: api.ngSpice_Command(b"remcirc"),
        ]
        for step in steps:
            if self.loaded and not self.lost:  # a run that was given up, or a fatal error, ends all
                step()

    def _keep(self, deck: Deck, earlier: int) -> None:
        """Keep the data of a finished run: Csmooth's capacitance, the last nodes' voltages, and the probes.

        The nodes are those so many kicks ``earlier`` as well.
        """
        if deck.smoothing:
            vector = self._ngspice_shared.ngGet_Vec_Info(b"@c.xload.csmooth[capacitance]")
            self.smoothing = float(vector.v_realdata[0]) if vector and vector.v_length else 0.0
        last = float(self.state["noise_size"][0] * self.state["h"][0] / self.state["w0"][0])
        if deck.keeps and self.state["t"][0] > last:
            self.nodes = self._nodes_at(last)
            before = earlier * float(self.state["h"][0] / self.state["w0"][0])
            self.nodes_earlier = self._nodes_at(last - before) if earlier else {}
        if deck.probes and self.state["t"][0] > 0.0:
            self.series = {name: self._vector(name).copy() for name in ("time", *deck.probes)}

    def _nodes_at(self, time: float) -> dict[str, float]:
        """Voltages of the nodes and currents of the inductors at the accepted point that is nearest to a time (s)."""
        at = int(np.argmin(np.abs(self._vector("time") - time)))
        return {name: float(self._vector(name)[at]) for name in self.names}

    def _vector(self, name: str) -> Floats:
        """A vector of the present run, which ngspice keeps until the run is forgotten."""
        api = self._ngspice_shared
        vector = api.ngGet_Vec_Info(name.encode())
        if not vector:  # c.xload.c5_int1 is a vector of the constants, const, to ngspice
            plot = ffi_string_utf8(api.ngSpice_CurPlot())
            vector = api.ngGet_Vec_Info(f"{plot}.{name}".encode())
        return np.frombuffer(ffi.buffer(vector.v_realdata, 8 * vector.v_length))


@cache
def ngspice() -> Ngspice:
    """The one ngspice of this process, loaded at the first call.

    Variables such as SPICE_LIB_DIR leave the environment before: ngspice would run the commands of
    a file in a folder that they name, those of a shell as well.  The wheel's library, which has no
    start file, gets its code models here.

    Raises MissingProgramError when the library cannot be loaded.
    """
    for name in [variable for variable in os.environ if variable.startswith("SPICE_")]:
        del os.environ[name]
    NgSpiceShared.LIBRARY_PATH = find_library()
    try:
        loaded = Ngspice()
        loaded.load(code_models(NgSpiceShared.LIBRARY_PATH))
    except (OSError, AttributeError) as error:
        raise MissingProgramError(
            f"engine 'spice' must have ngspice installed, but {NgSpiceShared.LIBRARY_PATH} is not such a library "
            f"({str(error).splitlines()[0]}): {REMEDY}"
        ) from None
    return loaded
