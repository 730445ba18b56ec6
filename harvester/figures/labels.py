"""Labels that are next to their objects, if they cover neither data nor each other."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from harvester.arrays import Floats
from harvester.presentation.plot import styled

_EVERY = 4.0  # pixels between the places of a line that a label keeps clear of
_AWAY = 7.0  # points from a label to its mark
# to the right, to the left, ...: direction and alignment
_SIDES: tuple[tuple[float, float, str, str], ...] = (
    *((1.0, 0.0, "left", "center"), (-1.0, 0.0, "right", "center")),
    *((0.0, 1.0, "center", "bottom"), (0.0, -1.0, "center", "top")),
    *((0.8, 0.8, "left", "bottom"), (0.8, -0.8, "left", "top")),
    *((-0.8, 0.8, "right", "bottom"), (-0.8, -0.8, "right", "top")),
)


@dataclass(frozen=True)
class Label:
    """A text, its colour, and the marks (n, 2) in units of the data that it may be next to, the best first."""

    text: str
    colour: Any
    at: Floats


def write_labels(axes: Axes, labels: Sequence[Label]) -> None:
    """Write each label next to one of its marks: inside the axes, off all lines, marks and labels if there is room.

    The axes must be complete, since their limits and the layout of the figure decide which of them
    covers another.
    """
    figure = axes.figure
    assert figure is not None
    with styled():
        figure.draw_without_rendering()  # type: ignore[union-attr]
        inside = axes.get_window_extent()
        taken = _drawn(axes)
        boxes: list[Bbox] = []
        for label in labels:
            written = axes.annotate(
                label.text,
                label.at[0],
                (0, 0),
                textcoords="offset points",
                fontsize=9,
                color=label.colour,
                zorder=7,
            )
            written.set_in_layout(False)
            best: tuple[float, Any, Any] = (np.inf, None, None)
            for at in label.at:
                for away in (1.0, 2.2, 4.0, 6.0):
                    for dx, dy, across, up in _SIDES:
                        written.xy = tuple(at)
                        written.xyann = (away * _AWAY * dx, away * _AWAY * dy)
                        written.set(ha=across, va=up)
                        box = written.get_window_extent()
                        cost = _covered(box, inside, taken, boxes) + 0.5 * away
                        if cost < best[0]:
                            best = (cost, (written.xy, written.xyann, across, up), box)
            (written.xy, written.xyann, across, up), box = best[1], best[2]
            written.set(ha=across, va=up)
            boxes.append(box.padded(2.0))


def _covered(box: Bbox, inside: Bbox, taken: Floats, boxes: Sequence[Bbox]) -> float:
    """How much a label at a place would cover: data, other labels, and the part outside the axes."""
    wide = box.padded(4.0)
    data = np.sum((taken > wide.min).all(axis=1) & (taken < wide.max).all(axis=1))
    outside = box.x0 < inside.x0 or box.x1 > inside.x1 or box.y0 < inside.y0 or box.y1 > inside.y1
    return float(data + 1e3 * sum(wide.overlaps(other) for other in boxes) + 1e4 * outside)


def _drawn(axes: Axes) -> Floats:
    """Places, shape (n, 2), in pixels, that lines, marks and bars of the axes go through."""
    paths = [
        (line.get_xydata(), line.get_transform(), line.get_linestyle() != "None")
        for line in axes.lines
    ]
    for bars in axes.collections:
        if hasattr(bars, "get_segments"):
            paths += [(segment, bars.get_transform(), True) for segment in bars.get_segments()]
    positions = [np.empty((0, 2))]
    for data, transform, joined in paths:
        points = transform.transform(np.asarray(data, dtype=float).reshape(-1, 2))
        points = points[np.isfinite(points).all(axis=1)]
        positions.append(points)
        if joined and len(points) > 1:
            length = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
            every = np.linspace(0.0, length[-1], min(int(length[-1] / _EVERY) + 2, 20_000))
            positions.append(
                np.stack([np.interp(every, length, points[:, k]) for k in (0, 1)], axis=1)
            )
    return np.concatenate(positions)
