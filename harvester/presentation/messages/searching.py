"""What searches for the largest power, and studies of tolerances and of largest values, say of their results."""

from collections.abc import Callable

from harvester.uncertainty.value import clock, duration

STAGES = {
    "scan": "the scan",
    "climb": "the climb to the peaks",
    "first scan": "the first scan of the range",
    "search": "the search for peaks",
    "refinement": "the final refinement",
}


def _budget_spent(budget: float, stage: str, evaluations: int, engine: str, usual: int, each: float | None) -> str:
    takes = f"some {usual}" if evaluations < usual else "more here"
    cost = ", which first compiles it" if each is None else f", each of {clock(each)}"
    return (
        f"the budget of {duration(budget)} ended in {STAGES[stage]}, after {evaluations} evaluations by {engine!r}: "
        f"a search takes {takes}{cost}"
    )


def _search_cut_short(stage: str, budget: float) -> str:
    return f"the budget ended in {STAGES[stage]}: give a `budget` of more than {duration(budget)}"


def _best_circuit(best: str, alike: str) -> str:
    return f"the best circuit is {best}" + (f", which cannot be told from {alike}" if alike else "")


def _alike_designs(count: int) -> str:
    return (
        f"{count} more {'design' if count == 1 else 'designs'} cannot be told from the front: beaten by less than the "
        "errors (--json has them)"
    )


def _by_blocks(blocks: int, time: float, unit: str, times: float) -> str:
    text = f"extrapolated from the largest values of {blocks} blocks of a path of {duration(time) if unit else f'{time:.3g}'}"
    if times <= 1.0:
        return text
    return f"{text}, {times:.3g} times what was counted; whether the tail keeps its law beyond that is not known"


MESSAGES: dict[str, str | Callable[..., str]] = {
    # The surface of the power, and the interval of its highest place.
    "no_power": "the load takes no power",
    "no_power_anywhere": "the load takes no power anywhere in the range",
    "same_power_everywhere": "the power is the same all over the range",
    "flat_within_model": "the power changes less over the range than the model's error",
    "no_place_better": "no place is seen to be better than another",
    "power_changes_little": "the power changes less than a quarter of `within`",
    "no_model_error": "no interval of the keys: the model's error is not known, so neither is how far off the optimum "
    "is",
    "curvature_in_noise": "no interval of the keys: the curvature does not stand above the noise",
    "no_curvature": "no interval of the keys: by its second derivatives the power has no peak there",
    "by_gradient": "by the gradient of the power: intervals are its error over the curvature, which leaves out {third:.1g} "
    "of them",
    "not_narrowed": "no interval of the keys: the budget ended before it was narrowed",
    "search_cut_short": _search_cut_short,
    "interval_rough": "the budget ended before the interval of the optimum was found: it is rough",
    "other_peak_within_model": "another peak is as high within the model's error: the interval holds both",
    "other_peak_within_sampling": "another peak is as high within the error of sampling: see peaks",
    "end_of_range": "{key} is best at the {end} end of its range: the best may lie beyond",
    # The search.
    "budget_spent": _budget_spent,
    "ended_with_scan": "its search ended with the first scan, whose largest power is {share:.0%} of that of {top}",
    "surface_disagrees": "the surface says {surface:.5g} at the optimum, and its own evaluation {own:.5g}",
    "evaluations_failed": "{failed} of {count} evaluations failed, the first: {first}",
    "evaluations_unsound": "{unsound} of {count} evaluations by {engine!r} had not settled, were cut off or have no "
    "known error: they count only where there is nothing else",
    # Circuits.
    "scan_fits": "the first place of all {circuits} circuits took {seconds:.2g} s: at least {fit} of the {places} places of a "
    "scan fit into the budget",
    "best_circuit": _best_circuit,
    "no_best_circuit": "no best circuit: the budget ended before the first scan of {early} did",
    "circuits_cut_short": "the search of {names} was cut short",
    "circuit_unsound": "its power has not settled, was cut off or has no known error, so that it is not compared with "
    "circuits whose power has",
    "no_optimum": "no optimum: {why}",
    "coils_differ": "the circuits have coils of different quality ({coils}), which is a part of what their powers differ "
    "by: give all of them one coil, such as seven RB1314 of 1.5 mH in series (L=10.5m, Rcoil=11.9, Rcore=510k)",
    "error_unknown": "the error of {part} is not known",
    # Limits and parts that scatter.
    "power_of_most": "the power is what all but {percent:.3g} % of the devices exceed",
    "unsafe_end": "values of peaks are at the unsafe end of their error",
    "limits_broken": "no place in the range meets all limits: this one breaks them by {broken:.2g} relatively",
    "limit_not_told": "whether {limit} is met cannot be told: the long path's interval holds the bound",
    "limit_broken_on_path": "{limit} is not met, by the long path",
    # Tolerances.
    "error_by_engine": "the error of a power is the engine's own estimate",
    "no_error_stated": "the error of a power is not known: the engine states none",
    "checked_by_runs": "the error of a power is from {runs} runs of {by!r}, whose powers are {ratio:.4g} times those of "
    "{engine!r}",
    "polynomial_stands_for_others": "a polynomial through {runs} runs, and {ends} at the ends, stands for the others",
    "linear_law": "first order: the power goes linearly with each key, by its gradient; curvature along the keys would "
    "move 95 % of the powers by less than {missed:.2g} and their mean by {mean:+.2g}, relatively, and two devices at the "
    "5 % and 95 % powers are off by up to {beyond:.2g} more ({runs} solutions)",
    "intervals_of_samples_alone": "the error of the engine is not known: intervals hold that of the samples alone",
    "intervals_are_wide": "the error of {engine!r} is not small against the spread of the powers: intervals are wide",
    "surface_misses": "the polynomial behind the sensitivity misses {share:.0%} of the variance: give more `samples`",
    "samples_outside": "{share:.1%} of the samples lie beyond those with an answer, and count as at their edge: the outer "
    "quantiles are those of that edge; give more `runs`",
    "samples_failed": "{failed} of {count} samples have no answer, the first: {first}",
    "samples_warned": "at {warned} of {count} samples: {first}",
    "no_shares_correlated": "no sensitivity: keys that are correlated have no shares of the variance that add up to it",
    "no_shares_library": "no sensitivity: SALib, which computes the shares of the variance, is not installed: python -m pip install 'piezo-harvester[tolerance]'",
    "no_shares_constant": "no sensitivity: the power does not change over the spreads",
    # Largest values over a lifetime.
    "by_rice": "Rice's formula: the response is Gaussian; the model's error is up to where every passage counts alone",
    "by_first_passages": "the displacement alone, by the rate of first passages of the density, without sampling "
    "({solved} solutions); its modes do not resolve those of a voltage, whose levels are by Rice's formula or counted",
    "by_blocks": _by_blocks,
    "few_impacts": "of {blocks} blocks {hit} have an impact: too few for the largest impact speed of a lifetime",
    # Fronts.
    "two_aims": "{quantity} is to be {aim}, the power large",
    "alike_designs": _alike_designs,
    "nothing_to_choose": "there is nothing to choose: the most power has the best {quantity} too",
    "front_cut_short": "the budget of {budget!t} ended after {done} of {places} places",
}
