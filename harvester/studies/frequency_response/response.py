"""Frequency response under a harmonic drive: voltage and power up the frequencies and down again.

At each frequency the mass goes on from its motion, and the phase of the drive, at the one before, so that a response of
two branches (a hardening or softening spring, a stop) is seen as the hysteresis that a slow sweep of the device shows.
A linear scene has one branch, in closed form, whose peak is then resolved between the frequencies of the sweep.
"""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harvester import figures
from harvester.engines import Ensemble as Engine
from harvester.engines import Exact
from harvester.engines.protocol import NOT_WHITE, AnyScene, served, unknown_effects, with_power
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, names_arguments
from harvester.scene.usual import unusual_values
from harvester.studies.frequency_response.curve import Response, ResponsePoint
from harvester.studies.frequency_response.resolved import resolved
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.sweep.points import read_axis
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories

QUIET, NOISY = 64, 1024  # trajectories, without and with noise beside the drive
# Shaking that has no frequency to sweep
UNSERVED = NOT_WHITE - {"harmonic_drive"}
LEAST, MOST = 3, 10_000  # frequencies


def frequencies(problem: Problem, text: str) -> tuple[float, ...]:
    """The ascending frequencies of a text ``FROM:TO:COUNT``, in Hz (nondimensional scene: rad).

    They are spaced by ratio where the ends differ tenfold.

    Raises InputError for anything else.
    """
    parts = text.split(":")
    if len(parts) != 3 or not re.fullmatch("[0-9]{1,5}", parts[2]) or not LEAST <= int(parts[2]) <= MOST:
        raise invalid("`sweep`", f"be FROM:TO:COUNT with a COUNT from {LEAST} to {MOST}, such as 1Hz:10Hz:60", text)
    key = "excitation.frequency" if problem.physical else "nondimensional.drive_frequency"
    found = sorted(read_axis(f"{key}={text}").values)
    if found[0] == found[-1]:
        raise invalid("`sweep`", "be between two different frequencies", text)
    return tuple(found)


@names_arguments
def response(
    scene: AnyScene, sweep: str | Sequence[float], seed: int = 0, tick: Callable[[], None] | None = None
) -> Response:
    """The response of a scene with a harmonic drive at the frequencies ``sweep``, ascending and then descending.

    ``sweep`` is in Hz (nondimensional scene: rad), or a text as of `frequencies`, such as "3Hz:9Hz:61".  With a text,
    a response in closed form has more points than that: its peak, its half-power points and some between (`resolved`).

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0))
    >>> round(hv.response(scene, "0.8:1.2:5").peak("up").frequency, 3)  # between those of the text
    1.008

    Raises
    ------
    InputError
        for a scene without a harmonic drive.
    CannotServeError
        for a load other than a resistance.
    UnboundedResponseError
        where the response grows without bound.
    """
    problem, resolving = Problem.of(scene), isinstance(sweep, str)
    if problem.netlist is not None:
        raise CannotServeError(
            f"a frequency response must have a load resistance, but the load is netlist {problem.netlist!r}: sweep "
            "excitation.frequency instead (harvester sweep, with engine 'ideal' or 'spice')"
        )
    served(Engine, problem)
    if isinstance(sweep, str):
        sweep = frequencies(problem, sweep)
    if reason := unknown_effects(problem, UNSERVED, "a frequency response", "engine 'ensemble'"):
        raise CannotServeError(reason)
    eqs = problem.equations
    key = ("excitation", "acceleration_amplitude", "frequency")
    if not problem.physical:
        key = ("nondimensional", "drive", "drive_frequency")
    if eqs.drive is None:
        raise InputError(f"{key[0]}.{key[1]} must be given for a frequency response, but is left out")
    noisy, linear, points = eqs.is_random, not Exact.refusal(problem), []
    trajectories = None

    def there_at(frequency: float) -> Problem:
        return Problem(problem.scene.vary(f"{key[0]}.{key[2]}", frequency))

    asked = set(sweep)
    if resolving and linear:
        sweep = resolved(lambda f: Exact().run(there_at(f)).mean_power.value, sweep)
    for direction, run in (("up", list(sweep)), ("down", list(sweep)[::-1])):
        for frequency in run:
            there = there_at(frequency)
            if tick is not None and frequency in asked:
                tick()
            if linear:
                one = Exact().run(there)
                powers = one.mean_square_voltage, one.mean_power
                points.append(ResponsePoint(direction, frequency, *powers, None if noisy else 0.0))
                continue
            here = there.equations
            if trajectories is None:
                from harvester.mechanics.ensemble.trajectories import Trajectories

                rest = np.zeros((3, NOISY if noisy else QUIET))
                rest[0] = here.resting_places[0]
                trajectories = Trajectories(here, rest.shape[1], np.random.SeedSequence(seed), None, rest)
            pair = _at(trajectories, here)
            trajectories = pair.trajectories
            points.append(_point(there, direction, frequency, pair, noisy))
    unusual = tuple(unusual_values(problem.scene))
    return Response(tuple(points), problem.physical, unusual, resolving and linear)


def _at(before: "Trajectories", eqs: Equations) -> "RichardsonPair":
    """Go on from the motion at another frequency: steady means there, and beside them those of twice the step."""
    from harvester.mechanics.ensemble.burn_in import until_steady
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.kernels.step_size import default_step, shorter_step

    x, v, _ = before.snapshot()
    h: float | None = default_step(eqs, float(np.mean(x * x)), float(np.mean(v * v)))
    while h is not None:
        trajectories = before.continued(eqs, h)
        moments, _ = until_steady(trajectories)
        h = shorter_step(eqs, trajectories.h, moments.mean("x2")[0], moments.mean("v2")[0])
    return RichardsonPair(trajectories, trajectories.time)


def _point(problem: Problem, direction: str, frequency: float, pair: "RichardsonPair", noisy: bool) -> ResponsePoint:
    """The means of one frequency, with their errors of sampling and step, in the scene's units."""
    from harvester.engines.ensemble import ALIKE

    (value, stderr), (bias, _), each = pair.mean("V2"), pair.bias("V2"), pair.moments.V2
    spread = None if noisy else float(np.ptp(each) / each.max()) if value > 0.0 else 0.0
    v2 = Value(value, None if spread is not None and spread <= ALIKE else stderr, abs(bias))
    power, units = with_power(v2, problem.equations), problem.units
    return ResponsePoint(direction, frequency, v2.scaled(units.volts**2), power.scaled(units.watts), spread)


def draw(
    scene: AnyScene,
    text: str,
    out: str | Path,
    seed: int = 0,
    tick: Callable[[], None] | None = None,
    vector: Sequence[str] = (),
) -> Response:
    """Compute a `response` over the frequencies of a text (`frequencies`), and write its files.

    These are response.csv, response.png, its ``vector`` forms (svg, pdf) and provenance.json.
    """
    problem = Problem.of(scene)
    sweep, folder = frequencies(problem, text), OutputFolder(out, vector)
    found = response(problem, text, seed, tick)
    about = provenance(problem, sweep=list(sweep), seed=seed)
    folder.save("response", found.text(), figures.response(found, problem.scene.title), about)
    return found
