"""The figure of one answer: the parts of its error and, where an energy ledger was kept, where the power went."""

from matplotlib.axes import Axes

from harvester.figures.quantities import scale
from harvester.figures.shapes import EstimateShape
from harvester.figures.style import INK, STYLES, WIDTH, Plot, entitle, new, styled

_LEDGER = "ledger_"
_HATCHES = {"sampling, 95 %": "", "step": "////", "model, estimated": "...."}


def estimate(answer: EstimateShape, title: str | None) -> Plot:
    """Draw bars of the mean power's errors in percent of it, and of the ledger's powers; an unknown error says so."""
    flows = {k.removeprefix(_LEDGER): v for k, v in answer.details.items() if k.startswith(_LEDGER)}
    flows.pop("residual", None)
    with styled():
        figure, axes = new(1, 2 if flows else 1, (WIDTH, 2.4), squeeze=False)
        _errors(axes[0, 0], answer)
        if flows:
            here = axes[0, 1]
            x = scale("mean power", answer.unit_names.power, [*flows.values()])
            here.barh([*flows], [v / x.factor for v in flows.values()], color="0.6", edgecolor=INK, linewidth=0.6)
            here.axvline(0.0, color=INK, linewidth=0.6)
            here.invert_yaxis()
            here.set_xlabel(x.label)
            here.set_title("Where the power went")
            here.grid(visible=False, axis="y")
        entitle(figure, title, f"Answer of {answer.engine}")
    return figure


def _errors(here: Axes, answer: EstimateShape) -> None:
    """Draw the errors of sampling, step and model as a bar each."""
    power = answer.mean_power
    parts = {
        "sampling, 95 %": None if power.stderr is None else power.sampling95,
        "step": power.bias,
        "model, estimated": power.model,
    }
    by = abs(power.value) / 100.0
    colour = STYLES.get(answer.engine, {}).get("color", "0.6")
    for place, (name, error) in enumerate(parts.items()):
        if error is None or by == 0.0:
            text = "none, or not known" if error is None else "the power is 0"
            here.annotate(text, (0.0, place), (4, 0), textcoords="offset points", va="center", fontsize=8, color="0.35")
        else:
            here.barh(place, error / by, 0.6, color=colour, edgecolor=INK, linewidth=0.6, hatch=_HATCHES[name])
    here.set_yticks(range(len(parts)), [*parts])
    here.set_ylim(len(parts) - 0.5, -0.5)
    here.set_xlim(0.0, None if here.containers else 1.0)
    here.set_xlabel("error of the mean power (%)")
    here.set_title(f"What the error of {answer.engine} is made of")
    here.grid(visible=False, axis="y")
