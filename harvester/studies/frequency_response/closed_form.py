"""A linear response, in closed form: one branch, the same up the frequencies and down."""

from collections.abc import Sequence

from harvester.engines import Exact
from harvester.linear.harmonics import phase_to_base
from harvester.linear.response import amplitudes
from harvester.linear.solve import solve
from harvester.studies.frequency_response.driven import HarmonicDrive
from harvester.studies.frequency_response.point import ResponsePoint, root
from harvester.uncertainty.value import Value


def power_at(driven: HarmonicDrive, frequency: float) -> float:
    """The mean power at one frequency, in the scene's unit."""
    return Exact().run(driven.at(frequency)).mean_power.value


def closed_form(driven: HarmonicDrive, frequencies: Sequence[float]) -> list[ResponsePoint]:
    """The points up and down again.

    Raises UnboundedResponseError where nothing takes energy.
    """
    found = []
    for direction, way in (("up", list(frequencies)), ("down", list(frequencies)[::-1])):
        for frequency in way:
            there = driven.at(frequency)
            answer, eqs = Exact().run(there), there.equations
            spread, phases = None, list[float]()
            if not driven.is_random:
                assert eqs.drive is not None and eqs.drive_frequency is not None, "Driven checks this"
                x, voltage = eqs.drive * amplitudes(eqs, eqs.drive_frequency)
                spread = 0.0
                phases = [phase_to_base(complex(one), eqs, there.physical) for one in (x, voltage)]
            v2, power = answer.mean_square_voltage, answer.mean_power
            square = solve(eqs)
            share = square.error / square.value if square.value else 0.0  # rounding, as that of E[V^2]
            moved = root(Value(square.x2, bias=share * square.x2, model=0.0).scaled(there.units.length**2))
            found.append(ResponsePoint(direction, frequency, v2, power, spread, moved, *phases))
    return found
