"""The figure of a sensor node: the voltage of its store, where it begins and stops, and its first packet."""

from harvester.figures.quantities import scale
from harvester.figures.shapes import NodeShape
from harvester.figures.style import WIDTH, Plot, entitle, legend, new, styled


def node(answer: NodeShape, title: str | None) -> Plot:
    """Draw the store's voltage over time."""
    time, volt = scale("time", "s", answer.t), scale("voltage of the store", "V", [*answer.voltage, *answer.thresholds])
    with styled():
        figure, axes = new(1, 1, (WIDTH, 3.0), squeeze=False)
        panel = axes[0, 0]
        panel.plot(answer.t / time.factor, answer.voltage / volt.factor, color="#0072B2", linewidth=0.8)
        for level, name, color in zip(answer.thresholds, ("begins", "stops"), ("#009E73", "#D55E00"), strict=True):
            panel.axhline(level / volt.factor, color=color, linewidth=1.0, linestyle=(0, (5, 2)), label=name)
        if answer.first_packet is not None:
            first = answer.first_packet.value / time.factor
            panel.axvline(first, color="0.4", linewidth=1.0, linestyle=":", label="first packet")
        panel.set_xlabel(time.label)
        panel.set_ylabel(volt.label)
        panel.set_ylim(0.0, None)
        entitle(figure, title, "Store and node")
        legend(figure, "")
    return figure
