"""All keys of a scene file, with unit, meaning and example, read off the scene's dataclasses; and their values."""

import difflib
import functools
from collections.abc import Collection

from harvester.errors import InputError, invalid, reading, shown, unknown
from harvester.presentation.columns import columns
from harvester.quantities.kinds import Kind, any_quantity, with_prefix
from harvester.scene.load import Load
from harvester.scene.nondimensional import Nondimensional
from harvester.scene.physical import (
    Ball,
    Excitation,
    Magnifier,
    Mode,
    OppositeStop,
    Oscillator,
    Piezo,
    Stop,
)
from harvester.scene.sensor_node import HarvestingChip, SensorNode, Storage
from harvester.scene.table import SceneKey, SceneTable, key_names, keys_of, notes

TABLES: dict[str, type[SceneTable]] = {
    table.TABLE: table
    for table in (
        *(
            Oscillator,
            Piezo,
            Stop,
            OppositeStop,
            Mode,
            Magnifier,
            Ball,
            Excitation,
            Load,
            Storage,
            SensorNode,
        ),
        *(HarvestingChip, Nondimensional),
    )
}

# tables of which a scene has several: [[mode]], the first of which is that of mode 2
SEVERAL = (Mode.TABLE,)
BESIDE = (
    Storage.TABLE,
    SensorNode.TABLE,
    HarvestingChip.TABLE,
    Mode.TABLE,
    Magnifier.TABLE,
    Ball.TABLE,
)  # of what is beside the device
MODES = ("2", "3", "4")  # the numbers of further modes
# as in SPICE
_OF_PARAMETERS = {"R": "ohm", "C": "F", "L": "H", "Rcoil": "ohm", "Rcore": "ohm", "Cp": "F"}


def keys() -> tuple[SceneKey, ...]:
    """Every key of a scene file, table by table."""
    return tuple(key for table in TABLES.values() for key in keys_of(table))


def chosen(what: str | None) -> tuple[SceneKey, ...]:
    """All keys, those of a table, or one such as ``load.resistance``.

    InputError with the nearest match otherwise.
    """
    everything = keys()
    if what is None:
        return everything
    names = {f"{key.table}.{key.name}": key for key in everything}
    if what in names:
        return (names[what],)
    if what in TABLES:
        return tuple(key for key in everything if key.table == what)
    raise unknown("scene table or key", what, [*TABLES, *names])


def text(some: tuple[SceneKey, ...]) -> str:
    """The keys as `harvester keys` lists them, under the names of their tables."""
    cells = [
        (key.name, key.unit, key.example, key.meaning + " (needed)" * key.needed) for key in some
    ]
    lines: list[str] = []
    table = ""
    for key, line in zip(some, columns(cells, "  "), strict=True):
        if key.table != table:
            table = key.table
            lines += [""] * bool(lines) + [f"[[{table}]]" if table in SEVERAL else f"[{table}]"]
        lines.append(line)
    return "\n".join(lines)


def full_key(key: str, present: Collection[str] = ()) -> str:
    """The whole name of a key that may be given bare: "mu" is nondimensional.mu, for only that table has one.

    A key of the device precedes one of a table that is compared with it: "capacitance" is that of
    the piezo.  If several tables of the device have the key, it is that of the only one of them among
    the tables ``present`` in a scene.

    Raises InputError if several tables have the key; any other text comes back as it is.
    """
    if "." in key or key in TABLES:
        return key
    having = [table for table, of in TABLES.items() if key in key_names(of)]
    device = [table for table in having if table not in BESIDE]
    candidates = [f"{table}.{key}" for table in device or having]
    here = [candidate for candidate in candidates if candidate.partition(".")[0] in present]
    if len(here) == 1:
        return here[0]
    if len(candidates) > 1:
        raise InputError(
            f"key {key!r} must be given with its table, but several have it: {', '.join(candidates)}"
        )
    return candidates[0] if candidates else key


def whole_key(key: str, present: Collection[str] = ()) -> str:
    """As `full_key`; InputError for a key that no scene has."""
    return ".".join(split_key(full_key(key, present)))


def split_key(key: str) -> tuple[str, str]:
    """The table and the name of a key, such as ("load", "resistance").

    InputError for a key that no scene has.

    That of a further mode is "mode.2.frequency", with the name "2.frequency".
    """
    table, _, name = full_key(key).partition(".")
    if table in SEVERAL:
        number, _, name = name.partition(".")
        if number not in MODES:
            must = f"have the number of a further mode, such as {table}.2.{name or number}"
            raise invalid(shown(key), must, number or "none")
        if name not in key_names(TABLES[table]):
            raise unknown(f"[[{table}]] key", name, key_names(TABLES[table]))
        return table, f"{number}.{name}"
    if table not in TABLES:
        bare = {} if name else {key for of in TABLES.values() for key in key_names(of)}
        if difflib.get_close_matches(table[:120], bare):
            raise unknown("scene key", table, bare)
        raise unknown("scene table", table, TABLES)
    names = [written.replace("parameters", "parameters.R") for written in key_names(TABLES[table])]
    parameter = name.removeprefix("parameters.")  # of a netlist
    if name not in names and not (table == "load" and parameter not in ("", name)):
        raise unknown(f"[{table}] key", name, names)
    return table, name


def read_value(key: str, text: str) -> float:
    """A value of a scene key as the command line writes it ("1k", "1 Mohm"), in SI units.

    InputError for another.
    """
    _, name = split_key(key)
    reader = (
        any_quantity
        if name.startswith("parameters.")
        else functools.partial(with_prefix, kind=kind_of(key))
    )
    return reading(key, reader, text)


def kind_of(key: str) -> Kind:
    """The kind of quantity of a scene key.

    InputError for a key that no scene has, or that is not a number.
    """
    kind = key_kind(*split_key(key))
    if kind is None:
        raise InputError(f"{key} must be a key with a number to be varied")
    return kind


def unit_of(key: str) -> str:
    """The SI unit of a scene key, "1" if it is a number; "" for a netlist's parameter whose unit is not known."""
    table, name = split_key(key)
    if name.startswith("parameters."):
        return _OF_PARAMETERS.get(name.removeprefix("parameters."), "")
    kind = key_kind(table, name)
    return (kind.unit if kind else "") or "1"


@functools.cache
def key_kind(table: str, name: str) -> Kind | None:
    """The kind of quantity of a table's key, out of its annotation.

    None for a key that is a text or a table.
    """
    name = name.rpartition(".")[2] if table in SEVERAL else name
    return next((note for note in notes(TABLES[table], name) if isinstance(note, Kind)), None)
