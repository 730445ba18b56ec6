"""The figures of a sensor's supply: the storage voltage, and the circuits of a design."""

from harvester.figures.quantities import Scale, amount, scale
from harvester.figures.style import INK, WIDTH, entitle, legend, new
from harvester.presentation.plot import Plot, styled
from harvester.studies.design.design_result import DesignResult
from harvester.studies.node import NodeResult

HOUR = 3600.0  # s
_CHOSEN = "#0072B2"
_MEETS = "#56B4E9"
_FAILS = "0.85"


def node(answer: NodeResult, title: str | None) -> Plot:
    """Draw the storage voltage over time."""
    volt = scale("storage voltage", "V", [*answer.voltage, *answer.thresholds])
    in_hours = answer.t[-1] > 2.0 * HOUR
    time = Scale(HOUR, "time (h)") if in_hours else scale("time", "s", answer.t)
    with styled():
        figure, axes = new(1, 1, (WIDTH, 3.0), squeeze=False)
        panel = axes[0, 0]
        panel.plot(
            answer.t / time.factor,
            answer.voltage / volt.factor,
            color=_CHOSEN,
            linewidth=0.8,
            label="storage",
        )
        names = ("the node begins", "the node stops")
        for level, name, color in zip(
            answer.thresholds, names, ("#009E73", "#D55E00"), strict=True
        ):
            label = f"{name}, {amount(level, 'V')}"
            panel.axhline(
                level / volt.factor, color=color, linewidth=1.0, linestyle=(0, (5, 2)), label=label
            )
        if answer.first_packet is not None:
            first = answer.first_packet.value
            label = f"first packet, after {amount(first, 's')}"
            panel.axvline(
                first / time.factor, color="0.4", linewidth=1.0, linestyle=":", label=label
            )
        panel.set_xlabel(time.label)
        panel.set_ylabel(volt.label)
        panel.set_xlim(0.0, answer.t[-1] / time.factor)
        panel.set_ylim(0.0, None)
        entitle(figure, title, "When does the node run from its storage?")
        legend(figure)
    return figure


def design(answer: DesignResult, title: str | None) -> Plot:
    """Draw each circuit's power with its total error, and the required one.

    The chosen one is first.
    """
    x = scale(
        "power available at the voltage needed",
        "W",
        [each.available.value for each in answer.candidates],
    )
    names = []
    with styled():
        figure, axes = new(1, 1, (WIDTH, 1.6 + 0.5 * len(answer.candidates)), squeeze=False)
        panel = axes[0, 0]
        for row, each in enumerate(answer.candidates):
            power, error = each.available.value / x.factor, each.available.known_error95 / x.factor
            kinds = ("meets everything", _MEETS) if each.meets else ("something is not met", _FAILS)
            label, color = ("chosen", _CHOSEN) if row == 0 else kinds
            look = {
                "color": color,
                "edgecolor": INK,
                "linewidth": 0.6,
                "capsize": 2,
                "label": label,
                "ecolor": INK,
            }
            panel.barh(row, power, 0.6, xerr=error or None, **look)
            text = amount(each.available.value, "W")
            text += "" if each.share_met is None else f", {100.0 * each.share_met:.3g} %"
            beside = {
                "textcoords": "offset points",
                "va": "center",
                "fontsize": 9,
                "backgroundcolor": "white",
            }
            panel.annotate(text, (power + error, row), (8, 0), **beside)
            wake = "never awake" if each.wake is None else f"awake after {amount(each.wake, 's')}"
            names.append(f"{', '.join(filter(None, (each.circuit, each.coil)))}\n{wake}")
        needed = amount(answer.power_needed, "W")
        panel.axvline(
            answer.power_needed / x.factor,
            color="#D55E00",
            linestyle=(0, (5, 2)),
            label=f"needed: {needed}",
        )
        panel.set_yticks(range(len(names)), names)
        panel.invert_yaxis()
        panel.margins(x=0.35)
        panel.set_xlabel(x.label)
        panel.grid(visible=False, axis="y")
        entitle(figure, title, f"Which circuit gives the {needed} that are needed?")
        shared = any(each.share_met is not None for each in answer.candidates)
        legend(
            figure,
            "Thin bars: the error, 95 %." + " Percent: devices that meet everything." * shared,
        )
    return figure
