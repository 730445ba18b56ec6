"""Forms in which analysers, profilers and standards write files, each with a small file and its right value.

The numbers of all files of a kind are the same: an impedance (tests/support/analysers.py), a current
with a pulse and three samples of -48 nA, two densities.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harvester.identification.read import read_file
from harvester.records.current_trace import read_trace
from harvester.records.record_files import read_density
from tests.support import analysers

G = 9.80665


@dataclass(frozen=True)
class Form:
    """A form: the file with its text, the right value or values, and the reader of them."""

    kind: str
    name: str
    file: str
    text: str
    right: tuple[float, ...]
    read: Callable[[Path], tuple[float, ...]]
    unit: str

    @property
    def head(self) -> str:
        """The line above the first row of numbers."""
        before = ""
        for line in self.text.splitlines():
            if line[:1].isdigit():
                break
            before = line
        return before

    def value(self, folder: Path) -> tuple[float, ...]:
        """The value that is read from the file, in ``folder``."""
        path = folder / self.file
        path.write_text(self.text, encoding="utf-8")
        return self.read(path)

    def shown(self, values: tuple[float, ...]) -> str:
        """The values as the page has them."""
        if self.kind == "impedance":
            phase = f"{values[1]:.3f} degrees" if len(values) > 1 else "phase not known"
            return f"{values[0]:.6g} ohm, {phase}"
        return f"{values[0]:.6g} {self.unit}"


MIDDLE = len(analysers.F) // 2


def _impedance(path):
    """|Z| (ohm) at the middle frequency, and its phase (degrees) if it is known."""
    [data] = read_file(str(path))
    z = data.z[MIDDLE]
    return (abs(z), math.degrees(np.angle(z))) if data.phase_known else (abs(z),)


def _impedances():
    """The forms of analysers' files."""
    z = analysers.Z[MIDDLE]
    size, phase = abs(z), math.degrees(np.angle(z))
    for name, (file, text) in analysers.FILES.items():
        yield Form("impedance", name, file, text, (size, phase), _impedance, "")
    for name, (file, text) in analysers.MAGNITUDES.items():
        yield Form("impedance", f"{name}, magnitude alone", file, text, (size,), _impedance, "")


COUNT, STEP = 400, 1e-4  # samples, s
TIME = np.arange(COUNT) * STEP
CURRENT = np.where((TIME > 0.01) & (TIME < 0.02), 5e-3, 2e-6)
CURRENT[[7, 150, 307]] = (-48e-9, 5e-3, -48e-9)
CURRENT[308] = -48e-9
CHARGE = float(CURRENT[CURRENT > 0.0].sum()) * STEP


def lines(times, currents, form="{:.9e}", tail=""):
    """Rows of a time and a current, both as they are given."""
    return "".join(f"{t},{form.format(i)}{tail}\n" for t, i in zip(times, currents, strict=True))


DAYTIMES = [f"01/23/2031,08:04:05,.{5000 + k:04d}00000" for k in range(COUNT)]
METER = "Style,Standard\nCount,400\nIndex,Reading,Unit,Range Digits,Date,Time,Fractional Seconds\n"
TRACES = {
    "PPK2": "Timestamp(ms),Current(uA),D0-D7\n"
    + lines(TIME * 1e3, CURRENT * 1e6, tail=",00000000"),
    "Joulescope": "#time,current,voltage,power\n"
    + "".join(f"{t:.4f},{i:.6e},3.3,{3.3 * i:.6e}\n" for t, i in zip(TIME, CURRENT, strict=True)),
    "Otii": '"Timestamp","Main current (A)"\n' + lines(12.5 + TIME, CURRENT),
    "Monsoon": "Time (s),Main Avg Current (mA)\n" + lines(TIME, CURRENT * 1e3),
    "Monsoon, a channel by its unit": "Time(s),Main(mA),Main Voltage(V)\n"
    + lines(TIME, CURRENT * 1e3, tail=",3.3"),
    "DMM with dates": METER
    + "".join(f"{k},{i:.6e},Amp DC,1,{DAYTIMES[k]}\n" for k, i in enumerate(CURRENT)),
    "DMM in mA": "Value,Unit,Time (s)\n"
    + "".join(f"{1e3 * i:.6e},mA,{t:.4f}\n" for t, i in zip(TIME, CURRENT, strict=True)),
    "seconds without a unit": "time,current (A)\n" + lines(TIME, CURRENT),
}


def _charge(path):
    """The charge of a trace (C)."""
    return (float(sum(i * t for i, t in read_trace(str(path)).states)),)


def _straight(*points):
    """The rms of a density whose breakpoints are joined by straight lines on log-log axes."""
    squares = 0.0
    for (f, s), (f2, s2) in itertools.pairwise(points):
        if f == f2:
            continue
        n = math.log(s2 / s) / math.log(f2 / f)
        squares += (
            s * f * math.log(f2 / f) if abs(n + 1.0) < 1e-9 else (s2 * f2 - s * f) / (n + 1.0)
        )
    return math.sqrt(squares)


# a rise of 3 dB per octave from 20 to 80 Hz, a plateau, a fall of 3 dB per octave; g^2/Hz
RAMPS = _straight((20.0, 0.01), (80.0, 0.04), (350.0, 0.04), (2000.0, 0.007))
STEPS = _straight((5.0, 0.02), (20.0, 0.02), (20.0, 0.005), (200.0, 0.005))
SI = _straight((10.0, 10.0), (100.0, 10.0), (300.0, 0.51), (500.0, 5.0))  # (m/s^2)^2/Hz
IN_G = {
    "breakpoints": ("Frequency (Hz),PSD (g^2/Hz)\n20,0.01\n80,0.04\n350,0.04\n2000,0.007\n", RAMPS),
    "the root, in kHz": (
        "f (kHz);ASD (g/rtHz)\n0,02;0,1\n0,08;0,2\n0,35;0,2\n2;0,08366600265\n",
        RAMPS,
    ),
    "dB per octave, rows": (
        "Frequency (Hz),PSD (g^2/Hz)\n20,+3 dB/oct\n80,0.04\n350,0.04\n2000,-3 dB/oct\n",
        RAMPS,
    ),
    "dB per octave, ranges": (
        "Frequency (Hz),PSD (g^2/Hz)\n20-80,+3 dB/oct\n80-350,0.04\n350-2000,-3 dB/oct\n",
        RAMPS,
    ),
    "dB per octave in words, a dash": (
        "Frequency (Hz),PSD (g^2/Hz)\n20\u201380,3 dB per octave\n80\u2013350,0.04\n"
        "350\u20132000,\u22123 dB per octave\n",
        RAMPS,
    ),
    "steps, two values at a frequency": (
        "Frequency (Hz),Amplitude (g^2/Hz)\n5,0.02\n20,0.02\n20,0.005\n200,0.005\n",
        STEPS,
    ),
    "steps, ranges": ("Frequency (Hz),Amplitude (g^2/Hz)\n5-20,0.02\n20-200,0.005\n", STEPS),
}
IN_SI = {
    "a row of units": ("Frequency;PSD\nHz;(m/s^2)^2/Hz\n10;10\n100;10\n300;0,51\n500;5\n", SI),
    "m^2/s^3": ("Frequency (Hz),ASD (m^2/s^3)\n10,10\n100,10\n300,0.51\n500,5\n", SI),
}


def _rms(unit):
    """A reader of a density's rms in ``unit`` (m/s^2)."""
    return lambda path: (read_density(str(path)).rms / unit,)


FORMS = [
    *_impedances(),
    *(
        Form(
            "current", name, "a.csv", text, (1e6 * CHARGE,), lambda p: (1e6 * _charge(p)[0],), "uC"
        )
        for name, text in TRACES.items()
    ),
    *(
        Form("density", name, "a.csv", text, (right,), _rms(G), "g")
        for name, (text, right) in IN_G.items()
    ),
    *(
        Form("density", name, "a.csv", text, (right,), _rms(1.0), "m/s^2")
        for name, (text, right) in IN_SI.items()
    ),
]
