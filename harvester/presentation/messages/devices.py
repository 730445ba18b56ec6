"""Explanations of a device's numbers: its coupling, load, stop, excitation and geometry."""

from collections.abc import Callable

from harvester.uncertainty.value import Value, amount, in_percent

_COUPLING = {
    "strong": "the load damps the mass and shifts its resonance",
    "medium": "the mass feels the load",
    "weak": "the mass hardly feels the load; circuits like SSHI or SECE may gain power",
}


def _best_load(power: float, ohm: float, low: float, high: float, near: float, at_end: bool) -> str:
    near_it = f"{in_percent(near, '.0f')} of it from {_ohm(low)} to {_ohm(high)}"
    end = ", the end of the range" if at_end else ""
    return f"the best mean power, {amount(power, 'W')}, at about {_ohm(ohm)} ({near_it}){end}"


def _own_load(resistance: float, share: float, near: float, nearly: float, **best: float) -> str:
    how = "near the best" if round(share, 2) >= nearly else "far from the best"
    return f"{how}: your {_ohm(resistance)} gives {in_percent(share, '.0f')} of {_best_load(near=near, **best)}"  # type: ignore[arg-type]


def _told_apart(number: float, other: float) -> str:
    """A number in as many digits, from three on, as distinguish it from another."""
    digits = next((d for d in range(3, 12) if f"{number:.{d}g}" != f"{other:.{d}g}"), 3)
    return f"{number:.{digits}g}"


def _ohm(value: float) -> str:
    """A resistance as a text of three digits."""
    return Value(float(f"{value:.3g}")).format("ohm")


def _stop_at_rest(rate: float | None) -> str:
    often = "" if rate is None else f", about {rate:.3g} times per second"
    return f"at the rest position, so it is hit in every swing{often}"


def _stop_under_noise(
    how: str, rms: float, distance: float, is_open: bool, rate: float | None
) -> str:
    sentence = f"hit {how}: without it the displacement is {amount(rms, 'm')} (RMS, linear), "
    sentence += f"and it is {amount(distance, 'm')} away"
    sentence += ", in open circuit" if is_open else ""
    return (
        sentence if rate is None else f"{sentence}; it would be reached {rate:.2g} times per second"
    )


def _stop_under_drive(peak: float, distance: float, is_noisy: bool) -> str:
    how = "hit in every swing" if peak > distance else "not reached"
    swing = f"the amplitude is {amount(peak, 'm')} (linear{', noise apart' if is_noisy else ''})"
    return f"{how}: without it {swing}, and it is {amount(distance, 'm')} away"


MESSAGES: dict[str, str | Callable[..., str]] = {
    "coupling_needs_damping": "k^2 Q has no meaning without damping: damping_ratio must be above 0",
    "coupling": lambda how, merit, strong_from: (
        f"{how}, k^2 Q = {_told_apart(merit, strong_from)} (strong from {_told_apart(strong_from, merit)}): {_COUPLING[how]}"
    ),
    "coupling_explained": "linear and under white noise, the best resistor extracts {share:.0%} of the input power (weak: below 20 %)",
    "from_points": lambda value, unit, points: (
        f"{amount(value, unit)}, computed from {points}: a linear device at its best frequency; voltages and "
        "accelerations are peaks unless written otherwise"
    ),
    "points_ambiguous": "another value gives the same point: the smallest is used; a second point or --open-circuit-frequency decides",
    "load_not_sought": "not sought: the base has no excitation",
    "best_load_not_found": "not found: {why}",
    "no_load_yet": lambda **best: f"none yet; {_best_load(**best)}",
    "own_load": _own_load,
    "best_load_by": "the best load is by engine {engine!r}, which states an error of {error:.1%} in power",
    "unusual_best_load": "{what}: are mass, frequency and capacitance right?",
    "engines_that_serve": "{engines}",
    "no_engine_yet": "none yet: a power needs an excitation and a load",
    "stop_at_rest": _stop_at_rest,
    "stop_pressed": lambda force: (
        f"pressed on the mass with {amount(force, 'N')}: it is hit whenever the excitation lifts the mass"
    ),
    "stop_under_noise": _stop_under_noise,
    "stop_under_drive": _stop_under_drive,
    "stop_distance": lambda distance: (
        f"{amount(distance, 'm')} away; harvester motion shows how often it is hit"
    ),
    "drive_off_resonance": "the excitation at {hertz:.4g} Hz is {ratio:.3g} times the resonance; most power is at {best:.3g} Hz, {gain:.2g} times as much for the same acceleration (linear)",
    "geometry_mode": "first mode of an Euler-Bernoulli beam, {wired}; the tip moves {tip:.4g} times as far as the scene's mass{block}",
    "geometry_strain": "the piezo's strain is largest at the clamp, {strain:.4g} microstrain per mm of the scene's displacement{lifetime}",
    "geometry_piezo": "{name}: Y {young:.4g} GPa, d31 {d31:.4g} pm/V, {permittivity:.4g} eps0 clamped, {density:.4g} kg/m^3: {source}",
    "geometry_substrate": "{name}: Y {young:.4g} GPa, {density:.4g} kg/m^3: {source}",
    "geometry_assumed": "assumed: {what}",
}
