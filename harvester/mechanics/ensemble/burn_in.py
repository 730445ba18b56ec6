"""Burn-in found from the data, and checked against what is known of the scene's memory.

Windows of doubled length follow each other until the means of E[x^2], E[x'^2] and E[V^2] in two neighbours
agree within two standard errors, and `LOADS` time constants of the load (1/mu; with a circuit, `CHARGINGS` of its
capacitor, kappa/mu, and its power agrees too) and `MEMORIES` correlation times of the energy, of V^2 and of the load's
power (found from the same window) have gone by.
"""

from typing import TYPE_CHECKING

from harvester.errors import SimulationError, UnboundedResponseError
from harvester.mechanics.kernels.bounds import friction_bounds, remedy, slowest, surely_bounded, unlike_wells
from harvester.mechanics.kernels.moments import Moments, correlation_time
from harvester.mechanics.kernels.shaking import is_random

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.trajectories import Ensemble

FIRST_WINDOW = 32.0  # time units: about five periods
LONGEST = 2e5  # time units: the burn-in ends here whatever the data say
LOADS = 5.0  # time constants of the load
CHARGINGS = 6.0  # time constants of a smoothing capacitor
TRANSIENTS = 1.2  # times MEMORIES: time constants of a small transient, of which e^-12 is left
MEMORIES = 10.0  # correlation times; from a window of half the burn-in they come out too short by a quarter at worst
PATIENCE = 2e10  # trajectory-steps of a burn-in: half a minute or so
STEPS_A_SECOND = 3e8  # that a --budget counts for: of a slow machine
COMPLIANT = 16.0  # steps that one of a compliant stop counts for, which looks for the contact's ends
GROWN = 1e12  # times the first energy: a growth that no response without a growing friction shows


def until_steady(many: "Ensemble") -> tuple[Moments, list[str]]:
    """Run until the start is forgotten: moments of the last window, and warnings.

    Raises
    ------
    UnboundedResponseError
        when the energy keeps growing.
    SimulationError
        when it is bounded, but still changes after `LONGEST`; or when that cannot be known in ``many.patience`` steps.
    """
    circuit, mu = many.circuit, many.eqs.mu
    load = CHARGINGS * circuit.memory if circuit is not None else LOADS / mu if mu is not None else 0.0
    length, before, first = FIRST_WINDOW, None, None
    while True:
        _check_patience(many, length)
        now = many.run(length)
        energy = now.mean("x2")[0] + now.mean("v2")[0]
        first = energy if first is None else first
        if energy > GROWN * max(first, 1e-300) and not friction_bounds(many.eqs):
            raise UnboundedResponseError(
                f"the response grows without bound: its energy grew {energy / first:.1e} times in "
                f"{many.time:g} time units; {remedy(many.eqs, many.h)}"
            )
        steady = before is not None and all(now.agrees(before, name) for name in ("x2", "v2"))
        response = MEMORIES * memory(many, now, length)
        loaded = before is not None and now.agrees(before, "V2") and now.agrees(before, "load")
        if steady and loaded and many.time >= max(load, response):
            return now, []
        if energy <= first / GROWN:
            return now, ["the response dies out: the scene has no noise that keeps it going"]
        if many.time >= LONGEST:
            if not steady:
                raise _not_stationary(many)
            return now, [_cut_short(many, load, response)]
        length, before = 2.0 * length, now


def memory(many: "Ensemble", window: Moments, length: float) -> float:
    """Correlation time of energy, V^2 or load power, the longest, from a window that ends now.

    Without noise that of a small transient (`slowest`), so that `MEMORIES` of it leave `TRANSIENTS` times as many.
    Between unlike wells also that of x, which sees hops however rare: trajectories begin in each of the wells.
    """
    if not is_random(many.eqs):
        return TRANSIENTS * slowest(many.eqs)
    x, v, voltage = many.snapshot()
    found = [correlation_time(window.x2 + window.v2, x * x + v * v, length)]
    found.append(correlation_time(window.V2, voltage * voltage, length))
    if unlike_wells(many.eqs):
        found.append(correlation_time(window.x, x, length))
    if many.circuit is not None:
        found.append(correlation_time(window.load, many.circuit.mu * many.state[:, 3].ravel() ** 2, length))
    return max(found)


def _check_patience(many: "Ensemble", length: float) -> None:
    """Refuse a window that would take more trajectory-steps than the caller has patience for."""
    weight = COMPLIANT if many.eqs.stop_stiffness is not None else 1.0
    steps = weight * (many.steps + length / many.h * many.trajectories)
    if steps > many.patience:
        raise SimulationError(
            f"the start is not forgotten after {many.time:g} time units, and a burn-in of {length:g} more would take "
            f"{steps:.1e} trajectory-steps of {many.h:.2g}/w0: give a longer `dt`, fewer `trajectories`, or a "
            f"`budget` above {steps / STEPS_A_SECOND:.2g}s"
        )


def _cut_short(many: "Ensemble", load: float, response: float) -> str:
    """Why a burn-in of `LONGEST` may be too short."""
    why = "no stationary voltage was seen"
    if load > many.time:
        constant = f"1/mu = {load / LOADS:g}" if many.circuit is None else f"R C w0 = {many.circuit.memory:g}"
        why = f"of the load's memory, {constant}, {why}"
    elif response > many.time:
        why = f"of the response's own memory, about {response / MEMORIES:.2g}, {why}"
    return f"burn-in stopped at {many.time:g} time units because {why}"


def _not_stationary(many: "Ensemble") -> SimulationError:
    after = f"its energy still changes after {many.time:g} time units"
    if surely_bounded(many.eqs):
        return SimulationError(f"no stationary response was seen: {after}; add damping, so that it settles sooner")
    return UnboundedResponseError(
        f"the response grows without bound: {after}; add damping or a stop with restitution below 1"
    )
