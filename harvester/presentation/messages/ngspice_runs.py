"""Messages of engine `spice` about its answers: runs of ngspice, periodic responses, and work beyond the budget.

``physical`` is True if times are in seconds, False if in 1/w0.
"""

from collections.abc import Callable

from harvester.uncertainty.value import duration, in_percent

MUCH = 10.0  # times the load power, beyond which it is not a matter of settling


def _runs_ended(ended: int, requested: int, paired: bool) -> str:
    said = f"{ended} of {requested} ngspice runs had ended when the `budget` was spent"
    alone = (
        ", too few to pair them with a cheap model: give a shorter `duration` or a larger `budget`"
    )
    return said + (alone if paired else "")


def _step_chosen(within: float, step: float, physical: bool) -> str:
    return f"`within` {in_percent(within)} chose a step of {step:.3g}{' s' if physical else ''}"


def _biases(followed: int, cheap_model: bool, tolerance_measured: bool, short: bool = False) -> str:
    if not cheap_model and not followed:
        return "the time-step bias is not known, as no ideal circuit supports the netlist: compare with half of `dt`"
    measured = "was measured against a tenth of it on the same motion"
    if not tolerance_measured:
        measured = "was not measured (for lack of time, or see the warning)"
    step = f"the largest consistent at 95 % with {followed} runs of ngspice and those of twice the step on the same noise"
    if cheap_model:
        step = "that of the circuit without ngspice"
    runs = "runs alone"
    if short:
        runs = "runs alone, short ones from states of the compiled circuit, whose difference from it is counted as a bias"
    return f"the time-step bias is {step}, that of ngspice's tolerance {measured}; the energy balance is of the ngspice {runs}"


def _returns(periods: int, from_before: bool) -> str:
    whence = "from that of the previous point" if from_before else "from rest"
    again = f"after {periods} periods of the excitation: subharmonic"
    if periods == 1:
        again = "after each period of the excitation"
    return f"no sampling error: nothing is random, and the response {whence} repeats {again}"


def _steady_within(within: float, error: float | None) -> str:
    return f"`within` {in_percent(within)} was not reached: the error {'is not known' if error is None else f'is {in_percent(error)}'}"


def _precision_unknown(why: str, steps: int, error: str) -> str:
    return {
        "lost": "the error is not known, as the response does not exist at another step or tolerance",
        "budget": "the error is not known, as the `budget` was spent before",
        "circuit": f"the error is not known: at another step or tolerance {error}",
        "step": f"the error is not known, as `dt` leaves fewer than {steps} steps to a period",
    }[why]


def _store_settles(time: float, physical: bool) -> str:
    settles = duration(time) if physical else f"{time:.3g}/w0"
    return f"the storage capacitor settles in {settles}; 'harvester charge' computes its way up"


def _mean_while_settling(
    covered: float, why: str, steady: bool, store: float | None = None, physical: bool = True
) -> str:
    said = f"the mean is over {duration(covered)} of ngspice, while still settling: {why}"
    several = "; a periodic response needs several such runs" if steady else ""
    return f"{said}{several}" + ("" if store is None else f"; {_store_settles(store, physical)}")


def _ngspice_left_out(resistive: bool, why: str) -> str:
    model = "its circuit made of ideal diodes and switches, as in engine 'ideal'"
    if resistive:
        model = "the same equations, as in engine 'ensemble'"
    return f"ngspice gave no answer in the `budget`, and the mean is that of {model}, without it: {why}"


def _several_responses(responses: int, from_rest: bool, engine: str) -> str:
    this = "this is the one from rest" if from_rest else "the mean is that of runs from rest"
    others = f"the others are found by engine {engine!r} from many starts"
    return f"the excitation has {responses} response{'s' * (responses > 1)}, and {this}; {others}"


def _not_periodic(
    cause: str = "", initial: bool = False, time: float = 0.0, physical: bool = True
) -> str:
    said = "no response repeats within 8 periods of the excitation, so runs are sampled"
    causes = {
        "store": _store_settles(time, physical),
        "rhythm": "a switch of the netlist may have a rhythm of its own",
        "oscillates": "transistors or controlled sources of the netlist may oscillate by themselves",
        "mass": "the motion of a nonlinear mass or one that hits a stop may be chaotic",
    }
    begins = "the runs begin at IC= or .ic, which may be far from the steady state; leave it out"
    why = [text for name, text in causes.items() if name == cause] + [begins] * initial
    return f"{said}: {'; '.join(why)}" if why else said


def _stores(share: float) -> str:
    said = "not stationary: mass, piezo and Csmooth still store"
    if share <= MUCH:
        return f"{said} {in_percent(share, '.0f')} as much as the load power"
    return (
        f"{said} more than {MUCH:g} times the load power, which is next to nothing: does a current "
        "find its way back to the piezo, which a single diode prevents, and is any element a short "
        "circuit?"
    )


def _paths_missed(within: float, error: float | None) -> str:
    known = (
        "the mean is not distinguishable from zero"
        if error is None
        else f"the error is {in_percent(error)}"
    )
    return (
        f"`within` {in_percent(within)} was not reached: {known}; give a smaller `step` or a longer "
        "`duration`"
    )


MESSAGES: dict[str, str | Callable[..., str]] = {
    # a model of the user's own
    "paths_missed": _paths_missed,
    "model_path": "one trajectory at one step: half of `step` and a tenth of `tolerance` show its error",
    "stand_in": "ngspice ran on a device of {mass:g} kg, w0 = {frequency:g} rad/s, Cp = {capacitance:g} F, theta = "
    "{coupling:.4g} N/V; results are nondimensional",
    "charging_cut_short": "burn-in stopped at {time:g} before the load's capacitor was charged: Rload Csmooth = "
    "{storage:g} s",
    "step_chosen": _step_chosen,
    "biases": _biases,
    "netlist_gives": "the netlist supplies {share:.0%} of the load power: that fraction is not harvested",
    "netlist_stores": _stores,
    # what the time did not allow
    "runs_ended": _runs_ended,
    "step_bias_not_measured": "the time-step bias could not be measured: {error}",
    "shunted": "ngspice did not converge: it does with {capacitance:.2g} F from each node to ground, {share:g} of the "
    "piezo's; its effect was measured with twice as much, together with that of the tolerance",
    "shunted_response": "ngspice did not converge: it does with {capacitance:.2g} F from each node to ground, {share:g} "
    "of the piezo's; its effect was measured with half as much, together with that of the tolerance",
    "tolerance_not_measured": "the effect of ngspice's tolerance could not be measured: {error}",
    "mean_while_settling": _mean_while_settling,
    "ngspice_left_out": _ngspice_left_out,
    # towards a target
    "needs_smaller_tolerance": "`within` {within!p} needs a smaller tolerance of ngspice, whose error is {error!p}: "
    "in Python, Spice(reltol={reltol:.0e})",
    "tolerance_chosen": "ngspice's relative tolerance is {reltol:.0e}: the error of its default is "
    "too large",
    "needs_smaller_dt": "`within` {within!p} needs a smaller `dt`: the time-step bias alone is too large",
    "steady_within": _steady_within,
    # responses to a steady excitation
    "not_periodic": _not_periodic,
    "comes_back": _returns,
    "precision_unknown": _precision_unknown,
    "steady_errors": "its error has parts for the time step, ngspice's tolerance and settling",
    "tolerance_reused": "that of the tolerance, which is negligible, was measured at a previous point",
    "others_not_sought": "other responses to the excitation are not sought",
    "search_not_settled": "a search for other responses, from other starts, did not settle",
    "no_other_response": "engine {engine!r} from many starts finds no other response",
    "several_responses": _several_responses,
    "only_from_rest": "only from rest",
    "lead_together": "{responses} responses without ngspice lead there",
    "not_followed": "ngspice does not follow it: {error}",
    "does_not_come_back": "ngspice finds none near it that repeats",
}
