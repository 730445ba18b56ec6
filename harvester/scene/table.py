"""The base of all tables of a scene: an error of pydantic becomes one line that names the table and the key."""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Generic,
    NoReturn,
    Self,
    TypeAlias,
    TypeVar,
    dataclass_transform,
    get_args,
    get_origin,
)

import pydantic
from pydantic import ConfigDict, ModelWrapValidatorHandler, model_validator
from pydantic.dataclasses import dataclass
from pydantic_core import core_schema

from harvester.errors import InputError, invalid, refused, unknown
from harvester.quantities.kinds import Kind

NONE: Any = None  # the default of a key that may be left out
Kept = TypeVar("Kept")
Given = TypeVar("Given")
Table = TypeVar("Table", bound="SceneTable")
Made = TypeVar("Made", bound=type)


class Read(Generic[Kept, Given]):
    """The type of a key that is read: the value that it holds, and the accepted inputs, such as 0.04 and "40 g".

    Type checkers treat it as a descriptor; when the program runs, ``Read[Kept, Given]`` is
    ``Kept``.
    """

    if TYPE_CHECKING:

        def __get__(self, table: Any, owner: Any) -> Kept: ...

        def __set__(self, table: Any, value: Given) -> None: ...

    else:

        def __class_getitem__(cls, types):
            return types[0]


Number: TypeAlias = Read[float, float | str]
OptNumber: TypeAlias = Read[float | None, float | str | None]


class FrozenDict(dict[str, float]):
    """A mapping in a scene: it cannot change, so that scenes can be keys of a mapping themselves."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError(
            "a scene cannot be changed: make another one by scene.varied({'load.parameters.R': '1 Mohm'})"
        )

    __setitem__ = __delitem__ = __ior__ = update = setdefault = pop = popitem = clear = _refuse

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple[type, tuple[dict[str, float]]]:
        return FrozenDict, (dict(self),)


NO_NUMBERS: Any = FrozenDict()
Numbers: TypeAlias = Read[Mapping[str, float], Mapping[str, float | str]]


@dataclasses.dataclass(frozen=True)
class FrozenNumbers:
    """As part of an annotation it makes pydantic read each number of a mapping, and freeze it."""

    read: Callable[[object], float] = dataclasses.field(repr=False)
    kind: Kind

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        number = core_schema.no_info_before_validator_function(
            self.read, core_schema.float_schema()
        )
        numbers = core_schema.dict_schema(core_schema.str_schema(), number)
        return core_schema.no_info_after_validator_function(FrozenDict, numbers)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return {"type": "object", "additionalProperties": self.kind.json_schema()}


class SceneTable:
    """A table of a scene file; its keys are the fields of the dataclass that inherits from it."""

    TABLE: ClassVar[str] = ""
    # keys that say the same, of which it has one; True: it must
    SAME: ClassVar[dict[tuple[str, ...], bool]] = {}

    def __repr__(self) -> str:
        keys = [(name, getattr(self, name)) for name in key_names(type(self))]
        present = [
            f"{name}={value!r}"
            for name, value in keys
            if value is not None and value not in ("", {})
        ]
        return f"{type(self).__name__}({', '.join(present)})"

    def replace(self, **keys: Any) -> Self:
        """The same table with other values of some keys; a key that is None is left out.

        A key replaces another that states the same, such as ``frequency`` that of
        ``stiffness``.
        """
        same = [
            other for names in self.SAME for other in names if not keys.keys().isdisjoint(names)
        ]
        return dataclasses.replace(self, **dict.fromkeys(same) | keys)  # type: ignore[type-var]

    def present(self) -> dict[str, Any]:
        """The keys that are present."""
        values = {name: getattr(self, name) for name in key_names(type(self))}
        plain = {
            key: dict(value) if isinstance(value, dict) else value for key, value in values.items()
        }
        return {key: value for key, value in plain.items() if value is not None and value != {}}

    @model_validator(mode="wrap")
    @classmethod
    def _check(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except pydantic.ValidationError as error:
            raise _in_one_line(error, cls) from None


@dataclasses.dataclass(frozen=True)
class SceneKey:
    """A key of a table; ``unit`` is empty for a number or a text, ``needed`` states that its table must have it."""

    table: str
    name: str
    unit: str
    meaning: str
    example: str
    needed: bool


@dataclass_transform(kw_only_default=True, frozen_default=True)
def scene_table(table: type[Table]) -> type[Table]:
    """Make a class of annotated keys a table that checks them, and explain the keys in its docstring."""
    made: Any = dataclass(frozen=True, kw_only=True, repr=False, config=ConfigDict(extra="forbid"))(
        table
    )
    made = one_line_errors(made)
    described = [
        f"    {key.name} : {type_in_words(table, key.name)}\n        {key.meaning}"
        + f" ({key.unit})" * bool(key.unit)
        for key in keys_of(made)
    ]
    text, prompt, example = (table.__doc__ or "").rstrip().partition("    >>> ")
    examples = ["", "    Examples", "    --------", prompt + example] if prompt else []
    made.__doc__ = "\n".join(
        [text.rstrip() + "\n", "    Parameters", "    ----------", *described, *examples]
    )
    return made  # type: ignore[no-any-return]


def one_line_errors(table: Made) -> Made:
    """The same table, whose checks of several keys (``__post_init__``) are reported as those of one key are."""
    made: Any = table
    init = made.__init__

    @functools.wraps(init)
    def checked(self: Any, *arguments: Any, **keys: Any) -> None:
        try:
            init(self, *arguments, **keys)
        except pydantic.ValidationError as error:
            raise _in_one_line(error, made) from None

    made.__init__ = checked
    return table


def keys_of(table: type[SceneTable]) -> list[SceneKey]:
    """The keys of a table, with the contents of their annotations."""
    keys = []
    for field in dataclasses.fields(table):  # type: ignore[arg-type]
        annotations = notes(table, field.name)
        kind = next((note for note in annotations if isinstance(note, Kind)), None)
        texts = [note for note in annotations if isinstance(note, str)]
        meaning = texts[0] if texts else kind.name if kind else ""
        example = texts[1] if len(texts) > 1 else kind.example if kind else ""
        optional = (
            field.default is not dataclasses.MISSING
            or field.default_factory is not dataclasses.MISSING
        )
        needed = not optional and table.TABLE != "nondimensional"
        unit = kind.unit if kind else ""
        keys.append(
            SceneKey(table.TABLE, field.name, unit, meaning, example.replace("'", '"'), needed)
        )
    return keys


def type_in_words(table: type, name: str) -> str:
    """The type of a key as NumPy's docstrings write it, such as "float or str, optional"."""
    left_out = getattr(table, name, dataclasses.MISSING) is not dataclasses.MISSING
    return _in_words(table.__annotations__[name]) + ", optional" * left_out


def _in_words(annotation: Any) -> str:
    origin = get_origin(annotation) or annotation
    for kind, words in _TYPES.items():
        if origin is kind:
            return words
    return next(filter(None, map(_in_words, get_args(annotation))), "")


_TYPES = {float: "float or str", str: "str", tuple: "tuple", Mapping: "mapping"}


def notes(table: type, name: str) -> list[Any]:
    """The contents of a key's annotation: its `Kind`, its meaning in words, and an example."""
    annotation = table.__annotations__.get(name)
    parts = (*getattr(annotation, "__args__", ()), annotation)
    return [note for part in parts for note in getattr(part, "__metadata__", ())]


def key_names(table: type) -> list[str]:
    """The names of a table's keys."""
    return [field.name for field in dataclasses.fields(table)]


def _in_one_line(error: pydantic.ValidationError, table: type[SceneTable]) -> InputError:
    """The first of pydantic's errors in the words of this package; a misspelt key comes first."""
    first = min(
        error.errors(include_url=False), key=lambda e: e["type"] != "unexpected_keyword_argument"
    )
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
