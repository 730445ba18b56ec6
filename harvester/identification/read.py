"""Measurements from CSV files: their kind from the columns, their load from the name, the header or a comment.

    frequency, |Z|, phase   frequency, R, X   frequency, G, B   frequency, Cp, D     impedance; FILE@clamped: mass held
    Touchstone (.s1p), traces of a 4294A; other pairs: `harvester.identification.impedance_table`
    frequency, V/g (phase)  frequency, mm/g ...                                      response; FILE@100k: the load
    time, voltage or displacement or speed                                           ring-down

A load is given after the file's name (FILE@short, FILE@open, FILE@470k), in a column `load (ohm)`,
in a column's name (`voltage at 100 kohm (V/g)`), or in a comment (`# load: 100 kohm`).
"""

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError, invalid, refused, shown
from harvester.identification import instrument_files
from harvester.identification.impedance_table import OHM, impedance, only
from harvester.identification.impedance_table import phase as phase_of
from harvester.identification.measurement import (
    OPEN,
    SHORT,
    BaseResponse,
    Decay,
    Impedance,
    Measurement,
    finite,
    rows_left_out,
)
from harvester.machine import files
from harvester.quantities.kinds import FREQUENCY, RESISTANCE, Kind, with_prefix
from harvester.quantities.units import LARGEST, SMALLEST
from harvester.records.csv_table import MOST_BYTES, CsvColumn, CsvTable, read_table, refuse_summary
from harvester.records.named_columns import is_frequency, is_time
from harvester.records.plain_text import decoded
from harvester.records.record_clock import times

_LOADS = {"load", "resistance", "rload", "rl"}  # words of a column
FEWEST = 12  # points of a measurement
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
NAMES = "frequency (Hz),|Z| (ohm),phase (deg)"
FORMS = (
    "frequency with |Z| and phase, R and X, G and B, or a capacitance and D, R or G; "
    "frequency with a voltage or displacement per g; or time with a voltage or displacement"
)


def read_files(names: tuple[str, ...]) -> list[Measurement]:
    """The measurements of several files, each with its state behind an @.

    Raises InputError in one line, which names the missing part of a file and the remedy.
    """
    measurements = [data for name in names for data in read_file(name)]
    if not measurements:
        raise InputError(
            "FILE must be given: a CSV file of a measurement, or the numbers of a datasheet, "
            "such as --frequency"
        )
    return measurements


def read_file(name: str) -> list[Measurement]:
    """The measurements of one file: one for each load that it holds."""
    path, state = _path_and_state(name)
    label = Path(path).name
    key = f"FILE {shown(label)}"
    text = decoded(files.read(path, "FILE", MOST_BYTES), path, "FILE")
    if instrument_files.is_touchstone(path, text):
        load, clamped = _state(state, [line for line in text.splitlines() if "!" in line], key)
        _refuse_load(state, load, key)
        f, z = instrument_files.touchstone(text, key)
        return [_of_impedance(label, f, z, clamped, True, key)]
    of_traces = instrument_files.is_traces(text)
    table = instrument_files.traces(text, key) if of_traces else read_table(path, "FILE")
    load, clamped = _state(state, table.remarks, key)
    _refuse_texts(table, key)
    if frequencies := table.find(is_frequency):
        f = only([_in_hertz(column, key) for column in frequencies], key, FREQUENCY.name).values
        with np.errstate(divide="ignore", invalid="ignore"):  # a zero in the table has no inverse
            answer = impedance(table, f, key)
        if answer is not None:
            _refuse_load(state, load, key)
            return [_of_impedance(label, f, answer[0], clamped, answer[1], key)]
        if responses := _responses(table, f, label, key, load):
            return responses
    elif table.find(is_time):
        return [_decay(table, label, key, load)]
    if not any(column.head for column in table.columns):
        raise InputError(
            f"{key} must have names above its columns, such as {NAMES!r}, but has none: write that "
            "line above the numbers, and the frequencies in a column of their own"
        )
    raise InputError(f"{key} must hold {FORMS}, but has {shown(table.heads)}")


def _path_and_state(name: str) -> tuple[str, str]:
    """The path of a file, and the state behind an @ after it; "" if there is no @."""
    path, at, state = name.rpartition("@")
    if not at or Path(name).exists():
        return name, ""
    if not state.strip():
        raise InputError(
            f"FILE {shown(Path(path).name)} must have a state behind the @, such as @100k, but has "
            "none: add it, or leave the @ out"
        )
    return path, state


def _refuse_texts(table: CsvTable, key: str) -> None:
    """Refuse a cell that is not a number, and lines of a summary below the rows."""
    refuse_summary(table, key)
    if table.bad:
        row, position, text = table.bad[0]
        head = next((column.name for column in table.columns if column.index == position), "")
        raise invalid(f"{key} column {head!r} row {row}", "be a number", text)


def _of_impedance(
    label: str, f: Floats, z: Complexes, clamped: bool, phase_known: bool, key: str
) -> Impedance:
    """The impedance at the frequencies above 0 at which it is a number other than 0."""
    good = finite(f, z.real, z.imag) & (f > 0.0) & (np.abs(z) > 0.0)
    _enough(good, key)
    _check_sizes(f[good], key, "frequencies (Hz)")
    _check_sizes(np.abs(z[good]), key, "impedances (ohm)")
    return Impedance(label, f[good], z[good], clamped, phase_known, rows_left_out(good))


def _state(state: str, remarks: Iterable[str], key: str) -> tuple[float | None, bool]:
    """The load (ohm), and whether the mass was held, from the text after the @ or else in remarks."""
    lines = [line[:LONGEST_REMARK] for line in remarks]
    said = state or next((m[1] for line in lines if (m := _LOAD_IN_PROSE.search(line))), "")
    if said.strip().lower() == "clamped" or (not said and any(map(_CLAMPED.fullmatch, lines))):
        return None, True
    return (_load(said, key) if said else None), False


def _refuse_load(state: str, load: float | None, key: str) -> None:
    """Refuse a load behind the @ of an impedance, which has none."""
    if state and load is not None:
        raise InputError(
            f"{key} holds an impedance, which has no load: leave '@{state}' out, or write @clamped"
        )


def _in_hertz(column: CsvColumn, key: str) -> CsvColumn:
    """A column of frequencies with its numbers in Hz, which they are if it has no unit."""
    f = column.in_si(FREQUENCY)
    if f is None and column.stated:
        raise invalid(f"{key} column {column.name!r}", "have a unit such as Hz", column.stated)
    return column if f is None else replace(column, values=f)


def _load(text: str, key: str) -> float:
    """A load in ohm from a text."""
    word = text.strip().lower()
    if word in ("short", "open"):
        return SHORT if word == "short" else OPEN
    try:
        return with_prefix(text.strip(), RESISTANCE)
    except ValueError as error:
        raise refused(f"{key}, the load behind the @,", error, text) from None


def _responses(
    table: CsvTable, f: Floats, label: str, key: str, load: float | None
) -> list[Measurement]:
    """A response for each column and load."""
    phase = phase_of(table, key)
    responses = []
    loads = _load_column(table, key)
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
                        f"{key} must name the load over which the voltage was measured: write it behind the name, "
                        f"as in {shown(label + '@100k')}, or @open"
                    )
                mine = SHORT
            every = np.full(len(f), 0.0 if mine is None else mine) if loads is None else loads
            for resistance in np.unique(every[~np.isnan(every)]):
                _refuse_shorted(of, resistance, label, key, loads is not None)
                good = finite(f, size) & (f > 0.0) & (np.abs(size) > 0.0) & (every == resistance)
                if phase is not None:
                    good &= np.isfinite(phase)
                _enough(good, key)
                _check_sizes(f[good], key, "frequencies (Hz)")
                _check_sizes(np.abs(size[good]), key, f"{of}s per acceleration in SI units")
                angle = None if phase is None else phase[good]
                response = BaseResponse(
                    label,
                    f[good],
                    np.abs(size[good]),
                    angle,
                    load=float(resistance),
                    of=of,
                    left_out=rows_left_out(good, every == resistance),
                )
                responses.append(response)
            break
    return list(responses)


def _refuse_shorted(of: str, load: float, label: str, key: str, in_column: bool) -> None:
    """Refuse a voltage in short circuit, which is 0 for each device.

    A column of loads precedes the load behind the name.
    """
    if of == "voltage" and load == SHORT:
        remedy = (
            "delete the rows whose load is 0"
            if in_column
            else "write the load of the measurement behind the name, as in "
            f"{shown(label + '@100k')}"
        )
        raise InputError(
            f"{key} must have a voltage over a load above 0, but has one in short circuit, "
            f"a voltage of 0: {remedy}"
        )


def _load_column(table: CsvTable, key: str) -> Floats | None:
    columns = [
        replace(column, values=loads)
        for column in table.find(lambda c: bool(_LOADS & set(c.words)))
        if (loads := column.in_si(OHM)) is not None
    ]
    return only(columns, key, RESISTANCE.name).values if columns else None


def _of_ring_down(table: CsvTable, key: str) -> tuple[str, CsvColumn]:
    """The quantity that rings down, and its column, in SI units."""
    columns = [
        (of, replace(column, values=y))
        for of, kind in _DECAYS.items()
        for column in table.columns
        if not is_time(column) and (y := column.in_si(kind)) is not None
    ]
    if not columns:
        raise InputError(f"{key} must hold {FORMS}, but has {shown(table.heads)}")
    return columns[0][0], only([column for _, column in columns], key, "a ring-down")


def _decay(table: CsvTable, label: str, key: str, load: float | None) -> Decay:
    """The ring-down of a table."""
    t = times(table, key)
    assert t is not None
    loads = _load_column(table, key)
    several = [] if loads is None else np.unique(loads[~np.isnan(loads)]).tolist()
    if len(several) > 1:
        raise InputError(
            f"{key} must be a ring-down over one load, but its column of loads has {len(several)} values"
        )
    of, column = _of_ring_down(table, key)
    y = column.values
    good = finite(t, y)
    _enough(good, key)
    if not (np.diff(t[good]) > 0.0).all():
        raise InputError(
            f"{key} must have ascending times, but has not: 'harvester record FILE' mends a record"
        )
    if not np.ptp(y[good]) > 0.0:
        raise InputError(f"{key} must show a ring-down, but its {of} is constant")
    _check_sizes(np.ptp(t[good]), key, "a length (s)")
    _check_sizes(np.abs(y[good]).max(), key, f"a largest {of} in SI units")
    written = _LOAD.search(column.name)
    mine = several[0] if several else _load(written[1], key) if written else load
    mine = (OPEN if of == "voltage" else SHORT) if mine is None else mine
    return Decay(label, t[good], y[good], load=mine, of=of, left_out=rows_left_out(good))


def _enough(good: Any, key: str) -> None:
    if good.sum() < FEWEST:
        raise invalid(f"{key}", f"have at least {FEWEST} points with numbers", int(good.sum()))


def _check_sizes(values: Any, key: str, name: str) -> None:
    """Refuse positive numbers so large or small that their squares or quotients overflow."""
    for number in (float(np.min(values)), float(np.max(values))):
        if not SMALLEST <= number <= LARGEST:
            raise invalid(key, f"have {name} between {SMALLEST:g} and {LARGEST:g}", number)
