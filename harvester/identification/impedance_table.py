"""The impedance of a table, from whichever pair of columns it has.

    |Z| and phase, |Y| and phase, R and X, G and B

    Cp and D:   1/Z = j w Cp (1 - j D)          Cs and D:   Z = (1 + j D)/(j w Cs)
    Cp and Rp:  1/Z = 1/Rp + j w Cp             Cs and Rs:  Z = Rs + 1/(j w Cs)
    Cp and G:   1/Z = G + j w Cp                Ls and Rs:  Z = Rs + j w Ls

w = 2 pi f.  A quality factor is 1/D.  |Z| without a phase is an impedance of unknown phase.  The
parts of Z and Y are also written as Z', Zre, Re(Z) or realz, a minus precedes the negative of a
quantity (-Z''), and a reflection coefficient (S11) is left out, since a table does not state its
reference impedance.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError, invalid, shown
from harvester.quantities.kinds import CAPACITANCE, Kind
from harvester.records.csv_table import CsvColumn, CsvTable
from harvester.records.named_columns import words_of

OHM, SIEMENS = (
    Kind("an impedance (ohm)", "ohm", "'1 kohm'"),
    Kind("an admittance (S)", "S", "'1 uS'"),
)
_HENRY = Kind("an inductance (H)", "H", "'1 mH'")
_ANGLE, _LOSS = Kind("an angle (rad)", "rad", "'90 deg'"), Kind("a loss", "", "0.02")
_PHASE = {"phase", "theta", "angle", "arg", "phi", "deg", "\u03b8", "\u03c6", "phasez", "zphz"}
# words of the phases of an impedance and of an admittance
_OF_IMPEDANCE = {"z", "impedance", "phasez", "zphz"}
_OF_ADMITTANCE = {"y", "admittance"}
# words of an impedance's phase, beside that of a reflection
_OF_ANALYSERS = {"theta", "phi", "\u03b8", "\u03c6"}
_QUANTITIES = {  # words of a column, and its kind
    "z": (words_of("z impedance zabs absz zmod mag magnitude"), OHM),
    "y": (words_of("y admittance"), SIEMENS),
    "r": (words_of("r rs resistance re real esr"), OHM),
    "x": (words_of("x xs reactance im imag"), OHM),
    "g": (words_of("g gp conductance"), SIEMENS),
    "b": (words_of("b bp susceptance"), SIEMENS),
    "cp": (words_of("cp c capacitance"), CAPACITANCE),
    "cs": (words_of("cs"), CAPACITANCE),
    "rp": (words_of("rp"), OHM),
    "ls": (words_of("ls"), _HENRY),
    "d": (words_of("d tan tand loss df"), _LOSS),
    "q": (words_of("q"), _LOSS),
}
_OF_PARTS = {"re", "im", "real", "imag"}  # words of columns that are no sizes
_PARTS_FIRST = re.compile(  # Re(Z), realz: Z stands first then
    r"(real|re|imag|im)[\s_.:(]{0,2}([zy])[sp]?\)?(?!\w)", re.IGNORECASE
)
_OF_COMPLEX = re.compile(  # Z', Zs_re, and (a), (b) of ZView
    r"([zy])[sp]?[\s_.:]{0,2}(?:(real|re|'(?!'))|imag|im|''|\")(?![\w'\"])(?:\([ab]\))?",
    re.IGNORECASE,
)
_NAMES_OF_PARTS = {"z": "RX", "y": "GB"}
_MINUS = ("-", "\u2212")
_REFLECTION = re.compile(r"(?<![a-z])(?:s[ _]?11|gamma|reflection)(?![a-z\d])", re.IGNORECASE)
PHASE = "a phase"
MOST_RADIANS = 6.4  # a larger phase without a unit is in degrees
AGREE = 0.02  # of two pairs of columns that state one impedance

Parts = dict[str, Floats]


def impedance(table: CsvTable, f: Floats, key: str) -> tuple[Complexes, bool] | None:
    """The impedance of a table at frequencies f (Hz), and whether its phase is known.

    None if it has none.

    Raises InputError, which begins with ``key``, for a reactance that is 0 everywhere, for two
    pairs of columns that disagree, for several phases or one of an unknown unit, and for a
    reflection alone.
    """
    reflections = table.find(lambda column: bool(_REFLECTION.search(column.name)))
    kept = tuple(_plain(column) for column in table.columns if column not in reflections)
    answer = _of_columns(replace(table, columns=kept), f, key)
    if answer is None and reflections:
        names = ", ".join(column.name for column in reflections)
        raise InputError(
            f"{key} must have an impedance, but has {shown(names)}, a reflection whose reference "
            "impedance it does not state: export a Touchstone file (.s1p), which does"
        )
    return answer


def _plain(column: CsvColumn) -> CsvColumn:
    """A column whose head is that of R, X, G or B if it names a part of Z or Y, and has no minus."""
    head = column.head.strip()
    values = column.values
    if head.startswith(_MINUS):
        head = head[1:].lstrip()
        values = -values
    if match := _PARTS_FIRST.match(head):
        head = match[2] + match[1] + head[match.end() :]
    if match := _OF_COMPLEX.match(head):
        head = _NAMES_OF_PARTS[match[1].lower()][not match[2]] + head[match.end() :]
    return replace(column, head=head, values=values)


def _of_columns(table: CsvTable, f: Floats, key: str) -> tuple[Complexes, bool] | None:
    """The impedance of columns with plain names, as `impedance` returns it."""
    parts = {
        name: values for name in _QUANTITIES if (values := _part(table, name, key)) is not None
    }
    for size, angle in _phases(table, set(parts), key).items():
        parts[f"phase of {size}"] = angle
    if "q" in parts and "d" not in parts:
        parts["d"] = 1.0 / parts["q"]
    _refuse_zeros(parts, key)
    w = 2.0 * math.pi * f
    ways = [way(parts, w) for needed, way in _WAYS if needed <= set(parts)]
    if not ways:
        sizes = (column.in_si(OHM) for column in table.find(_is_size))
        return next(((size.astype(complex), False) for size in sizes if size is not None), None)
    first = ways[0]
    _refuse_disagreement(ways, parts, key)
    return first, True


def _refuse_disagreement(ways: Sequence[Complexes], parts: Parts, key: str) -> None:
    """Refuse pairs of columns, or a size, that are not of one impedance."""
    first = ways[0]
    for other in ways[1:]:
        if np.nanmedian(np.abs(other / first - 1.0)) > AGREE:
            raise InputError(
                f"{key} must have columns of one impedance, but two pairs of them disagree"
            )
    if "z" in parts and np.nanmedian(np.abs(np.abs(first) / parts["z"] - 1.0)) > AGREE:
        raise InputError(
            f"{key} must have columns of one impedance, but the size of two of them is not that of "
            "the column |Z|"
        )


def _refuse_zeros(parts: Parts, key: str) -> None:
    """Refuse a reactance or a phase that is 0 everywhere, as of a magnitude."""
    for other, name in (("r", "x"), ("z", "phase of z"), ("y", "phase of y")):
        if {other, name} <= set(parts) and not parts[name].any():
            raise InputError(
                f"{key} must have a reactance or a phase other than 0, but it is 0 at all "
                "frequencies: if the other column is a magnitude, name it '|Z| (ohm)' alone"
            )


def _is_size(column: CsvColumn) -> bool:
    """Whether a column is named as the size of an impedance."""
    return bool(_QUANTITIES["z"][0] & set(column.words))


def _part(table: CsvTable, name: str, key: str) -> Floats | None:
    """The numbers of a quantity in SI units; None if no column has it; raises as `only`."""
    names, kind = _QUANTITIES[name]
    columns = list[CsvColumn]()
    for column in table.columns:
        if name in "zy" and set(column.words) & (_OF_PARTS | _PHASE):
            continue
        if column.name.strip("|").lower() in names or names & set(column.words):
            values = column.in_si(kind)
            if values is not None or not column.stated:
                columns.append(replace(column, values=column.values if values is None else values))
    return only(columns, key, kind.name).values if columns else None


def _phases(table: CsvTable, sizes: set[str], key: str) -> Parts:
    """The phases (rad) of the impedance z and the admittance y, by the words of their columns.

    A phase that names neither is of the one size that the table has.
    """
    columns = _phase_columns(table)
    named = {
        size: [column for column in columns if set(column.words) & words]
        for size, words in (("z", _OF_IMPEDANCE), ("y", _OF_ADMITTANCE))
    }
    angles = {size: _radians(only(some, key, PHASE), key) for size, some in named.items() if some}
    if angles or not columns or not sizes & {"z", "y"}:
        return angles
    thetas = [column for column in columns if set(column.words) & _OF_ANALYSERS]
    column = only(thetas or columns, key, PHASE)
    if {"z", "y"} <= sizes:
        raise InputError(
            f"{key} must name the phase of |Z| or |Y|, but column {column.name!r} names neither: "
            "name it 'phase of Z (deg)' or 'phase of Y (deg)'"
        )
    return {"z" if "z" in sizes else "y": _radians(column, key)}


def phase(table: CsvTable, key: str) -> Floats | None:
    """The phase of a response in rad; None if the table has none.

    Raises InputError, which begins with ``key``, for several, and for an unknown unit.
    """
    columns = _phase_columns(table)
    return _radians(only(columns, key, PHASE), key) if columns else None


def _phase_columns(table: CsvTable) -> list[CsvColumn]:
    return table.find(lambda column: bool(set(column.words) & _PHASE) and column.texts is None)


def only(columns: Sequence[CsvColumn], key: str, name: str) -> CsvColumn:
    """The one column of a quantity, which may be repeated with the same numbers.

    Raises InputError, which begins with ``key``, if there are several.
    """
    first = columns[0]
    if any(not np.array_equal(first.values, other.values, equal_nan=True) for other in columns):
        names = ", ".join(column.name for column in columns)
        raise InputError(
            f"{key} must have one column of {name}, but has {shown(names)}: delete the others"
        )
    return first


def _radians(column: CsvColumn, key: str) -> Floats:
    """A phase in rad; in degrees if it has no unit and exceeds the range of radians."""
    argument = f"{key} column {column.name!r}"
    unit = column.stated.replace("°", "deg").replace("degrees", "deg").replace("radians", "rad")
    factor, _ = _ANGLE.scale(unit) if unit else (None, 1)
    if unit and factor is None:
        raise invalid(argument, "have the unit deg or rad", column.stated)
    if factor is None:
        words = set(column.words)
        if words & {"deg", "degree", "degrees"} or np.nanmax(np.abs(column.values)) > MOST_RADIANS:
            factor = math.pi / 180.0
        elif words & {"rad", "radian", "radians"}:
            factor = 1.0
        else:
            raise InputError(
                f"{argument} must have a unit, but has none: name it '{column.name} (deg)' or "
                f"'{column.name} (rad)'"
            )
    return column.values * factor


_WAYS: tuple[tuple[set[str], Callable[[Parts, Floats], Complexes]], ...] = (
    ({"r", "x"}, lambda p, w: np.asarray(p["r"] + 1j * p["x"])),
    ({"z", "phase of z"}, lambda p, w: np.asarray(p["z"] * np.exp(1j * p["phase of z"]))),
    ({"y", "phase of y"}, lambda p, w: np.asarray(np.exp(-1j * p["phase of y"]) / p["y"])),
    ({"z", "phase of y"}, lambda p, w: np.asarray(p["z"] * np.exp(-1j * p["phase of y"]))),
    ({"y", "phase of z"}, lambda p, w: np.asarray(np.exp(1j * p["phase of z"]) / p["y"])),
    ({"g", "b"}, lambda p, w: np.asarray(1.0 / (p["g"] + 1j * p["b"]))),
    ({"cp", "d"}, lambda p, w: np.asarray(1.0 / (1j * w * p["cp"] * (1.0 - 1j * p["d"])))),
    ({"cp", "rp"}, lambda p, w: np.asarray(1.0 / (1.0 / p["rp"] + 1j * w * p["cp"]))),
    ({"cp", "g"}, lambda p, w: np.asarray(1.0 / (p["g"] + 1j * w * p["cp"]))),
    ({"cs", "r"}, lambda p, w: np.asarray(p["r"] + 1.0 / (1j * w * p["cs"]))),
    ({"cs", "d"}, lambda p, w: np.asarray((1.0 + 1j * p["d"]) / (1j * w * p["cs"]))),
    ({"ls", "r"}, lambda p, w: np.asarray(p["r"] + 1j * w * p["ls"])),
)
