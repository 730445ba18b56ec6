"""The look of all figures: fonts, sizes and lines.

Drawn 152 mm wide with letters of 9 points and more, which a phone 390 pixels wide still shows 8
pixels tall.  Fonts and lines are those of `harvester.presentation.plot`, and how each engine looks
is in `harvester.presentation.engine_look`.
"""

import math
import textwrap
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harvester.arrays import Floats
from harvester.errors import escaped
from harvester.presentation.engine_look import LOOKS, EngineLook
from harvester.presentation.plot import GIVEN, Plot, UsersAxes, styled

WIDTH = 6.0  # inches
MOST_BARS = 60  # points of a curve with an error bar each; more are a band
# Okabe and Ito's palette.  Engines state theirs (`harvester.presentation.engine_look`); this one is
# of a study.
LOOKS.setdefault(
    "spice alone", EngineLook("SPICE alone (ngspice)", "#56B4E9", "^", "none", order=3.9)
)
INK = "0.15"  # what belongs to no engine
_LINES = 3  # of a title
_POINTS_SEARCHED = 2000  # of lines, for the place of a legend


def new(rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Plot, Any]:
    """A new figure of a size in inches and its axes, without pyplot (0.2 s to load, and it keeps every figure)."""
    with styled():
        figure = Plot(figsize=size, layout="constrained")
        if (given := GIVEN.get()) is None:
            return figure, figure.subplots(rows, columns, **options)
        return figure, _with_first(figure, given, rows, columns, **options)


def _with_first(
    figure: Plot,
    given: UsersAxes,
    rows: int,
    columns: int,
    sharex: bool = False,
    sharey: bool = False,
    squeeze: bool = True,
    **options: Any,
) -> Any:
    """The axes of a figure: the user's, then others that nobody sees, which share their scales."""
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    axes[0, 0].remove()
    axes[0, 0] = given.axes
    given.below[:] = axes[1:, 0]
    for panel in axes.ravel()[1:]:
        if sharex:
            panel.sharex(given.axes)
        if sharey:
            panel.sharey(given.axes)
    if not squeeze:
        return axes
    return axes.item() if axes.size == 1 else axes.squeeze()


def entitle(figure: Figure, device: str | None, question: str = "") -> None:
    """Set a title of up to three lines: the figure's question, and the device; none for None.

    The user's axes have no question.
    """
    if device is None or (GIVEN.get() is not None and not device):
        return
    text = escaped(device)
    if (given := GIVEN.get()) is not None:
        with styled():
            given.axes.set_title(text)
        return
    across = 12.0 * figure.get_figwidth()
    # lines of about one length
    across = min(across, 1.1 * len(text) / max(1, math.ceil(len(text) / across)) + 8)
    lines = textwrap.wrap(text, int(across), max_lines=_LINES - bool(question), placeholder=" ...")
    with styled():
        figure.suptitle("\n".join([question] * bool(question) + lines))


def legend(figure: Figure, note: str = "", more: Iterable[Any] = (), beside: str = "") -> None:
    """Add one legend under all axes, or inside the user's; ``note`` explains bars and bands.

    The note ``beside`` is on panels other than the first, which the user's axes leave out.
    """
    named: dict[str, Any] = {}
    given = GIVEN.get()
    for axes in figure.axes if given is None else [given.axes]:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    named |= {handle.get_label(): handle for handle in more}
    note = note if given is not None else f"{note} {beside}".strip()
    if not named and not note:
        return
    longest = max((len(label) for label in named), default=1)
    columns = max(1, min(len(named), 4, int(15.0 * figure.get_figwidth() / (longest + 10))))
    # rows of equal length
    columns = math.ceil(len(named) / math.ceil(len(named) / columns)) if named else 1
    across = int(14.0 * figure.get_figwidth())
    if given is not None:
        _legend_inside(given.axes, named, note)
        return
    with styled():
        made = figure.legend(
            [*named.values()],
            [*named],
            loc="outside lower center",
            ncols=columns,
            title=textwrap.fill(note, across),
        )
        made.get_title().set_multialignment("center")


def _legend_inside(axes: Axes, named: dict[str, Any], note: str) -> None:
    """Add a legend as wide as the axes at most, at the best place if the search is quick."""
    across = max(12, int(14.0 * axes.bbox.width / axes.figure.dpi))
    points = sum(np.size(line.get_xdata()) for line in axes.lines)
    quick = not axes.collections and not axes.images and points <= _POINTS_SEARCHED
    with styled():
        axes.legend(
            [*named.values()],
            [textwrap.fill(label, max(8, across - 8)) for label in named],
            title=textwrap.fill(note, across),
            loc="best" if quick else "upper right",
            frameon=True,
            framealpha=0.85,
        )


def curve(
    axes: Axes, x: Floats, y: Floats, error: Floats, style: dict[str, Any], dot: str = "o"
) -> None:
    """Draw a line or markers, with intervals y +- error if there are any.

    nan breaks the line; a point without neighbours, which no line shows, is a marker ``dot``.
    """
    many = len(x) > MOST_BARS
    if many and style.get("marker") and style.get("linestyle") == "none":
        style = style | {"markersize": 2.0}
    axes.plot(x, y, **style)
    if np.any(error > 0.0):
        if many:
            axes.fill_between(
                x, y - error, y + error, color=style["color"], alpha=0.3, linewidth=0, zorder=1.9
            )
        else:
            bars = {"fmt": "none", "elinewidth": 1.0, "zorder": style.get("zorder", 2.0)}
            axes.errorbar(x, y, error, ecolor=style["color"], **bars)
    if style.get("linestyle", "-") != "none" and not style.get("marker"):
        known = np.concatenate(([False], np.isfinite(y), [False]))
        alone = known[1:-1] & ~known[:-2] & ~known[2:]
        dots: dict[str, Any] = {"marker": dot, "markersize": 5, "linestyle": "none"}
        if alone.any():
            axes.plot(
                x[alone], y[alone], color=style["color"], zorder=style.get("zorder", 2.0), **dots
            )


def paler(colour: Any, share: float) -> tuple[float, float, float]:
    """A colour mixed with a share (0 to 1) of white."""
    from matplotlib.colors import to_rgb

    r, g, b = (c + share * (1.0 - c) for c in to_rgb(colour))
    return r, g, b
