"""The reports of studies that say in words what they found: `response`, `motion`, `charge`, `stability`.

Their lines, notes and warnings are those of the terminal; beside them stand the figure and a table.
"""

import dataclasses
import re
from collections.abc import Sequence

from harvester import figures
from harvester.equations.problem import Problem
from harvester.report.numbers import NONE, signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.result import of_result
from harvester.report.scenes import scene_page
from harvester.scene.scene import Scene
from harvester.studies.charging.answer import ChargingResult
from harvester.studies.frequency_response.responses import FrequencyResponses
from harvester.studies.motion import Motion
from harvester.studies.output_folder import provenance
from harvester.studies.stability.exponent import Stability
from harvester.studies.stability.region import Edge

MOST_ROWS = 400  # of a table on a page


def of_response(scene: Scene | Problem, answer: FrequencyResponses, seed: int) -> Page:
    """The page of frequency responses: peaks and bandwidths, hysteresis, and all points with their errors."""
    caption = "Mean power, RMS voltage, RMS displacement and phase against the drive frequency."
    points = dataclasses.replace(answer.table, title="Points")
    return of_result(scene, "response", answer, answer.plot(None), caption, (points,), seed=seed)


def of_motion(scene: Scene | Problem, answer: Motion, seed: int) -> Page:
    """The page of one path: its figure, and between which ends each of its quantities goes."""
    caption = "The end of one path over time, its phase plane, and how often each value is taken."
    kind = f"motion, engine {answer.engine}"
    return of_result(scene, kind, answer, answer.plot(None), caption, (answer.ranges,), seed=seed)


def of_charge(scene: Scene | Problem, answer: ChargingResult, seed: int) -> Page:
    """The page of a storage capacitor that charges: the time to the target, and time and power to each level."""
    caption = "The voltage from empty, the share of runs that have been at the target, and the power into the store."
    kind = f"charge, engine {answer.engine}"
    return of_result(scene, kind, answer, answer.plot(None), caption, (answer.ladder,), seed=seed)


def of_stability(scene: Scene | Problem, answer: Stability, seed: int, region: Sequence[Edge] = ()) -> Page:
    """The page of the stability of rest: the exponents, and where it was computed its region in the plane (mu, D22)."""
    rows = [
        [f"{edge.mu:.3g}", *(f"{one:.4g}" for one in (edge.published, edge.averaged, edge.ensemble)), _half(edge)]
        for edge in region
    ]
    heads = ["μ", "published", "averaged", "Monte Carlo", "its 95 %, sampling"]
    note = "Parametric noise ε2² D22 at which rest turns unstable; inf: no noise makes it so. -: no error is known."
    tables = [TextTable("The edge of stability", heads, [list(map(signs, row)) for row in rows], range(5), note)]
    figure = figures.region([edge.mu for edge in region], list(region), None) if region else None
    caption = "Where rest is stable, in the plane of the time-constant ratio μ and the parametric noise."
    return printed_page(scene, "stability", str(answer), figure, caption, tables if region else [], seed)


def _half(edge: Edge) -> str:
    """The 95 % half-width of the edge by Monte Carlo; a dash where none was found."""
    return f"{1.96 * edge.ensemble_stderr:.2g}" if edge.ensemble_stderr < float("inf") else NONE


def printed_page(
    scene: Scene | Problem,
    kind: str,
    text: str,
    figure: "figures.Plot | None",
    caption: str,
    tables: Sequence[TextTable],
    seed: int,
) -> Page:
    """The page of what a study printed: its lines lead, its notes and warnings stand in their places."""
    problem = Problem.of(scene)
    lines = [signs(re.sub(r"(?<=\S)\s{2,}", ": ", line.strip(), count=1)) for line in text.splitlines()]
    told = [line for line in lines if not line.startswith(("note: ", "warning: "))]
    notes = [line.removeprefix("note: ") for line in lines if line.startswith("note: ")]
    doubts = [line.removeprefix("warning: ") for line in lines if line.startswith("warning: ")]
    drawings = [] if figure is None else [drawing(figure, f"{caption} {'. '.join(told)}.", caption)]
    texts = [f"{note[0].upper()}{note[1:]}." for note in notes]
    found = Section("What was found", texts=texts, drawings=drawings, tables=tables, warnings=doubts)
    return scene_page(problem, kind, told, found, provenance(problem), seed=seed)
