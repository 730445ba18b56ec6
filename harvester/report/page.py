"""A report as one HTML file: sections of text, figures and tables.

Nothing is loaded from elsewhere: figures are SVG inside data: addresses, styles are in the page,
there is no script. The user's texts (title, netlist, warnings) are text, which jinja2 escapes.
"""

import base64
import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from harvester.errors import escaped
from harvester.machine import files

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Drawing:
    """A figure: its description for those who do not see it (``alt``), and its caption."""

    svg: bytes
    alt: str
    caption: str

    @property
    def address(self) -> str:
        """The picture itself as a data: address."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode()


@dataclass(frozen=True)
class TextTable:
    """A table of texts: the first cell of a row names it.

    Columns ``numbers`` (by place) are set right.
    """

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[int] = ()
    note: str = ""

    @property
    def form(self) -> str:
        """The class of its width: tables of many columns are set smaller, and of some as cards on a phone."""
        return "many" if len(self.heads) > 7 else "some" if len(self.heads) > 3 else "few"


@dataclass(frozen=True)
class Listing:
    """A text unchanged in a file, under its title."""

    title: str
    text: str
    folded: bool = False


@dataclass(frozen=True)
class Section:
    """A heading and its contents, in the order of the attributes."""

    title: str
    texts: Sequence[str] = ()
    drawings: Sequence[Drawing] = ()
    tables: Sequence[TextTable] = ()
    warnings: Sequence[str] = ()
    listings: Sequence[Listing] = ()


@dataclass(frozen=True)
class Page:
    """A whole report: ``lead`` are its answers in a line each, ``about`` its provenance, ``command`` repeats it.

    An empty ``title`` becomes the name of the scene's file if there is one (`titled`).
    """

    title: str
    kind: str
    lead: Sequence[str]
    sections: Sequence[Section]
    command: str = ""
    about: dict[str, str] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """Whether the answer may be used unchanged."""
        count = sum(len(section.warnings) for section in self.sections)
        return (
            f"{count} warning{'s' * (count > 1)} below: read before use."
            if count
            else "No warning."
        )


def drawing(figure: "Figure", alt: str, caption: str) -> Drawing:
    """A matplotlib figure as SVG for the page."""
    from harvester.presentation.plot import image  # and with it matplotlib, which has drawn it

    return Drawing(image(figure, "svg"), alt, caption)


def titled(page: Page, file: str) -> Page:
    """The page with the name of its scene's file, mine.toml as "mine", for a title if the scene has none."""
    return page if page.title else dataclasses.replace(page, title=Path(file).stem)


def html(page: Page) -> str:
    """The page as the text of an HTML file."""
    import jinja2

    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        # not what is HTML already
        finalize=lambda value: escaped(value) if type(value) is str else value,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return templates.get_template("page.html").render(page=titled(page, "A scene without a title"))


def write(path: Path, page: Page) -> None:
    """Write the page, whole or not at all; InputError if the file cannot be written."""
    files.write(path, html(page), "report")
