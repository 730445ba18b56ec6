"""The reports of `response`, `motion`, `charge` and `stability`: the sheet of the result, its figure and a table."""

import dataclasses

from harvester.equations.problem import Problem
from harvester.report.numbers import amount, with_errors
from harvester.report.page import Page
from harvester.report.result import of_result
from harvester.scene.scene import Scene
from harvester.studies.charging.answer import ChargingResult
from harvester.studies.frequency_response.responses import FrequencyResponses
from harvester.studies.motion import Motion
from harvester.studies.stability.exponent import Stability

MOST = 6  # peaks that lead a page


def of_response(scene: Scene | Problem, answer: FrequencyResponses, seed: int) -> Page:
    """The page of frequency responses: peaks and bandwidths, hysteresis, and all points with their errors."""
    caption = "Mean power, RMS voltage, RMS displacement and phase against the drive frequency."
    points = dataclasses.replace(answer.table, title="Points")
    answers = []
    for curve in answer.curves:
        for direction in curve.directions:
            peak, of = curve.peak(direction), curve.unit_names
            most = with_errors(peak.mean_power, of.power)
            where = f"at {amount(peak.frequency, of.frequency)}, {direction}"
            answers.append(f"{curve.engine}: largest mean power {most} {where}")
    return of_result(scene, "response", answer, answer.plot(None), caption, (points,), answers[:MOST], seed=seed)


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


def of_stability(scene: Scene | Problem, answer: Stability, seed: int) -> Page:
    """The page of the stability of rest: the exponents, and where it was computed its region in the plane (mu, D22)."""
    caption = "Where rest is stable, in the plane of the time-constant ratio μ and the parametric noise ε2² D22."
    figure, tables = (answer.plot(None), (answer.table,)) if answer.region else (None, ())
    return of_result(scene, "stability", answer, figure, caption, tables, seed=seed)
