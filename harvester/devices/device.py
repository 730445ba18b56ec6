"""From the values of a datasheet to the tables of a scene file: each key with its value as written and a comment.

K = M (2 pi f_sc)^2        zeta = 1/(2 Q)        theta^2 = K Cp ((f_oc/f_sc)^2 - 1), Cp clamped
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import TypeAlias

from harvester.devices.beam import BeamMode
from harvester.devices.datasheet import FIELDS, TEXTS, arguments
from harvester.errors import InputError, invalid, reading
from harvester.quantities.kinds import QUALITY, Kind, any_quantity, with_prefix
from harvester.quantities.units import prefix_factor, split_unit
from harvester.records.profiles.catalogue import SHARED
from harvester.scene.keys import kind_of
from harvester.uncertainty.value import Value

_PREFIXED = ("ohm", "F", "Hz", "m")  # units that take a prefix as they stand
_COPIED = {  # fields that stand in the scene file as they are: their tables, keys and comments
    "strain_per_displacement": (
        "piezo",
        "strain_per_displacement",
        "1/m, largest strain of the piezo, at the clamp",
    ),
    "restitution": ("stop", "restitution", "speed after over speed before an impact"),
    "gap": ("stop", "gap", "from the mass at rest; negative: pressed on it"),
    "acceleration_psd": (
        "excitation",
        "acceleration_psd",
        "one-sided density of the base's white noise",
    ),
    "acceleration_amplitude": (
        "excitation",
        "acceleration_amplitude",
        "peak of the base's harmonic motion",
    ),
    "drive_frequency": ("excitation", "frequency", "frequency of the harmonic motion"),
    "profile": ("excitation", "profile", "an excitation by name; harvester keys profile"),
    "level": ("excitation", "level", "times the accelerations of the profile"),
    "pulse_duration": ("excitation", "pulse_duration", "duration of a shock"),
    "event_rate": ("excitation", "event_rate", "shocks per second; without it a single one"),
    "harmonics": ("excitation", "harmonics", "peaks at 1, 2, ... times the speed of rotation"),
    "resistance": ("load", "resistance", "across the electrodes"),
}


@dataclass(frozen=True)
class Entry:
    """One line of the scene file: a key, its value and a comment."""

    key: str
    value: float | str | list[str] | dict[str, float | str]
    comment: str


BOARD = {  # keys of [load] that name parts of a flat netlist, with their comments
    "terminals": "nets of the piezo",
    "resistor": "the load",
    "store": "the storage capacitor",
}
# of a scene file, in order; "" holds the keys before the first table
Tables: TypeAlias = dict[str, list[Entry]]


def read(name: str, text: str) -> float:
    """The value of a field in SI units, read as the command line reads scene keys.

    Raises InputError with the field's name, for a text that is not such a value.
    """
    return reading(f"`{name}`", partial(with_prefix, kind=_kind(name)), text)


def known_values(texts: Mapping[str, str]) -> dict[str, float]:
    """The fields of a linear device in SI units, as far as the texts give them.

    A pair of resonances gives ``beta``, theta^2/(K Cp), in place of the coupling.

    Raises InputError for a text that is not a value.
    """
    names = (*("mass", "stiffness", "frequency", "damping_ratio", "q", "capacitance"), "coupling")
    values = {name: read(name, texts[name]) for name in names if name in texts}
    if "stiffness" in values and ("mass" in values or "frequency" in values):
        if "mass" in values:
            values["frequency"] = _short_circuit(values)[1]
        else:
            values["mass"] = values["stiffness"] / (2.0 * math.pi * values["frequency"]) ** 2
    if values.get("damping_ratio", 0.0) > 0.0:
        values["q"] = 0.5 / values["damping_ratio"]
    other = "open_circuit_frequency"
    if other in texts and "frequency" in values:
        values["beta"] = _beta(values["frequency"], read(other, texts[other]))
    return values


def missing(known: Mapping[str, object]) -> list[tuple[str, ...]]:
    """The choices of fields of which one each is still needed."""
    needed: list[tuple[str, ...]] = []
    if "mass" not in known and "stiffness" not in known:
        needed.append(("mass", "stiffness"))
        if "frequency" not in known:
            needed.append(("frequency",))
    elif sum(name in known for name in ("mass", "stiffness", "frequency")) < 2:
        needed.append(("frequency", "stiffness" if "mass" in known else "mass"))
    others = (("damping_ratio", "q"), ("capacitance",), ("coupling", "open_circuit_frequency"))
    return needed + [choice for choice in others if not any(name in known for name in choice)]


def check(known: Mapping[str, object], netlist: str | None, parameters: Mapping[str, str]) -> None:
    """Refuse fields that contradict each other.

    Raises InputError which names the field to leave out, or the field to add.
    """
    if all(name in known for name in ("mass", "stiffness", "frequency")):
        raise InputError(
            "one of `mass`, `stiffness` and `frequency` must be left out, but all three are given"
        )
    for pair in (("damping_ratio", "q"), ("coupling", "open_circuit_frequency")):
        if all(name in known for name in pair):
            raise InputError(f"one of {arguments(pair)} must be left out, but both are given")
    harmonic = (
        ("acceleration_amplitude", "drive_frequency"),
        ("drive_frequency", "acceleration_amplitude"),
    )
    for name, other in (("gap", "restitution"), *(() if "profile" in known else harmonic)):
        if name in known and other not in known:
            raise InputError(f"`{other}` must be given with `{name}`, but is left out")
    if "resistance" in known and netlist is not None:
        raise InputError("one of `resistance`, `netlist` must be left out, but both are given")
    if parameters and netlist is None:
        raise InputError("`netlist` must be given with `parameter`, but is left out")


def scene_tables(
    texts: Mapping[str, str],
    title: str = "",
    netlist: str | None = None,
    parameters: Mapping[str, str] | None = None,
    higher_modes: Sequence[BeamMode] = (),
    board: Mapping[str, str | list[str]] = MappingProxyType({}),
) -> Tables:
    """The tables of the scene of a device, from the texts of its datasheet.

    ``netlist`` as the scene file names it.

    ``higher_modes`` are those above the first, which get its mass and damping; ``board`` names the
    parts of a flat netlist, by the keys of [load].

    Raises InputError for a text that is not a value, fields that contradict each other, and those
    that are missing.
    """
    parameters = parameters or {}
    check(texts, netlist, parameters)
    if needed := missing(texts):
        raise InputError(
            f"these must be given: {', '.join(arguments(choice, ' or ') for choice in needed)}, but are left out"
        )
    values = {name: read(name, text) for name, text in texts.items() if name not in TEXTS}
    written: dict[str, float | str] = {name: _as_written(name, texts[name]) for name in values}
    words = {name: texts[name].strip() for name in TEXTS if name in texts}
    tables: Tables = {"": [Entry("title", title, "")] if title else []}
    tables |= {"oscillator": _oscillator(values, written), "piezo": _piezo(values, written)}
    tables |= {
        f"mode.{number}": _mode(mode, tables["oscillator"])
        for number, mode in enumerate(higher_modes, 2)
    }
    tables |= {"stop": [], "excitation": [], "load": []}
    _copy(texts, {**written, **words}, tables)
    if netlist is not None:
        tables["load"].append(Entry("netlist", netlist, "a file of netlists/, or a path"))
    tables["load"] += [Entry(key, value, BOARD[key]) for key, value in board.items()]
    if parameters:
        numbers = {name: _parameter(name, text) for name, text in parameters.items()}
        tables["load"].append(Entry("parameters", numbers, "parameters of the netlist"))
    return tables


def _copy(texts: Mapping[str, str], values: Mapping[str, float | str], tables: Tables) -> None:
    """Put the values that scene and datasheet share into its tables."""
    for name, (table, key, comment) in _COPIED.items():
        if name in texts:
            value = (
                [harmonic.strip() for harmonic in texts[name].split(",")]
                if name == "harmonics"
                else values[name]
            )
            whose = "key of the profile" if key in SHARED and "profile" in texts else comment
            tables[table].append(Entry(key, value, whose))


def _oscillator(values: dict[str, float], written: dict[str, float | str]) -> list[Entry]:
    """The entries of mass, stiffness and damping, the third computed from the others if it is left out."""
    if values.get("stiffness", 1.0) <= 0.0:
        raise invalid(
            "`stiffness`",
            "be above 0 (two wells need [oscillator] cubic_stiffness: harvester keys)",
            values["stiffness"],
        )
    f = values.get("frequency", math.nan)
    square = (2.0 * math.pi * f) ** 2
    at = f"f_sc = {_hertz(f)}" if "frequency" in values else ""
    if "mass" in values:
        mass = Entry("mass", written["mass"], "effective (modal) mass")
    else:
        mass = Entry(
            "mass", values["stiffness"] / square, f"kg, effective: stiffness/(2 pi f_sc)^2, {at}"
        )
    if "stiffness" in values:
        stiffness = Entry("stiffness", written["stiffness"], "in short circuit")
    else:
        word = f"N/m, in short circuit: mass (2 pi f_sc)^2, {at}"
        stiffness = Entry("stiffness", values["mass"] * square, word)
    if "q" in values:
        q = values["q"]
        return [mass, stiffness, Entry("damping_ratio", 0.5 / q, f"mechanical: 1/(2 Q), Q = {q:g}")]
    word = "mechanical, of the critical; Q = 1/(2 damping_ratio)"
    return [mass, stiffness, Entry("damping_ratio", written["damping_ratio"], word)]


def _mode(mode: BeamMode, oscillator: list[Entry]) -> list[Entry]:
    """The entries of a further mode, with mass and damping of the first."""
    mass, _, ratio = oscillator
    return [
        Entry("frequency", float(f"{mode.frequency:.7g}"), "Hz, in short circuit"),
        Entry("mass", mass.value, "that of the first, by its shape's scale"),
        Entry("damping_ratio", ratio.value, "assumed equal to that of the first"),
        Entry("coupling", float(f"{mode.coupling:.7g}"), "N/V, by the slope at the end"),
        Entry("base", float(f"{mode.base:.7g}"), "participation in the base's acceleration"),
        Entry(
            "at_stop",
            float(f"{mode.at_stop:.7g}"),
            "the tip's displacement, over that of the first mode",
        ),
    ]


def _short_circuit(values: Mapping[str, float]) -> tuple[float, float]:
    """The stiffness (N/m) and the resonance frequency (Hz) in short circuit."""
    if "frequency" not in values:
        return values["stiffness"], math.sqrt(values["stiffness"] / values["mass"]) / (
            2.0 * math.pi
        )
    f = values["frequency"]
    return values["stiffness"] if "stiffness" in values else values["mass"] * (
        2.0 * math.pi * f
    ) ** 2, f


def _piezo(values: dict[str, float], written: dict[str, float | str]) -> list[Entry]:
    """The entries of coupling, which the open-circuit resonance may replace, and of capacitance."""
    capacitance = Entry("capacitance", written["capacitance"], "clamped: with the mass held")
    if "coupling" in values:
        return [
            Entry("coupling", written["coupling"], "force per volt, charge per displacement"),
            capacitance,
        ]
    stiffness, short = _short_circuit(values)
    open_circuit = values["open_circuit_frequency"]
    coupling = math.sqrt(stiffness * values["capacitance"] * _beta(short, open_circuit))
    word = f"N/V: coupling^2 = stiffness capacitance ((f_oc/f_sc)^2 - 1), f_oc = {_hertz(open_circuit)}"
    return [Entry("coupling", coupling, word), capacitance]


def _beta(short: float, open_circuit: float) -> float:
    """The coupling theta^2/(K Cp) of the resonances (Hz) in short and open circuit.

    InputError unless above 0.
    """
    if not open_circuit > short:
        must = f"be above the resonance in short circuit, {_hertz(short)}"
        raise invalid("`open_circuit_frequency`", must, _hertz(open_circuit))
    ratio = open_circuit / short
    return (ratio - 1.0) * (ratio + 1.0)


def _kind(name: str) -> Kind:
    """The kind of quantity that a field is."""
    return kind_of(FIELDS[name].key) if FIELDS[name].key else QUALITY


def _as_written(name: str, text: str) -> float | str:
    """The text if a scene file reads the same number from it, else one with a prefix that does, else the number."""
    kind = _kind(name)
    number = read(name, text)
    if kind.unit == "":
        return number
    parts = split_unit(text)
    # 1M is written 1 Mohm
    bare = parts is not None and parts[1] != kind.unit and prefix_factor(parts[1]) is not None
    candidates = [] if bare else [text.strip()]
    if kind.unit in _PREFIXED:
        candidates.append(Value(number).format(kind.unit))
    for candidate in candidates:
        try:
            if kind.read(candidate) == number:
                return candidate
        except ValueError:
            pass
    return number


def _parameter(name: str, text: str) -> float | str:
    """A parameter of the netlist: a number if the text is one, else the text."""
    number = reading(f"`parameter` {name}", any_quantity, text)
    try:
        plain = float(text)
    except ValueError:
        return text.strip()
    return number if plain == number else text.strip()


def _hertz(f: float) -> str:
    """A frequency as a text."""
    return Value(f).format("Hz")
