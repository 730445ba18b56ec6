"""Engine `exact`: linear equations without a stop, in closed form, under any excitation."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from harvester.answers.estimate import DISPLACEMENT, PEAKS, Estimate
from harvester.engines.formula import Formula
from harvester.engines.protocol import estimate
from harvester.equations.coefficients import Equations
from harvester.equations.effects import LINEAR, unknown_to
from harvester.equations.problem import Problem
from harvester.linear.transfer import amplitudes
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.value import Value


class Exact(Formula):
    """The stationary E[V^2] and E[P] of a linear scene, whose only error is rounding.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> f"{hv.Exact().run(scene).mean_power.value:.8f}"
    '0.00322581'

    Parameters
    ----------
    within, budget, seed : float or str or int, optional
        the options of `run`.

    Raises
    ------
    CannotServeError
        for a load other than a resistance or none, a stop, and a spring or damping that is not
        linear.
    UnboundedResponseError
        if the response grows without bound.
    """

    NAME = "exact"
    LOOK = EngineLook(
        "exact (linear, closed form)", "#000000", "*", (0, (1, 2)), order=3.3, trust=5
    )
    is_exact = True
    has_frequency_response = True
    UNSERVED = unknown_to(LINEAR)

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.linear.solve import solve_many

        return solve_many

    def _estimate(self, problem: Problem, solution: Any, seconds: float) -> Estimate:
        from harvester.linear.record_doubts import join_change, record_doubts

        eqs = problem.equations
        diagnostics = [
            *record_doubts(eqs),
            note("closed_form" + "_joined" * bool(join_change(eqs))),
        ]
        if eqs.load is None:
            diagnostics.append(warning("open_circuit"))
        if not eqs.is_shaken:
            diagnostics.append(warning("nothing_shakes"))
        v2 = Value(solution.value, bias=solution.error, model=0.0)
        return estimate(
            self.NAME,
            problem,
            v2,
            None,
            diagnostics,
            seconds,
            details=_motion(problem, solution.x2),
        )


def _motion(problem: Problem, x2: float) -> dict[str, float]:
    """The RMS displacement, and under a harmonic excitation alone the amplitudes of displacement and voltage.

    For a record or a tabulated PSD the displacement's error is not computed, so that it is left
    out.  Random excitation has no largest value but over a lifetime (`harvester run --lifetime`).
    """
    eqs, units = problem.equations, problem.units
    if eqs.record is not None or eqs.density is not None:
        return {}
    motion = {DISPLACEMENT: math.sqrt(x2) * units.length}
    if eqs.drive is not None and not eqs.is_random:
        assert eqs.drive_frequency is not None, "Scene checks this"
        x, voltage = abs(eqs.drive) * np.abs(amplitudes(eqs, eqs.drive_frequency))
        motion |= dict(
            zip(PEAKS, (float(x) * units.length, float(voltage) * units.volts), strict=True)
        )
    return motion | {f"{name}_bias": 0.0 for name in motion}
