"""Every engine that can handle a scene, side by side, and one trajectory: ngspice, exact update, decoupled V.

Long because the comparison of engines and that of paths share their scene and their page.
"""

import contextlib
import dataclasses
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines import Published, Spice
from harvester.engines.options import Request, number
from harvester.engines.protocol import AnyScene, Engine
from harvester.engines.selection import ENGINES, EngineOptions, Named, refusals
from harvester.engines.selection import engines as engines_of
from harvester.engines.spice.setup import READING, set_up
from harvester.equations.problem import Problem
from harvester.errors import (
    CannotServeError,
    HarvesterError,
    MissingProgramError,
    SimulationError,
    UnboundedResponseError,
)
from harvester.machine.execution import DEFAULT, Execution, working_on
from harvester.machine.progress import PartOfProgress
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.presentation.plain import plain
from harvester.presentation.result import Result, TableResult
from harvester.presentation.table import Column, Table
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.uncertainty.value import z_score

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PATHS = 0.1  # of the time that an engine of share 1 takes: the paths that are drawn
PATH_DURATION = 100.0  # nondimensional time of the path that is drawn


class PathComparison(Result):
    """V on one noise path from three sources, in the scene's units (`unit_names`), arrays of shape (n,).

    ``spice`` from ngspice, ``exact`` from the exact RC update, ``decoupled`` from the x and x' of
    the ngspice path by V = (w^2 x + mu x')/(mu^2 + w^2) (paper, Eq. 6), w^2 at the amplitude
    of the moment.  Their errors are relative differences in the RMS.
    """

    INTERNAL = frozenset({"t", "x", "spice", "exact", "decoupled"})
    DERIVED = ("spice_rms_error", "decoupled_rms_error")
    JSON_NAMES: ClassVar[dict[str, str]] = {"title": "scene"}
    SHORT = ("title", *DERIVED)

    title: str
    t: Floats
    x: Floats
    spice: Floats
    exact: Floats
    decoupled: Floats
    physical: bool = False

    @property
    def spice_rms_error(self) -> float:
        """The relative RMS difference of ngspice and the exact update."""
        return _relative_rms(self.spice, self.exact)

    @property
    def decoupled_rms_error(self) -> float:
        """The relative RMS error of the decoupled V against ngspice."""
        return _relative_rms(self.decoupled, self.spice)


class Comparison(TableResult):
    """The answers of all engines, or why there is none, and trajectories with and without the stop.

    Attributes
    ----------
    estimates : tuple of Estimate
        an `Estimate` of each engine that supports the scene.
    refused : dict
        the other engines by name, with the reason.
    paths : tuple of PathComparison
        trajectories of the voltage by three ways, if these have a meaning.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, D11=0.01))
    >>> comparison = hv.compare(scene, trajectories=64, duration=20.0)
    >>> comparison.z(comparison.reference) is None, comparison.ratio(comparison.reference)
    (True, 1.0)
    """

    DERIVED = ("answers", "table", "reference_engine", "engines")
    INTERNAL = frozenset({"estimates"})
    NOT_SHOWN = frozenset({"refused", "reference_engine", "engines"})
    NOT_IN_JSON = frozenset({"answers", "table"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"reference_engine": "reference"}
    SHORT = ("reference_engine", "estimates", "refused")

    estimates: tuple[Estimate, ...]
    refused: dict[str, str]
    paths: tuple[PathComparison, ...]

    @property
    def reference(self) -> Estimate:
        """The estimate to compare with: a closed form, or that of the least standard error without a model."""
        closed = [estimate for estimate in self.estimates if ENGINES[estimate.engine].is_exact]
        finest = [
            estimate
            for estimate in self.estimates
            if ENGINES[estimate.engine].next_fidelity is None
        ]
        with_stderr = [estimate for estimate in finest if estimate.mean_power.stderr is not None]
        return min(
            closed or with_stderr or self.estimates, key=lambda e: e.mean_power.stderr or 0.0
        )

    @property
    def physical(self) -> bool:
        """Whether its numbers have SI units."""
        return self.reference.physical

    @property
    def reference_engine(self) -> str:
        """The engine of the reference."""
        return self.reference.engine

    def z(self, estimate: Estimate) -> float | None:
        """The z-score of an estimate's power against the reference; None for the reference itself."""
        if estimate is self.reference:
            return None
        return z_score(estimate.mean_power, self.reference.mean_power)

    def ratio(self, estimate: Estimate) -> float | None:
        """The power of an estimate over that of the reference."""
        reference = self.reference.mean_power.value
        return estimate.mean_power.value / reference if reference else None

    @property
    def answers(self) -> dict[str, Estimate]:
        """The estimates by their engines."""
        return {estimate.engine: estimate for estimate in self.estimates}

    @property
    def engines(self) -> list[dict[str, Any]]:
        """The estimates as data, each with its ratio and its z-score."""
        return [
            {**plain(answer), "ratio": self.ratio(answer), "z": self.z(answer)}
            for answer in self.estimates
        ]

    @property
    def table(self) -> Table:
        """A row for each engine: its power, how far that is from the reference's, and its cost."""
        ratios = [self.ratio(estimate) for estimate in self.estimates]
        columns = (
            Column("engine", [estimate.engine for estimate in self.estimates]),
            Column(
                "mean_power",
                [estimate.mean_power for estimate in self.estimates],
                self.unit_names.power,
            ),
            Column(
                "difference",
                [None if ratio is None else 100.0 * (ratio - 1.0) for ratio in ratios],
                "%",
            ),
            Column("z", [self.z(estimate) for estimate in self.estimates]),
            Column("seconds", [estimate.seconds for estimate in self.estimates], "s"),
        )
        return Table(columns, f"against {self.reference_engine}")

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Why engines did not run."""
        return tuple(note("did_not_run", engine, why=why) for engine, why in self.refused.items())

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The engines, and the trajectories, as a matplotlib figure."""
        return drawing.draw(self, title, ax)


def compare(
    scene: AnyScene,
    *,
    engines: Sequence[Named] | None = None,
    execution: Execution = DEFAULT,
    **options: Unpack[EngineOptions],
) -> Comparison:
    """Run every engine on a scene, and compare one trajectory with and without its stop.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    engines : list of Engine or str, optional
        engines or their names, in place of all.
    execution : Execution, optional
        has the folder for compare.csv, compare.png and provenance.json; ``out``, ``formats`` and
        ``progress`` alone.
    options
        of the engines, as of `run`: ``within``, ``seed``, ``trajectories``, ...; each engine
        receives those that it has. A ``budget`` is for all together: each engine gets its part of
        the time that those before it left, those that refused in the end as well, without
        compilation of those that answered.

    Returns
    -------
    Comparison
        the estimates of the engines that support the scene, and why the others do not.

    Raises
    ------
    InputError
        for an engine or option that there is not, a folder that cannot be written, and the options
        that `Execution` has for other studies.
    HarvesterError
        when no engine can handle the scene, the error of the last.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, D11=0.01))
    >>> comparison = hv.compare(scene, trajectories=64, duration=20.0)
    >>> [estimate.engine for estimate in comparison.estimates]
    ['exact', 'published', 'averaged', 'density', 'ensemble', 'spice']
    """
    execution.only("compare", "out", "formats", "progress")
    seed = options.setdefault("seed", 0)
    problem = Problem.of(scene)
    folder = OutputFolder.of(execution)
    chosen = engines_of(list(refusals(problem)) if engines is None else engines, **options)
    budget = number(next((engine.budget for engine in chosen if isinstance(engine, Request)), None))
    estimates: list[Estimate] = []
    refused: dict[str, HarvesterError] = {}
    total = sum(engine.share_of_time for engine in chosen) + PATHS
    done = 0.0
    spent = 0.0
    with working_on("compare", execution) as progress:
        for engine in chosen:
            part = PartOfProgress(progress, done / total, engine.share_of_time / total, engine.NAME)
            part.step(0.0)
            begin = time.perf_counter()
            try:
                left = None if budget is None else budget - spent
                estimates.append(_with_share(engine, left, total - done).run(problem, part.step))
                spent += estimates[-1].seconds
            except (CannotServeError, MissingProgramError, SimulationError) as error:
                refused[engine.NAME] = error
                spent += time.perf_counter() - begin
            done += engine.share_of_time
        if not estimates:
            raise list(refused.values())[-1]
        progress.step(done / total, "paths")
        paths = tuple(_paths(problem, seed)) if _has_paths(chosen, refused) else ()
    result = Comparison(
        tuple(estimates), {name: str(error) for name, error in refused.items()}, paths
    )
    if folder is not None:
        folder.save(
            "compare",
            result.table.csv(),
            result.plot(problem.scene.name),
            provenance(problem, seed=seed),
        )
    return result


def _with_share(engine: Engine, left: float | None, shares: float) -> Engine:
    """The engine with its share of the seconds that are ``left``; ``shares`` are those of all that is to be done."""
    if left is None or not isinstance(engine, Request):
        return engine
    if left <= 0.0:
        raise SimulationError("the `budget` was spent before its turn: give more, or fewer engines")
    return dataclasses.replace(engine, budget=left * engine.share_of_time / shares)


def _has_paths(engines: Sequence[Engine], refused: dict[str, HarvesterError]) -> bool:
    """Whether paths are drawn: ngspice ran, and the published decoupled V, one of the three, has a meaning."""
    meaningless = isinstance(refused.get(Published.NAME), CannotServeError)
    return (
        any(engine.runs_ngspice and engine.NAME not in refused for engine in engines)
        and not meaningless
    )


def _paths(problem: Problem, seed: int) -> list[PathComparison]:
    """One trajectory with the stop, if there is one, and one without."""
    paths = []
    bare = Problem(problem.scene.without_stop())
    pairs = [("without the stop", bare)]
    if bare.scene != problem.scene:
        pairs.insert(0, ("with the stop", problem))
    for title, variant in pairs:
        # the stop may be all that bounds the response
        with contextlib.suppress(UnboundedResponseError):
            paths.append(one_path(variant, title, seed))
    return paths


def one_path(
    problem: Problem, title: str, seed: int = 0, dt: float | None = None
) -> PathComparison:
    """The voltage by ngspice, exact update and decoupled V on the same noise path; ``dt`` as for the engines."""
    from harvester.averaging.published.orbit import amplitude_through, decoupled, omega2
    from harvester.cosimulation import runs as worker
    from harvester.mechanics.kernels.noise import gaussian_grid
    from harvester.mechanics.trace import trace

    device = set_up(problem, Spice(seed=seed, dt=dt)).device
    eqs = device.eqs
    device = worker.CoupledDevice(
        eqs, device.scales, device.load, device.h, max(1, round(READING / 4 / device.h))
    )
    noise = gaussian_grid(np.random.SeedSequence(seed), round(PATH_DURATION / device.h))
    path = worker.path_in_worker(device, noise)
    exact = trace(eqs, noise, device.h, device.stride)
    alpha = eqs.alpha or 0.0
    beta = eqs.beta or 0.0
    mu = eqs.mu or 0.0
    A = amplitude_through(path.x, path.v, alpha, beta, mu)
    V = decoupled(path.x, path.v, omega2(A, alpha, beta, mu), mu)
    units = problem.units
    spice, exactly, without = (voltage * units.volts for voltage in (path.V, exact.V, V))
    t = path.t / units.frequency
    x = path.x * units.length
    return PathComparison(
        title=title,
        t=t,
        x=x,
        spice=spice,
        exact=exactly,
        decoupled=without,
        physical=problem.physical,
    )


def _relative_rms(a: Floats, b: Floats) -> float:
    norm = float(np.sqrt(np.mean(b**2)))
    return float(np.sqrt(np.mean((a - b) ** 2))) / norm if norm > 0.0 else 0.0
