"""Messages of engines about their answers, and reasons why one does not support a scene.

Arguments of several messages: ``physical`` is True if times are in seconds, False if in 1/w0;
``within`` is the target relative error.
"""

import math
from collections.abc import Callable

from harvester.uncertainty.value import amount, clock, half95, in_percent

BESIDE = ", in addition to the power from white noise"


def _s(physical: bool) -> str:
    """The unit behind a time, for a nondimensional scene none."""
    return " s" if physical else ""


def _storage_not_settled(share: float | None) -> str:
    power = (
        "while the load is off" if share is None else f"by {in_percent(share)} of the load's power"
    )
    return f"the response is not stationary, as capacitors charge or discharge {power}: set a longer budget"


def _target_missed(
    within: float, budget: float, error: float | None, more: float, enough: float
) -> str:
    text = f"`within` {in_percent(within)} was not reached in {budget:g} s: "
    if error is None:
        return text + "the mean is not distinguishable from zero"
    # a fifth more, rounded up to two digits
    unit = 10.0 ** (math.floor(math.log10(1.2 * enough)) - 1)
    rounded = f"{math.ceil(1.2 * enough / unit) * unit:.12g}"
    return (
        text
        + f"the error is {in_percent(error)}; it would need at least {clock(max(more, 1.0))} more: `budget` {rounded}s"
    )


def _beyond_formula(engine: str, within: float, error: float | None) -> str:
    known = "is not known" if error is None else f"is estimated at {in_percent(error)}"
    return f"`within` {in_percent(within)} cannot be guaranteed: the error of {engine!r} {known}"


def _effort(
    within: float,
    step: float,
    bias: float,
    bias_error: float,
    duration: float,
    trajectories: int,
    physical: bool,
) -> str:
    return (
        f"`within` {in_percent(within)} chose a step of {step:.3g}{_s(physical)}, whose bias is {in_percent(bias, '.2f')} +- "
        f"{in_percent(half95(bias_error), '.2f')}, measured against twice the step on the same noise, and "
        f"{duration:.3g}{_s(physical)} of {trajectories} trajectories, from the spread of their means"
    )


def _cheapest(
    engine: str,
    why: str,
    error: float | None,
    within: float,
    formula: str,
    refused: str,
    **needed: float,
) -> str:
    stated = "" if error is None else in_percent(error)
    closest = "its error is the smallest" if stated else "no total error is known"
    reason = {
        "closest": f"none reaches {in_percent(within)}, and {closest}",
        "refused": f"'averaged' gives no answer: {refused}",
        "reached": f"its stated error, {stated}, is within {in_percent(within)}",
        "beyond": f"{formula!r} states an error of {stated}, more than {in_percent(within)}",
    }[why]
    others = " and ".join(
        f"{name.removeprefix('needed_')!r} would need about {clock(max(seconds, 1.0))}"
        for name, seconds in needed.items()
    )
    predicted = f" ({others})" if others else ""
    cheapest = "" if why == "closest" else " as the cheapest"
    return f"engine {engine!r} was chosen{cheapest}: {reason}{predicted}"


def _averaging_doubtful(error: float, why: str) -> str:
    reason = {
        "coupling": "coupling is strong",
        "noise": "parametric noise is strong compared with the damping",
        "impacts": "impacts absorb much of the energy in one cycle",
    }[why]
    return f"averaging is doubtful here (estimated error {in_percent(error, '.0f')}): {reason}; check with 'ensemble'"


def _rare_hops(
    wells: str,
    hops: int,
    time: float,
    formula_time: float | None,
    burn_in: float,
    steps: float,
    at_least: bool,
    physical: bool,
) -> str:
    second = " s" if physical else "/w0"
    formula = (
        ""
        if formula_time is None
        else f" (Kramers' formula: about one in {formula_time:.1g}{second})"
    )
    return (
        f"transitions between the wells at {wells} are rare: {hops} in {time:.2g}{second} of all trajectories "
        f"together{formula}, so a mean over the wells would need a burn-in of "
        f"{'at least' if at_least else 'about'} {burn_in:.1g}{second}, {steps:.1g} trajectory-steps; {BETWEEN_WELLS}"
    )


def _slow_switching(seconds: float, share: float, worse: float, physical: bool) -> str:
    takes = f"{amount(seconds, 's')}, " if physical else ""
    return (
        f"each inversion lasts {takes}{share:.2g} of a half-period, but engine 'ideal' treats it as instantaneous: the power "
        f"may be off by up to {worse:g} times that fraction; use engine 'spice', or a smaller L"
    )


def power_law(exponent: float, lowest: float, highest: float | None) -> str:
    """The law of large amplitudes, with the ends of its exponent; ``highest`` None: infinite."""
    law = f"q = {exponent:.2g} (from {max(lowest, 0.0):.2g} to {highest or 0.0:.2g})"
    if highest is None:
        law = f"q = {max(lowest, 0.0):.2g} or more"
    elif highest == lowest:
        law = f"q = {exponent:.3g}"
    return f"parametric noise makes large amplitudes A as likely as A^-(1 + q), {law}"


def _variance_missing(surely: bool, **law: float) -> str:
    return (
        f"V^2 {'has' if surely else 'may have'} no finite variance, so the spread of a sample does not determine the error "
        f"of its mean: {power_law(**law)}, and a variance needs a q above 4"
    )


def _unserved_effects(engine: str, effects: str, linear_only: bool, linear: bool) -> str:
    who = f"engine {engine!r}{', for linear equations,' if linear_only else ''}"
    return _unknown_effects(who, effects, "engine 'ensemble'" + (f", or {EXACT}" if linear else ""))


def _slow_circuit(constant: float, frequency: float | None) -> str:
    time = (
        f"{constant:.3g}/w0"
        if frequency is None
        else f"{constant:.3g} s, where w0 is {frequency:.4g} rad/s,"
    )
    return (
        f"the cause is the time constant R C = {time} of load and storage capacitor, which limits the averaging: a "
        "smaller capacitor, still long compared with the period of the mass, gives nearly the same mean power sooner"
    )


def _unknown_effects(who: str, effects: str, instead: str) -> str:
    # a damping is named by its key, of which damping_v has no word that is shorter
    words = effects.split(" ")
    effects_named = " ".join(
        word if word.startswith("damping_") else word.replace("_", " ") for word in words
    )
    return f"{who} cannot model {effects_named}: use {instead}"


EXACT = "'exact', which supports all linear scenes"
BETWEEN_WELLS = "the mean is only known to lie between those of the wells"
LESS = (
    "less parametric noise (stiffness_noise, D22), more damping, or damping that grows (damping_x2)"
)
MESSAGES: dict[str, str | Callable[..., str]] = {
    # powers that no device gives
    "negative_power": lambda power, unit: (
        f"a negative mean power ({amount(power, unit)}) is impossible for a passive load: run more or longer trajectories"
    ),
    "open_balance": "energy balance does not close: {share:.2%} of the power is unaccounted for ({most:.2%} expected from sampling and "
    "time-step errors); the mean power may be off by as much: rerun with half the step",
    "power_above_bound": lambda power, bound, unit, why: (
        f"a mean power of {amount(power, unit)} exceeds the upper bound of this excitation for any device, {amount(bound, unit)} "
        f"({why}): run more or longer trajectories"
    ),
    "bound_by_white_noise": "mass times one-sided power spectral density over 4",
    "bound_by_damping": lambda white: (
        f"mean square of mass times acceleration, over 4 times the least damping{BESIDE * white}"
    ),
    "bound_by_stroke": lambda white: (
        f"mass times half of the distance between the stops times the mean rate of change of the acceleration"
        f"{BESIDE * white}"
    ),
    # why an engine cannot support a scene
    "needs_resistance": "engine {engine!r} needs a load resistance, but the load is netlist {netlist!r}: use "
    "engine 'spice', or 'ideal' for one of the package's netlists",
    "needs_netlist": "engine {engine!r} needs a netlist load, but this scene has none: use engine 'ensemble'",
    "elements_along_paths": "the power of each element is summed over the circuit's own steps on {paths} trajectories of {time:.3g}/w0 of the compiled circuit: its error includes sampling only",
    "needs_compiled_circuit": "engine {engine!r} needs a netlist of supported elements, but {why}: use engine 'spice'",
    "needs_ideal_circuit": "engine {engine!r} needs one of the netlists {known}, but the load is {netlist!r}: use "
    "engine 'spice'",
    "needs_drive_or_noise": "engine {engine!r} needs a harmonic excitation alone, or white or coloured noise alone and one "
    "resting position: use engine 'spice'",
    "slow_serves": "engine {other!r} supports this scene and needs seconds: a chip behind a "
    "rectifier changes slowly",
    "late_where_slow_serves": "{why}; engine {other!r} supports this scene and needs seconds",
    "needs_chip": "engine {engine!r} needs a diode bridge at the electrodes and a chip behind it: use engine 'spice'",
    "needs_load": "engine {engine!r} needs a load, but the circuit is open: use engine 'ensemble'",
    "needs_shaking": "engine {engine!r} starts at rest and needs external noise, or a base that moves: use engine "
    "'ensemble'",
    "unknown_effects": _unknown_effects,
    "beyond_ngspice": lambda effects: _unknown_effects(
        "lock-step with ngspice", effects, "engine 'ensemble'"
    ),
    "unserved_effects": _unserved_effects,
    # formulas
    "closed_form": "no sampling or model error: the linear equations are solved exactly (up to rounding)",
    "closed_form_joined": "no sampling error: the linear equations are solved exactly; the error is that of "
    "the unrecorded join between the recording's end and its beginning",
    "theory": "no sampling error: a formula; the model error is estimated from its small parameters",
    "published_formula": "no sampling error: a formula; it does not estimate its model error",
    "published_stop": "with a stop the published V, harmonic about zero, is wrong: the true V has no mean and only "
    "even harmonics, so E[V^2] and the power come out too high, about four times in the Entropy 2026 paper: use "
    "'averaged', 'ensemble' or 'spice'",
    "published_open_circuit": "open circuit with a stop: this is E[V^2] of a V that begins with V = x, including its "
    "mean; 'averaged' gives the variance of V about that mean",
    "averaging_doubtful": _averaging_doubtful,
    "open_circuit_variance": "open circuit: this is the variance of V about its mean, which keeps its initial value; "
    "engines that sample begin with V = x, and give E[V^2] including that mean",
    "restitution_untested": "the error was not measured for a restitution coefficient of {restitution:g}, below "
    "{least}",
    "nothing_shakes": "the response dies out: the base is at rest",
    "beyond_formula": _beyond_formula,
    "cheapest": _cheapest,
    # the density
    "density_solved": "no sampling: the probability density is solved on a mesh; its error has parts for mesh, modes and box",
    "density_not_reached": "`within` {within!p} was not reached: the error is {error!p} (mesh {mesh:.1g}, modes "
    "{modes:.1g}, box {box:.1g})",
    "density_not_resolved": "the density is not resolved: its error would be {error!p} (mesh {mesh:.1g}, modes "
    "{modes:.1g}, box {box:.1g}); use engine 'ensemble'",
    "density_not_solved": "the equations of the density were not solved: use engine 'ensemble'",
    "quick_in_budget": "the {budget!t} that 'slow' had of the `budget` were too short for its whole answer: this is its quick "
    "one, from few voltages and long steps",
    "density_needs_time": "no density in a `budget` of {budget:.3g} s: it needs at least about {seconds:.2g} s: give "
    "a longer one, or use engine 'ensemble'",
    "density_without_slow_decay": "no decay is slower than all others: the density comes to rest in waves",
    "densities_explained": "a coarser mesh, and half the terms for the voltage, change no density by more than {error:.1g} of its peak",
    "passages_counted": "the first passages of the voltage are counted on a trajectory of length {time:.3g}: the modes of the "
    "density do not resolve them",
    "density_without_box": "no box contains the density: use engine 'ensemble'",
    "needs_noise": "engine {engine!r} needs base noise (acceleration_psd, D11), without which the density does not exist: "
    "use engine 'ensemble'",
    "sticks_to_stop": "engine {engine!r} does not support coloured noise with a dissipative rigid stop: the "
    "mass comes to rest on it and has no density there: use engine 'ensemble'",
    # moments that parametric noise takes away
    "grows_by_stiffness_noise": "the response grows without bound: parametric noise feeds more energy than damping "
    f"dissipates; give {LESS}",
    "mean_infinite": lambda **law: (
        "the means of V^2 and of the power do not exist: "
        f"{power_law(**law)}, and they need a q above 2, so that the mean of a sample grows with its size; give {LESS}"
    ),
    "mean_may_be_infinite": lambda **law: (
        f"the means of V^2 and of the power may not exist: {power_law(**law)}, and they need a q above 2"
    ),
    "variance_missing": _variance_missing,
    # sampling
    "open_circuit": "open circuit: V keeps its initial offset, and the load power is zero",
    "starts_agree": "no sampling error: nothing is random, and all starts tried lead to the same "
    "response; a nonlinear device may have another, which other starts reach",
    "starts_differ": "trajectories differ in {of}, from {low:.3g} to {high:.3g} times the mean: the scene has "
    "several responses, a chaotic one, or one that settles late; the mean is over the starts",
    "rare_hops": _rare_hops,
    "between_wells": "the model error is half the distance between the wells",
    "circuit_not_converged": "a fraction {share:.1g} of the circuit's steps did not converge and kept the previous state: "
    "the mean may be wrong; use engine 'spice'",
    "circuit_fails": "a share of {share:.1g} of the circuit's steps did not converge, at netlist element {elements}: give "
    "it a series resistance or a capacitance, or use engine 'spice'",
    "switch_chatters": "switch {elements} of the netlist opens and closes too often for the shortest step: give its model a hysteresis (vh, "
    "or ih of a current-controlled switch) larger than the jump of its control at a change",
    "compiled_circuit": "the difference from ngspice is not measured: compare with 'spice'",
    "storage_not_settled": _storage_not_settled,
    "difference_measured": "model error: largest difference (95 %) from runs of ngspice on the same motion",
    "steady_difference": "model error: distance from ngspice's own response at the same step",
    "ideal_difference": "model error: largest difference (95 %) between ideal and compiled circuit on the same noise, "
    "plus 0.5 % for the compiled circuit",
    "compiled_beyond": "`within` {within!p} was not reached: the difference from ngspice is "
    "{error!p}; use engine 'spice'",
    "elements_beyond": "`within` {within!p} was not reached: the error of ideal diodes and switches is {error!p}; use "
    "engine 'compiled' or 'spice'",
    "ideal_elements": "the error of ideal diodes and switches is not measured: compare with 'spice'",
    "slow_switching": _slow_switching,
    "low_voltage": "the voltage is only {volts:.2g} V rms, comparable to the diode and switch drops that engine 'ideal' ignores (SECE under noise: power 44 % too high at 0.7 V, 12 to 15 % at 3.5 V): use engine 'compiled' or 'spice'",
    "slow_circuit": _slow_circuit,
    # towards a target
    "effort": _effort,
    "target_missed": _target_missed,
    "within_not_promised": "`within` {within!p} cannot be guaranteed: the error of {unknown} is not known",
    "within_between_wells": "`within` {within!p} cannot be guaranteed: " + BETWEEN_WELLS,
    "needs_smaller_step": "`within` {within!p} needs a step below `dt` {dt:g}",
}
