"""Messages of slow circuits behind a rectifier and of the study of sensor nodes."""

import math

from harvester.uncertainty.value import amount, clock, duration, in_percent

FEW_TIMES = 10.0  # a gain above which the packets are stated, and not per cent of almost none


def _packets(per_day: float, error: float) -> str:
    """Packets per day in whole numbers, to three digits if an error changes them."""
    if error < 0.5:
        return f"{per_day:,.0f}"
    digits = max(math.floor(math.log10(error)) - 1, 0)
    return f"{round(per_day, -digits):,.0f} +- {round(error, -digits):,.0f}"


def _node_answer(
    sent: str,
    per_day: float,
    error: float,
    interval: float,
    begins: float | None,
    days: float,
    outage: float | None,
    lasts: float | None,
    lasts_error: float | None,
    survived: float | None,
    longest: bool,
) -> str:
    """Whether a node sends all of its packets, and whether it outlasts an outage."""
    most = f"{86400.0 / interval:,.0f}"
    if begins is None:
        text = f"no: no packet in {clock(86400.0 * days)}"
    elif sent == "all":
        text = f"yes: {most} packets per day, one every {duration(interval)}"
        text += f", from {clock(begins)} on" if begins > interval else ""
    else:
        text = f"{sent}: {_packets(per_day, error)} packets per day, of {most}"
    if outage is None or lasts is None or begins is None:
        return text
    said = "longer than " * longest + clock(lasts)
    return f"{text}; an outage of {clock(outage)}: {_verdict(lasts - outage, lasts_error or 0.0, survived)}, the storage lasts {said}"


def _verdict(longer: float, error: float, survived: float | None) -> str:
    """Whether the storage outlasts an outage: by its mean time, or in a part of the cases under noise."""
    if survived is not None and 0.0 < survived < 1.0:
        return f"in {in_percent(survived, '.0f')} of cases"
    if abs(longer) < error:
        return "uncertain"
    return "yes" if longer >= 0.0 else "no"


MESSAGES = {
    "node_never_wakes": "never starts: the rectifier charges the storage only to {highest:.3g} V, below the wake voltage {wake:.3g} V",
    "chip_never_starts": lambda highest, volts, watts: (
        f"the chip's cold start never ends, because it needs {volts:g} V"
        + (f" and {amount(watts, 'W')}" if watts else "")
        + f" at its input: it charges the storage to {highest:.3g} V"
    ),
    "chip_by_its_sheet": "its numbers are from {source}; usual, but not confirmed there: {assumed}",
    "node_not_yet_awake": "not started: the storage needs longer than {seconds!t} to the wake voltage, {wake:.3g} V",
    "node_browns_out": "most packets are cut off: one discharges the storage from its wake voltage, {wake:.3g} V, below the stop "
    "voltage, {stop:.3g} V; a larger capacitance or a lower ESR helps",
    "node_lacks_energy": lambda given, needed: (
        f"limited by energy: the rectifier supplies {amount(given, 'W')} on average, and the node consumes "
        f"{amount(needed, 'W')} while it runs"
    ),
    "node_has_more": lambda lost: (
        f"limited by its sending interval: {amount(lost, 'W')} more come in, which the clamp dissipates"
    ),
    "node_keeps_its_interval": "limited by its sending interval ({interval!t}); the storage never runs out",
    "battery_resistance": "a packet lowers the battery's voltage below the stop voltage, {stop:.3g} V: a lower ESR helps",
    "battery_ran_empty": lambda seconds, given, needed: (
        f"the battery is empty after {amount(seconds, 's')}: the rectifier supplies {amount(given, 'W')} on average, and the "
        f"node consumes {amount(needed, 'W')} while it runs"
    ),
    "battery_lasts": lambda seconds, given, needed: (
        f"the battery lasts {amount(seconds, 's')}: the rectifier supplies {amount(given, 'W')} on average, and the node consumes "
        f"{amount(needed, 'W')} while it runs"
    ),
    "node_change_helps": lambda gain, packets: (
        "the change that helps most: 10 % of it gives "
        + (
            f"{in_percent(gain)} more packets"
            if gain <= FEW_TIMES
            else f"{(1.0 + gain) * packets:.3g} packets per hour"
        )
    ),
    "node_answer": _node_answer,
    "node_larger_store": lambda farads, first, end: (
        f"with {amount(farads, 'F')}, "
        + (
            f"the storage is not charged to the wake voltage in {clock(end)}"
            if first is None
            else f"the first packet is sent after {clock(first)}"
        )
    ),
    "slow_circuit_alone": lambda direct, separation: (
        f"the circuit behind the rectifier was computed alone, fed by its mean current; {direct:.3g} s of mass and "
        f"circuit together differ by {in_percent(separation)}, which is corrected and counted as an error"
    ),
    "run_directly": lambda direct, separation: (
        f"mass and circuit together differ by {in_percent(separation)} from the circuit alone, which is not slow compared with the "
        f"vibration: {clock(direct)} of both together replace it"
    ),
    "scales_not_apart": lambda separation: (
        f"mass and circuit together differ by {in_percent(separation)} of the mean power, which is counted as an error: the "
        "storage is not slow compared with the vibration, as a larger one would be"
    ),
    "clock_not_covered": lambda period: (
        f"the circuit repeats an action every {clock(period)}, and its averages cover fewer than "
        "four such periods: give a longer budget, or compare with 'spice' over a longer duration"
    ),
    "slow_circuit_unsettled": lambda seconds, share: (
        f"the mean power still changes by {in_percent(share)} after {clock(seconds)}"
    ),
    "circuit_left_out": "left out: {why}",
    "chip_without_netlist": "'harvester node' supports it by its datasheet's table, but no netlist of it is here to compare",
    "chip_not_asked": "chips are compared under a harmonic excitation, or if `chips` names them",
    "capacitor_kept": lambda has, smallest: (
        f"kept: {amount(has, 'F')} is enough, and {amount(smallest, 'F')} would be"
    ),
    "capacitor_too_small": lambda has, smallest: (
        f"too small: {amount(has, 'F')}, and {amount(smallest, 'F')} is the smallest that is enough"
    ),
    "chip_without_output": "chip {chip!r} has no output of {voltage:g} V",
    "coils_saturate": "an inversion at {voltage:g} V needs more current than any inductor of the list allows",
    "detector_not_counted": "its switch closes at the peaks at no cost: the detector of a real board consumes power "
    "and acts a little late, which is not counted here (the netlist self_powered_sshi has such a detector)",
    "design_simplest": "the first of the circuits that meets all requirements, in the order given; "
    "a spread would rank them by yield",
    "design_by_share": "chosen for the highest yield; ties go to the first listed",
    "design_check": lambda needed, whole: (
        f"a load of {amount(needed, 'ohm')} draws the required power at that voltage, {amount(whole, 'ohm')} all that is "
        "available: 'harvester run' and 'harvester tolerance' check it with these"
    ),
    "trace_of_joulescope": "the trace has no units: in SI units, as a Joulescope writes it (its power is current times voltage)",
    "trace_below_zero": "{samples} samples of the trace are slightly below 0, {least:.2g} A at least: counted as 0",
    "node_of_fluctuating_current": "the rectifier's current fluctuates under the noise, with the measured spectral density",
    "node_error_by_model": "the error of the packets, {error:.3g} per hour, is large, and more runs do not reduce it: the "
    "model's part dominates",
    "node_error_by_time": "the error of the packets, {error:.3g} per hour, is large: the {seconds:g} s for more runs ended",
    "node_error_by_budget": "the error of the packets, {error:.3g} per hour, is large, as the `budget` of {seconds!t} ended: "
    "give a longer one",
    "measurement_needs_time": "no answer in a `budget` of {budget!t}: it needs at least {seconds!t}, so give a longer one",
    "shares_left_out": "the `budget` of {budget!t} ended before the yields of these circuits were known: {names}: "
    "give a longer one",
}
