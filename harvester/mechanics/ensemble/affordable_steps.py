"""Whether trajectories that are still to run fit into a budget, by their steps per second."""

import time

from harvester.errors import CircuitError, SimulationError, UnboundedResponseError
from harvester.machine.cores import cores
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.uncertainty.value import two_digits

FIRST_WINDOW = 32.0  # time units of the first window of a burn-in: about five periods
MOST_STEPS = 2e10  # trajectory-steps of a burn-in without a budget: half a minute or so
STEPS_A_SECOND = 3e8  # that are counted on at most, and until their rate is measured
MEASURED = 0.1  # seconds after which the rate is known
# steps that one of a compliant stop counts for, which looks for the contact's ends
COMPLIANT = 16.0
OWN_KERNEL = 64.0  # steps that one with a circuit's own kernel counts for
TIMED = 0.2  # share of the budget, after which a pace is known


def check_cost(
    trajectories: Trajectories,
    length: float,
    budget: float | None,
    begin: float,
    before: float = 0.0,
) -> None:
    """Refuse a window of a ``length`` beyond the budget, or without one, beyond `MOST_STEPS`.

    The rate of steps is counted from ``begin``, the budget from ``before`` seconds earlier.

    Raises SimulationError, which states a remedy.
    """
    beyond, steps, seconds = exceeds(
        trajectories, length, budget if budget is None else budget - before, begin
    )
    if beyond:
        raise SimulationError(
            f"the start is not forgotten after {trajectories.time:g}/w0, and a burn-in of {length:g}/w0 more "
            f"would need {steps:.1e} trajectory-steps of {trajectories.h:.2g}/w0: give a longer `dt`, fewer "
            f"`trajectories`, or a `budget` of more than {two_digits(before + seconds)} s"
        )


def check_pace(trajectories: Trajectories, budget: float | None) -> None:
    """Refuse a first window that is beyond the budget at the measured pace of an own circuit.

    A circuit that switches often has ten thousand steps in each of the mass.  A block from rest is
    timed until the window fits or `TIMED` of the budget is over, as its beginning may be slow.

    Raises SimulationError, which states a remedy.
    """
    if budget is None or not trajectories.loaded.is_dear:
        return
    block = trajectories.brief(trajectories.h)
    begin = time.perf_counter()
    spent = 0.0
    while spent < TIMED * budget:
        try:
            block.run(block.time or block.h)
        except (CircuitError, UnboundedResponseError):  # the burn-in judges more steps
            return
        spent = time.perf_counter() - begin
        trajectories.rate = OWN_KERNEL * block.steps / spent * min(cores(), trajectories.blocks)
        if not exceeds(trajectories, FIRST_WINDOW, budget, time.perf_counter())[0]:
            return
    check_cost(trajectories, FIRST_WINDOW, budget, time.perf_counter())


def exceeds(
    trajectories: Trajectories, length: float, budget: float | None, begin: float
) -> tuple[bool, float, float]:
    """Whether a ``length`` more exceeds the budget, or `MOST_STEPS`.

    Also the number of all steps, with those of the ``length``, and the seconds for them.
    """
    weight = COMPLIANT if trajectories.eqs.stop_stiffness is not None else 1.0
    weight = max(weight, OWN_KERNEL if trajectories.loaded.is_dear else 1.0)
    made = weight * trajectories.steps
    more = weight * length / trajectories.h * trajectories.count
    spent = time.perf_counter() - begin
    rate = min(made / spent if spent > MEASURED else trajectories.rate, STEPS_A_SECOND)
    beyond = made + more > MOST_STEPS if budget is None else spent + more / rate > max(budget, 1.0)
    return beyond, made + more, max(spent, made / rate) + more / rate
