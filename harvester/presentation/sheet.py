"""A result as people read it, before it is a terminal's text, a notebook's table or a page: rows, tables, remarks.

It is made from the fields of the result (`sheet`), each named and given its unit by `harvester.presentation.glossary`.
A `Value` or a number is a row, a mapping of them a row each, a `Table` a table; results inside it are its parts.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from harvester.presentation import html
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.presentation.glossary import Entry, entry
from harvester.presentation.table import Table
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.presentation.result import Result

IN_THE_HEAD = frozenset({"engine", "seconds", "steps"})


@dataclass
class Sheet:
    """What a result shows: a head, rows of a name and a text, tables, remarks, and the sheets of its parts."""

    head: str
    rows: list[tuple[str, str]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    parts: list["Sheet"] = field(default_factory=list)

    def lines(self, indent: str = "") -> list[str]:
        """The lines of a terminal."""
        inner = indent + "  "
        lines = [indent + self.head] if self.head else []
        lines += columns([list(row) for row in self.rows], inner) if self.rows else []
        for one in self.tables:
            lines += [inner + one.title] * bool(one.title) + one.lines(inner)
        lines += [line for part in self.parts for line in part.lines(inner)]
        return lines + [inner + remark for remark in self.remarks()]

    def remarks(self) -> list[str]:
        """Its notes and warnings, each with the word for it."""
        return [f"note: {one}" for one in self.notes] + [f"warning: {one}" for one in self.warnings]

    def html(self) -> str:
        """A fragment of HTML, every text escaped."""
        found = html.table(self.head, (), self.rows, self.remarks())
        return found + "".join(one._repr_html_() for one in self.tables) + "".join(one.html() for one in self.parts)


def sheet(result: "Result", head: str | None = None) -> Sheet:
    """The sheet of a result; ``head`` replaces what it says of engine, seconds and steps."""
    found = Sheet(_head(result) if head is None else head)
    remarks = getattr(result, "diagnostics", ())
    found.notes = [str(one) for one in remarks if one.severity == "note"]
    found.warnings = [str(one) for one in remarks if one.severity == "warning"]
    for name in result.shown_names():
        if name not in IN_THE_HEAD:
            _add(found, name, getattr(result, name), result)
    return found


def _add(found: Sheet, name: str, one: Any, result: "Result") -> None:
    """Put one field on the sheet, as its type asks for."""
    from harvester.presentation.result import Result

    if isinstance(one, Table):
        found.tables.append(one)
    elif isinstance(one, Result):
        found.parts.append(sheet(one, entry(name).label))
    elif isinstance(one, Mapping):
        for key, part in one.items():
            if isinstance(part, Result):
                found.parts.append(sheet(part, str(key)))
            else:
                found.rows += _rows(str(key), part, result)
    elif isinstance(one, tuple) and one and all(isinstance(part, Result) for part in one):
        of = len(one)
        found.parts += [sheet(part, f"{entry(name).label} {k} of {of}") for k, part in enumerate(one, 1)]
    else:
        found.rows += _rows(name, one, result)


def _rows(name: str, one: Any, result: "Result") -> Iterator[tuple[str, str]]:
    """The row of a number, a value or a text; none of what is absent, and of arrays."""
    about = entry(name)
    unit = unit_of(about, result)
    if isinstance(one, bool):
        yield about.label, "yes" if one else "no"
    elif isinstance(one, Value | float | int):
        yield about.label, quantity(one, about, unit)
    elif isinstance(one, str) and one:
        yield about.label, one
    elif isinstance(one, tuple) and one and all(isinstance(part, str) for part in one):
        yield about.label, ", ".join(one)


def quantity(one: Value | float, about: Entry, unit: str) -> str:
    """A number with its unit, and with its errors where it has them."""
    value = one if isinstance(one, Value) else Value(float(one))
    if about.kind == "share":
        return f"{value.scaled(100.0).format()} %"
    if about.kind == "clock":
        return f"{value.value:.2g} s of computing"
    if not unit and value.value == int(value.value) and abs(value.value) < 1e6:
        return f"{value.value:.0f}"
    return value.format(unit)


def unit_of(about: Entry, result: "Result") -> str:
    """The unit of a kind in a result: of its scene, its own, or the kind itself where it is no quantity of a scene."""
    if about.kind == "own":
        return str(getattr(result, "unit", ""))
    if about.kind in AnswerUnits.__dataclass_fields__:
        return str(getattr(result.unit_names, about.kind))
    return "" if about.kind in ("share", "clock") else about.kind


def _head(result: "Result") -> str:
    """The engine, and what it took."""
    engine, seconds = getattr(result, "engine", ""), getattr(result, "seconds", None)
    steps = getattr(result, "steps", 0)
    took = [] if seconds is None else [f"{seconds:.2g} s"]
    took += [f"{steps:.3g} steps"] if steps else []
    name = engine or entry(type(result).__name__).label
    return f"{name}: {', '.join(took)}" if took else name
