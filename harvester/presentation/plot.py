"""The plot of a result: a matplotlib figure in one look, wherever it is drawn or saved.

Text is drawn unchanged (a title may hold a dollar sign), so units are written in Unicode.
"""

import io
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harvester.machine import files

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
_ONE_PLACE = 1e-9  # a width of an axis, relative to its end, that is rounding alone
_IGNORED = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None},
}


@dataclass(frozen=True)
class UsersAxes:
    """Axes of the user, in place of a figure's first panel, and the panels below it."""

    axes: Axes
    below: list[Axes] = field(default_factory=list)

    def finish(self) -> None:
        """Complete the axes with the label and the numbers of the x axis that a panel below has."""
        labels = [panel.get_xlabel() for panel in self.below if panel.get_xlabel()]
        if labels and not self.axes.get_xlabel():
            with styled():
                self.axes.set_xlabel(labels[-1])
        self.axes.tick_params(labelbottom=True)
        _widen(self.axes)


GIVEN: ContextVar[UsersAxes | None] = ContextVar("GIVEN", default=None)


class Plot(Figure):
    """A figure that keeps this look when it is drawn or saved later, and shows itself in a notebook."""

    def draw(self, renderer: Any) -> None:
        """Draw the figure as `matplotlib.figure.Figure.draw` does, in this look."""
        for here in self.axes:
            _widen(here)
        with styled():
            super().draw(renderer)

    def savefig(self, fname: Any, **options: Any) -> None:
        """Save the figure as `matplotlib.figure.Figure.savefig` does.

        The same figure gives the same file.
        """
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


def image(figure: Figure, form: str) -> bytes:
    """The figure as a file: png, svg or pdf."""
    out = io.BytesIO()
    figure.savefig(out, format=form)
    return out.getvalue()


def save(figure: Figure, folder: Path, name: str, vector: Sequence[str] = ()) -> None:
    """Write ``name``.png, and next to it the vector forms asked for (`harvester.machine.files.VECTOR`)."""
    for form in ("png", *dict.fromkeys(vector)):
        files.write(folder / f"{name}.{form}", image(figure, form))
