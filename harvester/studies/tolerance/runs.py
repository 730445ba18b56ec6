"""The runs of a study of tolerances: which samples an engine computes, which a dearer one, which a polynomial."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.machine.execution import Execution
from harvester.machine.progress import CallingBack, PartOfProgress
from harvester.studies.output_folder import OutputFolder
from harvester.studies.sweep.compute import compute_table
from harvester.studies.sweep.table import SweepTable
from harvester.studies.tolerance import design, peaks
from harvester.studies.tolerance import samples as sampled
from harvester.studies.tolerance.spreads import PartSpread
from harvester.studies.tolerance.surface import Polynomial, fit

FORMULAS = 512  # of them that an engine of formulas computes, unless their polynomial is rough
RUNS = 24  # that an engine that samples computes, for each key and one more
SWEPT = 0.2  # of the progress, where peaks come after the sweeps
OUTSIDE = 0.005  # of the samples, that may lie beyond those computed without a warning
ROUGH = 0.05  # of the standard deviation of the powers: what a polynomial may miss

Tick = Callable[[float], None]  # called with the fraction that is done


@dataclass(frozen=True)
class Found:
    """What the runs of one engine gave: samples at keys' values ``x``, their surface, and the powers of the tornado."""

    samples: sampled.Samples
    x: Floats
    surface: Polynomial
    alone: Floats
    failed: int
    warnings: tuple[str, ...]
    peaks: dict[str, Floats]
    peaks_off: dict[str, Floats]


@dataclass(frozen=True)
class Study:
    """The runs of a study: sweeps over lists of points, each in a folder of its own."""

    scene: Any
    folder: OutputFolder | None
    tick: Tick
    options: dict[str, Any]
    spreads: tuple[PartSpread, ...]
    u: Floats
    outer: Floats
    seed: int
    runs: int | None
    lifetime: float | None = None

    def run(self, engine: Engine, checks: int | None, within: float | None) -> Found:
        """Compute samples by an engine, and some of them by a dearer one where there is one."""
        runs = (FORMULAS if sampled.formulas(engine) else RUNS * (len(self.spreads) + 1)) if self.runs is None else 0
        runs = min(self.runs or runs, len(self.u))
        check = sampled.checker(engine, within, self.seed) if checks != 0 else None
        number = 0 if check is None else min(checks or check[0], runs)
        alone_to = runs + 1 + 2 * len(self.spreads)
        outer = self.outer if runs < len(self.u) else self.outer[:0]
        x = design.values_at(self.spreads, np.vstack([self.u[:runs], design.one_by_one(len(self.spreads)), outer]))
        whole = len(x) + number
        table = self._sweep(engine, x, engine.NAME, 0, whole)
        found = sampled.direct(engine, _part(table, 0, runs))
        ends = sampled.direct(engine, _part(table, alone_to, len(x)))
        ratio: sampled.Ratio | None = None
        if check is not None:
            served = np.flatnonzero(found.served)[:number]
            dearer = self._sweep(check[1], x[served], "checks", len(x), whole)
            ratio = sampled.compared(table, served.tolist(), dearer, engine, check[1])
            found, ends = sampled.corrected(found, ratio), sampled.corrected(ends, ratio)
        alone, warnings = sampled.column(table, "mean_power")[runs:alone_to] * found.ratio, _told(table)
        own = x[:runs][found.served]
        held = np.vstack([own, x[alone_to:][ends.served]])
        powers = np.append(found.values["mean_power"], ends.values["mean_power"])
        surface = fit(held, powers, len(own))
        rough = surface.scatter > ROUGH * found.values["mean_power"].std()
        if rough and runs < len(self.u) and sampled.formulas(engine) and self.runs is None:
            every, runs = design.values_at(self.spreads, self.u), len(self.u)
            table = self._sweep(engine, every, f"{engine.NAME}-all", 0, runs)
            found = sampled.direct(engine, table)
            found = found if ratio is None else sampled.corrected(found, ratio)
            own, warnings = every[found.served], _told(table)
            surface = fit(own, found.values["mean_power"])
        failed = int((~found.served).sum())
        if runs < len(self.u):
            failed = round(failed / runs * len(self.u))  # as many of the samples in all as of those computed
            many = design.values_at(self.spreads, self.u[: len(self.u) - failed])
            found, _ = sampled.interpolated(found, ends, held, many)
            warnings += _outside(held, many)
            return Found(found, many, surface, alone, failed, warnings, *self._peaks(held, len(own), many))
        return Found(found, own, surface, alone, failed, warnings, *self._peaks(own, len(own), own))

    @property
    def _swept(self) -> float:
        """The share of the progress that the sweeps are: paths that are counted take most of the time."""
        return 1.0 if self.lifetime is None else SWEPT

    @property
    def _counted(self) -> int:
        """How many devices the peaks over a lifetime are computed of, beside the outer ends."""
        return 0 if self.lifetime is None else peaks.wanted(Problem(self.scene), len(self.spreads))

    def _peaks(self, x: Floats, inner: int, many: Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """Peaks over the lifetime at keys' values ``many``, and their relative errors, by those computed at ``x``.

        The first ``inner`` of ``x`` are samples, of which `peaks.wanted` are computed, the others their outer ends.
        """
        if self.lifetime is None:
            return {}, {}
        keys, first = [one.key for one in self.spreads], min(inner, self._counted)
        x = np.vstack([x[:first], x[inner:]])
        scenes = [self.scene.varied(dict(zip(keys, map(float, row), strict=True))) for row in x]

        def told(done: int) -> None:
            self.tick(self._swept + (1.0 - self._swept) * done / len(x))

        return peaks.peak_surfaces(scenes, x, first, self.lifetime, self.seed, told)(many)

    def _sweep(self, engine: Engine, x: Floats, name: str, done: int, whole: int) -> SweepTable:
        """Run an engine at keys' values, shape (n, keys), as a sweep in a folder ``name``."""
        listening = CallingBack(lambda fraction, _: self.tick(fraction))
        part = PartOfProgress(listening, self._swept * done / whole, self._swept * len(x) / whole)
        out = None if self.folder is None else self.folder.path / name
        points = design.points(self.spreads, x)
        return compute_table(self.scene, points, [engine], Execution(out=out, progress=part, **self.options))


def _part(table: SweepTable, begin: int, end: int) -> SweepTable:
    """Some rows of a table of one engine."""
    return replace(table, rows=table.rows[begin:end], points=table.points[begin:end])


def _outside(computed: Floats, many: Floats) -> tuple[str, ...]:
    """A warning where many samples lie beyond all that were computed, where a polynomial knows nothing."""
    beyond = ((many < computed.min(axis=0)) | (many > computed.max(axis=0))).any(axis=1)
    share = float(beyond.mean())
    if share <= OUTSIDE * computed.shape[1]:
        return ()
    return (
        f"{share:.1%} of the samples lie beyond those with an answer, and count as at their edge: the outer quantiles "
        "are those of that edge; give more `runs`",
    )


def _told(table: SweepTable) -> tuple[str, ...]:
    """What went wrong at samples, and the first warning of the engine, with how many it concerns."""
    failed = [row.error for row in table.rows if row.error]
    warned = ["; ".join(map(str, row.warnings)) for row in table.rows if row.warnings]
    found = [f"{len(failed)} of {len(table.rows)} samples have no answer, the first: {failed[0]}"] if failed else []
    found += [f"at {len(warned)} of {len(table.rows)} samples: {warned[0]}"] if warned else []
    return tuple(found)
