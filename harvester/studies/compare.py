"""Every engine that can serve a scene, side by side, and one path: ngspice, exact update, decoupled V."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from harvester import figures
from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines import Exact, Ideal, Published, Spice
from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named, refusals
from harvester.engines.selection import engines as engines_of
from harvester.engines.spice.setup import READING, set_up
from harvester.equations.problem import Problem
from harvester.errors import (
    CannotServeError,
    HarvesterError,
    MissingProgramError,
    SimulationError,
    UnboundedResponseError,
    names_arguments,
)
from harvester.presentation.answer_units import AnswerUnits
from harvester.uncertainty.value import z_score

# Of time.
WEIGHTS = {**dict.fromkeys(("exact", "published", "averaged"), 0.02), "ensemble": 1.0, "ideal": 1.0, "spice": 2.0}
WEIGHTS["paths"] = 0.1
PATH_DURATION = 100.0  # nondimensional time of the path that is drawn


@dataclass(frozen=True)
class PathComparison:
    """V on one noise path from three sources, in the scene's units (`unit_names`), arrays of shape (n,).

    ``spice`` from ngspice, ``exact`` from the exact RC update, ``decoupled`` from the x and x' of
    the ngspice path by V = (w^2 x + mu x')/(mu^2 + w^2) (paper, Eq. 6), w^2 at the amplitude
    of the moment.
    """

    title: str
    t: Floats
    x: Floats
    spice: Floats
    exact: Floats
    decoupled: Floats
    physical: bool = False

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(self.physical)

    @property
    def spice_error(self) -> float:
        """The relative RMS difference of ngspice and the exact update."""
        return _relative_rms(self.spice, self.exact)

    @property
    def decoupled_error(self) -> float:
        """The relative RMS error of the decoupled V against ngspice."""
        return _relative_rms(self.decoupled, self.spice)


@names_arguments
@dataclass(frozen=True)
class Comparison:
    """Estimates of the engines that served, why the others did not, and paths with and without the stop: of `compare`.

    ``found.ratio(estimate)`` is its power over that of ``found.reference``, ``found.z(estimate)`` their z-score.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, D11=0.01))
    >>> found = hv.compare(scene, trajectories=64, duration=20.0)
    >>> found.z(found.reference) is None, found.ratio(found.reference)
    (True, 1.0)
    """

    estimates: tuple[Estimate, ...]
    refused: dict[str, str]
    paths: tuple[PathComparison, ...]

    @property
    def reference(self) -> Estimate:
        """The estimate that the others are compared with: `Exact`, or the smallest standard error without a model."""
        sampled = [e for e in self.estimates if e.mean_power.stderr is not None and e.engine != Ideal.NAME]
        closed = [e for e in self.estimates if e.engine == Exact.NAME]
        return min(closed or sampled or self.estimates, key=lambda e: e.mean_power.stderr or 0.0)

    def z(self, estimate: Estimate) -> float | None:
        """The z-score of an estimate's power against the reference; None for the reference itself."""
        if estimate is self.reference:
            return None
        return z_score(estimate.mean_power, self.reference.mean_power)

    def ratio(self, estimate: Estimate) -> float | None:
        """The power of an estimate over that of the reference."""
        reference = self.reference.mean_power.value
        return estimate.mean_power.value / reference if reference else None

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The engines, and the paths, as a matplotlib figure."""
        return figures.comparison(self.estimates, self.paths, title)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        rows = [e.as_json() | {"ratio": self.ratio(e), "z": self.z(e)} for e in self.estimates]
        paths = [
            {"scene": p.title, "spice_rms_error": p.spice_error, "decoupled_rms_error": p.decoupled_error}
            for p in self.paths
        ]
        return {"reference": self.reference.engine, "engines": rows, "refused": self.refused, "paths": paths}

    def __str__(self) -> str:
        lines = [str(estimate) for estimate in self.estimates]
        lines.append(f"against {self.reference.engine}:")
        for estimate in self.estimates:
            if estimate is not self.reference:
                ratio, z = self.ratio(estimate), self.z(estimate)
                text = "" if ratio is None else f"power times {ratio:.4g}"
                lines.append(f"  {estimate.engine:<10} {text}" + ("" if z is None else f", z = {z:.2f}"))
        lines += [
            f"one path {path.title}: relative RMS error of V, ngspice against exact {path.spice_error:.1e}, "
            f"published (V decoupled from x and x') against ngspice {path.decoupled_error:.2g}"
            for path in self.paths
        ]
        return "\n".join(lines + [f"{name} did not run: {why}" for name, why in self.refused.items()])

    def _repr_html_(self) -> str:
        from harvester.presentation import html

        rows = []
        for one in self.estimates:
            ratio, z = self.ratio(one), self.z(one)
            cells = ("" if ratio is None else f"{ratio:.4g}", "" if z is None else f"{z:.2f}", f"{one.seconds:.2g}")
            rows.append((one.engine, one.mean_power.format(one.unit_names.power), *cells))
        notes = [f"{name} did not run: {why}" for name, why in self.refused.items()]
        notes += [f"warning, {one.engine}: {word}" for one in self.estimates for word in one.warnings]
        head = ("engine", "mean power", f"over {self.reference.engine}", "z", "seconds")
        return html.table("engines side by side", head, rows, notes)


def compare(
    scene: AnyScene,
    seed: int = 0,
    *,
    engines: Sequence[Named] | None = None,
    tick: Callable[[float, str], None] | None = None,
    **options: Any,
) -> Comparison:
    """Run every engine on a scene, and one path of `PATH_DURATION` with and without its stop, where `published` serves.

    ``engines`` (or their names) stand for every engine.  ``options`` go to those that sample (see
    `harvester.engines.Ensemble`).  ``tick`` is called with the fraction done and what is at work.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, D11=0.01))
    >>> found = hv.compare(scene, trajectories=64, duration=20.0)
    >>> [one.engine for one in found.estimates]
    ['exact', 'published', 'averaged', 'ensemble', 'spice']

    Raises
    ------
    HarvesterError
        when no engine can serve the scene, the error of the last.
    """
    problem = Problem.of(scene)
    estimates: list[Estimate] = []
    refused: dict[str, str] = {}
    drawn = True  # the paths are, unless the published decoupled V, one of the three, has no meaning
    last: HarvesterError | None = None
    chosen = engines_of(list(refusals(problem)) if engines is None else engines, seed=seed, **options)
    names = [one.NAME for one in chosen]
    total, done = sum(WEIGHTS[name] for name in names) + WEIGHTS["paths"], 0.0

    def tell(fraction: float, what: str) -> None:
        if tick is not None:
            tick((done + WEIGHTS[what] * fraction) / total, what)

    for name, engine in zip(names, chosen, strict=True):
        tell(0.0, name)
        try:
            estimates.append(engine.run(problem, partial(tell, what=name)))
        except (CannotServeError, MissingProgramError, SimulationError) as error:
            refused[name], last = str(error), error
            drawn = drawn and not (name == Published.NAME and isinstance(error, CannotServeError))
        done += WEIGHTS[name]
    if not estimates:
        assert last is not None
        raise last
    paths: list[PathComparison] = []
    tell(0.0, "paths")
    if drawn and Spice.NAME in names and Spice.NAME not in refused:
        bare = Problem(problem.scene.without_stop())
        pairs = [("without the stop", bare)]
        if bare.scene != problem.scene:
            pairs.insert(0, ("with the stop", problem))
        for title, one in pairs:
            with contextlib.suppress(UnboundedResponseError):  # the stop may be all that bounds the response
                paths.append(one_path(one, title, seed))
    return Comparison(tuple(estimates), refused, tuple(paths))


def one_path(problem: Problem, title: str, seed: int = 0, dt: float | None = None) -> PathComparison:
    """The voltage by ngspice, exact update and decoupled V on the same noise path; ``dt`` as for the engines."""
    from harvester.averaging.published.voltage import amplitude_through, decoupled, omega2
    from harvester.cosimulation import runs as worker
    from harvester.mechanics.kernels.noise import gaussian_grid
    from harvester.mechanics.kernels.path import trace

    device = set_up(problem, Spice(seed=seed, dt=dt)).device
    eqs = device.eqs
    device = worker.CoupledDevice(eqs, device.scales, device.load, device.h, max(1, round(READING / 4 / device.h)))
    noise = gaussian_grid(np.random.SeedSequence(seed), round(PATH_DURATION / device.h))
    path = worker.path_in_worker(device, noise)
    exact = trace(eqs, noise, device.h, device.stride)
    alpha, beta, mu = eqs.alpha or 0.0, eqs.beta or 0.0, eqs.mu or 0.0
    A = amplitude_through(path.x, path.v, alpha, beta, mu)
    V = decoupled(path.x, path.v, omega2(A, alpha, beta, mu), mu)
    units = problem.units
    spice, exactly, without = (voltage * units.volts for voltage in (path.V, exact.V, V))
    t, x = path.t / units.frequency, path.x * units.length
    return PathComparison(title, t, x, spice, exactly, without, problem.physical)


def _relative_rms(a: Floats, b: Floats) -> float:
    norm = float(np.sqrt(np.mean(b**2)))
    return float(np.sqrt(np.mean((a - b) ** 2))) / norm if norm > 0.0 else 0.0
