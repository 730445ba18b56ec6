"""Instruments' files without named columns: Touchstone, and the trace blocks of a 4294A.

Touchstone: `# kHz S MA R 50`, then rows of frequency and two numbers: size and angle (MA), dB and
angle (DB), or real and imaginary part (RI), of S, Z or Y; Z = R (1 + S)/(1 - S).  Version 1
normalises Z and Y to R.

A 4294A names the quantities of its traces A and B in one line, `MEASURE PARAMETER: IMPEDANCE MAG PHASE
(DEG)`, and writes both parts of each trace, of which the second is 0 unless the trace is complex.

Source: Touchstone File Format Specification, version 1.1 (EIA/IBIS Open Forum 2002).
"""

import math
import re
from pathlib import Path

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError, shown
from harvester.presentation.diagnostic import note
from harvester.records.csv_table import CsvColumn, CsvTable

_OPTION = re.compile(
    r"#\s*(?:(?:[kMG]?Hz|[SYZGH]|MA|DB|RI|R\s+[\d.eE+-]+)(?:\s+|$))+", re.IGNORECASE
)
_SUFFIX = re.compile(r"\.[szy]\d+p", re.IGNORECASE)
_HERTZ = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "ghz": 1e9}
_VERSION_2 = re.compile(r"^\s*\[Version\]\s*2", re.IGNORECASE | re.MULTILINE)
_PARAMETER = re.compile(r"MEASURE\s+PARAMETER:\s*([^\"\n]*)", re.IGNORECASE)
_TRACE = re.compile(r"^[\"\s]*TRACE:\s*([AB])[\"\s]*$", re.IGNORECASE | re.MULTILINE)
_QUANTITIES = (  # of both traces, as columns, if these words are in the name of the parameter
    ({"impedance", "phase", "deg"}, ("|Z| (ohm)", "phase (deg)")),
    ({"impedance", "phase", "rad"}, ("|Z| (ohm)", "phase (rad)")),
    ({"admittance", "phase", "deg"}, ("|Y| (S)", "phase (deg)")),
    ({"admittance", "phase", "rad"}, ("|Y| (S)", "phase (rad)")),
    ({"resistance", "reactance"}, ("R (ohm)", "X (ohm)")),
    ({"conductance", "susceptance"}, ("G (S)", "B (S)")),
    ({"r", "x"}, ("R (ohm)", "X (ohm)")),
    ({"g", "b"}, ("G (S)", "B (S)")),
    ({"cp", "d"}, ("Cp (F)", "D")),
    ({"cp", "g"}, ("Cp (F)", "G (S)")),
    ({"cp", "rp"}, ("Cp (F)", "Rp (ohm)")),
    ({"cs", "d"}, ("Cs (F)", "D")),
    ({"cs", "rs"}, ("Cs (F)", "Rs (ohm)")),
    ({"ls", "rs"}, ("Ls (H)", "Rs (ohm)")),
)
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


def is_touchstone(path: str, text: str) -> bool:
    """Whether a file is a Touchstone file: by its name, or by its line of options."""
    named = bool(_SUFFIX.fullmatch(Path(path).suffix))
    return named or any(_OPTION.fullmatch(line.strip()) for line in text.splitlines()[:200])


def touchstone(text: str, key: str) -> tuple[Floats, Complexes]:
    """Frequencies (Hz) and impedances (ohm) of a file of one port.

    Raises InputError, which begins with ``key``, for several ports and lines without numbers.
    """
    unit = 1e9
    parameter = "s"
    form = "ma"
    reference = 50.0
    seen = False
    stated: float | None = None
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        plain = line.partition("!")[0].strip()
        if plain.startswith("#"):
            if not seen:  # a second line of options is ignored, as the format says
                unit, parameter, form, reference = _options(plain, key)
            seen = True
        elif plain.lower().startswith("[reference]"):
            stated = _reference(plain, key)
        elif plain and not plain.startswith("["):
            cells = plain.replace(",", " ").split()
            if len(cells) != 3 or not all(map(NUMBER.fullmatch, cells)):
                raise InputError(
                    f"{key} line {number} must have three numbers, those of one port, but is {shown(plain)}: "
                    "export the reflection of one port (.s1p)"
                )
            rows.append([float(cell) for cell in cells])
    if not rows:
        raise InputError(f"{key} must have rows of three numbers, but has none")
    if stated is not None:
        reference = stated
    f, first, second = np.array(rows).T
    angle = np.exp(1j * math.pi / 180.0 * second)
    values = (10.0 ** (first / 20.0) if form == "db" else first) * angle
    if form == "ri":
        values = first + 1j * second
    with np.errstate(divide="ignore", invalid="ignore"):
        size = 1.0 if _VERSION_2.search(text) else reference
        z = {
            "s": reference * (1.0 + values) / (1.0 - values),
            "z": values * size,
            "y": size / values,
        }[parameter]
    return unit * f, np.asarray(z)


def _reference(line: str, key: str) -> float:
    """The reference (ohm) of version 2, which goes before that of the options."""
    cells = line.partition("]")[2].split()
    if len(cells) != 1 or not NUMBER.fullmatch(cells[0]):
        raise InputError(f"{key} must have one reference in ohm, but has {shown(line)}")
    return float(cells[0])


def _options(line: str, key: str) -> tuple[float, str, str, float]:
    """The unit of frequencies (Hz), parameter, form and reference (ohm) of the options."""
    words = line.lstrip("#").lower().split()
    unit = 1e9
    parameter = "s"
    form = "ma"
    reference = 50.0
    k = 0
    while k < len(words):
        word = words[k]
        if word in _HERTZ:
            unit = _HERTZ[word]
        elif word in ("s", "y", "z"):
            parameter = word
        elif word in ("ma", "db", "ri"):
            form = word
        elif word == "r" and k + 1 < len(words) and NUMBER.fullmatch(words[k + 1]):
            k += 1
            reference = float(words[k])
        else:
            raise InputError(
                f"{key} must have options such as '# Hz S RI R 50', but has {shown(line)}"
            )
        k += 1
    return unit, parameter, form, reference


def is_traces(text: str) -> bool:
    """Whether a file is one of traces A and B of a 4294A."""
    return bool(_PARAMETER.search(text) and _TRACE.search(text))


def traces(text: str, key: str) -> CsvTable:
    """The columns of a 4294A's traces: the frequency, and the quantity of each trace.

    Raises InputError, which begins with ``key``, for a parameter that is not known, and traces of
    other frequencies.
    """
    match = _PARAMETER.search(text)
    parameter = match[1].strip() if match else ""
    words = set(re.findall(r"[a-z]+", parameter.lower()))
    parts = _TRACE.split(text)
    blocks = {
        name.upper(): _rows(body, key) for name, body in zip(parts[1::2], parts[2::2], strict=True)
    }
    first = next(iter(blocks.values()))
    if any(
        len(rows) != len(first) or (rows[:, 0] != first[:, 0]).any() for rows in blocks.values()
    ):
        raise InputError(f"{key} must have traces at the same frequencies, but has not")
    named = {"Frequency (Hz)": first[:, 0]}
    if "complex" in words:
        named |= {"R (ohm)": first[:, 1], "X (ohm)": first[:, 2]}
    else:
        heads = next((heads for needed, heads in _QUANTITIES if needed <= words), None)
        if heads is None:
            raise InputError(
                f"{key} must have a measure parameter such as 'IMPEDANCE MAG PHASE (DEG)', but has {shown(parameter)}"
            )
        if any(rows[:, 2].any() for rows in blocks.values()):
            raise InputError(
                f"{key} must have an imaginary part of 0 in its traces of {shown(parameter)}, but has not"
            )
        named |= {
            head: blocks[name][:, 1]
            for name, head in zip("AB", heads, strict=True)
            if name in blocks
        }
    columns = tuple(
        CsvColumn(head, "", values, k) for k, (head, values) in enumerate(named.items())
    )
    return CsvTable(columns, (), note("file_layout", delimiter="\t", decimal="."), ())


def _rows(body: str, key: str) -> Floats:
    """The rows of a trace, shape (n, 3): frequency and both parts."""
    rows = []
    for line in body.splitlines():
        cells = line.replace(",", " ").split()
        if cells and NUMBER.fullmatch(cells[0]):
            if len(cells) != 3 or not all(map(NUMBER.fullmatch, cells)):
                raise InputError(
                    f"{key} must have three numbers in each row of a trace, but has {shown(line)}"
                )
            rows.append([float(cell) for cell in cells])
    if not rows:
        raise InputError(f"{key} must have rows of three numbers below its trace, but has none")
    return np.array(rows)
