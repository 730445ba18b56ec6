"""The answer of a study of tolerances: distribution, yield, sensitivity and tornado.

Long because distribution, yield and sensitivity are properties of one result.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from harvester.arrays import Floats
from harvester.errors import SimulationError
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, has, note, warning
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.keys import unit_of
from harvester.studies.tolerance import design
from harvester.studies.tolerance.curved_law import CurvedLaw
from harvester.studies.tolerance.device_limits import Limit
from harvester.studies.tolerance.distribution import QUANTILES, ShareInterval, quantile, share_met
from harvester.studies.tolerance.spreads import PartSpread
from harvester.studies.tolerance.study import ToleranceRequest, ToleranceRuns
from harvester.studies.tolerance.variance_shares import VarianceShares, indices
from harvester.uncertainty.value import half95

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MISSES = ("surface_misses", "law_misses")
TINY = 1e-300
UNEXPLAINED = 0.05  # of the variance: a surface that misses more brings a warning
CHECKS = (
    "error_by_engine",
    "no_error_stated",
    "checked_by_runs",
    "polynomial_stands_for_others",
    "linear_law",
    "curved_law",
    "curved_law_and_rest",
    "curved_law_at_corners",
    "curved_law_unchecked",
    "checked_by_judged_runs",
)
NO_SHARES = ("no_shares_correlated", "no_shares_library", "no_shares_constant")


@dataclass(frozen=True)
class TornadoBar:
    """A bar of the tornado: the mean power with one key at the 5 % and 95 % points of its spread, all others at half.

    ``ends`` are these two values of the key, ``powers`` the powers there.  ``quantiles`` are the
    powers that 5 % and 95 % of devices are below if this key alone scatters, by the surface through
    the samples: a key whose best value lies between its ends moves the power by more than the
    powers at its ends show.
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
    engine : str
        the name of the engine that computed it.
    samples : ndarray
        the keys' values in SI units, shape (n, keys).
    power, voltage : ndarray
        the engine's values there, shape (n,) (W, V).
    off : float or None
        the relative error of each power at 95 %; None if it is not known.
    quantiles, voltages : dict
        the power, and the RMS voltage, that a fraction of devices is below.
    limits, met, met_each : tuple of Limit or ShareInterval or None or tuple of ShareInterval
        the limits, and the fraction of devices that meets all, and each alone, with its interval;
        None without a limit.
    peaks_off : dict
        the relative error at 95 % of each limited peak, in the median.
    sensitivity : dict
        of each key its fraction of the variance, ``first`` alone and ``total`` with others; empty
        if absent.
    unexplained : float
        the fraction of the variance that the polynomial does not explain.
    failed : int
        how many devices have no answer.
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    seconds : float
        the time of computing, without compilation (s).
    error_deviation : float or None
        the standard deviation of the engine's error among devices (W); None if it is not known.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> result = hv.tolerance(scene, vary={"nondimensional.mu": "5%", "nondimensional.c1": "20%"}, samples=256)
    >>> result.engine, max(result.sensitivity, key=lambda key: result.sensitivity[key].total)
    ('exact', 'nondimensional.c1')
    """

    DERIVED = (
        *("mean", "standard_deviation", "standard_deviation_error95"),
        *("error_from", "no_sensitivity", "sample_count"),
        *("distribution", "limit_table", "key_table"),
    )
    INTERNAL = frozenset(
        {
            "spreads",
            "samples",
            "power",
            "voltage",
            "quantiles",
            "voltages",
            "limits",
            "met_each",
            "tornado",
        }
        | {"nominal", "peaks_off", "error_deviation"}
    )
    NOT_SHOWN = frozenset(
        {"met", "sensitivity", "unexplained", "failed", "mean", "error_from", "no_sensitivity"}
    )
    NOT_IN_JSON = frozenset({"distribution", "limit_table", "key_table"})
    JSON_NAMES: ClassVar[dict[str, str]] = {
        "off": "relative_error95",
        "met": "yield",
        "unexplained": "surface_unexplained",
        "sample_count": "samples",
    }
    SHORT = ("engine", "mean", "standard_deviation", "sample_count")

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
    error_deviation: float | None = None

    @classmethod
    def of(
        cls, request: ToleranceRequest, runs: ToleranceRuns, seconds: float
    ) -> "ToleranceResult":
        """The answer that the runs of a study give.

        SimulationError if fewer than two samples have one.
        """
        samples = runs.samples
        if len(samples.values["mean_power"]) < 2:
            raise SimulationError("fewer than two samples have an answer")
        values = (
            samples.values
            | {"voltage_rms": np.sqrt(samples.values["mean_square_voltage"])}
            | runs.peaks
        )
        errors = _errors(runs)
        power = values["mean_power"]
        voltage = values["voltage_rms"]
        failed = runs.failed
        shares, without = _shares(request, runs)
        remarks = [*runs.warnings, *_warnings(runs), *samples.checks, *without]
        nominal = float(runs.alone[0])

        def met(limits: Sequence[Limit]) -> ShareInterval:
            return share_met(limits, values, errors, failed, runs.failed_share)

        return cls(
            engine=samples.engine,
            spreads=request.spreads,
            samples=runs.x,
            power=power,
            voltage=voltage,
            off=samples.off["mean_power"],
            quantiles={share: quantile(power, share, errors["mean_power"]) for share in QUANTILES},
            voltages={
                share: quantile(voltage, share, errors["voltage_rms"]) for share in QUANTILES
            },
            limits=request.limits,
            met=met(request.limits) if request.limits else None,
            met_each=tuple(met([limit]) for limit in request.limits),
            sensitivity=shares,
            tornado=_bars(request, runs),
            nominal=nominal if np.isfinite(nominal) else None,
            unexplained=runs.surface.unexplained,
            failed=failed,
            physical=request.scene.physical,
            seconds=seconds,
            diagnostics=tuple(dict.fromkeys(remarks)),
            peaks_off={name: float(np.median(errors)) for name, errors in runs.peaks_off.items()},
            error_deviation=None if samples.off["mean_power"] is None else samples.error_deviation,
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
    def standard_deviation_error95(self) -> float | None:
        """The error of the standard deviation s at 95 % (W).

        None if the engine's error is not known.

        The sum of the engine's part, which is at most the standard deviation of its error, of the
        sampling error 1.96 sqrt((m4 - s^4)/(4 n s^2)) of n devices with the fourth central moment
        m4, and of s u/2 for the fraction u of the variance that the polynomial does not explain.
        """
        deviation = self.standard_deviation
        if self.error_deviation is None or not deviation > 0.0:
            return self.error_deviation
        fourth = float(((self.power - self.mean) ** 4).mean())
        sampling = math.sqrt((fourth / deviation**2 - deviation**2) / (4.0 * len(self.power)))
        return float(self.error_deviation + half95(sampling) + 0.5 * self.unexplained * deviation)

    @property
    def check(self) -> str:
        """The origin of the error of a sample's power."""
        return "; ".join(
            str(diagnostic) for diagnostic in self.diagnostics if diagnostic.code in CHECKS
        )

    error_from = check

    @property
    def why(self) -> str:
        """The reason for the lack of a sensitivity; empty if there is."""
        return "; ".join(
            str(diagnostic) for diagnostic in self.diagnostics if diagnostic.code in NO_SHARES
        )

    no_sensitivity = why

    @property
    def sample_count(self) -> int:
        """The number of devices, those without an answer as well."""
        return len(self.power) + self.failed

    @property
    def distribution(self) -> Table:
        """The quantiles of power and voltage with their intervals."""
        units = self.unit_names
        shares = [100.0 * share for share in self.quantiles]
        columns = [Column("below", shares, "%", "devices below")]
        columns += _interval("mean_power", [*self.quantiles.values()], units.power)
        columns += _interval("voltage_rms", [*self.voltages.values()], units.voltage)
        return Table(tuple(columns), "distribution")

    @property
    def limit_table(self) -> Table | None:
        """The fraction of devices that meets each limit, and all of them; None without limits."""
        if self.met is None:
            return None
        names = [*(limit.written for limit in self.limits), "all limits"]
        columns = [
            Column("limit", names),
            *_interval("yield", [*self.met_each, self.met], "%", 100.0),
        ]
        if self.peaks_off:
            known = [self.peaks_off.get(limit.quantity) for limit in self.limits]
            levels = [None if error is None else 100.0 * error for error in known]
            columns.append(
                Column("level_error95", [*levels, None], "%", "error of a device's level, 95 %")
            )
        return Table(tuple(columns), "fraction of the devices within a limit")

    @property
    def key_table(self) -> Table:
        """The keys, the one with the widest bar first, and their fractions of the variance."""
        bars = self.tornado
        units = [unit_of(bar.key) for bar in self.tornado]
        columns = [Column("key", [bar.key for bar in bars])]
        for k, share in enumerate((5, 95)):
            columns.append(
                Column(
                    f"value_{share}", [bar.ends[k] for bar in bars], "", f"{share} % point", units
                )
            )
            powers = [bar.powers[k] for bar in bars]
            columns.append(Column(f"power_{share}", powers, self.unit_names.power, "power there"))
        names = ("first", "first_error95", "total", "total_error95") if self.sensitivity else ()
        shares = [self.sensitivity.get(bar.key) for bar in bars]
        columns += [Column(name, [getattr(s, name, None) for s in shares]) for name in names]
        return Table(tuple(columns), "each key alone, and its fraction of the variance")

    @property
    def table(self) -> Table:
        """All samples: the keys' values, mean power and RMS voltage."""
        units = self.unit_names
        columns = [
            Column(spread.key, self.samples[:, k], unit_of(spread.key))
            for k, spread in enumerate(self.spreads)
        ]
        columns += [
            Column("mean_power", self.power, units.power),
            Column("voltage_rms", self.voltage, units.voltage),
        ]
        return Table(tuple(columns), "samples")

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: its fields, with the quantiles, limits and bars by their names."""
        data = super().as_json()
        for name, intervals in (("quantile", self.quantiles), ("voltage_quantile", self.voltages)):
            data[f"{name}s"] = {
                f"{share:g}": interval.value for share, interval in intervals.items()
            }
            data[f"{name}_intervals"] = {
                f"{share:g}": [i.low, i.high] for share, i in intervals.items()
            }
        data["limits"] = [
            {"limit": limit.written, "peak_relative_error95": self.peaks_off.get(limit.quantity)}
            | vars(interval)
            for limit, interval in zip(self.limits, self.met_each, strict=True)
        ]
        bars = {
            b.key: {"ends": b.ends, "mean_power": b.powers, "quantiles": b.quantiles}
            for b in self.tornado
        }
        return data | {"tornado": bars}

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The distribution of the power, the tornado and the fractions of the variance as a matplotlib figure."""
        return drawing.draw(self, title, ax)


def _interval(
    name: str, intervals: list[ShareInterval], unit: str, times: float = 1.0
) -> list[Column]:
    """Columns of numbers and of the ends of their intervals."""

    def cells(part: str) -> list[float | None]:
        values = [getattr(interval, part) for interval in intervals]
        return [None if value is None else times * value for value in values]

    ends = [
        Column(f"{name}_{part}95", cells(part), unit, label)
        for part, label in (("low", "from"), ("high", "to"))
    ]
    return [Column(name, cells("value"), unit), *ends]


def _errors(runs: ToleranceRuns) -> dict[str, Floats]:
    """The errors of all quantities of each device at 95 %, in their unit; 0 if not known."""
    samples = runs.samples
    errors = {
        name: (samples.off[name] or 0.0) * np.maximum(values, samples.least.get(name, 0.0))
        for name, values in samples.values.items()
    }
    square = samples.values["mean_square_voltage"]
    lower = np.sqrt(np.maximum(square - errors["mean_square_voltage"], 0.0))
    peaks = {name: off * runs.peaks[name] for name, off in runs.peaks_off.items()}
    # of an error far above the square itself the upper side is the larger one
    upper = np.sqrt(square + errors["mean_square_voltage"])
    voltage = np.maximum(upper - np.sqrt(square), np.sqrt(square) - lower)
    return errors | {"voltage_rms": voltage} | peaks


def _warnings(runs: ToleranceRuns) -> list[Diagnostic]:
    """The results that the errors of the engine and of the surface make doubtful."""
    samples = runs.samples
    missed = runs.surface.unexplained
    warnings = []
    if samples.off["mean_power"] is None:
        warnings.append(warning("intervals_of_samples_alone"))
    elif not samples.small and np.ptp(samples.values["mean_power"]) > 0.0:
        warnings.append(warning("intervals_are_wide", engine=samples.engine))
    # a law that nothing checked states that in its note
    if missed > UNEXPLAINED and not has(samples.checks, "curved_law_unchecked"):
        by_law = isinstance(runs.surface, CurvedLaw)
        warnings.append(warning("law_misses" if by_law else "surface_misses", share=missed))
    return warnings


def _bars(request: ToleranceRequest, runs: ToleranceRuns) -> tuple[TornadoBar, ...]:
    """The bars of the keys whose ends have an answer, the widest first."""
    ends = design.values_at(request.spreads, design.one_by_one(len(request.spreads)))
    alone = runs.alone
    bars = []
    for k, spread in enumerate(request.spreads):
        low, high = 1 + 2 * k, 2 + 2 * k
        if np.isfinite(alone[[low, high]]).all():
            powers = float(alone[low]), float(alone[high])
            scattered = runs.surface(
                design.values_at(request.spreads, design.one_alone(k, len(request.spreads)))
            )
            least, most = np.quantile(scattered, (design.LOW, design.HIGH))
            values = float(ends[low, k]), float(ends[high, k])
            bars.append(TornadoBar(spread.key, values, powers, (float(least), float(most))))
    return tuple(sorted(bars, key=lambda bar: -bar.swing))


def _shares(
    request: ToleranceRequest, runs: ToleranceRuns
) -> tuple[dict[str, VarianceShares], list[Diagnostic]]:
    """The fractions of the variance, or why there are none."""
    if request.matrix is not None:
        return {}, [note("no_shares_correlated")]
    try:
        ratio = runs.samples.error_deviation / max(
            float(runs.samples.values["mean_power"].std()), TINY
        )
        shares = indices(
            runs.surface, request.spreads, runs.surface.unexplained, request.seed, ratio
        )
    except ImportError:
        return {}, [note("no_shares_library")]
    return shares, [] if shares else [note("no_shares_constant")]
