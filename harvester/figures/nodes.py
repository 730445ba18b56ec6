"""The figure of a sensor node: the voltage of its store, where it begins and stops, and its first packet."""

from harvester.figures.quantities import Scale, scale
from harvester.figures.shapes import NodeShape
from harvester.figures.style import WIDTH, Plot, entitle, legend, new, styled

HOUR = 3600.0  # s


def node(answer: NodeShape, title: str | None) -> Plot:
    """Draw the store's voltage over time."""
    volt = scale("voltage of the store", "V", [*answer.voltage, *answer.thresholds])
    in_hours = answer.t[-1] > 2.0 * HOUR
    time = Scale(HOUR, "time (h)") if in_hours else scale("time", "s", answer.t)
    with styled():
        figure, axes = new(1, 1, (WIDTH, 3.0), squeeze=False)
        panel = axes[0, 0]
        panel.plot(answer.t / time.factor, answer.voltage / volt.factor, color="#0072B2", linewidth=0.8)
        for level, name, color in zip(
            answer.thresholds, ("the node begins", "the node stops"), ("#009E73", "#D55E00"), strict=True
        ):
            panel.axhline(level / volt.factor, color=color, linewidth=1.0, linestyle=(0, (5, 2)), label=name)
        if answer.first_packet is not None:
            first = answer.first_packet.value / time.factor
            panel.axvline(first, color="0.4", linewidth=1.0, linestyle=":", label="first packet")
        panel.set_xlabel(time.label)
        panel.set_ylabel(volt.label)
        panel.set_xlim(0.0, answer.t[-1] / time.factor)
        panel.set_ylim(0.0, None)
        entitle(figure, title, "When does the node run from its store?")
        legend(figure, "")
    return figure
