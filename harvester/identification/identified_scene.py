"""The scene file of an identified device: values with their intervals as comments, and the missing values."""

import math
from pathlib import Path

from harvester.devices import scene_file
from harvester.devices.device import Entry, Tables
from harvester.identification.identification_result import IdentificationResult, Parameter
from harvester.identification.quantities import NEEDED
from harvester.machine import files
from harvester.scene.schema import write_beside
from harvester.scene.toml import loads

SCENE_TABLES = ("oscillator", "piezo", "stop")
_FORMULAS = {
    "oscillator.mass": "",
    "oscillator.stiffness": "(2 pi f_sc)^2 mass",
    "piezo.coupling": "sqrt(theta^2/M mass)",
    "piezo.capacitance": "",
}


_SHORT = dict.fromkeys(NEEDED, "not determined: give it as --known mass=...")
_SHORT["piezo.capacitance"] = "not determined: measure an impedance"
_SHORT_OF_MASS = _SHORT | dict.fromkeys(
    ("oscillator.stiffness", "piezo.coupling"), "not determined: measure another electrical state"
)


def text(result: IdentificationResult, title: str) -> str:
    """The text of the scene file; keys that are not determined are in it as comments."""
    tables: Tables = {"": [Entry("title", title, "")], "excitation": [], "load": []}
    tables |= {name: [] for name in SCENE_TABLES}
    for parameter in result.parameters:
        table, _, key = parameter.key.partition(".")
        if table in SCENE_TABLES:
            tables[table].append(Entry(key, float(f"{parameter.value:.9g}"), comment(parameter)))
    lines = scene_file.text({name: tables[name] for name in ("", *scene_file.TABLES)}).splitlines()
    known = {parameter.key for parameter in result.parameters}
    for key in reversed(NEEDED):
        if key not in known:
            table, _, name = key.partition(".")
            heads = [
                k for k, line in enumerate(lines) if line.startswith((f"[{table}]", f"# [{table}]"))
            ]
            formula = f" = {_FORMULAS[key]}" if _FORMULAS[key] else " = ?"
            why = _SHORT_OF_MASS if "oscillator.mass" in known else _SHORT
            lines.insert(heads[0] + 1, f"{f'# {name}{formula}':<{scene_file.WIDTH}} # {why[key]}")
    rest = [
        f"#   {parameter.key} = {parameter.value:.7g} ({comment(parameter)})"
        for parameter in result.parameters
        if parameter.key.partition(".")[0] not in SCENE_TABLES
    ]
    return "\n".join([*lines, *_second_mode(result), "", "# Also measured:", *rest]) + "\n"


def _second_mode(result: IdentificationResult) -> list[str]:
    """The table of a second mode as comments, as an impedance leaves open its part in the base's motion.

    It determines theta^2/M: the mass is that of the first mode, which gives base and at_stop the
    values that they are in that scale.
    """
    values = {
        parameter.key.removeprefix("mode.2."): parameter.value for parameter in result.parameters
    }
    if "frequency" not in values or not is_whole(result):
        return []
    mass = values["oscillator.mass"]
    rows = [
        ("[[mode]]", "the second: remove the # in front once `base` is known"),
        (f"frequency = {values['frequency']:.9g}", "Hz, in short circuit"),
        (f"damping_ratio = {values['damping_ratio']:.9g}", ""),
        (f"mass = {mass:.9g}", "kg, as the first, which sets the scale of the other values"),
        (
            f"coupling = {math.sqrt(values['coupling_squared_per_mass'] * mass):.9g}",
            "N/V; its sign changes with that of base",
        ),
        ("base = ?", "not determined: participation in the base's acceleration"),
        ("at_stop = ?", "not determined: displacement at a stop over that of the mode"),
    ]
    return [
        "",
        *(f"{f'# {line}':<{scene_file.WIDTH}} # {word}".rstrip(" #") for line, word in rows),
    ]


def comment(parameter: Parameter) -> str:
    """The interval of a parameter in words, in the unit of the scene file."""
    if parameter.low == parameter.high:
        return f"{parameter.unit}, given as known".lstrip(", ")
    unit = f"{parameter.unit}, " if parameter.unit else ""
    return f"{unit}95 %: {parameter.low:.7g} to {parameter.high:.7g}"


def is_whole(result: IdentificationResult) -> bool:
    """Whether the scene has all that a scene needs."""
    return set(NEEDED) <= {parameter.key for parameter in result.parameters}


def write(path: Path, result: IdentificationResult, title: str, force: bool) -> None:
    """Write the scene file, whole or not at all.

    Raises InputError if the file is there and not to be overwritten, or cannot be written.
    """
    scene_file.check(path, force)
    content = text(result, title)
    if is_whole(result):
        loads(content, path.parent)  # refuses numbers that no scene has
    files.write(path, content, "out")
    write_beside(path)
