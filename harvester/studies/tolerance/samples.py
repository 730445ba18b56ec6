"""The power and voltage of many devices by one engine, and how far they are from those of a more accurate engine.

An engine computes some of the samples, all with the same noise if it has any, and a polynomial
through them represents the others.  A more accurate engine computes a few of the samples again:
with the ratios r of its answers to the cheap ones, samples are multiplied by mean(r), and another
sample lies within

    off = t s sqrt(1 + 1/K) + (the more accurate engine's own bias)

of its own, relatively, with 95 % (s: standard deviation of K ratios, t: Student's quantile of K -
1).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harvester.arrays import Floats
from harvester.engines import ENGINES
from harvester.engines.protocol import Engine
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.studies.tolerance.surface import fit
from harvester.uncertainty.value import half95, one_more95

QUANTITIES = ("mean_power", "mean_square_voltage")
# whose own error can be measured, or is none
CHEAPEST_FIRST = ("exact", "averaged", "ideal", "ensemble", "slow", "compiled", "spice")
CHECKS, CHECKS_BY_NGSPICE = (8, 0.005), (4, 0.02)  # runs, and their error
SMALL = 0.2  # of the standard deviation of the powers: an error below is small against their spread


@dataclass(frozen=True)
class Samples:
    """The samples of one engine: their values, which of them have an answer, and the relative error.

    ``values`` are those of each of `QUANTITIES`, shape (n,), if ``served``; ``off`` the relative
    error at 95 % that is common to all or within which each lies, None if it is not known;
    ``checks`` state its origin; ``ratio`` is the factor of the powers.  The error of a value below
    the ``least`` of its quantity is that of this value.  ``engine_off`` is the part of the powers'
    ``off`` without that of a surface (None: all of it).
    """

    engine: str
    values: dict[str, Floats]
    served: NDArray[np.bool_]
    off: dict[str, float | None]
    checks: tuple[Diagnostic, ...]
    ratio: float = 1.0
    least: dict[str, float] = field(default_factory=dict)
    engine_off: float | None = None

    @property
    def small(self) -> bool:
        """Whether the error of the powers is known, and small against their spread."""
        off, power = self.off["mean_power"], self.values["mean_power"]
        return off is not None and off * abs(float(power.mean())) <= SMALL * float(power.std())

    @property
    def error_deviation(self) -> float:
        """The standard deviation of the engine's error among devices, in the unit of power.

        0 if not known.

        A device's relative error at 95 % counts as 1.96 of these.
        """
        off = self.off["mean_power"] if self.engine_off is None else self.engine_off
        return (off or 0.0) / float(half95(1.0)) * abs(float(self.values["mean_power"].mean()))


def cheapest(problem: Problem) -> type[Any]:
    """The kind of engine that supports a scene and costs least, whose own error can be measured or is absent."""
    for kind in (ENGINES[name] for name in CHEAPEST_FIRST):
        if kind.refusal(problem):
            continue
        try:
            if kind.is_formula:
                kind().run(problem)
        except HarvesterError:  # of a formula that has no answer here
            continue
        return kind
    raise InputError(
        f"`engine` must support the scene, but none does: {ENGINES['ensemble'].refusal(problem)}"
    )


def unjudged(engine: Any) -> Any:
    """The engine without the reference of its model's error, if it has one: for many devices."""
    return replace(engine, judged=False) if getattr(engine, "judged", False) else engine


def dearer(engine: Engine, **options: Any) -> Engine | None:
    """The engine that leaves less out of the model, or itself judged; None if absent."""
    if getattr(engine, "judged", True) is False:
        judged: Engine = replace(engine, judged=True, **options)  # type: ignore[type-var]
        return judged
    return None if engine.next_fidelity is None else engine_of(engine.next_fidelity, **options)


def checker(engine: Engine, within: float | None, seed: int) -> tuple[int, Engine] | None:
    """How many runs check an engine, and of which costlier engine.

    None if none is costlier and knows more.
    """
    kind = dearer(engine)
    if kind is None:
        return None
    asks_ngspice = kind.runs_ngspice or getattr(kind, "judged", False)
    count, target = CHECKS_BY_NGSPICE if asks_ngspice else CHECKS
    return count, engine_of(kind, within=target if within is None else within, seed=seed)


def column(table: SweepTable, name: str) -> Floats:
    """A column of all rows as numbers, in the order of the points; nan if absent."""
    return np.array(
        [math.nan if cell is None else cell for cell in table.table.plain()[name]], dtype=np.float64
    )


def stated(table: SweepTable, name: str) -> Floats | None:
    """The engine's own relative error at 95 % of each row, shape (n,).

    None if it states none for a row, or if a part of it is not known.
    """
    if any(table.table.plain()[f"{name}_unknown"]):
        return None
    value = column(table, name)
    stderr = column(table, f"{name}_stderr")
    # the same for both: V^2 over a load
    bias = column(table, "mean_power_bias") / np.abs(column(table, "mean_power"))
    if np.isnan(stderr[~np.isnan(value)] + 0.0).any() and np.isnan(bias[~np.isnan(value)]).any():
        return None
    return np.asarray(np.nan_to_num(half95(stderr) / np.abs(value)) + np.nan_to_num(bias))


def direct(engine: Engine, table: SweepTable) -> Samples:
    """The samples of an engine that computed each of them, with the error that it states itself."""
    values = {name: column(table, name) for name in QUANTITIES}
    served = ~np.isnan(values["mean_power"])
    off: dict[str, float | None] = {}
    for name in QUANTITIES:
        errors = stated(table, name)
        off[name] = None if errors is None or not served.any() else float(np.median(errors[served]))
    check = note("error_by_engine" if off["mean_power"] is not None else "no_error_stated")
    return Samples(
        engine.NAME, {name: v[served] for name, v in values.items()}, served, off, (check,)
    )


@dataclass(frozen=True)
class Ratio:
    """How a more accurate engine's answers compare: ``ratio`` and relative error ``off`` of each of `QUANTITIES`."""

    ratio: dict[str, float]
    off: dict[str, float | None]
    check: Diagnostic


def compared(
    table: SweepTable, checked: Sequence[int], dearer: SweepTable, engine: Engine, by: Engine
) -> Ratio:
    """Compare the rows ``checked`` of a table by an ``engine`` with those of a ``dearer`` table.

    Raises InputError if fewer than two of them have an answer by both.
    """
    ratio: dict[str, float] = {}
    off: dict[str, float | None] = {}
    count = 0
    for name in QUANTITIES:
        ratios = column(dearer, name) / column(table, name)[list(checked)]
        good = np.isfinite(ratios)
        ratios = ratios[good]
        count = int(good.sum())
        if count < 2:
            raise InputError(
                f"`checks` must be more: {by.NAME!r} answered at {count} of {len(checked)} samples"
            )
        bias = np.nan_to_num(
            column(dearer, "mean_power_bias") / np.abs(column(dearer, "mean_power"))
        )[good]
        ratio[name] = float(ratios.mean())
        is_known = not any(dearer.table.plain()[f"{name}_unknown"])
        off[name] = one_more95(ratios) + float(np.median(bias)) if is_known else None
    if off["mean_power"] is None:
        code = "no_error_stated"
    else:
        code = "checked_by_judged_runs" if by.NAME == engine.NAME else "checked_by_runs"
    check = note(code, runs=count, by=by.NAME, ratio=ratio["mean_power"], engine=engine.NAME)
    return Ratio(ratio, off, check)


def corrected(samples: Samples, ratio: Ratio) -> Samples:
    """Samples multiplied by the mean ratio of the more accurate engine's answers, with the error that these leave."""
    values = {name: samples.values[name] * ratio.ratio[name] for name in QUANTITIES}
    return Samples(
        samples.engine,
        values,
        samples.served,
        dict(ratio.off),
        (ratio.check,),
        ratio.ratio["mean_power"],
    )


def interpolated(computed: Samples, outer: Samples, x: Floats, many: Floats) -> Samples:
    """The samples at keys' values ``many``, (m, keys), by polynomials through those ``computed`` and the ``outer``.

    ``x`` are the keys' values of both, (n + n', keys).  Two standard deviations not predicted by a
    polynomial add to the error.
    """
    count = int(computed.served.sum())
    surfaces = {
        name: fit(x, np.append(values, outer.values[name]), count)
        for name, values in computed.values.items()
    }
    off: dict[str, float | None] = {}
    for name, surface in surfaces.items():
        known = computed.off[name]
        off[name] = (
            None
            if known is None
            else known + 2.0 * surface.scatter / abs(float(computed.values[name].mean()))
        )
    # no power is below 0
    values = {name: np.maximum(surface(many), 0.0) for name, surface in surfaces.items()}
    checks = (
        *computed.checks,
        note("polynomial_stands_for_others", runs=count, ends=len(x) - count),
    )
    return Samples(
        computed.engine,
        values,
        np.ones(len(many), dtype=bool),
        off,
        checks,
        computed.ratio,
        engine_off=computed.off["mean_power"],
    )
