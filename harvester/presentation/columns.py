"""Rows of texts as lines of aligned columns, as a terminal shows them."""

from collections.abc import Sequence


def columns(rows: Sequence[Sequence[str]], indent: str = "", right: bool = False) -> list[str]:
    """One line for each row, with two spaces between columns, each as wide as its widest cell.

    ``right`` sets the cells of all columns to the right, as numbers are read.
    """
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = (
            cell.rjust(width) if right else cell.ljust(width)
            for cell, width in zip(row, widths, strict=True)
        )
        lines.append((indent + "  ".join(cells)).rstrip())
    return lines
