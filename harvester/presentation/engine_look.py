"""How an engine looks in every figure and on the page of `harvester explore`: colour, line, marker and label.

An engine states its look next to its computation; the list of engines puts it into `LOOKS`, which
figures read by the engine's name.  The differences between engines survive a grey print: dashes,
width and markers next to the colour.
"""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class EngineLook:
    """The look of one engine, in the words of matplotlib.

    ``line`` is a line style, or "none" for an engine that is drawn by its markers; ``width`` is for
    wide lines, which are under thin ones so that engines that agree all show; ``order`` decides
    which is on top; ``paler`` is the fraction of white if its colour means something else.  With
    several engines, the others are drawn over that of the largest ``trust``.
    """

    label: str
    colour: str = "#4D4D4D"
    marker: str = "o"
    line: Any = "-"
    width: float | None = None
    order: float = 3.0
    paler: float = 0.0
    trust: int = 0

    def style(self) -> dict[str, Any]:
        """The arguments of matplotlib for its curve."""
        keywords: dict[str, Any] = {
            "color": self.colour,
            "linestyle": self.line,
            "zorder": self.order,
        }
        keywords |= {"label": self.label}
        if self.width is not None:
            keywords["linewidth"] = self.width
        if self.line == "none":
            keywords["marker"] = self.marker
        return keywords


LOOKS: dict[str, EngineLook] = {}


def look(engine: str) -> EngineLook:
    """The look of an engine by its name; for one that is in no list, a plain one."""
    return LOOKS.get(engine) or EngineLook(engine)
