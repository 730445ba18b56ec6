"""What `identify` says of its fit."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "ring_down_meets_a_stop": "the ring-down meets a stop: fitted as flights and impacts in short circuit",
    "one_state_alone": "one ring-down in {state} gives the frequency and quality there; those in short circuit and the coupling take one in another state (FILE@short, FILE@open, FILE@470k) or an impedance",
    "fit_is_off": "the fit is off by {percent:.2g} % rms: the device is not one linear mode there, or a load or unit is not as stated; the intervals hold only the scatter",
    "residual_has_a_pattern": "the residual of {file} ({curve}) is no noise, most about {at:.4g} Hz: neighbouring points agree (correlation {correlation:+.2f}); another mode, a stop that is not rigid, or a load or unit that is not as stated; the intervals hold only the scatter",
    "many_outliers": "{left_out} of the {points} points of {file} ({curve}) are left out as outliers: the fit may be of another device",
    "two_resonances": "the impedance holds two resonances: fitted with two modes, of which mode.2 is the one above; as it does not "
    "tell what part that has in the base's motion (base), its [[mode]] is a comment in a scene",
    "clamped_impedance": "a clamped impedance has no resonance: measure it free too",
    "fit_at_boundary": "the fit ends at its boundary, so that no interval holds it: measure more impacts",
    "no_such_device": "the fit gives {value:.3g} {unit}, which no such device has: check loads and units",
    "mass_is_open": "these data do not tell the mass: give it as --known mass=..., or measure the voltage per g over a load too",
    "capacitance_is_open": "measure an impedance, or responses over two loads or more about 1/(2 pi f C)",
    "one_state_leaves_it_open": "these data leave it open: measure in another electrical state too (another load, short, open)",
    "scene_not_whole": "the scene file is not whole yet, its comments say what is missing; with a known mass: "
    "harvester identify {files} --known mass='12 g' --out ...",
}
