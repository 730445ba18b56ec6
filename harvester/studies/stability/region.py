"""The region of stability in the plane of the load (mu) and the parametric noise (D22), three ways."""

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.averaging.stability import exponent as stability
from harvester.engines.protocol import AnyScene
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.studies.output_folder import OutputFolder, csv_text
from harvester.studies.stability.exponent import check_rest

COLUMNS = ("mu", "published", "averaged", "ensemble", "ensemble_stderr")
LOADS = np.geomspace(0.02, 5.0, 13)
_ROUNDS = 3  # of Newton's method on the Monte Carlo


@dataclass(frozen=True)
class Edge:
    """The boundary of stability at one mu: N2 = eps2^2 D22 at which the top exponent is zero, stable below.

    0 where rest is unstable without noise, infinite where no noise makes it unstable; ``ensemble`` is
    by Monte Carlo, with its standard error (infinite: none was found).
    """

    mu: float
    published: float
    averaged: float
    ensemble: float
    ensemble_stderr: float


def edges(eqs: Equations, mu: Floats, seed: np.random.SeedSequence) -> Iterator[Edge]:
    """Compute the boundary lambda = 0 at each mu, the Monte Carlo by Newton's method from our boundary.

    lambda is measured at our N2, moved by the slope of our theory, and measured again until the move is
    within its error.
    """
    found = stability.boundary(eqs, mu)
    for m, theirs, ours in zip(found.mu, found.published, found.averaged, strict=True):
        yield Edge(float(m), float(theirs), float(ours), *_measured(eqs, float(m), float(ours), seed))


def _measured(eqs: Equations, mu: float, n2: float, seed: np.random.SeedSequence) -> tuple[float, float]:
    from harvester.mechanics.ensemble.lyapunov import exponent

    if not 0.0 < n2 < math.inf:
        return n2, math.inf
    for _ in range(_ROUNDS):
        here = dataclasses.replace(eqs, mu=mu, n2=n2)
        found = exponent(here, seed, 2048, 500.0)
        slope = float(stability.averaged(here, n2=1.05 * n2) - stability.averaged(here)) / (0.05 * n2)
        move, error = found.value / slope, found.stderr / abs(slope)
        n2 = max(n2 - move, 0.1 * n2)
        if abs(move) < 2.0 * error:
            break
    return n2, error


def draw(
    scene: AnyScene, out: str | Path, seed: int = 0, tick: Callable[[], None] | None = None, vector: Sequence[str] = ()
) -> list[Edge]:
    """Write stability.csv and stability.png for a scene, whose own mu and D22 do not matter, into a folder.

    ``vector`` are forms of the figure beside its .png: svg, pdf.  Raises InputError for another one or where the folder
    cannot be written, and CannotServeError as `check_rest`.
    """
    problem = Problem.of(scene)
    check_rest(problem)
    folder, points = OutputFolder(out, vector), []
    for edge in edges(problem.equations, LOADS, np.random.SeedSequence(seed)):
        points.append(edge)
        if tick is not None:
            tick()
    text = csv_text(COLUMNS, map(dataclasses.astuple, points))
    folder.save("stability", text, figures.region([edge.mu for edge in points], points, problem.scene.title))
    return points
