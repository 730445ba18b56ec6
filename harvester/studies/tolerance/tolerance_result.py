"""The answer of a study of tolerances: distribution, yield, sensitivity and tornado.

Long because distribution, yield and sensitivity are properties of one result.
"""

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.keys import unit_of
from harvester.studies.tolerance import design
from harvester.studies.tolerance.device_limits import Limit
from harvester.studies.tolerance.distribution import QUANTILES, ShareInterval, quantile, share_met
from harvester.studies.tolerance.spreads import PartSpread
from harvester.studies.tolerance.study import Found, ToleranceRequest
from harvester.studies.tolerance.variance_shares import VarianceShares, indices

UNEXPLAINED = 0.05  # of the variance: a surface that misses more brings a warning
CHECKS = ("error_by_engine", "no_error_stated", "checked_by_runs", "polynomial_stands_for_others", "linear_law")
NO_SHARES = ("no_shares_correlated", "no_shares_library", "no_shares_constant")


@dataclass(frozen=True)
class TornadoBar:
    """A bar of the tornado: the mean power with one key at the 5 % and 95 % points of its spread, all others at half.

    ``ends`` are these two values of the key, ``powers`` the powers there.  ``quantiles`` are the powers that 5 % and
    95 % of devices are below where this key alone scatters, by the surface through the samples: a key whose best value
    lies between its ends moves the power by more than the powers at its ends tell.
    """

    key: str
    ends: tuple[float, float]
    powers: tuple[float, float]
    quantiles: tuple[float, float]

    @property
    def swing(self) -> float:
        """The size of the change of the power."""
        return self.quantiles[1] - self.quantiles[0]


class ToleranceResult(TableResult):
    """How mean power and RMS voltage scatter over devices whose parts have tolerances.

    Attributes
    ----------
    engine
        the name of the engine that computed it.
    samples
        the keys' values in SI units, shape (n, keys).
    power, voltage
        what the engine finds there, shape (n,) (W, V).
    off
        the relative error of each power at 95 %; None where it is not known.
    quantiles, voltages
        the power, and the RMS voltage, that a share of devices is below.
    limits, met, met_each
        the limits, and the share of devices that meets all, and each alone, with its interval; None without a limit.
    peaks_off
        the relative error at 95 % of each limited peak, in the median.
    sensitivity
        of each key its share of the variance, ``first`` alone and ``total`` with others; empty where there is none.
    unexplained
        the share of the variance that the polynomial does not explain.
    failed
        how many devices have no answer.
    physical
        whether its numbers are in SI units, rather than nondimensional.
    seconds
        the time of computing, without compilation (s).
    diagnostics
        warnings and notes, each with a code, numbers and a sentence (``str``).

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> found = hv.tolerance(scene, vary={"nondimensional.mu": "5%", "nondimensional.c1": "20%"}, samples=256)
    >>> found.engine, max(found.sensitivity, key=lambda key: found.sensitivity[key].total)
    ('exact', 'nondimensional.c1')
    """

    DERIVED: ClassVar[tuple[str, ...]] = (
        *("mean", "standard_deviation", "error_from", "no_sensitivity", "sample_count"),
        *("distribution", "limit_table", "key_table"),
    )
    INTERNAL: ClassVar[frozenset[str]] = frozenset(
        {"spreads", "samples", "power", "voltage", "quantiles", "voltages", "limits", "met_each", "tornado"}
        | {"nominal", "peaks_off"}
    )
    NOT_SHOWN: ClassVar[frozenset[str]] = frozenset(
        {"met", "sensitivity", "unexplained", "failed", "mean", "standard_deviation", "error_from", "no_sensitivity"}
    )
    NOT_IN_JSON: ClassVar[frozenset[str]] = frozenset({"distribution", "limit_table", "key_table"})
    JSON_NAMES: ClassVar[dict[str, str]] = {
        "off": "relative_error95",
        "met": "yield",
        "unexplained": "surface_unexplained",
        "sample_count": "samples",
    }
    SHORT: ClassVar[tuple[str, ...]] = ("engine", "mean", "standard_deviation", "sample_count")

    engine: str
    spreads: tuple[PartSpread, ...]
    samples: Floats
    power: Floats
    voltage: Floats
    off: float | None
    quantiles: dict[float, ShareInterval]
    voltages: dict[float, ShareInterval]
    limits: tuple[Limit, ...]
    met: ShareInterval | None
    met_each: tuple[ShareInterval, ...]
    sensitivity: dict[str, VarianceShares]
    tornado: tuple[TornadoBar, ...]
    nominal: float | None
    unexplained: float
    failed: int
    physical: bool
    seconds: float
    diagnostics: tuple[Diagnostic, ...] = ()
    peaks_off: dict[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, asked: ToleranceRequest, found: Found, seconds: float) -> "ToleranceResult":
        """The answer that the runs of a study give; SimulationError where fewer than two samples have one."""
        some = found.samples
        if len(some.values["mean_power"]) < 2:
            raise SimulationError("fewer than two samples have an answer")
        values = some.values | {"voltage_rms": np.sqrt(some.values["mean_square_voltage"])} | found.peaks
        off: dict[str, Any] = {name: value or 0.0 for name, value in some.off.items()} | found.peaks_off
        off["voltage_rms"] = 0.5 * off["mean_square_voltage"]
        power, voltage, failed = values["mean_power"], values["voltage_rms"], found.failed
        shares, without = _shares(asked, found)
        remarks = [*found.warnings, *_doubts(found), *some.checks, *without]
        nominal = float(found.alone[0])
        return cls(
            engine=some.engine,
            spreads=asked.spreads,
            samples=found.x,
            power=power,
            voltage=voltage,
            off=some.off["mean_power"],
            quantiles={share: quantile(power, share, off["mean_power"]) for share in QUANTILES},
            voltages={share: quantile(voltage, share, off["voltage_rms"]) for share in QUANTILES},
            limits=asked.limits,
            met=share_met(asked.limits, values, off, failed) if asked.limits else None,
            met_each=tuple(share_met([one], values, off, failed) for one in asked.limits),
            sensitivity=shares,
            tornado=_bars(asked, found),
            nominal=nominal if np.isfinite(nominal) else None,
            unexplained=found.surface.unexplained,
            failed=failed,
            physical=asked.scene.physical,
            seconds=seconds,
            diagnostics=tuple(dict.fromkeys(remarks)),
            peaks_off={name: float(np.median(one)) for name, one in found.peaks_off.items()},
        )

    @property
    def unit(self) -> str:
        """The unit of the powers."""
        return self.unit_names.power

    @property
    def mean(self) -> float:
        """The mean of the powers."""
        return float(self.power.mean())

    @property
    def standard_deviation(self) -> float:
        """The standard deviation of the powers."""
        return float(self.power.std())

    @property
    def check(self) -> str:
        """Where the error of a sample's power is from."""
        return "; ".join(str(one) for one in self.diagnostics if one.code in CHECKS)

    error_from = check

    @property
    def why(self) -> str:
        """Why there is no sensitivity; empty where there is."""
        return "; ".join(str(one) for one in self.diagnostics if one.code in NO_SHARES)

    no_sensitivity = why

    @property
    def sample_count(self) -> int:
        """The number of devices, those without an answer too."""
        return len(self.power) + self.failed

    @property
    def distribution(self) -> Table:
        """The quantiles of power and voltage with their intervals."""
        of, shares = self.unit_names, [100.0 * share for share in self.quantiles]
        columns = [Column("below", shares, "%", "devices below")]
        columns += _interval("mean_power", [*self.quantiles.values()], of.power)
        columns += _interval("voltage_rms", [*self.voltages.values()], of.voltage)
        return Table(tuple(columns), "distribution")

    @property
    def limit_table(self) -> Table | None:
        """The share of devices that meets each limit, and all of them; None without limits."""
        if self.met is None:
            return None
        names = [*(one.written for one in self.limits), "all limits"]
        columns = [Column("limit", names), *_interval("yield", [*self.met_each, self.met], "%", 100.0)]
        if self.peaks_off:
            known = [self.peaks_off.get(one.quantity) for one in self.limits]
            levels = [None if one is None else 100.0 * one for one in known]
            columns.append(Column("level_error95", [*levels, None], "%", "error of a device's level, 95 %"))
        return Table(tuple(columns), "share of the devices within a limit")

    @property
    def key_table(self) -> Table:
        """The keys, the one with the widest bar first, and their shares of the variance."""
        bars, units = self.tornado, [unit_of(bar.key) for bar in self.tornado]
        columns = [Column("key", [bar.key for bar in bars])]
        for k, share in enumerate((5, 95)):
            columns.append(Column(f"value_{share}", [bar.ends[k] for bar in bars], "", f"{share} % point", units))
            powers = [bar.powers[k] for bar in bars]
            columns.append(Column(f"power_{share}", powers, self.unit_names.power, "power there"))
        names = ("first", "first_error95", "total", "total_error95") if self.sensitivity else ()
        shares = [self.sensitivity.get(bar.key) for bar in bars]
        columns += [Column(name, [getattr(one, name, None) for one in shares]) for name in names]
        return Table(tuple(columns), "each key alone, and its share of the variance")

    @property
    def table(self) -> Table:
        """All samples: the keys' values, mean power and RMS voltage."""
        of = self.unit_names
        columns = [Column(one.key, self.samples[:, k]) for k, one in enumerate(self.spreads)]
        columns += [Column("mean_power", self.power, of.power), Column("voltage_rms", self.voltage, of.voltage)]
        return Table(tuple(columns), "samples")

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: its fields, with the quantiles, limits and bars by their names."""
        found = super().as_json()
        for name, some in (("quantile", self.quantiles), ("voltage_quantile", self.voltages)):
            found[f"{name}s"] = {f"{share:g}": one.value for share, one in some.items()}
            found[f"{name}_intervals"] = {f"{share:g}": [one.low, one.high] for share, one in some.items()}
        found["limits"] = [
            {"limit": limit.written, "peak_relative_error95": self.peaks_off.get(limit.quantity)} | vars(one)
            for limit, one in zip(self.limits, self.met_each, strict=True)
        ]
        return found | {
            "tornado": {
                bar.key: {"ends": bar.ends, "mean_power": bar.powers, "quantiles": bar.quantiles}
                for bar in self.tornado
            }
        }

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The distribution of the power, the tornado and the shares of the variance as a matplotlib figure."""
        return figures.tolerance(self, title)


def _interval(name: str, some: list[ShareInterval], unit: str, times: float = 1.0) -> list[Column]:
    """Columns of numbers and of the ends of their intervals."""

    def cells(part: str) -> list[float | None]:
        found = [getattr(one, part) for one in some]
        return [None if value is None else times * value for value in found]

    ends = [Column(f"{name}_{part}95", cells(part), unit, label) for part, label in (("low", "from"), ("high", "to"))]
    return [Column(name, cells("value"), unit), *ends]


def _doubts(found: Found) -> list[Diagnostic]:
    """What the errors of the engine and of the surface make doubtful."""
    some, missed = found.samples, found.surface.unexplained
    doubts = []
    if some.off["mean_power"] is None:
        doubts.append(warning("intervals_of_samples_alone"))
    elif not some.small and np.ptp(some.values["mean_power"]) > 0.0:
        doubts.append(warning("intervals_are_wide", engine=some.engine))
    return doubts + ([warning("surface_misses", share=missed)] if missed > UNEXPLAINED else [])


def _bars(asked: ToleranceRequest, found: Found) -> tuple[TornadoBar, ...]:
    """The bars of the keys whose ends have an answer, the widest first."""
    ends, alone = design.values_at(asked.spreads, design.one_by_one(len(asked.spreads))), found.alone
    bars = []
    for k, one in enumerate(asked.spreads):
        low, high = 1 + 2 * k, 2 + 2 * k
        if np.isfinite(alone[[low, high]]).all():
            powers = float(alone[low]), float(alone[high])
            along = found.surface(design.values_at(asked.spreads, design.one_alone(k, len(asked.spreads))))
            least, most = np.quantile(along, (design.LOW, design.HIGH))
            bars.append(
                TornadoBar(one.key, (float(ends[low, k]), float(ends[high, k])), powers, (float(least), float(most)))
            )
    return tuple(sorted(bars, key=lambda bar: -bar.swing))


def _shares(asked: ToleranceRequest, found: Found) -> tuple[dict[str, VarianceShares], list[Diagnostic]]:
    """The shares of the variance, or why there are none."""
    if asked.matrix is not None:
        return {}, [note("no_shares_correlated")]
    try:
        shares = indices(found.surface, asked.spreads, found.surface.unexplained, asked.seed)
    except ImportError:
        return {}, [note("no_shares_library")]
    return shares, [] if shares else [note("no_shares_constant")]
