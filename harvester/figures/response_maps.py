"""The figure of frequency responses at many values of one scene key: the mean power over frequency and value."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm, Normalize

from harvester.arrays import Floats
from harvester.figures.quantities import mark, plain, quantity, scale
from harvester.figures.style import WIDTH, entitle, legend, new
from harvester.presentation.plot import Plot, styled
from harvester.studies.frequency_response.curve import FrequencyResponse

FEWEST = 7  # values of one key: fewer are curves
DECADES = 30.0  # ratio of the powers from which the colours go by ratio
DEEPEST = 1e4  # the same, shown at most


def is_map(answers: Sequence[FrequencyResponse]) -> bool:
    """Whether responses are those of one engine at many values of one key."""
    return (
        len({a.engine for a in answers}) == 1
        and len(answers) >= FEWEST
        and len(answers[0].varied) == 1
    )


def response_map(answers: Sequence[FrequencyResponse], title: str | None, per_g: bool) -> Plot:
    """Draw a map of the power for each direction (one if they are alike), and the largest of each value as a line.

    ``per_g``: the power over the square of the base's amplitude.
    """
    answers = sorted(answers, key=lambda answer: next(iter(answer.varied.values())))
    (key,) = answers[0].varied
    at, powers = _common(answers, per_g)
    units = answers[0].unit_names
    power = scale(
        "mean power per g²" if per_g else "mean power",
        "W/g^2" if per_g else units.power,
        [*powers.values()],
    )
    hertz = scale(
        "excitation frequency" if units.frequency else "excitation frequency Ω", units.frequency, at
    )
    norm = _colours([values / power.factor for values in powers.values()])
    shown = [*powers] if any(answer.hysteresis for answer in answers) else [*powers][:1]
    with styled():
        size = (WIDTH, 4.2) if len(shown) == 1 else (WIDTH, 3.9)
        figure, axes = new(1, len(shown), size, squeeze=False, sharey=True)
        for number, (panel, direction) in enumerate(zip(axes[0], shown, strict=True)):
            height = _heights(panel, key, np.array([answer.varied[key] for answer in answers]))
            values = powers[direction] / power.factor
            f = np.array(at) / hertz.factor
            drawn = panel.pcolormesh(
                f, height, values, norm=norm, cmap="viridis", shading="nearest"
            )
            _crest(panel, answers, direction, height, hertz.factor)
            panel.set_xlabel(hertz.label)
            panel.set_title(f"{direction} the frequencies" if len(shown) > 1 else "")
            panel.set_ylabel("" if number else panel.get_ylabel())
        _bar(figure.colorbar(drawn, ax=list(axes[0]), label=power.label), isinstance(norm, LogNorm))
        entitle(figure, title, "Mean power against frequency and " + quantity(key)[0])
        legend(figure)
    return figure


def _common(
    answers: Sequence[FrequencyResponse], per_g: bool
) -> tuple[list[float], dict[str, Floats]]:
    """The frequencies that all responses have, and by direction the powers there, shape (responses, frequencies)."""
    directions = answers[0].directions
    at = sorted(
        set.intersection(*({p.frequency for p in a.sweep(d)} for a in answers for d in directions))
    )
    return at, {d: np.array([_powers(a, d, at, per_g) for a in answers]) for d in directions}


def _bar(bar: Colorbar, by_ratio: bool) -> None:
    """Write the numbers of a bar on a logarithmic scale as people read them."""
    if by_ratio:
        bar.formatter = bar.ax.yaxis.get_major_formatter()
        bar.ax.yaxis.set_major_formatter(lambda y, _: plain(y))


def _colours(powers: Sequence[Floats]) -> Normalize:
    """Colours on a logarithmic scale if powers differ by `DECADES` or more."""
    top = max(float(power.max()) for power in powers)
    least = min(float(power[power > 0.0].min(initial=np.inf)) for power in powers)
    low = max(least, top / DEEPEST)
    return LogNorm(low, top) if top > DECADES * low else Normalize(0.0, top or 1.0)


def _heights(panel: Axes, key: str, values: Floats) -> Floats:
    """The values of the key on the panel's axis, logarithmic if they differ tenfold."""
    panel.grid(False)
    logarithmic = values[0] > 0.0 and values[-1] >= 10.0 * values[0]
    return values / mark(panel.yaxis, key, values, bool(logarithmic))


def _powers(
    answer: FrequencyResponse, direction: str, frequencies: Sequence[float], per_g: bool
) -> list[float]:
    """The mean powers of one response at some of its frequencies."""
    of = {p.frequency: p.mean_power.value for p in answer.sweep(direction)}
    over = (answer.level or 1.0) ** 2 if per_g else 1.0
    return [of[f] / over for f in frequencies]


def _crest(
    panel: Axes, answers: Sequence[FrequencyResponse], direction: str, height: Floats, hertz: float
) -> None:
    """Draw the place of the largest power of each value."""
    peaks = [answer.peak(direction).frequency / hertz for answer in answers]
    panel.plot(
        peaks,
        height,
        color="#D55E00",
        linewidth=1.4,
        linestyle=(0, (3, 2)),
        label="frequency of the largest power",
    )
