"""The figure of one trajectory of a model of the user's own: each of its quantities over time."""

import numpy as np

from harvester.cosimulation.coupled_models import Cosimulation
from harvester.figures.quantities import broken, scale
from harvester.figures.style import WIDTH, entitle, new
from harvester.presentation.plot import Plot, styled

_MOST, _ROWS = 4000, 8  # points of a line, and quantities
_INK = "#0072B2"


def cosimulation(answer: Cosimulation, title: str | None) -> Plot:
    """Draw the columns of a trajectory over the first of them, its time."""
    time, *columns = answer.table.columns
    columns = columns[:_ROWS]
    t = np.asarray(time.cells, dtype=float)
    of_time = scale("time", time.unit, t)
    thin = slice(None, None, max(1, len(t) // _MOST))
    with styled():
        figure, axes = new(len(columns), 1, (WIDTH, 1.3 * len(columns) + 0.6))
        for here, column in zip(axes, columns, strict=True):
            values = np.asarray(column.cells, dtype=float)
            its_scale = scale(column.head, column.unit, values)
            here.plot(
                t[thin] / of_time.factor, values[thin] / its_scale.factor, color=_INK, linewidth=0.8
            )
            here.set_ylabel(broken(its_scale.label, 16))
            here.set_xlim(t[0] / of_time.factor, t[-1] / of_time.factor)
            here.tick_params(labelbottom=column is columns[-1])
        axes[-1].set_xlabel(of_time.label)
        entitle(figure, title, "A model and its circuit over time")
    return figure
