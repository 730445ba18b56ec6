"""A response by ngspice: at each frequency the periodic one, which that at the frequency before leads to.

Where the mass alone is linear, there is one response, from rest or from anywhere, and its neighbour is the shorter way.
Where it is not, there may be several: these are followed up the frequencies and down again, as a slow sweep would.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from harvester.answers.details import DISPLACEMENT, PHASES
from harvester.engines import Spice
from harvester.engines.protocol import served
from harvester.equations.bounds import linear_growth
from harvester.errors import HarvesterError, MissingProgramError
from harvester.studies.frequency_response.driven import Driven
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.engines.spice.steady import Steady

FROM_REST = "from rest"
Failure = tuple[float, str]  # a frequency and why there is no point


def directions(driven: Driven) -> tuple[str, ...]:
    """The ways over the frequencies that ngspice goes: one, or up and down for a mass that is not linear."""
    return ("up", "down") if linear_growth(driven.problem.equations) is None else (FROM_REST,)


def by_ngspice(
    engine: Spice, driven: Driven, frequencies: Sequence[float], tick: Callable[[], None]
) -> tuple[list[ResponsePoint], list[Failure], list[str]]:
    """The points, the frequencies without one, and the warnings; ``tick`` is called after each.

    Raises CannotServeError for what the engine does not know, MissingProgramError without ngspice, and the last error
    where no frequency has a point.
    """
    served(Spice, driven.problem)
    points, failures, warnings = list[ResponsePoint](), list[Failure](), list[str]()
    last: HarvesterError | None = None
    for direction in directions(driven):
        near: Steady | None = None
        for frequency in frequencies if direction != "down" else frequencies[::-1]:
            try:
                found, near = engine.follow(driven.at(frequency), near)
            except MissingProgramError:
                raise
            except HarvesterError as error:
                last, near = error, None
                failures.append((frequency, " ".join(str(error).split())))
            else:
                warnings.extend(found.warnings)
                moved, known = found.details.get(DISPLACEMENT), found.details.get(f"{DISPLACEMENT}_bias")
                displacement = None if moved is None else Value(moved, bias=known)
                phases = (found.details.get(name) for name in PHASES)
                means = found.mean_square_voltage, found.mean_power
                points.append(ResponsePoint(direction, frequency, *means, None, displacement, *phases))
            tick()
    if not points and last is not None:
        raise last
    return points, failures, list(dict.fromkeys(warnings))
