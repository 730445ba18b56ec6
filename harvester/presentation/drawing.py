"""How a result finds its drawing: by the name of its class, in `harvester.figures`.

Drawings are above all that they draw, so that they know its classes, and nothing below imports
them: they are loaded as the first plot is made.
"""

from collections.abc import Callable, Iterable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from harvester.errors import InputError, invalid, shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

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


def draw(result: object, title: str | None, ax: "Axes | None" = None, **options: Any) -> "Figure":
    """The plot of a result, with a title above: the figure's own one if empty, none if None.

    Axes ``ax`` of the user get its first panel, whose own title stays unless one is given; their
    figure is returned.  Text that is set later may hold formulas between dollar signs, as in any
    figure of matplotlib; its own is drawn unchanged.

    Raises InputError if ``ax`` are not the axes of a plane, or have names at their ticks, as
    bars have.
    """
    import matplotlib.axes
    import matplotlib.text

    from harvester.presentation.plot import GIVEN, UsersAxes

    draws = drawing_of(type(result))
    if ax is None:
        plot = draws(result, title, **options)
        _with_formulas(plot.findobj(matplotlib.text.Text))
        return plot
    if not isinstance(ax, matplotlib.axes.Axes) or ax.name != "rectilinear":
        raise invalid("`ax`", "be the Axes of a plane, as matplotlib's `subplots` returns them", ax)
    _refuse_named_ticks(ax)
    given = UsersAxes(ax)
    token = GIVEN.set(given)
    try:
        draws(result, title, **options)
        given.finish()
    finally:
        GIVEN.reset(token)
    _with_formulas(ax.findobj(matplotlib.text.Text))
    figure = ax.get_figure(root=True)
    assert figure is not None
    return figure


def _refuse_named_ticks(ax: "Axes") -> None:
    """Refuse axes with bars or others at ticks that have names: no curve has their scale."""
    from matplotlib.category import StrCategoryLocator
    from matplotlib.ticker import FixedFormatter, FixedLocator, FuncFormatter

    if not ax.has_data():
        return
    for axis in (ax.xaxis, ax.yaxis):
        tick_places = axis.get_major_locator()
        labels = axis.get_major_formatter()
        fixed = isinstance(tick_places, FixedLocator)
        named = fixed and isinstance(labels, FixedFormatter | FuncFormatter)
        if named or isinstance(tick_places, StrCategoryLocator):
            texts = [text.get_text() for text in axis.get_ticklabels()]
            raise InputError(
                f"`ax` must have axes of numbers, but its {axis.axis_name} axis has the names "
                f"{', '.join(map(shown, texts))}: draw into other axes"
            )


def _with_formulas(texts: "Iterable[Text]") -> None:
    for text in texts:
        if "$" not in text.get_text():
            text.set_parse_math(True)
