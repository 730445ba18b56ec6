"""Sphinx reads a notebook (.ipynb) as the Markdown page that its cells and their kept outputs make."""

import base64
import json
from pathlib import Path

from myst_parser.parsers.sphinx_ import MystParser


def as_markdown(notebook, folder):
    """The page; pictures become files of ``folder``, the page's _images."""
    parts = []
    for number, cell in enumerate(notebook["cells"]):
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "image/png" in data:
                folder.mkdir(parents=True, exist_ok=True)
                (folder / f"cell_{number}.png").write_bytes(base64.b64decode(data["image/png"]))
                picture = f'<p><img src="_images/cell_{number}.png" alt="The figure that the cell draws"></p>'
                parts.append(f"```{{raw}} html\n{picture}\n```")
            else:
                text = "".join(output.get("text", data.get("text/plain", ())))
                parts.append(f"```text\n{text.rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


class NotebookParser(MystParser):
    """Markdown of a notebook."""

    supported = ("notebook",)

    def parse(self, inputstring, document):
        """Parse a notebook's text."""
        folder = Path(document.settings.env.app.outdir) / "_images"
        super().parse(as_markdown(json.loads(inputstring), folder), document)


def setup(app):
    """Called by Sphinx."""
    app.add_source_suffix(".ipynb", "notebook")
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": True}
