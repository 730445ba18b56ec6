"""Measurements from CSV files: their kind from the columns, their load from the name, the header or a comment.

    frequency, |Z|, phase   frequency, R, X   frequency, G, B   frequency, Cp, D     impedance; FILE@clamped: mass held
    frequency, V/g (phase)  frequency, mm/g ...                                      response; FILE@100k: the load
    time, voltage or displacement or speed                                           ring-down

A load stands behind the file's name (FILE@short, FILE@open, FILE@470k), in a column `load (ohm)`,
in a column's name (`voltage at 100 kohm (V/g)`), or in a comment (`# load: 100 kohm`).
"""

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError, invalid, refused, shown
from harvester.identification.measurement import (
    OPEN,
    SHORT,
    BaseResponse,
    Decay,
    Impedance,
    Measurement,
    finite,
)
from harvester.quantities.kinds import CAPACITANCE, FREQUENCY, RESISTANCE, Kind, with_prefix
from harvester.records.csv_table import CsvColumn, CsvTable, read_table
from harvester.records.record_files import is_frequency, is_time, times

FEWEST = 12  # points of a measurement
_OHM, _SIEMENS = (
    Kind("an impedance (ohm)", "ohm", "'1 kohm'"),
    Kind("an admittance (S)", "S", "'1 uS'"),
)
_ANGLE, _LOSS = Kind("an angle (rad)", "rad", "'90 deg'"), Kind("a loss", "", "0.02")
_PER_G = {
    "voltage": Kind("a voltage per acceleration", "V/(m/s^2)", "'10 V/g'", gravity=True),
    "displacement": Kind("a displacement per acceleration", "m/(m/s^2)", "'1 mm/g'", gravity=True),
    "speed": Kind("a speed per acceleration", "(m/s)/(m/s^2)", "'10 mm/s/g'", gravity=True),
}
_DECAYS = {
    "voltage": Kind("a voltage (V)", "V", "'1 V'"),
    "displacement": Kind("a displacement (m)", "m", "'1 mm'"),
    "speed": Kind("a speed (m/s)", "m/s", "'1 m/s'"),
}
_PHASE = {"phase", "theta", "angle", "arg", "phi", "deg"}
_LOAD = re.compile(
    r"(?:@|\bat\b|\bload\b|\bRL?\b)\s*[:=]?\s*(\d[\d.]*\s*[\w.Ωµ]*|short|open|clamped)",
    re.IGNORECASE,
)
_LOAD_IN_PROSE = re.compile(  # stricter: "measured at 25 °C" is not a load
    r"\b(?:load|load resistance|RL?)\s*(?:[:=]|\bis\b)?\s*"
    r"(\d[\d.]*(?:e[+-]?\d+)?\s*[munµkMG]?(?:ohm|Ω|\u2126)|\d[\d.]*\s*[kMG](?=\s*$)|(?:short|open|clamped)\b)",
    re.IGNORECASE,
)
_CLAMPED = re.compile(r"[#%/! ]*clamped[. ]*", re.IGNORECASE)  # a remark of this word alone
LONGEST_REMARK = 200  # letters of a line that are looked at
FORMS = (
    "frequency with |Z| and phase, R and X, or G and B; frequency with a voltage or displacement per g; "
    "or time with a voltage or displacement"
)


def read_files(names: tuple[str, ...]) -> list[Measurement]:
    """The measurements of several files, each with its state behind an @.

    Raises InputError in one line, which states what of a file is missing and what would mend it.
    """
    measurements = [data for name in names for data in read_file(name)]
    if not measurements:
        raise InputError("FILE must be given: a CSV file of a measurement")
    return measurements


def read_file(name: str) -> list[Measurement]:
    """The measurements of one file: one for each load that it holds."""
    path, at, state = name.rpartition("@")
    if not at or Path(name).exists():
        path = name
        state = ""
    label = Path(path).name
    key = f"FILE {shown(label)}"
    table = read_table(path, "FILE")
    load, clamped = _state(state, table.remarks, key)
    if table.bad:
        row, position, text = table.bad[0]
        head = next((column.name for column in table.columns if column.index == position), "")
        raise invalid(f"{key} column {head!r} row {row}", "be a number", text)
    if frequencies := table.find(is_frequency):
        f = _in_hertz(frequencies[0], key)
        with np.errstate(divide="ignore", invalid="ignore"):  # a zero in the table has no inverse
            z = _impedance(table, f)
        if z is not None:
            good = finite(f, z.real, z.imag) & (f > 0.0) & (np.abs(z) > 0.0)
            _enough(good, key)
            return [Impedance(label, f[good], z[good], clamped)]
        if responses := _responses(table, f, label, key, load):
            return responses
    elif table.find(is_time):
        return [_decay(table, label, key, load)]
    raise InputError(f"{key} must hold {FORMS}, but has {shown(table.heads)}")


def _state(state: str, remarks: Iterable[str], key: str) -> tuple[float | None, bool]:
    """The load (ohm), and whether the mass was held, from what stands behind the @ or else in remarks."""
    lines = [line[:LONGEST_REMARK] for line in remarks]
    said = state or next((m[1] for line in lines if (m := _LOAD_IN_PROSE.search(line))), "")
    if said.strip().lower() == "clamped" or (not said and any(map(_CLAMPED.fullmatch, lines))):
        return None, True
    return (_load(said, key) if said else None), False


def _in_hertz(column: CsvColumn, key: str) -> Floats:
    """A column of frequencies, in Hz if it has no unit."""
    f = column.in_si(FREQUENCY)
    if f is None and column.stated:
        raise invalid(f"{key} column {column.name!r}", "have a unit such as Hz", column.stated)
    return column.values if f is None else f


def _load(text: str, key: str) -> float:
    """A load in ohm from a text."""
    word = text.strip().lower()
    if word in ("short", "open"):
        return SHORT if word == "short" else OPEN
    try:
        return with_prefix(text.strip(), RESISTANCE)
    except ValueError as error:
        raise refused(f"{key}, the load behind the @,", error, text) from None


def _impedance(table: CsvTable, f: Floats) -> Complexes | None:
    """The impedance of a table, from whichever pair of columns it has; None if it has none."""

    def part(kind: Kind, *names: str) -> Floats | None:
        for column in table.columns:
            if column.name.strip("|").lower() in names or set(column.words) & set(names):
                values = column.in_si(kind)
                if values is not None or not column.stated:
                    return column.values if values is None else values
        return None

    angle = _phase(table)
    if angle is not None:
        size = part(_OHM, "z", "impedance", "zabs", "mag", "magnitude")
        if size is not None and not table.find(lambda c: any(c.scale(k) for k in _PER_G.values())):
            return np.asarray(size * np.exp(1j * angle))
        size = part(_SIEMENS, "y", "admittance")
        if size is not None:
            return np.asarray(np.exp(-1j * angle) / size)
    r = part(_OHM, "r", "rs", "resistance", "re", "real", "zre", "z'", "esr")
    x = part(_OHM, "x", "xs", "reactance", "im", "imag", "zim", "z''")
    if r is not None and x is not None:
        return np.asarray(r + 1j * x)
    g, b = part(_SIEMENS, "g", "gp", "conductance"), part(_SIEMENS, "b", "bp", "susceptance")
    if g is not None and b is not None:
        return np.asarray(1.0 / (g + 1j * b))
    c = part(CAPACITANCE, "cp", "c", "capacitance")
    d = part(_LOSS, "d", "tan", "tand", "loss", "df")
    if c is not None and d is not None:
        return np.asarray(1.0 / (2j * math.pi * f * c * (1.0 - 1j * d)))
    return None


def _phase(table: CsvTable) -> Floats | None:
    """The phase in rad; in degrees if it has no unit and goes beyond what radians do."""
    for column in table.columns:
        if set(column.words) & _PHASE:
            unit = column.stated.replace("°", "deg").replace("degrees", "deg")
            factor, _ = _ANGLE.scale(unit) if unit else (None, 1)
            if factor is None:
                factor = math.pi / 180.0 if np.nanmax(np.abs(column.values)) > 6.4 else 1.0
                if not unit and "deg" in column.head.lower():
                    factor = math.pi / 180.0
            return column.values * factor
    return None


def _responses(
    table: CsvTable, f: Floats, label: str, key: str, load: float | None
) -> list[Measurement]:
    """A response for each column and load."""
    phase = _phase(table)
    responses = []
    loads = _load_column(table)
    for column in table.columns:
        for of, kind in _PER_G.items():
            size = column.in_si(kind) if not is_frequency(column) else None
            if size is None:
                continue
            written = _LOAD.search(column.name)
            mine = _load(written[1], key) if written else load
            if loads is None and mine is None:
                if of == "voltage":
                    raise InputError(
                        f"{key} must say over which load the voltage was measured: write it behind the name, "
                        f"as in {shown(label + '@100k')}, or @open"
                    )
                mine = SHORT
            every = np.full(len(f), 0.0 if mine is None else mine) if loads is None else loads
            for resistance in np.unique(every[~np.isnan(every)]):
                good = finite(f, size) & (f > 0.0) & (np.abs(size) > 0.0) & (every == resistance)
                if phase is not None:
                    good &= np.isfinite(phase)
                _enough(good, key)
                angle = None if phase is None else phase[good]
                responses.append(
                    BaseResponse(
                        label, f[good], np.abs(size[good]), angle, load=float(resistance), of=of
                    )
                )
            break
    return list(responses)


def _load_column(table: CsvTable) -> Floats | None:
    columns = table.find(
        lambda c: (
            bool({"load", "resistance", "rload", "rl"} & set(c.words)) and c.scale(_OHM) is not None
        )
    )
    return columns[0].in_si(_OHM) if columns else None


def _decay(table: CsvTable, label: str, key: str, load: float | None) -> Decay:
    """The ring-down of a table."""
    t = times(table, key)
    assert t is not None
    loads = _load_column(table)
    several = [] if loads is None else np.unique(loads[~np.isnan(loads)]).tolist()
    if len(several) > 1:
        raise InputError(
            f"{key} must be a ring-down over one load, but its column of loads has {len(several)} values"
        )
    for of, kind in _DECAYS.items():
        for column in table.columns:
            y = None if is_time(column) else column.in_si(kind)
            if y is None:
                continue
            good = finite(t, y)
            _enough(good, key)
            if not (np.diff(t[good]) > 0.0).all():
                raise InputError(
                    f"{key} must have ascending times, but has not: 'harvester record FILE' mends a record"
                )
            if not np.ptp(y[good]) > 0.0:
                raise InputError(f"{key} must show a ring-down, but its {of} is constant")
            written = _LOAD.search(column.name)
            mine = several[0] if several else _load(written[1], key) if written else load
            mine = (OPEN if of == "voltage" else SHORT) if mine is None else mine
            return Decay(label, t[good], y[good], load=mine, of=of)
    raise InputError(f"{key} must hold {FORMS}, but has {shown(table.heads)}")


def _enough(good: Any, key: str) -> None:
    if good.sum() < FEWEST:
        raise invalid(f"{key}", f"have at least {FEWEST} points with numbers", int(good.sum()))
