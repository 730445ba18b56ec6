"""Messages of `charge` about its result."""

from collections.abc import Callable

from harvester.uncertainty.value import duration, in_percent


def _not_reached(
    share: float, runs: int, time: float, unit: str, by_default: bool, height: float
) -> str:
    who = f"{in_percent(share, '.1f')} of the runs do" if runs > 1 else "the run does"
    limit = "the default" if by_default else "`duration`"
    where = f"at {height:.3g} times the target on average"
    remedy = "increase `duration`, the load resistance or the excitation"
    return f"{who} not reach the target within {duration(time) if unit else f'{time:.4g}'} ({limit}), ending {where}: the mean time is not known; {remedy}"


MESSAGES: dict[str, str | Callable[..., str]] = {
    "engine_chosen": "engine {engine!r} was chosen: {why}",
    "store_alone": "engine {engine!r} supports only `probe` store, but it is {probe}: use engine 'spice'",
    "noise_alone": "engine {engine!r} supports charging under noise only, not under a periodic excitation or recording: use engine 'spice'",
    "slow_probe": "engine 'slow' charges a capacitor Csmooth and supports only `probe` store, but it is {probe}: use engine 'spice'",
    "slow_shaking": "engine 'slow' supports charging under a harmonic excitation alone, and without a chip also under noise alone: use engine 'spice'",
    "slow_from_rest": "engine 'slow' charges from 0 V, but the netlist gives {names} a voltage at the start (`ic`): use engine 'spice'",
    "slow_charge": "the capacitor was charged by the rectifier's mean current; mass and circuit together need {change!t} longer in their first {direct!t}, which is added; the change still under way is in the error",
    "slow_charge_under_noise": "the capacitor was charged by the rectifier's mean current; mass and circuit together need {change!t} longer, by direct runs that charge for {direct!t}, which is added",
    "slow_charge_of_chip": "the circuit behind the rectifier was computed alone; in their first {direct!t} mass and circuit together need {change!t} longer to the same storage voltage, which is added and, for all of the time, in the error",
    "charge_not_slow": "charging lasts {seconds!t}, and transients of the mass {transients!t}: the time scales are not separate, and only runs of both together are accurate",
    "many_ngspice_runs": "{why}; {runs} runs, which may need minutes",
    "error_of_charging_side_by_side": "the time-step error is 2.4 times the change at twice the step and half the checks, on the same noise; because the voltage is checked at intervals, a few runs that just reach the target may be missed, and the fraction that does is a lower bound; the circuit's model error is not measured: compare with engine 'spice'",
    "one_run_is_all": "the scene is deterministic: one run is enough",
    "error_of_charging": "the time-step error is the change at twice the step and ten times ngspice's tolerance, on the same excitation",
    "target_not_reached": _not_reached,
    "record_repeats": "the recording lasts {period:.4g}{unit} and was repeated to fill the run: for a single shock, set `duration` shorter than the recording",
    "few_records": "the runs use {records} independent noise records, {together} runs on each, too few for reliable 5 and 95 % quantiles: increase `trajectories`",
    "runs_in_budget": "{runs} of {requested} runs fitted into the `budget` of {budget!t}: give a "
    "longer one for a smaller error",
    "watched_in_budget": "the `budget` of {budget!t} ended before the runs had reached the target: "
    "give a longer one",
    "few_runs": "the 5 and 95 % quantiles of {runs} runs are near the first and the last: increase `trajectories`",
}
