"""What ngspice states of a load circuit that a given current feeds: its own reading of the text, never one of ours.

A piezo of a capacitance CAPACITANCE with a leak next to it is driven by three sines of current
(DRIVE) for SECONDS from rest, and what is reported is the mean power of Rload and the RMS of the
terminals' voltage.  The netlist's text reaches ngspice letter by letter, between a bench of three
lines before it and ``.end`` behind.

`Oracle` answers thousands: it loads the library once, and each netlist in a process forked from
that one, so that a crash, an endless loop or what an option leaves behind stays in it.
`by_program` asks ``ngspice -b``.
"""

import ctypes
import json
import math
import os
import re
import select
import shutil
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from harvester.cosimulation.ngspice.locate_libngspice import find_library

CAPACITANCE, LEAK = 50e-9, 10e6  # F and ohm, of the piezo
# V at an open circuit, Hz, degrees
DRIVE = ((1.0, 47.0, 0.0), (0.7, 83.0, 40.0), (0.4, 131.0, 200.0))
SECONDS, LONGEST_STEP = 0.06, 2.5e-5
VOLTS = 6.0  # what the sines are times
_OPTIONS = ".options reltol=1e-6 vntol=1e-9 abstol=1e-15 chgtol=1e-18 method=gear itl4=60"
_REFUSING = re.compile(
    r"error|unknown|undefined|unable|too few|too many|mismatch|cannot|malformed|doanalyses", re.I
)
_HARMLESS = re.compile(r"^Note|Using SPARSE|no compat", re.I)


@dataclass(frozen=True)
class Answer:
    """Mean power of the load (W) and RMS voltage of the terminals (V), or ``why`` there is none."""

    power: float = math.nan
    voltage: float = math.nan
    why: str = ""

    @property
    def given(self) -> bool:
        """Whether there is an answer."""
        return not self.why


def amplitudes():
    """Each sine's current (A), frequency (Hz) and phase (rad)."""
    return [(VOLTS * v * CAPACITANCE * 2.0 * math.pi * f, f, math.radians(p)) for v, f, p in DRIVE]


def bench(calls, first, second, load, step):
    """The lines around a netlist whose piezo is between two nodes, and the vectors that tell its voltage and power."""
    lines = [
        f"Cpiezo_oracle {first} {second} {CAPACITANCE!r}",
        f"Rpiezo_oracle {first} {second} {LEAK!r}",
    ]
    for k, (amplitude, f, phase) in enumerate(amplitudes()):
        wave = f"sin(0 {amplitude!r} {f!r} 0 0 {math.degrees(phase)!r})"
        lines.append(f"Ipiezo_oracle{k} {second} {first} dc 0 {wave}")
    vectors = [f"v({node.lower()})" for node in (first, second) if node != "0"] + [load]
    run = f".tran {step!r} {SECONDS!r} 0 {step!r} uic"
    return [*calls, *lines, _OPTIONS, run, f".save {' '.join(vectors)}"], vectors


def bench_of(text, terminals=None, resistor="Rload", step=LONGEST_STEP):
    """The bench of a netlist: a subcircuit with Rload, or a flat one between two nets, whose load has a name."""
    if terminals is not None:
        return bench([], *terminals, f"@{resistor.lower()}[p]", step)
    name = subcircuit_of(text)
    return bench([f"Xoracle p_oracle 0 {name}"], "p_oracle", "0", "@r.xoracle.rload[p]", step)


def subcircuit_of(text):
    """The name of the subcircuit that holds Rload."""
    name = ""
    known = []
    lines = [re.split(r";|//|\s\$", line)[0].strip() for line in text.lower().splitlines()]
    whole = "\n".join(line for line in lines if line and line[0] != "*").replace("\n+", " ")
    for line in whole.splitlines():
        words = line.split()
        if words[:1] == [".subckt"] and len(words) > 1:
            known.append(words[1])
        elif words[:1] and words[0].startswith(".ends") and known:
            known.pop()
        elif words[:1] == ["rload"] and known:
            name = known[0]
    return name or "none"


def by_program(text, terminals=None, resistor="Rload", program="ngspice", patience=60.0):
    """What the program states, in batch mode."""
    lines, vectors = bench_of(text, terminals, resistor)
    signs = _signs(terminals)
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "found.txt"
        control = [
            ".control",
            "set wr_singlescale",
            "set numdgt=15",
            "run",
            f"wrdata {found} {' '.join(vectors)}",
            ".endc",
        ]
        file = Path(folder) / "netlist.cir"
        file.write_text("\n".join(["* oracle", *lines, *control, text, ".end", ""]))
        try:
            done = subprocess.run(
                [program, "-b", file.name],
                capture_output=True,
                text=True,
                timeout=patience,
                cwd=folder,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return Answer(why="does not end")
        if not found.exists():
            return Answer(why=reason((done.stdout + done.stderr).splitlines()))
        rows = [[float(word) for word in line.split()] for line in found.read_text().splitlines()]
    times, *voltages, powers = zip(*rows, strict=True)
    return measured(
        times, _difference(voltages, signs), powers, (done.stdout + done.stderr).splitlines()
    )


def measured(times, voltages, powers, messages):
    """The answer of a transient: means by the trapezoidal rule."""
    if not times or times[-1] < SECONDS * (1.0 - 1e-6):
        return Answer(why=reason(messages) or "stops before the end")
    square, power = 0.0, 0.0
    for k in range(1, len(times)):
        h = times[k] - times[k - 1]
        a = voltages[k - 1]
        b = voltages[k]
        square += h * (a * a + a * b + b * b) / 3.0
        power += 0.5 * h * (powers[k - 1] + powers[k])
    voltage = math.sqrt(square / SECONDS)
    if not (math.isfinite(power) and math.isfinite(voltage)):
        return Answer(why="is not finite")
    return Answer(power / SECONDS, voltage)


def reason(messages):
    """The line of ngspice's messages that states why."""
    said = [line.strip() for line in messages if line.strip() and not _HARMLESS.search(line)]
    lines = [" ".join(said[k : k + 4]) for k, line in enumerate(said) if _REFUSING.search(line)]
    return lines[0][:240] if lines else (messages[-1].strip()[:160] if messages else "says nothing")


def _file_of(library):
    """The file that a library's name or path represents."""
    if "/" in library:
        return library
    ctypes.CDLL(library)
    loaded = Path("/proc/self/maps").read_text().split()
    return next(word for word in loaded if word.startswith("/") and "libngspice" in word)


class Oracle:
    """The ngspice library in this process, which answers in processes forked from it; ``with Oracle() as ask:``."""

    def __init__(self, library="", patience=20.0):
        """``library`` is the path of another one than is found."""
        self.patience = patience
        self._messages = []
        path = _file_of(library or find_library())
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        # A copy has variables of its own: the package's ngspice in this process stays as it is.
        with tempfile.TemporaryDirectory() as folder:
            self._spice = ctypes.CDLL(str(shutil.copy(path, Path(folder) / "oracle.so")))
        text = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p)
        leave = ctypes.CFUNCTYPE(
            ctypes.c_int, ctypes.c_int, ctypes.c_bool, ctypes.c_bool, ctypes.c_int, ctypes.c_void_p
        )
        # ngspice holds their addresses
        self._kept = text(self._told), text(lambda *_: 0), leave(self._left)
        self._spice.ngSpice_Init(*self._kept, None, None, None, None)
        self._spice.ngGet_Vec_Info.restype = ctypes.POINTER(_Vector)
        self._pipe = -1

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def _told(self, line, _ident, _user):
        self._messages.append(line.decode(errors="replace").partition(" ")[2])
        return 0

    def _left(self, *_):
        """ngspice gives up: report what it stated, and end this process."""
        if self._pipe >= 0:
            _tell(self._pipe, {"messages": self._messages})
            os._exit(0)
        return 0

    def __call__(self, text, terminals=None, resistor="Rload", step=LONGEST_STEP):
        """ngspice's answer to a netlist's text, with steps of at most ``step`` seconds."""
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                os.close(reading)
                self._pipe = writing
                signal.alarm(int(self.patience) + 5)
                quiet = os.open(os.devnull, os.O_WRONLY)
                os.dup2(quiet, 1)
                os.dup2(quiet, 2)
                _tell(writing, self._run(text, terminals, resistor, step))
            finally:
                os._exit(1)
        os.close(writing)
        said = self._heard(reading)
        os.close(reading)
        if said is None:
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if said is None:
            return Answer(why="does not end")
        if os.WIFSIGNALED(status) or not said:
            return Answer(why=f"crashes with the signal {os.WTERMSIG(status)}")
        found = json.loads(said)
        if "power" not in found:
            return Answer(why=reason(found["messages"]))
        return Answer(**found)

    def _heard(self, pipe):
        """All that a child writes; None if it runs too long."""
        said = b""
        deadline = time.monotonic() + self.patience
        while True:
            ready, _, _ = select.select([pipe], [], [], max(deadline - time.monotonic(), 0.0))
            if not ready:
                return None
            part = os.read(pipe, 1 << 16)
            if not part:
                return said
            said += part

    def _run(self, text, terminals, resistor, step):
        """Run a netlist in this process, which ends behind it."""
        lines, names = bench_of(text, terminals, resistor, step)
        deck = ["* oracle", *lines, *text.splitlines(), ".end"]
        array = (ctypes.c_char_p * (len(deck) + 1))(*[line.encode() for line in deck], None)
        if self._spice.ngSpice_Circ(array):
            return {"messages": self._messages}
        self._spice.ngSpice_Command(b"run")
        vectors = [self._vector(name) for name in ("time", *names)]
        if not all(vectors):
            return {"messages": self._messages}
        times, *voltages, powers = vectors
        answer = measured(times, _difference(voltages, _signs(terminals)), powers, self._messages)
        return {"power": answer.power, "voltage": answer.voltage, "why": answer.why}

    def _vector(self, name):
        """A vector of the run as a list; an empty one where there is none."""
        found = self._spice.ngGet_Vec_Info(name.encode())
        if not found or not found[0].v_realdata:
            return []
        return found[0].v_realdata[: found[0].v_length]


def _signs(terminals):
    """The signs of the voltages of the piezo's nodes that are not ground."""
    return [
        sign for node, sign in zip(terminals or ("p", "0"), (1.0, -1.0), strict=True) if node != "0"
    ]


def _difference(voltages, signs):
    """The piezo's voltage from those of its nodes."""
    return [
        sum(sign * v for sign, v in zip(signs, point, strict=True))
        for point in zip(*voltages, strict=True)
    ]


class _Vector(ctypes.Structure):
    _fields_ = (
        ("v_name", ctypes.c_char_p),
        ("v_type", ctypes.c_int),
        ("v_flags", ctypes.c_short),
        ("v_realdata", ctypes.POINTER(ctypes.c_double)),
        ("v_compdata", ctypes.c_void_p),
        ("v_length", ctypes.c_int),
    )


def _tell(pipe, found):
    """Write a child's answer."""
    os.write(
        pipe,
        json.dumps(
            found | ({"messages": found["messages"][-40:]} if "messages" in found else {})
        ).encode(),
    )
