"""A scene file as people write it: "50.2 nF" instead of 5.0200000000000006e-08, and still the same to the last bit."""

from collections.abc import Iterator
from typing import Any

from harvester.quantities.kinds import Kind
from harvester.quantities.units import SYMBOLS
from harvester.scene.keys import key_kind
from harvester.scene.scene import Scene

_PREFIXED = ("ohm", "F", "Hz", "m", "s", "N/m", "N/V")  # units that a prefix stands before
_OTHERS = {
    "kg": ("g", "mg", "kg"),
    "m/s^2": ("g", "m/s^2"),
    "(m/s^2)^2/Hz": ("g^2/Hz", "(m/s^2)^2/Hz"),
}
# the size of a number that a unit is chosen for, where one of the units gives it
_LEAST, _MOST = 0.1, 1000.0
_FEW = 7  # digits: a text with more of them is no better than the number


def as_written(scene: Scene) -> str:
    """The scene file of a scene with its quantities in the units of few digits.

    `loads` gives the same scene back.
    """
    import tomli_w

    tables: dict[str, Any] = {}
    for table, keys in scene.tables().items():
        tables[table] = keys
        if isinstance(keys, dict):
            tables[table] = {name: written(table, name, value) for name, value in keys.items()}
        elif isinstance(keys, list):
            tables[table] = [
                {name: written(table, name, value) for name, value in row.items()} for row in keys
            ]
    return tomli_w.dumps(tables)


def written(table: str, name: str, value: Any) -> Any:
    """A key's value as a text with a unit, if one of few digits is read as exactly that value.

    Else the value.
    """
    kind = key_kind(table, name)
    if kind is None or not isinstance(value, float) or not kind.unit or value == 0.0:
        return value
    texts = [text for unit in _units(kind.unit) if (text := _shortest(kind, value, unit))]
    short = [text for text in texts if _LEAST <= abs(float(text.split()[0])) < _MOST]
    # rather than 1e8 mohm: 8.1e-4 N/V
    plain = [text for text in texts if text.split(maxsplit=1)[1] == kind.unit]
    return min(short or plain or texts, key=len) if texts else value


def _units(unit: str) -> Iterator[str]:
    """The units that a quantity may be written in."""
    if unit in _PREFIXED:
        yield from (prefix + unit for prefix in SYMBOLS.values())
    else:
        yield from _OTHERS.get(unit, (unit,))


def _shortest(kind: Kind, value: float, unit: str) -> str:
    """The text of fewest digits that is read as exactly the value; "" if that needs more than a few."""
    factor, power = kind.scale(unit)
    if factor is None or power != 1:
        return ""
    number = value / factor
    for digits in range(1, _FEW + 1):
        rounded = float(f"{number:.{digits}g}")
        text = f"{rounded:.{_FEW}g} {unit}".replace("e-0", "e-").replace("e+0", "e")
        if kind.read(text) == value:
            return text
    return ""
