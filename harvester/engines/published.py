"""Engine `published`: the paper's stochastic averaging, its misprints corrected."""

from collections.abc import Callable, Sequence
from typing import Any

from harvester.answers.estimate import Estimate
from harvester.engines.formula import Formula
from harvester.engines.protocol import estimate
from harvester.equations.coefficients import Equations
from harvester.equations.effects import PUBLISHED, unknown_to
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.value import Value


class Published(Formula):
    """Stochastic averaging of the Entropy 2026 paper, corrected: E[V^2] of Eq. 30, E[P] of Eq. 31.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> f"{hv.Published().run(scene).mean_power.value:.5f}"
    '0.00331'

    Parameters
    ----------
    within, budget, seed : float or str or int, optional
        the options of `run`.

    Raises
    ------
    CannotServeError
        for a load other than a resistance, or a spring or stop that the theory does not know.
    SimulationError
        without external noise, or if the response grows without bound.
    """

    NAME = "published"
    LOOK = EngineLook("published averaging", "#D55E00", "X", (0, (5, 2)), order=3.2)
    next_fidelity = "ensemble"
    UNSERVED = unknown_to(PUBLISHED)

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.averaging.published.stationary import mean_square_voltages

        return mean_square_voltages

    def _estimate(self, problem: Problem, solution: float, seconds: float) -> Estimate:
        eqs = problem.equations
        diagnostics = [note("published_formula")]
        if eqs.restitution is not None:
            diagnostics.append(
                warning("published_stop" if eqs.mu is not None else "published_open_circuit")
            )
        return estimate(self.NAME, problem, Value(solution), None, diagnostics, seconds)
