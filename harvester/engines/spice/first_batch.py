"""The first runs of ngspice for an answer: how long each lasts, how many there are, and whether anyone would wait."""

import numpy as np

from harvester.engines.ensemble import Ensemble
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import Progress
from harvester.engines.spice.means import FEWEST
from harvester.engines.spice.runs import Runs, fewest_pairs
from harvester.engines.spice.setup import SpiceSetup
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.uncertainty.value import two_digits

BLOCK = 32.0  # nondimensional time of a block, with controls of its own: five periods or so
TRAJECTORIES = 16
STEPS = 2_000_000  # of all trajectories alone, unless a duration is given
PATIENCE = 3e7  # steps of all ngspice runs together: a minute to some minutes
SHORTEST = 30.0  # s: in a smaller budget a few runs may not end; steps are counted for this
STEPS_A_SECOND = 1e5  # that a budget counts for: of a netlist on a slow machine
WINDOWS = 3.0  # burn-ins that a trajectory goes on for, paired or towards a target
TOGETHER = 0.5  # the same where it stays on one trajectory with its pair
# nondimensional duration of short runs, and how many there are at first
SHORT = 8.0
SHORT_RUNS = 64
BLOCKS = 5.0  # that it goes on for at least from settled states, where the burn-in is short


def first_batch(
    options: MonteCarloOptions,
    problem: Problem,
    setup: SpiceSetup,
    paired: bool,
    controlled: bool,
    deadline: float,
    progress: Progress | None,
) -> Runs:
    """As many runs as the target is likely to need at least; those of a later batch are as long.

    Raises SimulationError if they would make more steps than the budget has time for, or
    `PATIENCE`.
    """
    n_steps = setup.n_steps(_duration(options, problem, setup, paired))
    blocks = 1
    if setup.has_controls and controlled:
        blocks = max(round((n_steps * setup.device.h - setup.settling) / BLOCK), 1)
    fewest = fewest_pairs(number(options.within), blocks) if paired else FEWEST
    count = options.trajectories or (TRAJECTORIES if options.within is None else fewest)
    count = SHORT_RUNS if setup.short else max(count, fewest) if paired else count
    burn_in_alone = options.duration is not None  # for a duration is the user's own
    steps = count * (setup.burn_in / setup.device.h if burn_in_alone else n_steps)
    _check_patience(steps, number(options.budget), problem, setup)
    runs = Runs(
        setup=setup,
        paired=paired,
        blocks=blocks,
        n_steps=n_steps,
        seed=np.random.SeedSequence(options.seed),
        progress=progress,
        step_is_fixed=options.dt is not None,
        deadline=deadline,
    )
    runs.run_first(count)
    return runs


def _duration(
    options: MonteCarloOptions, problem: Problem, setup: SpiceSetup, paired: bool
) -> float:
    """The nondimensional duration of a trajectory after its burn-in."""
    if setup.short:
        return SHORT
    if options.duration is not None:
        return (number(options.duration) or 0.0) * problem.units.frequency
    if paired or not problem.equations.is_random or options.within is not None:
        windows = TOGETHER if paired and setup.stays_together else WINDOWS
        return max(windows * setup.burn_in, 0.0 if setup.starts is None else BLOCKS * BLOCK)
    return max(STEPS / TRAJECTORIES * setup.device.h, 4.0 * setup.burn_in)


def _check_patience(
    steps: float, budget: float | None, problem: Problem, setup: SpiceSetup
) -> None:
    """Refuse runs that nobody asked for, and mostly for their burn-in, in a SimulationError."""
    most = PATIENCE if budget is None else STEPS_A_SECOND * max(budget, SHORTEST)
    if steps > most:
        instead = "" if Ensemble.refusal(problem) else "use engine 'ensemble', or "
        last = f"{setup.burn_in / problem.units.frequency:.3g}{' s' * problem.physical}"
        raise SimulationError(
            f"the ngspice runs would need {steps:.1e} steps, as transients last {last}: {instead}give fewer "
            f"`trajectories`, a longer `dt` or a `budget` of more than {two_digits(steps / STEPS_A_SECOND)} s"
        )
