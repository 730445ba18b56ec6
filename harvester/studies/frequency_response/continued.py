"""A response up the frequencies and down again by trajectories that continue from each frequency to the next.

They keep their motion, the phase of the excitation, and with a circuit of ideal elements the charge
that its capacitors hold, so that a response of two branches (a hardening or softening spring, a
stop) shows the hysteresis of a slow sweep at the bench.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.engines import Ensemble, Ideal
from harvester.engines.protocol import served
from harvester.engines.sampling import ALIKE, UNLIKE
from harvester.equations.problem import Problem
from harvester.linear.transfer import first_harmonic, phase_to_base
from harvester.studies.frequency_response.driven import HarmonicDrive
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.frequency_response.steps import State, Step, Steps, as_written
from harvester.uncertainty.value import Value, mean_and_error

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.own_circuit import OwnCircuit
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.ideal_circuit import IdealCircuit

QUIET, NOISY = 64, 1024  # trajectories, without and with noise beside the excitation
# periods of the excitation from which a first harmonic is taken: whole turns of subharmonics, too
WAVES = 16
Phases = tuple[float | None, float | None]


def continued(
    engine: Ensemble | Ideal, driven: HarmonicDrive, frequencies: Sequence[float], steps: Steps
) -> list[ResponsePoint]:
    """The points up and down again, by engine `ensemble` or `ideal`.

    Raises CannotServeError for an effect that the engine lacks; UnboundedResponseError and
    SimulationError as `harvester.mechanics.ensemble.burn_in.until_steady`.
    """
    model = engine.model(served(type(engine), driven.problem))
    points = list[ResponsePoint]()
    trajectories = None
    ways = [("up", f) for f in frequencies] + [("down", f) for f in frequencies[::-1]]
    for number, (direction, frequency) in enumerate(ways):
        problem = driven.at(frequency)
        if (step := steps.earlier(number)) is not None:
            with as_written():
                trajectories = _trajectories(problem, model.circuit, engine.seed, step.state)
        else:
            if trajectories is None:
                trajectories = _trajectories(problem, model.circuit, engine.seed, None)
            pair = _steady(trajectories, problem, engine)
            trajectories = pair.trajectories
            step = Step(
                _point(problem, engine, direction, frequency, pair), (), _state(trajectories)
            )
            steps.add(number, step)
        points.append(step.point)
    return points


def _state(trajectories: "Trajectories") -> State:
    """The state from which trajectories continue, as JSON knows it."""
    arrays = {name: getattr(trajectories, name).tolist() for name in ("state", "filter", "words")}
    return {"h": trajectories.h, "seed": list(trajectories.seed.spawn_key), **arrays}


def _trajectories(
    problem: Problem, circuit: "IdealCircuit | OwnCircuit | None", seed: int, state: State | None
) -> "Trajectories":
    """Trajectories at rest (None), or of a state from a file.

    ValueError and such for another content.
    """
    from harvester.mechanics.ensemble.trajectories import Trajectories

    eqs = problem.equations
    rest = np.zeros((3, NOISY if eqs.is_random else QUIET))
    rest[0] = eqs.resting_places[0]
    if state is None:
        return Trajectories(eqs, rest.shape[1], np.random.SeedSequence(seed), None, rest, circuit)
    now = (
        np.array(state["state"], float),
        np.array(state["filter"], float),
        np.array(state["words"], np.uint64),
    )
    sequence = np.random.SeedSequence(seed, spawn_key=tuple(map(int, state["seed"])))
    return Trajectories(eqs, rest.shape[1], sequence, float(state["h"]), rest, circuit, origin=now)


def _steady(before: "Trajectories", problem: Problem, engine: Ensemble) -> "RichardsonPair":
    """Continue from the motion at another frequency: steady means there, and next to them those of twice the step."""
    from harvester.mechanics.ensemble.burn_in import until_steady
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.kernels.step_size import STEP, shorter_step, typical_frequency

    eqs = engine.model(problem).eqs
    x, v, _ = before.snapshot()
    h: float | None = STEP / typical_frequency(eqs, float(np.mean(x * x)), float(np.mean(v * v)))
    while h is not None:
        trajectories = before.continued(eqs, h)
        moments, _ = until_steady(trajectories)
        h = shorter_step(
            trajectories.h, typical_frequency(eqs, moments.mean("x2")[0], moments.mean("v2")[0])
        )
    return RichardsonPair(trajectories, trajectories.time)


def _point(
    problem: Problem, engine: Ensemble, direction: str, frequency: float, pair: "RichardsonPair"
) -> ResponsePoint:
    """The means of one frequency, with their sampling errors and step, in the scene's units."""
    model = engine.model(problem)
    units = problem.units
    moments = pair.moments
    noisy = problem.equations.is_random
    spread = None if noisy else _spread(getattr(moments, model.name))

    def value(each: Floats, mean: float, error: float, bias: float) -> Value:
        exact = not noisy and max(_spread(each), spread or 0.0) <= ALIKE
        return Value(mean, None if exact else error, abs(bias), unknown=engine.UNKNOWN)

    v2 = value(moments.V2, *pair.mean("V2"), pair.bias("V2")[0]).scaled(units.volts**2)
    power = value(getattr(moments, model.name), *pair.mean(model.name), pair.bias(model.name)[0])
    power = power.scaled(model.factor * units.watts)
    mean_x = np.mean(moments.x) if noisy else moments.x  # of each trajectory if nothing is random
    variance = np.maximum(moments.x2 - mean_x**2, 0.0)
    displacement = (
        value(variance, *mean_and_error(variance), pair.bias("x2")[0])
        .scaled(units.length**2)
        .root()
    )
    known = spread is not None and spread <= UNLIKE
    phases = _phases(problem, pair) if known else (None, None)
    return ResponsePoint(
        direction=direction,
        frequency=frequency,
        mean_square_voltage=v2,
        mean_power=power,
        spread=spread,
        displacement_rms=displacement,
        displacement_phase=phases[0],
        voltage_phase=phases[1],
    )


def _spread(each: Floats) -> float:
    """How far the trajectories' means of a square are apart, relative to the largest."""
    return float(np.ptp(each) / each.max()) if each.max() > 0.0 else 0.0


def _phases(problem: Problem, pair: "RichardsonPair") -> Phases:
    """The phases of displacement and voltage to the base, on one trajectory that continues from the first.

    None if its displacement is not that of the trajectories: it moved to another response.
    """
    trajectories, eqs = pair.trajectories, problem.equations
    assert eqs.drive is not None and eqs.drive_frequency is not None, "Driven checks this"
    h = trajectories.h
    steps = WAVES * round((eqs.shaking_period or h) / h)
    first = math.atan2(float(trajectories.filter[0, 1, 0]), float(trajectories.filter[0, 0, 0]))
    angles = first + eqs.drive_frequency * h * np.arange(steps + 1.0)
    shaking = abs(eqs.drive) * np.cos(angles)
    path = trajectories.loaded.follow(trajectories.state[0, :, 0], np.zeros(steps), h, shaking)
    variance = float(np.mean(pair.moments.x2 - pair.moments.x**2))
    if not abs(float(np.var(path.x)) - variance) <= UNLIKE * variance:
        return None, None
    middles = angles[1:] + 0.5 * eqs.drive_frequency * h  # of the drifts after each kick
    harmonics = (first_harmonic(values, middles) for values in (path.x, path.V))
    x_phase, voltage_phase = (
        phase_to_base(harmonic, eqs, problem.physical) for harmonic in harmonics
    )
    return x_phase, voltage_phase
