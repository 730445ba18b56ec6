"""How the runs of engine `spice` go on until the error that is asked for is reached."""

from harvester.engines.spice.runs import Runs
from harvester.uncertainty.target import Target


def sequential_sampling(runs: Runs, target: Target, fixed: bool) -> None:
    """More pairs and a longer ensemble, in the proportion that costs least, until the target is reached."""
    warnings = runs.ready.warnings
    while True:
        found = runs.power()
        if target.reached(found.value):
            return
        variance = target.variance(found.value)
        if variance == 0.0:  # a larger ensemble knows the bias no better: it was asked for before the first run
            tolerance = (runs.tolerance or {}).get(runs.ready.quantity, 0.0)
            if 2.0 * tolerance > target.within:
                warnings.append(
                    f"`within` {target.within:.3g} needs a smaller tolerance of ngspice, which makes {tolerance:.2g}: "
                    f"in Python, Spice(reltol={0.1 * runs.ready.device.reltol:.0e})"
                )
            elif fixed or target.budget is None:
                warnings.append(
                    f"`within` {target.within:.3g} needs a smaller `dt`: the bias of the step alone is too large"
                )
            else:
                warnings.append(target.missed(found.value))
            return
        pairs, longer = runs.asked_for(found, variance)
        seconds = pairs * runs.cost + longer * runs.rate
        share = min(target.seconds_left / seconds, 1.0)
        if share < 0.02:
            warnings.append(target.missed(found.value))
            return
        if pairs >= 1.0 or longer <= 0.0:  # less than a pair is asked for as one, where nothing else is
            runs.more(max(2 * round(0.5 * share * pairs), 2))
        if longer > 0.0:
            runs.extend(share * longer)
