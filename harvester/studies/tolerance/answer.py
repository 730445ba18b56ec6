"""The answer of a study of tolerances: distribution, yield, sensitivity and tornado, as text, JSON and a table."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.scene.keys import unit_of
from harvester.studies.output_folder import csv_text, named
from harvester.studies.tolerance.distribution import Interval, Quantile
from harvester.studies.tolerance.limits import Limit
from harvester.studies.tolerance.sensitivity import Sensitivity
from harvester.studies.tolerance.spreads import PartSpread
from harvester.uncertainty.value import amount, percent


@dataclass(frozen=True)
class TornadoBar:
    """A bar of the tornado: the mean power with one key at the 5 % and 95 % points of its spread, all others at half.

    ``ends`` are these two values of the key, ``powers`` the powers there.
    """

    key: str
    ends: tuple[float, float]
    powers: tuple[float, float]

    @property
    def swing(self) -> float:
        """The size of the change of the power."""
        return abs(self.powers[1] - self.powers[0])


@names_arguments
@dataclass(frozen=True)
class ToleranceResult:
    """How mean power and RMS voltage scatter over devices whose parts have tolerances.

    ``samples`` are the keys' values, shape (n, keys), and ``power`` and ``voltage`` what the engine finds there, shape
    (n,), in `unit_names`.  ``off`` is the relative error of each power at 95 %, None where it is not known, and
    ``check`` says where it is from.  ``quantiles`` map a share to the power that this share of devices is below,
    ``voltages`` the same of the RMS voltage.  ``met`` is the share that meets all ``limits``, ``met_each`` of each
    alone; None without a limit.  ``peaks_off`` is the relative error at 95 % of each limited peak, in the median.
    ``sensitivity`` is empty where there is none, for the reason ``why``.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> found = hv.tolerance(scene, {"nondimensional.mu": "5%", "nondimensional.c1": "20%"}, samples=256)
    >>> found.engine, max(found.sensitivity, key=lambda key: found.sensitivity[key].total)
    ('exact', 'nondimensional.c1')
    """

    engine: str
    spreads: tuple[PartSpread, ...]
    samples: Floats
    power: Floats
    voltage: Floats
    off: float | None
    check: str
    quantiles: dict[float, Quantile]
    voltages: dict[float, Quantile]
    limits: tuple[Limit, ...]
    met: Interval | None
    met_each: tuple[Interval, ...]
    sensitivity: dict[str, Sensitivity]
    why: str
    tornado: tuple[TornadoBar, ...]
    nominal: float | None
    unexplained: float
    failed: int
    physical: bool
    seconds: float
    warnings: tuple[str, ...] = ()
    peaks_off: dict[str, float] = field(default_factory=dict)
    about: dict[str, Any] = field(default_factory=dict, compare=False)

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of powers and voltages."""
        return AnswerUnits.of(self.physical)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        return {
            "engine": self.engine,
            "quantiles": {f"{share:g}": one.value for share, one in self.quantiles.items()},
            "quantile_intervals": {f"{share:g}": [one.low, one.high] for share, one in self.quantiles.items()},
            "voltage_quantiles": {f"{share:g}": one.value for share, one in self.voltages.items()},
            "voltage_quantile_intervals": {f"{share:g}": [one.low, one.high] for share, one in self.voltages.items()},
            "mean": float(self.power.mean()),
            "standard_deviation": float(self.power.std()),
            "yield": None if self.met is None else self.met.as_json(),
            "limits": [
                {"limit": limit.written, "peak_relative_error95": self.peaks_off.get(limit.quantity), **one.as_json()}
                for limit, one in zip(self.limits, self.met_each, strict=True)
            ],
            "sensitivity": {key: one.as_json() for key, one in self.sensitivity.items()},
            "no_sensitivity": self.why,
            "tornado": {bar.key: {"ends": bar.ends, "mean_power": bar.powers} for bar in self.tornado},
            "relative_error95": self.off,
            "error_from": self.check,
            "samples": len(self.power) + self.failed,
            "failed": self.failed,
            "surface_unexplained": self.unexplained,
            "seconds": self.seconds,
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        unit, volt = self.unit_names.power, self.unit_names.voltage
        lines = [f"{self.engine}: {self.seconds:.2g} s, {len(self.power) + self.failed} samples"]
        error = "is not known" if self.off is None else f"is {self.off:.2%} of it"
        lines.append(f"  the error of a sample's power {error} ({self.check})")
        lines += [f"  {line}" for line in self._distribution(unit, volt)]
        for limit, one in zip(self.limits, self.met_each, strict=True):
            known = self.peaks_off.get(limit.quantity)
            told = "" if known is None else f"; the level of a device is known within {percent(known, 1.0)}"
            lines.append(f"  {limit.written}: met by {_shares(one)}{told}")
        if self.met is not None:
            lines.append(f"  yield, all limits: {_shares(self.met)}")
        lines += [f"  {line}" for line in self._keys(unit)]
        if self.why:
            lines.append(f"  no sensitivity: {self.why}")
        return "\n".join(lines + [f"  warning: {one}" for one in self.warnings])

    def _distribution(self, unit: str, volt: str) -> list[str]:
        """The lines of the quantiles, with their intervals."""
        rows = [["devices below", "mean power", "95 %", "RMS voltage", "95 %"]]
        for share, power in self.quantiles.items():
            voltage = self.voltages[share]
            rows.append([f"{share:.0%}", amount(power.value, unit), _range(power, unit)])
            rows[-1] += [amount(voltage.value, volt), _range(voltage, volt)]
        return columns(rows, right=True)

    def _keys(self, unit: str) -> list[str]:
        """The lines of the keys, the one with the widest bar first."""
        rows = [["key", "5 to 95 % of it", "power, it alone", "variance share (95 %)", "with others (95 %)"]]
        for bar in self.tornado:
            own = unit_of(bar.key)
            one = self.sensitivity.get(bar.key)
            shares = ["-", "-"]
            if one is not None:
                shares = [_part(one.first, one.first_error95), _part(one.total, one.total_error95)]
            ends = " to ".join(amount(end, own) for end in bar.ends)
            rows.append([bar.key, ends, " to ".join(amount(power, unit) for power in bar.powers), *shares])
        return columns(rows)

    def _repr_html_(self) -> str:
        from harvester.presentation import html

        return html.table(f"tolerances by {self.engine}", (), self.rows(), html.warnings(self.warnings))

    def rows(self) -> list[tuple[str, str]]:
        """What a table of two columns shows of it: names, and numbers with their intervals."""
        unit = self.unit_names.power
        found = [
            (f"{share:.0%} of devices are below", f"{amount(one.value, unit)} ({_range(one, unit)})")
            for share, one in self.quantiles.items()
        ]
        for limit, one in zip(self.limits, self.met_each, strict=True):
            found.append((limit.written, _shares(one)))
        return [*found, *([] if self.met is None else [("yield, all limits", _shares(self.met))])]

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The distribution of the power, the tornado and the shares of the variance as a matplotlib figure."""
        return figures.tolerance(self, title)

    def text(self) -> str:
        """The CSV file of all samples: the keys' values, mean power, RMS voltage, and whether all limits are met."""
        units = self.unit_names
        heads = [one.key for one in self.spreads]
        heads += [named("mean_power", units.power), named("voltage_rms", units.voltage)]
        body: Sequence[Sequence[object]] = np.column_stack([self.samples, self.power, self.voltage]).tolist()
        return csv_text(heads, body)


def _range(one: Quantile, unit: str) -> str:
    """The interval in words; an end for which there are too few samples is not given."""
    if one.low is None or one.high is None:
        below = "" if one.high is None else f"below {amount(one.high, unit)}"
        return below or ("not known" if one.low is None else f"above {amount(one.low, unit)}")
    return f"{amount(one.low, unit)} to {amount(one.high, unit)}"


def _part(share: float, error95: float) -> str:
    """A share of the variance and its interval, which ends at 0 and 1."""
    return f"{share:.3f} ({max(share - error95, 0.0):.3f} to {min(share + error95, 1.0):.3f})"


def _shares(one: Interval) -> str:
    return f"{one.value:.2%} (95 %: {one.low:.2%} to {one.high:.2%})"
