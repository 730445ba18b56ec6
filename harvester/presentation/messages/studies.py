"""Messages of studies about their results."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "paper_published": "as published, the theory assumes a harmonic voltage about zero, which a stop does not have; in these "
    "figures it is off by up to {off!p} of the largest Monte Carlo value of a panel: do not design with it",
    "shaking_left_out": "external excitation is left out: the exponent is that of rest",
    "memory_longer_than_burn_in": "burn-in stopped at {longest:g}/w0, before the load's memory 1/mu ended",
    "impacts_lock_to_steps": "without noise the Monte Carlo's impacts can lock to the grid of steps: trust the exact value",
    "averaged_is_exact": "averaged is exact for this scene",
    "elasticity_explained": "normalised sensitivity: change of the power in per cent for a change of the key by 1 %",
    "keys_left_out": "the `budget` of {budget!t} ended before these keys were varied, which need {further!t} more: {keys}",
    "keys_unsettled": "differences of the power did not converge within {percent:g} % for these keys, whose errors are "
    "large: {keys}",
    "keys_failed": "no sensitivity in {keys}: {first}",
    "prediction_beyond_budget": "the devices of `predict` needed {seconds!t}, which the `budget` does not "
    "include",
    "no_sensitivity": "no sensitivity in the {left!t} of the `budget` that the power left: {why}",
    "step_bias_not_counted": "the time-step bias is not known for a custom netlist, and not counted",
    "setting_failed": "({setting}) failed: {why}",
    "did_not_run": "did not run: {why}",
    "stop_not_drawn": "the stop is not drawn: several displacements together meet it, not the displayed one alone",
    "ball_not_drawn": "the ball is not drawn: the figure shows the motion of the mass that carries it",
    "predicted_from_priors": "the interval of a real device has the spread of its parameters and {model:g} % of "
    "the power for the model error; the error of the computation is separate",
    "predicted_stop": "measured devices with a stop or a storage capacitor gave {percent:.3g} % of the "
    "computed power, which is the median factor of the model error",
    "predicted_guesses": "the origin of {quantities} is unknown: state a better one with `known`",
    "predicted_detuned": "the excitation has a fixed frequency, from which the resonance may deviate: "
    "frequency=tuned in `known` is for an excitation that follows the resonance",
    "one_path": "a single trajectory is not a mean: use harvester run for the power and its error",
    "shunt_converges": "ngspice did not converge: it does with {capacitance:.2g} F from each node to ground, {share:g} of "
    "the piezo's; its effect was not measured",
    "smaller_step_converges": "ngspice did not converge with a step of {asked}: it is {taken}",
}
