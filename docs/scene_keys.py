"""A directive for Sphinx: all keys of a scene file, a table each, from the program itself."""

from collections.abc import Iterator
from itertools import groupby

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from harvester.scene.keys import SEVERAL, keys
from harvester.scene.table import SceneKey

HEADS = ("key", "unit", "example", "meaning")


class SceneKeys(SphinxDirective):
    """One section for each table of a scene file, with its keys."""

    def run(self) -> list[nodes.Node]:
        """The sections in the order of `harvester keys`."""
        return list(_sections())


def _sections() -> Iterator[nodes.section]:
    for table, some in groupby(keys(), key=lambda key: key.table):
        title = f"[[{table}]]" if table in SEVERAL else f"[{table}]"
        section = nodes.section(
            ids=[nodes.make_id(table)], names=[nodes.fully_normalize_name(title)]
        )
        section += nodes.title("", "", nodes.literal(text=title))
        section += _table(list(some))
        yield section


def _table(some: list[SceneKey]) -> nodes.table:
    group = nodes.tgroup(cols=len(HEADS))
    group += [nodes.colspec(colwidth=width) for width in (25, 15, 20, 40)]
    group += nodes.thead("", _row([nodes.Text(head) for head in HEADS]))
    rows = [
        _row(
            [
                nodes.literal(text=key.name),
                nodes.Text(key.unit),
                nodes.literal(text=key.example) if key.example else nodes.Text(""),
                nodes.Text(key.meaning + " (needed)" * key.needed),
            ]
        )
        for key in some
    ]
    group += nodes.tbody("", *rows)
    return nodes.table("", group, classes=["keys"])


def _row(cells: list[nodes.Node]) -> nodes.row:
    return nodes.row("", *(nodes.entry("", nodes.paragraph("", "", cell)) for cell in cells))


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_directive("scene-keys", SceneKeys)
    return {"parallel_read_safe": True}
