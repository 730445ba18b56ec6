"""A directive for Sphinx: figures of examples, small, with their titles, linked to the gallery."""

import re
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[1]
SECTION = re.compile(
    r"^### (.*)\n(?:(?!^### ).*\n)*?!\[(.*?)\]\(\.\./docs/gallery/(\w+)\.png\)", re.MULTILINE
)


class GalleryWall(SphinxDirective):
    """The figures whose names are the lines of the directive, with the titles of examples/README.md."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """One link for each."""
        wall = nodes.container(classes=["wall"])
        sections = SECTION.findall((ROOT / "examples" / "README.md").read_text())
        found = {name: (title, alt) for title, alt, name in sections}
        for name in self.content:
            title, alt = found[name]
            link = nodes.reference(
                "", "", refuri=f"gallery.html#{nodes.make_id(title)}", internal=True
            )
            link += nodes.image(uri=f"gallery/{name}.png", alt=alt)
            link += nodes.inline(text=title)
            wall += nodes.paragraph("", "", link)
        return [wall]


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_directive("gallery-wall", GalleryWall)
    return {"parallel_read_safe": True}
