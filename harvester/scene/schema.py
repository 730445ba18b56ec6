"""The JSON schema of scene files, by which an editor completes keys, shows their meaning and marks errors.

pydantic makes it from the scene's dataclasses, and the words are those of `harvester keys`.  It
names which tables and keys there are, which are needed, and which form and range a value has.
Which unit a text may have, and which keys exclude each other, only the program knows: whatever the
program accepts, the schema accepts as well.
"""

import itertools
import json
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

from harvester.machine import files
from harvester.scene.keys import TABLES, keys
from harvester.scene.scene import Scene
from harvester.scene.table import SceneKey

NAME = "harvester.schema.json"  # of the file beside a scene
DIRECTIVE = f"#:schema ./{NAME}"  # the first line of a scene, which Taplo reads
TITLE = "A scene of harvester"
HELP = "Numbers are SI, texts carry their unit; an effect that is left out is absent."
MOST_BYTES = 1_000_000


class _OfToml(GenerateJsonSchema):
    """Without null, which TOML does not have: a key that is absent is left out; and in the draft that Taplo knows."""

    schema_dialect = "http://json-schema.org/draft-07/schema#"

    def nullable_schema(self, schema: Any) -> JsonSchemaValue:
        """The schema of a value that may be None, for a given value."""
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: Any) -> JsonSchemaValue:
        """The schema of a value with a default, which an editor need not write."""
        return self.generate_inner(schema["schema"])

    def tuple_schema(self, schema: Any) -> JsonSchemaValue:
        """The schema of a list of fixed length, in the words of this draft."""
        made = super().tuple_schema(schema)
        return {("items" if key == "prefixItems" else key): value for key, value in made.items()}


def schema() -> dict[str, Any]:
    """The schema of a whole scene file: draft 7, without references."""
    made = TypeAdapter(Scene).json_schema(schema_generator=_OfToml)
    whole: dict[str, Any] = _inlined(made, made.pop("$defs"))
    tables = whole["properties"]
    for key in keys():
        table = tables[key.table].get("items", tables[key.table])  # of [[mode]] there are several
        # without equations and examples
        table["description"] = table["description"].partition("\n\n")[0]
        table["properties"][key.name] |= {"title": key.unit or key.name, "description": _help(key)}
    for name, kind in TABLES.items():
        tables[name] |= _of_same(kind.SAME) if kind.SAME else {}
    tables["title"] |= {"description": "Title of tables and plots."}
    either = [{"required": ["nondimensional"]}, {"required": ["oscillator", "piezo"]}]
    return {
        "$schema": _OfToml.schema_dialect,
        **whole,
        "title": TITLE,
        "description": HELP,
        "anyOf": either,
    }


def _of_same(same: dict[tuple[str, ...], bool]) -> dict[str, Any]:
    """The rule of a table's schema for keys that mean the same.

    Without allOf, in which Taplo completes no keys.
    """
    pairs = [list(pair) for names in same for pair in itertools.combinations(names, 2)]
    needed = [names for names, must in same.items() if must]
    rules: dict[str, Any] = (
        {"not": {"anyOf": [{"required": pair} for pair in pairs]}} if pairs else {}
    )
    if needed:
        rules["anyOf"] = [{"required": list(some)} for some in itertools.product(*needed)]
    return rules


def _inlined(node: Any, definitions: dict[str, Any]) -> Any:
    """A part of the schema with its references replaced by their targets, as some editors do not follow them."""
    if isinstance(node, list):
        return [_inlined(part, definitions) for part in node]
    if not isinstance(node, dict):
        return node
    if "$ref" in node:
        return _inlined(definitions[node["$ref"].rpartition("/")[2]], definitions)
    return {key: _inlined(value, definitions) for key, value in node.items()}


def _help(key: SceneKey) -> str:
    """The text that an editor shows next to a key."""
    unit = f" A bare number is in {key.unit}; a text has its unit." if key.unit else ""
    return f"{key.meaning[:1].upper()}{key.meaning[1:]}.{unit} Example: {key.name} = {key.example}"


def text() -> str:
    """The schema as a file."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


def write_beside(path: Path) -> None:
    """Write the schema that the first line of the scene file at ``path`` names; a stranger's file stays as it is."""
    beside = path.with_name(NAME)
    if not beside.exists() or TITLE.encode() in files.read(beside, NAME, MOST_BYTES):
        files.write(beside, text(), NAME)
