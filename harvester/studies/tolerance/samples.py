"""The power and voltage of many devices by one engine, and how far they are from those of a dearer engine.

An engine computes some of the samples, all with the same noise if it has any, and a polynomial
through them represents the others.  A dearer engine computes a few of the samples again: with the
ratios of its answers to the cheap ones, samples are multiplied by these (`ratio`).
"""

import math
from dataclasses import dataclass
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
from harvester.studies.tolerance.ratio import Ratio, column
from harvester.studies.tolerance.surface import fit
from harvester.uncertainty.value import half95

QUANTITIES = ("mean_power", "mean_square_voltage")
# whose own error can be measured, or is none
CHEAPEST_FIRST = ("exact", "averaged", "ideal", "ensemble", "spice")
CHECKS, CHECKS_BY_NGSPICE = (8, 0.005), (4, 0.02)  # runs, and their error
SMALL = 0.5  # of the standard deviation of the powers: an error below is small against their spread


@dataclass(frozen=True)
class Samples:
    """The samples of one engine: their values, which of them have an answer, and the relative error.

    ``values`` are those of each of `QUANTITIES`, shape (n,), if ``served``; ``off`` the relative
    error at 95 % that is common to all or within which each lies, None if it is not known;
    ``checks`` state its origin.  ``scatter`` is the relative standard deviation of the error from
    sample to sample, and ``trend`` the share of its variance that may vary along the keys.
    """

    engine: str
    values: dict[str, Floats]
    served: NDArray[np.bool_]
    off: dict[str, float | None]
    checks: tuple[Diagnostic, ...]
    scatter: float = 0.0
    trend: float = 1.0

    @property
    def share_error(self) -> float:
        """The possible change by the engine's error in a share of the variance of the powers.

        With q, its standard deviation over theirs, it is q^2, and 2 q sqrt(trend) if it
        follows the powers.
        """
        power = self.values["mean_power"]
        spread = float(power.std())
        if spread == 0.0:
            return 0.0
        q = self.scatter * abs(float(power.mean())) / spread
        return min(2.0 * q * math.sqrt(self.trend) + q * q, 1.0)

    @property
    def small(self) -> bool:
        """Whether the error of the powers is known, and small against their spread."""
        off, power = self.off["mean_power"], self.values["mean_power"]
        return off is not None and off * abs(float(power.mean())) <= SMALL * float(power.std())


def cheapest(problem: Problem) -> type[Any]:
    """The kind of engine that supports a scene and costs least, whose own error can be measured or is absent."""
    for kind in (ENGINES[name] for name in CHEAPEST_FIRST):
        if kind.refusal(problem) or (kind.needs_netlist and problem.netlist is None):
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


def dearer(engine: Engine, **options: Any) -> Engine | None:
    """The engine that leaves less out of the model, with its options; None if absent."""
    return None if engine.next_fidelity is None else engine_of(engine.next_fidelity, **options)


def checker(engine: Engine, within: float | None, seed: int) -> tuple[int, Engine] | None:
    """How many runs check an engine, and of which dearer engine; None if none is dearer and knows more."""
    kind = dearer(engine)
    if kind is None:
        return None
    count, target = CHECKS_BY_NGSPICE if kind.runs_ngspice else CHECKS
    return count, engine_of(kind, within=target if within is None else within, seed=seed)


def stated(table: SweepTable, name: str) -> Floats | None:
    """The engine's own relative error at 95 % of each row, shape (n,); None if it states none for a row."""
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
    # that of common noise is the same in all samples
    scatter = 0.0 if engine.samples else (off["mean_power"] or 0.0) / half95(1.0)
    answered = {name: v[served] for name, v in values.items()}
    return Samples(engine.NAME, answered, served, off, (check,), scatter)


def corrected(samples: Samples, ratio: Ratio, x: Floats) -> Samples:
    """The samples at keys' values ``x``, (n, keys), multiplied by the ratios there, with the error that these leave."""
    values = {name: samples.values[name] * ratio.planes[name](x) for name in QUANTITIES}
    off: dict[str, float | None] = dict(ratio.off)
    power = ratio.planes["mean_power"]
    return Samples(
        samples.engine,
        values,
        samples.served,
        off,
        (ratio.check,),
        scatter=power.scatter,
        trend=power.share,
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
        scatter=computed.scatter,
        trend=computed.trend,
    )
