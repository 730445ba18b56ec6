"""From the given values to the keys of a scene: each with its value, as it is written, and a comment.

K = M (2 pi f_sc)^2        zeta = 1/(2 Q)        theta^2 = K Cp ((f_oc/f_sc)^2 - 1), Cp clamped
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from harvester.devices.flags import FLAGS, options
from harvester.errors import InputError, invalid, shown
from harvester.scene.keys import kind_of
from harvester.scene.kinds import Kind, any_quantity, with_prefix
from harvester.uncertainty.value import Value

_QUALITY = Kind("a quality factor", "", "125", above=0.0)
_PREFIXED = ("ohm", "F", "Hz", "m")  # units that take a prefix as they stand


@dataclass(frozen=True)
class Key:
    """A line of the scene file."""

    name: str
    value: float | str | dict[str, float | str]
    comment: str


@dataclass(frozen=True)
class Device:
    """The tables of a scene file, in order; ``given`` are the flags' values as numbers in SI units."""

    tables: dict[str, list[Key]]
    given: dict[str, float]


def read(name: str, text: str) -> float:
    """The value of a flag in SI units, read as the command line reads scene keys.

    Raises InputError, with the flag's name, where it is none.
    """
    try:
        return with_prefix(text, _kind(name))
    except ValueError as error:
        raise InputError(f"{FLAGS[name].option} {error}, but is {shown(text)}") from None


def missing(given: Mapping[str, object]) -> list[tuple[str, ...]]:
    """What is still needed: each a choice of flags."""
    needed: list[tuple[str, ...]] = []
    mechanical = [name for name in ("mass", "stiffness", "frequency") if name in given]
    if "mass" not in given and "stiffness" not in given:
        needed.append(("mass", "stiffness"))
        if "frequency" not in given:
            needed.append(("frequency",))
    elif len(mechanical) < 2:
        needed.append(("frequency", "stiffness" if "mass" in given else "mass"))
    others = (("damping_ratio", "q"), ("capacitance",), ("coupling", "open_circuit_frequency"))
    return needed + [choice for choice in others if not any(name in given for name in choice)]


def check(given: Mapping[str, object], netlist: str | None, parameters: Mapping[str, str]) -> None:
    """InputError for flags that do not go together."""
    if all(name in given for name in ("mass", "stiffness", "frequency")):
        raise InputError("one of `mass`, `stiffness` and `frequency` must be left out, but all three are given")
    for pair in (("damping_ratio", "q"), ("coupling", "open_circuit_frequency")):
        if all(name in given for name in pair):
            raise InputError(f"one of {options(*pair)} must be left out, but both are given")
    for name, other in (
        ("gap", "restitution"),
        ("acceleration_amplitude", "drive_frequency"),
        ("drive_frequency", "acceleration_amplitude"),
    ):
        if name in given and other not in given:
            raise InputError(f"{options(other)} must be given with {options(name)}, but is left out")
    if "resistance" in given and netlist is not None:
        raise InputError("one of `resistance`, `netlist` must be left out, but both are given")
    if parameters and netlist is None:
        raise InputError("`netlist` must be given with `parameter`, but is left out")


def device(
    texts: Mapping[str, str], title: str = "", netlist: str | None = None, parameters: Mapping[str, str] | None = None
) -> Device:
    """The scene of a device from texts by flag; ``netlist`` as the scene file names it.

    Raises
    ------
    InputError
        for a value that is none, flags that do not go together, and those that are missing.
    """
    parameters = parameters or {}
    check(texts, netlist, parameters)
    if needed := missing(texts):
        told = ", ".join(" or ".join(FLAGS[name].option for name in choice) for choice in needed)
        raise InputError(f"these must be given: {told}, but are left out")
    given = {name: read(name, text) for name, text in texts.items()}
    written = {name: _as_written(name, text) for name, text in texts.items()}
    tables: dict[str, list[Key]] = {"": [Key("title", title, "")] if title else []}
    tables["oscillator"] = _oscillator(given, written)
    tables["piezo"] = _piezo(given, written)
    tables["stop"] = [
        Key(name, written[name], comment)
        for name, comment in (
            ("restitution", "speed after over speed before an impact"),
            ("gap", "from the mass at rest; negative: pressed on it"),
        )
        if name in given
    ]
    tables["excitation"] = [
        Key(key, written[name], comment)
        for name, key, comment in (
            ("acceleration_psd", "acceleration_psd", "one-sided density of the base's white noise"),
            ("acceleration_amplitude", "acceleration_amplitude", "of the base's harmonic motion, peak"),
            ("drive_frequency", "frequency", "of the harmonic motion"),
        )
        if name in given
    ]
    tables["load"] = []
    if "resistance" in given:
        tables["load"].append(Key("resistance", written["resistance"], "across the electrodes"))
    if netlist is not None:
        tables["load"].append(Key("netlist", netlist, "a file of netlists/, or a path"))
        values = {name: _parameter(name, text) for name, text in parameters.items()}
        if values:
            tables["load"].append(Key("parameters", values, "of the netlist"))
    return Device(tables, given)


def _oscillator(given: dict[str, float], written: dict[str, float | str]) -> list[Key]:
    mass, stiffness, f = (given.get(name) for name in ("mass", "stiffness", "frequency"))
    if stiffness is not None and stiffness <= 0.0:
        raise invalid(
            "`stiffness`", "be above 0 (two wells need [oscillator] cubic_stiffness: harvester keys)", stiffness
        )
    square = None if f is None else (2.0 * math.pi * f) ** 2
    keys = []
    if mass is not None:
        keys.append(Key("mass", written["mass"], "effective (modal) mass"))
    else:
        assert stiffness is not None and square is not None and f is not None
        keys.append(Key("mass", stiffness / square, f"kg, effective: stiffness/(2 pi f_sc)^2, f_sc = {_hertz(f)}"))
    if stiffness is not None:
        keys.append(Key("stiffness", written["stiffness"], "in short circuit"))
    else:
        assert mass is not None and square is not None and f is not None
        keys.append(Key("stiffness", mass * square, f"N/m, in short circuit: mass (2 pi f_sc)^2, f_sc = {_hertz(f)}"))
    if "q" in given:
        keys.append(Key("damping_ratio", 0.5 / given["q"], f"mechanical: 1/(2 Q), Q = {given['q']:g}"))
    else:
        keys.append(
            Key("damping_ratio", written["damping_ratio"], "mechanical, of the critical; Q = 1/(2 damping_ratio)")
        )
    return keys


def short_circuit(given: Mapping[str, float]) -> tuple[float, float]:
    """Stiffness (N/m) and resonance frequency in short circuit (Hz)."""
    mass, stiffness, f = (given.get(name) for name in ("mass", "stiffness", "frequency"))
    if f is None:
        assert mass is not None and stiffness is not None
        return stiffness, math.sqrt(stiffness / mass) / (2.0 * math.pi)
    if stiffness is None:
        assert mass is not None
        stiffness = mass * (2.0 * math.pi * f) ** 2
    return stiffness, f


def _piezo(given: dict[str, float], written: dict[str, float | str]) -> list[Key]:
    capacitance = Key("capacitance", written["capacitance"], "clamped: with the mass held")
    if "coupling" in given:
        return [Key("coupling", written["coupling"], "force a volt, charge a displacement"), capacitance]
    stiffness, short = short_circuit(given)
    open_circuit = given["open_circuit_frequency"]
    if not open_circuit > short:
        raise invalid(
            "`open_circuit_frequency`",
            f"be above the resonance in short circuit, {_hertz(short)}",
            _hertz(open_circuit),
        )
    ratio = open_circuit / short
    coupling = math.sqrt(stiffness * given["capacitance"] * (ratio - 1.0) * (ratio + 1.0))
    word = f"N/V: coupling^2 = stiffness capacitance ((f_oc/f_sc)^2 - 1), f_oc = {_hertz(open_circuit)}"
    return [Key("coupling", coupling, word), capacitance]


def _kind(name: str) -> Kind:
    return kind_of(FLAGS[name].key) if FLAGS[name].key else _QUALITY


def _as_written(name: str, text: str) -> float | str:
    """The text where a scene file reads that number from it, else one with a prefix that does, else the number."""
    kind, number = _kind(name), read(name, text)
    if kind.unit == "":
        return number
    candidates = [text.strip()]
    if kind.unit in _PREFIXED:
        candidates.append(Value(number).text(kind.unit))
    for one in candidates:
        try:
            if kind.read(one) == number:
                return one
        except ValueError:
            pass
    return number


def _parameter(name: str, text: str) -> float | str:
    try:
        number = any_quantity(text)
    except ValueError as error:
        raise InputError(f"`parameter` {name} {error}, but is {shown(text)}") from None
    try:
        plain = float(text)
    except ValueError:
        return text.strip()
    return number if plain == number else text.strip()


def _hertz(f: float) -> str:
    return Value(f).text("Hz")
