"""What users add to a plot: formulas between dollar signs are formulas; the plot's own text is drawn unchanged."""

from matplotlib.text import Text

import harvester as hv
from tests.support.paths import EXAMPLES


def test_formulas_work_in_a_plot_that_is_there():
    plot = hv.motion(EXAMPLES / "plate.toml", duration="1 s").plot("costs 5$ and 6$")
    axes = plot.axes[0]
    axes.set_ylabel(r"$x_0$")
    axes.text(0.1, 0.1, r"$\beta$")
    texts = {text.get_text(): text.get_parse_math() for text in plot.findobj(Text)}
    assert texts[r"$x_0$"] and texts[r"$\beta$"]
    title = next(text for text in texts if "costs 5$ and 6$" in text)
    assert not texts[title]
