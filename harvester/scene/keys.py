"""All keys of a scene file, with unit, meaning and example: read off the scene's dataclasses."""

import dataclasses
from dataclasses import dataclass, fields

from harvester.errors import unknown
from harvester.scene.scene import TABLES, metadata
from harvester.scene.units import Kind


@dataclass(frozen=True)
class SceneKey:
    """A key as the list shows it; ``unit`` is empty for a number or a text; ``needed``: its table cannot be without."""

    table: str
    name: str
    unit: str
    meaning: str
    example: str
    needed: bool


def keys() -> tuple[SceneKey, ...]:
    """Every key, table by table."""
    found = []
    for table, kind in TABLES.items():
        for field in fields(kind):  # type: ignore[arg-type]
            notes = metadata(kind, field.name)
            quantity = next((note for note in notes if isinstance(note, Kind)), None)
            texts = [note for note in notes if isinstance(note, str)]
            meaning = texts[0] if texts else quantity.name if quantity else ""
            example = texts[1] if len(texts) > 1 else quantity.example if quantity else ""
            needed = table != "nondimensional" and _needed(table, field.name)
            found.append(
                SceneKey(
                    table, field.name, quantity.unit if quantity else "", meaning, example.replace("'", '"'), needed
                )
            )
    return tuple(found)


def _needed(table: str, name: str) -> bool:
    field = next(f for f in fields(TABLES[table]) if f.name == name)  # type: ignore[arg-type]
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def chosen(what: str | None) -> tuple[SceneKey, ...]:
    """All, those of a table, or one key such as ``load.resistance``; InputError with the nearest match otherwise."""
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
    """The list for people."""
    wide = [
        max(len(one) for one in column) for column in zip(*((k.name, k.unit, k.example) for k in some), strict=True)
    ]
    lines: list[str] = []
    table = ""
    for key in some:
        if key.table != table:
            table = key.table
            lines += [""] * bool(lines) + [f"[{table}]"]
        cells = (f"{one:<{width}}" for one, width in zip((key.name, key.unit, key.example), wide, strict=True))
        lines.append(f"  {'  '.join(cells)}  {key.meaning}{' (needed)' if key.needed else ''}")
    return "\n".join(lines)
