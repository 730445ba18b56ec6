"""What `charge` says of its result."""

from collections.abc import Callable

from harvester.uncertainty.value import duration


def _not_reached(share: float, runs: int, time: float, unit: str, by_default: bool, height: float) -> str:
    who = f"{share:.1%} of the runs do" if runs > 1 else "the run does"
    limit = "what is watched by default" if by_default else "`duration`"
    where = f"where it is at {height:.3g} times the target on average"
    remedy = "watch longer (`duration`), or take a larger load resistance or more shaking"
    return f"{who} not get there within {duration(time) if unit else f'{time:.4g}'} ({limit}), {where}: the mean time is not known; {remedy}"


MESSAGES: dict[str, str | Callable[..., str]] = {
    "engine_chosen": "engine {engine!r} was taken: {why}",
    "store_alone": "engine {engine!r} knows `probe` store alone, but it is {probe}: use engine 'spice'",
    "noise_alone": "engine {engine!r} begins at no certain place of what repeats, and charges under noise alone: use engine 'spice'",
    "slow_probe": "engine 'slow' charges a capacitor Csmooth and knows `probe` store alone, but it is {probe}: use engine 'spice'",
    "slow_shaking": "engine 'slow' charges under a harmonic drive alone, and a store without a chip also under noise alone, but the shaking is another: use engine 'spice'",
    "slow_charge": "the store was charged by the rectifier's mean current; mass and circuit together take {change!t} longer in their first {direct!t}, which is added; how much that still changed is in the error",
    "slow_charge_of_chip": "what is behind the rectifier was computed alone; in their first {direct!t} mass and circuit together take {change!t} longer to what the store has then, which is added and, for all of the time, in the error",
    "charge_not_slow": "the charge takes {seconds!t}, and transients of the mass {transients!t}: the time scales are not apart, and only runs of both together are right",
    "many_ngspice_runs": "{why}; {runs} runs, which may take minutes",
    "error_of_charging_side_by_side": "the error of the step is 2.4 times the change at twice the step and half the looks, on the same noise; as the voltage is checked at intervals, a few runs that just reach the target may be missed, and the share that does is a lower bound; the error of the circuit's model is not known from within: compare with engine 'spice'",
    "one_run_is_all": "nothing is random, so that one run is all",
    "error_of_charging": "the error of the step is the change at twice the step and ten times ngspice's tolerance, on the same shaking",
    "target_not_reached": _not_reached,
    "record_repeats": "the record lasts {period:.4g}{unit} and was played again and again: a single shock is a `duration` within the record",
    "few_records": "the runs are on {records} records of the tabulated density, {together} on each, which say little of 5 and 95 %: take more `trajectories`",
    "few_runs": "5 and 95 % of {runs} runs are near the first and the last: take more `trajectories`",
}
