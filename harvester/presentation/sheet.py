"""A result as people read it, before it is a terminal's text, a notebook's table or a page: rows, tables, remarks.

It is made from the fields of the result (`sheet`), each named and given its unit by
`harvester.presentation.glossary`. A `Value` or a number is a row, a mapping of them a row each, a
`Table` a table; results inside it are its parts.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeGuard

from harvester.presentation import html
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.glossary import Term, term
from harvester.presentation.scene_words import in_words
from harvester.presentation.table import Column, Table
from harvester.uncertainty.value import Value, clock, percent, two_digits

ERROR_OF = "error_of_"  # before the name of a number: its total error at 95 %
IN_THE_HEAD = frozenset({"engine", "seconds", "steps"})


class Presentable(Protocol):
    """The attributes that a sheet reads of a result (`harvester.presentation.result.Result`)."""

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        ...

    def shown_names(self) -> list[str]:
        """The names of the fields that its text shows."""
        ...


@dataclass(frozen=True)
class WholeError:
    """A number of which the error at 95 % is known as a whole; infinite: it is not known."""

    value: float
    error95: float


@dataclass
class Sheet:
    """A result for people: a head, rows of a name and a text, tables, remarks, and the sheets of its parts."""

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
        for table in self.tables:
            lines += [inner + table.title] * bool(table.title) + table.lines(inner + "  ")
        lines += [line for part in self.parts for line in part.lines(inner)]
        return lines + [inner + remark for remark in self.remarks()]

    def remarks(self) -> list[str]:
        """Its notes and warnings, each with the word for it."""
        return [f"note: {text}" for text in self.notes] + [
            f"warning: {text}" for text in self.warnings
        ]

    def html(self) -> str:
        """A fragment of HTML, every text escaped."""
        rows = html.table(self.head, (), self.rows, self.remarks())
        tables = (table._repr_html_() for table in self.tables)
        return "".join((rows, *tables, *(part.html() for part in self.parts)))


def sheet(
    result: Presentable, head: str | None = None, units: AnswerUnits | None = None, unit: str = ""
) -> Sheet:
    """The sheet of a result; ``head`` replaces its statement of engine, seconds and steps.

    ``units`` and ``unit`` are those of the result that it is a part of, if it does not know its
    own.
    """
    units = result.unit_names if units is None or hasattr(result, "physical") else units
    page = Sheet(_head(result) if head is None else head)
    remarks = getattr(result, "diagnostics", ())
    page.notes = [remark.line for remark in remarks if remark.severity == "note"]
    page.warnings = [remark.line for remark in remarks if remark.severity == "warning"]
    for name in result.shown_names():
        if name not in IN_THE_HEAD:
            with_errors = getattr(result, f"{name}_value", getattr(result, name))
            _add(page, name, with_errors, units, str(getattr(result, "unit", unit)))
    return page


def _add(page: Sheet, name: str, content: Any, units: AnswerUnits, unit: str) -> None:
    """Put one field on the sheet, as its type asks for."""
    if isinstance(content, Table):
        page.tables.append(content)
    elif _is_result(content):
        page.parts.append(sheet(content, term(name).label, units, unit))
    elif isinstance(content, Mapping):
        for key, part in with_companions(content).items():
            if _is_result(part):
                page.parts.append(sheet(part, str(key), units, unit))
            else:
                page.rows += _rows(str(key), part, units, unit)
    elif isinstance(content, tuple) and content and all(map(_is_result, content)):
        page.tables.append(table_of(content, term(name).label, units, unit))
    else:
        page.rows += _rows(name, content, units, unit)


def table_of(
    results: Sequence[Presentable], title: str, units: AnswerUnits, unit: str = ""
) -> Table:
    """Results of one type as the rows of a table; units as of `unit_of`."""
    cells = {
        name: [getattr(result, name) for result in results] for name in results[0].shown_names()
    }
    known = {
        name: some for name, some in cells.items() if any(cell not in (None, "") for cell in some)
    }
    return Table(
        tuple(Column(name, known[name], unit_of(term(name), units, unit)) for name in known), title
    )


def with_companions(numbers: Mapping[Any, Any]) -> dict[str, Any]:
    """Numbers of which some are the errors of others: ``x``, with ``x_stderr`` and ``x_bias``, or ``error_of_x``.

    Without the former, and with the latter 0, it is a closed form.
    """
    joined: dict[str, Any] = {}
    for name, number in numbers.items():
        companions = [
            numbers.get(of) for of in (f"{name}_stderr", f"{name}_bias", f"{ERROR_OF}{name}")
        ]
        stem = str(name).removesuffix("_stderr").removesuffix("_bias")
        if str(name).startswith(ERROR_OF) or (stem != name and stem in numbers):
            continue
        stderr, bias, whole = companions
        joined[str(name)] = number
        if isinstance(number, float | int) and (stderr is not None or bias is not None):
            closed = stderr is None and bias == 0.0
            joined[str(name)] = Value(
                float(number), stderr, None if closed else bias, 0.0 if closed else None
            )
        elif isinstance(number, float | int) and whole is not None:
            joined[str(name)] = WholeError(float(number), whole)
    return joined


def mapping_rows(
    numbers: Mapping[Any, Any], units: AnswerUnits, unit: str = ""
) -> list[tuple[str, str]]:
    """The rows of numbers by their names."""
    return [
        row
        for name, content in with_companions(numbers).items()
        for row in _rows(name, content, units, unit)
    ]


def _rows(name: str, content: Any, units: AnswerUnits, unit: str) -> Iterator[tuple[str, str]]:
    """The row of a number, a value or a text; none for an absent one, and for arrays."""
    about = term(name)
    text = _text(content, about, unit_of(about, units, unit))
    if about.kind == "names":
        text = ", ".join(in_words(effect) for effect in text.split(", "))
    if text:
        yield about.label, text


def with_error(content: WholeError, about: Term) -> str:
    """The error in per cent, relative to the number; a fraction is itself in per cent, as is its error."""
    if math.isinf(content.error95):
        return " (error not known)"
    if about.kind == "share":
        return f" +- {two_digits(100.0 * content.error95)} % (95 %)"
    return f" +- {percent(content.error95, content.value)} (95 %)" if content.value else ""


def _text(content: Any, about: Term, unit: str) -> str:
    """A number, a value or a text, several texts, or the two ends of a range as people read them.

    Else empty.
    """
    if isinstance(content, bool):
        return "yes" if content else "no"
    if isinstance(content, Value | float | int):
        return quantity(content, about, unit)
    if isinstance(content, WholeError):
        return quantity(content.value, about, unit) + with_error(content, about)
    if isinstance(content, str | Diagnostic):
        return str(content)
    if isinstance(content, tuple) and all(isinstance(part, str) for part in content):
        return ", ".join(content)
    if (
        isinstance(content, tuple)
        and len(content) == 2
        and all(isinstance(part, float) for part in content)
    ):
        return " to ".join(quantity(part, about, unit) for part in content)
    return ""


def quantity(number: Value | float, about: Term, unit: str) -> str:
    """A number with its unit, and with its errors if it has them."""
    value = number if isinstance(number, Value) else Value(float(number))
    if about.kind == "share":
        return value.scaled(100.0).format("%")
    if about.kind == "parameter":
        return f"about {100.0 * value.value:.2g} %"
    if about.kind == "clock":
        return f"{clock(value.value)} of computing"
    if about.kind == "time" and not unit:
        return f"{value.value:.4g} (1/w0)"
    is_count = not unit and value.value == int(value.value) and abs(value.value) < 1e6
    if is_count and not value.known_error95 and not value.unknown:
        return f"{value.value:.0f}"
    return value.format(unit)


def unit_of(about: Term, units: AnswerUnits, unit: str = "") -> str:
    """The unit of a kind: the scene's, the result's, or the kind itself if it is not a quantity of a scene."""
    if about.kind == "own":
        return unit
    if about.kind in AnswerUnits.__dataclass_fields__:
        return str(getattr(units, about.kind))
    return "" if about.kind in ("share", "parameter", "clock", "names") else about.kind


def _is_result(content: Any) -> TypeGuard[Presentable]:
    return hasattr(content, "shown_names")


def _head(result: Presentable) -> str:
    """The engine, and its cost."""
    engine = getattr(result, "engine", "")
    seconds = getattr(result, "seconds", None)
    steps = getattr(result, "steps", 0)
    took = [] if seconds is None else [clock(seconds)]
    took += [f"{steps:.3g} steps"] if steps else []
    name = engine or term(type(result).__name__).label
    return f"{name}: {', '.join(took)}" if took else name
