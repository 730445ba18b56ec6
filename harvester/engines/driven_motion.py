"""How far the mass swings under a sinusoid, and the peak of the voltage, from one trajectory of the response."""

import math
from typing import TYPE_CHECKING

import numpy as np

from harvester.answers.estimate import DISPLACEMENT, PEAKS
from harvester.equations.problem import Problem
from harvester.uncertainty.richardson import limit

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.richardson import RichardsonPair

# of E[V^2]: a trajectory of the response that all come to; and one that comes back
SAME, SETTLED = 0.02, 1e-3
MOST_STEPS = 4e6


def driven_motion(problem: Problem, pair: "RichardsonPair") -> dict[str, float]:
    """The RMS of x about its mean and the largest |x| and |V|, with their time-step error, in the scene's units.

    The trajectory continues from one of the trajectories, at their step, a half and a quarter of
    it. Nothing is given if something random shakes the mass, the circuit is compiled, or the
    trajectory does not come to the mean of all trajectories: they have several responses, or none
    that comes back.
    """
    from harvester.mechanics.ensemble.coexisting_responses import sections
    from harvester.mechanics.kernels.coefficients import BATCH
    from harvester.mechanics.kernels.forcing import forcing
    from harvester.mechanics.largest_swing import peak
    from harvester.mechanics.periodic import MULTIPLES

    eqs = problem.equations
    units = problem.units
    trajectories = pair.trajectories
    if eqs.drive is None or eqs.is_random or trajectories.loaded.is_dear:
        return {}
    period = eqs.shaking_period or 1.0
    middle = int(np.argsort(pair.moments.V2)[trajectories.count // 2])
    block, lane = divmod(middle, BATCH)
    state = trajectories.state[block, :, lane]
    # sections are half a step after the kick that made the state
    phase = float(sections(trajectories)[-1, middle]) - 0.5 * trajectories.h / period
    size = round(period / trajectories.h)
    periods = math.ceil(pair.burn_in / period) + 2 * MULTIPLES
    if 4 * size * periods > MOST_STEPS:
        return {}
    motions = []
    for n in (size, 2 * size, 4 * size):
        shaking = forcing(eqs, period / n, n)
        assert shaking is not None, "it is driven"
        at = (round(phase * n) + np.arange(n * periods + 1)) % n
        path = trajectories.loaded.follow(state, np.zeros(n * periods), period / n, shaking[at])
        x, voltage = (
            path.samples[-2 * MULTIPLES * n :, columns].reshape(2, -1)
            for columns in ([0, 2], [1, 4])
        )
        before, now = (voltage**2).mean(axis=1)
        mean = pair.mean("V2")[0]
        if (
            abs(now - mean) >= SAME * mean or abs(now - before) >= SETTLED * before
        ):  # also where there is no voltage
            return {}
        motions.append([(x[1].std(), 0.0), peak(x[1]), peak(voltage[1])])
    details = dict[str, float]()
    scales = (units.length, units.length, units.volts)
    for name, values, unit in zip(
        (DISPLACEMENT, *PEAKS), zip(*motions, strict=True), scales, strict=True
    ):
        value, error = limit([float(level) for level, _ in values])
        details |= {name: value * unit, f"{name}_bias": (error + values[-1][1]) * unit}
    return details
