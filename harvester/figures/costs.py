"""The figure of what accuracy costs."""

from collections.abc import Sequence

from harvester.figures.quantities import logarithm
from harvester.figures.shapes import CostShape
from harvester.figures.style import INK, MARKERS, STYLES, WIDTH, Plot, entitle, legend, new, styled


def cost(rows: Sequence[CostShape], title: str | None) -> Plot:
    """Draw total error against seconds, a marker for each row, and the Pareto front of both."""
    shown = [row for row in rows if row.seconds and row.total_error]
    best = sorted(
        (row.seconds, 100.0 * row.total_error) for row in shown if row.best and row.seconds and row.total_error
    )
    with styled():
        figure, here = new(1, 1, (WIDTH, 4.6))
        for engine in dict.fromkeys(row.engine for row in shown):
            of_engine = [row for row in shown if row.engine == engine]
            seconds, errors = (
                [row.seconds for row in of_engine],
                [100.0 * (row.total_error or 0.0) for row in of_engine],
            )
            look = {"color": STYLES[engine]["color"], "marker": MARKERS[engine], "label": STYLES[engine]["label"]}
            here.plot(seconds, errors, linestyle="none", markersize=6, markeredgecolor=INK, zorder=3, **look)
        if best:
            front = {"color": INK, "linewidth": 1, "zorder": 2, "label": "front: none is as fast and as accurate"}
            here.step([b[0] for b in best], [b[1] for b in best], where="post", **front)
            logarithm(here.xaxis)
            logarithm(here.yaxis)
            here.margins(0.08)
        here.set_xlabel("time of the computation (s)")
        here.set_ylabel("total error of the mean power (%)")
        entitle(figure, title, "What accuracy costs")
        legend(figure, "Total error: sampling at 95 % plus step and model, each counted as large as it may be unseen.")
    return figure
