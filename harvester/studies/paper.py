"""The paper's figures 1 to 9: published theory, our averaging, Monte Carlo of the coupled equations, and the density.

If the text does not print a value, or has lost its sign, the one assumed is in `ASSUMED` and
in the title.

Long because it names the curves of nine figures.
"""

import dataclasses
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.published import stationary
from harvester.averaging.published.orbit import amplitude_through
from harvester.averaging.stability import averaged_exponent as stability
from harvester.averaging.two_scale import densities
from harvester.averaging.two_scale import law as two_scale
from harvester.equations.coefficients import Equations
from harvester.errors import names_arguments, unknown
from harvester.machine.execution import DEFAULT, Execution, working_on
from harvester.machine.progress import PartOfProgress
from harvester.presentation import drawing
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.studies.output_folder import OutputFolder
from harvester.studies.stability import region

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Figures 1 and 2 (text): alpha, beta, mu, c1, c2, D11, D22; c3 = 0.1 in Figure 1, r = 0.96 in
# Figure 2.
RESPONSE = Equations(
    alpha=0.5, beta=0.05, mu=0.05, c1=0.01, c2=0.05, c3=0.1, restitution=0.96, n1=0.01, n2=0.01
)
# Figure 7 (text); the external noise is off.
STABILITY = Equations(
    alpha=0.05, beta=0.04, mu=0.1, c1=0.01, c2=0.015, c3=0.025, restitution=0.96, n2=0.06
)
ASSUMED = {
    "1": "r = 0.92, 0.96, 0.99, c1 > 0",
    "2": "c3 = 0.05, 0.1, 0.2, c1 > 0",
    "3": "beta = mu = 0.05, D11 = 0.01, c1 > 0",
    "4": "beta = mu = 0.05, r = 0.96, c1 > 0",
    "5": "mu = 0.05, D11 = 0.01, r = 0.96, c1 > 0",
    "6": "beta = 0.05, D11 = 0.01, r = 0.96, c1 > 0",
    "7": "c1 > 0",
    "8": "beta = 0.02, 0.04, 0.08; r = 0.96, D22 = 0.06, c1 > 0",
    "9": "r = 0.94, 0.96, 0.98, c1 > 0",
}
TITLES = {
    "1": "densities for three restitution coefficients",
    "2": "densities for three damping coefficients c3",
    "3": "mean square voltage and power against r",
    "4": "mean square voltage and power against D11",
    "5": "mean square voltage and power against beta",
    "6": "mean square voltage and power against mu",
    "7": "top Lyapunov exponent against r and D22",
    "8": "top Lyapunov exponent against mu",
    "9": "boundary of stability in the (mu, D22) plane",
}
COLUMNS = ("panel", "curve", "x", "published", "averaged", "ensemble", "ensemble_stderr", "density")
_TRAJECTORIES = 4096
# What the figures are against, by number and coefficient.
GRIDS: dict[str, Floats] = {
    "3": np.linspace(0.9, 0.99, 10),
    "4": np.linspace(0.005, 0.05, 10),
    "5": np.linspace(0.02, 0.2, 10),
    "6": np.geomspace(0.02, 2.0, 10),
    "7 r": np.linspace(0.9, 1.0, 11),
    "7 D22": np.linspace(0.01, 0.1, 10),
    "8": np.geomspace(0.05, 2.0, 9),
    "9": np.geomspace(0.05, 2.0, 7),
}
AGAINST = {"3": ("r", "restitution"), "4": ("D11", "n1"), "5": ("beta", "beta"), "6": ("mu", "mu")}
# How many points each figure has: for the time that is left.
POINTS = {"1": 360, "2": 360, "3": 20, "4": 20, "5": 20, "6": 20, "7": 21, "8": 27, "9": 21}


@dataclass(frozen=True)
class FigurePoint(region.Measured):
    """One point of a figure; ``ensemble`` has a standard error, ``density`` is None if it is not solved."""

    panel: str
    curve: str
    x: float
    published: float
    averaged: float
    ensemble: float
    ensemble_stderr: float
    density: float | None = None


class PaperFigure(TableResult):
    """A computed figure of the paper.

    Attributes
    ----------
    number : str
        the figure's number.
    title : str
        the quantities of the figure, and the values that are assumed.
    points : tuple of FigurePoint
        its points, as in ``table``.
    seconds : float
        the duration of the computation.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.PaperFigure.SHORT
    ('number', 'points', 'seconds')
    """

    INTERNAL = frozenset({"points"})
    DERIVED = ("table",)
    SHORT = ("number", "points", "seconds")

    number: str
    title: str
    points: tuple[FigurePoint, ...]
    seconds: float

    @property
    def table(self) -> Table:
        """Its points."""
        return Table(
            tuple(Column(name, [getattr(point, name) for point in self.points]) for name in COLUMNS)
        )

    @property
    def published_off(self) -> float:
        """The largest error of the published theory, over the largest value of its panel."""
        largest = 0.0
        for panel in {point.panel for point in self.points}:
            points = [point for point in self.points if point.panel == panel]
            size = max(abs(point.ensemble) for point in points)
            off = max(abs(point.published - point.ensemble) for point in points)
            largest = max(largest, off / size if size else 0.0)
        return largest

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The figure, with its own title (empty), another, or none (None) above."""
        return drawing.draw(self, self.title if title == "" and ax is None else title, ax)


@names_arguments
def paper(figure: int | str, *, execution: Execution = DEFAULT) -> PaperFigure:
    """Compute a figure of the Entropy 2026 paper: its theory, ours and Monte Carlo.

    Parameters
    ----------
    figure : int or str
        Number of the figure, 1 to 9.
    execution : Execution, optional
        Folder for figN.csv and figN.png, and progress.

    Returns
    -------
    PaperFigure
        The points of the figure, with ``plot()`` and ``to_pandas()``.

    Raises
    ------
    InputError
        ``figure`` is not one of the paper's, or the folder cannot be written.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.paper(9).number
    '9'
    """
    if str(figure) not in TITLES:
        raise unknown("figure of `figure`", str(figure), TITLES)
    (drawn,) = draw([str(figure)], execution)
    return drawn


def draw(numbers: Sequence[str], execution: Execution = DEFAULT) -> list[PaperFigure]:
    """Compute figures by their numbers; into a folder write figN.csv and figN.png for each.

    Raises InputError if the folder cannot be written, and for the options that `Execution` has for
    other studies.
    """
    execution.only("paper", "out", "formats", "progress")
    folder = OutputFolder.of(execution)
    drawn = []
    with working_on("paper", execution) as progress:
        for index, number in enumerate(numbers):
            part = PartOfProgress(
                progress, index / len(numbers), 1.0 / len(numbers), f"figure {number}"
            )
            part.start(POINTS[number])
            begin = time.perf_counter()
            points = []
            for point in figure(number):
                points.append(point)
                part.step()
            seconds = time.perf_counter() - begin
            title = f"Figure {number}: {TITLES[number]} (assumed: {ASSUMED[number]})"
            drawn.append(PaperFigure(number, title, tuple(points), seconds))
            if folder is not None:
                folder.save(f"fig{number}", drawn[-1].table.csv(), drawn[-1].plot())
    return drawn


def figure(number: str) -> Iterator[FigurePoint]:
    """The points of a figure."""
    match number:
        case "1":
            yield from _densities({f"r = {r}": {"restitution": r} for r in (0.92, 0.96, 0.99)})
        case "2":
            yield from _densities({f"c3 = {c3}": {"c3": c3} for c3 in (0.05, 0.1, 0.2)})
        case "3" | "4" | "5" | "6":
            yield from _response(*AGAINST[number], GRIDS[number])
        case "7":
            yield from _exponents("r", "", "restitution", GRIDS["7 r"], STABILITY)
            yield from _exponents("D22", "", "n2", GRIDS["7 D22"], STABILITY)
        case "8":
            for beta in (0.02, 0.04, 0.08):
                eqs = dataclasses.replace(STABILITY, beta=beta)
                yield from _exponents("mu", f"beta = {beta}", "mu", GRIDS["8"], eqs)
        case "9":
            for r in (0.94, 0.96, 0.98):
                yield from _boundary(f"r = {r}", dataclasses.replace(STABILITY, restitution=r))


def _response(panel: str, coefficient: str, values: Floats) -> Iterator[FigurePoint]:
    """E[V^2] and E[P] = beta mu E[V^2] against one coefficient of the response scene."""
    from harvester.density.refine import LIGHTEST, refined
    from harvester.mechanics.ensemble.burn_in import burn_in
    from harvester.mechanics.ensemble.trajectories import Trajectories

    for index, value in enumerate(values):
        change: dict[str, Any] = {coefficient: float(value)}
        eqs = dataclasses.replace(RESPONSE, **change)
        trajectories = Trajectories(
            eqs, _TRAJECTORIES, np.random.SeedSequence([1, int(1e6 * value)])
        )
        burn_in(trajectories)
        ensemble = trajectories.run(trajectories.time).mean("V2")
        three = (
            stationary.mean_square_voltage(eqs),
            two_scale.solve(eqs).mean_square_voltage,
            *ensemble,
        )
        # it takes the longest
        solved = None if index % 3 else float(refined(eqs, 1e-3, None, None, LIGHTEST).means[0])
        for name, factor in (("E[V^2]", 1.0), ("E[P]", (eqs.beta or 0.0) * (eqs.mu or 0.0))):
            theory, ours, monte_carlo, error = (factor * v for v in three)
            density = None if solved is None else factor * solved
            yield FigurePoint(
                f"{name} against {panel}",
                "",
                float(value),
                theory,
                averaged=ours,
                ensemble=monte_carlo,
                ensemble_stderr=error,
                density=density,
            )


def _densities(curves: dict[str, dict[str, Any]]) -> Iterator[FigurePoint]:
    """The densities p(A), p(x) and p(x') at the centres of the Monte Carlo's bins."""
    from harvester.density.marginals import Marginals
    from harvester.density.refine import LIGHTEST, refined
    from harvester.mechanics.ensemble.histograms import Histogram

    for curve, changes in curves.items():
        eqs = dataclasses.replace(RESPONSE, **changes)
        law, ours = stationary.density(eqs), two_scale.solve(eqs)
        solution = refined(eqs, 1e-3, None, None, LIGHTEST).solution
        solved = Marginals(solution.form, solution.p)
        (x, v) = _states(eqs)
        stop = eqs.restitution is not None
        through = partial(
            amplitude_through, alpha=eqs.alpha or 0.0, beta=eqs.beta or 0.0, mu=eqs.mu or 0.0
        )
        fine = np.arange(0.002, 4.0, 0.004)
        fast = np.arange(-6.0, 6.0, 0.008)
        edges = np.linspace(0.0, 2.4, 41)
        speeds = np.linspace(-3.0, 3.0, 41)
        plane = np.histogram(
            through(fine[:, None], fast), edges, weights=solved.phase_plane(fine, fast)
        )[0]
        at, to = 0.5 * (edges[1:] + edges[:-1]), 0.5 * (speeds[1:] + speeds[:-1])
        slow = (
            stationary.displacement_density(at, law, eqs),
            densities.displacement_density(at, ours, stop),
        )
        quick = (
            stationary.velocity_density(to, law, eqs),
            densities.velocity_density(to, ours, stop),
        )
        for panel, bins, values, theories, exact in (
            ("amplitude A", edges, through(x, v), (np.interp(at, law.A, law.p), densities.amplitude_density(at, ours)),
             plane * 0.004 * 0.008 / np.diff(edges)),
            ("displacement x", edges, x, slow, solved.displacement(at)),
            ("velocity x'", speeds, v, quick, solved.velocity(to)),
        ):  # fmt: skip
            # groups of trajectories: snapshots of one are not independent
            histogram = Histogram(bins, 64)
            histogram.add(values.ravel())
            counted = histogram.density()
            for row in zip(
                counted.centres, *theories, counted.value, counted.stderr, exact, strict=True
            ):
                yield FigurePoint(f"p({panel})", curve, *(float(v) for v in row))


def _states(eqs: Equations) -> Floats:
    """Displacement and velocity of many trajectories at many times, shape (2, trajectories, snapshots)."""
    from harvester.mechanics.ensemble.burn_in import burn_in
    from harvester.mechanics.ensemble.trajectories import Trajectories

    trajectories = Trajectories(eqs, _TRAJECTORIES, np.random.SeedSequence(2), 0.04)
    burn_in(trajectories)
    rows = []
    for _ in range(40):
        trajectories.run(12.0)
        rows.append(trajectories.snapshot()[:2])
    return np.moveaxis(np.array(rows), 0, 2)


def _exponents(
    panel: str, curve: str, coefficient: str, values: Floats, base: Equations
) -> Iterator[FigurePoint]:
    """Top Lyapunov exponent against one coefficient."""
    from harvester.mechanics.ensemble.lyapunov import exponent

    for value in values:
        change: dict[str, Any] = {coefficient: float(value)}
        eqs = dataclasses.replace(base, **change)
        estimate = exponent(eqs, np.random.SeedSequence(3), 2048, 500.0)
        yield FigurePoint(
            f"lambda against {panel}",
            curve,
            float(value),
            published=float(stability.published(eqs)),
            averaged=float(stability.averaged(eqs)),
            ensemble=estimate.value,
            ensemble_stderr=estimate.stderr,
        )


def _boundary(curve: str, base: Equations) -> Iterator[FigurePoint]:
    """D22 at which the exponent is zero."""
    for edge in region.edges(base, GRIDS["9"], np.random.SeedSequence(4)):
        yield FigurePoint("D22 against mu", curve, *dataclasses.astuple(edge))
