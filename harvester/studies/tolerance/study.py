"""Runs of a tolerance study: which samples an engine computes, which a more accurate one, which a polynomial."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError, SimulationError
from harvester.machine.execution import Execution
from harvester.machine.progress import PartOfProgress
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.scene.keys import unit_of
from harvester.scene.scene import Scene
from harvester.studies.output_folder import OutputFolder
from harvester.studies.sweep.compute import compute_table
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.studies.tolerance import design, peaks
from harvester.studies.tolerance import samples as sampling
from harvester.studies.tolerance.curved_law import CurvedLaw
from harvester.studies.tolerance.device_limits import Limit
from harvester.studies.tolerance.spreads import PartSpread
from harvester.studies.tolerance.surface import Polynomial, fit
from harvester.uncertainty.value import amount

FORMULAS = 512  # of them that an engine of formulas computes, unless their polynomial is rough
RUNS = 24  # that an engine that samples computes, for each key and one more
SWEPT = 0.2  # of the progress, where peaks come after the sweeps
OUTSIDE = 0.005  # of the samples, that may lie beyond those computed without a warning
ROUGH = 0.05  # of the standard deviation of the powers: what a polynomial may miss
PASSIVE = ("r", "c", "l")  # kinds of parts whose values are above 0
SMALL = 1e-6  # of a key's value: above 0


@dataclass(frozen=True)
class ToleranceRequest:
    """The checked arguments of a study of tolerances.

    ``matrix`` are the correlations of the keys (None: none), ``samples`` the number of devices in
    all, ``runs`` of them that the engine computes (None: as many as needed) and ``checks`` that a
    more accurate one computes again (None: as usual), with the relative error ``within``;
    ``lifetime`` is that of limited peaks, in seconds or 1/w0.
    """

    scene: Scene
    spreads: tuple[PartSpread, ...]
    matrix: Floats | None
    limits: tuple[Limit, ...]
    lifetime: float | None
    samples: int
    runs: int | None
    checks: int | None
    within: float | None
    seed: int

    @property
    def keys(self) -> list[str]:
        """The keys that scatter."""
        return [spread.key for spread in self.spreads]

    @cached_property
    def u(self) -> Floats:
        """The places of all samples in the unit cube."""
        return design.tied(
            design.sobol_points(self.samples, len(self.spreads), self.seed), self.matrix
        )

    @property
    def outer(self) -> Floats:
        """The places of the outer ends of each spread."""
        return design.outer(len(self.spreads), self.matrix)


@dataclass(frozen=True)
class ToleranceRuns:
    """The results of one engine's runs: samples at keys' values ``x``, their surface, and the powers of the tornado.

    ``failed_share`` is the interval of the fraction of devices without an answer, if a few state
    it.
    """

    samples: sampling.Samples
    x: Floats
    surface: Polynomial | CurvedLaw
    alone: Floats
    failed: int
    warnings: tuple[Diagnostic, ...]
    peaks: dict[str, Floats]
    peaks_off: dict[str, Floats]
    failed_share: tuple[float, float] | None = None


@dataclass(frozen=True)
class ToleranceStudy:
    """The runs of a study: sweeps over lists of points, each in a folder of its own."""

    request: ToleranceRequest
    folder: OutputFolder | None
    execution: Execution

    def run(self, engine: Engine) -> ToleranceRuns:
        """Compute samples by an engine, and some of them by a more accurate one if there is one."""
        request = self.request
        total = len(request.u)
        spreads = request.spreads
        runs = min(
            request.runs or (FORMULAS if engine.is_formula else RUNS * (len(spreads) + 1)), total
        )
        check = (
            sampling.checker(engine, request.within, request.seed) if request.checks != 0 else None
        )
        n_checks = 0 if check is None else min(request.checks or check[0], runs)
        alone_to = runs + 1 + 2 * len(spreads)
        outer = request.outer if runs < total else request.outer[:0]
        x = design.values_at(
            spreads, np.vstack([request.u[:runs], design.one_by_one(len(spreads)), outer])
        )
        n_runs = len(x) + n_checks
        table = self._sweep(engine, x, engine.NAME, 0, n_runs)
        samples = sampling.direct(engine, _part(table, 0, runs))
        ends = sampling.direct(engine, _part(table, alone_to, len(x)))
        ratio: sampling.Ratio | None = None
        if check is not None:
            served = np.flatnonzero(samples.served)[:n_checks]
            dearer = self._sweep(check[1], x[served], "checks", len(x), n_runs)
            ratio = sampling.compared(table, served.tolist(), dearer, engine, check[1])
            samples, ends = sampling.corrected(samples, ratio), sampling.corrected(ends, ratio)
        alone = sampling.column(table, "mean_power")[runs:alone_to] * samples.ratio
        warnings = [*_failures(table)]
        computed = x[:runs][samples.served]
        held = np.vstack([computed, x[alone_to:][ends.served]])
        surface = fit(
            held, np.append(samples.values["mean_power"], ends.values["mean_power"]), len(computed)
        )
        rough = surface.scatter > ROUGH * samples.values["mean_power"].std()
        if rough and runs < total and engine.is_formula and request.runs is None:
            every = design.values_at(spreads, request.u)
            runs = total
            table = self._sweep(engine, every, f"{engine.NAME}-all", 0, runs)
            samples = sampling.direct(engine, table)
            samples = samples if ratio is None else sampling.corrected(samples, ratio)
            computed = every[samples.served]
            warnings = [*_failures(table)]
            surface = fit(computed, samples.values["mean_power"])
        failed = int((~samples.served).sum())
        many = computed
        inner = len(computed)
        if runs < total:
            # as many of the samples in all as of those computed
            failed = round(failed / runs * total)
            many = design.values_at(spreads, request.u[: total - failed])
            computed = held
            samples = sampling.interpolated(samples, ends, held, many)
            warnings += _outside(held, many)
        levels, levels_off = self._peaks(computed, inner, many)
        return ToleranceRuns(
            samples,
            many,
            surface,
            alone=alone,
            failed=failed,
            warnings=tuple(warnings),
            peaks=levels,
            peaks_off=levels_off,
        )

    @property
    def _swept(self) -> float:
        """The share of the progress that the sweeps are: counted trajectories need most of the time."""
        return 1.0 if self.request.lifetime is None else SWEPT

    def _peaks(
        self, x: Floats, inner: int, many: Floats
    ) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """Peaks over the lifetime at keys' values ``many``, and their relative errors, by those computed at ``x``.

        The first ``inner`` of ``x`` are samples, `peaks.devices_needed` of them are computed, the
        rest are outer ends.
        """
        request = self.request
        progress = self.execution.progress
        if request.lifetime is None:
            return {}, {}
        first = min(inner, peaks.devices_needed(Problem(request.scene), len(request.spreads)))
        x = np.vstack([x[:first], x[inner:]])
        scenes = [
            request.scene.varied(dict(zip(request.keys, map(float, row), strict=True))) for row in x
        ]

        def report(done: int) -> None:
            progress.step(self._swept + (1.0 - self._swept) * done / len(x))

        return peaks.peak_surfaces(scenes, x, first, request.lifetime, request.seed, report)(many)

    def _sweep(self, engine: Engine, x: Floats, name: str, done: int, n_runs: int) -> SweepTable:
        """Run an engine at keys' values, shape (n, keys), as a sweep in a folder ``name``."""
        part = PartOfProgress(
            self.execution.progress, self._swept * done / n_runs, self._swept * len(x) / n_runs
        )
        out = None if self.folder is None else self.folder.path / name
        points = design.points(self.request.spreads, x)
        execution = replace(self.execution, out=out, formats=(), progress=part)
        return compute_table(self.request.scene, points, [engine], execution)


def _part(table: SweepTable, begin: int, end: int) -> SweepTable:
    """Some rows of a table of one engine."""
    return replace(table, rows=table.rows[begin:end], points=table.points[begin:end])


def _outside(computed: Floats, many: Floats) -> list[Diagnostic]:
    """A warning if many samples lie beyond all that were computed, for which a polynomial has no data."""
    share = float(
        ((many < computed.min(axis=0)) | (many > computed.max(axis=0))).any(axis=1).mean()
    )
    return [warning("samples_outside", share=share)] if share > OUTSIDE * computed.shape[1] else []


def _failures(table: SweepTable) -> Iterator[Diagnostic]:
    """The failures at samples, and the first warning of the engine, with how many it concerns."""
    failed = [row.error for row in table.rows if row.error]
    warned = ["; ".join(map(str, row.warnings)) for row in table.rows if row.warnings]
    if failed:
        yield warning("samples_failed", failed=len(failed), count=len(table.rows), first=failed[0])
    if warned:
        yield warning("samples_warned", warned=len(warned), count=len(table.rows), first=warned[0])


def answer_at(
    keys: Sequence[str], values: Floats, answer: Estimate | HarvesterError, key: int | None = None
) -> Estimate:
    """The answer at keys' values.

    An error is raised with these, or one ``key``, in its sentence.
    """
    if not isinstance(answer, HarvesterError):
        return answer
    located = [
        f"{keys[k]} of {amount(float(values[k]), unit_of(keys[k]))}"
        for k in (range(len(keys)) if key is None else [key])
    ]
    kind = type(answer) if isinstance(answer, SimulationError) else InputError
    raise kind(f"at {', '.join(located)} {answer}")


def check_devices(request: ToleranceRequest, values: Floats) -> None:
    """InputError for a device that cannot be, before any is computed.

    ``values`` are the keys' values of all devices, (n, keys), the middle first.  Those with the
    least or the largest value of a key are checked, after the middle with that value alone.
    """
    middle = values[0]
    try:
        # a negative resistance of the scene itself is meant
        meant = _not_above_zero(request, middle)
    except InputError as error:
        raise InputError(f"`vary` must allow all devices, but of one {error}") from None
    extreme = np.stack([values.argmin(axis=0), values.argmax(axis=0)])
    for k, rows in enumerate(extreme.T):
        spread = request.spreads[k]

        def fault(value: float, k: int = k) -> str:
            return _fault(request, np.where(np.arange(len(middle)) == k, value, middle), meant)

        for value in map(float, values[rows, k]):
            if not (why := fault(value)):
                continue
            if not spread.key.startswith("load.parameters."):
                raise InputError(f"`vary` must allow all devices, but of one {why}")
            if value <= 0.0 < middle[k] and fault(0.0) and not fault(SMALL * middle[k]):
                raise InputError(
                    f"`vary` must keep {spread.key} above 0, but {spread.written!r} reaches "
                    f"{value:.3g}"
                )
            raise InputError(
                f"`vary` must allow all devices, but at {spread.key} of {value:.3g} {why}"
            )
    for row in extreme.ravel():
        if why := _fault(request, values[row], meant):
            raise InputError(f"`vary` must allow all devices, but of one {why}")


def _fault(request: ToleranceRequest, values: Floats, meant: Collection[str]) -> str:
    """Why a device cannot be; empty if it can."""
    try:
        below = _not_above_zero(request, values)
    except InputError as error:
        return str(error)
    texts = [
        f"{name} must be above 0, but is {below[name]:.3g}" for name in sorted(below.keys() - meant)
    ]
    return texts[0] if texts else ""


def _not_above_zero(request: ToleranceRequest, values: Floats) -> dict[str, float]:
    """The resistors, capacitors and inductors of a device whose values are not above 0, by name.

    Raises InputError for a device that cannot be.
    """
    scene = request.scene.varied(dict(zip(request.keys, map(float, values), strict=True)))
    circuit = Problem(scene).circuit
    passive = [part for part in (circuit.parts if circuit else ()) if part.kind in PASSIVE]
    known = {part.name: part.effective_value for part in passive}
    return {name: value for name, value in known.items() if value is not None and value <= 0.0}
