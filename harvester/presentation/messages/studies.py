"""What studies say of their results."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "shaking_left_out": "external shaking is left out: the exponent is that of rest, which it does not leave",
    "memory_longer_than_burn_in": "burn-in stopped at {longest:g}/w0, before the load's memory 1/mu ended",
    "impacts_lock_to_steps": "without noise the Monte Carlo's impacts can lock to the grid of steps: trust the exact value",
    "averaged_is_exact": "averaged is exact for this scene",
    "elasticity_explained": "one percent more of a key changes the power by its elasticity in percent, all else equal",
    "keys_left_out": "the `budget` of {budget!t} ended before these keys were varied, which take {further!t} more: {keys}",
    "no_sensitivity": "no sensitivity in the {left!t} of the `budget` that the power left: {why}",
    "step_bias_not_counted": "the bias of the step is not known for a netlist of one's own, and not counted",
    "setting_failed": "({setting}) failed: {why}",
    "did_not_run": "did not run: {why}",
    "stop_not_drawn": "the stop is not drawn: it is met by several displacements together, not by the one that is shown",
    "ball_not_drawn": "the ball is not drawn: what is shown is the motion of the mass that carries it",
    "one_path": "one path is no mean: for the power and its error, harvester run",
    "shunt_converges": "ngspice did not converge: it does with {capacitance:.2g} F from each node to ground, {share:g} of "
    "the piezo's; what that changes was not measured",
    "smaller_step_converges": "ngspice did not converge with a step of {asked}: it is {taken}",
}
