"""A linear response, in closed form: one branch, the same up the frequencies and down.

A point costs next to nothing, so that frequencies are added which resolve the peak.
"""

from collections.abc import Callable, Sequence

import numpy as np

from harvester.engines import Exact
from harvester.linear.solve import solve
from harvester.linear.transfer import amplitudes, phase_to_base
from harvester.studies.frequency_response.driven import HarmonicDrive
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.uncertainty.value import Value


def power_at(driven: HarmonicDrive, frequency: float) -> float:
    """The mean power at one frequency, in the scene's unit."""
    return Exact().run(driven.at(frequency)).mean_power.value


def closed_form(driven: HarmonicDrive, frequencies: Sequence[float]) -> list[ResponsePoint]:
    """The points up and down again.

    Raises UnboundedResponseError if nothing dissipates energy.
    """
    points = []
    for direction, way in (("up", list(frequencies)), ("down", list(frequencies)[::-1])):
        for frequency in way:
            problem = driven.at(frequency)
            answer = Exact().run(problem)
            eqs = problem.equations
            spread = None
            of_displacement = of_voltage = None
            if not driven.is_random:
                assert eqs.drive is not None and eqs.drive_frequency is not None, (
                    "Driven checks this"
                )
                x, voltage = eqs.drive * amplitudes(eqs, eqs.drive_frequency)
                spread = 0.0
                of_displacement, of_voltage = (
                    phase_to_base(complex(amplitude), eqs, problem.physical)
                    for amplitude in (x, voltage)
                )
            square = solve(eqs)
            # rounding, as that of E[V^2]
            share = square.error / square.value if square.value else 0.0
            displacement = (
                Value(square.x2, bias=share * square.x2, model=0.0)
                .scaled(problem.units.length**2)
                .root()
            )
            points.append(
                ResponsePoint(
                    direction,
                    frequency,
                    answer.mean_square_voltage,
                    answer.mean_power,
                    spread=spread,
                    displacement_rms=displacement,
                    displacement_phase=of_displacement,
                    voltage_phase=of_voltage,
                )
            )
    return points


ACROSS = 9  # points from one half-power point to the other, for the curve


def resolved(power: Callable[[float], float], frequencies: Sequence[float]) -> list[float]:
    """The ascending frequencies, and with them that of the largest power, the half-power points, and some between.

    The largest power is sought between the neighbours of the best of ``frequencies``; a half-power point that is
    beyond them is left out.  ``power`` must be smooth, with one peak between two neighbours at most.
    """
    from scipy.optimize import brentq, minimize_scalar

    given = sorted(frequencies)
    values = [power(f) for f in given]
    top = int(np.argmax(values))
    if not values[top] > 0.0:
        return given
    ends = given[max(top - 1, 0)], given[min(top + 1, len(given) - 1)]
    optimum = minimize_scalar(
        lambda f: -power(f), bounds=ends, method="bounded", options={"xatol": 1e-9 * ends[1]}
    )
    peak = float(optimum.x) if -optimum.fun > values[top] else given[top]
    half = 0.5 * max(-optimum.fun, values[top])
    edges = []
    for side in ([f for f in given[::-1] if f < peak], [f for f in given if f > peak]):
        inner = peak
        for outer in side:
            if power(outer) <= half:
                edges.append(
                    float(brentq(lambda f: power(f) - half, inner, outer, xtol=1e-12 * peak))
                )
                break
            inner = outer
    between = np.linspace(edges[0], edges[1], ACROSS).tolist() if len(edges) == 2 else edges
    return sorted({*given, peak, *between})
