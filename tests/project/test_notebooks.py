"""The notebooks of examples/: every cell runs in a kernel of Jupyter, in a folder that has nothing else."""

import nbclient
import nbformat
import pytest

from tests.support.paths import EXAMPLES
from tests.support.screen import left_on_screen

NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_kept_without_outputs(path):
    """What a cell printed on some day would grow old unseen, and its pictures fill the repository."""
    book = nbformat.read(path, 4)
    nbformat.validate(book)
    assert [
        cell.id
        for cell in book.cells
        if cell.cell_type == "code" and (cell.outputs or cell.execution_count)
    ] == []


def stderr(cell):
    """All that a cell wrote there."""
    streams = [output for output in cell.outputs if output.output_type == "stream"]
    return "".join(stream.text for stream in streams if stream.name == "stderr")


@pytest.mark.thorough("test_example")
@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs(path, tmp_path):
    """Without an error or a warning; the pictures are drawn, and what has a power prints it with its error.

    On a slow machine a cell shows the bar of its progress, which is erased at the end of the cell.
    """
    book = nbformat.read(path, 4)
    nbclient.NotebookClient(
        book, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    ).execute()
    cells = [cell for cell in book.cells if cell.cell_type == "code"]
    assert {cell.id: left_on_screen(stderr(cell)) for cell in cells} == {
        cell.id: "" for cell in cells
    }
    outputs = [output for cell in cells for output in cell.outputs]
    kinds = {kind for output in outputs for kind in output.get("data", {})}
    assert {"image/png", "text/html"} <= kinds
    assert sum("+-" in output.get("text", "") for output in outputs) >= 4
    assert list(tmp_path.iterdir()) == []
