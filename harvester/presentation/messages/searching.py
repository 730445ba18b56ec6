"""Messages of searches for the largest power, and of studies of tolerances and of largest values."""

from collections.abc import Callable

from harvester.uncertainty.value import clock, duration

STAGES = {
    "scan": "the scan",
    "climb": "the climb to the peaks",
    "first scan": "the first scan of the range",
    "search": "the search for peaks",
    "refinement": "the final refinement",
}


def _budget_spent(
    budget: float, stage: str, evaluations: int, engine: str, typical: int, each: float | None
) -> str:
    takes = f"about {typical}" if evaluations < typical else "more here"
    cost = ", which first compiles it" if each is None else f", each of {clock(each)}"
    return (
        f"the budget of {duration(budget)} ended in {STAGES[stage]}, after {evaluations} evaluations by {engine!r}: "
        f"a search needs {takes}{cost}"
    )


def _search_cut_short(stage: str, budget: float) -> str:
    return f"the budget ended in {STAGES[stage]}: give a `budget` of more than {duration(budget)}"


def _best_circuit(best: str, alike: str) -> str:
    return f"the best circuit is {best}" + (
        f", statistically indistinguishable from {alike}" if alike else ""
    )


def _alike_designs(count: int) -> str:
    return (
        f"{count} more {'design is' if count == 1 else 'designs are'} statistically indistinguishable from the front (listed "
        "with --json)"
    )


def _by_blocks(blocks: int, time: float, unit: str, times: float) -> str:
    text = f"extrapolated from the largest values of {blocks} blocks of a trajectory of {duration(time) if unit else f'{time:.3g}'}"
    if times <= 1.0:
        return text
    return f"{text}, {times:.3g} times the counted time; whether the tail keeps its law beyond that is not known"


def _checked_by_judged_runs(runs: int, ratio: float) -> str:
    alone = runs == 1
    return (
        f"the level and its error are from {runs} {'run' if alone else 'runs'} with a measured "
        f"model error, whose {'power is' if alone else 'powers are'} {ratio:.4g} times the others"
    )


MESSAGES: dict[str, str | Callable[..., str]] = {
    # The surface of the power, and the interval of its highest place.
    "spread_not_followed": "the power changes so fast within the spread that {devices} devices predict that of others to "
    "{error!p} only: the power is that of more devices, but the values that the search found may not be the best; a "
    "narrower spread, or `tolerance` at other values, shows it",
    "spread_without_answers": "the power is that of the few devices in the search, since more cannot be computed: {why}",
    "spread_unresolved": "the power of the devices is known to {error!p} only: give a `budget` of more than {budget!t}",
    "no_power": "the load receives no power",
    "no_power_anywhere": "the load receives no power anywhere in the range",
    "same_power_everywhere": "the power is the same all over the range",
    "flat_within_model": "the power changes less over the range than the model error",
    "no_place_better": "no point is measurably better than another",
    "power_changes_little": "the power changes less than a quarter of `within`",
    "no_model_error": "no interval of the keys: the model error is not known, and so neither is the error of the optimum",
    "curvature_in_noise": "no interval of the keys: the curvature is not significant compared with the noise",
    "no_curvature": "no interval of the keys: by its second derivatives the power has no peak there",
    "by_gradient": "by the gradient of the power: intervals are its error over the curvature, which leaves out {third:.1g} "
    "of them",
    "not_narrowed": "no interval of the keys: the budget ended before it was narrowed",
    "search_cut_short": _search_cut_short,
    "interval_rough": "the budget ended before the interval of the optimum was found: it is rough",
    "other_peak_within_model": "another peak is as high within the model error: the interval contains both",
    "other_peak_within_sampling": "another peak is as high within the sampling error: see peaks",
    "end_of_range": "{key} is best at the {end} end of its range: the best may lie beyond",
    # The search.
    "budget_spent": _budget_spent,
    "ended_with_scan": "its search ended with the first scan, whose largest power is {share:.0%} of that of {top}",
    "surface_disagrees": "the surface gives {surface:.5g} at the optimum, and its own evaluation {own:.5g}",
    "evaluations_failed": "{failed} of {count} evaluations failed, the first: {first}",
    "evaluations_unsound": "{unsound} of {count} evaluations by {engine!r} had not settled, were cut off or have no "
    "known error: they count only if there is nothing else",
    # Circuits.
    "scan_fits": "the first point of all {circuits} circuits needed {seconds:.2g} s: at least {fit} of the {places} points of a "
    "scan fit into the budget",
    "best_circuit": _best_circuit,
    "no_best_circuit": "no best circuit: the budget ended before the first scan of {early} did",
    "circuits_cut_short": "the search of {names} was cut short",
    "circuit_unsound": "its power has not settled, was cut off or has no known error, so it is not compared with "
    "the others",
    "no_optimum": "no optimum: {why}",
    "coils_differ": "the circuits have inductors of different quality ({coils}), which explains part of the difference of their "
    "powers: give all of them one inductor, such as seven RB1314 of 1.5 mH in series (L=10.5m, Rcoil=11.9, Rcore=510k)",
    "error_unknown": "the error of {part} is not known",
    # Limits and parts that scatter.
    "power_of_most": "the power is that which all but {percent:.3g} % of the devices exceed",
    "unsafe_end": "values of peaks are at the unsafe end of their error",
    "limits_broken": "no point in the range meets all limits; the best one exceeds them by {broken:.2g} relatively",
    "limit_not_told": "cannot decide whether {limit} is met: the limit lies inside the interval of the long trajectory",
    "limit_broken_on_path": "{limit} is not met on the long trajectory",
    # Tolerances.
    "error_by_engine": "the power error is the engine's own estimate",
    "no_error_stated": "the power error is not known: the engine states none",
    "checked_by_runs": "the power error is from {runs} runs of {by!r}, whose powers are {ratio:.4g} times those of "
    "{engine!r}",
    "polynomial_stands_for_others": "a polynomial through {runs} runs, and {ends} at the ends, gives the rest",
    "linear_law": "first order: the power is linear in each key, by its gradient; curvature along the keys would "
    "change 95 % of the powers by less than {missed:.2g} and their mean by {mean:+.2g}, relatively, and two devices at the "
    "5 % and 95 % powers are off by up to {beyond:.2g} more ({runs} solutions)",
    "curved_law": "the power is a sum of one parabola per key, by {runs} runs of {engine!r} on the "
    "same noise; 95 % of devices are within {missed!p} of it, by {sampled} sampled devices and two "
    "at the 5 % and 95 % powers",
    "curved_law_at_corners": "the power is a sum of one parabola per key, by {runs} runs of "
    "{engine!r} on the same noise; by two devices at the 5 % and 95 % powers and the curvature "
    "along the keys, devices are within {missed!p} of it",
    "curved_law_unchecked": "the power is a sum of one parabola per key, by {runs} runs of "
    "{engine!r} on the same noise, which too few other devices check",
    "curved_law_and_rest": "the power is a sum of one parabola per key, by {runs} runs of "
    "{engine!r} on the same noise, and a polynomial through the rest of {sampled} sampled devices; "
    "95 % of devices are within {missed!p} of it",
    "checked_by_judged_runs": _checked_by_judged_runs,
    "over_budget": "the study needed {seconds!t} rather than {budget!t} (`budget`): every answer "
    "needs each key alone at both ends",
    "law_in_budget": "about {budget!t} in all (`budget`), with a first answer on the way, unless "
    "each key alone at both ends needs longer",
    "law_beyond_budget": "about {seconds!t} in all, rather than {budget!t} (`budget`): every answer "
    "needs each key alone at both ends",
    "judged_runs_failed": "no answer from {failed} of {count} runs with a measured model error, the "
    "first: {first}",
    "corners_failed": "no answer from {failed} of {count} devices at the 5 % and 95 % powers, the "
    "first: {first}",
    "first_answer": "first answer after {seconds!t}: 1 %, 50 % and 99 % of devices have a mean "
    "power below {low}, {middle} and {high}; {key} changes it most",
    "intervals_of_samples_alone": "the error of the engine is not known: intervals contain that of "
    "the samples alone",
    "intervals_are_wide": "the error of {engine!r} is not small compared with the spread of the "
    "powers: intervals are wide",
    "surface_misses": "the polynomial behind the sensitivity misses {share:.0%} of the variance: give "
    "more `samples`",
    "law_misses": "the law behind the sensitivity misses {share:.0%} of the variance: give a longer "
    "`budget`",
    "samples_outside": "{share:.1%} of the samples lie beyond those with an answer, and count as at their edge: the outer "
    "quantiles are those of that edge; give more `runs`",
    "samples_failed": "{failed} of {count} samples have no answer, the first: {first}",
    "samples_warned": "at {warned} of {count} samples: {first}",
    "no_shares_correlated": "no sensitivity: for correlated keys the fractions of the variance do "
    "not add up to it",
    "no_shares_library": "no sensitivity: SALib, which computes the fractions of the variance, is not "
    "installed: python -m pip install 'piezo-harvester[tolerance]'",
    "no_shares_constant": "no sensitivity: the power does not change over the spreads",
    # Largest values over a lifetime.
    "by_rice": "Rice's formula: the response is Gaussian; the model error reaches to independent passages",
    "by_first_passages": "the displacement alone, by the first-passage rate from the density, without sampling "
    "({solved} solutions); its modes do not resolve a voltage, whose levels are by Rice's formula or counted",
    "by_blocks": _by_blocks,
    "few_impacts": "{hit} of {blocks} blocks have an impact: too few for the largest impact speed of a lifetime",
    # Fronts.
    "two_aims": "{quantity} is to be {sense}, the power large",
    "alike_designs": _alike_designs,
    "nothing_to_choose": "there is nothing to choose: the highest power also has the best {quantity}",
    "front_cut_short": "the budget of {budget!t} ended after {done} of {places} points",
}
