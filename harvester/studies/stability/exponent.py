"""Stability of a scene at rest: its top Lyapunov exponent three ways, and the region in which it is stable."""

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from harvester.engines.protocol import AnyScene
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.machine.execution import DEFAULT, Execution, working_on
from harvester.machine.progress import PartOfProgress
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.messages.unknown_parts import PAPERS_FORMULA
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.plausibility import unusual_values
from harvester.studies.output_folder import OutputFolder
from harvester.studies.stability.region import LOADS, Edge, check_rest, edges
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EXACT = 1e-9  # relative: an estimated error below is that of the arithmetic


class Stability(TableResult):
    """The exponent lambda of the growth e^(lambda t) near rest: in 1/s for a physical scene, else nondimensional.

    Attributes
    ----------
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    published : float
        by the Entropy 2026 paper's Eq. 38, misprints corrected.
    averaged, model : float or None
        by our averaging, and its estimated error (None: unknown).
    ensemble : Value
        a `Value`: by Monte Carlo.  If there is a stop and no noise, the step's part in its error is
        at least the distance from ``noiseless``.
    noiseless : float or None
        the exact exponent without noise; None: the mass leaves the stop for good.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).
    region : tuple of Edge
        the edge of stability in the plane of the load and the parametric noise, if it was computed.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=0.1, beta=0.05, mu=1.0))
    >>> hv.stability(scene, trajectories=64, duration=50.0).verdict
    'unstable'
    """

    DERIVED = ("verdict", "averaged_exponent")
    NOT_SHOWN = frozenset({"averaged", "model", "region"})
    NOT_IN_JSON = frozenset({"averaged_exponent"})
    OPTIONAL = frozenset({"region"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"model": "averaged_model_bias"}
    SHORT = ("verdict", "ensemble")

    physical: bool
    published: float
    averaged: float
    model: float | None
    ensemble: Value
    noiseless: float | None
    diagnostics: tuple[Diagnostic, ...] = ()
    region: tuple[Edge, ...] = ()

    @property
    def verdict(self) -> str:
        """The verdict of the Monte Carlo: stable, unstable, or undecided within its error."""
        if abs(self.ensemble.value) <= self.ensemble.known_error95:
            return "undecided"
        return "stable" if self.ensemble.value < 0.0 else "unstable"

    @property
    def averaged_exponent(self) -> Value:
        """Our exponent with its estimated error."""
        return Value(self.averaged, model=self.model)

    @property
    def table(self) -> Table:
        """The edge of stability: at each mu the parametric noise eps2^2 D22 at which rest turns unstable."""
        names = ("mu", "published", "averaged", "ensemble", "ensemble_stderr")
        columns = tuple(
            Column(name, [getattr(edge, name) for edge in self.region]) for name in names
        )
        return Table(columns, "The edge of stability")

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The region of stability in the plane (mu, D22).

        Raises InputError if that was not computed.
        """
        if not self.region:
            raise InputError(
                "`plot` must have a region of stability, which only `stability` with `out` computes"
            )
        return drawing.draw(self, title, ax)


@names_arguments
def stability(
    scene: AnyScene,
    *,
    seed: int = 0,
    trajectories: int = 4096,
    duration: float = 1000.0,
    execution: Execution = DEFAULT,
) -> Stability:
    """Compute the top Lyapunov exponent of a scene's linearised equations without external noise.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    seed : int, default 0
        the same seed, the same noise.
    trajectories, duration : int or float, optional
        of the Monte Carlo; the duration is in units of 1/w0, also for a physical scene.
    execution : Execution, optional
        has the folder for the region of stability, for which the scene's own mu and D22 do not
        matter: stability.csv and stability.png; ``out``, ``formats`` and ``progress`` alone.

    Returns
    -------
    Stability
        the exponent (1/s; nondimensional scene: without unit) by the Entropy 2026 paper's formula,
        by ours and by Monte Carlo.

    Raises
    ------
    InputError
        for a folder that cannot be written, and the options that `Execution` has for other studies.
    CannotServeError
        for a netlist load, and if the linearised motion about x = 0 has no information on rest.
    SimulationError
        if the linearised motion stops dead (restitution 0 without a voltage).

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.1, beta=0.05, mu=1.0))
    >>> result = hv.stability(scene, trajectories=64, duration=50.0)
    >>> result.verdict, f"{result.averaged:.4f}"
    ('stable', '-0.0632')
    """
    from harvester.averaging.stability import averaged_exponent as formula
    from harvester.averaging.stability.exact_exponent import noiseless
    from harvester.mechanics.ensemble import lyapunov

    execution.only("stability", "out", "formats", "progress")
    problem = Problem.of(scene)
    check_rest(problem)
    folder = OutputFolder.of(execution)
    eqs = problem.equations
    unit = problem.units.frequency
    diagnostics = unusual_values(problem.scene)
    if eqs.is_shaken:
        diagnostics.append(warning("shaking_left_out"))
    if eqs.mu is not None and lyapunov.memory(eqs) > lyapunov.LONGEST:
        diagnostics.append(warning("memory_longer_than_burn_in", longest=lyapunov.LONGEST))
    share = 1.0 if folder is None else 0.2  # of the time
    with working_on("stability", execution) as progress:
        part = PartOfProgress(progress, 0.0, share)
        growth = lyapunov.exponent(
            eqs, np.random.SeedSequence(seed), trajectories, duration, progress=part.step
        )
        region: list[Edge] = []
        for edge in () if folder is None else edges(eqs, LOADS, np.random.SeedSequence(seed)):
            region.append(edge)
            progress.step(share + (1.0 - share) * len(region) / len(LOADS), "region")
    assessment = formula.checks(eqs)
    quiet = noiseless(eqs)
    bias = growth.bias
    unknown = ""
    if eqs.n2 is None and eqs.restitution is not None:
        # All trajectories can come to one path whose impacts lock to the grid: neither their
        # scatter nor a run of twice the step tells how far that is off.
        if quiet is None:
            unknown = "the step, as impacts can lock to its grid without noise"
        else:
            bias = max(bias, abs(growth.value - quiet))
            diagnostics.append(warning("impacts_lock_to_steps"))
    averaged = float(formula.averaged(eqs))
    if assessment.error is not None and assessment.error <= EXACT * abs(averaged):
        diagnostics.append(note("averaged_is_exact"))
    answer = Stability(
        physical=problem.physical,
        published=float(formula.published(eqs)) * unit,
        averaged=averaged * unit,
        model=None if assessment.error is None else assessment.error * unit,
        ensemble=Value(growth.value, growth.stderr, bias, unknown=unknown).scaled(unit),
        noiseless=None if quiet is None else quiet * unit,
        diagnostics=(
            *diagnostics,
            note("error_unknown", "published", part=PAPERS_FORMULA),
            *assessment.diagnostics,
        ),
        region=tuple(region),
    )
    if folder is not None:
        folder.save("stability", answer.table.csv(), answer.plot(problem.scene.name))
    return answer
