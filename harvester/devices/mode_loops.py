"""Further modes of an exported part: a loop each, as that of the first (`harvester.devices.export`), on one piezo.

mass_j X_j'' + damping X_j' + stiffness X_j + theta_j v
    = -mass_j base_j a + at_stop_j stops(w),  w = sum at_stop X_j
"""

import math
from collections.abc import Iterator, Sequence

from harvester.scene.physical import Mode

AT_STOP, SPEED = "v(atstop)", "v(stopspeed)"  # nodes of w and of its speed


def contact(modes: Sequence[Mode]) -> Iterator[str]:
    """The displacement and the speed where the stop is, of which each mode has its part."""
    yield "* The displacement and the speed at the stop: those of all modes, each times its at_stop"
    parts = [(number, _given(mode.at_stop)) for number, mode in enumerate(modes, 2)]
    yield "Batstop atstop 0 V=v(x)" + "".join(
        f"+{part:.10g}*v(x{number})" for number, part in parts
    )
    yield "Bstopspeed stopspeed 0 V=i(Vspeed)" + "".join(
        f"+{part:.10g}*i(Vspeed{n})" for n, part in parts
    )


def loop(number: int, mode: Mode, metre: float, stops: Sequence[str]) -> Iterator[str]:
    """The lines of a mode; ``stops`` are the nodes of their forces, and 1 V of x is ``metre``."""
    w = 2.0 * math.pi * mode.frequency
    damping = 2.0 * (mode.damping_ratio or 0.0) * w * mode.mass
    stiffness = mode.mass * w * w
    at = [f"k{number}{letter}" for letter in "abcdefgh"]
    here = iter(range(len(at)))

    def ends() -> str:
        first = next(here)
        return f"{at[first]} {at[first + 1]}"

    yield f"* Mode {number}: {mode.frequency:.10g} Hz, {mode.mass:.10g} kg, participation {_given(mode.base):.10g}"
    yield f"Eforce{number} {at[0]} 0 acc 0 {-mode.mass * _given(mode.base):.10g}"
    yield f"Hspeed{number} speed{number} 0 Vspeed{number} 1"
    yield f"Cmass{number} speed{number} force{number} {mode.mass:.10g}"
    yield f"Vforce{number} force{number} 0 0"
    yield f"Hmass{number} {ends()} Vforce{number} 1"
    if damping:
        yield f"* Its damping: {damping:.10g} N s/m"
        yield f"Rdamping{number} {ends()} {damping:.10g}"
    yield f"* Its spring: {stiffness:.10g} N/m"
    yield f"Cspring{number} {(spring := ends())} {1.0 / stiffness:.10g} ic=0"
    yield f"Edisplacement{number} x{number} 0 {spring} {1.0 / (stiffness * metre):.10g}"
    for stop in stops:
        yield f"* The {stop}'s force on it, times at_stop = {_given(mode.at_stop):.10g}"
        yield f"E{stop}{number} {ends()} {stop} 0 {_given(mode.at_stop):.10g}"
    coupling = mode.coupling or 0.0
    yield f"* Its coupling: {coupling:.10g} N/V"
    yield f"Epiezo{number} {ends()} p n {coupling:.10g}"
    yield f"Vspeed{number} {at[next(here)]} 0 0"
    yield f"Fpiezo{number} n p Vspeed{number} {coupling:.10g}"


def _given(value: float | None) -> float:
    """A participation, 1 if it is left out."""
    return 1.0 if value is None else value
