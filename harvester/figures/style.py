"""The look of all figures: fonts, sizes and lines.

Drawn 152 mm wide with letters of 9 points and more, which a phone 390 pixels wide still shows 8
pixels tall.  Text is taken unchanged (a title may hold a dollar sign), so units are written in
Unicode.  How each engine looks is in `harvester.presentation.engine_look`.
"""

import io
import math
import textwrap
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harvester.arrays import Floats
from harvester.errors import escaped
from harvester.machine import files
from harvester.presentation.engine_look import LOOKS, EngineLook

WIDTH = 6.0  # inches
MOST_BARS = 60  # points of a curve with an error bar each; more are a band
STYLE: Any = {  # of matplotlib's hundreds of names
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same on every machine
    "figure.titlesize": 10.5,
    **dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), 9.5),
    **dict.fromkeys(
        ("legend.fontsize", "legend.title_fontsize", "xtick.labelsize", "ytick.labelsize"), 9
    ),
    **dict.fromkeys(("axes.linewidth", "xtick.major.width", "ytick.major.width"), 0.6),
    **dict.fromkeys(("xtick.minor.width", "ytick.minor.width"), 0.4),
    **dict.fromkeys(
        ("legend.frameon", "axes.spines.top", "axes.spines.right", "text.parse_math"), False
    ),
    **dict.fromkeys(("axes.grid", "axes.axisbelow"), True),
    **{
        "grid.color": "0.9",
        "grid.linewidth": 0.5,
        "legend.handlelength": 3.0,
        "axes.formatter.limits": (-4, 5),
    },
    **{
        "lines.linewidth": 1.4,
        "lines.markersize": 4.5,
        "lines.markeredgewidth": 0.8,
        "errorbar.capsize": 2,
    },
    "savefig.dpi": 175,
    "svg.hashsalt": "harvester",  # the same names inside the same file, run after run
    "svg.fonttype": "path",  # looks the same where the font is missing
    "pdf.fonttype": 42,  # letters stay letters
}
# Okabe and Ito's palette.  Engines state theirs (`harvester.presentation.engine_look`); this one is
# of a study.
LOOKS.setdefault(
    "spice alone", EngineLook("SPICE alone (ngspice)", "#56B4E9", "^", "none", order=3.9)
)
INK = "0.15"  # what belongs to no engine
_LINES = 3  # of a title
_ONE_PLACE = 1e-9  # a width of an axis, relative to its end, that is rounding alone
_IGNORED = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None},
}


class Plot(Figure):
    """A figure that keeps this look when it is drawn or saved later, and shows itself in a notebook."""

    def draw(self, renderer: Any) -> None:
        """Draw the figure as `matplotlib.figure.Figure.draw` does, in this look."""
        for here in self.axes:
            _widen(here)
        with styled():
            super().draw(renderer)

    def savefig(self, fname: Any, **options: Any) -> None:
        """Save the figure as `matplotlib.figure.Figure.savefig` does; the same figure gives the same file."""
        form = options.get("format") or str(fname).rpartition(".")[2].lower()
        with styled():
            super().savefig(fname, **{"metadata": _IGNORED.get(form), **options})

    def _repr_png_(self) -> bytes:
        return image(self, "png")


def _widen(here: Axes) -> None:
    """Widen the x axis if all points have one place, which rounding may leave a width of nearly nothing."""
    low, high = sorted(here.get_xlim())
    if high - low < _ONE_PLACE * abs(high):
        here.set_xlim(low / 2.0, 2.0 * high) if low > 0.0 else here.set_xlim(2.0 * low, high / 2.0)


@contextmanager
def styled() -> Iterator[None]:
    """A context in which everything is drawn in the look of this package."""
    with mpl.rc_context(STYLE), warnings.catch_warnings():
        # a title's letter that the font lacks: an empty box
        warnings.filterwarnings("ignore", "Glyph .* missing")
        yield


def new(rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Plot, Any]:
    """A new figure of a size in inches and its axes, without pyplot (0.2 s to load, and it keeps every figure)."""
    with styled():
        figure = Plot(figsize=size, layout="constrained")
        return figure, figure.subplots(rows, columns, **options)


def image(figure: Figure, form: str) -> bytes:
    """The figure as a file: png, svg or pdf."""
    out = io.BytesIO()
    figure.savefig(out, format=form)
    return out.getvalue()


def save(figure: Figure, folder: Path, name: str, vector: Sequence[str] = ()) -> None:
    """Write ``name``.png, and beside it the vector forms asked for (`harvester.machine.files.VECTOR`)."""
    for form in ("png", *dict.fromkeys(vector)):
        files.write(folder / f"{name}.{form}", image(figure, form))


def entitle(figure: Figure, device: str | None, question: str = "") -> None:
    """Set a title of up to three lines: the question that the figure answers, and the device; none for None."""
    if device is None:
        return
    text = escaped(device)
    across = 12.0 * figure.get_figwidth()
    # lines of about one length
    across = min(across, 1.1 * len(text) / max(1, math.ceil(len(text) / across)) + 8)
    lines = textwrap.wrap(text, int(across), max_lines=_LINES - bool(question), placeholder=" ...")
    with styled():
        figure.suptitle("\n".join([question] * bool(question) + lines))


def legend(figure: Figure, note: str = "", more: Iterable[Any] = ()) -> None:
    """Add one legend under all axes, if it covers nothing; ``note`` says what bars and bands are."""
    named: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    named |= {handle.get_label(): handle for handle in more}
    if not named and not note:
        return
    longest = max((len(label) for label in named), default=1)
    columns = max(1, min(len(named), 4, int(15.0 * figure.get_figwidth() / (longest + 10))))
    # rows of equal length
    columns = math.ceil(len(named) / math.ceil(len(named) / columns)) if named else 1
    across = int(14.0 * figure.get_figwidth())
    with styled():
        made = figure.legend(
            [*named.values()],
            [*named],
            loc="outside lower center",
            ncols=columns,
            title=textwrap.fill(note, across),
        )
        made.get_title().set_multialignment("center")


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
