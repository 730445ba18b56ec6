"""A directive for Sphinx: every example's figure, small, with its title, linked to its section of the gallery."""

import re
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[1]
SECTION = re.compile(
    r"^### (.*)\n(?:(?!^### ).*\n)*?!\[.*?\]\(\.\./docs/(gallery/\w+\.png)\)", re.MULTILINE
)


class GalleryWall(SphinxDirective):
    """The figures of examples/README.md in their order there."""

    def run(self) -> list[nodes.Node]:
        """One link for each."""
        wall = nodes.container(classes=["wall"])
        for title, figure in SECTION.findall((ROOT / "examples" / "README.md").read_text()):
            link = nodes.reference(
                "", "", refuri=f"gallery.html#{nodes.make_id(title)}", internal=True
            )
            link += nodes.image(uri=figure, alt=title)
            link += nodes.inline(text=title)
            wall += nodes.paragraph("", "", link)
        return [wall]


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_directive("gallery-wall", GalleryWall)
    return {"parallel_read_safe": True}
