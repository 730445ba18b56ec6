"""What engines say of their answers, and why one cannot serve a scene.

Arguments that several messages have: ``physical`` says whether times are in seconds, else in 1/w0; ``within`` is the
relative error that was asked for.
"""

import math
from collections.abc import Callable

from harvester.uncertainty.value import amount, clock, half95, in_percent

BESIDE = ", beside what white noise gives"


def _s(physical: bool) -> str:
    """The unit behind a time, for a nondimensional scene none."""
    return " s" if physical else ""


def _target_missed(within: float, budget: float, error: float | None, more: float, enough: float) -> str:
    text = f"`within` {in_percent(within)} was not reached in {budget:g} s: "
    if error is None:
        return text + "the mean is not known from zero"
    unit = 10.0 ** (math.floor(math.log10(1.2 * enough)) - 1)  # a fifth more, rounded up to two digits
    rounded = f"{math.ceil(1.2 * enough / unit) * unit:.12g}"
    return (
        text
        + f"the error is {in_percent(error)}; it would take at least {clock(max(more, 1.0))} more: `budget` {rounded}s"
    )


def _beyond_formula(engine: str, within: float, error: float | None) -> str:
    known = "is not known" if error is None else f"is estimated at {in_percent(error)}"
    return f"`within` {in_percent(within)} cannot be promised: the error of {engine!r} {known}"


def _effort(
    within: float, step: float, bias: float, bias_error: float, duration: float, trajectories: int, physical: bool
) -> str:
    return (
        f"`within` {in_percent(within)} chose a step of {step:.3g}{_s(physical)}, whose bias is {bias:.2%} +- "
        f"{half95(bias_error):.2%}, measured against twice the step on the same noise, and "
        f"{duration:.3g}{_s(physical)} of {trajectories} trajectories, for the spread of their means"
    )


def _cheapest(engine: str, why: str, error: float | None, within: float, formula: str, refused: str) -> str:
    stated = "" if error is None else in_percent(error)
    reason = {
        "netlist": "the load is a netlist, and 'ideal' knows the error of its model only after its run",
        "refused": f"'averaged' cannot tell: {refused}",
        "reached": f"the error that it states, {stated}, is within {in_percent(within)}",
        "beyond": f"{formula!r} states an error of {stated}, more than {in_percent(within)}",
    }[why]
    return f"engine {engine!r} was chosen as the cheapest: {reason}"


def _averaging_doubtful(error: float, why: str) -> str:
    reason = {
        "coupling": "coupling is strong",
        "noise": "noise of the stiffness is strong beside the damping",
        "impacts": "impacts take much of the energy in one cycle",
    }[why]
    return f"averaging is doubtful here (estimated error {error:.0%}): {reason}; check with 'ensemble'"


def _rare_hops(
    places: str,
    hops: int,
    time: float,
    formula_time: float | None,
    burn_in: float,
    steps: float,
    at_least: bool,
    physical: bool,
) -> str:
    second = " s" if physical else "/w0"
    formula = "" if formula_time is None else f" (Kramers' formula: about one in {formula_time:.1g}{second})"
    return (
        f"hops between the wells at {places} are rare: {hops} in {time:.2g}{second} of all trajectories "
        f"together{formula}, so that a mean over the wells would take a burn-in of "
        f"{'at least' if at_least else 'about'} {burn_in:.1g}{second}, {steps:.1g} trajectory-steps; {BETWEEN_WELLS}"
    )


def _slow_switching(seconds: float, share: float, worse: float, physical: bool) -> str:
    takes = f"{amount(seconds, 's')}, " if physical else ""
    return (
        f"a switching takes the coil {takes}{share:.2g} of half a period, which ideal switches do at once: the power "
        f"may be off by up to {worse:g} times that part of it; use engine 'spice', or a smaller L"
    )


def power_law(exponent: float, lowest: float, highest: float | None) -> str:
    """The law of large amplitudes, with the ends of its exponent; ``highest`` None: infinite."""
    law = f"q = {exponent:.2g} (from {max(lowest, 0.0):.2g} to {highest or 0.0:.2g})"
    if highest is None:
        law = f"q = {max(lowest, 0.0):.2g} or more"
    elif highest == lowest:
        law = f"q = {exponent:.3g}"
    return f"noise of the stiffness makes large amplitudes A as likely as A^-(1 + q), {law}"


def _variance_missing(surely: bool, **law: float) -> str:
    return (
        f"V^2 {'has' if surely else 'may have'} no finite variance, so that a sample's spread does not state the error "
        f"of its mean: {power_law(**law)}, and a variance needs a q above 4"
    )


def _unserved_effects(engine: str, effects: str, linear_only: bool, linear: bool) -> str:
    who = f"engine {engine!r}{', for linear equations,' if linear_only else ''}"
    return _unknown_effects(who, effects, "engine 'ensemble'" + (f", or {EXACT}" if linear else ""))


def _slow_circuit(constant: float, frequency: float | None) -> str:
    time = f"{constant:.3g}/w0" if frequency is None else f"{constant:.3g} s, where w0 is {frequency:.4g} rad/s,"
    return (
        f"the cause is the time constant R C = {time} of load and storage capacitor, which a mean must outlast: a "
        "smaller capacitor that still outlasts the mass's periods gives nearly the same mean power, sooner"
    )


def _unknown_effects(who: str, effects: str, instead: str) -> str:
    words = effects.split(" ")  # a damping is named by its key, of which damping_v has no word that is shorter
    effects_named = " ".join(word if word.startswith("damping_") else word.replace("_", " ") for word in words)
    return f"{who} cannot model {effects_named}: use {instead}"


EXACT = "'exact', which serves all linear scenes"
BETWEEN_WELLS = "the mean is known between those of the wells only"
LESS = "less noise of the stiffness (stiffness_noise, D22), more damping, or one that grows (damping_x2)"
MESSAGES: dict[str, str | Callable[..., str]] = {
    # powers that no device gives
    "negative_power": lambda power, unit: (
        f"a mean power below 0, {amount(power, unit)}, is none that a load takes: its runs are too few or too short, or "
        "its error is larger than it says"
    ),
    "open_balance": "the energy does not add up: {share:.2%} of the power is not accounted for, where the errors of sampling "
    "and step explain {most:.2%}; the mean power may be as wrong: compare with half of the step",
    "power_above_bound": lambda power, bound, unit, why: (
        f"a mean power of {amount(power, unit)} is more than this shaking gives any device, {amount(bound, unit)} "
        f"({why}): its runs are too few or too short, or its error is larger than it says"
    ),
    "bound_by_white_noise": "mass times one-sided density over 4",
    "bound_by_damping": lambda white: (
        f"mean square of mass times acceleration, over 4 times the least damping{BESIDE * white}"
    ),
    "bound_by_stroke": lambda white: (
        f"mass times half of the room between the stops times the mean rate of change of the acceleration"
        f"{BESIDE * white}"
    ),
    # why an engine cannot serve a scene
    "needs_resistance": "engine {engine!r} must have a load resistance, but the load is netlist {netlist!r}: use "
    "engine 'spice', or 'ideal' for one of the package's netlists",
    "needs_netlist": "engine {engine!r} must have a netlist as load, but has none: use engine 'ensemble'",
    "elements_along_paths": "what each element takes is added up over the circuit's own steps on {paths} path(s) of {time:.3g}/w0 of the compiled circuit: of its error sampling alone is counted",
    "needs_compiled_circuit": "engine {engine!r} must have a netlist of elements that it knows, but {why}: use engine 'spice'",
    "needs_ideal_circuit": "engine {engine!r} must have one of the netlists {known}, but the load is {netlist!r}: use "
    "engine 'spice'",
    "needs_drive_or_noise": "engine {engine!r} must have a harmonic drive alone, or white or coloured noise alone and one "
    "resting place, but has not: use engine 'spice'",
    "needs_chip": "engine {engine!r} must have a bridge of diodes at the electrodes and a chip behind it, but has not: "
    "use engine 'spice'",
    "needs_load": "engine {engine!r} must have a load, but the circuit is open: use engine 'ensemble'",
    "needs_shaking": "engine {engine!r} starts at rest and needs external noise, or a base that moves: use engine "
    "'ensemble'",
    "unknown_effects": _unknown_effects,
    "unserved_effects": _unserved_effects,
    # formulas
    "closed_form": "no sampling error and no model: the equations are linear and solved as they stand, but for "
    "rounding",
    "closed_form_joined": "no sampling error: the equations are linear and solved as they stand; the error is that of "
    "the join between the record's end and its beginning, which nobody recorded",
    "theory": "no sampling error: a theory; the model's error is estimated from its small parameters",
    "published_formula": "no sampling error: a formula; its model error is not known from within",
    "published_stop": "with a stop the published V, harmonic about zero, is wrong: the true V has no mean and only "
    "even harmonics, so E[V^2] and the power come out too high, about four times at the paper's parameters: use "
    "'averaged', 'ensemble' or 'spice'",
    "published_open_circuit": "open circuit with a stop: this is E[V^2] of a V that begins with V = x, so with its "
    "mean; 'averaged' tells the variance of V about that mean",
    "averaging_doubtful": _averaging_doubtful,
    "open_circuit_variance": "open circuit: this is the variance of V about its mean, which stays what it began with; "
    "engines that sample begin with V = x, and tell E[V^2] with that mean",
    "restitution_untested": "the error was not measured for a restitution coefficient of {restitution:g}, below "
    "{least}",
    "nothing_shakes": "the response dies out: nothing shakes the base",
    "beyond_formula": _beyond_formula,
    "cheapest": _cheapest,
    # the density
    "density_solved": "no sampling: the density itself is solved, and its error is that of the mesh, of the modes and "
    "of the box",
    "density_not_reached": "`within` {within!p} was not reached: the error is {error!p} (mesh {mesh:.1g}, modes "
    "{modes:.1g}, box {box:.1g})",
    "density_not_resolved": "the density is not resolved: its error would be {error!p} (mesh {mesh:.1g}, modes "
    "{modes:.1g}, box {box:.1g}); use engine 'ensemble'",
    "density_not_solved": "the equations of the density were not solved: use engine 'ensemble'",
    "density_needs_time": "no density in a `budget` of {budget:.3g} s, as it takes about {seconds:.2g} s at least: give "
    "a longer one, or use engine 'ensemble'",
    "density_without_slow_decay": "no decay is slower than all others: the density comes to rest in waves",
    "densities_explained": "a coarser mesh, and half the terms for the voltage, change no density by more than {error:.1g} of its peak",
    "passages_counted": "the first passages of the voltage are counted, on a path of length {time:.3g}: the modes of the "
    "density do not resolve them",
    "density_without_box": "no box was found that holds the density: use engine 'ensemble'",
    "needs_noise": "engine {engine!r} must have noise of the base (acceleration_psd, D11), without which there is no "
    "density to solve: use engine 'ensemble'",
    "sticks_to_stop": "engine {engine!r} cannot serve coloured noise beside a rigid stop that takes energy, on which the "
    "mass comes to rest, so that it has no density there: use engine 'ensemble'",
    # moments that noise of the stiffness takes away
    "grows_by_stiffness_noise": "the response grows without bound: noise of the stiffness feeds more than damping "
    f"takes; give {LESS}",
    "mean_infinite": lambda **law: (
        "the means of V^2 and of the power do not exist: "
        f"{power_law(**law)}, and they need a q above 2, so that the mean of a sample grows with its size; give {LESS}"
    ),
    "mean_may_be_infinite": lambda **law: (
        f"the means of V^2 and of the power may not exist: {power_law(**law)}, and they need a q above 2"
    ),
    "variance_missing": _variance_missing,
    # sampling
    "open_circuit": "open circuit: V keeps the offset that it started with, and takes no power",
    "starts_agree": "no sampling error: nothing is random, and all starts that were tried come to the same "
    "response; a nonlinear device may have another, which other starts reach",
    "starts_differ": "trajectories differ in {of}, from {low:.3g} to {high:.3g} times the mean: the drive has "
    "several responses, a chaotic one, or one that settles late; the mean is over the starts",
    "rare_hops": _rare_hops,
    "between_wells": "the error of the model is half the distance between the wells",
    "circuit_not_converged": "a share of {share:.1g} of the circuit's steps did not converge, in which it was held as it was: "
    "the mean may be wrong; use engine 'spice'",
    "circuit_fails": "a share of {share:.1g} of the circuit's steps did not converge, at netlist element {elements}: give "
    "it a series resistance or a capacitance, or use engine 'spice'",
    "compiled_circuit": "the difference from ngspice is not measured: compare with 'spice'",
    "difference_measured": "the error of the model is what runs of ngspice on the same motion differ by at most (95 %)",
    "steady_difference": "the error of the model is how far ngspice's own response at the same step is from this one",
    "ideal_difference": "the error of the model is what ideal diodes and switches differ by from the compiled circuit "
    "on the same noise, at most (95 %), and .5 % for that circuit",
    "elements_beyond": "`within` {within!p} was not reached: the error of ideal diodes and switches is {error!p}; use "
    "engine 'compiled' or 'spice'",
    "ideal_elements": "the error of ideal diodes and switches is not known from within: compare with 'spice'",
    "slow_switching": _slow_switching,
    "low_voltage": "the voltage is {volts:.2g} V rms, little beside what diodes and an opening switch leave: of a SECE so driven by noise engine 'ideal' gave 44 % too much power at 0.7 V, 12 to 15 % at 3.5 V, with one mode as with two: use engine 'compiled' or 'spice'",
    "slow_circuit": _slow_circuit,
    # towards a target
    "effort": _effort,
    "target_missed": _target_missed,
    "within_not_promised": "`within` {within!p} cannot be promised: the error of {unknown} is not known",
    "within_between_wells": "`within` {within!p} cannot be promised: " + BETWEEN_WELLS,
    "needs_smaller_step": "`within` {within!p} needs a step below `dt` {dt:g}",
}
