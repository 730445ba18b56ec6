"""What slow circuits behind a rectifier and the study of sensor nodes say."""

from harvester.uncertainty.value import amount, clock, in_percent

MESSAGES = {
    "node_never_wakes": "it never begins: the rectifier charges the store to {highest:.3g} V, below the wake voltage, "
    "{wake:.3g} V",
    "chip_never_starts": lambda highest, volts, watts: (
        f"the chip's cold start never ends, which asks for {volts:g} V"
        + (f" and {amount(watts, 'W')}" if watts else "")
        + f" at its input: it charges the store to {highest:.3g} V"
    ),
    "chip_by_its_sheet": "its numbers are those of {source}; not confirmed there, but usual: {assumed}",
    "node_not_yet_awake": "it has not begun: the store takes longer than {seconds!t} to the wake voltage, {wake:.3g} V",
    "node_browns_out": "most packets are cut off: one takes the store from its wake voltage, {wake:.3g} V, below the stop "
    "voltage, {stop:.3g} V; a larger capacitance or a lower ESR helps",
    "node_lacks_energy": lambda given, needed: (
        f"energy limits it: the rectifier gives {amount(given, 'W')} on average, and the node takes "
        f"{amount(needed, 'W')} while it runs"
    ),
    "node_has_more": lambda lost: f"its interval limits it: {amount(lost, 'W')} more come in, which the clamp takes",
    "node_keeps_its_interval": "its interval limits it, {interval!t}: the store lasts",
    "battery_resistance": "a packet lowers the battery's voltage below the stop voltage, {stop:.3g} V: a lower ESR helps",
    "battery_ran_empty": lambda seconds, given, needed: (
        f"the battery is empty after {amount(seconds, 's')}: the rectifier gives {amount(given, 'W')} on average, and the "
        f"node takes {amount(needed, 'W')} while it runs"
    ),
    "battery_lasts": lambda seconds, given, needed: (
        f"the battery lasts {amount(seconds, 's')}: the rectifier gives {amount(given, 'W')} on average, and the node takes "
        f"{amount(needed, 'W')} while it runs"
    ),
    "node_change_helps": lambda gain: f"the change that helps most: 10 % of it gives {100.0 * gain:.3g} % more packets",
    "slow_circuit_alone": lambda direct, separation: (
        f"what is behind the rectifier was computed alone, fed by the rectifier's mean current; {direct:.3g} s of mass and "
        f"circuit together differ by {in_percent(separation)}, which is corrected and counted as an error"
    ),
    "run_directly": lambda direct, separation: (
        f"mass and circuit together differ by {in_percent(separation)} from the circuit alone, which is not slow beside the "
        f"vibration: {clock(direct)} of both together take its place"
    ),
    "scales_not_apart": lambda separation: (
        f"mass and circuit together differ by {in_percent(separation)} of the mean power, which is counted as an error: the "
        "store is not slow beside the vibration, as a larger one would be"
    ),
    "slow_circuit_unsettled": lambda seconds, share: (
        f"the mean power still changes by {in_percent(share)} after {clock(seconds)}"
    ),
    "circuit_left_out": "left out: {why}",
    "chip_without_output": "chip {chip!r} has no output of {voltage:g} V",
    "coils_saturate": "an inversion at {voltage:g} V takes more current than any coil of the list bears",
    "detector_not_counted": "its switch closes at the peaks at no cost: on a board a detector takes power of its "
    "own and acts a little late, which is not counted here (the netlist self_powered_sshi has such a detector)",
    "design_simplest": "the first of the circuits that meets everything, in the order in which they are asked for; "
    "a spread would tell them apart",
    "design_by_share": "the circuit that most devices meet everything with; of those that cannot be told apart the "
    "first",
    "design_check": lambda needed, whole: (
        f"load {amount(needed, 'ohm')} takes what is needed at that voltage, {amount(whole, 'ohm')} all that is "
        "available: 'harvester run' and 'harvester tolerance' check it with these"
    ),
    "node_of_fluctuating_current": "the rectifier's current fluctuates as the noise makes it, with the spectral density that "
    "was measured",
    "node_error_by_model": "the error of the packets, {error:.3g} an hour, is large, and more runs do not make it smaller: "
    "it is that of the model",
    "node_error_by_time": "the error of the packets, {error:.3g} an hour, is large: the {seconds:g} s for more runs are over",
}
