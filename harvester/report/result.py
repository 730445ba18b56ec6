"""The page of any result: its sheet's rows lead, its tables and remarks stand in their places."""

from collections.abc import Iterator
from typing import Any

from harvester import figures
from harvester.equations.problem import Problem
from harvester.presentation.sheet import Presentable, Sheet, sheet
from harvester.presentation.table import Table
from harvester.report.numbers import signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import scene_page
from harvester.scene.scene import Scene
from harvester.studies.output_folder import provenance

MOST_ON_A_PAGE = 400  # rows


def of_result(
    scene: Scene | Problem,
    kind: str,
    result: Presentable,
    figure: "figures.Plot | None" = None,
    caption: str = "",
    tables: tuple[Table, ...] = (),
    **made: Any,
) -> Page:
    """The page of what a study found for a scene, with ``tables`` beside its own; ``made`` says how."""
    problem, found = Problem.of(scene), sheet(result)
    lead = [signs(f"{name}: {text}") for name, text in found.rows]
    drawings = [] if figure is None else [drawing(figure, f"{caption} {'. '.join(lead)}.", caption)]
    section = Section(
        "What was found",
        texts=[f"{note[0].upper()}{note[1:]}." for note in map(signs, found.notes)],
        drawings=drawings,
        tables=[*_tables(found), *map(text_table, tables)],
        warnings=[signs(one) for one in found.warnings],
    )
    return scene_page(problem, kind, [signs(found.head), *lead], section, provenance(problem), **made)


def _tables(found: Sheet) -> Iterator[TextTable]:
    """The tables of a sheet, and of its parts."""
    yield from map(text_table, found.tables)
    for part in found.parts:
        if part.rows:
            rows = [[name, signs(text)] for name, text in part.rows]
            yield TextTable(part.head, ["what", "value"], rows, (1,))
        yield from _tables(part)


def text_table(table: Table) -> TextTable:
    """A table as texts; of a long one its beginning, and how much is left out."""
    few = table.head(MOST_ON_A_PAGE)
    heads, rows = few.shown()
    note = f"{len(table) - len(few)} more rows are in the CSV file." if len(few) < len(table) else ""
    numbers = [k for k, _ in enumerate(heads) if any(row[k][:1].isdigit() or row[k][:1] in ("-", "") for row in rows)]
    title = table.title[:1].upper() + table.title[1:]
    return TextTable(title, heads, [list(map(signs, row)) for row in rows], numbers, note)
