"""The figure of a record: over time, its density, its spectrogram, and its rms by octave."""

import numpy as np
from matplotlib.colors import LogNorm

from harvester.arrays import Floats
from harvester.figures.style import WIDTH, entitle, new
from harvester.presentation.plot import Plot, styled
from harvester.studies.record import RecordAnswer

_LINE = "#0072B2"
MOST = 20_000  # points of the curve over time


def _outline(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """A curve of at most `MOST` points with each peak: the extremes of its pieces in turn."""
    piece = max(1, -(-2 * len(values) // MOST))
    if piece < 3:
        return times, values
    whole = len(values) // piece * piece
    rows = values[:whole].reshape(-1, piece)
    first = np.arange(len(rows)) * piece
    both = np.sort([first + rows.argmin(axis=1), first + rows.argmax(axis=1)], axis=0)
    at = np.append(both.T.ravel(), np.arange(whole, len(values)))
    return times[at], values[at]


def record(answer: RecordAnswer, title: str | None) -> Plot:
    """Draw a record's acceleration, Welch's density, the spectrogram and the rms by octave."""
    cleaned = answer.record
    with styled():
        figure, grid = new(2, 2, (WIDTH, 5.6))
        over, density, colours, bars = grid.ravel()
        over.plot(*_outline(cleaned.times, cleaned.values), color=_LINE, linewidth=0.5)
        over.set_xlabel("time (s)")
        over.set_ylabel("acceleration (m/s²)")
        shown = (answer.f > 0.0) & (answer.density > 0.0)
        density.loglog(answer.f[shown], answer.density[shown], color=_LINE, linewidth=1.0)
        density.set_xlabel("frequency (Hz)")
        density.set_ylabel("density ((m/s²)²/Hz), Welch")
        top = float(answer.spectrogram.max())
        picture = colours.pcolormesh(
            answer.spectrogram_t,
            answer.spectrogram_f,
            np.maximum(answer.spectrogram, 1e-8 * top),
            norm=LogNorm(1e-6 * top, top),
            cmap="viridis",
            rasterized=True,
        )
        colours.grid(visible=False)
        colours.set_xlabel("time (s)")
        colours.set_ylabel("frequency (Hz)")
        figure.colorbar(picture, ax=colours, label="(m/s²)²/Hz", format="%.0e")
        centres = [np.sqrt(b.low * b.high) for b in answer.bands]
        values = [b.rms.value for b in answer.bands]
        errors = [b.rms.sampling95 for b in answer.bands]
        bars.bar(range(len(values)), values, 0.7, yerr=errors, color=_LINE, ecolor="0.2", capsize=2)
        bars.set_xticks(range(len(values)), [f"{c:.3g}" for c in centres], rotation=60)
        bars.set_xlabel("centre of the octave (Hz)")
        bars.set_ylabel("rms (m/s²)")
        for axes in (density,):
            axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
            axes.yaxis.set_major_formatter(lambda y, _: f"{y:.0e}")
        entitle(figure, title, f"What does the record hold? Axis {cleaned.axis}")
    return figure
