"""The spectra of a record: its density by Welch, its spectrogram, and its rms by octave with the sampling error."""

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid
from harvester.presentation import drawing
from harvester.presentation.columns import columns
from harvester.presentation.table import csv_lines
from harvester.records.cleaning import CleanRecord
from harvester.records.csv_table import MOST_BYTES
from harvester.records.records import Record
from harvester.uncertainty.value import Value, amount

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SEGMENTS = 16  # of Welch's mean, about
G = 9.80665
CENTRE = 1000.0  # Hz, of an octave


@dataclass(frozen=True)
class Band:
    """An octave from ``low`` to ``high`` (Hz) and the rms acceleration in it (m/s^2), with its sampling error."""

    low: float
    high: float
    rms: Value


@dataclass(frozen=True, eq=False)
class RecordAnswer:
    """A clean record and its spectra: density in (m/s^2)^2/Hz at ``f``, shape (m,), and by time, shape (m', k).

    ``possible`` is the most power (W) that any device of a mass absorbs within a stroke; None if
    none was asked for.
    """

    record: CleanRecord
    f: Floats
    density: Floats
    spectrogram_f: Floats
    spectrogram_t: Floats
    spectrogram: Floats
    bands: tuple[Band, ...]
    possible: float | None = None

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The record, its density, spectrogram and bands as a matplotlib figure."""
        return drawing.draw(self, title, ax)

    def text(self) -> str:
        """The clean record as the CSV file that a scene reads.

        Raises InputError if that would be too large.
        """
        rows = zip(np.round(self.record.times, 12), self.record.values, strict=True)
        text = "".join(csv_lines(["time (s)", "acceleration (m/s^2)"], rows))
        if len(text) > MOST_BYTES:
            raise InputError(
                f"FILE must give a clean record of at most {MOST_BYTES} bytes, as a scene reads, but it has "
                f"{len(text)}: cut the file, or give a lower `rate`"
            )
        return text

    def as_json(self) -> dict[str, object]:
        """The answer as ``--json`` prints it."""
        record = self.record
        return {
            "axis": record.axis,
            "rate": record.rate,
            "samples": len(record.values),
            "duration": len(record.values) / record.rate,
            "rms": record.rms,
            "peak": float(np.abs(record.values).max()),
            **({} if self.possible is None else {"possible_power": self.possible}),
            "bands": [
                {"low": b.low, "high": b.high, "rms": b.rms.value, "stderr": b.rms.stderr}
                for b in self.bands
            ],
            "found": list(map(str, record.notes)),
            "warnings": list(map(str, record.warnings)),
        }

    def __str__(self) -> str:
        record = self.record
        rms = self.record.rms
        peak = float(np.abs(record.values).max())
        n = len(record.values)
        lines = [
            f"axis {record.axis}: {n} samples, {record.rate:.6g} a second, {n / record.rate:.4g} s",
            f"rms {rms:.4g} m/s^2 ({rms / G:.3g} g), peak {peak:.4g} m/s^2 ({peak / G:.3g} g), of this record",
        ]
        if self.possible is not None:
            lines.append(
                f"no device of that mass and stroke absorbs more than {amount(self.possible, 'W')}"
            )
        lines += [f"found: {message}" for message in record.notes]
        lines += [f"warning: {message}" for message in record.warnings]
        rows = [(f"{b.low:.3g} to {b.high:.3g} Hz", b.rms.format("m/s^2")) for b in self.bands]
        return "\n".join([*lines, "rms by octave:", *columns(rows, "  ")])


def record_spectra(
    record: CleanRecord, mass: float | None = None, stroke: float | None = None
) -> RecordAnswer:
    """The spectra of a record, and the most power that a mass (kg) absorbs with a ``stroke`` (m) to either side.

    Between stops E[a x'] = -E[a' x], so that any device absorbs m D E|a'| at most
    (`harvester.equations.power_bound`).

    Raises InputError for one of mass and stroke without the other: a record bounds no power alone.
    """
    from scipy.signal import spectrogram, welch

    if (mass is None) != (stroke is None):
        raise InputError(
            "`mass` and `stroke` must be given together: one alone bounds no power, but one is left out"
        )
    if stroke is not None and not stroke > 0.0:
        raise invalid("`stroke`", "be above 0", stroke)
    n = len(record.values)
    f, density = welch(record.values, record.rate, nperseg=max(8, min(n, 2 * n // (SEGMENTS + 1))))
    short = max(8, min(n, n // 60 if n >= 1200 else n // 8))
    sf, st, grid = spectrogram(record.values, record.rate, nperseg=short, noverlap=short // 2)
    possible = None
    if mass is not None and stroke is not None:
        possible = mass * stroke * Record.of(1.0 / record.rate, record.values).mean_jerk
    return RecordAnswer(
        record=record,
        f=f,
        density=density,
        spectrogram_f=sf,
        spectrogram_t=st,
        spectrogram=grid,
        bands=_bands(record),
        possible=possible,
    )


def _bands(record: CleanRecord) -> tuple[Band, ...]:
    """The rms in octaves about 1 kHz up to half the rate, of the lines of the whole record.

    A line is chi-squared of two; the octaves are those of IEC 61260, in base 2.
    """
    n = len(record.values)
    f = np.fft.rfftfreq(n, 1.0 / record.rate)
    power = 2.0 * np.abs(np.fft.rfft(record.values)) ** 2 / n**2
    if n % 2 == 0:
        power[-1] *= 0.5
    octaves = np.log2(f[[1, -1]] / CENTRE)
    edges = CENTRE * 2.0 ** np.arange(math.floor(octaves[0] + 0.5) - 0.5, octaves[1] + 1.0)
    bands = []
    for low, high in itertools.pairwise(np.minimum(edges, f[-1])):
        inside = power[(f > low) & (f <= high)]
        if len(inside) and inside.sum() > 0.0:
            rms = math.sqrt(float(inside.sum()))
            # E[p^2] = 2 Var(p) of a line p
            error = 0.5 * math.sqrt(0.5 * float((inside**2).sum())) / rms
            value = Value(rms, unknown="a tone") if _has_tone(inside) else Value(rms, stderr=error)
            bands.append(Band(float(low), float(high), value))
    return tuple(bands)


def _has_tone(lines: Floats) -> bool:
    """Whether one line is so much of a band as chance makes it in none of a million random signals (Fisher's test)."""
    n = len(lines)
    share = float(lines.max() / lines.sum())
    return n > 1 and n * (1.0 - share) ** (n - 1) < 1e-6
