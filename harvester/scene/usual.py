"""Values that no such device has: most are right in number and wrong in unit."""

import math

from harvester.scene.keys import TABLES, key_kind
from harvester.scene.kinds import Kind
from harvester.scene.scene import Scene


def unusual_values(scene: Scene) -> list[str]:
    """A warning with the likely unit for each number of a scene that is far outside of what such devices have."""
    found = []
    for table, keys in scene.tables().items():
        for name, value in keys.items() if table in TABLES else ():
            kind = key_kind(table, name)
            if kind is not None and (doubt := unusual(f"{table}.{name}", value, kind)):
                unit = kind.example.strip("'").partition(" ")[2]
                likely = f"{value / 1000.0 ** (math.log10(abs(value)) // 3):.4g} {unit}"
                found.append(doubt + (f": is {likely} meant?" if unit not in ("", kind.unit) else ""))
    return found


def unusual(what: str, value: float, kind: Kind) -> str:
    """A warning that a value in SI units is far outside of what such devices have (`Kind.usual`); empty where not."""
    low, high = kind.usual
    if value == 0.0 or low <= abs(value) <= high:
        return ""
    return f"{what} is {value:.4g} {kind.unit}, far outside of the {low:g} to {high:g} {kind.unit} of such devices"
