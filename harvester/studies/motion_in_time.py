"""Motion in time, from its density: inter-well transitions, first passages of a level, and the voltage's spectrum."""

import math
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.density.first_passages import displacement_rate
from harvester.density.forces import heat, noise
from harvester.density.functionals import NAMES
from harvester.density.marginals import Marginals
from harvester.density.refine import Answer
from harvester.density.relaxation import slowest_decay, voltage_spectrum
from harvester.equations.problem import Problem
from harvester.errors import InputError, SimulationError, invalid
from harvester.quantities.kinds import GAP, VOLTAGE_FROM_0
from harvester.uncertainty.value import Value

MOST_DECAY_RATIO = 0.3  # the slowest decay over that of the energy, above which two wells are one


def read_level(level: float | str, problem: Problem) -> float:
    """The nondimensional level of a displacement.

    Raises InputError for an invalid one, or beyond both stops.
    """
    if isinstance(level, str) and not problem.physical:
        try:
            level = float(level)
        except ValueError:
            raise invalid("`level`", "be a number for a nondimensional scene", level) from None
    try:
        nondimensional = GAP.read(level) / problem.units.length
    except ValueError as error:
        raise InputError(f"`level` {error}") from None
    low, high = (
        problem.equations.stops if problem.equations.pressure else problem.equations.rigid_stops
    )
    if not (max(0.0, low) < nondimensional < math.inf) or (
        nondimensional >= high and -nondimensional <= low
    ):
        raise invalid(
            "`level`", "be a displacement above 0 that the mass can pass, between its stops", level
        )
    return float(nondimensional)


def read_voltage(level: float | str, problem: Problem) -> float | None:
    """The level of a voltage, in V.

    None for anything but a text with its unit, of a physical scene.
    """
    if not isinstance(level, str) or not problem.physical or GAP.reads(level):
        return None
    return VOLTAGE_FROM_0.read(level) if VOLTAGE_FROM_0.reads(level) else None


def forgetting(problem: Problem, answer: Answer) -> float:
    """The rate at which the motion forgets its energy: noise power over energy."""
    squares = (
        answer.means[NAMES.index("displacement_squared")],
        answer.means[NAMES.index("velocity_squared")],
    )
    eqs = problem.equations
    power = heat(eqs) if eqs.coloured else float(noise(eqs, np.array(math.sqrt(squares[0]))))
    return float(min(power / squares[1], 1.0 / (eqs.correlation_time or 1e-9)))


def hop_rate(problem: Problem, answer: Answer) -> Value | None:
    """Transitions per second between two wells; None if they are too frequent to be independent."""
    eqs = problem.equations
    wells = eqs.resting_places
    if len(wells) != 2:
        return None
    roots = np.roots([eqs.spring[2], eqs.spring[1], eqs.spring[0], 0.0]).real
    top = next((float(x) for x in roots if wells[0] < x < wells[1]), 0.5 * (wells[0] + wells[1]))
    try:
        decays = [slowest_decay(solution)[0] for solution in (answer.solution, answer.coarser)]
    except SimulationError:
        return None
    # a slow load would be the slowest
    ratio = decays[0] / min(forgetting(problem, answer), eqs.mu or math.inf)
    if ratio > MOST_DECAY_RATIO:
        return None
    share = Marginals(answer.solution.form, answer.solution.p).share_below(top)
    rate = 2.0 * share * (1.0 - share) * decays[0]
    known = Value(rate, bias=rate * abs(decays[1] / decays[0] - 1.0), model=rate * ratio)
    return known.scaled(problem.units.frequency)


def passage_time(problem: Problem, answer: Answer, level: float) -> Value:
    """The mean time until |displacement| first passes a level, with the error of mesh, modes and of forgetting."""
    modes = answer.solution.form.modes
    fewer = modes - 2 if modes > 3 else modes
    rate, coarse = (
        displacement_rate(problem.equations, answer.setting, level, resolution, count)
        for resolution, count in ((1, modes), (0, fewer))
    )
    if not (rate > 0.0 and coarse > 0.0):
        raise SimulationError(
            f"`level` is passed too rarely to be resolved: give less than {level * problem.units.length:.3g}"
        )
    known = Value(
        1.0 / rate, bias=abs(1.0 / rate - 1.0 / coarse), model=1.0 / forgetting(problem, answer)
    )
    return known.scaled(1.0 / problem.units.frequency)


def spectrum_of(problem: Problem, answer: Answer, w: Floats) -> dict[str, Any]:
    """Frequencies, the one-sided voltage density, and its relative error: one frequency on the finer mesh.

    In Hz and V^2/Hz, or over the angular frequency of a nondimensional scene.
    """
    u = problem.units
    (fine,), *rest = (
        voltage_spectrum(answer.solution, [1.0]),
        *voltage_spectrum(answer.coarser, [1.0, *w]),
    )
    per_hertz = 2.0 * u.volts**2 / u.frequency if problem.physical else 1.0 / math.pi
    hertz = u.frequency / (2.0 * math.pi) if problem.physical else 1.0
    error = abs(float(rest[0] / fine) - 1.0)
    return {
        "frequency": w * hertz,
        "spectrum": np.array(rest[1:]) * per_hertz,
        "spectrum_error": error,
    }
