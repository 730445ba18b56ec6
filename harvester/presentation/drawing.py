"""How a result finds its drawing: by the name of its class, in `harvester.figures`.

Drawings stand above all that they draw, so that they know its classes, and nothing below imports
them: they are loaded as the first plot is made.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from harvester.presentation.plot import Plot

FIGURES = "harvester.figures"


def drawing_of(kind: type) -> Callable[..., "Plot"]:
    """The function that draws results of a class, or of the nearest class that it derives from."""
    figures: Any = import_module(FIGURES)
    name = next(
        figures.DRAWINGS[base.__name__]
        for base in kind.__mro__
        if base.__name__ in figures.DRAWINGS
    )
    return getattr(figures, name)  # type: ignore[no-any-return]


def draw(result: object, title: str | None, **options: Any) -> "Plot":
    """The plot of a result, with a title above: the figure's own one if empty, none if None."""
    return drawing_of(type(result))(result, title, **options)
