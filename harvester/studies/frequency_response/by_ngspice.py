"""A response by ngspice or a compiled circuit: each frequency's periodic response, sought from that of the one before.

If the mass alone is linear, there is one response from any start, and the one at the frequency
before is near it. If it is not, there may be several: these are followed up the frequencies and
down again, as a slow sweep would.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from harvester.answers.estimate import DISPLACEMENT, PHASES
from harvester.engines import Compiled, Spice
from harvester.engines.protocol import served
from harvester.equations.bounds import linear_growth
from harvester.errors import HarvesterError, MissingProgramError
from harvester.presentation.diagnostic import Diagnostic, without_repeats
from harvester.studies.frequency_response.curve import Failure
from harvester.studies.frequency_response.driven import HarmonicDrive
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.frequency_response.steps import State, Step, Steps, as_written
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.mechanics.period_map import ResponseStart

FROM_REST = "from rest"


def directions(driven: HarmonicDrive) -> tuple[str, ...]:
    """The ways over the frequencies of ngspice: one, or up and down for a mass that is not linear."""
    return ("up", "down") if linear_growth(driven.problem.equations) is None else (FROM_REST,)


def by_ngspice(
    engine: Spice | Compiled, driven: HarmonicDrive, frequencies: Sequence[float], steps: Steps
) -> tuple[list[ResponsePoint], list[Failure], list[Diagnostic]]:
    """The points, the frequencies without one, and the warnings.

    Raises CannotServeError for an effect that the engine lacks, MissingProgramError without
    ngspice, and the last error if no frequency has a point.
    """
    served(type(engine), driven.problem)
    points = list[ResponsePoint]()
    failures = list[Failure]()
    warnings = list[Diagnostic]()
    last: HarvesterError | None = None
    for turn, direction in enumerate(directions(driven)):
        near: ResponseStart | None = None
        for index, frequency in enumerate(
            frequencies if direction != "down" else frequencies[::-1]
        ):
            number = turn * len(frequencies) + index
            if (step := steps.earlier(number)) is not None:
                with as_written():
                    near = None if step.state is None else _start(step.state)
            else:
                try:
                    step, near = _step(engine, driven, direction, frequency, near)
                except MissingProgramError:
                    raise
                except HarvesterError as error:
                    last = error
                    near = None
                    failures.append(Failure(frequency, " ".join(str(error).split())))
                steps.add(number, step)
            if step is not None:
                points.append(step.point)
                warnings.extend(step.warnings)
    if not points and last is not None:
        raise last
    return points, failures, without_repeats(warnings)


def _step(
    engine: Spice | Compiled, driven: HarmonicDrive, direction: str, frequency: float, near: Any
) -> "tuple[Step, ResponseStart | None]":
    """The response at one frequency from its neighbour's state, and the state from which the next one begins."""
    estimate, near = engine.run_from(driven.at(frequency), near, judged=False)
    rms = estimate.details.get(DISPLACEMENT)
    bias = estimate.details.get(f"{DISPLACEMENT}_bias")
    displacement = None if rms is None else Value(rms, bias=bias)
    of_displacement, of_voltage = (estimate.details.get(name) for name in PHASES)
    point = ResponsePoint(
        direction,
        frequency,
        estimate.mean_square_voltage,
        estimate.mean_power,
        spread=None,
        displacement_rms=displacement,
        displacement_phase=of_displacement,
        voltage_phase=of_voltage,
    )
    return Step(point, estimate.warnings, None if near is None else near.to_json()), near


def _start(state: State) -> "ResponseStart":
    """The start of the way to the next response, from the numbers of a file.

    Raises ValueError, TypeError or KeyError for another content.
    """
    from harvester.circuits.circuit_period import CircuitStart
    from harvester.cosimulation.periodic_responses import Neighbour

    kind = CircuitStart if "circuit" in state else Neighbour
    return kind.from_json(state)
