"""The parts of the page: words, fields and buttons in its looks, and boxes as wide as their place."""

from collections.abc import Callable
from typing import Any

import panel as pn

from harvester.explore.looks import BUTTON, FIELD, WORDS

_WIDE: dict[str, Any] = {"sizing_mode": "stretch_width", "margin": 0}


def words(name: str, text: str = "", **look: Any) -> Any:
    """A text of HTML, found by its name."""
    return pn.pane.HTML(text, **_WIDE | {"stylesheets": [WORDS], "css_classes": [name]} | look)


def column(*inside: Any, **look: Any) -> Any:
    """Parts below each other."""
    return pn.Column(*inside, **_WIDE | look)


def flow(*inside: Any, **look: Any) -> Any:
    """Parts next to each other, and below without room."""
    return pn.FlexBox(*inside, **_WIDE | look)


def field(kind: Any, *names: str, **look: Any) -> Any:
    """A field of a kind of Panel's, found by its names."""
    return kind(**{"stylesheets": [FIELD], "css_classes": [*names], "name": ""} | look)


def button(name: str, kind: str, action: Callable[[], None], right: int = 8) -> Any:
    """A button that does something."""
    made = pn.widgets.Button(
        name=name, margin=(4, right, 4, 0), css_classes=[kind], stylesheets=[BUTTON]
    )
    made.on_click(lambda _: action())
    return made
