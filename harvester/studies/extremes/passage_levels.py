"""The largest displacement over a lifetime by the rate of first passages of the density, without sampling.

Passages of a high level are a Poisson process of the rate lambda(a) of
`harvester.density.first_passages`, so that

    P(largest |x| in T below a) = exp(-lambda(a) T)

The level of a share p of devices has lambda(a) = -ln(p)/T, which secants of ln lambda over a^2
find.  Its error is that of ln lambda by a finer mesh and by fewer modes, and the time that the
motion needs to forget its beginning, over d ln lambda/da.
"""

import math

from harvester.density.first_passages import displacement_rate
from harvester.density.functionals import NAMES
from harvester.density.refine import Answer
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.studies.motion_in_time import forgetting
from harvester.uncertainty.value import Value

FIRST, NEXT = 1.0, 1.05  # of the guess: the first two levels
# of ln lambda, and solutions
CLOSE = 0.01
MOST = 12
# modes that are exact, as the voltage does not act on the mass; least number of others
FEW, MODES = 3, 10
CALM = 0.7  # of a level that is too far up to be resolved: where to go on


class PassageLevels:
    """The rates of first passage of a solved density at the levels that were asked for, nondimensional."""

    def __init__(self, problem: Problem, answer: Answer) -> None:
        self.problem, self.answer = problem, answer
        self.known: dict[float, float] = {}  # ln lambda by level, on the coarsest mesh
        modes = answer.solution.form.modes
        self.modes = modes if modes <= FEW else max(modes, MODES)

    def level(self, share: float, lifetime: float) -> Value:
        """The displacement that a fraction of devices stays below in a nondimensional lifetime.

        Raises SimulationError if it is too far up to be resolved.
        """
        target = math.log(-math.log(share) / lifetime)
        a, slope = self._solved(target)
        others = [
            self._rate(a, 1, self.modes),
            self._rate(a, 0, self.modes - 2 if self.modes > FEW else self.modes),
        ]
        if min(others) <= 0.0:
            raise SimulationError(
                "a level so rarely passed is not resolved: give a shorter lifetime"
            )
        error = sum(abs(self.known[a] - math.log(rate)) for rate in others)
        error += 1.0 / (forgetting(self.problem, self.answer) * lifetime)
        # by the finer mesh
        return Value(a + (target - math.log(others[0])) / slope, bias=error / abs(slope))

    def _rate(self, level: float, mesh: int, modes: int) -> float:
        return displacement_rate(self.problem.equations, self.answer.setting, level, mesh, modes)

    def _solved(self, target: float) -> tuple[float, float]:
        """The level of a logarithm of the rate, and the slope of that logarithm there."""
        rms = math.sqrt(self.answer.means[NAMES.index("displacement_squared")])
        low, high = self.problem.equations.rigid_stops
        floor = max(low, -high, 0.0)  # no level is below the nearer end of the mass's way
        for _ in range(MOST):
            near = sorted(self.known, key=lambda a: abs(self.known[a] - target))[:2]
            if len(near) == 2:
                (x, y), (u, v) = ((a * a, self.known[a]) for a in near)
                slope = (v - y) / (u - x)
                if abs(y - target) < CLOSE:
                    return near[0], 2.0 * near[0] * slope
                a = math.sqrt(min(max(x + (target - y) / slope, 0.25 * x, floor**2), 4.0 * x))
            else:
                guess = rms * math.sqrt(2.0 * max(-target - 1.0, 1.0))
                a = max(floor, guess) * (NEXT if near else FIRST)
            while not (rate := self._rate(a, 0, self.modes)) > 0.0:
                a = CALM * a
                if a < rms:
                    raise SimulationError(
                        "no level is passed at a rate that is resolved: use engine 'ensemble'"
                    )
            self.known[a] = math.log(rate)
        raise SimulationError(
            "no level with the rate of the lifetime was found: use engine 'ensemble'"
        )
