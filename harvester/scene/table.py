"""The base of all tables of a scene: what pydantic finds wrong becomes one line that names the table and the key."""

import dataclasses
from typing import Any, ClassVar, Self

import pydantic
from pydantic import ConfigDict, ModelWrapValidatorHandler, model_validator

from harvester.errors import InputError, invalid, refused, unknown

CONFIG = ConfigDict(extra="forbid")


class SceneTable:
    """A table of a scene file; its keys are the fields of the dataclass that inherits from it."""

    TABLE: ClassVar[str] = ""

    @model_validator(mode="wrap")
    @classmethod
    def _check(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except pydantic.ValidationError as error:
            raise _in_one_line(error, cls) from None


def key_names(table: type) -> list[str]:
    """The names of a table's keys."""
    return [field.name for field in dataclasses.fields(table)]


def _in_one_line(error: pydantic.ValidationError, table: type[SceneTable]) -> InputError:
    """The first of pydantic's errors in the words of this package; a misspelt key comes first."""
    first = min(error.errors(include_url=False), key=lambda e: e["type"] != "unexpected_keyword_argument")
    where = [part for part in (table.TABLE, *map(str, first["loc"])) if part]
    key = ".".join(where)
    match first["type"]:
        case "missing":
            return InputError(f"{key} must be given, but is missing")
        case "unexpected_keyword_argument":
            kind = f"[{table.TABLE}] key" if table.TABLE else "scene table"
            return unknown(kind, where[-1], key_names(table))
        case "value_error":
            return refused(key, first["ctx"]["error"], first["input"])
        case "string_type":
            return invalid(key, "be a text", first["input"])
        case "tuple_type":
            return invalid(key, "be a list", first["input"])
        case _:
            return invalid(key, "be a table of keys", first["input"])
