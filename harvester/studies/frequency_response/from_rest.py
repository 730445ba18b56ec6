"""A response by ngspice: at each frequency the periodic one that the device at rest comes to, on its own."""

from collections.abc import Callable, Sequence

from harvester.answers.details import DISPLACEMENT, PHASES
from harvester.engines import Spice
from harvester.engines.protocol import served
from harvester.errors import HarvesterError, MissingProgramError
from harvester.studies.frequency_response.driven import Driven
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.uncertainty.value import Value

FROM_REST = "from rest"
Failure = tuple[float, str]  # a frequency and why there is no point


def from_rest(
    engine: Spice, driven: Driven, frequencies: Sequence[float], tick: Callable[[], None]
) -> tuple[list[ResponsePoint], list[Failure], list[str]]:
    """The points, the frequencies without one, and the warnings; ``tick`` is called after each.

    Raises CannotServeError for what the engine does not know, MissingProgramError without ngspice, and the last error
    where no frequency has a point.
    """
    served(Spice, driven.problem)
    points, failures, warnings = list[ResponsePoint](), list[Failure](), list[str]()
    last: HarvesterError | None = None
    for frequency in frequencies:
        try:
            found = engine.run(driven.at(frequency))
        except MissingProgramError:
            raise
        except HarvesterError as error:
            last = error
            failures.append((frequency, " ".join(str(error).split())))
        else:
            warnings.extend(found.warnings)
            moved, known = found.details.get(DISPLACEMENT), found.details.get(f"{DISPLACEMENT}_bias")
            displacement = None if moved is None else Value(moved, bias=known)
            phases = (found.details.get(name) for name in PHASES)
            means = found.mean_square_voltage, found.mean_power
            points.append(ResponsePoint(FROM_REST, frequency, *means, None, displacement, *phases))
        tick()
    if not points and last is not None:
        raise last
    return points, failures, list(dict.fromkeys(warnings))
