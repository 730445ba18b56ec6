"""The page of any result: its sheet's rows lead, its tables and remarks are in their places."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from harvester.equations.problem import Problem
from harvester.presentation.sheet import Presentable, Sheet, sheet
from harvester.presentation.table import Table
from harvester.report.numbers import signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import scene_page
from harvester.scene.scene import Scene
from harvester.studies.output_folder import provenance

MOST_ON_A_PAGE = 400  # rows
FEW_ROWS = 3  # from which a column that says the same everywhere is one line
SENTENCE = 40  # letters, from which a text is said once


def of_result(
    scene: Scene | Problem,
    kind: str,
    result: Presentable,
    caption: str = "",
    tables: tuple[Table, ...] = (),
    answers: Sequence[str] = (),
    **made: Any,
) -> Page:
    """The page of a study's result for a scene, with its figure and further ``tables``.

    ``made`` explains its origin.

    ``answers`` lead it, if the rows of its sheet do not state them; its cost
    is last.
    """
    problem = Problem.of(scene)
    page = sheet(result)
    rows = [f"{name}: {text}" for name, text in page.rows]
    took = hasattr(result, "seconds")
    lead = list(map(signs, (*answers, *[page.head] * (not took), *rows, *[page.head] * took)))
    # `stability` draws that alone
    plot = getattr(result, "plot", None) if getattr(result, "region", True) else None
    drawings = (
        [] if plot is None else [drawing(plot(None), f"{caption} {'. '.join(lead)}.", caption)]
    )
    section = Section(
        "Findings",
        texts=[
            f"{note if '.' in note.split()[0] else note[0].upper() + note[1:]}."
            for note in map(signs, page.notes)
        ],
        drawings=drawings,
        tables=[*_tables(page), *map(text_table, tables)],
        warnings=[signs(warning) for warning in page.warnings],
    )
    return scene_page(problem, kind, lead, section, provenance(problem), **made)


def _tables(page: Sheet) -> Iterator[TextTable]:
    """The tables of a sheet, and of its parts."""
    yield from map(text_table, page.tables)
    for part in page.parts:
        if part.rows:
            rows = [[name, signs(text)] for name, text in part.rows]
            yield TextTable(part.head, ["what", "value"], rows, (1,))
        yield from _tables(part)


def text_table(table: Table) -> TextTable:
    """A table as texts; for a long one its beginning, and how much is left out.

    A column without any text is left out, one that states the same in every row is stated below,
    and so does a sentence that several cells have.
    """
    few = table.head(MOST_ON_A_PAGE)
    heads, rows = few.shown()
    notes = (
        [f"{len(table) - len(few)} more rows are in the CSV file."] if len(few) < len(table) else []
    )
    texts = [list(map(signs, column)) for column in zip(*rows, strict=True)] or [[] for _ in heads]
    first, *others = zip(heads, texts, strict=True)
    notes += [
        f"In every row: {head} {cells[0]}." for head, cells in others if _is_one(cells) and cells[0]
    ]
    kept = [
        first,
        *((head, _referred(cells, notes)) for head, cells in others if not _is_one(cells)),
    ]
    heads, columns = [head for head, _ in kept], [cells for _, cells in kept]
    numbers = [k for k, cells in enumerate(columns) if _are_numbers(cells)]
    title = table.title[:1].upper() + table.title[1:]
    return TextTable(title, heads, list(zip(*columns, strict=True)), numbers, " ".join(notes))


def _is_one(cells: list[str]) -> bool:
    """Whether all cells of a column are the same."""
    return len(cells) >= FEW_ROWS and len(set(cells)) == 1


def _are_numbers(cells: list[str]) -> bool:
    """Whether a column is set right: numbers, and no sentence."""
    has_numbers = any(cell[:1].isdigit() or cell[:1] in ("-", "") for cell in cells)
    return has_numbers and max(map(len, cells), default=0) <= SENTENCE


def _referred(cells: list[str], notes: list[str]) -> list[str]:
    """Cells of a column, with a number for each sentence that several of them have.

    The ``notes`` get the sentences.

    Sentences that differ in their numbers alone are one, which is there with those of the
    first.
    """
    kinds = {
        text: re.sub(r"\d[\d.e+-]*", "#", text)
        for text in dict.fromkeys(cells)
        if len(text) > SENTENCE
    }
    variants = Counter(kinds.values())
    many = Counter(kinds.get(text) for text in cells)
    known = dict[str, str]()
    for text, kind in kinds.items():
        if kind not in known and many[kind] > 1:
            known[kind] = f"[{len(notes) + 1}]"
            notes.append(
                f"{known[kind]} {text}{' (elsewhere with other numbers)' * (variants[kind] > 1)}."
            )
    return [known.get(kinds.get(text, ""), text) for text in cells]
