"""The notebooks of examples/: every cell runs in a kernel of Jupyter, in a folder that has nothing else."""

import nbclient
import nbformat
import pytest

from tests.support.paths import EXAMPLES

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


@pytest.mark.thorough("test_example")
@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs(path, tmp_path):
    """Without an error or a warning; the pictures are drawn, and what has a power prints it with its error."""
    book = nbformat.read(path, 4)
    nbclient.NotebookClient(
        book, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    ).execute()
    outputs = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
    assert [
        output for output in outputs if output.output_type == "stream" and output.name == "stderr"
    ] == []
    kinds = {kind for output in outputs for kind in output.get("data", {})}
    assert {"image/png", "text/html"} <= kinds
    assert sum("+-" in output.get("text", "") for output in outputs) >= 4
    assert list(tmp_path.iterdir()) == []
