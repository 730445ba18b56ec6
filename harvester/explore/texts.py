"""Values of scene keys as texts with their unit, as a person writes them: 5.02e-8 F is "50.2 nF"."""

import math

from harvester.quantities.units import PREFIXES, SYMBOLS, split_unit
from harvester.scene.keys import key_kind, keys, read_value, split_key

_PREFIXED = ("ohm", "F", "H", "Hz", "s", "m", "N/m", "N/V")
# the first letter of a netlist's parameter, as in SPICE
_OF_PARAMETERS = {"R": "ohm", "C": "F", "L": "H"}

_PARAMETERS = "load.parameters."
_MEASURED = {  # what a bench measures (`harvester.explore.measured`): unit and meaning
    "oscillator.frequency": ("Hz", "resonance in short circuit, which turns the stiffness"),
    "oscillator.q": ("", "quality factor, which turns the damping"),
    "piezo.open_circuit_frequency": ("Hz", "resonance in open circuit, which turns the coupling"),
}
_OWN_MEANING = {
    "R": "load resistance",
    "C": "smoothing capacitance",
    "L": "the inductor's inductance",
}
_OWN_MEANING |= {
    "Rcoil": "resistance of the inductor's wire",
    "Rcore": "resistance of the inductor's core",
}
_OWN_MEANING |= {
    "Is": "the diodes' saturation current (A)",
    "N": "the diodes' emission coefficient",
}
_OWN_MEANING |= {
    "Bv": "the diodes' breakdown voltage (V)",
    "Cp": "the piezo's capacitance, for the switch",
}
_OWN_MEANING |= {"play": "fall from the extremum before the switch closes (V)"}
_OWN_MEANING |= {"rest": "voltage at which the switch opens again (V)"}


def meaning_of(key: str) -> str:
    """The meaning of a key, in words."""
    if key in _MEASURED:
        return _MEASURED[key][1]
    if key.startswith(_PARAMETERS):
        return _OWN_MEANING.get(key.removeprefix(_PARAMETERS), "parameter of the netlist")
    return next((known.meaning for known in keys() if f"{known.table}.{known.name}" == key), "")


def unit_on_page(key: str) -> str:
    """The SI unit of a key, "" for a number.

    That of a netlist's parameter is determined by its first letter.
    """
    if key in _MEASURED:
        return _MEASURED[key][0]
    table, name = split_key(key)
    if name.startswith("parameters."):
        return _OF_PARAMETERS.get(name.removeprefix("parameters.")[:1], "")
    kind = key_kind(table, name)
    unit = kind.unit if kind else ""
    return "" if unit.startswith("1/") else unit  # "2.5 1/m" is not a text that a scene file takes


def written(key: str, value: float, like: str = "") -> str:
    """A value in SI units as a text, in the unit of the text ``like`` if that is one of its own, such as g^2/Hz."""
    unit = unit_on_page(key)
    kind = key_kind(*split_key(key))
    like_unit = (split_unit(like) or (0.0, ""))[1]
    if kind is not None and like_unit and like_unit not in _with_prefixes(unit):
        factor, power = kind.scale(like_unit)
        if factor:
            number = (
                value / factor
                if power == 1
                else math.copysign(math.sqrt(abs(value) / factor), value)
            )
            return f"{number:.6g}{'' if like_unit == '%' else ' '}{like_unit}"
    if unit == "kg":
        return prefixed(1e3 * value, "g") if abs(value) < 1.0 else f"{value:.6g} kg"
    return prefixed(value, unit) if unit in _PREFIXED else f"{value:.6g} {unit}".rstrip()


def exactly(key: str, value: float) -> str:
    """A value as `written`, or with all of its digits if that would lose some."""
    text = written(key, value)
    return text if read_value(key, text) == value else f"{value!r} {unit_on_page(key)}".rstrip()


def prefixed(value: float, unit: str) -> str:
    """A number between 1 and 1000 with an SI prefix: 470000 ohm is "470 kohm"."""
    power = 0 if value == 0.0 else 3 * math.floor(math.log10(abs(value)) / 3 + 1e-12)
    power = min(max(power, -15), 9)
    return f"{value / 10.0**power:.6g} {SYMBOLS[power]}{unit}"


def normal(key: str, text: str) -> str:
    """A text for a scene file, from one as it is typed: "470k" for a resistance becomes "470 kohm".

    Raises InputError for a text that is not a value of the key.
    """
    value = read_value(key, text.strip())
    kind = key_kind(*split_key(key))
    # 470k: a prefix alone
    bare = (split_unit(text) or (0.0, ""))[1] in PREFIXES and unit_on_page(key)
    return (
        text.strip()
        if kind is not None and not bare and kind.reads(text.strip())
        else written(key, value)
    )


def in_file(key: str, text: str) -> float | str:
    """The entry in a scene file for a text of the page: the text, or a number if it has no unit."""
    return text if (split_unit(text) or (0.0, ""))[1] else read_value(key, text)


def _with_prefixes(unit: str) -> set[str]:
    if unit == "kg":
        return {"kg", "g", "mg"}
    return {prefix + unit for prefix in PREFIXES} if unit in _PREFIXED else {unit}
