"""What all results share: a short repr, a text, a notebook's table, JSON, pandas and xarray, from their fields alone.

A result is a frozen dataclass of values, arrays, tables, diagnostics and other results.  It formats
nothing itself: what it wants beyond the order of its fields it states in class attributes.
"""

import dataclasses
from typing import TYPE_CHECKING, Any, ClassVar, dataclass_transform

from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.glossary import term
from harvester.presentation.plain import plain, same
from harvester.presentation.sheet import quantity, sheet, unit_of
from harvester.presentation.table import Cell, Column, Table
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    import pandas
    import xarray


HANDLED = frozenset({"diagnostics", "physical"})


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(dataclasses.field,))
class Result:
    """The base of results: what derives from it is a frozen dataclass, which answers a misspelt keyword with its match.

    For a result's names, its fields but for ``INTERNAL`` ones and then ``DERIVED`` properties, the
    text shows all but ``NOT_SHOWN``, JSON all but ``NOT_IN_JSON`` (under other names if
    ``JSON_NAMES`` has some; for those ``OPTIONAL`` only what is there), and the short repr those of
    ``SHORT``.  A field ``diagnostics``
    becomes the notes and warnings, ``physical`` states whether the numbers have SI units.

    Two results are equal if all that they say is, but for the seconds of computing.
    """

    DERIVED: ClassVar[tuple[str, ...]] = ()
    NOT_SHOWN: ClassVar[frozenset[str]] = frozenset()
    NOT_IN_JSON: ClassVar[frozenset[str]] = frozenset()
    INTERNAL: ClassVar[frozenset[str]] = frozenset()
    OPTIONAL: ClassVar[frozenset[str]] = frozenset()
    JSON_NAMES: ClassVar[dict[str, str]] = {}
    SHORT: ClassVar[tuple[str, ...]] = ("engine", "mean_power")

    def __init_subclass__(cls, kw_only: bool = False) -> None:
        names_arguments(
            dataclasses.dataclass(frozen=True, repr=False, eq=False, kw_only=kw_only)(cls)
        )

    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Any]]

    def __post_init__(self) -> None:
        """Give each of its values the unit that the glossary has for its name, and its parts the units of the whole."""
        result_unit = str(getattr(self, "unit", ""))
        for name, content in vars(self).items():
            for part in (
                content.values()
                if isinstance(content, dict)
                else content
                if isinstance(content, tuple)
                else (content,)
            ):
                if (
                    isinstance(part, Result)
                    and not hasattr(part, "physical")
                    and hasattr(self, "physical")
                ):
                    object.__setattr__(part, "physical", self.physical)
                    part.__post_init__()
            if isinstance(content, Value) and not content.unit:
                unit = unit_of(term(name), self.unit_names, result_unit)
                object.__setattr__(self, name, dataclasses.replace(content, unit=unit))

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and same(self, other)

    __hash__ = None  # type: ignore[assignment]

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(getattr(self, "physical", False))

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """The diagnostics that doubt it."""
        return tuple(
            remark for remark in getattr(self, "diagnostics", ()) if remark.severity == "warning"
        )

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """The diagnostics that explain it."""
        return tuple(
            remark for remark in getattr(self, "diagnostics", ()) if remark.severity == "note"
        )

    def field_names(self) -> list[str]:
        """The names of its fields and derived properties, in order, but for the diagnostics and ``physical``."""
        fields = [field.name for field in dataclasses.fields(self)]
        return [name for name in (*fields, *self.DERIVED) if name not in HANDLED | self.INTERNAL]

    def shown_names(self) -> list[str]:
        """Those that its text shows."""
        return [name for name in self.field_names() if name not in self.NOT_SHOWN]

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        names = [name for name in self.field_names() if name not in self.NOT_IN_JSON]
        names = [name for name in names if name not in self.OPTIONAL or getattr(self, name)]
        entries = {self.JSON_NAMES.get(name, name): plain(getattr(self, name)) for name in names}
        if hasattr(self, "diagnostics"):
            entries["warnings"] = [remark.line for remark in self.warnings]
            entries["reason"] = "; ".join(remark.line for remark in self.notes)
            entries["diagnostics"] = [remark.as_json() for remark in self.diagnostics]
        return entries

    @property
    def table(self) -> Table:
        """Its numbers and texts as one row."""
        result_unit = str(getattr(self, "unit", ""))
        cells = {
            name: content
            for name in self.field_names()
            if isinstance(content := getattr(self, name), Cell)
        }
        units = {name: unit_of(term(name), self.unit_names, result_unit) for name in cells}
        return Table(tuple(Column(name, [content], units[name]) for name, content in cells.items()))

    def to_pandas(self) -> "pandas.DataFrame":
        """Its `table` as a data frame: numbers in SI units (nondimensional scene: without units), nan for none.

        A value has columns for all parts of its error: ``mean_power``, ``mean_power_stderr``,
        ``mean_power_error95``...
        """
        return self.table.to_pandas()

    def to_xarray(self) -> "xarray.Dataset":
        """Its `table` as a dataset, whose variables have a label and a unit as attributes."""
        return self.table.to_xarray()

    def __str__(self) -> str:
        return "\n".join(sheet(self).lines())

    def __repr__(self) -> str:
        parts = [
            f"{name}={_short(self, name)}"
            for name in self.SHORT
            if getattr(self, name, None) is not None
        ]
        count = len(self.warnings)
        parts += [f"{count} warning{'s' * (count > 1)}"] if count else []
        return f"{type(self).__name__}({', '.join(parts)})"

    def _repr_html_(self) -> str:
        return sheet(self).html()


class TableResult(Result):
    """A result whose rows, or whose course in time, are a table: its property ``table``."""

    @property
    def table(self) -> Table:
        """Its rows."""
        raise NotImplementedError


def _short(result: Result, name: str) -> str:
    """One name's content in a short repr: numbers with their unit, of what is long its size."""
    content = getattr(result, name)
    if isinstance(content, Value | float) and not isinstance(content, bool):
        return quantity(
            content,
            term(name),
            unit_of(term(name), result.unit_names, str(getattr(result, "unit", ""))),
        )
    if isinstance(content, str | int | bool):
        return repr(content)
    return f"<{len(content)}>" if hasattr(content, "__len__") else f"<{type(content).__name__}>"
