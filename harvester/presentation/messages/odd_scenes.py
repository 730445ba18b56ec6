"""Warnings about a scene: unusual numbers, shocks, and the limits of a recording."""

from collections.abc import Callable


def _unusual(key: str, value: float, unit: str, low: float, high: float, likely: str) -> str:
    text = f"{key} is {value:.4g} {unit}, far outside of the usual {low:g} to {high:g} {unit}"
    return text + (f": is {likely} meant?" if likely else "")


def _overdamped(damping_ratio: float) -> str:
    return (
        f"oscillator.damping_ratio is {damping_ratio:.4g}, which is Q = {0.5 / damping_ratio:.2g}: such a mass does "
        f"not resonate; is {damping_ratio:.4g}% meant?"
    )


MESSAGES: dict[str, str | Callable[..., str]] = {
    "unusual_value": _unusual,
    "overdamped": _overdamped,
    "node_left_out": "[storage], [chip] and [node] are not computed here: use 'harvester node'",
    "far_from_resonance": "excitation.frequency is {frequency:.4g} Hz, {ratio:.3g} times the resonance of "
    "{resonance:.4g} Hz: is its unit right?",
    "other_capacitance": "load.parameters.Cp is {own:.4g} nF, but piezo.capacitance is {piezo:.4g} nF: left out, it is "
    "the piezo's",
    "single_shock": "the shock is a single one: the mean power is over {period!t}, in which the device comes to "
    "rest; that time changes with the damping: compare the energy per event, or give event_rate",
    "coarse_record": "the recording has only {samples:.3g} samples per period of the resonance: vibration above half "
    "its rate is missing, and if that is as strong as just below, E[V^2] is off by {change:.1%}",
    "record_join": "the recording's end does not meet its beginning: the way they are joined changes E[V^2] by {change:.1%}",
    "within_record_join": "`within` {within!p} is not reached by any effort: the way in which the recording's end is joined to "
    "its beginning changes E[V^2] by {change!p}: give a longer recording, or a larger `within`",
    "record_stands_still": "the recorded acceleration is constant in a share of {share:.2g} of the samples, longest in rows {first} to {last}, as of a sensor that died or stuck: 'harvester record FILE' names a part in which it changes",
    "narrow_density": "the tabulated power spectral density is narrow for a record of {period:.3g}/w0: its lines change E[V^2] by "
    "{change:.1%}",
}
