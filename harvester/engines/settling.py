"""How an engine settles its trajectories: a step short enough for shocks, the burn-in, and what remains to be told.

What a grid of steps cannot carry of a shock is left out, and beside a stop that moves the impacts.  The bias that is
measured at twice the step sees that only where both steps carry nearly all of it.
"""

from typing import TYPE_CHECKING

from harvester.averaging.kramers import hopping_rates
from harvester.equations.problem import Problem
from harvester.uncertainty.value import amount

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.hopping import Hopping
    from harvester.mechanics.ensemble.trajectories import Trajectories

STEPS = 8  # of a shock, at least
MOST = 64  # times shorter than the step of the response: a shock that is shorter is a blow, whatever its shape
ENOUGH = 10.0  # times 1/rate, of a burn-in that makes the shares of the wells stationary
BETWEEN = "the mean is known between those of the wells only"
HALF = "the error of the model is half the distance between the wells"


def settle(trajectories: "Trajectories", problem: Problem, budget: float | None) -> list[str]:
    """Burn in within a ``budget`` in seconds, as `harvester.mechanics.ensemble.burn_in.burn_in` does: its warnings.

    Under shocks the step is made shorter before, unless it is fixed; hops between unlike wells that are too rare for
    their shares to become stationary are a warning of their own.
    """
    from harvester.mechanics.ensemble.burn_in import burn_in

    shocks, h = problem.events, trajectories.h
    if shocks is not None and shocks.briefest is not None and not trajectories.step_is_fixed:
        shorter = max(shocks.briefest * problem.units.frequency / STEPS, h / MOST)
        if shorter < h:
            trajectories.restart(shorter)
    warnings = burn_in(trajectories, budget)
    if trajectories.hopping is not None:
        warnings.append(_rare_hops(trajectories.hopping, trajectories.h, problem))
    return warnings


def _rare_hops(hops: "Hopping", h: float, problem: Problem) -> str:
    """The warning that hops are rare, how rare, and what an answer would take at a step of ``h``."""
    eqs, unit = problem.equations, problem.units
    second, metre = (" s", "m") if problem.physical else ("/w0", "")
    places = " and ".join(f"x = {amount(x * unit.length, metre)}" for x in eqs.resting_places)
    whole = hops.count * hops.time / unit.frequency
    rates = None if problem.netlist is not None else hopping_rates(eqs)
    formula = (
        "" if rates is None else f" (Kramers' formula: about one in {1.0 / max(rates) / unit.frequency:.1g}{second})"
    )
    rate = hops.rate if hops.hops or rates is None else sum(rates)
    least = "at least" if rates is None and not hops.hops else "about"
    return (
        f"hops between the wells at {places} are rare: {hops.hops} in {whole:.2g}{second} of all trajectories "
        f"together{formula}, so that a mean over the wells would take a burn-in of {least} "
        f"{ENOUGH / rate / unit.frequency:.1g}{second}, {ENOUGH / rate / h * hops.count:.1g} "
        f"trajectory-steps; {BETWEEN}"
    )
