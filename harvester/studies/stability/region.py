"""The region of stability in the plane of the load (mu) and the parametric noise (D22), three ways."""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.stability import averaged_exponent as stability
from harvester.engines.protocol import unknown_effects
from harvester.equations.coefficients import Equations
from harvester.equations.effects import REST, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError
from harvester.uncertainty.value import Value

LOADS = np.geomspace(0.02, 5.0, 13)
_ROUNDS = 3  # of Newton's method on the Monte Carlo


class Measured:
    """A number by Monte Carlo with its standard error, which is infinite if none was found."""

    ensemble: float
    ensemble_stderr: float

    @property
    def ensemble_error95(self) -> float:
        """The half-width of its 95 % sampling interval."""
        return (
            Value(0.0, self.ensemble_stderr).sampling95
            if math.isfinite(self.ensemble_stderr)
            else math.inf
        )


@dataclass(frozen=True)
class Edge(Measured):
    """The boundary of stability at one mu: N2 = eps2^2 D22 at which the top exponent is zero, stable below.

    0 where rest is unstable without noise, infinite if no noise makes it unstable; ``ensemble``
    is by Monte Carlo, with its standard error (infinite: none was found).
    """

    mu: float
    published: float
    averaged: float
    ensemble: float
    ensemble_stderr: float


def edges(eqs: Equations, mu: Floats, seed: np.random.SeedSequence) -> Iterator[Edge]:
    """Compute the boundary lambda = 0 at each mu, the Monte Carlo by Newton's method from our boundary.

    lambda is measured at our N2, moved by the slope of our theory, and measured again until the
    move is within its error.
    """
    boundary = stability.boundary(eqs, mu)
    for m, published, averaged in zip(
        boundary.mu, boundary.published, boundary.averaged, strict=True
    ):
        yield Edge(
            float(m),
            float(published),
            float(averaged),
            *_measured(eqs, float(m), float(averaged), seed),
        )


def _measured(
    eqs: Equations, mu: float, n2: float, seed: np.random.SeedSequence
) -> tuple[float, float]:
    from harvester.mechanics.ensemble.lyapunov import exponent

    if not 0.0 < n2 < math.inf:
        return n2, math.inf
    for _ in range(_ROUNDS):
        here = dataclasses.replace(eqs, mu=mu, n2=n2)
        growth = exponent(here, seed, 2048, 500.0)
        slope = float(stability.averaged(here, n2=1.05 * n2) - stability.averaged(here)) / (
            0.05 * n2
        )
        move = growth.value / slope
        error = growth.stderr / abs(slope)
        n2 = max(n2 - move, 0.1 * n2)
        if abs(move) < 2.0 * error:
            break
    return n2, error


def check_rest(problem: Problem) -> None:
    """Raise CannotServeError for a netlist, and unless the mass rests at x = 0, free or touching one rigid stop."""
    if problem.netlist is not None:
        raise CannotServeError(
            f"stability must have a load resistance, but the load is netlist {problem.netlist!r}: "
            "give load.resistance, the circuit's at small signals"
        )
    subject = "stability, of rest at x = 0 with one rigid stop there or none,"
    if reason := unknown_effects(problem, unknown_to(REST), subject, "engine 'ensemble'"):
        raise CannotServeError(reason)
