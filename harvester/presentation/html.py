"""Tables of answers in a notebook: plain HTML with every text escaped."""

from collections.abc import Iterable, Sequence
from html import escape

MOST_ROWS = 60
_CELL = "text-align:left;vertical-align:top"


def table(
    title: str, head: Sequence[str], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()
) -> str:
    """An HTML table with a title above and notes below."""
    cells = "".join(
        "<tr>" + "".join(f'<td style="{_CELL}">{escape(cell)}</td>' for cell in row) + "</tr>"
        for row in rows
    )
    heads = "".join(f'<th style="{_CELL}">{escape(text)}</th>' for text in head)
    top = f"<thead><tr>{heads}</tr></thead>" if head else ""
    below = "".join(f"<div>{escape(note)}</div>" for note in notes)
    return f"<div><table><caption>{escape(title)}</caption>{top}<tbody>{cells}</tbody></table>{below}</div>"


def warnings(some: Iterable[str]) -> list[str]:
    """Warnings as notes that state that they are warnings."""
    return [f"warning: {text}" for text in some]
