"""What `identify` says of its fit."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "ring_down_meets_a_stop": "the ring-down meets a stop: fitted as flights and impacts in short circuit",
    "one_state_alone": "one ring-down in {state} gives the frequency and quality there; those in short circuit and the coupling take one in another state (FILE@short, FILE@open, FILE@470k) or an impedance",
    "fit_is_off": "the fit is off by {percent:.2g} % rms: the device is not one linear mode there, or a load or unit is not as stated; the intervals hold only the scatter",
    "residual_has_a_pattern": "the residual of {file} ({curve}) is no noise, most about {at:.4g} Hz: neighbouring points agree (correlation {correlation:+.2f}); another mode, a stop that is not rigid, or a load or unit that is not as stated; the intervals hold only the scatter",
    "many_outliers": "{left_out} of the {points} points of {file} ({curve}) are left out as outliers: the fit may be of another device",
    "two_resonances": "the impedance holds two resonances: fitted with two modes, of which mode.2 is the one above",
    "scene_not_whole": "the scene file is not whole yet, its comments say what is missing; with a known mass: "
    "harvester identify {files} --known mass='12 g' --out ...",
}
