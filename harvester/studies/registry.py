"""Every study, once: its name, its function, its result, and the options of its command.

Commands, reports, documentation and tests walk this list.  A study that has no file of its own in
harvester/commands/ gets its command from its entry here: scene, options, --json, and --report with
the page that any result has.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True)
class Option:
    """An option of a study's command: a keyword of its function, the type of its value, its default and its help."""

    name: str
    type: type
    default: Any
    help: str


@dataclass(frozen=True)
class Study:
    """A study: ``function`` and ``result`` are FILE:NAME below harvester.studies.

    The function has the scene first and all else by keyword, and gives the result, a
    `harvester.presentation.result.Result`.  ``summary`` and ``options`` are those of its command, and ``example`` is
    the rest of the command's example, and ``shorter`` the option that shortens it; without a
    summary the command has a file of its own.
    """

    name: str
    function: str
    result: str
    summary: str = ""
    options: tuple[Option, ...] = ()
    example: str = ""
    shorter: str = ""

    def run(self) -> Callable[..., Any]:
        """The function."""
        return _loaded(self.function)  # type: ignore[no-any-return]


def _loaded(path: str) -> Any:
    module, _, name = path.partition(":")
    return getattr(import_module(f"harvester.studies.{module}"), name)


STUDIES = (
    Study("sweep", "sweep.sweep:sweep", "sweep.sweep_table:SweepTable"),
    Study("compare", "compare:compare", "compare:Comparison"),
    Study("optimise", "optimum.optimise:optimise", "optimum.optimum_result:Optimum"),
    Study(
        "tolerance", "tolerance.tolerance:tolerance", "tolerance.tolerance_result:ToleranceResult"
    ),
    Study("charge", "charging.charge:charge", "charging.answer:ChargingResult"),
    Study("design", "design.decision:design", "design.design_result:DesignResult"),
    Study("motion", "motion:motion", "motion:Motion"),
    Study(
        "response",
        "frequency_response.response:responses",
        "frequency_response.responses:FrequencyResponses",
    ),
    Study("stability", "stability.exponent:stability", "stability.exponent:Stability"),
    Study("cost", "work_precision.cost:cost", "work_precision.cost_table:Cost"),
    Study(
        "extremes",
        "extremes.extremes:extremes",
        "extremes.extremes:Extremes",
        "Largest displacement, voltage and impact speed of SCENE over a lifetime.",
        (
            Option(
                "lifetime",
                str,
                "1 year",
                "Lifetime, such as '5 years' (nondimensional scene: a number of 1/w0).",
            ),
            Option("seed", int, 0, "Random seed (same seed, same noise)."),
        ),
        "--lifetime '5 years'",
    ),
    Study(
        name="densities",
        function="stationary_densities:densities",
        result="stationary_densities:Densities",
        summary="Stationary densities of displacement, velocity, voltage and impacts; transition rate; first passages.",
        options=(
            Option(
                "level",
                str,
                None,
                "A displacement or voltage, such as '2 mm', for its mean first-passage time.",
            ),
            Option("spectrum", int, 0, "Number of frequencies of the voltage spectrum."),
            Option("within", str, None, "Target relative power error.  Default: 0.01 %."),
            Option("seed", int, 0, "Random seed of the sampled path plotted for comparison."),
        ),
        example="--level '2 mm' --report densities.html",
        shorter="a larger --within",
    ),
    Study(
        "node",
        "node:node",
        "node:NodeResult",
        "Simulate a sensor node on SCENE: duty cycle, packets per hour, limiting factor (harvester keys node).",
        (
            Option("days", float, 1.0, "Simulated time in days."),
            Option(
                "stop",
                str,
                None,
                "Outage of the excitation after these days, such as 2h: does the storage outlast it, or which would.",
            ),
            Option(
                "budget",
                str,
                None,
                "Time limit, such as 30s: as many runs as fit into it.  Default: 20 s for further runs.",
            ),
            Option("seed", int, 0, "Random seed (same seed, same noise)."),
        ),
        "--days 7",
        shorter="--budget",
    ),
)
