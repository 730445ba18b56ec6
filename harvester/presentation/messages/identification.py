"""Messages of `identify` about its fit."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "rows_left_out": lambda file, rows, first: (
        f"{file}: {rows} of its rows {'was' if rows == 1 else 'were'} left out (first: row {first}): "
        "a frequency that is not above 0, a size of 0, or an empty cell"
    ),
    "ring_down_meets_a_stop": "the ring-down meets a stop: fitted as flights and impacts in short circuit",
    "magnitude_alone": "the phase is not known: the loss and the quality factor are those of the magnitude alone, and a capacitance is assumed; a phase gives narrower intervals",
    "one_state_alone": "one ring-down in {state} gives the frequency and quality there; those in short circuit and the coupling need a ring-down in another state (FILE@short, FILE@open, FILE@470k) or an impedance",
    "fit_is_off": "the fit is off by {percent:.2g} % rms: the device is not one linear mode there, or a load or unit is wrong; the intervals cover random scatter only",
    "residual_has_a_pattern": "the residuals of {file} ({curve}) are not random (lag-1 correlation {correlation:+.2f}, strongest near {at:.4g} Hz): suspect another mode, a compliant stop, or a wrong load or unit; the intervals cover random scatter only",
    "many_outliers": "{left_out} of the {points} points of {file} ({curve}) are left out as outliers: the fit may be of another device",
    "two_resonances": "the impedance has two resonances: fitted with two modes, mode.2 is the upper one; as it does not "
    "determine its part in the base motion (base), its [[mode]] is a comment in a scene",
    "clamped_impedance": "a clamped impedance has no resonance: also measure it free",
    "fit_at_boundary": "the fit ends at its boundary, so it has no interval: measure more impacts",
    "no_such_device": "the fit gives {value:.3g} {unit}, which no such device has: check loads and units",
    "mass_is_open": "these data do not determine the mass: pass --known mass=... or add a voltage-per-g measurement with a load",
    "damping_has_a_prior": "no number determines the damping: its prior is a "
    "quality factor of {quality:.3g} with a standard deviation of {spread:.0%}",
    "point_is_far_off": "{point} is off by {deviations:.2g} standard deviations: check peak or RMS, "
    "the acceleration, and whether all numbers are of one device",
    "points_have_two_answers": "a coupling of {value:.3g} {unit} has these points nearly as well: "
    "another point, such as both resonances, decides",
    "capacitance_is_open": "measure an impedance, or responses over two loads or more about 1/(2 pi f C)",
    "one_state_leaves_it_open": "these data do not determine it: also measure in another electrical state (another load, short, open)",
    "scene_not_whole": lambda given: (
        "the scene file is not complete, its comments list the missing values"
        + (
            ""
            if given is None
            else f"; with a known mass: harvester identify {given} --known mass='12 g' --out ..."
        )
    ),
}
